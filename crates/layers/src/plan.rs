//! From a cell and a box: the recording axis, the reference viewpoint, the texel size.

use crate::stack::count_layers;
use crate::{
    Bounds, LayerStack, MAX_LAYERS, Precision, SAFE_DISPARITY, StackError, corners_in_view, stack,
    texel_size,
};
use farfield_views::{Pose, ViewCell};
use glam::DVec3;

/// The camera that the impostor is made for: square, and wherever in the cell it stands, it looks
/// at the centre of the represented box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PromisedCamera {
    /// Field of view, in radians, between 0 and pi.
    pub fov: f64,
    /// Pixels on a side, at least 1.
    pub resolution: u32,
}

impl PromisedCamera {
    /// Side of the centre pixel at unit distance.
    pub fn pixel(&self) -> f64 {
        2.0 * (self.fov / 2.0).tan() / f64::from(self.resolution)
    }
}

/// From where, along which axis and how finely layers are recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceView {
    /// The reference viewpoint and the recording axis.
    pub pose: Pose,
    /// The largest texel that is not magnified, and the usual limits.
    pub precision: Precision,
}

/// Why nothing can be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The represented box has a corner that is not finite, or one less than the other.
    #[error("the represented box from {from} to {to} is not a finite box")]
    BadBox {
        /// Its first corner.
        from: DVec3,
        /// Its second corner.
        to: DVec3,
    },
    /// The view cell has sizes or distances that make no cell.
    #[error("{0:?} is not a view cell with finite, sensible sizes")]
    BadCell(ViewCell),
    /// The camera cannot see.
    #[error("a camera of {resolution} pixels and a field of view of {fov} radians cannot see")]
    BadCamera {
        /// In radians.
        fov: f64,
        /// In pixels.
        resolution: u32,
    },
    /// Along none of the axes tried does the view cell lie wholly before the represented box.
    #[error(
        "the represented box from {from} to {to} is not wholly in front of the view cell along any \
         recording axis: move the cell away or represent less"
    )]
    CellNotBefore {
        /// Least corner of the box.
        from: DVec3,
        /// Greatest corner of the box.
        to: DVec3,
    },
    /// A camera of the cell that looks at the centre of the box has parts of the box beside or
    /// behind it.
    #[error(
        "the represented box from {from} to {to} reaches around a camera of the view cell that \
         looks at its centre: move the cell away or represent less"
    )]
    TooNear {
        /// Least corner of the box.
        from: DVec3,
        /// Greatest corner of the box.
        to: DVec3,
    },
    /// The layers cannot be placed.
    #[error(transparent)]
    Stack(#[from] StackError),
}

/// How many places for the reference viewpoint are compared, both ends of the way included.
const PLACES: u32 = 17;

/// A direction that is no axis of the world must save this share of the texels to be taken:
/// across an axis of the world, facades lie within one layer each instead of crossing many.
const WORTH_TURNING: f64 = 0.05;

/// The stack of layers that shows a represented box to a view cell.
///
/// This is [`reference_view`], then [`stack`](crate::stack()) for the bounds of the box. What is in
/// the box may leave room: for that, take both steps, with the bounds of the vertices
/// ([`Bounds::of_points`]) between them.
///
/// * `represented` - least and greatest corner of a box in the world; it may be flat
///
/// # Errors
///
/// When the cell is not wholly before the box, there would be too many texels or layers, or the
/// arguments make no sense.
pub fn plan(
    cell: &ViewCell,
    represented: [DVec3; 2],
    camera: &PromisedCamera,
) -> Result<LayerStack, PlanError> {
    let ReferenceView { pose, precision } = reference_view(cell, represented, camera)?;
    let bounds = Bounds::of_points(&pose, box_corners(represented))?;
    let corners = corners_in_view(&pose, cell);
    Ok(stack(&pose, &bounds, &precision, &corners)?)
}

