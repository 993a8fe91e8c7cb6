//! Viewpoints spread evenly over the sphere.

use crate::Triangulation;
use farfield_views::sphere_direction;
use glam::DVec3;

/// Rounds of relaxation: the widest gap is within a percent of where it stays.
const ROUNDS: usize = 60;

/// Directions spread evenly over the sphere, of length 1, any number of them.
///
/// The spherical Fibonacci lattice ([`sphere_direction`]), relaxed: each direction moves to the
/// centroid of what is nearest to it, again and again (S. Lloyd, Least Squares Quantization in PCM,
/// 1982). What counts is the widest gap, the angle from the direction that is farthest from all to
/// the nearest of them.
///
/// The same count gives the same directions.
pub fn even_directions(count: u32) -> Vec<DVec3> {
    let mut directions: Vec<DVec3> = (0..count).map(|i| sphere_direction(i, count)).collect();
    for _ in 0..ROUNDS {
        // Fewer than four have no faces.
        match Triangulation::new(&directions, DVec3::ZERO) {
            Ok(faces) => directions = centroids(&faces),
            Err(_) => break,
        }
    }
    directions
}

/// The centroids of the Voronoi cells, on the sphere.
fn centroids(faces: &Triangulation) -> Vec<DVec3> {
    let centers: Vec<DVec3> = (0..faces.faces().len() as u32)
        .map(|face| circumcenter(faces.corners(face)))
        .collect();
    let mut sums = vec![DVec3::ZERO; faces.directions().len()];
    for (face, &here) in faces.faces().iter().zip(&centers) {
        for (i, &neighbor) in face.neighbors.iter().enumerate() {
            // Each edge of the Voronoi diagram forms a triangle with the viewpoint on either side;
            // of the two faces at it, each deals with one.
            let viewpoint = face.corners[i] as usize;
            let [a, b, c] = [
                faces.directions()[viewpoint],
                here,
                centers[neighbor as usize],
            ];
            let area = (b - a).cross(c - a).length();
            sums[viewpoint] += (a + b + c) * area;
        }
    }
    let direction = |(sum, old): (&DVec3, &DVec3)| sum.try_normalize().unwrap_or(*old);
    sums.iter().zip(faces.directions()).map(direction).collect()
}

/// The direction that is equally far from three others: the normal of their plane.
pub(crate) fn circumcenter([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize()
}

/// The angle from the direction that is farthest from all viewpoints to the nearest of them, in
/// radians.
pub fn widest_gap(faces: &Triangulation) -> f64 {
    let gap = |face| {
        let corners = faces.corners(face);
        circumcenter(corners).angle_between(corners[0])
    };
    (0..faces.faces().len() as u32).map(gap).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// For any count the widest gap is at most 1.27 times the radius of a cap that holds a
    /// direction's share of the sphere, and less than that of the lattice, which is 1.3 to 1.37
    /// times it. The least possible for many directions is 1.1 times it, that of regular hexagons.
    #[test]
    fn directions_are_spread_evenly() {
        let gap = |directions: &[DVec3]| {
            widest_gap(&Triangulation::new(directions, DVec3::ZERO).unwrap())
        };
        for count in (6..40).chain([100, 162, 300]) {
            let directions = even_directions(count);
            assert_eq!(directions.len(), count as usize);
            assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-15));
            let cap = (1.0 - 2.0 / f64::from(count)).acos();
            let relaxed = gap(&directions);
            assert!(relaxed < 1.27 * cap, "{count}: {relaxed} of {cap}");
            let lattice: Vec<_> = (0..count).map(|i| sphere_direction(i, count)).collect();
            assert!(relaxed < 0.95 * gap(&lattice), "{count}: {relaxed}");
        }
    }

    /// The widest gap is that which a search over many directions finds.
    #[test]
    fn the_widest_gap_is_found() {
        for count in [4, 7, 30] {
            let faces = Triangulation::new(&even_directions(count), DVec3::ZERO).unwrap();
            let distance = |d: DVec3| {
                let angles = faces.directions().iter().map(|v| v.angle_between(d));
                angles.fold(f64::MAX, f64::min)
            };
            let probes = (0..20_000).map(|i| sphere_direction(i, 20_000));
            let searched = probes.map(distance).fold(0.0, f64::max);
            // Probes are within 1.2 times the width of their share of any direction.
            let found = widest_gap(&faces);
            assert!(searched <= found + 1e-12 && found < searched + 1.2 * (2.0 * TAU / 2e4).sqrt());
        }
    }

    #[test]
    fn few_directions_are_the_lattice() {
        assert_eq!(even_directions(0), []);
        assert_eq!(even_directions(2).len(), 2);
    }
}
