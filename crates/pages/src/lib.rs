#![doc = include_str!("../README.md")]

mod paint;
mod quads;

pub use paint::{GUTTER, LayerTexels, Patch, blank_page, paint};
pub use quads::{ALPHA_CUTOFF, quad_scene};
