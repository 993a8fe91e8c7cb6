//! From a scene to a bundle.

pub mod auto;
pub(crate) mod bitfields;
pub(crate) mod channels;
mod layered;
mod limits;
mod painter;
pub mod recording;
mod sights;
mod tdm;
pub mod voxelize;

use crate::console::{Console, peak_rss_bytes};
use crate::device::Device;
use crate::dump;
use crate::outliers;
use crate::parts::{self, Part};
use crate::source::{self, SceneChoice};
use crate::view_cell::{SMALLEST_TEXEL, ViewCellSpec};
use crate::view_space;
use anyhow::{Context, Result, anyhow, bail};
pub use bitfields::{
    BitfieldsOptions, HELD_BACK, HELD_BACK_INSIDE, SampleChoice, SeenFrom, bake_bitfields,
};
pub(crate) use bitfields::{Sampler, cost_of_a_list, is_in, owners, percent, percentile, sets};
use farfield_bundle::{
    Body, Channels, Cost, FORMAT, GLTF_FILE, Impostor, Manifest, NewFile, Options, Promise,
    Statistics, TdmBody, Technique, VERSION, ViewSpace, encode_png, glb_from_scene,
};
use farfield_layers::{Aim, PromisedCamera};
use farfield_sampling::{Foliage, Textures};
use farfield_scene::{AlphaMode, Scene};
pub(crate) use layered::shown_from;
pub use limits::Limits;
use rayon::prelude::*;
use recording::Settings;
use std::path::PathBuf;
use std::time::Instant;

/// How impostors are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Making {
    /// As textured quads on parallel layers.
    Layered {
        /// What a quad is worth, in bytes.
        bytes_per_quad: f64,
    },
    /// As textured depth meshes.
    Tdm {
        /// Side of a voxel when it is asked whether the mesh touches it, in voxels, from 1 to 2.
        enlarged: f64,
    },
}

impl Making {
    /// The technique, as it stands in the names of folders.
    fn name(self) -> &'static str {
        match self {
            Self::Layered { .. } => "layered",
            Self::Tdm { .. } => "tdm",
        }
    }
}

/// How viewers and what they see lie to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// The viewers are before the scene: one impostor.
    Before,
    /// The viewers are amid the scene: what lies at this distance from the view cell or beyond, in
    /// metres, in up to six impostors round it.
    Far(f64),
    /// The viewers are anywhere around the scene, at least this far from its centre, in metres; where
    /// it is not given, eight times the diagonal of the scene's box: up to six impostors of all.
    Around(Option<f64>),
}

/// What to bake, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// What.
    pub scene: SceneChoice,
    /// Where the viewer may be; by default before the scene. Amid a scene a box must be given, around
    /// it none may.
    pub view_cell: Option<ViewCellSpec>,
    /// From where the scene is seen.
    pub arrangement: Arrangement,
    /// Pixels along each side of the viewer's picture.
    pub resolution: u32,
    /// The viewer's field of view, in degrees.
    pub fov_degrees: f64,
    /// Names of objects to leave out.
    pub exclude: Vec<String>,
    /// How impostors are made.
    pub making: Making,
    /// The other technique, for what is predicted to cost less that way, or cannot be made as asked for
    /// or not within the limits.
    pub alternative: Option<Making>,
    /// What they may cost: larger quads or voxels than asked for are tried to stay within it.
    pub limits: Limits,
    /// Longest side of an atlas page, in texels.
    pub page_size: u32,
    /// How masked materials are recorded.
    pub foliage: Foliage,
    /// What the pages hold.
    pub channels: Channels,
    /// The bundle's folder; by default `target/farfield/<scene>-<technique>`, or `<scene>-auto` where
    /// there is an alternative.
    pub out: Option<PathBuf>,
    /// Where the recorded layers, and what was made of them, are written for people to look at; nowhere
    /// unless asked for.
    pub dump: Option<PathBuf>,
}

