//! Which object and which triangle each pixel sees, and how far away.

use crate::pictures::{Targets, check_size, depth_target, draw, pipelines, target};
use crate::readback::{Mapped, Readback, Slot, batches, bytes_of};
use crate::scene::GpuScene;
use crate::{Draws, Gpu, GpuError, geometry::PIPELINES, shaders};
use farfield_grid::Grid;
use farfield_views::Camera;
use wgpu::{Color, RenderPipeline, TextureFormat};

/// The id of nothing.
pub const NONE: u32 = u32::MAX;

/// The nearest surface at each pixel's centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Along the view axis, in metres; infinite where nothing is seen.
    pub depth: Grid<f32>,
    /// Index into the scene's objects, or [`NONE`].
    pub objects: Grid<u32>,
    /// Index into the scene's triangles, or [`NONE`].
    pub triangles: Grid<u32>,
}

/// Draws ids and depths.
#[derive(Debug)]
pub struct IdBuffers {
    pipelines: [RenderPipeline; PIPELINES],
}

const IDS: TextureFormat = TextureFormat::Rg32Uint;
const DEPTHS: TextureFormat = TextureFormat::R32Float;
const BYTES_PER_PIXEL: [u32; 2] = [8, 4];

impl IdBuffers {
    /// Compiles the shaders.
    ///
    /// # Errors
    ///
    /// When the driver does not, or the device was lost.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        gpu.guarded(|| {
            Ok(Self {
                pipelines: pipelines(gpu, &shaders::ids(), &[IDS, DEPTHS]),
            })
        })
    }

    /// What cameras see of a scene, in their order.
    ///
    /// Back faces of single-sided materials are not seen, nor points where alpha, at the textures'
    /// finest level of detail, is below the material's cutoff
    /// ([`farfield_scene::AlphaMode::cutoff`]), nor what is nearer than a millionth of the distance
    /// to the scene's farthest corner. Where two surfaces are equally far, either is seen.
    ///
    /// Cheaper for many cameras at once: the CPU waits for the GPU only every 128 MB.
    ///
    /// # Errors
    ///
    /// When a picture is larger than the device takes, its memory does not suffice, or it was lost.
    ///
    /// # Panics
    ///
    /// When a camera has no pixels.
    pub fn see(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        draws: &Draws,
        cameras: &[Camera],
    ) -> Result<Vec<Seen>, GpuError> {
        let bytes = |camera: &Camera| -> u64 {
            let size = [camera.width, camera.height];
            BYTES_PER_PIXEL.iter().map(|b| bytes_of(size, *b)).sum()
        };
        let mut seen = Vec::with_capacity(cameras.len());
        for (batch, bytes) in batches(cameras, bytes) {
            seen.extend(gpu.guarded(|| self.see_batch(gpu, scene, draws, batch, bytes))?);
        }
        Ok(seen)
    }

    fn see_batch(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        draws: &Draws,
        cameras: &[Camera],
        bytes: u64,
    ) -> Result<Vec<Seen>, GpuError> {
        let mut readback = Readback::new(gpu, bytes)?;
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let mut slots = Vec::with_capacity(cameras.len());
        for same_size in cameras.chunk_by(|a, b| (a.width, a.height) == (b.width, b.height)) {
            check_size(gpu, &same_size[0])?;
            let size = [same_size[0].width, same_size[0].height];
            let textures = [IDS, DEPTHS].map(|format| target(gpu, size, format));
            let views = textures
                .each_ref()
                .map(|t| t.create_view(&Default::default()));
            let depth = depth_target(gpu, size);
            let all = |value: f64| Color {
                r: value,
                g: value,
                b: value,
                a: value,
            };
            let colors = [
                (&views[0], all(f64::from(NONE))),
                (&views[1], all(f64::INFINITY)),
            ];
            let targets = Targets {
                colors: &colors,
                depth: &depth,
                times: None,
            };
            for camera in same_size {
                let picture = scene.picture(gpu, camera, None)?;
                draw(
                    &mut encoder,
                    &self.pipelines,
                    scene,
                    draws,
                    &picture,
                    &targets,
                );
                slots.push(textures.each_ref().map(|t| readback.take(&mut encoder, t)));
            }
        }
        gpu.queue().submit([encoder.finish()]);
        let mapped = readback.read(gpu)?;
        let pictures = cameras.iter().zip(slots);
        Ok(pictures
            .map(|(camera, slots)| seen(camera, &mapped, slots))
            .collect())
    }
}

fn seen(camera: &Camera, mapped: &Mapped, [ids, depths]: [Slot; 2]) -> Seen {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut objects = Vec::with_capacity(width * height);
    let mut triangles = Vec::with_capacity(width * height);
    for row in mapped.rows(ids) {
        let row: &[[u32; 2]] = bytemuck::cast_slice(row);
        objects.extend(row.iter().map(|ids| ids[0]));
        triangles.extend(row.iter().map(|ids| ids[1]));
    }
    let depths = mapped
        .rows(depths)
        .flat_map(bytemuck::cast_slice::<u8, f32>);
    Seen {
        depth: Grid::from_cells(width, height, depths.copied().collect()),
        objects: Grid::from_cells(width, height, objects),
        triangles: Grid::from_cells(width, height, triangles),
    }
}
