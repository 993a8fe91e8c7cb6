//! What a verification adds to a bundle that kept its promise.

use crate::checksum::{is_sealed, seal};
use crate::manifest::{Generator, Manifest, SceneSource};
use crate::read::{Header, is_absent, parse_json, read_beginning};
use crate::view_space::ViewSpace;
use crate::write::{failed, flush_folder, random_digits, write_new_file};
use crate::{BundleError, ManifestError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// The value of [`Certificate::format`].
pub const CERTIFICATE_FORMAT: &str = "farfield-certificate";

/// The value of [`Certificate::version`] that this crate writes, and the greatest it reads.
pub const CERTIFICATE_VERSION: u32 = 1;

/// The name of the certificate's file in a bundle's folder.
pub const CERTIFICATE_FILE: &str = "certificate.json";

/// The JSON schema of `certificate.json`, draft 2020-12. It is also a file beside this crate's
/// source.
pub const CERTIFICATE_SCHEMA: &str = include_str!("../schema/certificate-1.schema.json");

/// No certificate is larger: it has a few dozen numbers and sentences.
const MAX_CERTIFICATE_BYTES: u64 = 4 << 20;

/// That a bundle kept its promise when it was verified: for which bundle, scene and camera, what
/// was measured from where, what holds for every viewpoint, and how far it holds beyond the view
/// cell.
///
/// It is no signature: whoever can write the file can write anything into it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Always "farfield-certificate".
    #[schemars(extend("const" = CERTIFICATE_FORMAT))]
    pub format: String,
    /// The format's version: 1.
    #[schemars(extend("const" = CERTIFICATE_VERSION))]
    pub version: u32,
    /// What verified the bundle.
    pub generator: Generator,
    /// The checksum that the bundle's manifest states of itself, and so that of all its files.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub bundle_sha256: String,
    /// The original that the bundle was compared with, as in the manifest.
    pub scene: SceneSource,
    /// Where the camera may be, as in the manifest.
    pub view_space: ViewSpace,
    /// Pixels along each side of the camera, as in the manifest; from 1 to 16384.
    #[schemars(range(min = 1, max = 16384))]
    pub resolution: u32,
    /// Full angle that the camera sees, in degrees, between 0 and 180; as in the manifest.
    pub fov_degrees: f64,
    /// Number of viewpoints looked from, at least 1. They are numbered from 0, which is the
    /// reference viewpoint.
    #[schemars(range(min = 1))]
    pub viewpoints: u64,
    /// Seed of the viewpoints that are chosen at random.
    pub seed: u64,
    /// The worst that was measured from these viewpoints.
    pub worst: WorstFigures,
    /// What holds by construction for every viewpoint of the view cell.
    pub proved: Vec<ProvedBound>,
    /// What was only measured, from the viewpoints given, a sentence each.
    pub sampled: Vec<String>,
    /// How far the promise holds outside of the view cell; null where that was not looked into.
    pub beyond: Option<Beyond>,
    /// SHA-256 of the certificate's own file in which the 64 digits of this field are replaced by
    /// zeros, in lower-case hexadecimal digits. Filled in when the certificate is written.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub sha256: String,
}

/// The worst figures that were measured. All are finite and at least 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WorstFigures {
    /// Pixels at which one sees through the impostor or into a layer too far behind, in all
    /// views together.
    pub gap_pixels: u64,
    /// Pixels that only the impostor covers, far from the original, in all views together.
    pub phantom_pixels: u64,
    /// The farthest that a point appears from where it is, in pixels.
    pub parallax_px: f64,
    /// The farthest that a silhouette appears from where it is, in pixels.
    pub silhouette_px: f64,
    /// Pixels of the original that the impostor misses, as a share of the original's, in the view
    /// where it is greatest.
    pub coverage_error: f64,
    /// The mean signed colour difference a channel, over pixels covered by both, as a share of
    /// full intensity; to either side of 0.
    pub colour_bias: f64,
    /// Pixels in the midst of colours that the original does not show anywhere near, as a share of
    /// those inside of what both cover, in all views together.
    pub stray_colours: f64,
    /// Pixels that show a primitive which is not drawn, in the view where they are most; absent where
    /// nothing is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// The mean FLIP error of the view where it is greatest, from 0 to 1; null where FLIP was not
    /// computed.
    pub flip: Option<f64>,
    /// The number of the worst viewpoint, less than that of the viewpoints.
    pub worst_view: u64,
}

