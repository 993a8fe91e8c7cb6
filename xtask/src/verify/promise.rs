//! What is promised, beside what was measured.

use super::report::VerifyReport;
use super::seams;
use super::totals::Place;
use farfield_bundle::Promise;

/// A figure beside what is promised of it.
pub(super) struct Judged {
    pub(super) name: &'static str,
    pub(super) measured: String,
    /// Empty where nothing is promised; says so where too little was seen to judge.
    pub(super) promised: String,
    /// Whether anything is promised, and enough was seen to judge it.
    pub(super) is_judged: bool,
    /// What is broken and where; nothing where the promise is kept.
    pub(super) broken: Option<String>,
}

/// What was measured of a figure, and what to say of it.
pub(super) struct Measured {
    pub(super) name: &'static str,
    pub(super) figure: f64,
    pub(super) words: fn(f64) -> String,
    /// Whether something is wrong that the figure does not show.
    pub(super) is_wrong: bool,
    /// Pixels that the figure is a mean of, where their number matters.
    pub(super) pixels: Option<u64>,
    /// The figure in a sentence.
    pub(super) what: String,
    /// Where it is; may be empty.
    pub(super) places: String,
}

/// All figures that can be promised, each compared with its limit: here and nowhere else.
pub(super) fn judged(report: &VerifyReport, promise: &Promise) -> Vec<Judged> {
    let whole = |n: Option<u64>| n.map(|n| n as f64);
    let limits = [
        whole(promise.gap_pixels),
        promise.parallax_px,
        whole(promise.phantom_pixels),
        whole(promise.back_pixels),
        promise.colour_bias,
        promise.stray_colours,
        promise.coverage_error,
        promise.coverage_change,
    ];
    let both = measured(report).into_iter().zip(limits);
    let judged = both.map(|(found, limit)| judge(found, limit));
    let lit = measured_surface(report, promise.surface_bias);
    let lit = lit.map(|found| judge(found, promise.surface_bias));
    let seams = seams::measured(report);
    let seams = seams.map(|found| judge(found, whole(promise.gap_pixels)));
    judged.chain(lit).chain(seams).collect()
}

fn judge(found: Measured, limit: Option<f64>) -> Judged {
    let Measured { figure, words, .. } = found;
    let is_enough = found.pixels.is_none_or(|pixels| pixels >= FEWEST_PIXELS);
    let promised = match limit {
        None => String::new(),
        Some(_) if !is_enough => format!("not judged: fewer than {FEWEST_PIXELS} pixels"),
        Some(most) => format!("at most {}", words(most)),
    };
    // What is no number keeps no promise.
    let keeps = |most: f64| figure.abs() <= most && !found.is_wrong;
    let limit = limit.filter(|_| is_enough);
    let is_kept = limit.is_none_or(keeps);
    let places = match found.places.as_str() {
        "" => String::new(),
        places => format!(": {places}"),
    };
    Judged {
        name: found.name,
        measured: words(figure),
        is_judged: limit.is_some(),
        broken: (!is_kept).then(|| format!("{}, promised {promised}{places}", found.what)),
        promised,
    }
}

