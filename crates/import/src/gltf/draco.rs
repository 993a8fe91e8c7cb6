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
