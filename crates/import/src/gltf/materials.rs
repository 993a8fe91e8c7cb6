//! Translates materials, textures and samplers.

use super::GltfError;
use super::document::{self, Document, TextureInfo};
use crate::notes::{Note, Notes};
use farfield_scene::{AlphaMode, Filter, Material, Texture, Wrap};
use glam::{DAffine2, DVec2, Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, BTreeSet};

/// Materials as a scene has them, and what the readers of meshes and images must know.
#[derive(Debug, Default)]
pub(crate) struct Looks {
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    /// The document's image behind each of the scene's images.
    pub(crate) images: Vec<usize>,
    /// The scene's material for each of the document's that is used; `None` is glTF's default.
    pub(crate) slots: BTreeMap<Option<usize>, u32>,
    /// For each of the scene's materials.
    pub(crate) uv_sources: Vec<UvSource>,
}

/// Which texture coordinates a material uses, and how it moves them.
///
/// The transform is kept as bits, so that sources can be compared and sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct UvSource {
    pub(crate) textured: bool,
    pub(crate) set: u32,
    /// Offset, rotation and scale.
    transform: Option<[u64; 5]>,
}

impl UvSource {
    /// After KHR_texture_transform, which supplies another set too.
    fn new(info: &TextureInfo) -> Self {
        let transform = info.extensions.transform.as_ref();
        let values = transform.map(|t| {
            let [offset_u, offset_v] = t.offset.unwrap_or_default();
            let [scale_u, scale_v] = t.scale.unwrap_or([1.0; 2]);
            [
                offset_u,
                offset_v,
                t.rotation.unwrap_or_default(),
                scale_u,
                scale_v,
            ]
        });
        Self {
            textured: true,
            set: transform
                .and_then(|t| t.tex_coord)
                .unwrap_or(info.tex_coord),
            transform: values
                .filter(|&values| values != [0.0, 0.0, 0.0, 1.0, 1.0])
                .map(|values| values.map(f64::to_bits)),
        }
    }

    /// From the texture coordinates in the file to those in the image, or `None` where they are
    /// the same.
    ///
    /// Scaled, then turned, then moved. A positive angle turns the coordinates counter-clockwise as
    /// seen in the image, whose v runs down.
    pub(crate) fn image_from_file(&self) -> Option<DAffine2> {
        let [offset_u, offset_v, angle, scale_u, scale_v] = self.transform?.map(f64::from_bits);
        Some(DAffine2::from_scale_angle_translation(
            DVec2::new(scale_u, scale_v),
            -angle,
            DVec2::new(offset_u, offset_v),
        ))
    }

    pub(crate) fn apply(transform: &DAffine2, uv: Vec2) -> Vec2 {
        transform.transform_point2(uv.as_dvec2()).as_vec2()
    }
}

/// Translates the materials that are used; `None` stands for glTF's default material.
///
/// # Errors
///
/// When a mode, a filter or a cutoff is none of glTF's.
pub(crate) fn read_materials(
    document: &Document,
    used: &BTreeSet<Option<usize>>,
    notes: &mut Notes,
) -> Result<Looks, GltfError> {
    let mut looks = Looks::default();
    let mut textures = Textures::default();
    for &index in used {
        let (material, uv_source) = match index {
            None => (Material::default(), UvSource::default()),
            Some(i) => read_material(document, i, &mut textures, notes)?,
        };
        looks.slots.insert(index, looks.materials.len() as u32);
        looks.materials.push(material);
        looks.uv_sources.push(uv_source);
    }
    looks.textures = textures.textures;
    looks.images = textures.images;
    Ok(looks)
}

fn read_material(
    document: &Document,
    index: usize,
    textures: &mut Textures,
    notes: &mut Notes,
) -> Result<(Material, UvSource), GltfError> {
    let source = &document.materials[index];
    let pbr = &source.pbr_metallic_roughness;
    let unlit = source.extensions.unlit.is_some();
    let strength = source.extensions.emissive_strength.as_ref();
    let strength = strength.and_then(|e| e.emissive_strength).unwrap_or(1.0);
    let greatest = f64::from(f32::MAX);
    let mut factor = |value: f64, greatest: f64| {
        let clamped = value.clamp(0.0, greatest);
        notes.add(Note::Factors, (clamped != value).into());
        clamped as f32
    };

    // The older model's diffuse colour is the base colour of something that is no metal.
    let specular = source.extensions.specular_glossiness.as_ref();
    let (base_color, metallic, roughness, base_color_texture) = match specular {
        Some(specular) => (
            specular.diffuse_factor,
            0.0,
            1.0 - factor(specular.glossiness_factor.unwrap_or(1.0), 1.0),
            specular.diffuse_texture.as_ref(),
        ),
        None => (
            pbr.base_color_factor,
            factor(pbr.metallic_factor.unwrap_or(1.0), 1.0),
            factor(pbr.roughness_factor.unwrap_or(1.0), 1.0),
            pbr.base_color_texture.as_ref(),
        ),
    };
    let emissive = source.emissive_factor.filter(|_| !unlit);
    let mut material = Material {
        name: source.name.clone().unwrap_or_default(),
        base_color: Vec4::from(base_color.unwrap_or([1.0; 4]).map(|v| factor(v, 1.0))),
        metallic,
        roughness,
        emissive: Vec3::from(
            emissive
                .unwrap_or_default()
                .map(|v| factor(v * strength, greatest)),
        ),
        alpha: read_alpha(source, index)?,
        double_sided: source.double_sided,
        unlit,
        ..Material::default()
    };
    notes.add(Note::SpecularGlossiness, specular.is_some().into());

    let mut uv_sources = Vec::new();
    let mut texture = |info: Option<&TextureInfo>| {
        let Some(info) = info else { return Ok(None) };
        let texture = textures.translate(document, info.index)?;
        notes.add(Note::NoImage, texture.is_none().into());
        uv_sources.extend(texture.map(|_| UvSource::new(info)));
        Ok(texture)
    };
    material.base_color_texture = texture(base_color_texture)?;
    // Without light, nothing else is seen.
    if !unlit {
        if specular.is_none() {
            material.metallic_roughness_texture = texture(pbr.metallic_roughness_texture.as_ref())?;
        }
        material.normal_texture = texture(source.normal_texture.as_ref())?;
        material.emissive_texture = texture(source.emissive_texture.as_ref())?;
    }
    if let Some(scale) = source.normal_texture.as_ref().and_then(|info| info.scale) {
        material.normal_scale = scale.clamp(-greatest, greatest) as f32;
    }
    let uv_source = uv_sources.first().copied().unwrap_or_default();
    let mixed = uv_sources.iter().any(|&other| other != uv_source);
    notes.add(Note::MixedUvs, mixed.into());
    Ok((material, uv_source))
}

