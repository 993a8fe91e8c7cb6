//! Simplified meshes: meshoptimizer's simplification and its sloppy mode, on whole scenes.

use farfield_bundle::cost;
use farfield_sampling::{linear_from_srgb, srgb_from_linear};
use farfield_scene::{Image, Mesh, Scene};
use glam::{Vec2, Vec3, Vec4};
use meshopt::{SimplifyOptions, VertexDataAdapter, simplify_sloppy, simplify_with_update};
use std::collections::{BTreeMap, BTreeSet};

/// How to simplify.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// Edge collapses; positions and attributes are fitted to the original, small parts removed.
    KeepingSeams,
    /// The same, but collapses may cross seams between attributes, at their price: without, facades
    /// of single rectangles do not get simpler.
    CrossingSeams,
    /// Vertices merged on a lattice, whatever the surface's topology.
    Sloppy,
}

/// How much may be left.
#[derive(Clone, Copy)]
pub(crate) enum Budget {
    /// Drawn triangles.
    Triangles(u64),
    /// Geometry and textures.
    Bytes(u64),
}

/// A simplified scene, and what should be known about it.
pub(crate) struct Simplified {
    pub(crate) scene: Scene,
    pub(crate) notes: Vec<String>,
}

/// Halvings of the interval of errors, which spans 2^40.
const HALVINGS: u32 = 24;

/// Simplifies a scene down to a budget; every mesh by the same error in the world, whatever it is.
///
/// Nothing is locked. Normals, texture coordinates and colours count as errors where materials
/// show them. Where bytes are counted, textures that do not change the picture are left out, and
/// the others halved until they take at most half of the bytes.
pub(crate) fn simplify(scene: &Scene, method: Method, budget: Budget) -> Simplified {
    let mut notes = Vec::new();
    let scene = match budget {
        Budget::Triangles(_) => scene.clone(),
        Budget::Bytes(bytes) => {
            let (slim, halvings) = with_small_textures(scene, bytes / 2);
            if cost(&slim).texture_bytes < cost(scene).texture_bytes {
                notes.push(format!(
                    "textures that diffuse light does not show left out, the others halved \
                     {halvings} times"
                ));
            }
            slim
        }
    };
    let fits = |scene: &Scene| match budget {
        Budget::Triangles(most) => scene.drawn_triangles() <= most,
        Budget::Bytes(most) => {
            let cost = cost(scene);
            cost.geometry_bytes + cost.texture_bytes <= most
        }
    };
    if fits(&scene) {
        notes.push("the original's triangles fit".into());
        return Simplified { scene, notes };
    }
    let parts = parts(&scene);
    let extent = scene
        .bounds()
        .map_or(1.0, |[min, max]| (max - min).max_element());
    let with_error = |log_error: f64| -> Vec<Part> {
        let error = (extent * log_error.exp2()) as f32;
        parts
            .iter()
            .map(|part| part.with_error(method, error))
            .collect()
    };
    // The extent itself is an error that leaves next to nothing.
    let (mut low, mut high) = (-32.0, 8.0);
    let mut best = with_error(high);
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        let parts = with_error(middle);
        if fits(&assembled(&scene, &parts)) {
            (high, best) = (middle, parts);
        } else {
            low = middle;
        }
    }
    // By error the count comes out a little below: share out what is left.
    if let Budget::Triangles(most) = budget {
        let reached = assembled(&scene, &best).drawn_triangles().max(1);
        let to_count = |(part, reached_part): (&Part, &Part)| {
            let count = reached_part.indices.len() as u64 / 3 * most / reached;
            part.with_count(method, count as usize * 3)
        };
        let finer: Vec<Part> = parts.iter().zip(&best).map(to_count).collect();
        if fits(&assembled(&scene, &finer)) {
            best = finer;
        }
    }
    let scene = assembled(&scene, &best);
    if !fits(&scene) {
        notes.push("does not get down to the budget".into());
    }
    Simplified { scene, notes }
}

/// Numbers of a vertex beside its position: normal, texture coordinates, colour.
const ATTRIBUTES: usize = 9;

/// The triangles of one material in one mesh.
#[derive(Clone)]
struct Part {
    mesh: usize,
    material: u32,
    /// The greatest factor by which an object enlarges the mesh.
    scale: f32,
    /// Longest side of the bounds of its positions.
    extent: f32,
    positions: Vec<[f32; 3]>,
    /// `ATTRIBUTES` a vertex.
    attributes: Vec<f32>,
    /// What an attribute's error counts, against one of the positions relative to the extent.
    weights: [f32; ATTRIBUTES],
    indices: Vec<u32>,
}

