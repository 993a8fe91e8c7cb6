//! Measures the GPU: id buffers and layers against the CPU's, and milliseconds a frame.
//!
//! `cargo run --release -p farfield-gpu-tests --example measure -- FILE...` takes scenes, such as a
//! glTF file and the `impostors.glb` of its bundle, and looks at all of them as at the first. Layers are
//! those of the Stanford dragon, where the environment variable `FARFIELD_MODELS` names a folder that has
//! `stanford_dragon.glb`.

mod touches;

use farfield_gpu::{Display, Gpu, GpuError, GpuScene, IdBuffers, LayerSearch, Lighting};
use farfield_sampling::{Foliage, Textures, rasterize, record, record_touches};
use farfield_scene::Scene;
use farfield_views::{Camera, ViewCell};
use glam::DVec3;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

const RESOLUTION: u32 = 512;

fn main() -> Result<(), GpuError> {
    let mut out = std::io::stdout();
    let mut say = |line: String| {
        // A closed pipe wants no more lines.
        let _ = writeln!(out, "{line}");
    };
    let gpu = Gpu::new()?;
    say(format!("{}, software: {}", gpu.name(), gpu.is_software()));
    let mut cameras = Vec::new();
    for name in std::env::args().skip(1) {
        let scene = match name.strip_prefix("town:").and_then(|n| n.parse().ok()) {
            Some(triangles) => farfield_town::town(1, triangles),
            None => match farfield_import::read(Path::new(&name)) {
                Ok(imported) => imported.scene,
                Err(error) => {
                    say(format!("{name}: {error}"));
                    continue;
                }
            },
        };
        if cameras.is_empty() {
            cameras = before(&scene);
        }
        let start = Instant::now();
        let uploaded = GpuScene::new(&gpu, &scene)?;
        let seconds = start.elapsed().as_secs_f64();
        let all = uploaded.all();
        say(format!(
            "{name}: {} triangles, {} draw calls, uploaded in {seconds:.2} s",
            all.triangles(),
            all.count()
        ));
        // The first picture pays for what the driver compiles.
        let ids = IdBuffers::new(&gpu)?;
        ids.see(&gpu, &uploaded, &all, &cameras[..1])?;
        let start = Instant::now();
        ids.see(&gpu, &uploaded, &all, &cameras)?;
        let on_gpu = start.elapsed().as_secs_f64() / cameras.len() as f64;
        let textures = Textures::new(&scene);
        let start = Instant::now();
        for camera in &cameras {
            rasterize(&scene, &textures, camera);
        }
        let on_cpu = start.elapsed().as_secs_f64() / cameras.len() as f64;
        say(format!(
            "  ids: {:.1} ms a picture, rasterize {:.1} ms",
            on_gpu * 1e3,
            on_cpu * 1e3
        ));
        let display = Display::new(&gpu, Display::OFFSCREEN)?;
        display.pictures(&gpu, &uploaded, &all, &cameras[..1], &LIGHT)?;
        let start = Instant::now();
        let pictures = display.pictures(&gpu, &uploaded, &all, &cameras, &LIGHT)?;
        let wall = start.elapsed().as_secs_f64() / cameras.len() as f64;
        let mut times: Vec<f64> = pictures.iter().filter_map(|p| p.gpu_milliseconds).collect();
        times.sort_by(f64::total_cmp);
        let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
        say(format!(
            "  display: {:.1} ms a frame, {median:.1} ms of GPU time (median)",
            wall * 1e3
        ));
    }
    let folder = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let dragon = folder.map(|folder| folder.join("stanford_dragon.glb"));
    match dragon.map(|file| farfield_import::read(&file)) {
        Some(Ok(imported)) => measure_layers(&gpu, &imported.scene, say)?,
        Some(Err(error)) => say(format!("layers: {error}")),
        None => say("layers are not measured: FARFIELD_MODELS names no folder".into()),
    }
    Ok(())
}

const LAYERS: u32 = 73;

/// Searches a scene's layers and records them, with the search and without.
fn measure_layers(gpu: &Gpu, scene: &Scene, mut say: impl FnMut(String)) -> Result<(), GpuError> {
    let [min, max] = scene.bounds().unwrap_or([DVec3::ZERO, DVec3::ONE]);
    let (middle, size) = ((min + max) / 2.0, max - min);
    // As a bake has it that is told nothing, but that all layers are of the same relative thickness.
    let away = size.max_element();
    let eye = DVec3::new(middle.x, middle.y, max.z + away);
    let cell = ViewCell::Box {
        center: eye,
        size: DVec3::splat(away / 2.0),
    };
    let camera = Camera::looking_at(eye, middle, 45f64.to_radians(), RESOLUTION);
    let thickness = ((away + size.z) / away).powf(1.0 / f64::from(LAYERS));
    let borders: Vec<f64> = (0..=LAYERS)
        .map(|i| away * thickness.powf(i.into()))
        .collect();
    let (corners, textures) = (cell.corners(), Textures::new(scene));

    let search = LayerSearch::new(gpu)?;
    // The first one pays for what the driver compiles.
    search.find(gpu, scene, &camera, &borders, &corners)?;
    let start = Instant::now();
    let found = search.find(gpu, scene, &camera, &borders, &corners)?;
    let searched = start.elapsed().as_secs_f64() * 1e3;
    let touches = touches::of_search(&found);
    let foliage = Foliage::Any;
    let start = Instant::now();
    let helped = record_touches(
        scene, &textures, &camera, &borders, &corners, foliage, &touches,
    );
    let with_touches = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let alone = record(scene, &textures, &camera, &borders, &corners, foliage);
    let without = start.elapsed().as_secs_f64() * 1e3;
    say(format!(
        "{LAYERS} layers of {} triangles: search {searched:.0} ms, {:.0} ms of GPU time in {} passes, {} \
         touches for {} texels; record_touches {with_touches:.0} ms, record alone {without:.0} ms{}",
        scene.triangles.len(),
        found.gpu_milliseconds.unwrap_or(f64::NAN),
        found.passes,
        touches.len(),
        alone.samples.len(),
        if helped == alone {
            ""
        } else {
            ", AND THEY DIFFER"
        },
    ));
    Ok(())
}

const LIGHT: Lighting = Lighting {
    to_sun: glam::Vec3::new(0.48, 0.64, 0.6),
    sun: glam::Vec3::splat(0.7),
    sky: glam::Vec3::splat(0.45),
    ground: glam::Vec3::splat(0.18),
};

/// Eight cameras before a scene, beside each other, that look at its middle.
fn before(scene: &Scene) -> Vec<Camera> {
    let [min, max] = scene.bounds().unwrap_or([DVec3::ZERO, DVec3::ONE]);
    let (middle, size) = ((min + max) / 2.0, (max - min).length());
    let eye = |i: u32| DVec3::new(f64::from(i) * 0.02 - 0.07, 0.1, 1.1) * size;
    (0..8)
        .map(|i| Camera::looking_at(middle + eye(i), middle, 45f64.to_radians(), RESOLUTION))
        .collect()
}
