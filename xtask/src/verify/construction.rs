//! What holds for every viewpoint, because of how the impostor is built: checked on the file as
//! a client reads it.

use super::subject::{MeshShape, Shape, Subject};
use crate::bake::recording::{recording_camera, texels_sha256};
use crate::bake::shown_from;
use anyhow::{Context, Result};
use farfield_bundle::{Channels, ProvedBound};
use farfield_layers::{Guarantee, guarantee};
use farfield_pages::{Patch, opaque_texels, patches_of};
use farfield_scene::{AlphaMode, Material};
use rayon::prelude::*;

/// What was proved, and what stands against it.
pub(super) struct Construction {
    pub(super) proved: Vec<ProvedBound>,
    /// The least side of a texel seen from anywhere in the view cell, in pixels.
    pub(super) smallest_texel_px: f64,
    /// What is not built as the proof needs it, a sentence each.
    pub(super) faults: Vec<String>,
    /// What the quads show; empty where they cannot be read.
    pub(super) patches: Vec<Patch>,
}

/// More than rounding adds to figures of about 1.
const DOUBT: f64 = 1e-6;

/// Checks that layers are near enough to each other for the view cell, and that the quads show
/// their texels where the layers have them, as masks.
///
/// # Errors
///
/// When the layers are no layers before the view cell at all.
pub(super) fn check_construction(subject: &Subject<'_>) -> Result<Construction> {
    let found = guarantee(
        &subject.stack,
        &subject.cell,
        subject.represented,
        &subject.lens,
    )
    .context("the layers do not fit together; bake the bundle again")?;
    let (proved, mut faults) = bounds(&found);
    let patches = match &subject.shape {
        Shape::Layers(_) => {
            let (patches, found) = check_quads(subject);
            faults.extend(found);
            patches
        }
        Shape::Mesh(mesh) => {
            faults.extend(check_mesh(subject, mesh));
            Vec::new()
        }
    };
    faults.extend(other_material(subject));
    Ok(Construction {
        proved,
        smallest_texel_px: found.smallest_texel_px,
        faults,
        patches,
    })
}

/// What the quads of a layered impostor show, and what is wrong with them.
fn check_quads(subject: &Subject<'_>) -> (Vec<Patch>, Vec<String>) {
    let depths: Vec<f64> = subject
        .stack
        .layers
        .iter()
        .map(|layer| layer.depth)
        .collect();
    let camera = recording_camera(&subject.stack);
    match patches_of(subject.impostor.scene, &camera, &depths) {
        Ok(patches) => {
            let faults = other_texels(&patches, subject);
            (patches, faults.into_iter().collect())
        }
        Err(error) => (Vec::new(), vec![error.to_string()]),
    }
}

/// What is wrong with a mesh.
fn check_mesh(subject: &Subject<'_>, mesh: &MeshShape) -> Vec<String> {
    let triangles = subject.impostor.scene.drawn_triangles();
    let is_other = triangles != mesh.body.triangles;
    let fault = is_other.then(|| {
        format!(
            "the mesh has {triangles} triangles, not the {} that were baked",
            mesh.body.triangles
        )
    });
    fault.into_iter().collect()
}

/// What is proved of all impostors of a bundle: of each bound the worst.
pub(super) fn worst_of(constructions: &[Construction]) -> Vec<ProvedBound> {
    let all = constructions.iter().map(|one| one.proved.clone());
    let worse = |a: ProvedBound, b: ProvedBound| if b.bound > a.bound { b } else { a };
    all.reduce(|a, b| a.into_iter().zip(b).map(|(a, b)| worse(a, b)).collect())
        .unwrap_or_default()
}

