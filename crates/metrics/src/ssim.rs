//! Structural similarity.

use crate::Distribution;
use farfield_grid::{BitMask, Grid};

/// Texels from a window's centre to its border: windows are 11 x 11.
const REACH: usize = 5;

/// Keep quotients of small means and variances stable: (0.01 x 255)^2 and (0.03 x 255)^2.
const STABLE: [f64; 2] = [6.5025, 58.5225];

/// 1 - SSIM at each pixel of a region, in [0, 2]: 0 where the pictures are equal, more the less
/// edges and texture of the two have in common; the mean SSIM is 1 less the mean.
///
/// SSIM compares mean, variance and covariance of luma within a window around each pixel
/// (Z. Wang et al., Image Quality Assessment: From Error Visibility to Structural Similarity,
/// 2004): 11 x 11 pixels, weighted by a Gaussian of 1.5 pixels. A window at the picture's border
/// is what of it lies inside.
///
/// * `original`, `impostor` - sRGB as displayed, over the background
/// * `region` - such as [`compared_region`](crate::compared_region) finds; windows see beyond it
///
/// About 0.2 µs a pixel of the region's bounds.
///
/// # Panics
///
/// When pictures and region are not equally large.
pub fn ssim_errors(
    original: &Grid<[u8; 3]>,
    impostor: &Grid<[u8; 3]>,
    region: &BitMask,
) -> Distribution {
    let (width, height) = (region.width(), region.height());
    for picture in [original, impostor] {
        assert_eq!((picture.width(), picture.height()), (width, height));
    }
    let mut errors = Distribution::default();
    let Some(bounds) = region.bounds() else {
        return errors;
    };
    let (left, right) = (bounds.x as usize, bounds.right() as usize);
    let rows =
        around(bounds.y as usize, height).start..around(bounds.bottom() as usize - 1, height).end;
    // The Gaussian is separable: first along rows, as far as windows of the region reach.
    let mut along_rows = Grid::filled(right - left, rows.len(), [0.0; 5]);
    for y in rows.clone() {
        let products: Vec<[f64; 5]> = (0..width)
            .map(|x| products(luma(original[(x, y)]), luma(impostor[(x, y)])))
            .collect();
        for (x, cell) in (left..right).zip(along_rows.row_mut(y - rows.start)) {
            *cell = weighted_mean(x, width, |x| products[x]);
        }
    }
    for (x, y) in region.iter() {
        let means = weighted_mean(y, height, |y| along_rows[(x - left, y - rows.start)]);
        // Rounding may lift the similarity of nearly equal windows a hair above 1.
        errors.record((1.0 - similarity(means)).max(0.0));
    }
    errors
}

/// Rec. 601 luma of a displayed colour, in [0, 255].
fn luma([r, g, b]: [u8; 3]) -> f64 {
    0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)
}

/// What the means over a window are taken of: a, b, a^2, b^2, ab.
fn products(a: f64, b: f64) -> [f64; 5] {
    [a, b, a * a, b * b, a * b]
}

/// SSIM from the means of [`products`] over a window.
fn similarity([a, b, aa, bb, ab]: [f64; 5]) -> f64 {
    let (variances, covariance) = (aa - a * a + (bb - b * b), ab - a * b);
    let [c1, c2] = STABLE;
    (2.0 * a * b + c1) * (2.0 * covariance + c2) / ((a * a + b * b + c1) * (variances + c2))
}

/// The coordinates below `end` within a window around `center`.
fn around(center: usize, end: usize) -> std::ops::Range<usize> {
    center.saturating_sub(REACH)..(center + REACH + 1).min(end)
}

