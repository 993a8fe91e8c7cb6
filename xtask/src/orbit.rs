//! Views from around a scene, between two distances.

use anyhow::{Result, bail};
use farfield_bitfields::Distances;
use farfield_bundle::ViewSpace;
use farfield_views::{Camera, Extent, Pose, direction_at, random_point};
use glam::DVec3;

/// How near viewers may be, in radii of the scene. Nearer ones look at it from the side or from
/// within: pictures that hold all of it become too large.
pub(crate) const NEAREST: f64 = 1.1;

/// How many times finer than the pixels of pictures those of the bake are, along each side.
///
/// On the bunny, with adaptive samples, 2 culled 21.7 % and 3 culled 22.5 %, with as many views, and took
/// twice as long to sample: where less is missed, less is added to sets.
pub(crate) const FINER: f64 = 2.0;

/// Pixels along each side of what the bake sees: more take minutes each.
pub(crate) const MOST_PIXELS: f64 = 32_768.0;

/// Where viewers are when nothing is said: from where the scene just fits into the picture, to so many
/// times as far, where it is a quarter as wide.
const RANGE: f64 = 4.0;

/// The least and the greatest distance of viewers, as the command line names them: `MIN:MAX`, in metres.
///
/// # Errors
///
/// When these are no such.
pub fn distances_from_argument(text: &str) -> Result<[f64; 2], String> {
    let numbers = text.split_once(':');
    let distances = numbers.and_then(|(min, max)| Some([min.parse().ok()?, max.parse().ok()?]));
    let distances: [f64; 2] = distances.ok_or("distances are MIN:MAX in metres, such as 2:10")?;
    if !distances.iter().all(|d| *d > 0.0 && d.is_finite()) {
        return Err("distances are positive and finite".into());
    }
    require_order(distances).map_err(|why| format!("the distances {why}"))?;
    Ok(distances)
}

/// A number for people, who do not count the digits of 1e300.
pub(crate) fn number(number: f64) -> String {
    match number == 0.0 || (1e-9..1e15).contains(&number.abs()) {
        true => number.to_string(),
        false => format!("{number:e}"),
    }
}

fn require_order([near, far]: [f64; 2]) -> Result<(), String> {
    match near <= far {
        true => Ok(()),
        false => Err(format!(
            "are not in order: name the nearest first, as in {}:{}",
            number(far),
            number(near)
        )),
    }
}

/// Cameras of one kind around a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orbit {
    /// What cameras look at: the centre of the scene's box.
    pub(crate) center: DVec3,
    /// From there to the corners of the box, in metres.
    pub(crate) radius: f64,
    /// Least and greatest distance from the centre, in metres.
    pub(crate) distances: [f64; 2],
    /// Full angle that pictures show, in radians.
    pub(crate) fov: f64,
    /// Pixels along each side of pictures.
    pub(crate) resolution: u32,
}

impl Orbit {
    /// Around a box, from the distances given or the usual ones.
    ///
    /// # Errors
    ///
    /// When distances are not in order, or so near that they are inside of the scene.
    pub(crate) fn new(
        [min, max]: [DVec3; 2],
        distances: Option<[f64; 2]>,
        fov: f64,
        resolution: u32,
    ) -> Result<Self> {
        let (center, radius) = ((min + max) / 2.0, min.distance(max) / 2.0);
        let least = NEAREST * radius;
        let fitting = (radius / (fov / 2.0).sin()).max(least);
        let distances = distances.unwrap_or([fitting, RANGE * fitting]);
        let [near, far] = distances;
        if let Err(why) = require_order(distances) {
            bail!("--distances {}:{} {why}", number(near), number(far));
        }
        if near < least {
            bail!(
                "viewers at {} m are inside of the scene or just before it: its corners are \
                 {radius:.6} m from its centre ({}, {}, {}); name distances of {:.6} m and more with \
                 --distances",
                number(near),
                center.x,
                center.y,
                center.z,
                least
            );
        }
        let orbit = Self {
            center,
            radius,
            distances,
            fov,
            resolution,
        };
        let pixel = 2.0 * (fov / 2.0).tan() / f64::from(resolution);
        if far.is_infinite() || 2.0 * radius / far < pixel {
            bail!(
                "seen from {} m the scene is less than a pixel wide: name distances nearer by with \
                 --distances",
                number(far)
            );
        }
        let pixels = orbit.recorded_pixels(FINER);
        if pixels > MOST_PIXELS {
            bail!(
                "all of the scene in pixels as fine as in pictures from {} m is {pixels:.0} pixels \
                 wide, more than {MOST_PIXELS}: lower the resolution, or name distances farther away",
                number(near)
            );
        }
        Ok(orbit)
    }

