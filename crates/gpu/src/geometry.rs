//! A scene's triangles in the order in which they are drawn.

use farfield_scene::{Material, Scene};
use glam::DVec3;
use std::ops::Range;

/// Triangles, vertices and objects in runs that one draw call takes.
#[derive(Debug, Default)]
pub(crate) struct Geometry {
    /// Vertices of the meshes that objects show, mesh by mesh.
    pub(crate) vertices: Vec<Vertex>,
    /// Three vertices of the above and the triangle's index in the scene.
    pub(crate) triangles: Vec<[u32; 4]>,
    /// A vertex, and the triangle that has it first: vertices as the vertex shader is given them.
    pub(crate) corners: Vec<[u32; 2]>,
    /// Three corners of each triangle, in the triangle's winding; the first is no other's first.
    pub(crate) indices: Vec<[u32; 3]>,
    /// Objects, those of one mesh in a row, the mirrored ones last.
    pub(crate) instances: Vec<Instance>,
    /// In the order in which they are drawn.
    pub(crate) runs: Vec<Run>,
}

/// A vertex of the scene, relative to the middle of its mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub(crate) index: u32,
    pub(crate) middle: DVec3,
}

/// An object and the middle of its mesh, in the mesh's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instance {
    pub(crate) object: u32,
    pub(crate) middle: DVec3,
}

/// All triangles of one mesh that have the same material, in the scene's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) pipeline: usize,
    pub(crate) material: u32,
    pub(crate) triangles: Range<u32>,
    pub(crate) instances: Range<u32>,
}

/// What is drawn of a scene: a list of draw calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Draws {
    pub(crate) runs: Vec<Run>,
}

impl Draws {
    /// How many draw calls these are.
    pub fn count(&self) -> usize {
        self.runs.len()
    }

    /// How many triangles they draw, those of shared meshes once per object.
    pub fn triangles(&self) -> u64 {
        let drawn = |run: &Run| run.triangles.len() as u64 * run.instances.len() as u64;
        self.runs.iter().map(drawn).sum()
    }
}

/// How many pipelines there are: see [`pipeline_of`].
pub(crate) const PIPELINES: usize = 8;

/// Which pipeline draws a material in objects that mirror it or do not: opaque ones come first, as
/// what they hide need not be looked up.
pub(crate) fn pipeline_of(material: &Material, mirrored: bool) -> usize {
    4 * usize::from(material.alpha.cutoff().is_some())
        + 2 * usize::from(material.double_sided)
        + usize::from(mirrored)
}

/// Brings the triangles that objects show into runs.
pub(crate) fn geometry(scene: &Scene) -> Geometry {
    let mut objects: Vec<u32> = (0..scene.objects.len() as u32).collect();
    let mirrored = |object: u32| scene.objects[object as usize].is_mirrored();
    objects.sort_by_key(|object| (mesh_of(scene, *object), mirrored(*object)));
    let mut sorted = Geometry::default();
    for of_mesh in objects.chunk_by(|a, b| mesh_of(scene, *a) == mesh_of(scene, *b)) {
        let mesh = scene.mesh_of(of_mesh[0]);
        let middle = middle(scene, mesh.vertices.clone());
        let first_vertex = sorted.vertices.len() as u32;
        let indices = mesh.vertices.clone();
        sorted
            .vertices
            .extend(indices.map(|index| Vertex { index, middle }));
        let first_instance = sorted.instances.len() as u32;
        sorted
            .instances
            .extend(of_mesh.iter().map(|&object| Instance { object, middle }));
        let end = sorted.instances.len() as u32;
        let turned = first_instance + of_mesh.partition_point(|object| !mirrored(*object)) as u32;

        let mut ids: Vec<u32> = mesh.triangles.clone().collect();
        let material_of = |id: u32| scene.triangle_materials[id as usize];
        ids.sort_by_key(|id| material_of(*id));
        let first_triangle = sorted.triangles.len() as u32;
        for ids in ids.chunk_by(|a, b| material_of(*a) == material_of(*b)) {
            let material = material_of(ids[0]);
            let first = sorted.triangles.len() as u32;
            sorted.triangles.extend(ids.iter().map(|&id| {
                let [a, b, c] = scene.triangles[id as usize]
                    .map(|vertex| vertex - mesh.vertices.start + first_vertex);
                [a, b, c, id]
            }));
            let triangles = first..sorted.triangles.len() as u32;
            for (instances, mirrored) in [(first_instance..turned, false), (turned..end, true)] {
                if !instances.is_empty() {
                    let pipeline = pipeline_of(&scene.materials[material as usize], mirrored);
                    sorted.runs.push(Run {
                        pipeline,
                        material,
                        triangles: triangles.clone(),
                        instances,
                    });
                }
            }
        }
        add_corners(&mut sorted, first_vertex, first_triangle);
    }
    sorted.runs.sort_by_key(|run| (run.pipeline, run.material));
    sorted
}

