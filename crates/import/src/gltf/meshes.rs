//! Reads meshes: primitives become runs of vertices and triangles.

use super::GltfError;
use super::accessors::Elements;
use super::document::{Document, Primitive};
use super::files::Buffers;
use super::materials::{Looks, UvSource};
use crate::assemble::has_area;
use crate::normals::smooth_normals;
use crate::notes::{Note, Notes};
use crate::recentre::recentre;
use farfield_scene::{Mesh, Scene};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::BTreeMap;
use std::ops::Range;

/// Bytes of vertices and triangles that any file may have, and how many more for each of its
/// bytes. What a file draws once takes at most 80 for each of its bytes: half a triangle of a strip
/// of shorts, with three vertices of its own. Beyond, it draws the same data over and over.
const GEOMETRY_BYTES: u64 = 1 << 28;
const GEOMETRY_BYTES_PER_BYTE: u64 = 128;
const BYTES_PER_VERTEX: u64 =
    (size_of::<Vec3>() * 2 + size_of::<Vec2>() + size_of::<Vec4>()) as u64;
const BYTES_PER_TRIANGLE: u64 = 16;

/// One of the document's meshes in the scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    /// Index into [`Scene::meshes`].
    pub(crate) mesh: u32,
    /// The mesh's origin in the node's space.
    pub(crate) centre: DVec3,
    /// The greatest absolute coordinates in the mesh's space.
    pub(crate) reach: DVec3,
}

/// What a primitive's vertices are made of; primitives with the same share them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Source {
    positions: usize,
    normals: Option<usize>,
    uvs: Option<usize>,
    colors: Option<usize>,
    /// Of the texture coordinates; the default where there are none.
    uv_source: UvSource,
}

/// What a primitive's triangles are made of, besides vertices: indices and mode.
type Connections = (Option<usize>, u32);

/// A mesh without its materials.
type Geometry = Vec<(Source, Vec<Connections>)>;

/// A geometry in the scene: its vertices, where they are and the triangles of each primitive.
#[derive(Clone, Debug)]
struct Built {
    vertices: Range<u32>,
    centre: DVec3,
    reach: DVec3,
    runs: Vec<Range<u32>>,
    /// The meshes made of it, and the material of each run.
    meshes: Vec<(u32, Vec<u32>)>,
}

/// Appends the given meshes of a document to a scene; `None` where no triangle is left.
///
/// Vertices that no triangle uses are left out. Meshes of the same accessors share their vertices.
///
/// # Errors
///
/// When an index exceeds the vertices, a position is not finite, or the meshes are too large for
/// a file of `size` bytes.
pub(crate) fn read_meshes(
    document: &Document,
    wanted: impl IntoIterator<Item = usize>,
    buffers: &Buffers<'_>,
    looks: &Looks,
    size: u64,
    scene: &mut Scene,
    notes: &mut Notes,
) -> Result<BTreeMap<usize, Option<Shape>>, GltfError> {
    let mut shapes = BTreeMap::new();
    let mut built: BTreeMap<Geometry, Option<Built>> = BTreeMap::new();
    let mut builder = Builder {
        document,
        buffers,
        budget: Budget::new(size),
        slots: Vec::new(),
        scene,
        notes,
    };
    for index in wanted {
        let (geometry, materials, places) = take_apart(document, index, looks, builder.notes);
        let shape = match built.get_mut(&geometry) {
            Some(built) => match built {
                Some(built) => Some(builder.reuse(index, built, materials)?),
                None => None,
            },
            None => {
                let new = builder.build(index, &geometry, materials, &places)?;
                let shape = new.as_ref().map(|new| new.shape(0));
                built.insert(geometry, new);
                shape
            }
        };
        shapes.insert(index, shape);
    }
    Ok(shapes)
}

