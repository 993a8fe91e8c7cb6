//! The initial mesh: steps over the voxels.

use crate::mesh::{join, root};
use crate::touch::Target;
use crate::{Cuboid, Mesh, VoxelLayers};
use farfield_grid::Grid;
use glam::Vec3;

/// No voxel.
const NONE: u32 = u32::MAX;

/// A mesh over the voxels as lines of sight meet them: the fronts of voxels that lines reach from the
/// layer before; and where two voxels lie right behind each other, walls from one to the next on the
/// sides on which lines pass. Where a surface recedes from them, so that it ends in one column and goes
/// on a layer behind in the next, the back of the last voxel joins the two.
///
/// A line of sight from layer to layer moves by at most a texel along each axis. If it meets a voxel
/// that has none right before it, it meets its front. If there is one, the line passes that on one
/// side, and comes in between the two through the wall. A line that moves diagonally can come in round
/// a corner of the nearer layer, within a texel of the surface's border.
/// (Jeschke, 2005, section 4.4, uses twelve rules, four vertices a voxel, and walls to all sides.)
///
/// Two voxels side by side, of which both are seen, are touched by triangles that share an edge.
/// Vertices lie where voxels meet, so there are no T-vertices. Mostly an edge has two triangles, or one
/// on a border; where a surface is seen from both sides and ends, or voxels touch in an edge only,
/// it can have more. Voxels that touch in a corner only have vertices of their own there.
///
/// Vertices are placed in the midst of the surface points that the voxels around them have: so what is
/// flat is flat in the mesh, and not a flight of steps. Those on borders stay at corners of voxels, so
/// that the mesh reaches as far as its voxels do; only the depth of what ends beside follows the points.
/// Where a voxel would be missed, its vertices stay too.
///
/// Every voxel that has a front or a wall has one triangle that stands for it, and touches it enlarged.
///
/// * `points` - a point of the surface in each voxel; voxels' centres will do, but the mesh then has
///   steps half a voxel high
/// * `enlarged` - side of a voxel, in voxels, when it is asked whether a triangle touches it; at least 1
///
/// Takes time and memory in proportion to voxels, but for looking them up, where it takes memory for
/// two layers.
///
/// # Panics
///
/// When a voxel lies outside of its layer, or there are not as many points as voxels.
pub fn initial_mesh(voxels: &VoxelLayers<'_>, points: &[Vec3], enlarged: f32) -> Mesh {
    let faces = faces(voxels);
    let corners = corners(&faces);
    let count = corners.iter().flatten().max().map_or(0, |last| last + 1) as usize;
    let boxes = voxels.boxes(enlarged);
    let steps = steps(&faces, &corners, count, voxels);
    let mut positions = midst(&faces, &corners, &steps, points, voxels);
    loop {
        let triangles = triangles(&corners, &positions);
        let (standing, missed) = stood_for(&triangles, &positions, &faces, &boxes);
        if missed.is_empty() {
            return Mesh {
                positions,
                triangles,
                voxels: standing,
            };
        }
        for vertex in missed.iter().flat_map(|face| corners[*face as usize]) {
            positions[vertex as usize] = steps[vertex as usize];
        }
    }
}

/// A front, a wall or a back: four corners in order, counter-clockwise seen from where lines of sight
/// come.
struct Face {
    kind: Kind,
    /// Which corners of the grid: column, row, layer.
    corners: [[u32; 3]; 4],
    /// The voxel at each corner, one in all of a front or a back, and two in a wall.
    voxels: [u32; 4],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Front,
    Wall,
    Back,
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

/// Two layers behind each other, and the one before them.
struct Between<'a> {
    voxels: &'a VoxelLayers<'a>,
    /// The layer behind.
    layer: u32,
    two_before: &'a Grid<u32>,
    before: &'a Grid<u32>,
    here: &'a Grid<u32>,
}

