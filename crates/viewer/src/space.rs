//! Where the viewer may be.

use farfield_bundle::ViewSpace;
use farfield_views::{Pose, ViewCell};
use glam::DVec3;

/// A point of the view space near `point`; the point itself where that lies in it.
pub(crate) fn inside(space: &ViewSpace, point: DVec3) -> DVec3 {
    match *space {
        ViewSpace::Before { view_cell }
        | ViewSpace::Amid { view_cell, .. }
        | ViewSpace::Inside { view_cell, .. } => inside_cell(&view_cell, point),
        ViewSpace::Around { center, near, far } => {
            center + between_cubes(point - center, near, far)
        }
        ViewSpace::Shell { center, near, far } => {
            let from = point - center;
            let distance = from.length();
            match distance > 0.0 {
                true => center + from * (distance.clamp(near, far) / distance),
                false => center + DVec3::Z * near,
            }
        }
    }
}

/// Whether a point lies in the view space, but for rounding.
pub(crate) fn contains(space: &ViewSpace, point: DVec3) -> bool {
    let digits = 1e-9 * point.abs().max_element().max(1.0);
    inside(space, point).distance(point) <= digits
}

/// Metres that a viewer flies in a second: a third of a box, or of the way to what is looked at.
pub(crate) fn speed(space: &ViewSpace, eye: DVec3, center: DVec3) -> f64 {
    let largest = match *space {
        ViewSpace::Before {
            view_cell: ViewCell::Box { size, .. },
        }
        | ViewSpace::Amid {
            view_cell: ViewCell::Box { size, .. },
            ..
        }
        | ViewSpace::Inside {
            view_cell: ViewCell::Box { size, .. },
            ..
        } => size.max_element(),
        _ => 0.0,
    };
    match largest > 0.0 {
        true => largest / 3.0,
        false => eye.distance(center) / 3.0,
    }
}

fn inside_cell(cell: &ViewCell, point: DVec3) -> DVec3 {
    match *cell {
        ViewCell::Box { center, size } => point.clamp(center - size / 2.0, center + size / 2.0),
        ViewCell::Shaft {
            apex,
            axis,
            half_angle,
            near,
            far,
        } => {
            let pose = Pose::looking_along(apex, axis);
            let from = pose.point_in_view(point);
            let depth = from.z.clamp(near, far);
            let reach = depth * half_angle.tan();
            let (x, y) = (from.x.clamp(-reach, reach), from.y.clamp(-reach, reach));
            pose.point_in_world(DVec3::new(x, y, depth))
        }
    }
}

/// Between two cubes; what is in the smaller one leaves it on the nearest side.
fn between_cubes(from: DVec3, near: f64, far: f64) -> DVec3 {
    let mut from = from.clamp(DVec3::splat(-far), DVec3::splat(far));
    let axis = from.abs().max_position();
    if from[axis].abs() < near {
        from[axis] = near.copysign(from[axis]);
    }
    from
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vectors(range: std::ops::Range<f64>) -> impl Strategy<Value = DVec3> + Clone {
        prop::array::uniform3(range).prop_map(DVec3::from)
    }

    /// Spaces of all kinds, points and thin ones among them.
    pub(crate) fn spaces() -> impl Strategy<Value = ViewSpace> {
        let boxes = (vectors(-99.0..99.0), vectors(0.0..9.0))
            .prop_map(|(center, size)| ViewCell::Box { center, size });
        let range = (0.1..50.0f64, 1.0..9.0f64).prop_map(|(near, times)| [near, near * times]);
        let shafts = (
            vectors(-99.0..99.0),
            vectors(-1.0..1.0),
            0.01..1.5f64,
            range.clone(),
        )
            .prop_filter("it has an axis", |(_, axis, ..)| axis.length() > 0.01)
            .prop_map(|(apex, axis, half_angle, [near, far])| ViewCell::Shaft {
                apex,
                axis,
                half_angle,
                near,
                far,
            });
        let cells = prop_oneof![boxes.clone(), shafts];
        prop_oneof![
            cells.prop_map(|view_cell| ViewSpace::Before { view_cell }),
            boxes.clone().prop_map(|view_cell| ViewSpace::Amid {
                view_cell,
                distance: 1.0,
                objects: Vec::new()
            }),
            boxes.prop_map(|view_cell| ViewSpace::Inside {
                view_cell,
                cells: [1; 3]
            }),
            (vectors(-99.0..99.0), range.clone())
                .prop_map(|(center, [near, far])| { ViewSpace::Around { center, near, far } }),
            (vectors(-99.0..99.0), range).prop_map(|(center, [near, far])| ViewSpace::Shell {
                center,
                near,
                far
            }),
        ]
    }

    /// Told otherwise than by clamping.
    pub(crate) fn is_in(space: &ViewSpace, point: DVec3) -> bool {
        // Some roundings of numbers up to a few hundred.
        const TOLERANCE: f64 = 1e-9;
        match *space {
            ViewSpace::Before { view_cell }
            | ViewSpace::Amid { view_cell, .. }
            | ViewSpace::Inside { view_cell, .. } => view_cell.contains(point, TOLERANCE),
            ViewSpace::Around { center, near, far } => {
                let reach = (point - center).abs().max_element();
                (near - TOLERANCE..=far + TOLERANCE).contains(&reach)
            }
            ViewSpace::Shell { center, near, far } => {
                let distance = point.distance(center);
                (near - TOLERANCE..=far + TOLERANCE).contains(&distance)
            }
        }
    }

    proptest! {
        /// Any point is brought into the space, and stays where it is if it lies there.
        #[test]
        fn points_are_brought_inside(space in spaces(), point in vectors(-200.0..200.0)) {
            let found = inside(&space, point);
            prop_assert!(is_in(&space, found), "{found}");
            prop_assert!(inside(&space, found).distance(found) < 1e-9);
            prop_assert!(contains(&space, found));
            prop_assert_eq!(contains(&space, point), is_in(&space, point));
        }
    }

    #[test]
    fn the_centre_of_a_shell_has_a_point_near_it() {
        let center = DVec3::ONE;
        for space in [
            ViewSpace::Shell {
                center,
                near: 2.0,
                far: 3.0,
            },
            ViewSpace::Around {
                center,
                near: 2.0,
                far: 3.0,
            },
        ] {
            assert!(is_in(&space, inside(&space, center)));
        }
    }
}