impl BakeOptions {
    /// What the command line takes for a scene if nothing else is asked for.
    pub fn new(scene: SceneChoice) -> Self {
        Self {
            scene,
            view_cell: None,
            arrangement: Arrangement::Before,
            resolution: 512,
            fov_degrees: 45.0,
            exclude: Vec::new(),
            making: Making::Layered {
                bytes_per_quad: 104.0,
            },
            alternative: None,
            limits: Limits::default(),
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
            out: None,
            dump: None,
        }
    }
}

/// What a bake made; field names are a published contract.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct BakeReport {
    /// The bundle's folder.
    pub bundle: PathBuf,
    /// Name of the technique.
    pub technique: &'static str,
    /// The GPU that helped to record layers; "cpu" where none helped with any. The bundle does not depend
    /// on it.
    pub device: String,
    /// From start to end.
    pub seconds: f64,
    /// Triangles of the original.
    pub triangles_in: u64,
    /// Triangles of the impostors; of ID-bitfields those drawn for a face, on average.
    pub triangles_out: u64,
    /// Layers of all impostors.
    pub layers: u64,
    /// Quads of all impostors.
    pub quads: u64,
    /// Draw calls of the impostors; of ID-bitfields those of a face, on average.
    pub draw_calls: u64,
    /// Uncompressed RGBA pages.
    pub atlas_bytes: u64,
    /// Vertices and indices of the impostors.
    pub geometry_bytes: u64,
    /// Triangles of the meshes before they were simplified; 0 where there are none.
    pub initial_triangles: u64,
    /// Opaque texels recorded, in all layers.
    pub texels_recorded: u64,
    /// Opaque texels that the view cell can see.
    pub texels_kept: u64,
    /// Of ID-bitfields; null where there are none.
    pub bitfields: Option<BitfieldsReport>,
    /// The most memory needed at any time; 0 where the system does not tell.
    pub peak_rss_bytes: u64,
    /// One by one.
    pub impostors: Vec<ImpostorReport>,
}

/// What a bake made of ID-bitfields.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BitfieldsReport {
    /// From where samples were taken: directions, or points in all cells together.
    pub viewpoints: u32,
    /// Lists: one for each face between directions, or for each cell.
    pub lists: u32,
    /// Ranges of all lists together.
    pub ranges: u64,
    /// Ranges of the list that has most.
    pub most_ranges: u32,
    /// Mean share of the triangles that a list leaves out.
    pub culled: f64,
    /// Triangles of blended materials, which are in all lists.
    pub always_drawn: u64,
    /// The file of the lists.
    pub list_bytes: u64,
    /// Promised of a share of all pictures: that they miss no more pixels.
    pub missed_pixels: u64,
    /// That share.
    pub missed_share: f64,
}

/// One impostor of a bake.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ImpostorReport {
    /// As in the bundle.
    pub name: String,
    /// Its layers.
    pub layers: u64,
    /// Its quads.
    pub quads: u64,
}

/// An impostor: its description and what is displayed.
#[derive(Clone, Debug, PartialEq)]
struct Baked {
    impostor: Impostor,
    display: Scene,
    /// The least side of a texel seen from anywhere in the view cell, in pixels.
    smallest_texel: f64,
}

/// Bakes a scene into a bundle.
///
/// # Errors
///
/// When the scene cannot be read, the view cell does not suit it, or the bundle cannot be written.
/// Then nothing is left behind.
pub fn bake(options: &BakeOptions, console: &Console) -> Result<BakeReport> {
    bake_on(options, &Device::cpu(), console)
}

