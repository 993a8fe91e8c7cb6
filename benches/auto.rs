//! What `bake --technique auto` predicts, beside what is made; and its constants, fitted again.

use crate::models::settings;
use farfield_sampling::Textures;
use farfield_views::ViewCell;
use std::path::PathBuf;
use xtask::auto::{Powers, Survey, TRIANGLE_BYTES, layered_bytes, survey, tdm_bytes};
use xtask::{BakeOptions, BuiltIn, Console, Device, Making, SceneChoice, ViewCellSpec, bake};

/// A scene, and its view cell as on the command line.
type Entry = (&'static str, &'static str);

/// What the constants are fitted on.
const FITTED: [Entry; 23] = [
    ("house", "box:0,10,70:20,20,20"),
    ("house", "box:0,50,160:100,100,100"),
    ("house", "box:0,50,180:100,100,100"),
    ("house", "box:0,50,210:100,100,100"),
    ("house", "box:0,50,320:100,100,100"),
    ("house", "box:0,50,420:100,100,100"),
    ("house", "box:0,50,1070:100,100,100"),
    ("stanford_bunny.glb", "box:0,0.11,0.45:0.2,0.2,0.2"),
    ("stanford_armadillo_86k.glb", "box:0,0,3:1,1,1"),
    ("stanford_dragon.glb", "box:0,0.12,0.5:0.15,0.15,0.15"),
    ("2CylinderEngine.glb", "box:0,0,1200:500,500,500"),
    ("DiffuseTransmissionPlant.glb", "box:0,0.4,1.5:0.3,0.3,0.3"),
    ("city_tokyo_lod2_b.glb", "box:0,25,300:60,40,60"),
    ("city_lyon1_lod1.glb", "box:0,400,2600:600,500,600"),
    ("tree_oak_large.glb", "box:0,50,220:40,40,40"),
    ("tree_pine_large.glb", "box:0,35,140:30,30,30"),
    ("FlightHelmet.glb", "box:0,0.36,1.6:0.4,0.4,0.4"),
    ("StainedGlassLamp.glb", "box:0,0.35,1.6:0.4,0.4,0.4"),
    ("japanese-bridge-garden.glb", "box:0,5,28:8,8,8"),
    ("CesiumMilkTruck.glb", "box:0,1.3,9:3,2,3"),
    ("lowpoly_tree_lime.glb", "box:14,2.5,-3:3,3,3"),
    ("lowpoly_tree_spruce.glb", "box:-14,3,-3:3,3,3"),
    ("pine_tree.glb", "box:0,40,180:40,40,40"),
];

/// What they are tried on.
const HELD_OUT: [Entry; 12] = [
    ("house", "box:0,50,130:100,100,100"),
    ("house", "box:0,50,250:100,100,100"),
    ("house", "box:0,50,570:100,100,100"),
    ("house", "box:0,12,110:20,20,20"),
    ("house", "box:0,12,200:40,40,40"),
    ("stanford_bunny.glb", "box:0,0.11,1.5:0.5,0.5,0.5"),
    ("stanford_bunny.glb", "box:0,0.11,0.3:0.2,0.2,0.2"),
    ("2CylinderEngine.glb", "box:0,0,4000:1000,1000,1000"),
    ("city_lyon1_lod1.glb", "box:0,200,1900:800,300,800"),
    ("city_tokyo_lod2_b.glb", "box:0,25,900:200,100,200"),
    ("japanese-bridge-garden.glb", "box:0,8,80:20,10,20"),
    ("CesiumMilkTruck.glb", "box:0,1.3,20:6,3,6"),
];

/// What was told of a bake, and what it cost as quads and as a mesh.
struct Row {
    survey: Survey,
    cost: [f64; 2],
}

