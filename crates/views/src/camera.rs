//! Cameras with off-axis frusta.

use crate::Pose;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Lateral bounds of a frustum per unit of depth, in view space.
///
/// A point (x, y, z) of view space with z > 0 lies inside if
/// `min.x <= x / z <= max.x`, and so for y. The frustum need not be centred on the view axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Slopes of the left and upper bounds.
    pub min: DVec2,
    /// Slopes of the right and lower bounds.
    pub max: DVec2,
}

impl Extent {
    /// The centred extent of a camera whose larger side spans `fov` radians.
    ///
    /// # Panics
    ///
    /// When `fov` is not between 0 and pi.
    pub fn symmetric(fov: f64, width: u32, height: u32) -> Self {
        assert!(
            fov > 0.0 && fov < std::f64::consts::PI,
            "a field of view of {fov} radians is not between 0 and pi"
        );
        let size = DVec2::new(f64::from(width), f64::from(height));
        let max = size / size.max_element() * (fov / 2.0).tan();
        Self { min: -max, max }
    }

    /// Width and height per unit of depth.
    pub fn size(&self) -> DVec2 {
        self.max - self.min
    }

    /// The four outermost slopes: upper left, upper right, lower left, lower right.
    pub fn corners(&self) -> [DVec2; 4] {
        [
            self.min,
            DVec2::new(self.max.x, self.min.y),
            DVec2::new(self.min.x, self.max.y),
            self.max,
        ]
    }
}

/// A pinhole camera that records `width` x `height` pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands and how it is turned.
    pub pose: Pose,
    /// What it sees, per unit of depth.
    pub extent: Extent,
    /// Columns of pixels.
    pub width: u32,
    /// Rows of pixels.
    pub height: u32,
}

impl Camera {
    /// A square camera of `resolution` pixels a side and `fov` radians that looks from `eye`
    /// at `target`.
    ///
    /// # Panics
    ///
    /// When `eye` is `target` or `fov` is not between 0 and pi.
    pub fn looking_at(eye: DVec3, target: DVec3, fov: f64, resolution: u32) -> Self {
        Self {
            pose: Pose::looking_along(eye, target - eye),
            extent: Extent::symmetric(fov, resolution, resolution),
            width: resolution,
            height: resolution,
        }
    }

    /// Width and height of a pixel per unit of depth.
    #[inline]
    pub fn pixel_size(&self) -> DVec2 {
        self.extent.size() / DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// A camera that sees only some columns and rows of this one's picture.
    pub fn window(&self, columns: &Range<u32>, rows: &Range<u32>) -> Self {
        let at = |x: u32, y: u32| self.view_from_pixel(DVec2::new(x.into(), y.into()), 1.0);
        Self {
            pose: self.pose,
            extent: Extent {
                min: at(columns.start, rows.start).truncate(),
                max: at(columns.end, rows.end).truncate(),
            },
            width: columns.end - columns.start,
            height: rows.end - rows.start,
        }
    }

    /// A camera that sees at each pixel what this one sees so many pixels beside it.
    pub fn shifted(&self, pixels: DVec2) -> Self {
        let slopes = pixels * self.pixel_size();
        Self {
            extent: Extent {
                min: self.extent.min + slopes,
                max: self.extent.max + slopes,
            },
            ..*self
        }
    }

    /// Pixel coordinates of a point in view space; pixel (i, j) covers [i, i+1] x [j, j+1].
    ///
    /// Meaningful only for a positive depth z.
    #[inline]
    pub fn pixel_from_view(&self, point: DVec3) -> DVec2 {
        (DVec2::new(point.x, point.y) / point.z - self.extent.min) / self.pixel_size()
    }

    /// The point of view space that pixel coordinates show at a depth.
    #[inline]
    pub fn view_from_pixel(&self, pixel: DVec2, depth: f64) -> DVec3 {
        let slope = self.extent.min + pixel * self.pixel_size();
        (slope * depth).extend(depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_symmetric_camera_sees_its_field_of_view() {
        let fov = 45f64.to_radians();
        let extent = Extent::symmetric(fov, 512, 256);
        assert!((extent.max.x - (fov / 2.0).tan()).abs() < 1e-15);
        assert!((extent.max.y - extent.max.x / 2.0).abs() < 1e-15);
    }

    #[test]
    fn the_target_is_in_the_middle() {
        let target = DVec3::new(3.0, 1.0, -2.0);
        let camera = Camera::looking_at(DVec3::new(0.0, 5.0, 9.0), target, 1.0, 100);
        let pixel = camera.pixel_from_view(camera.pose.point_in_view(target));
        assert!(pixel.abs_diff_eq(DVec2::splat(50.0), 1e-10));
    }

    proptest! {
        /// A window sees each of its pixels where the whole picture has it.
        #[test]
        fn a_window_sees_what_the_whole_sees(x in 0..20u32, y in 0..20u32, slope in -1.0..1.0f64) {
            let camera = Camera::looking_at(DVec3::ZERO, DVec3::Z, 1.0, 32);
            let window = camera.window(&(x..x + 7), &(y..y + 12));
            prop_assert_eq!([window.width, window.height], [7, 12]);
            let point = DVec3::new(slope, -slope / 2.0, 1.0);
            let whole = camera.pixel_from_view(point) - DVec2::new(x.into(), y.into());
            prop_assert!(whole.distance(window.pixel_from_view(point)) < 1e-10);
        }

        /// What a shifted camera sees in a pixel lies beside it in the picture.
        #[test]
        fn a_shifted_camera_sees_what_is_beside(
            x in -1.0..1.0f64, y in -1.0..1.0f64, slope in -1.0..1.0f64,
        ) {
            let camera = Camera::looking_at(DVec3::ZERO, DVec3::Z, 1.0, 32);
            let aside = DVec2::new(x, y);
            let point = DVec3::new(slope, -slope / 2.0, 1.0);
            let beside = camera.shifted(aside).pixel_from_view(point) + aside;
            prop_assert!(camera.pixel_from_view(point).distance(beside) < 1e-10);
        }

        /// A pixel taken to a point and back is the same pixel, off-axis extents included.
        #[test]
        fn pixel_from_view_inverts_view_from_pixel(
            pixel in prop::array::uniform2(-10.0..600.0f64),
            depth in 1e-3..1e3f64,
            bounds in prop::array::uniform4(0.1..3.0f64),
        ) {
            let min = DVec2::new(bounds[0] - 2.0, bounds[1] - 2.0);
            let camera = Camera {
                pose: Pose::looking_along(DVec3::ZERO, DVec3::X),
                extent: Extent { min, max: min + DVec2::new(bounds[2], bounds[3]) },
                width: 512,
                height: 300,
            };
            let pixel = DVec2::from(pixel);
            let back = camera.pixel_from_view(camera.view_from_pixel(pixel, depth));
            // Slopes of at most 60 are rounded to 2^-53 and divided by pixels of 1e-4 and more.
            prop_assert!(back.abs_diff_eq(pixel, 1e-9), "{back} is not {pixel}");
        }
    }
}
