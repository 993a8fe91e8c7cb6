//! Textured depth meshes: place, record, cull, connect, simplify, lay out, pack, paint
//! (S. Jeschke, Accelerating the Rendering Process Using Impostors, 2005, chapter 4).

use super::Baked;
use super::painter::{GUTTER, Painter, VoxelColors, normals};
use super::recording::{Layers, Settings, description, recording_camera};
use super::sights::{Sights, with_rectangles};
use super::voxelize::{Voxels, voxelize};
use crate::console::Console;
use crate::device::Device;
use crate::parts::Part;
use anyhow::{Context, Result, bail};
use farfield_atlas::{Atlas, pack};
use farfield_bundle::{Body, Channels, Impostor, TdmBody};
use farfield_grid::Grid;
use farfield_layers::{corners_in_view, smallest_texel};
use farfield_pages::{page_scene, place_as_object};
use farfield_sampling::{Lighting, Textures, sample_colors};
use farfield_scene::{AlphaMode, Material, Scene};
use farfield_tdm::{Chart, Mesh, VoxelIndex, VoxelLayers, charts, initial_mesh, pieces, simplify};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::BTreeSet;

/// Bakes one textured depth mesh of a part of the scene that the textures are of; `None` where nothing
/// of it can be seen.
///
/// * `enlarged` - side of a voxel, in voxels, when it is asked whether the mesh touches it
pub(super) fn bake(
    name: &str,
    part: &Part<'_>,
    textures: &Textures<'_>,
    settings: &Settings,
    enlarged: f64,
    device: &Device,
    console: &Console,
) -> Result<Option<(Baked, Layers)>> {
    if settings.channels == Channels::Pbr {
        bail!(
            "textured depth meshes hold colours only: bake --channels lit or unlit, or --technique \
             layered"
        );
    }
    let scene = &*part.scene;
    let Some(voxels) = voxelize(scene, textures, settings, device, console)? else {
        return Ok(None);
    };
    let Voxels {
        layers,
        projection,
        grid,
        points,
    } = voxels;
    let (stack, visible) = (&layers.stack, &layers.visible);
    let camera = recording_camera(stack);
    let (light, cell) = (Lighting::default(), settings.cell.corners());
    let colors = sample_colors(scene, textures, &camera, &cell, &visible.samples, &light);
    let voxels = grid.layers();
    let sights = Sights {
        scene,
        textures,
        settings,
        stack,
        projection: &projection,
    };
    let enlarged = enlarged as f32;
    let initial = console.stage("connect", || initial_mesh(&voxels, &points, enlarged));
    let simple = console.stage("simplify", || simplify(&initial, &voxels, enlarged).mesh);
    let samples = visible.samples.iter();
    let hits: Vec<DVec3> = samples
        .map(|sample| sample.hit.point_in_world(scene))
        .collect();
    let (seen, shown) = console.stage("look", || sights.seen(&hits));
    let (open, left) = console.stage("look through", || {
        sights.open_voxels(&seen, &simple, &voxels, &VoxelIndex::new(&voxels))
    });
    if left > 0 {
        console.warn(format_args!(
            "one looks through the mesh in {left} pixels of some thousand pictures, which no voxels around \
             close: a lower --enlarge makes it denser, and verify tells what is seen of them"
        ));
    }
    let (positions, mut triangles) = with_rectangles(&simple, &voxels, &open);
    let place = |p: &Vec3| projection.point_in_world(p.as_dvec3());
    let world: Vec<DVec3> = positions.iter().map(place).collect();
    let [min, max] = part.represented;
    let origin = (min + max) / 2.0;
    // Clients drop what has no area in the file.
    triangles.retain(|t| {
        let [a, b, c] = t.map(|v| (world[v as usize] - origin).as_vec3());
        (b - a).cross(c - a) != Vec3::ZERO
    });
    let (charts, atlas) = console.stage("lay out", || {
        let densities: Vec<f32> = triangles
            .iter()
            .map(|t| projection.stretch(t.map(|v| positions[v as usize])))
            .collect();
        let charts = charts(&positions, &triangles, &densities, GUTTER);
        let sizes: Vec<[u32; 2]> = charts
            .iter()
            .map(|chart| [chart.width, chart.height])
            .collect();
        let too_small = || format!("--page-size {} is too small", settings.page_size);
        let atlas = pack(&sizes, settings.page_size).with_context(too_small)?;
        anyhow::Ok((charts, atlas))
    })?;
    let pages = console.stage("paint", || {
        let painter = Painter {
            projection: &projection,
            voxels: VoxelColors {
                index: displayed(&voxels, &simple, &open),
                colors: &colors,
                normals: &normals(scene, &stack.pose, &visible.samples),
                shown: &shown,
            },
            triangles: &triangles,
            world: &world,
        };
        painter.pages(&charts, &atlas)
    });
    let display = display(name, &triangles, &world, origin, &charts, &atlas, &pages);
    let body = TdmBody {
        recorded: description(stack, &layers.recording, visible),
        initial_triangles: initial.triangles.len() as u64,
        triangles: triangles.len() as u64,
        pieces: pieces(&triangles) as u64,
        charts: charts.len() as u64,
    };
    let impostor = Impostor {
        name: name.into(),
        side: part.side,
        represented: part.represented,
        body: Body::Tdm(body),
    };
    let corners = corners_in_view(&stack.pose, &settings.cell);
    let baked = Baked {
        impostor,
        display,
        smallest_texel: smallest_texel(stack, &corners, &settings.camera),
    };
    Ok(Some((baked, layers)))
}

