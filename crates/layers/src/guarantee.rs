//! What a given stack of layers guarantees for a given view cell.

use crate::depth_range::{nearest_depth, parallax_between};
use crate::texel::least_approach;
use crate::{Aim, Layer, LayerStack, PromisedCamera, corners_in_view, displacement};
use crate::{smallest_texel, texel_size};
use farfield_views::{Extent, ViewCell};
use glam::{DVec2, DVec3, DVec4};

/// The greatest errors that a stack of layers shows to a view cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarantee {
    /// How far two neighbouring layers are displaced against each other, at most, in texels on
    /// either axis, seen by any ray of the cell that passes within a texel of the extent in both.
    /// 1 or less proves that no texel uncovers more than the one behind it: no gaps. 0 where
    /// there is at most one layer.
    pub disparity: f64,
    /// The nearer of the two layers that are displaced most; 0 where there is no second one.
    pub disparity_layer: usize,
    /// The least side of a texel seen from anywhere in the cell, in pixels, on an image plane
    /// parallel to the layers: [`smallest_texel`]. 0 for a cell without end.
    pub smallest_texel_px: f64,
    /// The greatest side of a texel within the represented box, in pixels of a camera anywhere in
    /// the cell that looks at the box's centre, where a texel counts as far away as it is along
    /// that camera's own axis: see [`texel_size`]. 1 or less proves that texels are not magnified.
    /// For a camera that looks anywhere, where it looks straight at a texel.
    /// Infinite if the box reaches beside or behind such a camera.
    pub greatest_texel_px: f64,
    /// How far a point of a layer's depth range is shown from where it belongs, at most, in
    /// pixels, on an image plane parallel to the layers: the distance between the images of the
    /// point and of where its ray from the reference viewpoint meets the layer. It is exact over
    /// all viewpoints of the cell and all rays within the extent.
    ///
    /// A camera that is tilted against the layers sees at most this times
    /// |A| / (A . f) D / (B . f), with A and B from the viewpoint to the point and to where it is
    /// shown, f the camera's direction, and D the depth of B along the axis of the layers: A and B
    /// are seen at a = A / A_z and b = B / D on the plane parallel to the layers, and
    /// |f x (a x b)| / ((a . f) (b . f)) apart on the camera's, where |a x b| = |a x (b - a)|.
    /// The second quotient is mostly below 1 where the tilt, and with it the parallax, is great. In
    /// seven set-ups of a house 30 to 500 m before a cell of 100 m, with fields of view of 45 and 90
    /// degrees and 4,000 viewpoints each, the camera's own pixels saw 0.36 to 0.99 of this.
    pub parallax_px: f64,
    /// The layer with the greatest parallax; 0 where there is none.
    pub parallax_layer: usize,
}

/// A stack whose layers do not fit together, or do not suit the view cell.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InconsistentStack {
    /// Texels have no size, or one that differs between rows and columns.
    #[error("its texels are {width} wide and {height} high per unit of depth, which is no square")]
    Texels {
        /// A slope.
        width: f64,
        /// A slope.
        height: f64,
    },
    /// The cell reaches as far along the axis as what a layer holds.
    #[error("layer {layer} holds depths from {near}, but the view cell ends at {cell_end}")]
    CellNotBefore {
        /// Index of the layer.
        layer: usize,
        /// Where its range begins.
        near: f64,
        /// The greatest depth of the cell, at least 0: the reference viewpoint counts as well.
        cell_end: f64,
    },
    /// A layer is not in its own range of depths, or the range is not finite.
    #[error("layer {layer} at depth {depth} is not in its range from {near} to {far}")]
    OutOfRange {
        /// Index of the layer.
        layer: usize,
        /// Where it is.
        depth: f64,
        /// Where its range begins.
        near: f64,
        /// Where its range ends.
        far: f64,
    },
    /// A layer does not lie behind the one before.
    #[error("layer {layer} at depth {depth} is not behind the one before, at {before}")]
    OutOfOrder {
        /// Index of the layer.
        layer: usize,
        /// Where it is.
        depth: f64,
        /// Where the one before is.
        before: f64,
    },
    /// A range of depths does not begin where the one before ends.
    #[error("the range of layer {layer} begins at {near}, where the one before ends at {far}")]
    NotJoined {
        /// Index of the layer.
        layer: usize,
        /// Where its range begins.
        near: f64,
        /// Where the range of the one before ends.
        far: f64,
    },
}

