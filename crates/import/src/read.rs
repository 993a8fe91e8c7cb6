//! Reads scenes from disk.

use crate::gltf::{GltfError, read_gltf};
use crate::mesh_error::MeshFileError;
use crate::obj::read_obj;
use crate::ply::read_ply;
use farfield_scene::Scene;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Fetches a file by its path relative to the scene's own, with `/` between folders.
pub type Load<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// A scene and what was dropped or changed on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// Passes [`Scene::check`].
    pub scene: Scene,
    /// One line each, with a count, such as "triangles without area, dropped: 108".
    pub warnings: Vec<String>,
    /// Files beside the scene's own that were read, as paths relative to it, in the order of
    /// reading, each once.
    pub files: Vec<String>,
}

/// Why a scene cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file itself cannot be read.
    #[error("{}: cannot be read: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        error: io::Error,
    },
    /// The content is of no format that is read.
    #[error(
        "{}: is none of glTF, GLB, PLY and OBJ (whose name must end with .obj); convert it to glTF 2.0",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The file has no content.
    #[error("{}: is empty; fetch or export it again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Something in a glTF file is wrong.
    #[error("{}: {error}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        error: GltfError,
    },
    /// Something in an OBJ or PLY file, or beside it, is wrong.
    #[error("{}: {error}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        error: MeshFileError,
    },
}

/// Reads a scene from a file, of the format that its content tells, whatever its name; an OBJ file,
/// which could be any text, is told by its name.
///
/// Files that it refers to are searched from its folder on. Only regular files are read.
///
/// # Errors
///
/// When the file cannot be read, is of no known format, or something in it is wrong.
pub fn read(path: &Path) -> Result<Imported, ImportError> {
    let bytes = read_regular(path).map_err(|error| ImportError::File {
        path: path.into(),
        error,
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut load = |name: &str| read_regular(&folder.join(name));
    let mesh_error = |error| ImportError::Mesh {
        path: path.into(),
        error,
    };
    if bytes.is_empty() {
        Err(ImportError::Empty { path: path.into() })
    } else if is_gltf(&bytes) {
        read_gltf(&bytes, &mut load).map_err(|error| ImportError::Gltf {
            path: path.into(),
            error,
        })
    } else if is_ply(&bytes) {
        read_ply(&bytes).map_err(mesh_error)
    } else if is_named_obj(path) {
        read_obj(&bytes, &mut load).map_err(mesh_error)
    } else {
        Err(ImportError::Format { path: path.into() })
    }
}

/// Whether content is glTF's container, or a JSON object.
fn is_gltf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.starts_with(b"glTF") || text.trim_ascii_start().starts_with(b"{")
}

/// Whether content begins as PLY files do: with a line `ply`.
fn is_ply(bytes: &[u8]) -> bool {
    matches!(bytes, [b'p', b'l', b'y', b'\n' | b'\r', ..])
}

fn is_named_obj(path: &Path) -> bool {
    path.extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("obj"))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle whose positions stand in `folder/a b.bin`, and the file of that name.
    fn write_triangle(folder: &Path) -> PathBuf {
        let positions: Vec<u8> = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .collect();
        fs::create_dir(folder.join("folder")).unwrap();
        fs::write(folder.join("folder/a b.bin"), positions).unwrap();
        let path = folder.join("triangle.of-no-known-kind");
        let document = r#"
            {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"uri": "folder/a%20b.bin", "byteLength": 36}]}"#;
        fs::write(&path, document).unwrap();
        path
    }

    #[test]
    fn a_file_and_what_lies_beside_it_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = write_triangle(folder.path());
        assert_eq!(read(&path).unwrap().scene.drawn_triangles(), 1);

        fs::remove_file(folder.path().join("folder/a b.bin")).unwrap();
        let message = read(&path).unwrap_err().to_string();
        let expected = format!("{}: buffers[0].uri: \"folder/a b.bin\"", path.display());
        assert!(message.starts_with(&expected), "{message}");
    }

    #[test]
    fn formats_are_told_by_content_and_obj_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let corners = "0 0 0\n1 0 0\n0 1 0\n";
        let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
            property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let ply = format!("{header}{corners}3 0 1 2\n");
        let obj = "mtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
        fs::write(folder.path().join("a b.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
        for (name, content) in [("a.obj", ply.as_str()), ("b.OBJ", obj), ("c", ply.as_str())] {
            let path = folder.path().join(name);
            fs::write(&path, content).unwrap();
            let imported = read(&path).unwrap();
            assert_eq!(imported.scene.drawn_triangles(), 1, "{name}");
            let files = if name == "b.OBJ" {
                vec!["a b.mtl"]
            } else {
                vec![]
            };
            assert_eq!(imported.files, files);
        }
        let path = folder.path().join("d.txt");
        fs::write(&path, obj).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(
            message.contains("none of glTF, GLB, PLY and OBJ"),
            "{message}"
        );
        let path = folder.path().join("f.glb");
        fs::write(&path, "").unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains("f.glb: is empty;"), "{message}");
        let path = folder.path().join("e.obj");
        fs::write(&path, "v 0 0\n").unwrap();
        let message = read(&path).unwrap_err().to_string();
        let expected = format!("{}: line 1: v has 2 numbers", path.display());
        assert!(message.starts_with(&expected), "{message}");
    }

    #[test]
    fn what_is_no_scene_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.glb");
        let refused = || read(&path).unwrap_err();
        assert!(matches!(refused(), ImportError::File { .. }));
        fs::write(&path, "").unwrap();
        assert!(matches!(refused(), ImportError::Empty { .. }));
        for content in ["  ", "solid cube", "[]"] {
            fs::write(&path, content).unwrap();
            assert!(
                matches!(refused(), ImportError::Format { .. }),
                "{content:?}"
            );
        }
        fs::write(&path, "{").unwrap();
        assert!(matches!(refused(), ImportError::Gltf { .. }));
        // A folder is no file.
        let error = read(folder.path()).unwrap_err();
        assert!(matches!(error, ImportError::File { .. }), "{error}");
    }
}
