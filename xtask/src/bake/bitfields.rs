//! ID-bitfields: number, sample, triangulate, group, adapt, list
//! (O. Meruvia Pastor and T. Strothotte, Approximated View Reconstruction Using Precomputed
//! ID-Bitfields; patches and adaptive samples go beyond it).

use super::grouped::Grouped;
use super::sampler::{Sampler, percentile};
use super::samples::{self, SampleChoice};
use super::{BakeReport, BitfieldsReport, ImpostorReport};
use crate::console::{Console, peak_rss_bytes};
use crate::device::Device;
use crate::drawn::{self, flattened};
use crate::orbit::{FINER, NEAREST, Orbit};
use crate::outliers;
use crate::source::{self, Loaded, SceneChoice};
use crate::view_cell::represented_box;
use anyhow::{Context, Result, bail};
use farfield_bitfields::{
    Adapted, AdaptiveSettings, Bitfield, FaceRanges, Lookup, PatchSettings, Samples, Triangulation,
    adapt, culled_share, face_sets, patches_in_parts,
};
use farfield_bundle::{
    BitfieldsBody, Body, Cost, FACES_FILE, FACES_FORMAT, FACES_VERSION, FORMAT, FaceLists,
    FaceRecord, GLTF_FILE, Impostor, Manifest, NewFile, Options, Promise, Statistics, Technique,
    VERSION, encode_png, glb_from_scene,
};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::path::PathBuf;
use std::time::Instant;

/// What to bake into ID-bitfields, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct BitfieldsOptions {
    /// What.
    pub scene: SceneChoice,
    /// Names of objects to leave out.
    pub exclude: Vec<String>,
    /// Pixels along each side of the viewer's picture.
    pub resolution: u32,
    /// The viewer's field of view, in degrees.
    pub fov_degrees: f64,
    /// Least and greatest distance of the viewer from the centre of the scene's box, in metres; where
    /// they are not given, those of listed viewpoints, or else from where the scene fits into the
    /// picture to four times as far.
    pub distances: Option<[f64; 2]>,
    /// From where the bake looks.
    pub samples: SampleChoice,
    /// Views, held back from the samples, that these are judged by: adaptive ones must miss nothing in
    /// so many one after another.
    pub held_back: u32,
    /// Moves the views that are held back.
    pub seed: u64,
    /// The bundle's folder; by default `target/farfield/<scene>-bitfields`.
    pub out: Option<PathBuf>,
}

impl BitfieldsOptions {
    /// What the command line takes for a scene if nothing else is asked for.
    pub fn new(scene: SceneChoice) -> Self {
        Self {
            scene,
            exclude: Vec::new(),
            resolution: 512,
            fov_degrees: 45.0,
            distances: None,
            samples: SampleChoice::Adaptive,
            held_back: HELD_BACK,
            seed: 0,
            out: None,
        }
    }
}

/// Views that must miss nothing unless asked otherwise.
pub const HELD_BACK: u32 = 3000;

/// Samples that adaptive ones begin with, as the paper has it, and how many they grow to. With more,
/// faces are smaller and more is culled, but there are more lists, and each face is looked at by fewer
/// of the views.
const FIRST_VIEWPOINTS: u32 = 25;
const MOST_VIEWPOINTS: u32 = 55;

/// So many times as many views as must miss nothing are looked at before it is given up: the bunny needs
/// six times as many; an engine full of slits was not done after minutes.
const PATIENCE: u32 = 8;

/// Of so large a share of views a bundle with given samples promises that none misses more than it
/// says, and so large a share of those that the bake looked at did not. The difference is for chance:
/// of a thousand other views the 95th percentile is never above the 99th of these.
const PROMISED_SHARE: f64 = 0.95;
const MEASURED_SHARE: f64 = 0.99;

