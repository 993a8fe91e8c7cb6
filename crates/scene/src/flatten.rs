//! All objects as one, in the order of materials.

use crate::{Mesh, Object, Scene};
use glam::{DAffine3, DMat3, DVec3, Vec3};

impl Scene {
    /// The scene as one object: all triangles that are drawn, sorted by material, those of one material
    /// in the order in which they are drawn, their vertices moved to where they are in the world.
    ///
    /// What objects share, each of them gets of its own. Positions are relative to `origin`, at which
    /// the object is placed, and rounded to `f32`; triangles that have no area then are left out.
    /// Materials, textures and images stay as they are, each as long as a triangle uses it.
    ///
    /// A scene without triangles has no object.
    ///
    /// # Panics
    ///
    /// When there would be more than 2^32 vertices.
    pub fn flattened(&self, name: &str, origin: DVec3) -> Scene {
        let mut flat = Scene {
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            ..Scene::default()
        };
        let mut drawn: Vec<(u32, [u32; 3])> = Vec::new();
        for (index, object) in (0..).zip(&self.objects) {
            let mesh = self.mesh_of(index);
            let first = u32::try_from(flat.positions.len()).expect("indices are 32 bits");
            let moved = first.wrapping_sub(mesh.vertices.start);
            for triangle in mesh.triangles.clone() {
                let corners = self.triangle_in(index, triangle);
                let material = self.triangle_materials[triangle as usize];
                drawn.push((material, corners.map(|v| v.wrapping_add(moved))));
            }
            let vertices = mesh.vertices.start as usize..mesh.vertices.end as usize;
            let world_from_mesh = object.world_from_mesh;
            flat.positions.extend(
                self.positions[vertices.clone()]
                    .iter()
                    .map(|p| (world_from_mesh.transform_point3(p.as_dvec3()) - origin).as_vec3()),
            );
            let linear = world_from_mesh.matrix3;
            let normals = self.normals[vertices.clone()].iter();
            flat.normals.extend(normals.map(|n| normal(*n, linear)));
            flat.uvs.extend_from_slice(&self.uvs[vertices.clone()]);
            flat.colors.extend_from_slice(&self.colors[vertices]);
        }
        drawn.retain(|(_, corners)| {
            let [a, b, c] = corners.map(|v| flat.positions[v as usize].as_dvec3());
            (b - a).cross(c - a) != DVec3::ZERO
        });
        drawn.sort_by_key(|(material, _)| *material);
        if drawn.is_empty() {
            return Scene::default();
        }
        (flat.triangle_materials, flat.triangles) = drawn.into_iter().unzip();
        flat.meshes = vec![Mesh {
            vertices: 0..u32::try_from(flat.positions.len()).expect("indices are 32 bits"),
            triangles: 0..u32::try_from(flat.triangles.len()).expect("indices are 32 bits"),
        }];
        flat.objects = vec![Object {
            name: name.into(),
            mesh: 0,
            world_from_mesh: DAffine3::from_translation(origin),
        }];
        flat.with_images_of(self)
    }

    /// The same with the materials, textures and images that its triangles use; the images are those of
    /// `source`.
    fn with_images_of(self, source: &Scene) -> Scene {
        let mut used: Vec<u32> = self.triangle_materials.clone();
        used.dedup();
        let place = |sorted: &[u32], index: u32| sorted.partition_point(|i| *i < index) as u32;
        let sorted = |mut all: Vec<u32>| {
            all.sort_unstable();
            all.dedup();
            all
        };
        let textures = used
            .iter()
            .flat_map(|m| self.materials[*m as usize].textures());
        let textures = sorted(textures.collect());
        let images = textures.iter().map(|t| self.textures[*t as usize].image);
        let images = sorted(images.collect());
        let material = |m: &u32| self.materials[*m as usize].renumbered(|t| place(&textures, t));
        let texture = |t: &u32| {
            let texture = &self.textures[*t as usize];
            crate::Texture {
                image: place(&images, texture.image),
                ..texture.clone()
            }
        };
        let image = |i: &u32| source.images[*i as usize].clone();
        Scene {
            triangle_materials: (self.triangle_materials.iter())
                .map(|m| place(&used, *m))
                .collect(),
            materials: used.iter().map(material).collect(),
            textures: textures.iter().map(texture).collect(),
            images: images.iter().map(image).collect(),
            ..self
        }
    }
}

