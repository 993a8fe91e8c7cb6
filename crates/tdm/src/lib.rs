#![doc = include_str!("../README.md")]

mod charts;
mod initial;
mod mesh;
mod near;
mod simplify;
#[cfg(test)]
mod testing;
mod touch;

pub use charts::{Chart, ChartTexel, charts};
pub use initial::initial_mesh;
pub use mesh::{Cuboid, Mesh, VoxelLayers, pieces};
pub use near::VoxelIndex;
pub use simplify::{Simplified, simplify};
