//! Which texels a convex polygon touches, exactly and conservatively.

use glam::DVec2;
use std::ops::{Range, RangeInclusive};

/// Doubt, in texels: a square that a polygon misses by less counts as touched. Far more than the
/// rounding of coordinates of up to 2^16 texels (2^-37), far less than a texel.
const DOUBT: f64 = 1.0 / (1 << 20) as f64;

/// The x interval of a convex polygon between two heights, or `None` where it has none.
///
/// A convex polygon cut to a band is convex, so it touches the closed square of a texel exactly
/// if this interval, taken between the square's upper and lower side, touches the square's. One
/// point and two points are polygons too.
fn span(polygon: &[DVec2], top: f64, bottom: f64) -> Option<(f64, f64)> {
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut take = |x: f64| (min, max) = (min.min(x), max.max(x));
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (upper, lower) = if a.y <= b.y { (a, b) } else { (b, a) };
        if lower.y < top || upper.y > bottom {
            continue;
        }
        let at = |y: f64| upper.x + (lower.x - upper.x) * (y - upper.y) / (lower.y - upper.y);
        take(if upper.y >= top { upper.x } else { at(top) });
        take(if lower.y <= bottom {
            lower.x
        } else {
            at(bottom)
        });
    }
    (min <= max).then_some((min, max))
}

/// A convex polygon in texels, and its bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline<'a> {
    corners: &'a [DVec2],
    min: DVec2,
    max: DVec2,
}

impl<'a> Outline<'a> {
    pub(crate) fn new(corners: &'a [DVec2]) -> Self {
        let nothing = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (min, max) = corners.iter().fold(nothing, |(min, max), corner| {
            (min.min(*corner), max.max(*corner))
        });
        Self { corners, min, max }
    }

    pub(crate) fn corners(&self) -> &'a [DVec2] {
        self.corners
    }

    /// The rows whose closed squares the polygon touches, within `0..height`.
    pub(crate) fn rows(&self, height: usize) -> RangeInclusive<usize> {
        touched(self.min.y, self.max.y, height)
    }

    /// The columns that the bounds touch, within `0..width`.
    pub(crate) fn columns_of_bounds(&self, width: usize) -> RangeInclusive<usize> {
        touched(self.min.x, self.max.x, width)
    }

    /// The columns of row `y`, one of its rows, whose closed squares the polygon touches, within
    /// `0..width`.
    pub(crate) fn columns(&self, y: usize, width: usize) -> RangeInclusive<usize> {
        let (top, bottom) = (y as f64 - DOUBT, (y + 1) as f64 + DOUBT);
        let in_bounds = self.columns_of_bounds(width);
        // Small polygons mostly lie in one row or column, and their bounds say all.
        let in_row = top <= self.min.y && self.max.y <= bottom;
        let column = *in_bounds.start() as f64;
        let in_column = in_bounds.start() == in_bounds.end()
            && column <= self.min.x
            && self.max.x <= column + 1.0;
        if in_row || in_column {
            return in_bounds;
        }
        match span(self.corners, top, bottom) {
            Some((min, max)) => touched(min, max, width),
            None => NOTHING,
        }
    }

    /// The columns of row `y` whose centres the polygon covers, within `0..width`.
    pub(crate) fn centers_in(&self, y: usize, width: usize) -> Range<usize> {
        let middle = y as f64 + 0.5;
        if self.min.y <= middle
            && middle <= self.max.y
            && let Some((min, max)) = span(self.corners, middle, middle)
        {
            let [first, end] = [(min - 0.5).ceil(), (max - 0.5).floor() + 1.0];
            return first.max(0.0) as usize..(end.max(0.0) as usize).min(width);
        }
        0..0
    }

    /// Whether the bounds hold the centre of a texel.
    pub(crate) fn may_cover_centers(&self) -> bool {
        (self.min - 0.5).ceil().cmple(self.max - 0.5).all()
    }

    /// Squared distance from a point to the bounds, no more than that to the polygon.
    pub(crate) fn distance_squared(&self, point: DVec2) -> f64 {
        point.distance_squared(point.clamp(self.min, self.max))
    }
}

/// The point of a polygon's border that is nearest to `point`: the edge's first corner and how
/// far along the edge.
pub(crate) fn nearest_on_border(polygon: &[DVec2], point: DVec2) -> (usize, f64) {
    let on_edge = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let along = b - a;
        let t = (point - a).dot(along) / along.length_squared();
        // Not a number on an edge without length.
        let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
        ((a + along * t).distance_squared(point), t)
    };
    let nearest = (0..polygon.len())
        .map(|i| (i, on_edge(i)))
        .reduce(|a, b| if b.1.0 < a.1.0 { b } else { a });
    nearest.map_or((0, 0.0), |(i, (_, t))| (i, t))
}

