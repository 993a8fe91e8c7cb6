//! View cells: where the viewer may be.

use crate::{Pose, low_discrepancy_point};
use glam::{DVec3, DVec4};

/// The convex region of viewpoints that an impostor is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewCell {
    /// A box with sides along the world's axes.
    Box {
        /// Centre, in metres.
        center: DVec3,
        /// Full lengths of the sides, in metres; zero is allowed, a point is a cell too.
        size: DVec3,
    },
    /// A four-sided pyramid without its top: a shaft of view (Jeschke, 2005, section 1.3).
    Shaft {
        /// The tip, in the centre of what is represented, in metres.
        apex: DVec3,
        /// From the apex towards the viewers; any length but zero.
        axis: DVec3,
        /// Between the axis and each of the four sides, in radians, below pi / 2.
        half_angle: f64,
        /// Along the axis from the apex to the border nearest to it, in metres.
        near: f64,
        /// Along the axis from the apex to the farthest border, in metres; may be infinite.
        far: f64,
    },
}

impl ViewCell {
    /// The eight corners in homogeneous coordinates of the world: (x, y, z, 1) is a point,
    /// (x, y, z, 0) the direction of a corner at infinity.
    ///
    /// Bit 0 of a corner's index tells its side in x, bit 1 in y, bit 2 in z; of a shaft, x and y
    /// are those of a viewer who looks at the apex, and z goes from near to far.
    pub fn corners(&self) -> [DVec4; 8] {
        std::array::from_fn(|i| {
            let side = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
            match *self {
                Self::Shaft { far, .. } if far.is_infinite() && side.z == 1.0 => {
                    self.shaft_ray(side).extend(0.0)
                }
                _ => self.point(side).extend(1.0),
            }
        })
    }

    /// The point of the cell at fractions of [0, 1] of its sides, in the world.
    ///
    /// The fractions order the cell as [`corners`](Self::corners) does. In a shaft the reciprocal
    /// distance from the apex is linear in z: the picture changes with it, not with the distance.
    ///
    /// # Panics
    ///
    /// When the point lies at infinity.
    pub fn point(&self, fractions: DVec3) -> DVec3 {
        match *self {
            Self::Box { center, size } => center + (fractions - 0.5) * size,
            Self::Shaft {
                apex, near, far, ..
            } => {
                let distance = 1.0 / ((1.0 - fractions.z) / near + fractions.z / far);
                assert!(
                    distance.is_finite(),
                    "the far border of {self:?} is at infinity"
                );
                apex + self.shaft_ray(fractions) * distance
            }
        }
    }

    /// The centre in the sense of [`point`](Self::point), in the world.
    pub fn center(&self) -> DVec3 {
        self.point(DVec3::splat(0.5))
    }

    /// Viewpoint `index` of the cell, in the world: 0 to 7 the corners, then the centres of the
    /// twelve edges and of the six faces, from 26 on a low-discrepancy sequence that fills the
    /// inside and depends on `seed`.
    ///
    /// # Panics
    ///
    /// When a part of the cell lies at infinity.
    pub fn viewpoint(&self, index: u64, seed: u64) -> DVec3 {
        let lattice = lattice_viewpoints();
        match lattice.get(index as usize) {
            Some(fractions) => self.point(*fractions),
            None => self.point(low_discrepancy_point(index - lattice.len() as u64, seed)),
        }
    }

    /// Viewpoint `index` of a low-discrepancy sequence that is stretched over the borders of the cell, in
    /// the world: along each axis a third of the viewpoints is at one end or the other, so that seven of
    /// ten are on faces, edges and corners. Another one for each `seed`.
    ///
    /// Whatever is seen through a cell is seen from its border, and what is seen from corners and edges
    /// only is seldom seen by viewpoints that fill the inside.
    ///
    /// # Panics
    ///
    /// When a part of the cell lies at infinity.
    pub fn viewpoint_to_border(&self, index: u64, seed: u64) -> DVec3 {
        self.point_to_border(low_discrepancy_point(index, seed))
    }

    /// The point at the given fractions of the unit cube, stretched over the borders of the cell as
    /// [`viewpoint_to_border`](Self::viewpoint_to_border) has it, in the world.
    ///
    /// # Panics
    ///
    /// When a part of the cell lies at infinity.
    pub fn point_to_border(&self, fractions: DVec3) -> DVec3 {
        let stretched = (fractions - 0.5) * 1.5 + 0.5;
        self.point(stretched.clamp(DVec3::ZERO, DVec3::ONE))
    }

