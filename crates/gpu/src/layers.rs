//! What triangles touch of the layers of a layered impostor.

use crate::binding;
use crate::pictures::{check_size, target};
use crate::placed::{Drawn, Space};
use crate::readback::Readback;
use crate::scene::{bind, buffer};
use crate::timer::{Clock, milliseconds};
use crate::{Gpu, GpuError, shaders};
use bytemuck::{Pod, Zeroable};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::DVec4;
use std::ops::Range;
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferUsages, RenderPipeline, ShaderStages};

/// A triangle that may touch a texel of a layer, and give it its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Touch {
    /// Index into the scene's objects.
    pub object: u32,
    /// Index into the scene's triangles.
    pub triangle: u32,
    /// From the front.
    pub layer: u32,
    /// Row.
    pub y: u16,
    /// Column.
    pub x: u16,
}

/// What a search found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Touches {
    /// In an order that changes from time to time.
    pub list: Vec<Touch>,
    /// GPU time of the passes, where the device can tell it.
    pub gpu_milliseconds: Option<f64>,
    /// How many times all triangles were drawn, all layers not having had room at once: twice each.
    pub passes: u32,
}

/// Finds which triangles may touch which texels of layers.
///
/// Each triangle is drawn as a rectangle around the texels it may touch, once into all layers, and a
/// fragment asks exactly, but for bounds on its rounding, which layers it touches there. A first pass
/// notes for each texel of each layer the best that is sure of it, a second one lists all that this does
/// not beat.
/// Hardware's own conservative rasterisation is not used: it snaps vertices to a grid before it is
/// conservative, may leave out what is seen edge-on, and not every adapter has it.
#[derive(Debug)]
pub struct LayerSearch {
    layout: BindGroupLayout,
    sure: RenderPipeline,
    possible: RenderPipeline,
}

/// What the shaders know of all triangles.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Task {
    pub(crate) half: [f32; 2],
    pub(crate) width: u32,
    pub(crate) texels: u32,
    pub(crate) begin: u32,
    pub(crate) end: u32,
    pub(crate) layers: u32,
    pub(crate) objects: u32,
    pub(crate) corners: u32,
    pub(crate) room: u32,
}

/// The texels of the layers that are looked at together take so many bytes at most, on devices that
/// take more too.
const BATCH: u64 = 256 << 20;

/// So many touches have room at first.
const ROOM: u64 = 1 << 22;

/// What a list of touches begins with.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Header {
    /// How many there are, if they were counted.
    pub(crate) count: u32,
    /// [`IS_VAGUE`], [`IS_UNCOUNTED`], both or 0.
    pub(crate) wrong: u32,
}

/// Some triangle is known too vaguely.
pub(crate) const IS_VAGUE: u32 = 1;
/// There are more touches than numbers of 32 bits count, or hardly fewer.
pub(crate) const IS_UNCOUNTED: u32 = 2;

/// Touches are counted up to here. As many more as may be added until all that run at the same time have
/// seen it do not make the count begin anew.
pub(crate) const MOST_COUNTED: u32 = 0xf000_0000;

pub(crate) const HEADER: u64 = size_of::<Header>() as u64;

