//! Whether ID-bitfields draw all that is seen: file, views, plot, report.

mod curves;
mod look;
mod original;
mod page;

use super::html::PromisedRow;
use super::report::{self, BitfieldsFigures, VerifyReport};
use super::subject::require_same_box;
use super::{Left, VerifyOptions, Views, leave, tell_certificate, write_pictures};
use crate::bake::{cost_of_a_list, percent};
use crate::chance::most_by_chance;
use crate::console::Console;
use crate::drawn::flattened;
use crate::view_cell::represented_box;
use crate::{lists, opened};
use anyhow::{Context, Result};
use farfield_bundle::{Channels, GLTF_FILE, Manifest, Promise, ProvedBound};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use look::{Looked, Sides};

/// Compares what a bundle of bitfields draws with its original, as [`verify`](super::verify) does.
pub(super) fn verify(
    options: &VerifyOptions,
    manifest: &Manifest,
    original: Scene,
    console: &Console,
) -> Result<VerifyReport> {
    let dir = &options.dir;
    let in_manifest = || opened::in_manifest(dir);
    let in_gltf = || dir.join(GLTF_FILE).display().to_string();
    let impostor = &manifest.impostors[0];
    let represented = represented_box(&original).with_context(in_manifest)?;
    require_same_box(impostor.represented, represented).with_context(in_manifest)?;
    let (lists, parts) = lists::read(dir, manifest, represented)?;
    let before = farfield_bundle::cost(&original);
    let original = flattened(&original, &impostor.name, represented).with_context(in_manifest)?;
    let display = opened::display(dir, manifest)?;
    let same = console
        .stage("compare geometry", || {
            original::compare(&original, &display, &parts)
        })
        .with_context(in_gltf)?;
    let earlier = tell_certificate(dir, manifest, console)?;

    let textures = [&original, &display].map(Textures::new);
    let sides = Sides::new(&original, &display, &textures, &same.places, &lists);
    let mut looked = look_at_all(&sides, options, console);
    let mut report = report::summarise(
        &std::mem::take(&mut looked.totals),
        Vec::new(),
        Channels::Lit,
        proved(&same.faults),
        super::CostOfBoth {
            original: before,
            impostor: cost_of_a_list(&display, lists.ranges()),
        },
    );
    let whole = options.views.verify();
    let promised = Promised::of(&manifest.promise);
    let mut figures = looked.figures(promised.most, promised.allowed(options.views));
    if let Some(orbit) = lists.orbit().filter(|_| whole) {
        figures.over_samples = console.stage("samples", || {
            curves::over_samples(&original, &textures[0], orbit)
        });
    }
    report.worst_view = looked.worst.first().map_or(0, |seen| seen.view);
    report.worst_views = looked.worst.iter().map(|seen| seen.view).collect();
    let (row, broken) = judged(promised, &figures, report.views);
    if !row.is_judged {
        report.undecided.push(format!(
            "missed pixels are promised of {} of all views, of which one view decides nothing",
            percent(promised.share)
        ));
    }
    report.broken = broken.into_iter().chain(same.faults).collect();
    // A single view may look past everything.
    if whole && report.covered_pixels == 0 {
        let blind = "no viewpoint sees anything of the original: nothing was compared";
        report.broken.push(blind.into());
    }
    report.holds = report.broken.is_empty();
    report.bitfields = Some(figures);

    let folder = dir.join("report");
    let pictures: Vec<_> = looked
        .worst
        .iter()
        .map(|seen| sides.pictures(seen))
        .collect();
    let files = pictures.iter().flat_map(|one| one.files());
    write_pictures(&folder, whole, files)?;
    let rows = rows(row, &report);
    print(&rows, &report, &looked, console);
    if whole {
        let page = page::page(&page::Sources {
            dir,
            command: super::command(options),
            manifest,
            lists: lists.ranges(),
            report: &report,
            rows,
            worst: &looked.worst,
            pictures: &pictures,
        });
        let left = Left {
            page: page.context("report.html")?,
            report: &report,
            sampled: &SAMPLED,
            earlier,
        };
        leave(dir, manifest, left, console)?;
    } else {
        console.say(format_args!("  pictures in {}", folder.display()));
    }
    Ok(report)
}

/// Views that are looked at before their figures are added up: bounds memory.
const CHUNK: u64 = 256;

fn look_at_all(sides: &Sides<'_>, options: &VerifyOptions, console: &Console) -> Looked {
    let views = options.views.numbers();
    let bar = console.bar("look", views.end - views.start);
    let mut looked = Looked::of(sides.triangles());
    for start in views.clone().step_by(CHUNK as usize) {
        let chunk = start..(start + CHUNK).min(views.end);
        for seen in sides.look(chunk, || bar.inc(1)) {
            looked.add(seen);
        }
    }
    bar.finish_and_clear();
    looked
}

