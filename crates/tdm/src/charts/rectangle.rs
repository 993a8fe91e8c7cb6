//! The tightest rectangle around points, which may be turned.

use glam::DVec2;

/// A turned rectangle of texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    /// Of length 1, along the longer side.
    along: DVec2,
    /// Added to a place along the rectangle's sides, in texels.
    offset: DVec2,
    density: f64,
    /// In texels, the gutter included.
    pub size: [u32; 2],
}

impl Rectangle {
    /// The tightest that holds a convex `hull` of `density` texels per unit, and `gutter` texels
    /// around it.
    ///
    /// One of its sides is flush with an edge of the hull: while none is, two or four corners of the
    /// hull touch the sides, width and height are those of these corners' diagonals, and turning
    /// one way or the other makes the rectangle smaller.
    pub(super) fn around(hull: &[DVec2], density: f64, gutter: u32) -> Self {
        let next = hull.iter().cycle().skip(1);
        let edges = hull
            .iter()
            .zip(next)
            .map(|(a, b)| (b - a).normalize_or(DVec2::X));
        edges
            .map(|along| Self::flush(hull, along, density, gutter))
            .min_by_key(Self::area)
            .expect("a hull has a point")
    }

    fn flush(hull: &[DVec2], along: DVec2, density: f64, gutter: u32) -> Self {
        let (mut least, mut most) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for point in hull {
            let turned = DVec2::new(along.dot(*point), along.perp_dot(*point));
            (least, most) = (least.min(turned), most.max(turned));
        }
        let extent = (most - least) * density;
        if extent.x < extent.y {
            let down = along.perp();
            return Self::flush_lying(
                down,
                DVec2::new(least.y, -most.x),
                DVec2::new(extent.y, extent.x),
                density,
                gutter,
            );
        }
        Self::flush_lying(along, least, extent, density, gutter)
    }

    fn flush_lying(along: DVec2, least: DVec2, extent: DVec2, density: f64, gutter: u32) -> Self {
        let inside = (extent - ROUNDING).ceil().max(DVec2::ONE);
        let gutter = DVec2::splat(gutter.into());
        Self {
            along,
            offset: (inside - extent) / 2.0 + gutter - least * density,
            density,
            size: (inside + 2.0 * gutter).to_array().map(|side| side as u32),
        }
    }

    /// In texels.
    pub(super) fn area(&self) -> u64 {
        self.size.iter().map(|side| u64::from(*side)).product()
    }

    /// Where in the rectangle a point is, in texels from its upper left corner.
    pub(super) fn place(&self, point: DVec2) -> DVec2 {
        let turned = DVec2::new(self.along.dot(point), self.along.perp_dot(point));
        turned * self.density + self.offset
    }
}

/// By how much a side may be shorter than what is in it, in texels, lest rounding costs a column.
pub(super) const ROUNDING: f64 = 1e-3;

/// The corners of the convex hull of points: from the least x to the most along one side, and back
/// along the other.
pub(super) fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut chain: Vec<DVec2> = Vec::with_capacity(points.len() + 1);
    let turns = |chain: &[DVec2], point: DVec2| match *chain {
        [.., a, b] => (b - a).perp_dot(point - b) > 0.0,
        _ => true,
    };
    for point in &points {
        while !turns(&chain, *point) {
            chain.pop();
        }
        chain.push(*point);
    }
    let lower = chain.len() - 1;
    for point in points.iter().rev().skip(1) {
        while !turns(&chain[lower..], *point) {
            chain.pop();
        }
        chain.push(*point);
    }
    chain.pop();
    chain
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Points of a grid, many of them in line but for what is rounded.
    fn points() -> impl Strategy<Value = Vec<DVec2>> {
        let point = (0..6i32, 0..9i32, -9..9i32, -9..9i32).prop_map(|(x, y, i, j)| {
            let rounded = DVec2::new(f64::from(i), f64::from(j)) * 1e-15;
            DVec2::new(f64::from(x), f64::from(y)) + rounded
        });
        prop::collection::vec(point, 1..20)
    }

    proptest! {
        /// All points are in the rectangle, the gutter off its sides; no other direction gives a
        /// smaller one, each side of it up to a texel longer for whole texels.
        #[test]
        fn the_tightest_holds_all_points(
            points in points(),
            density in 0.5..3.0,
            gutter in 0..4u32,
        ) {
            let found = Rectangle::around(&hull(points.clone()), density, gutter);
            let size = DVec2::from(found.size.map(f64::from));
            for point in &points {
                let place = found.place(*point);
                let inside = place.min(size - place).min_element();
                prop_assert!(inside >= f64::from(gutter) - ROUNDING, "{inside} from a side");
            }
            for degrees in 0..90 {
                let along = DVec2::from_angle(f64::from(degrees).to_radians());
                let turned = points.iter().map(|p| DVec2::new(along.dot(*p), along.perp_dot(*p)));
                let (least, most) = turned.fold(
                    (DVec2::INFINITY, DVec2::NEG_INFINITY),
                    |(least, most), p| (least.min(p), most.max(p)),
                );
                let sides = (most - least) * density + 1.0 + 2.0 * f64::from(gutter);
                prop_assert!(found.area() as f64 <= sides.x * sides.y + 1e-6);
            }
        }
    }
}
