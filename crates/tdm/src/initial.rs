//! The initial mesh: steps over the voxels.

use crate::{Mesh, VoxelLayers};
use farfield_grid::Grid;
use glam::Vec3;

/// No voxel, or no vertex.
const NONE: u32 = u32::MAX;

/// A mesh over the voxels as a flight of steps: the front of every voxel that has none right before
/// it, in the middle of its depth; and where two voxels lie right behind each other, walls from one to
/// the next on the sides on which the nearer has no neighbour.
///
/// Every line of sight that meets a voxel, and from one layer to the next moves by at most a texel
/// along one axis, meets the mesh no later: if the voxel's front is there, it meets that. If not,
/// there is a voxel right before it, which the line passes on one side, and comes in between the two
/// through the wall. A line that moves diagonally can come in round a corner of the nearer layer,
/// within a texel of the surface's border.
/// (Jeschke, 2005, section 4.4, uses twelve rules and four vertices a voxel. Voxels share their
/// corners here, so there are about half as many triangles, and one-sided: they face the viewers.)
///
/// Two voxels side by side, of which both are seen, are touched by triangles that share an edge.
/// Vertices lie where four voxels meet, so there are no T-vertices; where voxels touch in an edge or
/// a corner only, an edge can have four triangles.
///
/// Takes time in proportion to voxels, and memory for two layers besides.
///
/// # Panics
///
/// When a voxel lies outside of its layer.
pub fn initial_mesh(voxels: &VoxelLayers<'_>) -> Mesh {
    let (width, height) = (voxels.width as usize, voxels.height as usize);
    let mut mesh = Mesh::default();
    let mut stood_for = vec![false; voxels.layers.iter().map(Vec::len).sum()];
    let mut before = Layer::empty(width, height);
    let mut first = 0;
    let mut positions_before: &[[u16; 2]] = &[];
    for (l, positions) in voxels.layers.iter().enumerate() {
        let mut here = Layer::empty(width, height);
        let middle = |l| voxels.middle(l);
        for (id, [x, y]) in (first..).zip(positions) {
            here.voxels[(usize::from(*x) + 1, usize::from(*y) + 1)] = id;
        }
        let mut steps = Steps {
            mesh: &mut mesh,
            stood_for: &mut stood_for,
            depths: [l.checked_sub(1).map_or(0.0, middle), middle(l)],
            before: &mut before,
            here: &mut here,
        };
        for [x, y] in positions_before {
            steps.add_walls(usize::from(*x), usize::from(*y));
        }
        for [x, y] in positions {
            steps.add_front(usize::from(*x), usize::from(*y));
        }
        positions_before = positions;
        first += positions.len() as u32;
        before = here;
    }
    mesh
}

/// The voxels of a layer, with a border of none, and the vertices at their corners in the middle of
/// its depth.
struct Layer {
    voxels: Grid<u32>,
    vertices: Grid<u32>,
}

impl Layer {
    fn empty(width: usize, height: usize) -> Self {
        Self {
            voxels: Grid::filled(width + 2, height + 2, NONE),
            vertices: Grid::filled(width + 1, height + 1, NONE),
        }
    }

    /// The voxel `dx` columns and `dy` rows from (x, y).
    fn voxel(&self, x: usize, y: usize, [dx, dy]: [isize; 2]) -> u32 {
        let at = |i: usize, d: isize| (i + 1).wrapping_add_signed(d);
        self.voxels[(at(x, dx), at(y, dy))]
    }
}

struct Steps<'a> {
    mesh: &'a mut Mesh,
    /// Which voxels have a triangle.
    stood_for: &'a mut [bool],
    /// Of the layer before and this one.
    depths: [f32; 2],
    before: &'a mut Layer,
    here: &'a mut Layer,
}

/// The sides of a voxel: where the neighbour is, and the corners of its front on that side, in the
/// order in which the front has them.
const SIDES: [([isize; 2], [[usize; 2]; 2]); 4] = [
    ([-1, 0], [[0, 0], [0, 1]]),
    ([0, 1], [[0, 1], [1, 1]]),
    ([1, 0], [[1, 1], [1, 0]]),
    ([0, -1], [[1, 0], [0, 0]]),
];

impl Steps<'_> {
    fn add_front(&mut self, x: usize, y: usize) {
        if self.before.voxel(x, y, [0, 0]) == NONE {
            let corners = SIDES.map(|(_, [from, _])| self.vertex_here(x, y, from));
            self.add_quad(corners, &[self.here.voxel(x, y, [0, 0])]);
        }
    }

    /// The walls between the sides of a voxel of the layer before and the next layer.
    fn add_walls(&mut self, x: usize, y: usize) {
        let voxels = [
            self.before.voxel(x, y, [0, 0]),
            self.here.voxel(x, y, [0, 0]),
        ];
        if voxels[1] == NONE {
            return;
        }
        for (side, [from, to]) in SIDES {
            if self.before.voxel(x, y, side) == NONE {
                let wall = [
                    self.vertex_before(x, y, to),
                    self.vertex_before(x, y, from),
                    self.vertex_here(x, y, from),
                    self.vertex_here(x, y, to),
                ];
                self.add_quad(wall, &voxels);
            }
        }
    }

    fn add_quad(&mut self, [a, b, c, d]: [u32; 4], voxels: &[u32]) {
        let is_first = |voxel: &&u32| !std::mem::replace(&mut self.stood_for[**voxel as usize], true);
        let stood_for = voxels.iter().filter(is_first).copied().collect();
        self.mesh.triangles.extend([[a, b, c], [a, c, d]]);
        self.mesh.voxels.extend([stood_for, Vec::new()]);
    }

    fn vertex_here(&mut self, x: usize, y: usize, [dx, dy]: [usize; 2]) -> u32 {
        vertex(self.mesh, self.here, [x + dx, y + dy], self.depths[1])
    }

    fn vertex_before(&mut self, x: usize, y: usize, [dx, dy]: [usize; 2]) -> u32 {
        vertex(self.mesh, self.before, [x + dx, y + dy], self.depths[0])
    }
}

fn vertex(mesh: &mut Mesh, layer: &mut Layer, [x, y]: [usize; 2], depth: f32) -> u32 {
    let vertex = &mut layer.vertices[(x, y)];
    if *vertex == NONE {
        *vertex = mesh.positions.len() as u32;
        mesh.positions.push(Vec3::new(x as f32, y as f32, depth));
    }
    *vertex
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
            let mesh = initial_mesh(&layers);
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
            let mesh = initial_mesh(&layers);
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
        let mesh = initial_mesh(&blob.layers());
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
