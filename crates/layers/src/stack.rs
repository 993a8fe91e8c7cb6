//! A whole stack of layers for given bounds.

use crate::depth_range::nearest_depth;
use crate::{border_between, depth_range_behind, next_layer};
use farfield_views::{Extent, Pose, ViewCell};
use glam::{DVec2, DVec3, DVec4};

/// The share of a texel that neighbouring layers may move against each other, so that pinholes
/// stay shut on renderers that snap vertices to 1/16 of a pixel.
///
/// With 63/64 such a renderer showed pinholes, with 7/8 none, as long as a texel is at least
/// about 1/6 of a pixel wide; with less, layers multiply for nothing.
pub const SAFE_DISPARITY: f64 = 7.0 / 8.0;

/// The most texels a layer may have on a side: what graphics hardware takes as a texture.
pub const MAX_TEXTURE_SIDE: u32 = 16384;

/// The most layers in a stack; far fewer already cost more than most of what they replace.
pub const MAX_LAYERS: usize = 65535;

/// Where the layers of an impostor stand, what they show, and which depths each of them holds.
///
/// All lengths are in view space of `pose` (x right, y down, z forwards), in the world's unit.
///
/// ```text
///    view cell                      layer 0    layer 1     layer 2
///   ┌─────────┐              near  ┊   │    ┊     │     ┊     │   ┊  far
///   │         │                    ┊   │    ┊     │     ┊     │   ┊
///   │         P ─ ─ ─ ─ ─ ─ ─ ─ ─ ─┊─ ─│─ ─ ┊─ ─ ─│─ ─ ─┊─ ─ ─│─ ─┊─ ─ ▷ z, depth
///   │         │                    ┊   │    ┊     │     ┊     │   ┊
///   └─────────┘                    ├ range ─┼── range ──┼─ range ─┤
/// ```
///
/// Invariant of every stack made by this crate: there is at least one layer, depths increase,
/// and each range starts where the one before ends and holds its layer.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerStack {
    /// The reference viewpoint and the axis along which the layers are recorded.
    pub pose: Pose,
    /// The slopes that every layer covers: exactly `width` x `height` square texels.
    pub extent: Extent,
    /// Texels in a row of a layer.
    pub width: u32,
    /// Rows of texels in a layer.
    pub height: u32,
    /// Front to back.
    pub layers: Vec<Layer>,
}

/// One layer: a plane across the axis, and the depths of what it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Where the plane is.
    pub depth: f64,
    /// Where the range of depths that it holds begins, at most `depth`.
    pub near: f64,
    /// Where that range ends, at least `depth`; the next layer's `near`.
    pub far: f64,
}

impl LayerStack {
    /// Depths before the first, between neighbouring, and behind the last of the layers: one more
    /// than there are layers.
    pub fn borders(&self) -> Vec<f64> {
        let last = self.layers.last().map(|layer| layer.far);
        self.layers
            .iter()
            .map(|layer| layer.near)
            .chain(last)
            .collect()
    }

    /// Index of the layer whose range holds `depth`; a border belongs to the layer before it.
    ///
    /// Depths before the first range give the first layer, depths behind the last the last.
    ///
    /// # Panics
    ///
    /// When there are no layers.
    pub fn layer_at(&self, depth: f64) -> usize {
        assert!(
            !self.layers.is_empty(),
            "a stack without layers holds no depth"
        );
        let behind = self.layers.partition_point(|layer| layer.far < depth);
        behind.min(self.layers.len() - 1)
    }

    /// Side of a texel per unit of depth, in both directions.
    pub fn texel(&self) -> f64 {
        self.extent.size().x / f64::from(self.width)
    }
}

