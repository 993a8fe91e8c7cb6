//! The GPU that tests run on, those of the window too.

use farfield_gpu::{Gpu, GpuError};
use std::io::Write;

/// A GPU. Where the machine has none, the test is skipped, and says so; the environment variable
/// `FARFIELD_REQUIRE_GPU=1` makes that a failure.
pub(crate) fn gpu() -> Option<Gpu> {
    match Gpu::new() {
        Ok(gpu) => Some(gpu),
        Err(GpuError::NoAdapter { reason }) => {
            let required = std::env::var_os("FARFIELD_REQUIRE_GPU").is_some_and(|v| v == "1");
            assert!(
                !required,
                "FARFIELD_REQUIRE_GPU=1, and there is no GPU: {reason}"
            );
            skipped(&format!("there is no GPU: {reason}"));
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Says on the test's output that something was not tested.
pub(crate) fn skipped(why: &str) {
    // Not through `eprintln!`: what passing tests print with it is not shown.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}
