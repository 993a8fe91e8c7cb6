//! Textured depth meshes, from a scene to the verdict.

use crate::setup::{contents, display, model, options, options_in_cell, verified, write_bundle};
use farfield_bundle::{Body, Manifest, TdmBody};
use farfield_layers::{Aim, PromisedCamera, box_corners};
use farfield_sampling::{Foliage, Textures};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use std::fmt::Write;
use std::path::Path;
use xtask::auto::{layered_bytes, survey, tdm_bytes};
use xtask::recording::Settings;
use xtask::{
    BakeOptions, BuiltIn, Channels, Console, Device, Limits, Making, SceneChoice, ViewCellSpec,
    bake,
};

fn mesh_of(scene: SceneChoice, resolution: u32, enlarged: f64, out: &Path) -> BakeOptions {
    BakeOptions {
        making: Making::Tdm { enlarged },
        ..options(scene, resolution, out)
    }
}

fn house(out: &Path) -> BakeOptions {
    mesh_of(SceneChoice::BuiltIn(BuiltIn::House), 192, 1.5, out)
}

fn body(manifest: &Manifest) -> &TdmBody {
    match &manifest.impostors[0].body {
        Body::Tdm(body) => body,
        Body::Layered(_) | Body::Bitfields(_) => panic!("a mesh was asked for"),
    }
}

/// The house as a mesh is where it should be, in fewer triangles than it was made of at first; and each
/// thread count gives the same bytes.
#[test]
fn a_mesh_is_where_it_should_be() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let report = bake(&house(&dir), &Console::Silent).unwrap();
    let manifest = farfield_bundle::read(&dir).unwrap();
    let mesh = body(&manifest);
    assert_eq!(report.technique, "tdm");
    assert_eq!(report.triangles_out, mesh.triangles);
    assert!(mesh.triangles * 5 < mesh.initial_triangles);
    assert!(mesh.charts < mesh.triangles && mesh.pieces > 0);

    let found = verified(&dir, 40);
    assert_eq!(found.gap_pixels, 0, "{:?}", found.broken);
    assert!(found.parallax_px > 0.0 && found.parallax_px <= 1.75);
    assert_eq!((found.phantom_pixels, found.displaced_pixels), (0, 0));

    let alone = folder.path().join("alone");
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    pool.install(|| bake(&house(&alone), &Console::Silent))
        .unwrap();
    for file in &manifest.files {
        let [a, b] = [&dir, &alone].map(|dir| std::fs::read(dir.join(&file.path)).unwrap());
        assert!(a == b, "{} depends on the number of threads", file.path);
    }
}

/// What is displayed, replaced by something else; checksums are those of the new files.
fn replace(dir: &Path, change: impl Fn(&mut Scene)) {
    let manifest = farfield_bundle::read(dir).unwrap();
    let mut display = display(dir);
    change(&mut display);
    write_bundle(dir, &manifest, &display);
}

