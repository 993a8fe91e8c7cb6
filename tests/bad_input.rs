//! Bad input gives one clear message and leaves nothing behind.

use crate::deadline::must_end;
use crate::setup::{contents, options, options_in_cell, skipped};
use crate::shapes;
use glam::Vec3;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use xtask::{BuiltIn, Console, SceneChoice, VerifyOptions, VerifyReport, Views, bake, verify};

/// The message of a bake that must fail and leave its folder as it was.
fn refusal(scene: &Path, cell: Option<&str>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bundle");
    let scene = SceneChoice::File(scene.to_owned());
    let options = match cell {
        Some(cell) => options_in_cell(scene, cell, 64, &out),
        None => options(scene, 64, &out),
    };
    let error = must_end(&options.scene, || bake(&options, &Console::Silent));
    let error = error.expect_err("the bake must fail");
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
    farfield_bundle::glb_from_scene(&shapes::triangle(corners), &[]).unwrap()
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
        views: Views::First(1),
    };
    verify(&options, &Console::Silent)
}

/// The message of a verification that must fail and leave the bundle's folder as it was.
fn refused_bundle(dir: &Path, scene: Option<PathBuf>) -> String {
    let before = contents(dir);
    let error = must_end(&dir, || looked_at(dir, scene));
    let error = error.expect_err("the bundle must be refused");
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
            views: Views::First(27),
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

/// What is said of something that the Khronos validator, or the folder's readme, finds wrong.
enum Told {
    /// The file is refused with these words.
    Refused(&'static str),
    /// It is read, with these words in a warning.
    Warned(&'static str),
    /// Nothing; why.
    Not(&'static str),
}

use Told::{Not, Refused, Warned};

const COMPUTED: &str = "bounds are computed from the elements, whatever the file says of them";
const LEFT_OUT: &str = "is of skins, which are left out, and that they are is told";

/// The malformed files, what is wrong with each, and what is said of it.
const FINDINGS: [(&str, &[(&str, Told)]); 22] = [
    (
        "khronos-validator/base/data/accessor/matrix_alignment.gltf",
        &[
            (
                "ACCESSOR_TOO_LONG",
                Refused("accessors[0]: needs 17 bytes of bufferViews[0], which has 14"),
            ),
            (
                "ACCESSOR_MATRIX_ALIGNMENT",
                Not("is a later fault in a file that is refused, of matrices, which none reads"),
            ),
        ],
    ),
    (
        "khronos-validator/base/data/accessor_data/out_of_range_elements_uint32.gltf",
        &[
            ("ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND", Not(COMPUTED)),
            ("ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND", Not(COMPUTED)),
            ("ACCESSOR_MAX_MISMATCH", Not(COMPUTED)),
            ("ACCESSOR_MIN_MISMATCH", Not(COMPUTED)),
        ],
    ),
    (
        "khronos-validator/base/data/asset/1_0_version.gltf",
        &[(
            "UNKNOWN_ASSET_MAJOR_VERSION",
            Refused("asset.version: glTF version \"1.0\" is not supported"),
        )],
    ),
    (
        "khronos-validator/base/data/buffer/empty_array.gltf",
        &[("EMPTY_ENTITY", Not("an empty list has a clear meaning"))],
    ),
    (
        "khronos-validator/base/data/buffer/invalid_uri_data.gltf",
        &[(
            "INVALID_URI",
            Refused("buffers[0].uri: the URI \"data:application/octet-stream;;base64,AA==\" has"),
        )],
    ),
    (
        "khronos-validator/base/data/buffer_view/empty_object.gltf",
        &[(
            "UNDEFINED_PROPERTY",
            Refused("bufferViews[0]: missing field `buffer`"),
        )],
    ),
    (
        "khronos-validator/base/data/glb/empty_json_chunk.glb",
        &[("GLB_EMPTY_CHUNK", Refused("GLB chunk 0: is empty"))],
    ),
    (
        "khronos-validator/base/data/glb/misplaced_bin_chunk.glb",
        &[
            (
                "GLB_UNEXPECTED_BIN_CHUNK",
                Refused("GLB chunk 2: is the binary chunk, which must be the second"),
            ),
            (
                "GLB_UNKNOWN_CHUNK_TYPE",
                Not("the format has readers skip chunks that they do not know"),
            ),
        ],
    ),
    (
        "khronos-validator/base/data/image/png_eos.gltf",
        &[("IMAGE_UNEXPECTED_EOS", Not("nothing shows the image"))],
    ),
    (
        "khronos-validator/base/data/json/empty_file.gltf",
        &[(
            "INVALID_JSON",
            Refused("is empty; fetch or export it again"),
        )],
    ),
    (
        "khronos-validator/base/data/mesh/position_accessor_no_bounds.gltf",
        &[(
            "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS",
            Not(COMPUTED),
        )],
    ),
    (
        "khronos-validator/base/data/mesh_data/colors_non_clamped.gltf",
        &[("ACCESSOR_NON_CLAMPED", Not("no node has the mesh"))],
    ),
    (
        "khronos-validator/base/data/mesh_data/joints_weights_complex.gltf",
        &[
            (
                "ACCESSOR_JOINTS_INDEX_OOB",
                Warned("skinned objects, read as if they had no skin: 2"),
            ),
            ("ACCESSOR_JOINTS_INDEX_DUPLICATE", Not(LEFT_OUT)),
            ("ACCESSOR_JOINTS_USED_ZERO_WEIGHT", Not(LEFT_OUT)),
            ("ACCESSOR_WEIGHTS_NEGATIVE", Not(LEFT_OUT)),
            ("ACCESSOR_WEIGHTS_NON_NORMALIZED", Not(LEFT_OUT)),
        ],
    ),
    (
        "khronos-validator/base/data/node/node_parent_override.gltf",
        &[(
            "NODE_PARENT_OVERRIDE",
            Refused("nodes[1].children[0]: node 2 has another parent already"),
        )],
    ),
    (
        "khronos-validator/base/data/node/rotation_non_unit.gltf",
        &[(
            "ROTATION_NON_UNIT",
            Warned("rotations of another length than 1, brought to it: 1"),
        )],
    ),
    (
        "khronos-validator/base/data/root/invalid_collection_type.gltf",
        &[(
            "TYPE_MISMATCH",
            Refused("samplers: invalid type: map, expected a sequence"),
        )],
    ),
    (
        "khronos-validator/base/data/scene/non_root_node.gltf",
        &[(
            "SCENE_NON_ROOT_NODE",
            Refused("scenes[0].nodes[0]: node 1 is another node's child"),
        )],
    ),
    (
        "khronos-validator/base/data/texture/unresolved_sampler.gltf",
        &[(
            "UNRESOLVED_REFERENCE",
            Refused("textures[0].sampler: 0 does not exist"),
        )],
    ),
    (
        "assimp/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb",
        &[(
            "infinities in positions",
            Refused("accessors[2] (POSITION): element 0 is not finite"),
        )],
    ),
    (
        "assimp/IndexOutOfRange/AllIndicesOutOfRange.gltf",
        &[(
            "indices out of range",
            Refused("element 0 is vertex 65535, the primitive has 24"),
        )],
    ),
    (
        "assimp/IndexOutOfRange/IndexOutOfRange.gltf",
        &[(
            "indices out of range",
            Refused("element 0 is vertex 255, the primitive has 24"),
        )],
    ),
    (
        "assimp/RecursiveNodes/RecursiveNodes.gltf",
        &[(
            "a node that is its own ancestor",
            Refused("node 0 is its own ancestor"),
        )],
    ),
];

/// Every file of a folder of malformed ones, where there is one beside the models, is refused with
/// one line or read into a sound scene, and so is a bake of it; and what is wrong with it is told, or
/// there is a reason why not.
#[test]
fn malformed_files_are_refused_or_read_soundly() {
    let models = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let folder = models.and_then(|models| Some(models.parent()?.join("bad-gltf")));
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else {
        return skipped("no folder of malformed files lies beside FARFIELD_MODELS");
    };
    let expected = fs::read(folder.join("expected.json")).expect("the folder says what is wrong");
    let expected: serde_json::Value = serde_json::from_slice(&expected).unwrap();
    let files: BTreeSet<PathBuf> = contents(&folder).into_iter().map(|file| file.0).collect();
    let is_gltf = |name: &&PathBuf| {
        let end = name.extension();
        end.is_some_and(|end| end == "gltf" || end == "glb")
    };
    let named: BTreeSet<PathBuf> = FINDINGS.iter().map(|(name, _)| name.into()).collect();
    assert_eq!(
        files
            .iter()
            .filter(is_gltf)
            .cloned()
            .collect::<BTreeSet<_>>(),
        named
    );
    for name in expected.as_object().unwrap().keys() {
        assert!(
            named.contains(Path::new(name)),
            "{name} is not in the folder"
        );
    }
    for (name, findings) in FINDINGS {
        // All that the validator finds, where it was asked.
        if let Some(report) = expected.get(name) {
            let codes = ["errorCodes", "warningCodes"].map(|list| report[list].as_array().unwrap());
            let codes: BTreeSet<_> = codes
                .into_iter()
                .flatten()
                .map(|code| code.as_str().unwrap())
                .collect();
            let named: BTreeSet<_> = findings.iter().map(|(code, _)| *code).collect();
            assert_eq!(codes, named, "{name}");
        }
        let path = folder.join(name);
        let read = must_end(&name, || farfield_import::read(&path));
        let (message, warnings) = match read {
            Ok(imported) => {
                assert_eq!(imported.scene.check(), Ok(()), "{name}");
                must_end(&name, || baked_or_refused(&path));
                (String::new(), imported.warnings)
            }
            Err(error) => {
                let message = error.to_string();
                assert_names(&message, &[&path.display().to_string()]);
                assert!(!message.contains('\n'), "more than one line: {message}");
                assert_eq!(refusal(&path, None), message);
                (message, Vec::new())
            }
        };
        for (code, told) in findings {
            match told {
                Refused(words) => assert!(message.contains(words), "{name}: {code}: {message}"),
                Warned(words) => assert!(
                    warnings.iter().any(|warning| warning.contains(words)),
                    "{name}: {code}: {warnings:?}"
                ),
                Not(why) => assert!(!why.is_empty()),
            }
        }
        // A refusal has a reason.
        let is_named = findings.iter().any(|(_, told)| matches!(told, Refused(_)));
        assert_eq!(message.is_empty(), !is_named, "{name}: {message}");
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
