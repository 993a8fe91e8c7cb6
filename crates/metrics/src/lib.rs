#![doc = include_str!("../README.md")]

mod coverage;
mod gaps;
mod layers;

pub use coverage::{Coverage, coverage, covered_in_any_sample, phantom_pixels};
pub use gaps::gap_pixels;
pub use layers::{NONE, layer_indices};