/// Bakes a scene into ID-bitfields: a bundle that draws, for each direction, what of the original
/// geometry can be seen.
///
/// # Errors
///
/// When the scene cannot be read, samples or distances do not suit it, views never stop to miss
/// something, or the bundle cannot be written. Then nothing is left behind.
pub fn bake_bitfields(options: &BitfieldsOptions, console: &Console) -> Result<BakeReport> {
    let start = Instant::now();
    let name = options.scene.name();
    let dir = options.out.clone();
    let dir = dir.unwrap_or_else(|| format!("target/farfield/{name}-bitfields").into());
    farfield_bundle::require_replaceable(&dir)?;
    let in_scene = || options.scene.to_string();

    let mut loaded = console.stage("read", || source::load(&options.scene, &options.exclude))?;
    let mut exclude = options.exclude.clone();
    if options.distances.is_none() {
        exclude.extend(outliers::leave_out(&mut loaded.scene, &mut loaded.warnings));
    }
    let represented = represented_box(&loaded.scene).with_context(in_scene)?;
    let before = farfield_bundle::cost(&loaded.scene);
    let scene = console.stage("number", || flattened(&loaded.scene, &name, represented));
    let scene = scene.with_context(in_scene)?;
    if scene.objects.is_empty() {
        bail!("{}: no triangle has an area that can be seen", in_scene());
    }
    let (viewpoints, orbit) = place(options, represented).with_context(in_scene)?;
    let [near, far] = orbit.distances;
    console.say(format_args!(
        "  views from {near:.6} m to {far:.6} m around {}",
        orbit.center
    ));
    let textures = console.stage("prepare textures", || Textures::new(&scene));
    let sampler = Sampler::new(&scene, &textures, &orbit);

    let welded = welded(&scene);
    let distances = orbit.sampled();
    let offsets = distances.viewpoints(&viewpoints);
    let seen = console.stage("sample", || match options.samples {
        SampleChoice::Adaptive => sampler.grown_sets(&offsets, &welded),
        SampleChoice::Even(_) | SampleChoice::Listed(_) => sampler.sets(&offsets),
    });
    let faces = Triangulation::new(&viewpoints, DVec3::ZERO)?;
    let parts = drawn::parts(&scene);
    let grouped = console.stage("group", || {
        let seen = face_sets(&faces, &distances.unite(&seen), Samples::Six);
        let centers = centers(&scene);
        let most = PatchSettings::default().most_primitives;
        Grouped::new(patches_in_parts(&centers, &faces, &seen, &parts, most))
    });
    let (faces, sets, missing) = match options.samples {
        SampleChoice::Adaptive => {
            let mut seen = Some(seen);
            let sample = |offsets: &[DVec3]| {
                // Of the first viewpoints it is known already.
                let seen = seen.take();
                seen.unwrap_or_else(|| sampler.grown_sets(offsets, &welded))
            };
            adaptive(&sampler, &grouped, &faces, sample, options, console)?
        }
        SampleChoice::Even(_) | SampleChoice::Listed(_) => {
            let sets = distances.unite(&seen);
            let sets = sets.iter().map(|set| grouped.holding(set)).collect();
            (faces, sets, Missing::Unknown)
        }
    };
    // As whoever reads the bundle computes them from what stands there.
    let faces = Triangulation::new(faces.directions(), DVec3::ZERO)?;
    let united = face_sets(&faces, &sets, Samples::Six);
    let most_ranges = PatchSettings::default().most_ranges;
    let lists = grouped
        .patches
        .ranges_in_parts(&united, &parts, most_ranges);
    let lookup = Lookup::new(faces, lists);
    let promise = match missing {
        Missing::Nothing => promise(options.held_back, None),
        Missing::Unknown => {
            let missed = console.stage("look", || {
                // Not those that were looked at before.
                sampler.missed(&lookup, &grouped, options.held_back, !options.seed)
            });
            promise(options.held_back, Some(percentile(&missed, MEASURED_SHARE)))
        }
    };

    let display = grouped.ordered(&scene);
    let lists = face_lists(&lookup, parts);
    let files = console.stage("encode", || encode(&display, &lists))?;
    loaded
        .warnings
        .iter()
        .for_each(|warning| console.warn(warning));
    let impostor = Impostor {
        name,
        side: None,
        represented,
        body: Body::Bitfields(body(&scene, &lookup)),
    };
    let manifest = manifest(
        options, &orbit, &loaded, exclude, promise, before, &display, &lookup, impostor, &dir,
    )?;
    console.stage("write", || farfield_bundle::write(&dir, &manifest, &files))?;
    summarise(&manifest, &lists, &files, console);
    console.say(format_args!("  bundle in {}", dir.display()));
    Ok(report(&manifest, &files, dir, start))
}

