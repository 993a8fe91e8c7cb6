//! The driver: composes the stages into `bake` and `verify`, and owns files, progress and reports.

mod bake;
mod console;
mod pictures;
mod source;
mod verify;
mod view_cell;

pub use bake::{BakeOptions, BakeReport, ImpostorReport, bake, layered};
pub use console::Console;
pub use source::SceneChoice;
pub use verify::{VerifyOptions, VerifyReport, verify};
pub use view_cell::ViewCellSpec;
