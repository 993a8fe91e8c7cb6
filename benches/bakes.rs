//! Time and memory of whole bakes of real models, stage by stage, beside what is wished for.

use crate::models;
use crate::process::{self, Measured};
use xtask::{BakeOptions, SceneChoice};

/// A model's file without its ending, its view cell, and the seconds that its bake should stay below on
/// two cores, from the scene as it was read to the bundle as it is written.
const BAKES: [(&str, &str, f64); 3] = [
    ("stanford_dragon", "box:0,0.12,0.5:0.15,0.15,0.15", 2.0),
    ("stanford_armadillo_86k", "box:0,0,3:1,1,1", 0.5),
    ("stanford_armadillo_86k", "shaft:1,0.3,-1:15:2.5", 0.5),
];

/// Bakes of each model.
const REPEATS: usize = 5;

/// The word that has one model baked.
pub(crate) const ONE: &str = "bake-of";

/// The stage that is over before the time is taken.
const READ: &str = "read";

/// Prints seconds without reading, most memory, and each stage's share of these seconds.
pub(crate) fn table() {
    println!(
        "\nBakes for 512 x 512 pixels, on {} threads",
        rayon::current_num_threads()
    );
    let mut is_first = true;
    for (number, (name, cell, goal)) in BAKES.iter().enumerate() {
        if models::file(name).is_none() {
            continue;
        }
        let measured = process::measure(ONE, &number.to_string(), REPEATS);
        let (read, others): (Vec<_>, Vec<_>) = measured
            .stages
            .iter()
            .partition(|(stage, _)| stage.as_str() == READ);
        if is_first {
            let names: Vec<&str> = others.iter().map(|(name, _)| name.as_str()).collect();
            println!(
                "| model | view cell | triangles | read | bake | goal | peak memory | {} | what is between them |",
                names.join(" | ")
            );
            println!("|{}", "---|".repeat(8 + names.len()));
            is_first = false;
        }
        let read: f64 = read.iter().map(|(_, seconds)| seconds).sum();
        let Measured {
            triangles,
            seconds,
            peak_bytes,
            ..
        } = measured;
        let bake = seconds - read;
        let between = bake - others.iter().map(|(_, seconds)| seconds).sum::<f64>();
        let all = others.iter().map(|(_, seconds)| *seconds).chain([between]);
        let shares: Vec<String> = all
            .map(|seconds| format!("{:.0} %", seconds / bake * 100.0))
            .collect();
        println!(
            "| {name} | `{cell}` | {triangles} | {read:.2} s | {bake:.2} s | {goal} s | {:.0} MB | {} |",
            peak_bytes / 1e6,
            shares.join(" | ")
        );
    }
}

/// Bakes the model of a number.
pub(crate) fn bake_one(number: &str) {
    let number: usize = number.parse().expect("models have numbers");
    let (name, cell, _) = BAKES[number];
    let file = models::file(name).expect("the model was there");
    process::bake_here(BakeOptions {
        view_cell: Some(cell.parse().expect("the bench names view cells")),
        ..BakeOptions::new(SceneChoice::File(file))
    });
}
