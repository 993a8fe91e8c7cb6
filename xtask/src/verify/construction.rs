//! What holds for every viewpoint, because of how the impostor is built: checked on the file as
//! a client reads it.

use super::subject::Subject;
use crate::bake::layered::recording_camera;
use farfield_bundle::ProvedBound;
use farfield_layers::guarantee;
use farfield_pages::{Patch, patches_of};

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
            faults.extend(miscounted(&patches, &subject.quads));
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

/// Layers that have fewer or more quads than the manifest says, a sentence about the first. What a
/// layer lacks need not open a gap in any of the views.
fn miscounted(patches: &[Patch], expected: &[u32]) -> Option<String> {
    let mut found = vec![0; expected.len()];
    for patch in patches {
        found[patch.layer as usize] += 1;
    }
    let mut wrong = (0..found.len()).filter(|layer| found[*layer] != expected[*layer]);
    let first = wrong.next()?;
    Some(format!(
        "layer {first} has {} quads where the manifest says {}; {} other layers differ as well",
        found[first],
        expected[first],
        wrong.count()
    ))
}
