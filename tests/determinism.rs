//! The same input gives the same bytes.

use crate::setup::{contents, model, options, options_in_cell};
use std::path::Path;
use xtask::{BakeOptions, BuiltIn, Console, SceneChoice, bake};

fn assert_same_on_1_2_and_4_threads(options: &BakeOptions) {
    let dir = options.out.as_deref().unwrap();
    let mut bundles = [1, 2, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| bake(options, &Console::Silent)).unwrap();
        contents(dir)
    });
    let first = std::mem::take(&mut bundles[0]);
    assert!(first.len() >= 3, "{} files", first.len());
    for other in &bundles[1..] {
        assert!(first == *other, "the number of threads changes the bundle");
    }
}

#[test]
fn the_house_is_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    assert_same_on_1_2_and_4_threads(&options(
        SceneChoice::BuiltIn(BuiltIn::House),
        128,
        folder.path(),
    ));
}

#[test]
fn a_real_model_is_the_same_on_any_number_of_threads() {
    let Some(plant) = model("DiffuseTransmissionPlant.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let cell = "box:0,0.4,1.5:0.3,0.3,0.3";
    let out: &Path = folder.path();
    assert_same_on_1_2_and_4_threads(&options_in_cell(SceneChoice::File(plant), cell, 128, out));
}
