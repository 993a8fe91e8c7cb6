//! How far colours are apart.

use crate::{Distribution, NONE};
use farfield_grid::{BitMask, Grid};

/// Differences between the colours of two pictures; those of several views can be joined.
///
/// Colours are sRGB values as displayed, 0 to 255 in pictures and 0 to 1 in all figures.
/// Differences are impostor less original.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColorDifference {
    /// Pixels compared.
    pub pixels: u64,
    /// Sum of the squared differences of all channels, in units of 1/255 squared.
    pub squares: u64,
    /// How often each channel differs by -255, ..., 255 over the pixels that both pictures cover;
    /// empty where there are none.
    pub counts_in_both: Vec<[u64; 3]>,
    /// Absolute differences of channels, in [0, 1].
    pub differences: Distribution,
}

impl ColorDifference {
    /// Adds the differences of another view.
    pub fn merge(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.squares += other.squares;
        let most = self.counts_in_both.len().max(other.counts_in_both.len());
        self.counts_in_both.resize(most, [0; 3]);
        for (counts, more) in self.counts_in_both.iter_mut().zip(&other.counts_in_both) {
            for channel in 0..3 {
                counts[channel] += more[channel];
            }
        }
        self.differences.merge(&other.differences);
    }

    /// Peak signal-to-noise ratio in dB: -10 log10 of the mean squared difference of a channel;
    /// `None` where the pictures are equal.
    pub fn psnr(&self) -> Option<f64> {
        let values = (3 * self.pixels) as f64;
        (self.squares > 0).then(|| -10.0 * (self.squares as f64 / (255.0 * 255.0) / values).log10())
    }

    /// Interquartile mean of each channel's differences over the pixels that both pictures cover,
    /// in [-1, 1]; 0 where there are none. Whether the impostor's colours are right, whatever its
    /// silhouettes: the quarter of the pixels that differ most to either side does not count.
    pub fn typical_bias(&self) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let counts = self.counts_in_both.iter().map(|counts| counts[channel]);
            interquartile_mean(counts) / 255.0
        })
    }

    /// Mean of each channel's differences over the pixels that both pictures cover, in [-1, 1]; 0
    /// where there are none.
    pub fn mean_bias(&self) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let counts = self.counts_in_both.iter().map(|counts| counts[channel]);
            let sum: f64 = (-255..=255)
                .zip(counts)
                .map(|(difference, count)| f64::from(difference) * count as f64)
                .sum();
            sum / self.pixels_in_both().max(1) as f64 / 255.0
        })
    }

    /// The pixels that both pictures cover.
    pub fn pixels_in_both(&self) -> u64 {
        self.counts_in_both.iter().map(|counts| counts[0]).sum()
    }
}

/// The mean of the middle half of whole values, given how often -255, -254, ... occur.
fn interquartile_mean(counts: impl Iterator<Item = u64> + Clone) -> f64 {
    let total = counts.clone().sum::<u64>() as f64;
    let (first, last) = (total / 4.0, total * 3.0 / 4.0);
    let mut below = 0.0;
    let mut sum = 0.0;
    for (i, count) in counts.enumerate() {
        let end = below + count as f64;
        let inside = (end.min(last) - f64::max(below, first)).max(0.0);
        sum += inside * (i as f64 - 255.0);
        below = end;
    }
    if total > 0.0 {
        sum / (last - first)
    } else {
        0.0
    }
}

/// A picture and what it covers.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// sRGB as displayed, over the background.
    pub colors: &'a Grid<[u8; 3]>,
    /// [`NONE`] where only background is seen.
    pub ids: &'a Grid<u32>,
}