/// What a stack of layers, from wherever it comes, guarantees for a view cell: the inverse of
/// [`stack`](crate::stack()), which finds the layers for given limits.
///
/// Nothing is taken on trust but the stack itself: the figures follow from its depths, extent and
/// pose as they are. They are the greatest over the whole cell, not over samples of it.
///
/// * `represented` - least and greatest corner of the represented box in the world
/// * `camera` - the one that the stack is made for
///
/// # Errors
///
/// When the layers' depths do not ascend, a range does not hold its layer or does not begin where
/// the one before ends, texels are not square, or the cell does not lie wholly before the
/// layers.
pub fn guarantee(
    stack: &LayerStack,
    cell: &ViewCell,
    represented: [DVec3; 2],
    camera: &PromisedCamera,
) -> Result<Guarantee, InconsistentStack> {
    let corners = corners_in_view(&stack.pose, cell);
    check(stack, &corners)?;
    let (disparity, disparity_layer) = greatest_disparity(stack, &corners);
    let (parallax, parallax_layer) = greatest_parallax(stack, &corners);
    let pixel = camera.pixel();
    let largest = match camera.aim {
        Aim::Center => texel_size(&stack.pose, cell, represented, pixel),
        Aim::Anywhere => {
            let ends = stack.layers.first().zip(stack.layers.last());
            let depths = ends.map_or([1.0; 2], |(first, last)| [first.depth, last.depth]);
            pixel * least_approach(depths, &corners)
        }
    };
    Ok(Guarantee {
        disparity,
        disparity_layer,
        smallest_texel_px: smallest_texel(stack, &corners, camera),
        greatest_texel_px: if largest > 0.0 {
            stack.texel() / largest
        } else {
            f64::INFINITY
        },
        parallax_px: parallax / pixel,
        parallax_layer,
    })
}

/// The greatest displacement between neighbouring layers, in texels, and the nearer layer of the
/// two.
fn greatest_disparity(stack: &LayerStack, corners: &[DVec4]) -> (f64, usize) {
    let texel = stack.texel();
    // Rays that enter or leave the extent between two layers count too.
    let wide = Extent {
        min: stack.extent.min - texel,
        max: stack.extent.max + texel,
    };
    let mut greatest = (0.0, 0);
    for (i, pair) in stack.layers.windows(2).enumerate() {
        let moved = displacement(pair[0].depth, pair[1].depth, &wide, corners) / texel;
        if moved > greatest.0 {
            greatest = (moved, i);
        }
    }
    greatest
}

/// The greatest parallax between a layer and the borders of its range, as a slope, and the layer.
fn greatest_parallax(stack: &LayerStack, corners: &[DVec4]) -> (f64, usize) {
    let mut greatest = (0.0, 0);
    for (i, layer) in stack.layers.iter().enumerate() {
        for [near, far] in [[layer.near, layer.depth], [layer.depth, layer.far]] {
            let parallax = parallax_between(near, far, &stack.extent, corners, greatest.0);
            if parallax > greatest.0 {
                greatest = (parallax, i);
            }
        }
    }
    greatest
}

fn check(stack: &LayerStack, corners: &[DVec4]) -> Result<(), InconsistentStack> {
    let Extent { min, max } = stack.extent;
    let texel = (max - min) / DVec2::new(f64::from(stack.width), f64::from(stack.height));
    // Each bound of the extent is rounded a few times.
    let rounding = (min.abs() + max.abs()).max_element() * 4.0 * f64::EPSILON
        / f64::from(stack.width.min(stack.height));
    let square = texel.min_element() > 0.0 && (texel.x - texel.y).abs() <= rounding;
    if !square {
        return Err(InconsistentStack::Texels {
            width: texel.x,
            height: texel.y,
        });
    }
    let ahead = corners.iter().any(|v| v.w == 0.0 && v.z >= 0.0);
    let cell_end = match ahead {
        true => f64::INFINITY,
        false => nearest_depth(corners).max(0.0),
    };
    let mut before: Option<&Layer> = None;
    for (i, layer) in stack.layers.iter().enumerate() {
        check_layer(i, layer, before, cell_end)?;
        before = Some(layer);
    }
    Ok(())
}

