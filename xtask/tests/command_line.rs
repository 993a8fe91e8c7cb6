//! The command line is a contract: exit status, stdout and stderr.

use farfield_bundle::{CERTIFICATE_FILE, Manifest, NewFile};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn xtask(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(arguments)
        .current_dir(folder)
        // Mesa's drivers print to stderr where there is no desktop.
        .env("NODEVICE_SELECT", "1")
        .output()
        .expect("the program starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// One JSON object with a field of each of these names.
fn assert_fields(output: &Output, names: &[&str]) {
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON");
    for name in names {
        assert!(object.get(name).is_some(), "{name} is not in {object}");
    }
}

#[test]
fn bake_and_verify_report_as_promised() {
    let folder = tempfile::tempdir().unwrap();
    let baked = xtask(&["bake", "--resolution", "64", "--json"], folder.path());
    assert_eq!(baked.status.code(), Some(0), "{}", stderr(&baked));
    assert_fields(
        &baked,
        &[
            "bundle",
            "technique",
            "seconds",
            "triangles_in",
            "triangles_out",
            "layers",
            "quads",
            "draw_calls",
            "atlas_bytes",
            "geometry_bytes",
            "peak_rss_bytes",
            "impostors",
        ],
    );
    for stage in [
        "read",
        "place",
        "record",
        "cull",
        "grow quads",
        "pack",
        "paint",
        "write",
    ] {
        assert!(
            stderr(&baked).contains(stage),
            "{stage} is not in\n{}",
            stderr(&baked)
        );
    }
    let bundle = "target/farfield/town-layered";
    assert!(folder.path().join(bundle).join("bundle.json").exists());

    // As many as give colours of so small pictures a reliable mean.
    let verified = xtask(
        &["verify", bundle, "--views", "27", "--json"],
        folder.path(),
    );
    assert_eq!(verified.status.code(), Some(0), "{}", stderr(&verified));
    let names = [
        "views",
        "gap_pixels",
        "phantom_pixels",
        "coverage_error",
        "parallax_px",
        "flip_mean",
        "flip_p95",
        "psnr_db",
        "colour_bias",
        "stray_colours",
        "worst_view",
        "holds",
    ];
    assert_fields(&verified, &names);

    let one = xtask(&["verify", bundle, "--view", "5"], folder.path());
    assert_eq!(one.status.code(), Some(0), "{}", stderr(&one));
    assert!(one.stdout.is_empty());
    assert!(
        folder
            .path()
            .join(bundle)
            .join("report/view-0005-impostor.png")
            .exists()
    );
}

#[test]
fn failed_work_is_status_1_with_one_message() {
    let folder = tempfile::tempdir().unwrap();
    let output = xtask(&["bake", "missing.glb"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    let text = stderr(&output);
    let errors: Vec<_> = text
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    assert_eq!(errors.len(), 1, "{text}");
    assert_eq!(errors[0].matches("No such file").count(), 1, "{text}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Of bitfields too, with fields of their own.
#[test]
fn bitfields_report_as_promised() {
    let folder = tempfile::tempdir().unwrap();
    let bake = [
        "bake",
        "house",
        "--technique",
        "bitfields",
        "--resolution",
        "64",
        "--held-back",
        "32",
        "--verify",
        "--json",
    ];
    let baked = xtask(&bake, folder.path());
    assert_eq!(baked.status.code(), Some(0), "{}", stderr(&baked));
    assert_fields(
        &baked,
        &["bundle", "technique", "triangles_in", "layers", "bitfields"],
    );
    let object: serde_json::Value = serde_json::from_slice(&baked.stdout).unwrap();
    assert_eq!(object["technique"], "bitfields");
    for name in [
        "viewpoints",
        "lists",
        "ranges",
        "culled",
        "list_bytes",
        "missed_pixels",
    ] {
        assert!(
            object["bitfields"][name].is_number(),
            "{name} is not in {object}"
        );
    }
    assert_eq!(object["verify"]["holds"], true);
    for name in [
        "missed_pixels",
        "wrong_pixels",
        "culled",
        "missed_pixels_worst",
    ] {
        assert!(
            object["verify"]["bitfields"][name].is_number(),
            "{name} is not in {object}"
        );
    }
    let bundle = folder.path().join("target/farfield/house-bitfields");
    for name in [
        "faces.json",
        "report.html",
        "verify.json",
        "certificate.json",
    ] {
        assert!(bundle.join(name).exists(), "there is no {name}");
    }
    // What would be ignored is refused.
    let bundle = "target/farfield/house-bitfields";
    let refused = xtask(&["verify", bundle, "--device", "gpu"], folder.path());
    let text = stderr(&refused);
    assert_eq!(refused.status.code(), Some(1), "{text}");
    assert!(text.starts_with("error: --device gpu: "), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
}

/// Options that the technique would ignore are refused, and nothing is left behind.
#[test]
fn options_of_other_techniques_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bitfields = ["bake", "house", "--technique", "bitfields"];
    let layered = ["bake", "house"];
    for (first, rest) in [
        (&bitfields[..], &["--views-around=30"][..]),
        (&bitfields, &["--far=30", "--view-cell", "box:0,0,90:1,1,1"]),
        (&bitfields, &["--foliage", "centre"]),
        (&bitfields, &["--channels", "pbr"]),
        (&bitfields, &["--max-bytes", "1000"]),
        (&bitfields, &["--page-size", "512"]),
        (&bitfields, &["--dump", "dump"]),
        (&layered, &["--samples", "25"]),
        (&layered, &["--distances", "30:60"]),
        (&layered, &["--held-back", "30"]),
        (&layered, &["--tolerated-pixels", "3"]),
        (&layered, &["--neighbors", "true"]),
        (&bitfields, &["--tolerated-pixels", "3", "--samples", "25"]),
        (
            &bitfields,
            &["--samples", "25", "--view-cell", "box:0,0,90:1,1,1"],
        ),
        (&bitfields, &["--view-cell", "shaft:0,0,1:20:90"]),
    ] {
        let output = xtask(&[first, rest].concat(), folder.path());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{rest:?}: {text}");
        let name = rest[0].split('=').next().unwrap();
        let message = text.lines().next().unwrap();
        assert!(
            message.starts_with("error: ") && message.contains(name),
            "{rest:?}: {text}"
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

/// What there is to look at a bundle with is named; what is no bundle is refused before a page is built.
#[test]
fn view_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let look = |arguments: &[&str], message: &str| {
        let output = xtask(arguments, folder.path());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains(message), "{}", stderr(&output));
        assert!(output.stdout.is_empty());
    };
    let verified = xtask(&["verify", "house"], folder.path());
    let text = stderr(&verified);
    let error = text
        .lines()
        .find(|line| line.starts_with("error: "))
        .unwrap();
    // Nothing is built for a bundle that is not there.
    look(&["view", "house"], error);
    look(
        &["view", "house", "--screenshot", "a.png", "--view", "3"],
        error,
    );
    look(&["view", "house", "--web"], error);
    look(&["view", "house", "--web", "--export", "page"], error);
    look(
        &["view", "house", "--web", "--export", "house/page"],
        "cannot lie in each other",
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_wrong_command_line_is_status_2() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["bake", "--view-cell", "ball:0,0,0:1"][..],
        &["bake", "--fov", "190"],
        &["bake", "--resolution", "many"],
        &["bake", "--technique", "bitfields", "--distances", "30"],
        &["bake", "--technique", "bitfields", "--held-back", "0"],
        &["verify"],
        &["verify", ".", "--views", "0"],
        &["view"],
        &["view", ".", "--export", "page"],
        &["view", ".", "--web", "--port", "80000"],
        &["view", ".", "--web", "--port", "80", "--export", "page"],
        &["view", ".", "--web", "--screenshot", "a.png"],
        &["view", ".", "--mode", "both"],
        &["view", ".", "--size", "800"],
        &["view", ".", "--size", "0x600"],
        &["dance"],
    ] {
        let output = xtask(arguments, folder.path());
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
}

/// The message names option and value, and what is allowed.
#[test]
fn wrong_options_of_bitfields_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let cell = ["--view-cell", "box:0,1.8,25:1,1,1"];
    for (option, value, rest, allowed) in [
        ("--samples", "3", &[][..], "from 4 to 10000 samples"),
        ("--samples", "0", &[], "from 4 to 10000 samples"),
        ("--samples", "10001", &[], "from 4 to 10000 samples"),
        ("--samples", "7.5", &[], "from 4 to 10000 samples"),
        ("--distances", "9:8", &[], "8:9"),
        ("--distances", "0:8", &[], "positive and finite"),
        ("--distances", "8:inf", &[], "positive and finite"),
        ("--distances", "near:far", &[], "MIN:MAX"),
        ("--cells", "3,0,1", &cell, "1 to 10000 cells"),
        ("--cells", "200,200,200", &cell, "1 to 10000 cells"),
        ("--cells", "3,1", &cell, "three whole numbers"),
        ("--held-back", "0", &[], "1..=1000000"),
        ("--tolerated-pixels", "few", &[], "invalid digit"),
        ("--neighbors", "some", &[], "true, false"),
    ] {
        let bake = ["bake", "house", "--technique", "bitfields", option, value];
        let output = xtask(&[&bake[..], rest].concat(), folder.path());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{option} {value}: {text}");
        for part in [option, value, allowed] {
            assert!(text.contains(part), "{option} {value}: {text}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
    let flat = [
        "bake",
        "house",
        "--technique",
        "bitfields",
        "--view-cell",
        "box:0,1.8,25:1,0,1",
    ];
    let output = xtask(&flat, folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("a width, a height and a depth"));
}

/// The files of the bundle in a folder, with its pages changed.
fn files_with(dir: &Path, manifest: &Manifest, page: impl Fn(Vec<u8>) -> Vec<u8>) -> Vec<NewFile> {
    let file = |path: &String| {
        let bytes = fs::read(dir.join(path)).unwrap();
        NewFile {
            path: path.clone(),
            bytes: match path.ends_with(".png") {
                true => page(bytes),
                false => bytes,
            },
        }
    };
    manifest
        .files
        .iter()
        .map(|record| file(&record.path))
        .collect()
}

/// A glTF file of one triangle, with corners (0, 0, 0), (1, 0, 0) and (0, 1, 0).
const TRIANGLE: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri":
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]
}"#;

/// A changed bundle is refused before anything is measured; one that was also given new checksums
/// is only told apart from the one that was certified.
#[test]
fn a_changed_bundle_is_status_1_and_its_certificate_stale() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let out = dir.to_str().unwrap();
    fs::write(folder.path().join("scene.gltf"), TRIANGLE).unwrap();
    let baked = xtask(
        &["bake", "scene.gltf", "--resolution", "64", "--out", out],
        folder.path(),
    );
    assert_eq!(baked.status.code(), Some(0), "{}", stderr(&baked));
    let verified = xtask(&["verify", out, "--views", "2"], folder.path());
    assert_eq!(verified.status.code(), Some(0), "{}", stderr(&verified));
    // Of so few pixels colours tell nothing.
    let unjudged = "not judged: fewer than 10000 pixels";
    assert_eq!(stderr(&verified).matches(unjudged).count(), 2);
    let report = fs::read_to_string(dir.join("report.html")).unwrap();
    assert_eq!(report.matches(unjudged).count(), 2);
    let look = || xtask(&["verify", out, "--view", "1"], folder.path());
    let looked = look();
    assert!(stderr(&looked).contains("certified from 2 viewpoints"));

    let certificate = fs::read(dir.join(CERTIFICATE_FILE)).unwrap();
    let mut manifest = farfield_bundle::read(&dir).unwrap();
    manifest.warnings.push("It was edited.".into());
    let files = files_with(&dir, &manifest, |page| page);
    farfield_bundle::write(&dir, &manifest, &files).unwrap();
    fs::write(dir.join(CERTIFICATE_FILE), &certificate).unwrap();
    let looked = look();
    assert_eq!(looked.status.code(), Some(0), "{}", stderr(&looked));
    let stale = "warning: the certificate belongs to another";
    assert!(stderr(&looked).contains(stale), "{}", stderr(&looked));
    assert_eq!(fs::read(dir.join(CERTIFICATE_FILE)).unwrap(), certificate);

    let page = dir.join("pages/000.png");
    let mut bytes = fs::read(&page).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&page, bytes).unwrap();
    let refused = xtask(&["verify", out, "--json"], folder.path());
    assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
    assert!(refused.stdout.is_empty());
    let text = stderr(&refused);
    let errors: Vec<_> = text
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    assert_eq!(errors.len(), 1, "{text}");
    assert!(
        errors[0].contains("000.png does not match its checksum"),
        "{text}"
    );
}

/// Pages that are too small are refused, naming the least that would do.
#[test]
fn the_least_page_size_is_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.gltf"), TRIANGLE).unwrap();
    let bake = |size: u32| {
        let size = size.to_string();
        xtask(&["bake", "scene.gltf", "--page-size", &size], folder.path())
    };
    let refused = bake(64);
    assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
    let text = stderr(&refused);
    assert!(text.contains("--page-size 64 is too small: "), "{text}");
    let least = text.split("pages of ").last().unwrap();
    let least: u32 = least.split(' ').next().unwrap().parse().unwrap();
    assert_eq!(bake(least - 4).status.code(), Some(1));
    assert_eq!(bake(least).status.code(), Some(0));
}

#[test]
fn a_broken_promise_is_status_3() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let out = dir.to_str().unwrap();
    let baked = xtask(&["bake", "--resolution", "64", "--out", out], folder.path());
    assert_eq!(baked.status.code(), Some(0), "{}", stderr(&baked));

    // The same bundle with an empty page, and checksums that say so.
    let manifest = farfield_bundle::read(&dir).unwrap();
    let size = 4 * 64;
    let page = farfield_scene::Image {
        name: String::new(),
        width: size,
        height: size,
        texels: vec![[0; 4]; (size * size) as usize],
    };
    let files = files_with(&dir, &manifest, |_| farfield_bundle::encode_png(&page));
    farfield_bundle::write(&dir, &manifest, &files).unwrap();

    let verified = xtask(&["verify", out, "--views", "2"], folder.path());
    assert_eq!(verified.status.code(), Some(3), "{}", stderr(&verified));
    assert!(stderr(&verified).contains("BROKEN"));
    assert!(stderr(&verified).contains("gap pixels, promised at most 0: view 0 at ("));
}
