//! The command line is a contract: exit status, stdout and stderr.

use std::path::Path;
use std::process::{Command, Output};

fn xtask(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(arguments)
        .current_dir(folder)
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
    let bundle = "target/farfield/house-layered";
    assert!(folder.path().join(bundle).join("bundle.json").exists());

    let verified = xtask(&["verify", bundle, "--views", "3", "--json"], folder.path());
    assert_eq!(verified.status.code(), Some(0), "{}", stderr(&verified));
    let names = [
        "views",
        "gap_pixels",
        "phantom_pixels",
        "coverage_error",
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
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_wrong_command_line_is_status_2() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["bake", "--view-cell", "ball:0,0,0:1"][..],
        &["bake", "--fov", "190"],
        &["bake", "--resolution", "many"],
        &["verify"],
        &["verify", ".", "--views", "0"],
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
    let files: Vec<_> = manifest
        .files
        .iter()
        .map(|file| farfield_bundle::NewFile {
            path: file.path.clone(),
            bytes: match file.path.ends_with(".png") {
                true => farfield_bundle::encode_png(&page),
                false => std::fs::read(dir.join(&file.path)).unwrap(),
            },
        })
        .collect();
    farfield_bundle::write(&dir, &manifest, &files).unwrap();

    let verified = xtask(&["verify", out, "--views", "2"], folder.path());
    assert_eq!(verified.status.code(), Some(3), "{}", stderr(&verified));
    assert!(stderr(&verified).contains("BROKEN"));
    assert!(stderr(&verified).contains("gaps at pixels ("));
}
