//! How far surface points are displaced on the screen.

use crate::{Distribution, NONE, layer_indices};
use farfield_grid::Grid;
use farfield_views::{Camera, Pose};
use glam::{DVec2, DVec3};

/// Where and how an impostor was recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedFrom<'a> {
    /// The reference viewpoint: layers lie across its view axis.
    pub reference: Pose,
    /// Ascending depths from the reference viewpoint, one more than layers; what lies before the
    /// first or behind the last belongs to the first or last layer. Two where there are no
    /// layers.
    pub borders: &'a [f64],
    /// Width and height of a texel at unit depth, along the reference viewpoint's right and down.
    pub texel: DVec2,
}

/// Displacements of the surface points that one view of the original shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParallaxErrors {
    /// Distances between where points are and where the impostor shows them, in pixels.
    pub errors: Distribution,
    /// The greatest of them, in pixels, and its pixel (x, y); the first of several.
    pub worst: Option<(f64, [u32; 2])>,
    /// The pixels (x, y) displaced by more than the limit, or whose ray meets nothing, row by row.
    pub above: Vec<[u32; 2]>,
    /// The pixels (x, y) whose ray meets nothing that the camera has before it, row by row: what
    /// they show is missing, so they have no error.
    pub unmet: Vec<[u32; 2]>,
    /// Number of points that the impostor does not show because something nearer that the original
    /// shows at most two pixels away is before them.
    pub hidden: u64,
}

/// Measures how far the impostor displaces what a camera sees of the original.
///
/// A surface point X of the original was recorded along the ray from the reference viewpoint
/// through X. The impostor shows it where that ray meets the impostor's geometry, at X', and the
/// error is the distance between X and X' on the screen. Of several such places X' is the one
/// nearest in depth to the range of the layer that X falls in.
///
/// A surface point within a texel of something recorded can itself be unrecorded, such as a
/// sub-sample of a masked leaf. So where the ray meets nothing within the range, the eight rays
/// one texel beside it are tried too, and of all places met the nearest to the range counts, of
/// equally near ones the one with the least error.
///
/// Silhouettes of an impostor reach up to a texel too far, and what it never shows need not be
/// there. So a point whose own ray meets nothing within its range is hidden, not displaced, where
/// the impostor shows a nearer layer, but none nearer by more than one than what the original
/// shows in the 5 x 5 neighbourhood.
///
/// * `depth`, `impostor` - depths of both along the camera's view axis, in metres; infinite where
///   nothing is seen
/// * `limit` - in pixels; only decides what is listed as above it
/// * `meet` - given a direction in the world and a range of depths: the depth nearest to the
///   range at which the ray from the reference viewpoint meets the impostor. The direction's
///   length along the view axis is 1, so depths count lengths of it.
/// * `touches` - whether the original touches a layer or a nearer one in the 5 x 5 neighbourhood of
///   a pixel: looked at closely, because thin things fall between the pixels' centres. Asked only
///   to excuse an error above the limit.
///
/// # Panics
///
/// When a grid is not of the camera's size, or there are fewer than two borders.
pub fn parallax(
    depth: &Grid<f64>,
    impostor: &Grid<f64>,
    camera: &Camera,
    recorded: &RecordedFrom<'_>,
    limit: f64,
    meet: impl Fn(DVec3, [f64; 2]) -> Option<f64>,
    touches: impl Fn([u32; 2], u32) -> bool,
) -> ParallaxErrors {
    let RecordedFrom {
        reference, borders, ..
    } = *recorded;
    let layers = layer_indices(depth, camera, &reference, borders);
    let shown = layer_indices(impostor, camera, &reference, borders);
    let mut result = ParallaxErrors::default();
    for (i, &layer) in layers.cells().iter().enumerate() {
        if layer == NONE {
            continue;
        }
        let (x, y) = (i % depth.width(), i / depth.width());
        let (pixel, layer) = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5), layer as usize);
        let in_view = camera.view_from_pixel(pixel, depth[(x, y)]);
        let point = camera.pose.point_in_world(in_view) - reference.eye;
        let range = [borders[layer], borders[layer + 1]];
        let place = [x as u32, y as u32];
        let shown_at = |beside| displacement(camera, recorded, pixel, point, range, beside, &meet);
        let through = shown_at(DVec2::ZERO);
        let is_there = through.is_some_and(|(beyond, _)| beyond == 0.0);
        let nearer = match is_there {
            true => None,
            false => nearer_layer(&layers, &shown, [x, y]),
        };
        if nearer.is_some_and(|layer| shows(&layers, [x, y], layer)) {
            result.hidden += 1;
            continue;
        }
        let met = match is_there {
            true => through,
            false => through
                .into_iter()
                .chain(BESIDE.into_iter().filter_map(shown_at))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))),
        };
        let is_above = met.is_none_or(|(_, error)| error > limit);
        if is_above && nearer.is_some_and(|layer| touches(place, layer)) {
            result.hidden += 1;
            continue;
        }
        result.take(place, met.map(|(_, error)| error), is_above);
    }
    result
}

