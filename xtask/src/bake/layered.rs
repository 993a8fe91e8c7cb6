//! Layered impostors: place, record, cull, grow, pack, paint
//! (S. Jeschke, Accelerating the Rendering Process Using Impostors, 2005, chapter 3).

use super::recording::{Layers, Settings, cull, description, place, recording_camera};
use super::{Baked, channels};
use crate::console::Console;
use crate::device::Device;
use crate::parts::Part;
use anyhow::{Context, Result};
use farfield_atlas::pack;
use farfield_bundle::{Body, Channels, Impostor};
use farfield_grid::{Grid, Rect};
use farfield_layers::{corners_in_view, smallest_texel};
use farfield_pages::{
    ALPHA_CUTOFF, GUTTER, LayerTexels, LightPages, Patch, blank_page, make_lit, paint, quad_scene,
};
use farfield_quads::{Price, cover};
use farfield_sampling::{Foliage, Lighting, Recording, Textures, sample_colors, sample_surfaces};
use farfield_scene::{AlphaMode, Scene};
use farfield_views::Camera;
use glam::DVec4;
use rayon::prelude::*;

/// The alpha from which on texels are shown. Those that were set by their centres are as large as
/// they look: between an opaque and a transparent one, half of the way belongs to either.
pub(crate) fn shown_from(foliage: Foliage) -> f32 {
    match foliage {
        Foliage::Any => ALPHA_CUTOFF,
        Foliage::Centre => 0.5,
    }
}

/// Bakes one layered impostor of a part of the scene that the textures are of; `None` where nothing
/// of it can be seen.
///
/// * `bytes_per_quad` - what a quad is worth
pub(super) fn bake(
    name: &str,
    part: &Part<'_>,
    textures: &Textures<'_>,
    settings: &Settings,
    bytes_per_quad: f64,
    device: &Device,
    console: &Console,
) -> Result<Option<(Baked, Layers)>> {
    let scene = &*part.scene;
    let stack = console.stage("place", || place(scene, settings))?;
    let (width, height) = (stack.width, stack.height);
    let camera = recording_camera(&stack);
    let cell = settings.cell.corners();
    let recording = console.stage("record", || {
        let Settings { cell, foliage, .. } = settings;
        device.record(scene, textures, &stack, cell, *foliage, console)
    });
    let visible = console.stage("cull", || cull(&recording, width, height));
    if visible.samples.is_empty() {
        return Ok(None);
    }
    let rects: Vec<Vec<Rect>> = console.stage("grow quads", || {
        let price = Price {
            bytes_per_quad,
            ..Price::default()
        };
        let opaque = |layer| visible.masks(layer, width, height).opaque;
        let layers = (0..stack.layers.len()).into_par_iter();
        layers.map(|layer| cover(&opaque(layer), &price)).collect()
    });

    let (sizes, patches) = console.stage("pack", || arrange(&rects, settings.page_size))?;
    let (pages, light) = console.stage("paint", || {
        let painted =
            |colors: &[[u8; 3]]| paint_pages(&visible, colors, [width, height], &patches, &sizes);
        paint_channels(
            scene,
            textures,
            &camera,
            &cell,
            &visible,
            settings.channels,
            painted,
        )
    });

    let depths: Vec<f64> = stack.layers.iter().map(|layer| layer.depth).collect();
    let [min, max] = part.represented;
    let mut display = quad_scene(name, &camera, &depths, (min + max) / 2.0, &patches, &pages);
    if let Some(light) = light {
        make_lit(&mut display, &light);
    }
    for material in &mut display.materials {
        let cutoff = shown_from(settings.foliage);
        material.alpha = AlphaMode::Mask { cutoff };
    }
    let mut body = description(&stack, &recording, &visible);
    for (layer, rects) in body.layers.iter_mut().zip(&rects) {
        layer.quads = rects.len() as u32;
    }
    let impostor = Impostor {
        name: name.into(),
        side: part.side,
        represented: part.represented,
        body: Body::Layered(body),
    };
    let corners = corners_in_view(&stack.pose, &settings.cell);
    let baked = Baked {
        impostor,
        display,
        smallest_texel: smallest_texel(&stack, &corners, &settings.camera),
    };
    let layers = Layers {
        stack,
        recording,
        visible,
    };
    Ok(Some((baked, layers)))
}

/// Sizes of the pages, and where each rectangle lies on them, sorted by page.
fn arrange(rects: &[Vec<Rect>], page_size: u32) -> Result<(Vec<[u32; 2]>, Vec<Patch>)> {
    let all = rects.iter().enumerate();
    let all: Vec<(usize, Rect)> = all
        .flat_map(|(layer, rects)| rects.iter().map(move |rect| (layer, *rect)))
        .collect();
    let padded = |rect: &Rect| [rect.width + 2 * GUTTER, rect.height + 2 * GUTTER];
    let sizes: Vec<[u32; 2]> = all.iter().map(|(_, rect)| padded(rect)).collect();
    let too_small = || format!("--page-size {page_size} is too small");
    let atlas = pack(&sizes, page_size).with_context(too_small)?;
    let placed = all.into_iter().zip(atlas.placements);
    let mut patches: Vec<Patch> = placed
        .map(|((layer, rect), at)| Patch {
            layer: layer as u32,
            rect,
            page: at.page,
            x: at.x,
            y: at.y,
        })
        .collect();
    patches.sort_by_key(|patch| patch.page);
    Ok((atlas.pages, patches))
}

/// The pages of colours, and those beside them for engines that light them.
fn paint_channels(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    cell: &[DVec4],
    visible: &Recording,
    channels: Channels,
    painted: impl Fn(&[[u8; 3]]) -> Vec<Grid<[u8; 4]>>,
) -> (Vec<Grid<[u8; 4]>>, Option<LightPages>) {
    let samples = &visible.samples;
    match channels {
        Channels::Lit | Channels::Unlit => {
            let light = Lighting::default();
            let colors = sample_colors(scene, textures, camera, cell, samples, &light);
            (painted(&colors), None)
        }
        Channels::Pbr => {
            let surfaces = sample_surfaces(scene, textures, camera, cell, samples);
            let texels = channels::texels(&surfaces, &camera.pose);
            let emissive = texels.emissive;
            let light = LightPages {
                normal: painted(&texels.normal),
                metallic_roughness: painted(&texels.metallic_roughness),
                emissive: emissive.map(|(texels, strength)| (painted(&texels), strength)),
            };
            (painted(&texels.base_color), Some(light))
        }
    }
}

/// Copies the texels of all layers, of `layer_size` each, into pages of `page_sizes`.
fn paint_pages(
    recording: &Recording,
    colors: &[[u8; 3]],
    layer_size: [u32; 2],
    patches: &[Patch],
    page_sizes: &[[u32; 2]],
) -> Vec<Grid<[u8; 4]>> {
    let mut pages: Vec<_> = page_sizes.iter().map(|size| blank_page(*size)).collect();
    let mut by_layer = vec![Vec::new(); recording.layers.len()];
    for patch in patches {
        by_layer[patch.layer as usize].push(*patch);
    }
    let positions: Vec<[u16; 2]> = recording.samples.iter().map(|s| [s.x, s.y]).collect();
    let [width, height] = layer_size;
    let mut scratch = Grid::filled(width as usize, height as usize, [0; 4]);
    for (patches, run) in by_layer.iter().zip(&recording.layers) {
        let texels = LayerTexels {
            width,
            height,
            positions: &positions[run.clone()],
            colors: &colors[run.clone()],
        };
        paint(&texels, patches, &mut pages, &mut scratch);
    }
    pages
}
