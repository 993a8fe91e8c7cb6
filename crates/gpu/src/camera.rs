//! What shaders know of a camera and its light.

use farfield_views::Camera;
use glam::{DAffine3, DVec3, DVec4, Vec3, Vec4};

/// A sun and a sky without shadows or reflections.
///
/// White surfaces get `sun` times the cosine of the angle to the sun, and between `ground` and
/// `sky` in proportion to how far they face up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lighting {
    /// Towards the sun, of length 1.
    pub to_sun: Vec3,
    /// Linear RGB that a white surface facing the sun gets from it.
    pub sun: Vec3,
    /// Linear RGB that a white surface facing up gets from the sky.
    pub sky: Vec3,
    /// Linear RGB that a white surface facing down gets from the ground.
    pub ground: Vec3,
}

/// A picture's own constants.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct View {
    pub(crate) to_sun: Vec3A,
    pub(crate) sun: Vec3A,
    pub(crate) sky: Vec3A,
    pub(crate) ground: [f32; 3],
    /// Depth from which on something is seen.
    pub(crate) near: f32,
}

/// A vector as uniforms have it before another one.
type Vec3A = [f32; 4];

impl View {
    pub(crate) fn new(near: f64, light: Option<&Lighting>) -> Self {
        let dark = Self {
            near: near as f32,
            ..Self::default()
        };
        light.map_or(dark, |light| Self {
            to_sun: light.to_sun.extend(0.0).into(),
            sun: light.sun.extend(0.0).into(),
            sky: light.sky.extend(0.0).into(),
            ground: light.ground.into(),
            ..dark
        })
    }
}

/// Where an instance stands before a camera: takes a point of its mesh, relative to the mesh's
/// middle, to clip space.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Placement {
    /// To the right.
    pub(crate) x: [f32; 4],
    /// Up.
    pub(crate) y: [f32; 4],
    /// Along the view axis, in metres.
    pub(crate) depth: [f32; 4],
}

/// The placement of what has its middle at `middle` in its mesh's space.
///
/// All is added up in f64, so that scenes may lie far from the origin: only what is left, relative
/// to the eye, is rounded.
pub(crate) fn placement(camera: &Camera, world_from_mesh: &DAffine3, middle: DVec3) -> Placement {
    let view_from_world = camera.pose.view_from_world();
    let linear = view_from_world * world_from_mesh.matrix3;
    let middle = camera
        .pose
        .point_in_view(world_from_mesh.transform_point3(middle));
    let row = |axis: usize| linear.row(axis).extend(middle[axis]);
    let (x, y, depth) = (row(0), row(1), row(2));
    let (size, twice_center) = (camera.extent.size(), camera.extent.min + camera.extent.max);
    let single = |row: DVec4| Vec4::to_array(&row.as_vec4());
    Placement {
        x: single((x * 2.0 - depth * twice_center.x) / size.x),
        // Rows run down, clip space's y up.
        y: single((depth * twice_center.y - y * 2.0) / size.y),
        depth: single(depth),
    }
}

/// Depth from which on a camera sees: a millionth of the distance to the farthest corner of
/// bounds. Reversed depth in floating point is as precise for any; with a smaller one, clipped
/// triangles would lose their last digits in clip space.
pub(crate) fn near(camera: &Camera, bounds: Option<[DVec3; 2]>) -> f64 {
    let farthest = bounds.map_or(1.0, |[min, max]| {
        let eye = camera.pose.eye;
        (eye - min).abs().max((eye - max).abs()).length()
    });
    farthest.max(f64::from(f32::MIN_POSITIVE)) / f64::from(1 << 20)
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_views::{Extent, Pose};
    use glam::{DQuat, DVec2};
    use proptest::prelude::*;

    proptest! {
        /// A point lands on the pixel where the camera has it, also a million metres from the
        /// origin, in frusta that are not centred.
        #[test]
        fn points_land_on_their_pixels(
            at in prop::array::uniform3(-1.0..1.0f64),
            turn in prop::array::uniform3(-3.0..3.0f64),
            far in prop_oneof![Just(0.0), Just(1e6)],
            bounds in prop::array::uniform4(0.1..1.5f64),
        ) {
            let min = DVec2::new(bounds[0] - 0.8, bounds[1] - 0.8);
            let eye = DVec3::new(far, -far, 2.0);
            let camera = Camera {
                pose: Pose::looking_along(eye, DVec3::new(0.1, -0.2, -1.0)),
                extent: Extent { min, max: min + DVec2::new(bounds[2], bounds[3]) },
                width: 512,
                height: 300,
            };
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2]);
            let object = DAffine3::from_rotation_translation(turn, eye - DVec3::new(0.5, 1.0, 9.0));
            let (middle, point) = (DVec3::new(3.0, 2.0, 1.0), DVec3::from(at));
            let placed = placement(&camera, &object, middle);
            let local = (point - middle).as_vec3().extend(1.0);
            let dot = |row: [f32; 4]| f64::from(Vec4::from(row).dot(local));
            let depth = dot(placed.depth);
            let ndc = DVec2::new(dot(placed.x), -dot(placed.y)) / depth;
            let pixel = (ndc + 1.0) / 2.0 * DVec2::new(512.0, 300.0);
            let in_view = camera.pose.point_in_view(object.transform_point3(point));
            // Eight roundings to 2^-24 of sums of some hundred, over depths of at least 2, times
            // half the picture's size: below 0.01 pixels.
            prop_assert!(camera.pixel_from_view(in_view).distance(pixel) < 0.02);
            prop_assert!((depth - in_view.z).abs() < 1e-5);
        }
    }
}
