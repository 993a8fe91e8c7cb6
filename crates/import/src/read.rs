//! Reads scenes from disk.

use crate::gltf::{GltfError, read_gltf};
use farfield_scene::Scene;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// A scene and what was dropped or changed on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// Passes [`Scene::check`].
    pub scene: Scene,
    /// One line each, with a count, such as "triangles without area, dropped: 108".
    pub warnings: Vec<String>,
}

/// Why a scene cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file itself cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The content is of no format that is read.
    #[error("{}: is neither glTF nor GLB; convert it to glTF 2.0", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// Something in a glTF file is wrong.
    #[error("{}: {source}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: GltfError,
    },
}

/// Reads a scene from a file, of the format that its content tells, whatever its name.
///
/// Files that it refers to are searched from its folder on. Only regular files are read.
///
/// # Errors
///
/// When the file cannot be read, is of no known format, or something in it is wrong.
pub fn read(path: &Path) -> Result<Imported, ImportError> {
    let bytes = read_regular(path).map_err(|source| ImportError::File {
        path: path.into(),
        source,
    })?;
    if !is_gltf(&bytes) {
        return Err(ImportError::Format { path: path.into() });
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut load = |name: &str| read_regular(&folder.join(name));
    read_gltf(&bytes, &mut load).map_err(|source| ImportError::Gltf {
        path: path.into(),
        source,
    })
}

/// Whether content is glTF's container, or a JSON object.
fn is_gltf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.starts_with(b"glTF") || text.trim_ascii_start().starts_with(b"{")
}

/// A file's content; a device or a pipe could be endless.
fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    match fs::metadata(path)?.is_file() {
        true => fs::read(path),
        false => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "is not a regular file",
        )),
    }
}