/// The voxels that a mesh and rectangles stand for. Others, right behind what is in front, are not to shine
/// through where the mesh lies between.
fn displayed(voxels: &VoxelLayers<'_>, mesh: &Mesh, open: &BTreeSet<u32>) -> VoxelIndex {
    let count = voxels.layers.iter().map(Vec::len).sum();
    let mut standing = vec![false; count];
    for voxel in mesh.voxels.iter().flatten().chain(open) {
        standing[*voxel as usize] = true;
    }
    VoxelIndex::of(voxels, |voxel| standing[voxel as usize])
}

/// What is displayed: one object, one mesh, an opaque, unlit material a page, seen from both sides, as
/// a simplified triangle can face away where the surface is seen edge-on.
fn display(
    name: &str,
    triangles: &[[u32; 3]],
    world: &[DVec3],
    origin: DVec3,
    charts: &[Chart],
    atlas: &Atlas,
    pages: &[Grid<[u8; 4]>],
) -> Scene {
    let look = Material {
        metallic: 0.0,
        alpha: AlphaMode::Opaque,
        double_sided: true,
        unlit: true,
        ..Material::default()
    };
    let mut scene = page_scene(pages, &look);
    let mut order: Vec<usize> = (0..charts.len()).collect();
    order.sort_by_key(|chart| atlas.placements[*chart].page);
    // A vertex has one place in a chart.
    let mut numbers = vec![(u32::MAX, 0); world.len()];
    for chart in order {
        let (at, chart_number) = (atlas.placements[chart], chart as u32);
        let chart = &charts[chart];
        let [width, height] = atlas.pages[at.page as usize];
        let size = Vec2::new(width as f32, height as f32);
        let corner = Vec2::new(at.x as f32, at.y as f32);
        for (triangle, places) in chart.triangles.iter().zip(&chart.corners) {
            let triangle = triangles[*triangle as usize];
            let vertices = [0, 1, 2].map(|i| {
                let number = &mut numbers[triangle[i] as usize];
                if number.0 != chart_number {
                    *number = (chart_number, scene.positions.len() as u32);
                    let point = world[triangle[i] as usize] - origin;
                    scene.positions.push(point.as_vec3());
                    scene.normals.push(Vec3::Y);
                    scene.uvs.push((corner + places[i]) / size);
                    scene.colors.push(Vec4::ONE);
                }
                number.1
            });
            scene.triangles.push(vertices);
            scene.triangle_materials.push(at.page);
        }
    }
    place_as_object(&mut scene, name, origin);
    scene
}