/// How exact a stack is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Side of a texel per unit of depth; positive. [`texel_size`](crate::texel_size) finds the
    /// largest that is never magnified.
    pub texel: f64,
    /// How far neighbouring layers may move against each other, in texels; above 0 and at most 1,
    /// usually [`SAFE_DISPARITY`].
    pub disparity: f64,
    /// Largest parallax of what lies before the first or behind the last layer, as a slope;
    /// positive, usually a pixel's side at unit distance.
    pub parallax: f64,
}

/// Tight bounds of what is represented, in view space of the reference viewpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Slopes of the outermost points.
    pub extent: Extent,
    /// Depth of the nearest point.
    pub near: f64,
    /// Depth of the farthest point.
    pub far: f64,
}

impl Bounds {
    /// The bounds of points in the world, seen from `pose`; what is bounded by vertices, as
    /// triangles are, is bounded by the vertices' bounds.
    ///
    /// # Errors
    ///
    /// When there is no point, one is not finite, or one is not before the viewpoint.
    pub fn of_points(
        pose: &Pose,
        points: impl IntoIterator<Item = DVec3>,
    ) -> Result<Self, StackError> {
        let mut bounds = Self {
            extent: Extent {
                min: DVec2::INFINITY,
                max: DVec2::NEG_INFINITY,
            },
            near: f64::INFINITY,
            far: f64::NEG_INFINITY,
        };
        let view_from_world = pose.view_from_world();
        for point in points {
            let p = view_from_world * (point - pose.eye);
            // A flat cloud of NaN must not pass, so the test is for what is wanted.
            if !(p.z > 0.0 && p.is_finite()) {
                return Err(StackError::PointNotBefore { depth: p.z });
            }
            let slope = p.truncate() / p.z;
            bounds.extent.min = bounds.extent.min.min(slope);
            bounds.extent.max = bounds.extent.max.max(slope);
            bounds.near = bounds.near.min(p.z);
            bounds.far = bounds.far.max(p.z);
        }
        if bounds.near.is_finite() {
            Ok(bounds)
        } else {
            Err(StackError::Empty)
        }
    }
}

/// Why there is no stack.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StackError {
    /// There is nothing to represent.
    #[error("there is nothing to represent")]
    Empty,
    /// A point to be represented has no finite depth before the reference viewpoint.
    #[error("a point at depth {depth} is not at a finite distance before the viewpoint")]
    PointNotBefore {
        /// Along the recording axis.
        depth: f64,
    },
    /// A number is NaN, infinite or out of range.
    #[error("{what} is {value}")]
    Invalid {
        /// Which, and what it should be.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// The view cell reaches as far along the recording axis as what is represented.
    #[error(
        "the view cell ends at depth {cell_end}, but what is represented starts at {start}: \
         it must lie wholly behind the cell"
    )]
    CellNotBefore {
        /// Greatest depth of the cell.
        cell_end: f64,
        /// Least depth of what is represented.
        start: f64,
    },
    /// The layers would have too many texels on a side.
    #[error(
        "a layer would have {width} x {height} texels, more than {MAX_TEXTURE_SIDE} on a side: \
         lower the resolution, shrink the cell or move it away"
    )]
    TextureTooLarge {
        /// Texels in a row.
        width: f64,
        /// Rows.
        height: f64,
    },
    /// The stack would have too many layers.
    #[error(
        "more than {MAX_LAYERS} layers would be needed: \
         lower the resolution, shrink the cell or move it away"
    )]
    TooManyLayers,
}

/// The corners of a view cell in view space of `pose`; (x, y, z, 0) is the direction of a corner
/// at infinity.
pub fn corners_in_view(pose: &Pose, cell: &ViewCell) -> [DVec4; 8] {
    let view_from_world = pose.view_from_world();
    cell.corners()
        .map(|c| (view_from_world * (c.truncate() - pose.eye * c.w)).extend(c.w))
}

