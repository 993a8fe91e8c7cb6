//! What the texels of a chart show.

use super::Chart;
use glam::{DVec2, Vec2};
use std::f64::consts::SQRT_2;

/// What a texel of a chart shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartTexel {
    /// Column, from the left.
    pub x: u32,
    /// Row, from the top.
    pub y: u32,
    /// Which triangle of the mesh.
    pub triangle: u32,
    /// Of the triangle's corners, barycentric: from 0 to 1, and 1 together.
    pub weights: [f32; 3],
}

impl Chart {
    /// What those texels show that lie on triangles or about them, row by row.
    ///
    /// A texel whose centre is in a triangle shows that point of it; on an edge, of the first
    /// triangle. One whose centre is in none, but within the diagonal of `gutter` x `gutter` texels
    /// of one, shows the point nearest to its centre. The others are left out: filters that reach
    /// `gutter` texels to each side of a point of a triangle never meet them.
    ///
    /// Costs in proportion to the texels of each triangle, those about it included.
    pub fn texels(&self, gutter: u32) -> Vec<ChartTexel> {
        let mut found = vec![None; self.width as usize * self.height as usize];
        for (i, corners) in self.corners.iter().enumerate() {
            let corners = corners.map(Vec2::as_dvec2);
            self.each_near(corners, 0.0, |at, center| {
                let (seen, weights) = (&mut found[at], inside(corners, center));
                *seen = seen.or(weights.map(|weights| Found {
                    distance: -1.0,
                    triangle: i,
                    weights,
                }));
            });
        }
        let reach = f64::from(gutter) * SQRT_2;
        for (i, corners) in self.corners.iter().enumerate() {
            let corners = corners.map(Vec2::as_dvec2);
            self.each_near(corners, reach, |at, center| {
                let most = found[at].map_or(reach, |seen| seen.distance);
                if most < 0.0 {
                    return;
                }
                let (distance, weights) = nearest(corners, center);
                if distance < most {
                    found[at] = Some(Found {
                        distance,
                        triangle: i,
                        weights,
                    });
                }
            });
        }
        let texel = |(at, found): (usize, Option<Found>)| {
            let found = found?;
            Some(ChartTexel {
                x: at as u32 % self.width,
                y: at as u32 / self.width,
                triangle: self.triangles[found.triangle],
                weights: found.weights.map(|w| w as f32),
            })
        };
        found.into_iter().enumerate().filter_map(texel).collect()
    }

    /// The texels whose centres lie within `reach` of a triangle along both axes, or hardly more.
    fn each_near(&self, corners: [DVec2; 3], reach: f64, mut visit: impl FnMut(usize, DVec2)) {
        let [a, b, c] = corners;
        let texels = |from: f64, to: f64, count: u32| {
            let first = (from - 0.5 - ROUNDING).ceil().max(0.0) as u32;
            first..((to - 0.5 + ROUNDING).floor() + 1.0).clamp(0.0, count.into()) as u32
        };
        let least = a.min(b).min(c) - reach;
        let most = a.max(b).max(c) + reach;
        for y in texels(least.y, most.y, self.height) {
            let row = f64::from(y) + 0.5;
            let Some((left, right)) = span(corners, row - reach, row + reach) else {
                continue;
            };
            for x in texels(left - reach, right + reach, self.width) {
                let at = y as usize * self.width as usize + x as usize;
                visit(at, DVec2::new(f64::from(x) + 0.5, row));
            }
        }
    }
}

/// Of spans of texels; a texel too many does no harm.
const ROUNDING: f64 = 1e-6;

#[derive(Clone, Copy, Debug)]
struct Found {
    /// From the texel's centre; -1 where that is inside.
    distance: f64,
    triangle: usize,
    weights: [f64; 3],
}

/// From where to where that part of a triangle reaches, in x, that lies between two rows.
fn span(corners: [DVec2; 3], top: f64, bottom: f64) -> Option<(f64, f64)> {
    let mut span = None;
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (a, b) = match corners[i].y <= corners[j].y {
            true => (corners[i], corners[j]),
            false => (corners[j], corners[i]),
        };
        if a.y > bottom + ROUNDING || b.y < top - ROUNDING {
            continue;
        }
        let at = |y: f64| a.lerp(b, ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0)).x;
        let ends = match a.y < b.y {
            true => [at(top), at(bottom)],
            false => [a.x, b.x],
        };
        for x in ends {
            let (left, right) = span.unwrap_or((x, x));
            span = Some((f64::min(left, x), f64::max(right, x)));
        }
    }
    span
}

