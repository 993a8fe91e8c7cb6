//! What of a scene cameras see.

use super::grouped::Grouped;
use crate::drawn;
use farfield_bitfields::{Bitfield, with_neighbors};
use farfield_sampling::{NONE, Textures};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::DVec3;
use std::ops::Range;

/// Looks at a scene of one object.
pub(crate) struct Sampler<'a> {
    /// What hides what is behind it.
    solid: Scene,
    textures: &'a Textures<'a>,
    pub(super) triangles: u32,
    /// What is seen from everywhere.
    always: Vec<Range<u32>>,
}

impl<'a> Sampler<'a> {
    pub(crate) fn new(scene: &Scene, textures: &'a Textures<'a>) -> Self {
        Self {
            solid: drawn::solid(scene),
            textures,
            triangles: scene.triangles.len() as u32,
            always: drawn::blended(scene),
        }
    }

    /// What hides what is behind it.
    pub(super) fn solid(&self) -> &Scene {
        &self.solid
    }

    /// A point of the world in the object's space.
    pub(super) fn in_object(&self, point: DVec3) -> DVec3 {
        let world_from_mesh = self.solid.objects[0].world_from_mesh;
        world_from_mesh.inverse().transform_point3(point)
    }

    /// The triangles that cameras see.
    pub(super) fn seen(&self, cameras: &[Camera]) -> Bitfield {
        let mut set = Bitfield::empty(self.triangles);
        for camera in cameras {
            drawn::ids(&self.solid, self.textures, camera, |ids| {
                set.union_with(&Bitfield::from_ids(self.triangles, ids));
            });
        }
        set
    }

    /// A set that is seen from a point of the world, and those that share a vertex with one of it and face
    /// the point: at grazing angles and between pixels these are seen next.
    ///
    /// * `welded` - the scene's triangles, which share vertices wherever they touch
    pub(super) fn with_neighbors(
        &self,
        seen: &Bitfield,
        welded: &[[u32; 3]],
        eye: DVec3,
    ) -> Bitfield {
        let eye = self.in_object(eye);
        with_neighbors(seen, welded, |id| self.faces(id, eye))
    }

    /// A set, and all that is seen from everywhere.
    pub(super) fn with_blended(&self, mut set: Bitfield) -> Bitfield {
        set.union_with(&Bitfield::from_ranges(self.triangles, &self.always));
        set
    }

    /// Whether a triangle can be seen from a point of the object's space, if nothing is before it.
    pub(super) fn faces(&self, triangle: u32, point: DVec3) -> bool {
        let scene = &self.solid;
        let material = scene.triangle_materials[triangle as usize];
        let [a, b, c] = scene.triangles[triangle as usize]
            .map(|vertex| scene.positions[vertex as usize].as_dvec3());
        scene.materials[material as usize].double_sided || (b - a).cross(c - a).dot(point - a) > 0.0
    }

    /// The triangles that cameras see, each with its number of pixels, ascending.
    pub(crate) fn counted(&self, cameras: &[Camera]) -> Vec<[u32; 2]> {
        let mut all = Vec::new();
        (cameras.iter()).for_each(|camera| self.look(camera, |id| all.push(id)));
        all.sort_unstable();
        let runs = all.chunk_by(|a, b| a == b);
        runs.map(|run| [run[0], run.len() as u32]).collect()
    }

    /// The patches that a camera sees, each with its number of pixels, ascending.
    pub(super) fn patches(&self, grouped: &Grouped, camera: &Camera) -> Vec<[u32; 2]> {
        let mut counts = vec![0; grouped.patches.count() as usize];
        self.look(camera, |id| {
            counts[grouped.patch_of[id as usize] as usize] += 1;
        });
        let counts = (0..).zip(counts).filter(|(_, pixels)| *pixels > 0);
        counts.map(|(patch, pixels)| [patch, pixels]).collect()
    }

    /// How many pixels of a picture show what is not drawn.
    pub(super) fn missed(&self, grouped: &Grouped, drawn: &[Range<u32>], camera: &Camera) -> u64 {
        let mut missed = 0;
        self.look(camera, |id| {
            missed += u64::from(!is_in(drawn, grouped.places[id as usize]));
        });
        missed
    }

    /// Names the triangle at each pixel that shows one.
    fn look(&self, camera: &Camera, mut name: impl FnMut(u32)) {
        drawn::ids(&self.solid, self.textures, camera, |ids| {
            ids.iter()
                .copied()
                .filter(|id| *id != NONE)
                .for_each(&mut name);
        });
    }
}

/// Whether one of some ascending ranges holds a place.
pub(crate) fn is_in(ranges: &[Range<u32>], place: u32) -> bool {
    let at = ranges.partition_point(|range| range.end <= place);
    ranges.get(at).is_some_and(|range| range.contains(&place))
}

/// The value that a share of ascending values do not exceed.
pub(crate) fn percentile(ascending: &[u64], share: f64) -> u64 {
    let at = (ascending.len() as f64 * share).ceil() as usize;
    ascending.get(at.max(1) - 1).copied().unwrap_or(0)
}
