//! Translates the materials of OBJ files, with their pictures.

use super::mtl::{Description, Map, parse_mtl};
use crate::Load;
use crate::mesh_error::MeshFileError;
use crate::notes::{Note, Notes};
use crate::pictures::{check_size, decode, decoded_limit};
use farfield_scene::{AlphaMode, Filter, Image, Material, Scene, Texture, Wrap};
use glam::{Vec3, Vec4};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What lies beside an OBJ file.
#[derive(Debug, Default)]
pub(super) struct Beside {
    /// Paths of what was read, each once, in the order of reading.
    pub(super) files: Vec<String>,
    /// About what cannot be read.
    pub(super) warnings: Vec<String>,
}

/// Appends a material for each name, as the libraries describe them, the first of several with one
/// name. A library that cannot be read is a warning.
///
/// * `libraries` - names and the lines that mention them
/// * `size` - of the OBJ file, in bytes
///
/// # Errors
///
/// When a library is damaged, or a picture cannot be fetched or decoded.
pub(super) fn read_materials(
    libraries: &[(String, usize)],
    names: &[&str],
    size: u64,
    load: &mut Load<'_>,
    scene: &mut Scene,
    notes: &mut Notes,
) -> Result<Beside, MeshFileError> {
    let mut beside = Beside::default();
    let mut size = size;
    let mut descriptions: HashMap<String, (Description, String)> = HashMap::new();
    let mut asked = BTreeSet::new();
    for (name, line) in libraries {
        if !asked.insert(name) {
            continue;
        }
        let path = relative(name).map_err(|problem| {
            let place = format!("line {line}");
            MeshFileError::new(place, format!("{name:?} {problem}"), RELATIVE)
        })?;
        let bytes = match load(&path) {
            Ok(bytes) => bytes,
            Err(error) => {
                let what = format!("material library {path:?} cannot be read ({error})");
                beside.warnings.push(format!("{what}, left out: 1"));
                continue;
            }
        };
        size += bytes.len() as u64;
        let materials = parse_mtl(&bytes).map_err(|mut error| {
            error.place = format!("{path:?} {}", error.place);
            error
        })?;
        for material in materials {
            let entry = descriptions.entry(material.name.clone());
            entry.or_insert_with(|| (material, path.clone()));
        }
        beside.files.push(path);
    }

    let mut pictures = Pictures {
        load,
        size,
        decoded: 0,
        known: BTreeMap::new(),
        textures: BTreeMap::new(),
        fetched: BTreeSet::new(),
        files: &mut beside.files,
    };
    for &name in names {
        let description = descriptions.get(name);
        notes.add(
            Note::NoMaterial,
            (description.is_none() && !name.is_empty()).into(),
        );
        let material = match description {
            Some((description, library)) => {
                translate(description, library, &mut pictures, scene, notes)?
            }
            None => plain(name),
        };
        scene.materials.push(material);
    }
    Ok(beside)
}

const RELATIVE: &str = "use a path relative to the OBJ file";

/// White, rough and no metal. Seen from both sides, as the format tells no front from a back.
pub(crate) fn plain(name: &str) -> Material {
    Material {
        name: name.into(),
        metallic: 0.0,
        double_sided: true,
        ..Material::default()
    }
}

/// A name as a path with `/` between folders.
fn relative(name: &str) -> Result<String, &'static str> {
    let path = name.trim().trim_matches('"').replace('\\', "/");
    let drive = path
        .split_once(':')
        .is_some_and(|(drive, _)| drive.len() == 1);
    if path.is_empty() || path.contains('\0') {
        Err("names no file")
    } else if path.starts_with('/') || drive || path.contains("://") {
        Err("is absolute")
    } else {
        Ok(path)
    }
}

fn translate(
    source: &Description,
    library: &str,
    pictures: &mut Pictures<'_, '_>,
    scene: &mut Scene,
    notes: &mut Notes,
) -> Result<Material, MeshFileError> {
    let clamp = |value: f32, greatest: f32, notes: &mut Notes| {
        // What is no number is 1.
        let clamped = if value.is_nan() {
            1.0
        } else {
            value.clamp(0.0, greatest)
        };
        notes.add(Note::Factors, (clamped != value).into());
        clamped
    };
    let maps = [
        &source.diffuse_map,
        &source.emissive_map,
        &source.opacity_map,
        &source.normal_map,
    ];
    let with_options = maps.into_iter().flatten().filter(|map| map.has_options);
    notes.add(Note::TextureOptions, with_options.count());

    // Programs write black where only the picture counts.
    let diffuse = match (source.diffuse, &source.diffuse_map) {
        (Some(Vec3::ZERO), Some(_)) | (None, _) => Vec3::ONE,
        (Some(diffuse), _) => diffuse,
    };
    let color = diffuse.to_array().map(|c| clamp(c, 1.0, notes));
    let opacity = clamp(source.opacity, 1.0, notes);
    let roughness = match (source.roughness, source.exponent) {
        (Some(roughness), _) => clamp(roughness, 1.0, notes),
        // Whose highlight is about as wide.
        (None, Some(exponent)) if source.specular.max_element() > 0.0 => {
            (2.0 / (clamp(exponent, f32::MAX, notes) + 2.0)).powf(0.25)
        }
        _ => 1.0,
    };
    let mut show = |color: Option<&Map>, opacity: Option<&Map>| {
        let Some(map) = color.or(opacity) else {
            return Ok(None);
        };
        let image = pictures.read(color, opacity, library, scene)?;
        let textures = &mut scene.textures;
        let texture = pictures.textures.entry((image, map.clamped));
        Ok(Some(*texture.or_insert_with(|| {
            let wrap = match map.clamped {
                true => Wrap::ClampToEdge,
                false => Wrap::Repeat,
            };
            textures.push(Texture {
                image,
                wrap: [wrap; 2],
                filter: Filter::Mipmapped,
            });
            textures.len() as u32 - 1
        })))
    };
    let base_color_texture = show(source.diffuse_map.as_ref(), source.opacity_map.as_ref())?;
    let emissive_texture = show(source.emissive_map.as_ref(), None)?;
    let normal_texture = show(source.normal_map.as_ref(), None)?;
    let emissive = match (source.emissive, &source.emissive_map) {
        (Vec3::ZERO, Some(_)) => Vec3::ONE,
        (emissive, _) => emissive,
    };
    let alpha = match (&source.opacity_map, opacity) {
        (_, ..1.0) => AlphaMode::Blend,
        (Some(_), _) => AlphaMode::Mask { cutoff: 0.5 },
        _ => AlphaMode::Opaque,
    };
    let emissive = emissive.to_array().map(|c| clamp(c, f32::MAX, notes));
    Ok(Material {
        base_color: Vec4::new(color[0], color[1], color[2], opacity),
        base_color_texture,
        metallic: clamp(source.metallic.unwrap_or(0.0), 1.0, notes),
        roughness,
        emissive: emissive.into(),
        emissive_texture,
        normal_texture,
        alpha,
        ..plain(&source.name)
    })
}