/// The reference viewpoint, recording axis and texel size that show a represented box to a view
/// cell with the least effort.
///
/// The axis of a box-shaped cell is an axis of the world along which the cell lies wholly before
/// the represented box, or the direction between the centres if that separates them too: the one
/// with the least product of columns, rows and layers, where the direction between the centres
/// must save 5 % against the others. Layers across the world's axes hold facades as a
/// whole. A shaft is recorded against its own axis.
///
/// The reference viewpoint is on the line through the cell's centre along the axis (a shaft's
/// axis), between the border nearest to the box and the centre ([`ViewCell::center`], so twice as
/// far from the apex as the near border if the shaft has no end): of 17 evenly spaced
/// places the one with the fewest layers, and of several the nearest to the box. A viewpoint nearer
/// to the box than the cell would have distant layers magnified.
///
/// # Errors
///
/// As for [`plan`].
pub fn reference_view(
    cell: &ViewCell,
    represented: [DVec3; 2],
    camera: &PromisedCamera,
) -> Result<ReferenceView, PlanError> {
    check(cell, represented, camera)?;
    let [from, to] = represented;
    let mut best: Option<(f64, ReferenceView)> = None;
    let mut failure = PlanError::CellNotBefore { from, to };
    for Candidate {
        axis,
        border,
        center,
        handicap,
    } in candidates(cell, represented)
    {
        if !is_before(cell, axis, represented) {
            continue;
        }
        match best_place(cell, represented, camera, axis, [border, center]) {
            Ok((effort, view)) => {
                if best.is_none_or(|(least, _)| effort * handicap < least) {
                    best = Some((effort * handicap, view));
                }
            }
            Err(error) => failure = error,
        }
    }
    best.map(|(_, view)| view).ok_or(failure)
}

/// A recording axis, and the ends of the way on which the reference viewpoint may be.
struct Candidate {
    axis: DVec3,
    border: DVec3,
    center: DVec3,
    handicap: f64,
}

/// The recording axes to compare, in order of preference.
fn candidates(cell: &ViewCell, [from, to]: [DVec3; 2]) -> Vec<Candidate> {
    let (cell_center, size) = match *cell {
        ViewCell::Box { center, size } => (center, size),
        ViewCell::Shaft { axis, .. } => {
            return vec![Candidate {
                axis: -axis.normalize(),
                border: cell.point(DVec3::new(0.5, 0.5, 0.0)),
                center: cell.center(),
                handicap: 1.0,
            }];
        }
    };
    let candidate = |axis: DVec3, handicap| {
        // Where the line through the centre leaves the box.
        let reach = (0..3).filter(|i| axis[*i] != 0.0);
        let reach = reach
            .map(|i| size[i] / 2.0 / axis[i].abs())
            .fold(f64::INFINITY, f64::min);
        Candidate {
            axis,
            border: cell_center + axis * reach,
            center: cell_center,
            handicap,
        }
    };
    let between = ((from - cell_center) + (to - cell_center)) / 2.0;
    let turned = between.try_normalize();
    DVec3::AXES
        .into_iter()
        .flat_map(|axis| [candidate(axis, 1.0), candidate(-axis, 1.0)])
        .chain(turned.map(|axis| candidate(axis, 1.0 / (1.0 - WORTH_TURNING))))
        .collect()
}

/// Whether all of the cell lies before all of the box along an axis.
fn is_before(cell: &ViewCell, axis: DVec3, represented: [DVec3; 2]) -> bool {
    // Relative to the box, for the digits.
    let origin = represented[0];
    let nearest = box_corners(represented)
        .map(|c| (c - origin).dot(axis))
        .fold(f64::INFINITY, f64::min);
    cell.corners().iter().all(|c| {
        let depth = (c.truncate() - origin * c.w).dot(axis);
        if c.w == 0.0 {
            depth < 0.0
        } else {
            depth < nearest
        }
    })
}

