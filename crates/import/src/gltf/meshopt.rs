//! Decodes buffer views that are compressed with EXT_meshopt_compression.

use super::GltfError;
use super::document::Document;
use super::files::Buffers;
use meshoptimizer_rs::codec::{BufferView, Filter, Mode};
use meshoptimizer_rs::{Error, Workspace};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// An upper bound of the bytes that one byte of a stream becomes: attributes take two bits at
/// least for sixteen of their bytes.
const MOST_BYTES_PER_BYTE: u64 = 64;

/// Bytes that all buffer views of any file may become, and how many more for each of its bytes:
/// views can share a stream.
const DECODED_BYTES: u64 = 1 << 28;

/// Decodes the compressed buffer views that accessors use, in parallel.
///
/// They are decoded also where another buffer holds the same data uncompressed: it may be absent,
/// and nothing is lost by this compression.
///
/// * `size` - of the file with its buffers, in bytes
///
/// Source: Khronos Group, EXT_meshopt_compression.
///
/// # Errors
///
/// When a stream is damaged or cannot be as long as it says, or all together are too large.
pub(crate) fn decode_views(
    document: &Document,
    buffers: &mut Buffers<'_>,
    size: u64,
) -> Result<(), GltfError> {
    let sparse = document.accessors.iter().filter_map(|a| a.sparse.as_ref());
    let sparse = sparse.flat_map(|s| [s.indices.buffer_view, s.values.buffer_view]);
    let dense = document.accessors.iter().filter_map(|a| a.buffer_view);
    let used: BTreeSet<usize> = dense.chain(sparse).collect();

    let limit = DECODED_BYTES + MOST_BYTES_PER_BYTE * size;
    let mut streams = Vec::new();
    let mut total = 0;
    for view in used {
        let source = &document.buffer_views[view];
        let Some(compressed) = &source.extensions.meshopt else {
            continue;
        };
        let place = || format!("bufferViews[{view}].extensions.EXT_meshopt_compression");
        if source.byte_length > MOST_BYTES_PER_BYTE * compressed.byte_length {
            return Err(GltfError::Compressed {
                place: place(),
                problem: format!(
                    "{} bytes cannot become {}",
                    compressed.byte_length, source.byte_length
                ),
            });
        }
        total += source.byte_length;
        if total > limit {
            return Err(GltfError::TooLarge {
                place: place(),
                limit,
                unit: "bytes of decoded buffer views",
                remedy: "it decodes the same data many times; export it again",
            });
        }
        let start = compressed.byte_offset;
        let stream = buffers.bytes(compressed.buffer, start..start + compressed.byte_length)?;
        if compressed.count > 0 {
            streams.push((view, compressed, stream));
        }
    }
    let decoded: Vec<_> = streams
        .into_par_iter()
        .map(|(view, compressed, stream)| {
            let filter = compressed.filter.as_deref().unwrap_or("NONE");
            let decode = || -> Result<Vec<u8>, Error> {
                let (count, stride) = (compressed.count as usize, compressed.byte_stride as usize);
                let layout = BufferView::new(
                    Mode::parse(&compressed.mode)?,
                    Filter::parse(filter)?,
                    count,
                    stride,
                )?;
                layout.decode(stream, &mut Workspace::default())
            };
            let bytes = decode().map_err(|error| GltfError::Compressed {
                place: format!("bufferViews[{view}].extensions.EXT_meshopt_compression"),
                problem: format!("the stream is damaged ({error})"),
            })?;
            Ok((view, bytes))
        })
        .collect();
    // The first error of the file, not of the fastest thread.
    for decoded in decoded {
        let (view, bytes) = decoded?;
        buffers.insert(view, bytes);
    }
    Ok(())
}

#[cfg(test)]
pub(crate) mod tests {
    use crate::gltf::testing::{glb, read};
    use glam::{DQuat, DVec3, Vec3};
    use meshoptimizer_rs::Workspace;
    use meshoptimizer_rs::codec::{
        ExpMode, IndexEncoding, VertexEncoding, encode_filter_exp, encode_filter_oct,
        encode_filter_quat, encode_index_buffer, encode_index_sequence, encode_vertex_buffer,
    };
    use proptest::prelude::*;
    use serde_json::{Value, json};

    /// Compressed streams, and views and accessors of what they become.
    #[derive(Default)]
    struct Compressed {
        bytes: Vec<u8>,
        decoded: usize,
        views: Vec<Value>,
        accessors: Vec<Value>,
    }

