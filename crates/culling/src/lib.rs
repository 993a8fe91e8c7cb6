#![doc = include_str!("../README.md")]

mod culler;
mod umbra;

pub use culler::Culler;
pub use umbra::umbra_3x3;
