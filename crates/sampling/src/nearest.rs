//! The points of a surface that are nearest to places.

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use std::time::Duration;

/// Triangles in any space, ready to be asked which of their points are near a place.
#[derive(Clone, Debug)]
pub struct NearestPoints {
    /// In the order in which the tree's leaves count them.
    triangles: Vec<[DVec3; 3]>,
    /// The tree, root first. A leaf holds exactly one triangle.
    nodes: Vec<Bvh2Node>,
}

impl NearestPoints {
    /// Prepares triangles, which may be none.
    ///
    /// # Panics
    ///
    /// When a corner is not finite as `f32`.
    pub fn new(triangles: &[[DVec3; 3]]) -> Self {
        let corners = triangles.as_flattened();
        let are_finite = corners.iter().all(|corner| corner.as_vec3().is_finite());
        assert!(are_finite, "corners are not finite as f32");
        let boxes: Vec<Aabb> = triangles.iter().map(box_around).collect();
        if boxes.is_empty() {
            return Self {
                triangles: Vec::new(),
                nodes: Vec::new(),
            };
        }
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2(&boxes, params, &mut Duration::default());
        let order = tree.primitive_indices.iter();
        Self {
            triangles: order.map(|i| triangles[*i as usize]).collect(),
            nodes: tree.nodes,
        }
    }

    /// The point of a triangle that is nearest to a place, if it is at most `reach` away.
    pub fn nearest(&self, place: DVec3, reach: f64) -> Option<DVec3> {
        let (mut least, mut nearest) = (reach * reach, None);
        let mut waiting = Vec::with_capacity(64);
        let to_box = |index: u32| {
            let aabb = self.nodes[index as usize].aabb();
            let [min, max] = [aabb.min, aabb.max].map(|corner| corner.as_dvec3());
            (place.clamp(min, max).distance_squared(place), index)
        };
        if !self.nodes.is_empty() {
            waiting.push(to_box(0));
        }
        while let Some((distance, index)) = waiting.pop() {
            if distance > least {
                continue;
            }
            let node = &self.nodes[index as usize];
            let first = node.first_index;
            if !node.is_leaf() {
                let [a, b] = [to_box(first), to_box(first + 1)];
                // The nearer child is looked at first.
                waiting.extend(if a.0 < b.0 { [b, a] } else { [a, b] });
                continue;
            }
            let point = nearest_on(&self.triangles[first as usize], place);
            let distance = point.distance_squared(place);
            if distance <= least {
                (least, nearest) = (distance, Some(point));
            }
        }
        nearest
    }
}

/// The box around a triangle, rounded outwards.
fn box_around(corners: &[DVec3; 3]) -> Aabb {
    let mut aabb = Aabb::empty();
    for corner in corners {
        let margin = Vec3A::splat(corner.abs().max_element() as f32 * f32::EPSILON);
        let corner = Vec3A::from(corner.as_vec3());
        aabb.extend(corner - margin).extend(corner + margin);
    }
    aabb
}

/// The point of a triangle that is nearest to a place, by the regions of its corners, edges and
/// inside (C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
fn nearest_on([a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac) = (*b - *a, *c - *a);
    let along = |from: DVec3| (ab.dot(p - from), ac.dot(p - from));
    let (d1, d2) = along(*a);
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let (d3, d4) = along(*b);
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let (d5, d6) = along(*c);
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let beyond_ab = d1 * d4 - d3 * d2;
    if beyond_ab <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return *a + ab * (d1 / (d1 - d3));
    }
    let beyond_ac = d5 * d2 - d1 * d6;
    if beyond_ac <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return *a + ac * (d2 / (d2 - d6));
    }
    let beyond_bc = d3 * d6 - d5 * d4;
    if beyond_bc <= 0.0 && d4 >= d3 && d5 >= d6 {
        return *b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let whole = beyond_ab + beyond_ac + beyond_bc;
    *a + ab * (beyond_ac / whole) + ac * (beyond_ab / whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-3.0..3.0f64).prop_map(DVec3::from)
    }

    proptest! {
        /// No point of a fine lattice on the triangles is nearer than what is found, which is as near as
        /// the nearest of them but for the lattice's width.
        #[test]
        fn nothing_is_nearer(
            triangles in prop::collection::vec([point(), point(), point()], 0..6),
            place in point(),
            reach in 0.1..3.0f64,
        ) {
            const STEPS: u32 = 40;
            let lattice = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j)));
            let on = |[a, b, c]: &[DVec3; 3], (i, j): (u32, u32)| {
                let step = f64::from(STEPS);
                *a + (*b - *a) * (f64::from(i) / step) + (*c - *a) * (f64::from(j) / step)
            };
            let points = triangles.iter().flat_map(|t| lattice.clone().map(|at| on(t, at)));
            let least = points.map(|p| p.distance(place)).fold(f64::INFINITY, f64::min);
            let found = NearestPoints::new(&triangles).nearest(place, reach);
            match found {
                Some(point) => {
                    let distance = point.distance(place);
                    prop_assert!(distance <= least + 1e-9 && least - distance < 0.3);
                }
                None => prop_assert!(least > reach),
            }
        }
    }
}
