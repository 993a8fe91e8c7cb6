//! Decodes primitives that are compressed with KHR_draco_mesh_compression.

use super::GltfError;
use super::accessors::{Component, layout};
use super::document::{Accessor, BufferView, BufferViewExtensions, Document, DracoCompression};
use super::files::Buffers;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Bytes that all streams of any file may become, and how many more for each of its bytes. Real
/// meshes become five to fifty times as large, flat and regular ones more.
const DECODED_BYTES: u64 = 1 << 28;
const DECODED_BYTES_PER_BYTE: u64 = 256;

/// Decodes the compressed primitives of the given meshes, in parallel, and lets new accessors
/// stand for what was decoded.
///
/// Where a primitive's accessors have buffer views, it is not compressed only, and its accessors
/// are left as they are: they have not lost what compression loses.
///
/// * `size` - of the file with its buffers, in bytes
///
/// Source: Khronos Group, KHR_draco_mesh_compression.
///
/// # Errors
///
/// When a stream is damaged, lacks an attribute or has more than its accessors say, or all
/// together are too large.
pub(crate) fn decode_primitives(
    document: &mut Document,
    meshes: &BTreeSet<usize>,
    buffers: &mut Buffers<'_>,
    size: u64,
) -> Result<(), GltfError> {
    let jobs = find_streams(document, meshes, buffers, size)?;
    let decoded: Vec<_> = jobs
        .into_par_iter()
        .map(|job| job.decode().map(|decoded| (job.primitives, decoded)))
        .collect();
    // The first error of the file, not of the fastest thread.
    for decoded in decoded {
        let (primitives, decoded) = decoded?;
        let indices = insert(document, buffers, decoded.indices);
        let mut attributes = BTreeMap::new();
        for (name, attribute) in decoded.attributes {
            attributes.insert(name, insert(document, buffers, attribute));
        }
        for (mesh, primitive) in primitives {
            let primitive = &mut document.meshes[mesh].primitives[primitive];
            primitive.indices = Some(indices);
            primitive.attributes.extend(attributes.clone());
            // Also strips are decoded to separate triangles.
            primitive.mode = 4;
        }
    }
    Ok(())
}

/// Appends an accessor of a buffer view of its own.
fn insert(document: &mut Document, buffers: &mut Buffers<'_>, column: Column) -> usize {
    let view = document.buffer_views.len();
    document.buffer_views.push(BufferView {
        buffer: 0,
        byte_offset: 0,
        byte_length: column.bytes.len() as u64,
        byte_stride: None,
        extensions: BufferViewExtensions::default(),
    });
    buffers.insert(view, column.bytes);
    document.accessors.push(Accessor {
        buffer_view: Some(view),
        ..column.accessor
    });
    document.accessors.len() - 1
}

/// An accessor without its buffer view, and its bytes, packed.
struct Column {
    accessor: Accessor,
    bytes: Vec<u8>,
}

struct Decoded {
    indices: Column,
    attributes: Vec<(String, Column)>,
}

/// A stream and what the document says about it.
struct Job<'a> {
    stream: &'a [u8],
    /// In the stream, of the attributes that are read, with their accessors.
    attributes: Vec<(String, u32, &'a Accessor, usize)>,
    /// Triangles and bytes of attributes at most.
    most_triangles: u64,
    most_bytes: u64,
    place: String,
    /// Mesh and number of the primitives that are this.
    primitives: Vec<(usize, usize)>,
}

/// Streams and attributes, so that primitives of the same are decoded once.
type Key = (usize, BTreeMap<String, u32>, BTreeMap<String, usize>);

