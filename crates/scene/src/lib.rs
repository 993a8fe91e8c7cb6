#![doc = include_str!("../README.md")]

mod check;
mod material;
mod scene;

pub use check::SceneError;
pub use material::{AlphaMode, Filter, Image, Material, Texture, Wrap};
pub use scene::{Mesh, Object, Scene};
