#![doc = include_str!("../README.md")]

mod charts;
mod closing;
mod coverage;
mod faces;
mod flaps;
mod initial;
mod joints;
mod mesh;
mod near;
mod reach;
mod simplify;
#[cfg(test)]
mod testing;
mod touch;

pub use charts::{Chart, ChartTexel, charts};
pub use closing::{rectangles, shrunk};
pub use coverage::touched;
pub use initial::initial_mesh;
pub use mesh::{Cuboid, Mesh, VoxelLayers, pieces};
pub use near::VoxelIndex;
pub use simplify::{Simplified, simplify};
