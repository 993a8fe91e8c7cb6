//! Layered impostors beside other representations of the same scene.

use crate::models::Model;
use crate::octahedral::{OctahedralImpostor, TexelSize, linear_bytes};
use crate::picture::{Picture, over_background, render, write_png};
use crate::planar::planar_impostor;
use crate::simplified::{Budget, Method, simplify};
use farfield_bundle::{GLTF_FILE, LayeredBody, cost};
use farfield_grid::{BitMask, Grid};
use farfield_metrics::{
    Coverage, NONE, compared_region, coverage, covered_in_any_sample, flip_errors, gap_pixels,
    layer_indices, phantom_pixels,
};
use farfield_sampling::{Textures, rasterize};
use farfield_scene::Scene;
use farfield_views::{Camera, ViewCell};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;
use xtask::{BakeOptions, Console, ViewCellSpec, bake};

/// Viewpoints, the reference viewpoint and the cell's corners first.
const VIEWS: u64 = 64;

/// That of `verify`, so that viewpoints have the same numbers.
const SEED: u64 = 0x7665_7269_6679;

/// Of the camera that impostors are made for.
const RESOLUTION: u32 = 512;
const FOV_DEGREES: f64 = 45.0;

/// Samples a pixel along each side when looking for thin things of the original.
const SAMPLES: u32 = 4;

/// The viewpoint of which pictures are written: a corner of the cell.
const PICTURED: u64 = 8;

/// Simplified in two ways each, of which the better is shown.
const EQUAL_TRIANGLES: &str = "simplified, equal triangles";
const EQUAL_BYTES: &str = "simplified, equal bytes";

/// One line of the table.
struct Row {
    name: &'static str,
    triangles: u64,
    bytes: u64,
    shown: Shown,
    notes: Vec<String>,
}

/// What is displayed.
enum Shown {
    Scene(Scene),
    Octahedral(OctahedralImpostor),
}

/// What is wrong, in all views together.
#[derive(Clone, Default)]
struct Figures {
    gaps: u64,
    /// Those of them where nothing is shown at all.
    holes: u64,
    phantoms: u64,
    coverage: Coverage,
    flip: f64,
    region: u64,
}

impl Figures {
    fn mean_flip(&self) -> f64 {
        self.flip / self.region.max(1) as f64
    }
}

/// What everything is compared for.
struct Subject<'a> {
    model: &'a Model,
    represented: [DVec3; 2],
    layered: LayeredBody,
}

impl Subject<'_> {
    fn target(&self) -> DVec3 {
        (self.represented[0] + self.represented[1]) / 2.0
    }

    fn eye(&self, view: u64) -> DVec3 {
        match view.checked_sub(1) {
            None => self.layered.pose.eye,
            Some(index) => self.model.cell.viewpoint(index, SEED),
        }
    }

    fn camera(&self, view: u64) -> Camera {
        let fov = FOV_DEGREES.to_radians();
        Camera::looking_at(self.eye(view), self.target(), fov, RESOLUTION)
    }
}

/// Prints what a model's representations cost and how wrong they look, and writes pictures of one
/// view into a folder.
///
/// * gap pixels - those that `verify` looks at closely, by the layers of our impostor: the original
///   covers the centres of the 3 x 3 neighbourhood, but nothing is shown or something at least two
///   layers too far behind
/// * holes - those of them where nothing is shown
/// * phantom pixels, coverage error - as `verify` counts them
/// * FLIP - mean at 67 pixels a degree over pixels covered by either, widened by one
#[expect(clippy::print_stdout, reason = "a table to read")]
pub(crate) fn table(model: &Model, pictures: Option<&Path>) {
    let (subject, layered) = bake_layered(model);
    let rows = rows(&subject, layered);
    let figures = measure(&subject, &rows);
    println!(
        "\n{}: {VIEWS} views of {RESOLUTION} x {RESOLUTION} pixels, {FOV_DEGREES} degrees",
        model.name
    );
    println!(
        "representation                      | triangles |      bytes | gap pixels |     holes | phantom pixels | coverage error, % |   FLIP"
    );
    println!(
        "------------------------------------|----------:|-----------:|-----------:|----------:|---------------:|------------------:|-------:"
    );
    let mut notes: Vec<&String> = Vec::new();
    let lines: Vec<(&Row, &Figures)> = rows.iter().zip(&figures).collect();
    for ways in lines.chunk_by(|a, b| a.0.name == b.0.name) {
        let better = ways
            .iter()
            .min_by(|a, b| a.1.mean_flip().total_cmp(&b.1.mean_flip()));
        let (row, figures) = better.expect("every line has a way");
        let marks = row.notes.iter().map(|note| {
            let known = notes.iter().position(|known| *known == note);
            let number = known.unwrap_or_else(|| {
                notes.push(note);
                notes.len() - 1
            });
            format!(" [{}]", number + 1)
        });
        println!(
            "{:<35} | {:>9} | {:>10} | {:>10} | {:>9} | {:>14} | {:>17.3} | {:>6.4}",
            row.name.to_owned() + &marks.collect::<String>(),
            row.triangles,
            row.bytes,
            figures.gaps,
            figures.holes,
            figures.phantoms,
            figures.coverage.error() * 100.0,
            figures.mean_flip(),
        );
    }
    for (i, note) in notes.iter().enumerate() {
        println!("[{}] {note}", i + 1);
    }
    if let Some(folder) = pictures {
        write_pictures(&subject, &rows, folder);
    }
}

