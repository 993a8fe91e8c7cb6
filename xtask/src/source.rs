//! Where scenes come from.

use crate::built_in::BuiltIn;
use anyhow::{Context, Result, bail};
use farfield_bundle::{Manifest, SceneSource};
use farfield_scene::Scene;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What is to be baked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneChoice {
    /// One that is made in code.
    BuiltIn(BuiltIn),
    /// A file.
    File(PathBuf),
}

impl std::fmt::Display for SceneChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::BuiltIn(scene) => scene.fmt(f),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

impl SceneChoice {
    /// What an argument of the command line names: a built-in scene, or else a file.
    ///
    /// # Errors
    ///
    /// When it names a built-in scene of an impossible size.
    pub fn from_argument(argument: OsString) -> Result<Self, String> {
        match argument.to_str().and_then(BuiltIn::from_word) {
            Some(scene) => scene.map(Self::BuiltIn),
            None => Ok(Self::File(argument.into())),
        }
    }

    /// A short name, for the bundle's folder.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::BuiltIn(scene) => scene.name().into(),
            Self::File(path) => path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
        }
    }
}

/// A scene as it was read, less what was excluded.
pub(crate) struct Loaded {
    pub(crate) scene: Scene,
    pub(crate) warnings: Vec<String>,
    /// Of all its files; empty where it has none.
    pub(crate) sha256: String,
}

/// Reads or makes a scene and leaves out the objects named in `exclude`.
pub(crate) fn load(choice: &SceneChoice, exclude: &[String]) -> Result<Loaded> {
    let mut loaded = match choice {
        SceneChoice::BuiltIn(built_in) => Loaded {
            scene: built_in.scene(),
            warnings: Vec::new(),
            sha256: String::new(),
        },
        SceneChoice::File(path) => {
            let imported = farfield_import::read(path)?;
            Loaded {
                sha256: sha256_of_files(path, &imported.files)?,
                scene: imported.scene,
                warnings: imported.warnings,
            }
        }
    };
    for name in exclude {
        let objects = &mut loaded.scene.objects;
        let before = objects.len();
        objects.retain(|object| object.name != *name);
        if objects.len() == before {
            bail!("{choice}: no object has the name '{name}' given with --exclude");
        }
    }
    Ok(loaded)
}

/// How the manifest of a bundle in `dir` refers to a scene.
pub(crate) fn record(choice: &SceneChoice, sha256: &str, dir: &Path) -> Result<SceneSource> {
    match choice {
        SceneChoice::BuiltIn(scene) => Ok(scene.record()),
        SceneChoice::File(path) => {
            let from = std::path::absolute(dir).context("the current folder is gone")?;
            let to = path
                .canonicalize()
                .with_context(|| path.display().to_string())?;
            let relative = pathdiff::diff_paths(&to, real(&from)).unwrap_or(to);
            Ok(SceneSource::File {
                path: with_slashes(&relative)?,
                sha256: sha256.into(),
            })
        }
    }
}

/// A path as manifests hold it.
fn with_slashes(path: &Path) -> Result<String> {
    let parts = path.iter().map(|part| {
        let name = part.to_str();
        name.with_context(|| format!("{}: the name is not UTF-8; rename it", path.display()))
    });
    Ok(parts.collect::<Result<Vec<_>>>()?.join("/"))
}

/// Reads the scene that the bundle in `dir` was baked from, or `instead` of it; either must be the
/// same bytes.
pub(crate) fn load_again(
    manifest: &Manifest,
    dir: &Path,
    instead: Option<&Path>,
) -> Result<Loaded> {
    let exclude = &manifest.options.exclude;
    let (path, sha256) = match (&manifest.scene, instead) {
        (SceneSource::BuiltIn { name, size, seed }, None) => {
            let Some(scene) = BuiltIn::from_record(name, *size, *seed) else {
                bail!(
                    "this version has no built-in scene '{name}' of size {size} and seed {seed}: \
                     verify with the one that baked"
                )
            };
            return load(&SceneChoice::BuiltIn(scene), exclude);
        }
        (SceneSource::BuiltIn { name, .. }, Some(_)) => {
            bail!("the bundle was baked from the built-in scene '{name}': leave --scene out")
        }
        (SceneSource::File { path, sha256 }, None) => (dir.join(path), sha256),
        (SceneSource::File { sha256, .. }, Some(path)) => (path.to_owned(), sha256),
    };
    if !path.exists() {
        bail!("{}", not_there(&path));
    }
    let loaded = load(&SceneChoice::File(path.clone()), exclude)?;
    if loaded.sha256 != *sha256 {
        bail!(
            "{}: this is not the scene that was baked (its SHA-256 differs): bake it again, \
             or name the one that was baked with --scene FILE",
            path.display()
        );
    }
    Ok(loaded)
}

/// That the scene of the bundle in `dir` is no longer where it was baked from; `None` where it is, or
/// was no file.
pub(crate) fn moved(manifest: &Manifest, dir: &Path) -> Option<String> {
    match &manifest.scene {
        SceneSource::File { path, .. } if !dir.join(path).exists() => {
            Some(not_there(&dir.join(path)))
        }
        _ => None,
    }
}

fn not_there(path: &Path) -> String {
    format!(
        "{}: the scene that was baked is not there: name it with --scene FILE",
        path.display()
    )
}

/// One checksum of a scene's own file and of those it refers to by relative paths.
fn sha256_of_files(path: &Path, others: &[String]) -> Result<String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let of_file = |path: &Path| {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        Ok(farfield_bundle::sha256_hex(&bytes))
    };
    let own = of_file(path)?;
    if others.is_empty() {
        return Ok(own);
    }
    let others = others.iter().map(|name| of_file(&folder.join(name)));
    let all: String = std::iter::once(Ok(own))
        .chain(others)
        .collect::<Result<_>>()?;
    Ok(farfield_bundle::sha256_hex(all.as_bytes()))
}

/// A path with the symbolic links of its existing part followed: what "..", seen from there, means.
pub(crate) fn real(path: &Path) -> PathBuf {
    for above in path.ancestors() {
        if let (Ok(real), Ok(rest)) = (above.canonicalize(), path.strip_prefix(above)) {
            return real.join(rest);
        }
    }
    path.to_owned()
}