/// Directions that are sampled first, and from where pictures are taken.
fn place(options: &BitfieldsOptions, represented: [DVec3; 2]) -> Result<(Vec<DVec3>, Orbit)> {
    let orbit = |distances| {
        let fov = options.fov_degrees.to_radians();
        Orbit::new(represented, distances, fov, options.resolution)
    };
    match &options.samples {
        SampleChoice::Adaptive => Ok((samples::even(FIRST_VIEWPOINTS)?, orbit(options.distances)?)),
        SampleChoice::Even(count) => Ok((samples::even(*count)?, orbit(options.distances)?)),
        SampleChoice::Listed(path) => {
            let any = orbit(None)?;
            let listed = samples::listed(path)?;
            let least = NEAREST * any.radius;
            let (directions, range) = listed.directions(any.center, least)?;
            Ok((directions, orbit(options.distances.or(Some(range)))?))
        }
    }
}

/// What held-back views miss.
enum Missing {
    /// Nothing, as many in a row as was asked for.
    Nothing,
    Unknown,
}

/// Viewpoints and the patches that they see, until held-back views miss none, or there were too many.
fn adaptive(
    sampler: &Sampler<'_>,
    grouped: &Grouped,
    first: &Triangulation,
    mut sample: impl FnMut(&[DVec3]) -> Vec<Bitfield>,
    options: &BitfieldsOptions,
    console: &Console,
) -> Result<(Triangulation, Vec<Bitfield>, Missing)> {
    let settings = AdaptiveSettings {
        distances: sampler.orbit.sampled(),
        most_viewpoints: MOST_VIEWPOINTS,
        tolerated_pixels: 0,
        clean_views: options.held_back,
        most_views: options.held_back.saturating_mul(PATIENCE),
        seed: options.seed,
    };
    let sample = |offsets: &[DVec3]| {
        let sets = sample(offsets);
        sets.iter().map(|set| grouped.holding(set)).collect()
    };
    let mut looked = 0;
    let look = |offsets: &[DVec3]| {
        looked += offsets.len();
        sampler.pictures(grouped, offsets)
    };
    let adapted = console.stage("adapt", || {
        adapt(first.directions(), &settings, sample, look)
    })?;
    let Adapted {
        faces,
        sets,
        clean_views,
        rounds,
    } = adapted;
    let missing: u32 = rounds.iter().map(|round| round.missing_views).sum();
    console.say(format_args!(
        "  {} viewpoints; of {looked} views {missing} missed something, none of the last {clean_views}",
        sets.len()
    ));
    if clean_views == options.held_back {
        return Ok((faces, sets, Missing::Nothing));
    }
    console.warn(format_args!(
        "views did not stop to miss something: of the last {clean_views} none did, but --held-back asks \
         for {}; so what others miss is measured and promised, as with --samples",
        options.held_back
    ));
    Ok((faces, sets, Missing::Unknown))
}

/// Those for whom it is made.
const AIM: &str = "The camera looks at the centre of what is represented, from between the two \
    distances; who looks elsewhere from there sees the same triangles.";

/// What may be missed.
const MISSED: &str = "A pixel is missed where the triangle that it shows is not drawn. Blended surfaces \
    are drawn for every direction and hide nothing.";

/// What is promised, and how it was found: with adaptive samples that nothing is missed, with given ones
/// what was measured.
pub(crate) fn promise(held_back: u32, measured: Option<u64>) -> Promise {
    let found = match measured {
        None => format!(
            "Found by looking: {held_back} views in a row, held back from the samples, missed nothing. So \
             of all views less than {:.2} % miss something, with 95 % confidence.",
            // (1 - s)^n = 0.05
            (1.0 - 0.05f64.powf(1.0 / f64::from(held_back.max(1)))) * 100.0
        ),
        Some(_) => format!(
            "Measured: of {held_back} views, held back from the samples, {:.0} % missed no more. It is \
             promised of {:.0} % of all.",
            MEASURED_SHARE * 100.0,
            PROMISED_SHARE * 100.0
        ),
    };
    Promise {
        missed_pixels: Some(measured.unwrap_or(0)),
        missed_share: measured.map(|_| PROMISED_SHARE),
        notes: vec![AIM.into(), MISSED.into(), found],
        ..Promise::default()
    }
}

