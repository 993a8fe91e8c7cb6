#![doc = include_str!("../README.md")]

mod area;
mod box_growing;
mod cover;
mod price;
mod rework;
#[cfg(test)]
mod shapes;
mod split;

pub use box_growing::{Growth, grow_boxes};
pub use cover::cover;
pub use price::{Price, count_padded_texels};
