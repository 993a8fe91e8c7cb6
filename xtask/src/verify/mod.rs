//! Whether a bundle keeps its promise.

mod beyond;
mod bitfields;
mod certificate;
mod construction;
mod display;
mod gaps;
mod html;
mod possible;
mod promise;
mod report;
mod seams;
mod strays;
mod subject;
mod surface;
mod table;
mod totals;
mod view;
mod wireframe;
mod worst;

pub use report::{
    BitfieldsFigures, CostOfBoth, CoverageAt, OverSamples, Spread, Summary, VerifyReport,
};
pub use seams::Seams;
pub use surface::SurfaceBias;
pub use totals::Place;

use crate::console::Console;
use crate::device::Device;
use crate::parts::{Part, parts};
use crate::{bake, opened};
use anyhow::{Context, Result, bail, ensure};
use construction::Construction;
use display::quads_of_each;
use farfield_bundle::{CertificateState, Manifest};
use farfield_layers::{Aim, PromisedCamera};
use farfield_sampling::Textures;
use rayon::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};
use subject::{Side, Subject};
use totals::Totals;

/// Which bundle to verify, and from where.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyOptions {
    /// The bundle's folder.
    pub dir: PathBuf,
    /// The original, where it is no longer where it was baked from.
    pub scene: Option<PathBuf>,
    /// From where.
    pub views: Views,
}

/// Viewpoints, by number: 0 is the reference viewpoint, 1 to 8 are the cell's corners, 9 to 26 its edge
/// and face centres, from 27 on points spread evenly in it. Of several impostors each is seen in turn: of
/// six the first has the views 0, 6, 12 and so on for these.
///
/// Of bitfields they are independent of each other: in all directions alike, and from distances whose
/// reciprocals are spread evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Views {
    /// So many, from number 0 on: they verify the bundle.
    First(u64),
    /// One alone: it is only looked at.
    One(u64),
}

impl Views {
    fn numbers(self) -> Range<u64> {
        match self {
            Self::First(count) => 0..count,
            Self::One(number) => number..number + 1,
        }
    }

    /// Whether they verify the bundle.
    fn verify(self) -> bool {
        match self {
            Self::First(_) => true,
            Self::One(_) => false,
        }
    }
}

/// More viewpoints than anybody has time for: numbers of viewpoints are smaller.
pub const MOST_VIEWS: u64 = 1_000_000;

/// Views that are looked at before their figures are added up: bounds memory.
const CHUNK: u64 = 64;

/// Renders a bundle as a glTF client would and its original, from many viewpoints of the view
/// cell, measures what the impostor does wrong, checks how it is built, and writes `verify.json`,
/// `report.html` and pictures of the worst views into the bundle's folder. A bundle that keeps its
/// promise gets a certificate, unless it has one from more viewpoints; one that does not loses it.
///
/// A single view is looked at without leaving more than pictures behind.
///
/// # Errors
///
/// When the bundle is damaged or says what cannot be, or the original is not there or not the one
/// that was baked.
pub fn verify(options: &VerifyOptions, console: &Console) -> Result<VerifyReport> {
    verify_on(options, &Device::cpu(), console)
}

/// An error where a bundle has no layers that a GPU could help to record.
///
/// # Errors
///
/// When it has none, as the original geometry is drawn, or is damaged.
pub fn require_layers(dir: &Path) -> Result<()> {
    let manifest = opened::manifest(dir, &Console::Silent)?;
    ensure!(
        manifest.technique.channels().is_some(),
        "--device gpu: not for bundles of --technique bitfields, whose verification records no layers; leave \
         this out"
    );
    Ok(())
}

