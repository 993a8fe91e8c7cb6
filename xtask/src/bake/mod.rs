//! From a scene to a bundle.

pub mod layered;

use crate::console::{Console, peak_rss_bytes};
use crate::dump;
use crate::outliers;
use crate::source::{self, SceneChoice};
use crate::view_cell::{self, SMALLEST_TEXEL, ViewCellSpec};
use anyhow::{Context, Result};
use farfield_bundle::{
    Body, Cost, FORMAT, GLTF_FILE, Manifest, NewFile, Options, Promise, Statistics, Technique,
    VERSION, encode_png, glb_from_scene,
};
use farfield_layers::PromisedCamera;
use farfield_sampling::Foliage;
use farfield_scene::{AlphaMode, Scene};
use rayon::prelude::*;
use std::path::PathBuf;
use std::time::Instant;

/// The technique, as it stands in the names of folders.
const TECHNIQUE: &str = "layered";

/// What to bake, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// What.
    pub scene: SceneChoice,
    /// Where the viewer may be; by default before the scene.
    pub view_cell: Option<ViewCellSpec>,
    /// Pixels along each side of the viewer's picture.
    pub resolution: u32,
    /// The viewer's field of view, in degrees.
    pub fov_degrees: f64,
    /// Names of objects to leave out.
    pub exclude: Vec<String>,
    /// What a quad is worth, in bytes.
    pub bytes_per_quad: f64,
    /// Longest side of an atlas page, in texels.
    pub page_size: u32,
    /// How masked materials are recorded.
    pub foliage: Foliage,
    /// The bundle's folder; by default `target/farfield/<scene>-<technique>`.
    pub out: Option<PathBuf>,
    /// Where the recorded layers are written for people to look at; nowhere unless asked for.
    pub dump: Option<PathBuf>,
}

/// What a bake made; field names are a published contract.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct BakeReport {
    /// The bundle's folder.
    pub bundle: PathBuf,
    /// Name of the technique.
    pub technique: &'static str,
    /// From start to end.
    pub seconds: f64,
    /// Triangles of the original.
    pub triangles_in: u64,
    /// Triangles of the impostors.
    pub triangles_out: u64,
    /// Layers of all impostors.
    pub layers: u64,
    /// Quads of all impostors.
    pub quads: u64,
    /// Draw calls of the impostors.
    pub draw_calls: u64,
    /// Uncompressed RGBA pages.
    pub atlas_bytes: u64,
    /// Vertices and indices of the impostors.
    pub geometry_bytes: u64,
    /// Opaque texels recorded, in all layers.
    pub texels_recorded: u64,
    /// Opaque texels that the view cell can see.
    pub texels_kept: u64,
    /// The most memory needed at any time; 0 where the system does not tell.
    pub peak_rss_bytes: u64,
    /// One by one.
    pub impostors: Vec<ImpostorReport>,
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

/// Bakes a scene into a bundle.
///
/// # Errors
///
/// When the scene cannot be read, the view cell does not suit it, or the bundle cannot be written.
/// Then nothing is left behind.
pub fn bake(options: &BakeOptions, console: &Console) -> Result<BakeReport> {
    let start = Instant::now();
    let name = options.scene.name();
    let dir = options
        .out
        .clone()
        .unwrap_or_else(|| format!("target/farfield/{name}-{TECHNIQUE}").into());
    farfield_bundle::require_replaceable(&dir)?;
    if let Some(dump) = &options.dump {
        dump::require_place(dump, &dir)?;
    }

    let mut loaded = console.stage("read", || source::load(&options.scene, &options.exclude))?;
    let mut exclude = options.exclude.clone();
    if options.view_cell.is_none() {
        exclude.extend(outliers::leave_out(&mut loaded.scene, &mut loaded.warnings));
    }
    let scene = &loaded.scene;
    let settings = settings(options, scene).with_context(|| options.scene.to_string())?;
    console.say(format_args!(
        "  view cell {}",
        view_cell::describe(&settings.cell)
    ));
    let mut dumped = options.dump.as_ref().map(|_| Vec::new());
    let baked = layered::bake(&name, scene, &settings, dumped.as_mut(), console)
        .with_context(|| options.scene.to_string())?;
    let files = console.stage("encode", || encode(&baked.display))?;

    let too_small = texels_too_small(baked.smallest_texel);
    let blended = blended_as_masked(scene);
    let foliage = match options.foliage {
        Foliage::Any => farfield_bundle::Foliage::Any,
        Foliage::Centre => farfield_bundle::Foliage::Centre,
    };
    let warnings: Vec<String> = loaded
        .warnings
        .into_iter()
        .chain(blended)
        .chain(too_small.clone())
        .collect();
    warnings.iter().for_each(|warning| console.warn(warning));
    let statistics = statistics(scene, &baked);
    let manifest = Manifest {
        format: FORMAT.into(),
        version: VERSION,
        generator: crate::generator(),
        technique: Technique::Layered {
            bytes_per_quad: options.bytes_per_quad,
            page_size: options.page_size,
            foliage,
        },
        options: Options {
            resolution: options.resolution,
            fov_degrees: options.fov_degrees,
            view_cell: settings.cell,
            exclude,
        },
        scene: source::record(&options.scene, &loaded.sha256, &dir)?,
        promise: promise(scene, foliage, too_small),
        statistics: statistics.clone(),
        warnings,
        impostors: vec![baked.impostor],
        files: Vec::new(),
        sha256: String::new(),
    };
    // First, as its failure is the bake's.
    if let (Some(dir), Some(files)) = (&options.dump, &dumped) {
        console.stage("write dump", || dump::write(dir, files))?;
    }
    console.stage("write", || farfield_bundle::write(&dir, &manifest, &files))?;

    summarise(&statistics, &dir, console);
    let impostors = vec![ImpostorReport {
        name,
        layers: statistics.layers,
        quads: statistics.quads,
    }];
    Ok(BakeReport {
        bundle: dir,
        technique: manifest.technique.name(),
        seconds: start.elapsed().as_secs_f64(),
        triangles_in: statistics.before.triangles,
        triangles_out: statistics.after.triangles,
        layers: statistics.layers,
        quads: statistics.quads,
        draw_calls: statistics.after.draw_calls,
        atlas_bytes: statistics.after.texture_bytes,
        geometry_bytes: statistics.after.geometry_bytes,
        texels_recorded: statistics.texels_recorded,
        texels_kept: statistics.texels_kept,
        peak_rss_bytes: peak_rss_bytes(),
        impostors,
    })
}