/// Bakes a scene into a bundle, which is the same on whatever device its layers are recorded.
///
/// # Errors
///
/// As for [`bake`]; not when a GPU fails, as the CPU goes on then.
pub fn bake_on(options: &BakeOptions, device: &Device, console: &Console) -> Result<BakeReport> {
    let start = Instant::now();
    let name = options.scene.name();
    let dir = options.out.clone().unwrap_or_else(|| {
        let technique = match options.alternative {
            Some(_) => "auto",
            None => options.making.name(),
        };
        format!("target/farfield/{name}-{technique}").into()
    });
    farfield_bundle::require_replaceable(&dir)?;
    if let Some(dump) = &options.dump {
        dump::require_place(dump, &dir)?;
    }

    let mut loaded = console.stage("read", || source::load(&options.scene, &options.exclude))?;
    let mut exclude = options.exclude.clone();
    if options.view_cell.is_none() {
        exclude.extend(outliers::leave_out(&mut loaded.scene, &mut loaded.warnings));
    }
    let in_scene = || options.scene.to_string();
    let lens = PromisedCamera {
        aim: Aim::Center,
        fov: options.fov_degrees.to_radians(),
        resolution: options.resolution,
    };
    let space = view_space::resolve(options, &mut loaded.scene, &lens, &mut loaded.warnings);
    let space = space.with_context(in_scene)?;
    channels::prepare(&mut loaded.scene, options.channels);
    let scene = &loaded.scene;
    console.say(format_args!(
        "  view space {}",
        view_space::describe(&space)
    ));
    let parts = parts::parts(scene, &space, &lens).with_context(in_scene)?;
    let textures = console.stage("prepare textures", || Textures::new(scene));
    device.introduce(console);
    let before = device.tally();
    let attempt = |making| -> Result<Attempt> {
        let mut dumped = options.dump.as_ref().map(|_| Vec::new());
        let baked = bake_parts(
            &parts,
            &textures,
            options,
            making,
            dumped.as_mut(),
            device,
            console,
        );
        let baked = baked.with_context(in_scene)?;
        let display = joined(&baked);
        Ok(Attempt {
            making,
            excess: options.limits.excess(&farfield_bundle::cost(&display)),
            baked,
            display,
            dumped,
        })
    };
    let makings = techniques(&parts, &textures, options, device, console).with_context(in_scene)?;
    let best = first_within(&makings, attempt, console)?;
    let Attempt {
        making,
        baked,
        display,
        dumped,
        excess,
    } = best;
    if excess > 1.0 {
        let cost = farfield_bundle::cost(&display);
        let error = anyhow!(
            "the smallest impostors that keep the promise have {}: lower the resolution, or move the \
             view cell away",
            options.limits.missed(&cost)
        );
        return Err(error.context(options.scene.to_string()));
    }
    let files = console.stage("encode", || encode(&display))?;

    let too_small = texels_too_small(baked.iter().map(|one| one.smallest_texel));
    let blended = blended_as_masked(scene);
    let technique = technique(options, making);
    let promise = promise(scene, &space, &technique, too_small.clone());
    let warnings: Vec<String> = loaded
        .warnings
        .into_iter()
        .chain(blended)
        .chain(too_small.clone())
        .collect();
    warnings.iter().for_each(|warning| console.warn(warning));
    let impostors: Vec<Impostor> = baked.into_iter().map(|one| one.impostor).collect();
    let statistics = statistics(scene, &display, &impostors);
    let manifest = Manifest {
        format: FORMAT.into(),
        version: VERSION,
        generator: crate::generator(),
        technique,
        options: Options {
            resolution: options.resolution,
            fov_degrees: options.fov_degrees,
            view_space: space.clone(),
            exclude,
        },
        scene: source::record(&options.scene, &loaded.sha256, &dir)?,
        promise,
        statistics: statistics.clone(),
        warnings,
        impostors,
        files: Vec::new(),
        sha256: String::new(),
    };
    // First, as its failure is the bake's.
    if let (Some(dir), Some(mut dumped)) = (&options.dump, dumped) {
        dumped.extend(files.iter().cloned());
        console.stage("write dump", || dump::write(dir, &dumped))?;
    }
    console.stage("write", || farfield_bundle::write(&dir, &manifest, &files))?;

    summarise(&statistics, &manifest.impostors, &dir, console);
    let impostors = manifest.impostors.iter().map(|one| {
        let layers = one.body.layers().map_or(&[][..], |body| &body.layers);
        ImpostorReport {
            name: one.name.clone(),
            layers: layers.len() as u64,
            quads: layers.iter().map(|layer| u64::from(layer.quads)).sum(),
        }
    });
    Ok(BakeReport {
        bundle: dir,
        technique: manifest.technique.name(),
        device: device.name_since(before).into(),
        seconds: start.elapsed().as_secs_f64(),
        triangles_in: statistics.before.triangles,
        triangles_out: statistics.after.triangles,
        layers: statistics.layers,
        quads: statistics.quads,
        draw_calls: statistics.after.draw_calls,
        atlas_bytes: statistics.after.texture_bytes,
        geometry_bytes: statistics.after.geometry_bytes,
        initial_triangles: meshes(&manifest.impostors)
            .map(|m| m.initial_triangles)
            .sum(),
        texels_recorded: statistics.texels_recorded,
        texels_kept: statistics.texels_kept,
        bitfields: None,
        peak_rss_bytes: peak_rss_bytes(),
        impostors: impostors.collect(),
    })
}

