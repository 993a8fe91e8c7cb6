//! Whether a bundle keeps its promise.

mod view;

use crate::console::Console;
use crate::source::{self, SceneChoice};
use anyhow::{Context, Result, bail};
use farfield_bundle::{Body, GLTF_FILE, Manifest};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use farfield_views::Pose;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};
use view::{Subject, ViewFigures, look, write_pictures};

/// Which bundle to verify, and from where.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyOptions {
    /// The bundle's folder.
    pub dir: PathBuf,
    /// The original, where it is no longer where it was baked from.
    pub scene: Option<PathBuf>,
    /// Numbers of the viewpoints: 0 is the reference viewpoint, 1 to 8 are the cell's corners,
    /// 9 to 26 its edge and face centres, from 27 on points spread evenly in it.
    pub views: Range<u64>,
}

/// What was measured; field names are a published contract.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VerifyReport {
    /// Number of viewpoints.
    pub views: u64,
    /// Pixels at which one looks through the impostor, in all views together.
    pub gap_pixels: u64,
    /// Pixels that only the impostor covers, far from the original, in all views together.
    pub phantom_pixels: u64,
    /// Share of the original's pixels that the impostor misses, over all views.
    pub coverage_error: f64,
    /// The number of the worst viewpoint: most gaps, then phantoms, then missed pixels.
    pub worst_view: u64,
    /// Whether the bundle keeps its promise.
    pub holds: bool,
}

/// Distinguishes verify's viewpoints from any that a bake may look from.
const SEED: u64 = 0x7665_7269_6679;

/// Renders a bundle as a glTF client would and its original, from many viewpoints of the view
/// cell, counts what the impostor does wrong, and writes `verify.json` and pictures of the worst
/// view into the bundle's folder.
///
/// # Errors
///
/// When the bundle is damaged, or the original is not there or not the one that was baked.
pub fn verify(options: &VerifyOptions, console: &Console) -> Result<VerifyReport> {
    let dir = &options.dir;
    let manifest = console.stage("read bundle", || farfield_bundle::read(dir))?;
    let original = console.stage("read original", || {
        source::load_again(&manifest, dir, options.scene.as_deref())
    })?;
    let original = original.scene;
    let impostor = source::load(&SceneChoice::File(dir.join(GLTF_FILE)), &[])?.scene;
    let subject = subject(&manifest, &original, &impostor)?;

    let count = options.views.end - options.views.start;
    let bar = console.bar("look", count);
    let figures: Vec<ViewFigures> = options
        .views
        .clone()
        .into_par_iter()
        .map(|view| {
            let figures = look(&subject, view, eye(&manifest, &subject.reference, view));
            bar.inc(1);
            figures
        })
        .collect();
    bar.finish_and_clear();

    let report = summarise(&figures, &manifest);
    let worst = figures
        .iter()
        .find(|figures| figures.view == report.worst_view);
    let worst = worst.context("there must be at least one viewpoint")?;
    let pictures = dir.join("report");
    if options.views.start == 0 && pictures.exists() {
        // Those of an earlier worst view.
        std::fs::remove_dir_all(&pictures).with_context(|| pictures.display().to_string())?;
    }
    write_pictures(&subject, worst, &pictures)?;
    if options.views.start == 0 {
        write_json(dir, &report)?;
    }
    print(&report, worst, &manifest, &pictures, console);
    Ok(report)
}

/// What is compared with what, for the one impostor of the bundle.
fn subject<'a>(
    manifest: &Manifest,
    original: &'a Scene,
    impostor: &'a Scene,
) -> Result<Subject<'a>> {
    let [one] = manifest.impostors.as_slice() else {
        bail!(
            "the bundle holds {} impostors; this version verifies one",
            manifest.impostors.len()
        );
    };
    let Body::Layered(body) = &one.body;
    let [min, max] = one.represented;
    Ok(Subject {
        original,
        original_textures: Textures::new(original),
        impostor,
        impostor_textures: Textures::new(impostor),
        reference: body.pose,
        borders: body.borders(),
        target: (min + max) / 2.0,
        fov: manifest.options.fov_degrees.to_radians(),
        resolution: manifest.options.resolution,
    })
}

