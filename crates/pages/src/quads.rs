//! Textured quads over the patches of layers.

use crate::paint::{GUTTER, Patch};
use farfield_grid::Grid;
use farfield_scene::{AlphaMode, Filter, Image, Material, Mesh, Object, Scene, Texture, Wrap};
use farfield_views::Camera;
use glam::{DAffine3, DVec2, DVec3, Vec4};

/// Alpha from which on a page's texels are shown.
///
/// A bilinear mask that is 1 at an opaque texel's centre and 0 at all others is still 1/4 in the
/// corners of the texel's square, so a cutoff just below shows every opaque texel's full square.
/// Cut at 0.5, convex corners would be rounded off and open gaps.
pub const ALPHA_CUTOFF: f32 = 0.24;

/// How far a quad reaches over its rectangle on every side, in texels: into the gutter, so that
/// quads of one layer overlap and show the same texels there at the same depth. Without it,
/// T-junctions open.
pub(crate) const OVERLAP: f64 = 0.5;

/// The quads of one impostor: one object, one mesh, the triangles of each page behind each other,
/// and one masked, unlit, single-sided material per page, with bilinear look-up without levels of
/// detail.
///
/// * `camera` - at the reference viewpoint; its pixels are the texels of the layers
/// * `depths` - per layer, in metres from the reference viewpoint
/// * `origin` - in the world, in metres, near the quads: coordinates are kept relative to it
/// * `patches` - sorted by page
///
/// Quads face the reference viewpoint.
///
/// # Panics
///
/// When a patch's layer or page does not exist, or patches are not sorted by page.
pub fn quad_scene(
    name: &str,
    camera: &Camera,
    depths: &[f64],
    origin: DVec3,
    patches: &[Patch],
    pages: &[Grid<[u8; 4]>],
) -> Scene {
    assert!(
        patches.is_sorted_by_key(|patch| patch.page),
        "patches are not sorted by page"
    );
    let mask = Material {
        metallic: 0.0,
        alpha: AlphaMode::Mask {
            cutoff: ALPHA_CUTOFF,
        },
        unlit: true,
        ..Material::default()
    };
    let mut scene = page_scene(pages, &mask);
    for patch in patches {
        let page = &pages[patch.page as usize];
        add_quad(
            &mut scene,
            camera,
            depths[patch.layer as usize],
            origin,
            patch,
            page,
        );
    }
    place_as_object(&mut scene, name, origin);
    scene
}

/// A scene without triangles that has a material for each page, in their order: `look`, with bilinear
/// look-up in the page without levels of detail.
pub fn page_scene(pages: &[Grid<[u8; 4]>], look: &Material) -> Scene {
    let mut scene = Scene::default();
    for (i, page) in pages.iter().enumerate() {
        scene.images.push(Image {
            name: format!("{i:03}"),
            width: page.width() as u32,
            height: page.height() as u32,
            texels: page.cells().to_vec(),
        });
        scene.textures.push(Texture {
            image: i as u32,
            wrap: [Wrap::ClampToEdge; 2],
            filter: Filter::Linear,
        });
        scene.materials.push(Material {
            name: format!("page {i}"),
            base_color_texture: Some(i as u32),
            ..look.clone()
        });
    }
    scene
}

/// Makes all triangles of a scene one mesh of one object, at a place in the world that their
/// coordinates are relative to.
pub fn place_as_object(scene: &mut Scene, name: &str, origin: DVec3) {
    scene.meshes.push(Mesh {
        vertices: 0..scene.positions.len() as u32,
        triangles: 0..scene.triangles.len() as u32,
    });
    scene.objects.push(Object {
        name: name.into(),
        mesh: 0,
        world_from_mesh: DAffine3::from_translation(origin),
    });
}

