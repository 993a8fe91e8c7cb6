//! A single planar impostor: one quad with the picture seen from the reference viewpoint.

use crate::capture::capture;
use farfield_sampling::Textures;
use farfield_scene::{AlphaMode, Filter, Image, Material, Mesh, Object, Scene, Texture, Wrap};
use farfield_views::Camera;
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec4};

/// The quad across the view axis of `camera` through `center` that shows what the camera sees.
///
/// * `camera` - at the reference viewpoint, tight around the scene, its pixels small enough that
///   they are magnified from nowhere in the view cell
pub(crate) fn planar_impostor(scene: &Scene, camera: &Camera, center: DVec3) -> Scene {
    let texels = capture(scene, &Textures::new(scene), camera).texels;
    let depth = camera.pose.point_in_view(center).z;
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    // Upper left, lower left, lower right, upper right: counter-clockwise for the viewer.
    let corners = [DVec2::ZERO, DVec2::Y, DVec2::ONE, DVec2::X];
    let position = |side: &DVec2| {
        let point = camera.view_from_pixel(*side * size, depth);
        (camera.pose.point_in_world(point) - center).as_vec3()
    };
    Scene {
        positions: corners.iter().map(position).collect(),
        normals: vec![-camera.pose.forward.as_vec3(); 4],
        uvs: corners
            .iter()
            .map(|side| side.as_vec2())
            .collect::<Vec<Vec2>>(),
        colors: vec![Vec4::ONE; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0; 2],
        meshes: vec![Mesh {
            vertices: 0..4,
            triangles: 0..2,
        }],
        objects: vec![Object {
            name: "planar impostor".into(),
            mesh: 0,
            world_from_mesh: DAffine3::from_translation(center),
        }],
        materials: vec![Material {
            base_color_texture: Some(0),
            alpha: AlphaMode::Mask { cutoff: 0.5 },
            unlit: true,
            ..Material::default()
        }],
        textures: vec![Texture {
            image: 0,
            wrap: [Wrap::ClampToEdge; 2],
            filter: Filter::Linear,
        }],
        images: vec![Image {
            name: String::new(),
            width: camera.width,
            height: camera.height,
            texels: texels.cells().to_vec(),
        }],
    }
}