/// Pictures that were read so far.
struct Pictures<'a, 'l> {
    load: &'a mut Load<'l>,
    /// Bytes of all files so far.
    size: u64,
    /// Bytes of all pictures so far.
    decoded: u64,
    /// The scene's image for a colour's and an opacity's path.
    known: BTreeMap<[Option<String>; 2], u32>,
    /// The scene's texture of an image, clamped or not.
    textures: BTreeMap<(u32, bool), u32>,
    fetched: BTreeSet<String>,
    files: &'a mut Vec<String>,
}

impl Pictures<'_, '_> {
    /// The scene's image of a colour, a picture of its own or white, and an opacity.
    fn read(
        &mut self,
        color: Option<&Map>,
        opacity: Option<&Map>,
        library: &str,
        scene: &mut Scene,
    ) -> Result<u32, MeshFileError> {
        let mut paths = [None, None];
        for (map, path) in [color, opacity].into_iter().zip(&mut paths) {
            if let Some(map) = map {
                *path = Some(relative(&map.file).map_err(|problem| {
                    let problem = format!("{:?} {problem}", map.file);
                    MeshFileError::new(place(library, map), problem, RELATIVE)
                })?);
            }
        }
        if let Some(&image) = self.known.get(&paths) {
            return Ok(image);
        }
        let mut images = [None, None];
        for (i, map) in [color, opacity].into_iter().enumerate() {
            if let (Some(map), Some(path)) = (map, &paths[i]) {
                images[i] = Some(self.fetch(path, &|| place(library, map))?);
            }
        }
        let [mut color, opacity] = images;
        if let Some(opacity) = opacity {
            color = Some(with_opacity(color, &opacity));
        } else if let Some(color) = &mut color {
            // Without an opacity of its own, a material is opaque.
            color.texels.iter_mut().for_each(|texel| texel[3] = 255);
        }
        let image = color.expect("one of the two is there");
        self.known.insert(paths, scene.images.len() as u32);
        scene.images.push(image);
        Ok(scene.images.len() as u32 - 1)
    }

    fn fetch(&mut self, path: &str, place: &dyn Fn() -> String) -> Result<Image, MeshFileError> {
        let bytes = (self.load)(path).map_err(|error| {
            let problem = format!("{path:?} cannot be read: {error}");
            MeshFileError::new(place(), problem, "put it beside the OBJ file")
        })?;
        if self.fetched.insert(path.into()) {
            self.files.push(path.into());
            self.size += bytes.len() as u64;
        }
        let wrong = |problem: String| {
            let remedy = "store it as PNG or JPEG, of a usual size";
            MeshFileError::new(place(), format!("{path:?} {problem}"), remedy)
        };
        let [width, height] = check_size(&bytes).map_err(wrong)?;
        self.decoded += 4 * u64::from(width) * u64::from(height);
        let limit = decoded_limit(self.size);
        if self.decoded > limit {
            return Err(wrong(format!("would take all pictures over {limit} bytes")));
        }
        let mut image = decode(&bytes).map_err(wrong)?;
        image.name = path.into();
        Ok(image)
    }
}

fn place(library: &str, map: &Map) -> String {
    format!("{library:?} line {}", map.line)
}

/// A colour, white where there is none, with the opacity of another picture, of its size: the
/// other's alpha where it has any, else its brightness.
fn with_opacity(color: Option<Image>, opacity: &Image) -> Image {
    let mut image = color.unwrap_or_else(|| Image {
        texels: vec![[255; 4]; opacity.texels.len()],
        ..opacity.clone()
    });
    let has_alpha = opacity.texels.iter().any(|texel| texel[3] < 255);
    let (width, height) = (image.width as usize, image.height as usize);
    for (i, texel) in image.texels.iter_mut().enumerate() {
        let (x, y) = (i % width, i / width);
        // The texel in which the middle of this one lies.
        let across = (2 * x + 1) * opacity.width as usize / (2 * width);
        let down = (2 * y + 1) * opacity.height as usize / (2 * height);
        let [r, g, b, a] = opacity.texels[down * opacity.width as usize + across];
        let brightest = r.max(g).max(b);
        texel[3] = if has_alpha { a } else { brightest };
    }
    image
}
