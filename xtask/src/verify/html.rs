//! What verify says, for people: one page that needs nothing else.

use super::construction::Construction;
use super::report::{Summary, VerifyReport};
use super::subject::Subject;
use super::totals::{Dot, Totals};
use super::view::ViewFigures;
use super::wireframe::wireframes;
use super::worst::ViewPictures;
use crate::pictures::{contact_sheet, png};
use crate::view_space;
use anyhow::{Context, Result};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use farfield_bundle::{Beyond, Manifest, SceneSource, Technique, ViewSpace};
use farfield_grid::Grid;
use farfield_pages::{Patch, compose_layer};
use farfield_scene::Scene;
use farfield_views::Pose;
use glam::{DVec2, DVec3};
use minijinja::Environment;
use minijinja::value::Serde;
use serde::Serialize;
use std::path::Path;

/// How all pages look.
pub(super) const STYLE: &str = include_str!("style.css");

/// Everything that the page shows, in words and pictures.
#[derive(Serialize)]
struct Page<'a> {
    style: &'static str,
    name: &'a str,
    summary: String,
    made_of: String,
    report: &'a VerifyReport,
    cost: Vec<CostRow>,
    promised: Vec<PromisedRow>,
    difference: &'static str,
    worst: Vec<WorstView>,
    plots: Vec<Plot>,
    spread: Vec<SpreadRow>,
    coverage: Vec<CoverageRow>,
    beyond: Option<BeyondWords>,
    notes: &'a [String],
    edges: &'static str,
    wireframes: Vec<WireframeView<'a>>,
    sheets: Vec<Sheet<'a>>,
    pages: Vec<AtlasPage>,
    facts: Vec<Fact>,
}

#[derive(Serialize)]
pub(super) struct CostRow {
    name: &'static str,
    original: String,
    impostor: String,
    ratio: String,
}

/// A figure beside what is promised of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct PromisedRow {
    pub(super) name: &'static str,
    pub(super) measured: String,
    /// Empty where nothing is promised.
    pub(super) promised: String,
    /// Whether anything is promised, and enough was seen to judge it.
    pub(super) is_judged: bool,
    pub(super) kept: bool,
}

#[derive(Serialize)]
struct WorstView {
    view: u64,
    eye: String,
    figures: String,
    command: String,
    original: String,
    impostor: String,
    difference: String,
    marked: String,
}

#[derive(Serialize)]
struct Plot {
    title: String,
    width: f64,
    height: f64,
    boxes: Vec<PlotBox>,
    dots: Vec<PlotDot>,
}

#[derive(Serialize)]
struct PlotBox {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

#[derive(Serialize)]
struct PlotDot {
    x: f64,
    y: f64,
    color: String,
    label: String,
}

#[derive(Serialize)]
struct SpreadRow {
    name: &'static str,
    mean: String,
    p999: String,
    max: String,
}

#[derive(Serialize)]
struct CoverageRow {
    name: String,
    change: String,
}

#[derive(Serialize)]
struct BeyondWords {
    scale: String,
    distance: String,
    coverage: String,
    error: String,
}

#[derive(Serialize)]
struct WireframeView<'a> {
    name: &'a str,
    view: u64,
    place: &'static str,
    picture: String,
}

#[derive(Serialize)]
struct Sheet<'a> {
    name: &'a str,
    picture: String,
}

#[derive(Serialize)]
struct AtlasPage {
    name: String,
    size: String,
    picture: String,
}

#[derive(Serialize)]
pub(super) struct Fact {
    name: &'static str,
    value: String,
}

/// What the page is made from.
pub(super) struct Sources<'a> {
    pub(super) dir: &'a Path,
    /// What verifies the bundle again.
    pub(super) command: String,
    pub(super) manifest: &'a Manifest,
    pub(super) subjects: &'a [Subject<'a>],
    /// Of each of them.
    pub(super) constructions: &'a [Construction],
    /// All impostors.
    pub(super) display: &'a Scene,
    pub(super) totals: &'a Totals,
    pub(super) report: &'a VerifyReport,
    pub(super) promised: Vec<PromisedRow>,
    pub(super) pictures: &'a [ViewPictures],
}