/// Viewpoint number `view`, in the world.
fn eye(manifest: &Manifest, reference: &Pose, view: u64) -> DVec3 {
    match view.checked_sub(1) {
        None => reference.eye,
        Some(index) => manifest.options.view_cell.viewpoint(index, SEED),
    }
}

fn summarise(figures: &[ViewFigures], manifest: &Manifest) -> VerifyReport {
    let sum = |count: fn(&ViewFigures) -> u64| figures.iter().map(count).sum::<u64>();
    let gap_pixels = sum(|view| view.gaps.len() as u64);
    let badness =
        |view: &&ViewFigures| (view.gaps.len(), view.phantoms.len(), view.coverage.missed);
    // Of several that are equally bad the first.
    let worst = figures.iter().rev().max_by_key(badness);
    let missed = sum(|view| view.coverage.missed);
    VerifyReport {
        views: figures.len() as u64,
        gap_pixels,
        phantom_pixels: sum(|view| view.phantoms.len() as u64),
        coverage_error: missed as f64 / sum(|view| view.coverage.covered).max(1) as f64,
        worst_view: worst.map_or(0, |view| view.view),
        holds: manifest
            .promise
            .gap_pixels
            .is_none_or(|most| gap_pixels <= most),
    }
}

fn write_json(dir: &Path, report: &VerifyReport) -> Result<()> {
    let path = dir.join("verify.json");
    let text = serde_json::to_string_pretty(report)? + "\n";
    let partial = dir.join("verify.json.partial");
    std::fs::write(&partial, text)
        .and_then(|()| std::fs::rename(&partial, &path))
        .with_context(|| path.display().to_string())
}

fn print(
    report: &VerifyReport,
    worst: &ViewFigures,
    manifest: &Manifest,
    pictures: &Path,
    console: &Console,
) {
    let promised = |most: Option<u64>| most.map_or(String::new(), |most| format!("at most {most}"));
    console.say(format_args!("\n  {:<28}{:>12}   promised", "", "measured"));
    let gaps = promised(manifest.promise.gap_pixels);
    console.say(format_args!(
        "  {:<28}{:>12}   {gaps}",
        "gap pixels", report.gap_pixels
    ));
    console.say(format_args!(
        "  {:<28}{:>12}",
        "phantom pixels", report.phantom_pixels
    ));
    let percent = report.coverage_error * 100.0;
    console.say(format_args!(
        "  {:<28}{:>10.4} %",
        "coverage error", percent
    ));
    if let Some(pixels) = manifest.promise.parallax_px {
        let how = "not measured; it follows from where the layers are";
        console.say(format_args!(
            "  {:<28}{:>12}   at most {pixels} ({how})",
            "parallax, pixels", "-"
        ));
    }
    console.say(format_args!("  {:<28}{:>12}", "viewpoints", report.views));
    let [x, y, z] = worst.eye.to_array();
    console.say(format_args!(
        "\n  worst: view {} from ({x:.4}, {y:.4}, {z:.4}): {} gap pixels, {} phantom pixels, \
         {} of {} pixels missed",
        worst.view,
        worst.gaps.len(),
        worst.phantoms.len(),
        worst.coverage.missed,
        worst.coverage.covered
    ));
    if !worst.gaps.is_empty() {
        let places = worst
            .gaps
            .iter()
            .take(8)
            .map(|[x, y]| format!("({x}, {y})"));
        console.say(format_args!(
            "  gaps at pixels {}",
            places.collect::<Vec<_>>().join(", ")
        ));
    }
    console.say(format_args!("  pictures of it in {}", pictures.display()));
    let verdict = if report.holds {
        "the promise holds"
    } else {
        "the promise is BROKEN"
    };
    console.say(format_args!("\n  {verdict}"));
}
