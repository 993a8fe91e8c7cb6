#![doc = include_str!("../README.md")]

mod geometry;
mod textures;

mod masked;
mod surface;

mod light;

mod rasterize;

mod contest;
mod coverage;
mod piece;
mod record;
mod texel_search;
mod touches;

mod nearest;
mod trace;

pub use geometry::seen_bounds;
pub use light::{Lighting, lit_color};
pub use nearest::NearestPoints;
pub use rasterize::{NONE, Visibility, rasterize, shade, surfaces};

pub use record::{Foliage, LayerMasks, Recording, Sample, record, sample_colors, sample_surfaces};
pub use surface::{Hit, Surface, surface_at};
pub use textures::{Textures, linear_from_srgb, srgb_from_linear};
pub use touches::{Touch, record_touches};
pub use trace::Tracer;
