//! However files are damaged, they are read soundly or refused with one message, and nothing
//! panics.

use crate::damage::{bake_good, damages, good_glb, manifest, picture, places, stamp, values};
use farfield_bundle::{GLTF_FILE, MANIFEST_FILE};
use glam::DVec3;
use image::ImageFormat;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use xtask::{Console, VerifyOptions, verify};

/// Reads a scene: it is sound, or the message is one line that names the file.
fn check_import(path: &Path) -> Result<(), String> {
    match farfield_import::read(path) {
        Ok(imported) => imported.scene.check().map_err(|error| format!("{error:?}")),
        Err(error) => check_message(&error.to_string(), path),
    }
}

fn check_message(message: &str, path: &Path) -> Result<(), String> {
    let is_clear = message.contains(&path.display().to_string()) && !message.contains('\n');
    is_clear
        .then_some(())
        .ok_or_else(|| format!("unclear: {message}"))
}

/// Verifies a bundle: the promise holds, or it does not, or the message is one line that names
/// the folder or the scene.
fn check_verify(folder: &Path) -> Result<(), String> {
    let options = VerifyOptions {
        dir: folder.join("bundle"),
        scene: None,
        views: 0..2,
    };
    match verify(&options, &Console::Silent) {
        Ok(_) => Ok(()),
        Err(error) => check_message(&format!("{error:#}"), folder),
    }
}

/// The good bundle's files, baked once; removed with the process's own folder.
fn good_bundle() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    bake_good(folder.path());
    let dir = folder.path().join("bundle");
    (folder, dir)
}

#[test]
fn the_good_files_are_good() {
    let (folder, dir) = good_bundle();
    let imported = farfield_import::read(&folder.path().join("scene.glb")).unwrap();
    assert_eq!(imported.scene.drawn_triangles(), 4);
    assert_eq!(imported.scene.images.len(), 2);
    // Stamped, but as it was.
    stamp(&dir, manifest(&dir));
    let options = VerifyOptions {
        dir,
        scene: None,
        views: 0..27,
    };
    let report = verify(&options, &Console::Silent).unwrap();
    assert!(report.holds, "{:?}", report.broken);
}

/// What is found becomes a test with a name; it is not written beside the tests.
fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Tries damages of a file's bytes until one breaks `check`.
fn check_all(cases: u32, good: &[u8], path: &Path, check: impl Fn() -> Result<(), String>) {
    let mut runner = TestRunner::new(config(cases));
    let result = runner.run(&damages(), |damage| {
        fs::write(path, damage.of(good)).unwrap();
        check().map_err(TestCaseError::fail)
    });
    fs::write(path, good).unwrap();
    if let Err(error) = result {
        panic!("{}: {error}", path.display());
    }
}

/// A damaged GLB file, with its pictures, is read soundly or refused.
#[test]
fn damaged_glbs_are_read_soundly_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    check_all(3000, &good_glb(), &path, || check_import(&path));
}

/// So is a scene beside which a damaged picture lies.
#[test]
fn damaged_pictures_are_read_soundly_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.obj");
    let obj = "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\n\
        f 1/1 2/2 3/3\n";
    fs::write(&scene, obj).unwrap();
    for (format, name) in [
        (ImageFormat::Png, "a.png"),
        (ImageFormat::Jpeg, "a.jpg"),
        (ImageFormat::WebP, "a.webp"),
    ] {
        let library = format!("newmtl a\nmap_Kd {name}\n");
        fs::write(folder.path().join("scene.mtl"), library).unwrap();
        let picture = picture(format);
        let path = folder.path().join(name);
        fs::write(&path, &picture).unwrap();
        assert_eq!(farfield_import::read(&scene).unwrap().scene.images.len(), 1);
        check_all(1000, &picture, &path, || check_import(&scene));
    }
}

/// Whichever file of a bundle is damaged, reading it fails or finds it as it was.
#[test]
fn damaged_bundles_are_refused() {
    let (_folder, dir) = good_bundle();
    let sound = farfield_bundle::read(&dir).unwrap();
    let files = sound.files.iter().map(|file| &*file.path);
    for file in files.chain([MANIFEST_FILE]) {
        let path = dir.join(file);
        let good = fs::read(&path).unwrap();
        check_all(200, &good, &path, || match farfield_bundle::read(&dir) {
            Ok(found) if found == sound && fs::read(&path).unwrap() == good => Ok(()),
            Ok(_) => Err("the damage is not found".into()),
            Err(error) => check_message(&error.to_string(), &path),
        });
    }
}

