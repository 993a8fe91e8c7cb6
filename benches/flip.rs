//! FLIP, a perceived difference of pictures
//! (P. Andersson et al., FLIP: A Difference Evaluator for Alternating Images, 2020).

use farfield_grid::{BitMask, Grid};
use nv_flip::FlipImageRgb8;

/// Of the viewer's screen; the paper's own setting.
const PIXELS_PER_DEGREE: f32 = 67.0;

/// Pixels around the region that its errors can depend on: at 67 pixels a degree the filter of
/// the contrast sensitivity reaches 10, that of features 9.
const REACH: usize = 12;

/// The sum of the errors in a region, each in [0, 1].
///
/// Pictures and region are equally large.
pub(crate) fn sum_errors(a: &Grid<[u8; 3]>, b: &Grid<[u8; 3]>, region: &BitMask) -> f64 {
    let Some(bounds) = region.bounds() else {
        return 0.0;
    };
    let (left, top) = (bounds.x as usize, bounds.y as usize);
    let (left, top) = (left.saturating_sub(REACH), top.saturating_sub(REACH));
    let right = (bounds.right() as usize + REACH).min(a.width());
    let bottom = (bounds.bottom() as usize + REACH).min(a.height());
    let cropped = |picture: &Grid<[u8; 3]>| {
        let rows = (top..bottom).flat_map(|y| &picture.row(y)[left..right]);
        let bytes: Vec<u8> = rows.flatten().copied().collect();
        FlipImageRgb8::with_data((right - left) as u32, (bottom - top) as u32, &bytes)
    };
    let errors = nv_flip::flip(cropped(a), cropped(b), PIXELS_PER_DEGREE).to_vec();
    let at = |(x, y): (usize, usize)| f64::from(errors[(y - top) * (right - left) + x - left]);
    region.iter().map(at).sum()
}
