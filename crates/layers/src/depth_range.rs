//! Parallax: which depths a layer may hold, and where one layer's depths end.

use crate::cubic::cubic_roots;
use farfield_views::Extent;
use glam::{DVec2, DVec4};

/// How far behind the plane at `depth` another plane may lie, so that a point of either, moved
/// to the other along its ray from the reference viewpoint, moves by at most `parallax` for
/// any viewpoint of the cell.
///
/// Used both ways: before the first layer (from the nearest depth it holds to the layer) and
/// behind the last (from the layer to the farthest depth).
///
/// The ray at slope u of the reference viewpoint passes a viewpoint v at the lateral distance
/// b = |v.xy - u v.z|. At the distances D and D + e before v its points are seen
/// b (1/D - 1/(D + e)) apart on an image plane parallel to the layers, at unit distance, so that
/// e = K D^2 / (b - K D) with K the `parallax`. This replaces equation 3.7 of S. Jeschke,
/// Accelerating the Rendering Process Using Impostors, 2005, which bounds a true angle in a plane
/// through the axis of symmetry: on the image plane that can be 1.7 pixels where one is meant.
///
/// b is convex in v and in u, so the corners of the extent suffice, and the edges of the cell.
/// Its corners do not: e can be least in between, in a deep cell before a wide extent. With
/// t = 1/D, r = b/D is the length of a vector that is linear in t along a straight line of
/// viewpoints, and K/e = t (r - K), whose greatest value is found there.
///
/// * `depth` - from the reference viewpoint, farther than all of the cell
/// * `extent` - slopes that bound what is represented
/// * `parallax` - a slope: a pixel's side at unit distance
/// * `corners` - of the cell, in view space of the reference viewpoint; (x, y, z, 0) is a
///   direction towards a corner at infinity
///
/// Returns infinity where a plane holds everything behind.
///
/// # Panics
///
/// When `corners` is empty, `depth` does not lie before all of them, or `parallax` is not positive.
pub fn depth_range_behind(depth: f64, extent: &Extent, parallax: f64, corners: &[DVec4]) -> f64 {
    assert!(!corners.is_empty(), "a view cell has corners");
    assert!(parallax > 0.0, "a parallax of {parallax} is not positive");
    let mut most = 0f64;
    for slope in extent.corners() {
        let sight = |v: &DVec4| {
            let distance = depth * v.w - v.z;
            assert!(
                distance > 0.0,
                "the plane at {depth} is not before the corner {v}"
            );
            Sight {
                offset: (DVec2::new(v.x, v.y) - slope * v.z) / distance,
                nearness: v.w / distance,
            }
        };
        for (i, a) in corners.iter().map(sight).enumerate() {
            most = most.max(a.nearness * (a.offset.length() - parallax));
            for b in corners[..i].iter().map(sight) {
                // Neither factor of t (r - K) is greater in between than at the greater end.
                let offset = a.offset.length().max(b.offset.length());
                if a.nearness.max(b.nearness) * (offset - parallax) > most {
                    most = most.max(greatest_between(&a, &b, parallax));
                }
            }
        }
    }
    parallax / most
}

