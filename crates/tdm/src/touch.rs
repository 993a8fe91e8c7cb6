//! Whether triangles and edges touch boxes.

use crate::Cuboid;
use glam::Vec3;

/// A triangle, prepared to be compared with many boxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    corners: [Vec3; 3],
    edges: [Vec3; 3],
    /// Twice the area, along the normal.
    normal: Vec3,
    low: Vec3,
    high: Vec3,
    /// The two axes it is looked at along the third, in which its area is greatest.
    plane: [usize; 2],
}

impl Target {
    pub(crate) fn new([a, b, c]: [Vec3; 3]) -> Self {
        let edges = [b - a, c - b, a - c];
        let normal = edges[0].cross(edges[1]);
        Self {
            corners: [a, b, c],
            edges,
            normal,
            low: a.min(b).min(c),
            high: a.max(b).max(c),
            plane: match normal.abs().max_position() {
                0 => [1, 2],
                1 => [2, 0],
                _ => [0, 1],
            },
        }
    }

    /// Whether the triangle touches a box, border included.
    ///
    /// Separating axes: the box's three, the triangle's normal, and the nine products of edges
    /// (T. Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001).
    pub(crate) fn touches(&self, Cuboid { center, half }: &Cuboid) -> bool {
        if (self.low - *center).cmpgt(*half).any() || (*center - self.high).cmpgt(*half).any() {
            return false;
        }
        let distance = self.normal.dot(self.corners[0] - *center);
        if distance.abs() > half.dot(self.normal.abs()) {
            return false;
        }
        self.holds_line_through(*center, distance, *half) || !self.is_apart(*center, *half)
    }

    /// Whether the line through a box's middle along the axis of the normal's greatest part meets the
    /// triangle in the box: true of most that touch, and quick to tell.
    fn holds_line_through(&self, center: Vec3, distance: f32, half: Vec3) -> bool {
        let [i, j] = self.plane;
        let k = 3 - i - j;
        if distance.abs() > half[k] * self.normal[k].abs() {
            return false;
        }
        let sign = self.normal[k];
        (0..3).all(|at| {
            let (edge, from) = (self.edges[at], center - self.corners[at]);
            (edge[i] * from[j] - edge[j] * from[i]) * sign >= 0.0
        })
    }

    fn is_apart(&self, center: Vec3, half: Vec3) -> bool {
        let corners = self.corners.map(|p| p - center);
        self.edges.iter().any(|edge| {
            [
                Vec3::new(0.0, -edge.z, edge.y),
                Vec3::new(edge.z, 0.0, -edge.x),
                Vec3::new(-edge.y, edge.x, 0.0),
            ]
            .iter()
            .any(|axis| {
                let [a, b, c] = corners.map(|p| p.dot(*axis));
                let reach = half.dot(axis.abs());
                a.min(b).min(c) > reach || a.max(b).max(c) < -reach
            })
        })
    }
}

/// The shares of an edge from `a` to `b` between which it is in a box; `None` where it misses it.
pub(crate) fn interval_in_box(a: Vec3, b: Vec3, cuboid: &Cuboid) -> Option<[f32; 2]> {
    let (from, along, half) = (a - cuboid.center, b - a, cuboid.half);
    let mut shares = [0.0f32, 1.0];
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if from[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let ends = [-half[axis], half[axis]].map(|side| (side - from[axis]) / along[axis]);
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

    fn half() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(0.1..1.0f32).prop_map(Vec3::from)
    }

    proptest! {
        /// A triangle of which a point is in a box touches it; one that touches it comes as near as a
        /// fine lattice of its points can tell.
        #[test]
        fn triangles_touch_where_their_points_do(
            triangle in [point(), point(), point()], center in point(), half in half(),
        ) {
            const STEPS: u32 = 64;
            let lattice = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j)));
            let farthest_out = |p: Vec3| ((p - center).abs() - half).max_element();
            let nearest = lattice
                .map(|(i, j)| {
                    let (s, t) = (i as f32 / STEPS as f32, j as f32 / STEPS as f32);
                    let [a, b, c] = triangle;
                    farthest_out(a + (b - a) * s + (c - a) * t)
                })
                .fold(f32::INFINITY, f32::min);
            let found = Target::new(triangle).touches(&Cuboid { center, half });
            if nearest <= 0.0 {
                prop_assert!(found);
            }
            // Edges are at most 7 long, so lattice points are at most 0.11 apart.
            if nearest > 0.12 {
                prop_assert!(!found);
            }
        }

        /// The interval holds exactly the points of the edge that are in the box.
        #[test]
        fn intervals_hold_what_is_inside(
            a in point(), b in point(), center in point(), half in half(),
        ) {
            let found = interval_in_box(a, b, &Cuboid { center, half });
            for i in 0..=100 {
                let share = i as f32 / 100.0;
                let beyond = ((a.lerp(b, share) - center).abs() - half).max_element();
                prop_assume!(beyond.abs() > 1e-4);
                let inside = found.is_some_and(|[from, to]| from <= share && share <= to);
                prop_assert_eq!(inside, beyond < 0.0);
            }
        }
    }
}