fn find_streams<'a>(
    document: &'a Document,
    meshes: &BTreeSet<usize>,
    buffers: &'a Buffers<'_>,
    size: u64,
) -> Result<Vec<Job<'a>>, GltfError> {
    let limit = DECODED_BYTES + DECODED_BYTES_PER_BYTE * size;
    let mut total = 0;
    let mut jobs: Vec<Job<'_>> = Vec::new();
    let mut known: BTreeMap<Key, usize> = BTreeMap::new();
    for &mesh in meshes {
        for (number, primitive) in document.meshes[mesh].primitives.iter().enumerate() {
            let position = primitive.attributes.get("POSITION");
            let (Some(draco), Some(&position)) = (&primitive.extensions.draco, position) else {
                continue;
            };
            if document.accessors[position].buffer_view.is_some() {
                continue;
            }
            let DracoCompression {
                buffer_view,
                attributes,
            } = draco;
            let key = (
                *buffer_view,
                attributes.clone(),
                primitive.attributes.clone(),
            );
            if let Some(&job) = known.get(&key) {
                jobs[job].primitives.push((mesh, number));
                continue;
            }
            known.insert(key, jobs.len());

            let place = format!(
                "meshes[{mesh}].primitives[{number}].extensions.KHR_draco_mesh_compression"
            );
            let vertices = document.accessors[position].count;
            let corners = match primitive.indices {
                Some(indices) => document.accessors[indices].count,
                None => 3 * vertices,
            };
            let most_triangles = match primitive.mode {
                4 => corners / 3,
                _ => corners.saturating_sub(2),
            };
            let mut read = Vec::new();
            let mut most_bytes = 0;
            for (name, &id) in attributes {
                if let Some(&accessor) = primitive.attributes.get(name) {
                    let element = layout(&document.accessors[accessor], accessor)?.size;
                    // Points of a mesh are its vertices, split along seams at worst.
                    most_bytes += element * vertices.max(3 * most_triangles);
                    read.push((name.clone(), id, &document.accessors[accessor], accessor));
                }
            }
            total += most_bytes + 12 * most_triangles;
            if total > limit {
                return Err(GltfError::TooLarge {
                    place,
                    limit,
                    unit: "bytes of decoded meshes",
                    remedy: "split the file, or export it without compression",
                });
            }
            jobs.push(Job {
                stream: buffers.view(document, *buffer_view, 0)?,
                attributes: read,
                most_triangles,
                most_bytes,
                place,
                primitives: vec![(mesh, number)],
            });
        }
    }
    Ok(jobs)
}

impl Job<'_> {
    fn decode(&self) -> Result<Decoded, GltfError> {
        let fault = |problem: String| GltfError::Compressed {
            place: self.place.clone(),
            problem,
        };
        let limits = DecodeLimits::default()
            .with_max_faces(self.most_triangles)
            // The stream may have attributes that are not read.
            .with_max_decoded_bytes(DECODED_BYTES + 4 * self.most_bytes);
        let mut buffer = DecoderBuffer::new(self.stream).with_limits(limits);
        let mut mesh = Mesh::new();
        MeshDecoder::new()
            .decode(&mut buffer, &mut mesh)
            .map_err(|error| fault(error.to_string()))?;

        let points = mesh.num_points();
        let mut most_points = 3 * self.most_triangles;
        let mut attributes = Vec::new();
        for (name, id, accessor, index) in &self.attributes {
            most_points = most_points.max(accessor.count);
            if points as u64 > most_points {
                return Err(fault(format!(
                    "has {points} points, its accessors have {}",
                    accessor.count
                )));
            }
            let attribute = mesh
                .attribute_by_unique_id(*id)
                .ok_or_else(|| fault(format!("has no attribute {id} ({name})")))?;
            let layout = layout(accessor, *index)?;
            if usize::from(attribute.num_components()) != layout.components {
                return Err(fault(format!(
                    "attribute {id} ({name}) has {} components, accessors[{index}] has {}",
                    attribute.num_components(),
                    layout.components
                )));
            }
            let numbers = attribute.read_f32s(points, layout.components);
            attributes.push((
                name.clone(),
                Column {
                    bytes: encode(&numbers, layout.component),
                    accessor: Accessor {
                        shape: accessor.shape.clone(),
                        ..column(points, accessor.component_type, accessor.normalized)
                    },
                },
            ));
        }
        let corners = mesh.faces().iter().flatten();
        let indices = Column {
            bytes: corners.flat_map(|point| point.0.to_le_bytes()).collect(),
            accessor: column(3 * mesh.num_faces(), 5125, false),
        };
        Ok(Decoded {
            indices,
            attributes,
        })
    }
}

/// An accessor of scalars.
fn column(count: usize, component_type: u32, normalized: bool) -> Accessor {
    Accessor {
        buffer_view: None,
        byte_offset: 0,
        component_type,
        normalized,
        count: count as u64,
        shape: "SCALAR".into(),
        sparse: None,
    }
}

