//! Colours that the original does not show anywhere near.

use crate::{NONE, Picture};
use farfield_grid::{BitMask, Grid};
use std::ops::Range;

/// Pixels whose colours were looked for in the original.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StrayColors {
    /// Pixels that lie inside of what both pictures cover.
    pub interior: u64,
    /// Those of them (x, y) whose colours, and those of their eight neighbours, are strays, row by
    /// row.
    pub stray: Vec<[u32; 2]>,
}

/// How far a neighbourhood reaches to every side, in pixels.
const REACH: usize = 2;

/// The pixels in the midst of colours that the original does not show anywhere near.
///
/// Compared are pixels that the impostor covers where the original covers the whole 5 x 5
/// neighbourhood, which is away from silhouettes. A colour is a stray if a channel lies outside of
/// what the original shows there, from the least to the greatest of its 25 pixels, by more than the
/// tolerance. An impostor that shows every point within a pixel of where it is hardly has any,
/// whatever edges and textures there are: what it has are dots and lines of things too thin for the
/// original's samples. So a pixel counts only if it and its eight neighbours are strays. Damage is
/// found, however little of a picture it fills and however little it changes any mean.
///
/// * `tolerance` - in levels of 255
///
/// # Panics
///
/// When the pictures are not equally large.
pub fn stray_colors(original: Picture<'_>, impostor: Picture<'_>, tolerance: u8) -> StrayColors {
    let (width, height) = (original.ids.width(), original.ids.height());
    assert_eq!(
        (original.colors.width(), original.colors.height()),
        (width, height)
    );
    assert_eq!(
        (impostor.ids.width(), impostor.ids.height()),
        (width, height)
    );
    assert_eq!(
        (impostor.colors.width(), impostor.colors.height()),
        (width, height)
    );
    let shown = along_rows(original);
    let mut interior = 0;
    let mut strays = BitMask::empty(width, height);
    for y in REACH..height.saturating_sub(REACH) {
        let rows: [_; 2 * REACH + 1] = std::array::from_fn(|i| shown.row(y + i - REACH));
        let (ids, colors) = (impostor.ids.row(y), impostor.colors.row(y));
        for x in (0..width).filter(|x| ids[*x] != NONE) {
            let Some(span) = rows
                .iter()
                .map(|row| row[x])
                .reduce(joined)
                .expect("there are five rows")
            else {
                continue;
            };
            interior += 1;
            if !span.holds(&colors[x], tolerance) {
                strays.insert(x, y);
            }
        }
    }
    let is_amidst =
        |x: usize, y: usize| (y - 1..y + 2).all(|v| (x - 1..x + 2).all(|u| strays.contains(u, v)));
    // The outermost pixels are no strays: their neighbourhoods are not covered.
    let stray = strays.iter().filter(|(x, y)| is_amidst(*x, *y));
    StrayColors {
        interior,
        stray: stray.map(|(x, y)| [x as u32, y as u32]).collect(),
    }
}

/// Whether a colour lies between the least and the greatest of what a part of a picture shows, in
/// every channel, or outside by no more than a tolerance.
///
/// * `part` - columns and rows; of an empty part nothing lies within
/// * `tolerance` - in levels of 255
///
/// # Panics
///
/// When the part reaches over the picture.
pub fn is_within(
    colors: &Grid<[u8; 3]>,
    part: [Range<usize>; 2],
    color: [u8; 3],
    tolerance: u8,
) -> bool {
    let [columns, rows] = part;
    let shown = rows.flat_map(|y| &colors.row(y)[columns.clone()]);
    let span = shown.map(Span::of).reduce(Span::joined);
    span.is_some_and(|span| span.holds(&color, tolerance))
}

/// What five pixels of a row show, around each pixel; `None` where one of them shows nothing.
fn along_rows(picture: Picture<'_>) -> Grid<Option<Span>> {
    let (width, height) = (picture.ids.width(), picture.ids.height());
    let mut spans = Grid::filled(width, height, None);
    for y in 0..height {
        let (ids, colors) = (picture.ids.row(y), picture.colors.row(y));
        let inner = spans.row_mut(y).iter_mut().skip(REACH);
        // As long as the shortest: pixels too near to the right border keep nothing.
        let fives = ids
            .windows(2 * REACH + 1)
            .zip(colors.windows(2 * REACH + 1));
        for (span, (ids, colors)) in inner.zip(fives) {
            if !ids.contains(&NONE) {
                *span = colors.iter().map(Span::of).reduce(Span::joined);
            }
        }
    }
    spans
}

fn joined(a: Option<Span>, b: Option<Span>) -> Option<Span> {
    Some(a?.joined(b?))
}

/// The least and the greatest value of each channel.
#[derive(Clone, Copy, Debug)]
struct Span {
    least: [u8; 3],
    greatest: [u8; 3],
}

impl Span {
    fn of(color: &[u8; 3]) -> Self {
        Self {
            least: *color,
            greatest: *color,
        }
    }

    fn joined(self, other: Self) -> Self {
        Self {
            least: std::array::from_fn(|c| self.least[c].min(other.least[c])),
            greatest: std::array::from_fn(|c| self.greatest[c].max(other.greatest[c])),
        }
    }