/// The geometry of a mesh, and for each run of triangles its material and its primitive.
fn take_apart(
    document: &Document,
    index: usize,
    looks: &Looks,
    notes: &mut Notes,
) -> (Geometry, Vec<u32>, Vec<usize>) {
    // By source, so that primitives of the same vertices follow each other.
    let mut sources: BTreeMap<Source, Vec<(Connections, u32, usize)>> = BTreeMap::new();
    for (i, primitive) in document.meshes[index].primitives.iter().enumerate() {
        if primitive.mode < 4 {
            notes.add(Note::PointsOrLines, 1);
            continue;
        }
        let Some(&positions) = primitive.attributes.get("POSITION") else {
            notes.add(Note::NoPositions, 1);
            continue;
        };
        let material = looks.slots[&primitive.material];
        let uv_source = looks.uv_sources[material as usize];
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let uvs = attribute(&format!("TEXCOORD_{}", uv_source.set));
        notes.add(Note::NoUvs, (uv_source.textured && uvs.is_none()).into());
        let source = Source {
            positions,
            normals: attribute("NORMAL"),
            uvs,
            colors: attribute("COLOR_0"),
            uv_source: if uvs.is_some() {
                uv_source
            } else {
                UvSource::default()
            },
        };
        let connections = (primitive.indices, primitive.mode);
        sources
            .entry(source)
            .or_default()
            .push((connections, material, i));
    }
    let uses = || sources.values().flatten();
    let materials = uses().map(|&(_, material, _)| material).collect();
    let places = uses().map(|&(_, _, primitive)| primitive).collect();
    let connections = |uses: &[(Connections, u32, usize)]| uses.iter().map(|u| u.0).collect();
    let geometry = sources
        .iter()
        .map(|(&source, uses)| (source, connections(uses)))
        .collect();
    (geometry, materials, places)
}

/// The materials that the given meshes use.
pub(crate) fn used_materials<'a>(
    document: &'a Document,
    meshes: impl IntoIterator<Item = usize> + 'a,
) -> impl Iterator<Item = Option<usize>> + 'a {
    let drawn = |p: &&Primitive| p.mode >= 4 && p.attributes.contains_key("POSITION");
    meshes
        .into_iter()
        .flat_map(move |mesh| document.meshes[mesh].primitives.iter().filter(drawn))
        .map(|primitive| primitive.material)
}

impl Built {
    fn shape(&self, i: usize) -> Shape {
        Shape {
            mesh: self.meshes[i].0,
            centre: self.centre,
            reach: self.reach,
        }
    }
}

struct Builder<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    budget: Budget,
    /// For each element of an accessor, its place among those used; `NONE` between uses.
    slots: Vec<u32>,
    scene: &'a mut Scene,
    notes: &'a mut Notes,
}

const NONE: u32 = u32::MAX;