/// Measures how far a mesh displaces what a camera sees of the original.
///
/// The mesh passes within a voxel or so of what it stands for, and shows at each of its points the
/// colours of what is nearest to it. So a surface point X of the original is shown at the point X' of
/// the mesh that is nearest to it in the warped grid, in which a texel and a layer are as long as each
/// other, and the error is the distance between X and X' on the screen.
///
/// As in [`parallax`], a point with an error above the limit is hidden, not displaced, where the
/// impostor shows a nearer layer, but none nearer by more than one than what the original has in the
/// 5 x 5 neighbourhood.
///
/// * `nearest` - the point of the mesh nearest to a point, both in the world; `None` where there is
///   none near
///
/// The other arguments and panics are those of [`parallax`].
pub fn mesh_parallax(
    depth: &Grid<f64>,
    impostor: &Grid<f64>,
    camera: &Camera,
    recorded: &RecordedFrom<'_>,
    limit: f64,
    nearest: impl Fn(DVec3) -> Option<DVec3>,
    touches: impl Fn([u32; 2], u32) -> bool,
) -> ParallaxErrors {
    let RecordedFrom {
        reference, borders, ..
    } = *recorded;
    let layers = layer_indices(depth, camera, &reference, borders);
    let shown = layer_indices(impostor, camera, &reference, borders);
    let mut result = ParallaxErrors::default();
    for (i, &layer) in layers.cells().iter().enumerate() {
        if layer == NONE {
            continue;
        }
        let (x, y) = (i % depth.width(), i / depth.width());
        let (pixel, place) = (
            DVec2::new(x as f64 + 0.5, y as f64 + 0.5),
            [x as u32, y as u32],
        );
        let point = camera
            .pose
            .point_in_world(camera.view_from_pixel(pixel, depth[(x, y)]));
        let error = nearest(point).and_then(|shown| {
            let in_view = camera.pose.point_in_view(shown);
            let error = camera.pixel_from_view(in_view).distance(pixel);
            (in_view.z > 0.0 && error.is_finite()).then_some(error)
        });
        let is_above = error.is_none_or(|error| error > limit);
        let nearer = is_above
            .then(|| nearer_layer(&layers, &shown, [x, y]))
            .flatten();
        if nearer.is_some_and(|layer| shows(&layers, [x, y], layer) || touches(place, layer)) {
            result.hidden += 1;
            continue;
        }
        result.take(place, error, is_above);
    }
    result
}

impl ParallaxErrors {
    /// Counts the error of a pixel, or that it has none because what it shows is missing.
    fn take(&mut self, place: [u32; 2], error: Option<f64>, is_above: bool) {
        if is_above {
            self.above.push(place);
        }
        let Some(error) = error else {
            self.unmet.push(place);
            return;
        };
        self.errors.record(error);
        if self.worst.is_none_or(|(worst, _)| error > worst) {
            self.worst = Some((error, place));
        }
    }
}

