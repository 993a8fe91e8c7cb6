//! One-texel spacing: how far apart two neighbouring layers may be, and how far they are.

use farfield_views::Extent;
use glam::DVec4;

/// Distance from the layer at `depth` to the next one, the largest at which no texel uncovers
/// more than the texel behind it from anywhere in the view cell.
///
/// With the reference viewpoint at the origin, a corner v of the cell and a texel edge at the
/// lateral position x, the line from the origin through that edge passes v at the lateral
/// distance b = |v.x - x v.z / depth|. Similar triangles give c = p (depth - v.z) / (b - p), p the
/// texel's width, `movement` times `depth`. For a gap that opens to the right (v lies to the right
/// of that line) x is the texel's left edge, for one to the left its right edge. What is bounded is
/// thus the movement of the texel's other edge, the one beside the gap.
///
/// That a layer at distance c uncovers at most p is, for each of the two directions, linear in v
/// and linear in x, so the corners of the cell and the outermost texels suffice; both axes are
/// independent. A ray from the cell that passes through the extent in both layers sees them
/// displaced by at most `movement`, measured in slopes as seen from the reference viewpoint. One
/// that enters or leaves the extent in between may see a trifle more; to bound that too, widen the
/// extent by a texel on every side, as [`stack`](crate::stack()) does.
///
/// Generalises equations 3.2 to 3.5 of S. Jeschke, Accelerating the Rendering Process Using
/// Impostors, 2005, to extents off the axis and any convex cell.
///
/// * `depth` - from the reference viewpoint, positive, farther than all of the cell
/// * `extent` - slopes that bound what is recorded, at least `movement` wide
/// * `movement` - largest movement of a texel over the next layer, as a slope: a texel's side per
///   unit of depth, or a share of it
/// * `corners` - of the cell, in view space of the reference viewpoint; (x, y, z, 0) is a
///   direction towards a corner at infinity
///
/// Returns infinity where one layer holds everything behind.
///
/// # Panics
///
/// When `corners` is empty, `depth` is not positive or does not lie before all of them, or
/// `movement` is not positive.
pub fn next_layer(depth: f64, extent: &Extent, movement: f64, corners: &[DVec4]) -> f64 {
    assert!(movement > 0.0, "a movement of {movement} is not positive");
    let mut nearest = f64::INFINITY;
    for line in lines_of_sight(depth, extent, corners) {
        // No limit where lines of sight past a texel and the one behind it diverge.
        let excess = line.offset - movement * line.spread;
        if excess > 0.0 {
            nearest = nearest.min(movement * depth * line.distance / excess);
        }
    }
    nearest
}

/// How far the layers at `depth` and `next` are displaced against each other, at most, as seen from
/// the view cell by a ray that passes through the extent in both: the least `movement` for which
/// [`next_layer`] allows their distance.
///
/// Arguments and result are measured as there. A stack whose displacement is at most a texel in
/// an extent widened by a texel shows none above it to any ray that passes through its own
/// extent in either layer: slopes at which a ray meets one layer grow with those at which it
/// meets the other, so a ray that meets one inside and the other beyond the wider extent would
/// cross one at its border.
///
/// Returns 0 where no ray sees a displacement, as where the cell is the reference viewpoint.
///
/// # Panics
///
/// When `corners` is empty, or `depth` and `next` are not positive, in order and before all of
/// them.
pub fn displacement(depth: f64, next: f64, extent: &Extent, corners: &[DVec4]) -> f64 {
    assert!(
        depth <= next,
        "a layer at {next} is not behind one at {depth}"
    );
    let gap = next - depth;
    lines_of_sight(depth, extent, corners)
        .map(|line| gap * line.offset / (depth * line.distance + gap * line.spread))
        .fold(0.0, f64::max)
}

/// A line of sight of a corner of the cell that runs along a border of the extent in one of two
/// layers and inside of it in the other.
///
/// With a the depth of the nearer layer, c the distance between the layers, and m the movement,
/// (a `distance` + c `spread`) m = c `offset`.
struct LineOfSight {
    /// Lateral distance of the corner from the plane through the reference viewpoint and the
    /// border, positive on the side that makes the line run inwards.
    offset: f64,
    /// Of the nearer layer before the corner, along the axis.
    distance: f64,
    /// By how much the offset shrinks per unit of movement.
    spread: f64,
}

