//! Measures the GPU: id buffers against the CPU's, and milliseconds a frame.
//!
//! `cargo run --release -p farfield-gpu-tests --example measure -- FILE...` takes scenes, such as a
//! glTF file and the `impostors.glb` of its bundle, and looks at all of them as at the first.

use farfield_gpu::{Display, Gpu, GpuError, GpuScene, IdBuffers, Lighting};
use farfield_sampling::{Textures, rasterize};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::DVec3;
use std::io::Write;
use std::path::Path;
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
