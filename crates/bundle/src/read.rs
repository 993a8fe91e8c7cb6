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
    let json = |error| BundleError::Json {
        path: path.to_owned(),
        error,
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
    let invalid = |error: ManifestError| BundleError::Manifest {
        path: path.to_owned(),
        error,
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
    let failed = |error| BundleError::Io {
        doing: "read",
        path: path.clone(),
        error,
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
    let failed = |error| BundleError::Io {
        doing: "read",
        path: path.clone(),
        error,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{sample, sample_files};
    use crate::write;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    /// A small bundle in a folder that is removed at the end.
    fn bundle() -> (tempfile::TempDir, Manifest) {
        let dir = tempfile::tempdir().unwrap();
        let manifest = write(dir.path(), &sample(), &sample_files()).unwrap();
        (dir, manifest)
    }

    /// Whichever byte of whichever file is changed, and in whichever bit, reading fails and names
    /// the file.
    #[test]
    fn every_flipped_byte_is_found() {
        let (dir, manifest) = bundle();
        let listed = manifest.files.iter().map(|file| &*file.path);
        for path in listed.chain([MANIFEST_FILE]) {
            let path = dir.path().join(path);
            let sound = fs::read(&path).unwrap();
            for i in 0..sound.len() {
                let mut damaged = sound.clone();
                // All bits in turn.
                damaged[i] ^= 1 << (i % 8);
                fs::write(&path, &damaged).unwrap();
                let message = read(dir.path()).unwrap_err().to_string();
                let name = path.display().to_string();
                assert!(message.contains(&name), "byte {i} of {name}: {message}");
            }
            fs::write(&path, sound).unwrap();
        }
        assert_eq!(read(dir.path()).unwrap(), manifest);
    }

    /// Wherever a file is cut off, and when something is appended, reading fails.
    #[test]
    fn every_wrong_length_is_found() {
        let (dir, manifest) = bundle();
        let listed = manifest.files.iter().map(|file| &*file.path);
        for path in listed.chain([MANIFEST_FILE]) {
            let path = dir.path().join(path);
            let sound = fs::read(&path).unwrap();
            for len in 0..sound.len() {
                fs::write(&path, &sound[..len]).unwrap();
                assert!(read(dir.path()).is_err(), "{} cut at {len}", path.display());
            }
            fs::write(&path, [&sound[..], b"\n"].concat()).unwrap();
            assert!(read(dir.path()).is_err());
            fs::write(&path, sound).unwrap();
        }
        assert_eq!(read(dir.path()).unwrap(), manifest);
    }

    #[test]
    fn every_missing_file_is_named() {
        let (dir, manifest) = bundle();
        for file in &manifest.files {
            let path = dir.path().join(&file.path);
            let sound = fs::read(&path).unwrap();
            fs::remove_file(&path).unwrap();
            let missing = |e| matches!(e, BundleError::Missing { path: p } if p == path);
            assert!(read(dir.path()).is_err_and(missing));
            // A folder of that name is no file.
            fs::create_dir(&path).unwrap();
            let missing = |e| matches!(e, BundleError::Missing { path: p } if p == path);
            assert!(read(dir.path()).is_err_and(missing));
            fs::remove_dir(&path).unwrap();
            fs::write(&path, sound).unwrap();
        }
        fs::remove_file(dir.path().join(MANIFEST_FILE)).unwrap();
        let found = read(dir.path());
        assert!(matches!(found, Err(BundleError::NotABundle { .. })));
        let found = read(&dir.path().join("nowhere"));
        assert!(matches!(found, Err(BundleError::NotABundle { .. })));
    }

    /// A later version may have any content; what is said is that it is later.
    #[test]
    fn a_newer_version_asks_for_a_newer_farfield() {
        let (dir, _) = bundle();
        let text = json!({ "format": FORMAT, "version": 2, "shape": "other" }).to_string();
        fs::write(dir.path().join(MANIFEST_FILE), text).unwrap();
        let error = read(dir.path()).unwrap_err();
        assert!(matches!(
            error,
            BundleError::UnknownVersion { found: 2, .. }
        ));
        assert!(error.to_string().contains("use a newer farfield"));
        assert!(is_bundle(dir.path()).unwrap());
    }

    #[test]
    fn a_manifest_of_something_else_is_told_apart() {
        let (dir, _) = bundle();
        let text = json!({ "format": "other", "version": 1 }).to_string();
        fs::write(dir.path().join(MANIFEST_FILE), text).unwrap();
        let error = read(dir.path()).unwrap_err();
        assert!(matches!(error, BundleError::WrongFormat { found, .. } if found == "other"));
        assert!(!is_bundle(dir.path()).unwrap());
    }

    /// A manifest of any size is refused before it is held in memory.
    #[test]
    fn a_huge_manifest_is_refused() {
        let (dir, _) = bundle();
        // Sparse: takes no room on disk.
        let file = File::create(dir.path().join(MANIFEST_FILE)).unwrap();
        file.set_len(1 << 40).unwrap();
        let error = read(dir.path()).unwrap_err();
        assert!(matches!(error, BundleError::TooLarge { .. }));
    }

    /// All places in a JSON document.
    fn places(value: &Value, place: String, all: &mut Vec<String>) {
        match value {
            Value::Object(fields) => {
                for (name, value) in fields {
                    places(value, format!("{place}/{name}"), all);
                }
            }
            Value::Array(values) => {
                for (i, value) in values.iter().enumerate() {
                    places(value, format!("{place}/{i}"), all);
                }
            }
            _ => {}
        }
        all.push(place);
    }

    proptest! {
        /// Whatever stands in the place of a part of the manifest gives an error, never a panic.
        #[test]
        fn hostile_values_are_errors(at: prop::sample::Index, value: prop::sample::Index) {
            let mut manifest = serde_json::to_value(sample()).unwrap();
            let mut all = Vec::new();
            places(&manifest, String::new(), &mut all);
            let values = [
                json!(null), json!(true), json!(0), json!(-1), json!(1), json!(1e308), json!(-5e-324),
                json!(u64::MAX), json!(""), json!("../../etc/passwd"), json!("layered"), json!([]),
                json!({}), json!([0, 0, 0]), json!([1e308, 1e308, 1e308]), json!([[1], [2], [3]]),
                Value::Array(vec![json!({}); 1000]),
            ];
            *manifest.pointer_mut(&all[at.index(all.len())]).unwrap() = values[value.index(values.len())].clone();
            // The checksum cannot fit, so even where the value could be, this is an error.
            let text = serde_json::to_vec_pretty(&manifest).unwrap();
            prop_assert!(parse(Path::new("bundle.json"), &text).is_err());
        }

        /// Pieces cut out, doubled or put somewhere else give an error, never a panic.
        #[test]
        fn scrambled_manifests_are_errors(cuts: [prop::sample::Index; 3], junk in ".{0,3}") {
            let text = serde_json::to_string_pretty(&sample()).unwrap().into_bytes();
            let [a, b, c] = cuts.map(|cut| cut.index(text.len()));
            let (a, b) = (a.min(b), a.max(b));
            let scrambled = [&text[..a], &text[c..], junk.as_bytes(), &text[b..]].concat();
            prop_assume!(scrambled != text);
            prop_assert!(parse(Path::new("bundle.json"), &scrambled).is_err());
        }
    }
}
