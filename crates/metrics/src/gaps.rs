//! Holes in an impostor.

use crate::NONE;
use farfield_grid::Grid;

/// The pixels (x, y) where one looks through the impostor, row by row: the original covers the
/// whole 3 x 3 neighbourhood, but the impostor shows nothing, or a layer whose index exceeds by
/// more than `slack` the greatest among the nine.
///
/// * `original`, `impostor` - per pixel the index of the layer whose range holds the depth seen,
///   or [`NONE`] ([`layer_indices`](crate::layer_indices))
/// * `slack` - by how many layers an impostor may show a surface behind where it is: 1 where it is
///   made of layers, as surfaces reach over their borders
///
/// Pixels at the picture's border lack neighbours and are never gaps.
///
/// # Panics
///
/// When the pictures are not equally large.
pub fn gap_pixels(original: &Grid<u32>, impostor: &Grid<u32>, slack: u32) -> Vec<[u32; 2]> {
    let (width, height) = (original.width(), original.height());
    assert_eq!((impostor.width(), impostor.height()), (width, height));
    // `NONE` is greater than any index.
    let behind = greatest_of_nine(original, NONE, u32::max);
    let pixels = behind.cells().iter().zip(impostor.cells()).enumerate();
    let gaps = pixels.filter(|(_, (behind, seen))| {
        **behind != NONE && (**seen == NONE || **seen > **behind + slack)
    });
    gaps.map(|(i, _)| [(i % width) as u32, (i / width) as u32])
        .collect()
}

/// Of each pixel and the eight around it the greatest value.
///
/// * `outside` - for pixels at the picture's border, which lack neighbours
/// * `max` - the greater of two values
pub fn greatest_of_nine<T: Copy>(
    picture: &Grid<T>,
    outside: T,
    max: impl Fn(T, T) -> T,
) -> Grid<T> {
    let (width, height) = (picture.width(), picture.height());
    let mut greatest = Grid::filled(width, height, outside);
    for y in 1..height.saturating_sub(1) {
        let [above, here, below] = [y - 1, y, y + 1].map(|y| picture.row(y));
        let column = |x: usize| max(max(above[x], here[x]), below[x]);
        let inner = greatest.row_mut(y).iter_mut().enumerate().skip(1);
        for (x, greatest) in inner.take(width.saturating_sub(2)) {
            *greatest = max(max(column(x - 1), column(x)), column(x + 1));
        }
    }
    greatest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn indices() -> impl Strategy<Value = Grid<u32>> {
        // Mostly covered, or no 3 x 3 neighbourhood ever would be.
        let index = prop_oneof![40 => 0..6u32, 1 => Just(NONE)];
        prop::collection::vec(index, 7 * 5).prop_map(|cells| Grid::from_cells(7, 5, cells))
    }

    proptest! {
        /// Gaps are found exactly where the definition, written down pixel by pixel, has them.
        #[test]
        fn gaps_are_where_the_definition_has_them(
            original in indices(), impostor in indices(), slack in 0..4u32,
        ) {
            let mut expected = Vec::new();
            for y in 1..4 {
                for x in 1..6 {
                    let nine: Vec<u32> =
                        (0..9).map(|i| original[(x + i % 3 - 1, y + i / 3 - 1)]).collect();
                    let all = nine.iter().all(|i| *i != NONE);
                    let seen = impostor[(x, y)];
                    if all && (seen == NONE || seen > nine.iter().max().unwrap() + slack) {
                        expected.push([x as u32, y as u32]);
                    }
                }
            }
            prop_assert_eq!(gap_pixels(&original, &impostor, slack), expected);
        }

        /// A picture has no gaps against itself.
        #[test]
        fn the_original_has_no_gaps(original in indices()) {
            prop_assert!(gap_pixels(&original, &original, 0).is_empty());
        }
    }
}
