//! What tests share.

use crate::{Material, Mesh, Object, Scene};
use glam::{DAffine3, Vec2, Vec3, Vec4};

/// Three points a triangle, one material, one object.
pub(crate) fn soup(points: &[[f32; 3]]) -> Scene {
    let count = points.len() as u32;
    Scene {
        positions: points.iter().copied().map(Vec3::from).collect(),
        normals: vec![Vec3::Y; points.len()],
        uvs: vec![Vec2::ZERO; points.len()],
        colors: vec![Vec4::ONE; points.len()],
        triangles: (0..count / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        triangle_materials: vec![0; points.len() / 3],
        meshes: vec![Mesh {
            vertices: 0..count,
            triangles: 0..count / 3,
        }],
        objects: vec![Object {
            name: "soup".into(),
            mesh: 0,
            world_from_mesh: DAffine3::IDENTITY,
        }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}
