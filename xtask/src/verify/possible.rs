//! Whether a bundle can be looked at: its checksums find accidents, not what cannot be.

use super::construction::Construction;
use super::subject::Subject;
use crate::viewpoints::require_end;
use anyhow::{Result, bail};
use farfield_layers::Aim;
use farfield_views::Pose;
use glam::DVec3;
use std::ops::Range;

/// Views that are looked at besides those asked for: the lattice's, of the coverage and of what
/// lies beyond the cell.
const LATTICE: Range<u64> = 0..27;

/// How near the plane through its eye a camera may see anything, as a share of the distance: more
/// than rounding makes of what lies before it.
const LEAST_DEPTH: f64 = 1e-9;

/// Texels may be this many pixels wide. Those of a bake are at most one; were they more than two,
/// pictures would take more than four times the memory that the layers account for.
const MOST_PIXELS_A_TEXEL: f64 = 2.0;

/// Pictures up to this many pixels a side are looked at whatever is wrong with the layers: some
/// hundred megabytes for each at work.
const LARGEST_UNPROVED: u32 = 2048;

/// Checks that each camera has something to look at, and one that looks at all of the original has it
/// before it.
///
/// * `indices` - of the impostor's viewpoints
///
/// # Errors
///
/// The first viewpoint from which it is not so, as it is from all of the cell of any bake.
pub(super) fn check_views(subject: &Subject<'_>, indices: Range<u64>) -> Result<()> {
    require_end(&subject.cell)?;
    for view in LATTICE.chain(indices) {
        let eye = subject.eye(view);
        if subject.lens.aim == Aim::Anywhere {
            // What is before the cell may be behind a camera, which must look somewhere.
            let target = subject.looked_at(view);
            if (target - eye).try_normalize().is_none() {
                bail!(
                    "viewpoint {view} at {eye} has no direction to look along to {target}; bake \
                     the bundle again"
                );
            }
        } else if !sees_all(subject, eye) {
            bail!(
                "options.view_space.view_cell: from viewpoint {view} at {eye}, the scene does not \
                 lie before a camera that looks at the centre of what is represented, {}; bake the \
                 bundle again",
                subject.target()
            );
        }
    }
    Ok(())
}

/// Whether all that is represented lies before a camera at a place that looks at its centre.
pub(super) fn sees_all(subject: &Subject<'_>, eye: DVec3) -> bool {
    let axis = subject.target() - eye;
    if axis.try_normalize().is_none() {
        return false;
    }
    let pose = Pose::looking_along(eye, axis);
    subject.corners().iter().all(|corner| {
        let depth = pose.point_in_view(*corner).z;
        depth > LEAST_DEPTH * corner.distance(eye) && depth.is_finite()
    })
}

/// Checks that pictures are not larger than the layers, as they are in the file, account for.
///
/// # Errors
///
/// When they are. Whatever else is wrong with the layers is a broken promise, not an error.
pub(super) fn check_resolution(subject: &Subject<'_>, construction: &Construction) -> Result<()> {
    let resolution = subject.lens.resolution;
    let pixels = subject.stack.texel() / subject.lens.pixel();
    // What is not a number is caught here as well.
    let is_honest = pixels <= MOST_PIXELS_A_TEXEL;
    if !is_honest {
        bail!(
            "options.resolution is {resolution}, of which a texel of the layers takes \
             {pixels:.1} pixels instead of about one; bake the bundle again"
        );
    }
    match construction.faults.first() {
        Some(fault) if resolution > LARGEST_UNPROVED => bail!(
            "pictures of {resolution} pixels a side are too large to look at for nothing: {fault}; \
             bake the bundle again"
        ),
        _ => Ok(()),
    }
}
