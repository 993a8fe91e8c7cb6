//! However files are damaged, they are read soundly or refused with one message, and nothing
//! panics.

use crate::damage::{changed, changes, damages, good_options, manifest, stamp, write_scene};
use crate::deadline::must_end;
use crate::good::{good_glb, good_scenes, picture};
use farfield_bundle::{Channels, GLTF_FILE, MANIFEST_FILE};
use glam::DVec3;
use image::ImageFormat;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use xtask::{Arrangement, BakeOptions, Console, Making, VerifyOptions, Views, bake, verify};

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
        views: Views::First(2),
    };
    match verify(&options, &Console::Silent) {
        Ok(_) => Ok(()),
        Err(error) => check_message(&format!("{error:#}"), folder),
    }
}

/// The good bundle's files, which are removed with the folder.
fn good_bundle() -> (TempDir, PathBuf) {
    good_bundle_of(|options| options)
}

/// The same, baked in another way.
fn good_bundle_of(way: impl FnOnce(BakeOptions) -> BakeOptions) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let options = way(good_options(folder.path()));
    bake(&options, &Console::Silent).unwrap();
    let dir = folder.path().join("bundle");
    (folder, dir)
}

/// Triangles and pictures of the good scenes.
const CONTENTS: [[usize; 2]; 9] = [
    [4, 2],
    [18, 0],
    [18, 0],
    [18, 0],
    [18, 1],
    [19, 1],
    [18, 0],
    [18, 0],
    [18, 0],
];

