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
/// `KHR_materials_emissive_strength`; neither is required of a reader. Of unlit materials only
/// what they show is written: no emission, no textures but the base colour's. Meshes, materials,
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
    // A list of nodes must not be empty, so a scene without objects is a file without scenes.
    let scenes = match geometry.nodes.len() as u32 {
        0 => vec![],
        count => vec![gltf::SceneNodes {
            nodes: (0..count).collect(),
        }],
    };
    let mut document = gltf::Document {
        scene: scenes.first().map(|_| 0),
        scenes,
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
    // Without light, nothing but the base colour shows.
    let lit = |texture: Option<u32>| texture.filter(|_| !material.unlit);
    let emissive = match material.unlit {
        true => Vec3::ZERO,
        false => material.emissive,
    };
    // glTF's factor ends at 1, the rest is strength.
    let strength = emissive.max_element().max(1.0);
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
            metallic_roughness_texture: lit(material.metallic_roughness_texture).map(info),
        },
        normal_texture: lit(material.normal_texture).map(|texture| gltf::NormalTexture {
            index: index(texture),
            scale: material.normal_scale,
        }),
        emissive_texture: lit(material.emissive_texture).map(info),
        emissive_factor: (emissive != Vec3::ZERO).then(|| (emissive / strength).to_array()),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::scenes;
    use farfield_scene::{Mesh, Object};
    use glam::{DAffine3, DMat4, DVec3, Vec2, Vec4};
    use gltf_json::validation::Validate;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    fn uris(scene: &Scene) -> Vec<String> {
        let names = 0..scene.images.len();
        names.map(|i| format!("pages/{i:03}.png")).collect()
    }

    /// The JSON document and the buffer of a GLB file, after a check of its frame.
    fn split(glb: &[u8]) -> (&[u8], &[u8]) {
        let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&glb[..4], word(4), word(8)), (&b"glTF"[..], 2, glb.len()));
        assert_eq!((&glb[16..20], word(12) % 4), (&b"JSON"[..], 0));
        let end = 20 + word(12);
        if end == glb.len() {
            return (&glb[20..end], &[]);
        }
        assert_eq!(&glb[end + 4..end + 8], b"BIN\0");
        assert_eq!((word(end) % 4, end + 8 + word(end)), (0, glb.len()));
        (&glb[20..end], &glb[end + 8..])
    }

    /// The indices in a document are those of things that exist, and accessors lie aligned inside
    /// of their views, views inside of the buffer.
    fn check_document(root: &gltf_json::Root, bin: &[u8]) -> Result<(), String> {
        let mut problems = Vec::new();
        root.validate(root, gltf_json::Path::new, &mut |path, error| {
            problems.push(format!("{}: {error}", path()));
        });
        let length = root
            .buffers
            .first()
            .map_or(0, |buffer| buffer.byte_length.0);
        if length.next_multiple_of(4) != bin.len() as u64 {
            problems.push(format!("{length} bytes in a chunk of {}", bin.len()));
        }
        for (i, view) in root.buffer_views.iter().enumerate() {
            if view.byte_offset.unwrap().0 + view.byte_length.0 > length {
                problems.push(format!("view {i} ends behind the buffer"));
            }
        }
        for (i, accessor) in root.accessors.iter().enumerate() {
            let view = &root.buffer_views[accessor.buffer_view.unwrap().value()];
            let component = accessor.component_type.unwrap().0.size() as u64;
            let size = component * accessor.type_.unwrap().multiplicity() as u64;
            let stride = view
                .byte_stride
                .as_ref()
                .map_or(size, |stride| stride.0 as u64);
            let offset = accessor.byte_offset.unwrap().0;
            if stride != size || accessor.count.0 == 0 {
                problems.push(format!("accessor {i} is empty or its elements overlap"));
            }
            if offset + stride * accessor.count.0 > view.byte_length.0 {
                problems.push(format!("accessor {i} ends behind its view"));
            }
            if !(view.byte_offset.unwrap().0 + offset).is_multiple_of(component)
                || !offset.is_multiple_of(component)
            {
                problems.push(format!("accessor {i} is not aligned"));
            }
        }
        match problems.is_empty() {
            true => Ok(()),
            false => Err(problems.join("; ")),
        }
    }

    /// The numbers of an accessor.
    fn numbers(root: &gltf_json::Root, bin: &[u8], accessor: &Value) -> Vec<f64> {
        let accessor = &root.accessors[accessor.as_u64().unwrap() as usize];
        let view = &root.buffer_views[accessor.buffer_view.unwrap().value()];
        let start = (view.byte_offset.unwrap().0 + accessor.byte_offset.unwrap().0) as usize;
        let component = accessor.component_type.unwrap().0;
        let count = accessor.count.0 as usize * accessor.type_.unwrap().multiplicity();
        let bytes = bin[start..].chunks_exact(component.size()).take(count);
        bytes
            .map(|b| match *b {
                [a, b] => f64::from(u16::from_le_bytes([a, b])),
                [a, b, c, d] if component == gltf_json::accessor::ComponentType::U32 => {
                    f64::from(u32::from_le_bytes([a, b, c, d]))
                }
                [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
                _ => panic!("no such component"),
            })
            .collect()
    }

    /// A triangle's corner as it is seen: place, normal (shorter where the surface is flattened),
    /// texture coordinates and colour.
    type Corner = (DVec3, Option<DVec3>, Option<Vec2>, Vec4);

    /// The triangles of a scene's object by material, counter-clockwise seen from the front.
    fn expected_triangles(scene: &Scene, object: u32) -> Vec<(Material, [Corner; 3])> {
        let linear = scene.objects[object as usize].world_from_mesh.matrix3;
        let mut triangles: Vec<u32> = scene.mesh_of(object).triangles.clone().collect();
        triangles.sort_by_key(|&t| scene.triangle_materials[t as usize]);
        let corner = |v: u32, material: &Material| {
            let i = v as usize;
            let is_textured = textures_of(material).next().is_some();
            // A normal is perpendicular to what is mapped from perpendicular directions.
            let [a, b] = {
                let (a, b) = scene.normals[i].as_dvec3().any_orthonormal_pair();
                [linear * a, linear * b]
            };
            let mirrored = if linear.determinant() < 0.0 {
                -1.0
            } else {
                1.0
            };
            let normal = a.cross(b) * mirrored
                / linear
                    .x_axis
                    .length_squared()
                    .max(linear.y_axis.length_squared())
                    .max(linear.z_axis.length_squared());
            (
                scene.world_position(object, v),
                (!material.unlit).then_some(normal),
                is_textured.then_some(scene.uvs[i]),
                scene.colors[i],
            )
        };
        triangles
            .iter()
            .map(|&t| {
                let material = &scene.materials[scene.triangle_materials[t as usize] as usize];
                let corners = scene.triangle_in(object, t).map(|v| corner(v, material));
                (material.clone(), corners)
            })
            .collect()
    }

    /// The same of a node of a document, as the specification tells to draw it.
    fn drawn_triangles(
        document: &Value,
        root: &gltf_json::Root,
        bin: &[u8],
        node: usize,
    ) -> Vec<(Value, [Corner; 3])> {
        let node = &document["nodes"][node];
        let floats = |value: &Value| -> Vec<f64> {
            let numbers = value.as_array().into_iter().flatten();
            numbers.map(|x| x.as_f64().unwrap()).collect()
        };
        let world_from_mesh = match (
            &floats(&node["matrix"])[..],
            &floats(&node["translation"])[..],
        ) {
            ([], []) => DAffine3::IDENTITY,
            ([], t) => DAffine3::from_translation(DVec3::from_slice(t)),
            (m, []) => DAffine3::from_mat4(DMat4::from_cols_slice(m)),
            _ => panic!("a node has a matrix or a translation"),
        };
        let is_mirrored = world_from_mesh.matrix3.determinant() < 0.0;
        let mut triangles = Vec::new();
        let Some(mesh) = node["mesh"].as_u64() else {
            return triangles;
        };
        let primitives = document["meshes"][mesh as usize]["primitives"]
            .as_array()
            .unwrap();
        for primitive in primitives {
            let attribute = |name: &str| {
                let accessor = primitive["attributes"].get(name);
                accessor.map(|accessor| numbers(root, bin, accessor))
            };
            let (positions, normals) = (attribute("POSITION").unwrap(), attribute("NORMAL"));
            let (uvs, colors) = (attribute("TEXCOORD_0"), attribute("COLOR_0"));
            let corner = |i: f64| -> Corner {
                let i = i as usize;
                let vec3 = |numbers: &[f64]| DVec3::from_slice(&numbers[i * 3..]);
                let inverse = world_from_mesh.matrix3.inverse().transpose();
                (
                    world_from_mesh.transform_point3(vec3(&positions)),
                    normals.as_ref().map(|n| (inverse * vec3(n)).normalize()),
                    uvs.as_ref()
                        .map(|uv| Vec2::new(uv[i * 2] as f32, uv[i * 2 + 1] as f32)),
                    colors.as_ref().map_or(Vec4::ONE, |c| {
                        Vec4::from_array(std::array::from_fn(|k| c[i * 4 + k] as f32))
                    }),
                )
            };
            let material = &document["materials"][primitive["material"].as_u64().unwrap() as usize];
            let indices = numbers(root, bin, &primitive["indices"]);
            let vertices = positions.len() / 3;
            assert!(indices.iter().all(|i| *i < vertices as f64));
            assert!(
                (0..vertices).all(|v| indices.contains(&(v as f64))),
                "unused vertices"
            );
            for triangle in indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|k| corner(triangle[k]));
                let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
                triangles.push((material.clone(), corners));
            }
        }
        triangles
    }

    /// What of a material a document does not tell, or not as the scene has it.
    fn check_material(
        document: &Value,
        written: &Value,
        scene: &Scene,
        material: &Material,
    ) -> Result<(), String> {
        let same = |name: &str, found: &Value, expected: Value| {
            // As f32, which is what all these numbers are.
            let bits = |value: &Value| value.as_f64().map(|x| x as f32);
            let equal = match (found.as_array(), expected.as_array()) {
                (Some(a), Some(b)) => a.iter().map(bits).eq(b.iter().map(bits)),
                _ if found.is_number() => bits(found) == bits(&expected),
                _ => *found == expected,
            };
            match equal {
                true => Ok(()),
                false => Err(format!("{name} is {found}, expected {expected}")),
            }
        };
        let texture = |found: &Value, expected: Option<u32>| {
            let Some(texture) = expected.map(|t| &scene.textures[t as usize]) else {
                return same("texture", found, Value::Null);
            };
            let found =
                &document["textures"][found["index"].as_u64().ok_or("no texture")? as usize];
            let sampler = &document["samplers"][found["sampler"].as_u64().unwrap() as usize];
            let image = &document["images"][found["source"].as_u64().unwrap() as usize];
            same(
                "uri",
                &image["uri"],
                json!(format!("pages/{:03}.png", texture.image)),
            )?;
            let wrap = |wrap: Wrap| match wrap {
                Wrap::Repeat => json!(10497),
                Wrap::MirroredRepeat => json!(33648),
                Wrap::ClampToEdge => json!(33071),
            };
            same("wrapS", &sampler["wrapS"], wrap(texture.wrap[0]))?;
            same("wrapT", &sampler["wrapT"], wrap(texture.wrap[1]))?;
            let (mag, min) = match texture.filter {
                Filter::Nearest => (9728, 9728),
                Filter::Linear => (9729, 9729),
                Filter::Mipmapped => (9729, 9987),
            };
            same("magFilter", &sampler["magFilter"], json!(mag))?;
            same("minFilter", &sampler["minFilter"], json!(min))
        };
        let lit = |texture: Option<u32>| texture.filter(|_| !material.unlit);
        let pbr = &written["pbrMetallicRoughness"];
        texture(&pbr["baseColorTexture"], material.base_color_texture)?;
        texture(
            &pbr["metallicRoughnessTexture"],
            lit(material.metallic_roughness_texture),
        )?;
        texture(&written["normalTexture"], lit(material.normal_texture))?;
        texture(&written["emissiveTexture"], lit(material.emissive_texture))?;
        same(
            "baseColorFactor",
            &pbr["baseColorFactor"],
            json!(material.base_color.to_array()),
        )?;
        same(
            "metallicFactor",
            &pbr["metallicFactor"],
            json!(material.metallic),
        )?;
        same(
            "roughnessFactor",
            &pbr["roughnessFactor"],
            json!(material.roughness),
        )?;
        if lit(material.normal_texture).is_some() {
            same(
                "scale",
                &written["normalTexture"]["scale"],
                json!(material.normal_scale),
            )?;
        }
        same("name", &written["name"], json!(material.name))?;
        same(
            "doubleSided",
            &written["doubleSided"],
            json!(material.double_sided),
        )?;
        let (mode, cutoff) = match material.alpha {
            AlphaMode::Opaque => ("OPAQUE", Value::Null),
            AlphaMode::Mask { cutoff } => ("MASK", json!(cutoff)),
            AlphaMode::Blend => ("BLEND", Value::Null),
        };
        same("alphaMode", &written["alphaMode"], json!(mode))?;
        same("alphaCutoff", &written["alphaCutoff"], cutoff)?;
        let extensions = &written["extensions"];
        let unlit = if material.unlit {
            json!({})
        } else {
            Value::Null
        };
        same("unlit", &extensions["KHR_materials_unlit"], unlit)?;
        // The generator's emissions are products of powers of two, so this is exact.
        let strength = &extensions["KHR_materials_emissive_strength"]["emissiveStrength"];
        let strength = strength.as_f64().unwrap_or(1.0) as f32;
        let emissive = material.emissive * if material.unlit { 0.0 } else { 1.0 };
        let zero = json!([0.0, 0.0, 0.0]);
        let factor = written.get("emissiveFactor").unwrap_or(&zero);
        same(
            "emissiveFactor",
            factor,
            json!((emissive / strength).to_array()),
        )
    }

    /// Distance that two places may lie apart that differ by rounding, `scale` the size of what is
    /// rounded.
    fn is_near(a: DVec3, b: DVec3, scale: f64) -> bool {
        // Rounded to f32 once, and a few times to f64.
        a.distance(b) <= scale * f64::from(f32::EPSILON)
    }

    proptest! {
        /// A file written for a scene follows the specification's rules for indices, ranges and
        /// alignment, bounds are exact, and it shows each object with the triangles, materials and
        /// textures of the scene, from the same side.
        #[test]
        fn files_show_the_scene(scene in scenes()) {
            prop_assert_eq!(scene.check(), Ok(()));
            let glb = glb_from_scene(&scene, &uris(&scene)).unwrap();
            let (json, bin) = split(&glb);
            let document: Value = serde_json::from_slice(json).unwrap();
            let root: gltf_json::Root = gltf_json::deserialize::from_slice(json).unwrap();
            prop_assert_eq!(check_document(&root, bin), Ok(()));
            prop_assert_eq!(root.nodes.len(), scene.objects.len());
            prop_assert_eq!(root.extensions_required.len(), 0);
            prop_assert_eq!(
                glb.windows(10).any(|w| w == b"_strength\""),
                root.extensions_used.contains(&"KHR_materials_emissive_strength".to_owned())
            );
            for (i, accessor) in root.accessors.iter().enumerate().filter(|(_, a)| a.min.is_some()) {
                let numbers = numbers(&root, bin, &json!(i));
                let least = |k| numbers.iter().skip(k).step_by(3).copied().fold(f64::INFINITY, f64::min);
                let most = |k| numbers.iter().skip(k).step_by(3).copied().fold(-f64::INFINITY, f64::max);
                prop_assert_eq!(accessor.min.as_ref().unwrap(), &json!([least(0), least(1), least(2)]));
                prop_assert_eq!(accessor.max.as_ref().unwrap(), &json!([most(0), most(1), most(2)]));
            }
            for object in 0..scene.objects.len() {
                prop_assert_eq!(root.nodes[object].name.clone().unwrap_or_default(), scene.objects[object].name.clone());
                let expected = expected_triangles(&scene, object as u32);
                let drawn = drawn_triangles(&document, &root, bin, object);
                prop_assert_eq!(drawn.len(), expected.len());
                for ((written, drawn), (material, expected)) in drawn.iter().zip(&expected) {
                    prop_assert_eq!(check_material(&document, written, &scene, material), Ok(()));
                    for (drawn, expected) in drawn.iter().zip(expected) {
                        // Meshes of coordinates up to 1, scaled by up to 2 on three axes; the
                        // translation is added as f64 in both, rounded to 2^-52 of up to 8e6.
                        prop_assert!(is_near(drawn.0, expected.0, 12.0), "{} is not {}", drawn.0, expected.0);
                        prop_assert_eq!(drawn.1.is_some(), expected.1.is_some());
                        let normals = drawn.1.zip(expected.1);
                        prop_assert_eq!((drawn.2, drawn.3), (expected.2, expected.3));
                        // Where a surface is flattened a thousandfold, roundings grow as much;
                        // beyond that the direction means little and is not compared.
                        let normals = normals.filter(|(_, expected)| expected.length() > 1e-3);
                        if let Some((drawn, expected)) = normals {
                            let expected = expected.normalize();
                            prop_assert!(is_near(drawn, expected, 2e3), "{drawn} is not {expected}");
                        }
                    }
                }
            }
        }

        /// The cost is that of the file: every primitive is drawn once for every node that shows
        /// it, images count once, and geometry is the buffer.
        #[test]
        fn cost_counts_what_the_file_has(scene in scenes()) {
            let glb = glb_from_scene(&scene, &uris(&scene)).unwrap();
            let (json, _) = split(&glb);
            let document: Value = serde_json::from_slice(json).unwrap();
            let count = |value: &Value| value.as_array().map_or(0, |values| values.len() as u64);
            let nodes = document["nodes"].as_array().into_iter().flatten();
            let drawn = nodes.filter_map(|node| node["mesh"].as_u64());
            let draw_calls = drawn.map(|mesh| count(&document["meshes"][mesh as usize]["primitives"]));
            let texture_bytes = document["images"].as_array().into_iter().flatten().map(|image| {
                let uri = image["uri"].as_str().unwrap();
                let image = &scene.images[uri[6..9].parse::<usize>().unwrap()];
                image.texels.len() as u64 * 4
            });
            prop_assert_eq!(cost(&scene), Cost {
                triangles: scene.drawn_triangles(),
                draw_calls: draw_calls.sum(),
                texture_bytes: texture_bytes.sum(),
                geometry_bytes: document["buffers"][0]["byteLength"].as_u64().unwrap_or(0),
            });
        }
    }

    /// A row of `count` vertices, each used by a triangle.
    fn row(count: u32) -> Scene {
        let n = count as usize;
        Scene {
            positions: (0..count).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect(),
            normals: vec![Vec3::Z; n],
            uvs: vec![Vec2::ZERO; n],
            colors: vec![Vec4::ONE; n],
            triangles: (0..count - 2).map(|i| [i, i + 1, i + 2]).collect(),
            triangle_materials: vec![0; n - 2],
            meshes: vec![Mesh {
                vertices: 0..count,
                triangles: 0..count - 2,
            }],
            objects: vec![Object {
                name: "row".into(),
                mesh: 0,
                world_from_mesh: DAffine3::IDENTITY,
            }],
            materials: vec![Material {
                unlit: true,
                ..Material::default()
            }],
            ..Scene::default()
        }
    }

    /// The greatest value of an index type is not an index.
    #[test]
    fn indices_grow_when_they_must() {
        for (count, index_bytes, component_type) in [(65535, 2, 5123), (65536, 4, 5125)] {
            let scene = row(count);
            let bytes = cost(&scene).geometry_bytes;
            let triangles = u64::from(count) - 2;
            assert_eq!(bytes, u64::from(count) * 12 + triangles * 3 * index_bytes);
            let glb = glb_from_scene(&scene, &[]).unwrap();
            let (json, bin) = split(&glb);
            let root: gltf_json::Root = gltf_json::deserialize::from_slice(json).unwrap();
            assert_eq!(check_document(&root, bin), Ok(()));
            let document: Value = serde_json::from_slice(json).unwrap();
            assert_eq!(document["accessors"][1]["componentType"], component_type);
            let indices = numbers(&root, bin, &json!(1));
            assert_eq!(indices.last(), Some(&(f64::from(count) - 1.0)));
        }
    }

    /// City coordinates keep their millimetres, objects that share a mesh share it in the file,
    /// and names of any kind are kept.
    #[test]
    fn far_objects_share_small_coordinates() {
        let mut scene = row(3);
        scene.objects[0].world_from_mesh.translation = DVec3::new(4_567_890.123, 0.0, -0.001);
        scene.objects.push(scene.objects[0].clone());
        scene.objects[1].name = "\"quoted\"\n".into();
        let glb = glb_from_scene(&scene, &[]).unwrap();
        let document: Value = serde_json::from_slice(split(&glb).0).unwrap();
        assert_eq!(document["nodes"][1]["name"], "\"quoted\"\n");
        assert_eq!(
            document["nodes"][1]["translation"],
            json!([4_567_890.123, 0.0, -0.001])
        );
        assert_eq!(document["nodes"][1]["mesh"], 0);
        assert_eq!(document["meshes"].as_array().unwrap().len(), 1);
        assert!(document["materials"][0]["extensions"]["KHR_materials_unlit"].is_object());
        assert_eq!(document["extensionsUsed"], json!(["KHR_materials_unlit"]));
    }

    #[test]
    fn an_empty_scene_is_a_file_too() {
        let glb = glb_from_scene(&Scene::default(), &[]).unwrap();
        let (json, bin) = split(&glb);
        let root: gltf_json::Root = gltf_json::deserialize::from_slice(json).unwrap();
        assert_eq!(check_document(&root, bin), Ok(()));
        assert!(bin.is_empty());
    }
}
