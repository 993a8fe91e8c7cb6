//! Writing a bundle's folder: it appears complete, or not at all.

use crate::checksum::{seal, sha256_hex};
use crate::manifest::{FORMAT, FileRecord, MANIFEST_FILE, Manifest};
use crate::read::is_of_kind;
use crate::{BundleError, ManifestError};
use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file to be written into a bundle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewFile {
    /// Path relative to the bundle's folder, with slashes, such as "pages/000.png".
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Writes `manifest` and `files` as the bundle `dir`, and returns the manifest as it was
/// written: with `files` and `sha256` filled in.
///
/// Everything is written and flushed in a folder beside `dir` and then renamed, so that `dir`
/// is at any time the old bundle or the new one, complete. (Between the two there is none for
/// a moment where the file system cannot exchange folders; Linux can.) Folders above `dir` are
/// made as needed. An existing folder is replaced, with all it holds, if it is empty or holds
/// a `bundle.json` of ours: a new bundle has no certificate until it is verified. What a bake
/// that was killed left beside it is removed, except on Windows.
///
/// The order of `files` does not matter: the same content gives the same bytes.
///
/// ```
/// # use farfield_bundle::*;
/// # let cell = farfield_views::ViewCell::Box { center: glam::DVec3::Z, size: glam::DVec3::ONE };
/// let manifest = Manifest {
///     format: FORMAT.into(),
///     version: VERSION,
///     generator: Generator { name: "example".into(), version: "1.0".into() },
///     technique: Technique::Layered { bytes_per_quad: 104.0, page_size: 4096, foliage: Foliage::Any, channels: Channels::Lit },
///     options: Options { resolution: 512, fov_degrees: 45.0, view_space: ViewSpace::Before { view_cell: cell }, exclude: vec![] },
///     scene: SceneSource::BuiltIn { name: "house".into(), size: 1, seed: 0 },
///     promise: Promise { gap_pixels: Some(0), parallax_px: Some(1.0), ..Promise::default() },
///     statistics: Statistics::default(),
///     warnings: vec![],
///     impostors: vec![],
///     files: vec![],
///     sha256: String::new(),
/// };
/// let glb = glb_from_scene(&farfield_scene::Scene::default(), &[])?;
/// let files = [NewFile { path: GLTF_FILE.into(), bytes: glb }];
///
/// let dir = tempfile::tempdir()?;
/// let dir = dir.path().join("house-layered");
/// let written = write(&dir, &manifest, &files)?;
/// assert_eq!(read(&dir)?, written);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// When `dir` exists and is not ours to replace, when [`Manifest::check`] finds something, or
/// when the operating system refuses. Then all is as it was before.
pub fn write(dir: &Path, manifest: &Manifest, files: &[NewFile]) -> Result<Manifest, BundleError> {
    let (manifest, text) = complete(dir, manifest, files)?;
    put_folder(dir, &BUNDLE, files, text.as_bytes())?;
    Ok(manifest)
}

/// Folders of one kind, that are known by a JSON file with a format's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FolderKind {
    /// What such a folder is called in messages, such as "bundle".
    pub name: &'static str,
    /// The file that each has, such as "bundle.json".
    pub marker: &'static str,
    /// What its field `format` says, such as "farfield-bundle".
    pub format: &'static str,
}

/// What [`write()`] writes.
pub(crate) const BUNDLE: FolderKind = FolderKind {
    name: "bundle",
    marker: MANIFEST_FILE,
    format: FORMAT,
};

/// Writes `files` as the folder `dir` of another kind than bundles, in the way of [`write()`]: it
/// appears complete or not at all, and replaces only what is empty or of its kind. The marker is
/// added.
///
/// # Errors
///
/// When `dir` exists and is not ours to replace, or when the operating system refuses. Then all is
/// as it was before.
pub fn write_folder(dir: &Path, kind: &FolderKind, files: &[NewFile]) -> Result<(), BundleError> {
    let marker = serde_json::json!({ "format": kind.format, "version": 1 });
    put_folder(dir, kind, files, format!("{marker:#}\n").as_bytes())
}

