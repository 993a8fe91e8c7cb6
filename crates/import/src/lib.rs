#![doc = include_str!("../README.md")]

mod assemble;
mod gltf;
mod mesh_error;
mod normals;
mod notes;
mod obj;
mod pictures;
mod ply;
mod polygons;
mod read;
mod recentre;

pub use gltf::{GltfError, read_gltf};
pub use mesh_error::MeshFileError;
pub use obj::read_obj;
pub use ply::read_ply;
pub use read::{ImportError, Imported, Load, read};
