//! Reading a bundle's folder: nothing is believed before it is checked.

use crate::checksum::{sha256_of_manifest, sha256_of_reader};
use crate::manifest::{FORMAT, FileRecord, MANIFEST_FILE, Manifest, VERSION};
use crate::{BundleError, ManifestError};
use serde::Deserialize;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// No manifest is larger: a hundred thousand layers make 15 MB.
const MAX_MANIFEST_BYTES: u64 = 64 << 20;

/// Reads the manifest of the bundle in the folder `dir` and checks it, and the presence, size
/// and content of every file it lists.
///
/// Files that the manifest does not list are not looked at. Memory is in proportion to the
/// manifest, of which at most 64 MiB are read; the other files are streamed.
///
/// # Errors
///
/// The first thing that is missing, was changed since the bundle was written, or is not
/// possible; the error names the file. The checksums find accidents. They are no signature:
/// someone who changes a bundle can compute them anew.
pub fn read(dir: &Path) -> Result<Manifest, BundleError> {
    let path = dir.join(MANIFEST_FILE);
    let text = read_manifest_text(dir)?.ok_or_else(|| BundleError::NotABundle {
        dir: dir.to_owned(),
    })?;
    let manifest = parse(&path, &text)?;
    for file in &manifest.files {
        check_file(dir, file)?;
    }
    Ok(manifest)
}

/// Parses and checks the text of the manifest at `path`.
fn parse(path: &Path, text: &[u8]) -> Result<Manifest, BundleError> {
    let json = |source| BundleError::Json {
        path: path.to_owned(),
        source,
    };
    // First what tells whether the rest can be understood.
    let header: Header = serde_json::from_slice(text).map_err(json)?;
    if header.format != FORMAT {
        return Err(BundleError::WrongFormat {
            path: path.to_owned(),
            found: header.format,
        });
    }
    if header.version != u64::from(VERSION) {
        return Err(BundleError::UnknownVersion {
            path: path.to_owned(),
            found: header.version,
            known: VERSION,
        });
    }
    let manifest: Manifest = serde_json::from_slice(text).map_err(json)?;
    let invalid = |source: ManifestError| BundleError::Manifest {
        path: path.to_owned(),
        source,
    };
    manifest.check().map_err(invalid)?;
    let actual = std::str::from_utf8(text)
        .ok()
        .and_then(|text| sha256_of_manifest(text, &manifest.sha256));
    match actual {
        Some(actual) if actual == manifest.sha256 => Ok(manifest),
        _ => Err(BundleError::WrongChecksum {
            path: path.to_owned(),
        }),
    }
}

/// What every version of the format has.
#[derive(Deserialize)]
struct Header {
    format: String,
    version: u64,
}

/// Whether the folder holds the manifest of a bundle, of whatever version and state.
pub(crate) fn is_bundle(dir: &Path) -> Result<bool, BundleError> {
    let text = read_manifest_text(dir)?.unwrap_or_default();
    Ok(serde_json::from_slice(&text).is_ok_and(|header: Header| header.format == FORMAT))
}

/// The bytes of the folder's manifest, or `None` where it has none.
fn read_manifest_text(dir: &Path) -> Result<Option<Vec<u8>>, BundleError> {
    let path = dir.join(MANIFEST_FILE);
    let failed = |source| BundleError::Io {
        doing: "read",
        path: path.clone(),
        source,
    };
    match fs::metadata(&path) {
        Ok(found) if found.is_file() => {}
        Ok(_) => return Ok(None),
        Err(e) if is_absent(&e) => return Ok(None),
        Err(e) => return Err(failed(e)),
    }
    let mut text = Vec::new();
    File::open(&path)
        .and_then(|file| file.take(MAX_MANIFEST_BYTES + 1).read_to_end(&mut text))
        .map_err(failed)?;
    if text.len() as u64 > MAX_MANIFEST_BYTES {
        return Err(BundleError::TooLarge {
            path,
            limit: MAX_MANIFEST_BYTES,
        });
    }
    Ok(Some(text))
}

/// Checks that a listed file is there, of the right size and content.
fn check_file(dir: &Path, record: &FileRecord) -> Result<(), BundleError> {
    let path = dir.join(&record.path);
    let failed = |source| BundleError::Io {
        doing: "read",
        path: path.clone(),
        source,
    };
    let found = match fs::metadata(&path) {
        Ok(found) if found.is_file() => found.len(),
        Ok(_) => return Err(BundleError::Missing { path }),
        Err(e) if is_absent(&e) => return Err(BundleError::Missing { path }),
        Err(e) => return Err(failed(e)),
    };
    if found != record.bytes {
        return Err(BundleError::WrongSize {
            path,
            expected: record.bytes,
            found,
        });
    }
    let (bytes, sha256) = File::open(&path)
        .and_then(|file| sha256_of_reader(file, record.bytes))
        .map_err(failed)?;
    match bytes == record.bytes && sha256 == record.sha256 {
        true => Ok(()),
        false => Err(BundleError::WrongChecksum { path }),
    }
}

/// Whether a file is not there, or cannot be because a part of its path is not a folder.
fn is_absent(e: &io::Error) -> bool {
    matches!(
        e.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
    )
}
