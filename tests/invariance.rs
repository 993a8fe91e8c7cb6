//! Neither the unit nor the origin of a scene's coordinates matters.

use crate::setup::{contents, options, write_glb};
use farfield_bundle::{LayeredBody, Manifest};
use farfield_scene::{Material, Mesh, Object, Scene};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use proptest::prelude::*;
use std::path::PathBuf;
use xtask::{Console, SceneChoice, bake};

/// What a bake made of a scene.
struct Made {
    manifest: Manifest,
    pages: Vec<(PathBuf, Vec<u8>)>,
}

impl Made {
    fn body(&self) -> &LayeredBody {
        self.manifest.impostors[0].body.layers()
    }
}

/// Bakes a scene from a glTF file, as seen from the default view cell.
fn made(scene: &Scene, resolution: u32) -> Made {
    let folder = tempfile::tempdir().unwrap();
    let file = SceneChoice::File(write_glb(scene, folder.path()));
    let out = folder.path().join("bundle");
    bake(&options(file, resolution, &out), &Console::Silent).expect("the scene bakes");
    let mut pages = contents(&out);
    pages.retain(|(name, _)| name.starts_with("pages"));
    assert!(!pages.is_empty());
    let manifest = farfield_bundle::read(&out).expect("the bundle is sound");
    Made { manifest, pages }
}

/// A scene that is moved and then scaled by the transforms of its objects, which are f64.
fn placed(scene: &Scene, by: DVec3, scale: f64) -> Scene {
    let mut scene = scene.clone();
    let change = DAffine3::from_scale(DVec3::splat(scale)) * DAffine3::from_translation(by);
    for object in &mut scene.objects {
        object.world_from_mesh = change * object.world_from_mesh;
    }
    scene
}

/// A scene of unturned objects that is moved and then scaled by its vertices, which are f32.
fn remeshed(scene: &Scene, by: Vec3, scale: f32) -> Scene {
    let mut scene = scene.clone();
    for position in &mut scene.positions {
        *position = (*position + by) * scale;
    }
    for object in &mut scene.objects {
        object.world_from_mesh.translation *= f64::from(scale);
    }
    scene
}

/// Says where two bakes differ, of which the second one's lengths are `scale` times as large.
fn check_same(a: &Made, b: &Made, scale: f64) -> Result<(), String> {
    let same = |what: &str, a: f64, b: f64| {
        // A coordinate at 10^6 m is rounded to 10^-10 m, and depths here are 1 m and more.
        let near = (a * scale - b).abs() <= 1e-9 * (a * scale).abs();
        near.then_some(())
            .ok_or_else(|| format!("{what}: {a} times {scale} is not {b}"))
    };
    let (layers, others) = (&a.body().layers, &b.body().layers);
    if layers.len() != others.len() {
        return Err(format!("{} layers, {}", layers.len(), others.len()));
    }
    for (i, (a, b)) in layers.iter().zip(others).enumerate() {
        same(&format!("depth of layer {i}"), a.depth, b.depth)?;
        same(&format!("near of layer {i}"), a.near, b.near)?;
        same(&format!("far of layer {i}"), a.far, b.far)?;
        if (a.quads, &a.texels_sha256) != (b.quads, &b.texels_sha256) {
            return Err(format!("layer {i} has other texels"));
        }
    }
    match a.pages == b.pages {
        true => Ok(()),
        false => Err("the pages differ".into()),
    }
}

/// Far from the origin coordinates are rounded to 10^-10 m.
const FAR: [DVec3; 2] = [DVec3::new(1e6, 0.0, 0.0), DVec3::new(-1e6, 1e6, 1e6)];

/// Other units; the powers of two round nothing.
const SCALES: [f64; 4] = [1e6, 1e-6, MUCH as f64, 1.0 / MUCH as f64];

/// A power of two near 10^6.
const MUCH: f32 = (1 << 20) as f32;

