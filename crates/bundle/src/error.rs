//! What can go wrong with a bundle's folder.

use std::io;
use std::path::PathBuf;

/// Why a bundle could not be written or read: which file, what is wrong with it, what to do.
#[derive(Debug, thiserror::Error)]
pub enum BundleError {
    /// The operating system refused.
    #[error("cannot {doing} {}: {error}", path.display())]
    Io {
        /// What was tried: "write", "read", ...
        doing: &'static str,
        /// With what.
        path: PathBuf,
        /// What the operating system says.
        error: io::Error,
    },
    /// The output is not the name of a folder, such as "/" or "..".
    #[error("{} does not name a folder for a bundle; give a path that ends in a name", dir.display())]
    NoFolderName {
        /// The output.
        dir: PathBuf,
    },
    /// The output exists and is not ours to replace.
    #[error(
        "{} exists and is neither empty nor a farfield {kind}; choose another folder or remove it",
        dir.display()
    )]
    Foreign {
        /// The output.
        dir: PathBuf,
        /// What would be replaced there, such as "bundle".
        kind: &'static str,
    },
    /// The folder has no manifest.
    #[error("{} is not a bundle: it has no file bundle.json; bake one first", dir.display())]
    NotABundle {
        /// The folder.
        dir: PathBuf,
    },
    /// The manifest is not JSON, or not that of a bundle.
    #[error("{}: {place}: {error}; bake the bundle again", path.display())]
    Json {
        /// The manifest.
        path: PathBuf,
        /// Where in it, such as `options.resolution`.
        place: String,
        /// What is wrong, with line and column where they are known.
        error: serde_json::Error,
    },
    /// The manifest is that of something else.
    #[error(
        "{}: format: is {found:?}, expected \"farfield-bundle\"; give the folder of a bundle or bake one",
        path.display()
    )]
    WrongFormat {
        /// The manifest.
        path: PathBuf,
        /// Its format.
        found: String,
    },
    /// The manifest is of a version that this crate does not know.
    #[error(
        "{}: version: {found} of the format is not known, only up to {known}; use a newer farfield",
        path.display()
    )]
    UnknownVersion {
        /// The manifest.
        path: PathBuf,
        /// Its version.
        found: u64,
        /// The greatest version that is known.
        known: u32,
    },
    /// The manifest that was read cannot be true.
    #[error("{}: {error}; bake the bundle again", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        error: ManifestError,
    },
    /// A manifest or certificate that is to be written cannot be true.
    #[error("cannot write {}: {error}", path.display())]
    Invalid {
        /// Where it was to be written.
        path: PathBuf,
        /// What is wrong.
        error: ManifestError,
    },
    /// A file is larger than it can be.
    #[error("{} has more than {limit} bytes; bake the bundle again", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The largest allowed.
        limit: u64,
    },
    /// A file that the manifest lists is not there, or is not a file.
    #[error("{} is missing though the manifest lists it; bake the bundle again", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// A file has another size than the manifest says.
    #[error(
        "{} has {found} bytes, the manifest says {expected}; it was changed after the bake, bake the bundle again",
        path.display()
    )]
    WrongSize {
        /// The file.
        path: PathBuf,
        /// The size in the manifest.
        expected: u64,
        /// The size on disk.
        found: u64,
    },
    /// A file, or the manifest itself, has another content than the manifest says.
    #[error(
        "{} does not match its checksum; it was changed after the bake, bake the bundle again",
        path.display()
    )]
    WrongChecksum {
        /// The file.
        path: PathBuf,
    },
}

/// What a manifest or certificate says that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place} {problem}")]
pub struct ManifestError {
    /// The field, such as `impostors[0].body.layers[3]`.
    pub place: String,
    /// What is wrong with it.
    pub problem: String,
}
