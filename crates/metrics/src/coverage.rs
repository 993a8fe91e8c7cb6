//! Which pixels are covered by the original and by the impostor.

use crate::NONE;
use farfield_grid::{BitMask, Grid};

/// How many pixels the original covers, and how many of them the impostor misses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// Pixels the original covers.
    pub covered: u64,
    /// Those of them that the impostor does not cover.
    pub missed: u64,
}

impl Coverage {
    /// Missed pixels as a share of the original's pixels, in [0, 1]: the coverage error
    /// (C. Andujar et al., Omni-directional Relief Impostors, 2007); 0 where the original covers
    /// nothing.
    pub fn error(&self) -> f64 {
        self.missed as f64 / self.covered.max(1) as f64
    }
}

/// Compares what two pictures cover: pixels whose id or index is not [`NONE`].
///
/// # Panics
///
/// When the pictures are not equally large.
pub fn coverage(original: &Grid<u32>, impostor: &Grid<u32>) -> Coverage {
    let size = (original.width(), original.height());
    assert_eq!((impostor.width(), impostor.height()), size);
    let pairs = || {
        original
            .cells()
            .iter()
            .zip(impostor.cells())
            .filter(|(o, _)| **o != NONE)
    };
    Coverage {
        covered: pairs().count() as u64,
        missed: pairs().filter(|(_, i)| **i == NONE).count() as u64,
    }
}

/// The pixels covered in any of their `samples` x `samples` samples.
///
/// * `ids` - a picture of `samples` times the size, [`NONE`] where nothing is seen
///
/// # Panics
///
/// When `samples` is 0 or does not divide the size of `ids`.
pub fn covered_in_any_sample(ids: &Grid<u32>, samples: usize) -> BitMask {
    assert!(
        samples > 0 && ids.width().is_multiple_of(samples) && ids.height().is_multiple_of(samples),
        "{} x {} samples are not {samples} x {samples} a pixel",
        ids.width(),
        ids.height()
    );
    let mut mask = BitMask::empty(ids.width() / samples, ids.height() / samples);
    for y in 0..ids.height() {
        for (x, _) in ids.row(y).iter().enumerate().filter(|(_, id)| **id != NONE) {
            mask.insert(x / samples, y / samples);
        }
    }
    mask
}

/// The pixels (x, y) that only the impostor covers, row by row: no pixel of the 5 x 5
/// neighbourhood is covered by the original. Pixels within two of the picture's border lack
/// neighbours and are never phantoms.
///
/// * `original` - pixels covered in any sample ([`covered_in_any_sample`]): thin things fall
///   between single samples
/// * `impostor` - its picture, [`NONE`] where nothing is seen
///
/// # Panics
///
/// When the pictures are not equally large.
pub fn phantom_pixels(original: &BitMask, impostor: &Grid<u32>) -> Vec<[u32; 2]> {
    let (width, height) = (original.width(), original.height());
    assert_eq!((impostor.width(), impostor.height()), (width, height));
    let near_original = |x: usize, y: usize| {
        (y - 2..=y + 2).any(|y| (x - 2..=x + 2).any(|x| original.contains(x, y)))
    };
    let mut phantoms = Vec::new();
    for y in 2..height.saturating_sub(2) {
        let row = impostor.row(y);
        for x in (2..width.saturating_sub(2)).filter(|x| row[*x] != NONE) {
            if !near_original(x, y) {
                phantoms.push([x as u32, y as u32]);
            }
        }
    }
    phantoms
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(rows: [&str; 6]) -> Grid<u32> {
        let cells = rows
            .concat()
            .chars()
            .map(|c| if c == '#' { 0 } else { NONE })
            .collect();
        Grid::from_cells(rows[0].len(), 6, cells)
    }

    #[test]
    fn counts_what_is_missed_and_what_is_too_much() {
        let original = picture([
            "#.......", "##......", "........", "........", "........", "........",
        ]);
        let impostor = picture([
            "##......", "#..#....", "...#....", "...#.#..", "........", ".......#",
        ]);
        assert_eq!(
            coverage(&original, &impostor),
            Coverage {
                covered: 3,
                missed: 1
            }
        );
        let covered = covered_in_any_sample(&original, 1);
        // (3, 3) is two rows and columns from (1, 1); the last pixel lies at the picture's border.
        assert_eq!(phantom_pixels(&covered, &impostor), [[5, 3]]);
    }

    #[test]
    fn a_pixel_is_covered_if_one_of_its_samples_is() {
        let samples = picture([
            "........", ".#......", "........", "........", "........", "......#.",
        ]);
        let pixels: Vec<_> = covered_in_any_sample(&samples, 2).iter().collect();
        assert_eq!(pixels, [(0, 0), (3, 2)]);
    }

    #[test]
    fn nothing_is_missed_where_nothing_is() {
        let nothing = picture(["...", "...", "...", "...", "...", "..."]);
        assert_eq!(coverage(&nothing, &nothing).error(), 0.0);
    }
}