impl LayerSearch {
    /// Compiles the shaders.
    ///
    /// # Errors
    ///
    /// When the driver does not, or the device was lost.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        gpu.guarded(|| {
            let layout = layout(gpu.device());
            let pipeline = |entry| pipeline(gpu.device(), &layout, entry);
            Ok(Self {
                sure: pipeline("sure"),
                possible: pipeline("possible"),
                layout,
            })
        })
    }

    /// All triples of a triangle and a texel of a layer but those of which it is sure that the triangle
    ///
    /// - does not touch the texel's closed square within the layer's closed slab of depth, or cannot be
    ///   seen from the corners of the view cell, or
    /// - has a better one before it: an opaque front face over the texel's centre is nearer; or, where
    ///   nothing masked can touch the texel in that layer, an opaque face over the centre and not beside
    ///   it, or a front and not a back, or nearer to the centre.
    ///
    /// Masked triangles are taken as if all of them were there.
    ///
    /// * `camera` - its pixels are the texels
    /// * `borders` - ascending depths, one more than layers; the first and the last layer also hold what
    ///   lies before and behind
    /// * `cell` - corners in homogeneous coordinates of the world
    ///
    /// Memory of the GPU follows the texels of all layers, in batches of up to 256 MB, and the triangles.
    ///
    /// # Errors
    ///
    /// When a layer, the list of triangles or that of touches is larger than the device takes, its memory
    /// does not suffice, f32 is too coarse for the scene, or the device was lost.
    ///
    /// # Panics
    ///
    /// When there are fewer than two borders, or a layer has no texels or more than 65,536 a side.
    pub fn find(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        camera: &Camera,
        borders: &[f64],
        cell: &[DVec4],
    ) -> Result<Touches, GpuError> {
        let layers = borders.len().saturating_sub(1) as u32;
        assert!(layers > 0, "{} borders hold no layer", borders.len());
        assert!(
            camera.width.max(camera.height) <= 1 << 16,
            "a layer of {} x {} texels is too large",
            camera.width,
            camera.height
        );
        let mut found = Touches::default();
        gpu.guarded(|| {
            check_size(gpu, camera)?;
            let space = Space::new(scene, camera);
            let drawn = Drawn::new(scene, &space)?;
            if drawn.count == 0 {
                return Ok(());
            }
            let (stacks, mut room) = (Stacks::new(gpu, camera, layers)?, room(gpu, ROOM));
            let scene = Uploaded::new(gpu, &space, drawn, borders, cell)?;
            let (mut begin, mut size) = (0, stacks.layers);
            while begin < layers {
                let looked_at = begin..layers.min(begin + size);
                found.passes += 2;
                let batch = self.batch(gpu, &scene, &stacks, looked_at.clone(), room)?;
                found.gpu_milliseconds = sum(found.gpu_milliseconds, batch.milliseconds);
                if let Some(list) = batch.list {
                    let touch = |[texel, drawn]: &[u32; 2]| {
                        stacks.touch(&scene.drawn, begin, *texel, *drawn)
                    };
                    found.list.extend(list.iter().map(touch));
                    begin = looked_at.end;
                } else if crate::layers::room(gpu, batch.count) >= batch.count {
                    room = batch.count;
                } else if looked_at.len() > 1 {
                    size = looked_at.len() as u32 / 2;
                } else {
                    return Err(too_many(&gpu.device().limits(), batch.count));
                }
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Looks at some layers.
    fn batch(
        &self,
        gpu: &Gpu,
        scene: &Uploaded,
        stacks: &Stacks,
        layers: Range<u32>,
        room: u64,
    ) -> Result<Batch, GpuError> {
        let touches = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("touches"),
            size: HEADER + 8 * room,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let bound = scene.bound(gpu, &self.layout, stacks, &touches, layers, room as u32)?;
        let clock = gpu.has_timestamps().then(|| Clock::new(gpu));
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        encoder.clear_buffer(&stacks.best, 0, None);
        encoder.clear_buffer(&stacks.masked, 0, None);
        encoder.clear_buffer(&touches, 0, Some(HEADER));
        for (number, pipeline) in [(0, &self.sure), (1, &self.possible)] {
            let times = clock.as_ref().map(|clock| wgpu::RenderPassTimestampWrites {
                query_set: clock.queries(),
                beginning_of_pass_write_index: (number == 0).then_some(0),
                end_of_pass_write_index: (number == 1).then_some(1),
            });
            draw(
                &mut encoder,
                pipeline,
                stacks,
                &bound,
                scene.drawn.count as u32,
                times,
            );
        }
        let mut readback = Readback::new(gpu, 1024)?;
        let header = readback.take_bytes(&mut encoder, &touches, 0..HEADER);
        let times = clock.as_ref().map(|clock| {
            let times = clock.take(&mut encoder);
            readback.take_buffer(&mut encoder, times)
        });
        gpu.queue().submit([encoder.finish()]);
        let mapped = readback.read(gpu)?;
        let header: Header = bytemuck::pod_read_unaligned(mapped.bytes(header));
        let milliseconds = times.map(|times| milliseconds(gpu, mapped.bytes(times)));
        if header.wrong & IS_VAGUE != 0 {
            return Err(GpuError::Imprecise {
                what: "triangles so near to the camera's plane, or so far beside the picture"
                    .into(),
            });
        }
        let count = match header.wrong & IS_UNCOUNTED {
            0 => header.count.into(),
            _ => u64::from(u32::MAX) + 1,
        };
        let list = match count {
            0 => Some(Vec::new()),
            _ if count > room => None,
            _ => {
                let mut readback = Readback::new(gpu, 8 * count)?;
                let mut encoder = gpu.device().create_command_encoder(&Default::default());
                let list = readback.take_bytes(&mut encoder, &touches, HEADER..HEADER + 8 * count);
                gpu.queue().submit([encoder.finish()]);
                let mapped = readback.read(gpu)?;
                Some(bytemuck::pod_collect_to_vec(mapped.bytes(list)))
            }
        };
        Ok(Batch {
            count,
            list,
            milliseconds,
        })
    }
}

/// What was found in some layers.
struct Batch {
    /// More than 32 bits where they were not counted.
    count: u64,
    /// Texel and number of the triangle; `None` where there was no room for all.
    list: Option<Vec<[u32; 2]>>,
    milliseconds: Option<f64>,
}

fn sum(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.into_iter().chain(b).reduce(|a, b| a + b)
}

/// As many touches as asked for, or as the device takes.
fn room(gpu: &Gpu, wanted: u64) -> u64 {
    let (_, bytes) = most_bytes(&gpu.device().limits());
    wanted.min((bytes - HEADER) / 8).min(MOST_COUNTED.into())
}

/// The limit of what a buffer that shaders write to may take, and its bytes.
fn most_bytes(limits: &wgpu::Limits) -> (&'static str, u64) {
    let bound = limits.max_storage_buffer_binding_size;
    match bound <= limits.max_buffer_size {
        true => ("max_storage_buffer_binding_size", bound),
        false => ("max_buffer_size", limits.max_buffer_size),
    }
}

/// Why a list of more touches of one layer than there can be room for is refused.
fn too_many(limits: &wgpu::Limits, count: u64) -> GpuError {
    let (limit, allowed) = most_bytes(limits);
    let bytes = HEADER + 8 * count;
    match bytes > allowed {
        true => GpuError::TooLarge {
            what: "the list of what touches a layer, in bytes,".into(),
            size: bytes,
            limit,
            allowed,
        },
        false => GpuError::TooLarge {
            what: "the number of what touches a layer".into(),
            size: count,
            limit: "greatest count",
            allowed: MOST_COUNTED.into(),
        },
    }
}

/// The texels of as many layers as are looked at together.
struct Stacks {
    layers: u32,
    width: u32,
    /// Of a layer.
    texels: u32,
    best: Buffer,
    masked: Buffer,
    /// Fragments are wanted, not what they would draw; a pass must have some target.
    target: wgpu::TextureView,
}

impl Stacks {
    fn new(gpu: &Gpu, camera: &Camera, layers: u32) -> Result<Self, GpuError> {
        let texels = u64::from(camera.width) * u64::from(camera.height);
        let what = || {
            format!(
                "a layer of {} x {} texels, in bytes,",
                camera.width, camera.height
            )
        };
        let (limit, bytes) = most_bytes(&gpu.device().limits());
        gpu.check_limit(what, 4 * texels, limit, |_| bytes)?;
        let most = (bytes.min(BATCH) / (4 * texels)).max(1);
        // About as many layers each time.
        let batches = u64::from(layers).div_ceil(most);
        let together = u64::from(layers).div_ceil(batches);
        let buffer = |what, words: u64| {
            gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size: 4 * words,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let target = target(gpu, [camera.width, camera.height], TARGET);
        Ok(Self {
            layers: together as u32,
            width: camera.width,
            texels: texels as u32,
            best: buffer("the best that is sure", together * texels),
            masked: buffer("what is masked", (together * texels).div_ceil(32)),
            target: target.create_view(&Default::default()),
        })
    }

    /// What a touch of a batch that begins with a layer is of the scene.
    fn touch(&self, drawn: &Drawn, begin: u32, texel: u32, number: u32) -> Touch {
        let (layer, texel) = (begin + texel / self.texels, texel % self.texels);
        let [object, triangle] = drawn.ids_of(number);
        Touch {
            object,
            triangle,
            layer,
            y: (texel / self.width) as u16,
            x: (texel % self.width) as u16,
        }
    }
}

const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// What is drawn, on the GPU.
struct Uploaded {
    drawn: Drawn,
    half: [f32; 2],
    layers: u32,
    /// How many.
    corners: u32,
    /// Positions, triangles, objects, corners of the cell, borders.
    buffers: [Buffer; 5],
}

impl Uploaded {
    fn new(
        gpu: &Gpu,
        space: &Space,
        drawn: Drawn,
        borders: &[f64],
        cell: &[DVec4],
    ) -> Result<Self, GpuError> {
        let corners: Vec<[f32; 4]> = cell.iter().map(|corner| space.corner(*corner)).collect();
        // Shaders need not know infinity.
        let bounded = |border: &f64| (border / space.unit).clamp(-1e30, 1e30) as f32;
        let borders: Vec<f32> = borders.iter().map(bounded).collect();
        let storage = BufferUsages::STORAGE;
        Ok(Self {
            half: space.half().as_vec2().to_array(),
            layers: borders.len() as u32 - 1,
            corners: corners.len() as u32,
            buffers: [
                buffer(gpu, "positions", storage, &drawn.positions)?,
                buffer(gpu, "triangles", storage, &drawn.triangles)?,
                buffer(gpu, "the objects", storage, &drawn.objects)?,
                buffer(gpu, "the view cell", storage, &corners)?,
                buffer(gpu, "borders", storage, &borders)?,
            ],
            drawn,
        })
    }

    fn bound(
        &self,
        gpu: &Gpu,
        layout: &BindGroupLayout,
        stacks: &Stacks,
        touches: &Buffer,
        looked_at: Range<u32>,
        room: u32,
    ) -> Result<BindGroup, GpuError> {
        let task = Task {
            half: self.half,
            width: stacks.width,
            texels: stacks.texels,
            begin: looked_at.start,
            end: looked_at.end,
            layers: self.layers,
            objects: self.drawn.objects.len() as u32,
            corners: self.corners,
            room,
        };
        let task = buffer(gpu, "the task", BufferUsages::UNIFORM, &[task])?;
        let [positions, triangles, objects, corners, borders] = &self.buffers;
        let (best, masked) = (&stacks.best, &stacks.masked);
        let buffers = [
            &task, positions, triangles, objects, corners, borders, best, masked, touches,
        ];
        Ok(bind(gpu, layout, &buffers.map(Buffer::as_entire_binding)))
    }
}

fn layout(device: &wgpu::Device) -> BindGroupLayout {
    let vertex = (ShaderStages::VERTEX, binding::storage(true));
    let read = (ShaderStages::FRAGMENT, binding::storage(true));
    let written = (ShaderStages::FRAGMENT, binding::storage(false));
    let uniform = (ShaderStages::VERTEX_FRAGMENT, binding::UNIFORM);
    let bindings = [
        uniform, vertex, vertex, vertex, vertex, read, written, written, written,
    ];
    binding::layout(device, bindings)
}

fn pipeline(device: &wgpu::Device, layout: &BindGroupLayout, entry: &str) -> RenderPipeline {
    let target = wgpu::ColorTargetState {
        format: TARGET,
        blend: None,
        write_mask: wgpu::ColorWrites::empty(),
    };
    let strips = wgpu::PrimitiveTopology::TriangleStrip;
    binding::pipeline(device, layout, shaders::layers(), entry, strips, target)
}

fn draw(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &RenderPipeline,
    stacks: &Stacks,
    bound: &BindGroup,
    count: u32,
    times: Option<wgpu::RenderPassTimestampWrites<'_>>,
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &stacks.target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Discard,
            },
        })],
        depth_stencil_attachment: None,
        timestamp_writes: times,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bound, &[]);
    // A rectangle each.
    pass.draw(0..4, 0..count);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However many touches there are, and whatever a device takes: where there is no room for them, they
    /// are refused with the limit that they are above.
    #[test]
    fn what_has_no_room_is_above_a_limit() {
        for (bound, buffer) in [(1 << 27, 1 << 28), (1 << 28, 1 << 27), (1 << 40, 1 << 40)] {
            let limits = wgpu::Limits {
                max_storage_buffer_binding_size: bound,
                max_buffer_size: buffer,
                ..Default::default()
            };
            let most = (bound.min(buffer) - HEADER) / 8;
            for count in [most.min(MOST_COUNTED.into()) + 1, u64::from(u32::MAX) + 1] {
                let GpuError::TooLarge {
                    size,
                    limit,
                    allowed,
                    ..
                } = too_many(&limits, count)
                else {
                    panic!("no limit is told")
                };
                assert!(size > allowed, "{size} is not more than {allowed}");
                assert_eq!(limit == "max_buffer_size", buffer < bound);
            }
        }
    }
}
