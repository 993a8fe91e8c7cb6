//! How far from the model its viewers are.

use crate::Bitfield;
use glam::DVec3;

/// The distances from a model's centre at which it is looked at.
///
/// From near, more of what is in front is hidden by its own outline, and there are lines of sight
/// into openings that nobody has from afar, and the other way round: the set for a direction is
/// the union of what is seen from several distances in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distances {
    /// The least, in metres: positive, and so that no viewpoint is inside of the model.
    pub nearest: f64,
    /// The greatest, in metres: finite, and not below `nearest`.
    pub farthest: f64,
    /// Samples are taken at so many distances in each direction: two or more, one where `nearest`
    /// is `farthest`.
    pub samples: u32,
}

impl Distances {
    /// One distance only, in metres.
    pub fn only(distance: f64) -> Self {
        Self {
            nearest: distance,
            farthest: distance,
            samples: 1,
        }
    }

    /// The distance at a fraction of [0, 1] of the range, in metres: 0 is `nearest`, 1 is
    /// `farthest`.
    ///
    /// The reciprocal is linear in between: parallax changes with it, not with the distance.
    ///
    /// # Panics
    ///
    /// When the range is not positive, finite and ascending.
    pub fn at(&self, fraction: f64) -> f64 {
        let Self {
            nearest, farthest, ..
        } = *self;
        assert!(
            0.0 < nearest && nearest <= farthest && farthest.is_finite(),
            "{nearest} m to {farthest} m is no range of distances"
        );
        // Exact at either end.
        match fraction {
            0.0 => nearest,
            1.0 => farthest,
            _ => {
                (1.0 / ((1.0 - fraction) / nearest + fraction / farthest)).clamp(nearest, farthest)
            }
        }
    }

    /// Where to take samples: for each direction, which is of length 1, offsets from the centre at
    /// all distances, the nearest first, one direction after the other.
    ///
    /// # Panics
    ///
    /// When the range is not positive, finite and ascending, or there is no sample, or only one in
    /// a range that has a nearest and a farthest distance.
    pub fn viewpoints(&self, directions: &[DVec3]) -> Vec<DVec3> {
        let least = if self.nearest == self.farthest { 1 } else { 2 };
        assert!(
            self.samples >= least,
            "{} samples for distances from {} m to {} m",
            self.samples,
            self.nearest,
            self.farthest
        );
        let last = f64::from((self.samples - 1).max(1));
        let distances: Vec<f64> = (0..self.samples)
            .map(|i| self.at(f64::from(i) / last))
            .collect();
        let along = |direction: &DVec3| distances.iter().map(|d| *direction * *d).collect();
        directions.iter().flat_map::<Vec<DVec3>, _>(along).collect()
    }

    /// One set for each direction, from one for each of the [`viewpoints`](Self::viewpoints).
    ///
    /// # Panics
    ///
    /// When there are not as many sets for each direction as there are samples, or they are of
    /// different models.
    pub fn unite(&self, sets: &[Bitfield]) -> Vec<Bitfield> {
        let samples = self.samples.max(1) as usize;
        assert!(
            sets.len().is_multiple_of(samples),
            "{} sets are not {samples} for each direction",
            sets.len()
        );
        let united = |sets: &[Bitfield]| {
            let mut union = sets[0].clone();
            sets[1..].iter().for_each(|set| union.union_with(set));
            union
        };
        sets.chunks(samples).map(united).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::even_directions;
    use proptest::prelude::*;

    proptest! {
        /// Samples lie in their directions, the first at the least and the last at the greatest
        /// distance, and the set of a direction is what is seen from any of them.
        #[test]
        fn a_direction_has_what_is_seen_from_all_distances(
            nearest in 0.1..10.0f64,
            range in 1.0..10.0f64,
            samples in 2..5u32,
            directions in 0..9u32,
        ) {
            let distances = Distances { nearest, farthest: nearest * range, samples };
            let directions = even_directions(directions);
            let viewpoints = distances.viewpoints(&directions);
            let each = viewpoints.chunks(samples as usize).zip(&directions);
            for (along, direction) in each {
                // A length is rounded thrice.
                let off = |viewpoint: DVec3, distance: f64| {
                    (viewpoint - *direction * distance).length() > 1e-15 * distance
                };
                prop_assert!(!off(along[0], nearest));
                prop_assert!(!off(*along.last().unwrap(), nearest * range));
                let ascending = |pair: &[DVec3]| {
                    pair[0].length() <= pair[1].length() * (1.0 + 1e-15)
                };
                prop_assert!(along.windows(2).all(ascending));
            }
            let primitives = viewpoints.len() as u32;
            let own: Vec<Bitfield> = (0..primitives)
                .map(|id| Bitfield::from_ids(primitives, &[id]))
                .collect();
            let united = distances.unite(&own);
            prop_assert_eq!(united.len(), directions.len());
            for (at, set) in (0..).zip(&united) {
                prop_assert!(set.iter().eq(at * samples..(at + 1) * samples));
            }
        }

        /// Fractions of the range lie in it, in order.
        #[test]
        fn fractions_lie_in_the_range(
            nearest in 1e-3..1e3f64, range in 1.0..1e3f64, a in 0.0..1.0f64, b in 0.0..1.0f64,
        ) {
            let distances = Distances { nearest, farthest: nearest * range, samples: 2 };
            let [near, far] = [a.min(b), a.max(b)].map(|fraction| distances.at(fraction));
            prop_assert!(nearest <= near && near <= far * (1.0 + 1e-15));
            prop_assert!(far <= distances.farthest);
        }
    }

    #[test]
    #[should_panic(expected = "1 samples for distances from 1 m to 2 m")]
    fn one_sample_for_two_distances_panics() {
        let distances = Distances {
            nearest: 1.0,
            farthest: 2.0,
            samples: 1,
        };
        distances.viewpoints(&[DVec3::X]);
    }
}