/// Verifies a bundle. The device records the layers that tell whether the view space sees a part of the
/// original that there is no impostor for; its pictures would not prove what those of the CPU do, as
/// what a GPU shows at the edges of triangles depends on it.
///
/// # Errors
///
/// As for [`verify`]; not when a GPU fails, as the CPU goes on then.
pub fn verify_on(
    options: &VerifyOptions,
    device: &Device,
    console: &Console,
) -> Result<VerifyReport> {
    let dir = &options.dir;
    let manifest = opened::manifest(dir, console)?;
    let scene = options.scene.as_deref();
    let Some(channels) = manifest.technique.channels() else {
        let original = opened::whole_original(&manifest, dir, scene, console)?;
        return bitfields::verify(options, &manifest, original, console);
    };
    let original = opened::original(&manifest, dir, scene, channels, console)?;
    let display = opened::display(dir, &manifest)?;
    let space = &manifest.options.view_space;
    let in_manifest = || opened::in_manifest(dir);
    let lens = PromisedCamera {
        aim: Aim::Center,
        fov: manifest.options.fov_degrees.to_radians(),
        resolution: manifest.options.resolution,
    };
    let parts = parts(&original, space, &lens).with_context(in_manifest)?;
    let of_original = Textures::new(&original);
    let parts = parts_that_are_seen(&manifest, parts, &of_original, device, console);
    let parts = parts.with_context(in_manifest)?;
    let quads = quads_of_each(dir, &display, &manifest)?;
    let of_quads: Vec<_> = quads.iter().map(|quads| Textures::new(quads)).collect();
    let quads = quads.iter().zip(&of_quads);
    let quads = quads.map(|(scene, textures)| Side { scene, textures });
    let subjects = subjects(&manifest, &parts, &of_original, quads);
    let subjects = subjects.with_context(in_manifest)?;
    let views = options.views.numbers();
    let earlier = tell_certificate(dir, &manifest, console)?;
    let constructions: Vec<Construction> = subjects
        .iter()
        .map(|subject| {
            possible::check_views(subject, indices(&views, subjects.len()))?;
            let construction = construction::check_construction(subject)?;
            possible::check_resolution(subject, &construction)?;
            Ok(construction)
        })
        .collect::<Result<_>>()
        .with_context(in_manifest)?;
    let totals = look_at_all(&subjects, &views, console);
    let coverage_at = console.stage("coverage", || coverage_at(&subjects, &views));
    let mut report = report::summarise(
        &totals,
        coverage_at,
        channels,
        construction::worst_of(&constructions),
        CostOfBoth {
            original: farfield_bundle::cost(&original),
            impostor: farfield_bundle::cost(&display),
        },
    );
    let whole = options.views.verify();
    if whole {
        let of_display = Textures::new(&display);
        let sides = [(&original, &of_original), (&display, &of_display)];
        let sides = sides.map(|(scene, textures)| Side { scene, textures });
        report.seams = seams::seams(space, &sides, &lens, console);
    }
    let smallest = constructions.iter().map(|one| one.smallest_texel_px);
    let too_small = bake::texels_too_small(smallest);
    let least = bake::promise(&original, space, &manifest.technique, too_small);
    report.broken = promise::loosened(&manifest.promise, &least);
    let judged = promise::judged(&report, &manifest.promise);
    report.broken.extend(promise::broken(&report, &judged));
    for (subject, construction) in subjects.iter().zip(&constructions) {
        let of = match space.has_sides() {
            true => format!("{}: ", subject.name),
            false => String::new(),
        };
        let faults = construction.faults.iter();
        report
            .broken
            .extend(faults.map(|fault| format!("{of}{fault}")));
    }
    report.holds = report.broken.is_empty();
    if let ([one], false, true) = (&*subjects, space.has_sides(), whole && report.holds) {
        let bar = console.bar("beyond the cell", beyond::TESTS);
        report.beyond = Some(beyond::beyond(one, &manifest.promise, || bar.inc(1)));
        bar.finish_and_clear();
    }

    let rows = table::promised_rows(&report, &judged);
    let folder = dir.join("report");
    let pictures: Vec<_> = totals
        .worst
        .iter()
        .map(|view| worst::picture(viewed(&subjects, view.view).0, view))
        .collect();
    let files = pictures.iter().flat_map(worst::files);
    write_pictures(&folder, whole, files)?;
    table::print(&report, &rows, &totals, console);
    if whole {
        let sources = html::Sources {
            dir,
            command: command(options),
            manifest: &manifest,
            subjects: &subjects,
            constructions: &constructions,
            display: &display,
            totals: &totals,
            report: &report,
            promised: rows,
            pictures: &pictures,
        };
        let left = Left {
            page: html::page(sources).context("report.html")?,
            report: &report,
            sampled: &certificate::OF_IMPOSTORS,
            earlier,
        };
        leave(dir, &manifest, left, console)?;
    } else {
        console.say(format_args!("  pictures in {}", folder.display()));
    }
    Ok(report)
}

