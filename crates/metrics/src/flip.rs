//! FLIP: a difference as people see it who flip between two pictures.

use crate::Distribution;
use farfield_grid::{BitMask, Grid, Rect};

/// Errors that FLIP finds, in [0, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct FlipErrors {
    /// Where the map lies in the picture: the region's bounds. Empty where the region is.
    pub bounds: Rect,
    /// The error at each pixel of the bounds.
    pub map: Grid<f32>,
    /// The errors at the region's pixels.
    pub errors: Distribution,
}

/// How many pixels span a degree of the viewer's field of view: 0.7 m before a display of
/// 3840 pixels and 0.7 m width, the value the authors of FLIP recommend.
const PIXELS_PER_DEGREE: f32 = 67.0;

/// How far, in pixels, a pixel's error depends on others.
///
/// FLIP filters both pictures by contrast sensitivity, and beside that by detectors of edges and
/// points; each filter is applied once, to the pictures themselves. Radii are three standard
/// deviations, rounded up. The widest sensitivity, of blue against yellow, is a Gaussian
/// exp(-pi^2 x^2 / b) with b = 0.04 degrees^2, so of a deviation of sqrt(0.04 / (2 pi^2)) =
/// 0.0450 degrees: ceil(3 x 0.0450 x 67) = ceil(9.05) = 10. The detectors are derivatives of
/// a Gaussian of 0.041 degrees: ceil(3 x 0.041 x 67) = ceil(8.24) = 9.
const REACH: u32 = 10;

/// Compares two pictures with FLIP at 67 pixels a degree.
///
/// P. Andersson et al., FLIP: A Difference Evaluator for Alternating Images, 2020, as implemented
/// by its authors. Only the region's surroundings are looked at, as far as errors depend on them:
/// the errors are those of the whole pictures, bit by bit.
///
/// * `original`, `impostor` - sRGB as displayed, over the background
/// * `region` - such as [`compared_region`](crate::compared_region) finds
///
/// About 1 µs a pixel of the region's bounds.
///
/// # Panics
///
/// When pictures and region are not equally large.
pub fn flip_errors(
    original: &Grid<[u8; 3]>,
    impostor: &Grid<[u8; 3]>,
    region: &BitMask,
) -> FlipErrors {
    let (width, height) = (region.width() as u32, region.height() as u32);
    for picture in [original, impostor] {
        assert_eq!(
            (picture.width(), picture.height()),
            (region.width(), region.height())
        );
    }
    let mut errors = Distribution::default();
    let Some(bounds) = region.bounds() else {
        let bounds = Rect {
            x: 0,
            y: 0,
            width: 0,
            height: 0,
        };
        let map = Grid::filled(0, 0, 0.0);
        return FlipErrors {
            bounds,
            map,
            errors,
        };
    };
    let (x, y) = (
        bounds.x.saturating_sub(REACH),
        bounds.y.saturating_sub(REACH),
    );
    let seen = Rect {
        x,
        y,
        width: (bounds.right() + REACH).min(width) - x,
        height: (bounds.bottom() + REACH).min(height) - y,
    };
    let all = nv_flip::flip(
        cropped(original, seen),
        cropped(impostor, seen),
        PIXELS_PER_DEGREE,
    )
    .to_vec();
    let at = |x: u32, y: u32| all[((y - seen.y) * seen.width + (x - seen.x)) as usize];
    for (x, y) in region.iter() {
        errors.record(f64::from(at(x as u32, y as u32)));
    }
    let cells =
        (bounds.y..bounds.bottom()).flat_map(|y| (bounds.x..bounds.right()).map(move |x| at(x, y)));
    let map = Grid::from_cells(
        bounds.width as usize,
        bounds.height as usize,
        cells.collect(),
    );
    FlipErrors {
        bounds,
        map,
        errors,
    }
}

