//! What verify says, for programs.

use super::seams::Seams;
use super::surface::SurfaceBias;
use super::totals::{Place, Totals};
use crate::viewpoints::SEED;
use farfield_bundle::{Beyond, Channels, Cost, ProvedBound};
use farfield_metrics::Distribution;
use serde::Serialize;

/// What was measured; field names are a published contract.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Number of viewpoints.
    pub views: u64,
    /// Pixels at which one looks through the impostor, in all views together.
    pub gap_pixels: u64,
    /// Pixels that only the impostor covers, far from the original, in all views together.
    pub phantom_pixels: u64,
    /// Pixels that the impostor covers where of the original there are only the backs of single-sided
    /// surfaces whose fronts nobody in the view space sees, in all views together.
    pub back_pixels: u64,
    /// Pixels that the impostor covers where of the original there are only the backs of single-sided
    /// surfaces whose fronts are seen from elsewhere in the view space, in all views together.
    pub behind_pixels: u64,
    /// Share of the original's pixels that the impostor misses, over all views.
    pub coverage_error: f64,
    /// The farthest that a point appears from where it is, in pixels.
    pub parallax_px: f64,
    /// Mean FLIP error, over all pixels that either covers and their neighbours; null where FLIP
    /// is not built in.
    pub flip_mean: Option<f64>,
    /// 95 % of these pixels have no greater FLIP error.
    pub flip_p95: Option<f64>,
    /// Mean FLIP error of the view where it is greatest.
    pub flip_worst_view_mean: Option<f64>,
    /// Peak signal-to-noise ratio over the same pixels, in decibels; null where pictures are
    /// equal.
    pub psnr_db: Option<f64>,
    /// Mean signed difference of the channel where it is greatest, as a share of full intensity:
    /// positive where the impostor is brighter. Of pixels that both cover, less the quarter that
    /// differs most to either side: there silhouettes are a texel apart. For the same reason only where
    /// both show the same layer.
    pub colour_bias: f64,
    /// Mean signed difference of normals, roughness or metallic, of that where it is greatest, as a share
    /// of their whole range, where both show the same layer; null where the bundle is not to be lit.
    pub surface_bias: Option<f64>,
    /// Pixels in the midst of colours that the original does not show anywhere near, as a share of
    /// those inside of what both cover.
    pub stray_colours: f64,
    /// The number of the worst viewpoint: most gaps, phantoms and displaced pixels, then the
    /// greatest mean colour difference.
    pub worst_view: u64,
    /// The numbers of the worst viewpoints, of which there are pictures, the worst first.
    pub worst_views: Vec<u64>,
    /// Whether the bundle keeps its promise, as far as that was judged.
    pub holds: bool,

    /// What is broken and where, a sentence each; empty where the promise holds.
    pub broken: Vec<String>,
    /// What of the promise was not judged, a sentence each: a single view decides nothing of what is
    /// promised of a share of all views.
    pub undecided: Vec<String>,
    /// Pixels that the original covers, in all views together.
    pub covered_pixels: u64,
    /// Pixels whose colours were compared, in all views together.
    pub compared_pixels: u64,
    /// Those of them where both show the same layer.
    pub alike_pixels: u64,
    /// Pixels inside of what both cover, in all views together.
    pub interior_pixels: u64,
    /// Those of them in the midst of stray colours.
    pub stray_pixels: u64,
    /// Number that distinguishes these viewpoints from others.
    pub seed: u64,
    /// The bias of red, green and blue.
    pub colour_bias_rgb: [f64; 3],
    /// The bias of all that light meets.
    pub surface_bias_by: Option<SurfaceBias>,
    /// Mean structural similarity, 1 where pictures are equal.
    pub ssim_mean: f64,
    /// By what share the impostor covers more pixels than the original, over all views.
    pub coverage_change: f64,
    /// The same at lower resolutions, from the reference viewpoint and the view cell's corners,
    /// edges and faces.
    pub coverage_at: Vec<CoverageAt>,
    /// Surface points displaced by more than is promised or nowhere at all, in all views together.
    pub displaced_pixels: u64,
    /// Surface points of the original where the impostor has no quad at all.
    pub unmet_pixels: u64,
    /// Means hide cracks: greatest values and 99.9th percentiles.
    pub spread: Spread,
    /// What holds for every viewpoint of the cell, by construction.
    pub proved: Vec<ProvedBound>,
    /// What is seen where impostors amid a scene meet; null where there is one, or each is seen alone.
    pub seams: Option<Seams>,
    /// How far the promise holds outside of the view cell.
    pub beyond: Option<Beyond>,
    /// What ID-bitfields miss and cull; null where there are none.
    pub bitfields: Option<BitfieldsFigures>,
    /// What drawing costs, before and after; after it, of ID-bitfields, that of a face on average.
    pub cost: CostOfBoth,
    /// The first thousand gaps.
    pub gaps: Vec<Place>,
    /// The first thousand phantoms.
    pub phantoms: Vec<Place>,
    /// The first thousand pixels that show backs of what is seen from nowhere.
    pub backs: Vec<Place>,
    /// The first thousand pixels that show from behind what is seen from elsewhere.
    pub from_behind: Vec<Place>,
    /// The first thousand pixels in the midst of stray colours.
    pub strays: Vec<Place>,
    /// The first thousand points displaced by more than is promised.
    pub displaced: Vec<Place>,
}