/// What a verification leaves behind.
struct Left<'a> {
    page: String,
    report: &'a VerifyReport,
    /// What was only measured, a sentence each.
    sampled: &'a [&'a str],
    /// Viewpoints that the bundle is certified from already.
    earlier: Option<u64>,
}

/// Writes report and figures into a bundle's folder, and certifies it or takes its certificate away.
fn leave(dir: &Path, manifest: &Manifest, left: Left<'_>, console: &Console) -> Result<()> {
    let report = left.report;
    if !report.holds {
        farfield_bundle::remove_certificate(dir)?;
    }
    html::write(dir, &left.page)?;
    write_json(dir, report)?;
    if report.holds && (left.earlier).is_none_or(|viewpoints| viewpoints <= report.views) {
        let certificate = certificate::certificate(manifest, report, left.sampled);
        farfield_bundle::write_certificate(dir, &certificate)?;
    }
    console.say(format_args!(
        "  report in {}",
        dir.join("report.html").display()
    ));
    Ok(())
}

/// Writes PNG files, given by name and content, into a folder.
///
/// * `alone` - whether pictures of earlier views go
fn write_pictures<'a>(
    folder: &Path,
    alone: bool,
    mut files: impl Iterator<Item = (String, &'a [u8])>,
) -> Result<()> {
    if alone && folder.exists() {
        std::fs::remove_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    files.try_for_each(|(name, png)| {
        let path = folder.join(name);
        std::fs::write(&path, png).with_context(|| path.display().to_string())
    })
}

/// The command that verifies a bundle, for a shell.
fn command(options: &VerifyOptions) -> String {
    let quoted = |path: &Path| {
        let text = path.display().to_string();
        shlex::try_quote(&text).map_or(text.clone(), |quoted| quoted.into_owned())
    };
    let scene = options.scene.as_deref().map(quoted);
    let scene = scene.map_or(String::new(), |scene| format!(" --scene {scene}"));
    format!("cargo xtask verify {}{scene}", quoted(&options.dir))
}

/// The parts of the original that the impostors of a manifest stand for.
///
/// # Errors
///
/// When there is no impostor for a part of which something can be seen, or one for nothing.
fn parts_that_are_seen<'a>(
    manifest: &Manifest,
    parts: Vec<Part<'a>>,
    original: &Textures<'_>,
    device: &Device,
    console: &Console,
) -> Result<Vec<Part<'a>>> {
    let stated: Vec<_> = manifest.impostors.iter().map(|one| one.side).collect();
    let mut seen = Vec::new();
    for part in parts {
        let is_needed = stated.contains(&part.side) || {
            let settings = subject::settings(manifest, &part);
            bake::recording::is_seen(&part.scene, original, &settings, device, console)?
        };
        if is_needed {
            seen.push(part);
        }
    }
    let needed: Vec<_> = seen.iter().map(|part| part.side).collect();
    if stated != needed {
        let names = |sides: Vec<Option<farfield_bundle::Side>>| {
            let names = sides
                .iter()
                .map(|side| side.map_or("all".into(), |side| side.to_string()));
            names.collect::<Vec<_>>().join(", ")
        };
        bail!(
            "impostors are there for [{}], but the original needs them for [{}]: bake again",
            names(stated),
            names(needed)
        );
    }
    Ok(seen)
}

