//! Points that fill a cube evenly, however many are taken.

use glam::DVec3;

/// Point `index` of a low-discrepancy sequence in the unit cube; each `seed` shifts the
/// sequence by another offset.
///
/// The additive recurrence of the plastic number's generalisation to three dimensions: the
/// powers of 1/g with g^4 = g + 1, as proposed by M. Roberts, The Unreasonable Effectiveness of
/// Quasirandom Sequences, 2018.
///
/// Coordinates lie in [0, 1). Beyond 2^40 points the coordinates' last digits wear off.
pub fn low_discrepancy_point(index: u64, seed: u64) -> DVec3 {
    const G: f64 = 1.220_744_084_605_759_5;
    let step = DVec3::new(1.0 / G, 1.0 / (G * G), 1.0 / (G * G * G));
    let shift = DVec3::new(hash(seed, 1), hash(seed, 2), hash(seed, 3));
    (shift + index as f64 * step).fract()
}

/// Point `index` of a sequence of points in the unit cube that have nothing to do with each other, nor
/// with those of [`low_discrepancy_point`]: for what is to vary independently of these. Each `seed`
/// gives another sequence.
///
/// Coordinates lie in [0, 1).
pub fn random_point(index: u64, seed: u64) -> DVec3 {
    // Seeds that follow each other must not give each other's points.
    let point = index.wrapping_add(seed.wrapping_mul(0xd134_2543_de82_ef95));
    DVec3::new(hash(point, 1), hash(point, 2), hash(point, 3))
}

/// A number in [0, 1) that varies with every bit of its arguments (the finaliser of splitmix64).
fn hash(seed: u64, axis: u64) -> f64 {
    let mut h = seed.wrapping_add(axis.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((h ^ (h >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of points in any box at the origin is close to its volume: with 1,000 points
    /// the largest deviation over a lattice of boxes stays below 0.012, where independent random
    /// points reach about 0.03.
    #[test]
    fn points_are_spread_evenly() {
        for seed in 0..4 {
            let points: Vec<_> = (0..1000).map(|i| low_discrepancy_point(i, seed)).collect();
            assert!(
                points
                    .iter()
                    .all(|p| p.min_element() >= 0.0 && p.max_element() < 1.0)
            );
            for n in 0..512u32 {
                let corner = DVec3::new(
                    f64::from(n & 7) + 1.0,
                    f64::from(n >> 3 & 7) + 1.0,
                    f64::from(n >> 6) + 1.0,
                ) / 8.0;
                let inside = points.iter().filter(|p| p.cmplt(corner).all()).count();
                let deviation = inside as f64 / 1000.0 - corner.element_product();
                assert!(
                    deviation.abs() < 0.012,
                    "{deviation} below {corner}, seed {seed}"
                );
            }
        }
    }

    #[test]
    fn seeds_give_other_points() {
        assert_ne!(low_discrepancy_point(0, 0), low_discrepancy_point(0, 1));
    }

    /// Whatever a point of the even sequence is, the random one beside it may be any: of 4,000 pairs
    /// no share of the 4 x 4 boxes that they fall into is off by more than six standard deviations.
    #[test]
    fn random_points_are_independent() {
        for (seed, axes) in [(0, [0, 0]), (1, [0, 1]), (2, [2, 2])] {
            let mut counts = [0; 16];
            for index in 0..4000 {
                let even = low_discrepancy_point(index, seed)[axes[0]];
                let random = random_point(index, seed)[axes[1]];
                assert!((0.0..1.0).contains(&random));
                counts[(even * 4.0) as usize * 4 + (random * 4.0) as usize] += 1;
            }
            // 250 expected, with a deviation of the square root of 4000 (1/16) (15/16).
            let off = |count: i32| f64::from((count - 250).abs()) > 6.0 * 15.3;
            assert!(!counts.into_iter().any(off), "{counts:?}");
        }
        assert_ne!(random_point(0, 0), random_point(0, 1));
        assert_ne!(random_point(1, 0), random_point(0, 1));
    }
}