/// The page, a whole HTML document with all its pictures.
pub(super) fn page(sources: Sources<'_>) -> Result<String> {
    let Sources {
        manifest, report, ..
    } = sources;
    let statistics = &manifest.statistics;
    let name = manifest.impostors.first().map_or("", |one| &one.name);
    let made = sources.subjects.iter().zip(sources.constructions);
    let page = Page {
        style: STYLE,
        name,
        summary: summary(manifest),
        made_of: format!(
            "{} layers, {} quads; {} of {} recorded texels can be seen from the cell and were \
             kept. Texture bytes are uncompressed RGBA without mipmaps.",
            statistics.layers,
            statistics.quads,
            grouped(statistics.texels_kept),
            grouped(statistics.texels_recorded)
        ),
        report,
        cost: cost(report),
        promised: sources.promised,
        difference: match report.flip_mean {
            Some(_) => {
                "FLIP, what people see who flip between the pictures, from black (none) \
                        over violet and orange to yellow"
            }
            None => "absolute, four times as strong",
        },
        worst: sources
            .totals
            .worst
            .iter()
            .zip(sources.pictures)
            .map(|(view, pictures)| worst_view(view, pictures, &sources.command))
            .collect(),
        plots: plots(
            sources.subjects,
            &sources.totals.dots,
            report.flip_mean.is_some(),
        ),
        spread: spread(report),
        coverage: report
            .coverage_at
            .iter()
            .map(|at| CoverageRow {
                name: format!("{0} x {0}", at.resolution),
                change: format!("{:+.2} %", at.change * 100.0),
            })
            .collect(),
        beyond: report.beyond.map(beyond),
        notes: &manifest.promise.notes,
        edges: match manifest.technique {
            Technique::Layered { .. } => "Outlines of the quads",
            Technique::Tdm { .. } | Technique::Bitfields { .. } => "Edges of the triangles",
        },
        wireframes: wireframe_views(sources.subjects),
        sheets: made
            .filter_map(|(subject, construction)| sheet(subject, &construction.patches))
            .collect(),
        pages: atlas(sources.display),
        facts: facts(manifest, sources.dir),
    };
    rendered(include_str!("report.html"), page)
}

/// A page of the layout that all have in common.
pub(super) fn rendered(template: &str, page: impl Serialize) -> Result<String> {
    let mut environment = Environment::new();
    environment.add_template("layout.html", include_str!("layout.html"))?;
    environment.add_template("page.html", template)?;
    Ok(environment.get_template("page.html")?.render(Serde(page))?)
}

fn summary(manifest: &Manifest) -> String {
    let options = &manifest.options;
    let (technique, space) = (manifest.technique.name(), &options.view_space);
    let what = match manifest.impostors.len() {
        1 => format!("A {technique} impostor"),
        several => format!("{several} {technique} impostors"),
    };
    let aim = match space {
        ViewSpace::Amid { .. } | ViewSpace::Inside { .. } => "look anywhere",
        ViewSpace::Before { .. } | ViewSpace::Around { .. } | ViewSpace::Shell { .. } => {
            "look at the centre of what is represented"
        }
    };
    format!(
        "{what} for cameras of {0} x {0} pixels and {1} degrees that {aim}, from anywhere in the view \
         {2}.",
        options.resolution,
        options.fov_degrees,
        view_space::describe(space)
    )
}

pub(super) fn cost(report: &VerifyReport) -> Vec<CostRow> {
    let (before, after) = (&report.cost.original, &report.cost.impostor);
    let row = |name, original: u64, impostor: u64| CostRow {
        name,
        original: grouped(original),
        impostor: grouped(impostor),
        ratio: match original {
            0 => "-".into(),
            _ => format!("{:.3}", impostor as f64 / original as f64),
        },
    };
    vec![
        row("triangles", before.triangles, after.triangles),
        row("draw calls", before.draw_calls, after.draw_calls),
        row(
            "geometry bytes",
            before.geometry_bytes,
            after.geometry_bytes,
        ),
        row("texture bytes", before.texture_bytes, after.texture_bytes),
    ]
}

fn worst_view(view: &ViewFigures, pictures: &ViewPictures, command: &str) -> WorstView {
    let geometry = &view.geometry;
    let [x, y, z] = view.camera.pose.eye.to_array();
    WorstView {
        view: view.view,
        eye: format!("({x:.4}, {y:.4}, {z:.4})"),
        figures: format!(
            "{} gap pixels, {} phantom pixels, {} of {} pixels missed, parallax at most {:.3} \
             pixels",
            geometry.gaps.len(),
            geometry.phantoms.len(),
            view.coverage.missed,
            view.coverage.covered,
            geometry.parallax.errors.max()
        ),
        command: format!("{command} --view {}", view.view),
        original: data_uri(&pictures.original),
        impostor: data_uri(&pictures.impostor),
        difference: data_uri(&pictures.difference),
        marked: data_uri(&pictures.marked),
    }
}