/// The figures in the order in which they are told.
fn measured(report: &VerifyReport) -> [Measured; 8] {
    let count = |n: f64| format!("{n:.0}");
    let percent = |n: f64| format!("{:.4} %", n * 100.0);
    let found = |name, figure, words, what, places| Measured {
        name,
        figure,
        words,
        is_wrong: false,
        pixels: None,
        what,
        places,
    };
    let unmet = match report.unmet_pixels {
        0 => String::new(),
        unmet => format!(" ({unmet} of them are nowhere at all)"),
    };
    let [r, g, b] = report.colour_bias_rgb.map(|bias| bias * 255.0);
    [
        found(
            "gap pixels",
            report.gap_pixels as f64,
            count,
            format!("{} gap pixels", report.gap_pixels),
            places(&report.gaps),
        ),
        Measured {
            name: "parallax, pixels",
            figure: report.parallax_px,
            words: pixels,
            is_wrong: report.displaced_pixels > 0,
            pixels: None,
            what: format!("a parallax of {:.3} pixels", report.parallax_px),
            places: format!(
                "{} points are displaced by more{unmet}, {}",
                report.displaced_pixels,
                places(&report.displaced)
            ),
        },
        found(
            "phantom pixels",
            report.phantom_pixels as f64,
            count,
            format!("{} phantom pixels", report.phantom_pixels),
            places(&report.phantoms),
        ),
        found(
            "pixels that show backs",
            report.back_pixels as f64,
            count,
            format!(
                "{} pixels show backs of surfaces whose fronts nobody in the view cell sees",
                report.back_pixels
            ),
            places(&report.backs),
        ),
        Measured {
            pixels: Some(report.alike_pixels),
            ..found(
                "colour bias",
                report.colour_bias,
                levels,
                format!("colours are off by ({r:+.2}, {g:+.2}, {b:+.2}) of 255 on average"),
                String::new(),
            )
        },
        Measured {
            pixels: Some(report.interior_pixels),
            ..found(
                "stray colours",
                report.stray_colours,
                percent,
                format!(
                    "{:.4} % of the pixels inside of what is shown lie amidst stray colours, which \
                     the original does not show near them",
                    report.stray_colours * 100.0
                ),
                places(&report.strays),
            )
        },
        found(
            "coverage error",
            report.coverage_error,
            percent,
            format!(
                "{:.4} % of the original's pixels are missed",
                report.coverage_error * 100.0
            ),
            String::new(),
        ),
        found(
            "coverage change",
            report.coverage_change,
            percent,
            format!(
                "the impostor covers {:+.2} % more pixels than the original",
                report.coverage_change * 100.0
            ),
            String::new(),
        ),
    ]
}

/// The figure of what light meets; nothing where that was not measured, and nothing is promised of it.
fn measured_surface(report: &VerifyReport, limit: Option<f64>) -> Option<Measured> {
    let what = report.surface_bias_by.map(|bias| {
        let [x, y, z] = bias.normal.map(|bias| bias * 255.0);
        let [roughness, metallic] = [bias.roughness, bias.metallic].map(|bias| bias * 255.0);
        format!(
            "what light meets is off by so much of 255 on average: normals ({x:+.2}, {y:+.2}, \
             {z:+.2}), roughness {roughness:+.2}, metallic {metallic:+.2}"
        )
    });
    let unmeasured = || "there is nothing that light meets".to_owned();
    (report.surface_bias.is_some() || limit.is_some()).then(|| Measured {
        name: "bias of what light meets",
        figure: report.surface_bias.unwrap_or(f64::NAN),
        words: levels,
        is_wrong: false,
        pixels: Some(report.alike_pixels),
        what: what.unwrap_or_else(unmeasured),
        places: String::new(),
    })
}

/// A share of full intensity, in words.
fn levels(n: f64) -> String {
    format!("{:.2}/255", n * 255.0)
}

/// What of a promise is broken and where, a sentence each.
pub(super) fn broken(report: &VerifyReport, judged: &[Judged]) -> Vec<String> {
    let blind = (report.covered_pixels == 0)
        .then(|| "no viewpoint sees anything of the original: nothing was compared".into());
    let of_figures = judged.iter().filter_map(|figure| figure.broken.clone());
    of_figures.chain(blind).collect()
}

/// A length in pixels, in words.
pub(super) fn pixels(n: f64) -> String {
    match n.fract() == 0.0 {
        true => format!("{n:.0}"),
        false => format!("{n:.3}"),
    }
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
            ("surface_bias", promise.surface_bias),
            ("stray_colours", promise.stray_colours),
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

/// From how many pixels on colours are judged: single ones differ by some 30/255, in groups of
/// about ten, so that of fewer the mean is not even known to 1/255.
const FEWEST_PIXELS: u64 = 10_000;

/// Where something was found, the first few.
pub(super) fn places(places: &[Place]) -> String {
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