fn check_placed(scene: &Scene, resolution: u32) -> Result<(), String> {
    let plain = made(scene, resolution);
    for scale in SCALES {
        let scaled = made(&placed(scene, DVec3::ZERO, scale), resolution);
        check_same(&plain, &scaled, scale).map_err(|e| format!("scaled by {scale}: {e}"))?;
    }
    for by in FAR {
        let moved = made(&placed(scene, by, 1.0), resolution);
        check_same(&plain, &moved, 1.0).map_err(|e| format!("moved by {by}: {e}"))?;
    }
    Ok(())
}

fn check_remeshed(scene: &Scene, resolution: u32) -> Result<(), String> {
    let plain = made(scene, resolution);
    for (by, scale) in [
        (Vec3::ZERO, MUCH),
        (Vec3::ZERO, 1.0 / MUCH),
        (Vec3::new(MUCH, 0.0, 0.0), 1.0),
        (Vec3::new(-MUCH, MUCH, MUCH), 1.0),
    ] {
        let other = made(&remeshed(scene, by, scale), resolution);
        check_same(&plain, &other, scale.into())
            .map_err(|e| format!("moved by {by}, scaled by {scale}: {e}"))?;
    }
    Ok(())
}

/// One-metre triangles in a box of 20 m, in three objects.
fn soup(corners: &[[[f32; 3]; 3]], color: [f32; 3]) -> Scene {
    let mut scene = Scene::default();
    scene.materials.push(Material {
        base_color: Vec3::from(color).extend(1.0),
        double_sided: true,
        ..Material::default()
    });
    for (i, part) in corners.chunks(corners.len().div_ceil(3)).enumerate() {
        let (vertex, triangle) = (scene.positions.len() as u32, scene.triangles.len() as u32);
        for [a, b, c] in part.iter().map(|t| t.map(Vec3::from)) {
            let first = scene.positions.len() as u32;
            let center = 10.0 * a;
            scene.positions.extend([center + a, center + b, center + c]);
            let normal = (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Y);
            scene.normals.extend([normal; 3]);
            scene.triangles.push([first, first + 1, first + 2]);
        }
        scene.meshes.push(Mesh {
            vertices: vertex..scene.positions.len() as u32,
            triangles: triangle..scene.triangles.len() as u32,
        });
        scene.objects.push(Object {
            name: format!("part {i}"),
            mesh: i as u32,
            world_from_mesh: DAffine3::from_translation(DVec3::splat(i as f64)),
        });
    }
    scene.uvs.resize(scene.positions.len(), Vec2::ZERO);
    scene.colors.resize(scene.positions.len(), Vec4::ONE);
    scene.triangle_materials.resize(scene.triangles.len(), 0);
    scene
}

fn triangles() -> impl Strategy<Value = Vec<[[f32; 3]; 3]>> {
    let corner = || prop::array::uniform3(-1f32..1.0);
    prop::collection::vec(prop::array::uniform3(corner()), 3..60)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// However the nodes of a file place its meshes.
    #[test]
    fn triangles_bake_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
    ) {
        prop_assert_eq!(check_placed(&soup(&corners, color), 64), Ok(()));
    }

    /// However large the coordinates of its vertices are, as far as an f32 can tell them apart:
    /// at 2^20 m, by eighths of a metre.
    #[test]
    fn vertices_bake_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
    ) {
        let mut scene = soup(&corners, color);
        for position in &mut scene.positions {
            *position = (*position * 8.0).round() / 8.0;
        }
        // One that is surely no line.
        scene.positions[..3].copy_from_slice(&[Vec3::X, Vec3::Y, Vec3::Z]);
        prop_assert_eq!(check_remeshed(&scene, 64), Ok(()));
    }
}

#[test]
fn the_house_bakes_alike_in_any_unit_and_at_any_place() {
    assert_eq!(check_placed(&farfield_town::house(0), 96), Ok(()));
}
