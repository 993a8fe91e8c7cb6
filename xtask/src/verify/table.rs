//! What verify says on the terminal.

use super::html::PromisedRow;
use super::promise::{Judged, pixels};
use super::report::VerifyReport;
use super::totals::Totals;
use crate::console::Console;

/// Figures beside what is promised of them, and some that nothing is promised of.
pub(super) fn promised_rows(report: &VerifyReport, judged: &[Judged]) -> Vec<PromisedRow> {
    let promised = judged.iter().map(|figure| PromisedRow {
        name: figure.name,
        measured: figure.measured.clone(),
        promised: figure.promised.clone(),
        is_judged: figure.is_judged,
        kept: figure.broken.is_none(),
    });
    let plain = |n: f64| format!("{n:.4}");
    let others = [
        (
            "pixels seen from behind",
            Some(format!("{}", report.behind_pixels)),
        ),
        (
            "silhouettes, pixels",
            Some(pixels(report.spread.silhouette_px.max)),
        ),
        ("mean SSIM", Some(plain(report.ssim_mean))),
        ("mean FLIP", report.flip_mean.map(plain)),
        ("PSNR, dB", report.psnr_db.map(|psnr| format!("{psnr:.2}"))),
    ];
    let others = others.into_iter().filter_map(|(name, measured)| {
        Some(PromisedRow {
            name,
            measured: measured?,
            promised: String::new(),
            is_judged: false,
            kept: true,
        })
    });
    promised.chain(others).collect()
}

/// The table, the worst view, and the verdict.
pub(super) fn print(
    report: &VerifyReport,
    rows: &[PromisedRow],
    totals: &Totals,
    console: &Console,
) {
    print_rows(rows, report.views, console);
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
    print_verdict(report, console);
}

/// Figures beside what is promised of them.
pub(super) fn print_rows(rows: &[PromisedRow], views: u64, console: &Console) {
    console.say(format_args!("\n  {:<28}{:>14}   promised", "", "measured"));
    for row in rows {
        let broken = if row.kept { "" } else { "   BROKEN" };
        console.say(format_args!(
            "  {:<28}{:>14}   {}{broken}",
            row.name, row.measured, row.promised
        ));
    }
    console.say(format_args!("  {:<28}{:>14}", "viewpoints", views));
}

/// Whether the promise holds, what is broken, and what was not judged.
pub(super) fn print_verdict(report: &VerifyReport, console: &Console) {
    let verdict = match (report.holds, report.undecided.is_empty()) {
        (true, true) => "\n  the promise holds",
        (true, false) => "",
        (false, _) => "\n  the promise is BROKEN:",
    };
    console.say(verdict);
    for line in &report.broken {
        console.say(format_args!("  - {line}"));
    }
    for line in &report.undecided {
        console.say(format_args!("  not judged: {line}"));
    }
}