/// Prints what is predicted and made, and the constants fitted on the first list again.
pub(crate) fn tables() {
    println!(
        "\nBytes of pages, and {TRIANGLE_BYTES} a triangle, in kB: made, and in brackets predicted.\n"
    );
    println!(
        "| scene | view cell | texels | rectangles | turns | triangles | layered | mesh | right |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let fitted = rows(&FITTED);
    let held_out = rows(&HELD_OUT);
    for (name, rows) in [("fitted", &fitted), ("held out", &held_out)] {
        let right = rows.iter().filter(|row| is_right(row)).count();
        let off = [0, 1].map(|i| {
            let all = rows
                .iter()
                .map(|row| (predicted(&row.survey)[i] / row.cost[i] - 1.0).abs());
            all.sum::<f64>() / rows.len().max(1) as f64
        });
        println!(
            "{name}: right in {right} of {}, off by {:.0} % for layers and {:.0} % for meshes on average",
            rows.len(),
            off[0] * 100.0,
            off[1] * 100.0
        );
    }
    println!(
        "layered {:?}\ntdm {:?}",
        fit(&fitted, |row| (
            [row.survey.texels, row.survey.rectangles],
            row.cost[0]
        )),
        fit(&fitted, |row| (
            [row.survey.turns, row.survey.triangles],
            row.cost[1]
        )),
    );
}

fn predicted(survey: &Survey) -> [f64; 2] {
    [layered_bytes(survey), tdm_bytes(survey)]
}

fn is_right(row: &Row) -> bool {
    let [layered, mesh] = predicted(&row.survey);
    (layered <= mesh) == (row.cost[0] <= row.cost[1])
}

/// Those of the entries that are there, each baked and printed.
fn rows(entries: &[Entry]) -> Vec<Row> {
    let folder = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let mut rows = Vec::new();
    for (name, cell) in entries {
        let path = folder.as_ref().map(|folder| folder.join(name));
        let source = match (*name, path) {
            ("house", _) => SceneChoice::BuiltIn(BuiltIn::House),
            (_, Some(path)) if path.exists() => SceneChoice::File(path),
            _ => {
                println!("SKIPPED: {name} is in no folder named by FARFIELD_MODELS");
                continue;
            }
        };
        let cell: ViewCellSpec = cell.parse().expect("the view cells are written well");
        let row = Row {
            survey: surveyed(&source, &cell),
            cost: [
                Making::Layered {
                    bytes_per_quad: 104.0,
                },
                Making::Tdm { enlarged: 1.5 },
            ]
            .map(|making| cost(&source, &cell, making)),
        };
        let told = predicted(&row.survey);
        println!(
            "| {name} | {cell:?} | {} | {:.0} | {} | {} | {:.0} [{:.0}] | {:.0} [{:.0}] | {} |",
            row.survey.texels,
            row.survey.rectangles,
            row.survey.turns,
            row.survey.triangles,
            row.cost[0] / 1e3,
            told[0] / 1e3,
            row.cost[1] / 1e3,
            told[1] / 1e3,
            is_right(&row)
        );
        rows.push(row);
    }
    rows
}

fn surveyed(source: &SceneChoice, cell: &ViewCellSpec) -> Survey {
    let ViewCellSpec::Box { center, size } = *cell else {
        unreachable!("the view cells are boxes");
    };
    let scene = match source {
        SceneChoice::File(path) => farfield_import::read(path).expect("it can be read").scene,
        SceneChoice::BuiltIn(_) => farfield_town::house(0),
    };
    let settings = settings(&scene, ViewCell::Box { center, size });
    let (textures, device) = (Textures::new(&scene), Device::cpu());
    survey(&scene, &textures, &settings, &device, &Console::Silent)
        .expect("the cell lies before the scene")
}

fn cost(source: &SceneChoice, cell: &ViewCellSpec, making: Making) -> f64 {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let options = BakeOptions {
        making,
        view_cell: Some(*cell),
        out: Some(folder.path().join("bundle")),
        ..BakeOptions::new(source.clone())
    };
    let report = bake(&options, &Console::Silent).expect("the scene can be baked");
    (report.atlas_bytes + TRIANGLE_BYTES * report.triangles_out) as f64
}

/// The powers of two counts that come nearest to a cost: least squares of logarithms.
fn fit(rows: &[Row], of: impl Fn(&Row) -> ([f64; 2], f64)) -> Powers {
    let mut normal = glam::DMat3::ZERO;
    let mut right = glam::DVec3::ZERO;
    for (counts, cost) in rows.iter().map(of) {
        let known = glam::DVec3::new(1.0, counts[0].ln(), counts[1].ln());
        normal += glam::DMat3::from_cols(known * known.x, known * known.y, known * known.z);
        right += known * cost.ln();
    }
    let found = normal.inverse() * right;
    Powers {
        factor: found.x.exp(),
        exponents: [found.y, found.z],
    }
}