/// What a unit normal's error counts: the usual half.
const NORMAL_WEIGHT: f32 = 0.5;

/// No limit, but finite when squared.
const ANY_ERROR: f32 = 1e9;

impl Part {
    /// As little as is within an error, in metres in the world.
    fn with_error(&self, method: Method, error: f32) -> Self {
        self.reduced(method, 0, error / self.scale)
    }

    /// The best with at most so many indices.
    fn with_count(&self, method: Method, count: usize) -> Self {
        self.reduced(method, count, ANY_ERROR)
    }

    fn reduced(&self, method: Method, count: usize, error: f32) -> Self {
        let mut part = self.clone();
        match method {
            Method::KeepingSeams | Method::CrossingSeams => {
                let mut options = SimplifyOptions::Prune | SimplifyOptions::ErrorAbsolute;
                options.set(SimplifyOptions::Permissive, method == Method::CrossingSeams);
                let count = simplify_with_update(
                    &mut part.indices,
                    &mut part.positions,
                    &mut part.attributes,
                    &self.weights,
                    size_of::<[f32; ATTRIBUTES]>(),
                    None,
                    count,
                    error,
                    options,
                    None,
                );
                part.indices.truncate(count);
            }
            Method::Sloppy => {
                let bytes = meshopt::typed_to_bytes(&self.positions);
                let vertices = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0)
                    .expect("positions are whole");
                let error = (error / self.extent).min(1.0);
                part.indices = simplify_sloppy(&self.indices, &vertices, count, error, None);
            }
        }
        part
    }
}

/// The parts of a scene, vertices that differ in nothing a material shows made one.
fn parts(scene: &Scene) -> Vec<Part> {
    let mut parts = Vec::new();
    for (mesh_index, mesh) in scene.meshes.iter().enumerate() {
        let triangles = mesh.triangles.start as usize..mesh.triangles.end as usize;
        let materials: BTreeSet<u32> = scene.triangle_materials[triangles.clone()]
            .iter()
            .copied()
            .collect();
        let scale = scene
            .objects
            .iter()
            .filter(|object| object.mesh as usize == mesh_index);
        let scale = scale
            .flat_map(|object| {
                let m = object.world_from_mesh.matrix3;
                [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()]
            })
            .fold(0.0, f64::max);
        for material in materials {
            let of_material = triangles
                .clone()
                .filter(|&t| scene.triangle_materials[t] == material);
            let triangles: Vec<[u32; 3]> = of_material.map(|t| scene.triangles[t]).collect();
            parts.push(part(scene, mesh_index, material, scale as f32, &triangles));
        }
    }
    parts
}

fn part(scene: &Scene, mesh: usize, material: u32, scale: f32, triangles: &[[u32; 3]]) -> Part {
    let look = &scene.materials[material as usize];
    let textures = [
        look.base_color_texture,
        look.normal_texture,
        look.emissive_texture,
    ];
    let textured = textures.iter().any(Option::is_some);
    let mut positions: Vec<[f32; 3]> = Vec::new();
    let mut attributes: Vec<f32> = Vec::new();
    let mut known = BTreeMap::new();
    let mut index_of = |&vertex: &u32| {
        let vertex = vertex as usize;
        let normal = if look.unlit {
            Vec3::Y
        } else {
            scene.normals[vertex]
        };
        let uv = if textured {
            scene.uvs[vertex]
        } else {
            Vec2::ZERO
        };
        let position = scene.positions[vertex].to_array();
        let mut shown = [0.0; ATTRIBUTES];
        shown[..3].copy_from_slice(&normal.to_array());
        shown[3..5].copy_from_slice(&uv.to_array());
        shown[5..].copy_from_slice(&scene.colors[vertex].to_array());
        let key = (position.map(f32::to_bits), shown.map(f32::to_bits));
        *known.entry(key).or_insert_with(|| {
            positions.push(position);
            attributes.extend(shown);
            positions.len() as u32 - 1
        })
    };
    let indices: Vec<u32> = triangles.iter().flatten().map(&mut index_of).collect();
    let points = || positions.iter().copied().map(Vec3::from);
    let (min, max) = points().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| {
        (min.min(p), max.max(p))
    });
    // A flat or empty part must not divide by nothing.
    let extent = (max - min).max_element().max(f32::MIN_POSITIVE);

    // A texture that moves by a length is as wrong as a surface that does.
    let mut areas = [0.0, 0.0];
    for [a, b, c] in triangles.iter().map(|t| t.map(|v| v as usize)) {
        let p = |v: usize| scene.positions[v];
        areas[0] += (p(b) - p(a)).cross(p(c) - p(a)).length();
        areas[1] += (scene.uvs[b] - scene.uvs[a])
            .perp_dot(scene.uvs[c] - scene.uvs[a])
            .abs();
    }
    let uv_weight = match textured && areas[1] > 0.0 {
        true => (areas[0] / areas[1]).sqrt() / extent,
        false => 0.0,
    };
    let mut weights = [0.0; ATTRIBUTES];
    weights[..3].fill(if look.unlit { 0.0 } else { NORMAL_WEIGHT });
    weights[3..5].fill(uv_weight);
    weights[5..].fill(1.0);
    Part {
        mesh,
        material,
        scale: scale.max(f32::MIN_POSITIVE),
        extent,
        positions,
        attributes,
        weights,
        indices,
    }
}

