//! All views together, in memory that does not grow with their number.

use super::surface::SurfaceDifference;
use super::view::ViewFigures;
use farfield_metrics::{ColorDifference, Coverage, Distribution, SilhouetteDisplacement};
use glam::DVec3;

/// The figures of views that were added in order.
#[derive(Default)]
pub(super) struct Totals {
    pub(super) views: u64,
    pub(super) gap_pixels: u64,
    pub(super) phantom_pixels: u64,
    pub(super) back_pixels: u64,
    pub(super) behind_pixels: u64,
    /// Surface points that are displaced by more than is promised.
    pub(super) displaced_pixels: u64,
    /// Surface points whose ray meets nothing of the impostor.
    pub(super) unmet_pixels: u64,
    pub(super) coverage: Coverage,
    pub(super) covered_by_impostor: u64,
    pub(super) parallax: Distribution,
    pub(super) silhouette: SilhouetteDisplacement,
    pub(super) color: ColorDifference,
    pub(super) surface: SurfaceDifference,
    /// Pixels inside of what both sides cover.
    pub(super) interior_pixels: u64,
    /// Those of them that lie amidst colours that the original does not show near them.
    pub(super) stray_pixels: u64,
    pub(super) ssim: Distribution,
    pub(super) flip: Distribution,
    /// Of each view the share of missed pixels.
    pub(super) missed: Distribution,
    /// Of each view the mean FLIP error.
    pub(super) flip_of_views: Distribution,
    /// The worst views, the worst first.
    pub(super) worst: Vec<ViewFigures>,
    /// The first gaps found.
    pub(super) gaps: Vec<Place>,
    /// The first phantoms found.
    pub(super) phantoms: Vec<Place>,
    /// The first pixels found that show backs.
    pub(super) backs: Vec<Place>,
    /// The first pixels found that show from behind what others in the cell see the front of.
    pub(super) from_behind: Vec<Place>,
    /// The first pixels found amidst stray colours.
    pub(super) strays: Vec<Place>,
    /// The first points found that are displaced by more than is promised.
    pub(super) displaced: Vec<Place>,
    /// The first views, for the plot: the sequence of viewpoints is even from the start.
    pub(super) dots: Vec<Dot>,
}

/// A pixel of a view.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Place {
    /// Number of the view.
    pub view: u64,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

/// What the plot shows of a view.
pub(super) struct Dot {
    pub(super) view: u64,
    pub(super) eye: DVec3,
    pub(super) parallax: f64,
    pub(super) flip: f64,
}

/// How many views the report shows pictures of.
const WORST: usize = 4;
const MOST_PLACES: usize = 1000;
const MOST_DOTS: usize = 2000;

impl Totals {
    pub(super) fn add(&mut self, view: ViewFigures) {
        let geometry = &view.geometry;
        self.views += 1;
        self.gap_pixels += geometry.gaps.len() as u64;
        self.phantom_pixels += geometry.phantoms.len() as u64;
        self.back_pixels += geometry.backs.len() as u64;
        self.behind_pixels += geometry.from_behind.len() as u64;
        self.displaced_pixels += geometry.parallax.above.len() as u64;
        self.unmet_pixels += geometry.parallax.unmet.len() as u64;
        self.coverage.covered += view.coverage.covered;
        self.coverage.missed += view.coverage.missed;
        self.covered_by_impostor += view.covered_by_impostor;
        self.parallax.merge(&geometry.parallax.errors);
        self.silhouette.merge(&view.silhouette);
        self.color.merge(&view.color);
        self.surface.merge(&view.surface);
        self.interior_pixels += view.stray.interior;
        self.stray_pixels += view.stray.stray.len() as u64;
        self.ssim.merge(&view.ssim);
        self.flip.merge(&view.flip);
        self.missed.record(view.coverage.error());
        self.flip_of_views.record(view.flip.mean());
        note(&mut self.gaps, view.view, &geometry.gaps);
        note(&mut self.phantoms, view.view, &geometry.phantoms);
        note(&mut self.backs, view.view, &geometry.backs);
        note(&mut self.from_behind, view.view, &geometry.from_behind);
        note(&mut self.strays, view.view, &view.stray.stray);
        note(&mut self.displaced, view.view, &geometry.parallax.above);
        if self.dots.len() < MOST_DOTS {
            self.dots.push(Dot {
                view: view.view,
                eye: view.camera.pose.eye,
                parallax: geometry.parallax.errors.max(),
                flip: view.flip.mean(),
            });
        }
        let at = self
            .worst
            .partition_point(|worse| !view.is_worse_than(worse));
        self.worst.insert(at, view);
        self.worst.truncate(WORST);
    }
}

fn note(places: &mut Vec<Place>, view: u64, pixels: &[[u32; 2]]) {
    let room = MOST_PLACES - places.len();
    let new = pixels.iter().take(room);
    places.extend(new.map(|&[x, y]| Place { view, x, y }));
}