/// The weights of a point in a triangle that is counter-clockwise where y runs down. No centre on
/// a common edge is in neither of two triangles: places are f32, so signs are exact.
fn inside([a, b, c]: [DVec2; 3], point: DVec2) -> Option<[f64; 3]> {
    let part = |from: DVec2, to: DVec2| (point - from).perp_dot(to - from);
    let parts = [part(b, c), part(c, a), part(a, b)];
    let sum: f64 = parts.iter().sum();
    (parts.iter().all(|part| *part >= 0.0) && sum > 0.0).then(|| parts.map(|part| part / sum))
}

/// The distance to the nearest point of a triangle that a point is outside of, and the
/// weights of that point.
fn nearest(corners: [DVec2; 3], point: DVec2) -> (f64, [f64; 3]) {
    let mut nearest = (f64::INFINITY, [0.0; 3]);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let edge = corners[j] - corners[i];
        let along = (point - corners[i]).dot(edge) / edge.length_squared();
        let along = if along.is_nan() {
            0.0
        } else {
            along.clamp(0.0, 1.0)
        };
        let distance = point.distance_squared(corners[i].lerp(corners[j], along));
        if distance < nearest.0 {
            nearest = (distance, [0.0; 3]);
            nearest.1[i] = 1.0 - along;
            nearest.1[j] = along;
        }
    }
    (nearest.0.sqrt(), nearest.1)
}

#[cfg(test)]
mod tests {
    use super::super::tests::any_charts;
    use super::*;
    use proptest::prelude::*;

    /// How far points on a chart may be off, in texels: hundreds, as f32.
    const SLACK: f64 = 1e-4;

    proptest! {
        /// Each texel is told once, by brute force: a triangle that its centre is in, the nearest
        /// one where it is in none, nothing where all are farther than the gutter.
        #[test]
        fn texels_show_what_is_nearest((charts, gutter) in any_charts()) {
            let reach = f64::from(gutter) * SQRT_2;
            for chart in charts {
                let found = chart.texels(gutter);
                prop_assert!(found.is_sorted_by(|a, b| (a.y, a.x) < (b.y, b.x)));
                let mut found = found.into_iter().peekable();
                for (y, x) in (0..chart.height).flat_map(|y| (0..chart.width).map(move |x| (y, x))) {
                    let center = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let corners: Vec<[DVec2; 3]> =
                        chart.corners.iter().map(|t| t.map(Vec2::as_dvec2)).collect();
                    let distance = |t: &[DVec2; 3]| match inside(*t, center) {
                        Some(_) => 0.0,
                        None => nearest(*t, center).0,
                    };
                    let least = corners.iter().map(distance).fold(f64::INFINITY, f64::min);
                    let Some(texel) = found.next_if(|texel| (texel.x, texel.y) == (x, y)) else {
                        prop_assert!(least > reach - SLACK, "({x}, {y}) is not told");
                        continue;
                    };
                    let at = chart.triangles.binary_search(&texel.triangle).unwrap();
                    let shown = corners[at].iter().zip(texel.weights);
                    let shown: DVec2 = shown.map(|(corner, weight)| corner * f64::from(weight)).sum();
                    prop_assert!((shown.distance(center) - least).abs() < SLACK);
                    let sum: f32 = texel.weights.iter().sum();
                    prop_assert!((sum - 1.0).abs() < 1e-5);
                    prop_assert!(texel.weights.iter().all(|w| (0.0..=1.0).contains(w)));
                    prop_assert!(least <= reach + SLACK, "({x}, {y}) is {least} off");
                }
                prop_assert!(found.next().is_none());
            }
        }
    }

    /// Centres on the edge between two triangles are told once, without any gutter.
    #[test]
    fn centres_on_edges_are_told_once() {
        let [a, b, c, d] = [[0.0, 0.0], [0.0, 8.0], [8.0, 8.0], [8.0, 0.0]].map(Vec2::from);
        let chart = Chart {
            triangles: vec![3, 5],
            corners: vec![[a, b, c], [a, c, d]],
            width: 8,
            height: 8,
        };
        let found = chart.texels(0);
        assert_eq!(found.len(), 64);
        let on_edge = found.iter().filter(|texel| texel.x == texel.y);
        assert!(on_edge.clone().count() == 8 && on_edge.clone().all(|texel| texel.triangle == 3));
    }
}
