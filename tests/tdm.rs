//! Textured depth meshes, from a scene to the verdict.

use crate::setup::{model, options, options_in_cell, verified};
use farfield_bundle::{Body, GLTF_FILE, Manifest, NewFile, TdmBody};
use farfield_scene::Scene;
use std::path::Path;
use xtask::{BakeOptions, BuiltIn, Channels, Console, Limits, Making, SceneChoice, bake};

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
        Body::Layered(_) => panic!("a mesh was asked for"),
    }
}

/// The house as a mesh is where it should be, but for a pixel or two at corners where several surfaces
/// meet, in fewer triangles than it was made of at first; and each thread count gives the same bytes.
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
    assert!(found.gap_pixels <= 2, "{:?}", found.broken);
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
    let mut display = farfield_import::read(&dir.join(GLTF_FILE)).unwrap().scene;
    change(&mut display);
    let uris: Vec<String> = (0..display.images.len())
        .map(|i| format!("pages/{i:03}.png"))
        .collect();
    let mut files = vec![NewFile {
        path: GLTF_FILE.into(),
        bytes: farfield_bundle::glb_from_scene(&display, &uris).unwrap(),
    }];
    files.extend(
        display
            .images
            .iter()
            .zip(uris)
            .map(|(image, path)| NewFile {
                path,
                bytes: farfield_bundle::encode_png(image),
            }),
    );
    farfield_bundle::write(dir, &manifest, &files).unwrap();
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
