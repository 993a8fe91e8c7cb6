#![doc = include_str!("../README.md")]

mod paint;

mod quads;

mod read_back;

mod compose;

mod relight;

pub use compose::{compose_layer, opaque_texels};
pub use paint::{GUTTER, LayerTexels, Patch, blank_page, paint};
pub use quads::{ALPHA_CUTOFF, page_scene, place_as_object, quad_scene};
pub use read_back::{Damage, QuadError, patches_of};
pub use relight::{LightPages, make_lit, normal_texel};
