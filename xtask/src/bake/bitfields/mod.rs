//! ID-bitfields: number, sample, group, list
//! (O. Meruvia Pastor and T. Strothotte, Approximated View Reconstruction Using Precomputed
//! ID-Bitfields; patches, adaptive samples and view cells go beyond it).

mod around;
mod grouped;
mod inside;
mod sampler;
mod samples;
mod solids;

use super::{BakeReport, BitfieldsReport, ImpostorReport};
use crate::chance::{IMPROBABLE, sure_share};
use crate::console::{Console, peak_rss_bytes};
use crate::device::Device;
use crate::drawn::{self, flattened};
use crate::inside::Inside;
use crate::orbit::FINER;
use crate::outliers;
use crate::source::{self, Loaded, SceneChoice};
use crate::view_cell::represented_box;
use anyhow::{Context, Result, bail};
pub(crate) use around::sets;
use farfield_bitfields::{FaceRanges, PatchSettings, culled_share};
use farfield_bundle::{
    BitfieldsBody, Body, Cost, FORMAT, GLTF_FILE, Impostor, LISTS_MOST_BYTES, Manifest, NewFile,
    Options, Promise, Samples, Statistics, Technique, VERSION, ViewSpace, encode_png,
    glb_from_scene,
};
use farfield_scene::Scene;
use glam::{DVec3, Vec3};
use grouped::Grouped;
use rayon::prelude::*;
pub(crate) use sampler::{Sampler, is_in, percentile};
pub use samples::SampleChoice;
use std::ops::Range;
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
    /// Where the viewer is.
    pub seen_from: SeenFrom,
    /// Views, held back from the samples, that these are judged by: adaptive ones must miss nothing in
    /// so many one after another. By default [`HELD_BACK`] or [`HELD_BACK_INSIDE`].
    pub held_back: Option<u32>,
    /// Pixels that one of these views may miss and still not call for more, of adaptive samples.
    pub tolerated_pixels: u64,
    /// Whether what a sample sees is taken to be seen together with the triangles that share a vertex with
    /// it and face the sample; by default with adaptive samples around the scene, and else not.
    pub neighbors: Option<bool>,
    /// Moves the views that are held back, by all but its first two bits.
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
            seen_from: SeenFrom::Around {
                distances: None,
                samples: SampleChoice::Adaptive,
            },
            held_back: None,
            tolerated_pixels: 0,
            neighbors: None,
            seed: 0,
            out: None,
        }
    }
}

/// Where the viewer of ID-bitfields is.
#[derive(Clone, Debug, PartialEq)]
pub enum SeenFrom {
    /// All around the scene, in any direction.
    Around {
        /// Least and greatest distance from the centre of the scene's box, in metres; where they are not
        /// given, those of listed viewpoints, or else from where the scene fits into the picture to four
        /// times as far.
        distances: Option<[f64; 2]>,
        /// From where the bake looks.
        samples: SampleChoice,
    },
    /// In a box, looking anywhere.
    Inside {
        /// Its centre.
        center: DVec3,
        /// Full lengths of its sides, in metres.
        size: DVec3,
        /// Into how many view cells it is cut along x, y and z.
        cells: [u32; 3],
    },
}

/// Views from around that must miss nothing unless asked otherwise.
pub const HELD_BACK: u32 = 3000;

/// Views from each cell of a box that must miss nothing unless asked otherwise: each is six pictures, and as
/// long as some miss something, four times as many are looked at. After so many clean ones 97 % of all are
/// with 95 % confidence; of 299, for 99 %, a bake takes more than twice as long as of 50, and of 100 it does
/// not.
pub const HELD_BACK_INSIDE: u32 = 100;

impl BitfieldsOptions {
    fn held_back(&self) -> u32 {
        self.held_back.unwrap_or(match self.seen_from {
            SeenFrom::Around { .. } => HELD_BACK,
            SeenFrom::Inside { .. } => HELD_BACK_INSIDE,
        })
    }
}

/// So many views tell what is promised, or more: with fewer a share would be promised that nobody can rely on.
/// A thousand tell of 99.7 % if all of them are clean.
const JUDGING: u32 = 1000;
impl BitfieldsOptions {
    fn adds_neighbors(&self) -> bool {
        let is_adaptive = matches!(
            self.seen_from,
            SeenFrom::Around {
                samples: SampleChoice::Adaptive,
                ..
            }
        );
        self.neighbors.unwrap_or(is_adaptive)
    }
}

