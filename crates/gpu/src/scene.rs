//! A scene on the GPU.

use crate::binding;
use crate::camera::{Lighting, Placement, View, near, placement};
use crate::geometry::{Draws, Geometry, geometry, restricted};
use crate::levels::{Encoding, coarser_levels};
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use farfield_scene::{Filter, Image, Scene, Texture, Wrap};
use farfield_views::Camera;
use glam::{DAffine3, DVec3};
use std::collections::BTreeMap;
use std::ops::Range;
use wgpu::{BindGroup, BindGroupLayout, BufferUsages, ShaderStages};

/// A scene on the GPU: triangles, objects, materials and textures, uploaded once.
#[derive(Debug)]
pub struct GpuScene {
    pub(crate) geometry: BindGroup,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) materials: Vec<BindGroup>,
    sorted: Geometry,
    /// Of each instance.
    world_from_mesh: Vec<DAffine3>,
    bounds: Option<[DVec3; 2]>,
}

/// An object as shaders know it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Instance {
    /// The mesh's axes in the world.
    pub(crate) x: [f32; 3],
    pub(crate) object: u32,
    pub(crate) y: [f32; 3],
    /// 1 where triangles turn their winding.
    pub(crate) mirrored: u32,
    pub(crate) z: [f32; 3],
    pub(crate) padding: u32,
}

/// A material as shaders know it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Material {
    pub(crate) base_color: [f32; 4],
    pub(crate) emissive: [f32; 3],
    pub(crate) cutoff: f32,
    pub(crate) normal_scale: f32,
    pub(crate) flags: u32,
    /// How the base colour's texture goes on, along u and v.
    pub(crate) wrap: [u32; 2],
}

/// Bits of [`Material::flags`].
pub(crate) const UNLIT: u32 = 1;
pub(crate) const DOUBLE_SIDED: u32 = 2;
pub(crate) const BENT_NORMAL: u32 = 4;
pub(crate) const NEAREST: u32 = 8;

/// Numbers in [`Material::wrap`].
pub(crate) const REPEAT: u32 = 0;
pub(crate) const MIRRORED_REPEAT: u32 = 1;
pub(crate) const CLAMP_TO_EDGE: u32 = 2;

/// Floating-point numbers per vertex besides its position: normal, uv, colour.
pub(crate) const ATTRIBUTES: usize = 9;

/// What pipelines are given: the scene, the picture, the material.
#[derive(Debug)]
pub(crate) struct Layouts {
    pub(crate) scene: BindGroupLayout,
    pub(crate) picture: BindGroupLayout,
    pub(crate) material: BindGroupLayout,
}

impl Layouts {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let (uniform, storage) = (binding::UNIFORM, binding::storage(true));
        let texture = binding::texture(true);
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let layout = |bindings: &[wgpu::BindingType]| {
            let seen = bindings
                .iter()
                .map(|ty| (ShaderStages::VERTEX_FRAGMENT, *ty));
            binding::layout(device, seen)
        };
        Self {
            scene: layout(&[storage; 5]),
            picture: layout(&[uniform, storage]),
            material: layout(&[
                uniform, texture, sampler, texture, sampler, texture, sampler,
            ]),
        }
    }
}

impl GpuScene {
    /// Uploads a scene, with levels of detail of its textures.
    ///
    /// # Errors
    ///
    /// When an image or an array is larger than the device takes, its memory does not suffice, or
    /// it was lost.
    ///
    /// # Panics
    ///
    /// When the scene's arrays do not fit together ([`Scene::check`]).
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, GpuError> {
        gpu.guarded(|| {
            let sorted = geometry(scene);
            let world_from_mesh = sorted.instances.iter().map(|instance| instance.object);
            let world_from_mesh =
                world_from_mesh.map(|object| scene.objects[object as usize].world_from_mesh);
            Ok(Self {
                geometry: upload_geometry(gpu, scene, &sorted)?,
                indices: buffer(gpu, "indices", BufferUsages::INDEX, &sorted.indices)?,
                materials: upload_materials(gpu, scene)?,
                world_from_mesh: world_from_mesh.collect(),
                bounds: scene.bounds(),
                sorted,
            })
        })
    }

    /// All of the scene, in one draw call for each pair of a mesh and one of its materials, and
    /// another one for objects that mirror it.
    pub fn all(&self) -> Draws {
        let runs = self.sorted.runs.clone();
        Draws { runs }
    }