/// Something that holds for every viewpoint of the view cell, by construction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProvedBound {
    /// What holds, a sentence that names the figure and its unit.
    pub statement: String,
    /// The figure that this bundle reaches, as computed from its files; finite.
    pub bound: f64,
    /// The figure that it has to keep to; finite.
    pub limit: f64,
}

/// How far a promise holds outside of the view cell. All figures are finite and at least 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beyond {
    /// The promise holds in the view cell scaled about its centre by this factor.
    pub cell_scale: f64,
    /// The distance from the represented box below which an engine should switch back to
    /// geometry, in metres.
    pub switch_distance_m: f64,
    /// The share of the picture's height that the represented box's bounding sphere covers from
    /// there. A sphere that is higher than the picture covers more than 1.
    pub screen_coverage: f64,
    /// The `geometricError` of 3D Tiles with which a client whose `maximumScreenSpaceError` is 1
    /// switches there, in metres. Multiply it by the client's `maximumScreenSpaceError` otherwise.
    pub geometric_error_m: f64,
}

/// What is known of a bundle's certificate.
#[derive(Clone, Debug, PartialEq)]
pub enum CertificateState {
    /// The bundle has none: it was not verified, or did not keep its promise.
    Missing,
    /// The bundle is the one that was verified.
    Valid(Box<Certificate>),
    /// There is one, but it says nothing about this bundle.
    Stale {
        /// Why, and what to do; reads on after "the certificate", such as "belongs to another bake;
        /// verify the bundle again".
        why: String,
    },
}

/// Writes the certificate of the bundle in the folder `dir`, with its `sha256` filled in.
///
/// It is written and flushed in a file beside and then renamed: `certificate.json` is at any time
/// the old one or the new one, complete. The manifest does not list it, for that was sealed by the
/// bake. Whether the certificate is about this bundle is found when it is read, not here: the
/// folder may change until then.
///
/// [`write()`](crate::write()) replaces the whole folder, so that a new bake drops the certificate.
///
/// ```
/// # use farfield_bundle::*;
/// # let cell = farfield_views::ViewCell::Box { center: glam::DVec3::Z, size: glam::DVec3::ONE };
/// # let manifest = Manifest {
/// #     format: FORMAT.into(),
/// #     version: VERSION,
/// #     generator: Generator { name: "example".into(), version: "1.0".into() },
/// #     technique: Technique::Layered { bytes_per_quad: 104.0, page_size: 4096, foliage: Foliage::Any, channels: Channels::Lit },
/// #     options: Options { resolution: 512, fov_degrees: 45.0, view_space: ViewSpace::Before { view_cell: cell }, exclude: vec![] },
/// #     scene: SceneSource::BuiltIn { name: "house".into(), size: 1, seed: 0 },
/// #     promise: Promise::default(),
/// #     statistics: Statistics::default(),
/// #     warnings: vec![],
/// #     impostors: vec![],
/// #     files: vec![],
/// #     sha256: String::new(),
/// # };
/// # let dir = tempfile::tempdir()?;
/// # let dir = &dir.path().join("house-layered");
/// # write(dir, &manifest, &[NewFile { path: GLTF_FILE.into(), bytes: vec![] }])?;
/// let manifest = read(dir)?;
/// let certificate = Certificate {
///     format: CERTIFICATE_FORMAT.into(),
///     version: CERTIFICATE_VERSION,
///     generator: Generator { name: "example".into(), version: "1.0".into() },
///     bundle_sha256: manifest.sha256.clone(),
///     scene: manifest.scene.clone(),
///     view_space: manifest.options.view_space.clone(),
///     resolution: manifest.options.resolution,
///     fov_degrees: manifest.options.fov_degrees,
///     viewpoints: 256,
///     seed: 1,
///     worst: WorstFigures { parallax_px: 0.7, worst_view: 31, ..WorstFigures::default() },
///     proved: vec![],
///     sampled: vec!["Gap pixels were counted.".into()],
///     beyond: None,
///     sha256: String::new(),
/// };
/// write_certificate(dir, &certificate)?;
/// assert!(matches!(read_certificate(dir, &manifest)?, CertificateState::Valid(_)));
///
/// // A new bake is not yet verified.
/// write(dir, &manifest, &[NewFile { path: GLTF_FILE.into(), bytes: vec![] }])?;
/// assert_eq!(read_certificate(dir, &manifest)?, CertificateState::Missing);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// When [`Certificate::check`] finds something, the text has more than 4 MiB, or the operating
/// system refuses. Then all is as it was before.
pub fn write_certificate(dir: &Path, certificate: &Certificate) -> Result<(), BundleError> {
    let path = dir.join(CERTIFICATE_FILE);
    let text = complete(certificate).map_err(|error| BundleError::Invalid {
        path: path.clone(),
        error,
    })?;
    // A name of its own, for others may verify the same bundle.
    let partial = dir.join(format!(".{CERTIFICATE_FILE}.{}", random_digits()));
    let written = write_new_file(&partial, text.as_bytes())
        .and_then(|()| fs::rename(&partial, &path).map_err(failed("write", &path)));
    if written.is_err() {
        // May not have been made at all.
        let _ = fs::remove_file(&partial);
    }
    written?;
    flush_folder(dir)
}

