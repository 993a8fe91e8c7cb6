//! Textured depth meshes beside layered impostors, as in Table 4.1 of Jeschke, 2005.

use crate::models::{self, Model};
use farfield_views::ViewCell;
use glam::DVec3;
use xtask::{BakeOptions, BakeReport, Console, Making, ViewCellSpec, bake};

/// What the paper tells of its house: distance, layers, polygons of the mesh before and after it is
/// simplified, its kilobytes and seconds, polygons and kilobytes of the layered impostor.
const PAPER: [[f64; 8]; 7] = [
    [90.0, 110.0, 210_104.0, 418.0, 154.2, 89.2, 1176.0, 329.0],
    [110.0, 81.0, 139_588.0, 203.0, 89.7, 62.0, 700.0, 198.0],
    [140.0, 56.0, 83_928.0, 65.0, 49.7, 24.5, 372.0, 107.0],
    [180.0, 34.0, 47_738.0, 35.0, 26.4, 7.9, 178.0, 57.4],
    [250.0, 19.0, 23_176.0, 17.0, 12.3, 3.2, 82.0, 25.5],
    [500.0, 5.0, 5430.0, 8.0, 3.46, 0.67, 16.0, 4.5],
    [1000.0, 1.0, 1078.0, 3.0, 0.64, 0.101, 2.0, 0.67],
];

/// Bytes that a quad is worth in the settings that are tried for the layered impostor.
const PRICES: [f64; 5] = [104.0, 416.0, 1664.0, 6656.0, 26_624.0];

/// Prints the table of the built-in house in front of a cell of 100 m, and one line for each model.
pub(crate) fn tables() {
    println!(
        "\nTextured depth meshes (voxels enlarged by 1.5, and 2), layered impostors with the fewest bytes, \
         and with the fewest triangles within twice these; the paper's figures in brackets. kB are \
         pages and geometry.\n"
    );
    println!(
        "| scene | layers | initial | triangles, 1.5 | kB | s | triangles, 2 | kB | layered, kB | kB \
         | layered, triangles | kB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for paper in PAPER {
        let house = models::house();
        let [min, max] = house.scene.bounds().expect("the house has triangles");
        let center = DVec3::new((min.x + max.x) / 2.0, 50.0, max.z + paper[0] + 50.0);
        let cell = ViewCell::Box {
            center,
            size: DVec3::splat(100.0),
        };
        row(
            &format!("house at {} m", paper[0]),
            &Model { cell, ..house },
            Some(paper),
        );
    }
    let all = models::read(&models::DENSE)
        .into_iter()
        .chain(models::read(&models::CITY))
        .chain(models::read(&models::TEXTURED));
    for model in all {
        row(model.name, &model, None);
    }
}

fn row(name: &str, model: &Model, paper: Option<[f64; 8]>) {
    let [near, far] = [1.5, 2.0].map(|enlarged| baked(model, Making::Tdm { enlarged }));
    let layered = PRICES.map(|bytes_per_quad| baked(model, Making::Layered { bytes_per_quad }));
    let bytes = |report: &BakeReport| report.atlas_bytes + report.geometry_bytes;
    let least = layered
        .iter()
        .min_by_key(|report| bytes(report))
        .expect("prices are given");
    let within = layered
        .iter()
        .filter(|report| bytes(report) <= 2 * bytes(least));
    let fewest = within
        .min_by_key(|report| report.triangles_out)
        .expect("the least is one");
    let beside = |figure: String, at: usize| match paper {
        Some(paper) => format!("{figure} [{}]", paper[at]),
        None => figure,
    };
    let kilobytes = |report: &BakeReport| format!("{:.1}", bytes(report) as f64 / 1000.0);
    println!(
        "| {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
        beside(near.layers.to_string(), 1),
        beside(near.initial_triangles.to_string(), 2),
        beside(near.triangles_out.to_string(), 3),
        beside(kilobytes(&near), 4),
        beside(format!("{:.2}", near.seconds), 5),
        far.triangles_out,
        kilobytes(&far),
        beside(least.triangles_out.to_string(), 6),
        beside(kilobytes(least), 7),
        fewest.triangles_out,
        kilobytes(fewest),
    );
}

fn baked(model: &Model, making: Making) -> BakeReport {
    let ViewCell::Box { center, size } = model.cell else {
        unreachable!("the models' view cells are boxes");
    };
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let options = BakeOptions {
        making,
        view_cell: Some(ViewCellSpec::Box { center, size }),
        out: Some(folder.path().join("bundle")),
        ..BakeOptions::new(model.source.clone())
    };
    bake(&options, &Console::Silent).expect("the model can be baked")
}
