//! Reading a bundle's folder: nothing is believed before it is checked.

use crate::checksum::{is_sealed, sha256_of_reader};
use crate::manifest::{FORMAT, FileRecord, MANIFEST_FILE, Manifest, VERSION};
use crate::write::{FolderKind, failed};
use crate::{BundleError, ManifestError};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

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
    let text = read_text(dir.join(MANIFEST_FILE))?.ok_or_else(|| BundleError::NotABundle {
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
    let json = |(place, error)| BundleError::Json {
        path: path.to_owned(),
        place,
        error,
    };
    // First what tells whether the rest can be understood.
    let header: Header = parse_json(text).map_err(json)?;
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
    let manifest: Manifest = parse_json(text).map_err(json)?;
    let invalid = |error: ManifestError| BundleError::Manifest {
        path: path.to_owned(),
        error,
    };
    manifest.check().map_err(invalid)?;
    match is_sealed(text, &manifest.sha256) {
        true => Ok(manifest),
        false => Err(BundleError::WrongChecksum {
            path: path.to_owned(),
        }),
    }
}

/// What every version of every format has.
#[derive(Deserialize)]
pub(crate) struct Header {
    pub(crate) format: String,
    pub(crate) version: u64,
}

/// Parses a JSON document, or says at which place in it what is wrong.
pub(crate) fn parse_json<T: DeserializeOwned>(
    text: &[u8],
) -> Result<T, (String, serde_json::Error)> {
    let whole = || "the document".to_owned();
    let mut parser = serde_json::Deserializer::from_slice(text);
    let document = serde_path_to_error::deserialize(&mut parser).map_err(|error| {
        let place = match error.path().iter().len() {
            0 => whole(),
            _ => error.path().to_string(),
        };
        (place, error.into_inner())
    })?;
    parser.end().map_err(|error| (whole(), error))?;
    Ok(document)
}

/// Whether the folder holds the marker of a kind, such as the manifest of a bundle, of whatever
/// version and state.
pub(crate) fn is_of_kind(dir: &Path, kind: &FolderKind) -> Result<bool, BundleError> {
    let text = read_text(dir.join(kind.marker))?.unwrap_or_default();
    Ok(serde_json::from_slice(&text).is_ok_and(|header: Header| header.format == kind.format))
}

/// The bytes of a manifest or marker, or `None` where there is none.
fn read_text(path: PathBuf) -> Result<Option<Vec<u8>>, BundleError> {
    match fs::metadata(&path) {
        Ok(found) if found.is_file() => {}
        Ok(_) => return Ok(None),
        Err(e) if is_absent(&e) => return Ok(None),
        Err(e) => return Err(failed("read", &path)(e)),
    }
    let text = read_beginning(&path, MAX_MANIFEST_BYTES + 1)?;
    if text.len() as u64 > MAX_MANIFEST_BYTES {
        return Err(BundleError::TooLarge {
            path,
            limit: MAX_MANIFEST_BYTES,
        });
    }
    Ok(Some(text))
}

/// The first `limit` bytes of a file, or all if it has fewer.
pub(crate) fn read_beginning(path: &Path, limit: u64) -> Result<Vec<u8>, BundleError> {
    let mut text = Vec::new();
    File::open(path)
        .and_then(|file| file.take(limit).read_to_end(&mut text))
        .map_err(failed("read", path))?;
    Ok(text)
}

/// Checks that a listed file is there, of the right size and content.
fn check_file(dir: &Path, record: &FileRecord) -> Result<(), BundleError> {
    let path = dir.join(&record.path);
    let found = match fs::metadata(&path) {
        Ok(found) if found.is_file() => found.len(),
        Ok(_) => return Err(BundleError::Missing { path }),
        Err(e) if is_absent(&e) => return Err(BundleError::Missing { path }),
        Err(e) => return Err(failed("read", &path)(e)),
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
        .map_err(failed("read", &path))?;
    match bytes == record.bytes && sha256 == record.sha256 {
        true => Ok(()),
        false => Err(BundleError::WrongChecksum { path }),
    }
}

/// Whether a file is not there, or cannot be because a part of its path is not a folder.
pub(crate) fn is_absent(e: &io::Error) -> bool {
    matches!(
        e.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checksum::seal;
    use crate::generate::{damages, manifests, sample, sample_files};
    use crate::write::{BUNDLE, write};
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
        assert!(is_of_kind(dir.path(), &BUNDLE).unwrap());
    }

    #[test]
    fn a_manifest_of_something_else_is_told_apart() {
        let (dir, _) = bundle();
        let text = json!({ "format": "other", "version": 1 }).to_string();
        fs::write(dir.path().join(MANIFEST_FILE), text).unwrap();
        let error = read(dir.path()).unwrap_err();
        assert!(matches!(error, BundleError::WrongFormat { found, .. } if found == "other"));
        assert!(!is_of_kind(dir.path(), &BUNDLE).unwrap());
    }

    /// Every error of a manifest names the file, the place in it, and what to do.
    #[test]
    fn errors_name_file_place_and_remedy() {
        let sound = serde_json::to_string_pretty(&sample()).unwrap();
        let path = Path::new("house/bundle.json");
        let edit = |from: &str, to: &str| {
            assert!(sound.contains(from), "{from}");
            sound.replacen(from, to, 1)
        };
        let cut = |at: &str| sound[..sound.find(at).unwrap() + at.len()].to_owned();
        for (text, place, problem, remedy) in [
            (
                String::new(),
                "the document",
                "EOF",
                "bake the bundle again",
            ),
            (
                "no".into(),
                "the document",
                "expected ident",
                "bake the bundle again",
            ),
            (
                "{}".into(),
                "the document",
                "missing field `format`",
                "bake the bundle again",
            ),
            (
                sound.clone() + "}",
                "the document",
                "trailing characters",
                "bake the bundle again",
            ),
            (
                edit("\"farfield-bundle\"", "\"other\""),
                "format",
                "is \"other\"",
                "bake one",
            ),
            (
                edit("\"version\": 1", "\"version\": 9"),
                "version",
                "9",
                "use a newer farfield",
            ),
            (
                edit("\"version\": 1", "\"version\": -1"),
                "version",
                "`-1`",
                "bake the bundle again",
            ),
            (
                cut("\"resolution\": 5"),
                "options",
                "EOF while parsing",
                "bake the bundle again",
            ),
            (
                edit("\"resolution\": 512", "\"resolution\": \"512\""),
                "options.resolution",
                "expected u32",
                "bake the bundle again",
            ),
            (
                edit("\"triangles\": 0", "\"triangels\": 0"),
                "statistics.before.triangels",
                "unknown field `triangels`",
                "bake the bundle again",
            ),
            (
                edit("\"near\": 4.0", "\"near\": null"),
                "impostors[0].body",
                "expected f64",
                "bake the bundle again",
            ),
            (
                edit("\"near\": 4.0", "\"near\": 40.0"),
                "impostors[0].body.layers[0]",
                "not in order",
                "bake the bundle again",
            ),
            (
                edit("\"gap_pixels\": 0", "\"gap_pixels\": 1"),
                "",
                "does not match its checksum",
                "bake the bundle again",
            ),
        ] {
            let message = parse(path, text.as_bytes()).unwrap_err().to_string();
            let place = match place {
                // It cannot be told what was changed.
                "" => "house/bundle.json ".to_owned(),
                place => format!("house/bundle.json: {place}"),
            };
            assert!(message.starts_with(&place), "{message}, expected {place}");
            assert!(message.contains(problem), "{message}, expected {problem}");
            assert!(message.ends_with(remedy), "{message}, expected {remedy}");
        }
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

        /// However a manifest is cut off or changed, reading it gives an error that names the file,
        /// never a panic.
        #[test]
        fn damaged_manifests_are_errors(mut manifest in manifests(), damage in damages()) {
            let path = Path::new("bundle.json");
            let sound = seal(&mut manifest, |manifest| &mut manifest.sha256).into_bytes();
            prop_assert_eq!(parse(path, &sound).unwrap(), manifest);
            let damaged = damage.of(&sound);
            prop_assume!(damaged != sound);
            let message = parse(path, &damaged).unwrap_err().to_string();
            prop_assert!(message.starts_with("bundle.json"), "{}", message);
        }
    }
}
