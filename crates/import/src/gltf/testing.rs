//! Small glTF files for tests.

use super::{GltfError, read_gltf};
use crate::Imported;
use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};
use std::io::{self, Cursor};

/// A PNG of one white texel.
pub(crate) const PIXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8/5+hHgAHggJ/PchI7wAAAABJRU5ErkJggg==";

/// A GLB file.
pub(crate) fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, content) in [
        (b"JSON", document.to_string().as_bytes()),
        (b"BIN\0", binary),
    ] {
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
    }
    let length = file.len() as u32;
    file[8..12].copy_from_slice(&length.to_le_bytes());
    file
}

/// Bytes of a buffer, with the views and accessors on it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Binary {
    pub(crate) bytes: Vec<u8>,
    pub(crate) views: Vec<Value>,
    pub(crate) accessors: Vec<Value>,
}

impl Binary {
    /// Appends bytes and returns their view.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.views
            .push(json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}));
        self.views.len() - 1
    }

    /// Appends `count` elements and returns their accessor.
    pub(crate) fn accessor(&mut self, bytes: &[u8], code: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.accessors.push(
            json!({"bufferView": view, "componentType": code, "type": shape, "count": count}),
        );
        self.accessors.len() - 1
    }

    /// Appends vectors of floats and returns their accessor.
    pub(crate) fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = elements
            .iter()
            .flatten()
            .flat_map(|n| n.to_le_bytes())
            .collect();
        self.accessor(&bytes, 5126, &format!("VEC{N}"), elements.len())
    }

    /// Appends indices of shorts and returns their accessor.
    pub(crate) fn shorts(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|n| n.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, "SCALAR", indices.len())
    }

    /// A GLB file of the given further members of the document.
    pub(crate) fn file(&self, members: Value) -> Vec<u8> {
        glb(&self.document(members), &self.bytes)
    }

    pub(crate) fn document(&self, members: Value) -> Value {
        let mut document = json!({
            "asset": {"version": "2.0"}, "buffers": [{"byteLength": self.bytes.len()}],
            "bufferViews": self.views, "accessors": self.accessors,
        });
        for (name, member) in members.as_object().unwrap() {
            document[name] = member.clone();
        }
        document
    }
}

/// The bytes of a picture in some file format.
pub(crate) fn encode(
    picture: impl Into<image::DynamicImage>,
    format: image::ImageFormat,
) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A document that uses nearly everything that is read, and its binary chunk: 8 triangles in
/// 3 objects.
pub(crate) fn example() -> (Value, Vec<u8>) {
    let mut binary = Binary::default();
    let corners = [0.0, 1.0].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z], [1.0, 1.0, z]]);
    let positions = binary.floats(corners.as_flattened());
    let normals = binary.floats(&[[0.0, 0.0, 2.0]; 8]);
    let uvs = binary.accessor(&[0, 0, 255, 255].repeat(8), 5123, "VEC2", 8);
    let colors = binary.accessor(&[255, 128, 0, 255].repeat(8), 5121, "VEC4", 8);
    for accessor in [uvs, colors] {
        binary.accessors[accessor]["normalized"] = json!(true);
    }
    let triangles = binary.shorts(&[0, 1, 2, 1, 3, 2, 4, 5, 6]);
    let strip = binary.accessor(&[4, 5, 6, 7], 5121, "SCALAR", 4);
    let (at, values) = (binary.view(&[1, 7]), binary.view(&[0; 24]));
    binary.accessors.push(json!({
        "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 8,
        "sparse": {"count": 2, "indices": {"bufferView": at, "componentType": 5121},
            "values": {"bufferView": values}},
    }));
    let sparse = binary.accessors.len() - 1;
    let picture = image::RgbaImage::from_pixel(2, 2, image::Rgba([10, 20, 30, 40]));
    let png = encode(picture, image::ImageFormat::Png);
    let view = binary.view(&png);
    let uri = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&png));
    let all =
        json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors});
    let base_color_texture = json!({"index": 0, "extensions": {
        "KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1, "scale": [2, 2]}}});
    let document = binary.document(json!({
        "scene": 0,
        "scenes": [{"nodes": [0, 3]}],
        "nodes": [
            {"name": "root", "children": [1, 2], "translation": [10, 0, 0], "rotation": [0, 0, 1, 0]},
            {"mesh": 0, "scale": [1, -1, 1]},
            {"mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
            {"mesh": 2, "name": "strip"},
        ],
        "meshes": [
            {"primitives": [{"attributes": all, "indices": triangles, "material": 0}]},
            {"primitives": [{"attributes": all, "indices": triangles, "material": 2}], "name": "plain"},
            {"primitives": [{"attributes": {"POSITION": sparse}, "indices": strip, "mode": 5, "material": 1}]},
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {"baseColorTexture": base_color_texture,
                    "baseColorFactor": [1, 0.5, 0.25, 1], "metallicFactor": 0, "roughnessFactor": 0.5},
                "normalTexture": {"index": 1, "scale": 0.5}, "alphaMode": "MASK", "alphaCutoff": 0.25,
                "doubleSided": true,
            },
            {"emissiveFactor": [1, 0, 0], "alphaMode": "BLEND", "extensions": {"KHR_materials_unlit": {}}},
            {"pbrMetallicRoughness": {"baseColorTexture": base_color_texture}},
        ],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
        "samplers": [{"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"bufferView": view, "mimeType": "image/png"}, {"uri": uri}],
    }));
    (document, binary.bytes)
}

/// Reads a file that stands alone, and checks what comes out.
pub(crate) fn read(file: &[u8]) -> Result<Imported, GltfError> {
    let nothing_beside = |path: &str| Err(io::Error::new(io::ErrorKind::NotFound, path.to_owned()));
    let imported = read_gltf(file, &mut { nothing_beside })?;
    imported.scene.check().unwrap();
    Ok(imported)
}
