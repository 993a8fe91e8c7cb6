//! Cuts polygons into triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Corners of a polygon at most. Cutting takes time in proportion to their square at worst, and
/// what real files have stays far below.
pub(crate) const MOST_CORNERS: usize = 4096;

/// Appends the triangles of a polygon, as indices of its corners, turning the way it turns.
///
/// Seen along the polygon's mean normal, the triangles cover it and nothing else, also where it
/// bends inwards. A polygon that crosses itself or has no area gives triangles all the same.
///
/// The normal is the sum over the edges of a x b (M. Newell's method; I. Sutherland et al., A
/// Characterization of Ten Hidden-Surface Algorithms, 1974), exact for flat polygons.
///
/// * `corners` - 3 to [`MOST_CORNERS`], finite
pub(crate) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
    let count = corners.len() as u32;
    // Relative to a corner, so that far-away polygons lose nothing.
    let offsets: Vec<DVec3> = corners.iter().map(|&c| c - corners[0]).collect();
    let edges = || offsets.iter().zip(offsets.iter().cycle().skip(1));
    let normal: DVec3 = edges().map(|(a, b)| a.cross(*b)).sum();
    let Some(normal) = normal.try_normalize() else {
        triangles.extend((2..count).map(|i| [0, i - 1, i]));
        return;
    };
    let (x, y) = normal.any_orthonormal_pair();
    // The pair's cross product is the normal, so counter-clockwise stays counter-clockwise.
    let flat: Vec<DVec2> = offsets
        .iter()
        .map(|o| DVec2::new(o.dot(x), o.dot(y)))
        .collect();
    let area = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| flat[i as usize]);
        (b - a).perp_dot(c - a)
    };
    let convex = |fan: &[[u32; 3]]| fan.iter().all(|&triangle| area(triangle) > 0.0);
    match count {
        3 => triangles.push([0, 1, 2]),
        4 if convex(&[[0, 1, 2], [0, 2, 3]]) => triangles.extend([[0, 1, 2], [0, 2, 3]]),
        4 if convex(&[[1, 2, 3], [1, 3, 0]]) => triangles.extend([[1, 2, 3], [1, 3, 0]]),
        _ => {
            let mut cut: Vec<u32> = Vec::new();
            let points = flat.iter().map(|p| p.to_array());
            Earcut::new().earcut(points, &[], &mut cut);
            triangles.extend_from_slice(cut.as_chunks().0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use proptest::prelude::*;

    /// Twice the area of a polygon in the plane z = 0, positive counter-clockwise.
    fn area(corners: &[DVec3]) -> f64 {
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(a, b)| a.cross(*b).z).sum()
    }

    proptest! {
        /// The triangles of a star, which may bend inwards at every corner, turn its way and have
        /// its area together, however it is placed in space.
        #[test]
        fn triangles_cover_the_polygon(
            radii in prop::collection::vec(1u8..20, 3..24),
            turn in prop::array::uniform4(-1f64..1.0),
            far in prop::sample::select(vec![0.0, 1e6]),
        ) {
            // At least three points around, so that the middle is inside.
            let star: Vec<DVec3> = radii.iter().enumerate().map(|(i, &r)| {
                let angle = i as f64 / radii.len() as f64 * std::f64::consts::TAU;
                DVec3::new(angle.cos(), angle.sin(), 0.0) * f64::from(r)
            }).collect();
            prop_assume!(turn != [0.0; 4]);
            let turn = DQuat::from_array(turn).normalize();
            let placed: Vec<DVec3> = star.iter().map(|&p| turn * p + DVec3::splat(far)).collect();
            let mut triangles = vec![];
            triangulate(&placed, &mut triangles);
            let areas: Vec<f64> = triangles.iter()
                .map(|t| area(&t.map(|i| star[i as usize]))).collect();
            // Coordinates of 1e6 have steps of 1e-10, sides are up to 40 long.
            let tolerance = 1e-6;
            prop_assert!(areas.iter().all(|&a| a > -tolerance), "{:?}", areas);
            let sum: f64 = areas.iter().sum();
            prop_assert!((sum - area(&star)).abs() < tolerance, "{} of {}", sum, area(&star));
        }

        /// Whatever the corners are, every triangle is made of them.
        #[test]
        fn odd_polygons_do_no_harm(
            corners in prop::collection::vec(prop::array::uniform3(-2i8..3), 3..30),
            scale in prop::sample::select(vec![1e-30, 1.0, 1e30]),
        ) {
            let corners: Vec<DVec3> = corners.iter().map(|c| DVec3::from(c.map(f64::from)) * scale).collect();
            let mut triangles = vec![];
            triangulate(&corners, &mut triangles);
            prop_assert!(triangles.len() <= corners.len() - 2);
            prop_assert!(triangles.iter().flatten().all(|&i| (i as usize) < corners.len()));
        }
    }
}