/// The promise is for cameras that look at the centre of what is represented.
const OFF_AXIS: &str = "A camera that looks elsewhere magnifies texels by at most \
    1 / cos\u{b2} of the angle between its axis and the direction to them.";

/// The promise is for cameras that look anywhere.
const ANYWHERE: &str = "Texels are not magnified where the camera looks straight at them; beside its \
    axis they are by up to 1 / cos\u{b2} of the angle. Seams between impostors lie where what is seen \
    is as far along one axis of the world as along another.";

/// Each impostor of views from all around is verified alone.
const ONE_AT_A_TIME: &str = "Of the impostors only the one on the viewer's side is to be shown: that \
    along whose axis the viewer is farthest from the centre.";

/// What is recorded for one viewer is shown to all.
const FROM_BEHIND: &str = "A single-sided surface that ends in mid-air is also shown to viewers behind it \
    where another place in the view space sees its front.";

/// Masked materials are recorded so that no gap opens, which makes leaves larger by up to a texel.
const MASKED: &str = "Masked surfaces reach up to a texel over their outlines, so among leaves \
    more of the near and less of what is behind is seen; colours may differ more.";

/// How much colours may differ on average: of trees alone up to 4/255 were measured.
const BIAS: f64 = 1.0 / 255.0;
const BIAS_AMONG_LEAVES: f64 = 8.0 / 255.0;

/// How much normals, roughness and metallic may differ on average: of views before a scene up to 3/255
/// were measured, of a tree alone at 128 pixels 5.7/255, and 6.1/255 from all around, where scenes
/// are some 100 pixels wide. With half of it such small pictures would break it; with twice as much a
/// painted page could pass that a tenth of the pixels show.
const SURFACE_BIAS: f64 = 8.0 / 255.0;

/// How many pixels may lie amidst colours that are nowhere near in the original, as a share: up to
/// 0.00036 were measured, of leaves whose two sides are seen, and 0.00007 of lettering on a truck; a patch
/// on a tenth of a page made 0.008 and more.
const STRAY: f64 = 0.0005;

/// A mesh passes within enlarged voxels of what it stands for.
const NEAR_BY: &str = "The mesh may pass half the side of an enlarged voxel from what it stands for, and \
    by as much its outlines are shorter or longer. What it shows up to three layers behind where it is, two \
    with a factor of 1, is no gap.";

/// Leaves that are set by their centres come and go with the viewpoint.
const BY_CENTRES: &str = "Masked surfaces are recorded by the centres of texels: as much is \
    covered as by the original on average, but gaps between leaves may open and close; gaps, \
    parallax and colours are not promised.";