/// Writes files and the marker into a folder beside `dir`, and puts it into its place.
fn put_folder(
    dir: &Path,
    kind: &FolderKind,
    files: &[NewFile],
    marker: &[u8],
) -> Result<(), BundleError> {
    let mut made = MadeFolders::default();
    let place = Place::find(dir, kind, &mut made)?;
    place.remove_leftovers();
    let partial = place.make_partial()?;
    let contents = files.iter().map(|file| (&*file.path, &*file.bytes));
    write_files(&partial.path, contents.chain([(kind.marker, marker)]))?;
    // Nobody else's folder may have come in the meantime.
    require_replaceable_by(&place.dir, kind)?;
    put(&partial.path, &place.dir)?;
    made.keep();
    flush_folder(&place.parent)
}

/// The manifest with `files` and `sha256` filled in, and its text.
fn complete(
    dir: &Path,
    manifest: &Manifest,
    files: &[NewFile],
) -> Result<(Manifest, String), BundleError> {
    let mut manifest = manifest.clone();
    manifest.files = files
        .iter()
        .map(|file| FileRecord {
            path: file.path.clone(),
            bytes: file.bytes.len() as u64,
            sha256: sha256_hex(&file.bytes),
        })
        .collect();
    manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
    let invalid = |error: ManifestError| BundleError::Invalid {
        path: dir.join(MANIFEST_FILE),
        error,
    };
    manifest.check().map_err(invalid)?;
    let text = seal(&mut manifest, |manifest| &mut manifest.sha256);
    Ok((manifest, text))
}

/// Where a bundle goes.
struct Place {
    /// Its folder, with links resolved.
    dir: PathBuf,
    /// The folder that holds it.
    parent: PathBuf,
    /// How the names of folders beside it begin that hold it while it is written.
    prefix: OsString,
}

impl Place {
    /// Checks that `dir` may be written, and makes the folders above it.
    fn find(dir: &Path, kind: &FolderKind, made: &mut MadeFolders) -> Result<Self, BundleError> {
        require_replaceable_by(dir, kind)?;
        // An existing folder may be named in any way, through a link or as "."; a new one needs
        // a name.
        let dir = match fs::canonicalize(dir) {
            Ok(dir) => dir,
            Err(_) => {
                let (parent, name) = parent_and_name(dir)?;
                made.make_all(parent)?;
                let parent = fs::canonicalize(parent).map_err(failed("find", parent))?;
                parent.join(name)
            }
        };
        let (parent, name) = parent_and_name(&dir)?;
        let mut prefix = OsString::from(".");
        prefix.push(name);
        prefix.push(".farfield-");
        Ok(Self {
            parent: parent.to_owned(),
            prefix,
            dir,
        })
    }

    /// Makes and locks a folder beside the bundle's.
    fn make_partial(&self) -> Result<Partial, BundleError> {
        loop {
            // A name that no other bake has or had, also in another thread: folders are removed by
            // name.
            let mut name = self.prefix.clone();
            name.push(random_digits());
            let path = self.parent.join(name);
            fs::create_dir(&path).map_err(failed("make folder", &path))?;
            // Without the lock, another bake took it for a leftover and removes it.
            if let Some(lock) = lock(&path) {
                return Ok(Partial { path, _lock: lock });
            }
        }
    }

    /// Removes the folders that bakes of this bundle left when they were killed.
    fn remove_leftovers(&self) {
        let entries = fs::read_dir(&self.parent).into_iter().flatten();
        for entry in entries.flatten() {
            // A bake that runs holds the lock; where there are none, all may run.
            let is_folder = cfg!(unix) && entry.file_type().is_ok_and(|t| t.is_dir());
            if is_folder
                && self.is_partial_name(&entry.file_name())
                && let Some(_lock) = lock(&entry.path())
            {
                let _ = fs::remove_dir_all(entry.path());
            }
        }
    }

    fn is_partial_name(&self, name: &OsStr) -> bool {
        name.as_encoded_bytes()
            .strip_prefix(self.prefix.as_encoded_bytes())
            .is_some_and(|rest| rest.len() >= 16 && rest[..16].iter().all(u8::is_ascii_hexdigit))
    }
}

/// A folder in which a bundle is written. It is locked as long as this lives, and removed with
/// what is in it then: a part of a bundle, or the old bundle that the new one changed places with.
struct Partial {
    path: PathBuf,
    _lock: Lock,
}