/// Numbers as an accessor stores them; whole ones are not scaled.
fn encode(numbers: &[f32], component: Component) -> Vec<u8> {
    let numbers = numbers.iter();
    match component {
        Component::I8 => numbers.map(|&n| n as i8 as u8).collect(),
        Component::U8 => numbers.map(|&n| n as u8).collect(),
        Component::I16 => numbers.flat_map(|&n| (n as i16).to_le_bytes()).collect(),
        Component::U16 => numbers.flat_map(|&n| (n as u16).to_le_bytes()).collect(),
        Component::U32 => numbers.flat_map(|&n| (n as u32).to_le_bytes()).collect(),
        Component::F32 => numbers.flat_map(|n| n.to_le_bytes()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::testing::{Binary, read};
    use draco_core::{
        DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, MeshEncoder,
        PointAttribute, PointIndex,
    };
    use glam::Vec3;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    /// How a stream is made.
    #[derive(Clone, Copy, Debug)]
    struct Way {
        /// Along the mesh's edges, or one by one.
        edgebreaker: bool,
        /// 0 shrinks most, 10 is quickest.
        speed: i32,
        /// Of positions; 0 keeps floats.
        bits: i32,
    }

    fn attribute(kind: GeometryAttributeType, values: &[Vec<f32>]) -> PointAttribute {
        let components = values[0].len();
        let mut attribute = PointAttribute::new();
        attribute.init(
            kind,
            components as u8,
            DataType::Float32,
            false,
            values.len(),
        );
        for (i, value) in values.iter().enumerate() {
            let bytes: Vec<u8> = value.iter().flat_map(|c| c.to_le_bytes()).collect();
            attribute.buffer_mut().write(i * 4 * components, &bytes);
        }
        attribute
    }

    /// Attribute 0 are positions, attribute 1 texture coordinates.
    fn stream(positions: &[[f32; 3]], triangles: &[[u32; 3]], way: Way) -> Vec<u8> {
        let mut mesh = Mesh::new();
        let points: Vec<Vec<f32>> = positions.iter().map(|p| p.to_vec()).collect();
        let uvs: Vec<Vec<f32>> = positions
            .iter()
            .map(|p| vec![p[0] * 0.125, p[1] * 0.125])
            .collect();
        mesh.set_num_points(positions.len());
        mesh.add_attribute(attribute(GeometryAttributeType::Position, &points));
        mesh.add_attribute(attribute(GeometryAttributeType::TexCoord, &uvs));
        mesh.set_num_faces(triangles.len());
        for (i, triangle) in triangles.iter().enumerate() {
            mesh.set_face(FaceIndex(i as u32), triangle.map(PointIndex));
        }
        let mut options = EncoderOptions::new();
        options.set_global_int("encoding_speed", way.speed);
        options.set_global_int("decoding_speed", way.speed);
        options.set_encoding_method(way.edgebreaker.into());
        options.set_attribute_quantization(0, way.bits);
        options.set_attribute_quantization(1, 0);
        let mut encoder = MeshEncoder::new();
        encoder.set_mesh(mesh);
        let mut out = EncoderBuffer::new();
        encoder.encode(&options, &mut out).unwrap();
        out.data().to_vec()
    }

    /// A sheet of 4 x 4 vertices.
    fn sheet() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let positions = (0..16u8)
            .map(|i| [f32::from(i % 4), f32::from(i / 4), f32::from(i % 3)])
            .collect();
        let triangles = (0..9)
            .map(|i| i / 3 * 4 + i % 3)
            .flat_map(|v| [[v, v + 1, v + 4], [v + 1, v + 5, v + 4]])
            .collect();
        (positions, triangles)
    }

    fn file(
        stream: &[u8],
        vertices: usize,
        triangles: usize,
        change: impl FnOnce(&mut Value),
    ) -> Vec<u8> {
        let mut binary = Binary::default();
        let view = binary.view(stream);
        let accessor = |code: u32, shape: &str, count: usize| json!({"componentType": code, "type": shape, "count": count});
        let mut document = binary.document(json!({
            "extensionsRequired": ["KHR_draco_mesh_compression"],
            "accessors": [accessor(5126, "VEC3", vertices), accessor(5126, "VEC2", vertices),
                accessor(5123, "SCALAR", 3 * triangles)],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0, "mode": 4,
                "extensions": {"KHR_draco_mesh_compression": {"bufferView": view,
                    "attributes": {"POSITION": 0, "TEXCOORD_0": 1}}}}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}],
            "images": [{"uri": crate::gltf::testing::PIXEL}],
        }));
        change(&mut document);
        crate::gltf::testing::glb(&document, &binary.bytes)
    }

    /// Corners of all triangles, each first corner the least.
    fn soup(triangles: impl Iterator<Item = [[i32; 3]; 3]>) -> Vec<[[i32; 3]; 3]> {
        let mut all: Vec<_> = triangles
            .map(|mut t| {
                let first = (0..3).min_by_key(|&i| t[i]).unwrap();
                t.rotate_left(first);
                t
            })
            .collect();
        all.sort_unstable();
        all
    }

    proptest! {
        /// What a scene draws are the triangles that were encoded, in whatever way, and each corner
        /// has its own texture coordinate.
        #[test]
        fn triangles_come_out_as_they_went_in(
            keep in prop::collection::vec(any::<bool>(), 18),
            edgebreaker in any::<bool>(),
            speed in 0..11i32,
            bits in prop::sample::select(vec![0, 14]),
        ) {
            let (positions, triangles) = sheet();
            let triangles: Vec<[u32; 3]> = triangles.into_iter().zip(keep).filter(|(_, k)| *k).map(|(t, _)| t).collect();
            prop_assume!(!triangles.is_empty());
            let stream = stream(&positions, &triangles, Way { edgebreaker, speed, bits });
            let scene = read(&file(&stream, 16, triangles.len(), |_| {})).unwrap().scene;
            let whole = |p: [f32; 3]| p.map(|c| (c * 64.0).round() as i32);
            let expected = soup(triangles.iter().map(|t| t.map(|v| whole(positions[v as usize]))));
            let drawn = soup(scene.triangles.iter().map(|t| t.map(|v| whole(scene.positions[v as usize].to_array()))));
            prop_assert_eq!(drawn, expected);
            for (position, uv) in scene.positions.iter().zip(&scene.uvs) {
                // Steps of 14 bits over 3 metres.
                prop_assert!((position.truncate() * 0.125 - uv).length() < 1e-3, "{} at {}", uv, position);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        /// Streams with bytes changed or cut off are refused or read soundly.
        #[test]
        fn damaged_streams_do_no_harm(
            edgebreaker in any::<bool>(),
            speed in prop::sample::select(vec![0, 5, 10]),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
            length in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let (positions, triangles) = sheet();
            let mut stream = stream(&positions, &triangles, Way { edgebreaker, speed, bits: 11 });
            for (at, byte) in changes {
                let at = at.index(stream.len());
                stream[at] = byte;
            }
            if let Some(length) = length {
                stream.truncate(length.index(stream.len()));
            }
            let _ = read(&file(&stream, 16, 18, |_| {}));
        }
    }

    const WAY: Way = Way {
        edgebreaker: true,
        speed: 5,
        bits: 14,
    };

    #[test]
    fn faults_are_told_with_their_places() {
        let (positions, triangles) = sheet();
        let sound = stream(&positions, &triangles, WAY);
        let refusal = |triangles: usize, pointer: &str, value: Value| {
            let change = |document: &mut Value| *document.pointer_mut(pointer).unwrap() = value;
            read(&file(&sound, 16, triangles, change))
                .unwrap_err()
                .to_string()
        };
        let place = "meshes[0].primitives[0]";
        let extension = format!("{place}.extensions.KHR_draco_mesh_compression");
        let pointer = "/meshes/0/primitives/0";
        let inside = format!("{pointer}/extensions/KHR_draco_mesh_compression");
        for (triangles, pointer, value, expected) in [
            (
                17,
                "/asset/version".into(),
                json!("2.0"),
                format!("{extension}: "),
            ),
            (
                18,
                format!("{pointer}/mode"),
                json!(1),
                format!("{place}.mode: 1"),
            ),
            (
                18,
                format!("{inside}/bufferView"),
                json!(7),
                format!("{extension}.bufferView: 7 does not exist"),
            ),
            (
                18,
                format!("{inside}/attributes/POSITION"),
                json!(7),
                format!("{extension}: has no attribute 7 (POSITION)"),
            ),
            (
                18,
                format!("{inside}/attributes/TEXCOORD_0"),
                json!(0),
                format!("{extension}: attribute 0 (TEXCOORD_0) has 3"),
            ),
        ] {
            let message = refusal(triangles, &pointer, value);
            assert!(
                message.starts_with(&expected),
                "{message}, expected {expected}"
            );
        }
        let message = read(&file(b"DRACO", 16, 18, |_| {}))
            .unwrap_err()
            .to_string();
        assert!(message.starts_with(&extension), "{message}");
    }

    /// What stands there uncompressed as well is read so.
    #[test]
    fn accessors_with_bytes_are_preferred() {
        let (positions, triangles) = sheet();
        let mut binary = Binary::default();
        let view = binary.view(&stream(&positions, &triangles, WAY));
        let plain = binary.floats(&[[0.0; 3], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]]);
        let scene = read(&binary.file(json!({
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": plain}, "extensions":
                {"KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0}}}}]}],
        })));
        assert_eq!(scene.unwrap().scene.positions[1], Vec3::X * 5.0);
    }
}
