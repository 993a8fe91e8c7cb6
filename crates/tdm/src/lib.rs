#![doc = include_str!("../README.md")]

mod charts;
mod initial;
mod mesh;
mod simplify;
#[cfg(test)]
mod testing;
mod touch;

pub use charts::{Chart, ChartTexel, charts};
pub use initial::initial_mesh;
pub use mesh::{Mesh, VoxelLayers};
pub use simplify::{Simplified, simplify};