/// What is compared with what, impostor by impostor.
fn subjects<'a>(
    manifest: &'a Manifest,
    parts: &'a [Part<'_>],
    original: &'a Textures<'a>,
    quads: impl Iterator<Item = Side<'a>>,
) -> Result<Vec<Subject<'a>>> {
    let impostors = manifest.impostors.iter().zip(parts).zip(quads);
    impostors
        .map(|((impostor, part), quads)| Subject::new(manifest, impostor, part, original, quads))
        .collect()
}

/// The subject of a view, and the number of the viewpoint among its own: impostors take turns.
fn viewed<'a, 's>(subjects: &'s [Subject<'a>], view: u64) -> (&'s Subject<'a>, u64) {
    let count = subjects.len() as u64;
    (&subjects[(view % count) as usize], view / count)
}

/// The numbers among its own of the viewpoints that any of several impostors is seen from.
fn indices(views: &Range<u64>, impostors: usize) -> Range<u64> {
    let count = impostors as u64;
    views.start / count..views.end.div_ceil(count)
}

/// Says what is known from earlier verifications; returns the number of viewpoints that the bundle
/// is certified from.
fn tell_certificate(dir: &Path, manifest: &Manifest, console: &Console) -> Result<Option<u64>> {
    Ok(match farfield_bundle::read_certificate(dir, manifest)? {
        CertificateState::Missing => None,
        CertificateState::Valid(certificate) => {
            console.say(format_args!(
                "  certified from {} viewpoints",
                certificate.viewpoints
            ));
            Some(certificate.viewpoints)
        }
        CertificateState::Stale { why } => {
            console.warn(format_args!("the certificate {why}"));
            None
        }
    })
}

/// Looks from all viewpoints, in memory that does not grow with their number.
fn look_at_all(subjects: &[Subject<'_>], views: &Range<u64>, console: &Console) -> Totals {
    let bar = console.bar("look", views.end - views.start);
    let mut totals = Totals::default();
    for start in views.clone().step_by(CHUNK as usize) {
        let chunk = start..(start + CHUNK).min(views.end);
        let figures: Vec<_> = chunk
            .into_par_iter()
            .map(|view| {
                let (subject, index) = viewed(subjects, view);
                let figures = view::look(subject, index, view);
                bar.inc(1);
                figures
            })
            .collect();
        figures.into_iter().for_each(|figures| totals.add(figures));
    }
    bar.finish_and_clear();
    totals
}

/// Views that are looked at in several resolutions: the reference viewpoint, corners, edge and
/// face centres.
const LATTICE_VIEWS: u64 = 27;

/// How the number of covered pixels changes, at full, half and quarter resolution.
fn coverage_at(subjects: &[Subject<'_>], views: &Range<u64>) -> Vec<CoverageAt> {
    let lattice = LATTICE_VIEWS * subjects.len() as u64;
    let end = views.end.min(lattice.max(views.start + 1));
    [1, 2, 4]
        .map(|divisor| {
            let counts = (views.start..end).into_par_iter().map(|view| {
                let (subject, index) = viewed(subjects, view);
                view::coverage_at(subject, index, divisor)
            });
            let [original, impostor] = counts.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
            CoverageAt {
                resolution: (subjects[0].lens.resolution / divisor).max(1),
                change: impostor as f64 / original.max(1) as f64 - 1.0,
            }
        })
        .into()
}

fn write_json(dir: &Path, report: &VerifyReport) -> Result<()> {
    let path = dir.join("verify.json");
    let text = serde_json::to_string_pretty(report)? + "\n";
    let partial = dir.join("verify.json.partial");
    std::fs::write(&partial, text)
        .and_then(|()| std::fs::rename(&partial, &path))
        .with_context(|| path.display().to_string())
}
