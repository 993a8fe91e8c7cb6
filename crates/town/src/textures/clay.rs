//! Clay roof tiles, and slates.

use crate::canvas::{Painting, paint, smooth, srgb};
use crate::noise::{fractal, random};

/// Tiles side by side, and courses; even, because every other course is shifted by half a tile.
const TILES: i32 = 16;
const _: () = assert!(TILES % 2 == 0);

/// Plain tiles of 25 cm with rounded lower ends, in courses that overlap; 4 m.
pub(crate) fn tiles(seed: u32) -> Painting {
    let tones = [0xb9553b, 0xaa4a33, 0xc46447, 0x9c4432, 0xb25841, 0xbf6c4f].map(srgb);
    paint("tiles", 512, move |uv| {
        let at = uv * TILES as f32;
        let course = at.y.floor() as i32;
        let down = at.y - at.y.floor();
        // The tile above lies on this one and reaches over it with its rounded end.
        let (above, over) = column(at.x, course - 1);
        let rim = 0.32 * (1.0 - (2.0 * over - 1.0).powi(2)) + 0.06;
        let (tile, across, from_top, to_rim) = match down < rim {
            true => ([above, course - 1], over, 1.0 + down, rim - down),
            false => {
                let (own, across) = column(at.x, course);
                ([own, course], across, down, 1.0)
            }
        };
        let tile = tile.map(|i| i.rem_euclid(TILES));
        let tone =
            tones[(random(tile, seed) * 6.0) as usize] * (0.92 + 0.16 * random(tile, seed + 1));
        let weather = fractal(uv, [4, 4], 3, seed + 2) - 0.5;
        let grain = fractal(uv, [48, 24], 2, seed + 3) - 0.5;
        // Dark in the tile above's shadow and between neighbours, bright along the rim.
        let shadow = match to_rim < 1.0 {
            true => 1.0,
            false => 0.5 + 0.5 * smooth(0.0, 0.3, down - rim),
        };
        let gap = 0.72 + 0.28 * smooth(0.0, 0.09, across.min(1.0 - across));
        let lip = 1.0 + 0.14 * (1.0 - smooth(0.02, 0.12, to_rim));
        let slope = 0.94 + 0.06 * from_top;
        let lichen = smooth(0.2, 0.36, fractal(uv, [9, 9], 3, seed + 4) - 0.42);
        let clay = tone * (1.0 + 0.3 * weather + 0.22 * grain);
        clay.lerp(srgb(0x9a8a5e), 0.3 * lichen) * shadow * gap * lip * slope
    })
}

/// Blue-grey slates of 25 cm in courses; 4 m.
pub(crate) fn slates(seed: u32) -> Painting {
    paint("slates", 512, move |uv| {
        let at = uv * TILES as f32;
        let course = at.y.floor() as i32;
        let (slate, across) = column(at.x, course);
        let slate = [slate, course].map(|i| i.rem_euclid(TILES));
        let tone = srgb(0x5c6672).lerp(srgb(0x7d848c), random(slate, seed + 7));
        let weather = fractal(uv, [5, 5], 3, seed + 8) - 0.5;
        let shadow = 0.6 + 0.4 * smooth(0.0, 0.25, at.y - at.y.floor());
        let gap = 0.75 + 0.25 * smooth(0.0, 0.08, across.min(1.0 - across));
        tone * (1.0 + 0.3 * weather) * shadow * gap
    })
}

/// The tile of a course at `x`, and how far across it.
fn column(x: f32, course: i32) -> (i32, f32) {
    let x = x + 0.5 * course.rem_euclid(2) as f32;
    (x.floor() as i32, x - x.floor())
}
