use super::server::start;
use super::*;
use crate::{BakeOptions, BuiltIn, SceneChoice};
use farfield_bundle::Manifest;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;

/// Of a small bundle in a folder.
fn options_of(dir: &Path, scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        resolution: 64,
        out: Some(dir.into()),
        ..BakeOptions::new(scene)
    }
}

fn house(dir: &Path) {
    crate::bake(
        &options_of(dir, SceneChoice::BuiltIn(BuiltIn::House)),
        &Console::Silent,
    )
    .unwrap();
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A file of one triangle, and a bundle of it.
fn triangle(scene: &Path, dir: &Path) {
    std::fs::write(scene, TRIANGLE).unwrap();
    let options = options_of(dir, SceneChoice::File(scene.into()));
    crate::bake(&options, &Console::Silent).unwrap();
}

fn program() -> Vec<NewFile> {
    vec![NewFile {
        path: "index.html".into(),
        bytes: b"<!doctype html>".into(),
    }]
}

fn page_of(dir: &Path) -> Result<Vec<NewFile>> {
    let options = ViewOptions {
        dir: dir.into(),
        scene: None,
    };
    Ok(page_content(&options, &Console::Silent)?
        .into_iter()
        .chain(program())
        .collect())
}

fn json(folder: &Path, path: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(path)).unwrap()).unwrap()
}

/// An exported page has the bundle as it is, an original that reads back, and says of both what the
/// manifest says; it replaces a page, but not a bundle, and lies in none.
#[test]
fn a_page_shows_what_the_manifest_says() {
    let folder = tempfile::tempdir().unwrap();
    let (dir, out) = (folder.path().join("house"), folder.path().join("page"));
    house(&dir);
    let files = page_of(&dir).unwrap();
    for _ in 0..2 {
        export(&out, &dir, &files, &Console::Silent).unwrap();
    }
    let manifest: Manifest = farfield_bundle::read(&out.join("bundle")).unwrap();
    assert_eq!(manifest, farfield_bundle::read(&dir).unwrap());
    assert_eq!(
        std::fs::read(out.join("index.html")).unwrap(),
        b"<!doctype html>"
    );

    let original = farfield_import::read(&out.join(ORIGINAL)).unwrap().scene;
    let data = json(&out, "view.json");
    assert_eq!(data["original"], ORIGINAL);
    let before = serde_json::to_value(manifest.statistics.before).unwrap();
    let after = serde_json::to_value(manifest.statistics.after).unwrap();
    assert_eq!(
        [&data["cost"]["original"], &data["cost"]["impostor"]],
        [&before, &after]
    );
    assert_eq!(
        original.drawn_triangles(),
        manifest.statistics.before.triangles
    );

    let [min, max] = manifest.impostors[0].represented;
    let target = serde_json::to_value((min + max) / 2.0).unwrap();
    let eye = serde_json::to_value(manifest.impostors[0].body.layers().unwrap().pose.eye).unwrap();
    assert_eq!(data["views"].as_array().unwrap().len(), 256);
    assert_eq!(
        [&data["views"][0]["eye"], &data["views"][0]["target"]],
        [&eye, &target]
    );
    assert_eq!(data["views"][8]["eye"], data["cells"][0][7]);
    assert_eq!(data["worst"], serde_json::json!([]));

    assert!(export(&dir, &dir, &files, &Console::Silent).is_err());
    let inside = export(&dir.join("page"), &dir, &files, &Console::Silent);
    let message = inside.unwrap_err().to_string();
    assert!(message.contains("cannot lie in each other"), "{message}");
}

/// The worst views are those of the verification.
#[test]
fn the_worst_views_are_those_that_verify_found() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    triangle(&folder.path().join("scene.obj"), &dir);
    let options = crate::VerifyOptions {
        dir: dir.clone(),
        scene: None,
        views: crate::Views::First(3),
    };
    let report = crate::verify(&options, &Console::Silent).unwrap();
    let worst = |files: Vec<NewFile>| {
        let data = files.into_iter().find(|file| file.path == "view.json");
        let data: Value = serde_json::from_slice(&data.unwrap().bytes).unwrap();
        data["worst"].clone()
    };
    let found = worst(page_of(&dir).unwrap());
    assert_eq!(found, serde_json::json!(report.worst_views));
    assert_eq!(found[0], report.worst_view);
    assert!(report.worst_views.len() > 1);
    // The certificate knows the worst of them.
    std::fs::write(dir.join("verify.json"), "{").unwrap();
    let found = worst(page_of(&dir).unwrap());
    assert_eq!(found, serde_json::json!([report.worst_view]));
}

