//! One-texel spacing: how far apart two neighbouring layers may be.

use farfield_views::Extent;
use glam::DVec4;

/// Distance from the layer at `depth` to the next one, the largest at which no texel uncovers
/// more than the texel behind it from anywhere in the view cell.
///
/// With the reference viewpoint at the origin, a corner v of the cell and a texel edge at the
/// lateral position x, the line from the origin through that edge passes v at the lateral
/// distance b = |v.x - x v.z / depth|. Similar triangles give c = p (depth - v.z) / (b - p), p the
/// texel's width, `movement` times `depth`. For a gap that opens to the right (v lies to the right
/// of that line) x is the texel's left edge, for one to the left its right edge. What is bounded is
/// thus the movement of the texel's other edge, the one beside the gap.
///
/// That a layer at distance c uncovers at most p is, for each of the two directions, linear in v
/// and linear in x, so the corners of the cell and the outermost texels suffice; both axes are
/// independent. A ray from the cell that passes through the extent in both layers sees them
/// displaced by at most `movement`, measured in slopes as seen from the reference viewpoint. One
/// that enters or leaves the extent in between may see a trifle more; to bound that too, widen the
/// extent by a texel on every side, as [`stack`](crate::stack()) does.
///
/// Generalises equations 3.2 to 3.5 of S. Jeschke, Accelerating the Rendering Process Using
/// Impostors, 2005, to extents off the axis and any convex cell.
///
/// * `depth` - from the reference viewpoint, positive, farther than all of the cell
/// * `extent` - slopes that bound what is recorded, at least `movement` wide
/// * `movement` - largest movement of a texel over the next layer, as a slope: a texel's side per
///   unit of depth, or a share of it
/// * `corners` - of the cell, in view space of the reference viewpoint; (x, y, z, 0) is a
///   direction towards a corner at infinity
///
/// Returns infinity where one layer holds everything behind.
///
/// # Panics
///
/// When `corners` is empty, `depth` is not positive or does not lie before all of them, or
/// `movement` is not positive.
pub fn next_layer(depth: f64, extent: &Extent, movement: f64, corners: &[DVec4]) -> f64 {
    assert!(!corners.is_empty(), "a view cell has corners");
    assert!(
        depth > 0.0,
        "a layer at depth {depth} is not before the viewpoint"
    );
    assert!(movement > 0.0, "a movement of {movement} is not positive");
    let p = movement * depth;
    let mut nearest = f64::INFINITY;
    for v in corners {
        let distance = depth * v.w - v.z;
        assert!(
            distance > 0.0,
            "the layer at {depth} is not before the corner {v}"
        );
        for axis in 0..2 {
            let (min, max) = (extent.min[axis], extent.max[axis]);
            let lateral = |slope: f64| v[axis] - slope * v.z;
            let right = lateral(min).max(lateral(max - movement));
            let left = -lateral(min + movement).min(lateral(max));
            // No limit where b <= p: the lines of sight past a texel and the one behind it diverge.
            let excess = right.max(left) - p * v.w;
            if excess > 0.0 {
                nearest = nearest.min(p * distance / excess);
            }
        }
    }
    nearest
}
