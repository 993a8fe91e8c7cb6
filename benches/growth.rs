//! How time and memory of a bake grow with the scene.

use crate::process::{self, Measured};
use xtask::{BakeOptions, BuiltIn, SceneChoice};

/// Triangles that towns are asked for.
const TRIANGLES: [u32; 3] = [100_000, 1_000_000, 10_000_000];

/// Bakes of each town.
const REPEATS: usize = 3;

/// The word that has one town baked.
pub(crate) const ONE: &str = "growth-of";

/// Prints seconds and memory for towns of 10^5, 10^6 and 10^7 triangles, and by how much they grow
/// from one to the next; at most as much as the triangles if all is well.
pub(crate) fn table() {
    println!(
        "\n| town | triangles | bake | of its predecessor's | peak memory | of its predecessor's |"
    );
    println!("|---|---|---|---|---|---|");
    let mut before: Option<Measured> = None;
    for asked in TRIANGLES {
        let measured = process::measure(ONE, &asked.to_string(), REPEATS);
        let times = |of: fn(&Measured) -> f64| {
            before.as_ref().map_or(String::new(), |before| {
                format!("{:.1} times", of(&measured) / of(before))
            })
        };
        println!(
            "| `town:{asked:.0e}` | {} | {:.1} s | {} | {:.0} MB | {} |",
            measured.triangles,
            measured.seconds,
            times(|bake| bake.seconds),
            measured.peak_bytes / 1e6,
            times(|bake| bake.peak_bytes),
            asked = f64::from(asked),
        );
        before = Some(measured);
    }
}

/// Bakes a town of so many triangles.
pub(crate) fn bake_one(asked: &str) {
    let triangles = asked.parse().expect("the town's size is a number");
    let town = BuiltIn::Town { triangles, seed: 1 };
    process::bake_here(BakeOptions::new(SceneChoice::BuiltIn(town)));
}