    /// The triangles of some ranges, in all objects that show them; a draw call for each range, and
    /// more where it holds several meshes or materials.
    ///
    /// * `ranges` - of indices into the scene's triangles, ascending and disjoint
    ///
    /// # Panics
    ///
    /// When ranges are not ascending and disjoint.
    pub fn restricted(&self, ranges: &[Range<u32>]) -> Draws {
        let ascending = |pair: &[Range<u32>]| pair[0].end <= pair[1].start;
        assert!(
            ranges.windows(2).all(ascending) && ranges.iter().all(|r| r.start <= r.end),
            "ranges of triangles are not ascending and disjoint"
        );
        restricted(&self.sorted.runs, &self.sorted.triangles, ranges)
    }

    /// What a picture needs: its constants and where each instance stands.
    pub(crate) fn picture(
        &self,
        gpu: &Gpu,
        camera: &Camera,
        light: Option<&Lighting>,
    ) -> Result<BindGroup, GpuError> {
        let view = View::new(near(camera, self.bounds), light);
        let placements = self.sorted.instances.iter().zip(&self.world_from_mesh);
        let placements: Vec<Placement> = placements
            .map(|(instance, object)| placement(camera, object, instance.middle))
            .collect();
        let view = buffer(gpu, "the view", BufferUsages::UNIFORM, &[view])?;
        let placements = buffer(gpu, "the objects", BufferUsages::STORAGE, &placements)?;
        Ok(bind(
            gpu,
            &gpu.layouts.picture,
            &[view.as_entire_binding(), placements.as_entire_binding()],
        ))
    }
}

fn upload_geometry(gpu: &Gpu, scene: &Scene, sorted: &Geometry) -> Result<BindGroup, GpuError> {
    let positions = sorted.vertices.iter().map(|vertex| {
        let position = scene.positions[vertex.index as usize].as_dvec3();
        (position - vertex.middle).as_vec3().to_array()
    });
    let attributes = sorted.vertices.iter().map(|vertex| {
        let vertex = vertex.index as usize;
        let (n, uv, c) = (
            scene.normals[vertex],
            scene.uvs[vertex],
            scene.colors[vertex],
        );
        [n.x, n.y, n.z, uv.x, uv.y, c.x, c.y, c.z, c.w]
    });
    let instances = sorted.instances.iter().map(|instance| {
        let object = &scene.objects[instance.object as usize];
        let axes = object.world_from_mesh.matrix3;
        Instance {
            x: axes.x_axis.as_vec3().into(),
            object: instance.object,
            y: axes.y_axis.as_vec3().into(),
            mirrored: u32::from(object.is_mirrored()),
            z: axes.z_axis.as_vec3().into(),
            padding: 0,
        }
    });
    let storage = BufferUsages::STORAGE;
    let positions = buffer(gpu, "positions", storage, &positions.collect::<Vec<_>>())?;
    let attributes: Vec<[f32; ATTRIBUTES]> = attributes.collect();
    let attributes = buffer(gpu, "vertices", storage, &attributes)?;
    let triangles = buffer(gpu, "triangles", storage, &sorted.triangles)?;
    let instances = buffer(gpu, "the objects", storage, &instances.collect::<Vec<_>>())?;
    let corners = buffer(gpu, "corners", storage, &sorted.corners)?;
    let buffers = [&positions, &attributes, &triangles, &instances, &corners];
    Ok(bind(
        gpu,
        &gpu.layouts.scene,
        &buffers.map(|buffer| buffer.as_entire_binding()),
    ))
}

fn upload_materials(gpu: &Gpu, scene: &Scene) -> Result<Vec<BindGroup>, GpuError> {
    let white = Image {
        name: "white".into(),
        width: 1,
        height: 1,
        texels: vec![[255; 4]],
    };
    let white = upload_image(gpu, &white, Encoding::Linear, false)?;
    let mut views = BTreeMap::new();
    let plain = Texture {
        image: 0,
        wrap: [Wrap::ClampToEdge; 2],
        filter: Filter::Nearest,
    };
    let mut materials = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let textures = [
            (material.base_color_texture, Encoding::Srgb),
            (material.normal_texture, Encoding::Linear),
            (material.emissive_texture, Encoding::Srgb),
        ];
        for (texture, encoding) in textures {
            let Some(texture) = texture else { continue };
            let image = scene.textures[texture as usize].image;
            if let std::collections::btree_map::Entry::Vacant(place) =
                views.entry((image, encoding == Encoding::Srgb))
            {
                let minified = |t: &Texture| t.image == image && t.filter == Filter::Mipmapped;
                let minified = scene.textures.iter().any(minified);
                let image = &scene.images[image as usize];
                place.insert(upload_image(gpu, image, encoding, minified)?);
            }
        }
        let shown = textures.map(|(texture, encoding)| match texture {
            Some(texture) => {
                let texture = &scene.textures[texture as usize];
                (
                    &views[&(texture.image, encoding == Encoding::Srgb)],
                    texture,
                )
            }
            None => (&white, &plain),
        });
        let constants = constants(material, shown[0].1);
        let constants = buffer(gpu, "a material", BufferUsages::UNIFORM, &[constants])?;
        let samplers = shown.map(|(_, texture)| sampler(gpu, texture));
        let texture = |i: usize| wgpu::BindingResource::TextureView(shown[i].0);
        let sampler = |i: usize| wgpu::BindingResource::Sampler(&samplers[i]);
        let resources = [
            constants.as_entire_binding(),
            texture(0),
            sampler(0),
            texture(1),
            sampler(1),
            texture(2),
            sampler(2),
        ];
        materials.push(bind(gpu, &gpu.layouts.material, &resources));
    }
    Ok(materials)
}

