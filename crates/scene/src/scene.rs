//! Geometry, and what uses it.

use crate::{Image, Material, Texture};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::ops::Range;

/// Everything that can be seen, in flat arrays that refer to each other by index.
///
/// Vertices are shared by the triangles of a mesh, meshes by objects. The four vertex arrays are
/// equally long. [`Scene::check`] tells whether all this holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// In the mesh's own space, in metres.
    pub positions: Vec<Vec3>,
    /// In the mesh's own space, of length 1.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; (0, 0) is an image's upper left corner, v runs down. Zero where the
    /// mesh has none.
    pub uvs: Vec<Vec2>,
    /// Linear RGBA that multiplies the material's base colour; one where the mesh has none.
    pub colors: Vec<Vec4>,
    /// Three vertices each, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// The material of each triangle.
    pub triangle_materials: Vec<u32>,
    /// Runs of vertices and triangles.
    pub meshes: Vec<Mesh>,
    /// Placed meshes.
    pub objects: Vec<Object>,
    /// How triangles look.
    pub materials: Vec<Material>,
    /// What materials show.
    pub textures: Vec<Texture>,
    /// What textures show.
    pub images: Vec<Image>,
}

/// The vertices and triangles of one shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mesh {
    /// All vertices its triangles use.
    pub vertices: Range<u32>,
    /// Its triangles.
    pub triangles: Range<u32>,
}

/// A mesh at a place in the world. Several objects may share a mesh (instancing).
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// For people; need not be unique.
    pub name: String,
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// From the mesh's space to the world. In f64: cities have large coordinates.
    pub world_from_mesh: DAffine3,
}

impl Object {
    /// Whether the transform mirrors the mesh, so that triangles turn their winding.
    pub fn is_mirrored(&self) -> bool {
        self.world_from_mesh.matrix3.determinant() < 0.0
    }
}

impl Scene {
    /// The mesh of an object.
    ///
    /// # Panics
    ///
    /// When the object does not exist.
    pub fn mesh_of(&self, object: u32) -> &Mesh {
        &self.meshes[self.objects[object as usize].mesh as usize]
    }

    /// Vertices of a triangle as seen in an object, counter-clockwise seen from the front also in
    /// objects that are mirrored.
    ///
    /// # Panics
    ///
    /// When the object or the triangle does not exist.
    pub fn triangle_in(&self, object: u32, triangle: u32) -> [u32; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        match self.objects[object as usize].is_mirrored() {
            true => [a, c, b],
            false => [a, b, c],
        }
    }

    /// Position of an object's vertex in the world, in metres.
    ///
    /// # Panics
    ///
    /// When the object or the vertex does not exist.
    pub fn world_position(&self, object: u32, vertex: u32) -> DVec3 {
        self.objects[object as usize]
            .world_from_mesh
            .transform_point3(self.positions[vertex as usize].as_dvec3())
    }

    /// Corners in the world of all triangles that are drawn, object by object.
    pub fn triangles_in_world(&self) -> impl Iterator<Item = [DVec3; 3]> {
        (0..self.objects.len() as u32).flat_map(move |object| {
            let triangles = self.mesh_of(object).triangles.clone();
            triangles.map(move |triangle| {
                let vertices = self.triangle_in(object, triangle);
                vertices.map(|vertex| self.world_position(object, vertex))
            })
        })
    }

    /// Number of triangles drawn, those of shared meshes once per object.
    pub fn drawn_triangles(&self) -> u64 {
        (0..self.objects.len() as u32)
            .map(|object| self.mesh_of(object).triangles.len() as u64)
            .sum()
    }

    /// Least and greatest coordinates in the world of the vertices that an object's triangles
    /// use, or `None` where it has no triangle.
    ///
    /// # Panics
    ///
    /// When the object does not exist.
    pub fn bounds_of(&self, object: u32) -> Option<[DVec3; 2]> {
        let range = &self.mesh_of(object).triangles;
        self.triangles[range.start as usize..range.end as usize]
            .iter()
            .flatten()
            .map(|&vertex| self.world_position(object, vertex))
            .map(|point| [point, point])
            .reduce(enclose)
    }

    /// Least and greatest coordinates in the world of all that is drawn, or `None` where nothing
    /// is.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        (0..self.objects.len() as u32)
            .filter_map(|object| self.bounds_of(object))
            .reduce(enclose)
    }
}

fn enclose([min_a, max_a]: [DVec3; 2], [min_b, max_b]: [DVec3; 2]) -> [DVec3; 2] {
    [min_a.min(min_b), max_a.max(max_b)]
}
