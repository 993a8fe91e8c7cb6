//! Copper sheets and the clock.

use crate::canvas::{Painting, along_and_distance, paint, smooth, srgb};
use crate::noise::{fractal, random};
use glam::Vec2;

/// Green copper in sheets of 50 cm with standing seams and streaks; 2 m.
pub(crate) fn copper(seed: u32) -> Painting {
    paint("copper", 256, move |uv| {
        let sheet = uv * 4.0;
        let tone = random([sheet.x as i32, sheet.y as i32], seed);
        let streak = fractal(uv, [32, 3], 3, seed + 1);
        let patina = srgb(0x4f9c86).lerp(srgb(0x7cc0a6), 0.35 * tone + 0.6 * streak - 0.1);
        let seam = 0.5 - (sheet.x - sheet.x.floor() - 0.5).abs();
        let lap = sheet.y - sheet.y.floor();
        let worn = smooth(0.62, 0.8, fractal(uv, [6, 6], 4, seed + 2));
        patina.lerp(srgb(0x5a4a3a), 0.5 * worn)
            * (0.7 + 0.3 * smooth(0.02, 0.06, seam))
            * (0.8 + 0.2 * smooth(0.0, 0.06, lap))
    })
}

/// A clock at eight minutes past ten, in the disc inscribed into the texture.
pub(crate) fn clock() -> Painting {
    let (ink, gold) = (srgb(0x1d2b3d), srgb(0xe0b04c));
    paint("clock", 256, move |uv| {
        let p = Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
        let radius = p.length();
        let hour = |n: u32| Vec2::from_angle((3.0 - n as f32) * std::f32::consts::FRAC_PI_6);
        let mark = (0..12)
            .map(|n| {
                let thickness = if n % 3 == 0 { 0.045 } else { 0.025 };
                along_and_distance(p, hour(n) * 0.66, hour(n) * 0.82).1 - thickness
            })
            .fold(1.0, f32::min);
        let hand = |turns: f32, length: f32, thickness: f32| {
            let toward = Vec2::from_angle((0.25 - turns) * std::f32::consts::TAU);
            let (along, distance) = along_and_distance(p, toward * -0.12, toward * length);
            distance - thickness * (1.0 - 0.6 * along / (length + 0.12))
        };
        let hands = hand(10.13 / 12.0, 0.46, 0.055).min(hand(8.0 / 60.0, 0.7, 0.045));
        let face = srgb(0xf6eed8) * (1.0 - 0.12 * radius * radius);
        let ring = (radius - 0.9).abs() - 0.035;
        let inked = face
            .lerp(ink, smooth(0.012, 0.0, mark.min(hands).min(radius - 0.07)))
            .lerp(ink, smooth(0.012, 0.0, ring));
        inked.lerp(gold, smooth(0.925, 0.935, radius))
    })
}