/// The stack with the fewest layers that show what lies within `bounds` to all of a view cell
/// without gaps.
///
/// The extent is the bounds' widened evenly to whole texels, by half a texel or more on every side,
/// so that nothing touches the outermost border. Then:
///
/// - The first layer stands as far behind `bounds.near`, and `bounds.far` as far behind the last,
///   as [`depth_range_behind`] allows.
/// - Each layer stands as far behind the one before as [`next_layer`] allows, so that on a ray of
///   the cell that passes through the extent the displacement between neighbouring layers is at
///   most `precision.disparity` texels on either axis.
/// - Each border between two layers is where [`border_between`] puts it.
///
/// The last step is rarely as long as it could be. So all limits are then lowered by one common
/// factor, the smallest for which the number of layers stays the same: what slack there is makes
/// all errors smaller alike.
///
/// * `bounds` - of what is represented, in view space of `pose`
/// * `corners` - of the view cell, in view space of `pose`; see [`corners_in_view`]
///
/// # Errors
///
/// When the cell is not wholly before the bounds, there would be too many texels or layers, or
/// a number is not what it should be.
pub fn stack(
    pose: &Pose,
    bounds: &Bounds,
    precision: &Precision,
    corners: &[DVec4],
) -> Result<LayerStack, StackError> {
    check(bounds, precision, corners)?;
    let texels = texels(&bounds.extent, precision.texel)?;
    let extent = centered_extent(&bounds.extent, texels * precision.texel);
    let space = Space {
        bounds,
        extent: &extent,
        corners,
    };
    let depths = space
        .depths(precision, MAX_LAYERS)
        .ok_or(StackError::TooManyLayers)?;
    let depths = space.spread(precision, depths);

    let border = |i: usize| border_between(depths[i], depths[i + 1], corners);
    let layers = (0..depths.len())
        .map(|i| Layer {
            depth: depths[i],
            near: if i == 0 { bounds.near } else { border(i - 1) },
            far: if i + 1 == depths.len() {
                bounds.far
            } else {
                border(i)
            },
        })
        .collect();
    Ok(LayerStack {
        pose: *pose,
        extent,
        width: texels.x as u32,
        height: texels.y as u32,
        layers,
    })
}

/// Columns, rows and number of layers of the stack for the same arguments, or `None` if there
/// would be more than `limit` layers.
///
/// # Errors
///
/// As for [`stack`], but for the number of layers.
pub(crate) fn count_layers(
    bounds: &Bounds,
    precision: &Precision,
    corners: &[DVec4],
    limit: usize,
) -> Result<Option<(DVec2, usize)>, StackError> {
    check(bounds, precision, corners)?;
    let texels = texels(&bounds.extent, precision.texel)?;
    let extent = centered_extent(&bounds.extent, texels * precision.texel);
    let space = Space {
        bounds,
        extent: &extent,
        corners,
    };
    Ok(space
        .depths(precision, limit)
        .map(|depths| (texels, depths.len())))
}

fn check(bounds: &Bounds, precision: &Precision, corners: &[DVec4]) -> Result<(), StackError> {
    let Extent { min, max } = bounds.extent;
    let invalid = |what, value| Err(StackError::Invalid { what, value });
    if let Some(c) = corners
        .iter()
        .flat_map(|c| c.to_array())
        .find(|c| !c.is_finite())
    {
        return invalid("a coordinate of the view cell, which must be finite,", c);
    }
    for bound in [min.x, min.y, max.x, max.y, bounds.near, bounds.far] {
        if !bound.is_finite() {
            return invalid(
                "a bound of what is represented, which must be finite,",
                bound,
            );
        }
    }
    if min.cmpgt(max).any() || bounds.near > bounds.far {
        return Err(StackError::Empty);
    }
    let Precision {
        texel,
        disparity,
        parallax,
    } = *precision;
    if !(texel > 0.0 && texel.is_finite()) {
        return invalid(
            "the texels' size, which must be positive and finite,",
            texel,
        );
    }
    if !(disparity > 0.0 && disparity <= 1.0) {
        return invalid(
            "the disparity in texels, which must be above 0 and at most 1,",
            disparity,
        );
    }
    if !(parallax > 0.0 && parallax.is_finite()) {
        return invalid("the parallax, which must be positive and finite,", parallax);
    }
    // A corner at infinity must lie behind, not ahead or beside.
    let ahead = corners.iter().any(|c| c.w == 0.0 && c.z >= 0.0);
    let cell_end = if ahead {
        f64::INFINITY
    } else {
        nearest_depth(corners)
    };
    let start = bounds.near;
    if !(cell_end < start && start > 0.0) {
        return Err(StackError::CellNotBefore { cell_end, start });
    }
    Ok(())
}