/// A mesh that has lost a triangle, or is a metre off, or lit, breaks its promise, and verify says why.
#[test]
fn a_damaged_mesh_is_found_out() {
    type Damage = fn(&mut Scene);
    let damages: [(Damage, &str); 3] = [
        (
            |scene| {
                scene.triangles.pop();
                scene.triangle_materials.pop();
                scene.meshes[0].triangles.end -= 1;
            },
            "triangles, not the",
        ),
        (
            |scene| {
                scene.objects[0].world_from_mesh.translation.x += 1.0;
            },
            "parallax",
        ),
        (|scene| scene.materials[0].unlit = false, "is not unlit"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (i, (damage, words)) in damages.into_iter().enumerate() {
        let dir = folder.path().join(i.to_string());
        bake(&house(&dir), &Console::Silent).unwrap();
        replace(&dir, damage);
        let found = verified(&dir, 3);
        let says = |broken: &String| broken.contains(words);
        assert!(
            !found.holds && found.broken.iter().any(says),
            "{:?}",
            found.broken
        );
    }
}

/// Nor does one look through a mesh of voxels so large that surfaces draw apart: the bake finds where.
#[test]
fn a_mesh_is_closed_where_surfaces_draw_apart() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let house = SceneChoice::BuiltIn(BuiltIn::House);
    bake(&mesh_of(house, 96, 2.0, &dir), &Console::Silent).unwrap();
    let found = verified(&dir, 60);
    assert_eq!(found.gap_pixels, 0, "{:?}", found.broken);
}

/// A white bowl with a black one right behind it: a mesh may lie between the two, but nothing of the black
/// one can be seen.
#[test]
fn what_is_hidden_right_behind_does_not_shine_through() {
    const SIDE: u32 = 60;
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        2 * (SIDE + 1).pow(2),
        4 * SIDE.pow(2),
    );
    // The one behind is smaller, so that it cannot be seen beside the other.
    for (reach, behind, shade) in [(1.0, 0.0, 255), (0.9, 0.04, 0)] {
        for (y, x) in (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| (y, x))) {
            let [x, y] = [x, y].map(|at| reach * (2.0 * f64::from(at) / f64::from(SIDE) - 1.0));
            let z = 0.3 * (x * x + y * y) - behind;
            writeln!(ply, "{x} {y} {z} {shade} {shade} {shade}").unwrap();
        }
    }
    for first in [0, (SIDE + 1).pow(2)] {
        for (y, x) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (y, x))) {
            let [a, b] = [y, y + 1].map(|row| first + row * (SIDE + 1) + x);
            writeln!(ply, "3 {a} {} {}\n3 {a} {} {b}", a + 1, b + 1, b + 1).unwrap();
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let [file, dir] = ["bowls.ply", "bundle"].map(|name| folder.path().join(name));
    std::fs::write(&file, ply).unwrap();
    let options = BakeOptions {
        making: Making::Tdm { enlarged: 1.5 },
        channels: Channels::Unlit,
        ..options_in_cell(SceneChoice::File(file), "box:0,0,3:1,1,1", 128, &dir)
    };
    bake(&options, &Console::Silent).unwrap();
    let found = verified(&dir, 30);
    assert!(found.holds, "{:?}", found.broken);
    assert_eq!(found.stray_pixels, 0);
    assert!(found.ssim_mean > 0.9, "{}", found.ssim_mean);
}

/// Larger voxels give fewer triangles.
#[test]
fn enlarged_voxels_give_fewer_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let counts = [1.0, 1.5, 2.0].map(|enlarged| {
        let out = folder.path().join("bundle");
        let house = SceneChoice::BuiltIn(BuiltIn::House);
        let report = bake(&mesh_of(house, 128, enlarged, &out), &Console::Silent).unwrap();
        report.triangles_out
    });
    assert!(counts[0] > counts[1] && counts[1] > counts[2], "{counts:?}");
}

/// Meshes hold colours only, and say so.
#[test]
fn lit_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let options = BakeOptions {
        channels: Channels::Pbr,
        ..house(&dir)
    };
    let error = format!("{:#}", bake(&options, &Console::Silent).unwrap_err());
    assert!(error.contains("hold colours only"), "{error}");
    assert!(!dir.exists());
}

/// A page that is smaller than a chart is refused with the least size that would do, and that does.
#[test]
fn the_least_page_size_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let paged = |page_size| {
        let options = BakeOptions {
            page_size,
            ..house(&dir)
        };
        bake(&options, &Console::Silent)
    };
    let error = format!("{:#}", paged(64).unwrap_err());
    assert!(error.contains("--page-size 64 is too small"), "{error}");
    let (_, least) = error.split_once("pages of ").unwrap();
    let least: u32 = least.split_once(' ').unwrap().0.parse().unwrap();
    assert!(paged(least - 4).is_err());
    assert_eq!(paged(least).unwrap().technique, "tdm");
}

