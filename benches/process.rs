//! Bakes in processes of their own: the most memory that a process had at any time says nothing about
//! what came later.

use std::process::Command;
use xtask::{BakeOptions, Console, bake};

/// What a bake took.
pub(crate) struct Measured {
    pub(crate) triangles: u64,
    pub(crate) seconds: f64,
    pub(crate) peak_bytes: f64,
    /// Names and seconds of its stages, in their order; those that came again are added up.
    pub(crate) stages: Vec<(String, f64)>,
}

/// Bakes into a temporary folder, and prints what [`measure`] wants to know.
pub(crate) fn bake_here(options: BakeOptions) {
    let folder = tempfile::tempdir().expect("there is room for a temporary folder");
    let options = BakeOptions {
        out: Some(folder.path().to_owned()),
        ..options
    };
    // Not silent: the stages' times are read from what it says.
    let report = bake(&options, &Console::Stderr).expect("the scene bakes");
    println!(
        "{} {} {}",
        report.triangles_in, report.seconds, report.peak_rss_bytes
    );
}

/// Starts this program again with a word and an argument that make it [bake](bake_here), as often as is
/// asked for: the fastest counts, as others work on the machine too.
pub(crate) fn measure(word: &str, argument: &str, repeats: usize) -> Measured {
    let runs = (0..repeats).map(|_| run(word, argument));
    let fastest = runs.min_by(|a, b| a.seconds.total_cmp(&b.seconds));
    fastest.expect("there are repeats")
}

fn run(word: &str, argument: &str) -> Measured {
    let program = std::env::current_exe().expect("the bench has a file");
    let output = Command::new(program)
        .args([word, argument])
        .output()
        .expect("the bench starts again");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{word} {argument} fails: {said}");
    let text = String::from_utf8(output.stdout).expect("the bench writes numbers");
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|number| number.parse().expect("the bench writes numbers"))
        .collect();
    let [triangles, seconds, peak_bytes] = numbers[..] else {
        panic!("the bench writes three numbers, not {text}");
    };
    let mut stages: Vec<(String, f64)> = Vec::new();
    for (name, seconds) in said.lines().filter_map(stage) {
        match stages.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += seconds,
            None => stages.push((name, seconds)),
        }
    }
    Measured {
        triangles: triangles as u64,
        seconds,
        peak_bytes,
        stages,
    }
}

/// Name and seconds, of a line such as `  grow quads   0.012 s   40 MB at most`.
fn stage(line: &str) -> Option<(String, f64)> {
    let before_memory = line.strip_suffix(" MB at most")?.rsplit_once(" s ")?.0;
    let (name, seconds) = before_memory.trim().rsplit_once(' ')?;
    Some((name.trim().to_owned(), seconds.parse().ok()?))
}
