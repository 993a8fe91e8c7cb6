//! Small good files of every kind that is read.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use image::{DynamicImage, ImageFormat, RgbImage};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer,
};
use serde_json::{Value, json};
use std::io::Cursor;

/// A scene, of one file or several.
pub(crate) struct GoodScene {
    /// Its name, and what it contains.
    pub(crate) scene: (&'static str, Vec<u8>),
    /// Those that lie beside it.
    pub(crate) beside: Vec<(&'static str, Vec<u8>)>,
}

/// A scene of each kind that is read.
pub(crate) fn good_scenes() -> Vec<GoodScene> {
    let alone = |name, bytes| GoodScene {
        scene: (name, bytes),
        beside: Vec::new(),
    };
    let library = "newmtl a\nKd 1 0.5 0\nmap_Kd a.png\nPr 0.5\nnewmtl b\nKe 1 1 1\nd 0.5\n";
    vec![
        alone("pictures.glb", good_glb()),
        alone("quantised.glb", quantised_glb()),
        alone("draco.glb", draco_glb()),
        alone("meshopt.glb", meshopt_glb()),
        alone("basisu.glb", basisu_glb()),
        GoodScene {
            scene: ("scene.obj", obj()),
            beside: vec![
                ("scene.mtl", library.into()),
                ("a.png", picture(ImageFormat::Png)),
            ],
        },
        alone("ascii.ply", ply("ascii")),
        alone("little.ply", ply("binary_little_endian")),
        alone("big.ply", ply("binary_big_endian")),
    ]
}

/// Corners along each side of the sheet.
const SIDE: usize = 4;

/// A bumpy sheet's corners and triangles.
fn sheet() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let corner = |i: usize| {
        let (x, y) = (i % SIDE, i / SIDE);
        [x as f32, y as f32, ((x * 7 + y * 3) % 5) as f32 * 0.25]
    };
    let squares = (0..(SIDE - 1) * (SIDE - 1)).map(|i| i / (SIDE - 1) * SIDE + i % (SIDE - 1));
    let triangles = squares.flat_map(|v| [[v, v + 1, v + SIDE], [v + 1, v + SIDE + 1, v + SIDE]]);
    (
        (0..SIDE * SIDE).map(corner).collect(),
        triangles.map(|t| t.map(|v| v as u32)).collect(),
    )
}

fn bytes_of(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// Bytes of a buffer and views of its parts, each at a multiple of four.
#[derive(Default)]
struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
}

impl Binary {
    fn of(parts: impl IntoIterator<Item = Vec<u8>>) -> Self {
        let mut binary = Self::default();
        for part in parts {
            let (offset, length) = (binary.bytes.len(), part.len());
            let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
            binary.views.push(view);
            binary.bytes.extend(part);
            binary
                .bytes
                .resize(binary.bytes.len().next_multiple_of(4), 0);
        }
        binary
    }
}

/// A GLB file.
fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut document = document.to_string().into_bytes();
    document.resize(document.len().next_multiple_of(4), b' ');
    let length = (28 + document.len() + binary.len()) as u32;
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(length.to_le_bytes());
    for (kind, content) in [(b"JSON", &*document), (b"BIN\0", binary)] {
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
    }
    file
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
    let indices = [0u16, 1, 2, 0, 2, 3];
    let binary = Binary::of([
        bytes_of(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]),
        bytes_of(&[0., 1., 1., 1., 1., 0., 0., 0.]),
        indices.iter().flat_map(|i| i.to_le_bytes()).collect(),
        picture(ImageFormat::Png),
        picture(ImageFormat::Jpeg),
    ]);
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
        "bufferViews": binary.views,
        "buffers": [{"byteLength": binary.bytes.len()}],
    });
    glb(&document, &binary.bytes)
}