/// The scene with the triangles of the parts in place of its own.
fn assembled(scene: &Scene, parts: &[Part]) -> Scene {
    let mut simple = Scene {
        objects: scene.objects.clone(),
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
        images: scene.images.clone(),
        ..Scene::default()
    };
    for mesh in 0..scene.meshes.len() {
        let starts = [simple.positions.len() as u32, simple.triangles.len() as u32];
        for part in parts.iter().filter(|part| part.mesh == mesh) {
            let first = simple.positions.len() as u32;
            simple
                .positions
                .extend(part.positions.iter().copied().map(Vec3::from));
            for attributes in part.attributes.chunks_exact(ATTRIBUTES) {
                let normal = Vec3::from_slice(attributes);
                simple
                    .normals
                    .push(normal.try_normalize().unwrap_or(Vec3::Y));
                simple.uvs.push(Vec2::from_slice(&attributes[3..]));
                simple.colors.push(Vec4::from_slice(&attributes[5..]));
            }
            for triangle in part.indices.chunks_exact(3) {
                simple
                    .triangles
                    .push([0, 1, 2].map(|i| first + triangle[i]));
                simple.triangle_materials.push(part.material);
            }
        }
        simple.meshes.push(Mesh {
            vertices: starts[0]..simple.positions.len() as u32,
            triangles: starts[1]..simple.triangles.len() as u32,
        });
    }
    simple
}

/// The scene without textures that diffuse light does not show, the others halved as often as
/// they take more than `most` bytes together; and how often that was.
fn with_small_textures(scene: &Scene, most: u64) -> (Scene, u32) {
    let mut slim = scene.clone();
    for material in &mut slim.materials {
        material.metallic_roughness_texture = None;
    }
    let colors = slim.materials.iter();
    let colors =
        colors.flat_map(|material| [material.base_color_texture, material.emissive_texture]);
    let colors: BTreeSet<u32> = colors
        .flatten()
        .map(|texture| slim.textures[texture as usize].image)
        .collect();
    let mut halvings = 0;
    while cost(&slim).texture_bytes > most
        && slim
            .images
            .iter()
            .any(|image| image.width.max(image.height) > 1)
    {
        for (i, image) in slim.images.iter_mut().enumerate() {
            *image = halved(image, colors.contains(&(i as u32)));
        }
        halvings += 1;
    }
    (slim, halvings)
}

/// An image of half the size; colours are averaged in linear light and weighted with alpha.
fn halved(image: &Image, is_color: bool) -> Image {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let decode = |c: u8| {
        let value = f32::from(c) / 255.0;
        if is_color {
            linear_from_srgb(value)
        } else {
            value
        }
    };
    let encode = |c: f32| {
        let value = if is_color { srgb_from_linear(c) } else { c };
        (value * 255.0).round() as u8
    };
    let mut texels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
                let x = (2 * x + dx).min(image.width - 1);
                let y = (2 * y + dy).min(image.height - 1);
                image.texels[(y * image.width + x) as usize]
            });
            let alpha: f32 = four.iter().map(|t| f32::from(t[3])).sum();
            // Where all are transparent, they count alike.
            let weight = |t: &[u8; 4]| match alpha > 0.0 {
                true => f32::from(t[3]) / alpha,
                false => 0.25,
            };
            let mean = |channel: usize| {
                four.iter()
                    .map(|t| decode(t[channel]) * weight(t))
                    .sum::<f32>()
            };
            texels.push([
                encode(mean(0)),
                encode(mean(1)),
                encode(mean(2)),
                (alpha / 4.0).round() as u8,
            ]);
        }
    }
    Image {
        name: image.name.clone(),
        width,
        height,
        texels,
    }
}
