//! Triangles in meshoptimizer's groups.

use crate::numbered::Numbered;
use glam::Vec3;
use meshopt::VertexDataAdapter;
use std::collections::BTreeMap;

/// Groups of primitives.
pub(crate) struct Meshlets {
    pub(crate) primitives: Vec<Vec<u32>>,
    /// Apex, relative to the model's centre, axis and cutoff.
    pub(crate) cones: Vec<(Vec3, Vec3, f32)>,
}

impl Meshlets {
    /// * `build` - from three vertices of each triangle, and their places
    pub(crate) fn new(
        model: &Numbered,
        build: impl FnOnce(&[u32], &VertexDataAdapter<'_>) -> meshopt::Meshlets,
    ) -> Self {
        let vertices = model
            .welded
            .iter()
            .flatten()
            .max()
            .map_or(0, |last| last + 1);
        let mut places = vec![[0.0f32; 3]; vertices as usize];
        for (corners, welded) in model.scene.triangles_in_world().zip(&model.welded) {
            for (corner, &vertex) in corners.iter().zip(welded) {
                places[vertex as usize] = (*corner - model.center).as_vec3().to_array();
            }
        }
        // Meshoptimizer turns triangles, and does not tell which is which.
        let sorted = |mut corners: [u32; 3]| {
            corners.sort_unstable();
            corners
        };
        let mut ids: BTreeMap<[u32; 3], Vec<u32>> = BTreeMap::new();
        for (id, corners) in (0..).zip(&model.welded) {
            ids.entry(sorted(*corners)).or_default().push(id);
        }
        let bytes = meshopt::typed_to_bytes(&places);
        let adapter = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0);
        let adapter = adapter.expect("places are whole");
        let meshlets = build(model.welded.as_flattened(), &adapter);
        let (mut primitives, mut cones) = (Vec::new(), Vec::new());
        for meshlet in meshlets.iter() {
            let (triangles, _) = meshlet.triangles.as_chunks::<3>();
            let members = triangles.iter().map(|corners| {
                let corners = corners.map(|corner| meshlet.vertices[usize::from(corner)]);
                let same = ids
                    .get_mut(&sorted(corners))
                    .expect("corners are a primitive's");
                same.pop().expect("as many as there are in the model")
            });
            primitives.push(members.collect());
            let bounds = meshopt::compute_meshlet_bounds(meshlet, &adapter);
            cones.push((
                Vec3::from(bounds.cone_apex),
                Vec3::from(bounds.cone_axis),
                bounds.cone_cutoff,
            ));
        }
        Self { primitives, cones }
    }
}
