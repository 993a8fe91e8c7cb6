//! The driver: composes the stages into `bake`, `verify` and `view`, and owns files, progress and reports.

mod bake;
mod built_in;
mod chance;
mod console;
mod device;
mod drawn;
mod dump;
mod inside;
mod lists;
mod opened;
mod orbit;
mod outliers;
mod parts;
mod pictures;
mod source;
mod verify;
mod view;
mod view_cell;
mod view_space;
mod viewpoints;
mod voxels;

pub use bake::{
    Arrangement, BakeOptions, BakeReport, BitfieldsOptions, BitfieldsReport, HELD_BACK,
    HELD_BACK_INSIDE, ImpostorReport, Limits, Making, SampleChoice, SeenFrom, auto, bake,
    bake_bitfields, bake_on, recording, voxelize,
};
pub use built_in::BuiltIn;
pub use console::{Console, peak_rss_bytes};
pub use device::{Device, DeviceChoice, Tally};
pub use farfield_bundle::Channels;
pub use farfield_sampling::Foliage;
pub use inside::{cells_from_argument, require_volume};
pub use orbit::distances_from_argument;
pub use source::SceneChoice;
pub use verify::{
    BitfieldsFigures, CostOfBoth, CoverageAt, MOST_VIEWS, OverSamples, Place, Seams, Spread,
    Summary, SurfaceBias, VerifyOptions, VerifyReport, Views, require_layers, verify, verify_on,
};
pub use view::{
    CostOfShown, Shown, Sight, ViewMode, ViewOptions, WindowOptions, export, page_content,
    page_program, picture_size, require_export, serve, window,
};
pub use view_cell::ViewCellSpec;

/// What bundles and certificates name as their maker.
fn generator() -> farfield_bundle::Generator {
    farfield_bundle::Generator {
        name: "farfield".into(),
        version: env!("CARGO_PKG_VERSION").into(),
    }
}
