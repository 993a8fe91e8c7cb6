//! Where a masked triangle is there within a texel of a layer.

use crate::geometry::Interpolation;
use crate::masked::{Masked, Place, bounds, cut_to_side};
use crate::piece::Corner;
use farfield_views::Camera;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Searches texels for points of a triangle that are there.
#[derive(Debug)]
pub(crate) struct TexelSearch<'a> {
    camera: &'a Camera,
    masked: &'a Masked<'a>,
    /// Of the triangle, in view space.
    corners: [DVec3; 3],
    interpolation: Option<Interpolation>,
    /// Room for the polygons of a search.
    places: Vec<Place>,
}

impl<'a> TexelSearch<'a> {
    pub(crate) fn new(camera: &'a Camera, corners: [DVec3; 3], masked: &'a Masked<'a>) -> Self {
        Self {
            camera,
            masked,
            corners,
            interpolation: Interpolation::new(camera, corners),
            places: Vec::new(),
        }
    }

    /// Whether the triangle lies over centres of texels: not where it is seen edge-on.
    pub(crate) fn sees_centers(&self) -> bool {
        self.interpolation.is_some()
    }

    /// A point, in barycentric coordinates, where a part of the triangle lies in the texel around
    /// `center` and is there, if there is one.
    pub(crate) fn some_point(&mut self, part: &[Corner], center: DVec2) -> Option<DVec3> {
        self.places.clear();
        let places = part.iter().map(|corner| self.masked.place(corner.weights));
        self.places.extend(places);
        if self.is_surely_empty(center) {
            return None;
        }
        let part = part_in_texel(self.camera, self.corners, &mut self.places, center);
        self.masked.some_point(&mut self.places, part)
    }

    /// Whether alpha is too small wherever both the texel and the part reach in the texture, by
    /// the bounds of what they cover there: most texels of a card of leaves lie between them.
    fn is_surely_empty(&self, center: DVec2) -> bool {
        let Some(interpolation) = &self.interpolation else {
            return false;
        };
        let square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let seen = square.map(|(x, y)| interpolation.weights(center + DVec2::new(x, y)));
        // The plane's points before the camera form a convex quadrangle on the texture.
        if seen.iter().any(|weights| weights.element_sum() <= 0.0) {
            return false;
        }
        let on_plane = seen.map(|weights| self.masked.place(weights / weights.element_sum()));
        let [min, max] = bounds(&on_plane);
        // Far more than rounding, which grows with what a texel covers of the texture.
        let doubt = (max - min) / 64.0 + 1.0 / 64.0;
        let [part_min, part_max] = bounds(&self.places);
        let both = [part_min.max(min - doubt), part_max.min(max + doubt)];
        both[0].cmple(both[1]).all() && !self.masked.may_be_in(both)
    }
}

/// The part of a polygon that lies in the texel around `center`: a run of `places`, which holds
/// the polygon before and gets others on the way.
///
/// `corners` are the triangle's, in view space.
fn part_in_texel(
    camera: &Camera,
    [a, b, c]: [DVec3; 3],
    places: &mut Vec<Place>,
    center: DVec2,
) -> Range<usize> {
    let [low, high] = [center - 0.5, center + 0.5].map(|p| camera.view_from_pixel(p, 1.0));
    let [x, y, z] = [
        DVec3::new(a.x, b.x, c.x),
        DVec3::new(a.y, b.y, c.y),
        DVec3::new(a.z, b.z, c.z),
    ];
    let sides = [x - z * low.x, z * high.x - x, y - z * low.y, z * high.y - y];
    sides.into_iter().fold(0..places.len(), |part, side| {
        cut_to_side(places, part, |place| side.dot(place.weights))
    })
}
