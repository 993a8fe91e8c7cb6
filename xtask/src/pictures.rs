//! Pictures for people.

use farfield_grid::Grid;
use farfield_sampling::{NONE, srgb_from_linear};
use farfield_scene::Image;
use glam::Vec3;

/// Linear RGB behind everything.
const BACKGROUND: Vec3 = Vec3::new(0.42, 0.56, 0.71);

/// The colour behind everything, sRGB from 0 to 1.
pub(crate) fn background() -> [f32; 3] {
    BACKGROUND.to_array().map(srgb_from_linear)
}

/// A rendered picture of linear RGB over the background, in sRGB.
pub(crate) fn over_background(color: &Grid<Vec3>, ids: &Grid<u32>) -> Grid<[u8; 3]> {
    let byte = |c: f32| (srgb_from_linear(c) * 255.0).round() as u8;
    let cells = color.cells().iter().zip(ids.cells());
    let cells = cells
        .map(|(color, id)| if *id == NONE { BACKGROUND } else { *color })
        .map(|color| color.to_array().map(byte));
    Grid::from_cells(color.width(), color.height(), cells.collect())
}

/// How much two pictures differ, four times as strong, on black.
#[cfg(not(feature = "flip"))]
pub(crate) fn difference(a: &Grid<[u8; 3]>, b: &Grid<[u8; 3]>) -> Grid<[u8; 3]> {
    let cells = a.cells().iter().zip(b.cells());
    let apart = |a: u8, b: u8| a.abs_diff(b).saturating_mul(4);
    let cells = cells.map(|(a, b)| [0, 1, 2].map(|i| apart(a[i], b[i])));
    Grid::from_cells(a.width(), a.height(), cells.collect())
}

/// A picture in grey with marked pixels in a colour, each with its eight neighbours.
pub(crate) fn marked(
    picture: &Grid<[u8; 3]>,
    marks: impl Iterator<Item = ([u32; 2], [u8; 3])>,
) -> Grid<[u8; 3]> {
    let grey = |c: &[u8; 3]| [(c.iter().map(|c| u32::from(*c)).sum::<u32>() / 5) as u8; 3];
    let cells = picture.cells().iter().map(grey).collect();
    let mut marked = Grid::from_cells(picture.width(), picture.height(), cells);
    for ([x, y], color) in marks {
        let (x, y) = (x as usize, y as usize);
        for y in y.saturating_sub(1)..(y + 2).min(marked.height()) {
            for x in x.saturating_sub(1)..(x + 2).min(marked.width()) {
                marked[(x, y)] = color;
            }
        }
    }
    marked
}

/// Pictures beside and below each other, `columns` in a row, each made `side` pixels wide and
/// high or less, on a checkerboard that shows where they are transparent.
pub(crate) fn contact_sheet(
    pictures: impl ExactSizeIterator<Item = Grid<[u8; 4]>>,
    columns: usize,
    side: usize,
) -> Grid<[u8; 3]> {
    let unlabelled = pictures.map(|picture| (String::new(), picture));
    sheet(unlabelled, columns, [side, side])
}

/// The same, each with a line of ASCII text below, cut off where it is too long.
pub(crate) fn labelled_sheet(
    pictures: impl ExactSizeIterator<Item = (String, Grid<[u8; 4]>)>,
    columns: usize,
    side: usize,
) -> Grid<[u8; 3]> {
    sheet(pictures, columns, [side, side + GLYPH + 2])
}

/// Pixels along each side of a letter.
const GLYPH: usize = 8;

/// Pictures in fields of a size, those that are labelled at the foot of their fields.
fn sheet(
    pictures: impl ExactSizeIterator<Item = (String, Grid<[u8; 4]>)>,
    columns: usize,
    [width, height]: [usize; 2],
) -> Grid<[u8; 3]> {
    const SPACE: usize = 2;
    let rows = pictures.len().div_ceil(columns);
    let [across, down] = [width, height].map(|side| side + SPACE);
    let mut sheet = Grid::filled(columns * across + SPACE, rows * down + SPACE, [255; 3]);
    for (i, (label, picture)) in pictures.enumerate() {
        let (left, top) = (i % columns * across + SPACE, i / columns * down + SPACE);
        let small = smaller(&picture, width);
        for y in 0..small.height() {
            for (x, [r, g, b, a]) in small.row(y).iter().enumerate() {
                let board = if (x / 8 + y / 8) % 2 == 0 { 232 } else { 208 };
                let over = |c: &u8| {
                    let (c, a) = (u32::from(*c), u32::from(*a));
                    ((c * a + board * (255 - a)) / 255) as u8
                };
                sheet[(left + x, top + y)] = [over(r), over(g), over(b)];
            }
        }
        let letters = &label.as_bytes()[..label.len().min(width / GLYPH)];
        write_line(&mut sheet, letters, [left, top + height - GLYPH]);
    }
    sheet
}

/// Writes ASCII letters in black, from the upper left corner of the first one.
fn write_line(sheet: &mut Grid<[u8; 3]>, letters: &[u8], [left, top]: [usize; 2]) {
    for (i, letter) in letters.iter().enumerate() {
        let rows = font8x8::legacy::BASIC_LEGACY[usize::from(letter & 127)];
        for (y, row) in rows.into_iter().enumerate() {
            for x in (0..GLYPH).filter(|x| row >> x & 1 == 1) {
                sheet[(left + i * GLYPH + x, top + y)] = [0; 3];
            }
        }
    }
}

/// A picture made to fit into a square, texels averaged; as it is if it fits already.
fn smaller(picture: &Grid<[u8; 4]>, side: usize) -> Grid<[u8; 4]> {
    let (width, height) = (picture.width(), picture.height());
    let longest = width.max(height);
    if longest <= side {
        return picture.clone();
    }
    let fitting = |length: usize| (length * side / longest).max(1);
    let texels = picture.cells().concat();
    let image = image::RgbaImage::from_raw(width as u32, height as u32, texels)
        .expect("a picture has four bytes a texel");
    let (width, height) = (fitting(width), fitting(height));
    let small = image::imageops::thumbnail(&image, width as u32, height as u32);
    Grid::from_cells(width, height, small.pixels().map(|pixel| pixel.0).collect())
}

/// A picture as a PNG file.
pub(crate) fn png(picture: &Grid<[u8; 3]>) -> Vec<u8> {
    farfield_bundle::encode_png(&Image {
        name: String::new(),
        width: picture.width() as u32,
        height: picture.height() as u32,
        texels: picture
            .cells()
            .iter()
            .map(|&[r, g, b]| [r, g, b, 255])
            .collect(),
    })
}
