//! Voxels and meshes over them.

use glam::Vec3;

/// The voxels that can be seen: texels of layers, front to back.
///
/// Coordinates are those of the warped grid (Jeschke, 2005, section 4.3): voxel (i, j) of layer l
/// covers [i, i + 1] x [j, j + 1] x [l - 1/2, l + 1/2], x to the right, y down and z away from the
/// viewers, whatever its size in the world. In it lengths are about what they are on the screen.
#[derive(Clone, Copy, Debug)]
pub struct VoxelLayers<'a> {
    /// Columns of every layer.
    pub width: u32,
    /// Rows of every layer.
    pub height: u32,
    /// Column and row of each voxel, layer by layer, each layer row by row. Their order over all
    /// layers numbers the voxels.
    pub layers: &'a [Vec<[u16; 2]>],
}

impl VoxelLayers<'_> {
    /// The centres of all voxels.
    pub fn centers(&self) -> Vec<Vec3> {
        let layers = self.layers.iter().enumerate();
        layers
            .flat_map(|(l, layer)| {
                let at = move |[x, y]: &[u16; 2]| {
                    Vec3::new(f32::from(*x) + 0.5, f32::from(*y) + 0.5, l as f32)
                };
                layer.iter().map(at)
            })
            .collect()
    }
}

/// A mesh in the warped grid, and which voxels its triangles stand for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Places of the vertices.
    pub positions: Vec<Vec3>,
    /// Three vertices each, counter-clockwise seen from before the first layer.
    pub triangles: Vec<[u32; 3]>,
    /// Of each triangle the voxels that it touches and stands for; a voxel has at least one
    /// triangle.
    pub voxels: Vec<Vec<u32>>,
}