fn constants(material: &farfield_scene::Material, base_color: &Texture) -> Material {
    let flag = |flag: u32, is_set: bool| if is_set { flag } else { 0 };
    Material {
        base_color: material.base_color.into(),
        emissive: material.emissive.into(),
        cutoff: material.alpha.cutoff().unwrap_or(0.0),
        normal_scale: material.normal_scale,
        flags: flag(UNLIT, material.unlit)
            | flag(DOUBLE_SIDED, material.double_sided)
            | flag(BENT_NORMAL, material.normal_texture.is_some())
            | flag(NEAREST, base_color.filter == Filter::Nearest),
        wrap: base_color.wrap.map(|wrap| match wrap {
            Wrap::Repeat => REPEAT,
            Wrap::MirroredRepeat => MIRRORED_REPEAT,
            Wrap::ClampToEdge => CLAMP_TO_EDGE,
        }),
    }
}

fn upload_image(
    gpu: &Gpu,
    image: &Image,
    encoding: Encoding,
    minified: bool,
) -> Result<wgpu::TextureView, GpuError> {
    let what = || {
        let (width, height) = (image.width, image.height);
        format!(
            "the longer side of image {:?}, {width} x {height} texels,",
            image.name
        )
    };
    let side = image.width.max(image.height);
    gpu.check_limit(what, side.into(), "max_texture_dimension_2d", |limits| {
        limits.max_texture_dimension_2d.into()
    })?;
    let coarser = match minified {
        true => coarser_levels(image, encoding),
        false => Vec::new(),
    };
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(&image.name),
        size: extent(image.width, image.height),
        mip_level_count: 1 + coarser.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: match encoding {
            Encoding::Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
            Encoding::Linear => wgpu::TextureFormat::Rgba8Unorm,
        },
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (level, image) in (0..).zip(std::iter::once(image).chain(&coarser)) {
        let target = wgpu::TexelCopyTextureInfo {
            mip_level: level,
            ..texture.as_image_copy()
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * image.width),
            rows_per_image: None,
        };
        let size = extent(image.width, image.height);
        let texels = bytemuck::cast_slice(&image.texels);
        gpu.queue().write_texture(target, texels, layout, size);
    }
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}

fn sampler(gpu: &Gpu, texture: &Texture) -> wgpu::Sampler {
    let [u, v] = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
    });
    let filter = match texture.filter {
        Filter::Nearest => wgpu::FilterMode::Nearest,
        Filter::Linear | Filter::Mipmapped => wgpu::FilterMode::Linear,
    };
    // Several textures may show the same image, and not all its coarser levels.
    let (between, coarsest) = match texture.filter {
        Filter::Mipmapped => (wgpu::MipmapFilterMode::Linear, 32.0),
        Filter::Nearest | Filter::Linear => (wgpu::MipmapFilterMode::Nearest, 0.0),
    };
    gpu.device().create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: u,
        address_mode_v: v,
        mag_filter: filter,
        min_filter: filter,
        mipmap_filter: between,
        lod_max_clamp: coarsest,
        ..Default::default()
    })
}

/// A buffer with some content; of one zero where there is none, as buffers have a size.
pub(crate) fn buffer<T: Pod>(
    gpu: &Gpu,
    what: &str,
    usage: BufferUsages,
    content: &[T],
) -> Result<wgpu::Buffer, GpuError> {
    let size = size_of::<T>().max(size_of_val(content)) as u64;
    gpu.check_limit(
        || format!("the size of {what} in bytes"),
        size,
        "max_storage_buffer_binding_size",
        |limits| limits.max_storage_buffer_binding_size,
    )?;
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some(what),
        size,
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue()
        .write_buffer(&buffer, 0, bytemuck::cast_slice(content));
    Ok(buffer)
}

pub(crate) fn bind(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> BindGroup {
    let entries = (0..).zip(resources);
    let entries = entries.map(|(binding, resource)| wgpu::BindGroupEntry {
        binding,
        resource: resource.clone(),
    });
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &entries.collect::<Vec<_>>(),
    })
}

pub(crate) fn extent(width: u32, height: u32) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}
