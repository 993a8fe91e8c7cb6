//! From a formula for colour to an image, and the brushes the formulas use.

use farfield_scene::Image;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// A formula for what a texture shows, and how large it is meant to be.
pub(crate) struct Painting {
    name: &'static str,
    size: u32,
    color: Box<dyn Fn(Vec2) -> Vec3 + Send + Sync>,
    alpha: Option<Box<dyn Fn(Vec2) -> f32 + Send + Sync>>,
}

/// How finely a painting is painted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Detail {
    /// At its size, with four samples a texel: for what stands alone.
    Full,
    /// At half its size, with two samples a texel: an eighth of the time, for what stands in a
    /// crowd.
    Half,
}

/// A painting of `size` x `size` texels.
///
/// `color` takes texture coordinates in [0, 1), v downwards, and gives sRGB in [0, 1]; what lies
/// outside is clamped.
pub(crate) fn paint(
    name: &'static str,
    size: u32,
    color: impl Fn(Vec2) -> Vec3 + Send + Sync + 'static,
) -> Painting {
    Painting {
        name,
        size,
        color: Box::new(color),
        alpha: None,
    }
}

impl Painting {
    /// The painting with holes where `alpha` is below one half.
    ///
    /// Colours are wanted in the holes too: they show along the rims.
    pub(crate) fn cut_out(self, alpha: impl Fn(Vec2) -> f32 + Send + Sync + 'static) -> Self {
        Self {
            alpha: Some(Box::new(alpha)),
            ..self
        }
    }

    /// Paints it: each texel is the mean of its samples.
    pub(crate) fn image(&self, detail: Detail) -> Image {
        let (size, offsets): (u32, &[[f32; 2]]) = match detail {
            Detail::Full => (
                self.size,
                &[[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]],
            ),
            Detail::Half => (self.size / 2, &[[0.25, 0.25], [0.75, 0.75]]),
        };
        let texel = |i: u32| {
            let corner = Vec2::new((i % size) as f32, (i / size) as f32);
            let at = |offset: &[f32; 2]| (corner + Vec2::from(*offset)) / size as f32;
            let colors = offsets.iter().map(|offset| (self.color)(at(offset)));
            let mean = colors.sum::<Vec3>() / offsets.len() as f32;
            let byte = |c: f32| (c * 255.0).round() as u8;
            let [r, g, b] = mean.to_array().map(byte);
            let alpha = self.alpha.as_ref().map_or(255, |alpha| {
                let sum: f32 = offsets.iter().map(|offset| alpha(at(offset))).sum();
                byte(sum / offsets.len() as f32)
            });
            [r, g, b, alpha]
        };
        Image {
            name: self.name.into(),
            width: size,
            height: size,
            texels: (0..size * size).into_par_iter().map(texel).collect(),
        }
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

/// Linear light from sRGB, both in [0, 1], after IEC 61966-2-1.
pub(crate) fn linear(srgb: Vec3) -> Vec3 {
    srgb.map(|c| match c <= 0.04045 {
        true => c / 12.92,
        false => ((c + 0.055) / 1.055).powf(2.4),
    })
}