/// Adds corners and indices of the triangles from a first one on, whose vertices come from a first
/// one on.
///
/// A triangle's fragments get what is not interpolated from its first vertex, so it must be the
/// first of no other: of the three the first that is free, and where none is, a copy. That takes
/// hardly more vertices than there are triangles, and tells a triangle's number without a feature of
/// the adapter.
fn add_corners(sorted: &mut Geometry, first_vertex: u32, first_triangle: u32) {
    const NONE: u32 = u32::MAX;
    /// Corners that are no triangle's first.
    const FREE: u32 = u32::MAX;
    let mut corner_of = vec![NONE; sorted.vertices.len() - first_vertex as usize];
    for triangle in first_triangle..sorted.triangles.len() as u32 {
        let [a, b, c, _] = sorted.triangles[triangle as usize];
        let mut indices = [a, b, c].map(|vertex| {
            let corner = &mut corner_of[(vertex - first_vertex) as usize];
            if *corner == NONE {
                *corner = sorted.corners.len() as u32;
                sorted.corners.push([vertex, FREE]);
            }
            *corner
        });
        let is_free = |corner: &u32| sorted.corners[*corner as usize][1] == FREE;
        match indices.iter().position(is_free) {
            Some(free) => {
                indices.rotate_left(free);
                sorted.corners[indices[0] as usize][1] = triangle;
            }
            None => {
                indices[0] = sorted.corners.len() as u32;
                sorted.corners.push([a, triangle]);
            }
        }
        sorted.indices.push(indices);
    }
}

/// The parts of runs that show triangles of some ranges.
///
/// * `triangles` - of all runs; the fourth number is the index in the scene
/// * `ranges` - of indices in the scene, ascending and disjoint
pub(crate) fn restricted(runs: &[Run], triangles: &[[u32; 4]], ranges: &[Range<u32>]) -> Draws {
    let mut parts = Vec::new();
    for run in runs {
        let ids = &triangles[run.triangles.start as usize..run.triangles.end as usize];
        let (Some(first), Some(last)) = (ids.first(), ids.last()) else {
            continue;
        };
        let begin = ranges.partition_point(|range| range.end <= first[3]);
        for range in ranges[begin..]
            .iter()
            .take_while(|range| range.start <= last[3])
        {
            let [start, end] = [range.start, range.end]
                .map(|at| run.triangles.start + ids.partition_point(|t| t[3] < at) as u32);
            if start < end {
                let triangles = start..end;
                parts.push(Run {
                    triangles,
                    ..run.clone()
                });
            }
        }
    }
    Draws { runs: parts }
}

fn mesh_of(scene: &Scene, object: u32) -> u32 {
    scene.objects[object as usize].mesh
}

