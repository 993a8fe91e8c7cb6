#![doc = include_str!("../README.md")]

mod camera;
mod cell;
mod pose;
mod sequence;
mod sphere;

pub use camera::{Camera, Extent};
pub use cell::{ViewCell, lattice_viewpoints};
pub use pose::Pose;
pub use sequence::{low_discrepancy_point, random_point};
pub use sphere::{direction_at, sphere_direction};
