#![doc = include_str!("../README.md")]

mod gltf;
mod normals;
mod notes;
mod pictures;
mod read;
mod recentre;

pub use gltf::{GltfError, Load, read_gltf};
pub use read::{ImportError, Imported, read};
