//! Directions all around.

use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Direction `index` of `count` that are spread evenly over the sphere, of length 1.
///
/// The spherical Fibonacci lattice: bands of equal area along y, turned by the golden angle
/// (R. Swinbank and R. J. Purser, Fibonacci grids: A novel approach to global modelling, 2006).
///
/// # Panics
///
/// When `index` is not below `count`.
pub fn sphere_direction(index: u32, count: u32) -> DVec3 {
    assert!(index < count, "direction {index} of {count} does not exist");
    let y = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(count);
    let golden_ratio = (1.0 + 5f64.sqrt()) / 2.0;
    on_sphere(y, (f64::from(index) / golden_ratio).fract())
}

/// The direction of two fractions of [0, 1], of length 1: equal areas of the square are equal areas of the
/// sphere. The first is 0 at +Y and 1 at -Y, the second turns about Y.
pub fn direction_at(fractions: DVec2) -> DVec3 {
    on_sphere(1.0 - 2.0 * fractions.x, fractions.y)
}

fn on_sphere(y: f64, turn: f64) -> DVec3 {
    let (sin, cos) = (TAU * turn).sin_cos();
    let radius = (1.0 - y * y).max(0.0).sqrt();
    DVec3::new(radius * cos, y, radius * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every direction has a neighbour within the width of its share of the sphere, and none
    /// closer than half of it.
    #[test]
    fn directions_are_spread_evenly() {
        for count in [4, 33, 500] {
            let all: Vec<_> = (0..count).map(|i| sphere_direction(i, count)).collect();
            let share = (2.0 * TAU / f64::from(count)).sqrt();
            for (i, a) in all.iter().enumerate() {
                assert!((a.length() - 1.0).abs() < 1e-15);
                let others = all.iter().enumerate().filter(|(j, _)| *j != i);
                let nearest = others.map(|(_, b)| a.distance(*b)).fold(f64::MAX, f64::min);
                assert!(
                    nearest > 0.5 * share && nearest < 1.2 * share,
                    "{nearest} of {share}"
                );
            }
        }
    }
}
