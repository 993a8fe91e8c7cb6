//! Whether triangles and edges touch boxes.

use glam::Vec3;

/// Whether a triangle touches the axis-aligned cube of half side `half` round `center`, border
/// included.
///
/// Separating axes: the cube's three, the triangle's normal, and the nine products of edges
/// (T. Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001).
pub(crate) fn touches_cube(triangle: [Vec3; 3], center: Vec3, half: f32) -> bool {
    let [a, b, c] = triangle.map(|p| p - center);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if low.max_element() > half || high.min_element() < -half {
        return false;
    }
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(edges[1]);
    if normal.dot(a).abs() > half * normal.abs().element_sum() {
        return false;
    }
    let is_apart = |axis: Vec3| {
        let along = [a, b, c].map(|p| p.dot(axis));
        let reach = half * axis.abs().element_sum();
        let low = along[0].min(along[1]).min(along[2]);
        let high = along[0].max(along[1]).max(along[2]);
        low > reach || high < -reach
    };
    !edges.into_iter().any(|edge| {
        is_apart(Vec3::new(0.0, -edge.z, edge.y))
            || is_apart(Vec3::new(edge.z, 0.0, -edge.x))
            || is_apart(Vec3::new(-edge.y, edge.x, 0.0))
    })
}

/// The shares of an edge from `a` to `b` between which it is in the cube of half side `half` round
/// `center`; `None` where it misses it.
pub(crate) fn interval_in_cube(a: Vec3, b: Vec3, center: Vec3, half: f32) -> Option<[f32; 2]> {
    let (from, along) = (a - center, b - a);
    let mut shares = [0.0f32, 1.0];
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if from[axis].abs() > half {
                return None;
            }
            continue;
        }
        let ends = [-half, half].map(|side| (side - from[axis]) / along[axis]);
        shares[0] = shares[0].max(ends[0].min(ends[1]));
        shares[1] = shares[1].min(ends[0].max(ends[1]));
    }
    (shares[0] <= shares[1]).then_some(shares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-2.0..2.0f32).prop_map(Vec3::from)
    }

    proptest! {
        /// A triangle of which a point is in the cube touches it; one that touches it comes as near
        /// as a fine lattice of its points can tell.
        #[test]
        fn triangles_touch_where_their_points_do(
            triangle in [point(), point(), point()], half in 0.1..1.0f32,
        ) {
            const STEPS: u32 = 64;
            let lattice = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j)));
            let nearest = lattice
                .map(|(i, j)| {
                    let (s, t) = (i as f32 / STEPS as f32, j as f32 / STEPS as f32);
                    let [a, b, c] = triangle;
                    (a + (b - a) * s + (c - a) * t).abs().max_element()
                })
                .fold(f32::INFINITY, f32::min);
            let found = touches_cube(triangle, Vec3::ZERO, half);
            if nearest <= half {
                prop_assert!(found);
            }
            // Edges are at most 7 long, so lattice points are at most 0.11 apart.
            if nearest > half + 0.12 {
                prop_assert!(!found);
            }
        }

        /// The interval holds exactly the points of the edge that are in the cube.
        #[test]
        fn intervals_hold_what_is_inside(a in point(), b in point(), half in 0.1..1.0f32) {
            let found = interval_in_cube(a, b, Vec3::ZERO, half);
            for i in 0..=100 {
                let share = i as f32 / 100.0;
                let beyond = a.lerp(b, share).abs().max_element() - half;
                prop_assume!(beyond.abs() > 1e-4);
                let inside = found.is_some_and(|[from, to]| from <= share && share <= to);
                prop_assert_eq!(inside, beyond < 0.0);
            }
        }
    }
}