/// What is promised of a scene's impostor, with its limits.
pub(crate) fn promise(
    scene: &Scene,
    space: &ViewSpace,
    technique: &Technique,
    too_small: Option<String>,
) -> Promise {
    let masked = has_masks(scene);
    let by_centres = masked && technique.foliage() == Some(farfield_bundle::Foliage::Centre);
    let (parallax, mesh) = match *technique {
        Technique::Layered { .. } => (1.0, None),
        Technique::Tdm { enlarged, .. } => (1.0 + enlarged / 2.0, Some(NEAR_BY)),
        Technique::Bitfields { .. } => (0.0, None),
    };
    let note = match (masked, by_centres) {
        (_, true) => Some(BY_CENTRES),
        (true, false) => Some(MASKED),
        (false, false) => None,
    };
    let (aim, shown) = match space {
        ViewSpace::Before { .. } => (OFF_AXIS, None),
        ViewSpace::Amid { .. } => (ANYWHERE, None),
        ViewSpace::Around { .. } => (OFF_AXIS, Some(ONE_AT_A_TIME)),
        ViewSpace::Shell { .. } => (OFF_AXIS, None),
        ViewSpace::Inside { .. } => (ANYWHERE, None),
    };
    let behind = has_one_sided(scene).then_some(FROM_BEHIND);
    let notes = [Some(aim), shown, behind, mesh, note, too_small.as_deref()];
    Promise {
        gap_pixels: (!by_centres).then_some(0),
        parallax_px: (!by_centres).then_some(parallax),
        phantom_pixels: Some(0),
        back_pixels: Some(0),
        colour_bias: Some(if masked { BIAS_AMONG_LEAVES } else { BIAS }),
        surface_bias: (technique.channels() == Some(Channels::Pbr)).then_some(SURFACE_BIAS),
        // Of leaves seen from afar each pixel shows several, and others of the impostor's.
        stray_colours: (!(masked && space.has_sides())).then_some(STRAY),
        coverage_change: by_centres.then_some(0.05),
        notes: notes.into_iter().flatten().map(str::to_owned).collect(),
        ..Promise::default()
    }
}

/// The technique as the manifest tells it.
fn technique(options: &BakeOptions, making: Making) -> Technique {
    let (page_size, channels) = (options.page_size, options.channels);
    let foliage = match options.foliage {
        Foliage::Any => farfield_bundle::Foliage::Any,
        Foliage::Centre => farfield_bundle::Foliage::Centre,
    };
    match making {
        Making::Layered { bytes_per_quad } => Technique::Layered {
            bytes_per_quad,
            page_size,
            foliage,
            channels,
        },
        Making::Tdm { enlarged } => Technique::Tdm {
            enlarged,
            page_size,
            foliage,
            channels,
        },
    }
}

fn has_one_sided(scene: &Scene) -> bool {
    let one_sided = |material: &u32| !scene.materials[*material as usize].double_sided;
    scene.triangle_materials.iter().any(one_sided)
}

fn has_masks(scene: &Scene) -> bool {
    let masks = |material: &u32| scene.materials[*material as usize].alpha.cutoff().is_some();
    scene.triangle_materials.iter().any(masks)
}

/// All impostors of a bundle, made in one way.
struct Attempt {
    making: Making,
    baked: Vec<Baked>,
    /// All of them.
    display: Scene,
    /// Files that show the recorded layers, if they are asked for.
    dumped: Option<Vec<NewFile>>,
    /// How many times what is allowed they cost.
    excess: f64,
}

