//! The window.

use crate::flight::Flight;
use crate::keys::{self, Action};
use crate::outline::{self, Line};
use crate::pictures::{Look, Pictures, Side};
use crate::{panel, screenshot, space};
use anyhow::{Result, anyhow};
use eframe::egui::{self, Key, TextureId};
use eframe::{egui_wgpu, wgpu};
use glam::DVec3;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use xtask::{Shown, ViewMode};

/// Flickering shows each side for so long: slow enough for anybody's eyes.
const FLICKER: Duration = Duration::from_millis(500);

/// What is said is shown for so long.
const SAY: Duration = Duration::from_secs(5);

/// How often it is asked whether the GPU has told a time.
const ASK: Duration = Duration::from_millis(30);

/// The longest that a viewer flies between two pictures, in seconds.
const LONGEST: f64 = 0.1;

/// How much faster viewers fly with Shift.
const FASTER: f64 = 4.0;

/// Seconds of flight for a point that the wheel scrolls.
const WHEEL: f64 = 1.0 / 400.0;

/// The cell's colour.
const OUTLINE: egui::Color32 = egui::Color32::from_rgb(255, 208, 64);

/// All that the window shows and how.
struct App {
    shown: Shown,
    pictures: Pictures,
    flight: Flight,
    look: Look,
    lines: Vec<Line>,
    /// Whether the cell is drawn; `None`: when it was left.
    draws_cell: Option<bool>,
    /// The picture's size unless it is the window's own.
    promised: [u32; 2],
    is_native: bool,
    has_panel: bool,
    has_help: bool,
    /// What is said, and until when.
    message: Option<(String, Instant)>,
    /// Keys that move.
    held: BTreeSet<Key>,
    start: Instant,
    texture: TextureId,
    /// Why the window closes by itself.
    failure: Arc<Mutex<Option<anyhow::Error>>>,
}

/// Opens the window and stays until it is closed.
///
/// * `instance`, `adapter` - those of the pictures' GPU
///
/// # Errors
///
/// When there is no display, or the GPU fails.
pub(crate) fn run(
    shown: Shown,
    pictures: Pictures,
    (instance, adapter): (wgpu::Instance, wgpu::Adapter),
    flight: Flight,
    look: Look,
) -> Result<()> {
    let gpu = pictures.gpu();
    let setup = egui_wgpu::WgpuSetupExisting {
        instance,
        adapter,
        device: gpu.device().clone(),
        queue: gpu.queue().clone(),
    };
    let adapter_name = gpu.name().to_owned();
    let title = format!("{}: farfield", shown.name);
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_app_id("farfield")
            .with_inner_size([1280.0, 800.0]),
        renderer: eframe::Renderer::Wgpu,
        wgpu_options: egui_wgpu::WgpuConfiguration {
            wgpu_setup: setup.into(),
            ..Default::default()
        },
        ..Default::default()
    };
    let failure = Arc::new(Mutex::new(None));
    let of_app = Arc::clone(&failure);
    let create = move |context: &eframe::CreationContext<'_>| {
        let app = App::new(context, shown, pictures, flight, look, of_app);
        Ok(Box::new(app?) as Box<dyn eframe::App>)
    };
    eframe::run_native(&title, options, Box::new(create))
        .map_err(|error| no_window(error, &adapter_name))?;
    let failure = failure.lock().ok().and_then(|mut failure| failure.take());
    failure.map_or(Ok(()), Err)
}

/// Why there is no window. Where there is no display there is something else to do.
fn no_window(error: eframe::Error, adapter: &str) -> anyhow::Error {
    let words = error.to_string();
    let reason = without_place(&words).trim_end_matches('.');
    match error {
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => anyhow!(
            "there is no display for a window: {reason}; look at the bundle in a browser with --web, or \
             write a picture to a file with --screenshot FILE"
        ),
        _ => anyhow!("the window cannot be drawn with {adapter}: {reason}"),
    }
}

