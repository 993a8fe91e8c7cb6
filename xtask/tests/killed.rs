//! A bake that is killed leaves the old bundle or the new one, whole.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Bakes that are killed.
const KILLED: u32 = 100;

/// A triangle.
const SCENE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Starts a bake of the scene in a folder into `bundle` beside it.
fn start(folder: &Path, resolution: u32) -> Child {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["bake", "scene.obj", "--out", "bundle", "--resolution"])
        .arg(resolution.to_string())
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

/// Bakes to the end; returns the manifest's checksum and how long it took.
fn bake(folder: &Path, resolution: u32) -> (String, Duration) {
    let begin = Instant::now();
    let status = start(folder, resolution).wait().unwrap();
    assert!(status.success());
    let took = begin.elapsed();
    (sha256(folder), took)
}

/// The checksum of the bundle's manifest, after all of the bundle was found as it says.
fn sha256(folder: &Path) -> String {
    farfield_bundle::read(&folder.join("bundle"))
        .unwrap()
        .sha256
}

/// Whenever a bake is killed, the bundle it was to replace is there as it was, or the new one is;
/// what is left beside it is in nobody's way, and gone after the next bake.
#[test]
fn a_killed_bake_leaves_the_old_bundle_or_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scene.obj"), SCENE).unwrap();
    let resolutions = [16, 17];
    let (first, _) = bake(folder, resolutions[0]);
    let (second, took) = bake(folder, resolutions[1]);
    assert_ne!(first, second);

    let (mut before, mut killed) = (second.clone(), 0);
    for i in 0..KILLED {
        // Whichever is not there.
        let resolution = resolutions[usize::from(before == first)];
        let mut child = start(folder, resolution);
        // Spread evenly, in no order, over twice what a bake took: some come to their end.
        let share = (f64::from(i) * 0.618_033_988_749_895).fract();
        std::thread::sleep(took.mul_f64(2.0 * share));
        child.kill().unwrap();
        killed += u32::from(!child.wait().unwrap().success());

        let found = sha256(folder);
        assert!(found == first || found == second);
        before = found;
    }
    // The first is killed at once; whether all others are depends on the machine.
    assert!(killed > 0);

    let resolution = resolutions[usize::from(before == first)];
    let (found, _) = bake(folder, resolution);
    assert!(found == first || found == second);
    assert_ne!(found, before);
    // Where folders cannot be locked, none is removed.
    if cfg!(unix) {
        assert_eq!(
            fs::read_dir(folder).unwrap().count(),
            2,
            "something is left"
        );
    }
}
