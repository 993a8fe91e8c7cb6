//! How time and memory of a bake grow with the scene.

use std::path::Path;
use std::process::{Command, Stdio};
use xtask::{BakeOptions, BakeReport, BuiltIn, Console, SceneChoice, bake};

/// Triangles that towns are asked for.
const TRIANGLES: [u32; 3] = [100_000, 1_000_000, 10_000_000];

/// Bakes of each town: the fastest counts, as others work on the machine too.
const REPEATS: usize = 3;

/// The word that has one town baked.
pub(crate) const ONE: &str = "growth-of";

/// Prints seconds and memory for towns of 10^5, 10^6 and 10^7 triangles, and by how much they grow
/// from one to the next; at most as much as the triangles if all is well.
///
/// Each is baked in a process of its own: the most memory that a process had at any time says
/// nothing about what came later.
pub(crate) fn table() {
    println!(
        "\n| town | triangles | bake | of its predecessor's | peak memory | of its predecessor's |"
    );
    println!("|---|---|---|---|---|---|");
    let mut before: Option<[f64; 3]> = None;
    for asked in TRIANGLES {
        let bakes = (0..REPEATS).map(|_| bake_in_own_process(asked));
        let best = bakes.reduce(|a, b| if b[1] < a[1] { b } else { a });
        let [triangles, seconds, bytes] = best.expect("there are repeats");
        let times = |now: f64, of: usize| {
            before.map_or(String::new(), |before| {
                format!("{:.1} times", now / before[of])
            })
        };
        println!(
            "| `town:{asked:.0e}` | {triangles} | {seconds:.1} s | {} | {:.0} MB | {} |",
            times(seconds, 1),
            bytes / 1e6,
            times(bytes, 2),
            asked = f64::from(asked),
        );
        before = Some([triangles, seconds, bytes]);
    }
}

/// Bakes a town and prints what [`bake_in_own_process`] wants to know.
pub(crate) fn bake_one(asked: &str) {
    let folder = tempfile::tempdir().expect("there is room for a temporary folder");
    let report = bake_town(
        asked.parse().expect("the town's size is a number"),
        folder.path(),
    );
    println!(
        "{} {} {}",
        report.triangles_in, report.seconds, report.peak_rss_bytes
    );
}

fn bake_town(triangles: u32, out: &Path) -> BakeReport {
    let options = BakeOptions {
        out: Some(out.to_owned()),
        ..BakeOptions::new(SceneChoice::BuiltIn(BuiltIn::Town { triangles, seed: 1 }))
    };
    bake(&options, &Console::Silent).expect("the town bakes")
}

/// Triangles, seconds and bytes of a bake.
fn bake_in_own_process(triangles: u32) -> [f64; 3] {
    let program = std::env::current_exe().expect("the bench has a file");
    let output = Command::new(program)
        .args([ONE, &triangles.to_string()])
        .stderr(Stdio::inherit())
        .output()
        .expect("the bench starts again");
    assert!(output.status.success(), "the bake of {triangles} fails");
    let text = String::from_utf8(output.stdout).expect("the bench writes numbers");
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|number| number.parse().expect("the bench writes numbers"))
        .collect();
    numbers.try_into().expect("the bench writes three numbers")
}
