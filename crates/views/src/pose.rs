//! Where a viewer stands and how it is turned.

use glam::{DMat3, DVec3};

/// A viewer's position and orientation in the world.
///
/// View space is right-handed with x to the right, y down and z forwards, so lateral
/// coordinates grow in the same directions as columns and rows, and z is the depth.
///
/// Invariant: `right`, `down` and `forward` are orthonormal and right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position in the world, in metres.
    pub eye: DVec3,
    /// View space's x axis in the world, of length 1.
    pub right: DVec3,
    /// View space's y axis in the world, of length 1.
    pub down: DVec3,
    /// View space's z axis in the world, of length 1: the view axis.
    pub forward: DVec3,
}

impl Pose {
    /// A viewer at `eye` looking along `axis`, turned so that the world's +Y is up, or, when
    /// looking straight up or down, so that the world's -Z is up.
    ///
    /// # Panics
    ///
    /// When `axis` has no direction (zero, infinite or NaN).
    pub fn looking_along(eye: DVec3, axis: DVec3) -> Self {
        let forward = axis
            .try_normalize()
            .unwrap_or_else(|| panic!("{axis} has no direction to look along"));
        // Within 1e-6 of the vertical the cross product with +Y would be mostly rounding.
        let up = if forward.cross(DVec3::Y).length_squared() > 1e-12 {
            DVec3::Y
        } else {
            DVec3::NEG_Z
        };
        let right = forward.cross(up).normalize();
        Self {
            eye,
            right,
            down: forward.cross(right),
            forward,
        }
    }

    /// The rotation that takes directions in the world to view space.
    #[inline]
    pub fn view_from_world(&self) -> DMat3 {
        DMat3::from_cols(self.right, self.down, self.forward).transpose()
    }

    /// A point of the world in view space.
    #[inline]
    pub fn point_in_view(&self, point: DVec3) -> DVec3 {
        self.view_from_world() * (point - self.eye)
    }

    /// A point of view space in the world.
    pub fn point_in_world(&self, point: DVec3) -> DVec3 {
        self.eye + self.right * point.x + self.down * point.y + self.forward * point.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn right_is_right_and_down_is_down() {
        let pose = Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z);
        assert_eq!(pose.right, DVec3::X);
        assert_eq!(pose.down, DVec3::NEG_Y);
    }

    proptest! {
        /// Whatever the axis, straight up and down included, the axes are orthonormal and
        /// right-handed, and a point taken to view space and back is where it was.
        #[test]
        fn axes_are_orthonormal(
            axis in prop_oneof![
                prop::array::uniform3(-1.0..1.0f64),
                Just([0.0, 1.0, 0.0]),
                Just([1e-9, -1.0, 0.0]),
            ],
            point in prop::array::uniform3(-1e3..1e3f64),
        ) {
            let (axis, point) = (DVec3::from(axis), DVec3::from(point));
            prop_assume!(axis.length() > 1e-3);
            let pose = Pose::looking_along(DVec3::new(1.0, 2.0, 3.0), axis);
            let m = pose.view_from_world();
            // Each entry is a sum of three products of numbers of at most 1.
            prop_assert!((m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14));
            prop_assert!((m.determinant() - 1.0).abs() < 1e-14);
            prop_assert!(pose.point_in_world(pose.point_in_view(point)).abs_diff_eq(point, 1e-11));
        }
    }
}
