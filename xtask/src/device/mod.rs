//! What records layers: the CPU, alone or with the help of a GPU.
//!
//! A GPU finds which triangles may touch which texels of which layers, and leaves out what surely does
//! not matter; the CPU looks at these alone, exactly. So what is recorded is the same, to the last bit,
//! whatever helps: nothing of a bundle tells.

#[cfg(feature = "gpu")]
#[path = "gpu.rs"]
mod helper;

#[cfg(not(feature = "gpu"))]
#[path = "none.rs"]
mod helper;

use crate::bake::recording::record_layers;
use crate::console::Console;
use anyhow::Result;
use farfield_layers::LayerStack;
use farfield_sampling::{Foliage, Recording, Textures};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use helper::Helper;

/// What is asked to record layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A GPU, where the machine has one and the program was built for it; a driver that does without one
    /// counts as none.
    Auto,
    /// The CPU alone.
    Cpu,
    /// A GPU, or a driver that does without one.
    Gpu,
}

/// How many recordings a GPU helped with, and how many the CPU did alone because it was lost or did not
/// take them. Both are 0 where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// With its help.
    pub helped: u64,
    /// Without.
    pub refused: u64,
}

/// What records layers.
#[derive(Debug, Default)]
pub struct Device {
    helper: Option<Helper>,
}

impl Device {
    /// The CPU alone.
    pub fn cpu() -> Self {
        Self::default()
    }

    /// What was chosen, as far as the machine has it.
    ///
    /// # Errors
    ///
    /// When a GPU was chosen and there is none to be used, or the program was built without.
    pub fn open(choice: DeviceChoice, console: &Console) -> Result<Self> {
        let helper = match choice {
            DeviceChoice::Auto => Helper::if_any(console),
            DeviceChoice::Cpu => None,
            DeviceChoice::Gpu => Some(Helper::required()?),
        };
        Ok(Self { helper })
    }

    /// "cpu", or the name of the GPU that is asked for help, unless it was lost.
    pub fn name(&self) -> &str {
        let asked = self.helper.as_ref().filter(|helper| !helper.is_lost());
        asked.map_or("cpu", Helper::name)
    }

    /// How often the GPU helped so far, and how often not.
    pub fn tally(&self) -> Tally {
        self.helper.as_ref().map(Helper::tally).unwrap_or_default()
    }

    /// "cpu", or the name of the GPU, if it helped with any recording since.
    pub(crate) fn name_since(&self, before: Tally) -> &str {
        let helper = self.helper.as_ref();
        let helped = helper.filter(|helper| helper.tally().helped > before.helped);
        helped.map_or("cpu", Helper::name)
    }

    /// Loses the GPU, as if it were unplugged, when it is asked for help the next time after so many
    /// recordings, in all, that it helped with.
    pub fn lose_after(&self, recordings: u64) {
        if let Some(helper) = &self.helper {
            helper.lose_after(recordings);
        }
    }

    /// Says what records layers, where that is not the CPU alone.
    pub(crate) fn introduce(&self, console: &Console) {
        if self.helper.as_ref().is_some_and(|helper| !helper.is_lost()) {
            console.say(format_args!(
                "  layers are recorded with the help of {}",
                self.name()
            ));
        }
    }

    /// Records a scene into the layers of a stack. If the GPU fails, is lost or cannot take the scene, the
    /// CPU does it alone, with the same result, and that is told.
    ///
    /// # Panics
    ///
    /// As [`record_layers`].
    pub(crate) fn record(
        &self,
        scene: &Scene,
        textures: &Textures<'_>,
        stack: &LayerStack,
        cell: &ViewCell,
        foliage: Foliage,
        console: &Console,
    ) -> Recording {
        let helped = self.helper.as_ref();
        let helped =
            helped.and_then(|helper| helper.record(scene, textures, stack, cell, foliage, console));
        helped.unwrap_or_else(|| record_layers(scene, textures, stack, cell, foliage))
    }
}
