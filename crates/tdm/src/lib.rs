#![doc = include_str!("../README.md")]

mod initial;
mod mesh;
mod simplify;
#[cfg(test)]
mod testing;
mod touch;

pub use initial::initial_mesh;
pub use mesh::{Mesh, VoxelLayers};
pub use simplify::{Simplified, simplify};