/// An error of the system without the line of source code that winit puts before it.
fn without_place(error: &str) -> &str {
    let after = error.rsplit_once(".rs:").map(|(_, after)| after);
    let reason = after.and_then(|after| after.split_once(": "));
    reason.map_or(error, |(_, reason)| reason)
}

impl App {
    fn new(
        context: &eframe::CreationContext<'_>,
        shown: Shown,
        pictures: Pictures,
        flight: Flight,
        look: Look,
        failure: Arc<Mutex<Option<anyhow::Error>>>,
    ) -> Result<Self> {
        let state = context.wgpu_render_state.as_ref();
        let state = state.ok_or_else(|| anyhow!("the window is not drawn with wgpu"))?;
        let view = pictures.target().create_view(&Default::default());
        let texture = (state.renderer.write()).register_native_texture(
            &state.device,
            &view,
            wgpu::FilterMode::Linear,
        );
        let space = &shown.manifest.options.view_space;
        Ok(Self {
            lines: outline::lines(space, &shown.cells),
            promised: pictures.size(),
            shown,
            pictures,
            flight,
            look,
            draws_cell: None,
            is_native: false,
            has_panel: true,
            has_help: false,
            message: None,
            held: BTreeSet::new(),
            start: Instant::now(),
            texture,
            failure,
        })
    }

    fn is_inside(&self) -> bool {
        space::contains(&self.shown.manifest.options.view_space, self.flight.eye)
    }

    fn draws_cell(&self) -> bool {
        self.draws_cell.unwrap_or(!self.is_inside())
    }

    fn frame(&mut self, ui: &egui::Ui, frame: &eframe::Frame) -> Result<()> {
        let window = ui.max_rect();
        let pixels = window.size() * ui.pixels_per_point();
        if self.is_native {
            self.resize(
                [pixels.x, pixels.y].map(|side| side.round().max(1.0) as u32),
                frame,
            )?;
        } else {
            self.resize(self.promised, frame)?;
        }
        let picture = fitted(window, self.pictures.size());
        self.take_keys(ui)?;
        self.move_viewer(ui, picture);
        if self.look.mode == ViewMode::Flicker {
            let elapsed = self.start.elapsed();
            let turns = elapsed.as_millis() / FLICKER.as_millis();
            self.look.flickers = Side::ALL[(turns % 2) as usize];
            let next = FLICKER * (turns + 1) as u32;
            ui.request_repaint_after(next.saturating_sub(elapsed));
        }
        self.draw(ui)?;
        self.paint(ui, picture);
        Ok(())
    }

    fn resize(&mut self, size: [u32; 2], frame: &eframe::Frame) -> Result<()> {
        if size == self.pictures.size() {
            return Ok(());
        }
        self.pictures.resize(size)?;
        if let Some(state) = frame.wgpu_render_state() {
            let view = self.pictures.target().create_view(&Default::default());
            state
                .renderer
                .write()
                .update_egui_texture_from_wgpu_texture(
                    &state.device,
                    &view,
                    wgpu::FilterMode::Linear,
                    self.texture,
                );
        }
        Ok(())
    }

    fn take_keys(&mut self, ui: &egui::Ui) -> Result<()> {
        let (events, is_focused) = ui.input(|input| (input.events.clone(), input.focused));
        if !is_focused {
            self.held.clear();
        }
        for event in events {
            let egui::Event::Key {
                key,
                physical_key,
                pressed,
                repeat,
                modifiers,
            } = event
            else {
                continue;
            };
            let place = physical_key.unwrap_or(key);
            if !pressed {
                self.held.remove(&place);
            } else if modifiers.command || modifiers.ctrl || modifiers.alt {
                continue;
            } else if keys::moves(place) {
                self.held.insert(place);
            } else if let Some((action, rank)) = keys::action_of(key)
                && (!repeat || keys::repeats(action))
            {
                self.message = None;
                self.act(action, rank)?;
            }
        }
        Ok(())
    }

