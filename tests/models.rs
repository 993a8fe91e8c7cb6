//! Real models, from file to verified bundle, at a size that tests can afford.

use crate::setup::{model, options_in_cell, verified};
use xtask::{Console, SceneChoice, bake};

/// Bakes a model for 256 x 256 pixels and verifies that it has no gaps and no phantoms.
fn bake_and_verify(name: &str, cell: &str) {
    let Some(path) = model(name) else { return };
    let folder = tempfile::tempdir().unwrap();
    let options = options_in_cell(SceneChoice::File(path), cell, 256, folder.path());
    bake(&options, &Console::Silent).unwrap();
    let verified = verified(folder.path(), 40);
    assert!(
        verified.holds && verified.gap_pixels == 0,
        "{name}: {verified:?}"
    );
    assert_eq!(verified.phantom_pixels, 0, "{name}: {verified:?}");
}

#[test]
fn the_bunny_holds() {
    bake_and_verify("stanford_bunny.glb", "box:0,0.11,0.45:0.2,0.2,0.2");
}

#[test]
fn the_engine_holds() {
    bake_and_verify("2CylinderEngine.glb", "box:0,0,1200:500,500,500");
}

#[test]
fn the_dragon_holds() {
    bake_and_verify("stanford_dragon.glb", "box:0,0.12,0.5:0.1,0.1,0.1");
}

#[test]
fn the_armadillo_holds() {
    bake_and_verify("stanford_armadillo_86k.glb", "box:0,0,3:1,1,1");
}

#[test]
fn a_plant_with_masked_leaves_holds() {
    bake_and_verify("DiffuseTransmissionPlant.glb", "box:0,0.4,1.5:0.3,0.3,0.3");
}

#[test]
fn a_city_with_textured_facades_holds() {
    bake_and_verify("city_tokyo_lod2_b.glb", "box:0,25,300:60,40,60");
}

#[test]
fn a_shaft_beside_the_bunny_holds() {
    bake_and_verify("stanford_bunny.glb", "shaft:1,0.3,0.4:10:0.5");
}
