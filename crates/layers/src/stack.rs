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

/// The most layers in a stack; a cell that needs more all but touches what is represented.
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
                short = middle
            } else {
                last = middle
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
