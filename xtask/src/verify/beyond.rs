//! How far a promise holds outside of the view cell.

use super::possible;
use super::subject::Subject;
use super::view::geometry_holds;
use farfield_bundle::{Beyond, Promise};
use farfield_views::ViewCell;
use glam::DVec3;
use rayon::prelude::*;
use std::cell::Cell;

/// Corners, edge and face centres: the first viewpoints of every cell.
const LATTICE: u64 = 26;

/// Cells are tried up to this factor.
const LARGEST: f64 = 4.0;

/// How often an interval is halved.
const STEPS: u64 = 6;

/// Places that are tried.
pub(super) const TESTS: u64 = 2 * STEPS;

/// Searches for the largest cell around the view cell, and the nearest place before it, from
/// which the promise still holds. Sampled, not proved: from the corners, edge and face centres
/// of the cells tried.
///
/// * `tested` - called after each of [`TESTS`] tests
pub(super) fn beyond(subject: &Subject<'_>, promise: &Promise, tested: impl Fn()) -> Beyond {
    // What broke one test is likely to break the next.
    let telling = Cell::new(0);
    let holds = |eyes: &[DVec3]| {
        let broken = first_broken(subject, promise, eyes, telling.get());
        telling.set(broken.unwrap_or(telling.get()));
        tested();
        broken.is_none()
    };
    let cell_scale = last_that_holds(1.0, LARGEST, |scale| {
        let cell = scaled(&subject.cell, scale);
        let eyes = cell.map(|cell| (0..LATTICE).map(|i| cell.viewpoint(i, 0)).collect());
        eyes.is_some_and(|eyes: Vec<DVec3>| holds(&eyes))
    });

    // Towards the target, from 0, the cell as it is, to 1, all the way.
    let front = front(subject);
    let target = subject.target();
    let nearer =
        |share: f64| -> Vec<DVec3> { front.iter().map(|eye| eye.lerp(target, share)).collect() };
    let share = last_that_holds(0.0, 1.0, |share| holds(&nearer(share)));
    let places = nearer(share);
    let distance = |eye: &DVec3| {
        let [min, max] = subject.represented;
        eye.distance(eye.clamp(min, max))
    };
    // From all of them it holds, so from the farthest of them on it is sure to.
    let switch = places.iter().map(distance).fold(0.0, f64::max);
    let center = places
        .iter()
        .map(|eye| eye.distance(target))
        .fold(0.0, f64::max);
    let height = 2.0 * (subject.lens.fov / 2.0).tan();
    let [min, max] = subject.represented;
    Beyond {
        cell_scale,
        switch_distance_m: switch,
        screen_coverage: max.distance(min) / (height * center),
        geometric_error_m: switch * height / f64::from(subject.lens.resolution),
    }
}

/// The places of the lattice that are nearest to the target, those of the cell's front.
fn front(subject: &Subject<'_>) -> Vec<DVec3> {
    let depth = |eye: &DVec3| (*eye - subject.target()).dot(subject.reference().forward);
    let eyes: Vec<DVec3> = (0..LATTICE).map(|i| subject.cell.viewpoint(i, 0)).collect();
    let last = eyes.iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
    let first = eyes.iter().map(depth).fold(f64::INFINITY, f64::min);
    let border = last - (last - first) / 4.0;
    eyes.into_iter()
        .filter(|eye| depth(eye) >= border)
        .collect()
}

/// One of some places from which the promise about geometry does not hold; nothing where it holds
/// from all.
///
/// * `telling` - the place that is tried before the others, if there is one of that number
fn first_broken(
    subject: &Subject<'_>,
    promise: &Promise,
    eyes: &[DVec3],
    telling: usize,
) -> Option<usize> {
    // All are asked for what costs nothing before any is looked from.
    let unseen = eyes
        .iter()
        .position(|eye| !sees_all_before_it(subject, *eye));
    let is_broken = |at: &usize| !geometry_holds(subject, eyes[*at], promise);
    let others = || (0..eyes.len()).into_par_iter().filter(|at| *at != telling);
    unseen
        .or_else(|| Some(telling).filter(|at| *at < eyes.len() && is_broken(at)))
        .or_else(|| others().find_any(is_broken))
}

/// Whether all that is represented lies before a camera at a place, and before the place along
/// the axis of the layers.
fn sees_all_before_it(subject: &Subject<'_>, eye: DVec3) -> bool {
    let nearest = subject.stack.layers.first().map_or(0.0, |layer| layer.near);
    let along = (eye - subject.reference().eye).dot(subject.reference().forward);
    along < nearest && possible::sees_all(subject, eye)
}

/// The last value between `holds`, where something holds, and `end` at which it still does, as
/// far as halving finds it.
fn last_that_holds(start: f64, end: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut good, mut bad) = (start, end);
    for _ in 0..STEPS {
        let middle = (good + bad) / 2.0;
        match holds(middle) {
            true => good = middle,
            false => bad = middle,
        }
    }
    good
}

/// A cell scaled about its centre; `None` where that is no cell.
fn scaled(cell: &ViewCell, scale: f64) -> Option<ViewCell> {
    match *cell {
        ViewCell::Box { center, size } => Some(ViewCell::Box {
            center,
            size: size * scale,
        }),
        ViewCell::Shaft {
            apex,
            axis,
            half_angle,
            near,
            far,
        } => {
            // Its centre stays where it is; without an end only the near border can move.
            let (near, far) = match far.is_finite() {
                true => {
                    let (middle, half) = ((near + far) / 2.0, (far - near) / 2.0 * scale);
                    (middle - half, middle + half)
                }
                false => (near / scale, far),
            };
            (near > 0.0).then_some(ViewCell::Shaft {
                apex,
                axis,
                half_angle: (half_angle.tan() * scale).atan(),
                near,
                far,
            })
        }
    }
}
