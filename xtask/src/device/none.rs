//! Stands for a GPU where the program was built without.

use super::Tally;
use crate::console::Console;
use anyhow::{Result, bail};
use farfield_layers::LayerStack;
use farfield_sampling::{Foliage, Recording, Textures};
use farfield_scene::Scene;
use farfield_views::ViewCell;

/// No GPU.
#[derive(Debug)]
pub(super) enum Helper {}

impl Helper {
    pub(super) fn if_any(_: &Console) -> Option<Self> {
        None
    }

    pub(super) fn required() -> Result<Self> {
        bail!(
            "--device gpu: this program was built without the feature `gpu`; `cargo xtask-gpu` in place of \
             `cargo xtask` builds and runs it with, as does `cargo run --release -p xtask --features gpu --`"
        )
    }

    pub(super) fn name(&self) -> &str {
        match *self {}
    }

    pub(super) fn is_lost(&self) -> bool {
        match *self {}
    }

    pub(super) fn tally(&self) -> Tally {
        match *self {}
    }

    pub(super) fn lose_after(&self, _: u64) {
        match *self {}
    }

    pub(super) fn record(
        &self,
        _: &Scene,
        _: &Textures<'_>,
        _: &LayerStack,
        _: &ViewCell,
        _: Foliage,
        _: &Console,
    ) -> Option<Recording> {
        match *self {}
    }
}
