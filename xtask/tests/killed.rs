//! A bake that is killed leaves the old bundle or the new one, whole.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Bakes that are killed at least, and how many are started at most: some come to their end before.
const KILLED: u32 = 100;
const STARTED: u32 = 300;

/// Corners along each side of the scene.
const SIDE: u32 = 24;

/// A sheet so bumpy that its bake takes time for every stage, and has several pages.
fn scene() -> String {
    let mut text = String::new();
    for i in 0..SIDE * SIDE {
        let (x, y) = (i % SIDE, i / SIDE);
        let _ = writeln!(text, "v {x} {y} {}", (x * 7 + y * 3) % 11);
    }
    for i in 0..(SIDE - 1) * (SIDE - 1) {
        let a = i / (SIDE - 1) * SIDE + i % (SIDE - 1) + 1;
        let _ = writeln!(text, "f {a} {} {} {}", a + 1, a + SIDE + 1, a + SIDE);
    }
    text
}

/// Starts a bake of the scene in a folder into `bundle` beside it.
fn start(folder: &Path, resolution: u32) -> Child {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["bake", "scene.obj", "--out", "bundle"])
        .args(["--page-size", "144", "--resolution"])
        .arg(resolution.to_string())
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

/// The checksum of the bundle's manifest, after all of the bundle was found as it says.
fn sha256(folder: &Path) -> String {
    farfield_bundle::read(&folder.join("bundle"))
        .unwrap()
        .sha256
}

/// What is in a folder.
fn names(folder: &Path) -> BTreeSet<OsString> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name()).collect()
}

/// Waits until a bake has ended, or begins to write: something new is in the folder. Returns
/// whether it writes.
fn writes(child: &mut Child, folder: &Path, before: &BTreeSet<OsString>) -> bool {
    loop {
        if names(folder).difference(before).next().is_some() {
            return true;
        }
        if child.try_wait().unwrap().is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_micros(100));
    }
}

/// Bakes to the end; returns the manifest's checksum and how long it took until writing began, and
/// from then on.
fn bake(folder: &Path, resolution: u32) -> (String, [Duration; 2]) {
    let (begin, before) = (Instant::now(), names(folder));
    let mut child = start(folder, resolution);
    writes(&mut child, folder, &before);
    let until_writing = begin.elapsed();
    assert!(child.wait().unwrap().success());
    (
        sha256(folder),
        [until_writing, begin.elapsed() - until_writing],
    )
}

/// Whenever a bake is killed, the bundle it was to replace is there as it was, or the new one is;
/// what is left beside it is in nobody's way, and gone after the next bake.
#[test]
fn a_killed_bake_leaves_the_old_bundle_or_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scene.obj"), scene()).unwrap();
    let resolutions = [96, 97];
    let (first, _) = bake(folder, resolutions[0]);
    let (second, [until_writing, writing]) = bake(folder, resolutions[1]);
    assert_ne!(first, second);

    let mut before = second.clone();
    // Before anything was written, while it was, and after the new bundle had taken the old one's
    // place.
    let mut killed = [0; 3];
    let is_enough = |killed: &[u32; 3]| {
        killed.iter().sum::<u32>() >= KILLED && killed.iter().all(|count| *count > 0)
    };
    for i in 0..STARTED {
        if is_enough(&killed) {
            break;
        }
        // Whichever is not there.
        let resolution = resolutions[usize::from(before == first)];
        let there = names(folder);
        let mut child = start(folder, resolution);
        // Spread evenly, in no order: every other bake while it computes, the others while they
        // write, which takes less time.
        let share = (f64::from(i) * 0.618_033_988_749_895).fract();
        if i % 2 == 0 {
            std::thread::sleep(until_writing.mul_f64(share));
        } else if writes(&mut child, folder, &there) {
            std::thread::sleep(writing.mul_f64(share));
        }
        child.kill().unwrap();
        let is_killed = !child.wait().unwrap().success();

        let found = sha256(folder);
        assert!(found == first || found == second);
        let is_left = names(folder).difference(&there).next().is_some();
        let phase = match (found == before, is_left) {
            (true, false) => 0,
            (true, true) => 1,
            (false, _) => 2,
        };
        killed[phase] += u32::from(is_killed);
        before = found;
    }
    assert!(is_enough(&killed), "killed {killed:?} of {STARTED}");

    let resolution = resolutions[usize::from(before == first)];
    let (found, _) = bake(folder, resolution);
    assert!(found == first || found == second);
    assert_ne!(found, before);
    // Where folders cannot be locked, none is removed.
    if cfg!(unix) {
        let left = names(folder);
        assert_eq!(left, ["bundle", "scene.obj"].map(OsString::from).into());
    }
}