/// The greatest parallax between the planes at `near` and `far` that a viewpoint of the cell sees,
/// where it exceeds `above`, else `above`: the least `parallax` for which [`depth_range_behind`]
/// reaches from one to the other.
///
/// With D the nearer plane's distance, r = b/D, t = 1/D and e the distance between the planes it is
/// r e t / (1 + e t). Both factors are greatest at corners, so corners also bound the product:
/// the greatest found there from below, the product of the greatest factors from above. Between
/// the bounds it is found by bisection, to a double's last digits. Never below the exact value
/// but for rounding.
pub(crate) fn parallax_between(
    near: f64,
    far: f64,
    extent: &Extent,
    corners: &[DVec4],
    above: f64,
) -> f64 {
    let range = far - near;
    let (mut low, mut offset, mut share) = (above, 0f64, 0f64);
    for v in corners {
        let distance = near * v.w - v.z;
        let shift = range * v.w / (distance + range * v.w);
        share = share.max(shift);
        for slope in extent.corners() {
            let r = (DVec2::new(v.x, v.y) - slope * v.z).length() / distance;
            offset = offset.max(r);
            low = low.max(r * shift);
        }
    }
    let mut high = offset * share;
    let suffices =
        |parallax| parallax > 0.0 && depth_range_behind(near, extent, parallax, corners) >= range;
    // The greatest value is mostly at a corner.
    if low >= high || suffices(low) {
        return low;
    }
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if suffices(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Depth of the border between the layers at `near` and `far`: there the parallax against both
/// is the same, half of that between the layers, seen from any point of the plane through the
/// corner of the cell that is nearest to the layers.
///
/// The distances from that plane have the harmonic mean of the layers'. (Any border between the
/// layers keeps parallax below their own displacement. Equation 3.6 of S. Jeschke, Accelerating
/// the Rendering Process Using Impostors, 2005, halves an angle along a line of sight; this
/// halves what a pixel sees.)
///
/// * `near`, `far` - depths from the reference viewpoint, farther than all of the cell
/// * `corners` - as for [`depth_range_behind`]
///
/// # Panics
///
/// When the layers are not in order before the cell.
pub fn border_between(near: f64, far: f64, corners: &[DVec4]) -> f64 {
    let cell = nearest_depth(corners);
    assert!(
        cell < near && near <= far,
        "layers at {near} and {far} are not in order before a cell that ends at {cell}"
    );
    let (n, f) = (near - cell, far - cell);
    // The harmonic mean of n and f, less n, is n (f - n) / (n + f).
    (near + (f - n) * (n / (n + f))).clamp(near, far)
}

/// The depth of the corner nearest to the layers; corners at infinity lie behind.
pub(crate) fn nearest_depth(corners: &[DVec4]) -> f64 {
    let finite = corners.iter().filter(|v| v.w > 0.0);
    finite.map(|v| v.z / v.w).fold(f64::NEG_INFINITY, f64::max)
}

/// What a viewpoint sees of a plane: a ray's lateral distance over the plane's, b/D, and 1/D.
struct Sight {
    offset: DVec2,
    nearness: f64,
}

/// The greatest t (|r(t)| - `parallax`) strictly between two viewpoints, or 0 where the greatest
/// value is at one of them.
///
/// With r(t) = alpha t + beta and A = alpha^2, B = alpha beta, C = beta^2, the second derivative of
/// t |r| has the sign of 2 A^2 t^3 + 6 A B t^2 + 3 (A C + B^2) t + 2 B C, which only rises as
/// B^2 <= A C, and starts negative only if B < 0. So the first derivative falls to one least value
/// and rises from there: it falls through `parallax` once before, or not at all, and there is the
/// only top. In s = t + B / A, never positive, the place of the least is the one root of
/// s^3 + 3/2 e s - e B / (2 A), e = (A C - B^2) / A^2.
fn greatest_between(a: &Sight, b: &Sight, parallax: f64) -> f64 {
    let (a, b) = if a.nearness < b.nearness {
        (a, b)
    } else {
        (b, a)
    };
    if a.nearness == b.nearness {
        return 0.0;
    }
    let alpha = (b.offset - a.offset) / (b.nearness - a.nearness);
    let beta = a.offset - alpha * a.nearness;
    let (aa, ab) = (alpha.dot(alpha), alpha.dot(beta));
    if ab >= 0.0 {
        return 0.0;
    }
    // |r|^2 = A ((t - nearest)^2 + e).
    let nearest = -ab / aa;
    let e = (alpha.perp_dot(beta) / aa).powi(2);
    let [least, ..] = cubic_roots(1.5 * e, nearest * e / 2.0);
    let least = least.expect("a cubic has a root") + nearest;
    let rises = |t: f64| {
        let before = t - nearest;
        let length = (before * before + e).sqrt();
        // Not a number, and no rise, at the nearest point itself if r is 0 there.
        aa.sqrt() * (length + t * before / length) > parallax
    };
    let (mut low, mut high) = (a.nearness, least.min(b.nearness));
    if low >= high || !rises(low) || rises(high) {
        return 0.0;
    }
    // Each step gains a bit; the value is stationary there, so half of a double's bits suffice.
    for _ in 0..30 {
        let middle = (low + high) / 2.0;
        if rises(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low * ((alpha * low + beta).length() - parallax)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Setup, corner_points, parallax, setups, viewpoint, weights};
    use glam::DVec3;
    use proptest::prelude::*;

    /// The greatest parallax between two planes by brute force: from many points of all lines
    /// between two corners, the logarithms of their distances spaced evenly, at the extent's
    /// corners.
    fn greatest_parallax(setup: &Setup, near: f64, far: f64) -> f64 {
        const STEPS: u32 = 2000;
        let points = corner_points(&setup.corners);
        let mut greatest = 0f64;
        let mut look = |eye: DVec3| {
            for slope in setup.extent.corners() {
                greatest = greatest.max(parallax(eye, slope, near, far));
            }
        };
        points.iter().for_each(|eye| look(*eye));
        for (i, a) in points.iter().enumerate() {
            // Between corners as far away as each other it is less than at one of them.
            for b in points[..i].iter().filter(|b| b.z != a.z) {
                let (from, to) = (near - a.z, near - b.z);
                for step in 1..STEPS {
                    let share = f64::from(step) / f64::from(STEPS);
                    let distance = from * (to / from).powf(share);
                    look(*a + (*b - *a) * ((distance - from) / (to - from)));
                }
            }
        }
        greatest
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        /// From anywhere in the cell, points of both planes and of any between are seen at most
        /// the given parallax apart.
        #[test]
        fn no_viewpoint_sees_more_parallax(
            setup in setups(),
            limit in prop_oneof![1e-5..0.1f64, 0.1..3.0f64],
            rays in prop::collection::vec(
                (weights(), prop::array::uniform2(0.0..=1.0f64), 0.0..=1.0f64), 40),
        ) {
            let Setup { corners, extent, depth } = &setup;
            let range = depth_range_behind(*depth, extent, limit, corners).min(1e6);
            for (weights, at, share) in rays {
                let Some(eye) = viewpoint(corners, &weights) else { continue };
                let slope = extent.min + extent.size() * DVec2::from(at);
                let seen = parallax(eye, slope, *depth, depth + range * share);
                // Slopes of at most 1e5, rounded a few times: 0.05 is the least distance.
                prop_assert!(seen <= limit + 1e-10, "{seen} > {limit}");
            }
        }

        /// One per cent more breaks it.
        #[test]
        fn the_range_is_tight(
            setup in setups(), limit in prop_oneof![1e-5..0.1f64, 0.1..3.0f64],
        ) {
            let Setup { corners, extent, depth } = &setup;
            let range = depth_range_behind(*depth, extent, limit, corners);
            if range >= 10.0 {
                return Ok(());
            }
            let seen = greatest_parallax(&setup, *depth, depth + range * 1.01);
            // It gains 1 % of D / (D + range), at least 5e-5 of itself with D of at least 0.05.
            // The samples of a line miss its top by about the square of half a step, which is
            // 0.5 % where they reach to 1e6.
            prop_assert!(seen > limit, "{seen} <= {limit}");
        }

        /// The parallax found between two planes is never exceeded, is that of some viewpoint,
        /// and is not looked for where it does not exceed what is known.
        #[test]
        fn parallax_is_the_greatest_seen(
            setup in setups(),
            range in 1e-3..10.0f64,
            rays in prop::collection::vec((weights(), prop::array::uniform2(0.0..=1.0f64)), 40),
        ) {
            let Setup { corners, extent, depth } = &setup;
            let far = depth + range;
            let found = parallax_between(*depth, far, extent, corners, 0.0);
            for (weights, at) in rays {
                let Some(eye) = viewpoint(corners, &weights) else { continue };
                let slope = extent.min + extent.size() * DVec2::from(at);
                let seen = parallax(eye, slope, *depth, far);
                // As above, and 1e-9 of what is found for a range that is the difference of
                // depths.
                prop_assert!(seen <= found * (1.0 + 1e-9) + 1e-10, "{seen} > {found}");
            }
            let seen = greatest_parallax(&setup, *depth, far);
            // The samples miss the top of a line as above; corners at infinity are 1e5 away, where
            // distances of up to 20 count by 2e-4 of themselves, and slopes are off by 1e-10.
            prop_assert!((seen - found).abs() <= 2e-4 * found + 1e-9, "{seen} is not {found}");
            let more = found * 1.01 + 1e-9;
            prop_assert_eq!(parallax_between(*depth, far, extent, corners, more), more);
        }

        /// The border lies between the layers and is equally far from both, half as far as they
        /// are from each other, as seen from the plane through the cell's nearest corner.
        #[test]
        fn borders_halve_the_parallax(
            Setup { corners, extent, depth } in setups(),
            distance in prop_oneof![Just(0.0), 1e-6..10.0f64],
            at in prop::array::uniform2(-1.0..1.0f64),
        ) {
            let far = depth + distance;
            let border = border_between(depth, far, &corners);
            prop_assert!((depth..=far).contains(&border));
            let nearest = corners.iter().filter(|c| c.w > 0.0);
            let eye = DVec2::from(at).extend(nearest.map(|c| c.z).fold(f64::MIN, f64::max));
            let slope = extent.max;
            let (a, b) = (parallax(eye, slope, depth, border), parallax(eye, slope, border, far));
            let whole = parallax(eye, slope, depth, far);
            // Slopes of at most 100, from depths of at least 0.05 before the eye.
            prop_assert!((a - whole / 2.0).abs() < 1e-12 && (b - whole / 2.0).abs() < 1e-12);
        }
    }

    /// For one corner the formula of the documentation.
    #[test]
    fn one_viewpoint_is_as_documented() {
        let extent = Extent {
            min: DVec2::splat(-0.25),
            max: DVec2::splat(0.25),
        };
        let corner = DVec4::new(3.0, 0.0, -2.0, 1.0);
        // b = |(3 + 0.25 * 2, 0.25 * 2)|, D = 10 + 2.
        let (b, d, k) = (3.5f64.hypot(0.5), 12.0, 1e-3);
        let found = depth_range_behind(10.0, &extent, k, &[corner]);
        assert!((found / (k * d * d / (b - k * d)) - 1.0).abs() < 1e-14);
        assert_eq!(
            depth_range_behind(10.0, &extent, 0.3, &[corner]),
            f64::INFINITY
        );
    }

    /// From the near end of a line of viewpoints nothing moves, from the far end everything is
    /// small: parallax is greatest about as far behind the near end as the plane is before it.
    #[test]
    fn the_worst_viewpoint_can_lie_between_corners() {
        let extent = Extent {
            min: DVec2::splat(-1.0),
            max: DVec2::ONE,
        };
        let corners = [DVec4::W, DVec4::new(0.0, 0.0, -1000.0, 1.0)];
        let range = depth_range_behind(10.0, &extent, 1e-3, &corners);
        let at_corner = |i: usize| depth_range_behind(10.0, &extent, 1e-3, &corners[i..=i]);
        assert!(range < 0.05 * at_corner(0).min(at_corner(1)));
        let seen = |z: f64| parallax(DVec3::new(0.0, 0.0, z), DVec2::ONE, 10.0, 10.0 + range);
        assert!((seen(-10.0) - 1e-3).abs() < 1e-6, "{}", seen(-10.0));
        assert!(seen(-5.0) < 0.95e-3 && seen(-20.0) < 0.95e-3);
    }

    /// Found by the tests above: with a limit as large as the slopes, the worst viewpoint lies
    /// between corners even where parallax only grows from one to the other; and where the line
    /// between them leads through a place that sees no parallax.
    #[test]
    fn the_worst_viewpoint_is_found_for_large_limits_too() {
        let corners = [
            DVec4::new(1.226, 0.0, -1.993, 1.0),
            DVec4::new(0.492, 0.0, 0.0, 1.0),
        ];
        let extent = Extent {
            min: DVec2::new(0.163, 1.018),
            max: DVec2::new(1.493, 1.310),
        };
        let (depth, range) = (0.265, 6.031);
        let found = parallax_between(depth, depth + range, &extent, &corners, 0.0);
        let setup = Setup {
            corners: corners.to_vec(),
            extent,
            depth,
        };
        let seen = greatest_parallax(&setup, depth, depth + range);
        assert!((found / seen - 1.0).abs() < 1e-5, "{found} is not {seen}");

        // Straight behind the viewpoint, parallax is greatest as far behind it as the plane is
        // before it: 1 * 1 / 2^2 * 0.001.
        let corners = [DVec4::W, DVec4::new(0.0, 0.0, -0.1, 0.0)];
        let extent = Extent {
            min: DVec2::new(0.0, 1.0),
            max: DVec2::new(0.0, 1.0),
        };
        let found = parallax_between(1.0, 1.001, &extent, &corners, 0.0);
        assert!((found / 0.00025 - 1.0).abs() < 1e-3, "{found}");
    }
}
