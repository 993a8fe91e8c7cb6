//! Pictures in files.

use anyhow::{Context, Result};
use farfield_grid::Grid;
use farfield_scene::Image;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes a picture as a PNG file, in place of one that may be there.
///
/// # Errors
///
/// When the operating system refuses.
pub(crate) fn write(picture: &Grid<[u8; 4]>, path: &Path) -> Result<()> {
    std::fs::write(path, png(picture)).with_context(|| path.display().to_string())
}

/// Writes a picture as a PNG file that is not there yet, and returns its path.
///
/// * `name` - with its folder; `.png` is appended, or the first of `-2.png`, `-3.png` ... that is free
///
/// # Errors
///
/// When the operating system refuses.
pub(crate) fn write_new(picture: &Grid<[u8; 4]>, name: &Path) -> Result<PathBuf> {
    let (mut path, mut number) = (with_suffix(name, ".png"), 1u64);
    let mut file = loop {
        match File::create_new(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                number += 1;
                path = with_suffix(name, &format!("-{number}.png"));
            }
            created => break created.with_context(|| path.display().to_string())?,
        }
    };
    let written = file.write_all(&png(picture));
    written.with_context(|| path.display().to_string())?;
    Ok(path)
}

/// Names may have dots.
fn with_suffix(name: &Path, suffix: &str) -> PathBuf {
    let mut path = name.as_os_str().to_owned();
    path.push(suffix);
    path.into()
}

fn png(picture: &Grid<[u8; 4]>) -> Vec<u8> {
    farfield_bundle::encode_png(&Image {
        name: String::new(),
        width: picture.width() as u32,
        height: picture.height() as u32,
        texels: picture.cells().to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing that was saved is overwritten, but what is named is.
    #[test]
    fn pictures_are_saved_beside_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let picture = |red| Grid::from_cells(1, 1, vec![[red, 0, 0, 255]]);
        let name = folder.path().join("town-1.5-split");
        let saved: Vec<PathBuf> = (0..3)
            .map(|red| write_new(&picture(red), &name).unwrap())
            .collect();
        let names = [
            "town-1.5-split.png",
            "town-1.5-split-2.png",
            "town-1.5-split-3.png",
        ];
        assert_eq!(saved, names.map(|name| folder.path().join(name)));
        for (red, path) in (0..).zip(&saved) {
            assert_eq!(std::fs::read(path).unwrap(), png(&picture(red)));
        }
        write(&picture(9), &saved[0]).unwrap();
        assert_eq!(std::fs::read(&saved[0]).unwrap(), png(&picture(9)));
        assert!(write_new(&picture(0), &folder.path().join("none/town")).is_err());
    }
}
