#![doc = include_str!("../README.md")]

mod flight;
mod outline;
mod space;

mod pictures;
mod screenshot;
mod stopwatch;

mod app;
mod keys;
mod panel;

use anyhow::{Result, bail};
use clap::Parser;
use farfield_gpu::{Gpu, wgpu};
use flight::Flight;
use pictures::{Look, Pictures};
use std::path::PathBuf;
use std::process::ExitCode;
use xtask::{Console, MOST_VIEWS, Shown, ViewMode, ViewOptions, picture_size};

/// Shows a bundle beside its original, in a window or in a file.
#[derive(Parser)]
#[command(name = "farfield-viewer", version)]
struct Args {
    /// The bundle's folder.
    dir: PathBuf,
    /// The original, where it is no longer where it was baked from. Where it is not there at all, the
    /// impostor is shown alone.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Begins at this viewpoint, as `verify` counts.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(..MOST_VIEWS))]
    view: u64,
    /// What is shown of original and impostor. [default: split, or the impostor where it is alone]
    #[arg(long, value_enum)]
    mode: Option<ViewMode>,
    /// Width and height of the picture in pixels, as in 800x600. [default: as many as were promised]
    #[arg(long, value_name = "WxH", value_parser = picture_size)]
    size: Option<[u32; 2]>,
    /// Writes the picture to a PNG file, without a window.
    #[arg(long, value_name = "FILE")]
    screenshot: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            Console::Stderr.error(&error);
            ExitCode::from(1)
        }
    }
}

fn run(args: Args) -> Result<()> {
    let console = Console::Stderr;
    let options = ViewOptions {
        dir: args.dir,
        scene: args.scene,
    };
    let shown = Shown::open(&options, &console)?;
    let look = Look::new(mode(&shown, args.mode)?);
    let flight = Flight::at(shown.sight(args.view)?, shown.aims_anywhere);
    let size = args.size.unwrap_or([shown.manifest.options.resolution; 2]);
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = Gpu::adapter(&instance)?;
    let gpu = Gpu::with_adapter(&adapter)?;
    let mut pictures = console.stage("upload", || Pictures::new(gpu, &shown, size))?;
    let Some(file) = args.screenshot else {
        return app::run(shown, pictures, (instance, adapter), flight, look);
    };
    pictures.draw(&shown, &flight, &look)?;
    screenshot::write(&pictures.read()?, &file)?;
    console.say(format_args!("saved {}", file.display()));
    Ok(())
}

/// What is shown first.
fn mode(shown: &Shown, wanted: Option<ViewMode>) -> Result<ViewMode> {
    match (wanted, &shown.original) {
        (Some(mode), Some(_)) => Ok(mode),
        (None, Some(_)) => Ok(ViewMode::Split),
        (None | Some(ViewMode::Impostor), None) => Ok(ViewMode::Impostor),
        (Some(mode), None) => bail!(
            "--mode {}: the original is not there; name it with --scene FILE, or leave this out",
            mode.name()
        ),
    }
}
