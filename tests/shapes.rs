//! Shapes that scenes of tests are made of.

use farfield_scene::{Material, Mesh, Object, Scene};
use glam::{DAffine3, Vec2, Vec3, Vec4};

/// Adds the mesh of a box with sides along the axes, of one material.
pub(crate) fn add_box(scene: &mut Scene, center: Vec3, size: Vec3, material: u32) {
    let (first, triangles) = (scene.positions.len() as u32, scene.triangles.len() as u32);
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            // Counter-clockwise seen from outside.
            let (u, v) = (
                Vec3::AXES[(axis + 1) % 3],
                side * Vec3::AXES[(axis + 2) % 3],
            );
            let normal = side * Vec3::AXES[axis];
            let corner = scene.positions.len() as u32;
            for (a, b) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
                let offset = normal * 0.5 + u * a + v * b;
                scene.positions.push(center + offset * size);
                scene.normals.push(normal);
                scene.uvs.push(Vec2::new(a, b) * 8.0);
                scene.colors.push(Vec4::ONE);
            }
            let both = [[0, 1, 2], [0, 2, 3]];
            scene.triangles.extend(both.map(|t| t.map(|i| corner + i)));
        }
    }
    scene
        .triangle_materials
        .resize(scene.triangles.len(), material);
    scene.meshes.push(Mesh {
        vertices: first..scene.positions.len() as u32,
        triangles: triangles..scene.triangles.len() as u32,
    });
}

/// A scene of one triangle, single-sided.
pub(crate) fn triangle(corners: [Vec3; 3]) -> Scene {
    let [a, b, c] = corners;
    Scene {
        positions: corners.into(),
        normals: vec![(b - a).cross(c - a).normalize(); 3],
        uvs: vec![Vec2::ZERO; 3],
        colors: vec![Vec4::ONE; 3],
        triangles: vec![[0, 1, 2]],
        triangle_materials: vec![0],
        materials: vec![Material::default()],
        meshes: vec![Mesh {
            vertices: 0..3,
            triangles: 0..1,
        }],
        objects: vec![Object {
            name: "triangle".into(),
            mesh: 0,
            world_from_mesh: DAffine3::IDENTITY,
        }],
        ..Scene::default()
    }
}
