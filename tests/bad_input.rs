//! Bad input gives one clear message and leaves nothing behind.

use crate::setup::{contents, options, options_in_cell, skipped};
use farfield_scene::{Material, Mesh, Object, Scene};
use glam::{DAffine3, Vec2, Vec3, Vec4};
use std::fs;
use std::path::{Path, PathBuf};
use xtask::{BuiltIn, Console, SceneChoice, VerifyOptions, VerifyReport, bake, verify};

/// The message of a bake that must fail and leave its folder as it was.
fn refusal(scene: &Path, cell: Option<&str>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bundle");
    let scene = SceneChoice::File(scene.to_owned());
    let options = match cell {
        Some(cell) => options_in_cell(scene, cell, 64, &out),
        None => options(scene, 64, &out),
    };
    let error = bake(&options, &Console::Silent).expect_err("the bake must fail");
    assert!(
        contents(folder.path()).is_empty(),
        "something was left behind"
    );
    let message = format!("{error:#}");
    assert!(!message.contains('\n'), "more than one line: {message}");
    message
}

fn with_file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn assert_names(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
}

#[test]
fn a_missing_file_is_named() {
    assert_names(
        &refusal(Path::new("no/such/scene.glb"), None),
        &["no/such/scene.glb"],
    );
}

#[test]
fn a_text_file_is_no_scene() {
    let (_folder, path) = with_file("poem.glb", b"Roses are red.\n");
    assert_names(&refusal(&path, None), &["poem.glb"]);
}

#[test]
fn a_broken_glb_is_refused() {
    let display = farfield_town::house(0);
    let uris: Vec<String> = (0..display.images.len())
        .map(|i| format!("{i}.png"))
        .collect();
    let glb = farfield_bundle::glb_from_scene(&display, &uris).unwrap();
    for length in [10, 100, glb.len() / 2, glb.len() - 1] {
        let (_folder, path) = with_file("broken.glb", &glb[..length]);
        assert_names(&refusal(&path, None), &["broken.glb"]);
    }
}

#[test]
fn a_scene_without_triangles_is_nothing_to_bake() {
    let (_folder, path) = with_file("empty.gltf", br#"{"asset": {"version": "2.0"}}"#);
    assert_names(&refusal(&path, None), &["empty.gltf"]);
}

#[test]
fn a_cell_inside_the_scene_is_refused_with_the_objects_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bundle");
    let options = options_in_cell(
        SceneChoice::BuiltIn(BuiltIn::House),
        "box:0,5,0:1,1,1",
        64,
        &out,
    );
    let message = format!("{:#}", bake(&options, &Console::Silent).unwrap_err());
    assert_names(&message, &["not in front", "in the way", "'", "--exclude"]);
    assert!(contents(folder.path()).is_empty());
}

/// A scene file of one triangle, single-sided.
fn triangle_file(corners: [Vec3; 3]) -> Vec<u8> {
    let [a, b, c] = corners;
    let scene = Scene {
        positions: corners.into(),
        normals: vec![(b - a).cross(c - a).normalize(); 3],
        uvs: vec![Vec2::ZERO; 3],
        colors: vec![Vec4::ONE; 3],
        triangles: vec![[0, 1, 2]],
        triangle_materials: vec![0],
        materials: vec![Material::default()],
        meshes: vec![Mesh {
            vertices: 0..3,
            triangles: 0..1,
        }],
        objects: vec![Object {
            name: "triangle".into(),
            mesh: 0,
            world_from_mesh: DAffine3::IDENTITY,
        }],
        ..Scene::default()
    };
    farfield_bundle::glb_from_scene(&scene, &[]).unwrap()
}

#[test]
fn a_scene_that_faces_away_is_refused() {
    // Counter-clockwise seen from -Z; the default cell lies on the +Z side.
    let glb = triangle_file([Vec3::ZERO, Vec3::Y, Vec3::X]);
    let (_folder, path) = with_file("back.glb", &glb);
    assert_names(
        &refusal(&path, None),
        &["back.glb", "face away", "double-sided"],
    );
}

#[test]
fn a_foreign_folder_is_not_replaced() {
    let (folder, path) = with_file("diary.txt", b"precious");
    let error = bake(
        &options(SceneChoice::BuiltIn(BuiltIn::House), 64, folder.path()),
        &Console::Silent,
    );
    assert_names(
        &format!("{:#}", error.unwrap_err()),
        &[&folder.path().display().to_string()],
    );
    assert_eq!(fs::read(path).unwrap(), b"precious");
}

#[test]
fn an_excluded_object_must_exist() {
    let folder = tempfile::tempdir().unwrap();
    let mut options = options(
        SceneChoice::BuiltIn(BuiltIn::House),
        64,
        &folder.path().join("bundle"),
    );
    options.exclude = vec!["unicorn".into()];
    let message = format!("{:#}", bake(&options, &Console::Silent).unwrap_err());
    assert_names(&message, &["unicorn"]);
}

