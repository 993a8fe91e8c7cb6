//! Pictures of one size that are drawn again and again.

use crate::pictures::{Targets, check_side, depth_target, draw};
use crate::scene::extent;
use crate::timer::Timer;
use crate::{Display, Draws, Gpu, GpuError, GpuScene, Lighting};
use farfield_views::Camera;
use wgpu::{TextureFormat, TextureUsages, TextureView};

/// A picture of one size that stays on the GPU: its targets are kept from frame to frame.
#[derive(Debug)]
pub struct Canvas {
    size: [u32; 2],
    /// Linear light is written here.
    color: TextureView,
    /// The same texels as they are stored, in sRGB.
    pub(crate) stored: TextureView,
    depth: TextureView,
    timer: Option<Timer>,
}

impl Canvas {
    /// What canvases are made of.
    pub const FORMAT: TextureFormat = Display::OFFSCREEN;

    /// A canvas on which nothing is seen.
    ///
    /// * `size` - width and height, in pixels
    ///
    /// # Errors
    ///
    /// When it is larger than the device takes, its memory does not suffice, or it was lost.
    ///
    /// # Panics
    ///
    /// When it has no pixels.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        gpu.guarded(|| {
            check_side(gpu, size)?;
            let stored = TextureFormat::Rgba8Unorm;
            let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("a canvas"),
                size: extent(size[0], size[1]),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: Self::FORMAT,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
                view_formats: &[stored],
            });
            let view = |format: TextureFormat, usage: TextureUsages| {
                texture.create_view(&wgpu::TextureViewDescriptor {
                    format: Some(format),
                    usage: Some(usage),
                    ..Default::default()
                })
            };
            Ok(Self {
                size,
                color: view(Self::FORMAT, TextureUsages::RENDER_ATTACHMENT),
                stored: view(stored, TextureUsages::TEXTURE_BINDING),
                depth: depth_target(gpu, size),
                timer: gpu.has_timestamps().then(|| Timer::new(gpu)),
            })
        })
    }

    /// Width and height, in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Draws what a camera sees in place of what was there, as [`Display::pictures`] does, and does not
    /// wait for it.
    ///
    /// * `display` - one for [`Self::FORMAT`]
    ///
    /// # Errors
    ///
    /// When the device's memory does not suffice, or it was lost.
    ///
    /// # Panics
    ///
    /// When the camera's picture is of another size, or the display's format another.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        display: &Display,
        scene: &GpuScene,
        draws: &Draws,
        camera: &Camera,
        light: &Lighting,
    ) -> Result<(), GpuError> {
        let size = [camera.width, camera.height];
        assert_eq!(size, self.size, "the camera's picture is of another size");
        display.require_format(Self::FORMAT);
        gpu.guarded(|| {
            let picture = scene.picture(gpu, camera, Some(light))?;
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            let timer = self.timer.as_mut().filter(|timer| timer.is_free());
            let targets = Targets {
                colors: &[(&self.color, wgpu::Color::TRANSPARENT)],
                depth: &self.depth,
                times: timer.as_ref().map(|timer| timer.queries()),
            };
            draw(
                &mut encoder,
                &display.pipelines,
                scene,
                draws,
                &picture,
                &targets,
            );
            if let Some(timer) = &timer {
                timer.take(&mut encoder);
            }
            gpu.queue().submit([encoder.finish()]);
            if let Some(timer) = timer {
                timer.ask();
            }
            Ok(())
        })
    }

    /// Whether the adapter tells how long drawing takes.
    pub fn is_timed(&self) -> bool {
        self.timer.is_some()
    }

    /// Milliseconds from the first to the last thing that the GPU did for a picture that was drawn before,
    /// once for each that was timed; `None` while there is none to be told. Does not wait.
    ///
    /// # Errors
    ///
    /// When the device was lost.
    pub fn gpu_milliseconds(&mut self, gpu: &Gpu) -> Result<Option<f64>, GpuError> {
        match &mut self.timer {
            Some(timer) => gpu.guarded(|| timer.answer(gpu)),
            None => Ok(None),
        }
    }
}