/// Three vertices of each triangle, the same one where they are in the same place: files double them where
/// normals or texture coordinates differ.
fn welded(scene: &Scene) -> Vec<[u32; 3]> {
    let bits = |vertex: &u32| {
        scene.positions[*vertex as usize]
            .to_array()
            .map(f32::to_bits)
    };
    let mut sorted: Vec<u32> = (0..scene.positions.len() as u32).collect();
    sorted.sort_unstable_by_key(bits);
    let mut first = vec![0; sorted.len()];
    for same in sorted.chunk_by(|a, b| bits(a) == bits(b)) {
        same.iter()
            .for_each(|vertex| first[*vertex as usize] = same[0]);
    }
    let triangles = scene.triangles.iter();
    triangles
        .map(|t| t.map(|vertex| first[vertex as usize]))
        .collect()
}

fn centers(scene: &Scene) -> Vec<Vec3> {
    let center = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| scene.positions[v as usize]);
        (a + b + c) / 3.0
    };
    scene.triangles.iter().map(center).collect()
}

fn face_lists(lookup: &Lookup, parts: Vec<u32>) -> FaceLists {
    let faces = (0..).zip(lookup.faces().faces());
    let faces = faces.map(|(index, face)| FaceRecord {
        corners: face.corners,
        draw: (lookup.lists().of(index).iter())
            .map(|range| [range.start, range.end])
            .collect(),
    });
    FaceLists {
        format: FACES_FORMAT.into(),
        version: FACES_VERSION,
        viewpoints: lookup.faces().directions().to_vec(),
        parts,
        faces: faces.collect(),
    }
}

fn body(scene: &Scene, lookup: &Lookup) -> BitfieldsBody {
    let (faces, lists) = (lookup.faces(), lookup.lists());
    let most = (0..lists.faces()).map(|face| lists.of(face).len()).max();
    let always = drawn::blended(scene);
    BitfieldsBody {
        triangles: scene.triangles.len() as u64,
        always_drawn: always.iter().map(|range| range.len() as u64).sum(),
        viewpoints: faces.directions().len() as u32,
        faces: lists.faces(),
        ranges: lists.ranges.len() as u64,
        most_ranges: most.unwrap_or(0) as u32,
        culled: culled_share(lists, scene.triangles.len() as u32),
    }
}

/// The glTF file, the images that it shows, and the lists.
fn encode(display: &Scene, lists: &FaceLists) -> Result<Vec<NewFile>> {
    let uri = |i: usize| format!("textures/{i:03}.png");
    let uris: Vec<String> = (0..display.images.len()).map(uri).collect();
    let glb = NewFile {
        path: GLTF_FILE.into(),
        bytes: glb_from_scene(display, &uris)?,
    };
    let lists = NewFile {
        path: FACES_FILE.into(),
        bytes: lists.to_json().into_bytes(),
    };
    let images = display.images.par_iter().zip(uris);
    let images = images.map(|(image, path)| NewFile {
        path,
        bytes: encode_png(image),
    });
    let mut files: Vec<NewFile> = images.collect();
    files.extend([glb, lists]);
    Ok(files)
}

/// What drawing one face takes on average.
pub(crate) fn cost_of_a_face(display: &Scene, lists: &FaceRanges) -> Cost {
    let faces = u64::from(lists.faces()).max(1);
    let drawn: u64 = (0..lists.faces())
        .map(|face| u64::from(lists.primitives_of(face)))
        .sum();
    Cost {
        triangles: drawn.div_ceil(faces),
        draw_calls: (lists.ranges.len() as u64).div_ceil(faces),
        ..farfield_bundle::cost(display)
    }
}

