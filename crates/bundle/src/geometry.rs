//! A scene's vertices and triangles, sorted into the primitives and streams of a glTF file.

use crate::gltf::{Accessor, Attributes, BufferView, Mesh, Node, Primitive};
use farfield_scene::{Material, Object, Scene};
use glam::{DMat3, DMat4, DVec3, Vec4};
use std::ops::Range;

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

const NONE: u32 = u32::MAX;

/// Nodes and meshes of a glTF document and the content of its buffer.
///
/// Until [`place_streams`](Self::place_streams), accessors refer to streams.
/// Primitives refer to the scene's materials.
#[derive(Default)]
pub(crate) struct Geometry {
    pub(crate) nodes: Vec<Node>,
    pub(crate) meshes: Vec<Mesh>,
    pub(crate) accessors: Vec<Accessor>,
    streams: Streams,
}

/// Data of all primitives, by kind. Each becomes a buffer view.
#[derive(Default)]
struct Streams {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    long_indices: Vec<u32>,
    // Last, as it may end at a byte that the others could not begin at.
    short_indices: Vec<u16>,
}

impl Geometry {
    /// Sorts the objects of a scene, a node each, and the meshes they use.
    pub(crate) fn of(scene: &Scene) -> Self {
        let mut geometry = Self::default();
        let mut shared = vec![NONE; scene.meshes.len()];
        for object in &scene.objects {
            let node = geometry.node(scene, object, &mut shared);
            geometry.nodes.push(node);
        }
        geometry
    }

    fn node(&mut self, scene: &Scene, object: &Object, shared: &mut [u32]) -> Node {
        let affine = object.world_from_mesh;
        let linear = affine.matrix3;
        let fits_node = is_rotation_and_scale(linear);
        let mesh = if scene.meshes[object.mesh as usize].triangles.is_empty() {
            None
        } else if fits_node {
            let mesh = &mut shared[object.mesh as usize];
            if *mesh == NONE {
                *mesh = self.push_mesh(scene, object.mesh, DMat3::IDENTITY);
            }
            Some(*mesh)
        } else {
            Some(self.push_mesh(scene, object.mesh, linear))
        };
        let needs_matrix = fits_node && linear != DMat3::IDENTITY;
        let needs_translation = !needs_matrix && affine.translation != DVec3::ZERO;
        Node {
            name: object.name.clone(),
            mesh,
            matrix: needs_matrix.then(|| DMat4::from(affine).to_cols_array()),
            translation: needs_translation.then(|| affine.translation.to_array()),
        }
    }

    /// Adds a mesh of the scene with `linear` applied to it, and returns its index.
    fn push_mesh(&mut self, scene: &Scene, mesh: u32, linear: DMat3) -> u32 {
        let primitives = split_by_material(scene, mesh)
            .iter()
            .map(|part| self.push_part(scene, part, linear))
            .collect();
        self.meshes.push(Mesh { primitives });
        self.meshes.len() as u32 - 1
    }

    fn push_part(&mut self, scene: &Scene, part: &Part, linear: DMat3) -> Primitive {
        let vertices = || part.vertices.iter().map(|&v| v as usize);
        let material = &scene.materials[part.material as usize];
        let count = part.vertices.len() as u64;

        // Positions, with exact bounds.
        let start = self.streams.positions.len();
        let positions = vertices().map(|v| linear * scene.positions[v].as_dvec3());
        self.streams
            .positions
            .extend(positions.map(|p| p.as_vec3().to_array()));
        let bounds = bounds(&self.streams.positions[start..]);
        let position = self.push_accessor(Stream::Positions, start, count);
        self.accessors[position as usize].min = Some(bounds[0]);
        self.accessors[position as usize].max = Some(bounds[1]);

        let normal = (!material.unlit).then(|| {
            let start = self.streams.normals.len();
            let normals = vertices().map(|v| normal(scene.normals[v].as_dvec3(), linear));
            self.streams.normals.extend(normals);
            self.push_accessor(Stream::Normals, start, count)
        });
        let is_textured = textures_of(material).next().is_some();
        let uv = is_textured.then(|| {
            let start = self.streams.uvs.len();
            let uvs = vertices().map(|v| scene.uvs[v].to_array());
            self.streams.uvs.extend(uvs);
            self.push_accessor(Stream::Uvs, start, count)
        });
        let is_colored = vertices().any(|v| scene.colors[v] != Vec4::ONE);
        let color = is_colored.then(|| {
            let start = self.streams.colors.len();
            let colors = vertices().map(|v| scene.colors[v].clamp(Vec4::ZERO, Vec4::ONE));
            self.streams.colors.extend(colors.map(|c| c.to_array()));
            self.push_accessor(Stream::Colors, start, count)
        });

        // A baked mirror turns the winding, which a mirrored node does by itself.
        let order = if linear.determinant() < 0.0 {
            [0, 2, 1]
        } else {
            [0, 1, 2]
        };
        let indices = part.triangles.iter().flat_map(|t| order.map(|i| t[i]));
        let index_count = part.triangles.len() as u64 * 3;
        // The greatest index of a type is not allowed.
        let indices = if count <= u64::from(u16::MAX) {
            let start = self.streams.short_indices.len();
            self.streams.short_indices.extend(indices.map(|i| i as u16));
            self.push_accessor(Stream::ShortIndices, start, index_count)
        } else {
            let start = self.streams.long_indices.len();
            self.streams.long_indices.extend(indices);
            self.push_accessor(Stream::LongIndices, start, index_count)
        };
        Primitive {
            attributes: Attributes {
                position,
                normal,
                uv,
                color,
            },
            indices,
            material: part.material,
        }
    }