impl Drop for Partial {
    fn drop(&mut self) {
        // What cannot be removed now is left to the next bake.
        let _ = fs::remove_dir_all(&self.path);
    }
}

/// Folders above the bundle, that are removed again if the bundle does not come into its place.
#[derive(Default)]
struct MadeFolders(Vec<PathBuf>);

impl MadeFolders {
    /// Makes a folder and those above it.
    fn make_all(&mut self, dir: &Path) -> Result<(), BundleError> {
        let missing: Vec<&Path> = dir
            .ancestors()
            .take_while(|dir| !dir.as_os_str().is_empty() && !dir.exists())
            .collect();
        for dir in missing.into_iter().rev() {
            match fs::create_dir(dir) {
                // Someone else was quicker.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                result => {
                    result.map_err(failed("make folder", dir))?;
                    self.0.push(dir.to_owned());
                }
            }
        }
        Ok(())
    }

    fn keep(&mut self) {
        self.0.clear();
    }
}

impl Drop for MadeFolders {
    fn drop(&mut self) {
        for dir in self.0.iter().rev() {
            // Fails, as it should, where someone put something into it.
            let _ = fs::remove_dir(dir);
        }
    }
}

/// Checks that [`write()`] may put a bundle at `dir`: that it does not exist, is empty, or holds a
/// bundle. Worth asking before long work.
///
/// # Errors
///
/// When it holds something else, or the operating system refuses.
pub fn require_replaceable(dir: &Path) -> Result<(), BundleError> {
    require_replaceable_by(dir, &BUNDLE)
}

/// The same for [`write_folder`] and a folder of its kind.
///
/// # Errors
///
/// When it holds something else, or the operating system refuses.
pub fn require_replaceable_by(dir: &Path, kind: &FolderKind) -> Result<(), BundleError> {
    loop {
        let before = identity(dir);
        let replaceable = is_replaceable(dir, kind);
        match replaceable {
            Ok(true) => return Ok(()),
            // Another bake replaced and removed the folder while it was looked at.
            _ if identity(dir) != before => {}
            Ok(false) => {
                return Err(BundleError::Foreign {
                    dir: dir.to_owned(),
                    kind: kind.name,
                });
            }
            Err(e) => return Err(e),
        }
    }
}

fn is_replaceable(dir: &Path, kind: &FolderKind) -> Result<bool, BundleError> {
    match fs::read_dir(dir) {
        Ok(mut entries) => Ok(entries.next().is_none() || is_of_kind(dir, kind)?),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::NotADirectory => Ok(false),
        Err(e) => Err(failed("read", dir)(e)),
    }
}

/// What changes when another folder comes into the place of `dir`.
#[cfg(unix)]
fn identity(dir: &Path) -> Option<[i64; 3]> {
    use std::os::unix::fs::MetadataExt;
    let found = fs::metadata(dir).ok()?;
    // A number may be used again at once, but not at the same time.
    Some([found.ino() as i64, found.ctime(), found.ctime_nsec()])
}

/// Not known.
#[cfg(not(unix))]
fn identity(_: &Path) -> Option<[i64; 3]> {
    None
}

fn parent_and_name(dir: &Path) -> Result<(&Path, &OsStr), BundleError> {
    let no_name = || BundleError::NoFolderName {
        dir: dir.to_owned(),
    };
    let name = dir.file_name().ok_or_else(no_name)?;
    let parent = dir.parent().ok_or_else(no_name)?;
    match parent.as_os_str().is_empty() {
        true => Ok((Path::new("."), name)),
        false => Ok((parent, name)),
    }
}

/// Writes and flushes files, given by path and content, into a folder.
fn write_files<'a>(
    dir: &Path,
    contents: impl Iterator<Item = (&'a str, &'a [u8])>,
) -> Result<(), BundleError> {
    let mut folders = BTreeSet::from([dir.to_owned()]);
    for (path, bytes) in contents {
        let path = dir.join(path);
        let above = path.ancestors().skip(1).take_while(|above| *above != dir);
        folders.extend(above.map(Path::to_owned));
        path.parent()
            .map_or(Ok(()), fs::create_dir_all)
            .map_err(failed("write", &path))?;
        write_new_file(&path, bytes)?;
    }
    folders.iter().try_for_each(|dir| flush_folder(dir))
}