/// The promise is for cameras that look at the centre of what is represented.
const OFF_AXIS: &str = "A camera that looks elsewhere magnifies texels by at most \
    1 / cos\u{b2} of the angle between its axis and the direction to them.";

/// Masked materials are recorded so that no gap opens, which makes leaves larger by up to a texel.
const MASKED: &str = "Masked surfaces reach up to a texel over their outlines, so among leaves \
    more of the near and less of what is behind is seen; colours may differ more.";

/// How much colours may differ on average: of trees alone up to 4/255 were measured.
const BIAS: f64 = 1.0 / 255.0;
const BIAS_AMONG_LEAVES: f64 = 8.0 / 255.0;

/// Leaves that are set by their centres come and go with the viewpoint.
const BY_CENTRES: &str = "Masked surfaces are recorded by the centres of texels: as much is \
    covered as by the original on average, but gaps between leaves may open and close; gaps, \
    parallax and colours are not promised.";

/// What is promised of a scene's impostor, with its limits.
pub(crate) fn promise(
    scene: &Scene,
    foliage: farfield_bundle::Foliage,
    too_small: Option<String>,
) -> Promise {
    let masked = has_masks(scene);
    let by_centres = masked && foliage == farfield_bundle::Foliage::Centre;
    let note = match (masked, by_centres) {
        (_, true) => Some(BY_CENTRES),
        (true, false) => Some(MASKED),
        (false, false) => None,
    };
    let notes = [Some(OFF_AXIS), note, too_small.as_deref()];
    Promise {
        gap_pixels: (!by_centres).then_some(0),
        parallax_px: (!by_centres).then_some(1.0),
        phantom_pixels: Some(0),
        colour_bias: Some(if masked { BIAS_AMONG_LEAVES } else { BIAS }),
        coverage_change: by_centres.then_some(0.05),
        notes: notes.into_iter().flatten().map(str::to_owned).collect(),
        ..Promise::default()
    }
}

fn has_masks(scene: &Scene) -> bool {
    let masks = |material: &u32| scene.materials[*material as usize].alpha.cutoff().is_some();
    scene.triangle_materials.iter().any(masks)
}

/// What the impostor is made for.
fn settings(options: &BakeOptions, scene: &Scene) -> Result<layered::Settings> {
    let represented = view_cell::represented_box(scene)?;
    let camera = PromisedCamera {
        fov: options.fov_degrees.to_radians(),
        resolution: options.resolution,
    };
    Ok(layered::Settings {
        cell: view_cell::resolve(options.view_cell.as_ref(), represented, &camera)?,
        represented,
        camera,
        bytes_per_quad: options.bytes_per_quad,
        page_size: options.page_size,
        foliage: options.foliage,
    })
}

fn statistics(scene: &Scene, baked: &layered::Baked) -> Statistics {
    let Body::Layered(body) = &baked.impostor.body;
    Statistics {
        before: farfield_bundle::cost(scene),
        after: farfield_bundle::cost(&baked.display),
        layers: body.layers.len() as u64,
        quads: body.layers.iter().map(|layer| u64::from(layer.quads)).sum(),
        texels_recorded: body.texels_recorded,
        texels_kept: body.texels_kept,
    }
}

/// Far ends of cells where renderers that round vertices may show pinholes.
fn texels_too_small(smallest_texel: f64) -> Option<String> {
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

fn summarise(statistics: &Statistics, dir: &std::path::Path, console: &Console) {
    let Statistics { before, after, .. } = statistics;
    let kept = statistics.texels_kept as f64 / statistics.texels_recorded.max(1) as f64;
    let row = |name: &str, of: fn(&Cost) -> u64| {
        let (before, after) = (of(before), of(after));
        console.say(format_args!("  {name:<16}{before:>14}{after:>14}"));
    };
    console.say(format_args!(
        "\n  {:<16}{:>14}{:>14}",
        "", "original", "impostor"
    ));
    row("triangles", |cost| cost.triangles);
    row("draw calls", |cost| cost.draw_calls);
    row("geometry bytes", |cost| cost.geometry_bytes);
    row("texture bytes", |cost| cost.texture_bytes);
    console.say(format_args!(
        "\n  {} layers, {} quads, {:.1} % of {} recorded texels can be seen",
        statistics.layers,
        statistics.quads,
        kept * 100.0,
        statistics.texels_recorded
    ));
    console.say(format_args!("  bundle in {}", dir.display()));
}
