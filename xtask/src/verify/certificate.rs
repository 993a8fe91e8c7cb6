//! The certificate of a bundle that kept its promise.

use super::report::VerifyReport;
use farfield_bundle::{
    CERTIFICATE_FORMAT, CERTIFICATE_VERSION, Certificate, Manifest, WorstFigures,
};

/// What is signed off when a bundle kept its promise.
///
/// * `sampled` - what was only measured, a sentence each
pub(super) fn certificate(
    manifest: &Manifest,
    report: &VerifyReport,
    sampled: &[&str],
) -> Certificate {
    let options = &manifest.options;
    Certificate {
        format: CERTIFICATE_FORMAT.into(),
        version: CERTIFICATE_VERSION,
        generator: crate::generator(),
        bundle_sha256: manifest.sha256.clone(),
        scene: manifest.scene.clone(),
        view_space: options.view_space.clone(),
        resolution: options.resolution,
        fov_degrees: options.fov_degrees,
        viewpoints: report.views,
        seed: report.seed,
        worst: WorstFigures {
            gap_pixels: report.gap_pixels,
            phantom_pixels: report.phantom_pixels,
            parallax_px: report.parallax_px,
            silhouette_px: report.spread.silhouette_px.max,
            coverage_error: report.spread.coverage_error.max,
            colour_bias: report.colour_bias.abs(),
            stray_colours: report.stray_colours,
            missed_pixels: (report.bitfields.as_ref()).map(|found| found.missed_pixels_worst),
            flip: report.flip_worst_view_mean,
            worst_view: report.worst_view,
        },
        proved: report.proved.clone(),
        sampled: sampled.iter().copied().map(Into::into).collect(),
        beyond: report.beyond,
        sha256: String::new(),
    }
}

/// What is measured of impostors.
pub(super) const OF_IMPOSTORS: [&str; 5] = [
    "Gap pixels, phantom pixels and coverage, at every pixel of every viewpoint.",
    "Parallax: where the impostor's geometry shows each visible surface point of the original.",
    "Colours: FLIP, structural similarity, signal-to-noise ratio, bias and strays.",
    "Silhouettes: the distance between the outlines of original and impostor.",
    "The reach beyond the view cell, from corners, edge and face centres of larger and nearer cells.",
];
