//! Several scenes in one, and one object of several.

use crate::{Image, Material, Mesh, Scene, Texture};
use std::collections::BTreeSet;

impl Scene {
    /// Appends all that another scene holds. Names are kept as they are.
    ///
    /// # Panics
    ///
    /// When an array would have more than 2^32 elements.
    pub fn append(&mut self, other: &Scene) {
        let number = |len: usize| u32::try_from(len).expect("indices are 32 bits");
        let vertex = number(self.positions.len());
        let triangle = number(self.triangles.len());
        let material = number(self.materials.len());
        let mesh = number(self.meshes.len());
        let texture = number(self.textures.len());
        let image = number(self.images.len());
        number(self.positions.len() + other.positions.len());
        number(self.triangles.len() + other.triangles.len());
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs.extend_from_slice(&other.uvs);
        self.colors.extend_from_slice(&other.colors);
        let triangles = other.triangles.iter().map(|t| t.map(|v| v + vertex));
        self.triangles.extend(triangles);
        let materials = other.triangle_materials.iter().map(|m| m + material);
        self.triangle_materials.extend(materials);
        self.meshes.extend(other.meshes.iter().map(|m| Mesh {
            vertices: m.vertices.start + vertex..m.vertices.end + vertex,
            triangles: m.triangles.start + triangle..m.triangles.end + triangle,
        }));
        self.objects.extend(other.objects.iter().cloned());
        for object in self.objects.iter_mut().rev().take(other.objects.len()) {
            object.mesh += mesh;
        }
        let materials = other.materials.iter();
        self.materials
            .extend(materials.map(|m| m.renumbered(|t| t + texture)));
        self.textures.extend(other.textures.iter().map(|t| Texture {
            image: t.image + image,
            ..t.clone()
        }));
        self.images.extend(other.images.iter().cloned());
    }

    /// One object as a scene of its own, with no more materials, textures and images than it
    /// uses, in the order they have here.
    ///
    /// # Panics
    ///
    /// When the object does not exist.
    pub fn extracted(&self, object: u32) -> Scene {
        let mesh = self.mesh_of(object);
        let vertices = mesh.vertices.start as usize..mesh.vertices.end as usize;
        let triangles = mesh.triangles.start as usize..mesh.triangles.end as usize;
        let used = |all: Vec<u32>| -> Vec<u32> {
            let sorted: BTreeSet<u32> = all.into_iter().collect();
            sorted.into_iter().collect()
        };
        let place = |sorted: &[u32], index: u32| sorted.partition_point(|i| *i < index) as u32;
        let materials = used(self.triangle_materials[triangles.clone()].to_vec());
        let material = |i: &u32| &self.materials[*i as usize];
        let textures = materials.iter().flat_map(|i| material(i).textures());
        let textures = used(textures.collect());
        let texture = |i: &u32| &self.textures[*i as usize];
        let images = used(textures.iter().map(|i| texture(i).image).collect());
        let renumber = |m: &Material| m.renumbered(|t| place(&textures, t));
        Scene {
            positions: self.positions[vertices.clone()].to_vec(),
            normals: self.normals[vertices.clone()].to_vec(),
            uvs: self.uvs[vertices.clone()].to_vec(),
            colors: self.colors[vertices].to_vec(),
            triangles: self.triangles[triangles.clone()]
                .iter()
                .map(|t| t.map(|v| v - mesh.vertices.start))
                .collect(),
            triangle_materials: self.triangle_materials[triangles]
                .iter()
                .map(|m| place(&materials, *m))
                .collect(),
            meshes: vec![Mesh {
                vertices: 0..mesh.vertices.len() as u32,
                triangles: 0..mesh.triangles.len() as u32,
            }],
            objects: vec![crate::Object {
                mesh: 0,
                ..self.objects[object as usize].clone()
            }],
            materials: materials.iter().map(|i| renumber(material(i))).collect(),
            textures: textures
                .iter()
                .map(|i| Texture {
                    image: place(&images, texture(i).image),
                    ..texture(i).clone()
                })
                .collect(),
            images: images
                .iter()
                .map(|i| self.images[*i as usize].clone())
                .collect::<Vec<Image>>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::soup;
    use crate::{Filter, Wrap};
    use proptest::prelude::*;

    /// An object whose material number `material` of three shows its own of three images.
    fn scene(material: u32, name: &str) -> Scene {
        let mut scene = soup(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        for i in 0..3u32 {
            scene.images.push(Image {
                name: format!("{name} {i}"),
                width: 1,
                height: 1,
                texels: vec![[i as u8; 4]],
            });
            scene.textures.push(Texture {
                image: i,
                wrap: [Wrap::Repeat; 2],
                filter: Filter::Linear,
            });
        }
        let with = |i| Material {
            base_color_texture: Some(i),
            ..Material::default()
        };
        scene.materials = (0..3).map(with).collect();
        scene.triangle_materials = vec![material];
        scene.objects[0].name = name.into();
        scene
    }

    proptest! {
        /// Every object of joined scenes, taken out again, shows what it showed alone.
        #[test]
        fn joined_scenes_come_apart_again(materials in prop::collection::vec(0..3u32, 1..5)) {
            let all: Vec<Scene> =
                (0..).zip(&materials).map(|(i, m)| scene(*m, &format!("scene {i}"))).collect();
            let mut joined = Scene::default();
            all.iter().for_each(|scene| joined.append(scene));
            prop_assert_eq!(joined.check(), Ok(()));
            for (i, (scene, material)) in all.iter().zip(materials).enumerate() {
                let alone = joined.extracted(i as u32);
                prop_assert_eq!(alone.check(), Ok(()));
                prop_assert_eq!(&alone.objects, &scene.objects);
                prop_assert_eq!(&alone.positions, &scene.positions);
                prop_assert_eq!(&alone.images, &[scene.images[material as usize].clone()]);
                prop_assert_eq!(alone.materials.len(), 1);
                prop_assert_eq!(&alone.extracted(0), &alone);
            }
        }
    }
}