impl Between<'_> {
    /// The voxel of the layer before and the one behind in a column.
    fn pair(&self, [x, y]: [i32; 2]) -> [u32; 2] {
        let at = ((x + 1) as usize, (y + 1) as usize);
        [self.before[at], self.here[at]]
    }

    /// Whether lines of sight pass in a column of the layer before or, `behind`, in the one behind.
    /// Nothing hides what is before the first layer or beside the grid.
    fn is_passed(&self, [x, y]: [i32; 2], behind: bool) -> bool {
        let VoxelLayers { width, height, .. } = *self.voxels;
        let is_inside = x >= 0 && y >= 0 && x < width as i32 && y < height as i32;
        let layer = (self.layer + u32::from(behind)).checked_sub(1);
        let is_reached = |l: u32| self.voxels.reached[l as usize].contains(x as usize, y as usize);
        self.pair([x, y])[usize::from(behind)] == NONE
            && (!is_inside || layer.is_none_or(is_reached))
    }

    /// Whether lines pass in a column between the layers: they come from before, or from beside
    /// behind a voxel that ends there.
    fn is_open(&self, at: [i32; 2]) -> bool {
        let [nearer, _] = self.pair(at);
        match nearer == NONE {
            true => self.is_passed(at, false),
            false => self.is_passed(at, true),
        }
    }

    fn is_wall_behind(&self, at: [i32; 2]) -> bool {
        self.pair(at).iter().all(|voxel| *voxel != NONE)
    }
}

fn faces(voxels: &VoxelLayers<'_>) -> Vec<Face> {
    let (width, height) = (voxels.width as usize, voxels.height as usize);
    let mut faces = Vec::new();
    let mut two_before = looked_up(width, height, 0, &[]);
    let mut before = two_before.clone();
    let mut first = 0;
    let mut positions_before: &[[u16; 2]] = &[];
    for (l, positions) in (0..).zip(voxels.layers) {
        let here = looked_up(width, height, first, positions);
        first += positions.len() as u32;
        let between = Between {
            voxels,
            layer: l,
            two_before: &two_before,
            before: &before,
            here: &here,
        };
        for [x, y] in positions_before {
            faces.extend(back(&between, [*x, *y].map(i32::from)));
        }
        for [x, y] in positions {
            let at = [*x, *y].map(i32::from);
            match between.is_wall_behind(at) {
                true => faces.extend(walls(&between, at)),
                false => faces.extend(front(&between, at)),
            }
        }
        two_before = std::mem::replace(&mut before, here);
        positions_before = positions;
    }
    faces
}

/// A corner of a column's square, at a layer.
fn corner([x, y]: [i32; 2], [dx, dy]: [u32; 2], layer: u32) -> [u32; 3] {
    [x as u32 + dx, y as u32 + dy, layer]
}

/// The front of a voxel that has none before it.
fn front(between: &Between<'_>, at: [i32; 2]) -> Option<Face> {
    let layer = between.layer;
    between.is_passed(at, false).then(|| Face {
        kind: Kind::Front,
        corners: SIDES.map(|(_, [from, _])| corner(at, from, layer)),
        voxels: [between.pair(at)[1]; 4],
    })
}

/// The sides of two voxels behind each other, where lines pass beside.
fn walls(between: &Between<'_>, at: [i32; 2]) -> impl Iterator<Item = Face> {
    let [nearer, voxel] = between.pair(at);
    let layer = between.layer;
    SIDES.into_iter().filter_map(move |([dx, dy], [from, to])| {
        let beside = [at[0] + dx, at[1] + dy];
        let is_open = !between.is_wall_behind(beside) && between.is_open(beside);
        is_open.then(|| Face {
            kind: Kind::Wall,
            corners: [
                corner(at, to, layer - 1),
                corner(at, from, layer - 1),
                corner(at, from, layer),
                corner(at, to, layer),
            ],
            voxels: [nearer, nearer, voxel, voxel],
        })
    })
}

/// The back of two voxels where a surface recedes: beside it the surface goes on behind.
fn back(between: &Between<'_>, at: [i32; 2]) -> Option<Face> {
    let layer = between.layer;
    let goes_on = |([dx, dy], _): ([i32; 2], _)| between.is_wall_behind([at[0] + dx, at[1] + dy]);
    let nearer = between.two_before[((at[0] + 1) as usize, (at[1] + 1) as usize)];
    let is_seen = nearer != NONE && between.is_passed(at, true) && SIDES.into_iter().any(goes_on);
    is_seen.then(|| {
        let mut corners = SIDES.map(|(_, [from, _])| corner(at, from, layer - 1));
        corners.reverse();
        Face {
            kind: Kind::Back,
            corners,
            voxels: [between.pair(at)[0]; 4],
        }
    })
}

