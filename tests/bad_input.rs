//! Bad input gives one clear message and leaves nothing behind.

use crate::setup::{contents, options, options_in_cell, skipped};
use farfield_scene::{Material, Mesh, Object, Scene};
use glam::{DAffine3, Vec2, Vec3, Vec4};
use std::fs;
use std::path::{Path, PathBuf};
use xtask::{Console, SceneChoice, VerifyOptions, bake, verify};

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
    let options = options_in_cell(SceneChoice::House, "box:0,5,0:1,1,1", 64, &out);
    let message = format!("{:#}", bake(&options, &Console::Silent).unwrap_err());
    assert_names(&message, &["not in front", "in the way", "'", "--exclude"]);
    assert!(contents(folder.path()).is_empty());
}

#[test]
fn a_scene_that_faces_away_is_refused() {
    // Counter-clockwise seen from -Z; the default cell lies on the +Z side.
    let scene = Scene {
        positions: vec![Vec3::ZERO, Vec3::Y, Vec3::X],
        normals: vec![Vec3::NEG_Z; 3],
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
            name: "back".into(),
            mesh: 0,
            world_from_mesh: DAffine3::IDENTITY,
        }],
        ..Scene::default()
    };
    let glb = farfield_bundle::glb_from_scene(&scene, &[]).unwrap();
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
        &options(SceneChoice::House, 64, folder.path()),
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
    let mut options = options(SceneChoice::House, 64, &folder.path().join("bundle"));
    options.exclude = vec!["unicorn".into()];
    let message = format!("{:#}", bake(&options, &Console::Silent).unwrap_err());
    assert_names(&message, &["unicorn"]);
}

#[test]
fn verify_refuses_what_is_no_bundle_or_was_changed() {
    let folder = tempfile::tempdir().unwrap();
    let verify = |dir: &Path| {
        let options = VerifyOptions {
            dir: dir.to_owned(),
            scene: None,
            views: 0..1,
        };
        verify(&options, &Console::Silent)
    };
    assert_names(
        &format!("{:#}", verify(folder.path()).unwrap_err()),
        &["bundle.json"],
    );

    let dir = folder.path().join("bundle");
    bake(&options(SceneChoice::House, 64, &dir), &Console::Silent).unwrap();
    assert!(verify(&dir).is_ok());
    let page = dir.join("pages/000.png");
    let mut bytes = fs::read(&page).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&page, bytes).unwrap();
    assert_names(
        &format!("{:#}", verify(&dir).unwrap_err()),
        &["pages/000.png"],
    );
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
            views: 0..1,
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

/// Every file of a folder of malformed ones, where there is one beside the models, is refused or
/// read into a sound scene.
#[test]
fn malformed_files_are_refused_or_read_soundly() {
    let models = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let folder = models.and_then(|models| Some(models.parent()?.join("bad-gltf")));
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else {
        return skipped("no folder of malformed files lies beside FARFIELD_MODELS");
    };
    let mut count = 0;
    for (name, _) in contents(&folder) {
        let path = folder.join(&name);
        if !path
            .extension()
            .is_some_and(|end| end == "gltf" || end == "glb")
        {
            continue;
        }
        count += 1;
        match farfield_import::read(&path) {
            Ok(imported) => assert_eq!(imported.scene.check(), Ok(()), "{}", name.display()),
            Err(error) => {
                let message = error.to_string();
                let file = path.file_name().unwrap().to_string_lossy().into_owned();
                assert_names(&message, &[&file]);
            }
        }
    }
    assert!(count >= 20, "only {count} files were read");
}