/// Bakes a triangle in a folder: its file, `scene.glb`, and its bundle, `bundle`.
fn baked_triangle() -> (tempfile::TempDir, PathBuf) {
    let glb = triangle_file([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let (folder, scene) = with_file("scene.glb", &glb);
    let dir = folder.path().join("bundle");
    let options = options(SceneChoice::File(scene), 64, &dir);
    bake(&options, &Console::Silent).unwrap();
    (folder, dir)
}

fn looked_at(dir: &Path, scene: Option<PathBuf>) -> anyhow::Result<VerifyReport> {
    let options = VerifyOptions {
        dir: dir.to_owned(),
        scene,
        views: 0..1,
    };
    verify(&options, &Console::Silent)
}

/// The message of a verification that must fail and leave the bundle's folder as it was.
fn refused_bundle(dir: &Path, scene: Option<PathBuf>) -> String {
    let before = contents(dir);
    let error = looked_at(dir, scene).expect_err("the bundle must be refused");
    assert_eq!(contents(dir), before, "the folder was changed");
    let message = format!("{error:#}");
    assert!(!message.contains('\n'), "more than one line: {message}");
    message
}

#[test]
fn verify_refuses_what_is_no_bundle() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().display().to_string();
    let no_bundle = [&name, "is not a bundle", "bundle.json", "bake one first"];
    assert_names(&refused_bundle(folder.path(), None), &no_bundle);
    for (foreign, words) in [
        (r#"{"name": "left-pad", "files": []}"#, "format"),
        (
            r#"{"format": "sofa", "version": 1}"#,
            "expected \"farfield-bundle\"",
        ),
        ("[1, 2, 3]", "[0]"),
        ("", "the document"),
    ] {
        fs::write(folder.path().join("bundle.json"), foreign).unwrap();
        let message = refused_bundle(folder.path(), None);
        assert_names(&message, &["bundle.json: ", words, "bake"]);
    }
}

/// A changed file is refused before anything is measured: which file, and what to do.
#[test]
fn verify_refuses_a_bundle_that_was_changed() {
    let (_folder, dir) = baked_triangle();
    assert!(looked_at(&dir, None).unwrap().holds);
    let refuse = |file: &str, change: &dyn Fn(&mut Vec<u8>), words: &[&str]| {
        let path = dir.join(file);
        let sound = fs::read(&path).unwrap();
        let mut bytes = sound.clone();
        change(&mut bytes);
        assert_ne!(bytes, sound);
        fs::write(&path, bytes).unwrap();
        let message = refused_bundle(&dir, None);
        assert_names(&message, &[file, "again"]);
        assert_names(&message, words);
        fs::write(&path, sound).unwrap();
    };
    for file in ["pages/000.png", "impostors.glb"] {
        refuse(
            file,
            &|bytes| bytes.truncate(bytes.len() / 2),
            &["bytes, the manifest says", "changed after the bake"],
        );
        refuse(
            file,
            &|bytes| *bytes.last_mut().unwrap() ^= 1,
            &["does not match its checksum", "changed after the bake"],
        );
    }
    let edit = |from: &'static str, to: &'static str| {
        move |bytes: &mut Vec<u8>| {
            *bytes = String::from_utf8_lossy(bytes).replace(from, to).into();
        }
    };
    let manifest = "bundle.json";
    refuse(
        manifest,
        &|bytes| bytes.truncate(bytes.len() / 2),
        &["EOF", "line"],
    );
    refuse(
        manifest,
        &edit("\"resolution\": 64", "\"resolution\": 63"),
        &["does not match its checksum"],
    );
    refuse(
        manifest,
        &edit("\"resolution\": 64", "\"resolution\": 0"),
        &["options.resolution"],
    );
    fs::remove_file(dir.join("pages/000.png")).unwrap();
    assert_names(
        &refused_bundle(&dir, None),
        &["pages/000.png", "is missing", "bake the bundle again"],
    );
}

#[test]
fn verify_refuses_a_bundle_of_a_newer_version() {
    let (_folder, dir) = baked_triangle();
    let path = dir.join("bundle.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"version\": 1,", "\"version\": 2,")).unwrap();
    assert_names(
        &refused_bundle(&dir, None),
        &["bundle.json: version: 2", "use a newer farfield"],
    );
}

#[test]
fn verify_refuses_a_scene_that_is_missing_or_another() {
    let (folder, dir) = baked_triangle();
    let (scene, moved) = (
        folder.path().join("scene.glb"),
        folder.path().join("moved.glb"),
    );
    fs::rename(&scene, &moved).unwrap();
    assert_names(
        &refused_bundle(&dir, None),
        &["scene.glb", "is not there", "--scene FILE"],
    );
    assert!(looked_at(&dir, Some(moved)).unwrap().holds);

    let other = triangle_file([Vec3::ZERO, 2.0 * Vec3::X, Vec3::Y]);
    fs::write(&scene, other).unwrap();
    let another = ["scene.glb", "not the scene that was baked", "--scene FILE"];
    assert_names(&refused_bundle(&dir, None), &another);
    assert_names(&refused_bundle(&dir, Some(scene)), &another);
    let nowhere = Some(folder.path().join("nowhere.glb"));
    assert_names(&refused_bundle(&dir, nowhere), &["nowhere.glb", "--scene"]);
}

/// A scene is all of its files: verify refuses one whose buffer or image was changed.
#[test]
fn a_scene_that_was_changed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = farfield_town::house(0);
    let uris: Vec<String> = (0..scene.images.len())
        .map(|i| format!("{i}.png"))
        .collect();
    for (image, uri) in scene.images.iter().zip(&uris) {
        fs::write(folder.path().join(uri), farfield_bundle::encode_png(image)).unwrap();
    }
    let path = folder.path().join("house.glb");
    fs::write(
        &path,
        farfield_bundle::glb_from_scene(&scene, &uris).unwrap(),
    )
    .unwrap();
    let dir = folder.path().join("bundle");
    bake(
        &options(SceneChoice::File(path), 64, &dir),
        &Console::Silent,
    )
    .unwrap();
    let verify = || {
        let options = VerifyOptions {
            dir: dir.clone(),
            scene: None,
            // As many as give colours of so small pictures a reliable mean.
            views: 0..27,
        };
        verify(&options, &Console::Silent)
    };
    assert!(verify().unwrap().holds);
    fs::copy(folder.path().join("1.png"), folder.path().join("0.png")).unwrap();
    let message = format!("{:#}", verify().unwrap_err());
    assert_names(
        &message,
        &["house.glb", "not the scene that was baked", "--scene"],
    );
}