/// Mean of the values within a window around `center`, weighted by the Gaussian.
fn weighted_mean(center: usize, end: usize, value: impl Fn(usize) -> [f64; 5]) -> [f64; 5] {
    // exp(-(d / 1.5)^2 / 2) for d from 0 to 5.
    const WEIGHTS: [f64; REACH + 1] = [
        1.0,
        0.800_737_402_916_808_2,
        0.411_112_290_507_187_45,
        0.135_335_283_236_612_7,
        0.028_565_500_784_550_377,
        0.003_865_920_139_472_808,
    ];
    let (mut sum, mut total) = ([0.0; 5], 0.0);
    for i in around(center, end) {
        let (weight, value) = (WEIGHTS[i.abs_diff(center)], value(i));
        total += weight;
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += weight * value;
        }
    }
    sum.map(|sum| sum / total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Pictures smaller and larger than a window, alike or not, and any region.
    fn cases() -> impl Strategy<Value = (Grid<[u8; 3]>, Grid<[u8; 3]>, BitMask)> {
        (1..18usize, 1..18usize, 0..256u32).prop_flat_map(|(width, height, noise)| {
            let count = width * height;
            let colors = || prop::collection::vec(prop::array::uniform3(any::<u8>()), count);
            let bits = prop::collection::vec(any::<bool>(), count);
            (colors(), colors(), bits).prop_map(move |(a, b, bits)| {
                let mixed = a.iter().zip(b).map(|(a, b)| {
                    std::array::from_fn(|c| {
                        let (a, b) = (u32::from(a[c]), u32::from(b[c]));
                        ((a * (255 - noise) + b * noise) / 255) as u8
                    })
                });
                let b = Grid::from_cells(width, height, mixed.collect());
                let mut region = BitMask::empty(width, height);
                for (i, _) in bits.iter().enumerate().filter(|(_, bit)| **bit) {
                    region.insert(i % width, i / width);
                }
                (Grid::from_cells(width, height, a), b, region)
            })
        })
    }

    /// SSIM by its definition: one window, two dimensions, moments about the mean.
    fn ssim(a: &Grid<[u8; 3]>, b: &Grid<[u8; 3]>, center: (usize, usize)) -> f64 {
        let mut window = Vec::new();
        for y in 0..a.height() {
            for x in 0..a.width() {
                let (dx, dy) = (x.abs_diff(center.0), y.abs_diff(center.1));
                if dx <= REACH && dy <= REACH {
                    let weight = (-((dx * dx + dy * dy) as f64) / (2.0 * 1.5 * 1.5)).exp();
                    window.push((weight, luma(a[(x, y)]), luma(b[(x, y)])));
                }
            }
        }
        let total: f64 = window.iter().map(|(weight, ..)| weight).sum();
        let mean = |value: &dyn Fn(f64, f64) -> f64| {
            window.iter().map(|&(w, a, b)| w * value(a, b)).sum::<f64>() / total
        };
        let (mean_a, mean_b) = (mean(&|a, _| a), mean(&|_, b| b));
        let variance_a = mean(&|a, _| (a - mean_a).powi(2));
        let variance_b = mean(&|_, b| (b - mean_b).powi(2));
        let covariance = mean(&|a, b| (a - mean_a) * (b - mean_b));
        let [c1, c2] = [(0.01f64 * 255.0).powi(2), (0.03f64 * 255.0).powi(2)];
        (2.0 * mean_a * mean_b + c1) / (mean_a * mean_a + mean_b * mean_b + c1)
            * ((2.0 * covariance + c2) / (variance_a + variance_b + c2))
    }

    proptest! {
        /// Errors are 1 - SSIM as the definition gives it window by window.
        #[test]
        fn errors_are_those_of_the_definition((a, b, region) in cases()) {
            let found = ssim_errors(&a, &b, &region);
            let expected: Vec<f64> = region.iter().map(|p| 1.0 - ssim(&a, &b, p)).collect();
            prop_assert_eq!(found.count(), expected.len() as u64);
            let mean = expected.iter().sum::<f64>() / expected.len().max(1) as f64;
            let most = expected.iter().fold(0.0, |most: f64, e| most.max(*e));
            // Means of squares of at most 2^16, after 22 roundings: variances err by up to
            // 2^16 x 22 x 2^-53 = 2e-10, over a denominator of at least 58.
            prop_assert!((found.mean() - mean).abs() < 1e-10, "{} is not {mean}", found.mean());
            prop_assert!((found.max() - most).abs() < 1e-10, "{} is not {most}", found.max());
        }

        /// Equal pictures differ by exactly nothing.
        #[test]
        fn a_picture_is_similar_to_itself((a, _, region) in cases()) {
            prop_assert_eq!(ssim_errors(&a, &a, &region).max(), 0.0);
        }
    }
}
