//! From where an impostor is looked at and what the camera looks at from there, by number: the same in
//! `verify`, its report and the viewer.

use anyhow::{Result, bail};
use farfield_views::{ViewCell, lattice_viewpoints, random_point};
use glam::DVec3;

/// Distinguishes these viewpoints from any that a bake may look from.
pub(crate) const SEED: u64 = 0x7665_7269_6679;

/// Distinguishes where cameras look from where they are.
pub(crate) const AIM_SEED: u64 = 0x0061_696d;

/// Viewpoint number `index` of an impostor in the world: 0 is the reference viewpoint, 1 to 8 are the
/// cell's corners, 9 to 26 its edge and face centres, from 27 on points spread evenly in it.
///
/// # Panics
///
/// When a part of the cell lies at infinity, see [`require_end`].
pub(crate) fn eye(reference: DVec3, cell: &ViewCell, index: u64) -> DVec3 {
    match index.checked_sub(1) {
        None => reference,
        Some(index) => cell.viewpoint(index, SEED),
    }
}

/// Where a camera that looks anywhere looks from viewpoint number `index`: at the middle, from corners,
/// edges and faces of the cell at opposite ones of the hull, then into all of it.
///
/// * `hull` - corners of a convex body around what is represented, as [`Part`](crate::parts::Part) has
///   them
pub(crate) fn sight(hull: &[DVec3; 8], index: u64) -> DVec3 {
    let lattice = lattice_viewpoints();
    let at = match index.checked_sub(1) {
        None => DVec3::splat(0.5),
        Some(index) => match lattice.get(index as usize) {
            Some(fractions) => DVec3::ONE - *fractions,
            None => random_point(index, AIM_SEED),
        },
    };
    let along = |axis: usize, a: DVec3, b: DVec3| a.lerp(b, at[axis]);
    let edge = |i: usize| along(0, hull[i], hull[i + 1]);
    let face = |i: usize| along(1, edge(i), edge(i + 2));
    along(2, face(0), face(4))
}

/// Refuses a cell that reaches to infinity, which no bake makes.
pub(crate) fn require_end(cell: &ViewCell) -> Result<()> {
    if cell.corners().iter().any(|corner| corner.w == 0.0) {
        bail!("options.view_space.view_cell has no end; bake the bundle again");
    }
    Ok(())
}
