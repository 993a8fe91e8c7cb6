//! Normals for meshes that have none.

use glam::{DVec3, Vec3};

/// Unit normals, one for each position: the mean of the normals of the triangles around the
/// vertex, weighted by their angles there.
///
/// Weighted by angle, the result does not depend on how a flat face is cut into triangles. What
/// shares a vertex is smooth, what does not has an edge: a scan comes out smooth, a soup of
/// separate triangles flat. Triangles without area count for nothing. A vertex whose triangles
/// cancel out gets the normal of the first, a vertex without triangles +Z.
///
/// * `positions` - finite
/// * `triangles` - indices into `positions`, counter-clockwise seen from the front
pub(crate) fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    // In f64: squares of squares of coordinates would leave the range of f32.
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|v| positions[v as usize].as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for (vertex, at, next, last) in [
            (corners[0], a, b, c),
            (corners[1], b, c, a),
            (corners[2], c, a, b),
        ] {
            let (u, v) = (next - at, last - at);
            let angle = u.cross(v).length().atan2(u.dot(v));
            sums[vertex as usize] += normal * angle;
        }
    }
    // What is left of normals that cancel out is rounding: a few steps of 1e-16 for each triangle
    // of pi at most.
    let cancelled = |sum: &DVec3| sum.length() < 1e-9;
    let mut normals: Vec<Vec3> = sums
        .iter()
        .map(|n| n.normalize_or_zero().as_vec3())
        .collect();
    if sums.iter().any(cancelled) {
        let mut first = vec![Vec3::Z; positions.len()];
        for corners in triangles.iter().rev() {
            let [a, b, c] = corners.map(|v| positions[v as usize].as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            if normal != Vec3::ZERO {
                corners.iter().for_each(|&v| first[v as usize] = normal);
            }
        }
        for (i, sum) in sums.iter().enumerate() {
            if cancelled(sum) {
                normals[i] = first[i];
            }
        }
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Every normal has length 1, whatever the triangles.
        #[test]
        fn normals_have_length_one(
            positions in prop::collection::vec(prop::array::uniform3(-3i8..3), 3..12),
            corners in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 0..12),
            scale in prop::sample::select(vec![1e-30f32, 1.0, 1e30]),
        ) {
            let positions: Vec<Vec3> = positions.iter().map(|p| Vec3::from(p.map(f32::from)) * scale).collect();
            let triangles: Vec<[u32; 3]> = corners.iter().map(|t| t.map(|i| i.index(positions.len()) as u32)).collect();
            for normal in smooth_normals(&positions, &triangles) {
                // Three components rounded to f32.
                prop_assert!((normal.length() - 1.0).abs() < 4.0 * f32::EPSILON, "{}", normal);
            }
        }

        /// A corner of a box gets the diagonal, however each face is cut in two.
        #[test]
        fn cuts_of_flat_faces_do_not_matter(cuts in prop::array::uniform6(any::<bool>())) {
            let positions: Vec<Vec3> = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
            let faces: [[u32; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            let triangles: Vec<[u32; 3]> = faces.iter().zip(cuts).flat_map(|(&[a, b, c, d], cut)| {
                if cut { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] }
            }).collect();
            for (normal, position) in smooth_normals(&positions, &triangles).iter().zip(&positions) {
                let diagonal = (*position - Vec3::splat(0.5)).normalize();
                // Rounding of a few operations in f64 and one to f32.
                prop_assert!((*normal - diagonal).length() < 4.0 * f32::EPSILON, "{} at {}", normal, position);
            }
        }
    }

    #[test]
    fn a_sheet_with_two_sides_keeps_the_first() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let normals = smooth_normals(&positions, &[[0, 2, 1], [0, 1, 2]]);
        assert_eq!(normals, [Vec3::NEG_Z; 3]);
    }
}