/// What is wrong with a bundle is said in the words of `verify`.
#[test]
fn bad_bundles_are_refused_as_by_verify() {
    let folder = tempfile::tempdir().unwrap();
    let same_words = |dir: &Path| {
        let options = crate::VerifyOptions {
            dir: dir.into(),
            scene: None,
            views: crate::Views::First(1),
        };
        let of_verify = crate::verify(&options, &Console::Silent).unwrap_err();
        let of_view = page_of(dir).unwrap_err();
        assert_eq!(format!("{of_view:#}"), format!("{of_verify:#}"));
    };
    same_words(&folder.path().join("nowhere"));
    let dir = folder.path().join("house");
    house(&dir);
    let page = dir.join("pages/000.png");
    let sound = std::fs::read(&page).unwrap();
    std::fs::write(&page, &sound[1..]).unwrap();
    same_words(&dir);
    std::fs::remove_file(&page).unwrap();
    same_words(&dir);
    std::fs::write(&page, &sound).unwrap();
    std::fs::write(dir.join("bundle.json"), "{}").unwrap();
    same_words(&dir);
}

/// Without the file that was baked, the page shows the impostor alone; a changed one is refused.
#[test]
fn a_moved_original_leaves_the_impostor() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.obj");
    let dir = folder.path().join("bundle");
    triangle(&scene, &dir);
    let has_original = |files: &[NewFile]| files.iter().any(|file| file.path == ORIGINAL);
    assert!(has_original(&page_of(&dir).unwrap()));
    let moved = folder.path().join("elsewhere.obj");
    std::fs::rename(&scene, &moved).unwrap();
    assert!(!has_original(&page_of(&dir).unwrap()));
    let named = ViewOptions {
        dir: dir.clone(),
        scene: Some(moved),
    };
    let files = page_content(&named, &Console::Silent).unwrap();
    assert!(has_original(&files));
    std::fs::write(&scene, TRIANGLE.replace('1', "2")).unwrap();
    let message = format!("{:#}", page_of(&dir).unwrap_err());
    assert!(
        message.contains("not the scene that was baked"),
        "{message}"
    );
}

/// What a server answers to the first line of a request.
fn ask(stream: &mut TcpStream, line: &str) -> String {
    write!(
        stream,
        "{line} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

/// Only the page's files are served, whatever is asked for, and only on this machine.
#[test]
fn nothing_but_the_page_is_served() {
    let (_server, address) = start(program(), 0).unwrap();
    assert!(address.ip().is_loopback());
    let ask = |line: &str| ask(&mut TcpStream::connect(address).unwrap(), line);
    for found in ["GET /", "GET /index.html", "GET /?a=../b"] {
        let answer = ask(found);
        assert!(answer.starts_with("HTTP/1.1 200 "), "{found}: {answer}");
        assert!(answer.ends_with("<!doctype html>"), "{found}: {answer}");
        assert!(answer.contains("text/html"), "{found}: {answer}");
    }
    for missing in [
        "GET /..",
        "GET /../Cargo.toml",
        "GET /bundle/../../Cargo.toml",
        "GET /%2e%2e/Cargo.toml",
        "GET //etc/passwd",
        "GET /Cargo.toml",
        "GET /src",
    ] {
        let answer = ask(missing);
        assert!(answer.starts_with("HTTP/1.1 404 "), "{missing}: {answer}");
    }
    let answer = ask("POST /");
    assert!(answer.starts_with("HTTP/1.1 405 "), "{answer}");
    // Somebody else's port is not taken.
    let taken = start(program(), address.port()).map(|(_, address)| address);
    assert!(format!("{:#}", taken.unwrap_err()).contains("choose another --port"));
}

/// Browsers open many connections at once and keep them: none waits for another.
#[test]
fn connections_do_not_wait_for_each_other() {
    let (_server, address) = start(program(), 0).unwrap();
    let connect = |_| TcpStream::connect(address).unwrap();
    let mut streams: Vec<TcpStream> = (0..32).map(connect).collect();
    // The last first, while the others say nothing.
    for stream in streams.iter_mut().rev() {
        assert!(ask(stream, "GET /").starts_with("HTTP/1.1 200 "));
    }
}
