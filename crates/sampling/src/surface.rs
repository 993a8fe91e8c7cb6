//! What a surface looks like at a point: its material, evaluated.

use crate::Textures;
use crate::geometry::{Drawn, Interpolation, corners_in_view};
use farfield_scene::Scene;
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

impl Hit {
    /// The point's position in the world, in metres.
    ///
    /// # Panics
    ///
    /// When the object or the triangle does not exist.
    pub fn point_in_world(&self, scene: &Scene) -> DVec3 {
        let corners = scene
            .triangle_in(self.object, self.triangle)
            .map(|vertex| scene.world_position(self.object, vertex));
        let weights = weights(self).map(f64::from);
        (0..3).map(|i| corners[i] * weights[i]).sum()
    }
}

/// A material at a point, before any light; the channels of a relightable picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Linear RGB, in [0, 1].
    pub base_color: Vec3,
    /// In the world, of length 1; on the viewer's side where the material is double-sided.
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
    let mut normal = smooth_normal(scene, hit);
    if let Some(texture) = material.normal_texture {
        let texel = textures.data(texture, uv, footprint).truncate() * 2.0 - 1.0;
        let scale = Vec3::new(material.normal_scale, material.normal_scale, 1.0);
        normal = bent(normal, scene, hit, texel * scale);
    }
    // Single-sided surfaces are seen from their front only, whatever this camera sees: what it
    // records is shown to other viewpoints.
    let [a, b, c] = corners;
    if material.double_sided && (b - a).cross(c - a).dot(a) > 0.0 {
        normal = -normal;
    }
    Surface {
        base_color: base_color.truncate(),
        normal: normal.as_vec3(),
        metallic,
        roughness,
        emissive,
        unlit: material.unlit,
    }
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

/// The interpolated normal in the world, of length 1; where it vanishes, the triangle's own.
fn smooth_normal(scene: &Scene, hit: &Hit) -> DVec3 {
    let object = &scene.objects[hit.object as usize];
    let vertices = scene.triangle_in(hit.object, hit.triangle);
    let weights = weights(hit);
    let in_mesh: Vec3 = (0..3)
        .map(|i| scene.normals[vertices[i] as usize] * weights[i])
        .sum();
    // Normals transform by the inverse transpose: the cofactors over the determinant.
    let m = object.world_from_mesh.matrix3;
    let sign = if object.is_mirrored() { -1.0 } else { 1.0 };
    let [x, y, z] = (in_mesh.as_dvec3() * sign).to_array();
    let in_world =
        m.y_axis.cross(m.z_axis) * x + m.z_axis.cross(m.x_axis) * y + m.x_axis.cross(m.y_axis) * z;
    let [a, b, c] = vertices.map(|v| scene.world_position(hit.object, v));
    in_world
        .try_normalize()
        .or((b - a).cross(c - a).try_normalize())
        .unwrap_or(DVec3::Y)
}

/// A normal bent by a bump in tangent space: x along growing u, y against growing v. Where the
/// texture coordinates have no direction, it stays as it was.
fn bent(normal: DVec3, scene: &Scene, hit: &Hit, bump: Vec3) -> DVec3 {
    let vertices = scene.triangle_in(hit.object, hit.triangle);
    let [a, b, c] = vertices.map(|v| scene.world_position(hit.object, v));
    let uvs = vertices.map(|v| scene.uvs[v as usize].as_dvec2());
    let (p, q) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    // Solves e1 = p.u U + p.v V and e2 = q.u U + q.v V for the directions U and V.
    let sign = p.perp_dot(q).signum();
    let along_u = ((b - a) * q.y - (c - a) * p.y) * sign;
    let along_v = ((c - a) * p.x - (b - a) * q.x) * sign;
    let Some(tangent) = along_u.reject_from_normalized(normal).try_normalize() else {
        return normal;
    };
    let side = normal.cross(tangent);
    let bitangent = if side.dot(along_v) > 0.0 { -side } else { side };
    let bump = bump.as_dvec3();
    let bent = tangent * bump.x + bitangent * bump.y + normal * bump.z;
    bent.try_normalize().unwrap_or(normal)
}

fn weights(hit: &Hit) -> [f32; 3] {
    let [b, c] = hit.barycentric;
    [1.0 - b - c, b, c]
}

fn mix2(values: [Vec2; 3], weights: [f32; 3]) -> Vec2 {
    values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::soup;
    use farfield_scene::{Filter, Image, Texture, Wrap};
    use glam::DAffine3;
    use proptest::prelude::*;

    /// A triangle across the z axis whose normal texture bends everything along +u.
    fn bumpy() -> Scene {
        let mut scene = soup(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        scene.normals = vec![Vec3::Z; 3];
        // v runs down: the texture stands upright.
        scene.uvs = vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::ZERO];
        scene.images.push(Image {
            name: String::new(),
            width: 1,
            height: 1,
            texels: vec![[128, 255, 128, 255]],
        });
        let wrap = [Wrap::Repeat; 2];
        scene.textures.push(Texture {
            image: 0,
            wrap,
            filter: Filter::Linear,
        });
        scene
    }

    fn normal_at(scene: &Scene, eye: DVec3) -> Vec3 {
        let camera = Camera::looking_at(eye, DVec3::new(0.3, 0.3, 0.0), 0.5, 64);
        let hit = Hit {
            object: 0,
            triangle: 0,
            barycentric: [0.3, 0.3],
        };
        surface_at(scene, &Textures::new(scene), &camera, &hit).normal
    }

    #[test]
    fn only_double_sided_surfaces_turn_to_the_viewer() {
        let mut scene = bumpy();
        let (before, behind) = (DVec3::Z * 5.0, DVec3::NEG_Z * 5.0);
        assert_eq!(
            [normal_at(&scene, before), normal_at(&scene, behind)],
            [Vec3::Z; 2]
        );
        scene.materials[0].double_sided = true;
        assert_eq!(
            [normal_at(&scene, before), normal_at(&scene, behind)],
            [Vec3::Z, -Vec3::Z]
        );
    }

    #[test]
    fn green_in_a_normal_texture_points_up() {
        let mut scene = bumpy();
        scene.materials[0].normal_texture = Some(0);
        // 128 of 255 is a hair more than the middle.
        assert!(normal_at(&scene, DVec3::Z * 5.0).abs_diff_eq(Vec3::Y, 0.01));
    }

    proptest! {
        /// Normals stay perpendicular to their surface under any transform, mirrored ones too.
        #[test]
        fn normals_stay_perpendicular(columns in prop::array::uniform9(-2.0..2.0f64)) {
            let mut scene = bumpy();
            scene.objects[0].world_from_mesh = DAffine3::from_mat3(glam::DMat3::from_cols_array(&columns));
            let [a, b, c] = scene.triangle_in(0, 0).map(|v| scene.world_position(0, v));
            let flat = (b - a).cross(c - a);
            prop_assume!(flat.length() > 1e-2);
            let normal = normal_at(&scene, DVec3::new(7.0, 8.0, 9.0)).as_dvec3();
            prop_assert!(normal.abs_diff_eq(flat.normalize(), 1e-5), "{normal} is not {flat}");
        }
    }
}
