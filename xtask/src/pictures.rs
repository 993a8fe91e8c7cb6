//! Pictures for people.

use anyhow::{Context, Result};
use farfield_grid::Grid;
use farfield_sampling::{NONE, srgb_from_linear};
use farfield_scene::Image;
use glam::Vec3;
use std::path::Path;

/// Linear RGB behind everything.
const BACKGROUND: Vec3 = Vec3::new(0.42, 0.56, 0.71);

/// A rendered picture over the background.
pub(crate) fn over_background(color: &Grid<Vec3>, ids: &Grid<u32>) -> Grid<Vec3> {
    let cells = color.cells().iter().zip(ids.cells());
    let cells = cells
        .map(|(color, id)| if *id == NONE { BACKGROUND } else { *color })
        .collect();
    Grid::from_cells(color.width(), color.height(), cells)
}

/// How much two pictures differ, four times as strong, on black.
pub(crate) fn difference(a: &Grid<Vec3>, b: &Grid<Vec3>) -> Grid<Vec3> {
    let cells = a
        .cells()
        .iter()
        .zip(b.cells())
        .map(|(a, b)| (*a - *b).abs() * 4.0)
        .collect();
    Grid::from_cells(a.width(), a.height(), cells)
}

/// A picture in grey with marked pixels in a colour, each with its eight neighbours.
pub(crate) fn marked(picture: &Grid<Vec3>, marks: &[([u32; 2], Vec3)]) -> Grid<Vec3> {
    let grey = picture
        .cells()
        .iter()
        .map(|c| Vec3::splat(c.element_sum() / 6.0))
        .collect();
    let mut marked = Grid::from_cells(picture.width(), picture.height(), grey);
    for &([x, y], color) in marks {
        let (x, y) = (x as usize, y as usize);
        for y in y.saturating_sub(1)..(y + 2).min(marked.height()) {
            for x in x.saturating_sub(1)..(x + 2).min(marked.width()) {
                marked[(x, y)] = color;
            }
        }
    }
    marked
}

/// Writes a picture of linear RGB as a PNG file.
pub(crate) fn write_png(path: &Path, picture: &Grid<Vec3>) -> Result<()> {
    let byte = |c: f32| (srgb_from_linear(c) * 255.0).round() as u8;
    let texel = |c: &Vec3| [byte(c.x), byte(c.y), byte(c.z), 255];
    let image = Image {
        name: String::new(),
        width: picture.width() as u32,
        height: picture.height() as u32,
        texels: picture.cells().iter().map(texel).collect(),
    };
    std::fs::write(path, farfield_bundle::encode_png(&image))
        .with_context(|| path.display().to_string())
}