/// The lines of sight among which that of the greatest movement is, whatever the farther layer.
fn lines_of_sight(
    depth: f64,
    extent: &Extent,
    corners: &[DVec4],
) -> impl Iterator<Item = LineOfSight> {
    assert!(!corners.is_empty(), "a view cell has corners");
    assert!(
        depth > 0.0,
        "a layer at depth {depth} is not before the viewpoint"
    );
    let (min, max) = (extent.min, extent.max);
    corners.iter().flat_map(move |v| {
        let distance = depth * v.w - v.z;
        assert!(
            distance > 0.0,
            "the layer at {depth} is not before the corner {v}"
        );
        [0, 1].into_iter().flat_map(move |axis| {
            let from_min = v[axis] - min[axis] * v.z;
            let from_max = v[axis] - max[axis] * v.z;
            // A line that meets the farther layer at the border moves by c b / (a (D + c)), one
            // that meets the nearer layer there by c b / ((a + c) D); from the right it runs to
            // the left, and so inwards to the border of the farther layer if that is the left.
            let (in_farther, in_nearer) = (depth * v.w, distance);
            [
                (from_min, in_farther),
                (from_max, in_nearer),
                (-from_max, in_farther),
                (-from_min, in_nearer),
            ]
            .map(|(offset, spread)| LineOfSight {
                offset,
                distance,
                spread,
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Setup, corner_points, setups, slope_behind, viewpoint, weights};
    use glam::DVec2;
    use proptest::prelude::*;

    /// The symmetric case of the paper: an object of width w at the distance t0 from a cell of
    /// width n and depth m, recorded with `res` texels from s behind the cell's near border. Two
    /// dimensions: nothing in y.
    #[derive(Clone, Debug)]
    struct Symmetric {
        n: f64,
        m: f64,
        s: f64,
        w: f64,
        t0: f64,
        res: f64,
        t: f64,
    }

    fn symmetric_cases() -> impl Strategy<Value = Symmetric> {
        let ratios = (
            0.1..10.0f64,
            0.0..5.0f64,
            0.0..1.0f64,
            0.01..20.0f64,
            0.1..20.0f64,
        );
        (ratios, 2.0..2000.0f64, 1.0..3.0f64).prop_map(|((n, m, s, w, t0), res, t)| Symmetric {
            n,
            m,
            s: s * m,
            w,
            t0,
            res,
            t: t * t0,
        })
    }

    impl Symmetric {
        /// `next_layer` for corners (x, z, w), z from the near border towards the object.
        fn next_layer(&self, corners: &[[f64; 3]]) -> f64 {
            let slope = self.w / 2.0 / (self.t0 + self.s);
            let movement = 2.0 * slope / self.res;
            // In y half a texel to both sides of the axis, which no viewpoint leaves.
            let max = DVec2::new(slope, movement / 2.0);
            let corners: Vec<_> = corners
                .iter()
                .map(|[x, z, w]| DVec4::new(*x, 0.0, z + w * self.s, *w))
                .collect();
            next_layer(
                self.t + self.s,
                &Extent { min: -max, max },
                movement,
                &corners,
            )
        }

        /// Compares reciprocals, which are exact where the distances run away to infinity.
        fn check(&self, found: f64, expected: impl IntoIterator<Item = f64>) -> Result<(), String> {
            // A denominator that is not positive means no limit.
            let limits = expected.into_iter().filter(|c| *c > 0.0);
            let expected = limits.fold(f64::INFINITY, f64::min);
            // 1/c is a difference of b/(p a) and 1/a, with up to a dozen roundings each. The
            // summands of b/(p a) are 1/c + 1/a and those of the lateral distance, which may
            // cancel: 2 res (1 + (n + m) (t0 + s) / (w t)) / t covers them.
            let Self {
                n,
                m,
                s,
                w,
                t0,
                res,
                t,
            } = self;
            let magnitude =
                (2.0 * res * (1.0 + (n + m) * (t0 + s) / (w * t)) + 1.0) / t + 1.0 / expected;
            if (1.0 / found - 1.0 / expected).abs() <= 12.0 * f64::EPSILON * magnitude {
                Ok(())
            } else {
                Err(format!("{found} is not {expected}"))
            }
        }

        fn eq_3_2(&self) -> f64 {
            let Self {
                n,
                s,
                w,
                t0,
                res,
                t,
                ..
            } = self;
            t / (res / (2.0 * (t + s)) * (n * (t0 + s) / w + s) - 1.0)
        }

        fn eq_3_3(&self) -> f64 {
            let Self {
                n,
                m,
                s,
                w,
                t0,
                res,
                t,
            } = self;
            let bracket = n * (t0 + s) / w + (m - s) * (1.0 - 2.0 / res);
            (t + m) / (res / (2.0 * (t + s)) * bracket - 1.0)
        }

        fn eq_3_4(&self) -> f64 {
            let Self {
                n,
                s,
                w,
                t0,
                res,
                t,
                ..
            } = self;
            t / (res / (2.0 * (t + s)) * (n * (t0 + s) / w + s * (2.0 / res - 1.0)) - 1.0)
        }

        fn eq_3_5(&self, half_angle: f64) -> f64 {
            let Self {
                s, w, t0, res, t, ..
            } = self;
            (t + s) / (res * (0.5 + (t0 + s) / w * half_angle.tan()) - 1.0)
        }
    }

    proptest! {
        /// In the symmetric case the distance is the least of equations 3.2, 3.3 and 3.4.
        #[test]
        fn a_rectangular_cell_is_as_in_the_paper(case in symmetric_cases()) {
            let (x, m) = (case.n / 2.0, case.m);
            let corners = [[-x, 0.0, 1.0], [x, 0.0, 1.0], [-x, -m, 1.0], [x, -m, 1.0]];
            let found = case.next_layer(&corners);
            case.check(found, [case.eq_3_2(), case.eq_3_3(), case.eq_3_4()])
                .map_err(TestCaseError::fail)?;
        }

        /// In a shaft without end it is the lesser of equations 3.2 and 3.5.
        #[test]
        fn a_shaft_is_as_in_the_paper(case in symmetric_cases(), half_angle in 0.01..1.4f64) {
            let (x, d) = (case.n / 2.0, half_angle.tan());
            let corners = [[-x, 0.0, 1.0], [x, 0.0, 1.0], [-d, -1.0, 0.0], [d, -1.0, 0.0]];
            let found = case.next_layer(&corners);
            case.check(found, [case.eq_3_2(), case.eq_3_5(half_angle)])
                .map_err(TestCaseError::fail)?;
        }

        /// A ray from anywhere in the cell that passes through the extent in both layers sees
        /// them displaced by at most a texel, and any nearer layer too.
        #[test]
        fn no_viewpoint_sees_a_disparity_above_one_texel(
            Setup { corners, extent, depth } in setups(),
            texels in 1.0..600.0f64,
            rays in prop::collection::vec(
                (weights(), prop::array::uniform2(0.0..=1.0f64), 0.0..=1.0f64), 40),
        ) {
            let movement = extent.size().min_element() / texels;
            let distance = next_layer(depth, &extent, movement, &corners).min(1e3 * depth);
            for (weights, at, share) in rays {
                let Some(eye) = viewpoint(&corners, &weights) else { continue };
                let slope = extent.min + extent.size() * DVec2::from(at);
                let behind = slope_behind(eye, slope, depth, depth + distance * share);
                for axis in 0..2 {
                    let inside = (extent.min[axis]..=extent.max[axis]).contains(&behind[axis]);
                    let moved = (behind[axis] - slope[axis]).abs();
                    // Slopes of at most 4 are found in ten roundings, from coordinates that
                    // weights of 1e-3 and the depth of at least 0.05 magnify to 1e5.
                    prop_assert!(!inside || moved <= movement + 1e-10, "{moved} > {movement}");
                }
            }
        }

        /// One per cent more breaks it: some corner sees an outermost texel uncover more than
        /// one.
        #[test]
        fn spacing_is_tight(Setup { corners, extent, depth } in setups()) {
            let movement = extent.size().min_element() / 512.0;
            let distance = next_layer(depth, &extent, movement, &corners);
            prop_assume!(distance < 100.0 * depth);
            let most = |distance: f64| {
                let mut most = 0f64;
                for eye in corner_points(&corners) {
                    // The edge beside the gap: left edges move right, right edges left.
                    let edges = [
                        (extent.min, 1.0),
                        (extent.max - movement, 1.0),
                        (extent.min + movement, -1.0),
                        (extent.max, -1.0),
                    ];
                    for (slope, sign) in edges {
                        let moved = slope_behind(eye, slope, depth, depth + distance) - slope;
                        most = most.max((moved * sign).max_element());
                    }
                }
                most
            };
            // It gains 1 % of depth / (depth + distance), at least 1e-4 of itself. In place of
            // corners at infinity stand points 1e6 away, so that slopes are off by 1e-10 of
            // rounding, with a movement of 2e-5, and distances by 1e-5 of themselves.
            prop_assert!(most(distance * 1.01) > movement * (1.0 + 2e-5));
            prop_assert!(most(distance) <= movement * (1.0 + 2e-5));
        }

        /// Layers that start farther back stay farther back, so going as far as possible each
        /// time takes the fewest.
        #[test]
        fn farther_layers_have_farther_successors(
            Setup { corners, extent, depth } in setups(),
            step in 0.0..5.0f64,
        ) {
            let movement = extent.size().min_element() / 512.0;
            let next = |depth: f64| depth + next_layer(depth, &extent, movement, &corners);
            // A few roundings, magnified where b is close to p.
            prop_assert!(next(depth + step) >= next(depth) * (1.0 - 1e-9));
        }

        /// Twice the movement of a texel never takes more layers.
        #[test]
        fn larger_texels_allow_larger_distances(
            Setup { corners, extent, depth } in setups(),
            texels in 2.0..600.0f64,
        ) {
            let movement = extent.size().min_element() / texels;
            let fine = next_layer(depth, &extent, movement, &corners);
            prop_assert!(next_layer(depth, &extent, 2.0 * movement, &corners) >= fine);
        }
    }

    proptest! {
        /// The displacement between two layers is the least movement that allows their distance.
        #[test]
        fn displacement_inverts_next_layer(
            Setup { corners, extent, depth } in setups(),
            texels in 1.0..600.0f64,
            distance in prop_oneof![Just(0.0), 1e-3..1e3f64],
        ) {
            let movement = extent.size().min_element() / texels;
            let distance_of_movement = next_layer(depth, &extent, movement, &corners);
            if distance_of_movement < 1e6 {
                let found = displacement(depth, depth + distance_of_movement, &extent, &corners);
                // A distance of at most 1e6 is added to a depth of 0.05 and more and taken from
                // the sum again, and is at least 1e-5 of the depth.
                prop_assert!((found / movement - 1.0).abs() < 1e-8, "{found} is not {movement}");
            } else {
                let found = displacement(depth, depth + distance.min(1e6), &extent, &corners);
                prop_assert!(found <= movement);
            }

            let found = displacement(depth, depth + distance, &extent, &corners);
            if found > 0.0 {
                // A little more allows the distance, a little less does not.
                let allowed = |movement| next_layer(depth, &extent, movement, &corners);
                prop_assert!(allowed(found * (1.0 + 1e-8)) >= distance);
                prop_assert!(allowed(found * (1.0 - 1e-8)) <= distance);
            }
        }

        /// No ray from anywhere in the cell that passes through the extent in both layers sees
        /// them displaced by more, and some ray does see them so displaced.
        #[test]
        fn displacement_is_the_greatest_seen(
            Setup { corners, extent, depth } in setups(),
            distance in 1e-3..10.0f64,
            rays in prop::collection::vec((weights(), prop::array::uniform2(0.0..=1.0f64)), 40),
        ) {
            let next = depth + distance;
            let most = displacement(depth, next, &extent, &corners);
            for (weights, at) in rays {
                let Some(eye) = viewpoint(&corners, &weights) else { continue };
                let slope = extent.min + extent.size() * DVec2::from(at);
                let behind = slope_behind(eye, slope, depth, next);
                for axis in 0..2 {
                    let inside = (extent.min[axis]..=extent.max[axis]).contains(&behind[axis]);
                    let moved = (behind[axis] - slope[axis]).abs();
                    // As in the test of the spacing.
                    prop_assert!(!inside || moved <= most + 1e-10, "{moved} > {most}");
                }
            }
            // From a corner, along a border of either layer.
            let mut seen = 0f64;
            for eye in corner_points(&corners) {
                for slope in [extent.min, extent.max] {
                    let behind = slope_behind(eye, slope, depth, next);
                    let before = slope_behind(eye, slope, next, depth);
                    let inwards = (extent.min + extent.max) / 2.0 - slope;
                    for moved in [behind - slope, before - slope] {
                        for axis in 0..2 {
                            if moved[axis] * inwards[axis] > 0.0 {
                                seen = seen.max(moved[axis].abs());
                            }
                        }
                    }
                }
            }
            // In place of corners at infinity stand points 1e5 and more away, where slopes are
            // off by 1e-10, and distances of up to 16 count by 2e-4 of themselves.
            prop_assert!((seen - most).abs() <= 1e-9 + 2e-4 * most, "{seen} is not {most}");
        }
    }

    #[test]
    fn a_cell_that_is_the_viewpoint_needs_one_layer() {
        let extent = Extent {
            min: DVec2::splat(-1.0),
            max: DVec2::ONE,
        };
        assert_eq!(next_layer(1.0, &extent, 0.01, &[DVec4::W]), f64::INFINITY);
    }
}
