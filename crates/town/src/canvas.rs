//! From a formula for colour to an image, and the brushes the formulas use.

use farfield_scene::Image;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// An image of `size` x `size` texels, each the mean of four samples of `color`.
///
/// `color` takes texture coordinates in [0, 1), v downwards, and gives sRGB in [0, 1]; what lies
/// outside is clamped.
pub(crate) fn paint(name: &str, size: u32, color: impl Fn(Vec2) -> Vec3 + Sync) -> Image {
    let texel = |i: u32| {
        let corner = Vec2::new((i % size) as f32, (i / size) as f32);
        let samples = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]
            .map(|offset| color((corner + Vec2::from(offset)) / size as f32));
        let mean = samples.iter().sum::<Vec3>() / 4.0;
        let [r, g, b] = mean.to_array().map(|c| (c * 255.0).round() as u8);
        [r, g, b, 255]
    };
    Image {
        name: name.into(),
        width: size,
        height: size,
        texels: (0..size * size).into_par_iter().map(texel).collect(),
    }
}

/// A colour from its sRGB bytes, 0xRRGGBB.
pub(crate) const fn srgb(hex: u32) -> Vec3 {
    Vec3::new(
        (hex >> 16) as f32 / 255.0,
        (hex >> 8 & 255) as f32 / 255.0,
        (hex & 255) as f32 / 255.0,
    )
}

/// 0 up to `from`, 1 from `to` on, a smooth step between; `from` may be the greater one.
pub(crate) fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Signed distance to an axis-parallel rectangle, negative inside.
pub(crate) fn distance_to_rect(p: Vec2, center: Vec2, half: Vec2) -> f32 {
    let d = (p - center).abs() - half;
    d.max(Vec2::ZERO).length() + d.max_element().min(0.0)
}

/// Where `p` lies relative to the segment from `a` to `b`: how far along, and the distance.
pub(crate) fn along_and_distance(p: Vec2, a: Vec2, b: Vec2) -> (f32, f32) {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    (t * axis.length(), p.distance(a + axis * t))
}
