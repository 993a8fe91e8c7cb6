//! Whether a bundle keeps its promise.

mod beyond;
mod certificate;
mod construction;
mod html;
mod possible;
mod promise;
mod report;
mod subject;
mod table;
mod totals;
mod view;
mod worst;

pub use report::{CostOfBoth, CoverageAt, Spread, Summary, VerifyReport};
pub use totals::Place;

use crate::console::Console;
use crate::{bake, source};
use anyhow::{Context, Result, bail};
use farfield_bundle::{CertificateState, GLTF_FILE, MANIFEST_FILE, Manifest, Technique};
use farfield_scene::Scene;
use rayon::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};
use subject::Subject;
use totals::Totals;

/// Which bundle to verify, and from where.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyOptions {
    /// The bundle's folder.
    pub dir: PathBuf,
    /// The original, where it is no longer where it was baked from.
    pub scene: Option<PathBuf>,
    /// Numbers of the viewpoints: 0 is the reference viewpoint, 1 to 8 are the cell's corners,
    /// 9 to 26 its edge and face centres, from 27 on points spread evenly in it.
    ///
    /// From 0 on they verify the bundle; others are only looked at.
    pub views: Range<u64>,
}

/// Views that are looked at before their figures are added up: bounds memory.
const CHUNK: u64 = 64;

/// Renders a bundle as a glTF client would and its original, from many viewpoints of the view
/// cell, measures what the impostor does wrong, checks how it is built, and writes `verify.json`,
/// `report.html` and pictures of the worst views into the bundle's folder. A bundle that keeps its
/// promise gets a certificate, unless it has one from more viewpoints; one that does not loses it.
///
/// Views that do not start at 0 are looked at without leaving more than pictures behind.
///
/// # Errors
///
/// When the bundle is damaged or says what cannot be, or the original is not there or not the one
/// that was baked.
pub fn verify(options: &VerifyOptions, console: &Console) -> Result<VerifyReport> {
    let dir = &options.dir;
    let manifest = console.stage("read bundle", || farfield_bundle::read(dir))?;
    let original = console.stage("read original", || {
        source::load_again(&manifest, dir, options.scene.as_deref())
    })?;
    let original = original.scene;
    let impostor = read_impostors(dir, &manifest)?;
    let in_manifest = || dir.join(MANIFEST_FILE).display().to_string();
    let subject = Subject::new(&manifest, &original, &impostor).with_context(in_manifest)?;
    let earlier = tell_certificate(dir, &manifest, console)?;
    possible::check_views(&subject, &options.views).with_context(in_manifest)?;
    let construction = construction::check_construction(&subject).with_context(in_manifest)?;
    possible::check_resolution(&subject, &construction).with_context(in_manifest)?;
    let totals = look_at_all(&subject, &options.views, console);
    let coverage_at = console.stage("coverage", || coverage_at(&subject, &options.views));
    let mut report = report::summarise(
        &totals,
        coverage_at,
        construction.proved,
        CostOfBoth {
            original: farfield_bundle::cost(&original),
            impostor: farfield_bundle::cost(&impostor),
        },
    );
    let Technique::Layered { foliage, .. } = manifest.technique;
    let least = bake::promise(&original, foliage, None);
    report.broken = promise::loosened(&manifest.promise, &least);
    report
        .broken
        .extend(promise::broken(&report, &manifest.promise));
    report.broken.extend(construction.faults);
    report.holds = report.broken.is_empty();
    let whole = options.views.start == 0;
    if whole && report.holds {
        let beyond = console.stage("beyond the cell", || {
            beyond::beyond(&subject, &manifest.promise)
        });
        report.beyond = Some(beyond);
    }

    let rows = table::promised_rows(&report, &manifest.promise);
    let folder = dir.join("report");
    if whole && folder.exists() {
        // Pictures of earlier worst views.
        std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let pictures: Vec<_> = totals
        .worst
        .iter()
        .map(|view| worst::picture(&subject, view))
        .collect();
    for pictures in &pictures {
        worst::write(pictures, &folder)?;
    }
    table::print(&report, &rows, &totals, console);
    if whole {
        if !report.holds {
            farfield_bundle::remove_certificate(dir)?;
        }
        let sources = html::Sources {
            dir,
            command: command(options),
            manifest: &manifest,
            subject: &subject,
            patches: &construction.patches,
            totals: &totals,
            report: &report,
            promised: rows,
            pictures: &pictures,
        };
        let page = html::page(sources).context("report.html")?;
        html::write(dir, &page)?;
        write_json(dir, &report)?;
        if report.holds && earlier.is_none_or(|viewpoints| viewpoints <= report.views) {
            let certificate = certificate::certificate(&manifest, &report);
            farfield_bundle::write_certificate(dir, &certificate)?;
        }
        console.say(format_args!(
            "  report in {}",
            dir.join("report.html").display()
        ));
    } else {
        console.say(format_args!("  pictures in {}", folder.display()));
    }
    Ok(report)
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

/// What a bundle's glTF file draws.
///
/// # Errors
///
/// When it cannot be read, or shows files that the manifest has no checksum of.
fn read_impostors(dir: &Path, manifest: &Manifest) -> Result<Scene> {
    let path = dir.join(GLTF_FILE);
    let imported = farfield_import::read(&path)?;
    let is_listed = |name: &&String| manifest.files.iter().any(|file| file.path == **name);
    if let Some(name) = imported.files.iter().find(|name| !is_listed(name)) {
        bail!(
            "{}: shows {name}, which the manifest does not list: bake again",
            path.display()
        );
    }
    Ok(imported.scene)
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
fn look_at_all(subject: &Subject<'_>, views: &Range<u64>, console: &Console) -> Totals {
    let bar = console.bar("look", views.end - views.start);
    let mut totals = Totals::default();
    for start in views.clone().step_by(CHUNK as usize) {
        let chunk = start..(start + CHUNK).min(views.end);
        let figures: Vec<_> = chunk
            .into_par_iter()
            .map(|view| {
                let figures = view::look(subject, view);
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
fn coverage_at(subject: &Subject<'_>, views: &Range<u64>) -> Vec<CoverageAt> {
    let end = views.end.min(LATTICE_VIEWS.max(views.start + 1));
    [1, 2, 4]
        .map(|divisor| {
            let counts = (views.start..end)
                .into_par_iter()
                .map(|view| view::coverage_at(subject, view, divisor));
            let [original, impostor] = counts.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
            CoverageAt {
                resolution: (subject.lens.resolution / divisor).max(1),
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
