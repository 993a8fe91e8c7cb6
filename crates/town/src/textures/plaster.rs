//! Lime plaster.

use crate::canvas::{Painting, paint, smooth};
use crate::noise::fractal;
use glam::Vec3;

/// Nearly white, to be tinted, with the trowel's clouds and faint streaks of rain; 3 m.
pub(crate) fn plaster(seed: u32) -> Painting {
    paint("plaster", 512, move |uv| {
        let cloud = fractal(uv, [5, 5], 3, seed + 61) - 0.5;
        let streak = fractal(uv, [30, 3], 2, seed + 62) - 0.5;
        let patch = smooth(0.62, 0.72, fractal(uv, [3, 4], 2, seed + 63));
        Vec3::splat(0.93 * (1.0 + 0.12 * cloud + 0.07 * streak - 0.05 * patch))
    })
}