/// The least share of all views of which it is promised that none misses anything. Where that cannot be, a
/// bundle promises of so large a share that none misses more than it says: what so large a share of those
/// that the bake looked at did not. The difference is for chance.
const PROMISED_SHARE: f64 = 0.95;
const MEASURED_SHARE: f64 = 0.99;

/// What is drawn of a scene.
struct Made {
    /// Triangles in the order of the file.
    grouped: Grouped,
    /// Of each face or cell.
    lists: FaceRanges,
    /// The same as a file.
    file: NewFile,
    /// Viewpoints that were sampled.
    viewpoints: u32,
    samples: Samples,
    /// Whether neighbours of what these saw were added.
    neighbors: bool,
    space: ViewSpace,
    /// How many pixels each of [`JUDGING`] views or more misses that nothing was learnt from, ascending.
    missed: Vec<u64>,
    /// What was told of the samples.
    warning: Option<String>,
}

/// Bakes a scene into ID-bitfields: a bundle that draws, for each direction or from each view cell, what
/// of the original geometry can be seen.
///
/// # Errors
///
/// When the scene cannot be read, samples, distances or cells do not suit it, or the bundle cannot be
/// written. Then nothing is left behind.
pub fn bake_bitfields(options: &BitfieldsOptions, console: &Console) -> Result<BakeReport> {
    let start = Instant::now();
    let name = options.scene.name();
    let dir = options.out.clone();
    let dir = dir.unwrap_or_else(|| format!("target/farfield/{name}-bitfields").into());
    farfield_bundle::require_replaceable(&dir)?;
    let in_scene = || options.scene.to_string();

    let mut loaded = console.stage("read", || source::load(&options.scene, &options.exclude))?;
    let mut exclude = options.exclude.clone();
    if let SeenFrom::Around {
        distances: None, ..
    } = options.seen_from
    {
        exclude.extend(outliers::leave_out(&mut loaded.scene, &mut loaded.warnings));
    }
    let represented = represented_box(&loaded.scene).with_context(in_scene)?;
    let before = farfield_bundle::cost(&loaded.scene);
    let scene = console.stage("number", || flattened(&loaded.scene, &name, represented));
    let scene = scene.with_context(in_scene)?;
    if scene.objects.is_empty() {
        bail!("{}: no triangle has an area that can be seen", in_scene());
    }
    let seeded = BitfieldsOptions {
        seed: salted(options.seed),
        ..options.clone()
    };
    let made = match &options.seen_from {
        SeenFrom::Around { distances, samples } => {
            around::made(&scene, represented, samples, *distances, &seeded, console)?
        }
        &SeenFrom::Inside {
            center,
            size,
            cells,
        } => {
            let fov = options.fov_degrees.to_radians();
            let inside = Inside::new([center, size], cells, fov, options.resolution)?;
            inside::made(&scene, represented, &inside, &seeded, console).with_context(in_scene)?
        }
    };
    let promise = promise(&made.space, &made.missed);
    loaded.warnings.extend(warning_of_many(options, &promise));

    let display = made.grouped.ordered(&scene);
    let files = console.stage("encode", || encode(&display, &made.file))?;
    loaded
        .warnings
        .iter()
        .for_each(|warning| console.warn(warning));
    loaded.warnings.extend(made.warning.clone());
    let impostor = Impostor {
        name,
        side: None,
        represented,
        body: Body::Bitfields(body(&scene, &made)),
    };
    let manifest = manifest(
        options, &loaded, exclude, &made, promise, before, &display, impostor, &dir,
    )?;
    console.stage("write", || farfield_bundle::write(&dir, &manifest, &files))?;
    summarise(&manifest, &made, console);
    console.say(format_args!("  bundle in {}", dir.display()));
    Ok(report(&manifest, &made, dir, start))
}

/// The seed of the views that a bake learns from; of those that tell what it promises it is the complement.
/// Whatever the user's, neither is that of `verify`, whose first two bits are alike: here they differ.
fn salted(seed: u64) -> u64 {
    1 << 63 | seed & (u64::MAX >> 2)
}

/// What views must not miss that are held back from adaptive samples.
fn too_much(options: &BitfieldsOptions) -> String {
    match options.tolerated_pixels {
        0 => "something".into(),
        tolerated => format!("more than {tolerated} pixels"),
    }
}