    impl Compressed {
        fn push(
            &mut self,
            stream: &[u8],
            stride: usize,
            count: usize,
            how: Value,
            accessor: Value,
        ) {
            let mut extension = json!({"buffer": 0, "byteOffset": self.bytes.len(),
                "byteLength": stream.len(), "byteStride": stride, "count": count});
            extension
                .as_object_mut()
                .unwrap()
                .extend(how.as_object().unwrap().clone());
            let mut view = json!({"buffer": 1, "byteOffset": self.decoded,
                "byteLength": count * stride, "extensions": {"EXT_meshopt_compression": extension}});
            let is_attribute =
                view["extensions"]["EXT_meshopt_compression"]["mode"] == "ATTRIBUTES";
            if is_attribute {
                view["byteStride"] = json!(stride);
            }
            let mut accessor = accessor;
            accessor["bufferView"] = json!(self.views.len());
            accessor["count"] = json!(count);
            self.views.push(view);
            self.accessors.push(accessor);
            self.decoded += count * stride;
            self.bytes.extend(stream);
        }

        fn push_vertices(&mut self, bytes: &[u8], stride: usize, filter: &str, accessor: Value) {
            let count = bytes.len() / stride;
            // The extension has version 0 only.
            let version = VertexEncoding::new(0, 0).unwrap();
            let stream =
                encode_vertex_buffer(bytes, count, stride, version, &mut Workspace::default());
            let how = json!({"mode": "ATTRIBUTES", "filter": filter});
            self.push(&stream.unwrap(), stride, count, how, accessor);
        }
    }