/// The view from the best place between `ends`, and its columns times rows times layers.
fn best_place(
    cell: &ViewCell,
    represented: [DVec3; 2],
    camera: &PromisedCamera,
    axis: DVec3,
    [border, center]: [DVec3; 2],
) -> Result<(f64, ReferenceView), PlanError> {
    let [from, to] = represented;
    let pixel = camera.pixel();
    let mut best = None;
    let mut limit = MAX_LAYERS;
    for i in 0..PLACES {
        let eye = border.lerp(center, f64::from(i) / f64::from(PLACES - 1));
        let pose = Pose::looking_along(eye, axis);
        let texel = texel_size(&pose, cell, represented, pixel);
        if texel <= 0.0 {
            return Err(PlanError::TooNear { from, to });
        }
        let precision = Precision {
            texel,
            disparity: SAFE_DISPARITY,
            parallax: pixel,
        };
        let bounds = Bounds::of_points(&pose, box_corners(represented))?;
        let corners = corners_in_view(&pose, cell);
        // Layers, then texels: an equal number of layers goes to the place found first.
        if let Some((texels, layers)) = count_layers(&bounds, &precision, &corners, limit)? {
            let effort = texels.element_product() * layers as f64;
            best = Some((effort, ReferenceView { pose, precision }));
            limit = layers - 1;
        }
    }
    Ok(best.ok_or(StackError::TooManyLayers)?)
}

fn box_corners([from, to]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |i| {
        let side = |bit: usize| {
            if i >> bit & 1 == 0 {
                from[bit]
            } else {
                to[bit]
            }
        };
        DVec3::new(side(0), side(1), side(2))
    })
}

fn check(
    cell: &ViewCell,
    [from, to]: [DVec3; 2],
    camera: &PromisedCamera,
) -> Result<(), PlanError> {
    // NaN fails every comparison, so each asks for what is wanted.
    if !((to - from).is_finite() && from.cmple(to).all()) {
        return Err(PlanError::BadBox { from, to });
    }
    let sensible = match *cell {
        ViewCell::Box { center, size } => {
            center.is_finite() && size.is_finite() && size.cmpge(DVec3::ZERO).all()
        }
        ViewCell::Shaft {
            apex,
            axis,
            half_angle,
            near,
            far,
        } => {
            apex.is_finite()
                && axis.try_normalize().is_some()
                && (0.0..std::f64::consts::FRAC_PI_2).contains(&half_angle)
                && near > 0.0
                && near.is_finite()
                && near <= far
        }
    };
    if !sensible {
        return Err(PlanError::BadCell(*cell));
    }
    let PromisedCamera { fov, resolution } = *camera;
    if !(fov > 0.0 && fov < std::f64::consts::PI && resolution > 0) {
        return Err(PlanError::BadCamera { fov, resolution });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn explore() {
        let camera = PromisedCamera { fov: 45f64.to_radians(), resolution: 512 };
        for lift in [0.0, -40.0, 10.0, 40.0, 50.0] {
            for (share, at) in [(1.0, 0.0), (1.0, 1.0), (0.875, 0.0), (0.875, 1.0)] {
                let counts: Vec<_> = [90., 110., 140., 180., 250., 500., 1000.]
                    .into_iter()
                    .map(|d| {
                        let represented = [
                            DVec3::new(-10., -10. - lift, -d - 40.),
                            DVec3::new(10., 10. - lift, -d),
                        ];
                        let cell = ViewCell::Box {
                            center: DVec3::new(0., 0., 50.),
                            size: DVec3::splat(100.),
                        };
                        let pose =
                            Pose::looking_along(DVec3::new(0., 0., 50.0 * (1. - at)), DVec3::NEG_Z);
                        let texel = texel_size(&pose, &cell, represented, camera.pixel());
                        let precision =
                            Precision { texel, disparity: share, parallax: camera.pixel() };
                        let bounds = Bounds::of_points(&pose, box_corners(represented)).unwrap();
                        let s = stack(&pose, &bounds, &precision, &corners_in_view(&pose, &cell))
                            .unwrap();
                        (s.layers.len(), s.width, s.height)
                    })
                    .collect();
                println!("lift {lift} share {share} at {at}: {counts:?}");
            }
        }
        for d in [90., 110., 140., 180., 250., 500., 1000.] {
            let represented = [DVec3::new(-10., -10., -d - 40.), DVec3::new(10., 10., -d)];
            let cell =
                ViewCell::Box { center: DVec3::new(0., 0., 50.), size: DVec3::splat(100.) };
            let s = plan(&cell, represented, &camera).unwrap();
            println!("{d}: {} {:?}", s.layers.len(), s.pose.eye);
        }
    }
}