/// The text of a certificate with its `sha256` filled in.
fn complete(certificate: &Certificate) -> Result<String, ManifestError> {
    certificate.check()?;
    let text = seal(&mut certificate.clone(), |certificate| {
        &mut certificate.sha256
    });
    match text.len() as u64 > MAX_CERTIFICATE_BYTES {
        true => Err(ManifestError {
            place: "the document".into(),
            problem: format!("has more than {MAX_CERTIFICATE_BYTES} bytes"),
        }),
        false => Ok(text),
    }
}

/// Removes the certificate of the bundle in the folder `dir`, if it has one: for a bundle that was
/// found to break its promise.
///
/// # Errors
///
/// When the operating system refuses.
pub fn remove_certificate(dir: &Path) -> Result<(), BundleError> {
    let path = dir.join(CERTIFICATE_FILE);
    match fs::remove_file(&path) {
        Ok(()) => flush_folder(dir),
        Err(e) if is_absent(&e) => Ok(()),
        Err(e) => Err(failed("remove", &path)(e)),
    }
}

/// Reads the certificate of the bundle in the folder `dir` and tells whether it is about the
/// bundle whose manifest is `manifest`, as [`read()`](crate::read()) returned it.
///
/// A certificate that is damaged, edited, foreign, of a newer version or about something else
/// is stale, and no error: the bundle is as good as one without. At most 4 MiB of it are read.
///
/// # Errors
///
/// When the operating system refuses.
pub fn read_certificate(dir: &Path, manifest: &Manifest) -> Result<CertificateState, BundleError> {
    let path = dir.join(CERTIFICATE_FILE);
    let found = match fs::metadata(&path) {
        Ok(found) if found.is_file() => {
            let text = read_beginning(&path, MAX_CERTIFICATE_BYTES + 1)?;
            parse(&text).and_then(|certificate| match differing(&certificate, manifest) {
                Some(what) => Err(format!("belongs to another {what}")),
                None => Ok(certificate),
            })
        }
        Ok(_) => Err(format!("is not a file; remove {CERTIFICATE_FILE}")),
        Err(e) if is_absent(&e) => return Ok(CertificateState::Missing),
        Err(e) => return Err(failed("read", &path)(e)),
    };
    Ok(match found {
        Ok(certificate) => CertificateState::Valid(Box::new(certificate)),
        Err(problem) => CertificateState::Stale {
            why: format!("{problem}; verify the bundle again"),
        },
    })
}

