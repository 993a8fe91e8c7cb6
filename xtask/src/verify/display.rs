//! What a glTF client shows of a bundle, impostor by impostor.

use anyhow::{Result, bail};
use farfield_bundle::{GLTF_FILE, Manifest};
use farfield_scene::Scene;
use std::borrow::Cow;
use std::path::Path;

/// The quads of each impostor of a manifest.
///
/// # Errors
///
/// When several impostors are not objects of their names.
pub(super) fn quads_of_each<'a>(
    dir: &Path,
    all: &'a Scene,
    manifest: &Manifest,
) -> Result<Vec<Cow<'a, Scene>>> {
    if !manifest.options.view_space.has_sides() {
        return Ok(vec![Cow::Borrowed(all); manifest.impostors.len()]);
    }
    let path = dir.join(GLTF_FILE);
    let path = path.display();
    let names: Vec<&str> = all
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    if names.len() != manifest.impostors.len() {
        bail!(
            "{path}: draws {} objects for {} impostors: bake again",
            names.len(),
            manifest.impostors.len()
        );
    }
    let of_one = |name: &String| match names.iter().position(|other| other == name) {
        Some(object) => Ok(Cow::Owned(all.extracted(object as u32))),
        None => bail!("{path}: has no object '{name}': bake again"),
    };
    let impostors = manifest.impostors.iter();
    impostors.map(|impostor| of_one(&impostor.name)).collect()
}
