#![doc = include_str!("../README.md")]

mod device;

mod binding;
mod camera;
mod geometry;
mod levels;
mod scene;
mod shaders;

mod pictures;
mod readback;
mod timer;

mod display;
mod ids;

mod canvas;
mod comparison;

mod layers;
mod placed;

pub use device::{Gpu, GpuError};

pub use geometry::Draws;
pub use scene::GpuScene;

pub use camera::Lighting;

pub use canvas::Canvas;
pub use comparison::{Compared, Comparison};
pub use display::{Display, Picture};
pub use ids::{IdBuffers, NONE, Seen};
pub use layers::{LayerSearch, Touch, Touches};

pub use wgpu;
