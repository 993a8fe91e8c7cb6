//! A GPU that helps to record layers.

use crate::bake::recording::recording_camera;
use crate::console::Console;
use anyhow::{Context, Result};
use farfield_gpu::{Gpu, GpuError, LayerSearch};
use farfield_layers::LayerStack;
use farfield_sampling::{Foliage, Recording, Textures, Touch, record_touches};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use std::sync::atomic::{AtomicBool, Ordering};

/// A GPU.
#[derive(Debug)]
pub(super) struct Helper {
    gpu: Gpu,
    search: LayerSearch,
    is_lost: AtomicBool,
}

impl Helper {
    /// A GPU, where there is one. A driver that does without one takes longer than the CPU alone.
    pub(super) fn if_any(console: &Console) -> Option<Self> {
        match Self::new() {
            Ok(helper) if helper.gpu.is_software() => None,
            Ok(helper) => Some(helper),
            Err(GpuError::NoAdapter { .. }) => None,
            Err(error) => {
                console.warn(format_args!(
                    "layers are recorded by the CPU alone: {error}"
                ));
                None
            }
        }
    }

    pub(super) fn required() -> Result<Self> {
        Self::new().context("--device gpu")
    }

    fn new() -> Result<Self, GpuError> {
        let gpu = Gpu::new()?;
        Ok(Self {
            search: LayerSearch::new(&gpu)?,
            gpu,
            is_lost: AtomicBool::new(false),
        })
    }

    /// The GPU's name, unless it was lost.
    pub(super) fn name(&self) -> Option<&str> {
        (!self.is_lost.load(Ordering::Relaxed)).then(|| self.gpu.name())
    }

    pub(super) fn lose(&self) {
        self.gpu.device().destroy();
    }

    /// Records layers; `None` where the GPU does not help, which is told once.
    pub(super) fn record(
        &self,
        scene: &Scene,
        textures: &Textures<'_>,
        stack: &LayerStack,
        cell: &ViewCell,
        foliage: Foliage,
        console: &Console,
    ) -> Option<Recording> {
        let name = self.name()?;
        let camera = recording_camera(stack);
        let (borders, corners) = (stack.borders(), cell.corners());
        let found = self
            .search
            .find(&self.gpu, scene, &camera, &borders, &corners);
        let found = match found {
            Ok(found) => found,
            Err(error @ GpuError::Lost { .. }) => {
                self.is_lost.store(true, Ordering::Relaxed);
                console.warn(format_args!(
                    "{error}; the CPU goes on alone, with the same result"
                ));
                return None;
            }
            Err(error) => {
                console.warn(format_args!(
                    "{name} does not help here: {error}; the CPU records alone, with the same result"
                ));
                return None;
            }
        };
        let touches = found.list.into_iter().map(|touch| Touch {
            object: touch.object,
            triangle: touch.triangle,
            layer: touch.layer,
            y: touch.y,
            x: touch.x,
        });
        let touches: Vec<Touch> = touches.collect();
        Some(record_touches(
            scene, textures, &camera, &borders, &corners, foliage, &touches,
        ))
    }
}