#[expect(
    clippy::reversed_empty_ranges,
    reason = "an inclusive range of nothing"
)]
const NOTHING: RangeInclusive<usize> = 1..=0;

/// Unit intervals [i, i + 1] of `0..count` that touch [min, max].
fn touched(min: f64, max: f64, count: usize) -> RangeInclusive<usize> {
    let (low, high) = (min - DOUBT, max + DOUBT);
    if count == 0 || high < 0.0 || low > count as f64 || min > max {
        return NOTHING;
    }
    // Conversion rounds towards zero, and is much faster than `floor` where that is a call.
    let below = low.max(0.0) as u32 as usize;
    let ends_there = below as f64 == low && below > 0;
    let last = (high.min(count as f64) as u32 as usize).min(count - 1);
    below - usize::from(ends_there)..=last
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Whether the polygon, cut to the closed square by its four sides one after the other,
    /// keeps a point.
    fn touches(polygon: &[DVec2], x: usize, y: usize) -> bool {
        let (x, y) = (x as f64, y as f64);
        let sides: [(DVec2, f64); 4] = [
            (DVec2::X, x),
            (-DVec2::X, -x - 1.0),
            (DVec2::Y, y),
            (-DVec2::Y, -y - 1.0),
        ];
        let mut rest = polygon.to_vec();
        for (normal, offset) in sides {
            let distance = |p: DVec2| p.dot(normal) - offset;
            let n = rest.len();
            rest = (0..n)
                .flat_map(|i| {
                    let (a, b) = (rest[i], rest[(i + 1) % n]);
                    let (da, db) = (distance(a), distance(b));
                    let cut = (da * db < 0.0).then(|| a + (b - a) * (da / (da - db)));
                    (da >= 0.0).then_some(a).into_iter().chain(cut)
                })
                .collect();
        }
        !rest.is_empty()
    }

    /// Triangles, segments and points, also on texel borders and corners.
    fn polygons() -> impl Strategy<Value = Vec<DVec2>> {
        let coordinate = prop_oneof![3 => -3.0..12.0f64, 1 => (-3..12i32).prop_map(f64::from)];
        let point = prop::array::uniform2(coordinate).prop_map(DVec2::from);
        prop_oneof![
            prop::collection::vec(point.clone(), 1..=3),
            point.prop_map(|p| vec![p, p, p]),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Exactly the texels whose closed squares meet the polygon are touched; in doubt more.
        #[test]
        fn touched_texels_are_those_whose_closed_squares_meet_the_polygon(polygon in polygons()) {
            let (width, height) = (9, 8);
            let outline = Outline::new(&polygon);
            let rows = outline.rows(height);
            for y in 0..height {
                let columns = if rows.contains(&y) { outline.columns(y, width) } else { NOTHING };
                for x in 0..width {
                    let found = rows.contains(&y) && columns.contains(&x);
                    if touches(&polygon, x, y) {
                        prop_assert!(found, "({x}, {y}) is missing");
                    } else if found {
                        // Only a doubtful square: the polygon touches it when swollen a little.
                        let near = |d: DVec2| {
                            let moved: Vec<_> = polygon.iter().map(|p| *p + d).collect();
                            touches(&moved, x, y)
                        };
                        let d = 2.0 * DOUBT;
                        let doubtful = [(d, d), (d, -d), (-d, d), (-d, -d)]
                            .into_iter().any(|(x, y)| near(DVec2::new(x, y)));
                        prop_assert!(doubtful, "({x}, {y}) is too much");
                    }
                }
            }
        }

        /// No sample of the border is nearer than the nearest point found.
        #[test]
        fn nearest_is_nearest(polygon in polygons(), x in -3.0..12.0f64, y in -3.0..12.0f64) {
            let point = DVec2::new(x, y);
            let at = |i: usize, t: f64| polygon[i].lerp(polygon[(i + 1) % polygon.len()], t);
            let (i, t) = nearest_on_border(&polygon, point);
            let distance = at(i, t).distance(point);
            for i in 0..polygon.len() {
                for t in 0..=16 {
                    prop_assert!(at(i, f64::from(t) / 16.0).distance(point) >= distance - 1e-12);
                }
            }
        }
    }
}