fn cropped(picture: &Grid<[u8; 3]>, rect: Rect) -> nv_flip::FlipImageRgb8 {
    let rows = rect.y as usize..rect.bottom() as usize;
    let columns = rect.x as usize..rect.right() as usize;
    let bytes: Vec<u8> = rows
        .flat_map(|y| picture.row(y)[columns.clone()].iter().flatten().copied())
        .collect();
    nv_flip::FlipImageRgb8::with_data(rect.width, rect.height, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Noise, so that every pixel within reach of another matters to it.
    fn noise(width: usize, height: usize, seed: u32) -> Grid<[u8; 3]> {
        let mut state = seed | 1;
        let mut byte = || {
            // G. Marsaglia's xorshift.
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (state >> 24) as u8
        };
        let cells = (0..width * height).map(|_| [byte(), byte(), byte()]);
        Grid::from_cells(width, height, cells.collect())
    }

    fn filled(width: usize, height: usize, rect: Rect) -> BitMask {
        let mut region = BitMask::empty(width, height);
        for y in rect.y..rect.bottom() {
            (rect.x..rect.right()).for_each(|x| region.insert(x as usize, y as usize));
        }
        region
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// The errors within a region are exactly those of the whole pictures.
        #[test]
        fn cropping_changes_nothing_inside(
            seed: u32,
            x in 0..60u32, y in 0..50u32, width in 1..9u32, height in 1..9u32,
        ) {
            let (a, b) = (noise(70, 60, seed), noise(70, 60, !seed));
            let everything = Rect { x: 0, y: 0, width: 70, height: 60 };
            let whole = flip_errors(&a, &b, &filled(70, 60, everything));
            prop_assert_eq!(whole.bounds, everything);
            let rect = Rect { x, y, width, height };
            let part = flip_errors(&a, &b, &filled(70, 60, rect));
            prop_assert_eq!(part.bounds, rect);
            let mut expected = Distribution::default();
            for v in 0..height as usize {
                for u in 0..width as usize {
                    let error = whole.map[(u + x as usize, v + y as usize)];
                    prop_assert_eq!(part.map[(u, v)].to_bits(), error.to_bits());
                    expected.record(f64::from(error));
                }
            }
            prop_assert_eq!(part.errors, expected);
        }
    }

    /// A change of one pixel is felt at most ten pixels away, and there it is.
    #[test]
    fn the_reach_is_as_derived() {
        let a = Grid::filled(61, 61, [128; 3]);
        let mut b = a.clone();
        b[(30, 30)] = [0, 0, 255];
        let everything = Rect {
            x: 0,
            y: 0,
            width: 61,
            height: 61,
        };
        let map = flip_errors(&a, &b, &filled(61, 61, everything)).map;
        let felt = |x: usize| (0..61).any(|y| map[(x, y)] > 0.0);
        let columns: Vec<usize> = (0..61).filter(|x| felt(*x)).collect();
        let reach = REACH as usize;
        assert_eq!(columns, (30 - reach..=30 + reach).collect::<Vec<_>>());
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let a = noise(20, 10, 7);
        let everything = Rect {
            x: 0,
            y: 0,
            width: 20,
            height: 10,
        };
        let found = flip_errors(&a, &a, &filled(20, 10, everything));
        assert_eq!((found.errors.count(), found.errors.max()), (200, 0.0));
        let nothing = flip_errors(&a, &a, &BitMask::empty(20, 10));
        assert_eq!((nothing.errors.count(), nothing.bounds.area()), (0, 0));
    }

    /// Hardly anything differs more than white from black.
    #[test]
    fn white_for_black_is_far_off() {
        let (black, white) = (Grid::filled(32, 32, [0; 3]), Grid::filled(32, 32, [255; 3]));
        let everything = Rect {
            x: 0,
            y: 0,
            width: 32,
            height: 32,
        };
        let found = flip_errors(&black, &white, &filled(32, 32, everything));
        assert!(found.errors.mean() > 0.9, "{}", found.errors.mean());
    }
}
