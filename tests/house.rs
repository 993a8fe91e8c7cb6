//! The built-in house, from scene to verified bundle.

use crate::setup::{options, options_in_cell, verified};
use farfield_bundle::{NewFile, read, write};
use std::fs;
use xtask::{BakeReport, BuiltIn, Console, SceneChoice, bake};

fn bake_house(dir: &std::path::Path) -> BakeReport {
    bake(
        &options(SceneChoice::BuiltIn(BuiltIn::House), 256, dir),
        &Console::Silent,
    )
    .expect("the house bakes")
}

#[test]
fn the_house_bakes_into_a_bundle_that_holds() {
    let folder = tempfile::tempdir().unwrap();
    let report = bake_house(folder.path());
    assert!(report.layers >= 10, "{} layers", report.layers);
    assert_eq!(report.triangles_out, 2 * report.quads);
    let verified = verified(folder.path(), 60);
    assert!(verified.holds && verified.gap_pixels == 0, "{verified:?}");
    assert_eq!(verified.phantom_pixels, 0);
    assert!(verified.coverage_error < 1e-3, "{verified:?}");
    for file in [
        "bundle.json",
        "impostors.glb",
        "pages/000.png",
        "verify.json",
    ] {
        assert!(folder.path().join(file).exists(), "{file} is missing");
    }
}

#[test]
fn a_house_seen_from_a_shaft_holds() {
    let folder = tempfile::tempdir().unwrap();
    let cell = "shaft:0.3,0.1,1:8:80";
    let options = options_in_cell(
        SceneChoice::BuiltIn(BuiltIn::House),
        cell,
        256,
        folder.path(),
    );
    let report = bake(&options, &Console::Silent).unwrap();
    assert!(report.layers >= 10, "{} layers", report.layers);
    let verified = verified(folder.path(), 60);
    assert!(
        verified.holds && verified.phantom_pixels == 0,
        "{verified:?}"
    );
}

/// A verifier that finds no fault with a bad bundle is worth nothing.
#[test]
fn a_bundle_with_a_page_from_elsewhere_does_not_hold() {
    let folder = tempfile::tempdir().unwrap();
    bake_house(folder.path());
    let manifest = read(folder.path()).unwrap();
    let files: Vec<NewFile> = manifest
        .files
        .iter()
        .map(|file| NewFile {
            path: file.path.clone(),
            bytes: fs::read(folder.path().join(&file.path)).unwrap(),
        })
        .collect();
    // The page upside down: the same size, other texels.
    let mut damaged = files.clone();
    let page = damaged
        .iter_mut()
        .find(|file| file.path == "pages/000.png")
        .unwrap();
    page.bytes = upside_down(&page.bytes);
    write(folder.path(), &manifest, &damaged).unwrap();
    let damaged = verified(folder.path(), 10);
    assert!(!damaged.holds && damaged.gap_pixels > 1000, "{damaged:?}");

    // Back again it holds again.
    write(folder.path(), &manifest, &files).unwrap();
    assert!(verified(folder.path(), 10).holds);
}

fn upside_down(png: &[u8]) -> Vec<u8> {
    let mut image = image::load_from_memory(png).unwrap().into_rgba8();
    image::imageops::flip_vertical_in_place(&mut image);
    let mut bytes = Vec::new();
    image
        .write_to(
            &mut std::io::Cursor::new(&mut bytes),
            image::ImageFormat::Png,
        )
        .unwrap();
    bytes
}
