//! What an engine needs to light an impostor, beside the original's.

use super::subject::{Side, Subject};
use crate::bake::channels::metallic;
use farfield_grid::{BitMask, Grid};
use farfield_metrics::{ColorDifference, Picture, color_difference};
use farfield_sampling::{Surface, Visibility, surfaces};
use farfield_views::Camera;

/// Differences of what light meets, as those of colours: 255 is the whole range. The light that
/// pictures are rendered under is reflected by what is rough and no metal whatever the pages say.
#[derive(Default)]
pub(super) struct SurfaceDifference {
    /// x, y and z in the world; from -1 to 1 it is 255.
    normal: ColorDifference,
    /// The same twice, and nothing.
    roughness_metallic: ColorDifference,
}

/// By how much what light meets is off on average.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SurfaceBias {
    /// Of the normals' x, y and z in the world, as a share of the range from -1 to 1.
    pub normal: [f64; 3],
    /// Of the roughness.
    pub roughness: f64,
    /// Of what is metallic.
    pub metallic: f64,
}

impl SurfaceDifference {
    /// Adds the differences of another view.
    pub(super) fn merge(&mut self, other: &Self) {
        self.normal.merge(&other.normal);
        self.roughness_metallic.merge(&other.roughness_metallic);
    }

    /// Means over all pixels, unlike those of colours: pages are only damaged here and there, and
    /// where both show the same layer little else differs.
    pub(super) fn bias(&self) -> SurfaceBias {
        let [roughness, metallic, _] = self.roughness_metallic.mean_bias();
        SurfaceBias {
            normal: self.normal.mean_bias(),
            roughness,
            metallic,
        }
    }
}

impl SurfaceBias {
    /// The one that is farthest from 0.
    pub(super) fn worst(&self) -> f64 {
        let [x, y, z] = self.normal;
        let farther = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
        [x, y, z, self.roughness, self.metallic]
            .into_iter()
            .fold(0.0, farther)
    }
}

/// Compares what light meets at the pixels of a region.
///
/// * `seen` - by the original and the impostor
/// * `alike` - what the impostor shows where it is to be compared, else nothing
pub(super) fn surface_difference(
    subject: &Subject<'_>,
    camera: &Camera,
    seen: [&Visibility; 2],
    alike: &Grid<u32>,
    region: &BitMask,
) -> SurfaceDifference {
    let found = |side: &Side<'_>, seen| surfaces(side.scene, side.textures, camera, seen);
    let original = found(&subject.original, seen[0]);
    let impostor = found(&subject.impostor, seen[1]);
    let compared = |of: fn(&Surface) -> [f32; 3]| {
        let [before, after] = [&original, &impostor].map(|surfaces| bytes(surfaces, of));
        let before = Picture {
            colors: &before,
            ids: &seen[0].objects,
        };
        let after = Picture {
            colors: &after,
            ids: alike,
        };
        color_difference(before, after, region)
    };
    SurfaceDifference {
        normal: compared(|surface| (surface.normal * 0.5 + 0.5).to_array()),
        roughness_metallic: compared(|surface| [surface.roughness, metallic(surface), 0.0]),
    }
}

fn bytes(surfaces: &Grid<Option<Surface>>, of: fn(&Surface) -> [f32; 3]) -> Grid<[u8; 3]> {
    let byte = |share: f32| (share * 255.0).round().clamp(0.0, 255.0) as u8;
    let cells = surfaces.cells().iter();
    let cells = cells.map(|surface| surface.as_ref().map_or([0; 3], |s| of(s).map(byte)));
    Grid::from_cells(surfaces.width(), surfaces.height(), cells.collect())
}