    fn holds(&self, color: &[u8; 3], tolerance: u8) -> bool {
        (0..3).all(|c| {
            color[c] >= self.least[c].saturating_sub(tolerance)
                && color[c] <= self.greatest[c].saturating_add(tolerance)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: usize = 11;

    /// Mostly covered, of few colours, so that neighbourhoods are covered and strays gather.
    fn pictures() -> impl Strategy<Value = (Grid<[u8; 3]>, Grid<u32>)> {
        let channel = || prop_oneof![8 => Just(100u8), 1 => Just(104), 1 => Just(130)];
        let color = [channel(), channel(), channel()];
        let id = prop_oneof![200 => Just(0u32), 1 => Just(NONE)];
        let patch = ((0..SIZE, 0..SIZE), (0..SIZE, 0..SIZE), any::<u8>());
        (
            prop::collection::vec(color, SIZE * SIZE),
            prop::collection::vec(id, SIZE * SIZE),
            patch,
        )
            .prop_map(|(mut colors, ids, ((left, top), (w, h), value))| {
                for y in top..(top + h).min(SIZE) {
                    for x in left..(left + w).min(SIZE) {
                        colors[y * SIZE + x] = [value; 3];
                    }
                }
                (
                    Grid::from_cells(SIZE, SIZE, colors),
                    Grid::from_cells(SIZE, SIZE, ids),
                )
            })
    }

    fn picture((colors, ids): &(Grid<[u8; 3]>, Grid<u32>)) -> Picture<'_> {
        Picture { colors, ids }
    }

    proptest! {
        /// Strays are found exactly where the definition, written down pixel by pixel, has them.
        #[test]
        fn strays_are_where_the_definition_has_them(
            a in pictures(),
            b in pictures(),
            tolerance in prop::sample::select(vec![0u8, 3, 4, 29, 30]),
        ) {
            let around = |x: usize, y: usize, reach: usize| -> Option<Vec<(usize, usize)>> {
                let near = |at: usize| (reach..SIZE - reach).contains(&at).then(|| at - reach..=at + reach);
                let (columns, rows) = (near(x)?, near(y)?);
                Some(rows.flat_map(|v| columns.clone().map(move |u| (u, v))).collect())
            };
            let compared = |x: usize, y: usize| {
                let near = around(x, y, 2)?;
                (b.1[(x, y)] != NONE && near.iter().all(|at| a.1[*at] != NONE)).then_some(near)
            };
            let is_stray = |x: usize, y: usize| {
                let Some(near) = compared(x, y) else { return false };
                (0..3).any(|c| {
                    let values = || near.iter().map(|at| i32::from(a.0[*at][c]));
                    let value = i32::from(b.0[(x, y)][c]);
                    let tolerance = i32::from(tolerance);
                    value < values().min().unwrap() - tolerance || value > values().max().unwrap() + tolerance
                })
            };
            for (x, y) in [(2, 2), (5, 6), (8, 4)] {
                let within = is_within(&a.0, [x - 2..x + 3, y - 2..y + 3], b.0[(x, y)], tolerance);
                prop_assert!(compared(x, y).is_none() || within != is_stray(x, y));
            }
            let all = || (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y)));
            let amidst = |(x, y): &(usize, usize)| {
                around(*x, *y, 1).is_some_and(|nine| nine.iter().all(|(u, v)| is_stray(*u, *v)))
            };
            let expected: Vec<_> = all().filter(amidst).map(|(x, y)| [x as u32, y as u32]).collect();
            let found = stray_colors(picture(&a), picture(&b), tolerance);
            prop_assert_eq!(found.stray, expected);
            prop_assert_eq!(found.interior, all().filter(|(x, y)| compared(*x, *y).is_some()).count() as u64);
        }

        /// A picture that is displaced by up to two pixels has no strays, whatever it shows.
        #[test]
        fn displaced_pictures_have_no_strays(
            colors in prop::collection::vec(prop::array::uniform3(any::<u8>()), SIZE * SIZE),
            (dx, dy) in (0..5usize, 0..5usize),
        ) {
            let colors = Grid::from_cells(SIZE, SIZE, colors);
            let ids = Grid::filled(SIZE, SIZE, 0);
            let mut moved = Grid::filled(SIZE, SIZE, [0; 3]);
            for (x, y) in (2..SIZE - 2).flat_map(|y| (2..SIZE - 2).map(move |x| (x, y))) {
                moved[(x, y)] = colors[(x + dx - 2, y + dy - 2)];
            }
            let (original, impostor) = ((colors, ids.clone()), (moved, ids));
            let found = stray_colors(picture(&original), picture(&impostor), 0);
            prop_assert_eq!(found, StrayColors { interior: 49, stray: Vec::new() });
        }
    }

    #[test]
    fn a_patch_of_three_by_three_is_found_and_lines_are_not() {
        let ids = Grid::filled(SIZE, SIZE, 0);
        let grey = Grid::filled(SIZE, SIZE, [128; 3]);
        let painted = |columns: Range<usize>| {
            let mut colors = grey.clone();
            for (x, y) in columns.flat_map(|x| (4..7).map(move |y| (x, y))) {
                colors[(x, y)] = [128, 145, 128];
            }
            let impostor = Picture {
                colors: &colors,
                ids: &ids,
            };
            let original = Picture {
                colors: &grey,
                ids: &ids,
            };
            [16, 17].map(|tolerance| stray_colors(original, impostor, tolerance).stray)
        };
        assert_eq!(painted(4..7), [vec![[5, 5]], vec![]]);
        let none: Vec<[u32; 2]> = Vec::new();
        assert_eq!(painted(4..6), [none.clone(), none]);
    }
}