/// Nor does anything panic at what is damaged before checksums are computed: bytes of the geometry
/// and of the pages.
#[test]
fn damaged_geometry_and_pages_are_no_panic() {
    let (folder, dir) = good_bundle();
    let stamped = manifest(&dir);
    for (file, cases) in [(GLTF_FILE, 300), ("pages/000.png", 60)] {
        let path = dir.join(file);
        let good = fs::read(&path).unwrap();
        check_all(cases, &good, &path, || {
            stamp(&dir, stamped.clone());
            check_verify(folder.path())
        });
    }
}

/// Nor at a manifest that says anything else in up to three places.
#[test]
fn manifests_of_any_values_are_no_panic() {
    let (folder, dir) = good_bundle();
    let good = manifest(&dir);
    // The files are what is there, and checked by other tests.
    let all: Vec<String> = places(&good)
        .into_iter()
        .filter(|place| !place.starts_with("/files") && !place.ends_with("sha256"))
        .collect();
    let places = prop::collection::vec((prop::sample::select(all), values()), 1..4);
    let mut runner = TestRunner::new(config(600));
    runner
        .run(&places, |changes| {
            let mut changed = good.clone();
            for (place, value) in changes {
                *changed.pointer_mut(&place).unwrap() = value;
            }
            stamp(&dir, changed);
            check_verify(folder.path()).map_err(TestCaseError::fail)
        })
        .unwrap_or_else(|error| panic!("{error}"));
}

/// What verify says of the good bundle with values in the places of others.
fn refused(changes: &[(&str, Value)]) -> String {
    let (folder, dir) = good_bundle();
    let mut changed = manifest(&dir);
    for (place, value) in changes {
        *changed.pointer_mut(place).unwrap() = value.clone();
    }
    stamp(&dir, changed);
    let options = VerifyOptions {
        dir: dir.clone(),
        scene: None,
        views: 0..1,
    };
    let error = verify(&options, &Console::Silent).expect_err("it must be refused");
    let message = format!("{error:#}");
    check_message(&message, &folder.path().join("bundle/bundle.json")).unwrap();
    assert!(
        message.contains("again") || message.contains("lower"),
        "{message}"
    );
    message
}

#[test]
fn a_bundle_without_layers_is_refused() {
    let body = "/impostors/0/body";
    let message = refused(&[
        (&format!("{body}/layers"), json!([])),
        ("/statistics/layers", json!(0)),
        ("/statistics/quads", json!(0)),
    ]);
    assert!(message.contains("layers are none"), "{message}");
}

/// No picture is so large because a number says so.
#[test]
fn a_resolution_that_the_layers_do_not_have_is_refused() {
    let resolution = "/options/resolution";
    for value in [65, 1000, 16_384, 65_536] {
        let message = refused(&[(resolution, json!(value * 2))]);
        assert!(message.contains("options.resolution"), "{message}");
    }
    // Layers of as many texels as would account for it, which the quads do not show.
    let body = "/impostors/0/body";
    for [resolved, side] in [[4096, 8192], [16_384, 65_536], [65_536, 65_536]] {
        let message = refused(&[
            (resolution, json!(resolved)),
            (&format!("{body}/width"), json!(side)),
            (&format!("{body}/height"), json!(side)),
        ]);
        let reasons = ["resolution", "large", "do not fit together"];
        let is_said = reasons.iter().any(|reason| message.contains(reason));
        assert!(is_said, "{message}");
    }
}

/// Where something is beside or behind a camera, there is no picture to compare.
#[test]
fn a_view_cell_in_the_scene_is_refused() {
    let (_folder, dir) = good_bundle();
    let sound = farfield_bundle::read(&dir).unwrap();
    let [min, max] = sound.impostors[0].represented;
    let target = (min + max) / 2.0;
    for center in [target, max, target + 0.1, DVec3::splat(1e308)] {
        let cell = json!({"kind": "box", "center": center.to_array(), "size": [0.1, 0.1, 0.1]});
        let message = refused(&[("/options/view_space/view_cell", cell)]);
        assert!(message.contains("options.view_space"), "{message}");
    }
    let shaft = json!({"kind": "shaft", "apex": target.to_array(), "axis": [0, 0, 1],
        "half_angle": 0.1, "near": 50.0});
    let message = refused(&[("/options/view_space/view_cell", shaft)]);
    assert!(message.contains("has no end"), "{message}");
}

/// A field of view of almost nothing is none in radians.
#[test]
fn a_field_of_view_of_nothing_is_refused() {
    for fov in [5e-324, 1e-323] {
        let message = refused(&[("/options/fov_degrees", json!(fov))]);
        assert!(message.contains("fov_degrees"), "{message}");
    }
}
