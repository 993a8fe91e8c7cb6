//! What a surface looks like at a point: its material, evaluated.

use crate::Textures;
use crate::geometry::{Drawn, Interpolation, corners_in_view};
use farfield_scene::{Material, Scene};
use farfield_views::Camera;
use glam::{DVec3, Vec2, Vec3, Vec4};

/// A point on a triangle of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index into the scene's objects.
    pub object: u32,
    /// Index into the scene's triangles.
    pub triangle: u32,
    /// Shares of the triangle's second and third corner, as [`Scene::triangle_in`] orders them;
    /// the first has the rest.
    pub barycentric: [f32; 2],
}

/// A material at a point, before any light; the channels of a relightable picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Linear RGB, in [0, 1].
    pub base_color: Vec3,
    /// In the world, of length 1, on the viewer's side.
    pub normal: Vec3,
    /// In [0, 1].
    pub metallic: f32,
    /// In [0, 1].
    pub roughness: f32,
    /// Linear RGB.
    pub emissive: Vec3,
    /// Whether the base colour is shown as it is, without light.
    pub unlit: bool,
}

/// Evaluates the material at a hit, textures filtered for a pixel of the camera.
///
/// # Panics
///
/// When the hit's object or triangle does not exist.
pub fn surface_at(scene: &Scene, textures: &Textures<'_>, camera: &Camera, hit: &Hit) -> Surface {
    let material = &scene.materials[scene.triangle_materials[hit.triangle as usize] as usize];
    let vertices = scene
        .triangle_in(hit.object, hit.triangle)
        .map(|v| v as usize);
    let weights = weights(hit);
    let uvs = vertices.map(|v| scene.uvs[v]);
    let uv = mix2(uvs, weights);

    let drawn = Drawn {
        object: hit.object,
        triangle: hit.triangle,
    };
    let corners = corners_in_view(scene, &camera.pose, drawn);
    let footprint = uv_footprint(camera, corners, weights, uvs);

    let mut base_color: Vec4 = material.base_color
        * (0..3)
            .map(|i| scene.colors[vertices[i]] * weights[i])
            .sum::<Vec4>();
    if let Some(texture) = material.base_color_texture {
        base_color *= textures.color(texture, uv, footprint);
    }
    let (mut metallic, mut roughness) = (material.metallic, material.roughness);
    if let Some(texture) = material.metallic_roughness_texture {
        let texel = textures.data(texture, uv, footprint);
        (metallic, roughness) = (metallic * texel.z, roughness * texel.y);
    }
    let mut emissive = material.emissive;
    if let Some(texture) = material.emissive_texture {
        emissive *= textures.color(texture, uv, footprint).truncate();
    }
    let bump = material.normal_texture.map(|texture| {
        let texel = textures.data(texture, uv, footprint).truncate() * 2.0 - 1.0;
        texel * Vec3::new(material.normal_scale, material.normal_scale, 1.0)
    });
    Surface {
        base_color: base_color.truncate(),
        normal: normal(scene, camera, hit, corners, bump),
        metallic,
        roughness,
        emissive,
        unlit: material.unlit,
    }
}

/// Whether the surface is there at a hit: alpha reaches the material's cutoff.
pub(crate) fn is_there(
    scene: &Scene,
    textures: &Textures<'_>,
    material: &Material,
    hit: &Hit,
) -> bool {
    let Some(cutoff) = material.alpha.cutoff() else {
        return true;
    };
    let vertices = scene
        .triangle_in(hit.object, hit.triangle)
        .map(|v| v as usize);
    let weights = weights(hit);
    let vertex_alpha: f32 = (0..3)
        .map(|i| scene.colors[vertices[i]].w * weights[i])
        .sum();
    let mut alpha = material.base_color.w * vertex_alpha;
    if let Some(texture) = material.base_color_texture {
        alpha *= textures.alpha(texture, mix2(vertices.map(|v| scene.uvs[v]), weights));
    }
    alpha >= cutoff
}

/// Growth of uv per column and per row of the camera's picture; zero where the triangle is seen
/// edge-on.
fn uv_footprint(
    camera: &Camera,
    corners: [DVec3; 3],
    weights: [f32; 3],
    uvs: [Vec2; 3],
) -> [Vec2; 2] {
    let point: DVec3 = (0..3).map(|i| corners[i] * f64::from(weights[i])).sum();
    match Interpolation::new(camera, corners) {
        Some(interpolation) if point.z > 0.0 => interpolation
            .derivatives(camera.pixel_from_view(point))
            .map(|growth| mix2(uvs, growth.as_vec3().to_array())),
        _ => [Vec2::ZERO; 2],
    }
}

/// The shading normal in the world, bent by `bump` (tangent space) and turned to the camera.
fn normal(
    scene: &Scene,
    camera: &Camera,
    hit: &Hit,
    corners: [DVec3; 3],
    bump: Option<Vec3>,
) -> Vec3 {
    let object = &scene.objects[hit.object as usize];
    let vertices = scene
        .triangle_in(hit.object, hit.triangle)
        .map(|v| v as usize);
    let weights = weights(hit);
    let in_mesh: Vec3 = (0..3)
        .map(|i| scene.normals[vertices[i]] * weights[i])
        .sum();
    // Normals transform by the inverse transpose: the cofactors over the determinant.
    let m = object.world_from_mesh.matrix3;
    let cofactors = [
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    ];
    let turn = if object.is_mirrored() { -1.0 } else { 1.0 };
    let [x, y, z] = in_mesh.as_dvec3().to_array();
    let smooth = (cofactors[0] * x + cofactors[1] * y + cofactors[2] * z) * turn;

    let flat_in_view = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let front = flat_in_view.dot(corners[0]) <= 0.0;
    let pose = &camera.pose;
    let flat =
        pose.right * flat_in_view.x + pose.down * flat_in_view.y + pose.forward * flat_in_view.z;
    let smooth = smooth
        .try_normalize()
        .or(flat.try_normalize())
        .unwrap_or(-pose.forward);

    let bent = bump.and_then(|bump| {
        let [a, b, c] = vertices.map(|v| {
            object
                .world_from_mesh
                .transform_point3(scene.positions[v].as_dvec3())
        });
        let uvs = vertices.map(|v| scene.uvs[v].as_dvec2());
        let (u, v) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
        let along_u = ((b - a) * v.y - (c - a) * u.y) * (u.x * v.y - u.y * v.x).signum();
        let tangent = along_u.reject_from_normalized(smooth).try_normalize()?;
        // Against growing v, as green points up in the texture.
        let along_v = ((c - a) * u.x - (b - a) * v.x) * (u.x * v.y - u.y * v.x).signum();
        let side = -smooth.cross(tangent).dot(along_v).signum();
        let bitangent = smooth.cross(tangent) * side;
        let bump = bump.as_dvec3();
        (tangent * bump.x + bitangent * bump.y + smooth * bump.z).try_normalize()
    });
    let seen = bent.unwrap_or(smooth) * if front { 1.0 } else { -1.0 };
    seen.as_vec3()
}

fn weights(hit: &Hit) -> [f32; 3] {
    let [b, c] = hit.barycentric;
    [1.0 - b - c, b, c]
}

fn mix2(values: [Vec2; 3], weights: [f32; 3]) -> Vec2 {
    values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2]
}