/// Bakes a model and reads back what any viewer would show.
fn bake_layered(model: &Model) -> (Subject<'_>, Scene) {
    let ViewCell::Box { center, size } = model.cell else {
        unreachable!("the models' view cells are boxes");
    };
    let folder = tempfile::tempdir().expect("there is room for a temporary folder");
    let options = BakeOptions {
        view_cell: Some(ViewCellSpec::Box { center, size }),
        resolution: RESOLUTION,
        fov_degrees: FOV_DEGREES,
        out: Some(folder.path().to_owned()),
        ..BakeOptions::new(model.source.clone())
    };
    bake(&options, &Console::Silent).expect("the model bakes");
    let manifest = farfield_bundle::read(folder.path()).expect("the bundle is sound");
    let display = farfield_import::read(&folder.path().join(GLTF_FILE));
    let impostor = &manifest.impostors[0];
    let layered = impostor.body.layers().expect("it is layered").clone();
    let subject = Subject {
        model,
        represented: impostor.represented,
        layered,
    };
    (subject, display.expect("the impostor can be read").scene)
}

fn rows(subject: &Subject<'_>, layered: Scene) -> Vec<Row> {
    let original = &subject.model.scene;
    let layered = scene_row("layered impostor", layered, Vec::new());
    let (triangles, bytes) = (layered.triangles, layered.bytes);
    let simple = |name, method, budget| {
        let simple = simplify(original, method, budget);
        let mut notes = simple.notes;
        if method == Method::CrossingSeams {
            notes.push("collapses cross seams between attributes: better here than without".into());
        }
        scene_row(name, simple.scene, notes)
    };
    let recording = Camera {
        pose: subject.layered.pose,
        extent: subject.layered.extent,
        width: subject.layered.width,
        height: subject.layered.height,
    };
    let planar = planar_impostor(original, &recording, subject.target());
    // The side of a texel of the first layer.
    let texel = recording.pixel_size().x * subject.layered.layers[0].depth;
    vec![
        scene_row("original", original.clone(), Vec::new()),
        layered,
        simple(
            EQUAL_TRIANGLES,
            Method::KeepingSeams,
            Budget::Triangles(triangles),
        ),
        simple(
            EQUAL_TRIANGLES,
            Method::CrossingSeams,
            Budget::Triangles(triangles),
        ),
        simple(EQUAL_BYTES, Method::KeepingSeams, Budget::Bytes(bytes)),
        simple(EQUAL_BYTES, Method::CrossingSeams, Budget::Bytes(bytes)),
        simple(
            "sloppy, equal triangles",
            Method::Sloppy,
            Budget::Triangles(triangles),
        ),
        simple("sloppy, equal bytes", Method::Sloppy, Budget::Bytes(bytes)),
        scene_row("planar impostor", planar, Vec::new()),
        octahedral_row(
            subject,
            "octahedral 8 x 8, equal bytes",
            TexelSize::OfAtlas(bytes),
        ),
        octahedral_row(
            subject,
            "octahedral 8 x 8, unmagnified",
            TexelSize::Metres(texel),
        ),
    ]
}

fn scene_row(name: &'static str, scene: Scene, notes: Vec<String>) -> Row {
    let cost = cost(&scene);
    Row {
        name,
        triangles: cost.triangles,
        bytes: cost.geometry_bytes + cost.texture_bytes,
        shown: Shown::Scene(scene),
        notes,
    }
}

