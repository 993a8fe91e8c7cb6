//! Two pictures of the same size, seen as one.

use crate::binding;
use crate::canvas::Canvas;
use crate::pictures::check_side;
use crate::readback::{Readback, bytes_of};
use crate::scene::{bind, buffer, extent};
use crate::{Gpu, GpuError, shaders};
use bytemuck::{Pod, Zeroable};
use farfield_grid::Grid;
use wgpu::{BindGroupLayout, BufferUsages, RenderPipeline, Texture, TextureFormat, TextureUsages};

/// What of two pictures is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compared {
    /// The first.
    First,
    /// The second.
    Second,
    /// The first on the left, the second on the right.
    Split {
        /// The column between both, which is white.
        border: u32,
    },
    /// The magnitude of the difference in each channel, in sRGB.
    Difference {
        /// How many times as strong.
        gain: f32,
    },
}

/// As shaders have it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Shown {
    pub(crate) background: [f32; 3],
    pub(crate) mode: u32,
    pub(crate) gain: f32,
    pub(crate) border: i32,
    padding: [u32; 2],
}

/// Numbers in [`Shown::mode`].
pub(crate) const FIRST: u32 = 0;
pub(crate) const SECOND: u32 = 1;
pub(crate) const SPLIT: u32 = 2;
pub(crate) const DIFFERENCE: u32 = 3;

/// Shows two canvases as one picture.
#[derive(Debug)]
pub struct Comparison {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
}

impl Comparison {
    /// What its pictures are made of: sRGB as it is stored.
    pub const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

    /// Compiles the shaders.
    ///
    /// # Errors
    ///
    /// When the driver does not, or the device was lost.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        gpu.guarded(|| {
            let device = gpu.device();
            let layout = layout(device);
            let pipeline = pipeline(device, &layout);
            Ok(Self { pipeline, layout })
        })
    }

    /// A texture for pictures of a size, which can be bound to be shown elsewhere.
    ///
    /// # Errors
    ///
    /// When it is larger than the device takes, its memory does not suffice, or it was lost.
    ///
    /// # Panics
    ///
    /// When it has no pixels.
    pub fn target(gpu: &Gpu, size: [u32; 2]) -> Result<Texture, GpuError> {
        gpu.guarded(|| {
            check_side(gpu, size)?;
            Ok(gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("a comparison"),
                size: extent(size[0], size[1]),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: Self::FORMAT,
                usage: TextureUsages::RENDER_ATTACHMENT
                    | TextureUsages::TEXTURE_BINDING
                    | TextureUsages::COPY_SRC,
                view_formats: &[],
            }))
        })
    }

    /// Draws what of two canvases is seen, and does not wait for it.
    ///
    /// * `background` - sRGB from 0 to 1, where nothing is seen
    /// * `target` - of the canvases' size, as [`Self::target`] makes it
    ///
    /// # Errors
    ///
    /// When the target is of another format, the device's memory does not suffice, or it was lost.
    ///
    /// # Panics
    ///
    /// When sizes differ.
    pub fn draw(
        &self,
        gpu: &Gpu,
        canvases: [&Canvas; 2],
        seen: Compared,
        background: [f32; 3],
        target: &Texture,
    ) -> Result<(), GpuError> {
        let size = [target.width(), target.height()];
        assert!(
            canvases.iter().all(|canvas| canvas.size() == size),
            "canvases and target are of different sizes"
        );
        gpu.guarded(|| {
            let shown = constants(seen, background);
            let shown = buffer(gpu, "what is seen", BufferUsages::UNIFORM, &[shown])?;
            let resources = [
                shown.as_entire_binding(),
                wgpu::BindingResource::TextureView(&canvases[0].stored),
                wgpu::BindingResource::TextureView(&canvases[1].stored),
            ];
            let bound = bind(gpu, &self.layout, &resources);
            let view = target.create_view(&Default::default());
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: None,
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: None,
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &bound, &[]);
            pass.draw(0..3, 0..1);
            drop(pass);
            gpu.queue().submit([encoder.finish()]);
            Ok(())
        })
    }

    /// What was drawn into a target: RGBA, colours in sRGB, all opaque. Waits for it.
    ///
    /// # Errors
    ///
    /// When the device's memory does not suffice, or it was lost.
    pub fn read(gpu: &Gpu, target: &Texture) -> Result<Grid<[u8; 4]>, GpuError> {
        gpu.guarded(|| {
            let (width, height) = (target.width(), target.height());
            let mut readback = Readback::new(gpu, bytes_of([width, height], 4))?;
            let mut encoder = gpu.device().create_command_encoder(&Default::default());
            let slot = readback.take(&mut encoder, target);
            gpu.queue().submit([encoder.finish()]);
            let mapped = readback.read(gpu)?;
            let rows = mapped.rows(slot);
            let cells = rows.flat_map(bytemuck::cast_slice::<u8, [u8; 4]>).copied();
            let (width, height) = (width as usize, height as usize);
            Ok(Grid::from_cells(width, height, cells.collect()))
        })
    }
}

fn constants(seen: Compared, background: [f32; 3]) -> Shown {
    let shown = |mode| Shown {
        background,
        mode,
        gain: 0.0,
        border: 0,
        padding: [0; 2],
    };
    match seen {
        Compared::First => shown(FIRST),
        Compared::Second => shown(SECOND),
        Compared::Split { border } => Shown {
            border: i32::try_from(border).unwrap_or(i32::MAX),
            ..shown(SPLIT)
        },
        Compared::Difference { gain } => Shown {
            gain,
            ..shown(DIFFERENCE)
        },
    }
}

fn layout(device: &wgpu::Device) -> BindGroupLayout {
    let canvas = binding::texture(false);
    let bindings = [binding::UNIFORM, canvas, canvas];
    let bindings = bindings.map(|ty| (wgpu::ShaderStages::FRAGMENT, ty));
    binding::layout(device, bindings)
}

fn pipeline(device: &wgpu::Device, layout: &BindGroupLayout) -> RenderPipeline {
    let (source, target) = (shaders::comparison(), Comparison::FORMAT.into());
    let triangles = wgpu::PrimitiveTopology::TriangleList;
    binding::pipeline(device, layout, source, "fragment", triangles, target)
}
