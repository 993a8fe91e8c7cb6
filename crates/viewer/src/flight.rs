//! Where the viewer is and looks: a plain state, and what changes it.

use crate::space;
use farfield_bundle::ViewSpace;
use farfield_views::{Camera, Extent, Pose};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use xtask::Sight;

/// Where the viewer is and looks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Flight {
    /// In the world, in metres.
    pub(crate) eye: DVec3,
    /// Of length 1.
    forward: DVec3,
    /// A point that is looked at wherever the viewer flies, as the promise of a bundle may have it.
    pub(crate) target: Option<DVec3>,
    /// The numbered viewpoint where the viewer is, until moved.
    pub(crate) at: Option<Sight>,
    /// Whether the view space may be left.
    pub(crate) leaves: bool,
}

impl Flight {
    /// At a viewpoint, looking from there as `verify` does.
    pub(crate) fn at(sight: Sight, aims_anywhere: bool) -> Self {
        let mut flight = Self {
            eye: sight.eye,
            forward: DVec3::NEG_Z,
            target: None,
            at: None,
            leaves: false,
        };
        flight.go_to(sight, aims_anywhere);
        flight
    }

    /// Goes to a viewpoint and looks from there as `verify` does.
    pub(crate) fn go_to(&mut self, sight: Sight, aims_anywhere: bool) {
        self.eye = sight.eye;
        self.forward = (sight.target - sight.eye)
            .try_normalize()
            .unwrap_or(self.forward);
        self.target = (!aims_anywhere).then_some(sight.target);
        self.at = Some(sight);
    }

    /// Where the viewer is and how turned.
    pub(crate) fn pose(&self) -> Pose {
        let towards = self.target.map(|target| target - self.eye);
        let along = towards.and_then(DVec3::try_normalize);
        Pose::looking_along(self.eye, along.unwrap_or(self.forward))
    }

    /// The viewer's camera.
    ///
    /// * `fov` - full angle along the longer side, in radians
    /// * `size` - of the picture, in pixels
    pub(crate) fn camera(&self, fov: f64, [width, height]: [u32; 2]) -> Camera {
        Camera {
            pose: self.pose(),
            extent: Extent::symmetric(fov, width, height),
            width,
            height,
        }
    }

    /// Flies.
    ///
    /// * `by` - to the right, up and forward, in metres
    pub(crate) fn fly(&mut self, space: &ViewSpace, by: DVec3) {
        let pose = self.pose();
        let eye = self.eye + pose.right * by.x - pose.down * by.y + pose.forward * by.z;
        self.eye = match self.leaves {
            true => eye,
            false => space::inside(space, eye),
        };
        self.at = None;
    }

    /// Turns by angles in radians, to the right and up; looks at nothing fixed any more.
    pub(crate) fn turn(&mut self, right: f64, up: f64) {
        const STEEPEST: f64 = FRAC_PI_2 - 1e-3;
        let forward = self.pose().forward;
        let heading = forward.x.atan2(-forward.z) + right;
        let pitch = (forward.y.clamp(-1.0, 1.0).asin() + up).clamp(-STEEPEST, STEEPEST);
        let level = pitch.cos();
        self.forward = DVec3::new(heading.sin() * level, pitch.sin(), -heading.cos() * level);
        self.target = None;
        self.at = None;
    }

    /// Looks at a point from now on.
    pub(crate) fn look_at(&mut self, target: DVec3) {
        if self.target != Some(target) {
            // Where the viewer is in that point, as before.
            self.forward = self.pose().forward;
            self.target = Some(target);
            self.at = None;
        }
    }

    /// Leaves the view space at will from now on, or goes back into it.
    pub(crate) fn leave(&mut self, space: &ViewSpace, leaves: bool) {
        self.leaves = leaves;
        if !leaves && !space::contains(space, self.eye) {
            self.eye = space::inside(space, self.eye);
            self.at = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::tests::{is_in, spaces};
    use proptest::prelude::*;

    fn sight(eye: DVec3, target: DVec3) -> Sight {
        Sight {
            view: 0,
            impostor: 0,
            eye,
            target,
        }
    }

    proptest! {
        /// However the viewer flies and turns, the view space is left only at will, and returned to.
        #[test]
        fn flights_stay_in_the_view_space(
            space in spaces(),
            aims_anywhere: bool,
            moves in prop::collection::vec(
                (prop::array::uniform3(-40.0..40.0f64), -3.0..3.0f64, -3.0..3.0f64), 1..8),
        ) {
            let eye = space::inside(&space, DVec3::ZERO);
            let mut flight = Flight::at(sight(eye, eye + DVec3::new(1.0, 2.0, -3.0)), aims_anywhere);
            let fly = |flight: &mut Flight, stays: bool| {
                for (by, right, up) in &moves {
                    flight.fly(&space, DVec3::from(*by));
                    assert!(!stays || is_in(&space, flight.eye), "{}", flight.eye);
                    flight.turn(*right, *up);
                }
            };
            fly(&mut flight, true);
            flight.leave(&space, true);
            fly(&mut flight, false);
            flight.leave(&space, false);
            prop_assert!(is_in(&space, flight.eye));
            fly(&mut flight, true);
        }

        /// A turn and its opposite lead back, but where the view is steep.
        #[test]
        fn turns_can_be_undone(right in -3.0..3.0f64, up in -0.7..0.7f64) {
            let mut flight = Flight::at(sight(DVec3::ZERO, DVec3::new(1.0, 0.5, 0.3)), true);
            let before = flight.pose();
            flight.turn(right, up);
            flight.turn(-right, -up);
            prop_assert!(flight.pose().forward.abs_diff_eq(before.forward, 1e-12));
        }
    }

    /// The camera at a viewpoint is that of `verify`.
    #[test]
    fn viewpoints_are_looked_from_as_verify_does() {
        let (eye, target) = (DVec3::new(1.0, 2.0, 9.0), DVec3::new(0.1, 0.2, 0.3));
        let flight = Flight::at(sight(eye, target), false);
        assert_eq!(
            flight.camera(0.8, [64, 64]),
            Camera::looking_at(eye, target, 0.8, 64)
        );
    }

    #[test]
    fn a_target_is_kept_in_sight() {
        let space = ViewSpace::Shell {
            center: DVec3::ZERO,
            near: 1.0,
            far: 9.0,
        };
        let mut flight = Flight::at(sight(DVec3::Z * 5.0, DVec3::ZERO), false);
        flight.fly(&space, DVec3::new(2.0, 1.0, 0.0));
        assert!(flight.pose().point_in_view(DVec3::ZERO).truncate().length() < 1e-9);
        assert_eq!(flight.at, None);
        flight.turn(0.3, 0.0);
        assert_eq!(flight.target, None);
        flight.look_at(DVec3::X);
        assert!(flight.pose().point_in_view(DVec3::X).truncate().length() < 1e-9);
    }
}