fn read_alpha(source: &document::Material, index: usize) -> Result<AlphaMode, GltfError> {
    let wrong = |field, value, expected| GltfError::Value {
        place: format!("materials[{index}].{field}"),
        value,
        expected,
    };
    match source.alpha_mode.as_deref() {
        None | Some("OPAQUE") => Ok(AlphaMode::Opaque),
        Some("BLEND") => Ok(AlphaMode::Blend),
        Some("MASK") => {
            let cutoff = source.alpha_cutoff.unwrap_or(0.5);
            if !(0.0..=1.0).contains(&cutoff) {
                return Err(wrong("alphaCutoff", cutoff.to_string(), "0 to 1"));
            }
            Ok(AlphaMode::Mask {
                cutoff: cutoff as f32,
            })
        }
        Some(mode) => {
            let value = format!("{mode:?}");
            Err(wrong("alphaMode", value, "OPAQUE, MASK or BLEND"))
        }
    }
}

/// The textures used so far, each of the document's once.
#[derive(Debug, Default)]
struct Textures {
    textures: Vec<Texture>,
    images: Vec<usize>,
    texture_of: BTreeMap<usize, u32>,
    image_of: BTreeMap<usize, u32>,
}

impl Textures {
    /// The scene's texture for one of the document's, or `None` where it has no image.
    fn translate(&mut self, document: &Document, index: usize) -> Result<Option<u32>, GltfError> {
        if let Some(&texture) = self.texture_of.get(&index) {
            return Ok(Some(texture));
        }
        let source = &document.textures[index];
        let Some(image) = source.image() else {
            return Ok(None);
        };
        let images = &mut self.images;
        let image = *self.image_of.entry(image).or_insert_with(|| {
            images.push(image);
            images.len() as u32 - 1
        });
        let default = document::Sampler::default();
        let sampler = source
            .sampler
            .map_or(&default, |sampler| &document.samplers[sampler]);
        let sampler_index = source.sampler.unwrap_or_default();
        self.texture_of.insert(index, self.textures.len() as u32);
        self.textures.push(Texture {
            image,
            wrap: [
                read_wrap(sampler.wrap_s, sampler_index, "wrapS")?,
                read_wrap(sampler.wrap_t, sampler_index, "wrapT")?,
            ],
            filter: read_filter(sampler, sampler_index)?,
        });
        Ok(Some(self.textures.len() as u32 - 1))
    }
}

fn read_wrap(code: Option<u32>, sampler: usize, field: &str) -> Result<Wrap, GltfError> {
    match code {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33071) => Ok(Wrap::ClampToEdge),
        Some(33648) => Ok(Wrap::MirroredRepeat),
        Some(code) => Err(GltfError::Value {
            place: format!("samplers[{sampler}].{field}"),
            value: code.to_string(),
            expected: "10497, 33071 or 33648",
        }),
    }
}

/// The minifying filter: far-away textures are seen minified. Without one, mipmaps.
fn read_filter(sampler: &document::Sampler, index: usize) -> Result<Filter, GltfError> {
    let wrong = |field, value: u32, expected| GltfError::Value {
        place: format!("samplers[{index}].{field}"),
        value: value.to_string(),
        expected,
    };
    if let Some(code) = sampler
        .mag_filter
        .filter(|code| !matches!(code, 9728 | 9729))
    {
        return Err(wrong("magFilter", code, "9728 or 9729"));
    }
    match sampler.min_filter {
        Some(9728) => Ok(Filter::Nearest),
        Some(9729) => Ok(Filter::Linear),
        None | Some(9984..=9987) => Ok(Filter::Mipmapped),
        Some(code) => Err(wrong("minFilter", code, "9728, 9729 or 9984 to 9987")),
    }
}
