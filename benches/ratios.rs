//! How far the stages of a bake are from what bounds them: ratios of times taken in turns, so that
//! they mean something on a machine that is shared.

use crate::models::{self, Layered, Model};
use farfield_culling::Culler;
use farfield_sampling::{Foliage, LayerMasks, Textures, rasterize};
use farfield_scene::{Object, Scene};
use glam::{DAffine3, DVec3};
use std::hint::black_box;
use std::time::Instant;
use xtask::recording::{record_layers, recording_camera};

/// Times each is measured; the shortest counts.
const TURNS: usize = 7;

/// Prints, for each model, what recording costs next to one plain pass of the z-buffer through the
/// same camera, and how many texels culling, which runs on one core, looks at in a second.
pub(crate) fn table(models: &[Layered]) {
    println!(
        "\nStages next to their bounds, on {} threads",
        rayon::current_num_threads()
    );
    println!(
        "{:<24} {:>10} {:>6} {:>10} {:>10} {:>6} {:>12} {:>14}",
        "model",
        "triangles",
        "layers",
        "pass ms",
        "record ms",
        "ratio",
        "ns/triangle",
        "Gtexel/s/core"
    );
    models.iter().for_each(row);
}

fn row(model: &Layered) {
    let (scene, stack) = (&model.scene, &model.stack);
    let textures = Textures::new(scene);
    let camera = recording_camera(stack);
    let recording = record_layers(scene, &textures, stack, &model.cell, Foliage::Any);
    let masks: Vec<LayerMasks> = (0..stack.layers.len())
        .map(|layer| recording.masks(layer, stack.width, stack.height))
        .collect();
    let mut pass = || drop(black_box(rasterize(scene, &textures, &camera)));
    let mut record = || {
        drop(black_box(record_layers(
            scene,
            &textures,
            stack,
            &model.cell,
            Foliage::Any,
        )));
    };
    let mut cull = || {
        let mut culler = Culler::new(stack.width as usize, stack.height as usize);
        for mask in &masks {
            black_box(culler.next(&mask.opaque, &mask.occluding));
        }
    };
    let [pass, record, cull] = shortest([&mut pass, &mut record, &mut cull]);
    let triangles = scene.drawn_triangles();
    let texels = f64::from(stack.width) * f64::from(stack.height) * stack.layers.len() as f64;
    println!(
        "{:<24} {:>10} {:>6} {:>10.1} {:>10.1} {:>6.2} {:>12.0} {:>14.2}",
        model.name,
        triangles,
        stack.layers.len(),
        pass * 1e3,
        record * 1e3,
        record / pass,
        record * 1e9 / triangles as f64,
        texels / cull / 1e9,
    );
}

/// The shortest time of each, in seconds, all measured in turns.
fn shortest<const N: usize>(mut stages: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut times = [f64::INFINITY; N];
    for _ in 0..TURNS {
        for (stage, time) in stages.iter_mut().zip(&mut times) {
            let start = Instant::now();
            stage();
            *time = time.min(start.elapsed().as_secs_f64());
        }
    }
    times
}

/// Prints how recording grows with the triangles drawn: a dense mesh, one, ten and a hundred times
/// beside each other, from a cell as large as suits them.
pub(crate) fn growth(model: &Model) {
    println!("\nRecording {} again and again", model.name);
    println!(
        "{:>12} {:>6} {:>12} {:>10} {:>12} {:>10}",
        "triangles", "layers", "texels", "record ms", "ns/triangle", "peak MB"
    );
    for side in [1, 4, 11] {
        let grown = models::prepare(Model {
            name: model.name,
            source: model.source.clone(),
            scene: repeated(&model.scene, side),
            cell: model.cell,
        });
        let textures = Textures::new(&grown.scene);
        let start = Instant::now();
        let recording = record_layers(
            &grown.scene,
            &textures,
            &grown.stack,
            &grown.cell,
            Foliage::Any,
        );
        let seconds = start.elapsed().as_secs_f64();
        let triangles = grown.scene.drawn_triangles();
        println!(
            "{:>12} {:>6} {:>12} {:>10.1} {:>12.0} {:>10.0}",
            triangles,
            grown.stack.layers.len(),
            recording.samples.len(),
            seconds * 1e3,
            seconds * 1e9 / triangles as f64,
            xtask::peak_rss_bytes() as f64 / 1e6,
        );
    }
}

/// `side` x `side` of a scene beside and above each other, shrunk to the room of one.
fn repeated(scene: &Scene, side: u32) -> Scene {
    let [min, max] = scene.bounds().expect("the scene has triangles");
    let step = (max - min) / f64::from(side);
    let places =
        (0..side).flat_map(|y| (0..side).map(move |x| DVec3::new(x.into(), y.into(), 0.0)));
    let objects = places.flat_map(|place| {
        let origin = min + place * step;
        let shrunk = DAffine3::from_translation(origin)
            * DAffine3::from_scale(DVec3::splat(1.0 / f64::from(side)))
            * DAffine3::from_translation(-min);
        scene.objects.iter().map(move |object| Object {
            world_from_mesh: shrunk * object.world_from_mesh,
            ..object.clone()
        })
    });
    Scene {
        objects: objects.collect(),
        ..scene.clone()
    }
}