    fn push_accessor(&mut self, stream: Stream, start: usize, count: u64) -> u32 {
        let (component_type, r#type, stride, _) = stream.layout();
        self.accessors.push(Accessor {
            buffer_view: stream as u32,
            byte_offset: start as u64 * u64::from(stride),
            component_type,
            count,
            r#type,
            min: None,
            max: None,
        });
        self.accessors.len() as u32 - 1
    }

    /// Bytes of all streams.
    pub(crate) fn byte_length(&self) -> u64 {
        Stream::ALL.iter().map(|s| self.byte_length_of(*s)).sum()
    }

    fn byte_length_of(&self, stream: Stream) -> u64 {
        let streams = &self.streams;
        let count = match stream {
            Stream::Positions => streams.positions.len(),
            Stream::Normals => streams.normals.len(),
            Stream::Uvs => streams.uvs.len(),
            Stream::Colors => streams.colors.len(),
            Stream::LongIndices => streams.long_indices.len(),
            Stream::ShortIndices => streams.short_indices.len(),
        };
        count as u64 * u64::from(stream.layout().2)
    }

    /// Lays the streams out in a buffer: its views, to which the accessors refer from now on.
    pub(crate) fn place_streams(&mut self) -> Vec<BufferView> {
        let mut views = Vec::new();
        let mut view_of_stream = [NONE; Stream::ALL.len()];
        let mut byte_offset = 0;
        for stream in Stream::ALL {
            let byte_length = self.byte_length_of(stream);
            if byte_length > 0 {
                let (_, _, stride, target) = stream.layout();
                view_of_stream[stream as usize] = views.len() as u32;
                views.push(BufferView {
                    buffer: 0,
                    byte_offset,
                    byte_length,
                    byte_stride: (target == ARRAY_BUFFER).then_some(stride),
                    target,
                });
                byte_offset += byte_length;
            }
        }
        for accessor in &mut self.accessors {
            accessor.buffer_view = view_of_stream[accessor.buffer_view as usize];
        }
        views
    }

    /// Appends the streams, little-endian.
    pub(crate) fn append_streams(&self, bytes: &mut Vec<u8>) {
        let streams = &self.streams;
        let floats = streams
            .positions
            .as_flattened()
            .iter()
            .chain(streams.normals.as_flattened())
            .chain(streams.uvs.as_flattened())
            .chain(streams.colors.as_flattened());
        bytes.extend(floats.flat_map(|x| x.to_le_bytes()));
        bytes.extend(streams.long_indices.iter().flat_map(|i| i.to_le_bytes()));
        bytes.extend(streams.short_indices.iter().flat_map(|i| i.to_le_bytes()));
    }
}

/// What a stream holds; in the order of the buffer.
#[derive(Clone, Copy)]
enum Stream {
    Positions,
    Normals,
    Uvs,
    Colors,
    LongIndices,
    ShortIndices,
}

impl Stream {
    const ALL: [Self; 6] = [
        Self::Positions,
        Self::Normals,
        Self::Uvs,
        Self::Colors,
        Self::LongIndices,
        Self::ShortIndices,
    ];