/// What the Khronos validator minds in files that are read nevertheless: it is about what is not
/// used, what can be told from the rest, or what has a clear meaning.
const HARMLESS: [&str; 13] = [
    "ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND",
    "ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND",
    "ACCESSOR_MAX_MISMATCH",
    "ACCESSOR_MIN_MISMATCH",
    "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS",
    "ACCESSOR_NON_CLAMPED",
    "EMPTY_ENTITY",
    "ROTATION_NON_UNIT",
    // Of an image that nothing shows.
    "IMAGE_UNEXPECTED_EOS",
    // Of skins, which are left out.
    "ACCESSOR_JOINTS_INDEX_DUPLICATE",
    "ACCESSOR_JOINTS_INDEX_OOB",
    "ACCESSOR_WEIGHTS_NEGATIVE",
    "ACCESSOR_WEIGHTS_NON_NORMALIZED",
];

/// Every file of a folder of malformed ones, where there is one beside the models, is refused with
/// one line or read into a sound scene, and so is a bake of it.
#[test]
fn malformed_files_are_refused_or_read_soundly() {
    let models = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let folder = models.and_then(|models| Some(models.parent()?.join("bad-gltf")));
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else {
        return skipped("no folder of malformed files lies beside FARFIELD_MODELS");
    };
    let expected = fs::read(folder.join("expected.json")).expect("the folder says what is wrong");
    let expected: serde_json::Value = serde_json::from_slice(&expected).unwrap();
    let expected = expected.as_object().unwrap();
    let mut names: Vec<PathBuf> = contents(&folder).into_iter().map(|file| file.0).collect();
    names.retain(|name| {
        let end = name.extension();
        end.is_some_and(|end| end == "gltf" || end == "glb")
    });
    for name in expected.keys() {
        assert!(names.contains(&name.into()), "{name} is not in the folder");
    }
    assert!(names.len() >= 20, "only {} files are there", names.len());
    for name in names {
        let path = folder.join(&name);
        match farfield_import::read(&path) {
            Ok(imported) => {
                assert_eq!(imported.scene.check(), Ok(()), "{}", name.display());
                let wrong = &expected[&*name.to_string_lossy()]["errorCodes"];
                let codes = wrong.as_array().unwrap().iter();
                let harmful: Vec<_> = codes
                    .filter(|code| !HARMLESS.contains(&code.as_str().unwrap()))
                    .collect();
                assert!(harmful.is_empty(), "{}: {harmful:?}", name.display());
                baked_or_refused(&path);
            }
            Err(error) => {
                let message = error.to_string();
                assert_names(&message, &[&path.display().to_string()]);
                assert!(!message.contains('\n'), "more than one line: {message}");
                assert_names(&refusal(&path, None), &[&path.display().to_string()]);
            }
        }
    }
}

/// Bakes a file, or is told in one line why not, with nothing left behind.
fn baked_or_refused(scene: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bundle");
    let options = options(SceneChoice::File(scene.to_owned()), 64, &out);
    match bake(&options, &Console::Silent) {
        Ok(_) => assert!(farfield_bundle::read(&out).is_ok()),
        Err(error) => {
            let message = format!("{error:#}");
            assert_names(&message, &[&scene.display().to_string()]);
            assert!(!message.contains('\n'), "more than one line: {message}");
            assert!(contents(folder.path()).is_empty());
        }
    }
}
