//! What a surface looks like at a point: its material, evaluated.

use crate::Textures;
use crate::geometry::{Drawn, Interpolation, corners_in_view};
use crate::piece::Viewpoint;
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
        self.among(self.corners_in_world(scene))
    }

    /// The point among the corners of its triangle, in any space.
    fn among(&self, [a, b, c]: [DVec3; 3]) -> DVec3 {
        // Not by three weights of f32: their sum is 1 to 7 digits, and coordinates have more.
        let [to_b, to_c] = self.barycentric.map(f64::from);
        a + (b - a) * to_b + (c - a) * to_c
    }

    /// The triangle's normal in the world, of length 1, on the side that it is the front of; zero where
    /// the triangle has no area.
    ///
    /// # Panics
    ///
    /// When the object or the triangle does not exist.
    pub fn normal_in_world(&self, scene: &Scene) -> DVec3 {
        let [a, b, c] = self.corners_in_world(scene);
        (b - a).cross(c - a).normalize_or_zero()
    }

    fn corners_in_world(&self, scene: &Scene) -> [DVec3; 3] {
        let vertices = scene.triangle_in(self.object, self.triangle);
        vertices.map(|vertex| scene.world_position(self.object, vertex))
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
    let triangle = TriangleInView::new(scene, camera, hit);
    surface(scene, textures, hit, &triangle, triangle.footprint(camera))
}

/// Evaluates the material at a hit for viewers all over a cell, textures filtered for a pixel of the
/// camera's as whoever faces the surface most squarely would have it: what the camera sees edge-on
/// is shown to others, who see its details.
///
/// * `cell` - the corners of the cell, in the camera's view
///
/// # Panics
///
/// When the hit's object or triangle does not exist.
pub(crate) fn surface_from_cell(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    cell: &[Viewpoint],
    hit: &Hit,
) -> Surface {
    let triangle = TriangleInView::new(scene, camera, hit);
    let sights = cell.iter().map(|corner| corner.sight_of(triangle.point));
    let footprint = triangle.squarest_footprint(camera, sights);
    surface(scene, textures, hit, &triangle, footprint)
}

