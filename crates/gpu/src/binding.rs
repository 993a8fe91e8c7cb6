//! What shaders are given, and pipelines that take nothing else: no vertices, no depth.

use wgpu::{BindGroupLayout, BindingType, BufferBindingType, ColorTargetState, PrimitiveTopology};
use wgpu::{RenderPipeline, ShaderStages};

/// Constants.
pub(crate) const UNIFORM: BindingType = buffer(BufferBindingType::Uniform);

/// A buffer as large as need be.
pub(crate) const fn storage(read_only: bool) -> BindingType {
    buffer(BufferBindingType::Storage { read_only })
}

const fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A picture.
pub(crate) const fn texture(filterable: bool) -> BindingType {
    BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

/// Bindings from number 0 on, and who sees them.
pub(crate) fn layout(
    device: &wgpu::Device,
    bindings: impl IntoIterator<Item = (ShaderStages, BindingType)>,
) -> BindGroupLayout {
    let entries = (0..).zip(bindings);
    let entries = entries.map(|(binding, (visibility, ty))| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty,
        count: None,
    });
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries.collect::<Vec<_>>(),
    })
}

/// A pipeline whose shader needs nothing but what is bound to group 0.
///
/// * `source` - WGSL with a vertex shader named `vertex`
/// * `entry` - the fragment shader's name
pub(crate) fn pipeline(
    device: &wgpu::Device,
    layout: &BindGroupLayout,
    source: String,
    entry: &str,
    topology: PrimitiveTopology,
    target: ColorTargetState,
) -> RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        bind_group_layouts: &[Some(layout)],
        ..Default::default()
    });
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
            topology,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
