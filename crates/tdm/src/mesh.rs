//! Voxels and meshes over them.

use farfield_grid::BitMask;
use glam::Vec3;

/// The voxels that can be seen: texels of layers, front to back.
///
/// Coordinates are those of the warped grid (Jeschke, 2005, section 4.3): voxel (i, j) of layer l
/// covers `[i, i + 1] x [j, j + 1] x [borders[l], borders[l + 1]]`, x to the right, y down and z away
/// from the viewers, whatever its size in the world. In it lengths are about what they are on the
/// screen.
///
/// If z is an affine function of 1 / depth, the grid is a projection of the world: what is straight
/// and flat here is so in the world too, and what is found out about triangles here is true of those
/// that are displayed. (The paper counts layers, which is that only where they are spaced evenly.)
#[derive(Clone, Copy, Debug)]
pub struct VoxelLayers<'a> {
    /// Columns of every layer.
    pub width: u32,
    /// Rows of every layer.
    pub height: u32,
    /// Column and row of each voxel, layer by layer, each layer row by row. Their order over all
    /// layers numbers the voxels.
    pub layers: &'a [Vec<[u16; 2]>],
    /// Texels of each layer that lines of sight reach: those with voxels, and those that are passed.
    pub reached: &'a [BitMask],
    /// Where layers begin and end, ascending: one more than there are layers. About 1 apart, so that
    /// voxels are about cubes.
    pub borders: &'a [f32],
}

impl VoxelLayers<'_> {
    /// The middle of a layer.
    pub(crate) fn middle(&self, layer: usize) -> f32 {
        (self.borders[layer] + self.borders[layer + 1]) / 2.0
    }

    /// All voxels as boxes, each enlarged about its centre by a factor.
    ///
    /// # Panics
    ///
    /// When there are not as many borders as layers and one.
    pub fn boxes(&self, enlarged: f32) -> Vec<Cuboid> {
        assert_eq!(
            self.borders.len(),
            self.layers.len() + 1,
            "borders of layers"
        );
        let count = self.layers.iter().map(Vec::len).sum();
        let mut boxes = Vec::with_capacity(count);
        for (l, layer) in self.layers.iter().enumerate() {
            let z = self.middle(l);
            let thickness = self.borders[l + 1] - self.borders[l];
            let half = Vec3::new(1.0, 1.0, thickness) * (enlarged / 2.0);
            boxes.extend(layer.iter().map(|[x, y]| Cuboid {
                center: Vec3::new(f32::from(*x) + 0.5, f32::from(*y) + 0.5, z),
                half,
            }));
        }
        boxes
    }
}

/// A box with sides along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Its middle.
    pub center: Vec3,
    /// Half of each side.
    pub half: Vec3,
}

/// A mesh in the warped grid, and which voxels its triangles stand for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Places of the vertices.
    pub positions: Vec<Vec3>,
    /// Three vertices each, counter-clockwise seen from before the first layer.
    pub triangles: Vec<[u32; 3]>,
    /// Of each triangle the voxels that it touches and stands for; a voxel has at most one triangle.
    pub voxels: Vec<Vec<u32>>,
}

/// Number of pieces of a mesh that do not hang together over vertices.
pub fn pieces(triangles: &[[u32; 3]]) -> usize {
    let count = triangles.iter().flatten().max().map_or(0, |last| last + 1);
    let mut joined: Vec<u32> = (0..count).collect();
    for [a, b, c] in triangles {
        join(&mut joined, *a, *b);
        join(&mut joined, *b, *c);
    }
    let mut roots: Vec<u32> = triangles.iter().map(|t| root(&mut joined, t[0])).collect();
    roots.sort_unstable();
    roots.dedup();
    roots.len()
}

/// What stands for all that `at` is joined with: the least of them.
pub(crate) fn root(joined: &mut [u32], mut at: u32) -> u32 {
    while joined[at as usize] != at {
        joined[at as usize] = joined[joined[at as usize] as usize];
        at = joined[at as usize];
    }
    at
}

pub(crate) fn join(joined: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(joined, a), root(joined, b));
    joined[a.max(b) as usize] = a.min(b);
}
