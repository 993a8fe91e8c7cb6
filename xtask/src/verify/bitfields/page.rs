//! What verify says of bitfields, for people: one page that needs nothing else.

use super::super::html::{CostRow, Fact, PromisedRow, STYLE, cost, data_uri, facts, rendered};
use super::super::report::{OverSamples, VerifyReport};
use super::look::{Pictures, Seen};
use crate::bake::owners;
use crate::view_space;
use anyhow::Result;
use farfield_bitfields::FaceRanges;
use farfield_bundle::{BitfieldsBody, Body, Manifest, Samples, Technique, ViewSpace};
use serde::Serialize;
use std::path::Path;

/// What the page is made from.
pub(super) struct Sources<'a> {
    pub(super) dir: &'a Path,
    /// What verifies the bundle again.
    pub(super) command: String,
    pub(super) manifest: &'a Manifest,
    pub(super) lists: &'a FaceRanges,
    pub(super) report: &'a VerifyReport,
    pub(super) rows: Vec<PromisedRow>,
    pub(super) worst: &'a [Seen],
    pub(super) pictures: &'a [Pictures],
}

/// Everything that the page shows, in words and pictures.
#[derive(Serialize)]
struct Page<'a> {
    style: &'static str,
    name: &'a str,
    summary: String,
    made_of: String,
    /// What lists are of.
    owner: &'static str,
    /// From where worst views are seen once more, and how viewpoints are spread.
    aside: &'static str,
    spread: &'static str,
    report: &'a VerifyReport,
    cost: Vec<CostRow>,
    promised: Vec<PromisedRow>,
    worst: Vec<WorstView>,
    plots: Vec<Plot>,
    over_samples: Vec<Row>,
    notes: &'a [String],
    facts: Vec<Fact>,
}

#[derive(Serialize)]
struct WorstView {
    view: u64,
    eye: String,
    figures: String,
    command: String,
    original: String,
    drawn: String,
    marked: String,
    aside: String,
}

#[derive(Serialize)]
struct Row {
    samples: u32,
    cells: [String; 4],
}

/// Lines over the number of samples, on a page of `WIDTH` x `HEIGHT`.
#[derive(Serialize)]
struct Plot {
    title: &'static str,
    width: f64,
    height: f64,
    /// Of the axes, in the plot's coordinates: left, right, top, bottom.
    frame: [f64; 4],
    lines: Vec<Line>,
    /// Of the bundle.
    bundle: Dot,
    x_ticks: Vec<Tick>,
    y_ticks: Vec<Tick>,
}

#[derive(Serialize)]
struct Line {
    name: &'static str,
    class: &'static str,
    points: String,
    dots: Vec<Dot>,
}

#[derive(Serialize)]
struct Dot {
    x: f64,
    y: f64,
    label: String,
}

#[derive(Serialize)]
struct Tick {
    at: f64,
    text: String,
}

/// The page, a whole HTML document with all its pictures.
pub(super) fn page(sources: &Sources<'_>) -> Result<String> {
    let Sources {
        manifest, report, ..
    } = sources;
    let space = &manifest.options.view_space;
    let page = Page {
        style: STYLE,
        name: &manifest.impostors[0].name,
        summary: summary(manifest),
        made_of: made_of(sources),
        owner: owners(space)[0],
        aside: match space {
            ViewSpace::Inside { .. } => "from above",
            _ => "from the other side",
        },
        spread: match space {
            ViewSpace::Inside { .. } => {
                "in no order in the view cell and, 19 of 27, on its borders, in all directions alike"
            }
            _ => {
                "in no order in all directions alike and from distances whose reciprocals are spread evenly"
            }
        },
        report,
        cost: cost(report),
        promised: sources.rows.clone(),
        worst: sources
            .worst
            .iter()
            .zip(sources.pictures)
            .map(|(seen, pictures)| worst_view(seen, pictures, sources))
            .collect(),
        plots: plots(sources),
        over_samples: over_samples(sources).iter().map(row).collect(),
        notes: &manifest.promise.notes,
        facts: facts(manifest, sources.dir),
    };
    rendered(include_str!("page.html"), page)
}

fn over_samples<'a>(sources: &Sources<'a>) -> &'a [OverSamples] {
    let figures = sources.report.bitfields.as_ref();
    figures.map_or(&[], |figures| &figures.over_samples)
}

fn summary(manifest: &Manifest) -> String {
    let options = &manifest.options;
    let space = &options.view_space;
    let aim = match space {
        ViewSpace::Inside { .. } => "look anywhere",
        _ => "look at the centre of what is represented",
    };
    format!(
        "ID-bitfields for cameras of {0} x {0} pixels and {1} degrees that {aim}, {2}.",
        options.resolution,
        options.fov_degrees,
        view_space::describe(space)
    )
}

fn body<'a>(sources: &Sources<'a>) -> &'a BitfieldsBody {
    match &sources.manifest.impostors[0].body {
        Body::Bitfields(body) => body,
        Body::Layered(_) | Body::Tdm(_) => unreachable!("these have no lists"),
    }
}

