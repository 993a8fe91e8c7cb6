//! The window: a program of its own, so that nothing else compiles one.

use super::{ViewMode, ViewOptions};
use crate::console::Console;
use crate::opened;
use anyhow::{Context, Result, bail};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

/// How the window begins. What is not named is the window's own choice.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WindowOptions {
    /// Number of a viewpoint, as `verify` counts.
    pub view: Option<u64>,
    /// What is shown of original and impostor.
    pub mode: Option<ViewMode>,
    /// Width and height of the picture, in pixels.
    pub size: Option<[u32; 2]>,
    /// A PNG file that is written in place of a window.
    pub screenshot: Option<PathBuf>,
}

/// The package that has the window, and its folder in the checkout.
const PACKAGE: &str = "farfield-viewer";
const FOLDER: &str = "crates/viewer";

/// Shows a bundle in a window until that is closed, or writes a picture: builds the program that does, if
/// need be, and runs it. Returns the program's exit status.
///
/// # Errors
///
/// When the bundle is damaged, in the words of `verify` and before anything is built, or when this program
/// is not in its checkout, from which the window is built.
pub fn window(options: &ViewOptions, window: &WindowOptions) -> Result<ExitStatus> {
    // The window says all this again.
    opened::manifest(&options.dir, &Console::Silent)?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if !root.join(FOLDER).join("Cargo.toml").exists() {
        bail!(
            "the window is built from {}, which is not there any more: run `cargo xtask view` in a \
             checkout, or look at the bundle in a browser with --web",
            root.join(FOLDER).display()
        );
    }
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["run", "--release", "--package", PACKAGE, "--manifest-path"])
        .arg(root.join("Cargo.toml"))
        .arg("--")
        .args(arguments(options, window))
        .status();
    status.context("cargo, which builds the window, cannot be run")
}

/// The window's command line.
fn arguments(options: &ViewOptions, window: &WindowOptions) -> Vec<OsString> {
    let mut arguments = Vec::new();
    let mut add = |name: &str, value: OsString| arguments.extend([name.into(), value]);
    if let Some(scene) = &options.scene {
        add("--scene", scene.into());
    }
    if let Some(view) = window.view {
        add("--view", view.to_string().into());
    }
    if let Some(mode) = window.mode {
        add("--mode", mode.name().into());
    }
    if let Some([width, height]) = window.size {
        add("--size", format!("{width}x{height}").into());
    }
    if let Some(file) = &window.screenshot {
        add("--screenshot", file.into());
    }
    arguments.extend(["--".into(), options.dir.clone().into()]);
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The window is given what this program was, and a folder is no option.
    #[test]
    fn options_are_passed_on() {
        let options = ViewOptions {
            dir: "--mode".into(),
            scene: Some("scene.glb".into()),
        };
        let begin = WindowOptions {
            view: Some(3),
            mode: Some(ViewMode::Difference),
            size: Some([80, 60]),
            screenshot: Some("picture.png".into()),
        };
        let expected = "--scene scene.glb --view 3 --mode difference --size 80x60 \
                        --screenshot picture.png -- --mode";
        let expected: Vec<&str> = expected.split_whitespace().collect();
        assert_eq!(arguments(&options, &begin), expected);
        let bare = ViewOptions {
            scene: None,
            ..options
        };
        assert_eq!(
            arguments(&bare, &WindowOptions::default()),
            ["--", "--mode"]
        );
    }
}