    /// Whether a point of the world lies in the cell or within `tolerance` metres of its sides.
    pub fn contains(&self, point: DVec3, tolerance: f64) -> bool {
        match *self {
            Self::Box { center, size } => {
                ((point - center).abs() - size / 2.0).max_element() <= tolerance
            }
            Self::Shaft {
                apex,
                axis,
                half_angle,
                near,
                far,
            } => {
                let local = Pose::looking_along(apex, axis).point_in_view(point);
                let lateral = local.x.abs().max(local.y.abs());
                let beyond = (lateral - local.z * half_angle.tan()) * half_angle.cos();
                beyond.max(near - local.z).max(local.z - far) <= tolerance
            }
        }
    }

    /// From the apex of a shaft through the given fractions of its cross-section, of length 1
    /// along the axis.
    fn shaft_ray(&self, fractions: DVec3) -> DVec3 {
        let Self::Shaft {
            axis, half_angle, ..
        } = *self
        else {
            unreachable!("only shafts have rays");
        };
        // Seen by a viewer, who looks against the axis.
        let viewer = Pose::looking_along(DVec3::ZERO, -axis);
        let lateral = (fractions.truncate() * 2.0 - 1.0) * half_angle.tan();
        viewer.right * lateral.x - viewer.down * lateral.y - viewer.forward
    }
}

/// Corners, edge centres and face centres of the unit cube, in the order of
/// [`ViewCell::viewpoint`].
pub fn lattice_viewpoints() -> Vec<DVec3> {
    let halves = |i: u32| f64::from(i) / 2.0;
    let all: Vec<DVec3> = (0..27)
        .map(|i| DVec3::new(halves(i % 3), halves(i / 3 % 3), halves(i / 9)))
        .collect();
    let centered = |p: &DVec3| p.to_array().iter().filter(|c| **c == 0.5).count();
    (0..3)
        .flat_map(|n| all.iter().copied().filter(move |p| centered(p) == n))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cells() -> impl Strategy<Value = ViewCell> {
        let vector =
            |range: std::ops::Range<f64>| prop::array::uniform3(range).prop_map(DVec3::from);
        prop_oneof![
            (vector(-1e3..1e3), vector(0.0..1e2))
                .prop_map(|(center, size)| ViewCell::Box { center, size }),
            (
                vector(-1e3..1e3),
                vector(0.1..1.0),
                0.01..1.4f64,
                0.1..10.0f64,
                0.0..1e3f64
            )
                .prop_map(|(apex, axis, half_angle, near, depth)| ViewCell::Shaft {
                    apex,
                    axis,
                    half_angle,
                    near,
                    far: near + depth,
                }),
        ]
    }

    #[test]
    fn the_lattice_counts_as_documented() {
        let lattice = lattice_viewpoints();
        let centered: Vec<_> = lattice
            .iter()
            .map(|p| p.to_array().iter().filter(|c| **c == 0.5).count())
            .collect();
        assert_eq!(centered, [vec![0; 8], vec![1; 12], vec![2; 6]].concat());
    }

    #[test]
    fn a_shaft_to_infinity_has_corners_in_directions() {
        let shaft = ViewCell::Shaft {
            apex: DVec3::ZERO,
            axis: DVec3::Z,
            half_angle: 45f64.to_radians(),
            near: 2.0,
            far: f64::INFINITY,
        };
        let corners = shaft.corners();
        assert!(corners[0].abs_diff_eq(DVec4::new(-2.0, -2.0, 2.0, 1.0), 1e-12));
        assert!(corners[7].abs_diff_eq(DVec4::new(1.0, 1.0, 1.0, 0.0), 1e-12));
    }

    proptest! {
        /// Every viewpoint lies in the cell, and the first eight are its corners.
        #[test]
        fn viewpoints_lie_in_the_cell(cell in cells(), seed: u64) {
            let corners = cell.corners();
            for index in 0..200 {
                let point = cell.viewpoint(index, seed);
                // Coordinates of up to 1e4 m, rounded a dozen times to 2^-53 of themselves.
                prop_assert!(cell.contains(point, 1e-10), "{point} is outside of {cell:?}");
                if index < 8 {
                    prop_assert_eq!(point.extend(1.0), corners[index as usize]);
                }
            }
            let outside = corners[7].truncate() + (corners[7] - corners[0]).truncate() + 1e-6;
            prop_assert!(!cell.contains(outside, 1e-10));
        }
    }

    /// Seven of ten viewpoints are on the border of the cell, 1 - (2/3)^3, and all corners are among a
    /// thousand.
    #[test]
    fn borders_have_their_share() {
        let (center, size) = (DVec3::ZERO, DVec3::splat(2.0));
        let cell = ViewCell::Box { center, size };
        let all: Vec<DVec3> = (0..1000).map(|i| cell.viewpoint_to_border(i, 7)).collect();
        assert!(all.iter().all(|p| cell.contains(*p, 0.0)));
        let on_border = all.iter().filter(|p| p.abs().max_element() == 1.0).count();
        assert!(on_border.abs_diff(704) < 20, "{on_border}");
        for corner in cell.corners() {
            assert!(all.contains(&corner.truncate()));
        }
    }
}