    /// Half of what the scene is wide, seen from a distance, per unit of depth.
    fn half_width(&self, distance: f64) -> f64 {
        let half = (self.radius / distance).clamp(0.0, 1.0).asin().tan();
        // Of what lies on a line or in a point something is seen too.
        half.max(f64::MIN_POSITIVE.sqrt())
    }

    /// Pixels along each side of a picture of all of the scene, `finer` times as fine as pictures from
    /// the least distance.
    fn recorded_pixels(&self, finer: f64) -> f64 {
        let pixel = 2.0 * (self.fov / 2.0).tan() / f64::from(self.resolution) / finer;
        (2.0 * self.half_width(self.distances[0]) / pixel)
            .ceil()
            .max(1.0)
    }

    /// From how far samples are taken: from the least and from the greatest distance.
    pub(crate) fn sampled(&self) -> Distances {
        let [nearest, farthest] = self.distances;
        Distances {
            nearest,
            farthest,
            samples: if nearest == farthest { 1 } else { 2 },
        }
    }

    /// As the manifest tells it.
    pub(crate) fn space(&self) -> ViewSpace {
        let [near, far] = self.distances;
        ViewSpace::Shell {
            center: self.center,
            near,
            far,
        }
    }

    /// The camera that the promise is made for, at an offset from the centre.
    pub(crate) fn camera(&self, offset: DVec3) -> Camera {
        let eye = self.center + offset;
        Camera::looking_at(eye, self.center, self.fov, self.resolution)
    }

    /// The part of such a camera's picture that can show anything of the scene: a window that holds the
    /// sphere around it.
    pub(crate) fn window(&self, camera: &Camera) -> Camera {
        let distance = camera.pose.eye.distance(self.center);
        let half = self.half_width(distance) / camera.pixel_size();
        let middle = f64::from(self.resolution) / 2.0;
        let range = |half: f64| {
            // A pixel more, for roundings.
            let first = (middle - half - 1.0).floor().max(0.0) as u32;
            first..self.resolution - first
        };
        camera.window(&range(half.x), &range(half.y))
    }

    /// View `index` of an endless sequence of views that have nothing to do with each other, another one
    /// for each seed: directions and the reciprocals of distances are uniformly distributed.
    pub(crate) fn view(&self, index: u64, seed: u64) -> Camera {
        let point = random_point(index, seed);
        self.camera(direction_at(point.truncate()) * self.sampled().at(point.z))
    }

