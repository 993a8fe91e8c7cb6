//! From shapes to a scene.

use crate::canvas::Detail;
use crate::shape::Shape;
use crate::skin::Skin;
use farfield_scene::{Filter, Mesh, Object, Scene, Texture, Wrap};
use glam::DAffine3;
use rayon::prelude::*;

/// A scene with the materials of the first `skins` of all skins and no geometry.
pub(crate) fn empty_scene(seed: u32, skins: usize, detail: Detail) -> Scene {
    let skins = &Skin::ALL[..skins];
    let images: Vec<_> = skins
        .par_iter()
        .map(|skin| Some(skin.painting(seed)?.image(detail)))
        .collect();
    let mut scene = Scene::default();
    for (&skin, image) in skins.iter().zip(images) {
        let mut material = skin.material();
        if let Some(image) = image {
            material.base_color_texture = Some(scene.textures.len() as u32);
            let wrap = match skin.tiles() {
                true => Wrap::Repeat,
                false => Wrap::ClampToEdge,
            };
            scene.textures.push(Texture {
                image: scene.images.len() as u32,
                wrap: [wrap; 2],
                filter: Filter::Mipmapped,
            });
            scene.images.push(image);
        }
        scene.materials.push(material);
    }
    scene
}

/// Adds a mesh that objects can show, and returns its index.
pub(crate) fn add_mesh(scene: &mut Scene, shape: &Shape) -> u32 {
    let (first, triangles) = (scene.positions.len() as u32, scene.triangles.len() as u32);
    scene.positions.extend(&shape.positions);
    scene.normals.extend(&shape.normals);
    scene.uvs.extend(&shape.uvs);
    scene.colors.extend(&shape.colors);
    scene
        .triangles
        .extend(shape.triangles.iter().map(|t| t.map(|v| v + first)));
    scene
        .triangle_materials
        .extend(shape.skins.iter().map(|&skin| skin as u32));
    scene.meshes.push(Mesh {
        vertices: first..scene.positions.len() as u32,
        triangles: triangles..scene.triangles.len() as u32,
    });
    scene.meshes.len() as u32 - 1
}

/// Adds an object that shows a mesh.
pub(crate) fn place(scene: &mut Scene, name: &str, mesh: u32, world_from_mesh: DAffine3) {
    scene.objects.push(Object {
        name: name.into(),
        mesh,
        world_from_mesh,
    });
}

/// Adds a shape that is already where it belongs.
pub(crate) fn add_object(scene: &mut Scene, name: &str, shape: &Shape) {
    let mesh = add_mesh(scene, shape);
    place(scene, name, mesh, DAffine3::IDENTITY);
}