fn proved(faults: &[String]) -> Vec<ProvedBound> {
    vec![ProvedBound {
        statement:
            "The file's triangles, their materials and textures are those of the original: so \
                    many differ in something."
                .into(),
        bound: faults.len() as f64,
        limit: 0.0,
    }]
}

/// What is promised of missed pixels.
#[derive(Clone, Copy)]
struct Promised {
    /// Pixels that a view may miss.
    most: u64,
    /// Of so large a share of all views.
    share: f64,
}

impl Promised {
    fn of(promise: &Promise) -> Self {
        Self {
            most: promise.missed_pixels.unwrap_or(0),
            share: promise.missed_share.unwrap_or(1.0),
        }
    }

    /// The most of some views that may miss more; nothing where one view is to tell of a share of all.
    fn allowed(self, views: Views) -> Option<u64> {
        match views {
            Views::First(count) => Some(most_by_chance(count, self.share)),
            Views::One(_) => (self.share >= 1.0).then_some(0),
        }
    }
}

/// What is promised of missed pixels beside what was measured; and a sentence where it is broken.
fn judged(
    promised: Promised,
    figures: &BitfieldsFigures,
    views: u64,
) -> (PromisedRow, Option<String>) {
    let Promised { most, share } = promised;
    let more = figures.missing_more_than_promised;
    let allowed = figures.may_miss_more_than_promised;
    let kept = allowed.is_none_or(|allowed| more <= allowed);
    let share = percent(share);
    let broken = (!kept).then(|| {
        format!(
            "{more} of {views} views miss more than {most} pixels, promised of {share} of all views, so \
             that at most {} would by chance: the worst {}, {}",
            allowed.unwrap_or(0),
            figures.missed_pixels_worst,
            super::promise::places(&figures.missed)
        )
    });
    let row = PromisedRow {
        name: "views that miss too much",
        measured: format!("{more} of {views}"),
        promised: match allowed {
            Some(allowed) => {
                format!("at most {allowed}: {share} of all views miss at most {most} pixels")
            }
            None => format!("not judged: one view of {share} that miss at most {most} pixels"),
        },
        is_judged: allowed.is_some(),
        kept,
    };
    (row, broken)
}

fn rows(promised: PromisedRow, report: &VerifyReport) -> Vec<PromisedRow> {
    let figures = report.bitfields.as_ref().expect("it was just measured");
    let told = |name, measured: String| PromisedRow {
        name,
        measured,
        promised: String::new(),
        is_judged: false,
        kept: true,
    };
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    let mut rows = vec![
        promised,
        told(
            "views that miss something",
            figures.missing_views.to_string(),
        ),
        told(
            "missed pixels, 95 % of views",
            figures.missed_pixels_p95.to_string(),
        ),
        told(
            "missed pixels, worst view",
            figures.missed_pixels_worst.to_string(),
        ),
        told("wrong pixels, all views", figures.wrong_pixels.to_string()),
        told("gap pixels, all views", report.gap_pixels.to_string()),
        told("triangles culled, mean", percent(figures.culled)),
        told("triangles culled, least", percent(figures.culled_least)),
    ];
    let others = [
        (
            "mean FLIP",
            report.flip_mean.map(|flip| format!("{flip:.4}")),
        ),
        ("PSNR, dB", report.psnr_db.map(|psnr| format!("{psnr:.2}"))),
    ];
    let others = others.into_iter();
    rows.extend(others.filter_map(|(name, measured)| Some(told(name, measured?))));
    rows
}

fn print(rows: &[PromisedRow], report: &VerifyReport, looked: &Looked, console: &Console) {
    super::table::print_rows(rows, report.views, console);
    if let Some(worst) = looked.worst.first() {
        let [x, y, z] = worst.camera.pose.eye.to_array();
        console.say(format_args!(
            "\n  worst: view {} from ({x:.4}, {y:.4}, {z:.4}): {} missed pixels, {} wrong pixels",
            worst.view,
            worst.missed.len(),
            worst.wrong
        ));
    }
    super::table::print_verdict(report, console);
}

const SAMPLED: [&str; 3] = [
    "Missed pixels: those that show a triangle which is not drawn, at every pixel of every viewpoint. Of a \
     promise of a share of all views: that not so many viewpoints miss more as would be improbable (5 %).",
    "Wrong pixels: those that have another colour than the original.",
    "Culling: the share of the triangles that is not drawn for each viewpoint.",
];