/// The view cell from above and from the side, coloured by parallax and by colour errors.
fn plots(subjects: &[Subject<'_>], dots: &[Dot], with_flip: bool) -> Vec<Plot> {
    let most = |value: fn(&Dot) -> f64| dots.iter().map(value).fold(1e-9, f64::max);
    let parallax = |dot: &Dot| dot.parallax;
    let flip = |dot: &Dot| dot.flip;
    let above = |p: DVec3| DVec2::new(p.x, -p.z);
    let side = |p: DVec3| DVec2::new(p.z, p.y);
    let scale = most(parallax);
    let unit = format!("greatest parallax, black 0 to yellow {scale:.3} pixels");
    let mut plots = vec![
        plot(
            subjects,
            dots,
            above,
            |d| parallax(d) / scale,
            format!("From above: {unit}"),
        ),
        plot(
            subjects,
            dots,
            side,
            |d| parallax(d) / scale,
            format!("From the side: {unit}"),
        ),
    ];
    if with_flip {
        let scale = most(flip);
        let unit = format!("mean FLIP, black 0 to yellow {scale:.4}");
        plots.push(plot(
            subjects,
            dots,
            above,
            |d| flip(d) / scale,
            format!("From above: {unit}"),
        ));
    }
    plots
}

/// Viewpoints and represented boxes, made flat: of one impostor in view space of the reference
/// viewpoint, of several in the world as seen against +Z.
fn plot(
    subjects: &[Subject<'_>],
    dots: &[Dot],
    flat: impl Fn(DVec3) -> DVec2,
    value: impl Fn(&Dot) -> f64,
    title: String,
) -> Plot {
    const WIDTH: f64 = 520.0;
    const HEIGHT: f64 = 320.0;
    const MARGIN: f64 = 16.0;
    let pose = match subjects {
        [one] => *one.reference(),
        _ => Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z),
    };
    let at = |point: DVec3| flat(pose.point_in_view(point));
    let boxes: Vec<_> = subjects.iter().map(|one| one.corners().map(at)).collect();
    let eyes: Vec<DVec2> = dots.iter().map(|dot| at(dot.eye)).collect();
    let bounds = |points: &[DVec2]| {
        let low = points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        [low, high]
    };
    let [low, high] = bounds(&[boxes.as_flattened(), &eyes].concat());
    let room = DVec2::new(WIDTH - 2.0 * MARGIN, HEIGHT - 2.0 * MARGIN);
    let scale = (room / (high - low).max(DVec2::splat(f64::MIN_POSITIVE))).min_element();
    let middle = (low + high) / 2.0;
    let on_page = |p: DVec2| (p - middle) * scale + DVec2::new(WIDTH, HEIGHT) / 2.0;
    let rounded = |x: f64| (x * 10.0).round() / 10.0;
    let boxes = boxes.iter().map(|corners| {
        let [from, to] = bounds(corners).map(on_page);
        PlotBox {
            x: rounded(from.x),
            y: rounded(from.y),
            width: rounded(to.x - from.x),
            height: rounded(to.y - from.y),
        }
    });
    let dots = dots.iter().zip(eyes).map(|(dot, eye)| {
        let place = on_page(eye);
        let color = colorous::INFERNO.eval_continuous(value(dot).clamp(0.0, 1.0));
        PlotDot {
            x: rounded(place.x),
            y: rounded(place.y),
            color: format!("#{color:x}"),
            label: format!(
                "view {}: parallax {:.3}, FLIP {:.4}",
                dot.view, dot.parallax, dot.flip
            ),
        }
    });
    Plot {
        title,
        width: WIDTH,
        height: HEIGHT,
        boxes: boxes.collect(),
        dots: dots.collect(),
    }
}

fn spread(report: &VerifyReport) -> Vec<SpreadRow> {
    let spread = &report.spread;
    let row = |name, summary: &Summary| SpreadRow {
        name,
        mean: format!("{:.4}", summary.mean),
        p999: format!("{:.4}", summary.p999),
        max: format!("{:.4}", summary.max),
    };
    let mut rows = vec![
        row("parallax, pixels", &spread.parallax_px),
        row("silhouette displacement, pixels", &spread.silhouette_px),
        row("missed share of a view", &spread.coverage_error),
        row("colour difference a channel", &spread.colour_difference),
        row("1 - SSIM", &spread.ssim_error),
    ];
    rows.extend(spread.flip.iter().map(|summary| row("FLIP", summary)));
    rows
}

fn beyond(beyond: Beyond) -> BeyondWords {
    BeyondWords {
        scale: format!("{:.2}", beyond.cell_scale),
        distance: format!("{:.4} m", beyond.switch_distance_m),
        coverage: format!("{:.3}", beyond.screen_coverage),
        error: format!("{:.3e} m", beyond.geometric_error_m),
    }
}

/// The edges of each impostor, from two of its viewpoints.
fn wireframe_views<'a>(subjects: &'a [Subject<'a>]) -> Vec<WireframeView<'a>> {
    let count = subjects.len() as u64;
    let of = |(number, subject): (u64, &'a Subject<'a>)| {
        wireframes(subject).map(|wireframe| WireframeView {
            name: subject.name,
            view: wireframe.index * count + number,
            place: match wireframe.index {
                0 => "the reference viewpoint",
                _ => "the corner of the cell that sees it most obliquely",
            },
            picture: data_uri(&png(&wireframe.picture)),
        })
    };
    (0..).zip(subjects).flat_map(of).collect()
}

/// All layers of an impostor, as their quads show them; `None` where the quads are none of its
/// layers, or these are larger than a bake makes any.
fn sheet<'a>(subject: &'a Subject<'_>, patches: &[Patch]) -> Option<Sheet<'a>> {
    let stack = &subject.stack;
    let texels = u64::from(stack.width) * u64::from(stack.height);
    if patches.is_empty() || texels > 1 << 28 {
        return None;
    }
    let mut of_layer = vec![Vec::new(); stack.layers.len()];
    for patch in patches {
        of_layer[patch.layer as usize].push(*patch);
    }
    let images = &subject.impostor.scene.images;
    // One at a time: all of them need not fit into memory.
    let layers = of_layer
        .iter()
        .map(|patches| compose_layer(patches, images, [stack.width, stack.height]));
    Some(Sheet {
        name: subject.name,
        picture: data_uri(&png(&contact_sheet(layers, 10, 110))),
    })
}

fn atlas(display: &Scene) -> Vec<AtlasPage> {
    let images = &display.images;
    let page = |(i, image): (usize, &farfield_scene::Image)| {
        let (width, height) = (image.width as usize, image.height as usize);
        let texels = Grid::from_cells(width, height, image.texels.clone());
        AtlasPage {
            name: format!("{i:03}"),
            size: format!("{width} x {height}"),
            picture: data_uri(&png(&contact_sheet(std::iter::once(texels), 1, 1024))),
        }
    };
    images.iter().enumerate().map(page).collect()
}

pub(super) fn facts(manifest: &Manifest, dir: &Path) -> Vec<Fact> {
    let fact = |name, value| Fact { name, value };
    let scene = match &manifest.scene {
        SceneSource::File { path, sha256 } => format!("{path}, SHA-256 {sha256}"),
        SceneSource::BuiltIn { name, size, seed } => {
            format!("built-in {name}, size {size}, seed {seed}")
        }
    };
    vec![
        fact(
            "bundle",
            format!("{}, SHA-256 {}", dir.display(), manifest.sha256),
        ),
        fact("original", scene),
        fact(
            "left out",
            match manifest.options.exclude.as_slice() {
                [] => "nothing".into(),
                names => names.join(", "),
            },
        ),
        fact("made by", {
            let generator = &manifest.generator;
            format!("{} {}", generator.name, generator.version)
        }),
    ]
}

pub(super) fn data_uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png))
}

/// Digits in groups of three.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups = digits.as_bytes().rchunks(3).rev();
    let groups: Vec<_> = groups.map(String::from_utf8_lossy).collect();
    groups.join(",")
}

/// Writes the page beside the bundle's other files, whole or not at all.
pub(super) fn write(dir: &Path, page: &str) -> Result<()> {
    let path = dir.join("report.html");
    let partial = dir.join("report.html.partial");
    std::fs::write(&partial, page)
        .and_then(|()| std::fs::rename(&partial, &path))
        .with_context(|| path.display().to_string())
}
