//! The largest texel that no promised camera magnifies.

use farfield_views::{Pose, ViewCell};
use glam::DVec3;

/// Side of a texel per unit of depth, the largest that appears at most one pixel wide in the
/// centre of a camera anywhere in the cell that looks at the centre of the represented box.
///
/// A texel at a point X of the box is k X.z wide, X.z its depth before the reference viewpoint,
/// and covers the width `pixel` times the distance of X along the camera's own axis: a camera
/// in a corner of the cell is tilted against the layers, so its axis is what counts. Hence
///
/// k = pixel min over v, X of (X - v) . f(v) / X.z,
///
/// with f(v) the direction from v to the centre C of the box. For a given v this is a quotient of
/// functions linear in X, so the corners of the box suffice. For a given X the numerator
/// |y| + (X - C) . y / |y| with y = C - v grows with the distance from C, so it is least on the
/// cell's surface. Along a straight line it is stationary at the roots of a cubic, and inside a
/// face only on one line, from the foot of the perpendicular from C in the direction of X - C. The
/// least is found among these few points, not on a lattice; it is exact but for rounding. Viewpoints
/// at infinity never count: from there everything is small.
///
/// * `pose` - the reference viewpoint and the recording axis
/// * `represented` - least and greatest corner of a box in the world that lies before `pose`
/// * `pixel` - side of the camera's centre pixel at unit distance
///
/// Not positive if a corner of the box lies beside or behind such a camera: then no texel is small
/// enough. Of another camera, one that looks elsewhere, a pixel that far off its axis covers
/// less, by up to the squared cosine of the angle between them.
pub fn texel_size(pose: &Pose, cell: &ViewCell, represented: [DVec3; 2], pixel: f64) -> f64 {
    let center = (represented[0] + represented[1]) / 2.0;
    let half = (represented[1] - represented[0]) / 2.0;
    let least_ratio = (0..8)
        .map(|i| {
            let side = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(side(0), side(1), side(2));
            let depth = (center - pose.eye + corner).dot(pose.forward);
            least_distance(&seen_from(cell, center), corner) / depth
        })
        .fold(f64::INFINITY, f64::min);
    pixel * least_ratio
}

/// The cell with `origin` as the world's origin: what follows keeps its digits far away from it.
fn seen_from(cell: &ViewCell, origin: DVec3) -> ViewCell {
    let mut cell = *cell;
    match &mut cell {
        ViewCell::Box { center, .. } => *center -= origin,
        ViewCell::Shaft { apex, .. } => *apex -= origin,
    }
    cell
}

/// Least distance of `point` along the axis of a camera in the cell that looks at the origin.
fn least_distance(cell: &ViewCell, point: DVec3) -> f64 {
    let distance = |y: DVec3| y.length() + point.dot(y / y.length());
    let corners = cell.corners();
    let finite = corners.iter().filter(|c| c.w != 0.0);
    let mut least = finite
        .map(|c| distance(-c.truncate()))
        .fold(f64::INFINITY, f64::min);
    for line in lines(cell, point) {
        let tolerance = 1e-9 * line.foot.length();
        for y in stationary_points(&line, point) {
            if cell.contains(-y, tolerance) {
                least = least.min(distance(y));
            }
        }
    }
    least
}

/// A straight line of places y = foot + s direction of the origin, as seen from viewpoints -y.
struct Line {
    /// The line's nearest point to the viewpoint at the origin.
    foot: DVec3,
    /// Of length 1, perpendicular to `foot`.
    direction: DVec3,
}

/// The lines on which the distance of `point` can be least: along the cell's edges, and one in
/// each face.
fn lines(cell: &ViewCell, point: DVec3) -> Vec<Line> {
    let corners = cell.corners();
    let along = |i: usize, j: usize| {
        let to = corners[j];
        let from = if to.w == 0.0 {
            DVec3::ZERO
        } else {
            corners[i].truncate()
        };
        (to.truncate() - from).try_normalize()
    };
    let mut lines = Vec::new();
    // From corners with a bit cleared, which are finite if any is, along the bit.
    for (bit, i) in (0..3).flat_map(|bit| (0..8).map(move |i| (1 << bit, i))) {
        if i & bit == 0
            && corners[i].w != 0.0
            && let Some(direction) = along(i, i | bit)
        {
            let y = -corners[i].truncate();
            lines.push(Line {
                foot: y - y.dot(direction) * direction,
                direction,
            });
        }
    }
    for (bit, side) in [(1, 0), (1, 1), (2, 0), (2, 2), (4, 0), (4, 4)] {
        let (one, other) = (if bit == 1 { 2 } else { 1 }, if bit == 4 { 2 } else { 4 });
        if corners[side].w != 0.0
            && let Some(a) = along(side, side | one)
            && let Some(b) = along(side, side | other)
            && let Some(normal) = a.cross(b).try_normalize()
        {
            let foot = -corners[side].truncate().dot(normal) * normal;
            let lateral = point - point.dot(normal) * normal;
            // A point straight behind the foot is seen alike all around.
            lines.push(Line {
                foot,
                direction: lateral.try_normalize().unwrap_or(a),
            });
        }
    }
    lines
}

/// Where the distance of `point` is stationary along a line.
///
/// With s in units of the foot's length n, it is so where
/// s^3 + (1 - point . foot / n^2) s + point . direction / n = 0.
fn stationary_points(line: &Line, point: DVec3) -> impl Iterator<Item = DVec3> {
    let Line { foot, direction } = *line;
    let n = foot.length();
    let p = 1.0 - point.dot(foot) / (n * n);
    let q = point.dot(direction) / n;
    // A line through the centre has no stationary point, and here a NaN, which is in no cell.
    cubic_roots(p, q)
        .into_iter()
        .flatten()
        .map(move |s| foot + direction * (s * n))
}

/// The real roots of t^3 + p t + q, by Cardano's formula, or Vieta's where there are three.
fn cubic_roots(p: f64, q: f64) -> [Option<f64>; 3] {
    let discriminant = q * q / 4.0 + p * p * p / 27.0;
    if discriminant >= 0.0 {
        let u = (-q / 2.0 - discriminant.sqrt().copysign(q)).cbrt();
        let root = if u == 0.0 { 0.0 } else { u - p / (3.0 * u) };
        // Where two roots coincide, the distance is not least but inflected.
        return [Some(root), None, None];
    }
    let m = 2.0 * (-p / 3.0).sqrt();
    let angle = (3.0 * q / (p * m)).clamp(-1.0, 1.0).acos() / 3.0;
    [0.0, 1.0, 2.0].map(|k| Some(m * (angle - k * std::f64::consts::TAU / 3.0).cos()))
}
