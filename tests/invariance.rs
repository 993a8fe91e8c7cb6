//! Neither the unit nor the origin of a scene's coordinates matters.

use crate::setup::{contents, display, write_glb};
use farfield_bundle::{Body, Impostor, LayeredBody};
use farfield_scene::{Material, Mesh, Object, Scene};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use proptest::prelude::*;
use std::path::PathBuf;
use xtask::{Arrangement, BakeOptions, Channels, Console, Making, SceneChoice, ViewCellSpec, bake};

/// How a scene is baked that is neither moved nor scaled.
type Way = fn(SceneChoice) -> BakeOptions;

/// Pixels along each side of the promised camera.
const RESOLUTION: u32 = 64;

/// As layers, from before.
fn layered(scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        resolution: RESOLUTION,
        ..BakeOptions::new(scene)
    }
}

/// The same for an engine that lights them.
fn lit_by_engines(scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        channels: Channels::Pbr,
        ..layered(scene)
    }
}

/// As a mesh.
fn meshed(scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        making: Making::Tdm { enlarged: 1.5 },
        ..layered(scene)
    }
}

/// What is far from a cell amid it.
fn amid(scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        view_cell: Some(ViewCellSpec::Box {
            center: DVec3::new(0.5, 0.0, -0.25),
            size: DVec3::new(1.0, 0.5, 1.0),
        }),
        arrangement: Arrangement::Far(3.0),
        ..layered(scene)
    }
}

/// From all around, as near as is usual.
fn around(scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        arrangement: Arrangement::Around(None),
        ..layered(scene)
    }
}

/// From all around, as near as is asked for.
fn near_around(scene: SceneChoice) -> BakeOptions {
    BakeOptions {
        arrangement: Arrangement::Around(Some(120.0)),
        ..layered(scene)
    }
}

/// Moves what is at the origin to `by`, and then multiplies all lengths.
#[derive(Clone, Copy)]
struct Change {
    by: DVec3,
    scale: f64,
}

impl Change {
    const NONE: Self = Self {
        by: DVec3::ZERO,
        scale: 1.0,
    };

    fn place(self, point: DVec3) -> DVec3 {
        (point + self.by) * self.scale
    }

    /// The same bake, of a scene that was changed.
    fn of(self, options: BakeOptions) -> BakeOptions {
        let view_cell = options.view_cell.map(|cell| match cell {
            ViewCellSpec::Box { center, size } => ViewCellSpec::Box {
                center: self.place(center),
                size: size * self.scale,
            },
            ViewCellSpec::Shaft { .. } => panic!("no way has a shaft"),
        });
        let arrangement = match options.arrangement {
            Arrangement::Far(distance) => Arrangement::Far(distance * self.scale),
            Arrangement::Around(distance) => {
                Arrangement::Around(distance.map(|distance| distance * self.scale))
            }
            Arrangement::Before => Arrangement::Before,
        };
        BakeOptions {
            view_cell,
            arrangement,
            ..options
        }
    }
}

/// What a bake made of a scene.
struct Made {
    change: Change,
    impostors: Vec<Impostor>,
    display: Scene,
    pages: Vec<(PathBuf, Vec<u8>)>,
}

/// Bakes a scene that was changed, from a glTF file; `None` where nothing is far.
fn made(scene: &Scene, way: Way, change: Change) -> Option<Made> {
    let folder = tempfile::tempdir().unwrap();
    let file = SceneChoice::File(write_glb(scene, folder.path()));
    let out = folder.path().join("bundle");
    let options = BakeOptions {
        out: Some(out.clone()),
        ..change.of(way(file))
    };
    if let Err(error) = bake(&options, &Console::Silent) {
        assert!(format!("{error:#}").contains("lower --far"), "{error:#}");
        return None;
    }
    let mut pages = contents(&out);
    pages.retain(|(name, _)| name.starts_with("pages"));
    assert!(!pages.is_empty());
    let manifest = farfield_bundle::read(&out).expect("the bundle is sound");
    Some(Made {
        change,
        impostors: manifest.impostors,
        display: display(&out),
        pages,
    })
}