/// Writes and flushes a file that must not exist.
pub(crate) fn write_new_file(path: &Path, bytes: &[u8]) -> Result<(), BundleError> {
    File::create_new(path)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .map_err(failed("write", path))
}

/// Sixteen hexadecimal digits that no one else gets.
pub(crate) fn random_digits() -> String {
    // The standard library's hash keys are random.
    format!("{:016x}", RandomState::new().build_hasher().finish())
}

/// Makes sure that the names in a folder survive a power cut.
pub(crate) fn flush_folder(dir: &Path) -> Result<(), BundleError> {
    // Elsewhere folders cannot be opened like files.
    if cfg!(unix) {
        File::open(dir)
            .and_then(|file| file.sync_all())
            .map_err(failed("flush", dir))?;
    }
    Ok(())
}

/// Puts the folder `new` into the place of `dir`. What was there, if anything, is then at `new`.
fn put(new: &Path, dir: &Path) -> Result<(), BundleError> {
    match fs::rename(new, dir) {
        // Something is there, and not empty.
        Err(_) if dir.is_dir() => exchange(new, dir).unwrap_or_else(|| exchange_in_steps(new, dir)),
        result => result,
    }
    .map_err(failed("make", dir))
}

/// Lets two folders change places in a single step, or `None` where that is not possible.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange(a: &Path, b: &Path) -> Option<io::Result<()>> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    match renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE) {
        Err(Errno::NOSYS | Errno::INVAL | Errno::NOTSUP) => None,
        result => Some(result.map_err(io::Error::from)),
    }
}

/// Lets two folders change places in a single step, or `None` where that is not possible.
#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> Option<io::Result<()>> {
    None
}

/// Lets two folders change places; nothing is at `dir` for a moment.
fn exchange_in_steps(new: &Path, dir: &Path) -> io::Result<()> {
    let mut aside = new.as_os_str().to_owned();
    aside.push("-0");
    fs::rename(dir, &aside)?;
    if let Err(e) = fs::rename(new, dir) {
        fs::rename(&aside, dir)?;
        return Err(e);
    }
    fs::rename(&aside, new)
}

/// Shows other bakes that a folder is in use; the system lets go of it when the process ends.
#[cfg(unix)]
type Lock = File;

/// Locks a folder, or `None` where it is locked already or gone.
#[cfg(unix)]
fn lock(dir: &Path) -> Option<Lock> {
    use rustix::fs::{FlockOperation, flock};
    let file = File::open(dir).ok()?;
    flock(&file, FlockOperation::NonBlockingLockExclusive).ok()?;
    // Whoever had the lock before may have removed the folder.
    dir.exists().then_some(file)
}

/// Folders cannot be locked here.
#[cfg(not(unix))]
type Lock = ();

/// Always succeeds.
#[cfg(not(unix))]
fn lock(_: &Path) -> Option<Lock> {
    Some(())
}

