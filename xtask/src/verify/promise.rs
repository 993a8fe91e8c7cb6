//! What is promised, beside what was measured.

use super::report::VerifyReport;
use super::totals::Place;
use farfield_bundle::Promise;

/// What of a promise is broken and where, a sentence each.
pub(super) fn broken(report: &VerifyReport, promise: &Promise) -> Vec<String> {
    let more = |found: f64, most: Option<f64>| most.filter(|most| found > *most);
    let count = |found: u64, most: Option<u64>| most.filter(|most| found > *most);
    let mut broken = Vec::new();
    if let Some(most) = count(report.gap_pixels, promise.gap_pixels) {
        broken.push(format!(
            "{} gap pixels, promised at most {most}: {}",
            report.gap_pixels,
            places(&report.gaps)
        ));
    }
    if let Some(most) = promise.parallax_px.filter(|_| report.displaced_pixels > 0) {
        let missing = match report.unmet_pixels {
            0 => String::new(),
            unmet => format!(" ({unmet} of them are nowhere at all)"),
        };
        broken.push(format!(
            "a parallax of {:.3} pixels, promised at most {most}: {} points are displaced by \
             more{missing}, {}",
            report.parallax_px,
            report.displaced_pixels,
            places(&report.displaced)
        ));
    }
    if report.covered_pixels == 0 {
        broken.push("no viewpoint sees anything of the original: nothing was compared".into());
    }
    if let Some(most) = count(report.phantom_pixels, promise.phantom_pixels) {
        broken.push(format!(
            "{} phantom pixels, promised at most {most}: {}",
            report.phantom_pixels,
            places(&report.phantoms)
        ));
    }
    if let Some(most) = count(report.back_pixels, promise.back_pixels) {
        broken.push(format!(
            "{} pixels show backs of surfaces that are to be seen from their fronts, promised at \
             most {most}: {}",
            report.back_pixels,
            places(&report.backs)
        ));
    }
    let colour_bias = promise.colour_bias.filter(|_| is_judged(report));
    if let Some(most) = more(report.colour_bias.abs(), colour_bias) {
        let [r, g, b] = report.colour_bias_rgb.map(|bias| bias * 255.0);
        broken.push(format!(
            "colours are off by ({r:+.2}, {g:+.2}, {b:+.2}) of 255 on average, promised at most \
             {:.2}",
            most * 255.0
        ));
    }
    if let Some(most) = more(report.coverage_error, promise.coverage_error) {
        broken.push(format!(
            "{:.4} % of the original's pixels are missed, promised at most {:.4} %",
            report.coverage_error * 100.0,
            most * 100.0
        ));
    }
    if let Some(most) = more(report.coverage_change.abs(), promise.coverage_change) {
        broken.push(format!(
            "the impostor covers {:+.2} % more pixels than the original, promised at most {:.2} %",
            report.coverage_change * 100.0,
            most * 100.0
        ));
    }
    broken
}

/// In what a manifest promises less than what its technique keeps to, a sentence each: nobody
/// loosens a promise by editing it.
pub(super) fn loosened(promise: &Promise, least: &Promise) -> Vec<String> {
    let count = |n: Option<u64>| n.map(|n| n as f64);
    let figures = |promise: &Promise| {
        [
            ("gap_pixels", count(promise.gap_pixels)),
            ("phantom_pixels", count(promise.phantom_pixels)),
            ("back_pixels", count(promise.back_pixels)),
            ("parallax_px", promise.parallax_px),
            ("colour_bias", promise.colour_bias),
            ("coverage_error", promise.coverage_error),
            ("coverage_change", promise.coverage_change),
        ]
    };
    let untold = least
        .notes
        .iter()
        .filter(|note| !promise.notes.contains(note));
    let untold = untold.map(|note| format!("the manifest's promise does not tell: {note}"));
    let both = figures(promise).into_iter().zip(figures(least));
    both.filter_map(|((name, stated), (_, least))| {
        let least = least?;
        let stated = match stated {
            Some(stated) if stated <= least => return None,
            Some(stated) => stated.to_string(),
            None => "nothing".into(),
        };
        Some(format!(
            "the manifest promises {stated} for {name}, where the technique keeps to {least}"
        ))
    })
    .chain(untold)
    .collect()
}

/// Whether enough pixels were compared to judge their mean: single pixels differ by some 30/255,
/// in groups of about ten, so that of fewer the mean is not even known to 1/255.
pub(super) fn is_judged(report: &VerifyReport) -> bool {
    report.compared_pixels >= 10_000
}

/// Where something was found, the first few.
fn places(places: &[Place]) -> String {
    let mut text = Vec::new();
    for of_view in places.chunk_by(|a, b| a.view == b.view).take(3) {
        let pixels = of_view
            .iter()
            .take(4)
            .map(|at| format!("({}, {})", at.x, at.y));
        let more = if of_view.len() > 4 { ", ..." } else { "" };
        let pixels: Vec<_> = pixels.collect();
        text.push(format!(
            "view {} at {}{more}",
            of_view[0].view,
            pixels.join(", ")
        ));
    }
    text.join("; ")
}
