#![doc = include_str!("../README.md")]

mod coverage;
mod gaps;
mod layers;

mod distribution;

mod parallax;
mod silhouette;

mod region;

mod color;
mod ssim;
mod stray;

#[cfg(feature = "flip")]
mod flip;

pub use color::{ColorDifference, Picture, color_difference};
pub use coverage::{Coverage, coverage, covered_in_any_sample, phantom_pixels};
pub use distribution::Distribution;
#[cfg(feature = "flip")]
pub use flip::{FlipErrors, flip_errors};
pub use gaps::{gap_pixels, greatest_of_nine};
pub use layers::{LayersSeen, NONE, layer_indices};
pub use parallax::{ParallaxErrors, RecordedFrom, mesh_parallax, parallax};
pub use region::compared_region;
pub use silhouette::{SilhouetteDisplacement, silhouette_displacement};
pub use ssim::ssim_errors;
pub use stray::{StrayColors, is_within, stray_colors};