/// A scene that is changed by the transforms of its objects, which are f64.
fn placed(scene: &Scene, Change { by, scale }: Change) -> Scene {
    let mut scene = scene.clone();
    let change = DAffine3::from_scale(DVec3::splat(scale)) * DAffine3::from_translation(by);
    for object in &mut scene.objects {
        object.world_from_mesh = change * object.world_from_mesh;
    }
    scene
}

/// A scene of unturned objects that is changed by its vertices, which are f32.
fn remeshed(scene: &Scene, Change { by, scale }: Change) -> Scene {
    let mut scene = scene.clone();
    for position in &mut scene.positions {
        *position = (*position + by.as_vec3()) * scale as f32;
    }
    for object in &mut scene.objects {
        object.world_from_mesh.translation *= scale;
    }
    scene
}

/// Says where two bakes differ, the first of a scene that was not changed.
fn check_same(a: &Made, b: &Made) -> Result<(), String> {
    check_same_layers(a, b)?;
    let counts = |made: &Made| -> Vec<Option<[u64; 4]>> {
        made.impostors
            .iter()
            .map(|one| mesh_counts(&one.body))
            .collect()
    };
    let (one, other) = (counts(a), counts(b));
    if one != other {
        return Err(format!("counts of meshes: {one:?}, {other:?}"));
    }
    check_same_display(&a.display, &b.display, b.change)?;
    match a.pages == b.pages {
        true => Ok(()),
        false => Err("the pages differ".into()),
    }
}

/// Triangles, before and after simplification, pieces and charts.
fn mesh_counts(body: &Body) -> Option<[u64; 4]> {
    match body {
        Body::Layered(_) | Body::Bitfields(_) => None,
        Body::Tdm(mesh) => Some([
            mesh.initial_triangles,
            mesh.triangles,
            mesh.pieces,
            mesh.charts,
        ]),
    }
}

/// Says where what two bakes recorded differs.
fn check_same_layers(a: &Made, b: &Made) -> Result<(), String> {
    let (count, other) = (a.impostors.len(), b.impostors.len());
    if count != other {
        return Err(format!("{count} impostors, {other}"));
    }
    for (one, other) in a.impostors.iter().zip(&b.impostors) {
        if one.side != other.side {
            return Err("other sides".into());
        }
        let (layers, others) = (one.body.layers().unwrap(), other.body.layers().unwrap());
        check_same_body(layers, others, b.change.scale)
            .map_err(|e| format!("{:?}: {e}", one.side))?;
    }
    Ok(())
}

fn check_same_body(a: &LayeredBody, b: &LayeredBody, scale: f64) -> Result<(), String> {
    let same = |what: &str, a: f64, b: f64| {
        // A coordinate at 10^6 m is rounded to 10^-10 m, and depths here are 1 m and more.
        let near = (a * scale - b).abs() <= 1e-9 * (a * scale).abs();
        near.then_some(())
            .ok_or_else(|| format!("{what}: {a} times {scale} is not {b}"))
    };
    let (layers, others) = (&a.layers, &b.layers);
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
    Ok(())
}

/// The same triangles at the places to which they were changed.
fn check_same_display(a: &Scene, b: &Scene, change: Change) -> Result<(), String> {
    if a.triangles != b.triangles || a.uvs != b.uvs {
        return Err("other triangles are shown".into());
    }
    let [min, max] = a.bounds().expect("something is shown");
    let [a, b] = [a, b].map(|scene| scene.triangles_in_world().flatten());
    for (a, b) in a.zip(b) {
        // Coordinates in the file are f32, relative to the middle of an impostor, and quads reach
        // over what they represent.
        let near = change
            .place(a)
            .abs_diff_eq(b, 1e-6 * min.distance(max) * change.scale);
        if !near {
            return Err(format!("{a} came to {b}, not {}", change.place(a)));
        }
    }
    Ok(())
}

/// To other places; far from the origin coordinates are rounded to 10^-10 m. And in other units; the
/// powers of two round nothing.
const CHANGES: [Change; 6] = [
    scaled(1e6),
    scaled(1e-6),
    scaled(MUCH),
    scaled(1.0 / MUCH),
    moved(DVec3::new(1e6, 0.0, 0.0)),
    moved(DVec3::new(-1e6, 1e6, 1e6)),
];

