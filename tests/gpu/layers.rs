//! Layers recorded with the GPU's help.

use crate::setup::{gpu, model, moved};
use farfield_gpu::{Gpu, LayerSearch, Touches};
use farfield_sampling::{Foliage, Recording, Textures, Touch, record, record_touches};
use farfield_scene::{AlphaMode, Image, Material, Mesh, Object, Scene};
use farfield_views::{Camera, Extent, ViewCell};
use glam::{DAffine3, DVec2, DVec3, DVec4, Vec2, Vec3, Vec4};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

/// Layers of a scene, and a cell that they are seen from.
#[derive(Clone, Debug)]
struct Layers {
    camera: Camera,
    borders: Vec<f64>,
    corners: Vec<DVec4>,
}

/// Some layers from a least to a greatest depth, of the same relative thickness.
fn borders(near: f64, far: f64, count: u32) -> Vec<f64> {
    let border = |i: u32| near * (far / near).powf(f64::from(i) / f64::from(count));
    (0..=count).map(border).collect()
}

/// Layers for viewers in a box before a scene, so many times its size away.
fn before(scene: &Scene, away: f64, resolution: u32, count: u32) -> Layers {
    let [min, max] = scene.bounds().expect("the scene shows something");
    let (middle, size) = ((min + max) / 2.0, (max - min).length());
    let eye = middle + DVec3::new(0.1, 0.15, 1.0).normalize() * away * size;
    let cell = ViewCell::Box {
        center: eye,
        size: DVec3::splat(0.2 * size),
    };
    let fov = 2.0 * (0.5 / away).atan();
    Layers {
        camera: Camera::looking_at(eye, middle, fov, resolution),
        borders: borders((away - 0.5) * size, (away + 0.5) * size, count),
        corners: cell.corners().to_vec(),
    }
}

fn search(gpu: &Gpu, scene: &Scene, layers: &Layers) -> Touches {
    let search = LayerSearch::new(gpu).unwrap();
    let Layers {
        camera,
        borders,
        corners,
    } = layers;
    search.find(gpu, scene, camera, borders, corners).unwrap()
}

fn recorded(scene: &Scene, layers: &Layers, foliage: Foliage, found: &Touches) -> [Recording; 2] {
    let textures = Textures::new(scene);
    let Layers {
        camera,
        borders,
        corners,
    } = layers;
    let touches = found.list.iter().map(|touch| Touch {
        object: touch.object,
        triangle: touch.triangle,
        layer: touch.layer,
        y: touch.y,
        x: touch.x,
    });
    let touches: Vec<Touch> = touches.collect();
    [
        record(scene, &textures, camera, borders, corners, foliage),
        record_touches(
            scene, &textures, camera, borders, corners, foliage, &touches,
        ),
    ]
}

/// Panics unless layers that the GPU helped to record are those of the CPU to the last bit. Returns how
/// many texels were set, and how many touches the CPU had to look at for each.
fn check(gpu: &Gpu, scene: &Scene, layers: &Layers) -> (usize, f64) {
    let found = search(gpu, scene, layers);
    let [expected, recorded] = recorded(scene, layers, Foliage::Any, &found);
    let count = expected.samples.len();
    // Not `assert_eq!`, which would print them all.
    let differ = differing(&expected, &recorded);
    assert!(differ == 0, "{differ} of {count} texels differ");
    assert!(expected == recorded, "the order differs");
    (count, found.list.len() as f64 / count as f64)
}

/// Texels that only one recording has, or that differ.
fn differing(a: &Recording, b: &Recording) -> usize {
    let texels = |recording: &Recording| -> Vec<(usize, String)> {
        let layers = recording.layers.iter().enumerate();
        let of_layer = |(layer, run): (usize, &std::ops::Range<usize>)| {
            let samples = recording.samples[run.clone()].to_vec();
            samples
                .into_iter()
                .map(move |sample| (layer, format!("{sample:?}")))
        };
        layers.flat_map(of_layer).collect()
    };
    if a == b {
        return 0;
    }
    let [a, b] = [a, b].map(|r| {
        texels(r)
            .into_iter()
            .collect::<std::collections::BTreeSet<_>>()
    });
    for one in a.difference(&b).take(5) {
        println!("cpu {one:?}");
    }
    for one in b.difference(&a).take(5) {
        println!("gpu {one:?}");
    }
    a.symmetric_difference(&b).count()
}

#[test]
fn scenes() {
    let Some(gpu) = gpu() else { return };
    for (scene, away) in [
        (farfield_town::house(1), 1.2),
        (farfield_town::town(1, 100_000), 1.5),
    ] {
        for count in [1, 9, 60] {
            let t = std::time::Instant::now();
            println!(
                "{:?} {:?}",
                check(&gpu, &scene, &before(&scene, away, 256, count)),
                t.elapsed()
            );
        }
    }
}
