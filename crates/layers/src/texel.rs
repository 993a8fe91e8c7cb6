//! The largest texel that no promised camera magnifies, and the smallest that one sees.

use crate::cubic::cubic_roots;
use crate::{LayerStack, PromisedCamera};
use farfield_views::{Pose, ViewCell};
use glam::{DVec3, DVec4};

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

/// The least that depths come nearer to a viewpoint of the cell than to the reference viewpoint, as
/// a share of their distance: `(z - v.z) / z`, the reciprocal of how much larger a texel of the layer
/// at z is seen from v on an image plane parallel to the layers, and at most when it is looked at
/// straight.
///
/// * `depths` - least and greatest, from the reference viewpoint
/// * `corners` - of the cell, in view space
///
/// Not positive if the cell reaches as far as the nearest depth.
pub(crate) fn least_approach(depths: [f64; 2], corners: &[DVec4]) -> f64 {
    let finite = corners.iter().filter(|v| v.w > 0.0);
    finite
        .flat_map(|v| depths.map(|z| (z - v.z) / z))
        .fold(f64::INFINITY, f64::min)
}

/// The least side of a texel seen from anywhere in the view cell, in pixels of the camera's centre,
/// on an image plane parallel to the layers.
///
/// From a corner v, a texel of the layer at depth a is k a / (a - v.z) wide at unit distance. That
/// is least for the corner farthest behind and, as it rises or falls with a throughout, in the
/// first or the last layer. A camera that is tilted against the layers is farther away along its
/// own axis, and sees texels smaller by the cosine of the angle between, and at a slant by the
/// same once more.
///
/// * `corners` - of the cell, in view space of the stack's pose, wholly before its layers; see
///   [`corners_in_view`](crate::corners_in_view)
///
/// Returns 0 for a cell that reaches to infinity, and infinity if there is no layer.
pub fn smallest_texel(stack: &LayerStack, corners: &[DVec4], camera: &PromisedCamera) -> f64 {
    let ends = stack.layers.first().into_iter().chain(stack.layers.last());
    ends.flat_map(|layer| {
        corners
            .iter()
            .map(|v| v.w * layer.depth / (layer.depth * v.w - v.z))
    })
    .map(|share| stack.texel() / camera.pixel() * share)
    .fold(f64::INFINITY, f64::min)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::cells_before_boxes;
    use farfield_views::Camera;
    use proptest::prelude::*;

    /// The least pixels per texel by brute force, over points of the cell spaced evenly.
    fn least_pixels(pose: &Pose, cell: &ViewCell, [from, to]: [DVec3; 2], steps: u32) -> f64 {
        let center = (from + to) / 2.0;
        let mut least = f64::INFINITY;
        for i in 0..(steps + 1).pow(3) {
            let n = steps + 1;
            let fractions =
                DVec3::new(f64::from(i % n), f64::from(i / n % n), f64::from(i / n / n));
            // In a shaft without end the last of these is infinitely far.
            let last = matches!(cell, ViewCell::Shaft { far, .. } if far.is_infinite());
            let fractions = fractions / f64::from(steps);
            if last && fractions.z == 1.0 {
                continue;
            }
            let eye = cell.point(fractions);
            // An independent way to the depth before the camera.
            let camera = Camera::looking_at(eye, center, 1.0, 1);
            for corner in 0..8 {
                let side = |bit: usize| {
                    if corner >> bit & 1 == 0 {
                        from[bit]
                    } else {
                        to[bit]
                    }
                };
                let x = DVec3::new(side(0), side(1), side(2));
                least = least.min(camera.pose.point_in_view(x).z / pose.point_in_view(x).z);
            }
        }
        least
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// No camera of the cell magnifies a texel, and one shows it in full, up to the step of
        /// the lattice that is searched.
        #[test]
        fn the_texel_is_the_largest_that_is_never_magnified((cell, represented) in cells_before_boxes()) {
            let axis = match cell {
                ViewCell::Box { .. } => DVec3::NEG_Z,
                ViewCell::Shaft { axis, .. } => -axis,
            };
            let eye = cell.point(DVec3::new(0.5, 0.5, 0.0));
            let pose = Pose::looking_along(eye, axis);
            let pixel = 0.01;
            let texel = texel_size(&pose, &cell, represented, pixel);
            let least = pixel * least_pixels(&pose, &cell, represented, 16);
            // Coordinates of 10 are rounded a few times, at depths of at least 0.1.
            prop_assert!(texel <= least + pixel * 1e-13, "{texel} is magnified, {least} is not");
            // Half a step of 1/16 of a cell at most 3 wide is 0.1 m; the distance changes with
            // the square of it over the distance, and the depths are at least 0.1.
            prop_assert!(texel >= least - pixel * 0.2, "{texel} could be {least}");
        }
    }

    /// A viewpoint between corners can be the worst: straight before the front, which is nearest
    /// there.
    #[test]
    fn the_middle_of_a_face_can_be_the_worst() {
        let cell = ViewCell::Box {
            center: DVec3::new(0.0, 0.0, 20.0),
            size: DVec3::new(20.0, 20.0, 20.0),
        };
        let represented = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0)];
        let pose = Pose::looking_along(DVec3::new(0.0, 0.0, 10.0), DVec3::NEG_Z);
        let texel = texel_size(&pose, &cell, represented, 1.0);
        let corners = cell.corners().map(|c| c.truncate());
        let at_corners = corners.map(|eye| {
            let point = ViewCell::Box {
                center: eye,
                size: DVec3::ZERO,
            };
            texel_size(&pose, &point, represented, 1.0)
        });
        assert!(texel < 0.995, "{texel}");
        assert!(
            at_corners.iter().all(|t| *t > 1.1 * texel),
            "{at_corners:?}"
        );
    }
}
