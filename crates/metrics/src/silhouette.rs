//! How far outlines are displaced.

use crate::{Distribution, NONE};
use farfield_grid::{BitMask, Grid};

/// Distances between the silhouettes of two pictures; those of several views can be joined.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SilhouetteDisplacement {
    /// From each silhouette pixel of either picture to the nearest one of the other, in pixels.
    pub distances: Distribution,
    /// Silhouette pixels of a picture where the other one has no silhouette at all.
    pub unmatched: u64,
}

impl SilhouetteDisplacement {
    /// Adds the distances of another view.
    pub fn merge(&mut self, other: &Self) {
        self.distances.merge(&other.distances);
        self.unmatched += other.unmatched;
    }
}

/// Compares the outlines of what two pictures cover.
///
/// Silhouette pixels are covered and have one of their four neighbours, inside the picture, not
/// covered. Distances are Euclidean, between pixel centres, exact, and taken both ways: an
/// impostor may miss a part of the outline or add one.
///
/// # Panics
///
/// When the pictures are not equally large.
pub fn silhouette_displacement(
    original: &Grid<u32>,
    impostor: &Grid<u32>,
) -> SilhouetteDisplacement {
    let size = (original.width(), original.height());
    assert_eq!((impostor.width(), impostor.height()), size);
    let outlines = [silhouette(original), silhouette(impostor)];
    let mut result = SilhouetteDisplacement::default();
    for (from, to) in [(0, 1), (1, 0)] {
        match squared_distances(&outlines[to]) {
            None => result.unmatched += outlines[from].count() as u64,
            Some(squares) => {
                for pixel in outlines[from].iter() {
                    result.distances.record((squares[pixel] as f64).sqrt());
                }
            }
        }
    }
    result
}

/// The covered pixels with an uncovered neighbour above, below, left or right.
fn silhouette(ids: &Grid<u32>) -> BitMask {
    let (width, height) = (ids.width(), ids.height());
    let mut outline = BitMask::empty(width, height);
    for y in 0..height {
        let row = ids.row(y);
        let above = ids.row(y.saturating_sub(1));
        let below = ids.row((y + 1).min(height - 1));
        for x in 0..width {
            let around = [
                row[x.saturating_sub(1)],
                row[(x + 1).min(width - 1)],
                above[x],
                below[x],
            ];
            if row[x] != NONE && around.contains(&NONE) {
                outline.insert(x, y);
            }
        }
    }
    outline
}

/// Squared distance from each pixel to the nearest one of a mask; `None` where it is empty.
///
/// First along columns, by counting. Then along rows: the distance from (x, y) through column q
/// is the parabola (x - q)^2 + column distance(q)^2, and the least of all parabolas is kept as a
/// list of those that are lowest somewhere, in order (P. Felzenszwalb and D. Huttenlocher,
/// Distance Transforms of Sampled Functions, 2012). Integers, so exact.
fn squared_distances(mask: &BitMask) -> Option<Grid<i64>> {
    mask.bounds()?;
    let (width, height) = (mask.width(), mask.height());
    // Farther than any pixel, and its square still fits.
    let far = (width + height) as i64;
    let mut columns = Grid::filled(width, height, far);
    let mut nearest = vec![far; width];
    let mut sweep = |y: usize| {
        for (x, distance) in nearest.iter_mut().enumerate() {
            *distance = match mask.contains(x, y) {
                true => 0,
                false => (*distance + 1).min(columns[(x, y)]),
            };
            columns[(x, y)] = *distance;
        }
    };
    (0..height).for_each(&mut sweep);
    (0..height).rev().for_each(&mut sweep);

    let mut squares = Grid::filled(width, height, 0);
    for y in 0..height {
        let heights: Vec<i64> = columns.row(y).iter().map(|d| d * d).collect();
        lowest_parabolas(&heights, squares.row_mut(y));
    }
    Some(squares)
}

