#![doc = include_str!("../README.md")]

mod device;

mod camera;
mod geometry;
mod levels;
mod scene;
mod shaders;

mod pictures;
mod readback;

mod display;
mod ids;

mod layers;
mod placed;

pub use device::{Gpu, GpuError};

pub use geometry::Draws;
pub use scene::GpuScene;

pub use camera::Lighting;

pub use display::{Display, Picture};
pub use ids::{IdBuffers, NONE, Seen};
pub use layers::{LayerSearch, Touch, Touches};

pub use wgpu;
