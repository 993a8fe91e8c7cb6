//! What pictures take of models from which ID-bitfields leave out what is hidden: the paper's Figure 6.
//!
//! What a face draws is its exact set, with the vertices of this alone, as if each face had a model of its
//! own; patches draw more, in ranges of one index buffer.

use crate::models;
use crate::numbered::{Numbered, PICTURE, PICTURES};
use farfield_bitfields::{
    Bitfield, FaceRanges, Lookup, Triangulation, United, even_directions, face_sets,
};
use farfield_sampling::{Textures, rasterize};
use farfield_scene::{Mesh, Scene};
use farfield_views::{Camera, sphere_direction};
use glam::DVec3;
use std::hint::black_box;
use std::time::Instant;

const MODELS: [models::Entry; 4] = [
    models::DENSE[0],
    models::DENSE[1],
    models::DENSE[2],
    models::LARGE[0],
];

/// Every so many of the pictures are drawn, the best of so many times each.
const STEP: usize = 8;
const TIMES: usize = 3;

/// Prints the table.
pub(crate) fn table() {
    println!(
        "\nMilliseconds of a picture of {PICTURE} x {PICTURE} pixels by the CPU's renderer, which culls \
         back faces: mean over {} directions, and its share of what the whole model takes. Six sets a \
         face, at one distance, each face's as a model of its own. The paper's brain, gear and bunny: up to 5.5, 2.55 and 1.4 times as \
         many frames.\n",
        PICTURES as usize / STEP
    );
    println!("| model | samples | culled | ms | of all |\n|---|---|---|---|---|");
    for model in models::read(&MODELS) {
        let [min, max] = model.scene.bounds().expect("the model has triangles");
        let flat = model.scene.flattened("model", (min + max) / 2.0);
        rows(&Numbered::new(model.name, flat));
    }
}

fn rows(model: &Numbered) {
    let textures = Textures::new(&model.scene);
    let distance = model.distance([PICTURE; 2]);
    let cameras: Vec<(DVec3, Camera)> = (0..PICTURES)
        .step_by(STEP)
        .map(|index| {
            let direction = sphere_direction(index, PICTURES);
            let eye = model.center + direction * distance;
            let fov = std::f64::consts::FRAC_PI_4;
            (
                direction,
                Camera::looking_at(eye, model.center, fov, PICTURE),
            )
        })
        .collect();
    let milliseconds = |scene: &Scene, camera: &Camera| {
        let once = |_| {
            let start = Instant::now();
            black_box(rasterize(scene, &textures, camera));
            start.elapsed().as_secs_f64() * 1e3
        };
        (0..TIMES).map(once).fold(f64::MAX, f64::min)
    };
    let mean = |sum: f64| sum / cameras.len() as f64;
    let all = cameras
        .iter()
        .map(|(_, camera)| milliseconds(&model.scene, camera));
    let all = mean(all.sum());
    println!("| {} | - | 0 % | {all:.2} | 100 % |", model.name);
    for samples in [6, 14, 25, 55, 110] {
        let directions = even_directions(samples);
        let faces = Triangulation::new(&directions, DVec3::ZERO).expect("these are all around");
        let offsets: Vec<DVec3> = directions.iter().map(|d| *d * distance).collect();
        let united = face_sets(&faces, &model.sets(&textures, &offsets), United::Six);
        let lookup = Lookup::new(faces, FaceRanges::from_sets(&united));
        let (mut sum, mut drawn) = (0.0, 0.0);
        for (direction, camera) in &cameras {
            let set = &united[lookup.face(*direction) as usize];
            drawn += f64::from(set.len());
            sum += milliseconds(&only(&model.scene, set), camera);
        }
        println!(
            "| {} | {samples} | {:.1} % | {:.2} | {:.0} % |",
            model.name,
            100.0 * (1.0 - mean(drawn) / f64::from(model.primitives)),
            mean(sum),
            100.0 * mean(sum) / all
        );
    }
}

/// A scene of one object with some of its triangles and their vertices alone.
fn only(scene: &Scene, set: &Bitfield) -> Scene {
    const NONE: u32 = u32::MAX;
    let mut place = vec![NONE; scene.positions.len()];
    let mut only = Scene {
        objects: scene.objects.clone(),
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
        ..Scene::default()
    };
    for id in set.iter() {
        let corners = scene.triangles[id as usize].map(|vertex| {
            let at = vertex as usize;
            if place[at] == NONE {
                place[at] = only.positions.len() as u32;
                only.positions.push(scene.positions[at]);
                only.normals.push(scene.normals[at]);
                only.uvs.push(scene.uvs[at]);
                only.colors.push(scene.colors[at]);
            }
            place[at]
        });
        only.triangles.push(corners);
        only.triangle_materials
            .push(scene.triangle_materials[id as usize]);
    }
    only.meshes = vec![Mesh {
        vertices: 0..only.positions.len() as u32,
        triangles: 0..only.triangles.len() as u32,
    }];
    only
}
