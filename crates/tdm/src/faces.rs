//! The faces of voxels at which lines of sight meet them.

use crate::VoxelLayers;
use crate::reach::{Gap, Light};
use farfield_grid::Grid;

/// No voxel.
const NONE: u32 = u32::MAX;

/// A front, a wall or a back: four corners in order, counter-clockwise seen from where lines of sight
/// come.
pub(crate) struct Face {
    pub kind: Kind,
    /// From which lines of sight come.
    pub from: Gap,
    /// Which corners of the grid: column, row, layer.
    pub corners: [[u32; 3]; 4],
    /// The voxel at each corner, one in all of a front or a back, and two in a wall.
    pub voxels: [u32; 4],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
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
    light: &'a Light,
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

    fn gap(&self, [x, y]: [i32; 2]) -> Gap {
        [x, y, self.layer as i32]
    }

    /// Whether lines of sight pass in a column, or nearly so.
    fn is_open(&self, at: [i32; 2]) -> bool {
        !self.is_solid(at) && self.light.is_lit(self.gap(at))
    }

    fn is_solid(&self, at: [i32; 2]) -> bool {
        self.pair(at).iter().all(|voxel| *voxel != NONE)
    }
}

/// All faces where lines of sight pass, or nearly so.
pub(crate) fn faces(voxels: &VoxelLayers<'_>, light: &Light) -> Vec<Face> {
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
            light,
            layer: l,
            two_before: &two_before,
            before: &before,
            here: &here,
        };
        for [x, y] in positions_before {
            let at = [*x, *y].map(i32::from);
            faces.extend(back(&between, at));
        }
        for [x, y] in positions {
            let at = [*x, *y].map(i32::from);
            match between.is_solid(at) {
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
    between.is_open(at).then(|| Face {
        kind: Kind::Front,
        from: between.gap(at),
        corners: SIDES.map(|(_, [from, _])| corner(at, from, between.layer)),
        voxels: [between.pair(at)[1]; 4],
    })
}

/// The sides of two voxels behind each other, where lines pass beside.
fn walls(between: &Between<'_>, at: [i32; 2]) -> impl Iterator<Item = Face> {
    let [nearer, voxel] = between.pair(at);
    let layer = between.layer;
    SIDES.into_iter().filter_map(move |([dx, dy], [from, to])| {
        let beside = [at[0] + dx, at[1] + dy];
        between.is_open(beside).then(|| Face {
            kind: Kind::Wall,
            from: between.gap(beside),
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

/// The back of two voxels behind each other.
fn back(between: &Between<'_>, at: [i32; 2]) -> Option<Face> {
    let nearer = between.two_before[((at[0] + 1) as usize, (at[1] + 1) as usize)];
    (nearer != NONE && between.is_open(at)).then(|| {
        let mut corners = SIDES.map(|(_, [from, _])| corner(at, from, between.layer - 1));
        corners.reverse();
        Face {
            kind: Kind::Back,
            from: between.gap(at),
            corners,
            voxels: [between.pair(at)[0]; 4],
        }
    })
}
