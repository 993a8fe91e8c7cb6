//! Whether ID-bitfields draw all that is seen.
use super::{VerifyOptions, VerifyReport};
use crate::console::Console;
use anyhow::{Result, bail};
use farfield_bundle::Manifest;
use farfield_scene::Scene;
pub(super) fn verify(
    _o: &VerifyOptions,
    _m: &Manifest,
    _s: Scene,
    _c: &Console,
) -> Result<VerifyReport> {
    bail!("todo")
}
