//! What is shown and what it costs, in words.

use crate::flight::Flight;
use crate::keys;
use crate::pictures::{Look, Pictures, Side};
use crate::space;
use eframe::egui;
use farfield_bundle::ViewSpace;
use glam::DVec3;
use xtask::{Shown, ViewMode};

/// What the panel says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Words {
    pub(crate) title: String,
    /// What, of the original, of the impostor.
    pub(crate) rows: Vec<[String; 3]>,
    pub(crate) lines: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

/// The words for what is shown.
pub(crate) fn words(shown: &Shown, pictures: &Pictures, flight: &Flight, look: &Look) -> Words {
    let options = &shown.manifest.options;
    let [width, height] = pictures.size();
    let gpu = pictures.gpu();
    let lines = vec![
        match look.mode {
            ViewMode::Difference => format!("difference, {} times as strong", look.gain),
            ViewMode::Flicker => match look.flickers {
                Side::Original => "flicker: original".into(),
                Side::Impostor => "flicker: impostor".into(),
            },
            mode => mode.name().into(),
        },
        match flight.at {
            Some(sight) => format!("viewpoint {}{}", sight.view, rank(shown, sight.view)),
            None => place(flight.eye),
        },
        format!(
            "{width} × {height} pixels, {}°; promised for {} × {}",
            options.fov_degrees, options.resolution, options.resolution
        ),
        match gpu.is_software() {
            true => format!("{}, without a GPU", gpu.name()),
            false => gpu.name().into(),
        },
    ];
    Words {
        title: format!("{}, {}", shown.name, shown.manifest.technique.name()),
        rows: rows(shown, pictures),
        lines,
        warnings: warnings(shown, flight),
    }
}

fn rows(shown: &Shown, pictures: &Pictures) -> Vec<[String; 3]> {
    let sides = [shown.cost.original, Some(shown.cost.impostor)];
    let row = |what: &str, of: &dyn Fn(&farfield_bundle::Cost) -> String| {
        let [original, impostor] = sides.map(|cost| cost.map_or("–".into(), |cost| of(&cost)));
        [what.into(), original, impostor]
    };
    let known = |what: &str, of: &dyn Fn(Side) -> Option<String>| {
        let [original, impostor] = Side::ALL.map(|side| of(side).unwrap_or("–".into()));
        [what.into(), original, impostor]
    };
    vec![
        row("triangles", &|cost| count(cost.triangles)),
        row("draw calls", &|cost| count(cost.draw_calls)),
        known("in this view", &|side| {
            let drawn = pictures.drawn(side)?;
            let calls = count(drawn.calls as u64);
            Some(format!("{} / {calls}", count(drawn.triangles)))
        }),
        row("textures", &|cost| megabytes(cost.texture_bytes)),
        row("geometry", &|cost| megabytes(cost.geometry_bytes)),
        known("GPU ms", &|side| {
            Some(format!("{:.2}", pictures.milliseconds(side)?))
        }),
    ]
}

/// What should be known of where the viewer is.
fn warnings(shown: &Shown, flight: &Flight) -> Vec<String> {
    let space = &shown.manifest.options.view_space;
    let is_amid = matches!(space, ViewSpace::Amid { .. });
    let all = [
        (
            !space::contains(space, flight.eye),
            "outside of the view cell: gaps open here",
        ),
        (
            !shown.aims_anywhere && flight.target.is_none(),
            "the promise is for a camera that looks at the centre",
        ),
        (
            is_amid,
            "what is near the view cell stays geometry and is not shown",
        ),
        (
            shown.original.is_none(),
            "the original is not there: only the impostor is shown",
        ),
    ];
    let said = all.into_iter().filter(|(applies, _)| *applies);
    said.map(|(_, words)| words.to_owned()).collect()
}

/// A number with commas between thousands.
fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut written = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            written.push(',');
        }
        written.push(digit);
    }
    written
}

fn megabytes(bytes: u64) -> String {
    format!("{:.2} MB", bytes as f64 / 1e6)
}

fn place(eye: DVec3) -> String {
    format!("at {:.3}, {:.3}, {:.3}", eye.x, eye.y, eye.z)
}

fn rank(shown: &Shown, view: u64) -> String {
    let rank = shown.worst.iter().position(|worst| *worst == view);
    rank.map_or(String::new(), |rank| {
        format!(", number {} of the worst", rank + 1)
    })
}

/// Brighter than egui's own.
const TEXT: egui::Color32 = egui::Color32::from_gray(215);

const WARNING: egui::Color32 = egui::Color32::from_rgb(255, 176, 64);

/// Shows the words in the upper left corner of the window.
pub(crate) fn show(ui: &egui::Ui, words: &Words) {
    let corner = ui.max_rect().left_top() + egui::vec2(10.0, 10.0);
    in_frame(
        ui,
        egui::Area::new(egui::Id::unique("panel")).fixed_pos(corner),
        |ui| {
            ui.strong(&words.title);
            egui::Grid::new("figures").num_columns(3).show(ui, |ui| {
                for name in ["", "original", "impostor"] {
                    ui.label(name);
                }
                ui.end_row();
                for [what, original, impostor] in &words.rows {
                    ui.label(what);
                    ui.monospace(original);
                    ui.monospace(impostor);
                    ui.end_row();
                }
            });
            words.lines.iter().for_each(|line| drop(ui.label(line)));
            let warnings = words.warnings.iter();
            warnings.for_each(|line| drop(ui.colored_label(WARNING, line)));
            ui.label("H: help");
        },
    );
}

/// Shows what keys do, in the middle of the window.
pub(crate) fn show_help(ui: &egui::Ui) {
    let area =
        egui::Area::new(egui::Id::unique("help")).anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]);
    in_frame(ui, area, |ui| {
        ui.strong("Keys");
        egui::Grid::new("keys").num_columns(2).show(ui, |ui| {
            let flying = keys::FLYING.into_iter();
            let bindings = keys::BINDINGS.iter().map(|one| (one.name, one.say));
            for (name, say) in flying.chain(bindings) {
                ui.monospace(name);
                ui.label(say);
                ui.end_row();
            }
        });
    });
}

/// Says something at the foot of the window.
pub(crate) fn show_message(ui: &egui::Ui, message: &str) {
    let area = egui::Area::new(egui::Id::unique("message"))
        .anchor(egui::Align2::CENTER_BOTTOM, [0.0, -10.0]);
    in_frame(ui, area, |ui| drop(ui.label(message)));
}

fn in_frame(ui: &egui::Ui, area: egui::Area, add: impl FnOnce(&mut egui::Ui)) {
    area.interactable(false).show(ui.ctx(), |ui| {
        // Lines are as long as they are.
        ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
        ui.visuals_mut().override_text_color = Some(TEXT);
        egui::Frame::popup(ui.style()).show(ui, add);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_commas() {
        let written = [0, 999, 1_000, 499_080, 12_345_678].map(count);
        assert_eq!(written, ["0", "999", "1,000", "499,080", "12,345,678"]);
    }
}
