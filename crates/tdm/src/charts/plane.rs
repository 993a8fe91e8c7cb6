//! Planes that pieces of a mesh are laid out in.

use glam::{DVec2, DVec3};

/// A plane through the origin, looked at from the side that its axis points to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Of length 1.
    pub axis: DVec3,
    right: DVec3,
    down: DVec3,
}

impl Plane {
    pub(super) fn new(axis: DVec3) -> Self {
        // Of zeros with a sign would come other directions.
        let axis = axis + DVec3::ZERO;
        let (right, _) = axis.any_orthonormal_pair();
        Self {
            axis,
            right,
            down: right.cross(axis),
        }
    }

    /// The place of a point, x to the right and y down.
    pub(super) fn place(&self, point: DVec3) -> DVec2 {
        DVec2::new(point.dot(self.right), point.dot(self.down))
    }

    pub(super) fn is_parallel(&self, other: &Self) -> bool {
        self.axis.dot(other.axis) > 1.0 - 1e-12
    }
}

/// The unit normal of a triangle; one without an area has any across its longest edge.
pub(super) fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let edges = [b - a, c - b, a - c];
    let longest = edges.into_iter().fold(DVec3::ZERO, |longest, edge| {
        match edge.length_squared() > longest.length_squared() {
            true => edge,
            false => longest,
        }
    });
    let across = match longest == DVec3::ZERO {
        true => DVec3::Z,
        false => longest.any_orthogonal_vector().normalize(),
    };
    edges[0].cross(edges[1]).normalize_or(across)
}

/// Whether two triangles, counter-clockwise on a plane whose y runs down, have more in common than
/// a strip of [`TOLERANCE`].
///
/// Triangles that do not overlap lie on different sides of an edge of one of them. Vertices that
/// both have lie on their edges exactly, whatever is rounded.
pub(super) fn overlap(one: [DVec2; 3], other: [DVec2; 3]) -> bool {
    let parts = |of: [DVec2; 3], from: [DVec2; 3]| {
        [(0, 1), (1, 2), (2, 0)].into_iter().any(|(i, j)| {
            let edge = of[j] - of[i];
            let limit = -TOLERANCE * edge.length();
            from.iter().all(|p| edge.perp_dot(p - of[i]) >= limit)
        })
    };
    !parts(one, other) && !parts(other, one)
}

/// How far triangles side by side may reach into each other for what is rounded, in units of the
/// warped grid, whose coordinates are thousands.
const TOLERANCE: f64 = 1e-7;
