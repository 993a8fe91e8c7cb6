//! Some of the triangles that a scene draws.

use crate::{Mesh, Object, Scene};
use std::collections::BTreeSet;

impl Scene {
    /// The scene with only some of the triangles that it draws.
    ///
    /// As in [`Scene::clipped`], the images stay behind; materials and textures have the numbers they
    /// have here, and vertices too.
    ///
    /// * `drawn` - objects, and triangles of their meshes
    ///
    /// # Panics
    ///
    /// When an object or a triangle does not exist.
    pub fn drawing_only(&self, drawn: &BTreeSet<[u32; 2]>) -> Scene {
        let mut selection = Scene {
            positions: self.positions.clone(),
            normals: self.normals.clone(),
            uvs: self.uvs.clone(),
            colors: self.colors.clone(),
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            ..Scene::default()
        };
        let drawn: Vec<&[u32; 2]> = drawn.iter().collect();
        for of_object in drawn.chunk_by(|a, b| a[0] == b[0]) {
            let object = of_object[0][0];
            let first = selection.triangles.len() as u32;
            for [_, triangle] in of_object {
                let triangle = *triangle as usize;
                selection.triangles.push(self.triangles[triangle]);
                let material = self.triangle_materials[triangle];
                selection.triangle_materials.push(material);
            }
            selection.objects.push(Object {
                mesh: selection.meshes.len() as u32,
                ..self.objects[object as usize].clone()
            });
            selection.meshes.push(Mesh {
                vertices: self.mesh_of(object).vertices.clone(),
                triangles: first..selection.triangles.len() as u32,
            });
        }
        selection
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::soup;
    use glam::DAffine3;
    use proptest::prelude::*;

    proptest! {
        /// Of two mirrored instances what was asked for is drawn, where and as it was, and nothing else.
        #[test]
        fn what_is_asked_for_is_drawn(
            points in prop::collection::vec([-2.0..2.0f32, -2.0..2.0f32, -2.0..2.0f32], 12),
            asked in prop::collection::btree_set(prop::array::uniform2(0..4u32), 1..9),
        ) {
            let mut scene = soup(&points);
            let mut second = scene.objects[0].clone();
            second.world_from_mesh = DAffine3::from_scale([-1.0, 1.0, 2.0].into());
            scene.objects.push(second);
            let asked = asked.into_iter().map(|[object, triangle]| [object % 2, triangle]);
            let asked: BTreeSet<[u32; 2]> = asked.collect();
            let found = scene.drawing_only(&asked);
            prop_assert_eq!(found.check(), Ok(()));
            let all: Vec<_> = scene.triangles_in_world().collect();
            let expected = asked.iter().map(|[object, triangle]| all[(4 * object + triangle) as usize]);
            prop_assert_eq!(found.triangles_in_world().collect::<Vec<_>>(), expected.collect::<Vec<_>>());
        }
    }
}