#[expect(
    clippy::too_many_arguments,
    reason = "all that is known of a bake ends up here"
)]
fn manifest(
    options: &BitfieldsOptions,
    orbit: &Orbit,
    loaded: &Loaded,
    exclude: Vec<String>,
    promise: Promise,
    before: Cost,
    display: &Scene,
    lookup: &Lookup,
    impostor: Impostor,
    dir: &std::path::Path,
) -> Result<Manifest> {
    Ok(Manifest {
        format: FORMAT.into(),
        version: VERSION,
        generator: crate::generator(),
        technique: Technique::Bitfields {
            samples: match options.samples {
                SampleChoice::Adaptive => farfield_bundle::Samples::Adaptive,
                SampleChoice::Even(_) => farfield_bundle::Samples::Even,
                SampleChoice::Listed(_) => farfield_bundle::Samples::Listed,
            },
            held_back: options.held_back,
            patch_triangles: PatchSettings::default().most_primitives,
            finer: FINER,
        },
        options: Options {
            resolution: options.resolution,
            fov_degrees: options.fov_degrees,
            view_space: orbit.space(),
            exclude,
        },
        scene: source::record(&options.scene, &loaded.sha256, dir)?,
        promise,
        statistics: Statistics {
            before,
            after: cost_of_a_face(display, lookup.lists()),
            ..Statistics::default()
        },
        warnings: loaded.warnings.clone(),
        impostors: vec![impostor],
        files: Vec::new(),
        sha256: String::new(),
    })
}

fn body_of(manifest: &Manifest) -> &BitfieldsBody {
    match &manifest.impostors[0].body {
        Body::Bitfields(body) => body,
        Body::Layered(_) | Body::Tdm(_) => unreachable!("it was just made"),
    }
}

fn bytes_of(files: &[NewFile], path: &str) -> u64 {
    let named = files.iter().find(|file| file.path == path);
    named.map_or(0, |file| file.bytes.len() as u64)
}

fn summarise(manifest: &Manifest, lists: &FaceLists, files: &[NewFile], console: &Console) {
    let (body, promise) = (body_of(manifest), &manifest.promise);
    let Statistics { before, after, .. } = &manifest.statistics;
    super::say_cost(before, after, "a face, mean", console);
    let drawn = (0..body.faces).map(|face| lists.drawn(face));
    console.say(format_args!(
        "\n  {:.1} % of the triangles culled, mean over {} faces between {} viewpoints; at most {} drawn, \
         in {} ranges; lists of {} bytes",
        body.culled * 100.0,
        body.faces,
        body.viewpoints,
        drawn.max().unwrap_or(0),
        body.most_ranges,
        bytes_of(files, FACES_FILE)
    ));
    console.say(format_args!(
        "  promised: at most {} missed pixels in {}",
        promise.missed_pixels.unwrap_or(0),
        match promise.missed_share {
            None => "any view".into(),
            Some(share) => format!("{:.0} % of the views", share * 100.0),
        }
    ));
}

fn report(manifest: &Manifest, files: &[NewFile], dir: PathBuf, start: Instant) -> BakeReport {
    let (body, after) = (body_of(manifest), &manifest.statistics.after);
    BakeReport {
        bundle: dir,
        technique: manifest.technique.name(),
        device: Device::cpu().name().into(),
        seconds: start.elapsed().as_secs_f64(),
        triangles_in: manifest.statistics.before.triangles,
        triangles_out: after.triangles,
        layers: 0,
        quads: 0,
        draw_calls: after.draw_calls,
        atlas_bytes: after.texture_bytes,
        geometry_bytes: after.geometry_bytes,
        initial_triangles: 0,
        texels_recorded: 0,
        texels_kept: 0,
        bitfields: Some(BitfieldsReport {
            viewpoints: body.viewpoints,
            faces: body.faces,
            ranges: body.ranges,
            most_ranges: body.most_ranges,
            culled: body.culled,
            always_drawn: body.always_drawn,
            list_bytes: bytes_of(files, FACES_FILE),
            missed_pixels: manifest.promise.missed_pixels.unwrap_or(0),
            missed_share: manifest.promise.missed_share.unwrap_or(1.0),
        }),
        peak_rss_bytes: peak_rss_bytes(),
        impostors: vec![ImpostorReport {
            name: manifest.impostors[0].name.clone(),
            layers: 0,
            quads: 0,
        }],
    }
}