/// What an error of the operating system is for us.
pub(crate) fn failed(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> BundleError {
    move |error| BundleError::Io {
        doing,
        path: path.to_owned(),
        error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{files, manifests_with_layers, sample, sample_files};
    use crate::read;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// All files below a folder, and all folders with empty content.
    fn tree(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut all = BTreeMap::new();
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                all.extend(tree(&path));
            }
            all.insert(path.clone(), fs::read(&path).unwrap_or_default());
        }
        all
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// A bundle is read as it was written, and holds just its files. The order in which they
        /// are given does not matter.
        #[test]
        fn what_is_written_is_read(manifest in manifests_with_layers(), files in files()) {
            let parent = tempfile::tempdir().unwrap();
            let dir = parent.path().join("bundle");
            let written = write(&dir, &manifest, &files).unwrap();
            prop_assert_eq!(&read(&dir).unwrap(), &written);
            let unsealed = |manifest: &Manifest| Manifest {
                files: vec![],
                sha256: String::new(),
                ..manifest.clone()
            };
            prop_assert_eq!(unsealed(&written), unsealed(&manifest));

            let first = tree(parent.path());
            for file in &files {
                prop_assert_eq!(&first[&dir.join(&file.path)], &file.bytes);
            }
            // The folder itself, "pages", "a" and "a/b".
            prop_assert_eq!(first.len(), files.len() + 1 + 4);

            let reversed: Vec<_> = files.into_iter().rev().collect();
            write(&dir, &written, &reversed).unwrap();
            prop_assert_eq!(tree(parent.path()), first);
        }
    }

    /// An old bundle goes with all that was in it, an empty folder is filled.
    #[test]
    fn bundles_and_empty_folders_are_replaced() {
        let parent = tempfile::tempdir().unwrap();
        let dir = parent.path().join("bundle");
        fs::create_dir(&dir).unwrap();
        write(&dir, &sample(), &sample_files()).unwrap();
        fs::create_dir(dir.join("report")).unwrap();
        fs::write(dir.join("report/worst.png"), "").unwrap();
        write(&dir, &sample(), &sample_files()[..1]).unwrap();
        assert_eq!(read(&dir).unwrap().files.len(), 1);
        // The folder, its manifest and the glTF file.
        assert_eq!(tree(parent.path()).len(), 3);
    }

    /// Whatever is not ours stays as it is.
    #[test]
    fn foreign_folders_are_not_replaced() {
        let parent = tempfile::tempdir().unwrap();
        let dir = |name: &str| parent.path().join(name);
        let contents = [
            ("notes", "notes.txt", "precious"),
            ("no_json", "bundle.json", "precious"),
            ("other", "bundle.json", r#"{"format":"other","version":1}"#),
            ("unnamed", "bundle.json", r#"{"version":1}"#),
        ];
        for (name, file, content) in contents {
            fs::create_dir(dir(name)).unwrap();
            fs::write(dir(name).join(file), content).unwrap();
        }
        fs::write(dir("file"), "precious").unwrap();
        let before = tree(parent.path());
        for name in ["notes", "no_json", "other", "unnamed", "file", "."] {
            let result = write(&dir(name), &sample(), &sample_files());
            assert!(matches!(result, Err(BundleError::Foreign { .. })), "{name}");
        }
        for name in ["new/..", "new/../.."] {
            let result = write(&dir(name), &sample(), &sample_files());
            assert!(
                matches!(result, Err(BundleError::NoFolderName { .. })),
                "{name}"
            );
        }
        assert_eq!(tree(parent.path()), before);
    }

    /// A folder is replaced by one of its kind, by no other.
    #[test]
    fn folders_of_another_kind_are_not_replaced() {
        const SHEETS: FolderKind = FolderKind {
            name: "set of sheets",
            marker: "sheets.json",
            format: "farfield-sheets",
        };
        let parent = tempfile::tempdir().unwrap();
        let [bundle, sheets] = ["bundle", "sheets"].map(|name| parent.path().join(name));
        write(&bundle, &sample(), &sample_files()).unwrap();
        let file = |path: &str| NewFile {
            path: path.into(),
            bytes: b"content".to_vec(),
        };
        write_folder(&sheets, &SHEETS, &[file("old.txt")]).unwrap();
        let before = tree(parent.path());
        let refused = write_folder(&bundle, &SHEETS, &[]).unwrap_err();
        assert!(refused.to_string().contains("a farfield set of sheets"));
        let refused = write(&sheets, &sample(), &sample_files()).unwrap_err();
        assert!(refused.to_string().contains("a farfield bundle"));
        assert_eq!(tree(parent.path()), before);
        write_folder(&sheets, &SHEETS, &[file("new.txt")]).unwrap();
        assert!(sheets.join("new.txt").exists() && !sheets.join("old.txt").exists());
    }

    /// A write that fails half-way leaves all as it was: the old bundle, or nothing at all.
    #[test]
    fn a_failing_write_leaves_nothing() {
        let parent = tempfile::tempdir().unwrap();
        let old = parent.path().join("old");
        write(&old, &sample(), &sample_files()).unwrap();
        fs::write(parent.path().join("file"), "").unwrap();
        let before = tree(parent.path());

        // "pages/000.png" cannot be a file and a folder.
        let mut files = sample_files();
        files.push(NewFile {
            path: "pages/000.png/mip".into(),
            bytes: vec![],
        });
        for name in ["old", "new", "far/down/new"] {
            let result = write(&parent.path().join(name), &sample(), &files);
            assert!(matches!(result, Err(BundleError::Io { .. })), "{name}");
            assert_eq!(tree(parent.path()), before, "{name}");
        }
        // A folder cannot be made below a file.
        let result = write(&parent.path().join("file/new"), &sample(), &sample_files());
        assert!(result.is_err());
        // Nothing is touched for a manifest that cannot be.
        let mut manifest = sample();
        manifest.options.fov_degrees = f64::NAN;
        let result = write(&parent.path().join("a/b"), &manifest, &sample_files());
        assert!(matches!(result, Err(BundleError::Invalid { .. })));
        let result = write(&parent.path().join("a/b"), &sample(), &sample_files()[1..]);
        assert!(
            matches!(result, Err(BundleError::Invalid { .. })),
            "no glTF file"
        );
        assert_eq!(tree(parent.path()), before);
    }

    /// What a killed bake left goes; what a running one works at, and what only looks alike, stays.
    #[cfg(unix)]
    #[test]
    fn leftovers_are_removed() {
        let parent = tempfile::tempdir().unwrap();
        let dir = |name: &str| parent.path().join(name);
        let names = [
            ".new.farfield-0123456789abcdef",
            ".new.farfield-0123456789abcdef-0",
            ".new.farfield-0123456789abcdee",
            ".newer.farfield-0123456789abcdef",
            ".new.farfield-for-the-records",
        ];
        for name in names {
            fs::create_dir(dir(name)).unwrap();
            fs::write(dir(name).join("part"), "").unwrap();
        }
        fs::write(dir(".new.farfield-0123456789abcded"), "a file").unwrap();
        let _running = lock(&dir(names[2])).unwrap();
        write(&dir("new"), &sample(), &sample_files()).unwrap();
        let exists = names.map(|name| dir(name).exists());
        assert_eq!(exists, [false, false, true, true, true]);
        assert!(dir(".new.farfield-0123456789abcded").exists());
    }

    /// Bakes of the same folder at the same time do not disturb each other: one of them comes last,
    /// complete.
    #[test]
    fn concurrent_bakes_leave_one_complete_bundle() {
        let parent = tempfile::tempdir().unwrap();
        let dir = parent.path().join("bundle");
        std::thread::scope(|scope| {
            for seed in 0..4u8 {
                let dir = &dir;
                scope.spawn(move || {
                    let mut files = sample_files();
                    files.iter_mut().for_each(|file| file.bytes.push(seed));
                    for _ in 0..10 {
                        write(dir, &sample(), &files).unwrap();
                    }
                });
            }
        });
        read(&dir).unwrap();
        let names: Vec<_> = fs::read_dir(parent.path()).unwrap().collect();
        assert_eq!(names.len(), 1, "{names:?}");
    }

    /// Where folders cannot be exchanged in one step, two will do.
    #[test]
    fn folders_are_exchanged_in_steps_too() {
        let parent = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| parent.path().join(name));
        for dir in [&a, &b] {
            fs::create_dir(dir).unwrap();
            fs::write(dir.join("name"), dir.as_os_str().as_encoded_bytes()).unwrap();
        }
        exchange_in_steps(&a, &b).unwrap();
        assert_eq!(
            fs::read(b.join("name")).unwrap(),
            a.as_os_str().as_encoded_bytes()
        );
        assert_eq!(
            fs::read(a.join("name")).unwrap(),
            b.as_os_str().as_encoded_bytes()
        );
        // What cannot be replaced is put back.
        assert!(exchange_in_steps(&parent.path().join("nowhere"), &b).is_err());
        assert!(b.join("name").exists());
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 2);
    }

    /// Through a link, the folder it points to is replaced, not the link.
    #[cfg(unix)]
    #[test]
    fn links_are_followed() {
        let parent = tempfile::tempdir().unwrap();
        let [dir, link] = ["dir", "link"].map(|name| parent.path().join(name));
        write(&dir, &sample(), &sample_files()).unwrap();
        std::os::unix::fs::symlink(&dir, &link).unwrap();
        write(&link, &sample(), &sample_files()[..1]).unwrap();
        assert!(link.is_symlink());
        assert_eq!(read(&dir).unwrap().files.len(), 1);
    }
}