/// Evaluates the material at a hit, textures filtered for a growth of uv to two sides.
fn surface(
    scene: &Scene,
    textures: &Textures<'_>,
    hit: &Hit,
    triangle: &TriangleInView,
    footprint: [Vec2; 2],
) -> Surface {
    let material = &scene.materials[scene.triangle_materials[hit.triangle as usize] as usize];
    let vertices = scene
        .triangle_in(hit.object, hit.triangle)
        .map(|v| v as usize);
    let weights = weights(hit);
    let uv = mix2(triangle.uvs, weights);

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
    if material.double_sided && triangle.normal().dot(triangle.corners[0]) > 0.0 {
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

/// Cosine below which a surface is seen edge-on, and rounding tells from which side.
const EDGE_ON: f64 = 1e-9;

/// The triangle of a hit as a camera sees it.
struct TriangleInView {
    corners: [DVec3; 3],
    uvs: [Vec2; 3],
    /// The hit.
    point: DVec3,
    double_sided: bool,
}

impl TriangleInView {
    fn new(scene: &Scene, camera: &Camera, hit: &Hit) -> Self {
        let &Hit {
            object, triangle, ..
        } = hit;
        let corners = corners_in_view(scene, &camera.pose, Drawn { object, triangle });
        let vertices = scene.triangle_in(object, triangle);
        let material = scene.triangle_materials[triangle as usize];
        Self {
            corners,
            uvs: vertices.map(|v| scene.uvs[v as usize]),
            point: hit.among(corners),
            double_sided: scene.materials[material as usize].double_sided,
        }
    }

    /// Towards those who see the front, as long as the triangle is large.
    fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// Growth of uv per column and per row of the camera's picture; zero where the triangle is seen
    /// edge-on.
    fn footprint(&self, camera: &Camera) -> [Vec2; 2] {
        match Interpolation::new(camera, self.corners) {
            Some(interpolation) if self.point.z > 0.0 => interpolation
                .derivatives(camera.pixel_from_view(self.point))
                .map(|growth| mix2(self.uvs, growth.as_vec3().to_array())),
            _ => [Vec2::ZERO; 2],
        }
    }

    /// Growth of uv over the width and over the height of a pixel at the hit, seen from where in a
    /// cell it is seen most squarely; as the camera has it where nobody sees more than its edge.
    ///
    /// Tried are the camera, the corners, and halfway between the best and these, three times: that is
    /// within a quarter of a level of detail of the best there is.
    ///
    /// * `corners` - lines of sight from the corners of the cell, of any length
    fn squarest_footprint(
        &self,
        camera: &Camera,
        corners: impl Iterator<Item = DVec3> + Clone,
    ) -> [Vec2; 2] {
        let normal = self.normal();
        let size = camera.pixel_size() * self.point.z;
        let growth = |sight: DVec3| {
            let right = DVec3::X.reject_from_normalized(sight).normalize_or_zero();
            self.grown([right * size.x, sight.cross(right) * size.y], sight)
        };
        // By how fine it is, not by the angle: of sights that are alike either will do.
        let coarseness = |sight: DVec3| {
            let facing = match self.double_sided {
                true => normal.dot(sight).abs(),
                false => -normal.dot(sight),
            };
            let is_seen = facing > EDGE_ON * normal.length();
            let [a, b] = growth(sight).map(Vec2::length);
            match is_seen && a.max(b) > 0.0 {
                true => a.max(b),
                false => f32::INFINITY,
            }
        };
        let finer = |a: DVec3, b: DVec3| match coarseness(b) < coarseness(a) {
            true => b,
            false => a,
        };
        let sights = corners.chain([self.point]);
        let sights = sights.filter_map(DVec3::try_normalize);
        let best = sights.clone().reduce(finer);
        let Some(best) = best.filter(|best| coarseness(*best).is_finite()) else {
            return self.footprint(camera);
        };
        let halfway = |best: DVec3| {
            let sights = sights.clone();
            sights.filter_map(move |other| (best + other).try_normalize())
        };
        growth((0..3).fold(best, |best, _| halfway(best).fold(best, finer)))
    }

    /// Growth of uv along two offsets of a line of sight; zero where it runs along the triangle.
    fn grown(&self, offsets: [DVec3; 2], sight: DVec3) -> [Vec2; 2] {
        let [a, b, c] = self.corners;
        // Solves offset = p (b - a) + q (c - a) + r sight.
        let (along_b, along_c) = ((c - a).cross(sight), sight.cross(b - a));
        let scale = self.normal().dot(sight).recip();
        if !scale.is_finite() {
            return [Vec2::ZERO; 2];
        }
        let [u, v, w] = self.uvs;
        offsets.map(|offset| {
            let (p, q) = (offset.dot(along_b) * scale, offset.dot(along_c) * scale);
            (v - u) * p as f32 + (w - u) * q as f32
        })
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
    let [a, b, c] = hit.corners_in_world(scene);
    in_world
        .try_normalize()
        .or((b - a).cross(c - a).try_normalize())
        .unwrap_or(DVec3::Y)
}

/// A normal bent by a bump in tangent space: x along growing u, y against growing v. Where the
/// texture coordinates have no direction, it stays as it was.
fn bent(normal: DVec3, scene: &Scene, hit: &Hit, bump: Vec3) -> DVec3 {
    let vertices = scene.triangle_in(hit.object, hit.triangle);
    let [a, b, c] = hit.corners_in_world(scene);
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
    use crate::{Foliage, Lighting, record, sample_colors};
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

    proptest! {
        /// However far the scene is from the origin, a point on it is where it is: coordinates of
        /// 10^7 m are rounded to 10^-9 m.
        #[test]
        fn points_are_where_they_are_far_from_the_origin(
            barycentric in [0.0..0.5f32, 0.0..0.5f32],
            by in prop::array::uniform3(-1e7..1e7f64),
        ) {
            let mut scene = soup(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
            let hit = Hit { object: 0, triangle: 0, barycentric };
            let near = hit.point_in_world(&scene);
            let by = DVec3::from(by);
            scene.objects[0].world_from_mesh = DAffine3::from_translation(by);
            let far = hit.point_in_world(&scene);
            prop_assert!((far - by).abs_diff_eq(near, 1e-8), "{} is not {near}", far - by);
        }
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

    /// A wall at `x = 0.5` from 10 to 14 m before the viewer, who sees it almost edge-on, with 16
    /// black and white stripes across.
    fn striped_wall() -> Scene {
        let (near, far) = (-10.0, -14.0);
        let corners =
            [[near, -1.0], [near, 1.0], [far, 1.0], [far, -1.0]].map(|[z, y]| [0.5, y, z]);
        let mut scene = soup(&[0, 1, 2, 0, 2, 3].map(|i| corners[i]));
        scene.uvs = [0.0, 0.0, 1.0, 0.0, 1.0, 1.0]
            .map(|u| Vec2::new(u, 0.5))
            .into();
        scene.images.push(Image {
            name: String::new(),
            width: 64,
            height: 64,
            texels: (0..64 * 64)
                .map(|i| [[0, 0, 0, 255], [255; 4]][i / 4 % 2])
                .collect(),
        });
        scene.textures.push(Texture {
            image: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Mipmapped,
        });
        scene.materials[0].base_color_texture = Some(0);
        scene.materials[0].double_sided = true;
        scene.materials[0].unlit = true;
        scene
    }

    /// What is recorded edge-on is shown to others of the cell, who see its details.
    #[test]
    fn what_the_camera_sees_edge_on_is_recorded_as_others_see_it() {
        let scene = striped_wall();
        let textures = Textures::new(&scene);
        let camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, 0.5, 64);
        let contrast = |left: f64| {
            let cell: Vec<_> = (0..8)
                .map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from))
                .map(|[x, y, z]| DVec3::new(x * left, y - 0.5, z).extend(1.0))
                .collect();
            let borders: Vec<f64> = (0..=40).map(|i| 10.0 + 0.1 * f64::from(i)).collect();
            let recording = record(&scene, &textures, &camera, &borders, &cell, Foliage::Any);
            let light = Lighting::default();
            let colors = sample_colors(
                &scene,
                &textures,
                &camera,
                &cell,
                &recording.samples,
                &light,
            );
            let values = || colors.iter().map(|color| color[0]);
            values().max().unwrap() - values().min().unwrap()
        };
        // In linear light half of white is 188 of 255.
        assert!(contrast(0.0) < 40, "{}", contrast(0.0));
        assert!(contrast(-10.0) > 200, "{}", contrast(-10.0));
    }

    proptest! {
        /// A texel on a surface is as long as who sees it most squarely in the cell has it, to within
        /// a quarter of a level of detail: two offsets at right angles across a line of sight that
        /// meets the surface at a sine of s grow to sqrt((1 + 1 / s^2) / 2) times their length at
        /// least, the longer of them, and 1 / s times at most.
        #[test]
        fn texels_are_as_fine_as_the_cell_sees_them(
            turn in prop::array::uniform3(-3.0..3.0f64),
            size in prop::array::uniform3(0.1..20.0f64),
            inside in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 100),
        ) {
            let [x, y, z] = turn;
            let turned = glam::DMat3::from_euler(glam::EulerRot::XYZ, x, y, z);
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| DVec3::new(1.0, 2.0, 28.0) + turned * p);
            let triangle = TriangleInView {
                corners,
                uvs: [Vec2::ZERO, Vec2::X, Vec2::Y],
                point: corners[0],
                double_sided: false,
            };
            let sight = |fractions: [f64; 3]| triangle.point - DVec3::from(fractions) * DVec3::from(size);
            let corners = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|bit| f64::from(bit * 2 - 1)));
            let corners: Vec<DVec3> = corners.map(sight).collect();
            let sine = |sight: &DVec3| -triangle.normal().dot(sight.normalize());
            let best = |sights: &[DVec3]| sights.iter().map(sine).fold(-1.0, f64::max);
            prop_assume!(best(&corners) > 0.01);
            let found = best(&inside.into_iter().map(sight).collect::<Vec<_>>()).max(best(&corners));
            let widest = corners.iter().flat_map(|a| corners.iter().map(|b| a.angle_between(*b)));
            // A sine grows by no more than the angle.
            let most = (best(&corners) + widest.fold(0.0, f64::max)).min(1.0);

            let camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 100);
            let footprint = triangle.squarest_footprint(&camera, corners.into_iter());
            let longer = f64::from(footprint[0].length().max(footprint[1].length()));
            let length = longer / (camera.pixel_size().x * triangle.point.z);
            // Seven digits of f32, some of which cancel.
            let doubt = 1.0 + 1e-4;
            prop_assert!(length <= 2f64.powf(0.25) / found * doubt, "{length}, but a sine of {found}");
            let least = ((1.0 + most.powi(-2)) / 2.0).sqrt();
            prop_assert!(length * doubt >= least, "{length}, but at most a sine of {most}");
        }

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
