//! A GPU that helps to record layers.

use super::Tally;
use crate::bake::recording::recording_camera;
use crate::console::Console;
use anyhow::{Context, Result};
use farfield_gpu::{Gpu, GpuError, LayerSearch, Touches};
use farfield_layers::LayerStack;
use farfield_sampling::{Foliage, Recording, Textures, Touch, record_touches};
use farfield_scene::Scene;
use farfield_views::{Camera, ViewCell};
use glam::DVec4;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// A GPU.
#[derive(Debug)]
pub(super) struct Helper {
    gpu: Gpu,
    search: LayerSearch,
    is_lost: AtomicBool,
    helped: AtomicU64,
    refused: AtomicU64,
    /// After so many recordings that it helped with, it is lost.
    lost_after: AtomicU64,
    /// What was said, once each.
    told: Mutex<BTreeSet<String>>,
}

impl Helper {
    /// A GPU, where there is one. A driver that does without one takes longer than the CPU alone.
    pub(super) fn if_any(console: &Console) -> Option<Self> {
        let helper = Gpu::new().and_then(|gpu| match gpu.is_software() {
            true => Ok(None),
            false => Self::of(gpu).map(Some),
        });
        match helper {
            Ok(helper) => helper,
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
        Gpu::new().and_then(Self::of).context("--device gpu")
    }

    /// Compiles what is needed.
    fn of(gpu: Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            search: LayerSearch::new(&gpu)?,
            gpu,
            is_lost: AtomicBool::new(false),
            helped: AtomicU64::new(0),
            refused: AtomicU64::new(0),
            lost_after: AtomicU64::new(u64::MAX),
            told: Mutex::default(),
        })
    }

    pub(super) fn name(&self) -> &str {
        self.gpu.name()
    }

    pub(super) fn is_lost(&self) -> bool {
        self.is_lost.load(Ordering::Relaxed)
    }

    pub(super) fn tally(&self) -> Tally {
        Tally {
            helped: self.helped.load(Ordering::Relaxed),
            refused: self.refused.load(Ordering::Relaxed),
        }
    }

    pub(super) fn lose_after(&self, recordings: u64) {
        self.lost_after.store(recordings, Ordering::Relaxed);
    }

    /// Records layers; `None` where the GPU does not help. Why is told, the same thing once.
    pub(super) fn record(
        &self,
        scene: &Scene,
        textures: &Textures<'_>,
        stack: &LayerStack,
        cell: &ViewCell,
        foliage: Foliage,
        console: &Console,
    ) -> Option<Recording> {
        let camera = recording_camera(stack);
        let (borders, corners) = (stack.borders(), cell.corners());
        let Some(found) = self.find(scene, &camera, &borders, &corners, console) else {
            self.refused.fetch_add(1, Ordering::Relaxed);
            return None;
        };
        self.helped.fetch_add(1, Ordering::Relaxed);
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

    fn find(
        &self,
        scene: &Scene,
        camera: &Camera,
        borders: &[f64],
        corners: &[DVec4],
        console: &Console,
    ) -> Option<Touches> {
        if self.is_lost() {
            return None;
        }
        if self.helped.load(Ordering::Relaxed) >= self.lost_after.load(Ordering::Relaxed) {
            self.gpu.device().destroy();
        }
        let found = self.search.find(&self.gpu, scene, camera, borders, corners);
        match found {
            Ok(found) => return Some(found),
            Err(error @ GpuError::Lost { .. }) => {
                self.is_lost.store(true, Ordering::Relaxed);
                self.tell(
                    format!("{error}; the CPU goes on alone, with the same result"),
                    console,
                );
            }
            Err(error) => {
                let name = self.name();
                self.tell(
                    format!(
                        "{name} does not help here: {error}; the CPU records alone, with the same result"
                    ),
                    console,
                );
            }
        }
        None
    }

    /// Warns, unless it was said before.
    fn tell(&self, warning: String, console: &Console) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if !told.contains(&warning) {
            console.warn(&warning);
            told.insert(warning);
        }
    }
}