/// Numbers of the vertices at the corners of each face: faces that share an edge share its ends.
fn corners(faces: &[Face]) -> Vec<[u32; 4]> {
    let mut joined: Vec<u32> = (0..4 * faces.len() as u32).collect();
    for edges in edges(faces).chunk_by(|a, b| a.ends == b.ends) {
        // Where there are fronts and backs only, a surface ends: they are its two sides.
        let has_wall = edges.iter().any(|edge| edge.kind == Kind::Wall);
        let hang_together = |a: &Edge, b: &Edge| has_wall || a.kind == b.kind;
        for (i, edge) in edges.iter().enumerate() {
            let others = edges[..i].iter();
            for other in others.filter(|other| hang_together(edge, other)) {
                for end in 0..2 {
                    join(&mut joined, edge.corners[end], other.corners[end]);
                }
            }
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
struct Edge {
    /// Corners of the grid, the lesser first.
    ends: [[u32; 3]; 2],
    /// Which corner of all faces is at each of the ends.
    corners: [u32; 2],
    kind: Kind,
}

/// All sides of all faces, equal ones beside each other.
fn edges(faces: &[Face]) -> Vec<Edge> {
    let of_face = |(face, one): (u32, &Face)| {
        [0, 1, 2, 3].map(|side| {
            let next = (side + 1) % 4;
            let ends = [side, next].map(|i| (one.corners[i], 4 * face + i as u32));
            let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            Edge {
                ends: ends.map(|end| end.0),
                corners: ends.map(|end| end.1),
                kind: one.kind,
            }
        })
    };
    let mut edges: Vec<Edge> = (0..).zip(faces).flat_map(of_face).collect();
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.corners));
    edges
}

/// Where voxels meet: places of the vertices at corners of voxels, in the middle of their layers.
fn steps(
    faces: &[Face],
    corners: &[[u32; 4]],
    count: usize,
    voxels: &VoxelLayers<'_>,
) -> Vec<Vec3> {
    let mut places = vec![Vec3::ZERO; count];
    for (face, vertices) in faces.iter().zip(corners) {
        for (vertex, [x, y, l]) in vertices.iter().zip(face.corners) {
            places[*vertex as usize] = Vec3::new(x as f32, y as f32, voxels.middle(l as usize));
        }
    }
    places
}

/// Places of the vertices in the midst of the points around them.
fn midst(
    faces: &[Face],
    corners: &[[u32; 4]],
    steps: &[Vec3],
    points: &[Vec3],
    voxels: &VoxelLayers<'_>,
) -> Vec<Vec3> {
    // Of each vertex the voxels around it.
    let mut around: Vec<[u32; 2]> = faces
        .iter()
        .zip(corners)
        .flat_map(|(face, vertices)| [0, 1, 2, 3].map(|i| [vertices[i], face.voxels[i]]))
        .collect();
    around.sort_unstable();
    around.dedup();
    let borders = border_of(faces, corners, steps.len(), voxels);
    let place = |of_one: &[[u32; 2]]| {
        let vertex = of_one[0][0] as usize;
        let sum: Vec3 = of_one
            .iter()
            .map(|[_, voxel]| points[*voxel as usize])
            .sum();
        let mean = sum / of_one.len() as f32;
        match borders[vertex] {
            Border::No => mean,
            Border::Beside => steps[vertex].with_z(mean.z),
            Border::InDepth(z) => steps[vertex].with_z(z),
        }
    };
    around.chunk_by(|a, b| a[0] == b[0]).map(place).collect()
}

/// Two triangles a face, along the shorter of its diagonals.
fn triangles(corners: &[[u32; 4]], positions: &[Vec3]) -> Vec<[u32; 3]> {
    let length = |p: u32, q: u32| positions[p as usize].distance_squared(positions[q as usize]);
    let halves = |[a, b, c, d]: &[u32; 4]| match length(*a, *c) <= length(*b, *d) {
        true => [[*a, *b, *c], [*a, *c, *d]],
        false => [[*a, *b, *d], [*b, *c, *d]],
    };
    corners.iter().flat_map(halves).collect()
}

/// Whether a vertex lies on a border, and how.
#[derive(Clone, Copy, PartialEq)]
enum Border {
    No,
    /// Of a front, or where a wall ends beside.
    Beside,
    /// Where a wall begins or ends in depth: the surface goes on to the end of its voxels.
    InDepth(f32),
}

fn border_of(
    faces: &[Face],
    corners: &[[u32; 4]],
    count: usize,
    voxels: &VoxelLayers<'_>,
) -> Vec<Border> {
    let mut edges: Vec<([u32; 2], u32, usize)> = (0..)
        .zip(corners)
        .flat_map(|(face, vertices)| {
            [0, 1, 2, 3].map(|side| {
                let (a, b) = (vertices[side], vertices[(side + 1) % 4]);
                ([a.min(b), a.max(b)], face, side)
            })
        })
        .collect();
    edges.sort_unstable();
    let mut of_vertices = vec![Border::No; count];
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        let [(ends, face, side)] = same else { continue };
        let face = &faces[*face as usize];
        let layer = face.corners[*side][2] as usize;
        let border = match (face.kind, side) {
            (Kind::Wall, 0) => Border::InDepth(voxels.borders[layer]),
            (Kind::Wall, 2) => Border::InDepth(voxels.borders[layer + 1]),
            _ => Border::Beside,
        };
        for end in ends {
            let of_vertex = &mut of_vertices[*end as usize];
            if !matches!(of_vertex, Border::InDepth(_)) {
                *of_vertex = border;
            }
        }
    }
    of_vertices
}