/// Whether layer `i` suits the one before and the cell. What is not a number suits nothing.
fn check_layer(
    i: usize,
    layer: &Layer,
    before: Option<&Layer>,
    cell_end: f64,
) -> Result<(), InconsistentStack> {
    let &Layer { depth, near, far } = layer;
    let holds = near <= depth && depth <= far && far.is_finite();
    if !holds {
        return Err(InconsistentStack::OutOfRange {
            layer: i,
            depth,
            near,
            far,
        });
    }
    if near <= cell_end {
        return Err(InconsistentStack::CellNotBefore {
            layer: i,
            near,
            cell_end,
        });
    }
    let Some(before) = before else {
        return Ok(());
    };
    if depth <= before.depth {
        return Err(InconsistentStack::OutOfOrder {
            layer: i,
            depth,
            before: before.depth,
        });
    }
    if near != before.far {
        return Err(InconsistentStack::NotJoined {
            layer: i,
            near,
            far: before.far,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{
        Setup, cells_before_boxes, parallax, slope_behind, stacks, viewpoint, weights,
    };
    use crate::{Bounds, Precision, SAFE_DISPARITY, plan, stack};
    use farfield_views::{Camera, Pose};
    use glam::DVec3;
    use proptest::prelude::*;
    use proptest::sample::Index;

    const CAMERA: PromisedCamera = PromisedCamera {
        aim: Aim::Center,
        fov: std::f64::consts::FRAC_PI_4,
        resolution: 64,
    };

    fn pose() -> Pose {
        Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z)
    }

    /// The stack of `setup` with layers moved and left out, ranges joined again.
    fn tampered(
        (setup, bounds, precision): &(Setup, Bounds, Precision),
        keep: &[bool],
        shares: &[f64],
    ) -> LayerStack {
        let mut stack = stack(&pose(), bounds, precision, &setup.corners).unwrap();
        let kept = stack.layers.iter().zip(keep.iter().cycle());
        let mut layers: Vec<Layer> = kept.filter(|(_, keep)| **keep).map(|(l, _)| *l).collect();
        for (layer, share) in layers.iter_mut().zip(shares.iter().cycle()) {
            layer.depth = layer.near + (layer.far - layer.near) * share;
        }
        for i in 1..layers.len() {
            layers[i].near = layers[i - 1].far;
        }
        stack.layers = layers;
        stack
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        /// What was made for limits keeps them.
        #[test]
        fn stacks_guarantee_what_they_were_made_for((setup, bounds, precision) in stacks()) {
            let stack = stack(&pose(), &bounds, &precision, &setup.corners).unwrap();
            prop_assert_eq!(check(&stack, &setup.corners), Ok(()));
            let (disparity, _) = greatest_disparity(&stack, &setup.corners);
            // The extent, of a few units, is rounded, and its texels, of at least 1e-4, with it.
            // Depths of up to 25 are rounded as well, and differ by 1e-6 and more.
            prop_assert!(disparity <= precision.disparity * (1.0 + 1e-8), "{disparity}");
            let mut ends = stack.clone();
            let last = ends.layers.len() - 1;
            for (i, layer) in ends.layers.iter_mut().enumerate() {
                layer.near = if i == 0 { layer.near } else { layer.depth };
                layer.far = if i == last { layer.far } else { layer.depth };
            }
            let (parallax, _) = greatest_parallax(&ends, &setup.corners);
            prop_assert!(parallax <= precision.parallax * (1.0 + 1e-8), "{parallax}");
        }

        /// Whatever the layers' depths are, no viewpoint sees more than is guaranteed, and where
        /// that is a texel, no ray that passes through the extent in either layer does.
        #[test]
        fn no_viewpoint_sees_more_than_guaranteed(
            case in stacks(),
            keep in prop::collection::vec(prop::bool::weighted(0.8), 5),
            shares in prop::collection::vec(0.0..=1.0f64, 7),
            rays in prop::collection::vec(
                (weights(), prop::array::uniform2(-0.1..=1.1f64), 0.0..=1.0f64), 40),
        ) {
            let stack = tampered(&case, &keep, &shares);
            prop_assume!(check(&stack, &case.0.corners) == Ok(()));
            let LayerStack { extent, layers, .. } = &stack;
            let texel = stack.texel();
            let corners = &case.0.corners;
            let (disparity, at_most) = greatest_disparity(&stack, corners);
            let (most_parallax, farthest) = greatest_parallax(&stack, corners);
            prop_assert!(at_most < layers.len().max(1) && farthest < layers.len().max(1));
            for (weights, at, share) in rays {
                let Some(eye) = viewpoint(corners, &weights) else { continue };
                let slope = extent.min + extent.size() * DVec2::from(at);
                for pair in layers.windows(2) {
                    let behind = slope_behind(eye, slope, pair[0].depth, pair[1].depth);
                    for axis in 0..2 {
                        let (min, max) = (extent.min[axis], extent.max[axis]);
                        let in_wide = |x: f64| min - texel <= x && x <= max + texel;
                        let inside = |x: f64| min <= x && x <= max;
                        let bounded = in_wide(slope[axis]) && in_wide(behind[axis])
                            || disparity <= 1.0 && (inside(slope[axis]) || inside(behind[axis]));
                        let moved = (behind[axis] - slope[axis]).abs() / texel;
                        // As in the spacing's test, in texels of at least 1e-4.
                        prop_assert!(!bounded || moved <= disparity + 1e-6, "{moved}");
                    }
                }
                let slope = slope.clamp(extent.min, extent.max);
                for layer in layers {
                    let depth = layer.near + (layer.far - layer.near) * share;
                    let seen = parallax(eye, slope, depth, layer.depth);
                    prop_assert!(seen <= most_parallax * (1.0 + 1e-9) + 1e-10, "{seen}");
                }
            }
        }

        /// Layers that do not fit together are found, and which.
        #[test]
        fn inconsistent_layers_are_found(
            (setup, bounds, precision) in stacks(), layer in any::<Index>(), how in 0..8usize,
        ) {
            let mut stack = stack(&pose(), &bounds, &precision, &setup.corners).unwrap();
            let i = layer.index(stack.layers.len());
            let last = stack.layers.len() - 1;
            let Layer { depth, far, .. } = stack.layers[i];
            let expected = match how {
                0 => {
                    stack.layers[i].depth = far * 1.01;
                    ("is not in its range", i)
                }
                1 => {
                    stack.layers[i].near = f64::NAN;
                    ("is not in its range", i)
                }
                2 => {
                    stack.layers[last].far = f64::INFINITY;
                    ("is not in its range", last)
                }
                3 => {
                    stack.layers[i].far = depth;
                    stack.layers.insert(i + 1, Layer { depth, near: depth, far });
                    ("is not behind the one before", i + 1)
                }
                4 => {
                    stack.layers[0].near = -1e9;
                    ("but the view cell ends", 0)
                }
                5 => {
                    stack.layers.push(Layer { depth: 1e3, near: 999.0, far: 1e3 });
                    ("where the one before ends", last + 1)
                }
                6 => {
                    stack.width += 1;
                    ("which is no square", 0)
                }
                _ => {
                    stack.extent.max = stack.extent.min;
                    ("which is no square", 0)
                }
            };
            let error = check(&stack, &setup.corners).unwrap_err();
            let layer = match error {
                InconsistentStack::Texels { .. } => 0,
                InconsistentStack::CellNotBefore { layer, .. }
                | InconsistentStack::OutOfRange { layer, .. }
                | InconsistentStack::OutOfOrder { layer, .. }
                | InconsistentStack::NotJoined { layer, .. } => layer,
            };
            prop_assert!(error.to_string().contains(expected.0), "{error}");
            prop_assert_eq!(layer, expected.1);
        }
    }

    proptest! {
        // Plans take long: they compare many places for the viewpoint.
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Texels are never seen larger or smaller than guaranteed.
        #[test]
        fn texels_are_as_large_as_guaranteed(
            (cell, represented) in cells_before_boxes(),
            eyes in prop::collection::vec(prop::array::uniform3(0.0..=1.0f64), 20),
            places in prop::collection::vec(prop::array::uniform3(0.0..=1.0f64), 20),
        ) {
            let Ok(stack) = plan(&cell, represented, &CAMERA) else { return Ok(()) };
            let found = guarantee(&stack, &cell, represented, &CAMERA).unwrap();
            prop_assert!((found.greatest_texel_px - 1.0).abs() < 1e-9);
            let endless = matches!(cell, ViewCell::Shaft { far, .. } if far.is_infinite());
            prop_assert_eq!(found.smallest_texel_px == 0.0, endless);
            let center = (represented[0] + represented[1]) / 2.0;
            for (eye, place) in eyes.into_iter().zip(places) {
                let eye = DVec3::from(eye);
                // The far end of some shafts is at infinity.
                let eye = cell.point(eye.with_z(eye.z.min(0.999)));
                let camera = Camera::looking_at(eye, center, CAMERA.fov, CAMERA.resolution);
                let place = represented[0] + (represented[1] - represented[0]) * DVec3::from(place);
                let texel = stack.texel() * stack.pose.point_in_view(place).z;
                let pixels = texel / (CAMERA.pixel() * camera.pose.point_in_view(place).z);
                prop_assert!(pixels <= found.greatest_texel_px + 1e-9, "{pixels}");
                for layer in &stack.layers {
                    let behind = layer.depth - stack.pose.point_in_view(eye).z;
                    let pixels = stack.texel() * layer.depth / (CAMERA.pixel() * behind);
                    prop_assert!(pixels >= found.smallest_texel_px - 1e-9, "{pixels}");
                }
            }
        }

        /// A larger cell sees no less disparity and parallax.
        #[test]
        fn a_larger_cell_sees_no_less(
            (cell, represented) in cells_before_boxes(), factor in 1.0..2.0f64,
        ) {
            let Ok(stack) = plan(&cell, represented, &CAMERA) else { return Ok(()) };
            let found = guarantee(&stack, &cell, represented, &CAMERA).unwrap();
            let larger = guarantee(&stack, &enlarged(&cell, factor), represented, &CAMERA);
            // It may reach into what is represented.
            let Ok(larger) = larger else { return Ok(()) };
            prop_assert!(larger.disparity >= found.disparity * (1.0 - 1e-9));
            prop_assert!(larger.parallax_px >= found.parallax_px * (1.0 - 1e-9));
        }
    }

    /// Before the house of the plan's tests, the stack has hardly any slack: it guarantees
    /// little less than it was made for, and more than a texel and a pixel to a cell larger by
    /// 30 %, in which disparity is 1.34 to 1.60 times as large.
    #[test]
    fn a_cell_larger_by_a_third_sees_gaps() {
        for distance in [90.0, 110.0, 140.0, 180.0, 250.0, 500.0] {
            let cell = ViewCell::Box {
                center: DVec3::new(0.0, 0.0, 50.0),
                size: DVec3::splat(100.0),
            };
            let far = DVec3::new(-10.0, -10.0, -distance - 40.0);
            let house = [far, DVec3::new(10.0, 10.0, -distance)];
            let camera = PromisedCamera {
                aim: Aim::Center,
                resolution: 512,
                ..CAMERA
            };
            let stack = plan(&cell, house, &camera).unwrap();
            let found = guarantee(&stack, &cell, house, &camera).unwrap();
            let slack = found.disparity / SAFE_DISPARITY;
            assert!((0.9..=1.0).contains(&slack), "{found:?}");
            // An eighth, and what tilted cameras magnify, is kept in reserve.
            assert!((0.7..=0.875).contains(&found.parallax_px), "{found:?}");
            assert!(found.disparity_layer + 1 < stack.layers.len());
            assert!(found.smallest_texel_px > 0.4 && found.smallest_texel_px < 1.0);
            let larger = guarantee(&stack, &enlarged(&cell, 1.3), house, &camera).unwrap();
            assert!(larger.disparity > 1.0 && larger.parallax_px > 1.0);
            assert!((1.3..1.65).contains(&(larger.disparity / found.disparity)));
        }
    }

    /// A stack without layers shows nothing wrong, and one layer is not displaced.
    #[test]
    fn few_layers_are_not_displaced() {
        let cell = ViewCell::Box {
            center: DVec3::ZERO,
            size: DVec3::ONE,
        };
        let house = [DVec3::new(-1.0, -1.0, -9.0), DVec3::new(1.0, 1.0, -8.0)];
        let mut stack = plan(&cell, house, &CAMERA).unwrap();
        stack.layers.truncate(1);
        let found = guarantee(&stack, &cell, house, &CAMERA).unwrap();
        assert_eq!((found.disparity, found.disparity_layer), (0.0, 0));
        assert!(found.parallax_px > 0.0);
        stack.layers.clear();
        let found = guarantee(&stack, &cell, house, &CAMERA).unwrap();
        assert_eq!((found.disparity, found.parallax_px), (0.0, 0.0));
        assert_eq!(found.smallest_texel_px, f64::INFINITY);
    }

    /// A cell that reaches `factor` times as far from its centre.
    fn enlarged(cell: &ViewCell, factor: f64) -> ViewCell {
        match *cell {
            ViewCell::Box { center, size } => ViewCell::Box {
                center,
                size: size * factor,
            },
            ViewCell::Shaft {
                apex,
                axis,
                half_angle,
                near,
                far,
            } => ViewCell::Shaft {
                apex,
                axis,
                half_angle: (half_angle.tan() * factor).atan(),
                near,
                far,
            },
        }
    }
}