    fn act(&mut self, action: Action, rank: usize) -> Result<()> {
        let space = &self.shown.manifest.options.view_space;
        match action {
            Action::Mode(mode) if mode != ViewMode::Impostor && self.shown.original.is_none() => {
                self.say("the original is not there: only the impostor is shown");
            }
            Action::Mode(mode) => self.look.mode = mode,
            Action::Split(by) => self.look.split = (self.look.split + by).clamp(0.0, 1.0),
            Action::Gain(by) => self.look.gain = (self.look.gain * by).clamp(1.0, 64.0),
            Action::Leave => {
                self.flight.leave(space, !self.flight.leaves);
                self.pictures.touch();
                self.say(match self.flight.leaves {
                    true => "the view cell can be left",
                    false => "the view cell is not left any more",
                });
            }
            Action::Target => {
                self.flight.look_at(self.shown.center());
                self.pictures.touch();
            }
            Action::Cell => self.draws_cell = Some(!self.draws_cell()),
            Action::Native => self.is_native = !self.is_native,
            Action::Reference => self.visit(0),
            Action::Worst => match (self.shown.worst.get(rank), self.shown.worst.len()) {
                (Some(view), _) => self.visit(*view),
                (None, 0) => {
                    self.say("the worst views are not known: cargo xtask verify finds them");
                }
                (None, count) => self.say(format!("verify kept the worst {count} views")),
            },
            Action::Step(by) => {
                let view = self.flight.at.map_or(0, |sight| sight.view);
                self.visit(view.saturating_add_signed(by));
            }
            Action::Save => self.save()?,
            Action::Panel => self.has_panel = !self.has_panel,
            Action::Help => self.has_help = !self.has_help,
        }
        Ok(())
    }

    fn say(&mut self, message: impl Into<String>) {
        self.message = Some((message.into(), Instant::now() + SAY));
    }

    /// Goes to a viewpoint; where there is none, that is said and the viewer stays.
    fn visit(&mut self, view: u64) {
        match self.shown.sight(view) {
            Ok(sight) => {
                self.flight.go_to(sight, self.shown.aims_anywhere);
                self.pictures.touch();
            }
            Err(error) => self.say(format!("viewpoint {view}: {error:#}")),
        }
    }

    /// Saves what is shown in the current folder, beside what was saved before.
    fn save(&mut self) -> Result<()> {
        self.pictures.draw(&self.shown, &self.flight, &self.look)?;
        let picture = self.pictures.read()?;
        let view = self.flight.at.map(|sight| format!("-view-{}", sight.view));
        let mode = self.look.mode.name();
        let name = format!("{}{}-{mode}", self.shown.name, view.unwrap_or_default());
        let name = std::path::absolute(&name).unwrap_or_else(|_| PathBuf::from(name));
        self.say(match screenshot::write_new(&picture, &name) {
            Ok(path) => format!("saved {}", path.display()),
            Err(error) => format!("not saved: {error:#}"),
        });
        Ok(())
    }

    /// Moves the viewer by keys and mouse.
    fn move_viewer(&mut self, ui: &egui::Ui, picture: egui::Rect) {
        let sense = egui::Sense::click_and_drag();
        let response = ui.interact(ui.max_rect(), egui::Id::unique("picture"), sense);
        let options = &self.shown.manifest.options;
        let drag = response.drag_delta();
        if drag != egui::Vec2::ZERO {
            let angle = options.fov_degrees.to_radians() / f64::from(picture.size().max_elem());
            self.flight
                .turn(-f64::from(drag.x) * angle, f64::from(drag.y) * angle);
            self.pictures.touch();
        }
        let (seconds, shift, wheel) = ui.input(|input| {
            let wheel = f64::from(input.smooth_scroll_delta().y);
            (f64::from(input.stable_dt), input.modifiers.shift, wheel)
        });
        let held = keys::movement(self.held.iter().copied());
        let faster = if shift { FASTER } else { 1.0 };
        let by = held * (seconds.min(LONGEST) * faster) + DVec3::Z * (wheel * WHEEL);
        if by != DVec3::ZERO {
            let speed = space::speed(&options.view_space, self.flight.eye, self.shown.center());
            self.flight.fly(&options.view_space, by * speed);
            self.pictures.touch();
        }
        if held != DVec3::ZERO {
            ui.request_repaint();
        }
    }