/// For each x the least of (x - q)^2 + heights\[q\] over all q.
fn lowest_parabolas(heights: &[i64], lowest: &mut [i64]) {
    // Parabola q is the lowest from the x on that stands beside it.
    let mut parabolas: Vec<(usize, i64)> = Vec::new();
    for (q, &height) in heights.iter().enumerate() {
        let square = |q: usize| (q * q) as i64;
        // The first x at which parabola q is below parabola p < q.
        let first_below = |p: usize| {
            let numerator = (height + square(q)) - (heights[p] + square(p));
            numerator.div_euclid(2 * (q - p) as i64) + 1
        };
        while parabolas
            .last()
            .is_some_and(|(p, start)| first_below(*p) <= *start)
        {
            parabolas.pop();
        }
        let start = parabolas.last().map_or(0, |(p, _)| first_below(*p));
        parabolas.push((q, start));
    }
    let mut current = 0;
    for (x, lowest) in lowest.iter_mut().enumerate() {
        while parabolas
            .get(current + 1)
            .is_some_and(|(_, start)| *start <= x as i64)
        {
            current += 1;
        }
        let q = parabolas[current].0;
        *lowest = (x.abs_diff(q) * x.abs_diff(q)) as i64 + heights[q];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pictures() -> impl Strategy<Value = [Grid<u32>; 2]> {
        (1..20usize, 1..20usize, 0.0..=1.0f64, 0.0..=1.0f64).prop_flat_map(
            |(width, height, a, b)| {
                [a, b].map(|density| {
                    prop::collection::vec(prop::bool::weighted(density), width * height).prop_map(
                        move |bits| {
                            let ids = bits.iter().map(|bit| if *bit { 1 } else { NONE }).collect();
                            Grid::from_cells(width, height, ids)
                        },
                    )
                })
            },
        )
    }

    /// Silhouette pixels by the definition.
    fn outline(ids: &Grid<u32>) -> Vec<(i64, i64)> {
        let (width, height) = (ids.width() as i64, ids.height() as i64);
        let empty = |(x, y): (i64, i64)| {
            (0..width).contains(&x)
                && (0..height).contains(&y)
                && ids[(x as usize, y as usize)] == NONE
        };
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .filter(|&(x, y)| {
                let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
                !empty((x, y)) && around.into_iter().any(empty)
            })
            .collect()
    }

    proptest! {
        /// Distances are those between all pairs of silhouette pixels, both ways; where a picture
        /// has no silhouette, the other's pixels are counted.
        #[test]
        fn distances_are_those_of_all_pairs([a, b] in pictures()) {
            let outlines = [outline(&a), outline(&b)];
            let mut expected = SilhouetteDisplacement::default();
            for (from, to) in [(0, 1), (1, 0)] {
                for (x, y) in &outlines[from] {
                    let squares = outlines[to].iter().map(|(u, v)| (u - x).pow(2) + (v - y).pow(2));
                    match squares.min() {
                        None => expected.unmatched += 1,
                        Some(square) => expected.distances.record((square as f64).sqrt()),
                    }
                }
            }
            prop_assert_eq!(silhouette_displacement(&a, &b), expected);
        }

        /// A picture's outline is not displaced against itself, and a picture that covers
        /// everything or nothing has none.
        #[test]
        fn an_outline_is_where_it_is([a, _] in pictures()) {
            let found = silhouette_displacement(&a, &a);
            prop_assert_eq!((found.distances.max(), found.unmatched), (0.0, 0));
            let full = Grid::filled(a.width(), a.height(), 0);
            prop_assert_eq!(silhouette_displacement(&full, &full).distances.count(), 0);
        }
    }

    #[test]
    fn a_shifted_square_is_displaced_by_its_shift() {
        let square = |left: usize| {
            let mut ids = Grid::filled(40, 20, NONE);
            (5..15).for_each(|y| ids.row_mut(y)[left..left + 10].fill(0));
            ids
        };
        let found = silhouette_displacement(&square(5), &square(8));
        assert_eq!((found.distances.max(), found.unmatched), (3.0, 0));
    }

    #[test]
    fn empty_pictures_are_compared() {
        let nothing = Grid::filled(0, 0, NONE);
        assert_eq!(
            silhouette_displacement(&nothing, &nothing),
            SilhouetteDisplacement::default()
        );
    }
}