/// Columns and rows of whole texels around an extent, with half a texel or more on every side.
fn texels(extent: &Extent, texel: f64) -> Result<DVec2, StackError> {
    let texels = (extent.size() / texel).ceil() + 1.0;
    if texels.max_element() > f64::from(MAX_TEXTURE_SIDE) {
        return Err(StackError::TextureTooLarge {
            width: texels.x,
            height: texels.y,
        });
    }
    Ok(texels)
}

/// The extent of the given size with the same centre.
fn centered_extent(extent: &Extent, size: DVec2) -> Extent {
    let min = (extent.min + extent.max - size) / 2.0;
    Extent {
        min,
        max: min + size,
    }
}

/// What the depths of a stack depend on, besides its precision.
struct Space<'a> {
    bounds: &'a Bounds,
    extent: &'a Extent,
    corners: &'a [DVec4],
}

impl Space<'_> {
    /// The layers' depths from front to back, each as far as it may be; `None` if there would be
    /// more than `limit`.
    fn depths(&self, precision: &Precision, limit: usize) -> Option<Vec<f64>> {
        let &Bounds { near, far, .. } = self.bounds;
        let behind = |depth| {
            depth + depth_range_behind(depth, self.extent, precision.parallax, self.corners)
        };
        // Rays that enter or leave the extent between two layers count too.
        let wide = Extent {
            min: self.extent.min - precision.texel,
            max: self.extent.max + precision.texel,
        };
        let movement = precision.texel * precision.disparity;

        let mut depth = behind(near).min(far);
        // The nearest place for the last layer; the range behind a layer grows with its depth.
        let (mut short, mut last) = (near, far);
        for _ in 0..60 {
            let middle = (short + last) / 2.0;
            if behind(middle) < far {
                short = middle;
            } else {
                last = middle;
            }
        }
        let mut depths = vec![depth];
        while depth < last {
            if depths.len() >= limit {
                return None;
            }
            depth = (depth + next_layer(depth, &wide, movement, self.corners)).min(far);
            depths.push(depth);
        }
        (depths.len() <= limit).then_some(depths)
    }

    /// As many depths as given, spaced by the smallest share of the limits that suffices.
    fn spread(&self, precision: &Precision, widest: Vec<f64>) -> Vec<f64> {
        let count = widest.len();
        let mut depths = widest;
        let (mut few, mut enough) = (0.0, 1.0);
        // To 2^-30: what is left of the slack is too small to see.
        for _ in 0..30 {
            let share = (few + enough) / 2.0;
            let lowered = Precision {
                disparity: precision.disparity * share,
                parallax: precision.parallax * share,
                ..*precision
            };
            match self.depths(&lowered, count) {
                Some(d) => (enough, depths) = (share, d),
                None => few = share,
            }
        }
        depths
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{parallax, slope_behind, stacks, viewpoint, weights};
    use proptest::prelude::*;

    fn pose() -> Pose {
        Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z)
    }

    /// Says what is wrong with a stack for the given bounds, besides what viewpoints see.
    fn check_stack(stack: &LayerStack, bounds: &Bounds, texel: f64) -> Result<(), String> {
        let LayerStack {
            extent,
            width,
            height,
            layers,
            ..
        } = stack;
        let (Some(first), Some(last)) = (layers.first(), layers.last()) else {
            return Err("there are no layers".into());
        };
        if (first.near, last.far) != (bounds.near, bounds.far) {
            return Err(format!("{} to {} is not {bounds:?}", first.near, last.far));
        }
        for layer in layers {
            if !(layer.near <= layer.depth && layer.depth <= layer.far) {
                return Err(format!("{layer:?} is not in its range"));
            }
        }
        for pair in layers.windows(2) {
            if pair[0].far != pair[1].near || pair[0].depth >= pair[1].depth {
                return Err(format!("{pair:?} do not follow each other"));
            }
        }
        // Slopes of a few units are rounded a few times.
        let tiny = 1e-14;
        let size = DVec2::new(f64::from(*width), f64::from(*height)) * texel;
        if !extent.size().abs_diff_eq(size, tiny) {
            return Err(format!("{extent:?} is not {size} wide"));
        }
        let (left, right) = (
            bounds.extent.min - extent.min,
            extent.max - bounds.extent.max,
        );
        let margin = left.min(right).min_element();
        if margin < texel / 2.0 - tiny || left.max(right).max_element() > texel + tiny {
            return Err(format!("margins {left} and {right} for texels of {texel}"));
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        /// The ranges tile the depths, each holds its layer, and the extent is whole texels with
        /// half a texel to one texel around.
        #[test]
        fn ranges_tile_the_depths((setup, bounds, precision) in stacks()) {
            let stack = stack(&pose(), &bounds, &precision, &setup.corners).unwrap();
            check_stack(&stack, &bounds, precision.texel).map_err(TestCaseError::fail)?;
        }

        /// What viewpoints see: a ray that passes through the extent in either of two neighbouring
        /// layers, or both, sees them displaced by at most the share of a texel; a point is shown
        /// at most one texel of its layer away on either axis, and, outside of the first and
        /// last layer, at most a pixel away.
        #[test]
        fn no_viewpoint_of_the_cell_sees_an_error(
            (setup, bounds, precision) in stacks(),
            rays in prop::collection::vec(
                (weights(), prop::array::uniform2(-0.5..=1.5f64), 0.0..=1.0f64), 40),
        ) {
            let stack = stack(&pose(), &bounds, &precision, &setup.corners).unwrap();
            let LayerStack { extent, layers, .. } = &stack;
            let last = layers.len() - 1;
            for (weights, at, share) in rays {
                let Some(eye) = viewpoint(&setup.corners, &weights) else { continue };
                let slope = extent.min + extent.size() * DVec2::from(at);
                for pair in layers.windows(2) {
                    let behind = slope_behind(eye, slope, pair[0].depth, pair[1].depth);
                    for axis in 0..2 {
                        let range = extent.min[axis]..=extent.max[axis];
                        let inside = range.contains(&slope[axis]) || range.contains(&behind[axis]);
                        let moved = (behind[axis] - slope[axis]).abs() / precision.texel;
                        // As in the spacing's test, in texels of at least 1e-4.
                        prop_assert!(!inside || moved <= precision.disparity + 1e-6, "{moved}");
                    }
                }
                let slope = slope.clamp(extent.min, extent.max);
                for (i, layer) in layers.iter().enumerate() {
                    let depth = layer.near + (layer.far - layer.near) * share;
                    let seen = parallax(eye, slope, depth, layer.depth);
                    let inner = if depth < layer.depth { i > 0 } else { i < last };
                    if inner {
                        let texel = precision.texel * layer.depth / (layer.depth - eye.z);
                        // Both axes together: the square root of two.
                        prop_assert!(seen <= texel * 1.4143 * precision.disparity + 1e-10);
                    } else {
                        prop_assert!(seen <= precision.parallax + 1e-10, "{seen} in {layer:?}");
                    }
                }
            }
        }

        /// Slack is spread: there are no more layers than without, and errors are as small as
        /// they can be with that number.
        #[test]
        fn slack_lowers_errors_and_not_the_count((setup, bounds, precision) in stacks()) {
            let corners = &setup.corners;
            let found = stack(&pose(), &bounds, &precision, corners).unwrap().layers.len();
            let count = |precision: &Precision, limit| {
                count_layers(&bounds, precision, corners, limit).unwrap().map(|(_, n)| n)
            };
            prop_assert_eq!(count(&precision, MAX_LAYERS), Some(found));
            prop_assert_eq!(count(&precision, found), Some(found));
            prop_assert_eq!(count(&precision, found - 1), None);
        }

        /// Half the texel and half the pixel never take fewer layers.
        #[test]
        fn finer_stacks_have_more_layers((setup, bounds, precision) in stacks()) {
            let Precision { texel, disparity, parallax } = precision;
            let finer = Precision { texel: texel / 2.0, disparity, parallax: parallax / 2.0 };
            let count = |precision| {
                stack(&pose(), &bounds, precision, &setup.corners).unwrap().layers.len()
            };
            prop_assert!(count(&finer) >= count(&precision));
        }

        /// Every depth gets the layer whose range holds it, others the nearest.
        #[test]
        fn layer_at_is_the_range_that_holds_it(
            (setup, bounds, precision) in stacks(),
            share in -0.1..1.1f64,
        ) {
            let stack = stack(&pose(), &bounds, &precision, &setup.corners).unwrap();
            let depth = bounds.near + (bounds.far - bounds.near) * share;
            let layer = stack.layers[stack.layer_at(depth)];
            let clamped = depth.clamp(bounds.near, bounds.far);
            prop_assert!(layer.near <= clamped && clamped <= layer.far);
            for (i, layer) in stack.layers.iter().enumerate() {
                prop_assert_eq!(stack.layer_at(layer.depth), i);
                prop_assert_eq!(stack.layer_at(layer.far), i);
            }
        }

        /// The bounds hold all points and touch one on every side.
        #[test]
        fn bounds_are_tight(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 1..20),
        ) {
            let pose = Pose::looking_along(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.2, 0.1, -1.0));
            let points = points.into_iter().map(DVec3::from);
            let bounds = Bounds::of_points(&pose, points.clone()).unwrap();
            let seen: Vec<_> = points.map(|p| pose.point_in_view(p)).collect();
            let least = |f: fn(&DVec3) -> f64| seen.iter().map(f).fold(f64::INFINITY, f64::min);
            let found = [
                bounds.near - least(|p| p.z),
                bounds.far + least(|p| -p.z),
                bounds.extent.min.x - least(|p| p.x / p.z),
                bounds.extent.min.y - least(|p| p.y / p.z),
                bounds.extent.max.x + least(|p| -p.x / p.z),
                bounds.extent.max.y + least(|p| -p.y / p.z),
            ];
            prop_assert_eq!(found, [0.0; 6]);
        }
    }

    /// Few texels, before a viewpoint far behind: there the displacement grows fast to the sides, and
    /// a ray that enters the extent between two layers is the worst.
    #[test]
    fn rays_that_enter_the_extent_count_too() {
        let extent = Extent {
            min: DVec2::splat(-0.001),
            max: DVec2::splat(0.001),
        };
        let bounds = Bounds {
            extent,
            near: 0.1,
            far: 2.0,
        };
        let precision = Precision {
            texel: 0.001,
            disparity: 1.0,
            parallax: 1e-5,
        };
        let eye = DVec3::new(0.0, 0.0, -5.0);
        let stack = stack(&pose(), &bounds, &precision, &[eye.extend(1.0)]).unwrap();
        let max = stack.extent.max;
        let mut entering = 0;
        for (pair, i) in stack
            .layers
            .windows(2)
            .flat_map(|p| (0..100).map(move |i| (p, i)))
        {
            let slope = max + precision.texel * f64::from(i) / 50.0;
            let behind = slope_behind(eye, slope, pair[0].depth, pair[1].depth);
            if behind.x <= max.x {
                entering += 1;
                assert!((slope - behind).x <= precision.texel, "{slope} to {behind}");
            }
        }
        assert!(entering > 100);
    }

    /// A plane parallel to the layers is shown without any parallax.
    #[test]
    fn a_flat_thing_is_in_its_layer() {
        let extent = Extent {
            min: DVec2::splat(-0.1),
            max: DVec2::splat(0.1),
        };
        let bounds = Bounds {
            extent,
            near: 10.0,
            far: 10.0,
        };
        let precision = Precision {
            texel: 0.001,
            disparity: SAFE_DISPARITY,
            parallax: 0.001,
        };
        let corners = [DVec4::W, DVec4::new(3.0, 3.0, -9.0, 1.0)];
        let stack = stack(&pose(), &bounds, &precision, &corners).unwrap();
        assert_eq!(
            stack.layers,
            [Layer {
                depth: 10.0,
                near: 10.0,
                far: 10.0
            }]
        );
    }

    #[test]
    fn what_cannot_be_is_an_error() {
        let extent = Extent {
            min: DVec2::splat(-0.1),
            max: DVec2::splat(0.1),
        };
        let bounds = Bounds {
            extent,
            near: 10.0,
            far: 20.0,
        };
        let precision = Precision {
            texel: 0.001,
            disparity: SAFE_DISPARITY,
            parallax: 0.001,
        };
        let corner = DVec4::new(3.0, 3.0, 9.0, 1.0);
        let error = |bounds: &Bounds, precision: &Precision, corner: DVec4| {
            let found = stack(&pose(), bounds, precision, &[corner]);
            found.map(|s| s.layers.len()).unwrap_err()
        };
        assert_eq!(
            error(&bounds, &precision, corner.with_z(10.0)),
            StackError::CellNotBefore {
                cell_end: 10.0,
                start: 10.0
            }
        );
        assert_eq!(
            error(&bounds, &precision, DVec4::X),
            StackError::CellNotBefore {
                cell_end: f64::INFINITY,
                start: 10.0
            }
        );
        assert_eq!(
            error(
                &bounds,
                &Precision {
                    texel: 1e-5,
                    ..precision
                },
                corner
            ),
            StackError::TextureTooLarge {
                width: 20001.0,
                height: 20001.0
            }
        );
        // Some 4e-7 apart.
        assert_eq!(
            error(
                &bounds,
                &Precision {
                    disparity: 1e-4,
                    ..precision
                },
                corner
            ),
            StackError::TooManyLayers
        );
        assert_eq!(
            error(
                &Bounds {
                    near: 21.0,
                    ..bounds
                },
                &precision,
                corner
            ),
            StackError::Empty
        );
        for (bounds, precision, corner) in [
            (
                Bounds {
                    far: f64::INFINITY,
                    ..bounds
                },
                precision,
                corner,
            ),
            (
                bounds,
                Precision {
                    texel: 0.0,
                    ..precision
                },
                corner,
            ),
            (
                bounds,
                Precision {
                    disparity: 1.01,
                    ..precision
                },
                corner,
            ),
            (
                bounds,
                Precision {
                    parallax: f64::NAN,
                    ..precision
                },
                corner,
            ),
            (bounds, precision, corner.with_x(f64::NAN)),
        ] {
            let error = error(&bounds, &precision, corner);
            assert!(matches!(error, StackError::Invalid { .. }), "{error}");
        }
        assert_eq!(Bounds::of_points(&pose(), []), Err(StackError::Empty));
        for z in [0.0, 1.0, f64::NAN] {
            let points = [DVec3::NEG_Z, DVec3::new(0.0, 0.0, z)];
            assert!(Bounds::of_points(&pose(), points).is_err());
        }
    }
}