fn add_quad(
    scene: &mut Scene,
    camera: &Camera,
    depth: f64,
    origin: DVec3,
    patch: &Patch,
    page: &Grid<[u8; 4]>,
) {
    let first = scene.positions.len() as u32;
    let size = DVec2::new(f64::from(patch.rect.width), f64::from(patch.rect.height));
    let in_layer = DVec2::new(f64::from(patch.rect.x), f64::from(patch.rect.y));
    let in_page = DVec2::new(f64::from(patch.x), f64::from(patch.y)) + f64::from(GUTTER);
    let page_size = DVec2::new(page.width() as f64, page.height() as f64);
    // Upper left, lower left, lower right, upper right: counter-clockwise for the viewer.
    for (x, y) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)] {
        let side = DVec2::new(x, y);
        let corner = side * size + (side * 2.0 - 1.0) * OVERLAP;
        let point = camera
            .pose
            .point_in_world(camera.view_from_pixel(in_layer + corner, depth));
        scene.positions.push((point - origin).as_vec3());
        scene.normals.push(-camera.pose.forward.as_vec3());
        scene.uvs.push(((in_page + corner) / page_size).as_vec2());
        scene.colors.push(Vec4::ONE);
    }
    scene
        .triangles
        .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    scene.triangle_materials.extend([patch.page; 2]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blank_page;
    use farfield_grid::Rect;
    use farfield_views::{Extent, Pose};
    use glam::{Vec2, Vec3};
    use proptest::prelude::*;

    /// Where a point of a quad is seen from the reference viewpoint, and what it shows there.
    fn seen(scene: &Scene, camera: &Camera, vertex: usize) -> (DVec2, Vec2) {
        let point = camera
            .pose
            .point_in_view(scene.world_position(0, vertex as u32));
        (camera.pixel_from_view(point), scene.uvs[vertex])
    }

    proptest! {
        /// Seen from the reference viewpoint, every page texel appears at the place in the layer
        /// that it was recorded at, and quads face the viewer.
        #[test]
        fn texels_appear_where_they_were_recorded(
            rect in (0..500u32, 0..300u32, 1..60u32, 1..60u32),
            at in (0..30u32, 0..30u32), depth in 5.0..500.0f64,
        ) {
            let camera = Camera {
                pose: Pose::looking_along(DVec3::new(1e5, 20.0, -3.0), DVec3::new(1.0, -0.2, 0.4)),
                extent: Extent { min: DVec2::new(-0.1, -0.3), max: DVec2::new(0.5, 0.1) },
                width: 600,
                height: 400,
            };
            let (x, y, width, height) = rect;
            let patch =
                Patch { layer: 0, rect: Rect { x, y, width, height }, page: 0, x: at.0, y: at.1 };
            let pages = [blank_page([128, 128])];
            let origin = camera.pose.eye + camera.pose.forward * depth;
            let scene = quad_scene("quad", &camera, &[depth], origin, &[patch], &pages);
            prop_assert_eq!(scene.check(), Ok(()));
            for vertex in 0..4 {
                let (pixel, uv) = seen(&scene, &camera, vertex);
                let texel = uv.as_dvec2() * 128.0;
                let expected = pixel - DVec2::new(f64::from(x), f64::from(y))
                    + DVec2::new(f64::from(at.0), f64::from(at.1)) + 1.0;
                // Positions are f32, relative to an origin at most a picture's width (600 texels) away.
                prop_assert!(texel.abs_diff_eq(expected, 1e-3), "{texel} is not {expected}");
            }
            for triangle in 0..2 {
                let [a, b, c] = scene.triangle_in(0, triangle).map(|v| scene.world_position(0, v));
                prop_assert!((b - a).cross(c - a).dot(camera.pose.eye - a) > 0.0);
            }
        }
    }

    /// Numbers the vertices' positions in `f32`.
    #[test]
    fn coordinates_are_small() {
        let camera = Camera::looking_at(
            DVec3::new(5e6, 0.0, 9.0),
            DVec3::new(5e6, 0.0, 0.0),
            1.0,
            64,
        );
        let patch = Patch {
            layer: 0,
            rect: Rect {
                x: 0,
                y: 0,
                width: 64,
                height: 64,
            },
            page: 0,
            x: 0,
            y: 0,
        };
        let pages = [blank_page([66, 66])];
        let origin = DVec3::new(5e6, 0.0, 0.0);
        let scene = quad_scene("quad", &camera, &[9.0], origin, &[patch], &pages);
        assert!(scene.positions.iter().all(|p: &Vec3| p.length() < 10.0));
        assert_eq!(scene.objects[0].world_from_mesh.translation, origin);
    }
}
