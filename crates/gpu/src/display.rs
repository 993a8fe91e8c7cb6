//! Pictures of scenes.

use crate::pictures::{Targets, check_size, depth_target, draw, pipelines, target};
use crate::readback::{Readback, batches, bytes_of};
use crate::scene::GpuScene;
use crate::timer::{Clock, milliseconds};
use crate::{Draws, Gpu, GpuError, Lighting, geometry::PIPELINES, shaders};
use farfield_grid::Grid;
use farfield_views::Camera;
use wgpu::{RenderPipeline, TextureFormat};

/// What a camera sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// RGBA, colours in sRGB; alpha is 255 where something is seen, else all is 0.
    pub pixels: Grid<[u8; 4]>,
    /// Milliseconds from the first to the last thing that the GPU did for it; `None` where the
    /// adapter does not tell.
    pub gpu_milliseconds: Option<f64>,
}

/// Draws scenes in colour.
#[derive(Debug)]
pub struct Display {
    pub(crate) pipelines: [RenderPipeline; PIPELINES],
    format: TextureFormat,
}

impl Display {
    /// What pictures that are read back are made of.
    pub const OFFSCREEN: TextureFormat = TextureFormat::Rgba8UnormSrgb;

    /// Compiles the shaders for targets of a format, which should be an sRGB one: colours are
    /// written as linear light.
    ///
    /// # Errors
    ///
    /// When the driver does not, or the device was lost.
    pub fn new(gpu: &Gpu, format: TextureFormat) -> Result<Self, GpuError> {
        gpu.guarded(|| {
            Ok(Self {
                pipelines: pipelines(gpu, &shaders::display(), &[format]),
                format,
            })
        })
    }

    /// Pictures of what cameras see, in their order.
    ///
    /// Lit materials show diffuse light only, unlit ones their base colour; textures are filtered
    /// between levels of detail; masks and back faces are as [`crate::IdBuffers::see`] has them.
    ///
    /// # Errors
    ///
    /// When a picture is larger than the device takes, its memory does not suffice, or it was lost.
    ///
    /// # Panics
    ///
    /// When a camera has no pixels, or the display's format is not [`Self::OFFSCREEN`].
    pub fn pictures(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        draws: &Draws,
        cameras: &[Camera],
        light: &Lighting,
    ) -> Result<Vec<Picture>, GpuError> {
        self.require_format(Self::OFFSCREEN);
        let bytes = |camera: &Camera| {
            // And a row for its times.
            bytes_of([camera.width, camera.height], 4) + bytes_of([1, 1], 4)
        };
        let mut pictures = Vec::with_capacity(cameras.len());
        for (batch, bytes) in batches(cameras, bytes) {
            pictures.extend(gpu.guarded(|| self.batch(gpu, scene, draws, batch, light, bytes))?);
        }
        Ok(pictures)
    }

    pub(crate) fn require_format(&self, format: TextureFormat) {
        assert_eq!(self.format, format, "the display is for another format");
    }

    fn batch(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        draws: &Draws,
        cameras: &[Camera],
        light: &Lighting,
        bytes: u64,
    ) -> Result<Vec<Picture>, GpuError> {
        let mut readback = Readback::new(gpu, bytes)?;
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let clock = gpu.has_timestamps().then(|| Clock::new(gpu));
        let mut slots = Vec::with_capacity(cameras.len());
        for same_size in cameras.chunk_by(|a, b| (a.width, a.height) == (b.width, b.height)) {
            check_size(gpu, &same_size[0])?;
            let size = [same_size[0].width, same_size[0].height];
            let color = target(gpu, size, self.format);
            let view = color.create_view(&Default::default());
            let depth = depth_target(gpu, size);
            let targets = Targets {
                colors: &[(&view, wgpu::Color::TRANSPARENT)],
                depth: &depth,
                times: clock.as_ref().map(Clock::queries),
            };
            for camera in same_size {
                let picture = scene.picture(gpu, camera, Some(light))?;
                draw(
                    &mut encoder,
                    &self.pipelines,
                    scene,
                    draws,
                    &picture,
                    &targets,
                );
                let pixels = readback.take(&mut encoder, &color);
                let times = clock.as_ref().map(|clock| {
                    let times = clock.take(&mut encoder);
                    readback.take_buffer(&mut encoder, times)
                });
                slots.push((pixels, times));
            }
        }
        gpu.queue().submit([encoder.finish()]);
        let mapped = readback.read(gpu)?;
        let picture = |(camera, (pixels, times)): (&Camera, (_, Option<_>))| {
            let rows = mapped
                .rows(pixels)
                .flat_map(bytemuck::cast_slice::<u8, [u8; 4]>);
            let times = times.map(|slot| milliseconds(gpu, mapped.bytes(slot)));
            Picture {
                pixels: Grid::from_cells(
                    camera.width as usize,
                    camera.height as usize,
                    rows.copied().collect(),
                ),
                gpu_milliseconds: times,
            }
        };
        Ok(cameras.iter().zip(slots).map(picture).collect())
    }
}
