//! A bundle and its original, opened for whoever looks at them.

use crate::console::Console;
use crate::parts::keep_represented;
use crate::{bake, source};
use anyhow::{Context, Result, bail};
use farfield_bundle::{Channels, GLTF_FILE, MANIFEST_FILE, Manifest, ViewSpace};
use farfield_scene::Scene;
use std::path::Path;

/// Reads a bundle's manifest and checks its files.
///
/// # Errors
///
/// When it is no bundle, or damaged.
pub(crate) fn manifest(dir: &Path, console: &Console) -> Result<Manifest> {
    Ok(console.stage("read bundle", || farfield_bundle::read(dir))?)
}

/// The original of the bundle in `dir`.
///
/// * `instead` - where it is no longer where it was baked from
///
/// # Errors
///
/// When the original is not there or not the one that was baked.
pub(crate) fn whole_original(
    manifest: &Manifest,
    dir: &Path,
    instead: Option<&Path>,
    console: &Console,
) -> Result<Scene> {
    let loaded = console.stage("read original", || {
        source::load_again(manifest, dir, instead)
    })?;
    Ok(loaded.scene)
}

/// What of the original the impostors of the bundle in `dir` stand for, with the light that its pages
/// were recorded under.
///
/// * `instead` - where it is no longer where it was baked from
/// * `channels` - what the pages hold
///
/// # Errors
///
/// When the original is not there or not the one that was baked.
pub(crate) fn original(
    manifest: &Manifest,
    dir: &Path,
    instead: Option<&Path>,
    channels: Channels,
    console: &Console,
) -> Result<Scene> {
    let mut scene = whole_original(manifest, dir, instead, console)?;
    let kept = keep_represented(&mut scene, &manifest.options.view_space);
    require_all_objects(manifest, &kept).with_context(|| in_manifest(dir))?;
    bake::channels::prepare(&mut scene, channels);
    Ok(scene)
}

/// What a bundle's glTF file draws.
///
/// # Errors
///
/// When it cannot be read, or shows files that the manifest has no checksum of.
pub(crate) fn display(dir: &Path, manifest: &Manifest) -> Result<Scene> {
    let path = dir.join(GLTF_FILE);
    let imported = farfield_import::read(&path)?;
    let is_listed = |name: &&String| manifest.files.iter().any(|file| file.path == **name);
    if let Some(name) = imported.files.iter().find(|name| !is_listed(name)) {
        bail!(
            "{}: shows {name}, which the manifest does not list: bake again",
            path.display()
        );
    }
    Ok(imported.scene)
}

/// The manifest's path, for messages about what it says.
pub(crate) fn in_manifest(dir: &Path) -> String {
    dir.join(MANIFEST_FILE).display().to_string()
}

/// Checks that the manifest names the objects that are far from the view cell.
fn require_all_objects(manifest: &Manifest, kept: &[String]) -> Result<()> {
    if let ViewSpace::Amid { objects, .. } = &manifest.options.view_space
        && objects != kept
    {
        bail!(
            "options.view_space.objects are not the {} objects that are far from the view cell: \
             bake again",
            kept.len()
        );
    }
    Ok(())
}
