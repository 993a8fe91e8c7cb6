//! The initial mesh: steps over the voxels.

use crate::touch::Target;
use crate::{Mesh, VoxelLayers};
use farfield_grid::Grid;
use glam::Vec3;
use std::ops::Range;

/// No voxel.
const NONE: u32 = u32::MAX;

/// A mesh over the voxels as lines of sight meet them: the fronts of voxels that lines reach from the
/// layer before; and where two voxels lie right behind each other, walls from one to the next on the
/// sides on which lines pass the nearer.
///
/// A line of sight from layer to layer moves by at most a texel along each axis. If it meets a voxel
/// that has none right before it, it meets its front. If there is one, the line passes that on one
/// side, and comes in between the two through the wall. A line that moves diagonally can come in round
/// a corner of the nearer layer, within a texel of the surface's border.
/// (Jeschke, 2005, section 4.4, uses twelve rules, four vertices a voxel, and walls to all sides.)
///
/// Every edge has one or two triangles, and those around a vertex are a fan: the mesh is a manifold
/// with borders. Where voxels touch in an edge only and lines pass on both sides, each side has its
/// own surface, with vertices of its own in the same place. Two voxels side by side, of which both
/// are seen, are touched by triangles that share an edge. Vertices lie where voxels meet, so there
/// are no T-vertices.
///
/// Vertices are placed in the midst of the surface points that the voxels around them have: so what is
/// flat is flat in the mesh, and not a flight of steps. Those on borders stay at corners of voxels,
/// and only their depth follows the points.
///
/// * `points` - a point of the surface in each voxel; voxels' centres will do, but the mesh then has
///   steps half a voxel high
///
/// Takes time and memory in proportion to voxels, but for looking them up, where it takes memory for
/// two layers.
///
/// # Panics
///
/// When a voxel lies outside of its layer, or there are not as many points as voxels.
pub fn initial_mesh(voxels: &VoxelLayers<'_>, points: &[Vec3]) -> Mesh {
    let faces = faces(voxels);
    let corners = corners(&faces);
    let count = corners.iter().flatten().max().map_or(0, |last| last + 1);
    let positions = positions(&faces, &corners, count as usize, points);
    let mut mesh = Mesh {
        positions,
        ..Mesh::default()
    };
    for [a, b, c, d] in corners {
        // The shorter diagonal: what is folded less.
        let length = |p: u32, q: u32| {
            let [p, q] = [p, q].map(|v| mesh.positions[v as usize]);
            p.distance_squared(q)
        };
        mesh.triangles.extend(match length(a, c) <= length(b, d) {
            true => [[a, b, c], [a, c, d]],
            false => [[a, b, d], [b, c, d]],
        });
    }
    mesh.voxels = stood_for(&mesh, &faces, voxels);
    mesh
}

/// A front or a wall: four corners in order, counter-clockwise seen from where lines of sight come.
struct Face {
    /// Which corners of the grid: column, row, layer.
    corners: [[u32; 3]; 4],
    /// The voxel at each corner, one in all of a front, and two in a wall.
    voxels: [u32; 4],
    /// The column that lines pass in before they meet a wall; of a front its own.
    passed: [u32; 2],
}

/// The voxels of a layer, with a border of none.
fn looked_up(width: usize, height: usize, first: u32, positions: &[[u16; 2]]) -> Grid<u32> {
    let mut voxels = Grid::filled(width + 2, height + 2, NONE);
    for (id, [x, y]) in (first..).zip(positions) {
        voxels[(usize::from(*x) + 1, usize::from(*y) + 1)] = id;
    }
    voxels
}

/// The sides of a voxel: where the neighbour is, and the corners of its front on that side, in the
/// order in which the front has them.
const SIDES: [([i32; 2], [[u32; 2]; 2]); 4] = [
    ([-1, 0], [[0, 0], [0, 1]]),
    ([0, 1], [[0, 1], [1, 1]]),
    ([1, 0], [[1, 1], [1, 0]]),
    ([0, -1], [[1, 0], [0, 0]]),
];

