//! Without a view cell, sky domes and strays are left out, and `verify` leaves out the same.

use crate::setup::{options, options_in_cell, verified, write_glb};
use farfield_bundle::Manifest;
use farfield_scene::{Material, Mesh, Object, Scene};
use glam::{DAffine3, Vec2, Vec3, Vec4};
use std::f32::consts::TAU;
use std::path::Path;
use xtask::{BakeOptions, BuiltIn, Console, SceneChoice, bake};

/// Adds a mesh in the world's space as an object of its own.
fn add(scene: &mut Scene, name: &str, positions: &[Vec3], triangles: &[[u32; 3]]) {
    let first = scene.positions.len() as u32;
    let vertices = first..first + positions.len() as u32;
    scene.positions.extend(positions);
    scene.normals.resize(vertices.end as usize, Vec3::Y);
    scene.uvs.resize(vertices.end as usize, Vec2::ZERO);
    scene.colors.resize(vertices.end as usize, Vec4::ONE);
    let start = scene.triangles.len() as u32;
    scene
        .triangles
        .extend(triangles.iter().map(|t| t.map(|v| v + first)));
    let end = scene.triangles.len() as u32;
    let material = scene.materials.len() as u32;
    scene.materials.push(Material::default());
    scene.triangle_materials.resize(end as usize, material);
    scene.meshes.push(Mesh {
        vertices,
        triangles: start..end,
    });
    scene.objects.push(Object {
        name: name.into(),
        mesh: scene.meshes.len() as u32 - 1,
        world_from_mesh: DAffine3::IDENTITY,
    });
}

/// A half sphere of latitudes from the ground to the zenith, its front inside; of a negative
/// radius it is a bowl, whose front is inside too.
fn add_dome(scene: &mut Scene, name: &str, radius: f32) {
    const AROUND: u32 = 16;
    const UP: u32 = 6;
    let at = |i: u32, j: u32| {
        let (around, up) = (
            TAU * i as f32 / AROUND as f32,
            TAU / 4.0 * j as f32 / UP as f32,
        );
        radius * Vec3::new(around.cos() * up.cos(), up.sin(), around.sin() * up.cos())
    };
    let positions: Vec<Vec3> = (0..=UP)
        .flat_map(|j| (0..AROUND).map(move |i| at(i, j)))
        .collect();
    let triangles: Vec<[u32; 3]> = (0..UP)
        .flat_map(|j| (0..AROUND).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let next = (i + 1) % AROUND;
            let [a, b] = [i, next].map(|i| j * AROUND + i);
            let [c, d] = [a, b].map(|v| v + AROUND);
            // A bowl is the dome mirrored in a point, which turns the winding.
            match radius > 0.0 {
                true => [[a, b, c], [b, d, c]],
                false => [[a, c, b], [b, c, d]],
            }
        })
        .collect();
    add(scene, name, &positions, &triangles);
}

fn house_and(change: impl FnOnce(&mut Scene), folder: &Path) -> SceneChoice {
    let mut scene = farfield_town::house(0);
    change(&mut scene);
    SceneChoice::File(write_glb(&scene, folder))
}

fn baked(options: &BakeOptions) -> Manifest {
    bake(options, &Console::Silent).expect("the scene bakes");
    let dir = options.out.as_deref().expect("the test names a folder");
    farfield_bundle::read(dir).expect("the bundle is sound")
}

fn default_options(scene: SceneChoice, folder: &Path) -> BakeOptions {
    options(scene, 256, &folder.join("bundle"))
}

