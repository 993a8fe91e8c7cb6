//! Lists for viewers all around a scene: sample, triangulate, group, adapt, list.

use super::grouped::{Grouped, require_memory};
use super::sampler::Sampler;
use super::samples::{self, SampleChoice};
use super::{BitfieldsOptions, JUDGING, Made, list_file, listed_ranges, misses};
use crate::console::Console;
use crate::orbit::{FINER, NEAREST, Orbit};
use anyhow::{Context, Result};
use farfield_bitfields::{
    Adapted, AdaptiveSettings, Bitfield, Lookup, PatchSettings, Triangulation, United, adapt,
    face_sets, patches_in_parts,
};
use farfield_bundle::{FACES_FILE, FACES_FORMAT, FACES_VERSION, FaceLists, FaceRecord};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// Samples that adaptive ones begin with, as the paper has it, and how many they grow to. With more,
/// faces are smaller and more is culled, but there are more lists, and each face is looked at by fewer
/// of the views.
const FIRST_VIEWPOINTS: u32 = 25;
const MOST_VIEWPOINTS: u32 = 55;

/// So many times as many views as must miss nothing are looked at before it is given up: the bunny needs
/// six times as many; an engine full of slits was not done after minutes.
const PATIENCE: u32 = 8;

/// What is drawn of a scene for each face between directions.
///
/// * `represented` - the scene's box
pub(super) fn made(
    scene: &Scene,
    represented: [DVec3; 2],
    choice: &SampleChoice,
    distances: Option<[f64; 2]>,
    options: &BitfieldsOptions,
    console: &Console,
) -> Result<Made> {
    let in_scene = || options.scene.to_string();
    let (viewpoints, orbit) = place(options, represented, choice, distances)?;
    let faces = Triangulation::new(&viewpoints, DVec3::ZERO)?;
    require_memory(
        scene.triangles.len() as u64,
        faces.faces().len() as u64,
        "faces",
        "give fewer viewpoints with --samples",
    )
    .with_context(in_scene)?;
    let [near, far] = orbit.distances;
    console.say(format_args!(
        "  views from {near:.6} m to {far:.6} m around {}",
        orbit.center
    ));
    let textures = console.stage("prepare textures", || Textures::new(scene));
    let sampler = Sampler::new(scene, &textures);

    let welded = super::welded(scene);
    let distances = orbit.sampled();
    let offsets = distances.viewpoints(&viewpoints);
    let sample = |offsets: &[DVec3]| match options.adds_neighbors() {
        true => grown_sets(&sampler, &orbit, offsets, &welded),
        false => sets(&sampler, &orbit, offsets),
    };
    let seen = console.stage("sample", || sample(&offsets));
    let parts = crate::drawn::parts(scene);
    let settings = PatchSettings::default();
    let grouped = console.stage("group", || {
        let seen = face_sets(&faces, &distances.unite(&seen), United::Six);
        let (centers, most) = (super::centers(scene), settings.most_primitives);
        let patches = patches_in_parts(&centers, &faces, &seen, &parts, most);
        Grouped::new(patches.with_coincident_in_order(&welded, &parts))
    });
    let (faces, sets) = match choice {
        SampleChoice::Adaptive => {
            let mut seen = Some(seen);
            let sample = |offsets: &[DVec3]| {
                // Of the first viewpoints it is known already.
                let seen = seen.take();
                seen.unwrap_or_else(|| sample(offsets))
            };
            adaptive(&sampler, &orbit, &grouped, &faces, sample, options, console)?
        }
        SampleChoice::Even(_) | SampleChoice::Listed(_) => {
            let sets = distances.unite(&seen);
            let sets = sets
                .iter()
                .map(|set| grouped.patches.holding(set))
                .collect();
            (faces, sets)
        }
    };
    // Of the directions as they will stand in the file.
    let faces = Triangulation::new(faces.directions(), DVec3::ZERO)?;
    let united = face_sets(&faces, &sets, United::Six);
    let lists = (grouped.patches).ranges_in_parts(&united, &parts, settings.most_ranges);
    let lookup = Lookup::new(faces, lists);
    // Not those that were looked at before.
    let missed = |view| {
        let camera = orbit.view(view, !options.seed);
        let ranges = lookup.ranges(camera.pose.eye - orbit.center);
        sampler.missed(&grouped, ranges, &orbit.window(&camera))
    };
    let judging = options.held_back().max(JUDGING);
    let missed = console.stage("look", || misses(judging, missed));
    let viewpoints = lookup.faces().directions().len() as u32;
    Ok(Made {
        lists: lookup.lists().clone(),
        file: list_file(
            FACES_FILE,
            face_lists(&lookup, parts).to_json(),
            "ask for fewer viewpoints with --samples",
        )?,
        grouped,
        viewpoints,
        samples: match choice {
            SampleChoice::Adaptive => farfield_bundle::Samples::Adaptive,
            SampleChoice::Even(_) => farfield_bundle::Samples::Even,
            SampleChoice::Listed(_) => farfield_bundle::Samples::Listed,
        },
        neighbors: options.adds_neighbors(),
        space: orbit.space(),
        missed,
        warning: None,
    })
}