    fn draw(&mut self, ui: &egui::Ui) -> Result<()> {
        self.pictures.collect_times()?;
        self.pictures.draw(&self.shown, &self.flight, &self.look)?;
        for side in Side::ALL {
            if self.look.shows(side) && self.pictures.lacks_time(side) {
                // Again, as the first time does not count.
                self.pictures.touch_side(side);
                ui.request_repaint_after(ASK);
            }
        }
        Ok(())
    }

    fn paint(&self, ui: &egui::Ui, picture: egui::Rect) {
        let painter = ui.painter().with_clip_rect(picture);
        let whole = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        painter.image(self.texture, picture, whole, egui::Color32::WHITE);
        if self.draws_cell() {
            let fov = self.shown.manifest.options.fov_degrees.to_radians();
            let camera = self.flight.camera(fov, self.pictures.size());
            let scale = f64::from(picture.width()) / f64::from(camera.width);
            let seen = (self.lines.iter()).filter_map(|line| outline::in_picture(&camera, line));
            for ends in seen {
                let ends = ends.map(|end| {
                    let end = (end * scale).as_vec2();
                    picture.min + egui::vec2(end.x, end.y)
                });
                painter.line_segment(ends, egui::Stroke::new(1.5, OUTLINE));
            }
        }
        if self.has_panel {
            let words = panel::words(&self.shown, &self.pictures, &self.flight, &self.look);
            panel::show(ui, &words);
        }
        if let Some((message, until)) = &self.message
            && let Some(rest) = until.checked_duration_since(Instant::now())
        {
            panel::show_message(ui, message);
            ui.request_repaint_after(rest);
        }
        if self.has_help {
            panel::show_help(ui);
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if let Err(error) = self.frame(ui, frame) {
            if let Ok(mut failure) = self.failure.lock() {
                *failure = Some(error);
            }
            ui.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    fn clear_color(&self, _: &egui::Visuals) -> [f32; 4] {
        [0.1, 0.1, 0.1, 1.0]
    }
}

/// The largest place in the middle of the window for a picture of a size in pixels.
fn fitted(window: egui::Rect, [width, height]: [u32; 2]) -> egui::Rect {
    let size = egui::vec2(width as f32, height as f32);
    let scale = (window.size() / size).min_elem();
    egui::Rect::from_center_size(window.center(), size * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_do_not_name_source_code() {
        let error = "os error at /a/winit-0.30.13/src/linux/mod.rs:765: DISPLAY is not set.";
        assert_eq!(without_place(error), "DISPLAY is not set.");
        assert_eq!(without_place("no surface: lost"), "no surface: lost");
    }

    /// Only where there is no display is it said that there is none.
    #[test]
    fn windows_that_are_not_drawn_name_the_adapter() {
        let failed = eframe::Error::AppCreation("no surface: lost".into());
        let words = no_window(failed, "llvmpipe").to_string();
        assert!(!words.contains("no display"), "{words}");
        assert!(
            words.contains("llvmpipe") && words.contains("no surface: lost"),
            "{words}"
        );
    }

    /// A picture keeps its shape and fills the window along one side.
    #[test]
    fn pictures_fit_into_the_window() {
        let window = egui::Rect::from_min_size(egui::pos2(0.0, 0.0), egui::vec2(1280.0, 800.0));
        let square = fitted(window, [512, 512]);
        assert_eq!(square.size(), egui::vec2(800.0, 800.0));
        assert_eq!(square.center(), window.center());
        assert_eq!(fitted(window, [320, 100]).size(), egui::vec2(1280.0, 400.0));
    }
}
