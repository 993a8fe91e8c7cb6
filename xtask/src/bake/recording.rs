//! What all techniques begin with: layers are placed and recorded, and what cannot be seen is culled
//! (S. Jeschke, Accelerating the Rendering Process Using Impostors, 2005, sections 3.3 and 3.4).

use crate::console::Console;
use crate::device::Device;
use crate::view_cell;
use anyhow::Result;
use farfield_bundle::{Channels, LayerRecord, LayeredBody};
use farfield_culling::Culler;
use farfield_grid::BitMask;
use farfield_layers::{
    Bounds, LayerStack, PromisedCamera, corners_in_view, reference_view_of_hull, stack,
};
use farfield_sampling::{Foliage, Recording, Sample, Textures, rasterize, record, seen_bounds};
use farfield_scene::Scene;
use farfield_views::{Camera, ViewCell};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// What an impostor is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Where the viewer may be.
    pub cell: ViewCell,
    /// Corners of a convex body around all that is represented.
    pub hull: [DVec3; 8],
    /// The viewer's camera.
    pub camera: PromisedCamera,
    /// Longest side of an atlas page, in texels.
    pub page_size: u32,
    /// How masked materials are recorded.
    pub foliage: Foliage,
    /// What the pages hold.
    pub channels: Channels,
}

/// The layers of an impostor, as they were recorded, and what culling kept of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layers {
    /// Where they lie.
    pub(crate) stack: LayerStack,
    /// All texels that were set.
    pub(crate) recording: Recording,
    /// Those that can be seen.
    pub(crate) visible: Recording,
}

/// Whether anything of a scene can be seen from its view cell.
///
/// # Errors
///
/// As for [`place`].
pub(crate) fn is_seen(
    scene: &Scene,
    textures: &Textures<'_>,
    settings: &Settings,
    device: &Device,
    console: &Console,
) -> Result<bool> {
    let stack = place(scene, settings)?;
    let Settings { cell, foliage, .. } = settings;
    let recording = device.record(scene, textures, &stack, cell, *foliage, console);
    Ok(!recording.samples.is_empty())
}

/// Where the layers go: reference viewpoint and texel size follow from the represented hull,
/// extent and depths from the vertices.
///
/// # Errors
///
/// When the view cell does not lie before the scene, or too many texels or layers were needed.
///
/// # Panics
///
/// When the scene draws nothing.
pub fn place(scene: &Scene, settings: &Settings) -> Result<LayerStack> {
    let Settings {
        cell, hull, camera, ..
    } = settings;
    let view = reference_view_of_hull(cell, hull, camera)
        .map_err(|error| view_cell::explain(error, cell, scene))?;
    let (extent, [near, far]) =
        seen_bounds(scene, &view.pose).expect("a scene with a represented box has triangles");
    let bounds = Bounds { extent, near, far };
    Ok(stack(
        &view.pose,
        &bounds,
        &view.precision,
        &corners_in_view(&view.pose, cell),
    )?)
}

/// The camera whose pixels are the texels of a stack's layers.
pub fn recording_camera(stack: &LayerStack) -> Camera {
    Camera {
        pose: stack.pose,
        extent: stack.extent,
        width: stack.width,
        height: stack.height,
    }
}

/// Records a scene into the layers of a stack.
///
/// # Panics
///
/// When a triangle does not lie before the reference viewpoint.
pub fn record_layers(
    scene: &Scene,
    textures: &Textures<'_>,
    stack: &LayerStack,
    cell: &ViewCell,
    foliage: Foliage,
) -> Recording {
    let camera = recording_camera(stack);
    let (borders, corners) = (stack.borders(), cell.corners());
    record(scene, textures, &camera, &borders, &corners, foliage)
}

/// Whether a camera in the view cell sees the back of anything that is to be seen from its front only, as
/// far as its corners and the middles of its edges and faces tell.
pub fn shows_backs(
    scene: &Scene,
    textures: &Textures<'_>,
    cell: &ViewCell,
    hull: &[DVec3; 8],
    camera: &PromisedCamera,
) -> bool {
    let is_one_sided = |m: &u32| !scene.materials[*m as usize].double_sided;
    if !scene.triangle_materials.iter().any(is_one_sided) {
        return false;
    }
    let mut both_sides = scene.clone();
    for material in &mut both_sides.materials {
        material.double_sided = true;
    }
    let center = hull.iter().sum::<DVec3>() / hull.len() as f64;
    (0..LOOKED_FROM).into_par_iter().any(|index| {
        let eye = cell.viewpoint(index, 0);
        let camera = Camera::looking_at(eye, center, camera.fov, camera.resolution);
        let [fronts, all] =
            [scene, &both_sides].map(|scene| rasterize(scene, textures, &camera).depth);
        fronts.cells() != all.cells()
    })
}

/// Viewpoints of a cell that are its corners, and the middles of edges, faces and all.
const LOOKED_FROM: u64 = 27;

/// What is left of a recording when texels that no view of the cell can see are removed, front to
/// back.
pub fn cull(recording: &Recording, width: u32, height: u32) -> Recording {
    visible(recording, &reached(recording, width, height))
}

/// The texels of each layer that lines of sight from the cell may reach: to meet them or to pass.
pub fn reached(recording: &Recording, width: u32, height: u32) -> Vec<BitMask> {
    let all = BitMask::full(width as usize, height as usize);
    let mut culler = Culler::new(width as usize, height as usize);
    let layers = 0..recording.layers.len();
    layers
        .map(|layer| culler.next(&all, &recording.masks(layer, width, height).occluding))
        .collect()
}

/// What of a recording is reached.
pub fn visible(recording: &Recording, reached: &[BitMask]) -> Recording {
    let mut visible = Recording::default();
    for (run, reached) in recording.layers.iter().zip(reached) {
        let is_seen = |sample: &&Sample| reached.contains(sample.x.into(), sample.y.into());
        let start = visible.samples.len();
        let samples = &recording.samples[run.clone()];
        visible.samples.extend(samples.iter().filter(is_seen));
        visible.layers.push(start..visible.samples.len());
    }
    visible
}

/// The layers of an impostor as the manifest describes them, without quads.
pub(super) fn description(
    stack: &LayerStack,
    recording: &Recording,
    visible: &Recording,
) -> LayeredBody {
    let positions = |run: &Range<usize>| -> Vec<[u16; 2]> {
        let samples = &visible.samples[run.clone()];
        samples.iter().map(|sample| [sample.x, sample.y]).collect()
    };
    let layers = stack.layers.iter().zip(&visible.layers);
    let layers = layers.map(|(layer, run)| LayerRecord {
        depth: layer.depth,
        near: layer.near,
        far: layer.far,
        quads: 0,
        texels_sha256: texels_sha256(&positions(run)),
    });
    LayeredBody {
        pose: stack.pose,
        extent: stack.extent,
        width: stack.width,
        height: stack.height,
        layers: layers.collect(),
        texels_recorded: recording.samples.len() as u64,
        texels_kept: visible.samples.len() as u64,
    }
}

/// The checksum of where a layer has texels, given row by row, as the manifest states it.
pub(crate) fn texels_sha256(positions: &[[u16; 2]]) -> String {
    let bytes: Vec<u8> = positions
        .as_flattened()
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    farfield_bundle::sha256_hex(&bytes)
}
