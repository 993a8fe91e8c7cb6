//! What all pictures have in common: pipelines, targets and passes.

use crate::geometry::{Draws, PIPELINES};
use crate::scene::{GpuScene, extent};
use crate::{Gpu, GpuError};
use farfield_views::Camera;
use wgpu::{CommandEncoder, RenderPipeline, Texture, TextureFormat, TextureUsages, TextureView};

const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// The pipelines of a shader, as [`crate::geometry::pipeline_of`] numbers them.
pub(crate) fn pipelines(
    gpu: &Gpu,
    source: &str,
    targets: &[TextureFormat],
) -> [RenderPipeline; PIPELINES] {
    let device = gpu.device();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layouts = &gpu.layouts;
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        bind_group_layouts: &[
            Some(&layouts.scene),
            Some(&layouts.picture),
            Some(&layouts.material),
        ],
        ..Default::default()
    });
    let targets: Vec<_> = targets
        .iter()
        .map(|format| Some((*format).into()))
        .collect();
    std::array::from_fn(|number| {
        let [masked, double_sided, mirrored] = [4, 2, 1].map(|bit| number & bit != 0);
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                front_face: match mirrored {
                    true => wgpu::FrontFace::Cw,
                    false => wgpu::FrontFace::Ccw,
                },
                cull_mode: (!double_sided).then_some(wgpu::Face::Back),
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                // Depth is reversed.
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(if masked { "masked" } else { "opaque" }),
                compilation_options: Default::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    })
}

/// A texture to draw into and to be read back.
pub(crate) fn target(gpu: &Gpu, size: [u32; 2], format: TextureFormat) -> Texture {
    let usage = match format == DEPTH {
        true => TextureUsages::RENDER_ATTACHMENT,
        false => TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
    };
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: extent(size[0], size[1]),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// Depths to draw with.
pub(crate) fn depth_target(gpu: &Gpu, size: [u32; 2]) -> TextureView {
    target(gpu, size, DEPTH).create_view(&Default::default())
}

/// An error if a camera's picture has more pixels along a side than the device takes.
///
/// # Panics
///
/// When it has none.
pub(crate) fn check_size(gpu: &Gpu, camera: &Camera) -> Result<(), GpuError> {
    check_side(gpu, [camera.width, camera.height])
}

/// An error if a picture has more pixels along a side than the device takes.
///
/// # Panics
///
/// When it has none.
pub(crate) fn check_side(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<(), GpuError> {
    assert!(
        width > 0 && height > 0,
        "a picture of {width} x {height} pixels is empty"
    );
    let what = || format!("the longer side of a picture of {width} x {height} pixels");
    let side = u64::from(width.max(height));
    gpu.check_limit(what, side, "max_texture_dimension_2d", |limits| {
        limits.max_texture_dimension_2d.into()
    })
}

/// Where a pass draws to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Targets<'a> {
    /// With what is where nothing is seen.
    pub(crate) colors: &'a [(&'a TextureView, wgpu::Color)],
    pub(crate) depth: &'a TextureView,
    /// Two queries that are given the times at which the pass begins and ends.
    pub(crate) times: Option<&'a wgpu::QuerySet>,
}

/// Draws a picture.
pub(crate) fn draw(
    encoder: &mut CommandEncoder,
    pipelines: &[RenderPipeline; PIPELINES],
    scene: &GpuScene,
    draws: &Draws,
    picture: &wgpu::BindGroup,
    targets: &Targets<'_>,
) {
    let colors = targets.colors.iter().map(|(view, nothing)| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(*nothing),
                store: wgpu::StoreOp::Store,
            },
        })
    });
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: &colors.collect::<Vec<_>>(),
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: targets.depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        timestamp_writes: targets
            .times
            .map(|query_set| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: Some(1),
            }),
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_bind_group(0, &scene.geometry, &[]);
    pass.set_bind_group(1, picture, &[]);
    pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
    let mut bound = (usize::MAX, u32::MAX);
    for run in &draws.runs {
        if bound.0 != run.pipeline {
            pass.set_pipeline(&pipelines[run.pipeline]);
        }
        if bound.1 != run.material {
            pass.set_bind_group(2, &scene.materials[run.material as usize], &[]);
        }
        bound = (run.pipeline, run.material);
        let indices = 3 * run.triangles.start..3 * run.triangles.end;
        pass.draw_indexed(indices, 0, run.instances.clone());
    }
}
