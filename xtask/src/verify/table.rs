//! What verify says on the terminal.

use super::html::PromisedRow;
use super::promise::is_judged;
use super::report::VerifyReport;
use super::totals::Totals;
use crate::console::Console;
use farfield_bundle::Promise;

/// Figures beside what is promised of them.
pub(super) fn promised_rows(report: &VerifyReport, promise: &Promise) -> Vec<PromisedRow> {
    let most = |most: Option<f64>, found: f64, words: fn(f64) -> String| {
        let promised = most.map_or(String::new(), |most| format!("at most {}", words(most)));
        (promised, most.is_none_or(|most| found <= most))
    };
    let row = |name, found: f64, limit: Option<f64>, words: fn(f64) -> String| {
        let (promised, kept) = most(limit, found.abs(), words);
        PromisedRow {
            name,
            measured: words(found),
            promised,
            kept,
        }
    };
    let count = |n: f64| format!("{n:.0}");
    let pixels = |n: f64| match n.fract() == 0.0 {
        true => format!("{n:.0}"),
        false => format!("{n:.3}"),
    };
    let percent = |n: f64| format!("{:.4} %", n * 100.0);
    let levels = |n: f64| format!("{:.2}/255", n * 255.0);
    let plain = |n: f64| format!("{n:.4}");
    let whole = |n: Option<u64>| n.map(|n| n as f64);
    let colour_bias = promise.colour_bias.filter(|_| is_judged(report));
    let mut rows = vec![
        row(
            "gap pixels",
            report.gap_pixels as f64,
            whole(promise.gap_pixels),
            count,
        ),
        row(
            "parallax, pixels",
            report.parallax_px,
            promise.parallax_px,
            pixels,
        ),
        row(
            "phantom pixels",
            report.phantom_pixels as f64,
            whole(promise.phantom_pixels),
            count,
        ),
        row(
            "pixels that show backs",
            report.back_pixels as f64,
            whole(promise.back_pixels),
            count,
        ),
        row("colour bias", report.colour_bias, colour_bias, levels),
        row(
            "coverage error",
            report.coverage_error,
            promise.coverage_error,
            percent,
        ),
        row(
            "coverage change",
            report.coverage_change,
            promise.coverage_change,
            percent,
        ),
        row(
            "silhouettes, pixels",
            report.spread.silhouette_px.max,
            None,
            pixels,
        ),
        row("mean SSIM", report.ssim_mean, None, plain),
    ];
    rows.extend(
        report
            .flip_mean
            .map(|flip| row("mean FLIP", flip, None, plain)),
    );
    rows.extend(
        report
            .psnr_db
            .map(|psnr| row("PSNR, dB", psnr, None, |n| format!("{n:.2}"))),
    );
    rows
}

/// The table, the worst view, and the verdict.
pub(super) fn print(
    report: &VerifyReport,
    rows: &[PromisedRow],
    totals: &Totals,
    console: &Console,
) {
    console.say(format_args!("\n  {:<28}{:>14}   promised", "", "measured"));
    for row in rows {
        let broken = if row.kept { "" } else { "   BROKEN" };
        console.say(format_args!(
            "  {:<28}{:>14}   {}{broken}",
            row.name, row.measured, row.promised
        ));
    }
    console.say(format_args!("  {:<28}{:>14}", "viewpoints", report.views));
    if let Some(worst) = totals.worst.first() {
        let [x, y, z] = worst.camera.pose.eye.to_array();
        console.say(format_args!(
            "\n  worst: view {} from ({x:.4}, {y:.4}, {z:.4}): {} gap pixels, {} phantom pixels, \
             {} of {} pixels missed",
            worst.view,
            worst.geometry.gaps.len(),
            worst.geometry.phantoms.len(),
            worst.coverage.missed,
            worst.coverage.covered
        ));
    }
    if let Some(beyond) = &report.beyond {
        console.say(format_args!(
            "  beyond the cell: holds in {:.2} times the cell, and down to {:.4} m before what is \
             represented",
            beyond.cell_scale, beyond.switch_distance_m
        ));
    }
    let verdict = match report.holds {
        true => "the promise holds",
        false => "the promise is BROKEN:",
    };
    console.say(format_args!("\n  {verdict}"));
    for line in &report.broken {
        console.say(format_args!("  - {line}"));
    }
}