/// Directions that are sampled first, and from where pictures are taken.
fn place(
    options: &BitfieldsOptions,
    represented: [DVec3; 2],
    choice: &SampleChoice,
    distances: Option<[f64; 2]>,
) -> Result<(Vec<DVec3>, Orbit)> {
    let orbit = |distances| {
        let fov = options.fov_degrees.to_radians();
        let orbit = Orbit::new(represented, distances, fov, options.resolution);
        orbit.with_context(|| options.scene.to_string())
    };
    match choice {
        SampleChoice::Adaptive => Ok((samples::even(FIRST_VIEWPOINTS)?, orbit(distances)?)),
        SampleChoice::Even(count) => Ok((samples::even(*count)?, orbit(distances)?)),
        SampleChoice::Listed(path) => {
            let any = orbit(None)?;
            let listed = samples::listed(path)?;
            let least = NEAREST * any.radius;
            let (directions, range) = listed.directions(any.center, least)?;
            Ok((directions, orbit(distances.or(Some(range)))?))
        }
    }
}

/// The triangles that can be seen from each offset from the centre.
pub(crate) fn sets(sampler: &Sampler<'_>, orbit: &Orbit, offsets: &[DVec3]) -> Vec<Bitfield> {
    let set = |offset: &DVec3| {
        let seen = sampler.seen(&[orbit.recorder(*offset, FINER)]);
        sampler.with_blended(seen)
    };
    offsets.par_iter().map(set).collect()
}

/// The same, and their neighbours.
fn grown_sets(
    sampler: &Sampler<'_>,
    orbit: &Orbit,
    offsets: &[DVec3],
    welded: &[[u32; 3]],
) -> Vec<Bitfield> {
    let set = |offset: &DVec3| {
        let seen = sampler.seen(&[orbit.recorder(*offset, FINER)]);
        let eye = orbit.center + *offset;
        sampler.with_blended(sampler.with_neighbors(&seen, welded, eye))
    };
    offsets.par_iter().map(set).collect()
}

/// Viewpoints and the patches that they see, until held-back views miss no more than is tolerated, or there
/// were too many.
fn adaptive(
    sampler: &Sampler<'_>,
    orbit: &Orbit,
    grouped: &Grouped,
    first: &Triangulation,
    mut sample: impl FnMut(&[DVec3]) -> Vec<Bitfield>,
    options: &BitfieldsOptions,
    console: &Console,
) -> Result<(Triangulation, Vec<Bitfield>)> {
    let held_back = options.held_back();
    let settings = AdaptiveSettings {
        distances: orbit.sampled(),
        most_viewpoints: MOST_VIEWPOINTS,
        tolerated_pixels: options.tolerated_pixels,
        clean_views: held_back,
        most_views: held_back.saturating_mul(PATIENCE),
        seed: options.seed,
    };
    let sample = |offsets: &[DVec3]| {
        let sets = sample(offsets);
        sets.iter()
            .map(|set| grouped.patches.holding(set))
            .collect()
    };
    let mut looked = 0;
    let look = |offsets: &[DVec3]| {
        looked += offsets.len();
        let picture =
            |offset: &DVec3| sampler.patches(grouped, &orbit.window(&orbit.camera(*offset)));
        offsets.par_iter().map(picture).collect()
    };
    let adapted = console.stage("adapt", || {
        adapt(first.directions(), &settings, sample, look)
    })?;
    let Adapted {
        faces,
        sets,
        clean_views,
        rounds,
        ..
    } = adapted;
    let missing: u32 = rounds.iter().map(|round| round.missing_views).sum();
    let what = super::too_much(options);
    console.say(format_args!(
        "  {} viewpoints; of {looked} views {missing} missed {what}; clean in a row at last: {clean_views}",
        sets.len()
    ));
    if clean_views < held_back {
        let missing = format_args!("{missing} of {looked}");
        super::warn_of_misses(missing, held_back, console);
    }
    Ok((faces, sets))
}

fn face_lists(lookup: &Lookup, parts: Vec<u32>) -> FaceLists {
    let faces = (0..).zip(lookup.faces().faces());
    let faces = faces.map(|(index, face)| FaceRecord {
        corners: face.corners,
        draw: listed_ranges(lookup.lists().of(index)),
    });
    FaceLists {
        format: FACES_FORMAT.into(),
        version: FACES_VERSION,
        viewpoints: lookup.faces().directions().to_vec(),
        parts,
        faces: faces.collect(),
    }
}