fn made_of(sources: &Sources<'_>) -> String {
    let (samples, neighbors) = match sources.manifest.technique {
        Technique::Bitfields {
            samples, neighbors, ..
        } => (samples, neighbors),
        Technique::Layered { .. } | Technique::Tdm { .. } => unreachable!("these have no lists"),
    };
    let how = match samples {
        Samples::Adaptive => "added where views missed something",
        Samples::Even => "spread evenly",
        Samples::Listed => "listed by the user",
    };
    let neighbors = match neighbors {
        Some(true) => ", with the neighbours of what they see",
        Some(false) | None => "",
    };
    let body = body(sources);
    let [one, several] = owners(&sources.manifest.options.view_space);
    let drawn: Vec<u32> = (0..body.lists)
        .map(|list| sources.lists.primitives_of(list))
        .collect();
    format!(
        "{} {several}, from {} viewpoints, {how}{neighbors}. A {one} draws {} to {} triangles, in at most {} ranges, \
         culled are {:.1} % on average. Triangles and draw calls above are the mean over all {several}.",
        body.lists,
        body.viewpoints,
        drawn.iter().min().unwrap_or(&0),
        drawn.iter().max().unwrap_or(&0),
        body.most_ranges,
        body.culled * 100.0
    )
}

fn worst_view(seen: &Seen, pictures: &Pictures, sources: &Sources<'_>) -> WorstView {
    let [x, y, z] = seen.camera.pose.eye.to_array();
    let [one, _] = owners(&sources.manifest.options.view_space);
    let all = body(sources).triangles;
    WorstView {
        view: seen.view,
        eye: format!("({x:.4}, {y:.4}, {z:.4})"),
        figures: format!(
            "{} missed pixels, {} wrong pixels, {} of {all} triangles drawn for {one} {}",
            seen.missed.len(),
            seen.wrong,
            seen.drawn,
            seen.list
        ),
        command: format!("{} --view {}", sources.command, seen.view),
        original: data_uri(&pictures.original),
        drawn: data_uri(&pictures.drawn),
        marked: data_uri(&pictures.marked),
        aside: data_uri(&pictures.aside),
    }
}

fn row(of: &OverSamples) -> Row {
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    Row {
        samples: of.samples,
        cells: [
            percent(of.culled_by_three),
            of.missed_by_three.to_string(),
            percent(of.culled_by_six),
            of.missed_by_six.to_string(),
        ],
    }
}

fn plots(sources: &Sources<'_>) -> Vec<Plot> {
    let over = over_samples(sources);
    let Some(figures) = sources
        .report
        .bitfields
        .as_ref()
        .filter(|_| !over.is_empty())
    else {
        return Vec::new();
    };
    let BitfieldsBody {
        viewpoints, culled, ..
    } = *body(sources);
    vec![
        plot(
            "Triangles culled, mean over faces, in percent",
            over,
            [|o| o.culled_by_three * 100.0, |o| o.culled_by_six * 100.0],
            (viewpoints, culled * 100.0),
            100.0,
        ),
        plot(
            "Missed pixels, 95th percentile of views",
            over,
            [|o| o.missed_by_three as f64, |o| o.missed_by_six as f64],
            (viewpoints, figures.missed_pixels_p95 as f64),
            0.0,
        ),
    ]
}

/// * `of` - what is plotted, of three and of six samples
/// * `bundle` - the number of its viewpoints, and its figure
/// * `least_top` - where the vertical axis ends at least
fn plot(
    title: &'static str,
    over: &[OverSamples],
    of: [fn(&OverSamples) -> f64; 2],
    bundle: (u32, f64),
    least_top: f64,
) -> Plot {
    const WIDTH: f64 = 520.0;
    const HEIGHT: f64 = 300.0;
    let [left, right, top, bottom] = [52.0, WIDTH - 16.0, 30.0, HEIGHT - 34.0];
    let values = over.iter().flat_map(|o| of.map(|of| of(o)));
    let most = values.chain([bundle.1, least_top, 1.0]).fold(0.0, f64::max);
    // Half of the height or more is used, up to a number that is easily read.
    let step = 10f64.powf((most / 2.0).log10().floor());
    let most = (most / step).ceil() * step;
    let counts = over.iter().map(|o| o.samples).chain([bundle.0]);
    let [first, last] = counts.fold([u32::MAX, 0], |[a, b], n| [a.min(n), b.max(n)]);
    let log = |samples: u32| f64::from(samples.max(1)).ln();
    let span = (log(last) - log(first)).max(f64::MIN_POSITIVE);
    let rounded = |x: f64| (x * 10.0).round() / 10.0;
    let x = |samples: u32| rounded(left + (right - left) * (log(samples) - log(first)) / span);
    let y = |value: f64| rounded(bottom - (bottom - top) * value / most);
    let line = |name, class, of: fn(&OverSamples) -> f64| {
        let dots: Vec<Dot> = over
            .iter()
            .map(|o| Dot {
                x: x(o.samples),
                y: y(of(o)),
                label: format!("{} samples: {:.1}", o.samples, of(o)),
            })
            .collect();
        let points: Vec<String> = dots
            .iter()
            .map(|dot| format!("{},{}", dot.x, dot.y))
            .collect();
        Line {
            name,
            class,
            points: points.join(" "),
            dots,
        }
    };
    let tick = |at, text| Tick { at, text };
    Plot {
        title,
        width: WIDTH,
        height: HEIGHT,
        frame: [left, right, top, bottom],
        lines: vec![
            line("three samples a face", "three", of[0]),
            line("six samples a face", "six", of[1]),
        ],
        bundle: Dot {
            x: x(bundle.0),
            y: y(bundle.1),
            label: format!("this bundle, {} viewpoints: {:.1}", bundle.0, bundle.1),
        },
        x_ticks: over
            .iter()
            .map(|o| tick(x(o.samples), o.samples.to_string()))
            .collect(),
        y_ticks: [0.0, 0.25, 0.5, 0.75, 1.0]
            .map(|share| share * most)
            .map(|value| tick(y(value), format!("{value}")))
            .into(),
    }
}
