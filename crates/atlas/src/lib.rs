#![doc = include_str!("../README.md")]

mod pages;
mod skyline;
mod waiting;

pub use pages::{Atlas, PackError, Placement, pack};