/// Compares the colours of two pictures over a region.
///
/// * `region` - such as [`compared_region`](crate::compared_region) finds
///
/// # Panics
///
/// When pictures and region are not equally large.
pub fn color_difference(
    original: Picture<'_>,
    impostor: Picture<'_>,
    region: &BitMask,
) -> ColorDifference {
    let size = (region.width(), region.height());
    for picture in [original, impostor] {
        assert_eq!((picture.colors.width(), picture.colors.height()), size);
        assert_eq!((picture.ids.width(), picture.ids.height()), size);
    }
    let mut result = ColorDifference::default();
    let mut counts = [0; 256];
    for pixel in region.iter() {
        let (before, after) = (original.colors[pixel], impostor.colors[pixel]);
        let both = original.ids[pixel] != NONE && impostor.ids[pixel] != NONE;
        result.pixels += 1;
        if both && result.counts_in_both.is_empty() {
            result.counts_in_both = vec![[0; 3]; 511];
        }
        for channel in 0..3 {
            let difference = i64::from(after[channel]) - i64::from(before[channel]);
            let distance = difference.unsigned_abs();
            counts[distance as usize] += 1;
            result.squares += distance * distance;
            if both {
                result.counts_in_both[(difference + 255) as usize][channel] += 1;
            }
        }
    }
    for (distance, count) in counts.into_iter().enumerate() {
        result
            .differences
            .record_many(distance as f64 / 255.0, count);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compared_region;
    use proptest::prelude::*;

    const SIZE: (usize, usize) = (7, 5);

    /// Few ids, so that all ways of covering a pixel occur; colours at both ends of the range.
    fn pictures() -> impl Strategy<Value = (Grid<[u8; 3]>, Grid<u32>)> {
        let count = SIZE.0 * SIZE.1;
        let channel = prop_oneof![Just(0u8), Just(255), any::<u8>()];
        let colors = prop::collection::vec(prop::array::uniform3(channel), count);
        let ids = prop::collection::vec(prop_oneof![Just(NONE), Just(3)], count);
        (colors, ids).prop_map(|(colors, ids)| {
            let (width, height) = SIZE;
            (
                Grid::from_cells(width, height, colors),
                Grid::from_cells(width, height, ids),
            )
        })
    }

    fn compare(
        a: &(Grid<[u8; 3]>, Grid<u32>),
        b: &(Grid<[u8; 3]>, Grid<u32>),
        region: &BitMask,
    ) -> ColorDifference {
        let [a, b] = [a, b].map(|(colors, ids)| Picture { colors, ids });
        color_difference(a, b, region)
    }

    proptest! {
        /// All figures are those of the definition, taken over a list of the region's pixels in
        /// floating point.
        #[test]
        fn figures_are_those_of_the_definition(a in pictures(), b in pictures()) {
            let region = compared_region(&a.1, &b.1);
            let found = compare(&a, &b, &region);
            let differences = |both: bool| -> Vec<[f64; 3]> {
                region.iter()
                    .filter(|p| !both || (a.1[*p] != NONE && b.1[*p] != NONE))
                    .map(|p| std::array::from_fn(|c| {
                        (f64::from(b.0[p][c]) - f64::from(a.0[p][c])) / 255.0
                    }))
                    .collect()
            };
            let (all, both) = (differences(false), differences(true));
            for channel in 0..3 {
                // Four of each, so that the quarters are whole.
                let mut four: Vec<f64> = both.iter().flat_map(|v| [v[channel]; 4]).collect();
                four.sort_by(f64::total_cmp);
                let middle = &four[both.len()..3 * both.len()];
                let typical = middle.iter().sum::<f64>() / middle.len().max(1) as f64;
                prop_assert!((found.typical_bias()[channel] - typical).abs() < 1e-13);
                let mean = both.iter().map(|v| v[channel]).sum::<f64>() / both.len().max(1) as f64;
                prop_assert!((found.mean_bias()[channel] - mean).abs() < 1e-13);
            }
            prop_assert_eq!(found.pixels_in_both(), both.len() as u64);
            let values: Vec<f64> = all.concat();
            prop_assert_eq!(found.differences.count(), values.len() as u64);
            let most = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            prop_assert!((found.differences.max() - most).abs() < 1e-15);
            let square = values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64;
            match found.psnr() {
                None => prop_assert!(square == 0.0),
                // At most 48 dB + 10 log10 105, to about 1e-14.
                Some(psnr) => prop_assert!((psnr + 10.0 * square.log10()).abs() < 1e-11),
            }
        }

        /// Exchanging the pictures turns the bias and nothing else.
        #[test]
        fn exchanging_the_pictures_turns_the_bias(a in pictures(), b in pictures()) {
            let region = compared_region(&a.1, &b.1);
            let (there, back) = (compare(&a, &b, &region), compare(&b, &a, &region));
            let turned = ColorDifference {
                counts_in_both: back.counts_in_both.iter().rev().copied().collect(),
                ..back
            };
            prop_assert_eq!(there, turned);
        }

        /// Joining the figures of two regions gives those of both together.
        #[test]
        fn joined_views_are_one_large_view(a in pictures(), b in pictures(), cut in 0..5usize) {
            let all = compared_region(&a.1, &b.1);
            let (mut upper, mut lower) = (all.clone(), all.clone());
            for y in 0..all.height() {
                let cleared = if y < cut { &mut lower } else { &mut upper };
                cleared.set_row(y, &[0]);
            }
            let mut joined = compare(&a, &b, &upper);
            joined.merge(&compare(&a, &b, &lower));
            let whole = compare(&a, &b, &all);
            // The mean's last digits depend on the order.
            prop_assert!((joined.differences.mean() - whole.differences.mean()).abs() < 1e-14);
            prop_assert_eq!(joined.differences.percentile(0.9), whole.differences.percentile(0.9));
            let plain = |mut d: ColorDifference| { d.differences = Distribution::default(); d };
            prop_assert_eq!(plain(joined), plain(whole));
        }
    }

    #[test]
    fn equal_pictures_have_no_noise() {
        let picture = (Grid::filled(3, 3, [9; 3]), Grid::filled(3, 3, 0));
        let region = compared_region(&picture.1, &picture.1);
        let found = compare(&picture, &picture, &region);
        assert_eq!(
            (found.psnr(), found.typical_bias(), found.pixels),
            (None, [0.0; 3], 9)
        );
    }

    #[test]
    fn white_for_black_has_no_signal() {
        let ids = Grid::filled(2, 2, 0);
        let region = compared_region(&ids, &ids);
        let (black, white) = (Grid::filled(2, 2, [0; 3]), Grid::filled(2, 2, [255; 3]));
        let found = compare(&(black, ids.clone()), &(white, ids), &region);
        assert_eq!((found.psnr(), found.typical_bias()), (Some(-0.0), [1.0; 3]));
    }
}