#[test]
fn the_good_files_are_good() {
    let (folder, dir) = good_bundle();
    for (good, [triangles, images]) in good_scenes().iter().zip(CONTENTS) {
        let (path, _) = write_scene(good, folder.path());
        let scene = farfield_import::read(&path).unwrap().scene;
        let found = [scene.drawn_triangles() as usize, scene.images.len()];
        assert_eq!(found, [triangles, images], "{}", path.display());
    }
    // Stamped, but as it was.
    stamp(&dir, manifest(&dir));
    let options = VerifyOptions {
        dir,
        scene: None,
        views: Views::First(27),
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
        must_end(&(path, damage), &check).map_err(TestCaseError::fail)
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

/// So are scenes of all other kinds, whichever of their files is damaged.
#[test]
fn damaged_scenes_of_all_kinds_are_read_soundly_or_refused() {
    for good in good_scenes() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, files) = write_scene(&good, folder.path());
        for (path, bytes) in files {
            check_all(500, bytes, &path, || check_import(&scene));
        }
    }
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

/// Nor does anything panic, or go on for ever, at what is damaged before checksums are computed.
///
/// * `cases` - of the geometry's bytes, of each page's, and of the manifest's values
fn damage_before_checksums(way: impl FnOnce(BakeOptions) -> BakeOptions, cases: [u32; 3]) {
    let (folder, dir) = good_bundle_of(way);
    let sound = manifest(&dir);
    assert_eq!(check_verify(folder.path()), Ok(()));
    for file in sound["files"].as_array().unwrap() {
        let path = dir.join(file["path"].as_str().unwrap());
        let is_page = path.extension().is_some_and(|end| end == "png");
        let good = fs::read(&path).unwrap();
        check_all(cases[usize::from(is_page)], &good, &path, || {
            stamp(&dir, sound.clone());
            check_verify(folder.path())
        });
    }
    let mut runner = TestRunner::new(config(cases[2]));
    let result = runner.run(&changes(&sound), |changes| {
        stamp(&dir, changed(&sound, &changes));
        must_end(&changes, || check_verify(folder.path())).map_err(TestCaseError::fail)
    });
    result.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn damaged_layers_are_no_panic() {
    damage_before_checksums(|options| options, [300, 60, 600]);
}

#[test]
fn damaged_depth_meshes_are_no_panic() {
    let making = Making::Tdm { enlarged: 1.0 };
    damage_before_checksums(|options| BakeOptions { making, ..options }, [30, 6, 40]);
}

#[test]
fn damaged_surface_channels_are_no_panic() {
    let channels = Channels::Pbr;
    damage_before_checksums(
        |options| BakeOptions {
            channels,
            ..options
        },
        [40, 3, 50],
    );
}

/// Impostors round a cell, of what lies at a distance.
fn far(options: BakeOptions) -> BakeOptions {
    BakeOptions {
        view_cell: Some("box:2,3,8:1,1,1".parse().unwrap()),
        arrangement: Arrangement::Far(1.0),
        ..options
    }
}

#[test]
fn damaged_far_impostors_are_no_panic() {
    damage_before_checksums(far, [30, 5, 50]);
}

/// Impostors of a scene that is seen from all around.
#[test]
fn damaged_impostors_from_around_are_no_panic() {
    let arrangement = Arrangement::Around(None);
    let around = |options| BakeOptions {
        arrangement,
        ..options
    };
    damage_before_checksums(around, [8, 1, 12]);
}

/// What verify says of a bundle that it refuses because of one of its files.
fn refused_at(folder: &Path, file: &str) -> String {
    let options = VerifyOptions {
        dir: folder.join("bundle"),
        scene: None,
        views: Views::First(1),
    };
    let error = verify(&options, &Console::Silent).expect_err("it must be refused");
    let message = format!("{error:#}");
    check_message(&message, &options.dir.join(file)).unwrap();
    assert!(
        message.contains("again") || message.contains("lower"),
        "{message}"
    );
    message
}

/// What verify says of the good bundle with values in the places of others.
fn refused(changes: &[(&str, Value)]) -> String {
    let (folder, dir) = good_bundle();
    let changes: Vec<_> = changes
        .iter()
        .map(|(place, value)| (place.to_string(), value.clone()))
        .collect();
    stamp(&dir, changed(&manifest(&dir), &changes));
    refused_at(folder.path(), MANIFEST_FILE)
}

#[test]
fn a_depth_mesh_that_is_nowhere_is_refused() {
    let making = Making::Tdm { enlarged: 1.0 };
    let (folder, dir) = good_bundle_of(|options| BakeOptions { making, ..options });
    let eye = "/impostors/0/body/recorded/pose/eye/0".to_owned();
    stamp(&dir, changed(&manifest(&dir), &[(eye, json!(1e308))]));
    let message = refused_at(folder.path(), MANIFEST_FILE);
    assert!(message.contains("in the grid of its layers"), "{message}");
}

/// Of a mesh whose texture coordinates became enormous there are pictures.
#[test]
fn enormous_texture_coordinates_are_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let glb = good_glb();
    let corners = [0f32, 1., 1., 1., 1., 0., 0., 0.]
        .map(f32::to_le_bytes)
        .concat();
    let at = glb
        .windows(corners.len())
        .position(|bytes| bytes == corners);
    for u in [1e19f32, -3e38, f32::MAX] {
        let mut glb = glb.clone();
        glb[at.unwrap()..][..4].copy_from_slice(&u.to_le_bytes());
        let options = good_options(folder.path());
        fs::write(folder.path().join("scene.glb"), glb).unwrap();
        bake(&options, &Console::Silent).unwrap();
        assert_eq!(check_verify(folder.path()), Ok(()));
    }
}

/// Where what is at the cell is far, the borders between its sides begin at the viewpoints.
#[test]
fn a_distance_of_nothing_is_no_panic() {
    let (folder, dir) = good_bundle_of(far);
    let distance = "/options/view_space/distance".to_owned();
    for nothing in [0.0, 5e-324] {
        let change = (distance.clone(), json!(nothing));
        stamp(&dir, changed(&manifest(&dir), &[change]));
        assert_eq!(check_verify(folder.path()), Ok(()));
    }
}

/// Nor is there a direction to look along from so far that lengths are no numbers.
#[test]
fn a_viewpoint_at_no_place_is_refused() {
    let (folder, dir) = good_bundle_of(far);
    let eye = "/impostors/0/body/pose/eye/0".to_owned();
    stamp(&dir, changed(&manifest(&dir), &[(eye, json!(1e200))]));
    let message = refused_at(folder.path(), MANIFEST_FILE);
    assert!(message.contains("no direction to look along"), "{message}");
}

/// An impostor that the geometry does not have is missed in the geometry's file.
#[test]
fn an_impostor_of_another_name_is_refused() {
    let (folder, dir) = good_bundle_of(far);
    let sound = manifest(&dir);
    let name = "/impostors/0/name".to_owned();
    stamp(&dir, changed(&sound, &[(name, json!("another"))]));
    let message = refused_at(folder.path(), GLTF_FILE);
    assert!(message.contains("has no object 'another'"), "{message}");
    // No object at all, as no node is in the scene.
    let glb = fs::read(dir.join(GLTF_FILE)).unwrap();
    let text = String::from_utf8_lossy(&glb);
    let node = text.find("\"mesh\"").unwrap();
    let mut glb = glb.clone();
    glb[node + 1] = b'n';
    fs::write(dir.join(GLTF_FILE), glb).unwrap();
    stamp(&dir, sound);
    let message = refused_at(folder.path(), GLTF_FILE);
    assert!(
        message.contains("draws 0 objects for 1 impostors"),
        "{message}"
    );
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
