//! Reading what is damaged takes no more memory than what is good, by more than a small factor.
//!
//! A program of its own with one test, as all that it allocates is counted.

mod damage;
mod deadline;
mod good;

use damage::{changed, changes, damages, good_options, manifest, stamp, write_scene};
use deadline::must_end;
use farfield_bundle::{GLTF_FILE, MANIFEST_FILE};
use good::good_scenes;
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::fs;
use std::path::Path;
use xtask::{Console, Making, VerifyOptions, Views, bake, verify};

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

/// Calls for each of `count` values; the same in every run.
fn for_each_of<S: Strategy>(count: u32, strategy: &S, mut call: impl FnMut(S::Value)) {
    let mut runner = TestRunner::deterministic();
    for _ in 0..count {
        call(strategy.new_tree(&mut runner).unwrap().current());
    }
}

/// Asserts that no damage of a file's bytes makes a call take many times the memory.
///
/// * `good`, `file` - the file's bytes, and where it lies
/// * `call` - tells whether the file was found good
fn assert_bounded(count: u32, good: &[u8], file: &Path, call: impl Fn() -> bool) {
    // Threads are started and tables filled the first time.
    assert!(call());
    let least = peak_of(|| assert!(call()));
    for_each_of(count, &damages(), |damage| {
        fs::write(file, damage.of(good)).unwrap();
        let taken = must_end(&(file, &damage), || peak_of(&call));
        assert!(
            taken <= FACTOR * least,
            "{}: {damage:?}: {taken} bytes, the good file takes {least}",
            file.display()
        );
    });
    fs::write(file, good).unwrap();
}

fn looked_at(folder: &Path) -> bool {
    let options = VerifyOptions {
        dir: folder.join("bundle"),
        scene: None,
        views: Views::First(1),
    };
    verify(&options, &Console::Silent).is_ok()
}

#[test]
fn damaged_files_take_at_most_four_times_the_memory_of_good_ones() {
    // The importer, with every kind of scene, whichever of its files is damaged.
    for good in good_scenes() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, files) = write_scene(&good, folder.path());
        for (file, bytes) in files {
            assert_bounded(500, bytes, &file, || farfield_import::read(&scene).is_ok());
        }
    }

    let tdm = Making::Tdm { enlarged: 1.0 };
    // Damages of the geometry, of a page and of the manifest's values.
    for (making, cases) in [(None, [60, 12, 120]), (Some(tdm), [20, 5, 40])] {
        let folder = tempfile::tempdir().unwrap();
        let mut options = good_options(folder.path());
        options.making = making.unwrap_or(options.making);
        bake(&options, &Console::Silent).unwrap();
        let dir = folder.path().join("bundle");

        // The bundle's reader.
        let path = dir.join(MANIFEST_FILE);
        let text = fs::read(&path).unwrap();
        assert_bounded(400, &text, &path, || farfield_bundle::read(&dir).is_ok());

        // Verify, with checksums that are right.
        let sound = manifest(&dir);
        for (file, cases) in [(GLTF_FILE, cases[0]), ("pages/000.png", cases[1])] {
            let path = dir.join(file);
            let good = fs::read(&path).unwrap();
            assert_bounded(cases, &good, &path, || {
                stamp(&dir, sound.clone());
                looked_at(folder.path())
            });
        }
        stamp(&dir, sound.clone());
        let least = peak_of(|| assert!(looked_at(folder.path())));
        for_each_of(cases[2], &changes(&sound), |changes| {
            stamp(&dir, changed(&sound, &changes));
            let taken = must_end(&changes, || peak_of(|| looked_at(folder.path())));
            assert!(
                taken <= FACTOR * least,
                "{changes:?}: {taken} bytes, the good bundle takes {least}"
            );
        });
    }
}