fn faces(voxels: &VoxelLayers<'_>) -> Vec<Face> {
    let (width, height) = (voxels.width as usize, voxels.height as usize);
    let mut faces = Vec::new();
    let mut before = looked_up(width, height, 0, &[]);
    let mut first = 0;
    for (l, positions) in (0..).zip(voxels.layers) {
        let here = looked_up(width, height, first, positions);
        first += positions.len() as u32;
        // Nothing hides what is before the first layer or beside the grid.
        let is_passed = |[x, y]: [i32; 2]| {
            let is_free = before[((x + 1) as usize, (y + 1) as usize)] == NONE;
            let is_inside = x >= 0 && y >= 0 && x < width as i32 && y < height as i32;
            let is_reached = || voxels.reached[l as usize - 1].contains(x as usize, y as usize);
            is_free && (l == 0 || !is_inside || is_reached())
        };
        for at in positions {
            let [x, y] = at.map(u32::from);
            let [i, j] = [x as usize + 1, y as usize + 1];
            let (nearer, voxel) = (before[(i, j)], here[(i, j)]);
            if nearer == NONE {
                if is_passed([x as i32, y as i32]) {
                    faces.push(Face {
                        corners: SIDES.map(|(_, [[dx, dy], _])| [x + dx, y + dy, l]),
                        voxels: [voxel; 4],
                        passed: [x, y],
                    });
                }
                continue;
            }
            for ([dx, dy], [from, to]) in SIDES {
                let passed = [x as i32 + dx, y as i32 + dy];
                if is_passed(passed) {
                    let corner = |[dx, dy]: [u32; 2], layer| [x + dx, y + dy, layer];
                    faces.push(Face {
                        corners: [
                            corner(to, l - 1),
                            corner(from, l - 1),
                            corner(from, l),
                            corner(to, l),
                        ],
                        voxels: [nearer, nearer, voxel, voxel],
                        passed: passed.map(|i| i as u32),
                    });
                }
            }
        }
        before = here;
    }
    faces
}

/// Numbers of the vertices at the corners of each face: faces that share an edge share its ends.
fn corners(faces: &[Face]) -> Vec<[u32; 4]> {
    let mut joined: Vec<u32> = (0..4 * faces.len() as u32).collect();
    for edges in edges(faces).chunk_by(|a, b| a.ends == b.ends) {
        for pair in pairs(edges) {
            // One runs against the other.
            let [a, b] = pair.map(|edge| [edge.face * 4 + edge.side, edge.face * 4 + (edge.side + 1) % 4]);
            join(&mut joined, a[0], b[1]);
            join(&mut joined, a[1], b[0]);
        }
    }
    let mut numbers = vec![NONE; joined.len()];
    let mut count = 0;
    (0..faces.len() as u32)
        .map(|face| {
            [0, 1, 2, 3].map(|corner| {
                let root = root(&mut joined, 4 * face + corner);
                let number = &mut numbers[root as usize];
                if *number == NONE {
                    *number = count;
                    count += 1;
                }
                *number
            })
        })
        .collect()
}

/// A side of a face.
#[derive(Clone, Copy)]
struct Edge {
    /// The lesser corner first.
    ends: [[u32; 3]; 2],
    face: u32,
    /// From this corner to the next.
    side: u32,
    /// Of the face.
    passed: [u32; 2],
}

/// All sides of all faces, equal ones beside each other.
fn edges(faces: &[Face]) -> Vec<Edge> {
    let mut edges: Vec<Edge> = (0..)
        .zip(faces)
        .flat_map(|(face, Face { corners, passed, .. })| {
            [0, 1, 2, 3].map(|side| {
                let ends = [corners[side as usize], corners[(side as usize + 1) % 4]];
                Edge {
                    ends: [ends[0].min(ends[1]), ends[0].max(ends[1])],
                    face,
                    side,
                    passed: *passed,
                }
            })
        })
        .collect();
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.passed, edge.face));
    edges
}

/// Which of the faces at an edge are neighbours: two are, of four those that are passed in the same
/// column.
fn pairs(edges: &[Edge]) -> impl Iterator<Item = [Edge; 2]> {
    let is_one_pair = edges.len() == 2;
    edges.chunks_exact(2).filter_map(move |pair| {
        (is_one_pair || pair[0].passed == pair[1].passed).then_some([pair[0], pair[1]])
    })
}