/// A normal after a linear map, of length 1.
fn normal(normal: Vec3, linear: DMat3) -> Vec3 {
    if linear == DMat3::IDENTITY {
        return normal;
    }
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    // The inverse transpose but for a factor; exists also where there is no inverse.
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let sign = 1f64.copysign(linear.determinant());
    let mapped = (cofactors * normal.as_dvec3() * sign).normalize_or(DVec3::Z);
    mapped.as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::soup;
    use crate::{Filter, Image, Material, Texture, Wrap};
    use glam::{DQuat, Vec4};
    use proptest::prelude::*;

    /// Triangles of three materials, of which the last is not used, drawn by several objects.
    fn scenes() -> impl Strategy<Value = Scene> {
        let corners = prop::collection::vec([-9.0..9.0f32, -9.0..9.0f32, -9.0..9.0f32], 12);
        let object = (
            prop::array::uniform3(-100.0..100.0f64),
            0.1..3.0f64,
            0.0..6.0f64,
            any::<bool>(),
        );
        (corners, prop::collection::vec(object, 1..4)).prop_map(|(corners, objects)| {
            let mut scene = soup(&corners);
            for i in 0..3 {
                scene.images.push(Image {
                    name: format!("{i}"),
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
            scene.materials = (0..3)
                .map(|i| Material {
                    base_color_texture: Some(2 - i),
                    ..Material::default()
                })
                .collect();
            scene.triangle_materials = vec![1, 0, 1, 0];
            for (i, uv) in scene.colors.iter_mut().enumerate() {
                *uv = Vec4::splat(i as f32 / 12.0);
            }
            let (first, place) = (scene.objects[0].clone(), |(at, scale, turn, mirror)| {
                let sign = if mirror { -1.0 } else { 1.0 };
                DAffine3::from_scale_rotation_translation(
                    DVec3::new(scale * sign, scale, 2.0 * scale),
                    DQuat::from_rotation_y(turn),
                    DVec3::from_array(at),
                )
            });
            scene.objects = objects
                .into_iter()
                .map(|object| Object {
                    world_from_mesh: place(object),
                    ..first.clone()
                })
                .collect();
            scene
        })
    }

    proptest! {
        /// Every triangle that is drawn is in the one object, in the order of materials, where it
        /// was but for the rounding, seen from the same side and with the look that it had.
        #[test]
        fn a_flattened_scene_draws_the_same(scene in scenes(), origin in prop::array::uniform3(-9.0..9.0f64)) {
            let flat = scene.flattened("all", origin.into());
            prop_assert_eq!(flat.check(), Ok(()));
            prop_assert!(flat.triangle_materials.is_sorted());
            prop_assert_eq!((flat.objects.len(), flat.materials.len(), flat.images.len()), (1, 2, 2));
            let look = |scene: &Scene, triangle: usize, vertex: u32| {
                let material = &scene.materials[scene.triangle_materials[triangle] as usize];
                let texture = &scene.textures[material.base_color_texture.unwrap() as usize];
                let image = scene.images[texture.image as usize].name.clone();
                (image, scene.colors[vertex as usize])
            };
            let mut expected = Vec::new();
            for object in 0..scene.objects.len() as u32 {
                for triangle in scene.mesh_of(object).triangles.clone() {
                    let [a, b, c] = scene.triangle_in(object, triangle);
                    let corners = [a, b, c].map(|v| scene.world_position(object, v));
                    expected.push((corners, look(&scene, triangle as usize, a)));
                }
            }
            expected.sort_by(|a, b| b.1.0.cmp(&a.1.0));
            prop_assert_eq!(flat.triangles.len(), expected.len());
            for (triangle, (corners, looks)) in expected.into_iter().enumerate() {
                let [a, b, c] = flat.triangles[triangle];
                prop_assert_eq!(look(&flat, triangle, a), looks);
                for (vertex, corner) in [a, b, c].into_iter().zip(corners) {
                    let at = flat.world_position(0, vertex);
                    // Rounded to f32 once, of up to 200 m.
                    prop_assert!(at.distance(corner) < 200.0 * f64::from(f32::EPSILON));
                    prop_assert!((flat.normals[vertex as usize].length() - 1.0).abs() < 1e-6);
                }
            }
        }
    }

    /// What has no area is not drawn, and a scene without triangles is empty.
    #[test]
    fn what_cannot_be_seen_is_left_out() {
        let point = [1.0, 2.0, 3.0];
        assert_eq!(
            soup(&[point; 3]).flattened("", DVec3::ZERO),
            Scene::default()
        );
        let mut two = soup(&[
            point,
            point,
            point,
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        assert_eq!(two.flattened("", DVec3::ZERO).triangles, [[3, 4, 5]]);
        // Too small for the coordinates that it gets.
        two.objects[0].world_from_mesh.translation.x = 1e9;
        assert_eq!(two.flattened("", DVec3::ZERO), Scene::default());
    }
}
