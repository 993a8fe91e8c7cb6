#![doc = include_str!("../README.md")]

mod check;
mod clip;
mod flatten;
mod join;
mod material;
mod scene;
mod selection;
#[cfg(test)]
mod testing;

pub use check::SceneError;
pub use material::{AlphaMode, Filter, Image, Material, Texture, Wrap};
pub use scene::{Mesh, Object, Scene};
