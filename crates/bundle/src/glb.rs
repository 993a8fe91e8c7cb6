//! Scenes as glTF files.

use crate::geometry::{Geometry, textures_of};
use crate::gltf;
use crate::manifest::Cost;
use farfield_scene::{AlphaMode, Filter, Material, Scene, Texture, Wrap};
use glam::Vec3;

/// The scene is larger than a GLB file can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the scene takes {bytes} bytes as a GLB file, which can hold {}",
    u32::MAX
)]
pub struct GlbTooLarge {
    /// Its size.
    pub bytes: u64,
}

/// The scene as a binary glTF 2.0 file with external images.
///
/// * `scene` - as [`Scene::check`] wants it; materials within the ranges their docs tell
/// * `image_uris` - one for each of the scene's images, percent-encoded, relative to the file
///
/// Objects become nodes of the same names, in the same order, and share the meshes that they
/// share. Transforms are written as f64: a translation where it is nothing more, else a matrix.
/// A glTF node cannot shear; an object that does, or that flattens, gets a copy of its mesh with
/// the linear part of its transform applied.
///
/// A mesh has one primitive, so one draw call, for each of its materials, in the materials'
/// order, with just the vertices it uses in the order of their first use. Indices are u16 up to
/// 65,535 vertices, u32 beyond. Normals are written where the material is lit, texture
/// coordinates where it has a texture, colours (clamped to [0, 1]) where they are not all one.
/// Unlit materials use `KHR_materials_unlit`, emission beyond 1
/// `KHR_materials_emissive_strength`; neither is required of a reader. Meshes, materials,
/// textures and images that nothing uses are left out.
///
/// # Errors
///
/// When the file would be larger than 4 GiB.
///
/// # Panics
///
/// When [`Scene::check`] would find something or `image_uris` has not one entry an image.
pub fn glb_from_scene(scene: &Scene, image_uris: &[String]) -> Result<Vec<u8>, GlbTooLarge> {
    assert!(
        image_uris.len() == scene.images.len(),
        "{} image URIs for {} images",
        image_uris.len(),
        scene.images.len()
    );
    let mut geometry = Geometry::of(scene);
    let buffer_views = geometry.place_streams();
    let bin_length = geometry.byte_length();
    let buffers = match bin_length {
        0 => vec![],
        byte_length => vec![gltf::Buffer { byte_length }],
    };
    let mut document = gltf::Document {
        scenes: [gltf::SceneNodes {
            nodes: (0..geometry.nodes.len() as u32).collect(),
        }],
        nodes: std::mem::take(&mut geometry.nodes),
        meshes: std::mem::take(&mut geometry.meshes),
        accessors: std::mem::take(&mut geometry.accessors),
        buffer_views,
        buffers,
        ..gltf::Document::default()
    };
    fill_in_materials(&mut document, scene, image_uris);
    let json = serde_json::to_vec(&document).expect("a document has only string keys");

    // Header, then a chunk of JSON and one of binary data, each padded to 4 bytes.
    let json_length = json.len().next_multiple_of(4);
    let padded_bin_length = bin_length.next_multiple_of(4);
    let bin_chunk = if bin_length > 0 {
        8 + padded_bin_length
    } else {
        0
    };
    let length = 12 + 8 + json_length as u64 + bin_chunk;
    let as_u32 = |n: u64| u32::try_from(n).map_err(|_| GlbTooLarge { bytes: length });
    let mut glb = Vec::with_capacity(as_u32(length)? as usize);
    glb.extend(b"glTF");
    glb.extend(2u32.to_le_bytes());
    glb.extend(as_u32(length)?.to_le_bytes());
    glb.extend(as_u32(json_length as u64)?.to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(&json);
    glb.resize(20 + json_length, b' ');
    if bin_length > 0 {
        glb.extend(as_u32(padded_bin_length)?.to_le_bytes());
        glb.extend(b"BIN\0");
        geometry.append_streams(&mut glb);
        glb.resize(length as usize, 0);
    }
    Ok(glb)
}

/// What drawing a scene takes.
///
/// Counts what [`glb_from_scene`] would write for it, so that the costs of an original and of its
/// impostors compare.
///
/// # Panics
///
/// When [`Scene::check`] would find something.
pub fn cost(scene: &Scene) -> Cost {
    let geometry = Geometry::of(scene);
    let primitives = || geometry.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let materials = Kept::of(scene.materials.len(), primitives().map(|p| p.material));
    let textures = Kept::of(scene.textures.len(), textures_in(scene, &materials));
    let images = Kept::of(scene.images.len(), images_in(scene, &textures));
    let texels = |&i: &u32| {
        let image = &scene.images[i as usize];
        u64::from(image.width) * u64::from(image.height)
    };
    let draw_calls_of = |mesh: u32| geometry.meshes[mesh as usize].primitives.len() as u64;
    let used_meshes = geometry.nodes.iter().filter_map(|node| node.mesh);
    Cost {
        triangles: scene.drawn_triangles(),
        draw_calls: used_meshes.map(draw_calls_of).sum(),
        texture_bytes: images.old.iter().map(texels).sum::<u64>() * 4,
        geometry_bytes: geometry.byte_length(),
    }
}

/// Adds the materials that the document's primitives use, and what these use, and lets the
/// primitives refer to them.
fn fill_in_materials(document: &mut gltf::Document, scene: &Scene, image_uris: &[String]) {
    let primitives = || document.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let materials = Kept::of(scene.materials.len(), primitives().map(|p| p.material));
    let textures = Kept::of(scene.textures.len(), textures_in(scene, &materials));
    let images = Kept::of(scene.images.len(), images_in(scene, &textures));

    for primitive in document.meshes.iter_mut().flat_map(|m| &mut m.primitives) {
        primitive.material = materials.new[primitive.material as usize];
    }
    for &i in &materials.old {
        let material = material(&scene.materials[i as usize], &textures);
        document.materials.push(material);
    }
    for &i in &textures.old {
        let texture = &scene.textures[i as usize];
        let sampler = sampler(texture);
        let known = document.samplers.iter().position(|s| *s == sampler);
        let sampler = known.unwrap_or_else(|| {
            document.samplers.push(sampler);
            document.samplers.len() - 1
        });
        document.textures.push(gltf::Texture {
            sampler: sampler as u32,
            source: images.new[texture.image as usize],
        });
    }
    for &i in &images.old {
        document.images.push(gltf::Image {
            name: scene.images[i as usize].name.clone(),
            uri: image_uris[i as usize].clone(),
        });
    }
    let any = |uses: fn(&gltf::Extensions) -> bool| {
        document.materials.iter().any(|m| uses(&m.extensions))
    };
    let extensions = [
        (
            "KHR_materials_emissive_strength",
            any(|e| e.emissive_strength.is_some()),
        ),
        ("KHR_materials_unlit", any(|e| e.unlit.is_some())),
    ];
    document.extensions_used = extensions.iter().filter(|e| e.1).map(|e| e.0).collect();
}

/// The entries of an array that are used, and where they went.
struct Kept {
    /// Indices into the old array, ascending.
    old: Vec<u32>,
    /// For each index into the old array the index into the new one, where it was kept.
    new: Vec<u32>,
}

impl Kept {
    fn of(len: usize, used: impl Iterator<Item = u32>) -> Self {
        let mut new = vec![u32::MAX; len];
        used.for_each(|i| new[i as usize] = 0);
        let old: Vec<u32> = (0..len as u32).filter(|&i| new[i as usize] == 0).collect();
        for (index, &i) in old.iter().enumerate() {
            new[i as usize] = index as u32;
        }
        Self { old, new }
    }
}

fn textures_in<'a>(scene: &'a Scene, materials: &'a Kept) -> impl Iterator<Item = u32> + 'a {
    let materials = materials.old.iter();
    materials.flat_map(|&i| textures_of(&scene.materials[i as usize]))
}

fn images_in<'a>(scene: &'a Scene, textures: &'a Kept) -> impl Iterator<Item = u32> + 'a {
    let textures = textures.old.iter();
    textures.map(|&i| scene.textures[i as usize].image)
}

fn material(material: &Material, textures: &Kept) -> gltf::Material {
    let index = |texture: u32| textures.new[texture as usize];
    let info = |texture: u32| gltf::TextureInfo {
        index: index(texture),
    };
    // glTF's factor ends at 1, the rest is strength.
    let strength = material.emissive.max_element().max(1.0);
    let (alpha_mode, alpha_cutoff) = match material.alpha {
        AlphaMode::Opaque => ("OPAQUE", None),
        AlphaMode::Mask { cutoff } => ("MASK", Some(cutoff)),
        AlphaMode::Blend => ("BLEND", None),
    };
    gltf::Material {
        name: material.name.clone(),
        pbr_metallic_roughness: gltf::MetallicRoughness {
            base_color_factor: material.base_color.to_array(),
            base_color_texture: material.base_color_texture.map(info),
            metallic_factor: material.metallic,
            roughness_factor: material.roughness,
            metallic_roughness_texture: material.metallic_roughness_texture.map(info),
        },
        normal_texture: material.normal_texture.map(|texture| gltf::NormalTexture {
            index: index(texture),
            scale: material.normal_scale,
        }),
        emissive_texture: material.emissive_texture.map(info),
        emissive_factor: (material.emissive != Vec3::ZERO)
            .then(|| (material.emissive / strength).to_array()),
        alpha_mode,
        alpha_cutoff,
        double_sided: material.double_sided,
        extensions: gltf::Extensions {
            unlit: material.unlit.then_some(gltf::Unlit {}),
            emissive_strength: (strength > 1.0).then_some(gltf::EmissiveStrength {
                emissive_strength: strength,
            }),
        },
    }
}

fn sampler(texture: &Texture) -> gltf::Sampler {
    const NEAREST: u32 = 9728;
    const LINEAR: u32 = 9729;
    const LINEAR_MIPMAP_LINEAR: u32 = 9987;
    let (mag_filter, min_filter) = match texture.filter {
        Filter::Nearest => (NEAREST, NEAREST),
        Filter::Linear => (LINEAR, LINEAR),
        Filter::Mipmapped => (LINEAR, LINEAR_MIPMAP_LINEAR),
    };
    let [wrap_s, wrap_t] = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    });
    gltf::Sampler {
        mag_filter,
        min_filter,
        wrap_s,
        wrap_t,
    }
}