/// The sheet in positions of two bytes, with colours of one and a vertex that is moved.
fn quantised_glb() -> Vec<u8> {
    let (corners, triangles) = sheet();
    let positions = corners.iter().flat_map(|corner| {
        let [x, y, z] = corner.map(|c| (c * 1000.0) as i16);
        [x, y, z, 0].map(i16::to_le_bytes)
    });
    let binary = Binary::of([
        positions.flatten().collect(),
        (0..4 * corners.len()).map(|i| i as u8 * 3).collect(),
        triangles.as_flattened().iter().map(|&v| v as u8).collect(),
        vec![5],
        [7i16, 8, 9].map(i16::to_le_bytes).concat(),
    ]);
    let mut views = binary.views;
    views[0]["byteStride"] = json!(8);
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsRequired": ["KHR_mesh_quantization"],
        "nodes": [{"mesh": 0, "scale": [0.001, 0.001, 0.001]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5122, "type": "VEC3", "count": corners.len(),
                "min": [0, 0, 0], "max": [3000, 3000, 1000],
                "sparse": {"count": 1, "indices": {"bufferView": 3, "componentType": 5121},
                    "values": {"bufferView": 4}}},
            {"bufferView": 1, "componentType": 5121, "type": "VEC4", "count": corners.len(),
                "normalized": true},
            {"bufferView": 2, "componentType": 5121, "type": "SCALAR",
                "count": 3 * triangles.len()}],
        "bufferViews": views,
        "buffers": [{"byteLength": binary.bytes.len()}],
    });
    glb(&document, &binary.bytes)
}

/// The sheet in a stream of KHR_draco_mesh_compression, which runs along its edges.
fn draco_glb() -> Vec<u8> {
    let (corners, triangles) = sheet();
    let mut positions = PointAttribute::new();
    let kind = GeometryAttributeType::Position;
    positions.init(kind, 3, DataType::Float32, false, corners.len());
    positions
        .buffer_mut()
        .write(0, &bytes_of(corners.as_flattened()));
    let mut mesh = Mesh::new();
    mesh.set_num_points(corners.len());
    mesh.add_attribute(positions);
    mesh.set_num_faces(triangles.len());
    for (i, triangle) in triangles.iter().enumerate() {
        mesh.set_face(FaceIndex(i as u32), triangle.map(PointIndex));
    }
    let mut options = EncoderOptions::new();
    options.set_encoding_method(1);
    options.set_attribute_quantization(0, 11);
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut stream = EncoderBuffer::new();
    encoder.encode(&options, &mut stream).unwrap();

    let binary = Binary::of([stream.data().to_vec()]);
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsRequired": ["KHR_draco_mesh_compression"],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "extensions":
            {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}}]}],
        "accessors": [
            {"componentType": 5126, "type": "VEC3", "count": corners.len()},
            {"componentType": 5123, "type": "SCALAR", "count": 3 * triangles.len()}],
        "bufferViews": binary.views,
        "buffers": [{"byteLength": binary.bytes.len()}],
    });
    glb(&document, &binary.bytes)
}

/// The sheet in streams of EXT_meshopt_compression.
fn meshopt_glb() -> Vec<u8> {
    let (corners, triangles) = sheet();
    let mut workspace = Workspace::default();
    let positions = bytes_of(corners.as_flattened());
    let version = VertexEncoding::new(0, 0).unwrap();
    let vertices = encode_vertex_buffer(&positions, corners.len(), 12, version, &mut workspace);
    let indices = triangles.as_flattened();
    let faces = encode_index_buffer(indices, IndexEncoding::DEFAULT, &mut workspace);
    let binary = Binary::of([vertices.unwrap(), faces.unwrap()]);
    let kinds = [
        ("ATTRIBUTES", 12, corners.len()),
        ("TRIANGLES", 2, indices.len()),
    ];
    let mut decoded = 0;
    let compressed = binary.views.iter().zip(kinds);
    let views: Vec<Value> = compressed
        .map(|(stream, (mode, stride, count))| {
            let mut stream = stream.clone();
            stream["mode"] = json!(mode);
            stream["byteStride"] = json!(stride);
            stream["count"] = json!(count);
            let at = decoded;
            decoded += stride * count;
            json!({"buffer": 1, "byteOffset": at, "byteLength": stride * count,
                "extensions": {"EXT_meshopt_compression": stream}})
        })
        .collect();
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsRequired": ["EXT_meshopt_compression"],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": corners.len()},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": indices.len()}],
        "bufferViews": views,
        "buffers": [{"byteLength": binary.bytes.len()},
            {"byteLength": decoded, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}],
    });
    glb(&document, &binary.bytes)
}

