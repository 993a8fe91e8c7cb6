//! The pixels over which pictures are compared.

use crate::NONE;
use farfield_grid::{BitMask, Grid};

/// The pixels covered in either picture, and their eight neighbours.
///
/// Where neither shows anything there is nothing to compare, and pixels of empty surroundings
/// would make any mean as small as one likes.
///
/// * `original`, `impostor` - ids, [`NONE`] where nothing is seen
///
/// # Panics
///
/// When the pictures are not equally large.
pub fn compared_region(original: &Grid<u32>, impostor: &Grid<u32>) -> BitMask {
    let (width, height) = (original.width(), original.height());
    assert_eq!((impostor.width(), impostor.height()), (width, height));
    let mut covered = BitMask::empty(width, height);
    for y in 0..height {
        let pairs = original.row(y).iter().zip(impostor.row(y));
        for (x, _) in pairs
            .enumerate()
            .filter(|(_, (o, i))| **o != NONE || **i != NONE)
        {
            covered.insert(x, y);
        }
    }
    dilated(&covered)
}

/// The texels of a mask and their eight neighbours.
fn dilated(mask: &BitMask) -> BitMask {
    let mut dilated = BitMask::empty(mask.width(), mask.height());
    for y in 0..mask.height() {
        let mut row = vec![0; mask.words_per_row()];
        for near in y.saturating_sub(1)..(y + 2).min(mask.height()) {
            for (word, near) in row.iter_mut().zip(mask.row(near)) {
                *word |= near;
            }
        }
        let word = |i: Option<usize>| i.and_then(|i| row.get(i)).copied().unwrap_or(0);
        let wide: Vec<u64> = (0..row.len())
            .map(|i| {
                let (left, right) = (word(i.checked_sub(1)), word(Some(i + 1)));
                row[i] | row[i] << 1 | left >> 63 | row[i] >> 1 | right << 63
            })
            .collect();
        dilated.set_row(y, &wide);
    }
    dilated
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A pixel is compared exactly if something is covered in its 3 x 3 neighbourhood.
        #[test]
        fn the_region_is_what_is_covered_and_its_neighbours(
            width in prop_oneof![0..5usize, 62..67usize, 126..131usize],
            height in 0..5usize,
            places in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64, any::<bool>()), 0..6),
        ) {
            let mut pictures = [Grid::filled(width, height, NONE), Grid::filled(width, height, NONE)];
            if width * height > 0 {
                for (x, y, second) in places {
                    let place = ((x * width as f64) as usize, (y * height as f64) as usize);
                    pictures[usize::from(second)][place] = 7;
                }
            }
            let [original, impostor] = &pictures;
            let region = compared_region(original, impostor);
            for y in 0..height {
                for x in 0..width {
                    let expected = (y.saturating_sub(1)..(y + 2).min(height))
                        .flat_map(|v| (x.saturating_sub(1)..(x + 2).min(width)).map(move |u| (u, v)))
                        .any(|place| original[place] != NONE || impostor[place] != NONE);
                    prop_assert_eq!(region.contains(x, y), expected, "pixel ({}, {})", x, y);
                }
            }
        }
    }
}
