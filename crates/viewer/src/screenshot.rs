//! Pictures in files.

use anyhow::{Context, Result};
use farfield_grid::Grid;
use farfield_scene::Image;
use std::path::Path;

/// Writes a picture as a PNG file.
///
/// # Errors
///
/// When the operating system refuses.
pub(crate) fn write(picture: &Grid<[u8; 4]>, path: &Path) -> Result<()> {
    let png = farfield_bundle::encode_png(&Image {
        name: String::new(),
        width: picture.width() as u32,
        height: picture.height() as u32,
        texels: picture.cells().to_vec(),
    });
    std::fs::write(path, png).with_context(|| path.display().to_string())
}
