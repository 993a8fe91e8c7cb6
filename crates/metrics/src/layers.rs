//! Which layer's range of depths a picture shows at each pixel.

use farfield_grid::Grid;
use farfield_views::{Camera, Pose};
use glam::{DVec2, DVec3};

/// The index of nothing.
pub const NONE: u32 = u32::MAX;

/// Per pixel the index of the layer whose range holds the depth of the surface seen, or [`NONE`].
///
/// * `depth` - along the camera's view axis, in metres; infinite where nothing is seen
/// * `reference` - the reference viewpoint: layers lie across its view axis
/// * `borders` - ascending depths from the reference viewpoint, one more than layers; what lies
///   before the first or behind the last belongs to the first or last layer
///
/// # Panics
///
/// When `depth` is not of the camera's size or there are fewer than two borders.
pub fn layer_indices(
    depth: &Grid<f64>,
    camera: &Camera,
    reference: &Pose,
    borders: &[f64],
) -> Grid<u32> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    assert_eq!((depth.width(), depth.height()), (width, height));
    let layers = LayersSeen::new(camera, reference, borders);
    let index = |(i, &depth): (usize, &f64)| {
        let pixel = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        layers.at(pixel, depth)
    };
    Grid::from_cells(
        width,
        height,
        depth.cells().iter().enumerate().map(index).collect(),
    )
}

/// The layers that a camera looks at.
#[derive(Clone, Copy, Debug)]
pub struct LayersSeen<'a> {
    camera: &'a Camera,
    /// The reference viewpoint's view axis, in the camera's view space.
    axis: DVec3,
    /// What the depth from the reference viewpoint has more at the camera.
    offset: f64,
    inner: &'a [f64],
}

impl<'a> LayersSeen<'a> {
    /// * `reference` - the reference viewpoint: layers lie across its view axis
    /// * `borders` - ascending depths from the reference viewpoint, one more than layers
    ///
    /// # Panics
    ///
    /// When there are fewer than two borders.
    pub fn new(camera: &'a Camera, reference: &Pose, borders: &'a [f64]) -> Self {
        assert!(
            borders.len() >= 2,
            "{} borders hold no layer",
            borders.len()
        );
        Self {
            camera,
            axis: camera.pose.view_from_world() * reference.forward,
            offset: (camera.pose.eye - reference.eye).dot(reference.forward),
            inner: &borders[1..borders.len() - 1],
        }
    }

    /// The index of the layer whose range holds what is seen at pixel coordinates; what lies before the
    /// first or behind the last belongs to the first or last layer. [`NONE`] for an infinite depth.
    ///
    /// * `depth` - along the camera's view axis, in metres
    pub fn at(&self, pixel: DVec2, depth: f64) -> u32 {
        if depth.is_infinite() {
            return NONE;
        }
        // The depth from the reference viewpoint is linear in the point, so in the pixel too.
        let from_reference = self.camera.view_from_pixel(pixel, depth).dot(self.axis) + self.offset;
        self.inner
            .partition_point(|border| *border <= from_reference) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A point seen by any camera gets the layer in whose range its depth from the reference
        /// viewpoint lies.
        #[test]
        fn indices_follow_the_depth_from_the_reference_viewpoint(
            eye in prop::array::uniform3(-1.0..1.0f64),
            point in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let reference = Pose::looking_along(DVec3::new(0.0, 0.0, 10.0), DVec3::NEG_Z);
            let borders = [9.0, 9.5, 10.0, 10.7, 11.0];
            let (eye, point) = (DVec3::from(eye) + DVec3::Z * 6.0, DVec3::from(point));
            let camera = Camera::looking_at(eye, point, 1.0, 5);
            let mut depth = Grid::filled(5, 5, f64::INFINITY);
            depth[(2, 2)] = camera.pose.point_in_view(point).z;
            let indices = layer_indices(&depth, &camera, &reference, &borders);
            let from_reference = 10.0 - point.z;
            prop_assume!(borders.iter().all(|b| (b - from_reference).abs() > 1e-9));
            let expected = borders.iter().filter(|b| **b < from_reference).count().clamp(1, 4) - 1;
            prop_assert_eq!(indices[(2, 2)], expected as u32);
            prop_assert_eq!(indices.cells().iter().filter(|i| **i != NONE).count(), 1);
        }
    }
}
