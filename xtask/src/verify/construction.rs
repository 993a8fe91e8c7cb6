//! What holds for every viewpoint, because of how the impostor is built: checked on the file as
//! a client reads it.

use super::subject::Subject;
use crate::bake::layered::{recording_camera, texels_sha256};
use farfield_bundle::ProvedBound;
use farfield_layers::guarantee;
use farfield_pages::{Patch, opaque_texels, patches_of};
use rayon::prelude::*;

/// What was proved, and what stands against it.
pub(super) struct Construction {
    pub(super) proved: Vec<ProvedBound>,
    /// What is not built as the proof needs it, a sentence each.
    pub(super) faults: Vec<String>,
    /// What the quads show; empty where they cannot be read.
    pub(super) patches: Vec<Patch>,
}

/// More than rounding adds to figures of about 1.
const DOUBT: f64 = 1e-6;

/// Checks that layers are near enough to each other for the view cell, and that the quads show
/// their texels where the layers have them.
pub(super) fn check_construction(subject: &Subject<'_>) -> Construction {
    let mut proved = Vec::new();
    let mut faults = Vec::new();
    match guarantee(
        &subject.stack,
        &subject.cell,
        subject.represented,
        &subject.lens,
    ) {
        Ok(found) => {
            let mut bound = |statement: &str, bound: f64, limit: f64, fault: String| {
                if bound > limit + DOUBT {
                    faults.push(fault);
                }
                proved.push(ProvedBound {
                    statement: statement.into(),
                    bound,
                    limit,
                });
            };
            bound(
                "Texels that two neighbouring layers are displaced against each other, at most: \
                 up to 1, no gap opens between them.",
                found.disparity,
                1.0,
                format!(
                    "layers {} and {} are too far apart for the view cell: seen from its worst \
                     place they are displaced by {:.3} texels against each other, where gaps open \
                     from 1 on",
                    found.disparity_layer,
                    found.disparity_layer + 1,
                    found.disparity
                ),
            );
            bound(
                "Pixels along the side of a texel, at most: up to 1, none is magnified.",
                found.greatest_texel_px,
                1.0,
                format!(
                    "texels are magnified: seen from the worst place of the view cell, one is \
                     {:.3} pixels wide",
                    found.greatest_texel_px
                ),
            );
        }
        Err(error) => faults.push(format!("the layers do not fit together: {error}")),
    }
    let depths: Vec<f64> = subject
        .stack
        .layers
        .iter()
        .map(|layer| layer.depth)
        .collect();
    let camera = recording_camera(&subject.stack);
    let patches = match patches_of(subject.impostor.scene, &camera, &depths) {
        Ok(patches) => {
            faults.extend(other_texels(&patches, subject));
            patches
        }
        Err(error) => {
            faults.push(format!("{error}"));
            Vec::new()
        }
    };
    Construction {
        proved,
        faults,
        patches,
    }
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
    let held: u64 = pages.iter().map(|page| page.texels.len() as u64).sum();
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