fn root(joined: &mut [u32], mut at: u32) -> u32 {
    while joined[at as usize] != at {
        joined[at as usize] = joined[joined[at as usize] as usize];
        at = joined[at as usize];
    }
    at
}

fn join(joined: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(joined, a), root(joined, b));
    joined[a.max(b) as usize] = a.min(b);
}

/// Places of the vertices.
fn positions(faces: &[Face], corners: &[[u32; 4]], count: usize, points: &[Vec3]) -> Vec<Vec3> {
    // Of each vertex the voxels around it, and where it is in the grid.
    let mut around: Vec<(u32, u32, [u32; 3])> = faces
        .iter()
        .zip(corners)
        .flat_map(|(face, vertices)| {
            [0, 1, 2, 3].map(|i| (vertices[i], face.voxels[i], face.corners[i]))
        })
        .collect();
    let on_border = on_border(corners, count);
    around.sort_unstable();
    around.dedup();
    let place = |of_one: &[(u32, u32, [u32; 3])]| {
        let (vertex, _, [x, y, _]) = of_one[0];
        let sum: Vec3 = of_one.iter().map(|(_, voxel, _)| points[*voxel as usize]).sum();
        let mean = sum / of_one.len() as f32;
        match on_border[vertex as usize] {
            true => Vec3::new(x as f32, y as f32, mean.z),
            false => mean,
        }
    };
    around.chunk_by(|a, b| a.0 == b.0).map(place).collect()
}

/// Which vertices lie on borders.
fn on_border(corners: &[[u32; 4]], count: usize) -> Vec<bool> {
    let sides = |[a, b, c, d]: &[u32; 4]| [[*a, *b], [*b, *c], [*c, *d], [*d, *a]];
    let mut edges: Vec<[u32; 2]> = corners.iter().flat_map(sides).collect();
    edges.iter_mut().for_each(|edge| edge.sort_unstable());
    edges.sort_unstable();
    let mut on_border = vec![false; count];
    for same in edges.chunk_by(|a, b| a == b) {
        if let [[a, b]] = same {
            on_border[*a as usize] = true;
            on_border[*b as usize] = true;
        }
    }
    on_border
}

