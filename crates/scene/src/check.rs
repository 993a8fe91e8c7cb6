//! Whether a scene's arrays fit together.

use crate::Scene;
use std::ops::Range;

/// What does not fit together in a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// The array and the element, such as `triangles[7]`.
    pub place: String,
    /// What is wrong with it.
    pub problem: String,
}

impl std::fmt::Display for SceneError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.place, self.problem)
    }
}

impl std::error::Error for SceneError {}

impl Scene {
    /// Checks that all indices exist, arrays that run side by side are equally long, images have
    /// all their texels and all numbers are finite.
    ///
    /// # Errors
    ///
    /// The first thing found wrong.
    pub fn check(&self) -> Result<(), SceneError> {
        self.check_vertices()?;
        self.check_triangles()?;
        self.check_objects()?;
        self.check_materials()
    }

    fn check_vertices(&self) -> Result<(), SceneError> {
        let count = self.positions.len();
        for (array, len) in [
            ("normals", self.normals.len()),
            ("uvs", self.uvs.len()),
            ("colors", self.colors.len()),
        ] {
            require(len == count, array, || {
                format!("has {len} entries for {count} positions")
            })?;
        }
        for i in 0..count {
            let finite = self.positions[i].is_finite()
                && self.normals[i].is_finite()
                && self.uvs[i].is_finite()
                && self.colors[i].is_finite();
            require(finite, format_args!("vertex {i}"), || {
                "has a number that is not finite".into()
            })?;
        }
        Ok(())
    }

    fn check_triangles(&self) -> Result<(), SceneError> {
        let (count, materials) = (self.triangles.len(), self.triangle_materials.len());
        require(materials == count, "triangle_materials", || {
            format!("has {materials} entries for {count} triangles")
        })?;
        for (i, &material) in self.triangle_materials.iter().enumerate() {
            in_array(
                material,
                &self.materials,
                "material",
                format_args!("triangles[{i}]"),
            )?;
        }
        for (i, mesh) in self.meshes.iter().enumerate() {
            let place = format!("meshes[{i}]");
            in_range(&mesh.vertices, self.positions.len(), "vertices", &place)?;
            in_range(&mesh.triangles, count, "triangles", &place)?;
            for t in mesh.triangles.clone() {
                let inside = self.triangles[t as usize]
                    .iter()
                    .all(|v| mesh.vertices.contains(v));
                require(inside, format_args!("triangles[{t}]"), || {
                    format!("uses a vertex outside of {place}")
                })?;
            }
        }
        Ok(())
    }

    fn check_objects(&self) -> Result<(), SceneError> {
        for (i, object) in self.objects.iter().enumerate() {
            let place = format!("objects[{i}]");
            in_array(object.mesh, &self.meshes, "mesh", &place)?;
            require(object.world_from_mesh.is_finite(), place, || {
                "has a transform that is not finite".into()
            })?;
        }
        Ok(())
    }

    fn check_materials(&self) -> Result<(), SceneError> {
        for (i, material) in self.materials.iter().enumerate() {
            for texture in [
                material.base_color_texture,
                material.metallic_roughness_texture,
                material.normal_texture,
                material.emissive_texture,
            ]
            .into_iter()
            .flatten()
            {
                in_array(
                    texture,
                    &self.textures,
                    "texture",
                    format_args!("materials[{i}]"),
                )?;
            }
        }
        for (i, texture) in self.textures.iter().enumerate() {
            in_array(
                texture.image,
                &self.images,
                "image",
                format_args!("textures[{i}]"),
            )?;
        }
        for (i, image) in self.images.iter().enumerate() {
            let texels = image.width as usize * image.height as usize;
            require(
                texels == image.texels.len() && texels > 0,
                format_args!("images[{i}]"),
                || {
                    let (w, h, n) = (image.width, image.height, image.texels.len());
                    format!("has {n} texels for {w} x {h}")
                },
            )?;
        }
        Ok(())
    }
}