/// Says that adaptive samples were given up.
///
/// * `missing` - how many views missed something
fn warn_of_misses(missing: impl std::fmt::Display, held_back: u32, console: &Console) {
    console.warn(format_args!(
        "views did not stop to miss something: {missing} did, and --held-back asks for {held_back} in a row \
         that do not; what others miss is promised, as with --samples"
    ));
}

/// What to do where so much may be missed that it shows: more than a hundredth of a picture.
fn warning_of_many(options: &BitfieldsOptions, promise: &Promise) -> Option<String> {
    let missed = promise.missed_pixels.unwrap_or(0);
    let remedy = match &options.seen_from {
        SeenFrom::Around { samples, .. } => match samples {
            SampleChoice::Adaptive => "ask for more clean views with --held-back",
            SampleChoice::Even(_) | SampleChoice::Listed(_) => {
                "name more viewpoints with --samples, or leave it out, so that they are added where \
                 something is missed"
            }
        },
        SeenFrom::Inside { .. } => {
            "ask for more clean views with --held-back, or cut the view cell into more with --cells"
        }
    };
    let is_many = 100 * missed > u64::from(options.resolution).pow(2);
    is_many.then(|| {
        format!("{missed} missed pixels are promised, more than 1 % of the picture: {remedy}")
    })
}

/// How many pixels each of some views misses, ascending.
fn misses(views: u32, missed: impl Fn(u64) -> u64 + Send + Sync) -> Vec<u64> {
    let mut all: Vec<u64> = (0..u64::from(views)).into_par_iter().map(missed).collect();
    all.sort_unstable();
    all
}

/// Ranges as they stand in files.
fn listed_ranges(ranges: &[Range<u32>]) -> Vec<[u32; 2]> {
    ranges
        .iter()
        .map(|range| [range.start, range.end])
        .collect()
}

/// A file of lists.
///
/// * `remedy` - for one that is too large
///
/// # Errors
///
/// When it is, so that nobody would read it.
fn list_file(name: &str, text: String, remedy: &str) -> Result<NewFile> {
    let bytes = text.len() as u64;
    if bytes > LISTS_MOST_BYTES {
        bail!("{name} would have {bytes} bytes, more than {LISTS_MOST_BYTES}: {remedy}");
    }
    Ok(NewFile {
        path: name.into(),
        bytes: text.into_bytes(),
    })
}

/// Those for whom it is made.
const AIM: &str = "The camera looks at the centre of what is represented, from between the two \
    distances; who looks elsewhere from there sees the same triangles.";
const ANYWHERE: &str = "The camera looks anywhere, from the view cell; inside of what is solid it sees \
    what it can.";

/// What all views are of which a share is promised.
const ALL_AROUND: &str = "All views are those in all directions alike, from distances whose reciprocals are \
    spread evenly between the two.";
const ALL_WITHIN: &str = "All views are those in all directions alike, 19 of 27 from faces, edges and corners \
    of the view cell, and the others from anywhere within.";

/// What may be missed.
const MISSED: &str = "A pixel is missed where the triangle that it shows is not drawn. Blended surfaces \
    are drawn for every direction and hide nothing.";

/// What is promised, and how it was found: by looking from views that nothing was learnt from.
///
/// * `missed` - pixels that each of them misses, ascending
///
/// # Panics
///
/// When these are fewer than [`JUDGING`].
pub(crate) fn promise(space: &ViewSpace, missed: &[u64]) -> Promise {
    let count = missed.len();
    assert!(count >= JUDGING as usize, "{count} views are too few");
    let missing = count - missed.partition_point(|pixels| *pixels == 0);
    let clean = sure_share(count as u64, missing as u64);
    let (most, share, found) = if clean >= PROMISED_SHARE {
        let found = match missing {
            0 => "none missed any pixel".into(),
            some => format!("{some} missed any pixel, the worst {}", missed[count - 1]),
        };
        (0, clean, found)
    } else {
        (
            percentile(missed, MEASURED_SHARE),
            PROMISED_SHARE,
            format!("{} missed no more", percent(MEASURED_SHARE)),
        )
    };
    let found = format!(
        "Found by looking: of {count} views that the bake learnt nothing from, {found}. It is promised of {} \
         of all, which holds with {} confidence.",
        percent(share),
        percent(1.0 - IMPROBABLE)
    );
    let [aim, all] = match space {
        ViewSpace::Inside { .. } => [ANYWHERE, ALL_WITHIN],
        _ => [AIM, ALL_AROUND],
    };
    Promise {
        missed_pixels: Some(most),
        missed_share: Some(share),
        notes: vec![aim.into(), MISSED.into(), found, all.into()],
        ..Promise::default()
    }
}

