//! Reading what is damaged takes no more memory than what is good, by more than a small factor.
//!
//! A program of its own with one test, as all that it allocates is counted.

mod damage;

use damage::{bake_good, damages, good_glb, manifest, places, stamp, values};
use farfield_bundle::MANIFEST_FILE;
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use serde_json::Value;
use std::fs;
use std::path::Path;
use xtask::{Console, VerifyOptions, verify};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Bytes that were allocated at the same time in a call, besides those before it.
fn peak_of<T>(call: impl FnOnce() -> T) -> usize {
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    call();
    ALLOCATOR.peak_usage() - before.min(ALLOCATOR.peak_usage())
}

/// How many times the good file's memory a damaged one may take.
const FACTOR: usize = 4;

/// Calls for each of `count` damaged files; the same in every run.
fn greatest_of<S: Strategy>(
    count: u32,
    strategy: &S,
    mut take: impl FnMut(S::Value) -> usize,
) -> usize {
    let mut runner = TestRunner::deterministic();
    let mut draw = || strategy.new_tree(&mut runner).unwrap().current();
    (0..count).map(|_| take(draw())).max().unwrap()
}

fn looked_at(folder: &Path) -> bool {
    let options = VerifyOptions {
        dir: folder.join("bundle"),
        scene: None,
        views: 0..1,
    };
    verify(&options, &Console::Silent).is_ok()
}

#[test]
fn damaged_files_take_at_most_four_times_the_memory_of_good_ones() {
    let folder = tempfile::tempdir().unwrap();
    bake_good(folder.path());

    // The importer.
    let path = folder.path().join("scene.glb");
    let glb = good_glb();
    let import = || farfield_import::read(&path).is_ok();
    let good = peak_of(|| assert!(import()));
    let worst = greatest_of(2000, &damages(), |damage| {
        fs::write(&path, damage.of(&glb)).unwrap();
        peak_of(import)
    });
    fs::write(&path, &glb).unwrap();
    assert!(
        worst <= FACTOR * good,
        "{worst} bytes, the good file takes {good}"
    );

    // The bundle's reader.
    let dir = folder.path().join("bundle");
    let path = dir.join(MANIFEST_FILE);
    let text = fs::read(&path).unwrap();
    let read = || farfield_bundle::read(&dir).is_ok();
    let good = peak_of(|| assert!(read()));
    let worst = greatest_of(500, &damages(), |damage| {
        fs::write(&path, damage.of(&text)).unwrap();
        peak_of(read)
    });
    fs::write(&path, &text).unwrap();
    assert!(
        worst <= FACTOR * good,
        "{worst} bytes, the good file takes {good}"
    );

    // Verify, with checksums that are right. The first time threads are started.
    let sound = manifest(&dir);
    assert!(looked_at(folder.path()));
    let good = peak_of(|| assert!(looked_at(folder.path())));
    let all: Vec<String> = places(&sound)
        .into_iter()
        .filter(|place| !place.starts_with("/files") && !place.ends_with("sha256"))
        .collect();
    let changes = prop::collection::vec((prop::sample::select(all), values()), 1..4);
    let worst = greatest_of(400, &changes, |changes| {
        let mut changed: Value = sound.clone();
        for (place, value) in changes {
            *changed.pointer_mut(&place).unwrap() = value;
        }
        stamp(&dir, changed);
        peak_of(|| looked_at(folder.path()))
    });
    assert!(
        worst <= FACTOR * good,
        "{worst} bytes, the good file takes {good}"
    );
}