/// The sheet with a KTX2 picture of KHR_texture_basisu.
fn basisu_glb() -> Vec<u8> {
    let (corners, triangles) = sheet();
    let uvs: Vec<f32> = corners
        .iter()
        .flat_map(|c| [c[0] / 3.0, c[1] / 3.0])
        .collect();
    let indices = triangles.as_flattened().iter();
    let binary = Binary::of([
        bytes_of(corners.as_flattened()),
        bytes_of(&uvs),
        indices.map(|&v| v as u8).collect(),
        ktx2(),
    ]);
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsRequired": ["KHR_texture_basisu"],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
            "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
        "images": [{"bufferView": 3, "mimeType": "image/ktx2"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": corners.len()},
            {"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": corners.len()},
            {"bufferView": 2, "componentType": 5121, "type": "SCALAR",
                "count": 3 * triangles.len()}],
        "bufferViews": binary.views,
        "buffers": [{"byteLength": binary.bytes.len()}],
    });
    glb(&document, &binary.bytes)
}

/// A KTX2 file of 8 x 8 texels in four blocks of UASTC, each of one colour.
pub(crate) fn ktx2() -> Vec<u8> {
    let colors = [
        [250u8, 0, 0, 255],
        [0, 250, 0, 255],
        [0, 0, 250, 255],
        [90, 90, 90, 255],
    ];
    // Mode 8, whose code is 10111, then red, green, blue and alpha.
    let blocks = colors.map(|c| (0x17 | u128::from(u32::from_le_bytes(c)) << 5).to_le_bytes());
    // No Vulkan format, bytes of a component, width, height, depth, layers, faces, levels and
    // supercompression; places and lengths of descriptor, keys and tables; the level's place,
    // length and inflated length, as words of four bytes.
    let mut header = vec![0, 1, 8, 8, 0, 0, 1, 1, 0];
    header.extend([104, 44, 0, 0, 0, 0, 0, 0]);
    header.extend([160, 0, 64, 0, 64, 0]);
    // The descriptor: UASTC in sRGB, blocks of 4 x 4 in 16 bytes, one sample of all channels.
    let model = 166 | 1 << 8 | 2 << 16;
    header.extend([
        44,
        0,
        2 | 40 << 16,
        model,
        0x0303,
        16,
        0,
        3 << 24 | 127 << 16,
    ]);
    header.extend([0, 0, u32::MAX]);
    let mut file = b"\xABKTX 20\xBB\r\n\x1A\n".to_vec();
    file.extend(header.iter().flat_map(|word| word.to_le_bytes()));
    file.resize(160, 0);
    file.extend(blocks.as_flattened());
    file
}

/// The sheet in two materials, its squares as polygons, and a triangle of relative corners.
fn obj() -> Vec<u8> {
    let (corners, triangles) = sheet();
    let mut text = "# a sheet\nmtllib scene.mtl\no sheet\n".to_owned();
    for [x, y, z] in corners {
        text += &format!("v {x} {y} {z}\nvt {} {}\nvn 0 0 1\n", x / 3.0, y / 3.0);
    }
    text += "usemtl a\n";
    for (i, pair) in triangles.chunks(2).enumerate() {
        if i == 6 {
            text += "g part\nusemtl b\n";
        }
        let [a, b, d, c] = [pair[0][0], pair[0][1], pair[0][2], pair[1][1]].map(|v| v + 1);
        text += &format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c} {d}/{d}/{d}\n");
    }
    text += "f -1//-1 -2//-2 \\\n -6//-6\n";
    text.into_bytes()
}

/// The sheet with colours, in one of the format's encodings.
fn ply(encoding: &str) -> Vec<u8> {
    let (corners, triangles) = sheet();
    let header = format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        corners.len(),
        triangles.len()
    );
    let mut file = header.into_bytes();
    // A number as text, or its bytes in their order; text alone ends an element.
    let mut push = |text: String, little: &[u8]| match encoding {
        "ascii" => file.extend(text.bytes()),
        "binary_big_endian" => file.extend(little.iter().rev()),
        _ => file.extend(little),
    };
    for corner in corners {
        for c in corner {
            push(format!("{c} "), &c.to_le_bytes());
        }
        for color in [200u8, 100, 50] {
            push(format!("{color} "), &[color]);
        }
        push("\n".into(), &[]);
    }
    for triangle in triangles {
        push("3 ".into(), &[3]);
        for v in triangle {
            push(format!("{v} "), &v.to_le_bytes());
        }
        push("\n".into(), &[]);
    }
    file
}