/// The techniques that may be used, in the order in which they are to be tried: first what is predicted
/// to cost less.
fn techniques(
    parts: &[Part<'_>],
    textures: &Textures<'_>,
    options: &BakeOptions,
    device: &Device,
    console: &Console,
) -> Result<Vec<Making>> {
    let Some(alternative) = options.alternative else {
        return Ok(vec![options.making]);
    };
    let mut makings = vec![options.making, alternative];
    let reason = if options.channels == Channels::Pbr {
        makings.retain(|making| matches!(making, Making::Layered { .. }));
        "meshes hold colours only".to_owned()
    } else {
        let forecast = console.stage("compare techniques", || {
            let mut forecast = auto::Forecast::default();
            for part in parts {
                forecast.add(part, textures, &settings(options, part), device, console)?;
            }
            anyhow::Ok(forecast)
        })?;
        makings.sort_by(|a, b| forecast.bytes(*a).total_cmp(&forecast.bytes(*b)));
        forecast.to_string()
    };
    let first = makings.first().map_or("none", |making| making.name());
    console.say(format_args!("  technique {first}: {reason}"));
    Ok(makings)
}

/// What is made by the first of the techniques that stays within the limits, cheaper variants of each
/// included; where none does, what misses them least.
///
/// # Errors
///
/// When the last technique fails and no other made anything.
fn first_within(
    makings: &[Making],
    attempt: impl Fn(Making) -> Result<Attempt>,
    console: &Console,
) -> Result<Attempt> {
    let mut best: Option<Attempt> = None;
    for (number, making) in (1..).zip(makings) {
        let is_last = number == makings.len();
        let mut is_made = false;
        for variant in std::iter::once(*making).chain(limits::cheaper(*making)) {
            let attempted = attempt(variant);
            is_made |= attempted.is_ok();
            match attempted {
                Ok(made) if best.as_ref().is_none_or(|best| made.excess < best.excess) => {
                    best = Some(made);
                }
                Ok(_) => {}
                Err(error) if is_last && best.is_none() => return Err(error),
                Err(error) => {
                    let name = making.name();
                    console.warn(format_args!("not made as {name}: {error:#}"));
                    break;
                }
            }
            if best.as_ref().is_some_and(|best| best.excess <= 1.0) {
                return Ok(best.expect("it was looked at"));
            }
        }
        if !is_last && is_made {
            let name = making.name();
            console.say(format_args!("  {name} is not within the limits"));
        }
    }
    best.ok_or_else(|| anyhow!("no technique can be used"))
}

/// Bakes all parts that anything can be seen of.
fn bake_parts(
    parts: &[Part<'_>],
    textures: &Textures<'_>,
    options: &BakeOptions,
    making: Making,
    mut dump: Option<&mut Vec<NewFile>>,
    device: &Device,
    console: &Console,
) -> Result<Vec<Baked>> {
    let name = options.scene.name();
    let mut baked = Vec::new();
    for part in parts {
        let name = match part.side {
            Some(side) => format!("{name} {side}"),
            None => name.clone(),
        };
        if part.side.is_some() {
            console.say(format_args!("  impostor {name}"));
        }
        let settings = settings(options, part);
        let made = match making {
            Making::Layered { bytes_per_quad } => layered::bake(
                &name,
                part,
                textures,
                &settings,
                bytes_per_quad,
                device,
                console,
            )?,
            Making::Tdm { enlarged } => {
                tdm::bake(&name, part, textures, &settings, enlarged, device, console)?
            }
        };
        let Some((one, layers)) = made else {
            continue;
        };
        baked.push(one);
        if let Some(files) = dump.as_deref_mut() {
            let of_layers = console.stage("dump", || {
                dump::files(&name, &part.scene, textures, &settings.cell, &layers)
            })?;
            files.extend(of_layers);
        }
    }
    if baked.is_empty() {
        bail!(
            "nothing can be seen from the view cell: all triangles are single-sided and face away, \
             or are transparent; move the cell, or make the materials double-sided"
        );
    }
    Ok(baked)
}

/// What the impostor of a part is made for.
fn settings(options: &BakeOptions, part: &Part<'_>) -> Settings {
    Settings {
        cell: part.cell,
        hull: part.hull,
        camera: part.camera,
        page_size: options.page_size,
        foliage: options.foliage,
        channels: options.channels,
    }
}

/// All impostors in one scene, their pages numbered through.
fn joined(baked: &[Baked]) -> Scene {
    let mut all = Scene::default();
    baked.iter().for_each(|one| all.append(&one.display));
    for (i, material) in all.materials.iter_mut().enumerate() {
        material.name = format!("page {i}");
        for (texture, kind) in [
            (material.base_color_texture, ""),
            (material.normal_texture, "-normal"),
            (material.metallic_roughness_texture, "-metallic-roughness"),
            (material.emissive_texture, "-emissive"),
        ] {
            if let Some(texture) = texture {
                let image = all.textures[texture as usize].image;
                all.images[image as usize].name = format!("{i:03}{kind}");
            }
        }
    }
    all
}

fn statistics(scene: &Scene, display: &Scene, impostors: &[Impostor]) -> Statistics {
    let bodies = || impostors.iter().filter_map(|one| one.body.layers());
    let layers = || bodies().flat_map(|body| &body.layers);
    Statistics {
        before: farfield_bundle::cost(scene),
        after: farfield_bundle::cost(display),
        layers: layers().count() as u64,
        quads: layers().map(|layer| u64::from(layer.quads)).sum(),
        texels_recorded: bodies().map(|body| body.texels_recorded).sum(),
        texels_kept: bodies().map(|body| body.texels_kept).sum(),
    }
}

/// Far ends of cells where renderers that round vertices may show pinholes.
pub(crate) fn texels_too_small(smallest: impl Iterator<Item = f64>) -> Option<String> {
    let smallest_texel = smallest.fold(f64::INFINITY, f64::min);
    (smallest_texel < SMALLEST_TEXEL).then(|| {
        format!(
            "seen from the far end of the view cell a texel is {smallest_texel:.3} pixels; below \
             {SMALLEST_TEXEL:.3}, renderers that snap vertices to 1/16 pixel may show pinholes"
        )
    })
}

/// Blended materials are recorded like masked ones, which their makers may not expect.
fn blended_as_masked(scene: &Scene) -> Option<String> {
    let blended = |material: &u32| scene.materials[*material as usize].alpha == AlphaMode::Blend;
    let count = scene
        .triangle_materials
        .iter()
        .filter(|material| blended(material))
        .count();
    (count > 0).then(|| {
        format!(
            "{count} triangles have blended materials; impostors are opaque or not, \
             so these count as there where alpha is at least 0.5"
        )
    })
}

/// The glTF file and the pages it shows.
fn encode(display: &Scene) -> Result<Vec<NewFile>> {
    let uris: Vec<String> = display
        .images
        .iter()
        .map(|image| format!("pages/{}.png", image.name))
        .collect();
    let glb = NewFile {
        path: GLTF_FILE.into(),
        bytes: glb_from_scene(display, &uris)?,
    };
    let pages = display.images.par_iter().zip(&uris);
    let pages = pages.map(|(image, uri)| NewFile {
        path: uri.clone(),
        bytes: encode_png(image),
    });
    Ok(rayon::iter::once(glb).chain(pages).collect())
}

/// The meshes among impostors.
fn meshes(impostors: &[Impostor]) -> impl Iterator<Item = &TdmBody> {
    impostors.iter().filter_map(|one| match &one.body {
        Body::Tdm(mesh) => Some(mesh),
        Body::Layered(_) | Body::Bitfields(_) => None,
    })
}

/// Tells what drawing the original and what replaces it takes.
fn say_cost(before: &Cost, after: &Cost, replaced_by: &str, console: &Console) {
    let row = |name: &str, of: fn(&Cost) -> u64| {
        let (before, after) = (of(before), of(after));
        console.say(format_args!("  {name:<16}{before:>14}{after:>14}"));
    };
    console.say(format_args!(
        "\n  {:<16}{:>14}{replaced_by:>14}",
        "", "original"
    ));
    row("triangles", |cost| cost.triangles);
    row("draw calls", |cost| cost.draw_calls);
    row("geometry bytes", |cost| cost.geometry_bytes);
    row("texture bytes", |cost| cost.texture_bytes);
}

fn summarise(
    statistics: &Statistics,
    impostors: &[Impostor],
    dir: &std::path::Path,
    console: &Console,
) {
    let Statistics { before, after, .. } = statistics;
    let kept = statistics.texels_kept as f64 / statistics.texels_recorded.max(1) as f64;
    say_cost(before, after, "impostor", console);
    console.say(format_args!(
        "\n  {} layers, {} quads, {:.1} % of {} recorded texels can be seen",
        statistics.layers,
        statistics.quads,
        kept * 100.0,
        statistics.texels_recorded
    ));
    for mesh in meshes(impostors) {
        console.say(format_args!(
            "  mesh of {} triangles, at first {}, in {} pieces and {} charts",
            mesh.triangles, mesh.initial_triangles, mesh.pieces, mesh.charts
        ));
    }
    console.say(format_args!("  bundle in {}", dir.display()));
}