/// Where the impostor shows a nearer layer at a pixel than the original does: the farthest that
/// the original must have close by for that to be its silhouette. One behind what is shown will
/// do, as surfaces reach over the borders of layers.
fn nearer_layer(layers: &Grid<u32>, shown: &Grid<u32>, [x, y]: [usize; 2]) -> Option<u32> {
    let before = shown[(x, y)];
    (before < layers[(x, y)]).then(|| before.saturating_add(1))
}

/// Whether the original shows this layer or a nearer one in the 5 x 5 neighbourhood of a pixel.
fn shows(layers: &Grid<u32>, [x, y]: [usize; 2], layer: u32) -> bool {
    let columns = x.saturating_sub(2)..(x + 3).min(layers.width());
    let mut close_by = (y.saturating_sub(2)..(y + 3).min(layers.height()))
        .flat_map(|y| &layers.row(y)[columns.clone()]);
    close_by.any(|shown| *shown <= layer)
}

/// The eight texels around one.
const BESIDE: [DVec2; 8] = [
    DVec2::new(-1.0, -1.0),
    DVec2::new(0.0, -1.0),
    DVec2::new(1.0, -1.0),
    DVec2::new(-1.0, 0.0),
    DVec2::new(1.0, 0.0),
    DVec2::new(-1.0, 1.0),
    DVec2::new(0.0, 1.0),
    DVec2::new(1.0, 1.0),
];

/// What the depth of a quad may be off its layer, as a share of it: files hold positions as `f32`. The
/// range of a flat scene has no thickness.
const ROUNDING: f64 = 1e-6;

