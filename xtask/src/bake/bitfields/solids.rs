//! View cells that reach into solids: from there the backs of walls are seen, which are not drawn, and
//! so is what lies behind them.

use super::sampler::Sampler;
use crate::drawn;
use farfield_bitfields::{CellSet, cube_map};
use farfield_sampling::{NONE, Textures};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;
use rayon::prelude::*;

/// Pixels along each side of a face of the cube maps that tell what surrounds a viewpoint.
const PIXELS: u32 = 64;

/// A cell reaches into a solid where more than this share of the pixels that show anything, around any of
/// its viewpoints, show a back.
///
/// Outside of closed solids none does, whatever overlaps; in the built-in house, between floor and ceiling,
/// a tenth does, under the ground of the town a half and more. More, and large rooms are not noticed;
/// less, and every sign with one side is told.
const INSIDE: f64 = 0.01;

/// Says which cells reach into solids; `None` where none does.
///
/// * `looked` - what was found of each cell
pub(super) fn warning(
    sampler: &Sampler<'_>,
    textures: &Textures<'_>,
    cells: &[ViewCell],
    looked: &[CellSet],
) -> Option<String> {
    let scene = both_sides(sampler.solid());
    let most = |looked: &CellSet| {
        let eyes = looked.viewpoints.par_iter();
        let shares = eyes.map(|eye| back_share(&scene, sampler, textures, *eye));
        shares.reduce(|| 0.0, f64::max)
    };
    let shares = looked.iter().map(most).enumerate();
    let reaching: Vec<(usize, f64)> = shares.filter(|(_, share)| *share > INSIDE).collect();
    let &(first, share) = reaching.first()?;
    let cell = &cells[first];
    let (center, size) = (
        cell.center(),
        cell.point(DVec3::ONE) - cell.point(DVec3::ZERO),
    );
    // To millimetres, as people name them.
    let name = |v: DVec3| {
        let rounded = v.to_array().map(|at| (at * 1e3).round() / 1e3);
        rounded.map(|at| at.to_string()).join(",")
    };
    Some(format!(
        "view cells that reach into solids: {} of {}. The backs of walls are not drawn, so that what is behind \
         them is seen from there and listed. Of cell {first}, box:{}:{}, {:.0} % of what is around a viewpoint \
         are such backs. Keep --view-cell clear of what is solid, make it smaller, leave out what is in the way \
         with --exclude, or cut the box with --cells into more cells, so that fewer reach in",
        reaching.len(),
        cells.len(),
        name(center),
        name(size),
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

/// Of the pixels around a viewpoint that show anything, the share that shows the back of a single-sided
/// surface.
///
/// * `scene` - with both sides of all
fn back_share(scene: &Scene, sampler: &Sampler<'_>, textures: &Textures<'_>, eye: DVec3) -> f64 {
    let (mut all, mut backs) = (0u32, 0u32);
    for camera in cube_map(eye, PIXELS) {
        drawn::ids(scene, textures, &camera, |ids| {
            for &id in ids.iter().filter(|id| **id != NONE) {
                all += 1;
                backs += u32::from(!sampler.faces(id, sampler.in_object(eye)));
            }
        });
    }
    f64::from(backs) / f64::from(all.max(1))
}