    /// A bumpy sheet of `side` x `side` vertices: positions, normals and triangles.
    fn sheet(side: usize) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<u32>) {
        let at = |x: usize, y: usize| ((x * 7 + y * 3) % 5) as f32 * 0.25;
        let vertices = (0..side * side).map(|i| (i % side, i / side));
        let positions = vertices
            .clone()
            .map(|(x, y)| [x as f32, y as f32, at(x, y)])
            .collect();
        let normal = |(x, y): (usize, usize)| {
            Vec3::new(x as f32 - 2.0, 1.5 - y as f32, 3.0)
                .normalize()
                .to_array()
        };
        let normals = vertices.map(normal).collect();
        let quads = (0..(side - 1) * (side - 1)).map(|i| (i / (side - 1)) * side + i % (side - 1));
        let triangles = quads
            .flat_map(|v| [v, v + 1, v + side, v + 1, v + side + 1, v + side])
            .map(|v| v as u32)
            .collect();
        (positions, normals, triangles)
    }

    /// A file in which all is compressed, in all modes and with all filters: a sheet and three
    /// instances of it.
    pub(crate) fn example() -> (Value, Vec<u8>) {
        let (positions, normals, triangles) = sheet(6);
        let mut workspace = Workspace::default();
        let mut c = Compressed::default();
        let count = positions.len();
        let exp = encode_filter_exp(
            count,
            12,
            15,
            positions.as_flattened(),
            ExpMode::Separate,
            &mut workspace,
        );
        c.push_vertices(
            &exp.unwrap(),
            12,
            "EXPONENTIAL",
            json!({"componentType": 5126, "type": "VEC3"}),
        );
        let padded: Vec<f32> = normals
            .iter()
            .flat_map(|&[x, y, z]| [x, y, z, 0.0])
            .collect();
        let oct = encode_filter_oct(count, 4, 8, &padded, &mut workspace).unwrap();
        let signed = json!({"componentType": 5120, "type": "VEC3", "normalized": true});
        c.push_vertices(&oct, 4, "OCTAHEDRAL", signed);
        let stream =
            encode_index_buffer(&triangles, IndexEncoding::DEFAULT, &mut workspace).unwrap();
        let shorts = json!({"componentType": 5123, "type": "SCALAR"});
        c.push(
            &stream,
            2,
            triangles.len(),
            json!({"mode": "TRIANGLES"}),
            shorts,
        );
        let turns: Vec<f32> = (0..3)
            .flat_map(|i| DQuat::from_rotation_z(f64::from(i)).as_quat().to_array())
            .collect();
        let quat = encode_filter_quat(3, 8, 12, &turns, &mut workspace).unwrap();
        let rotation = json!({"componentType": 5122, "type": "VEC4", "normalized": true});
        c.push_vertices(&quat, 8, "QUATERNION", rotation);
        let strip = encode_index_sequence(&[0, 1, 6, 7], IndexEncoding::DEFAULT, &mut workspace);
        let words = json!({"componentType": 5125, "type": "SCALAR"});
        c.push(
            &strip.unwrap(),
            4,
            4,
            json!({"mode": "INDICES", "filter": "NONE"}),
            words,
        );
        let document = json!({
            "asset": {"version": "2.0"},
            "extensionsRequired": ["EXT_meshopt_compression", "EXT_mesh_gpu_instancing"],
            "buffers": [{"byteLength": c.bytes.len()}, {"byteLength": c.decoded,
                "uri": "absent.bin", "extensions": {"EXT_meshopt_compression": {"fallback": true}}}],
            "bufferViews": c.views, "accessors": c.accessors,
            "meshes": [
                {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]},
                {"primitives": [{"attributes": {"POSITION": 0}, "indices": 4, "mode": 5}]},
            ],
            "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": 3}}}},
                {"mesh": 1}],
        });
        (document, c.bytes)
    }

    #[test]
    fn all_modes_and_filters_are_decoded() {
        let (document, binary) = example();
        let imported = read(&glb(&document, &binary)).unwrap();
        assert_eq!(imported.warnings, [""; 0]);
        let scene = imported.scene;
        let (positions, normals, triangles) = sheet(6);
        assert_eq!(scene.objects.len(), 4);
        // Encoders may turn triangles, starting with another corner.
        let sorted = |triangles: &mut dyn Iterator<Item = [u32; 3]>| {
            let mut all: Vec<[u32; 3]> = triangles
                .map(|mut t| {
                    let first = (0..3).min_by_key(|&i| t[i]).unwrap();
                    t.rotate_left(first);
                    t
                })
                .collect();
            all.sort_unstable();
            all
        };
        let mesh = scene.mesh_of(0).clone();
        let drawn = &scene.triangles[mesh.triangles.start as usize..mesh.triangles.end as usize];
        assert_eq!(
            sorted(&mut drawn.iter().copied()),
            sorted(&mut triangles.as_chunks().0.iter().copied())
        );
        for (i, position) in positions.iter().enumerate() {
            // Mantissas of 15 bits hold numbers this small and round exactly.
            assert_eq!(scene.positions[i], Vec3::from(*position));
            // Two coordinates of 8 bits on an octahedron: a step is 1/127, at most twice as long
            // on the sphere.
            let off = (scene.normals[i] - Vec3::from(normals[i])).length();
            assert!(off < 4.0 / 127.0, "normal {i} is off by {off}");
        }
        for i in 0..3 {
            let turned = DQuat::from_rotation_z(f64::from(i)) * DVec3::X;
            let x = scene.objects[i as usize]
                .world_from_mesh
                .transform_vector3(DVec3::X);
            // Components of 12 bits.
            assert!((x - turned).length() < 4.0 / 2047.0, "{x} and {turned}");
        }
        let strip = scene.mesh_of(3).triangles.clone();
        assert_eq!(strip.len(), 2);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        /// Streams with bytes changed or cut off are refused or read soundly.
        #[test]
        fn damaged_streams_do_no_harm(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
            view in 0..5usize,
            shorter in 0..9u64,
        ) {
            let (mut document, mut binary) = example();
            for (at, byte) in changes {
                let at = at.index(binary.len());
                binary[at] = byte;
            }
            let length = &mut document["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]["byteLength"];
            *length = json!(length.as_u64().unwrap().saturating_sub(shorter));
            let _ = read(&glb(&document, &binary));
        }
    }

    #[test]
    fn faults_are_told_with_their_places() {
        let at = "bufferViews[0].extensions.EXT_meshopt_compression";
        for (field, value, message) in [
            ("mode", json!("LINES"), ".mode: \"LINES\""),
            (
                "filter",
                json!("QUATERNION"),
                ".filter: Some(\"QUATERNION\") of ATTRIBUTES of 12",
            ),
            ("byteStride", json!(6), ".byteStride: 6"),
            ("count", json!(35), ".count: 35 elements of 12 bytes"),
            ("count", json!(u64::MAX), ".count: 18446744073709551615"),
            ("buffer", json!(2), ".buffer: 2 does not exist"),
            (
                "byteOffset",
                json!(u64::MAX),
                ": needs 18446744073709551615 bytes",
            ),
            ("byteLength", json!(5), ": 5 bytes cannot become 432"),
            ("byteLength", json!(20), ": the stream is damaged"),
        ] {
            let (mut document, binary) = example();
            document["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][field] = value;
            let error = read(&glb(&document, &binary)).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{at}{message}")), "{error}");
        }
    }

    /// Views that share a stream cannot ask for gigabytes.
    #[test]
    fn shared_streams_take_little_memory() {
        // Zeros: two bits for sixteen bytes.
        let zeros = vec![0; 1 << 22];
        let version = VertexEncoding::new(0, 0).unwrap();
        let stream = encode_vertex_buffer(&zeros, 1 << 14, 256, version, &mut Workspace::default());
        let stream = stream.unwrap();
        let view = json!({"buffer": 1, "byteLength": 1 << 22, "byteStride": 256, "extensions":
            {"EXT_meshopt_compression": {"buffer": 0, "byteLength": stream.len(), "byteStride": 256,
                "count": 1 << 14, "mode": "ATTRIBUTES"}}});
        let accessor =
            |i: usize| json!({"bufferView": i, "componentType": 5126, "type": "VEC3", "count": 9});
        let file = |count: usize| {
            let document = json!({
                "asset": {"version": "2.0"}, "buffers": [{"byteLength": stream.len()}, {"byteLength": 1 << 22}],
                "bufferViews": vec![view.clone(); count],
                "accessors": (0..count).map(accessor).collect::<Vec<_>>(),
            });
            glb(&document, &stream)
        };
        assert!(read(&file(8)).is_ok());
        let error = read(&file(200)).unwrap_err().to_string();
        assert!(error.contains("bytes of decoded buffer views"), "{error}");
    }
}