/// Parses and checks the text of a certificate, or says what is wrong with it.
fn parse(text: &[u8]) -> Result<Certificate, String> {
    if text.len() as u64 > MAX_CERTIFICATE_BYTES {
        return Err(format!("has more than {MAX_CERTIFICATE_BYTES} bytes"));
    }
    let unreadable = |(place, error)| format!("cannot be read ({place}: {error})");
    // First what tells whether the rest can be understood.
    let header: Header = parse_json(text).map_err(unreadable)?;
    if header.format != CERTIFICATE_FORMAT {
        let found = header.format;
        return Err(format!(
            "has the format {found:?}, not {CERTIFICATE_FORMAT:?}"
        ));
    }
    if header.version != u64::from(CERTIFICATE_VERSION) {
        return Err(format!(
            "has version {} of the format, of which only versions up to {CERTIFICATE_VERSION} are \
             known; use a newer farfield",
            header.version
        ));
    }
    let certificate: Certificate = parse_json(text).map_err(unreadable)?;
    if !is_sealed(text, &certificate.sha256) {
        return Err("was changed after it was written: it does not match its checksum".into());
    }
    certificate
        .check()
        .map_err(|error| format!("cannot be true: {error}"))?;
    Ok(certificate)
}

/// What a certificate was made for, if it is not what the manifest tells.
fn differing(certificate: &Certificate, manifest: &Manifest) -> Option<&'static str> {
    let options = &manifest.options;
    [
        ("bake", certificate.bundle_sha256 == manifest.sha256),
        ("scene", certificate.scene == manifest.scene),
        ("view cell", certificate.view_space == options.view_space),
        ("resolution", certificate.resolution == options.resolution),
        (
            "field of view",
            certificate.fov_degrees == options.fov_degrees,
        ),
    ]
    .into_iter()
    .find_map(|(what, equal)| (!equal).then_some(what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{
        certificates, check_schema, damages, manifests, sample, sample_certificate, sample_files,
    };
    use crate::{MANIFEST_FILE, NewFile, sha256_hex, write};
    use proptest::prelude::*;
    use std::path::PathBuf;

    /// A small bundle with a certificate, in a folder that is removed at the end.
    fn bundle() -> (tempfile::TempDir, Manifest) {
        let dir = tempfile::tempdir().unwrap();
        let manifest = write(dir.path(), &sample(), &sample_files()).unwrap();
        write_certificate(dir.path(), &sample_certificate(&manifest)).unwrap();
        (dir, manifest)
    }

    fn why(dir: &Path, manifest: &Manifest) -> String {
        match read_certificate(dir, manifest).unwrap() {
            CertificateState::Stale { why } => why,
            other => panic!("{other:?}"),
        }
    }

    fn file_names(dir: &Path) -> Vec<PathBuf> {
        let entries = fs::read_dir(dir).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
        names.sort();
        names
    }

    /// Manifests as a bake leaves them, each with a certificate.
    fn certified() -> impl Strategy<Value = (Manifest, Certificate)> {
        manifests().prop_flat_map(|manifest| {
            let certificate = certificates(&manifest);
            (Just(manifest), certificate)
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// A certificate is read as it was written, numbers with all their bits, and nothing else
        /// in the folder changes.
        #[test]
        fn what_is_written_is_read((manifest, certificate) in certified()) {
            let dir = tempfile::tempdir().unwrap();
            let dir = dir.path();
            write_certificate(dir, &certificate).unwrap();
            prop_assert_eq!(file_names(dir), [dir.join(CERTIFICATE_FILE)]);
            let text = fs::read(dir.join(CERTIFICATE_FILE)).unwrap();

            let state = read_certificate(dir, &manifest).unwrap();
            let CertificateState::Valid(read) = state else {
                return Err(TestCaseError::fail(format!("{state:?}")));
            };
            let sha256 = read.sha256.clone();
            prop_assert_eq!(&*read, &Certificate { sha256, ..certificate });
            // Equal numbers may have other bits (0 and -0), equal texts may not.
            write_certificate(dir, &read).unwrap();
            prop_assert_eq!(fs::read(dir.join(CERTIFICATE_FILE)).unwrap(), text);
        }
    }

    proptest! {
        /// However a certificate is cut off or changed, it is never valid, and reading it never
        /// panics.
        #[test]
        fn no_damaged_certificate_is_valid((_, certificate) in certified(), damage in damages()) {
            let sound = complete(&certificate).unwrap().into_bytes();
            prop_assert!(parse(&sound).is_ok());
            let damaged = damage.of(&sound);
            prop_assume!(damaged != sound);
            prop_assert!(parse(&damaged).is_err());
        }
    }

    /// All bits of every byte, and every length.
    #[test]
    fn every_flipped_bit_and_every_wrong_length_is_found() {
        let certificate = sample_certificate(&sample());
        let sound = complete(&certificate).unwrap().into_bytes();
        assert!(parse(&sound).is_ok());
        for i in 0..sound.len() {
            assert!(parse(&sound[..i]).is_err(), "cut at {i}");
            for bit in 0..8 {
                let mut damaged = sound.clone();
                damaged[i] ^= 1 << bit;
                assert!(parse(&damaged).is_err(), "bit {bit} of byte {i}");
            }
        }
        assert!(parse(&[&sound[..], b"\n"].concat()).is_err());
    }

    /// Whatever differs between what was verified and what is there, the certificate is stale, even
    /// if its own checksum fits.
    #[test]
    fn certificates_of_something_else_are_stale() {
        type Change = fn(&mut Certificate);
        let changes: [(&str, Change); 5] = [
            ("bake", |c| c.bundle_sha256 = sha256_hex(b"other")),
            ("scene", |c| {
                c.scene = SceneSource::File {
                    path: "../house.glb".into(),
                    sha256: sha256_hex(b"house"),
                };
            }),
            ("view cell", |c| {
                let ViewSpace::Amid { distance, .. } = &mut c.view_space else {
                    unreachable!("the sample is amid the scene");
                };
                *distance *= 1.0 + f64::EPSILON;
            }),
            ("resolution", |c| c.resolution += 1),
            ("field of view", |c| c.fov_degrees += 1e-14),
        ];
        let (dir, manifest) = bundle();
        for (what, change) in changes {
            let mut certificate = sample_certificate(&manifest);
            change(&mut certificate);
            write_certificate(dir.path(), &certificate).unwrap();
            let expected = format!("belongs to another {what}; verify the bundle again");
            assert_eq!(why(dir.path(), &manifest), expected);
        }
    }

    /// A certificate never makes a bundle unreadable: what stands in its place is told, with what to
    /// do.
    #[test]
    fn what_is_no_certificate_is_stale() {
        let (dir, manifest) = bundle();
        let path = dir.path().join(CERTIFICATE_FILE);
        let sound = fs::read_to_string(&path).unwrap();
        let newer = format!(r#"{{"format":{CERTIFICATE_FORMAT:?},"version":2,"shape":[]}}"#);
        let edited = sound.replace("\"gap_pixels\": 0", "\"gap_pixels\": 1");
        let mistyped = sound.replace("\"gap_pixels\": 0", "\"gap_pixels\": -1");
        let unknown = sound.replace("\"gap_pixels\": 0", "\"holes\": 0");
        let manifest_text = fs::read_to_string(dir.path().join(MANIFEST_FILE)).unwrap();
        for (text, expected) in [
            ("", "cannot be read (the document: EOF"),
            ("PNG", "cannot be read (the document: expected value"),
            ("[]", "cannot be read (the document: "),
            ("{}", "missing field `format`"),
            (&sound[..sound.len() / 2], "cannot be read ("),
            (&manifest_text, "has the format \"farfield-bundle\", not"),
            (&newer, "has version 2 of the format"),
            (&edited, "does not match its checksum"),
            (&mistyped, "(worst.gap_pixels: invalid value: integer `-1`"),
            (&unknown, "(worst.holes: unknown field `holes`"),
        ] {
            fs::write(&path, text).unwrap();
            let why = why(dir.path(), &manifest);
            assert!(why.contains(expected), "{why}");
            assert!(why.ends_with("; verify the bundle again"), "{why}");
        }
        // Sparse: takes no room on disk, and is not read as a whole.
        fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert!(why(dir.path(), &manifest).starts_with("has more than 4194304 bytes"));
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert!(why(dir.path(), &manifest).starts_with("is not a file; remove certificate.json"));
        assert_eq!(crate::read(dir.path()).unwrap(), manifest);
    }

    /// A sealed certificate that cannot be true, as another program might write it, is stale.
    #[test]
    fn impossible_certificates_are_stale() {
        let mut certificate = sample_certificate(&sample());
        certificate.worst.parallax_px = -1.0;
        let text = seal(&mut certificate, |c| &mut c.sha256);
        let problem = parse(text.as_bytes()).unwrap_err();
        assert!(problem.starts_with("cannot be true: worst.parallax_px is -1"));
    }

    /// A write that fails leaves the folder as it was.
    #[test]
    fn a_failing_write_leaves_nothing() {
        let (dir, manifest) = bundle();
        let before = file_names(dir.path());
        let sound = read_certificate(dir.path(), &manifest).unwrap();
        let mut certificate = sample_certificate(&manifest);
        certificate.worst.colour_bias = f64::NAN;
        let result = write_certificate(dir.path(), &certificate);
        assert!(matches!(result, Err(BundleError::Invalid { .. })));
        let mut certificate = sample_certificate(&manifest);
        certificate.sampled = vec!["x".repeat(MAX_CERTIFICATE_BYTES as usize)];
        let result = write_certificate(dir.path(), &certificate);
        assert!(matches!(result, Err(BundleError::Invalid { .. })));
        assert_eq!(read_certificate(dir.path(), &manifest).unwrap(), sound);
        assert_eq!(file_names(dir.path()), before);

        // A file cannot take the place of a folder.
        let path = dir.path().join(CERTIFICATE_FILE);
        remove_certificate(dir.path()).unwrap();
        fs::create_dir(&path).unwrap();
        let certificate = sample_certificate(&manifest);
        let error = write_certificate(dir.path(), &certificate).unwrap_err();
        assert!(error.to_string().contains(&path.display().to_string()));
        assert!(remove_certificate(dir.path()).is_err());
        assert_eq!(file_names(dir.path()), before);
        assert!(write_certificate(&dir.path().join("nowhere"), &certificate).is_err());
        assert_eq!(file_names(dir.path()), before);
    }

    /// Bundles without a certificate: never verified, broken, baked again.
    #[test]
    fn certificates_come_and_go() {
        let (dir, manifest) = bundle();
        let state = || read_certificate(dir.path(), &manifest).unwrap();
        assert!(matches!(state(), CertificateState::Valid(_)));
        for _ in 0..2 {
            remove_certificate(dir.path()).unwrap();
            assert_eq!(state(), CertificateState::Missing);
        }
        write_certificate(dir.path(), &sample_certificate(&manifest)).unwrap();
        write(dir.path(), &sample(), &sample_files()).unwrap();
        assert_eq!(state(), CertificateState::Missing);
        assert_eq!(
            read_certificate(&dir.path().join("nowhere"), &manifest).unwrap(),
            CertificateState::Missing
        );
        // The name is not the bake's to use.
        let mut files = sample_files();
        files.push(NewFile {
            path: CERTIFICATE_FILE.into(),
            bytes: vec![],
        });
        assert!(write(dir.path(), &sample(), &files).is_err());
    }

    /// Those who verify the same bundle at the same time do not disturb each other.
    #[test]
    fn concurrent_writes_leave_one_complete_certificate() {
        let (dir, manifest) = bundle();
        std::thread::scope(|scope| {
            for seed in 0..4 {
                let (dir, manifest) = (dir.path(), &manifest);
                scope.spawn(move || {
                    let certificate = Certificate {
                        seed,
                        ..sample_certificate(manifest)
                    };
                    for _ in 0..10 {
                        write_certificate(dir, &certificate).unwrap();
                        let state = read_certificate(dir, manifest).unwrap();
                        assert!(matches!(state, CertificateState::Valid(_)));
                    }
                });
            }
        });
        // The glTF file, the pages' folder, the manifest, the certificate.
        assert_eq!(file_names(dir.path()).len(), 4);
    }

    /// Nothing of a certificate is ignored in silence.
    #[test]
    fn unknown_fields_are_errors() {
        let certificate = serde_json::to_value(sample_certificate(&sample())).unwrap();
        for place in [
            "",
            "/generator",
            "/scene",
            "/view_space",
            "/worst",
            "/proved/0",
            "/beyond",
        ] {
            let mut certificate = certificate.clone();
            certificate.pointer_mut(place).unwrap()["colour"] = 1.into();
            let error = serde_json::from_value::<Certificate>(certificate).unwrap_err();
            assert!(error.to_string().contains("colour"), "{place}: {error}");
        }
    }

    /// The published schema is that of the code.
    #[test]
    fn the_published_certificate_schema_is_up_to_date() {
        let schema = schemars::schema_for!(Certificate);
        check_schema("certificate-1.schema.json", CERTIFICATE_SCHEMA, &schema);
    }
}