fn octahedral_row(subject: &Subject<'_>, name: &'static str, texel: TexelSize) -> Row {
    let target = subject.target();
    let eyes: Vec<DVec3> = (0..VIEWS).map(|view| subject.eye(view)).collect();
    let pole = subject.model.cell.center() - target;
    let impostor = OctahedralImpostor::new(&subject.model.scene, target, pole, texel, &eyes);
    let note = "RGBA and a byte of depth a texel, frames over the hemisphere around the view cell and \
                tight around the scene, the nearest three blended after a step of parallax";
    Row {
        name,
        triangles: 2,
        bytes: impostor.bytes(),
        shown: Shown::Octahedral(impostor),
        notes: vec![note.into()],
    }
}

/// What a row is rendered with.
struct Renderer<'a> {
    row: &'a Row,
    textures: Option<Textures<'a>>,
    linear: [f32; 256],
}

impl<'a> Renderer<'a> {
    fn new(row: &'a Row) -> Self {
        let textures = match &row.shown {
            Shown::Scene(scene) => Some(Textures::new(scene)),
            Shown::Octahedral(_) => None,
        };
        Self {
            row,
            textures,
            linear: linear_bytes(),
        }
    }

    fn render(&self, camera: &Camera) -> Picture {
        match (&self.row.shown, &self.textures) {
            (Shown::Scene(scene), Some(textures)) => render(scene, textures, camera),
            (Shown::Octahedral(impostor), _) => impostor.render(camera, &self.linear),
            (Shown::Scene(_), None) => unreachable!("scenes have their textures prepared"),
        }
    }
}

/// Looks at all rows from all viewpoints; the first row is the original.
fn measure(subject: &Subject<'_>, rows: &[Row]) -> Vec<Figures> {
    let renderers: Vec<Renderer<'_>> = rows.iter().map(Renderer::new).collect();
    let views: Vec<Vec<Figures>> = (0..VIEWS)
        .into_par_iter()
        .map(|view| {
            let camera = subject.camera(view);
            let original = renderers[0].render(&camera);
            let fine = Camera {
                width: camera.width * SAMPLES,
                height: camera.height * SAMPLES,
                ..camera
            };
            let textures = renderers[0]
                .textures
                .as_ref()
                .expect("the original is a scene");
            let samples = rasterize(&subject.model.scene, textures, &fine);
            let covered = covered_in_any_sample(&samples.objects, SAMPLES as usize);
            let look = |renderer: &Renderer<'_>| {
                compare(
                    subject,
                    &camera,
                    &original,
                    &covered,
                    &renderer.render(&camera),
                )
            };
            renderers.iter().map(look).collect()
        })
        .collect();
    let mut sums = vec![Figures::default(); rows.len()];
    for (sum, figures) in views.iter().flat_map(|view| (0..).zip(view)) {
        let sum: &mut Figures = &mut sums[sum];
        sum.gaps += figures.gaps;
        sum.holes += figures.holes;
        sum.phantoms += figures.phantoms;
        sum.coverage.covered += figures.coverage.covered;
        sum.coverage.missed += figures.coverage.missed;
        sum.flip += figures.flip;
        sum.region += figures.region;
    }
    sums
}

/// What one view shows wrong.
///
/// * `covered` - the pixels of which the original covers a sample
fn compare(
    subject: &Subject<'_>,
    camera: &Camera,
    original: &Picture,
    covered: &BitMask,
    shown: &Picture,
) -> Figures {
    let layered = &subject.layered;
    let borders = layered.borders();
    let layers = |depth: &Grid<f64>| layer_indices(depth, camera, &layered.pose, &borders);
    let gaps = gap_pixels(&layers(&original.depth), &layers(&shown.depth), 1);
    let is_hole = |[x, y]: &&[u32; 2]| shown.ids[(*x as usize, *y as usize)] == NONE;
    let region = compared_region(&original.ids, &shown.ids);
    let [before, after] = [original, shown].map(over_background);
    let flip = flip_errors(&before, &after, &region).errors;
    Figures {
        gaps: gaps.len() as u64,
        holes: gaps.iter().filter(is_hole).count() as u64,
        phantoms: phantom_pixels(covered, &shown.ids).len() as u64,
        coverage: coverage(&original.ids, &shown.ids),
        flip: flip.mean() * flip.count() as f64,
        region: region.count() as u64,
    }
}

/// Writes what every row shows of one view.
fn write_pictures(subject: &Subject<'_>, rows: &[Row], folder: &Path) {
    std::fs::create_dir_all(folder).expect("the folder can be made");
    let camera = subject.camera(PICTURED);
    for (i, row) in rows.iter().enumerate() {
        let picture = Renderer::new(row).render(&camera);
        let name = row.name.replace(", ", "-").replace(' ', "-");
        let path = folder.join(format!("{}-{i}-{name}.png", subject.model.name));
        write_png(&path, &over_background(&picture));
    }
}
