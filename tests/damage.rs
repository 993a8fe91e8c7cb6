//! Ways to damage files.

use crate::good::{GoodScene, good_glb};
use farfield_bundle::{MANIFEST_FILE, sha256_hex};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use xtask::{BakeOptions, SceneChoice};

/// What happens to a file's bytes.
#[derive(Clone, Debug)]
pub(crate) enum Damage {
    /// It ends early.
    Cut(prop::sample::Index),
    /// Single bits change.
    Flip(Vec<(prop::sample::Index, u8)>),
    /// A number of four bytes changes.
    Number(prop::sample::Index, u32),
}

impl Damage {
    /// The damaged bytes.
    pub(crate) fn of(&self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        match self {
            Self::Cut(at) => bytes.truncate(at.index(bytes.len())),
            Self::Flip(bits) => {
                for (at, bit) in bits {
                    let at = at.index(bytes.len());
                    bytes[at] ^= 1 << bit;
                }
            }
            Self::Number(at, number) => {
                let at = at.index(bytes.len() - 3);
                bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
            }
        }
        bytes
    }
}

/// Any damage.
pub(crate) fn damages() -> impl Strategy<Value = Damage> {
    let place = any::<prop::sample::Index>;
    let numbers = prop::sample::select(vec![
        0,
        1,
        0x7F,
        0xFFFF,
        0x7FFF_FFFF,
        0x8000_0000,
        u32::MAX,
        // Not a number, infinite, and the greatest finite number, as floats.
        0x7FC0_0000,
        0x7F80_0000,
        0x7F7F_FFFF,
    ]);
    prop_oneof![
        1 => place().prop_map(Damage::Cut),
        3 => prop::collection::vec((place(), 0..8u8), 1..4).prop_map(Damage::Flip),
        2 => (place(), numbers).prop_map(|(at, number)| Damage::Number(at, number)),
    ]
}

/// What may come in the place of a part of a manifest.
fn values() -> impl Strategy<Value = Value> {
    let numbers = vec![
        0.0, 0.5, 1.0, -1.0, 2.0, 1e-300, 5e-324, 1e-9, 1e9, 1e20, 1e154, 1e200, 1e308, -1e308,
        179.999,
    ];
    prop_oneof![
        3 => prop::sample::select(numbers).prop_map(|number| json!(number)),
        3 => prop::sample::select(vec![0, 1, 2, 3, 255, 4096, 16384, 65535, 65536, u64::MAX])
            .prop_map(|number| json!(number)),
        1 => prop::sample::select(vec!["", "NaN", "-inf", "../../..", "house", "layered"])
            .prop_map(|text| json!(text)),
        1 => prop::sample::select(vec![json!(null), json!([]), json!({}), json!(true)]),
    ]
}

/// All places in a JSON document that hold no other.
fn places(value: &Value) -> Vec<String> {
    let within = |(name, value): (String, &Value)| {
        let inner = places(value);
        inner
            .into_iter()
            .map(move |place| format!("/{name}{place}"))
    };
    match value {
        Value::Object(fields) => {
            let fields = fields.iter().map(|(name, value)| (name.clone(), value));
            fields.flat_map(within).collect()
        }
        Value::Array(values) if !values.is_empty() => {
            let values = values.iter().enumerate();
            values
                .map(|(i, value)| (i.to_string(), value))
                .flat_map(within)
                .collect()
        }
        _ => vec![String::new()],
    }
}

/// Writes a good scene into a folder; returns its path, and path and contents of each of its files.
pub(crate) fn write_scene<'a>(
    good: &'a GoodScene,
    folder: &Path,
) -> (PathBuf, Vec<(PathBuf, &'a [u8])>) {
    let all = good.beside.iter().chain([&good.scene]);
    let files: Vec<_> = all
        .map(|(name, bytes)| (folder.join(name), bytes.as_slice()))
        .collect();
    for (path, bytes) in &files {
        fs::write(path, bytes).unwrap();
    }
    (folder.join(good.scene.0), files)
}

/// Writes the good GLB file into a folder, and says how to bake it into the folder `bundle` beside
/// it.
pub(crate) fn good_options(folder: &Path) -> BakeOptions {
    let scene = folder.join("scene.glb");
    fs::write(&scene, good_glb()).unwrap();
    BakeOptions {
        resolution: 32,
        out: Some(folder.join("bundle")),
        ..BakeOptions::new(SceneChoice::File(scene))
    }
}

/// The manifest of the bundle in a folder, whatever it says.
pub(crate) fn manifest(dir: &Path) -> Value {
    serde_json::from_slice(&fs::read(dir.join(MANIFEST_FILE)).unwrap()).unwrap()
}

/// Writes a manifest with checksums that are right for what lies in the folder.
pub(crate) fn stamp(dir: &Path, mut manifest: Value) {
    for file in manifest["files"].as_array_mut().into_iter().flatten() {
        let path = file["path"].as_str().map(|path| dir.join(path));
        if let Some(bytes) = path.and_then(|path| fs::read(path).ok()) {
            file["bytes"] = json!(bytes.len());
            file["sha256"] = json!(sha256_hex(&bytes));
        }
    }
    if manifest.is_object() {
        manifest["sha256"] = json!("0".repeat(64));
        manifest["sha256"] = json!(sha256_hex(manifest.to_string().as_bytes()));
    }
    fs::write(dir.join(MANIFEST_FILE), manifest.to_string()).unwrap();
}

/// Changes of a manifest in up to three places; its files are what is there, and checked by other
/// tests.
pub(crate) fn changes(manifest: &Value) -> impl Strategy<Value = Vec<(String, Value)>> + use<> {
    let all: Vec<String> = places(manifest)
        .into_iter()
        .filter(|place| !place.starts_with("/files") && !place.ends_with("sha256"))
        .collect();
    prop::collection::vec((prop::sample::select(all), values()), 1..4)
}

/// A manifest with its changes.
pub(crate) fn changed(manifest: &Value, changes: &[(String, Value)]) -> Value {
    let mut changed = manifest.clone();
    for (place, value) in changes {
        *changed.pointer_mut(place).unwrap() = value.clone();
    }
    changed
}
