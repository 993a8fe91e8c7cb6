#![doc = include_str!("../README.md")]

mod spacing;

mod depth_range;

mod stack;

mod cubic;

mod texel;

mod plan;

mod guarantee;

#[cfg(test)]
mod testing;

pub use depth_range::{border_between, depth_range_behind};
pub use guarantee::{Guarantee, InconsistentStack, guarantee};
pub use plan::{
    Aim, PlanError, PromisedCamera, ReferenceView, box_corners, plan, reference_view,
    reference_view_of_hull,
};
pub use spacing::{displacement, next_layer};
pub use stack::{
    Bounds, Layer, LayerStack, MAX_LAYERS, MAX_TEXTURE_SIDE, Precision, SAFE_DISPARITY, StackError,
    corners_in_view, stack,
};
pub use texel::{smallest_texel, texel_size};