/// A real truck from near: a hundred layers, wheels, lettering.
#[test]
fn the_truck_is_kept() {
    let Some(truck) = model("CesiumMilkTruck.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let in_cell = options_in_cell(SceneChoice::File(truck), "box:0,1.3,9:3,2,3", 256, &dir);
    let options = BakeOptions {
        making: Making::Tdm { enlarged: 1.5 },
        ..in_cell
    };
    bake(&options, &Console::Silent).unwrap();
    let found = verified(&dir, 27);
    assert!(found.holds, "{:?}", found.broken);
}

/// What is bytes, pages and geometry.
fn bytes(report: &xtask::BakeReport) -> u64 {
    report.atlas_bytes + report.geometry_bytes
}

/// Of both techniques the one that is predicted to cost less is used, as if it had been asked for; where
/// it misses the limits the other; and layers wherever meshes cannot be made.
#[test]
fn the_cheaper_technique_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let baked = |options: BakeOptions| bake(&options, &Console::Silent).unwrap();
    let layered = Making::Layered {
        bytes_per_quad: 104.0,
    };
    let either = |options: BakeOptions| BakeOptions {
        making: layered,
        alternative: Some(Making::Tdm { enlarged: 1.5 }),
        ..options
    };
    let house = || SceneChoice::BuiltIn(BuiltIn::House);
    let far = || options_in_cell(house(), "box:0,50,570:100,100,100", 256, &dir);
    let report = baked(either(far()));
    assert_eq!(report.technique, "layered");
    let chosen = contents(&dir);
    baked(BakeOptions {
        making: layered,
        ..far()
    });
    assert!(contents(&dir) == chosen, "the choice changes the bundle");

    // Layers are thought to be better, but are larger than a mesh.
    let near = || options_in_cell(house(), "box:0,50,250:100,100,100", 256, &dir);
    let of_mesh = bytes(&baked(BakeOptions {
        making: Making::Tdm { enlarged: 1.5 },
        ..near()
    }));
    let free = baked(either(near()));
    assert_eq!(free.technique, "layered");
    assert!(of_mesh < bytes(&free));
    let limited = baked(BakeOptions {
        limits: Limits {
            triangles: None,
            bytes: Some(of_mesh),
        },
        ..either(near())
    });
    assert_eq!((limited.technique, bytes(&limited)), ("tdm", of_mesh));

    let lit = baked(BakeOptions {
        channels: Channels::Pbr,
        ..either(far())
    });
    assert_eq!(lit.technique, "layered");
}

/// The forecasts, without baking: of the built-in house from near, a mesh is thought to be smaller; from
/// far away, layers.
#[test]
fn a_near_house_is_forecast_as_a_mesh() {
    let scene = farfield_town::house(0);
    let textures = Textures::new(&scene);
    let forecast = |cell: &str| {
        let settings = Settings {
            cell: match cell.parse().unwrap() {
                ViewCellSpec::Box { center, size } => ViewCell::Box { center, size },
                ViewCellSpec::Shaft { .. } => panic!("the test names boxes"),
            },
            hull: box_corners(scene.bounds().unwrap()),
            camera: PromisedCamera {
                aim: Aim::Center,
                fov: 45f64.to_radians(),
                resolution: 512,
            },
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
        };
        let found = survey(
            &scene,
            &textures,
            &settings,
            &Device::cpu(),
            &Console::Silent,
        )
        .unwrap();
        [layered_bytes(&found), tdm_bytes(&found)]
    };
    let [layered, mesh] = forecast("box:0,10,70:20,20,20");
    assert!(mesh < layered, "{mesh} {layered}");
    let [layered, mesh] = forecast("box:0,50,570:100,100,100");
    assert!(layered < mesh, "{layered} {mesh}");
}

/// Limits are met by larger quads or voxels than were asked for; where that is not enough, nothing is
/// written, and what is missed is told.
#[test]
fn limits_are_met_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let house = || SceneChoice::BuiltIn(BuiltIn::House);
    let makings = [
        Making::Layered {
            bytes_per_quad: 104.0,
        },
        Making::Tdm { enlarged: 1.0 },
    ];
    for making in makings {
        let unlimited = BakeOptions {
            making,
            ..options(house(), 96, &dir)
        };
        let free = bake(&unlimited, &Console::Silent).unwrap();
        let limited = |triangles: u64| BakeOptions {
            limits: Limits {
                triangles: Some(triangles),
                bytes: None,
            },
            ..unlimited.clone()
        };
        let most = free.triangles_out * 9 / 10;
        let report = bake(&limited(most), &Console::Silent).unwrap();
        assert!(report.triangles_out <= most);
        assert_ne!(farfield_bundle::read(&dir).unwrap().technique, {
            bake(&unlimited, &Console::Silent).unwrap();
            farfield_bundle::read(&dir).unwrap().technique
        });
        std::fs::remove_dir_all(&dir).unwrap();
        let error = format!("{:#}", bake(&limited(1), &Console::Silent).unwrap_err());
        assert!(error.contains("more than --max-triangles 1"), "{error}");
        assert!(!dir.exists());
    }
}