/// A share for people, such as 95 % or 99.9 %.
pub(crate) fn percent(share: f64) -> String {
    let digits = format!("{:.2}", share * 100.0);
    format!("{} %", digits.trim_end_matches('0').trim_end_matches('.'))
}

fn centers(scene: &Scene) -> Vec<Vec3> {
    let center = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| scene.positions[v as usize]);
        (a + b + c) / 3.0
    };
    scene.triangles.iter().map(center).collect()
}

/// The triangles of a scene of one object, which share vertices wherever they touch.
fn welded(scene: &Scene) -> Vec<[u32; 3]> {
    let positions: Vec<DVec3> = scene.positions.iter().map(|p| p.as_dvec3()).collect();
    farfield_bitfields::welded(&positions, &scene.triangles)
}

fn body(scene: &Scene, made: &Made) -> BitfieldsBody {
    let lists = &made.lists;
    let most = (0..lists.count()).map(|list| lists.of(list).len()).max();
    let always = drawn::blended(scene);
    BitfieldsBody {
        triangles: scene.triangles.len() as u64,
        always_drawn: always.iter().map(|range| range.len() as u64).sum(),
        viewpoints: made.viewpoints,
        lists: lists.count(),
        ranges: lists.ranges.len() as u64,
        most_ranges: most.unwrap_or(0) as u32,
        culled: culled_share(lists, scene.triangles.len() as u32),
    }
}

/// The glTF file, the images that it shows, and the lists.
fn encode(display: &Scene, lists: &NewFile) -> Result<Vec<NewFile>> {
    let uri = |i: usize| format!("textures/{i:03}.png");
    let uris: Vec<String> = (0..display.images.len()).map(uri).collect();
    let glb = NewFile {
        path: GLTF_FILE.into(),
        bytes: glb_from_scene(display, &uris)?,
    };
    let images = display.images.par_iter().zip(uris);
    let images = images.map(|(image, path)| NewFile {
        path,
        bytes: encode_png(image),
    });
    let mut files: Vec<NewFile> = images.collect();
    files.extend([glb, lists.clone()]);
    Ok(files)
}