/// The middle of the bounds of some vertices; zero of none.
fn middle(scene: &Scene, vertices: Range<u32>) -> DVec3 {
    let points = &scene.positions[vertices.start as usize..vertices.end as usize];
    let bounds = points.iter().map(|point| (*point, *point));
    let bounds = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    bounds.map_or(DVec3::ZERO, |(min, max)| {
        (min.as_dvec3() + max.as_dvec3()) / 2.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_scene::{AlphaMode, Mesh, Object};
    use glam::{DAffine3, Vec2, Vec3, Vec4};
    use proptest::prelude::*;

    /// Two meshes of given materials, the first shown twice, of six vertices each.
    fn scene(materials: &[u32], first: u32) -> Scene {
        let count = materials.len() as u32;
        let mesh = |vertices, triangles| Mesh {
            vertices,
            triangles,
        };
        let object = |mesh| Object {
            name: String::new(),
            mesh,
            world_from_mesh: DAffine3::IDENTITY,
        };
        let material = |i: u32| Material {
            double_sided: i % 2 == 1,
            alpha: match i < 2 {
                true => AlphaMode::Blend,
                false => AlphaMode::Opaque,
            },
            ..Material::default()
        };
        Scene {
            positions: (0..12).map(|i| Vec3::splat(i as f32)).collect(),
            normals: vec![Vec3::Y; 12],
            uvs: vec![Vec2::ZERO; 12],
            colors: vec![Vec4::ONE; 12],
            triangles: (0..count)
                .map(|i| [0, i % 3, 5].map(|v| v + if i < first { 0 } else { 6 }))
                .collect(),
            triangle_materials: materials.to_vec(),
            meshes: vec![mesh(0..6, 0..first), mesh(6..12, first..count)],
            objects: vec![object(0), object(1), object(0)],
            materials: (0..4).map(material).collect(),
            ..Scene::default()
        }
    }

    /// Triangle and object of all that draws show, sorted.
    fn drawn(geometry: &Geometry, draws: &Draws) -> Vec<(u32, u32)> {
        let mut drawn = Vec::new();
        for run in &draws.runs {
            for instance in run.instances.clone() {
                let object = geometry.instances[instance as usize].object;
                let triangles = run.triangles.clone();
                drawn.extend(triangles.map(|t| (geometry.triangles[t as usize][3], object)));
            }
        }
        drawn.sort_unstable();
        drawn
    }

    proptest! {
        /// All that ranges contain is drawn once in every object that shows it, with its material
        /// and its vertices; nothing else is; and all together take no more draws than there are
        /// pairs of mesh and material.
        #[test]
        fn draws_show_each_triangle_once(
            materials in prop::collection::vec(0..4u32, 0..20),
            first in 0..20u32,
            cuts in prop::collection::btree_set(0..22u32, 0..6),
        ) {
            let first = first.min(materials.len() as u32);
            let scene = scene(&materials, first);
            prop_assert_eq!(scene.check(), Ok(()));
            let sorted = geometry(&scene);
            let all = Draws { runs: sorted.runs.clone() };
            let objects = |t: u32| if t < first { vec![0, 2] } else { vec![1] };
            let expected = |shown: &dyn Fn(u32) -> bool| -> Vec<(u32, u32)> {
                let shown = (0..materials.len() as u32).filter(|t| shown(*t));
                shown.flat_map(|t| objects(t).into_iter().map(move |o| (t, o))).collect()
            };
            prop_assert_eq!(drawn(&sorted, &all), expected(&|_| true));
            prop_assert_eq!(all.triangles(), scene.drawn_triangles());
            prop_assert!(all.count() <= 8 && all.runs.is_sorted_by_key(|run| run.pipeline));
            for run in &all.runs {
                for t in run.triangles.clone() {
                    let [a, b, c, id] = sorted.triangles[t as usize];
                    let vertices = [a, b, c].map(|v| sorted.vertices[v as usize].index);
                    let corners = sorted.indices[t as usize].map(|i| sorted.corners[i as usize]);
                    prop_assert_eq!(corners[0][1], t);
                    let mut around = corners.map(|corner| corner[0]);
                    let first = around.iter().position(|vertex| *vertex == a).unwrap();
                    around.rotate_left(first);
                    prop_assert_eq!(around, [a, b, c]);
                    prop_assert_eq!(vertices, scene.triangles[id as usize]);
                    prop_assert_eq!(run.material, materials[id as usize]);
                }
            }
            let cuts: Vec<u32> = cuts.into_iter().collect();
            let ranges: Vec<_> = cuts.chunks_exact(2).map(|pair| pair[0]..pair[1]).collect();
            let some = restricted(&sorted.runs, &sorted.triangles, &ranges);
            let shown = |t: u32| ranges.iter().any(|range| range.contains(&t));
            prop_assert_eq!(drawn(&sorted, &some), expected(&shown));
        }
    }
}
