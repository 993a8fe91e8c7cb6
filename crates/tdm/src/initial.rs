//! The initial mesh: faces of voxels, smoothed.

use crate::faces::{Face, Kind, faces};
use crate::flaps::{Flap, without_flaps};
use crate::joints::Joints;
use crate::mesh::{join, root};
use crate::reach::{Gap, Light};
use crate::touch::Target;
use crate::{Cuboid, Mesh, VoxelLayers};
use glam::Vec3;

/// No vertex.
const NONE: u32 = u32::MAX;

/// A mesh over the voxels as lines of sight meet them: the fronts of voxels that lines reach from the
/// layer before; where two voxels lie right behind each other, walls from one to the next on the sides
/// on which lines pass; and the backs of the last of them, where lines pass behind.
///
/// A line of sight from layer to layer moves by at most a texel along each axis. If it meets a voxel
/// that has none right before it, it meets its front. If there is one, the line passes that on one
/// side, and comes in between the two through the wall. A line that moves diagonally can come in round
/// a corner of the nearer layer, within a texel of the surface's border.
/// (Jeschke, 2005, section 4.4, uses twelve rules, four vertices a voxel, and walls to all sides.)
///
/// The mesh goes on for some texels into shadows, of what does not let lines of sight pass: what hides
/// may shrink when it is simplified, and so may what it hides.
///
/// Two voxels side by side, of which both are seen, are touched by triangles that share an edge.
/// Vertices lie where voxels meet, so there are no T-vertices. Mostly an edge has two triangles, or one
/// on a border. Where two surfaces touch in an edge, as front and back of what is thin and slopes do,
/// each has vertices of its own there, and so it is where voxels touch in a corner. Voxels that stick out
/// where two surfaces meet, a texel wide, have no faces: the edge touches them.
///
/// Vertices are placed in the midst of the surface points that the voxels around them have: so what is
/// flat is flat in the mesh, and not a flight of steps. Where a surface folds back they are placed at the
/// outermost of these points. Those on borders stay at corners of voxels, so that the mesh reaches as far
/// as its voxels do; only the depth of what ends beside follows the points. Where a voxel would be
/// missed, or a face vanish, its vertices stay too.
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
    let light = Light::new(voxels);
    let (faces, flaps) = without_flaps(faces(voxels, &light));
    let corners = corners(&faces);
    let count = corners.iter().flatten().max().map_or(0, |last| last + 1) as usize;
    let boxes = voxels.boxes(enlarged);
    let steps = steps(&faces, &corners, count, voxels);
    let shown = shown(&faces, &flaps, &light.reaches(voxels));
    let borders = borders(&faces, &corners, count, voxels, &light);
    let mut positions = midst(&faces, &flaps, &corners, &steps, points, &borders);
    for vertex in vanished(&faces, &corners, &positions) {
        let place = steps[vertex as usize];
        positions[vertex as usize] = place.with_z(positions[vertex as usize].z);
    }
    loop {
        let triangles = triangles(&corners, &positions);
        let (standing, missed) = stood_for(&triangles, &positions, &shown, &boxes);
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

/// Numbers of the vertices at the corners of each face: faces that share an edge share its ends.
fn corners(faces: &[Face]) -> Vec<[u32; 4]> {
    let mut joined: Vec<u32> = (0..4 * faces.len() as u32).collect();
    for joint in Joints::new(faces).iter() {
        for pair in joint.windows(2) {
            for end in 0..2 {
                join(&mut joined, pair[0].corners[end], pair[1].corners[end]);
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
    flaps: &[Flap],
    corners: &[[u32; 4]],
    steps: &[Vec3],
    points: &[Vec3],
    borders: &[Border],
) -> Vec<Vec3> {
    // Of each vertex the voxels around it.
    let mut around: Vec<[u32; 2]> = faces
        .iter()
        .zip(corners)
        .flat_map(|(face, vertices)| [0, 1, 2, 3].map(|i| [vertices[i], face.voxels[i]]))
        .collect();
    for flap in flaps {
        let (face, vertices) = (&faces[flap.beside as usize], corners[flap.beside as usize]);
        let shared = (0..4).filter(|i| flap.face.corners.contains(&face.corners[*i]));
        around.extend(shared.map(|i| [vertices[i], flap.face.voxels[0]]));
    }
    around.sort_unstable();
    around.dedup();

    let place = |of_one: &[[u32; 2]]| {
        let vertex = of_one[0][0] as usize;
        let sum: Vec3 = of_one
            .iter()
            .map(|[_, voxel]| points[*voxel as usize])
            .sum();
        let mean = sum / of_one.len() as f32;
        let outward = steps[vertex] - mean;
        let points = of_one.iter().map(|[_, voxel]| points[*voxel as usize]);
        let outermost = || {
            let by_reach = points.max_by(|a, b| a.dot(outward).total_cmp(&b.dot(outward)));
            by_reach.unwrap_or(mean)
        };
        match borders[vertex] {
            Border::No => mean,
            Border::Fold => outermost(),
            Border::Beside | Border::InShadow => steps[vertex].with_z(mean.z),
            Border::InDepth(z) => steps[vertex].with_z(z),
        }
    };
    around.chunk_by(|a, b| a[0] == b[0]).map(place).collect()
}

/// The vertices of fronts and backs that have drawn together: points around them were the same.
fn vanished(faces: &[Face], corners: &[[u32; 4]], positions: &[Vec3]) -> Vec<u32> {
    let is_small = |(face, vertices): &(&Face, &[u32; 4])| {
        let [a, b, c, d] = vertices.map(|v| positions[v as usize]);
        face.kind != Kind::Wall && a.distance(c).max(b.distance(d)) < SMALLEST
    };
    let small = faces.iter().zip(corners).filter(is_small);
    small.flat_map(|(_, vertices)| *vertices).collect()
}

/// Diagonal of a face of which hardly anything is left, in voxels.
const SMALLEST: f32 = 0.5;

/// Two triangles a face, along the shorter of its diagonals.
fn triangles(corners: &[[u32; 4]], positions: &[Vec3]) -> Vec<[u32; 3]> {
    let length = |p: u32, q: u32| positions[p as usize].distance_squared(positions[q as usize]);
    let halves = |[a, b, c, d]: &[u32; 4]| match length(*a, *c) <= length(*b, *d) {
        true => [[*a, *b, *c], [*a, *c, *d]],
        false => [[*a, *b, *d], [*b, *c, *d]],
    };
    corners.iter().flat_map(halves).collect()
}

/// Whether a vertex lies on a border, and how; the last that is true of it.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Border {
    No,
    /// Only where the surface goes on but is not seen.
    InShadow,
    /// Where a surface folds back.
    Fold,
    /// Where a surface ends beside.
    Beside,
    /// Where a wall begins or ends in depth: the surface goes on to the end of its voxels.
    InDepth(f32),
}

fn borders(
    faces: &[Face],
    corners: &[[u32; 4]],
    count: usize,
    voxels: &VoxelLayers<'_>,
    light: &Light,
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
    let is_outline = is_outline(faces, corners, count);
    let mut of_vertices: Vec<Border> = is_outline
        .iter()
        .map(|is| if *is { Border::Fold } else { Border::No })
        .collect();
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        let [(ends, face, side)] = same else { continue };
        let face = &faces[*face as usize];
        let sides = [*side, (*side + 1) % 4].map(|i| face.corners[i]);
        let layer = sides[0][2] as usize;
        let is_dark = |gap: &Gap| !light.is_solid(*gap) && !light.is_lit(*gap);
        let border = match (face.kind, side) {
            _ if gaps_around(sides).iter().any(is_dark) => Border::InShadow,
            (Kind::Wall, 0) => Border::InDepth(voxels.borders[layer]),
            (Kind::Wall, 2) => Border::InDepth(voxels.borders[layer + 1]),
            _ => Border::Beside,
        };
        for end in ends {
            let of_vertex = &mut of_vertices[*end as usize];
            // The first of those in depth.
            if *of_vertex < border && !matches!(of_vertex, Border::InDepth(_)) {
                *of_vertex = border;
            }
        }
    }
    of_vertices
}

/// Whether each vertex lies where a surface ends or folds back, as seen from before: the fronts and backs
/// around it, and around those that walls join with it in depth, do not lie on all sides.
fn is_outline(faces: &[Face], corners: &[[u32; 4]], count: usize) -> Vec<bool> {
    let mut joined: Vec<u32> = (0..count as u32).collect();
    for (face, [a, b, c, d]) in faces.iter().zip(corners) {
        if face.kind == Kind::Wall {
            join(&mut joined, *a, *d);
            join(&mut joined, *b, *c);
        }
    }
    let mut sides = vec![0u8; count];
    for (face, vertices) in faces.iter().zip(corners) {
        if face.kind != Kind::Wall {
            let [x, y, _] = face.from.map(|at| at as u32);
            for (vertex, at) in vertices.iter().zip(face.corners) {
                let side = u8::from(at[0] == x) + 2 * u8::from(at[1] == y);
                sides[root(&mut joined, *vertex) as usize] |= 1 << side;
            }
        }
    }
    (0..count as u32)
        .map(|vertex| sides[root(&mut joined, vertex) as usize] != 0b1111)
        .collect()
}

/// The four gaps between layers that meet at a side of a face.
fn gaps_around([p, q]: [[u32; 3]; 2]) -> [Gap; 4] {
    let along = (0..3).find(|axis| p[*axis] != q[*axis]).unwrap_or(0);
    let [x, y, layer] = [0, 1, 2].map(|axis| p[axis].max(q[axis]) as i32);
    // In depth, it lies in the gap before its end; across, between those before and behind its layer.
    [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| match along {
        0 => [x - 1, y - i, layer + j],
        1 => [x - i, y - 1, layer + j],
        _ => [x - i, y - j, layer],
    })
}

/// Which faces show which voxels: pairs, in the order of faces. Of what is not needed none is.
fn shown(faces: &[Face], flaps: &[Flap], is_needed: &[bool]) -> Vec<[u32; 2]> {
    let mut flaps = flaps.iter().peekable();
    let mut shown = Vec::with_capacity(2 * faces.len());
    for (i, face) in (0..).zip(faces) {
        let [first, _, last, _] = face.voxels;
        shown.push([i, first]);
        if last != first {
            shown.push([i, last]);
        }
        while let Some(flap) = flaps.next_if(|flap| flap.beside == i) {
            shown.push([i, flap.face.voxels[0]]);
        }
    }
    shown.retain(|[_, voxel]| is_needed[*voxel as usize]);
    shown
}

/// Of each triangle the voxels it stands for, those whose first triangle to touch them it is; and the
/// first face of each voxel that no triangle touches.
fn stood_for(
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    shown: &[[u32; 2]],
    boxes: &[Cuboid],
) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut standing = vec![Vec::new(); triangles.len()];
    let mut is_touched = vec![false; boxes.len()];
    for of_face in shown.chunk_by(|a, b| a[0] == b[0]) {
        let face = of_face[0][0] as usize;
        for triangle in 2 * face..2 * face + 2 {
            let target = Target::new(triangles[triangle].map(|v| positions[v as usize]));
            for [_, voxel] in of_face {
                let is_touched = &mut is_touched[*voxel as usize];
                if !*is_touched && target.touches(&boxes[*voxel as usize]) {
                    *is_touched = true;
                    standing[triangle].push(*voxel);
                }
            }
        }
    }
    let mut missed = Vec::new();
    for [face, voxel] in shown {
        if !std::mem::replace(&mut is_touched[*voxel as usize], true) {
            missed.push(*face);
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
        let faces = faces(&blob.layers(), &Light::new(&blob.layers()));
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

        /// What shares an edge in the grid shares it in the mesh, unless it is the two sides of where a
        /// surface ends, or of two surfaces that pass each other; and the triangles around a vertex hang
        /// together over edges.
        #[test]
        fn triangles_hang_together_over_edges(blob in blobs()) {
            let faces = faces(&blob.layers(), &Light::new(&blob.layers()));
            let corners = corners(&faces);
            let mut of_edge = BTreeMap::new();
            for (face, vertices) in faces.iter().zip(&corners) {
                for i in 0..4 {
                    let next = (i + 1) % 4;
                    let mut edge = [(face.corners[i], vertices[i]), (face.corners[next], vertices[next])];
                    edge.sort_unstable();
                    let shared = of_edge.entry(edge.map(|end| end.0)).or_insert(Vec::new());
                    shared.push((face, edge.map(|end| end.1)));
                }
            }
            for shared in of_edge.values() {
                let has_wall = shared.iter().any(|(face, _)| face.kind == Kind::Wall);
                let (first, in_mesh) = shared[0];
                let same_side = shared.iter().filter(|(face, _)| face.from == first.from).count();
                for (face, other) in &shared[1..] {
                    let passes = shared.len() == 4 && same_side == 2 && face.from != first.from;
                    let is_apart = match has_wall {
                        true => passes,
                        false => face.kind != first.kind,
                    };
                    prop_assert!(is_apart || in_mesh == *other);
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
