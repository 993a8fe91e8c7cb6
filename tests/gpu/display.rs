//! Pictures.

use crate::adapter::gpu;
use crate::setup::{cameras, house_bundle, model};
use farfield_gpu::{Display, Gpu, GpuScene, IdBuffers, Lighting};
use farfield_grid::Grid;
use farfield_sampling::{Textures, Visibility, rasterize, shade, srgb_from_linear};
use farfield_scene::Scene;
use farfield_views::Camera;
use std::path::Path;

/// The light of the CPU's pictures.
pub(crate) fn light() -> Lighting {
    let light = farfield_sampling::Lighting::default();
    Lighting {
        to_sun: light.to_sun,
        sun: light.sun,
        sky: light.sky,
        ground: light.ground,
    }
}

fn cpu_picture(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    seen: &Visibility,
) -> Grid<[u8; 4]> {
    let light = farfield_sampling::Lighting::default();
    let colors = shade(scene, textures, camera, seen, &light);
    let pixels = colors.cells().iter().zip(seen.objects.cells());
    let pixels = pixels.map(|(color, object)| {
        let [r, g, b] = color
            .to_array()
            .map(|c| (srgb_from_linear(c) * 255.0).round() as u8);
        [
            r,
            g,
            b,
            if *object == farfield_sampling::NONE {
                0
            } else {
                255
            },
        ]
    });
    Grid::from_cells(colors.width(), colors.height(), pixels.collect())
}

/// Greatest difference of a channel.
fn difference(a: &[u8; 4], b: &[u8; 4]) -> u8 {
    (0..4).map(|i| a[i].abs_diff(b[i])).max().unwrap_or(0)
}

fn write(pixels: &Grid<[u8; 4]>, path: &Path) {
    let (width, height) = (pixels.width() as u32, pixels.height() as u32);
    let bytes = pixels.cells().as_flattened().to_vec();
    let image = image::RgbaImage::from_raw(width, height, bytes).expect("four bytes a pixel");
    image.save(path).expect("the picture can be written");
}

/// Shares of pixels that differ by more than 2 of 255.
#[derive(Clone, Copy, Debug)]
struct Shares {
    all: f64,
    /// Those in which both see the same triangle.
    same_surface: f64,
}

/// How pictures differ, per camera. The pictures are written into the
/// folder that the environment variable `FARFIELD_GPU_PICTURES` names.
fn check(gpu: &Gpu, name: &str, scene: &Scene, cameras: &[Camera]) -> Vec<Shares> {
    let uploaded = GpuScene::new(gpu, scene).unwrap();
    let display = Display::new(gpu, Display::OFFSCREEN).unwrap();
    let pictures = display.pictures(gpu, &uploaded, &uploaded.all(), cameras, &light());
    let pictures = pictures.unwrap();
    let ids = IdBuffers::new(gpu).unwrap();
    let ids = ids.see(gpu, &uploaded, &uploaded.all(), cameras).unwrap();
    let textures = Textures::new(scene);
    let mut shares = Vec::new();
    for (i, (camera, picture)) in cameras.iter().zip(&pictures).enumerate() {
        let seen = rasterize(scene, &textures, camera);
        let expected = cpu_picture(scene, &textures, camera, &seen);
        let pairs = expected.cells().iter().zip(picture.pixels.cells());
        let same = seen.triangles.cells().iter().zip(ids[i].triangles.cells());
        let differ = pairs.clone().zip(same);
        let differ = differ.filter(|((a, b), _)| difference(a, b) > 2);
        let share = |count: usize| count as f64 / pairs.len() as f64;
        shares.push(Shares {
            all: share(differ.clone().count()),
            same_surface: share(differ.filter(|(_, (a, b))| a == b).count()),
        });
        if let Some(folder) = std::env::var_os("FARFIELD_GPU_PICTURES") {
            let file = |kind: &str| Path::new(&folder).join(format!("{name}-{i}-{kind}.png"));
            let apart = pairs.map(|(a, b)| {
                let d = difference(a, b).saturating_mul(32);
                [d, d, d, 255]
            });
            let (width, height) = (expected.width(), expected.height());
            write(
                &Grid::from_cells(width, height, apart.collect()),
                &file("difference"),
            );
            write(&expected, &file("cpu"));
            write(&picture.pixels, &file("gpu"));
        }
    }
    shares
}

/// Pictures of impostors differ from the CPU's by more than 2 of 255 in at most 0.1 % of the pixels.
#[test]
fn impostors_look_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = house_bundle();
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    assert_eq!(
        uploaded.all().count(),
        scene.images.len(),
        "a draw call a page"
    );
    for shares in check(&gpu, "bundle", &scene, &cameras(&scene, 256)) {
        assert!(shares.all <= 1e-3, "{shares:?}");
    }
}

/// Pictures of scenes that are lit and textured differ from the CPU's in no more pixels than their
/// edges take: there, another surface is seen.
#[test]
fn scenes_look_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let house = farfield_town::house(1);
    let town = farfield_town::town(1, 100_000);
    for (name, scene) in [("house", house), ("town", town)] {
        for shares in check(&gpu, name, &scene, &cameras(&scene, 256)) {
            assert!(shares.all <= 1e-3, "{name}: {shares:?}");
        }
    }
}

/// Real models with textures of colours, normals and light, some of them masked.
#[test]
fn models_look_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for name in ["FlightHelmet", "StainedGlassLamp", "lowpoly_tree_lime"] {
        let Some(scene) = model(&format!("{name}.glb")) else {
            continue;
        };
        for shares in check(&gpu, name, &scene, &cameras(&scene, 200)) {
            // Some show two surfaces at the same place, of which either may be seen.
            assert!(shares.same_surface <= 1e-4, "{name}: {shares:?}");
        }
    }
}
