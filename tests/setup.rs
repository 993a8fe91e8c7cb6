//! What the tests share: options, folders and real models.

use farfield_bundle::{GLTF_FILE, Manifest, NewFile};
use farfield_scene::Scene;
use std::io::Write;
use std::path::{Path, PathBuf};
use xtask::{BakeOptions, Console, SceneChoice, VerifyOptions, VerifyReport, Views};

/// A bake of a scene for a picture of `resolution` pixels a side.
pub(crate) fn options(scene: SceneChoice, resolution: u32, out: &Path) -> BakeOptions {
    BakeOptions {
        resolution,
        out: Some(out.to_owned()),
        ..BakeOptions::new(scene)
    }
}

/// The same, from within a view cell named as on the command line.
pub(crate) fn options_in_cell(
    scene: SceneChoice,
    cell: &str,
    resolution: u32,
    out: &Path,
) -> BakeOptions {
    let view_cell = Some(cell.parse().expect("the test names a view cell"));
    BakeOptions {
        view_cell,
        ..options(scene, resolution, out)
    }
}

/// Looks at a bundle from its first `views` viewpoints.
pub(crate) fn verified(dir: &Path, views: u64) -> VerifyReport {
    let options = VerifyOptions {
        dir: dir.to_owned(),
        scene: None,
        views: Views::First(views),
    };
    xtask::verify(&options, &Console::Silent).expect("the bundle can be verified")
}

/// Writes a scene and its images into a folder as glTF, and returns the file.
pub(crate) fn write_glb(scene: &Scene, folder: &Path) -> PathBuf {
    let uris: Vec<String> = (0..scene.images.len())
        .map(|i| format!("{i}.png"))
        .collect();
    for (image, uri) in scene.images.iter().zip(&uris) {
        let png = farfield_bundle::encode_png(image);
        std::fs::write(folder.join(uri), png).expect("the image can be written");
    }
    let glb = farfield_bundle::glb_from_scene(scene, &uris).expect("the scene is small");
    let path = folder.join("scene.glb");
    std::fs::write(&path, glb).expect("the file can be written");
    path
}

/// What a bundle of colours displays.
pub(crate) fn display(dir: &Path) -> Scene {
    let imported = farfield_import::read(&dir.join(GLTF_FILE));
    imported.expect("the bundle can be read").scene
}

/// Writes a bundle of colours that displays something, with checksums that are right.
pub(crate) fn write_bundle(dir: &Path, manifest: &Manifest, display: &Scene) {
    let uris: Vec<String> = (0..display.images.len())
        .map(|i| format!("pages/{i:03}.png"))
        .collect();
    let glb = NewFile {
        path: GLTF_FILE.into(),
        bytes: farfield_bundle::glb_from_scene(display, &uris).expect("the display is small"),
    };
    let pages = display.images.iter().zip(&uris);
    let pages = pages.map(|(image, uri)| NewFile {
        path: uri.clone(),
        bytes: farfield_bundle::encode_png(image),
    });
    let files: Vec<_> = std::iter::once(glb).chain(pages).collect();
    farfield_bundle::write(dir, manifest, &files).expect("the bundle can be written");
}

/// A real model, where the environment variable `FARFIELD_MODELS` names a folder that has it.
pub(crate) fn model(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("FARFIELD_MODELS").map(|folder| PathBuf::from(folder).join(name));
    let found = path.filter(|path| path.exists());
    if found.is_none() {
        skipped(&format!("{name} is in no folder named by FARFIELD_MODELS"));
    }
    found
}

/// Says on the test's output that something was not tested.
pub(crate) fn skipped(why: &str) {
    // Not through `eprintln!`: what passing tests print with it is not shown.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}

/// Names and contents of all files under a folder, sorted.
pub(crate) fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("the folder can be read") {
            let path = entry.expect("the entry can be read").path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    let bytes = std::fs::read(&path).expect("the file can be read");
                    let name = path.strip_prefix(folder).expect("it lies in the folder");
                    files.push((name.to_owned(), bytes));
                }
            }
        }
    }
    files.sort();
    files
}
