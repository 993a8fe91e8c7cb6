//! Generators and brute force shared by this crate's tests.

use crate::{Bounds, Precision};
use farfield_views::{Extent, ViewCell};
use glam::{DVec2, DVec3, DVec4};
use proptest::collection::vec;
use proptest::prelude::*;

/// A convex cell, given by its corners, and a plane at `depth` before it.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) corners: Vec<DVec4>,
    pub(crate) extent: Extent,
    pub(crate) depth: f64,
}

/// Cells of all shapes, in front of, around and beside the reference viewpoint: points, flat
/// ones, slivers, some with corners at infinity; extents off the axis.
pub(crate) fn setups() -> impl Strategy<Value = Setup> {
    let corner = (
        prop::array::uniform3(-1.0..1.0f64),
        prop::bool::weighted(0.2),
    );
    let sizes = prop::array::uniform3(prop_oneof![Just(0.0), 0.01..3.0f64]);
    let slopes = (
        prop::array::uniform2(-1.5..1.5f64),
        prop::array::uniform2(0.01..2.0f64),
    );
    (
        vec(corner, 1..9),
        sizes,
        slopes,
        0.05..10.0f64,
        prop::bool::ANY,
    )
        .prop_map(|(corners, sizes, (min, size), depth, infinite)| {
            let corners: Vec<_> = corners
                .into_iter()
                .enumerate()
                .map(|(i, (c, at_infinity))| {
                    let c = DVec3::from(c) * DVec3::from(sizes);
                    // The first corner is finite, so that the cell is not all at infinity.
                    if infinite && at_infinity && i > 0 {
                        DVec4::new(c.x, c.y, -c.z.abs() - 0.1, 0.0)
                    } else {
                        c.extend(1.0)
                    }
                })
                .collect();
            let end = corners
                .iter()
                .filter(|c| c.w > 0.0)
                .map(|c| c.z)
                .fold(0.0, f64::max);
            let min = DVec2::from(min);
            Setup {
                corners,
                extent: Extent {
                    min,
                    max: min + DVec2::from(size),
                },
                depth: end + depth,
            }
        })
}

/// What is represented, before a cell; texels of which at most 64 fit in.
pub(crate) fn stacks() -> impl Strategy<Value = (Setup, Bounds, Precision)> {
    let range = prop_oneof![Just(0.0), 0.01..20.0f64];
    (setups(), range, 1.0..64.0f64, 0.5..=1.0f64, 0.1..2.0f64).prop_map(
        |(setup, range, texels, disparity, pixel)| {
            let bounds = Bounds {
                extent: setup.extent,
                near: setup.depth,
                far: setup.depth + range,
            };
            let texel = setup.extent.size().max_element() / texels;
            let precision = Precision {
                texel,
                disparity,
                parallax: texel * pixel,
            };
            (setup, bounds, precision)
        },
    )
}

/// Boxes of all shapes before cells of all shapes, along -z.
pub(crate) fn cells_before_boxes() -> impl Strategy<Value = (ViewCell, [DVec3; 2])> {
    let vector = |range: std::ops::Range<f64>| prop::array::uniform3(range).prop_map(DVec3::from);
    let size = || {
        prop::array::uniform3(prop_oneof![Just(0.0), Just(1.0), 0.01..3.0f64]).prop_map(DVec3::from)
    };
    let boxes =
        (size(), size(), vector(-2.0..2.0), 0.1..5.0f64).prop_map(|(cell, object, shift, gap)| {
            let from = -object / 2.0;
            let center = shift.with_z(object.z / 2.0 + gap + cell.z / 2.0);
            (ViewCell::Box { center, size: cell }, [from, from + object])
        });
    let shafts = (
        size(),
        vector(-0.2..0.2),
        0.0..1.2f64,
        0.1..5.0f64,
        0.0..9.0f64,
    )
        .prop_map(|(object, tilt, half_angle, gap, depth)| {
            let near = object.length() / 2.0 + gap;
            let far = if depth > 6.0 {
                f64::INFINITY
            } else {
                near + depth
            };
            let axis = DVec3::Z + tilt;
            let shaft = ViewCell::Shaft {
                apex: DVec3::ZERO,
                axis,
                half_angle,
                near,
                far,
            };
            (shaft, [-object / 2.0, object / 2.0])
        });
    prop_oneof![boxes, shafts]
}

/// Weights of a cell's corners, many of them zero, so that corners, edges and faces come up.
pub(crate) fn weights() -> impl Strategy<Value = Vec<f64>> {
    vec(prop_oneof![Just(0.0), 0.0..1.0f64], 8)
}

/// The point of a cell with the given weights of its corners; `None` at infinity.
pub(crate) fn viewpoint(corners: &[DVec4], weights: &[f64]) -> Option<DVec3> {
    let sum: DVec4 = corners.iter().zip(weights).map(|(c, w)| *c * *w).sum();
    (sum.w > 1e-3).then(|| sum.truncate() / sum.w)
}

/// All corners that are points, and far points of the edges that lead to the others.
pub(crate) fn corner_points(corners: &[DVec4]) -> Vec<DVec3> {
    let finite = corners
        .iter()
        .filter(|c| c.w > 0.0)
        .map(|c| c.truncate() / c.w);
    let far = |c: &DVec4| {
        finite
            .clone()
            .map(|f| f + c.truncate() * 1e6)
            .collect::<Vec<_>>()
    };
    let infinite = corners.iter().filter(|c| c.w == 0.0).flat_map(far);
    finite.clone().chain(infinite).collect()
}

/// The slope at which the plane at `far` is seen from the origin, where a ray from `eye` passes
/// that meets the plane at `near` at `slope`.
pub(crate) fn slope_behind(eye: DVec3, slope: DVec2, near: f64, far: f64) -> DVec2 {
    let there = (slope * near).extend(near);
    let behind = eye + (there - eye) * ((far - eye.z) / (near - eye.z));
    behind.truncate() / behind.z
}

/// How far apart the points at two depths on the origin's ray at `slope` are seen from `eye`, on an
/// image plane at unit distance.
pub(crate) fn parallax(eye: DVec3, slope: DVec2, near: f64, far: f64) -> f64 {
    let seen = |depth: f64| {
        let p = (slope * depth).extend(depth) - eye;
        p.truncate() / p.z
    };
    seen(near).distance(seen(far))
}
