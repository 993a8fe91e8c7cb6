//! What finds holes of meshes, and what closes them.

use crate::{Mesh, VoxelLayers};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// The squares of some voxels, in the middle of their layers, and their corners; those of neighbours in a
/// layer share them. Together they close whatever the voxels do, as textured quads would.
///
/// * `chosen` - numbers of voxels
pub fn squares(voxels: &VoxelLayers<'_>, chosen: &BTreeSet<u32>) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (l, layer) in voxels.layers.iter().enumerate() {
        let end = first + layer.len() as u32;
        let mut corners = BTreeMap::new();
        for voxel in chosen.range(first..end) {
            let [x, y] = layer[(voxel - first) as usize].map(u32::from);
            let [a, b, c, d] = [[x, y], [x, y + 1], [x + 1, y + 1], [x + 1, y]].map(|[x, y]| {
                *corners.entry([x, y]).or_insert_with(|| {
                    positions.push(Vec3::new(x as f32, y as f32, voxels.middle(l)));
                    positions.len() as u32 - 1
                })
            });
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        first = end;
    }
    (positions, triangles)
}

/// The mesh with its borders moved inwards, each vertex on them by at most `margin` voxels: through it one
/// looks where the mesh is closed only just, and holes are as much wider.
///
/// # Panics
///
/// When a triangle refers to a vertex that is not there, or to one twice.
pub fn shrunk(mesh: &Mesh, margin: f32) -> Mesh {
    let mut edges: Vec<([u32; 2], u32)> = Vec::new();
    for (i, t) in (0..).zip(&mesh.triangles) {
        for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
            edges.push(([a.min(b), a.max(b)], i));
        }
    }
    edges.sort_unstable();
    let mut inwards = vec![Vec3::ZERO; mesh.positions.len()];
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        let &[([a, b], triangle)] = edge else {
            continue;
        };
        let corners = mesh.triangles[triangle as usize];
        let opposite = corners.into_iter().find(|v| *v != a && *v != b);
        let opposite = opposite.expect("a triangle has three corners");
        let [p, q, r] = [a, b, opposite].map(|v| mesh.positions[v as usize]);
        let across = (r - p).reject_from((q - p).normalize_or(Vec3::X));
        let across = across.clamp_length_max(1.0);
        inwards[a as usize] += across;
        inwards[b as usize] += across;
    }
    let mut shrunk = mesh.clone();
    for (position, inwards) in shrunk.positions.iter_mut().zip(inwards) {
        *position += inwards.clamp_length_max(1.0) * margin;
    }
    shrunk
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::blobs;
    use crate::{initial_mesh, simplify};
    use proptest::prelude::*;

    proptest! {
        /// Each voxel that is chosen has its whole square, in the middle of its layer, and no other has;
        /// neighbours share corners.
        #[test]
        fn squares_are_those_of_the_chosen(
            blob in blobs(), chosen in prop::collection::btree_set(0..60u32, 0..20),
        ) {
            let layers = blob.layers();
            let boxes = layers.boxes(1.0);
            let (corners, triangles) = squares(&layers, &chosen);
            let there: Vec<u32> = chosen.into_iter().filter(|v| (*v as usize) < boxes.len()).collect();
            prop_assert_eq!(triangles.len(), 2 * there.len());
            for (voxel, both) in there.iter().zip(triangles.chunks(2)) {
                let place = &boxes[*voxel as usize];
                let at = |v: u32| corners[v as usize] - place.center;
                let area: f32 = both.iter().map(|t| {
                    let [a, b, c] = t.map(at);
                    (b - a).cross(c - a).length() / 2.0
                }).sum();
                prop_assert_eq!(area, 1.0);
                for corner in both.iter().flatten() {
                    prop_assert_eq!(at(*corner).abs(), Vec3::new(0.5, 0.5, 0.0));
                }
            }
            let mut distinct: Vec<[u32; 3]> = corners.iter().map(|c| c.to_array().map(f32::to_bits)).collect();
            distinct.sort_unstable();
            distinct.dedup();
            prop_assert_eq!(distinct.len(), corners.len());
        }

        /// Vertices within stay where they are, and none moves by more than the margin.
        #[test]
        fn only_borders_move(blob in blobs(), margin in 0.1..0.5f32) {
            let layers = blob.layers();
            let mesh = simplify(&initial_mesh(&layers, &blob.points(), 1.5), &layers, 1.5).mesh;
            let found = shrunk(&mesh, margin);
            prop_assert_eq!(&found.triangles, &mesh.triangles);
            let mut sides: BTreeMap<[u32; 2], u32> = BTreeMap::new();
            for [a, b, c] in &mesh.triangles {
                for [p, q] in [[a, b], [b, c], [c, a]] {
                    *sides.entry([*p.min(q), *p.max(q)]).or_default() += 1;
                }
            }
            let borders = sides.iter().filter(|(_, count)| **count == 1);
            let on_border: BTreeSet<u32> = borders.flat_map(|(ends, _)| *ends).collect();
            for (v, (from, to)) in (0..).zip(mesh.positions.iter().zip(&found.positions)) {
                let most = if on_border.contains(&v) { margin * (1.0 + 1e-5) } else { 0.0 };
                // Of coordinates up to ten, seven digits.
                prop_assert!(from.distance(*to) <= most + 1e-6 * f32::from(most > 0.0));
            }
        }
    }

    /// The borders of a flat square move inwards, by as much as asked for.
    #[test]
    fn a_square_shrinks() {
        let positions = [[0.0, 0.0], [0.0, 4.0], [4.0, 4.0], [4.0, 0.0]];
        let mesh = Mesh {
            positions: positions.map(|[x, y]| Vec3::new(x, y, 1.0)).into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            voxels: vec![Vec::new(); 2],
            held: vec![true; 4],
        };
        for (corner, moved) in mesh.positions.iter().zip(shrunk(&mesh, 0.25).positions) {
            let inwards = (Vec3::new(2.0, 2.0, 1.0) - *corner).normalize();
            assert!(
                (moved - *corner).dot(inwards) > 0.24,
                "{corner} moved to {moved}"
            );
        }
    }
}
