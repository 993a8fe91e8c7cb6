//! What finds holes of meshes, and what closes them.

use crate::{Mesh, VoxelLayers};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// The squares of some voxels, in the middle of their layers, joined to rectangles where several are side
/// by side in a layer: positions of corners, and triangles. They reach a quarter of a voxel over what they
/// are of. Together they close whatever the voxels do, as textured quads would.
///
/// * `chosen` - numbers of voxels
pub fn rectangles(voxels: &VoxelLayers<'_>, chosen: &BTreeSet<u32>) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (l, layer) in voxels.layers.iter().enumerate() {
        let end = first + layer.len() as u32;
        let chosen = chosen.range(first..end);
        let places: BTreeSet<[u16; 2]> = chosen
            .map(|voxel| layer[(voxel - first) as usize])
            .map(|[x, y]| [y, x])
            .collect();
        for [min, max] in joined(&places) {
            let start = positions.len() as u32;
            let [min, max] = [(min, -OVERLAP), (max, OVERLAP)]
                .map(|(corner, overlap)| corner.map(|at| at as f32 + overlap));
            let corners = [[min[0], min[1]], [min[0], max[1]], max, [max[0], min[1]]];
            let corner = |[x, y]: [f32; 2]| Vec3::new(x, y, voxels.middle(l));
            positions.extend(corners.map(corner));
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| start + v)));
        }
        first = end;
    }
    (positions, triangles)
}

/// By how much rectangles reach over their voxels, in voxels: a line of sight may pass by a hair where two
/// voxels touch only at their corners. Quads of layers are drawn over their texels as well.
const OVERLAP: f32 = 0.25;

/// Runs of places in a row, joined with those of the same length in the row before: least and greatest
/// corners, x first.
///
/// * `places` - y first
fn joined(places: &BTreeSet<[u16; 2]>) -> Vec<[[u32; 2]; 2]> {
    let mut runs: Vec<[[u32; 2]; 2]> = Vec::new();
    for [y, x] in places.iter().map(|place| place.map(u32::from)) {
        match runs.last_mut() {
            Some([min, max]) if min[1] == y && max[0] == x => max[0] += 1,
            _ => runs.push([[x, y], [x + 1, y + 1]]),
        }
    }
    let mut joined: Vec<[[u32; 2]; 2]> = Vec::new();
    // Of the rectangles that end above, by their sides.
    let mut above: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for [min, max] in runs {
        let sides = |y| [min[0], max[0], y];
        let at = match above.remove(&sides(min[1])) {
            Some(at) => {
                joined[at][1][1] = max[1];
                at
            }
            None => {
                joined.push([min, max]);
                joined.len() - 1
            }
        };
        above.insert(sides(max[1]), at);
    }
    joined
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
        /// Each voxel that is chosen is covered once, in the middle of its layer, and no other is; two
        /// rectangles of a layer that have a side in common lie diagonally or are not equally long there.
        #[test]
        fn rectangles_cover_the_chosen(
            blob in blobs(), chosen in prop::collection::btree_set(0..200u32, 0..100),
        ) {
            let layers = blob.layers();
            let boxes = layers.boxes(1.0);
            let (corners, triangles) = rectangles(&layers, &chosen);
            let of_both = triangles.chunks(2).map(|both| {
                let all = both.iter().flatten().map(|v| corners[*v as usize]);
                let min = all.clone().reduce(Vec3::min).unwrap();
                let max = all.reduce(Vec3::max).unwrap();
                let area = |[a, b, c]: [u32; 3]| {
                    let [a, b, c] = [a, b, c].map(|v| corners[v as usize]);
                    (b - a).cross(c - a).length() / 2.0
                };
                let sides = (max - min).truncate();
                assert_eq!(both.iter().map(|t| area(*t)).sum::<f32>(), sides.element_product());
                let overlap = Vec3::new(OVERLAP, OVERLAP, 0.0);
                (min + overlap, max - overlap)
            });
            let all: Vec<(Vec3, Vec3)> = of_both.collect();
            for (voxel, place) in (0..).zip(&boxes) {
                let center = place.center;
                let covering = all.iter().filter(|(min, max)| {
                    center.cmpge(*min).all() && center.cmple(*max).all()
                });
                prop_assert_eq!(covering.count(), usize::from(chosen.contains(&voxel)));
            }
            let area: f32 = all.iter().map(|(min, max)| (max - min).truncate().element_product()).sum();
            let there = chosen.iter().filter(|v| (**v as usize) < boxes.len()).count();
            prop_assert_eq!(area, there as f32);
            for (i, (min, max)) in all.iter().enumerate() {
                let joins = |(other_min, other_max): &(Vec3, Vec3)| {
                    min.z == other_min.z && max.y == other_min.y
                        && min.x == other_min.x && max.x == other_max.x
                };
                prop_assert!(!all[i + 1..].iter().any(joins));
            }
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
