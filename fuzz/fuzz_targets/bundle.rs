//! A manifest, a geometry, a page or lists of any bytes in the place of a good bundle's, with checksums
//! that are right, is refused or verified.

#![no_main]

use farfield_bundle::{
    CELLS_FILE, CELLS_FORMAT, Channels, FACES_FILE, FACES_FORMAT, GLTF_FILE, MANIFEST_FILE,
    sha256_hex,
};
use glam::DVec3;
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;
use xtask::{
    BakeOptions, BitfieldsOptions, Console, Making, SceneChoice, SeenFrom, VerifyOptions, Views,
    bake, bake_bitfields, verify,
};

const SCENE: &[u8] = include_bytes!("../scene.obj");
const PAGE_FILE: &str = "pages/000.png";

/// Two view cells beside the scene.
const BESIDE: SeenFrom = SeenFrom::Inside {
    center: DVec3::new(0.5, 0.5, 4.0),
    size: DVec3::ONE,
    cells: [2, 1, 1],
};

/// Good bundles, and where they lie.
struct Good {
    folder: tempfile::TempDir,
    bundles: Vec<Bundle>,
}

struct Bundle {
    dir: PathBuf,
    manifest: Value,
    geometry: Vec<u8>,
    /// A page, or the lists of bitfields.
    shown: (&'static str, Vec<u8>),
}

impl Bundle {
    fn read(dir: PathBuf, shown: &'static str) -> Self {
        let read = |name: &str| fs::read(dir.join(name)).expect("the bundle has it");
        Self {
            manifest: serde_json::from_slice(&read(MANIFEST_FILE)).expect("it is JSON"),
            geometry: read(GLTF_FILE),
            shown: (shown, read(shown)),
            dir,
        }
    }
}

static GOOD: LazyLock<Good> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let scene = folder.path().join("scene.obj");
    fs::write(&scene, SCENE).expect("the scene can be written");
    let tdm = Making::Tdm { enlarged: 1.0 };
    let layered = BakeOptions::new(SceneChoice::File(scene.clone())).making;
    let kinds = [
        (layered, Channels::Lit),
        (tdm, Channels::Lit),
        (layered, Channels::Pbr),
    ];
    let bundles = kinds
        .into_iter()
        .enumerate()
        .map(|(i, (making, channels))| {
            let dir = folder.path().join(i.to_string());
            let options = BakeOptions {
                resolution: 16,
                making,
                channels,
                out: Some(dir.clone()),
                ..BakeOptions::new(SceneChoice::File(scene.clone()))
            };
            bake(&options, &Console::Silent).expect("the scene can be baked");
            Bundle::read(dir, PAGE_FILE)
        });
    let mut bundles: Vec<Bundle> = bundles.collect();
    let around = BitfieldsOptions::new(SceneChoice::File(scene.clone())).seen_from;
    for (lists, seen_from) in [(FACES_FILE, around), (CELLS_FILE, BESIDE)] {
        let dir = folder.path().join(lists);
        let options = BitfieldsOptions {
            resolution: 16,
            held_back: Some(16),
            out: Some(dir.clone()),
            seen_from,
            ..BitfieldsOptions::new(SceneChoice::File(scene.clone()))
        };
        bake_bitfields(&options, &Console::Silent).expect("the scene can be baked");
        bundles.push(Bundle::read(dir, lists));
    }
    Good { bundles, folder }
});

impl Bundle {
    /// Writes all files, and a manifest with checksums that are right where it is an object.
    fn write(&self, manifest: &[u8], geometry: &[u8], shown: &[u8]) {
        let mut manifest = manifest.to_vec();
        if let Ok(mut value @ Value::Object(_)) = serde_json::from_slice(&manifest) {
            for file in value["files"].as_array_mut().into_iter().flatten() {
                let bytes = match file["path"].as_str() {
                    Some(GLTF_FILE) => geometry,
                    Some(name) if name == self.shown.0 => shown,
                    _ => continue,
                };
                file["bytes"] = json!(bytes.len());
                file["sha256"] = json!(sha256_hex(bytes));
            }
            value["sha256"] = json!("0".repeat(64));
            value["sha256"] = json!(sha256_hex(value.to_string().as_bytes()));
            manifest = value.to_string().into_bytes();
        }
        for (name, bytes) in [
            (MANIFEST_FILE, &*manifest),
            (GLTF_FILE, geometry),
            (self.shown.0, shown),
        ] {
            fs::write(self.dir.join(name), bytes).expect("the file can be written");
        }
    }
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let good = &*GOOD;
    assert!(good.folder.path().exists());
    for bundle in &good.bundles {
        let manifest = bundle.manifest.to_string().into_bytes();
        let (name, shown) = &bundle.shown;
        let says = |format: &str| {
            let mut places = bytes.windows(format.len());
            places.any(|place| place == format.as_bytes())
        };
        // How the bytes begin tells what they are, and of lists their format.
        match bytes {
            [b'g', ..] => bundle.write(&manifest, bytes, shown),
            [0x89, ..] if *name == PAGE_FILE => bundle.write(&manifest, &bundle.geometry, bytes),
            _ if *name == FACES_FILE && says(FACES_FORMAT)
                || *name == CELLS_FILE && says(CELLS_FORMAT) =>
            {
                bundle.write(&manifest, &bundle.geometry, bytes);
            }
            _ => bundle.write(bytes, &bundle.geometry, shown),
        }
        let options = VerifyOptions {
            dir: bundle.dir.clone(),
            scene: None,
            // Not several, which would write a report.
            views: Views::One(1),
        };
        if let Err(error) = verify(&options, &Console::Silent) {
            let message = format!("{error:#}");
            assert!(!message.contains('\n'), "more than one line: {message}");
        }
    }
});