impl Builder<'_> {
    /// A mesh of a geometry that is in the scene already.
    fn reuse(
        &mut self,
        index: usize,
        built: &mut Built,
        materials: Vec<u32>,
    ) -> Result<Shape, GltfError> {
        if let Some(i) = built.meshes.iter().position(|(_, m)| *m == materials) {
            return Ok(built.shape(i));
        }
        let start = self.scene.triangles.len();
        for (run, &material) in built.runs.iter().zip(&materials) {
            self.budget
                .take(0, run.len() as u64, || format!("meshes[{index}]"))?;
            let run = run.start as usize..run.end as usize;
            self.scene
                .triangle_materials
                .extend(run.clone().map(|_| material));
            self.scene.triangles.extend_from_within(run);
        }
        built
            .meshes
            .push((self.scene.meshes.len() as u32, materials));
        self.scene.meshes.push(Mesh {
            vertices: built.vertices.clone(),
            triangles: start as u32..self.scene.triangles.len() as u32,
        });
        Ok(built.shape(built.meshes.len() - 1))
    }

    /// Appends a geometry to the scene, as a mesh with the given materials; nothing, and `None`,
    /// where no triangle is left.
    fn build(
        &mut self,
        index: usize,
        geometry: &Geometry,
        materials: Vec<u32>,
        primitives: &[usize],
    ) -> Result<Option<Built>, GltfError> {
        let first_vertex = self.scene.positions.len();
        let first_triangle = self.scene.triangles.len();
        let mut runs: Vec<Range<u32>> = Vec::new();
        for (source, connections) in geometry {
            // Triangles as elements of the accessors.
            let mut triangles: Vec<[u32; 3]> = Vec::new();
            let mut ends = Vec::new();
            for &(indices, mode) in connections {
                let primitive = primitives[runs.len() + ends.len()];
                let place = || format!("meshes[{index}].primitives[{primitive}]");
                self.read_triangles(source, indices, mode, &place, &mut triangles)?;
                ends.push(triangles.len());
            }
            let base = self.scene.positions.len();
            let used = self.compact(source, &mut triangles, base as u32);
            let missing_normals = self.read_vertices(source, &used)?;

            // Drop what has no area, run by run.
            let mut start = 0;
            let first = self.scene.triangles.len();
            for end in ends {
                let kept = self.scene.triangles.len();
                let whole = |t: &&[u32; 3]| has_area(t.map(|v| self.scene.positions[v as usize]));
                let new: Vec<_> = triangles[start..end]
                    .iter()
                    .filter(whole)
                    .copied()
                    .collect();
                self.notes
                    .add(Note::DegenerateTriangles, end - start - new.len());
                self.scene.triangles.extend(new);
                let material = materials[runs.len()];
                self.scene
                    .triangle_materials
                    .resize(self.scene.triangles.len(), material);
                runs.push(kept as u32..self.scene.triangles.len() as u32);
                start = end;
            }
            if missing_normals {
                let count = self.fill_normals(base, first);
                let given = source.normals.is_some();
                self.notes.add(Note::Normals, if given { count } else { 0 });
            }
        }
        if self.scene.triangles.len() == first_triangle {
            self.scene.positions.truncate(first_vertex);
            self.scene.normals.truncate(first_vertex);
            self.scene.uvs.truncate(first_vertex);
            self.scene.colors.truncate(first_vertex);
            return Ok(None);
        }
        let vertices = first_vertex as u32..self.scene.positions.len() as u32;
        let mesh = self.scene.meshes.len() as u32;
        self.scene.meshes.push(Mesh {
            vertices: vertices.clone(),
            triangles: first_triangle as u32..self.scene.triangles.len() as u32,
        });
        let positions = &mut self.scene.positions[first_vertex..];
        let centre = recentre(positions);
        let reach = positions
            .iter()
            .fold(Vec3::ZERO, |reach, p| reach.max(p.abs()));
        Ok(Some(Built {
            vertices,
            centre,
            reach: reach.as_dvec3(),
            runs,
            meshes: vec![(mesh, materials)],
        }))
    }

    /// Appends a primitive's triangles, as elements of its accessors; those that use a vertex
    /// twice are left out.
    fn read_triangles(
        &mut self,
        source: &Source,
        indices: Option<usize>,
        mode: u32,
        place: &dyn Fn() -> String,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<(), GltfError> {
        let vertices = self.document.accessors[source.positions].count;
        let count = match indices {
            Some(accessor) => self.document.accessors[accessor].count,
            None => vertices,
        };
        let new = match mode {
            4 => count / 3,
            _ => count.saturating_sub(2),
        };
        self.budget.take(vertices.min(3 * new), new, place)?;
        self.notes.add(
            Note::IncompleteTriangles,
            (mode == 4 && count % 3 > 0).into(),
        );

        let corners: Vec<u32> = match indices {
            None => (0..count as u32).collect(),
            Some(accessor) => {
                let elements = Elements::open(self.document, self.buffers, accessor)?;
                (0..elements.count).map(|i| elements.get_index(i)).collect()
            }
        };
        let beyond = corners.iter().position(|&v| u64::from(v) >= vertices);
        if let (Some(element), Some(accessor)) = (beyond, indices) {
            return Err(GltfError::Vertex {
                place: format!("accessors[{accessor}] (indices of {})", place()),
                element: element as u64,
                index: corners[element],
                vertices,
            });
        }
        let before = triangles.len();
        let distinct = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        match mode {
            4 => triangles.extend(corners.as_chunks().0.iter().copied().filter(distinct)),
            // Every other triangle of a strip is turned.
            5 => triangles.extend(
                corners
                    .windows(3)
                    .enumerate()
                    .map(|(i, v)| {
                        if i % 2 == 0 {
                            [v[0], v[1], v[2]]
                        } else {
                            [v[0], v[2], v[1]]
                        }
                    })
                    .filter(distinct),
            ),
            _ => triangles.extend(
                corners
                    .windows(2)
                    .skip(1)
                    .map(|v| [v[0], v[1], corners[0]])
                    .filter(distinct),
            ),
        }
        let dropped = new as usize - (triangles.len() - before);
        self.notes.add(Note::DegenerateTriangles, dropped);
        Ok(())
    }

    /// Renumbers triangles from `base` on without gaps, and returns the element of each vertex,
    /// ascending.
    fn compact(&mut self, source: &Source, triangles: &mut [[u32; 3]], base: u32) -> Vec<u32> {
        let count = self.document.accessors[source.positions].count as usize;
        if self.slots.len() < count {
            self.slots.resize(count, NONE);
        }
        let mut used = Vec::new();
        for &element in triangles.iter().flatten() {
            let slot = &mut self.slots[element as usize];
            if *slot == NONE {
                *slot = 0;
                used.push(element);
            }
        }
        used.sort_unstable();
        for (slot, &element) in (base..).zip(&used) {
            self.slots[element as usize] = slot;
        }
        for corner in triangles.iter_mut().flatten() {
            *corner = self.slots[*corner as usize];
        }
        // Ready for the next use, at a cost in proportion to this one.
        used.iter()
            .for_each(|&element| self.slots[element as usize] = NONE);
        used
    }

    /// Appends vertices of accessors; returns whether normals are missing, which are 0 then.
    fn read_vertices(&mut self, source: &Source, used: &[u32]) -> Result<bool, GltfError> {
        let open = |accessor: usize| Elements::open(self.document, self.buffers, accessor);
        let elements = || used.iter().map(|&element| element as usize);
        let scene = &mut *self.scene;

        let positions = open(source.positions)?;
        for element in elements() {
            let [x, y, z, _] = positions.get(element);
            let position = Vec3::new(x, y, z);
            if !position.is_finite() {
                return Err(GltfError::NotFinite {
                    place: format!("accessors[{}] (POSITION)", source.positions),
                    element: element as u64,
                });
            }
            scene.positions.push(position);
        }
        let total = scene.positions.len();

        let mut missing = source.normals.is_none();
        if let Some(accessor) = source.normals {
            let normals = open(accessor)?;
            for element in elements() {
                let [x, y, z, _] = normals.get(element);
                // In f64, as squares of small numbers vanish in f32; 0 where there is no direction.
                let normal = Vec3::new(x, y, z).as_dvec3().normalize_or_zero().as_vec3();
                missing |= normal == Vec3::ZERO;
                scene.normals.push(normal);
            }
        }
        scene.normals.resize(total, Vec3::ZERO);

        if let Some(accessor) = source.uvs {
            let uvs = open(accessor)?;
            let transform = source.uv_source.image_from_file();
            let mut bad = 0;
            for element in elements() {
                let [u, v, ..] = uvs.get(element);
                let mut uv = Vec2::new(u, v);
                if let Some(transform) = &transform {
                    uv = UvSource::apply(transform, uv);
                }
                bad += usize::from(!uv.is_finite());
                scene.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
            }
            self.notes.add(Note::Uvs, bad);
        }
        scene.uvs.resize(total, Vec2::ZERO);

        if let Some(accessor) = source.colors {
            let colors = open(accessor)?;
            let opaque = self.document.accessors[accessor].shape == "VEC3";
            let mut bad = 0;
            for element in elements() {
                let mut color = Vec4::from(colors.get(element));
                if opaque {
                    color.w = 1.0;
                }
                // Not a number becomes 1, the colour that changes nothing.
                let clamped = color.map(|c| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) });
                bad += usize::from(clamped != color);
                scene.colors.push(clamped);
            }
            self.notes.add(Note::Colors, bad);
        }
        scene.colors.resize(total, Vec4::ONE);
        Ok(missing)
    }

    /// Computes the normals that are 0 among the vertices and triangles from some on; returns
    /// their number.
    fn fill_normals(&mut self, first_vertex: usize, first_triangle: usize) -> usize {
        let scene = &mut *self.scene;
        let base = first_vertex as u32;
        let triangles: Vec<[u32; 3]> = scene.triangles[first_triangle..]
            .iter()
            .map(|t| t.map(|v| v - base))
            .collect();
        let computed = smooth_normals(&scene.positions[first_vertex..], &triangles);
        let mut count = 0;
        for (normal, computed) in scene.normals[first_vertex..].iter_mut().zip(computed) {
            if *normal == Vec3::ZERO {
                *normal = computed;
                count += 1;
            }
        }
        count
    }
}