/// Of each triangle the voxels it stands for, those whose first triangle to touch them it is; and the
/// first face of each voxel that no triangle touches.
fn stood_for(
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    faces: &[Face],
    boxes: &[Cuboid],
) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut standing = vec![Vec::new(); triangles.len()];
    let mut is_touched = vec![false; boxes.len()];
    let of_face = |face: &Face| [face.voxels[0], face.voxels[2]];
    for (of_one, (face, pair)) in standing
        .chunks_exact_mut(2)
        .zip(faces.iter().zip(triangles.chunks_exact(2)))
    {
        for (standing, triangle) in of_one.iter_mut().zip(pair) {
            let target = Target::new(triangle.map(|v| positions[v as usize]));
            for voxel in of_face(face) {
                let is_touched = &mut is_touched[voxel as usize];
                if !*is_touched && target.touches(&boxes[voxel as usize]) {
                    *is_touched = true;
                    standing.push(voxel);
                }
            }
        }
    }
    let mut missed = Vec::new();
    for (i, face) in (0..).zip(faces) {
        for voxel in of_face(face) {
            if !std::mem::replace(&mut is_touched[voxel as usize], true) {
                missed.push(i);
            }
        }
    }
    (standing, missed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Blob, blobs};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// The faces where voxels meet, not moved to the midst of anything, as triangles.
    fn steps_of(blob: &Blob) -> Vec<[Vec3; 3]> {
        let faces = faces(&blob.layers());
        let place = |[x, y, l]: [u32; 3]| Vec3::new(x as f32, y as f32, l as f32 + 0.5);
        let triangles = faces.iter().flat_map(|face| {
            let [a, b, c, d] = face.corners.map(place);
            [[a, b, c], [a, c, d]]
        });
        triangles.collect()
    }

    /// Whether a piece of a line from `from` to `to` meets a triangle.
    fn meet(triangles: &[[Vec3; 3]], from: Vec3, to: Vec3) -> bool {
        triangles.iter().any(|[a, b, c]| {
            let volume = |p: Vec3, q: Vec3, r: Vec3, s: Vec3| (q - p).cross(r - p).dot(s - p);
            let (above, below) = (volume(*a, *b, *c, from), volume(*a, *b, *c, to));
            let sides = [[a, b], [b, c], [c, a]].map(|[p, q]| volume(from, to, *p, *q));
            above * below <= 0.0
                && (above != 0.0 || below != 0.0)
                && (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0))
        })
    }

    /// Of each edge how many triangles it has.
    fn edges(mesh: &Mesh) -> BTreeMap<[u32; 2], usize> {
        let mut edges = BTreeMap::new();
        for t in &mesh.triangles {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry([t[a].min(t[b]), t[a].max(t[b])]).or_insert(0) += 1;
            }
        }
        edges
    }

    proptest! {
        /// Whatever the voxels, a line of sight that moves by less than a texel a layer along one axis,
        /// which may change, meets the steps no later than a voxel's front.
        #[test]
        fn what_meets_a_voxel_meets_the_steps(
            blob in blobs(),
            start in (-1.0..7.0f32, -1.0..7.0f32),
            steps_of_line in prop::collection::vec((0.0..1.0f32, prop::bool::ANY, 0.0..1.0f32), 6),
            signs in (prop::bool::ANY, prop::bool::ANY),
        ) {
            let triangles = steps_of(&blob);
            let sign = |positive: bool| if positive { 1.0 } else { -1.0 };
            let mut at = Vec3::new(start.0, start.1, 0.0);
            let mut met = false;
            for (l, (step, along_x, bend)) in steps_of_line.iter().enumerate() {
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
                met |= meet(&triangles, at, middle) || meet(&triangles, middle, beyond);
                let inside = to.x > 0.0 && to.y > 0.0;
                if inside && blob.contains(to.x as u16, to.y as u16, l) {
                    prop_assert!(met, "a voxel of layer {l} at {to} is missed");
                    break;
                }
                at = to;
            }
        }

        /// Each voxel that has none right before it has exactly one triangle that stands for it, and
        /// touches it.
        #[test]
        fn triangles_stand_for_what_they_touch(
            blob in blobs(), at_points in any::<bool>(), enlarged in 1.0..2.0f32,
        ) {
            let layers = blob.layers();
            let points = match at_points {
                true => blob.points(),
                false => blob.centers(),
            };
            let mesh = initial_mesh(&layers, &points, enlarged);
            let boxes = layers.boxes(enlarged);
            let mut stood_for = vec![false; boxes.len()];
            for (triangle, voxels) in mesh.triangles.iter().zip(&mesh.voxels) {
                let corners = triangle.map(|v| mesh.positions[v as usize]);
                for voxel in voxels {
                    prop_assert!(!std::mem::replace(&mut stood_for[*voxel as usize], true));
                    prop_assert!(Target::new(corners).touches(&boxes[*voxel as usize]));
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

        /// What shares an edge in the grid shares it in the mesh, and the triangles around a vertex hang
        /// together over edges.
        #[test]
        fn triangles_hang_together_over_edges(blob in blobs()) {
            let faces = faces(&blob.layers());
            let corners = corners(&faces);
            let mut of_edge = BTreeMap::new();
            for (face, vertices) in faces.iter().zip(&corners) {
                for i in 0..4 {
                    let next = (i + 1) % 4;
                    let mut edge = [(face.corners[i], vertices[i]), (face.corners[next], vertices[next])];
                    edge.sort_unstable();
                    let shared = of_edge.entry(edge.map(|end| end.0)).or_insert(Vec::new());
                    shared.push((face.kind, edge.map(|end| end.1)));
                }
            }
            for shared in of_edge.values() {
                let has_wall = shared.iter().any(|(kind, _)| *kind == Kind::Wall);
                let (first, in_mesh) = shared[0];
                for (kind, other) in &shared[1..] {
                    prop_assert!(in_mesh == *other || (!has_wall && first != *kind));
                }
            }
            let mesh = initial_mesh(&blob.layers(), &blob.centers(), 1.5);
            let mut around = vec![Vec::new(); mesh.positions.len()];
            for t in &mesh.triangles {
                for i in 0..3 {
                    around[t[i] as usize].push([t[(i + 1) % 3], t[(i + 2) % 3]]);
                }
            }
            for mut apart in around {
                prop_assert!(!apart.is_empty());
                let mut together: Vec<u32> = apart.swap_remove(0).into();
                while let Some(next) = apart.iter().position(|pair| pair.iter().any(|v| together.contains(v))) {
                    together.extend(apart.swap_remove(next));
                }
                prop_assert!(apart.is_empty(), "triangles at a vertex are apart");
            }
        }
    }

    /// A slope of one voxel a layer is one strip of steps: closed, with one border; and flat where
    /// points of the slope are known.
    #[test]
    fn a_slope_is_one_strip() {
        let blob = Blob::of(6, |x, y, l| {
            y < 4 && (usize::from(x) == l || usize::from(x) == l + 1)
        });
        let blob = blob.reached_where(|x, _, l| usize::from(x) >= l);
        let on_slope = |center: &Vec3| center.with_z(center.x);
        let points: Vec<Vec3> = blob.centers().iter().map(on_slope).collect();
        let mesh = initial_mesh(&blob.layers(), &points, 1.5);
        let edges = edges(&mesh);
        assert!(edges.values().all(|count| *count <= 2));
        // Vertices less edges plus faces: a disk.
        let characteristic = mesh.positions.len() + mesh.triangles.len() - edges.len();
        assert_eq!(characteristic, 1);
        let inner = mesh
            .positions
            .iter()
            .filter(|p| p.y > 0.0 && p.y < 4.0 && p.x > 1.0 && p.x < 5.0);
        inner.for_each(|p| assert!((p.x - p.z).abs() < 1e-5, "{p}"));
    }
}
