//! What one walks on: setts, flagstones, grass; and rock.

use crate::canvas::{Painting, paint, smooth, srgb};
use crate::noise::{fractal, random};
use glam::{Vec2, Vec3};

/// Setts of 12 cm in rows, pale where they are worn; 3 m.
pub(crate) fn setts(seed: u32) -> Painting {
    let tones = [0xa09888, 0x948c7e, 0xaaa292, 0x8d867a, 0xa59b87].map(srgb);
    paint("setts", 512, move |uv| {
        let (stone, inside) = in_rows(uv, [22, 24], seed + 71);
        let tone = tones[(random(stone, seed + 72) * 5.0) as usize];
        let worn = fractal(uv, [4, 4], 2, seed + 73) - 0.5;
        tone * (1.0 + 0.2 * worn) * (0.72 + 0.28 * smooth(0.02, 0.2, inside))
    })
}

/// Sandstone flags of half a metre; 4 m.
pub(crate) fn flags(seed: u32) -> Painting {
    let tones = [0xc9bb9c, 0xbfb192, 0xd1c4a6, 0xb8ab90, 0xc6b797].map(srgb);
    paint("flags", 512, move |uv| {
        let (stone, inside) = in_rows(uv, [7, 8], seed + 74);
        let tone = tones[(random(stone, seed + 75) * 5.0) as usize];
        let worn = fractal(uv, [6, 6], 3, seed + 76) - 0.5;
        tone * (1.0 + 0.18 * worn) * (0.75 + 0.25 * smooth(0.0, 0.05, inside))
    })
}

/// The stone at a point of a bond, and the distance to its edge in heights of a row.
fn in_rows(uv: Vec2, [across, rows]: [i32; 2], seed: u32) -> ([i32; 2], f32) {
    let wander = fractal(uv, [12, 12], 1, seed) - 0.5;
    let v = uv.y * rows as f32 + 0.2 * wander;
    let row = v.floor();
    let shift = 0.5 * (row as i32).rem_euclid(2) as f32;
    let u = uv.x * across as f32 + shift + 0.2 * wander;
    let edge = |t: f32| 0.5 - (t - t.floor() - 0.5).abs();
    let stone = [
        (u.floor() as i32).rem_euclid(across),
        (row as i32).rem_euclid(rows),
    ];
    (stone, edge(u).min(edge(v)))
}

/// A meadow with drier patches; 6 m.
pub(crate) fn grass(seed: u32) -> Painting {
    paint("grass", 512, move |uv| {
        let patch = fractal(uv, [4, 4], 3, seed + 81);
        let blades = fractal(uv, [60, 60], 2, seed + 82) - 0.5;
        let tone = srgb(0x647f38).lerp(srgb(0x93a04e), smooth(0.3, 0.75, patch));
        tone * (1.0 + 0.35 * blades)
    })
}

/// Layered grey rock, moss on its ledges; 6 m.
pub(crate) fn rock(seed: u32) -> Painting {
    paint("rock", 512, move |uv| {
        let strata = fractal(uv, [3, 14], 3, seed + 84);
        let cracks = (fractal(uv, [9, 6], 3, seed + 85) - 0.5).abs();
        let moss = smooth(0.55, 0.7, fractal(uv, [6, 6], 3, seed + 86));
        let stone: Vec3 = srgb(0x857d70).lerp(srgb(0xb3a998), strata);
        (stone * (0.72 + 0.28 * smooth(0.0, 0.05, cracks))).lerp(srgb(0x6f7a45), 0.5 * moss)
    })
}
