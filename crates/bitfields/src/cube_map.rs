//! All that is seen from a point.

use farfield_views::{Camera, Extent, Pose};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Six cameras that see all around: the faces of a cube map, towards +X, -X, +Y, -Y, +Z and -Z.
///
/// Their images tile the sphere: each direction is in one of them, or in those that meet at an
/// edge.
///
/// * `eye` - where it is seen from, in metres
/// * `resolution` - pixels on either side of each face; the coarsest are those in its middle,
///   2 / `resolution` radians wide
pub fn cube_map(eye: DVec3, resolution: u32) -> [Camera; 6] {
    let towards = |axis: DVec3| Camera {
        pose: Pose::looking_along(eye, axis),
        extent: Extent::symmetric(FRAC_PI_2, resolution, resolution),
        width: resolution,
        height: resolution,
    };
    [
        DVec3::X,
        DVec3::NEG_X,
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
    ]
    .map(towards)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use proptest::prelude::*;

    proptest! {
        /// A direction is seen by one of the cameras, and by others only on edges.
        #[test]
        fn cameras_tile_the_sphere(
            eye in prop::array::uniform3(-9.0..9.0f64),
            direction in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let [eye, direction] = [eye, direction].map(DVec3::from);
            // Beside the edges, which are where two coordinates are as large as each other.
            let mut sizes = direction.abs().to_array();
            sizes.sort_by(f64::total_cmp);
            prop_assume!(sizes[1] < 0.999 * sizes[2]);
            let seen = cube_map(eye, 16).iter().filter(|camera| {
                let point = camera.pose.point_in_view(eye + direction);
                let slope = DVec2::new(point.x, point.y) / point.z;
                let inside = slope.cmpge(camera.extent.min).all()
                    && slope.cmple(camera.extent.max).all();
                point.z > 0.0 && inside
            }).count();
            prop_assert_eq!(seen, 1);
        }
    }
}
