//! Small good files of every kind that is read, and ways to damage them.

use farfield_bundle::{MANIFEST_FILE, sha256_hex};
use image::{DynamicImage, ImageFormat, RgbImage};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::io::Cursor;
use std::path::Path;
use xtask::{BakeOptions, Console, SceneChoice, bake};

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
pub(crate) fn values() -> impl Strategy<Value = Value> {
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
pub(crate) fn places(value: &Value) -> Vec<String> {
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

/// A picture of many colours.
pub(crate) fn picture(format: ImageFormat) -> Vec<u8> {
    let picture = RgbImage::from_fn(48, 32, |x, y| {
        image::Rgb([x * 5, y * 7, (x * 13 + y * 29) % 251].map(|n| n as u8))
    });
    let mut file = Cursor::new(Vec::new());
    DynamicImage::from(picture)
        .write_to(&mut file, format)
        .unwrap();
    file.into_inner()
}

/// A GLB file of two triangles with a PNG and a JPEG in it.
pub(crate) fn good_glb() -> Vec<u8> {
    let bytes = |numbers: &[f32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    let parts: [Vec<u8>; 5] = [
        bytes(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]),
        bytes(&[0., 1., 1., 1., 1., 0., 0., 0.]),
        [0u16, 1, 2, 0, 2, 3]
            .iter()
            .flat_map(|i| i.to_le_bytes())
            .collect(),
        picture(ImageFormat::Png),
        picture(ImageFormat::Jpeg),
    ];
    let mut binary = Vec::new();
    let mut views = Vec::new();
    for part in parts {
        views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": part.len()}));
        binary.extend(part);
        binary.resize(binary.len().next_multiple_of(4), 0);
    }
    let primitive = |material: u32| {
        json!({
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": material
        })
    };
    let material = |texture: u32| {
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}
        })
    };
    let document = json!({
        "asset": {"version": "2.0"},
        "nodes": [{"name": "flag", "mesh": 0, "translation": [1, 2, 3], "children": [1]},
            {"name": "pennon", "mesh": 1, "scale": [2, 0.5, 1], "translation": [0, 0, 0.5]}],
        "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [primitive(0)]}, {"primitives": [primitive(1)]}],
        "materials": [material(0), material(1)],
        "textures": [{"source": 0}, {"source": 1}],
        "images": [{"bufferView": 3, "mimeType": "image/png"},
            {"bufferView": 4, "mimeType": "image/jpeg"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
                "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 4},
            {"bufferView": 2, "componentType": 5123, "type": "SCALAR", "count": 6}],
        "bufferViews": views,
        "buffers": [{"byteLength": binary.len()}],
    });
    let mut document = document.to_string().into_bytes();
    document.resize(document.len().next_multiple_of(4), b' ');
    let length = (28 + document.len() + binary.len()) as u32;
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(length.to_le_bytes());
    for (kind, content) in [(b"JSON", &document), (b"BIN\0", &binary)] {
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
    }
    file
}

/// Bakes the good GLB file into the folder `bundle` beside it.
pub(crate) fn bake_good(folder: &Path) {
    let scene = folder.join("scene.glb");
    fs::write(&scene, good_glb()).unwrap();
    let options = BakeOptions {
        resolution: 32,
        out: Some(folder.join("bundle")),
        ..BakeOptions::new(SceneChoice::File(scene))
    };
    bake(&options, &Console::Silent).unwrap();
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
