//! From a cell and a box: the recording axis, the reference viewpoint, the texel size.

use crate::stack::count_layers;
use crate::texel::least_approach;
use crate::{
    Bounds, LayerStack, MAX_LAYERS, Precision, SAFE_DISPARITY, StackError, corners_in_view, stack,
    texel_size,
};
use farfield_views::{Pose, ViewCell};
use glam::DVec3;

/// The camera that the impostor is made for, square, wherever in the cell it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PromisedCamera {
    /// Where it looks.
    pub aim: Aim,
    /// Field of view, in radians, between 0 and pi.
    pub fov: f64,
    /// Pixels on a side, at least 1.
    pub resolution: u32,
}

/// Where a camera looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// At the centre of the represented box.
    Center,
    /// Anywhere: what is represented may surround the cell, and reach beside and behind a camera.
    /// Texels are not magnified where it looks straight at them. Elsewhere in its picture they are
    /// by up to 1 / cos^2 of the angle off its axis; parallax keeps its limit there too.
    Anywhere,
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
    reference_view_of_hull(cell, &box_corners(represented), camera)
}

/// As [`reference_view`], for any convex hull in place of a box: a frustum round a view cell is much
/// narrower near the cell than its box.
///
/// * `hull` - finite corners in the world; their box is the represented box
///
/// # Errors
///
/// As for [`plan`].
pub fn reference_view_of_hull(
    cell: &ViewCell,
    hull: &[DVec3; 8],
    camera: &PromisedCamera,
) -> Result<ReferenceView, PlanError> {
    let represented = box_around(hull);
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
        if !is_before(cell, axis, hull) {
            continue;
        }
        match best_place(cell, hull, camera, axis, [border, center]) {
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

/// Whether all of the cell lies before all of the hull along an axis.
fn is_before(cell: &ViewCell, axis: DVec3, hull: &[DVec3; 8]) -> bool {
    // Relative to the hull, for the digits.
    let origin = hull[0];
    let nearest = hull
        .iter()
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
    hull: &[DVec3; 8],
    camera: &PromisedCamera,
    axis: DVec3,
    [border, center]: [DVec3; 2],
) -> Result<(f64, ReferenceView), PlanError> {
    let represented = box_around(hull);
    let [from, to] = represented;
    let pixel = camera.pixel();
    let mut best = None;
    let mut limit = MAX_LAYERS;
    for i in 0..PLACES {
        let eye = border.lerp(center, f64::from(i) / f64::from(PLACES - 1));
        let pose = Pose::looking_along(eye, axis);
        let bounds = Bounds::of_points(&pose, hull.iter().copied())?;
        let corners = corners_in_view(&pose, cell);
        let texel = match camera.aim {
            Aim::Center => texel_size(&pose, cell, represented, pixel),
            Aim::Anywhere => pixel * least_approach([bounds.near, bounds.far], &corners),
        };
        if texel <= 0.0 {
            return Err(PlanError::TooNear { from, to });
        }
        let precision = Precision {
            texel,
            disparity: SAFE_DISPARITY,
            parallax: SAFE_PARALLAX * pixel
                / parallax_magnification(axis, cell, represented, camera),
        };
        // Layers, then texels: an equal number of layers goes to the place found first.
        if let Some((texels, layers)) = count_layers(&bounds, &precision, &corners, limit)? {
            let effort = texels.element_product() * layers as f64;
            best = Some((effort, ReferenceView { pose, precision }));
            limit = layers - 1;
        }
    }
    Ok(best.ok_or(StackError::TooManyLayers)?)
}

/// Share of a pixel that parallax may take: the rest is for what a camera between the cell's corners
/// magnifies more than those in them.
const SAFE_PARALLAX: f64 = 7.0 / 8.0;

/// By how much the promised camera magnifies parallax within the box against an image plane parallel
/// to the layers, at most; at least 1.
fn parallax_magnification(
    axis: DVec3,
    cell: &ViewCell,
    represented: [DVec3; 2],
    camera: &PromisedCamera,
) -> f64 {
    match camera.aim {
        Aim::Center => tilt_magnification(axis, cell, represented),
        // Seen straight on, what is t off the layers' axis is seen at most as far apart as on their
        // plane; in the corner of the picture, f off the camera's axis, 1 / cos^2 f times that.
        Aim::Anywhere => 1.0 + 2.0 * (camera.fov / 2.0).tan().powi(2),
    }
}

/// By how much a camera in a corner of the cell that looks at the centre of the box magnifies
/// parallax within the box against an image plane parallel to the layers, at most; at least 1.
///
/// A point at y from the viewpoint, displaced a little along the layers, is seen displaced by
/// |y| (y . n) / (y . f)^2 times as much in the tilted picture, n the layers' axis and f the
/// camera's: it is (y . n) / (y . f) times as near along that axis, and seen |y| / (y . f) times as
/// far from the middle. For a given f the greatest is at a corner of the box.
fn tilt_magnification(axis: DVec3, cell: &ViewCell, represented: [DVec3; 2]) -> f64 {
    let center = (represented[0] + represented[1]) / 2.0;
    let corners = cell.corners();
    let eyes = corners.iter().filter(|v| v.w > 0.0);
    eyes.flat_map(|eye| box_corners(represented).map(|corner| (eye.truncate(), corner)))
        .map(|(eye, corner)| {
            let (y, forward) = (corner - eye, (center - eye).normalize());
            y.length() * y.dot(axis) / y.dot(forward).powi(2)
        })
        .fold(1.0, f64::max)
}

fn box_around(hull: &[DVec3; 8]) -> [DVec3; 2] {
    let least = |a: DVec3, b: &DVec3| a.min(*b);
    let greatest = |a: DVec3, b: &DVec3| a.max(*b);
    [
        hull.iter().fold(DVec3::INFINITY, least),
        hull.iter().fold(DVec3::NEG_INFINITY, greatest),
    ]
}

/// The corners of a box, given by its least and greatest.
pub fn box_corners([from, to]: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| {
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
    let PromisedCamera {
        fov, resolution, ..
    } = *camera;
    if !(fov > 0.0 && fov < std::f64::consts::PI && resolution > 0) {
        return Err(PlanError::BadCamera { fov, resolution });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{cells_before_boxes, viewpoint, weights};
    use farfield_views::Camera;
    use glam::DVec2;
    use proptest::prelude::*;

    const CAMERA: PromisedCamera = PromisedCamera {
        aim: Aim::Center,
        fov: std::f64::consts::FRAC_PI_4,
        resolution: 512,
    };

    /// A house 20 m wide and high and 40 m deep, `distance` before a cubic cell of 100 m, both
    /// centred at the same height.
    fn house(distance: f64) -> (ViewCell, [DVec3; 2]) {
        let cell = ViewCell::Box {
            center: DVec3::new(0.0, 0.0, 50.0),
            size: DVec3::splat(100.0),
        };
        let far = DVec3::new(-10.0, -10.0, -distance - 40.0);
        (cell, [far, DVec3::new(10.0, 10.0, -distance)])
    }

    const DISTANCES: [f64; 7] = [90.0, 110.0, 140.0, 180.0, 250.0, 500.0, 1000.0];

    fn stack_from(eye: DVec3, distance: f64, disparity: f64) -> LayerStack {
        let (cell, represented) = house(distance);
        let pose = Pose::looking_along(eye, DVec3::NEG_Z);
        let texel = texel_size(&pose, &cell, represented, CAMERA.pixel());
        let parallax =
            SAFE_PARALLAX * CAMERA.pixel() / tilt_magnification(DVec3::NEG_Z, &cell, represented);
        let precision = Precision {
            texel,
            disparity,
            parallax,
        };
        let bounds = Bounds::of_points(&pose, box_corners(represented)).unwrap();
        stack(&pose, &bounds, &precision, &corners_in_view(&pose, &cell)).unwrap()
    }

    /// Table 4.1 of S. Jeschke, Accelerating the Rendering Process Using Impostors, 2005, counts
    /// 110, 81, 56, 34, 19, 5 and 1 layers for a house of unstated size. This house takes about
    /// as many; the counts themselves are our own, and may change by two.
    #[test]
    fn layers_of_the_house() {
        let check = |counts: [usize; 7], expected: [usize; 7]| {
            for (found, wanted) in counts.into_iter().zip(expected) {
                assert!(
                    found.abs_diff(wanted) <= 2,
                    "{counts:?} is not {expected:?}"
                );
            }
        };
        let middle = DVec3::new(0.0, 0.0, 50.0);
        check(
            DISTANCES.map(|d| stack_from(middle, d, 1.0).layers.len()),
            [121, 84, 54, 33, 18, 5, 1],
        );
        check(
            DISTANCES.map(|d| stack_from(DVec3::ZERO, d, SAFE_DISPARITY).layers.len()),
            [122, 86, 56, 36, 19, 5, 1],
        );
    }

    /// The plan for the house looks from the near border, where the layers are fewest.
    #[test]
    fn the_house_is_recorded_from_the_near_border() {
        for distance in DISTANCES {
            let (cell, represented) = house(distance);
            let plan = plan(&cell, represented, &CAMERA).unwrap();
            assert_eq!(plan, stack_from(DVec3::ZERO, distance, SAFE_DISPARITY));
        }
    }

    /// No place on the way has fewer layers, and none nearer to the box as few.
    #[test]
    fn the_viewpoint_has_the_fewest_layers() {
        // Before a wide facade the best place is not at the border.
        let cell = ViewCell::Box {
            center: DVec3::new(0.0, 0.0, 10.0),
            size: DVec3::new(4.0, 4.0, 20.0),
        };
        let represented = [
            DVec3::new(-20.0, -20.0, -60.0),
            DVec3::new(20.0, 20.0, -20.0),
        ];
        let found = reference_view(&cell, represented, &CAMERA).unwrap();
        let count = |i: u32| {
            let eye = DVec3::new(0.0, 0.0, f64::from(i) * 10.0 / 16.0);
            let pose = Pose::looking_along(eye, DVec3::NEG_Z);
            let texel = texel_size(&pose, &cell, represented, CAMERA.pixel());
            let bounds = Bounds::of_points(&pose, box_corners(represented)).unwrap();
            let precision = Precision {
                texel,
                ..found.precision
            };
            let corners = corners_in_view(&pose, &cell);
            stack(&pose, &bounds, &precision, &corners)
                .unwrap()
                .layers
                .len()
        };
        let counts: Vec<_> = (0..PLACES).map(count).collect();
        let best = (0..counts.len()).min_by_key(|i| counts[*i]).unwrap();
        assert_eq!(
            found.pose.eye,
            DVec3::new(0.0, 0.0, best as f64 * 10.0 / 16.0)
        );
        assert!(best > 0, "{counts:?}");
    }

    /// How far from where it belongs a promised camera at `eye` sees a point of the represented box
    /// that lies before the first or behind the last layer, in its own pixels.
    fn tilted_parallax(
        stack: &LayerStack,
        represented: [DVec3; 2],
        lens: &PromisedCamera,
        eye: DVec3,
        point: DVec3,
    ) -> f64 {
        let center = (represented[0] + represented[1]) / 2.0;
        let camera = Camera::looking_at(eye, center, lens.fov, lens.resolution);
        let [first, last] = [&stack.layers[0], &stack.layers[stack.layers.len() - 1]];
        let point = stack.pose.point_in_view(point);
        let shown = point * (point.z.clamp(first.depth, last.depth) / point.z);
        let [a, b] = match point.z < first.depth || point.z > last.depth {
            true => [point, shown],
            false => [point; 2],
        }
        .map(|p| camera.pose.point_in_view(stack.pose.point_in_world(p)))
        .map(|p| camera.pixel_from_view(p));
        a.distance(b)
    }

    /// A truck right before a wide cell, from whose corners it is seen at a slant.
    #[test]
    fn tilted_cameras_near_a_truck_see_at_most_a_pixel_of_parallax() {
        let cell = ViewCell::Box {
            center: DVec3::new(0.0, 1.3, 9.0),
            size: DVec3::new(3.0, 2.0, 3.0),
        };
        let represented = [
            DVec3::new(-1.396, -0.069, -2.431),
            DVec3::new(1.396, 2.584, 2.438),
        ];
        let stack = plan(&cell, represented, &CAMERA).unwrap();
        let corners = cell.corners().map(|v| v.truncate());
        let seen = corners.iter().flat_map(|eye| {
            box_corners(represented)
                .map(|point| tilted_parallax(&stack, represented, &CAMERA, *eye, point))
        });
        let most = seen.fold(0.0, f64::max);
        assert!((0.8..=1.0).contains(&most), "{most} pixels");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// The promised camera anywhere in the cell sees what lies before the first or behind the
        /// last layer at most a pixel from where it belongs, however it is tilted.
        #[test]
        fn a_tilted_camera_sees_at_most_a_pixel_of_parallax(
            (cell, represented) in cells_before_boxes(),
            weights in weights(),
            at in prop::array::uniform3(0.0..=1.0f64),
            resolution in 8..64u32,
        ) {
            let lens = PromisedCamera { resolution, ..CAMERA };
            let Ok(stack) = plan(&cell, represented, &lens) else { return Ok(()) };
            let Some(eye) = viewpoint(&cell.corners(), &weights) else { return Ok(()) };
            let point = represented[0] + (represented[1] - represented[0]) * DVec3::from(at);
            let seen = tilted_parallax(&stack, represented, &lens, eye, point);
            prop_assert!(seen <= 1.0, "{seen} pixels");
        }
    }

    #[test]
    fn axes_of_the_world_are_preferred() {
        let cell = ViewCell::Box {
            center: DVec3::ZERO,
            size: DVec3::ONE,
        };
        let axis = |center: DVec3, size: DVec3| {
            let represented = [center - size / 2.0, center + size / 2.0];
            reference_view(&cell, represented, &CAMERA).map(|view| view.pose.forward)
        };
        // Straight ahead and a little to the side, above and below.
        assert_eq!(
            axis(DVec3::new(0.0, 0.0, -9.0), DVec3::ONE),
            Ok(DVec3::NEG_Z)
        );
        assert_eq!(
            axis(DVec3::new(1.0, 0.5, -9.0), DVec3::ONE),
            Ok(DVec3::NEG_Z)
        );
        assert_eq!(axis(DVec3::new(0.0, 9.0, 1.0), DVec3::ONE), Ok(DVec3::Y));
        assert_eq!(
            axis(DVec3::new(0.1, -9.0, 0.0), DVec3::ONE),
            Ok(DVec3::NEG_Y)
        );
        // Turned, the layers would have 3 % fewer texels here, and 29 % fewer there.
        assert_eq!(
            axis(DVec3::new(2.0, 0.0, -9.0), DVec3::ONE),
            Ok(DVec3::NEG_Z)
        );
        assert_ne!(
            axis(DVec3::new(5.0, 0.0, -9.0), DVec3::ONE),
            Ok(DVec3::NEG_Z)
        );
        // A wall along x, seen across the corner: its facade stays in few layers.
        let wall = axis(DVec3::new(6.0, 0.0, -9.0), DVec3::new(8.0, 3.0, 0.1));
        assert_eq!(wall, Ok(DVec3::NEG_Z));
        // Across the corner a post has less parallax along the direction to it.
        let post = axis(DVec3::new(9.0, 9.0, -9.0), DVec3::splat(1.0)).unwrap();
        assert!(
            post.abs_diff_eq(DVec3::new(1.0, 1.0, -1.0).normalize(), 1e-12),
            "{post}"
        );
    }

    #[test]
    fn flat_and_pointlike_boxes_are_planned() {
        let (cell, _) = house(90.0);
        let at = DVec3::new(1.0, 2.0, -90.0);
        // A single triangle that faces the cell, one that stands edge on, and a point.
        for (size, layers) in [(DVec3::new(3.0, 2.0, 0.0), 1..=1), (DVec3::ZERO, 1..=1)] {
            let plan = plan(&cell, [at, at + size], &CAMERA).unwrap();
            assert!(layers.contains(&plan.layers.len()), "{}", plan.layers.len());
            assert!(plan.width >= 1 && plan.height >= 1);
        }
        let edge_on = plan(&cell, [at - DVec3::Z * 9.0, at + DVec3::Y], &CAMERA).unwrap();
        assert!(edge_on.layers.len() > 10);
        // A cell of one point sees no parallax.
        let point = ViewCell::Box {
            center: DVec3::ZERO,
            size: DVec3::ZERO,
        };
        let (_, represented) = house(90.0);
        assert_eq!(plan(&point, represented, &CAMERA).unwrap().layers.len(), 1);
    }

    fn shaft(near: f64, far: f64) -> ViewCell {
        let axis = DVec3::new(0.3, 0.2, 2.0);
        ViewCell::Shaft {
            apex: DVec3::new(5.0, 6.0, 7.0),
            axis,
            half_angle: 0.3,
            near,
            far,
        }
    }

    /// A shaft is recorded against its axis, from between its near border and its centre; one
    /// that never ends takes no more layers than are bounded, and no fewer than one that ends.
    #[test]
    fn shafts_may_be_infinite() {
        let apex = DVec3::new(5.0, 6.0, 7.0);
        let represented = [apex - 1.0, apex + 1.0];
        let plan_to = |far| plan(&shaft(4.0, far), represented, &CAMERA).unwrap();
        let (short, long, endless) = (plan_to(4.0), plan_to(40.0), plan_to(f64::INFINITY));
        assert!(short.layers.len() <= long.layers.len());
        assert!(long.layers.len() <= endless.layers.len());
        assert!(endless.layers.len() < 1000, "{}", endless.layers.len());
        let pose = endless.pose;
        let axis = DVec3::new(0.3, 0.2, 2.0).normalize();
        assert!(pose.forward.abs_diff_eq(-axis, 1e-15));
        let distance = (pose.eye - apex).dot(axis);
        assert!((4.0 - 1e-12..8.0 + 1e-12).contains(&distance), "{distance}");
        assert!((pose.eye - apex).cross(axis).length() < 1e-12);
    }

    #[test]
    fn what_cannot_be_planned_is_an_error() {
        let (cell, represented) = house(90.0);
        let error = |cell: &ViewCell, represented, camera: &PromisedCamera| {
            plan(cell, represented, camera)
                .map(|s| s.layers.len())
                .unwrap_err()
        };
        let [from, to] = represented;
        // Touching the cell, and around it.
        for around in [[from, to.with_z(0.0)], [from - 100.0, to + 100.0]] {
            let found = error(&cell, around, &CAMERA);
            assert!(matches!(found, PlanError::CellNotBefore { .. }), "{found}");
        }
        // A long wall right before the cell reaches around it.
        let wall = [DVec3::new(-500.0, 0.0, -2.0), DVec3::new(500.0, 10.0, -1.0)];
        assert!(matches!(
            error(&cell, wall, &CAMERA),
            PlanError::TooNear { .. }
        ));
        let fine = PromisedCamera {
            aim: Aim::Center,
            resolution: 1 << 17,
            ..CAMERA
        };
        let found = error(&cell, represented, &fine);
        assert!(
            matches!(found, PlanError::Stack(StackError::TextureTooLarge { .. })),
            "{found}"
        );
        for bad in [
            [to, from],
            [from, to.with_x(f64::NAN)],
            [DVec3::NEG_INFINITY, to],
        ] {
            assert!(matches!(
                error(&cell, bad, &CAMERA),
                PlanError::BadBox { .. }
            ));
        }
        for (fov, resolution) in [(0.0, 512), (4.0, 512), (f64::NAN, 512), (1.0, 0)] {
            let found = error(
                &cell,
                represented,
                &PromisedCamera {
                    fov,
                    resolution,
                    ..CAMERA
                },
            );
            assert!(matches!(found, PlanError::BadCamera { .. }));
        }
        let negative = ViewCell::Box {
            center: DVec3::ZERO,
            size: DVec3::NEG_ONE,
        };
        for bad in [
            negative,
            shaft(0.0, 1.0),
            shaft(2.0, 1.0),
            shaft(f64::INFINITY, 1.0 / 0.0),
        ] {
            assert!(matches!(
                error(&bad, represented, &CAMERA),
                PlanError::BadCell(_)
            ));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// A camera that looks in any direction at what surrounds its cell sees no texel that it
        /// looks straight at magnified, and a point before the first or behind the last layer at most
        /// a pixel from where it belongs, wherever in its picture it sees it.
        #[test]
        fn a_camera_that_looks_anywhere_sees_at_most_a_pixel_of_parallax(
            half in prop::array::uniform3(0.0..2.0f64),
            depths in (1.0..5.0f64, 0.1..20.0f64),
            fov in 0.2..1.5f64,
            eye in prop::array::uniform3(-1.0..=1.0f64),
            at in prop::array::uniform3(-1.0..=1.0f64),
            beside in (-1.0..1.0f64, -1.0..1.0f64),
        ) {
            let half = DVec3::from(half);
            let cell = ViewCell::Box { center: DVec3::ZERO, size: half * 2.0 };
            // Behind the cell's -Z side, widening by 45 degrees.
            let within = |depth: f64, x: f64, y: f64| {
                DVec3::new(x * (half.x + depth), y * (half.y + depth), -half.z - depth)
            };
            let ends = [depths.0, depths.0 + depths.1];
            let sides = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
            let hull = std::array::from_fn(|i| {
                within(ends[i / 4], sides[i % 4].0, sides[i % 4].1)
            });
            let lens = PromisedCamera { aim: Aim::Anywhere, fov, resolution: 64 };
            let ReferenceView { pose, precision } =
                reference_view_of_hull(&cell, &hull, &lens).unwrap();
            let bounds = Bounds::of_points(&pose, hull).unwrap();
            let corners = corners_in_view(&pose, &cell);
            let stack = stack(&pose, &bounds, &precision, &corners).unwrap();
            let eye = DVec3::from(eye) * half;
            let depth = if at[2] > 0.0 { ends[0] } else { ends[1] };
            let point = within(depth, at[0], at[1]);
            // Two pictures of what is seen: straight, and as far beside as the picture reaches.
            let reach = (fov / 2.0).tan();
            let straight = Camera::looking_at(eye, point, fov, 64);
            let tilted = straight.pose.forward
                + straight.pose.right * beside.0 * reach / (1.0 + reach * reach)
                + straight.pose.down * beside.1 * reach / (1.0 + reach * reach);
            let tilted = Camera::looking_at(eye, eye + tilted, fov, 64);
            let (first, last) = (stack.layers[0], stack.layers[stack.layers.len() - 1]);
            let in_view = stack.pose.point_in_view(point);
            let shown = in_view * (in_view.z.clamp(first.depth, last.depth) / in_view.z);
            let shown = stack.pose.point_in_world(shown);
            for camera in [straight, tilted] {
                let pixel = |point| camera.pixel_from_view(camera.pose.point_in_view(point));
                let size = DVec2::splat(64.0);
                if (pixel(point) - size / 2.0).abs().cmple(size / 2.0).all() {
                    let moved = pixel(point).distance(pixel(shown));
                    prop_assert!(moved <= 1.0, "{moved} pixels");
                }
            }
            for side in [stack.pose.right, stack.pose.down] {
                let texel = side * stack.texel() * in_view.z;
                let seen = straight.pose.point_in_view(point + texel / 2.0)
                    - straight.pose.point_in_view(point - texel / 2.0);
                let pixels = seen.length() / (point.distance(eye) * lens.pixel());
                prop_assert!(pixels <= 1.0 + 1e-9, "a texel of {pixels} pixels");
            }
        }

        /// There are no absolute lengths: a world a million times larger or smaller gets the
        /// same layers, scaled; one that is moved far away almost the same.
        #[test]
        fn plans_scale_and_move_with_the_world(
            size in prop::array::uniform3(0.1..5.0f64),
            object in prop::array::uniform3(0.1..5.0f64),
            shift in prop::array::uniform3(-2.0..2.0f64),
            gap in 2.0..20.0f64,
        ) {
            let (size, object) = (DVec3::from(size), DVec3::from(object));
            let camera = PromisedCamera { resolution: 128, ..CAMERA };
            let offset = DVec3::from(shift).with_z(-gap - (size.z + object.z) / 2.0);
            let plan_at = |scale: f64, origin: DVec3| {
                let cell = ViewCell::Box { center: origin, size: size * scale };
                let center = origin + offset * scale;
                let half = object / 2.0 * scale;
                plan(&cell, [center - half, center + half], &camera)
            };
            let Ok(one) = plan_at(1.0, DVec3::ZERO) else { return Ok(()) };
            // Powers of two change no digits.
            for scale in [2f64.powi(-20), 2f64.powi(20)] {
                let other = plan_at(scale, DVec3::ZERO).unwrap();
                prop_assert_eq!(other.extent, one.extent);
                prop_assert_eq!(other.pose.forward, one.pose.forward);
                let depths = |s: &LayerStack, f: f64| -> Vec<_> {
                    s.layers.iter().map(|l| [l.depth * f, l.near * f, l.far * f]).collect()
                };
                prop_assert_eq!(depths(&other, 1.0), depths(&one, scale));
            }
            // 1e6 m away, the sizes are rounded to 1e-10 m; counts change only at the brink.
            let far = plan_at(1.0, DVec3::new(1e6, -1e6, 1e6)).unwrap();
            prop_assert!(far.layers.len().abs_diff(one.layers.len()) <= 1);
            prop_assert!(far.width.abs_diff(one.width) <= 1);
        }

        /// A finer camera gets finer texels.
        #[test]
        fn texels_follow_the_resolution(distance in 20.0..500.0f64, resolution in 16u32..256) {
            let (cell, represented) = house(distance);
            let at = |resolution| {
                plan(&cell, represented, &PromisedCamera { resolution, ..CAMERA }).unwrap()
            };
            let (coarse, fine) = (at(resolution), at(2 * resolution));
            prop_assert!(fine.layers.len() >= coarse.layers.len());
            // The same axis and so the same width, if not the same viewpoint, within the margins.
            prop_assert!(fine.width + 3 >= 2 * coarse.width || fine.pose != coarse.pose);
        }
    }
}
