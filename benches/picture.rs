//! What a camera sees of a representation.

use farfield_bundle::encode_png;
use farfield_grid::Grid;
use farfield_sampling::{Lighting, NONE, Textures, rasterize, shade, srgb_from_linear};
use farfield_scene::{Image, Scene};
use farfield_views::Camera;
use glam::Vec3;
use std::path::Path;

/// A rendered picture, sampled at the pixels' centres.
pub(crate) struct Picture {
    /// Along the view axis, in metres; infinite where nothing is seen.
    pub(crate) depth: Grid<f64>,
    /// [`NONE`] where nothing is seen.
    pub(crate) ids: Grid<u32>,
    /// Linear RGB; anything where nothing is seen.
    pub(crate) color: Grid<Vec3>,
}

/// Linear RGB behind everything: the blue of a clear sky.
const BACKGROUND: Vec3 = Vec3::new(0.42, 0.56, 0.71);

/// What a camera sees of a scene under the light that is baked.
pub(crate) fn render(scene: &Scene, textures: &Textures<'_>, camera: &Camera) -> Picture {
    let seen = rasterize(scene, textures, camera);
    Picture {
        color: shade(scene, textures, camera, &seen, &Lighting::default()),
        depth: seen.depth,
        ids: seen.objects,
    }
}

/// sRGB values of a picture over the background.
pub(crate) fn over_background(picture: &Picture) -> Grid<[u8; 3]> {
    let cells = picture.color.cells().iter().zip(picture.ids.cells());
    let cells = cells
        .map(|(color, id)| srgb_bytes(if *id == NONE { BACKGROUND } else { *color }))
        .collect();
    Grid::from_cells(picture.color.width(), picture.color.height(), cells)
}

/// Linear RGB as sRGB bytes.
pub(crate) fn srgb_bytes(color: Vec3) -> [u8; 3] {
    color
        .to_array()
        .map(|c| (srgb_from_linear(c) * 255.0).round() as u8)
}

/// Writes a picture as a PNG file.
pub(crate) fn write_png(path: &Path, picture: &Grid<[u8; 3]>) {
    let image = Image {
        name: String::new(),
        width: picture.width() as u32,
        height: picture.height() as u32,
        texels: picture
            .cells()
            .iter()
            .map(|[r, g, b]| [*r, *g, *b, 255])
            .collect(),
    };
    std::fs::write(path, encode_png(&image)).expect("the picture can be written");
}