/// Those that vertices of f32 can take.
const EXACT: [Change; 4] = [
    scaled(MUCH),
    scaled(1.0 / MUCH),
    moved(DVec3::new(MUCH, 0.0, 0.0)),
    moved(DVec3::new(-MUCH, MUCH, MUCH)),
];

/// A power of two near 10^6.
const MUCH: f64 = (1 << 20) as f64;

const fn scaled(scale: f64) -> Change {
    Change {
        by: DVec3::ZERO,
        scale,
    }
}

const fn moved(by: DVec3) -> Change {
    Change { by, scale: 1.0 }
}

/// Compares the bakes of a scene before and after each change.
fn check(
    scene: &Scene,
    way: Way,
    changes: &[Change],
    changed: fn(&Scene, Change) -> Scene,
    same: fn(&Made, &Made) -> Result<(), String>,
) -> Result<(), String> {
    let plain = made(scene, way, Change::NONE);
    for change in changes {
        let Change { by, scale } = change;
        let other = made(&changed(scene, *change), way, *change);
        match (&plain, &other) {
            (Some(plain), Some(other)) => same(plain, other),
            (None, None) => Ok(()),
            _ => Err("one of them shows nothing".into()),
        }
        .map_err(|e| format!("moved by {by}, scaled by {scale}: {e}"))?;
    }
    Ok(())
}

/// One-metre triangles in a box of 20 m, in up to so many objects.
fn soup(corners: &[[[f32; 3]; 3]], color: [f32; 3], objects: usize) -> Scene {
    let mut scene = Scene::default();
    scene.materials.push(Material {
        base_color: Vec3::from(color).extend(1.0),
        double_sided: true,
        ..Material::default()
    });
    for (i, part) in corners.chunks(corners.len().div_ceil(objects)).enumerate() {
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
        let scene = soup(&corners, color, 3);
        prop_assert_eq!(check(&scene, layered, &CHANGES, placed, check_same), Ok(()));
    }

    /// However large the coordinates of its vertices are, as far as an f32 can tell them apart:
    /// at 2^20 m, by eighths of a metre.
    #[test]
    fn vertices_bake_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
    ) {
        let mut scene = soup(&corners, color, 3);
        for position in &mut scene.positions {
            *position = (*position * 8.0).round() / 8.0;
        }
        // One that is surely no line.
        scene.positions[..3].copy_from_slice(&[Vec3::X, Vec3::Y, Vec3::Z]);
        prop_assert_eq!(check(&scene, layered, &EXACT, remeshed, check_same), Ok(()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]

    #[test]
    fn what_engines_light_bakes_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
    ) {
        let scene = soup(&corners, color, 3);
        prop_assert_eq!(check(&scene, lit_by_engines, &CHANGES, placed, check_same), Ok(()));
    }

    /// Meshes are equal where nothing is rounded; elsewhere the layers they are made from are, as
    /// the last digits decide in which order edges are removed.
    #[test]
    fn meshes_bake_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
    ) {
        let scene = soup(&corners, color, 3);
        prop_assert_eq!(check(&scene, meshed, &CHANGES, placed, check_same_layers), Ok(()));
        let unrounded = [scaled(MUCH), scaled(1.0 / MUCH)];
        prop_assert_eq!(check(&scene, meshed, &unrounded, placed, check_same), Ok(()));
    }

    #[test]
    fn what_is_far_bakes_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
    ) {
        let scene = soup(&corners, color, corners.len());
        prop_assert_eq!(check(&scene, amid, &CHANGES, placed, check_same), Ok(()));
    }

    #[test]
    fn views_from_all_around_bake_alike_in_any_unit_and_at_any_place(
        corners in triangles(),
        color in prop::array::uniform3(0.1f32..1.0),
        way in prop::sample::select(vec![around as Way, near_around]),
    ) {
        let scene = soup(&corners, color, 3);
        prop_assert_eq!(check(&scene, way, &CHANGES, placed, check_same), Ok(()));
    }
}

#[test]
fn the_house_bakes_alike_in_any_unit_and_at_any_place() {
    let larger: Way = |scene| BakeOptions {
        resolution: 96,
        ..layered(scene)
    };
    let house = farfield_town::house(0);
    assert_eq!(check(&house, larger, &CHANGES, placed, check_same), Ok(()));
}
