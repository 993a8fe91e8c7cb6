//! The recorded layers as voxels: what meshes are made for.

use super::recording::{Layers, Settings, place, reached, shows_backs, visible};
use crate::console::Console;
use crate::device::Device;
use crate::voxels::{Projection, VoxelGrid};
use anyhow::Result;
use farfield_grid::BitMask;
use farfield_sampling::Textures;
use farfield_scene::Scene;
use farfield_tdm::VoxelLayers;
use glam::Vec3;
use rayon::prelude::*;

/// The texels of recorded layers that can be seen, in the warped grid.
#[derive(Clone, Debug)]
pub struct Voxels {
    pub(super) layers: Layers,
    pub(super) projection: Projection,
    pub(super) grid: VoxelGrid,
    pub(super) points: Vec<Vec3>,
}

impl Voxels {
    /// The voxels, as meshes are made for them.
    pub fn layers(&self) -> VoxelLayers<'_> {
        self.grid.layers()
    }

    /// A point of the surface in each, in the warped grid.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }
}

/// Places, records and culls the layers of a scene; `None` where nothing of it can be seen.
///
/// # Errors
///
/// As for [`place`].
pub fn voxelize(
    scene: &Scene,
    textures: &Textures<'_>,
    settings: &Settings,
    device: &Device,
    console: &Console,
) -> Result<Option<Voxels>> {
    let stack = console.stage("place", || place(scene, settings))?;
    let recording = console.stage("record", || {
        let Settings {
            cell, hull, camera, ..
        } = settings;
        let foliage = settings.foliage;
        let mut recording = device.record(scene, textures, &stack, cell, foliage, console);
        // Nobody looks through a back from behind, so whoever could has been stopped before.
        if !shows_backs(scene, textures, cell, hull, camera) {
            recording
                .samples
                .iter_mut()
                .for_each(|sample| sample.occludes = true);
        }
        recording
    });
    let (reached, visible) = console.stage("cull", || {
        let reached = reached(&recording, stack.width, stack.height);
        let around: Vec<BitMask> = reached.par_iter().map(surroundings).collect();
        let visible = visible(&recording, &around);
        (reached, visible)
    });
    if visible.samples.is_empty() {
        return Ok(None);
    }
    let projection = Projection::of(&stack);
    let grid = VoxelGrid::new(&stack, &projection, &visible, reached);
    let points = projection.points(scene, &visible.samples);
    Ok(Some(Voxels {
        layers: Layers {
            stack,
            recording,
            visible,
        },
        projection,
        grid,
        points,
    }))
}

/// How far meshes go into shadows and, at borders, know what is beside them, in texels.
const INTO_SHADOW: usize = 8;

fn surroundings(reached: &BitMask) -> BitMask {
    (0..INTO_SHADOW).fold(reached.clone(), |mask, _| mask.dilated())
}
