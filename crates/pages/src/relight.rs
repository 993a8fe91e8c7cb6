//! Pages beside the colours, for engines that light quads themselves.

use farfield_grid::Grid;
use farfield_scene::{Image, Scene, Texture};
use farfield_views::Pose;
use glam::Vec3;

/// What the pages of an impostor hold beside base colour and alpha, each page as large as the one of
/// colours and with its texels in the same places.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPages {
    /// Normals in the quads' tangent space ([`normal_texel`]), linear.
    pub normal: Vec<Grid<[u8; 4]>>,
    /// Roughness in green, metallic in blue, linear.
    pub metallic_roughness: Vec<Grid<[u8; 4]>>,
    /// What shines by itself, sRGB, and linear RGB that it is multiplied with; none where nothing
    /// does.
    pub emissive: Option<(Vec<Grid<[u8; 4]>>, f32)>,
}

/// A normal of the world as a texel of a quad's normal map. Quads face against the pose's view axis,
/// u runs along its right and v down: x of the map is to the right, y up and z towards the viewer.
///
/// * `normal` - of length 1
pub fn normal_texel(pose: &Pose, normal: Vec3) -> [u8; 3] {
    let along = |axis: glam::DVec3| normal.as_dvec3().dot(axis);
    let in_tangent_space = [along(pose.right), -along(pose.down), -along(pose.forward)];
    in_tangent_space.map(|c| ((c * 0.5 + 0.5) * 255.0).round().clamp(0.0, 255.0) as u8)
}

/// Gives the materials of [`quad_scene`](crate::quad_scene) the other pages, named after them, so that an engine lights
/// them as metallic-roughness materials.
///
/// # Panics
///
/// When a page is missing.
pub fn make_lit(scene: &mut Scene, pages: &LightPages) {
    for page in 0..scene.materials.len() {
        let base = scene.materials[page].base_color_texture;
        let base = scene.textures[base.expect("quads have pages") as usize].clone();
        let mut add = |pages: &[Grid<[u8; 4]>], name: &str| {
            let texels = &pages[page];
            scene.images.push(Image {
                name: format!("{}-{name}", scene.images[base.image as usize].name),
                width: texels.width() as u32,
                height: texels.height() as u32,
                texels: texels.cells().to_vec(),
            });
            scene.textures.push(Texture {
                image: scene.images.len() as u32 - 1,
                ..base.clone()
            });
            scene.textures.len() as u32 - 1
        };
        let normal = add(&pages.normal, "normal");
        let metallic_roughness = add(&pages.metallic_roughness, "metallic-roughness");
        let emissive = pages.emissive.as_ref();
        let emissive = emissive.map(|(pages, strength)| (add(pages, "emissive"), *strength));
        let material = &mut scene.materials[page];
        material.unlit = false;
        material.normal_texture = Some(normal);
        material.metallic_roughness_texture = Some(metallic_roughness);
        material.metallic = 1.0;
        material.roughness = 1.0;
        if let Some((texture, strength)) = emissive {
            material.emissive_texture = Some(texture);
            material.emissive = Vec3::splat(strength);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Patch, blank_page, quad_scene};
    use farfield_grid::Rect;
    use farfield_views::{Camera, Extent};
    use glam::{DVec2, DVec3};
    use proptest::prelude::*;

    proptest! {
        /// A normal map is read in the tangent space that follows from the quad's corners and texture
        /// coordinates: the normal comes back as it was.
        #[test]
        fn normals_survive_the_quads_tangent_space(
            forward in prop::array::uniform3(-1.0..1.0f64),
            normal in prop::array::uniform3(-1.0..1.0f32),
        ) {
            let (forward, normal) = (DVec3::from(forward), Vec3::from(normal));
            prop_assume!(forward.length() > 0.1 && normal.length() > 0.1);
            let normal = normal.normalize();
            let camera = Camera {
                pose: Pose::looking_along(DVec3::ZERO, forward),
                extent: Extent { min: DVec2::splat(-0.5), max: DVec2::splat(0.5) },
                width: 8,
                height: 8,
            };
            let rect = Rect { x: 1, y: 2, width: 4, height: 3 };
            let patch = Patch { layer: 0, rect, page: 0, x: 0, y: 0 };
            let pages = vec![blank_page([16, 16])];
            let mut scene = quad_scene("quad", &camera, &[5.0], DVec3::ZERO, &[patch], &pages);
            make_lit(&mut scene, &LightPages {
                normal: pages.clone(),
                metallic_roughness: pages.clone(),
                emissive: Some((pages, 2.0)),
            });
            prop_assert_eq!(scene.check(), Ok(()));
            prop_assert_eq!(scene.images.len(), 4);

            let corner = |i: usize| (scene.positions[i].as_dvec3(), scene.uvs[i].as_dvec2());
            // Upper left, lower left, lower right: v grows down, u to the right.
            let ((a, ta), (b, tb), (c, tc)) = (corner(0), corner(1), corner(2));
            prop_assert!(tb.y > ta.y && tc.x > tb.x);
            let (tangent, bitangent) = ((c - b).normalize(), (a - b).normalize());
            let facing = tangent.cross(bitangent);
            let texel = normal_texel(&camera.pose, normal).map(|c| f64::from(c) / 255.0 * 2.0 - 1.0);
            let read = tangent * texel[0] + bitangent * texel[1] + facing * texel[2];
            prop_assert!(read.abs_diff_eq(normal.as_dvec3(), 0.01), "{read} is not {normal}");
        }
    }
}
