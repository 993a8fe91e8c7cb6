//! Whether a bundle's file holds the original: all its triangles, as they look.

use crate::drawn;
use anyhow::{Result, bail};
use farfield_scene::{Material, Scene};

/// How the triangles of a file are those of the original.
pub(super) struct Same {
    /// Where in the file each triangle of the original is.
    pub(super) places: Vec<u32>,
    /// In what they look different, a sentence each.
    pub(super) faults: Vec<String>,
}

/// Matches the triangles of a file with those of the original, part by part.
///
/// Corners are compared bit by bit: a bake computes them from the original as it is done here.
///
/// # Errors
///
/// When the file does not hold the same triangles.
pub(super) fn compare(original: &Scene, display: &Scene, parts: &[u32]) -> Result<Same> {
    let is_placed = match (&original.objects[..], &display.objects[..]) {
        ([original], [object]) => {
            let drawn = &display.meshes[object.mesh as usize].triangles;
            object.world_from_mesh == original.world_from_mesh
                && *drawn == (0..display.triangles.len() as u32)
        }
        _ => false,
    };
    if !is_placed {
        bail!("does not draw one object at the centre of the original: bake again");
    }
    let counts = [original, display].map(|scene| scene.triangles.len());
    if drawn::parts(original) != parts || drawn::parts(display) != parts {
        bail!(
            "draws {} triangles in other primitives than the original's {} or than the lists say: bake \
             again",
            counts[1],
            counts[0]
        );
    }
    let mut places = vec![0; counts[0]];
    let mut faults = Vec::new();
    for part in parts.windows(2) {
        let [ours, theirs] = [original, display].map(|scene| sorted(scene, part[0]..part[1]));
        let differing = ours.iter().zip(&theirs).filter(|(a, b)| a.0 != b.0).count();
        if differing > 0 {
            bail!(
                "draws other triangles than the original: {differing} of {} differ from number {} on; \
                 bake again",
                part[1] - part[0],
                part[0]
            );
        }
        let [material, shown] = [original, display]
            .map(|scene| &scene.materials[scene.triangle_materials[part[0] as usize] as usize]);
        let name = &material.name;
        if let Some(what) = difference([original, display], [material, shown]) {
            faults.push(format!(
                "the material '{name}' has another {what} than the original's"
            ));
        }
        let mut unlike = 0;
        for ((_, a), (_, b)) in ours.into_iter().zip(theirs) {
            places[a as usize] = b;
            let corners =
                (original.triangles[a as usize].iter()).zip(display.triangles[b as usize]);
            let is_alike = |(a, b): (&u32, u32)| {
                is_alike([original, display], [*a as usize, b as usize], material)
            };
            unlike += u64::from(!corners.into_iter().all(is_alike));
        }
        if unlike > 0 {
            faults.push(format!(
                "{unlike} triangles of the material '{name}' have other normals, texture coordinates or \
                 colours than the original's"
            ));
        }
    }
    Ok(Same { places, faults })
}

/// The triangles of a part, ordered by the bits of their corners; those with the same ones as they are
/// drawn, which decides what of them is seen.
fn sorted(scene: &Scene, part: std::ops::Range<u32>) -> Vec<([[u32; 3]; 3], u32)> {
    let bits = |vertex: u32| {
        scene.positions[vertex as usize]
            .to_array()
            .map(f32::to_bits)
    };
    let keyed = part.map(|triangle| (scene.triangles[triangle as usize].map(bits), triangle));
    let mut all: Vec<_> = keyed.collect();
    all.sort_unstable();
    all
}

/// Whether a vertex looks like another one, as far as the material shows it.
fn is_alike([a, b]: [&Scene; 2], [i, j]: [usize; 2], material: &Material) -> bool {
    // Normals are made as long as 1 when they are written and read.
    let normal = material.unlit || a.normals[i].abs_diff_eq(b.normals[j], 1e-5);
    let textures = [
        material.base_color_texture,
        material.normal_texture,
        material.metallic_roughness_texture,
        material.emissive_texture,
    ];
    let is_textured = textures.iter().any(Option::is_some);
    let uv = !is_textured || a.uvs[i] == b.uvs[j];
    // Files hold no more than 1.
    let color = a.colors[i].clamp(glam::Vec4::ZERO, glam::Vec4::ONE);
    normal && uv && color == b.colors[j]
}

/// In what a material looks different from another one.
fn difference(scenes: [&Scene; 2], [a, b]: [&Material; 2]) -> Option<&'static str> {
    let texture = |of: fn(&Material) -> Option<u32>| {
        let [a, b] = [0, 1].map(|i| {
            let material = [a, b][i];
            of(material).map(|texture| {
                let texture = &scenes[i].textures[texture as usize];
                let image = &scenes[i].images[texture.image as usize];
                (
                    texture.wrap,
                    texture.filter,
                    image.width,
                    image.height,
                    &image.texels,
                )
            })
        });
        a != b
    };
    let lit = !a.unlit;
    // The file has it as a product.
    let emission = (a.emissive - b.emissive).abs().max_element();
    [
        (a.base_color != b.base_color, "base colour"),
        (texture(|m| m.base_color_texture), "base colour texture"),
        (a.alpha != b.alpha, "alpha mode"),
        (a.double_sided != b.double_sided, "sidedness"),
        (a.unlit != b.unlit, "lighting"),
        (a.metallic != b.metallic, "metallic factor"),
        (a.roughness != b.roughness, "roughness"),
        (
            lit && emission > 1e-6 * a.emissive.max_element(),
            "emission",
        ),
        (lit && texture(|m| m.emissive_texture), "emissive texture"),
        (lit && texture(|m| m.normal_texture), "normal texture"),
        (
            lit && a.normal_texture.is_some() && a.normal_scale != b.normal_scale,
            "normal scale",
        ),
        (
            lit && texture(|m| m.metallic_roughness_texture),
            "metallic-roughness texture",
        ),
    ]
    .into_iter()
    .find_map(|(differs, what)| differs.then_some(what))
}
