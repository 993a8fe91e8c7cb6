//! Lists for viewers in a box, which look anywhere: sample each of its cells, group, list.

use super::grouped::{Grouped, require_memory};
use super::sampler::Sampler;
use super::{BitfieldsOptions, JUDGING, Made, list_file, listed_ranges, misses, solids};
use crate::console::Console;
use crate::inside::{Inside, box_name};
use crate::orbit::FINER;
use anyhow::{Result, bail};
use farfield_bitfields::{
    Bitfield, CellSet, CellSettings, FaceRanges, PatchSettings, cell_patches_in_parts, cell_set,
};
use farfield_bundle::{CELLS_FILE, CELLS_FORMAT, CELLS_VERSION, CellLists, CellRecord, Samples};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;
use rayon::prelude::*;

/// Samples of a cell beside the 27 that are taken first; from then on only what views show is added.
const MOST_SAMPLES: u32 = 400;

/// So many times as many views as must miss nothing are looked at before it is given up: where thousands
/// of small things are seen past each other, some pixel is always missed.
const PATIENCE: u32 = 4;

/// What is drawn of a scene for each view cell of a box.
///
/// * `represented` - the scene's box
pub(super) fn made(
    scene: &Scene,
    represented: [DVec3; 2],
    inside: &Inside,
    options: &BitfieldsOptions,
    console: &Console,
) -> Result<Made> {
    inside.require_pixels(FINER)?;
    inside.require_near(represented)?;
    let cells: Vec<ViewCell> = inside.grid().cells().collect();
    require_memory(
        scene.triangles.len() as u64,
        cells.len() as u64,
        "cells",
        "cut the view cell into fewer with --cells",
    )?;
    let textures = console.stage("prepare textures", || Textures::new(scene));
    let sampler = Sampler::new(scene, &textures);
    let warning = console.stage("look for backs", || {
        solids::warning(&sampler, &textures, &cells)
    });
    // Before what takes long.
    warning.iter().for_each(|warning| console.warn(warning));
    let welded = super::welded(scene);
    let bar = console.bar("look around", cells.len() as u64);
    let looked = cells.iter().map(|cell| {
        let found = seen_from(cell, &sampler, &welded, inside, options);
        bar.inc(1);
        found
    });
    let looked: Vec<CellSet> = console.stage("sample", || looked.collect());
    bar.finish_and_clear();
    let sets: Vec<Bitfield> = looked.iter().map(|cell| cell.set.clone()).collect();
    if sets.iter().all(Bitfield::is_empty) {
        bail!(
            "nothing of the scene is seen from the view cell: move --view-cell to where fronts of {} can \
             be seen",
            box_name(
                (represented[0] + represented[1]) / 2.0,
                represented[1] - represented[0]
            )
        );
    }
    let viewpoints: usize = looked.iter().map(|cell| cell.viewpoints.len()).sum();
    let rounds = looked.iter().flat_map(|cell| &cell.rounds);
    let missing: u32 = rounds.map(|round| round.missing_views).sum();
    let given_up = (looked.iter()).filter(|cell| cell.clean_views < options.held_back());
    let given_up = given_up.count();
    console.say(format_args!(
        "  {viewpoints} viewpoints in {} cells; {missing} views missed {}, in {given_up} cells to the end",
        cells.len(),
        super::too_much(options)
    ));

    let parts = crate::drawn::parts(scene);
    let settings = PatchSettings::default();
    let grouped = console.stage("group", || {
        let middles: Vec<DVec3> = cells.iter().map(ViewCell::center).collect();
        let (centers, most) = (super::centers(scene), settings.most_primitives);
        let patches = cell_patches_in_parts(&centers, &middles, &sets, &parts, most);
        Grouped::new(patches.with_coincident_in_order(&welded, &parts))
    });
    let sets: Vec<Bitfield> = sets
        .iter()
        .map(|set| grouped.patches.holding(set))
        .collect();
    let lists = (grouped.patches).ranges_in_parts(&sets, &parts, settings.most_ranges);
    if given_up > 0 {
        let missing = format_args!(
            "{missing} of all cells, in {given_up} of {} to the end,",
            cells.len()
        );
        super::warn_of_misses(missing, options.held_back(), console);
    }
    // Not those that were looked at before.
    let missed = |view| {
        let camera = inside.view(view, !options.seed);
        let ranges = lists.of(inside.list(camera.pose.eye));
        sampler.missed(&grouped, ranges, &camera)
    };
    let missed = console.stage("look", || misses(JUDGING, missed));
    let file = list_file(
        CELLS_FILE,
        cell_lists(&lists, parts).to_json(),
        "cut the view cell into fewer with --cells",
    )?;
    Ok(Made {
        grouped,
        lists,
        file,
        viewpoints: viewpoints as u32,
        samples: Samples::Adaptive,
        neighbors: options.adds_neighbors(),
        space: inside.space(),
        missed,
        warning,
    })
}

/// All that is seen from a cell.
fn seen_from(
    cell: &ViewCell,
    sampler: &Sampler<'_>,
    welded: &[[u32; 3]],
    inside: &Inside,
    options: &BitfieldsOptions,
) -> CellSet {
    let settings = CellSettings {
        most_samples: MOST_SAMPLES,
        tolerated_pixels: options.tolerated_pixels,
        clean_views: options.held_back(),
        most_views: options.held_back().saturating_mul(PATIENCE),
        seed: options.seed,
    };
    let sample = |eyes: &[DVec3]| {
        let seen = |eye: &DVec3| {
            let seen = sampler.seen(&inside.around(*eye, FINER));
            sampler.with_blended(match options.adds_neighbors() {
                true => sampler.with_neighbors(&seen, welded, *eye),
                false => seen,
            })
        };
        eyes.par_iter().map(seen).collect()
    };
    let look = |eyes: &[DVec3]| {
        let shown = |eye: &DVec3| sampler.counted(&inside.around(*eye, 1.0));
        eyes.par_iter().map(shown).collect()
    };
    cell_set(cell, &settings, sample, look)
}

fn cell_lists(lists: &FaceRanges, parts: Vec<u32>) -> CellLists {
    let cells = (0..lists.count()).map(|cell| CellRecord {
        draw: listed_ranges(lists.of(cell)),
    });
    CellLists {
        format: CELLS_FORMAT.into(),
        version: CELLS_VERSION,
        parts,
        cells: cells.collect(),
    }
}
