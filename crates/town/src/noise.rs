//! Repeatable randomness for textures: hashes and value noise that tiles.

use glam::Vec2;

/// A number in [0, 1) for each cell of the lattice, unrelated to those of the neighbours.
pub(crate) fn random(cell: [i32; 2], seed: u32) -> f32 {
    let [x, y] = cell.map(|i| i as u32);
    let mixed = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841);
    let x = scramble(mixed ^ seed.wrapping_mul(0xcb1a_b31f));
    // 24 bits fill the significand, so that the result stays below 1.
    (x >> 8) as f32 / (1 << 24) as f32
}

/// A seed below 2^24, so that small numbers can be added to it.
pub(crate) fn fold(seed: u64) -> u32 {
    scramble(seed as u32 ^ scramble((seed >> 32) as u32)) >> 8
}

/// Mixes all bits of a word into all others: xor-shifts and odd multipliers, a bijection.
fn scramble(mut x: u32) -> u32 {
    x = x.wrapping_add(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x21f0_aaad);
    x = (x ^ (x >> 15)).wrapping_mul(0x735a_2d97);
    x ^ (x >> 15)
}

/// Smooth noise in [0, 1] that repeats with the unit square.
///
/// * `at` - 1 is one repetition
/// * `cells` - bumps in a repetition, along u and along v
/// * `octaves` - each adds detail of half the size and half the strength
pub(crate) fn fractal(at: Vec2, cells: [i32; 2], octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut weights) = (0.0, 1.0, 0.0);
    for octave in 0..octaves {
        let cells = cells.map(|n| n << octave);
        sum += weight * value_noise(at, cells, seed.wrapping_add(octave));
        weights += weight;
        weight *= 0.5;
    }
    sum / weights
}

/// Random values at lattice points, blended smoothly in between.
fn value_noise(at: Vec2, cells: [i32; 2], seed: u32) -> f32 {
    let axis = |t: f32, cells: i32| {
        let t = t * cells as f32;
        // Rounds down; without a call of a library's floor, which took half of the time.
        let low = t as i32 - i32::from(t < t as i32 as f32);
        let f = t - low as f32;
        let low = low.rem_euclid(cells);
        let high = if low + 1 == cells { 0 } else { low + 1 };
        (low, high, f * f * (3.0 - 2.0 * f))
    };
    let (left, right, x) = axis(at.x, cells[0]);
    let (upper, lower, y) = axis(at.y, cells[1]);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |y| mix(random([left, y], seed), random([right, y], seed), x);
    mix(row(upper), row(lower), y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Noise stays in [0, 1] and shows the same in every repetition.
        #[test]
        fn noise_tiles(
            at in [0.0..1.0f32, 0.0..1.0], cells in [1..9i32, 1..9], octaves in 1..5u32,
            shift in [-2..3i32, -2..3], seed: u32,
        ) {
            let at = Vec2::from(at);
            let there = at + Vec2::new(shift[0] as f32, shift[1] as f32);
            let [a, b] = [at, there].map(|p| fractal(p, cells, octaves, seed));
            prop_assert!((0.0..=1.0).contains(&a));
            // Adding the shift, at most 3, rounds by 2^-22 at most; an octave with n cells has
            // slope 1.5 n, and n times its weight is the same for each: 1.5 * 8 * 5 * 2^-22,
            // along both axes.
            prop_assert!((a - b).abs() <= 120.0 / (1 << 22) as f32, "{a} {b}");
        }

        /// Random numbers fill [0, 1) evenly: the mean of n is within 5 standard errors of 1/2.
        #[test]
        fn random_numbers_are_even(seed: u32) {
            let n = 10_000;
            let mean = (0..n).map(|i| random([i % 100, i / 100], seed)).sum::<f32>() / n as f32;
            prop_assert!((mean - 0.5).abs() < 5.0 * (1.0 / 12.0f32).sqrt() / (n as f32).sqrt());
        }
    }
}