/// Of each triangle the voxels it stands for: the first of a voxel's triangles that touches it does,
/// or the first of all where none does.
fn stood_for(mesh: &Mesh, faces: &[Face], voxels: &VoxelLayers<'_>) -> Vec<Vec<u32>> {
    let boxes = voxels.boxes(1.0);
    let mut standing = vec![(NONE, false); boxes.len()];
    let triangles: Vec<Range<u32>> = (0..faces.len() as u32).map(|f| 2 * f..2 * f + 2).collect();
    for (face, triangles) in faces.iter().zip(triangles) {
        for triangle in triangles {
            let corners = mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize]);
            let target = Target::new(corners);
            for voxel in [face.voxels[0], face.voxels[2]] {
                let stands = &mut standing[voxel as usize];
                if !stands.1 && (stands.0 == NONE || target.touches(&boxes[voxel as usize])) {
                    *stands = (triangle, target.touches(&boxes[voxel as usize]));
                }
            }
        }
    }
    let mut of_triangles = vec![Vec::new(); mesh.triangles.len()];
    for (voxel, (triangle, _)) in (0..).zip(standing) {
        if triangle != NONE {
            of_triangles[triangle as usize].push(voxel);
        }
    }
    of_triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Blob, blobs};
    use crate::touch::Target;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Whether the mesh has a front at a voxel, or a wall between a column and a neighbour of it
    /// behind a layer.
    struct Faces(Vec<[Vec3; 3]>);

    impl Faces {
        fn of(mesh: &Mesh) -> Self {
            let corners = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize]);
            Self(mesh.triangles.iter().map(corners).collect())
        }

        /// Whether a piece of a line from `from` to `to` meets a triangle.
        fn meet(&self, from: Vec3, to: Vec3) -> bool {
            self.0.iter().any(|[a, b, c]| {
                let volume = |p: Vec3, q: Vec3, r: Vec3, s: Vec3| (q - p).cross(r - p).dot(s - p);
                let (above, below) = (volume(*a, *b, *c, from), volume(*a, *b, *c, to));
                let sides = [[a, b], [b, c], [c, a]].map(|[p, q]| volume(from, to, *p, *q));
                above * below <= 0.0
                    && (above != 0.0 || below != 0.0)
                    && (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0))
            })
        }
    }

    proptest! {
        /// Whatever the voxels, a line of sight that moves by less than a texel a layer along one axis,
        /// which may change, meets the mesh no later than a voxel's front.
        #[test]
        fn what_meets_a_voxel_meets_the_mesh(
            blob in blobs(),
            start in (-1.0..7.0f32, -1.0..7.0f32),
            steps in prop::collection::vec((0.0..1.0f32, prop::bool::ANY, 0.0..1.0f32), 6),
            signs in (prop::bool::ANY, prop::bool::ANY),
        ) {
            let layers = blob.layers();
            let mesh = initial_mesh(&layers, &blob.centers());
            let faces = Faces::of(&mesh);
            let sign = |positive: bool| if positive { 1.0 } else { -1.0 };
            let mut at = Vec3::new(start.0, start.1, 0.0);
            let mut met = false;
            for (l, (step, along_x, bend)) in steps.iter().enumerate() {
                // In two pieces between the layers: monotone, but not straight.
                let to = at + match along_x {
                    true => Vec3::X * sign(signs.0) * *step,
                    false => Vec3::Y * sign(signs.1) * *step,
                };
                let to = to.with_z(l as f32 + 0.5);
                let share = Vec3::new(*bend, 1.0 - bend, 0.5);
                let middle = at + (to - at) * share;
                // Exactly on a corner or an edge nothing can be told apart.
                let fractions = [to.x.fract(), to.y.fract()].map(f32::abs);
                prop_assume!(fractions.iter().all(|f| *f > 1e-3 && *f < 0.999));
                let beyond = to + (to - middle) * 1e-3;
                met |= faces.meet(at, middle) || faces.meet(middle, beyond);
                let inside = to.x > 0.0 && to.y > 0.0;
                if inside && blob.contains(to.x as u16, to.y as u16, l) {
                    prop_assert!(met, "a voxel of layer {l} at {to} is missed");
                    break;
                }
                at = to;
            }
        }

        /// Each triangle touches the voxels it stands for, each voxel that has none right before it
        /// or beside is stood for, and edges lead from corner to corner.
        #[test]
        fn triangles_stand_for_what_they_touch(blob in blobs()) {
            let layers = blob.layers();
            let mesh = initial_mesh(&layers, &blob.centers());
            let boxes = layers.boxes(1.0);
            let mut stood_for = vec![false; boxes.len()];
            for (triangle, voxels) in mesh.triangles.iter().zip(&mesh.voxels) {
                let corners = triangle.map(|v| mesh.positions[v as usize]);
                for voxel in voxels {
                    prop_assert!(!std::mem::replace(&mut stood_for[*voxel as usize], true));
                    prop_assert!(Target::new(corners).touches(&boxes[*voxel as usize]));
                }
                for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                    let along = (corners[a] - corners[b]).abs();
                    prop_assert!(along.max_element() == 1.0 && along.element_sum() <= 2.0);
                }
            }
            let mut id = 0;
            for (l, layer) in layers.layers.iter().enumerate() {
                for [x, y] in layer {
                    let is_hidden = l > 0 && blob.contains(*x, *y, l - 1);
                    prop_assert!(is_hidden || stood_for[id]);
                    id += 1;
                }
            }
        }
    }

    /// A slope of one voxel a layer is one strip of steps: closed, with one border.
    #[test]
    fn a_slope_is_one_strip() {
        let blob = Blob::of(6, |x, y, l| {
            y < 4 && (usize::from(x) == l || usize::from(x) == l + 1)
        });
        let mesh = initial_mesh(&blob.layers(), &blob.centers());
        let mut edges = BTreeMap::new();
        for t in &mesh.triangles {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry((t[a].min(t[b]), t[a].max(t[b]))).or_insert(0) += 1;
            }
        }
        assert!(edges.values().all(|count| *count <= 2));
        // Vertices less edges plus faces: a disk.
        let characteristic = mesh.positions.len() + mesh.triangles.len() - edges.len();
        assert_eq!(characteristic, 1);
    }
}