/// What was measured of ID-bitfields.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BitfieldsFigures {
    /// Pixels that show a triangle which is not drawn, in all views together.
    pub missed_pixels: u64,
    /// Those of the view where they are most.
    pub missed_pixels_worst: u64,
    /// 95 % of the views miss no more.
    pub missed_pixels_p95: u64,
    /// Views that miss any.
    pub missing_views: u64,
    /// Views that miss more pixels than is promised.
    pub missing_more_than_promised: u64,
    /// So many may, as it is promised of a share of all views: of independent ones more would do so with a
    /// probability below 5 %. Null where a single view was looked at, which decides nothing of a share.
    pub may_miss_more_than_promised: Option<u64>,
    /// Pixels of another colour than the original's, in all views together.
    pub wrong_pixels: u64,
    /// Share of the triangles that is not drawn, mean over all views.
    pub culled: f64,
    /// The same of the view where it is least.
    pub culled_least: f64,
    /// What plain samples would do, without patches and without more where something is missed; empty
    /// where single views were looked at.
    pub over_samples: Vec<OverSamples>,
    /// The first thousand missed pixels.
    pub missed: Vec<Place>,
}

/// What so many samples, spread evenly, cull and miss.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OverSamples {
    /// How many.
    pub samples: u32,
    /// Mean share of the triangles that faces do not draw which unite the samples at their corners.
    pub culled_by_three: f64,
    /// The same of faces that unite the six samples around.
    pub culled_by_six: f64,
    /// 95 % of the views miss no more pixels with the former.
    pub missed_by_three: u64,
    /// The same with the latter.
    pub missed_by_six: u64,
}

/// Covered pixels at one resolution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CoverageAt {
    /// Pixels along each side.
    pub resolution: u32,
    /// By what share the impostor covers more pixels than the original.
    pub change: f64,
}

/// How figures are spread.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Distances between where points are and where they appear, in pixels.
    pub parallax_px: Summary,
    /// Distances between silhouettes, in pixels.
    pub silhouette_px: Summary,
    /// Absolute differences a channel, as a share of full intensity.
    pub colour_difference: Summary,
    /// FLIP errors; null where FLIP is not built in.
    pub flip: Option<Summary>,
    /// One less structural similarity.
    pub ssim_error: Summary,
    /// Of each view the share of the original's pixels that the impostor misses.
    pub coverage_error: Summary,
}

/// Many values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The mean.
    pub mean: f64,
    /// 99.9 % of the values are no greater.
    pub p999: f64,
    /// The greatest.
    pub max: f64,
}

impl Summary {
    fn of(values: &Distribution) -> Self {
        Self {
            mean: values.mean(),
            p999: values.percentile(0.999),
            max: values.max(),
        }
    }
}

/// What drawing costs, before and after.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct CostOfBoth {
    /// The original.
    pub original: Cost,
    /// The impostor.
    pub impostor: Cost,
}

/// Sums up what was measured; what is broken and how far the promise reaches is filled in later.
pub(super) fn summarise(
    totals: &Totals,
    coverage_at: Vec<CoverageAt>,
    channels: Channels,
    proved: Vec<ProvedBound>,
    cost: CostOfBoth,
) -> VerifyReport {
    let surface_bias = (channels == Channels::Pbr).then(|| totals.surface.bias());
    let built_in = cfg!(feature = "flip");
    let color = &totals.color;
    let bias = color.typical_bias();
    let covered = totals.coverage.covered.max(1) as f64;
    VerifyReport {
        views: totals.views,
        gap_pixels: totals.gap_pixels,
        phantom_pixels: totals.phantom_pixels,
        back_pixels: totals.back_pixels,
        behind_pixels: totals.behind_pixels,
        coverage_error: totals.coverage.error(),
        parallax_px: totals.parallax.max(),
        flip_mean: built_in.then(|| totals.flip.mean()),
        flip_p95: built_in.then(|| totals.flip.percentile(0.95)),
        flip_worst_view_mean: built_in.then(|| totals.flip_of_views.max()),
        psnr_db: color.psnr(),
        colour_bias: bias
            .into_iter()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or(0.0),
        surface_bias: surface_bias.map(|bias| bias.worst()),
        stray_colours: totals.stray_pixels as f64 / totals.interior_pixels.max(1) as f64,
        worst_view: totals.worst.first().map_or(0, |view| view.view),
        worst_views: totals.worst.iter().map(|view| view.view).collect(),
        holds: false,
        broken: Vec::new(),
        undecided: Vec::new(),
        covered_pixels: totals.coverage.covered,
        interior_pixels: totals.interior_pixels,
        stray_pixels: totals.stray_pixels,
        seed: SEED,
        compared_pixels: color.pixels,
        alike_pixels: color.pixels_in_both(),
        colour_bias_rgb: bias,
        surface_bias_by: surface_bias,
        ssim_mean: 1.0 - totals.ssim.mean(),
        coverage_change: totals.covered_by_impostor as f64 / covered - 1.0,
        coverage_at,
        displaced_pixels: totals.displaced_pixels,
        unmet_pixels: totals.unmet_pixels,
        spread: Spread {
            parallax_px: Summary::of(&totals.parallax),
            silhouette_px: Summary::of(&totals.silhouette.distances),
            colour_difference: Summary::of(&color.differences),
            flip: built_in.then(|| Summary::of(&totals.flip)),
            ssim_error: Summary::of(&totals.ssim),
            coverage_error: Summary::of(&totals.missed),
        },
        proved,
        seams: None,
        beyond: None,
        bitfields: None,
        cost,
        gaps: totals.gaps.clone(),
        phantoms: totals.phantoms.clone(),
        backs: totals.backs.clone(),
        from_behind: totals.from_behind.clone(),
        strays: totals.strays.clone(),
        displaced: totals.displaced.clone(),
    }
}