    /// The camera that records what can be seen from an offset from the centre: it holds all of the scene, whatever its
    /// field of view, in pixels `finer` times as fine as those of pictures from the least distance.
    pub(crate) fn recorder(&self, offset: DVec3, finer: f64) -> Camera {
        let (half, pixels) = (
            self.half_width(offset.length()),
            self.recorded_pixels(finer) as u32,
        );
        let eye = self.center + offset;
        Camera {
            pose: Pose::looking_along(eye, self.center - eye),
            extent: Extent::symmetric(2.0 * half.atan(), pixels, pixels),
            width: pixels,
            height: pixels,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn orbits() -> impl Strategy<Value = ([DVec3; 2], Orbit)> {
        let corner = prop::array::uniform3(-1e3..1e3f64);
        let size = prop::array::uniform3(0.0..1e3f64);
        let range = prop::option::of((1.01 * NEAREST..9.0f64, 1.0..9.0f64));
        (corner, size, range, 20.0..90.0f64, 200..600u32).prop_map(
            |(corner, size, range, fov, resolution)| {
                let min = DVec3::from(corner);
                let bounds = [min, min + DVec3::from(size) + 1e-3];
                let radius = bounds[0].distance(bounds[1]) / 2.0;
                let distances = range.map(|(near, more)| [near, near * more].map(|d| d * radius));
                let orbit = Orbit::new(bounds, distances, fov.to_radians(), resolution);
                (bounds, orbit.expect("the distances are far enough"))
            },
        )
    }

    proptest! {
        /// Views are taken from between the two distances and look at the centre, half of them from
        /// nearer than where parallax is half of what it can be; those of other seeds from other places.
        #[test]
        fn views_stay_in_the_range((_, orbit) in orbits(), seed: u64) {
            let [near, far] = orbit.distances;
            let distance = |view| orbit.view(view, seed).pose.eye.distance(orbit.center);
            let all: Vec<f64> = (0..200).map(distance).collect();
            // Adding the centre and taking it away again rounds numbers of up to 1e5.
            let slack = 1e-10 * (far + orbit.center.length());
            prop_assert!(all.iter().all(|d| *d > near - slack && *d < far + slack));
            let nearer = all.iter().filter(|d| **d < orbit.sampled().at(0.5)).count();
            // Six deviations of the square root of 200 / 4.
            prop_assert!(nearer.abs_diff(100) < 43, "{nearer}");
            // Steps of a sequence that fills the sphere evenly are the same.
            let height = |view| orbit.view(view, seed).pose.forward.y;
            let step = |view: u64| (height(view + 1) - height(view)).rem_euclid(2.0);
            prop_assert!((step(0) - step(1)).abs() > 1e-9);
            let camera = orbit.view(7, seed);
            let ahead = camera.pose.point_in_view(orbit.center);
            prop_assert!(ahead.truncate().length() < 1e-9 * (far + orbit.center.length()));
            prop_assert!(camera.pose.eye != orbit.view(7, seed ^ 1).pose.eye);
        }

        /// The window of a picture leaves out nothing of the scene that the picture shows, and what the
        /// bake sees holds all of the scene, in pixels as fine as it says.
        #[test]
        fn nothing_of_the_scene_is_cut_off((bounds, orbit) in orbits(), view in 0..1000u64) {
            let camera = orbit.view(view, 1);
            let window = orbit.window(&camera);
            let eye = camera.pose.eye - orbit.center;
            let recorder = orbit.recorder(eye, FINER);
            for i in 0..8 {
                let at = |axis: usize| bounds[i >> axis & 1][axis];
                let corner = DVec3::new(at(0), at(1), at(2));
                let pixel = camera.pixel_from_view(camera.pose.point_in_view(corner));
                let size = f64::from(orbit.resolution);
                if pixel.min_element() > 0.0 && pixel.max_element() < size {
                    let inside = window.pixel_from_view(window.pose.point_in_view(corner));
                    prop_assert!(inside.min_element() >= 0.0);
                    prop_assert!(inside.max_element() <= f64::from(window.width));
                }
                let pixel = recorder.pixel_from_view(recorder.pose.point_in_view(corner));
                // Corners lie on the sphere that just fits in.
                let slack = 1e-6 * f64::from(recorder.width);
                prop_assert!(pixel.min_element() > -slack);
                prop_assert!(pixel.max_element() < f64::from(recorder.width) + slack);
            }
            let finest = recorder.pixel_size().x * FINER;
            prop_assert!(finest <= camera.pixel_size().x * (1.0 + 1e-9));
        }
    }

    /// Distances that make no sense are refused with what to do.
    #[test]
    fn distances_must_be_outside_and_in_order() {
        let cube = [DVec3::NEG_ONE, DVec3::ONE];
        for (distances, what) in [
            ([9.0, 8.0], "name the nearest first, as in 8:9"),
            ([1.0, 8.0], "inside of the scene"),
            ([1.8, 8.0], "inside of the scene"),
            ([2.0, f64::INFINITY], "less than a pixel"),
            (
                [2.0, 1e300],
                "seen from 1e300 m the scene is less than a pixel",
            ),
            ([1e300, 1e-300], "as in 1e-300:1e300"),
        ] {
            let error = Orbit::new(cube, Some(distances), 0.8, 512).unwrap_err();
            let message = error.to_string();
            assert!(message.contains(what), "{message}");
        }
        let orbit = Orbit::new(cube, None, 0.8, 512).unwrap();
        assert!((orbit.distances[0] - 3f64.sqrt() / 0.4f64.sin()).abs() < 1e-12);
    }
}