/// What a guarantee proves, and what of it is too much, a sentence each.
fn bounds(found: &Guarantee) -> (Vec<ProvedBound>, Vec<String>) {
    let bound = |statement: &str, bound: f64| ProvedBound {
        statement: statement.into(),
        bound,
        limit: 1.0,
    };
    let proved = vec![
        bound(
            "Texels that two neighbouring layers are displaced against each other, at most: up to \
             1, no gap opens between them.",
            found.disparity,
        ),
        bound(
            "Pixels along the side of a texel, at most: up to 1, none is magnified.",
            found.greatest_texel_px,
        ),
    ];
    let faults = [
        format!(
            "layers {} and {} are too far apart for the view cell: seen from its worst place they \
             are displaced by {:.3} texels against each other, where gaps open from 1 on",
            found.disparity_layer,
            found.disparity_layer + 1,
            found.disparity
        ),
        format!(
            "texels are magnified: seen from the worst place of the view cell, one is {:.3} pixels \
             wide",
            found.greatest_texel_px
        ),
    ];
    let both = proved.iter().zip(faults);
    let faults = both.filter(|(proved, _)| proved.bound > proved.limit + DOUBT);
    let faults = faults.map(|(_, fault)| fault).collect();
    (proved, faults)
}

/// The first material that does not show its page as a mask, as it was baked: clients would sort
/// it, light it or not, or cut its texels elsewhere.
fn other_material(subject: &Subject<'_>) -> Option<String> {
    let cutoff = shown_from(subject.foliage);
    let is_lit = |m: &Material| {
        !m.unlit && m.normal_texture.is_some() && m.metallic_roughness_texture.is_some()
    };
    let is_mesh = matches!(subject.shape, Shape::Mesh(_));
    let is_mask = |m: &&Material| {
        if is_mesh {
            return m.unlit && m.double_sided && m.alpha == AlphaMode::Opaque;
        }
        let is_shown_as_baked = match subject.channels {
            Channels::Lit | Channels::Unlit => m.unlit,
            Channels::Pbr => is_lit(m),
        };
        is_shown_as_baked && m.alpha == AlphaMode::Mask { cutoff }
    };
    let other = subject
        .impostor
        .scene
        .materials
        .iter()
        .find(|m| !is_mask(m))?;
    if is_mesh {
        return Some(format!(
            "material '{}' is not unlit, opaque and seen from both sides",
            other.name
        ));
    }
    let kind = match subject.channels {
        Channels::Lit | Channels::Unlit => "an unlit mask",
        Channels::Pbr => "a lit mask with pages of normals, metallic and roughness",
    };
    Some(format!(
        "material '{}' is not {kind} with an alpha cutoff of {cutoff}",
        other.name
    ))
}

/// Layers that show other texels than were baked, a sentence about the first. What a layer lacks or
/// shows elsewhere need not open a gap in any of the views.
fn other_texels(patches: &[Patch], subject: &Subject<'_>) -> Option<String> {
    let mut of_layer = vec![Vec::new(); subject.texels_sha256.len()];
    for patch in patches {
        of_layer[patch.layer as usize].push(*patch);
    }
    let pages = &subject.impostor.scene.images;
    // Quads that share what they show could have any number of texels.
    let shown: u64 = patches.iter().map(|patch| patch.rect.area()).sum();
    let materials = subject.impostor.scene.materials.iter();
    let held: u64 = materials
        .filter_map(|material| material.base_color_texture)
        .map(|texture| subject.impostor.scene.textures[texture as usize].image)
        .map(|image| pages[image as usize].texels.len() as u64)
        .sum();
    if shown > held {
        return Some(format!(
            "the quads show {shown} texels, more than the {held} of the pages: they share some"
        ));
    }
    let found: Vec<_> = of_layer
        .par_iter()
        .map(|patches| opaque_texels(patches, pages))
        .collect();
    let is_wrong = |layer: &usize| texels_sha256(&found[*layer]) != subject.texels_sha256[*layer];
    let wrong: Vec<_> = (0..found.len()).filter(is_wrong).collect();
    let first = *wrong.first()?;
    let others = match wrong.len() - 1 {
        0 => String::new(),
        1 => ", and so does another layer".into(),
        more => format!(", and so do {more} other layers"),
    };
    Some(format!(
        "layer {first} shows other texels than were baked, in {} quads {} texels{others}",
        of_layer[first].len(),
        found[first].len()
    ))
}