    /// Component type, accessor type, bytes an element, target.
    fn layout(self) -> (u32, &'static str, u32, u32) {
        match self {
            Self::Positions | Self::Normals => (FLOAT, "VEC3", 12, ARRAY_BUFFER),
            Self::Uvs => (FLOAT, "VEC2", 8, ARRAY_BUFFER),
            Self::Colors => (FLOAT, "VEC4", 16, ARRAY_BUFFER),
            Self::LongIndices => (UNSIGNED_INT, "SCALAR", 4, ELEMENT_ARRAY_BUFFER),
            Self::ShortIndices => (UNSIGNED_SHORT, "SCALAR", 2, ELEMENT_ARRAY_BUFFER),
        }
    }
}

/// The triangles of a mesh that have the same material, and the vertices they use.
struct Part {
    material: u32,
    /// Indices into the scene's vertices, in the order of their first use.
    vertices: Vec<u32>,
    /// Indices into `vertices`.
    triangles: Vec<[u32; 3]>,
}

/// The parts of a mesh, ordered by material; triangles keep their order.
fn split_by_material(scene: &Scene, mesh: u32) -> Vec<Part> {
    let mesh = &scene.meshes[mesh as usize];
    let Range { start, end } = mesh.vertices;
    let mut triangles: Vec<u32> = mesh.triangles.clone().collect();
    triangles.sort_by_key(|&t| scene.triangle_materials[t as usize]);

    let mut index_in_part = vec![NONE; (end - start) as usize];
    let same_material = |&a: &u32, &b: &u32| {
        scene.triangle_materials[a as usize] == scene.triangle_materials[b as usize]
    };
    triangles
        .chunk_by(same_material)
        .map(|chunk| {
            let mut vertices = Vec::new();
            let triangles = chunk
                .iter()
                .map(|&t| {
                    scene.triangles[t as usize].map(|v| {
                        let index = &mut index_in_part[(v - start) as usize];
                        if *index == NONE {
                            *index = vertices.len() as u32;
                            vertices.push(v);
                        }
                        *index
                    })
                })
                .collect();
            for &v in &vertices {
                index_in_part[(v - start) as usize] = NONE;
            }
            Part {
                material: scene.triangle_materials[chunk[0] as usize],
                vertices,
                triangles,
            }
        })
        .collect()
}

/// Indices of the textures that a material shows.
pub(crate) fn textures_of(material: &Material) -> impl Iterator<Item = u32> {
    let lit = [
        material.metallic_roughness_texture,
        material.normal_texture,
        material.emissive_texture,
    ];
    let lit = lit.into_iter().filter(|_| !material.unlit);
    lit.chain([material.base_color_texture]).flatten()
}

/// Whether a linear map is a rotation after a scaling along the axes, mirrored or not: all that a
/// glTF node can hold.
fn is_rotation_and_scale(m: DMat3) -> bool {
    let lengths = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
    let longest = lengths.into_iter().fold(0.0, f64::max);
    // Matrices out of f32 files are orthogonal within some 1e-7; readers that check allow about
    // 1e-4. An axis as good as lost has no direction that could be read back.
    let between =
        |a: usize, b: usize| m.col(a).dot(m.col(b)).abs() <= 1e-6 * lengths[a] * lengths[b];
    lengths.iter().all(|l| *l > 1e-6 * longest) && between(0, 1) && between(1, 2) && between(2, 0)
}

/// A normal after a linear map, of length 1.
fn normal(normal: DVec3, linear: DMat3) -> [f32; 3] {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    // The inverse transpose but for a factor; exists also where there is no inverse.
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let sign = if linear.determinant() < 0.0 {
        -1.0
    } else {
        1.0
    };
    let mapped = cofactors * normal * sign;
    // What has the right length, by f32's measure, keeps its bits.
    let unit = match (mapped.length() - 1.0).abs() < 1e-6 {
        true => mapped,
        false => mapped.normalize_or(DVec3::Z),
    };
    unit.as_vec3().to_array()
}

/// Least and greatest coordinates.
fn bounds(positions: &[[f32; 3]]) -> [[f64; 3]; 2] {
    let fold = |start: f32, f: fn(f32, f32) -> f32| {
        let fold = |a: [f32; 3], b: &[f32; 3]| std::array::from_fn(|i| f(a[i], b[i]));
        positions.iter().fold([start; 3], fold).map(f64::from)
    };
    [
        fold(f32::INFINITY, f32::min),
        fold(f32::NEG_INFINITY, f32::max),
    ]
}