/// The cell is that of the house alone, and what the bundle promises is kept, as `verify` leaves
/// out the same.
#[test]
fn a_dome_and_a_stray_are_left_out_of_bake_and_verify() {
    let folder = tempfile::tempdir().unwrap();
    let add_both = |scene: &mut Scene| {
        add_dome(scene, "sky", 300.0);
        let triangle = [Vec3::X, Vec3::Y, Vec3::Z].map(|v| v + 1e4);
        add(scene, "forgotten", &triangle, &[[0, 1, 2]]);
    };
    let scene = house_and(add_both, folder.path());
    let manifest = baked(&default_options(scene, folder.path()));
    assert_eq!(manifest.options.exclude, ["sky", "forgotten"]);
    let alone = SceneChoice::BuiltIn(BuiltIn::House);
    let alone = baked(&options(alone, 256, &folder.path().join("alone")));
    assert_eq!(manifest.options.view_space, alone.options.view_space);
    assert_eq!(manifest.statistics.before, alone.statistics.before);
    for name in ["'sky' is left out", "'forgotten' is left out"] {
        let says = |warning: &&String| warning.contains(name) && warning.contains("--view-cell");
        let count = manifest.warnings.iter().filter(says).count();
        assert_eq!(count, 1, "{name}: {:?}", manifest.warnings);
    }
    let verified = verified(&folder.path().join("bundle"), 27);
    assert!(verified.holds, "{verified:?}");
}

/// Whoever names a cell gets all that is there.
#[test]
fn with_a_view_cell_nothing_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let scene = house_and(|scene| add_dome(scene, "sky", 300.0), folder.path());
    let (cell, out) = ("box:0,100,900:100,100,100", folder.path().join("bundle"));
    let manifest = baked(&options_in_cell(scene, cell, 128, &out));
    assert!(manifest.options.exclude.is_empty());
    let house = farfield_town::house(0).drawn_triangles();
    assert!(manifest.statistics.before.triangles > house);
}

/// A valley around the house is as large as a dome, and open above; a shell seen from outside is
/// a building.
#[test]
fn valleys_and_buildings_stay() {
    let outside = |scene: &mut Scene| {
        add_dome(scene, "hall", 300.0);
        let mesh = scene.meshes.last().unwrap().triangles.clone();
        for triangle in &mut scene.triangles[mesh.start as usize..mesh.end as usize] {
            triangle.swap(0, 1);
        }
    };
    let changes: [&dyn Fn(&mut Scene); 2] = [&|scene| add_dome(scene, "valley", -300.0), &outside];
    for change in changes {
        let folder = tempfile::tempdir().unwrap();
        let scene = house_and(change, folder.path());
        let manifest = baked(&default_options(scene, folder.path()));
        assert!(manifest.options.exclude.is_empty(), "{manifest:?}");
    }
}

/// A name is all that a manifest has to leave out an object, so one that others share is no help.
#[test]
fn a_stray_with_the_name_of_another_object_stays_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let add_namesake = |scene: &mut Scene| {
        let name = scene.objects[0].name.clone();
        let triangle = [Vec3::X, Vec3::Y, Vec3::Z].map(|v| v - 1e4);
        add(scene, &name, &triangle, &[[0, 1, 2]]);
    };
    let scene = house_and(add_namesake, folder.path());
    let manifest = baked(&default_options(scene, folder.path()));
    assert!(manifest.options.exclude.is_empty());
    let says = |warning: &String| warning.contains("is not left out");
    assert!(
        manifest.warnings.iter().any(says),
        "{:?}",
        manifest.warnings
    );
}

/// Of all real models only the one in a sky dome has something that is left out.
#[test]
fn real_models_are_left_whole() {
    let Some(folder) = std::env::var_os("FARFIELD_MODELS") else {
        crate::setup::skipped("FARFIELD_MODELS names no folder");
        return;
    };
    let entries = std::fs::read_dir(folder).expect("the folder of models can be read");
    let mut models: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    models.retain(|path| path.extension().is_some_and(|e| e == "glb"));
    models.sort();
    for path in models {
        let folder = tempfile::tempdir().unwrap();
        let expected: &[&str] = match path.ends_with("VC.glb") {
            true => &["skbox"],
            false => &[],
        };
        let options = options(SceneChoice::File(path.clone()), 16, folder.path());
        let manifest = baked(&options);
        assert_eq!(manifest.options.exclude, expected, "{}", path.display());
    }
}
