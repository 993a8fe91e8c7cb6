//! View cells that may reach into solids: from there the backs of walls are seen, which are not drawn, and
//! so is what lies behind them.
//!
//! A single-sided sheet that is seen from behind cannot be told from the wall of a solid, and a solid of
//! two-sided surfaces not from a room.

use super::sampler::Sampler;
use crate::drawn;
use crate::inside::{box_name, point_name};
use farfield_bitfields::cube_map;
use farfield_sampling::{NONE, Textures};
use farfield_scene::Scene;
use farfield_views::{ViewCell, lattice_viewpoints};
use glam::DVec3;
use rayon::prelude::*;

/// Pixels along each side of a face of the cube maps that tell what surrounds a viewpoint.
const PIXELS: u32 = 64;

/// A cell may reach into a solid where more than this share of what surrounds any of the viewpoints that
/// samples are first taken from is a back.
///
/// Outside of closed solids none is, whatever overlaps; in the built-in house, between floor and ceiling,
/// a tenth is, under the ground of the town a half and more. More, and large rooms are not noticed; less,
/// and every sign with one side is told.
const INSIDE: f64 = 0.01;

/// Says which cells may reach into solids; `None` where none does.
pub(super) fn warning(
    sampler: &Sampler<'_>,
    textures: &Textures<'_>,
    cells: &[ViewCell],
) -> Option<String> {
    let scene = both_sides(sampler.solid());
    let mut lattice = lattice_viewpoints();
    lattice.push(DVec3::splat(0.5));
    let most = |cell: &ViewCell| {
        let shares = lattice.par_iter().map(|fractions| {
            let eye = cell.point(*fractions);
            (back_share(&scene, sampler, textures, eye), eye)
        });
        let shares: Vec<(f64, DVec3)> = shares.collect();
        let most = shares.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        most.expect("there are viewpoints")
    };
    let reaching: Vec<(usize, (f64, DVec3))> = (cells.iter().map(most).enumerate())
        .filter(|(_, (share, _))| *share > INSIDE)
        .collect();
    let &(first, (share, eye)) = reaching.first()?;
    let cell = &cells[first];
    let size = cell.point(DVec3::ONE) - cell.point(DVec3::ZERO);
    Some(format!(
        "view cells that see the backs of single-sided surfaces, and may reach into something solid: {} of \
         {}. Backs are not drawn, so that what is behind them is seen from there and listed. Of cell {first}, \
         {}, the viewpoint {} has {:.0} % of them around it. Keep --view-cell clear of what is solid, make \
         it smaller, leave out what is in the way with --exclude, or cut the box with --cells into more \
         cells, so that fewer reach in",
        reaching.len(),
        cells.len(),
        box_name(cell.center(), size),
        point_name(eye),
        share * 100.0,
    ))
}

/// A scene of which both sides of all surfaces are seen.
fn both_sides(scene: &Scene) -> Scene {
    let mut both = drawn::without_images(scene);
    both.materials
        .iter_mut()
        .for_each(|material| material.double_sided = true);
    both
}

/// Of the pixels around a viewpoint, the share that shows the back of a single-sided surface.
///
/// * `scene` - with both sides of all
fn back_share(scene: &Scene, sampler: &Sampler<'_>, textures: &Textures<'_>, eye: DVec3) -> f64 {
    let eye_in_object = sampler.in_object(eye);
    let (mut all, mut backs) = (0usize, 0usize);
    for camera in cube_map(eye, PIXELS) {
        drawn::ids(scene, textures, &camera, |ids| {
            let is_back = |id: &&u32| **id != NONE && !sampler.faces(**id, eye_in_object);
            all += ids.len();
            backs += ids.iter().filter(is_back).count();
        });
    }
    backs as f64 / all as f64
}