/// What geometry may still take.
struct Budget {
    limit: u64,
    left: u64,
    vertices: u64,
    triangles: u64,
}

impl Budget {
    fn new(size: u64) -> Self {
        let limit = GEOMETRY_BYTES + GEOMETRY_BYTES_PER_BYTE * size;
        Self {
            limit,
            left: limit,
            vertices: 0,
            triangles: 0,
        }
    }

    /// Counts vertices and triangles before they are read.
    fn take(
        &mut self,
        vertices: u64,
        triangles: u64,
        place: impl Fn() -> String,
    ) -> Result<(), GltfError> {
        self.vertices += vertices;
        self.triangles += triangles;
        // Indices are u32, and the largest means none.
        if self.vertices.max(self.triangles) >= u64::from(NONE) {
            return Err(GltfError::TooLarge {
                place: place(),
                limit: NONE.into(),
                unit: "vertices or triangles",
                remedy: "split the file",
            });
        }
        let bytes = vertices * BYTES_PER_VERTEX + triangles * BYTES_PER_TRIANGLE;
        self.left = self
            .left
            .checked_sub(bytes)
            .ok_or_else(|| GltfError::TooLarge {
                place: place(),
                limit: self.limit,
                unit: "bytes of vertices and triangles",
                remedy: "it draws the same data many times; use instances",
            })?;
        Ok(())
    }
}
