#![doc = include_str!("../README.md")]

mod bit_mask;
mod grid;
mod rect;

pub use bit_mask::BitMask;
pub use grid::Grid;
pub use rect::Rect;