/// How far in depth from its range a ray shows a point, and how far on the screen from where it
/// is, in pixels; `None` where nothing is met.
///
/// * `pixel` - where the camera sees the point
/// * `point` - relative to the reference viewpoint, in the world's directions
/// * `beside` - texels by which the ray passes beside the point
fn displacement(
    camera: &Camera,
    recorded: &RecordedFrom<'_>,
    pixel: DVec2,
    point: DVec3,
    range: [f64; 2],
    beside: DVec2,
    meet: impl Fn(DVec3, [f64; 2]) -> Option<f64>,
) -> Option<(f64, f64)> {
    let reference = &recorded.reference;
    let texels = recorded.texel * beside;
    let direction = point / point.dot(reference.forward);
    let ray = direction + reference.right * texels.x + reference.down * texels.y;
    let depth = meet(ray, range)?;
    let in_view = camera.pose.point_in_view(reference.eye + ray * depth);
    let beyond = (range[0] - depth).max(depth - range[1]);
    let beyond = if beyond <= depth * ROUNDING {
        0.0
    } else {
        beyond
    };
    let error = camera.pixel_from_view(in_view).distance(pixel);
    (in_view.z > 0.0 && error.is_finite()).then_some((beyond, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_views::Extent;
    use proptest::prelude::*;

    const BORDERS: [f64; 4] = [9.0, 10.0, 10.5, 12.0];

    fn recorded() -> RecordedFrom<'static> {
        RecordedFrom {
            reference: Pose::looking_along(DVec3::new(0.0, 0.0, 10.0), DVec3::NEG_Z),
            borders: &BORDERS,
            texel: DVec2::new(0.01, 0.02),
        }
    }

    fn camera(pose: Pose) -> Camera {
        let extent = Extent {
            min: DVec2::new(-0.2, -0.1),
            max: DVec2::new(0.1, 0.3),
        };
        Camera {
            pose,
            extent,
            width: 6,
            height: 4,
        }
    }

    /// Depths from the reference viewpoint, within the borders.
    fn depths() -> impl Strategy<Value = Grid<f64>> {
        let depth = prop_oneof![4 => 9.0..12.0f64, 1 => Just(f64::INFINITY)];
        prop::collection::vec(depth, 24).prop_map(|cells| Grid::from_cells(6, 4, cells))
    }

    fn middle(_: DVec3, [near, far]: [f64; 2]) -> Option<f64> {
        Some((near + far) / 2.0)
    }

    fn seen(depth: &Grid<f64>) -> usize {
        depth.cells().iter().filter(|d| d.is_finite()).count()
    }

    proptest! {
        /// For a camera that is not turned against the layers, errors are those of the formula
        /// for two depths z and z' on one ray from the reference viewpoint with slope u, seen
        /// from v: |v_xy - u v_z| |1 / (z - v_z) - 1 / (z' - v_z)|.
        #[test]
        fn errors_follow_the_formula_for_depths(
            depth in depths(),
            v in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let reference = recorded().reference;
            let v = DVec3::from(v);
            let camera = camera(Pose { eye: reference.point_in_world(v), ..reference });
            let in_camera = Grid::from_cells(6, 4, depth.cells().iter().map(|z| z - v.z).collect());
            let found = parallax(&in_camera, &in_camera, &camera, &recorded(), 0.5, middle, |_, _| false);
            let mut expected = Vec::new();
            for y in 0..4 {
                for x in 0..6 {
                    let z = depth[(x, y)];
                    if z.is_infinite() { continue; }
                    let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let u = (camera.view_from_pixel(pixel, z - v.z) + v).truncate() / z;
                    let layer = BORDERS[1..3].iter().filter(|border| **border <= z).count();
                    let shown = (BORDERS[layer] + BORDERS[layer + 1]) / 2.0;
                    let apart = (v.truncate() - u * v.z) * (1.0 / (z - v.z) - 1.0 / (shown - v.z));
                    expected.push(((apart / camera.pixel_size()).length(), [x as u32, y as u32]));
                }
            }
            prop_assert_eq!(found.errors.count(), expected.len() as u64);
            prop_assert!(found.unmet.is_empty());
            let worst = expected.iter().map(|(error, _)| *error).fold(0.0, f64::max);
            // Coordinates of at most 20 m, rounded a dozen times, over pixels of 0.05 at 7 m.
            prop_assert!((found.errors.max() - worst).abs() < 1e-11);
            prop_assert_eq!(found.worst.map(|(error, _)| error).unwrap_or(0.0), found.errors.max());
            let clear = expected.iter().all(|(error, _)| (error - 0.5).abs() > 1e-9);
            prop_assume!(clear);
            let above = expected.iter().filter(|(error, _)| *error > 0.5).map(|(_, p)| *p);
            prop_assert_eq!(found.above, above.collect::<Vec<_>>());
        }

        /// From the reference viewpoint nothing is displaced, wherever the impostor is met and
        /// however the camera is turned.
        #[test]
        fn nothing_is_displaced_from_the_reference_viewpoint(
            depth in depths(),
            turn in prop::array::uniform2(-0.3..0.3f64),
            stretch in 0.5..2.0f64,
        ) {
            let axis = DVec3::new(turn[0], turn[1], -1.0);
            let camera = camera(Pose::looking_along(recorded().reference.eye, axis));
            // Within the range but where asked, so that no ray beside is tried.
            let meet = |_: DVec3, [near, far]: [f64; 2]| Some((near + far * stretch) / (1.0 + stretch));
            let found = parallax(&depth, &depth, &camera, &recorded(), 0.1, meet, |_, _| false);
            prop_assert_eq!(found.errors.count() as usize, seen(&depth));
            prop_assert!(found.errors.max() < 1e-11, "{}", found.errors.max());
        }

        /// The range of what is flat has no thickness, and a quad read from a file lies beside it by
        /// the rounding of its coordinates: the point's own ray meets it all the same.
        #[test]
        fn a_flat_scene_is_not_displaced_by_rounding(off in -1e-7..1e-7f64) {
            let recorded = RecordedFrom { borders: &[10.0, 10.0], ..recorded() };
            let camera = camera(recorded.reference);
            let depth = Grid::filled(6, 4, 10.0);
            // Rays beside the point's own happen to round the other way.
            let meet = |ray: DVec3, [near, _]: [f64; 2]| {
                let pixel = camera.pixel_from_view(recorded.reference.point_in_view(
                    recorded.reference.eye + ray)).fract() - 0.5;
                let own = pixel.abs().max_element() < 1e-6;
                Some(if own { near * (1.0 + off) } else { near })
            };
            let found = parallax(&depth, &depth, &camera, &recorded, 0.1, meet, |_, _| false);
            prop_assert!(found.errors.max() < 1e-5, "{}", found.errors.max());
        }

        /// A point that is not there is hidden exactly where the impostor shows a nearer layer that
        /// is close by in the original.
        #[test]
        fn what_a_near_silhouette_hides_is_not_displaced(x in 0..6usize, y in 0..4usize) {
            let camera = camera(recorded().reference);
            // A wall at 11 m, and a post before it in the corner.
            let mut depth = Grid::filled(6, 4, 11.0);
            depth[(0, 0)] = 9.5;
            // Of the wall nothing is left, and the post covers a pixel more.
            let mut shown = Grid::filled(6, 4, f64::INFINITY);
            shown[(x, y)] = 9.7;
            let post = |_: DVec3, _: [f64; 2]| Some(9.7);
            let found = parallax(&depth, &shown, &camera, &recorded(), 0.0, post, |_, _| false);
            let hides = (x, y) != (0, 0) && x <= 2 && y <= 2;
            prop_assert_eq!(found.hidden, u64::from(hides));
            prop_assert_eq!(found.errors.count() + found.hidden, 24);
        }

        /// Where nothing is met inside the range, the nearest of what all nine rays meet counts.
        #[test]
        fn the_nearest_of_nine_rays_counts(
            v in prop::array::uniform3(-2.0..2.0f64),
            met in prop::array::uniform9(prop::option::of(5.0..16.0f64)),
        ) {
            let recorded = recorded();
            let reference = recorded.reference;
            let eye = reference.point_in_world(DVec3::from(v));
            let camera = Camera { width: 1, height: 1, ..camera(Pose { eye, ..reference }) };
            let depth = Grid::filled(1, 1, 10.2 - v[2]);
            let pixel = DVec2::splat(0.5);
            let point = camera.pose.point_in_world(camera.view_from_pixel(pixel, depth[(0, 0)]));
            let through = (point - reference.eye) / 10.2;
            let ray_of = |i: usize| {
                let texels = DVec2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0) * recorded.texel;
                through + reference.right * texels.x + reference.down * texels.y
            };
            let meet = |ray: DVec3, range: [f64; 2]| {
                assert_eq!(range, [10.0, 10.5]);
                (0..9).find(|i| ray.abs_diff_eq(ray_of(*i), 1e-9)).and_then(|i| met[i])
            };
            let found = parallax(&depth, &depth, &camera, &recorded, 0.0, meet, |_, _| false);
            let error = |i: usize, depth: f64| {
                let point = reference.eye + ray_of(i) * depth;
                camera.pixel_from_view(camera.pose.point_in_view(point)).distance(pixel)
            };
            let beyond = |depth: f64| (10.0 - depth).max(depth - 10.5).max(0.0);
            let least = met.iter().flatten().map(|d| beyond(*d)).fold(f64::INFINITY, f64::min);
            let expected = match met[4] {
                Some(depth) if beyond(depth) == 0.0 => Some(error(4, depth)),
                _ => (0..9)
                    .filter_map(|i| met[i].filter(|d| beyond(*d) == least).map(|d| error(i, d)))
                    .reduce(f64::min),
            };
            match expected {
                None => prop_assert_eq!(found.unmet, [[0, 0]]),
                Some(expected) => {
                    let found = found.worst.unwrap().0;
                    prop_assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
                }
            }
        }
    }

    #[test]
    fn what_is_met_behind_the_camera_is_not_seen() {
        let reference = recorded().reference;
        let eye = reference.point_in_world(DVec3::Z * 8.0);
        let camera = camera(Pose { eye, ..reference });
        let depth = Grid::filled(6, 4, 2.2);
        let found = parallax(
            &depth,
            &depth,
            &camera,
            &recorded(),
            1.0,
            |_, _| Some(7.0),
            |_, _| false,
        );
        assert_eq!((found.unmet.len(), found.errors.count()), (24, 0));
        let found = parallax(
            &depth,
            &depth,
            &camera,
            &recorded(),
            1.0,
            |_, _| None,
            |_, _| false,
        );
        assert_eq!((found.unmet.len(), found.worst), (24, None));
    }
}
