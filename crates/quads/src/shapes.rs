//! Masks that ask for trouble, and what every set of rectangles must keep.

use farfield_grid::{BitMask, Rect};
use proptest::prelude::*;

/// The texels of a `width` x `height` grid for which `inside` holds.
pub(crate) fn mask_where(
    width: usize,
    height: usize,
    inside: impl Fn(usize, usize) -> bool,
) -> BitMask {
    let mut mask = BitMask::empty(width, height);
    for y in 0..height {
        for x in (0..width).filter(|&x| inside(x, y)) {
            mask.insert(x, y);
        }
    }
    mask
}

/// Discs, rings, frames, bands, lines, combs, lattices, leaves, noise, one texel, nothing and
/// everything, with widths around the borders of words.
pub(crate) fn masks() -> impl Strategy<Value = BitMask> {
    let width = prop_oneof![1..9usize, 30..34usize, 62..68usize, 126..131usize];
    let height = prop_oneof![1..9usize, 30..70usize];
    (width, height, 0..13u8, any::<[u8; 4]>(), any::<u64>()).prop_map(
        |(width, height, shape, [a, b, c, d], seed)| {
            let [a, b, c, d] = [a, b, c, d].map(usize::from);
            let (x0, y0) = (a % width, b % height);
            let (thick, step) = (1 + c % 5, 2 + d % 30);
            let radius = (1 + d % 40) as f64;
            let distance =
                move |x: usize, y: usize| (x as f64 - x0 as f64).hypot(y as f64 - y0 as f64);
            let noise = move |x: usize, y: usize| hash(seed, (y * width + x) as u64);
            mask_where(width, height, |x, y| match shape {
                0 => false,
                1 => true,
                2 => (x, y) == (x0, y0),
                3 => distance(x, y) < radius,
                4 => (radius - thick as f64..radius).contains(&distance(x, y)),
                5 => {
                    let edge = x.abs_diff(x0).max(y.abs_diff(y0));
                    (step..step + thick).contains(&edge)
                }
                6 => (x + y * (1 + d % 3) + a) % 61 < thick,
                7 => x == x0 || y == y0,
                8 => (x + a) % step < thick,
                9 => (y + b) % step < thick || (x + a) % (step + 3) < thick,
                10 => {
                    // One leaf in some of the cells of a lattice.
                    let (cx, cy) = (x / 12, y / 12);
                    let turn = if noise(cx, cy) < 0.5 {
                        x % 12
                    } else {
                        11 - x % 12
                    };
                    noise(cy, cx) < 0.4 && turn.abs_diff(y % 12) < thick
                }
                11 => noise(x, y) < c as f64 / 255.0,
                _ => noise(x / 3, y / 3) < c as f64 / 255.0,
            })
        },
    )
}

/// A number in [0, 1) for each of `index` (the finaliser of splitmix64).
pub(crate) fn hash(seed: u64, index: u64) -> f64 {
    let mut h = seed.wrapping_add((index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((h ^ (h >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Says what is wrong unless every opaque texel is in exactly one of `rects`, and these are
/// disjoint, inside the mask, not empty and tight.
pub(crate) fn check_rects(mask: &BitMask, rects: &[Rect]) -> Result<(), String> {
    let mut owner = vec![None; mask.width() * mask.height()];
    for (i, rect) in rects.iter().enumerate() {
        if rect.area() == 0 {
            return Err(format!("{rect:?} is empty"));
        }
        let (right, bottom) = (rect.right() as usize, rect.bottom() as usize);
        if right > mask.width() || bottom > mask.height() {
            return Err(format!("{rect:?} reaches out of the mask"));
        }
        let (left, top) = (rect.x as usize, rect.y as usize);
        for y in top..bottom {
            for x in left..right {
                if let Some(other) = owner[y * mask.width() + x].replace(i) {
                    return Err(format!("{rect:?} overlaps {:?}", rects[other]));
                }
            }
        }
        let row = |y| (left..right).any(|x| mask.contains(x, y));
        let column = |x| (top..bottom).any(|y| mask.contains(x, y));
        if !(row(top) && row(bottom - 1) && column(left) && column(right - 1)) {
            return Err(format!("{rect:?} is not tight"));
        }
    }
    match mask
        .iter()
        .find(|&(x, y)| owner[y * mask.width() + x].is_none())
    {
        Some((x, y)) => Err(format!("texel ({x}, {y}) is in no rectangle")),
        None => Ok(()),
    }
}
