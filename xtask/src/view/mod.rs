//! A bundle beside its original, for people to look at: in a window, or as a page for any browser.

mod shown;
mod sights;

mod data;
mod program;
mod server;

mod mode;
mod window;

pub use mode::{ViewMode, picture_size};
pub use program::built as page_program;
pub use server::serve;
pub use shown::{CostOfShown, Shown};
pub use sights::Sight;
pub use window::{WindowOptions, window};

use crate::console::Console;
use crate::{dump, opened};
use anyhow::{Context, Result, bail};
use farfield_bundle::{FolderKind, NewFile, encode_png, glb_from_scene, write_folder};
use farfield_scene::Scene;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Which bundle to look at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewOptions {
    /// The bundle's folder.
    pub dir: PathBuf,
    /// The original, where it is no longer where it was baked from.
    pub scene: Option<PathBuf>,
}

/// Folders that pages are exported to.
const PAGE: FolderKind = FolderKind {
    name: "page",
    marker: "page.json",
    format: "farfield-page",
};

/// Where the original lies beside the page.
const ORIGINAL: &str = "original/scene.glb";

/// What a page shows, a bundle beside its original, as files with paths relative to the page:
///
/// * `bundle/` - the bundle's own files
/// * `original/scene.glb` - what of the original the impostors stand for, with its images beside it
/// * `view.json` - viewpoints, costs and light
///
/// [`page_program`] has the rest.
///
/// Where the original's file is not there any more, and no other is named, that is said and the page
/// shows the impostor alone.
///
/// # Errors
///
/// When the bundle is damaged or says what cannot be, or the original is not the one that was baked.
pub fn page_content(options: &ViewOptions, console: &Console) -> Result<Vec<NewFile>> {
    let dir = &options.dir;
    let manifest = opened::manifest(dir, console)?;
    if manifest.technique.channels().is_none() {
        bail!(
            "{}: bundles of {} are not shown as pages, but in a window: cargo xtask view {}",
            dir.display(),
            manifest.technique.name(),
            dir.display()
        );
    }
    let shown = Shown::of(manifest, options, console)?;
    let data = data::data(&shown).with_context(|| opened::in_manifest(dir))?;
    let data = NewFile {
        path: "view.json".into(),
        bytes: serde_json::to_vec(&data)?,
    };
    let manifest = &shown.manifest;
    let own = manifest.files.iter().map(|file| file.path.as_str());
    let own = own.chain([farfield_bundle::MANIFEST_FILE]).map(|path| {
        let from = dir.join(path);
        let bytes = std::fs::read(&from).with_context(|| from.display().to_string())?;
        let path = format!("bundle/{path}");
        Ok(NewFile { path, bytes })
    });
    let mut files = own.collect::<Result<Vec<_>>>()?;
    if let Some(scene) = &shown.original {
        files.extend(console.stage("encode original", || encode_original(scene))?);
    }
    files.push(data);
    Ok(files)
}

/// Writes a page to a folder: it appears complete or not at all, and replaces only what is empty or an
/// earlier page.
///
/// * `bundle` - the folder of what it shows, in which it must not lie
///
/// # Errors
///
/// When the folder is not ours to replace or the operating system refuses.
pub fn export(folder: &Path, bundle: &Path, files: &[NewFile], console: &Console) -> Result<()> {
    dump::require_apart(folder, bundle, &PAGE)?;
    write_folder(folder, &PAGE, files)?;
    let bytes: usize = files.iter().map(|file| file.bytes.len()).sum();
    console.say(format_args!(
        "  page in {}, {:.1} MB; it wants to be served, not opened as a file",
        folder.display(),
        bytes as f64 / 1e6
    ));
    Ok(())
}

/// Checks that a page of a bundle may be exported to a folder, before any work is done for it.
///
/// # Errors
///
/// As for [`export`].
pub fn require_export(folder: &Path, bundle: &Path) -> Result<()> {
    dump::require_apart(folder, bundle, &PAGE)
}

/// The original as glTF, with its images beside it.
fn encode_original(scene: &Scene) -> Result<Vec<NewFile>> {
    // Images may have any names, or the same.
    let uris: Vec<String> = (0..scene.images.len())
        .map(|i| format!("{i:03}.png"))
        .collect();
    let glb = NewFile {
        path: ORIGINAL.into(),
        bytes: glb_from_scene(scene, &uris)?,
    };
    let images = scene.images.par_iter().zip(&uris);
    let images = images.map(|(image, uri)| NewFile {
        path: format!("original/{uri}"),
        bytes: encode_png(image),
    });
    Ok(rayon::iter::once(glb).chain(images).collect())
}

#[cfg(test)]
mod tests;
