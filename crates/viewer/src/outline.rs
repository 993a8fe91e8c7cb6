//! The borders of the view space as lines.

use farfield_bundle::ViewSpace;
use farfield_views::{Camera, ViewCell};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A line from one point of the world to another, in metres.
pub(crate) type Line = [DVec3; 2];

/// Straight pieces of a circle.
const PIECES: u32 = 64;

/// The edges of the cells that impostors are seen from, or, of a shell, three circles around each of its
/// borders.
pub(crate) fn lines(space: &ViewSpace, cells: &[ViewCell]) -> Vec<Line> {
    match *space {
        ViewSpace::Shell { center, near, far } => {
            let circles = [near, far].into_iter();
            circles.flat_map(|radius| sphere(center, radius)).collect()
        }
        _ => cells.iter().flat_map(edges).collect(),
    }
}

/// Pairs of corners that differ in one bit.
fn edges(cell: &ViewCell) -> Vec<Line> {
    let corners = cell.corners().map(|corner| corner.truncate());
    let from = |bit: usize| {
        (0..8)
            .filter(move |i| i & bit == 0)
            .map(move |i| (i, i | bit))
    };
    let pairs = [1, 2, 4].into_iter().flat_map(from);
    pairs.map(|(a, b)| [corners[a], corners[b]]).collect()
}

/// Circles around the three axes.
fn sphere(center: DVec3, radius: f64) -> Vec<Line> {
    let axes = [
        (DVec3::X, DVec3::Y),
        (DVec3::Y, DVec3::Z),
        (DVec3::Z, DVec3::X),
    ];
    let circle = |(u, v): (DVec3, DVec3)| {
        let at = move |i: u32| {
            let angle = TAU * f64::from(i) / f64::from(PIECES);
            center + (u * angle.cos() + v * angle.sin()) * radius
        };
        (0..PIECES).map(move |i| [at(i), at(i + 1)])
    };
    axes.into_iter().flat_map(circle).collect()
}

/// Where in its picture a camera sees a line, in pixels: the ends of what is in the picture.
pub(crate) fn in_picture(camera: &Camera, line: &Line) -> Option<[DVec2; 2]> {
    let [a, b] = line.map(|point| camera.pose.point_in_view(point));
    let (min, max) = (camera.extent.min, camera.extent.max);
    // Inwards, across the sides of the pyramid that the camera sees.
    let sides = [
        DVec3::new(1.0, 0.0, -min.x),
        DVec3::new(-1.0, 0.0, max.x),
        DVec3::new(0.0, 1.0, -min.y),
        DVec3::new(0.0, -1.0, max.y),
    ];
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for side in sides {
        let [at_a, at_b] = [a, b].map(|point| side.dot(point));
        let crossing = at_a / (at_a - at_b);
        match (at_a < 0.0, at_b < 0.0) {
            (true, true) => return None,
            (true, false) => first = first.max(crossing),
            (false, true) => last = last.min(crossing),
            (false, false) => {}
        }
    }
    let ends = [first, last].map(|share| camera.pixel_from_view(a.lerp(b, share)));
    let is_seen = first <= last && ends.iter().all(|end| end.is_finite());
    is_seen.then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::tests::{is_in, spaces};
    use farfield_bundle::Side;
    use proptest::prelude::*;

    proptest! {
        /// Lines are borders: their ends lie in the space.
        #[test]
        fn lines_lie_in_the_space(space in spaces()) {
            let cells: Vec<ViewCell> = match space {
                ViewSpace::Shell { .. } => Vec::new(),
                ViewSpace::Around { .. } => Side::ALL.map(|side| space.cell(Some(side))).into(),
                _ => vec![space.cell(None)],
            };
            let lines = lines(&space, &cells);
            prop_assert!(lines.len() >= 12);
            prop_assert!(lines.as_flattened().iter().all(|end| is_in(&space, *end)));
        }

        /// What is seen of a line lies in the picture, and a line between two points in the picture is seen
        /// whole.
        #[test]
        fn lines_are_cut_at_the_picture(
            ends in prop::array::uniform2(prop::array::uniform3(-9.0..9.0f64)),
        ) {
            let camera = Camera::looking_at(DVec3::new(0.0, 1.0, 5.0), DVec3::ZERO, 0.9, 100);
            let line = ends.map(DVec3::from);
            let pixels = line.map(|end| {
                let end = camera.pose.point_in_view(end);
                (end.z > 0.0).then(|| camera.pixel_from_view(end))
            });
            let is_within = |pixel: DVec2, slack: f64| {
                pixel.min_element() >= -slack && pixel.max_element() <= 100.0 + slack
            };
            let seen = in_picture(&camera, &line);
            if let Some(seen) = seen {
                prop_assert!(seen.iter().all(|end| is_within(*end, 1e-6)), "{seen:?}");
            }
            if let [Some(a), Some(b)] = pixels && is_within(a, 0.0) && is_within(b, 0.0) {
                let [from, to] = seen.expect("both ends are in the picture");
                prop_assert!(from.abs_diff_eq(a, 1e-6) && to.abs_diff_eq(b, 1e-6));
            }
        }
    }

    #[test]
    fn lines_behind_the_camera_are_not_seen() {
        let camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, 0.9, 100);
        let behind = [DVec3::new(-1.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 1.0)];
        assert_eq!(in_picture(&camera, &behind), None);
    }
}