/// What drawing one list takes on average.
pub(crate) fn cost_of_a_list(display: &Scene, lists: &FaceRanges) -> Cost {
    let faces = u64::from(lists.count()).max(1);
    let drawn: u64 = (0..lists.count())
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
    loaded: &Loaded,
    exclude: Vec<String>,
    made: &Made,
    promise: Promise,
    before: Cost,
    display: &Scene,
    impostor: Impostor,
    dir: &std::path::Path,
) -> Result<Manifest> {
    let held_back = options.held_back();
    Ok(Manifest {
        format: FORMAT.into(),
        version: VERSION,
        generator: crate::generator(),
        technique: Technique::Bitfields {
            samples: made.samples,
            held_back,
            tolerated_pixels: options.tolerated_pixels,
            seed: options.seed,
            patch_triangles: PatchSettings::default().most_primitives,
            finer: FINER,
            neighbors: Some(made.neighbors),
        },
        options: Options {
            resolution: options.resolution,
            fov_degrees: options.fov_degrees,
            view_space: made.space.clone(),
            exclude,
        },
        scene: source::record(&options.scene, &loaded.sha256, dir)?,
        promise,
        statistics: Statistics {
            before,
            after: cost_of_a_list(display, &made.lists),
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

/// What lists are of, one and several.
pub(crate) fn owners(space: &ViewSpace) -> [&'static str; 2] {
    match space {
        ViewSpace::Inside { .. } => ["cell", "cells"],
        _ => ["face", "faces"],
    }
}

fn summarise(manifest: &Manifest, made: &Made, console: &Console) {
    let (body, promise) = (body_of(manifest), &manifest.promise);
    let Statistics { before, after, .. } = &manifest.statistics;
    let [one, several] = owners(&made.space);
    super::say_cost(before, after, &format!("a {one}, mean"), console);
    let drawn = (0..body.lists).map(|list| made.lists.primitives_of(list));
    console.say(format_args!(
        "\n  {:.1} % of the triangles culled, mean over {} {several}, from {} viewpoints; at most {} drawn, \
         in {} ranges; lists of {} bytes",
        body.culled * 100.0,
        body.lists,
        body.viewpoints,
        drawn.max().unwrap_or(0),
        body.most_ranges,
        made.file.bytes.len()
    ));
    console.say(format_args!(
        "  promised: at most {} missed pixels in {} of the views",
        promise.missed_pixels.unwrap_or(0),
        percent(promise.missed_share.unwrap_or(1.0))
    ));
}

fn report(manifest: &Manifest, made: &Made, dir: PathBuf, start: Instant) -> BakeReport {
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
            lists: body.lists,
            ranges: body.ranges,
            most_ranges: body.most_ranges,
            culled: body.culled,
            always_drawn: body.always_drawn,
            list_bytes: made.file.bytes.len() as u64,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn promised(missed: &[u64]) -> (u64, f64) {
        let space = ViewSpace::Shell {
            center: DVec3::ZERO,
            near: 2.0,
            far: 8.0,
        };
        let promise = promise(&space, missed);
        let [.., found, _] = &promise.notes[..] else {
            panic!("it is not told how that was found");
        };
        assert!(
            found.contains(&format!("of {} views", missed.len())),
            "{found}"
        );
        (
            promise.missed_pixels.expect("so many are promised"),
            promise.missed_share.expect("of a share"),
        )
    }

    /// No more is promised than so many views can tell: of a thousand clean ones not that all are.
    #[test]
    fn no_more_is_promised_than_views_can_tell() {
        assert_eq!(promised(&[0; 3000]), (0, 0.999));
        assert_eq!(promised(&[0; 1000]), (0, 0.997));
        let few = |missing: usize| [vec![0; 1000 - missing], vec![7; missing]].concat();
        assert_eq!(promised(&few(1)), (0, 0.9952));
        assert_eq!(promised(&few(38)), (0, 0.9504));
        // One of a hundred misses more.
        assert_eq!(promised(&few(39)), (7, 0.95));
        let many: Vec<u64> = (0..1000).collect();
        assert_eq!(promised(&many), (989, 0.95));
        assert_eq!([0.95, 0.999, 1.0].map(percent), ["95 %", "99.9 %", "100 %"]);
    }

    /// More than a hundredth of the picture is warned of, with what helps.
    #[test]
    fn many_missed_pixels_are_warned_of() {
        let scene = SceneChoice::BuiltIn(crate::built_in::BuiltIn::House);
        let warning = |missed, seen_from| {
            let options = BitfieldsOptions {
                resolution: 100,
                seen_from,
                ..BitfieldsOptions::new(scene.clone())
            };
            let promise = Promise {
                missed_pixels: Some(missed),
                ..Promise::default()
            };
            warning_of_many(&options, &promise)
        };
        let around = |samples| SeenFrom::Around {
            distances: None,
            samples,
        };
        let inside = SeenFrom::Inside {
            center: DVec3::ZERO,
            size: DVec3::ONE,
            cells: [1; 3],
        };
        for (seen_from, remedy) in [
            (around(SampleChoice::Adaptive), "--held-back"),
            (around(SampleChoice::Even(4)), "--samples"),
            (inside, "--cells"),
        ] {
            assert_eq!(warning(100, seen_from.clone()), None);
            let told = warning(101, seen_from).expect("it is warned");
            assert!(
                told.starts_with("101 missed pixels") && told.contains(remedy),
                "{told}"
            );
        }
    }

    /// No seed lets a bake learn from the views that `verify` takes, or from those that judge it, nor takes
    /// these for each other; and usual seeds are not taken for each other.
    #[test]
    fn seeds_of_views_are_apart() {
        use crate::viewpoints::SEED;
        for seed in [0, 1, SEED, !SEED, SEED | 1 << 63, !SEED | 1 << 63, u64::MAX] {
            let [learnt, judging] = [salted(seed), !salted(seed)];
            assert!(
                learnt != SEED && judging != SEED && learnt != judging,
                "{seed:x}"
            );
            assert!((0..7).all(|other| salted(other) != judging), "{seed:x}");
        }
        assert!(salted(0) != salted(1) && salted(SEED) != salted(!SEED));
    }

    /// What readers refuse is not written, and the message says what to do.
    #[test]
    fn lists_that_nobody_reads_are_refused() {
        let most = LISTS_MOST_BYTES as usize;
        assert!(list_file("cells.json", " ".repeat(most), "do less").is_ok());
        let error = list_file("cells.json", " ".repeat(most + 1), "do less").unwrap_err();
        assert!(error.to_string().ends_with("do less"), "{error}");
    }
}