fn require(
    holds: bool,
    place: impl std::fmt::Display,
    problem: impl FnOnce() -> String,
) -> Result<(), SceneError> {
    match holds {
        true => Ok(()),
        false => Err(SceneError {
            place: place.to_string(),
            problem: problem(),
        }),
    }
}

fn in_array<T>(
    index: u32,
    array: &[T],
    what: &str,
    place: impl std::fmt::Display,
) -> Result<(), SceneError> {
    require((index as usize) < array.len(), place, || {
        format!("uses {what} {index} of {}", array.len())
    })
}

fn in_range(range: &Range<u32>, len: usize, what: &str, place: &str) -> Result<(), SceneError> {
    require(
        range.start <= range.end && range.end as usize <= len,
        place,
        || format!("uses {what} {range:?} of {len}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, Material, Mesh, Object, Texture, Wrap};
    use glam::{DAffine3, Vec2, Vec3, Vec4};
    use proptest::prelude::*;

    fn triangle() -> Scene {
        Scene {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            uvs: vec![Vec2::ZERO; 3],
            colors: vec![Vec4::ONE; 3],
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            meshes: vec![Mesh {
                vertices: 0..3,
                triangles: 0..1,
            }],
            objects: vec![Object {
                name: "triangle".into(),
                mesh: 0,
                world_from_mesh: DAffine3::IDENTITY,
            }],
            materials: vec![Material {
                base_color_texture: Some(0),
                ..Material::default()
            }],
            textures: vec![Texture {
                image: 0,
                wrap: [Wrap::Repeat; 2],
                filter: crate::Filter::Linear,
            }],
            images: vec![Image {
                name: String::new(),
                width: 1,
                height: 1,
                texels: vec![[255; 4]],
            }],
        }
    }

    #[test]
    fn a_sound_scene_passes() {
        assert_eq!(triangle().check(), Ok(()));
        assert_eq!(Scene::default().check(), Ok(()));
    }

    proptest! {
        /// Whichever index or array is damaged, the check names the place.
        #[test]
        fn every_damage_is_found(damage in 0..12usize, by in 3..u32::MAX) {
            let mut s = triangle();
            let place = match damage {
                0 => { s.triangles[0][1] = by; "triangles[0]" }
                1 => { s.triangle_materials[0] = by; "triangles[0]" }
                2 => { s.meshes[0].triangles.end = by; "meshes[0]" }
                3 => { s.meshes[0].vertices = by..u32::MAX; "meshes[0]" }
                4 => { s.objects[0].mesh = by; "objects[0]" }
                5 => { s.objects[0].world_from_mesh.translation.x = f64::NAN; "objects[0]" }
                6 => { s.materials[0].emissive_texture = Some(by); "materials[0]" }
                7 => { s.textures[0].image = by; "textures[0]" }
                8 => { s.images[0].width = by; "images[0]" }
                9 => { s.normals.pop(); "normals" }
                10 => { s.positions[2].z = f32::INFINITY; "vertex 2" }
                _ => { s.colors[1].w = f32::NAN; "vertex 1" }
            };
            prop_assert_eq!(s.check().unwrap_err().place, place);
        }

        /// Mirrored objects turn the winding, so the front stays the front.
        #[test]
        fn normals_of_mirrored_triangles_point_to_the_same_side(sign in prop::array::uniform3(any::<bool>())) {
            let mut s = triangle();
            let scale = glam::DVec3::from(sign.map(|s| if s { 2.0 } else { -2.0 }));
            s.objects[0].world_from_mesh = DAffine3::from_scale(scale);
            let [a, b, c] = s.triangle_in(0, 0).map(|v| s.world_position(0, v));
            // The mesh's normal is +Z; a transform takes normals along by its inverse transpose.
            prop_assert!((b - a).cross(c - a).z * scale.z > 0.0);
        }
    }
}
