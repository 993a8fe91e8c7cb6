//! Plain pictures, to be compared with those of another renderer on the same machine.

use crate::models::Model;
use farfield_sampling::{Textures, rasterize};
use farfield_views::{Camera, ViewCell};
use std::hint::black_box;
use std::time::Instant;

/// Pictures of each model: the fastest counts.
const REPEATS: usize = 15;

/// Prints what one pass of the z-buffer takes, of 512 x 512 pixels seen from the middle of the view cell,
/// and how another renderer is asked for the same.
pub(crate) fn table(models: &[Model]) {
    println!(
        "\nPlain pictures of 512 x 512 pixels, on {} threads",
        rayon::current_num_threads()
    );
    println!(
        "{:<26} {:>10} {:>8} {:>12}  eye",
        "model", "triangles", "ms", "ns/triangle"
    );
    for model in models {
        let ViewCell::Box { center: eye, .. } = model.cell else {
            panic!("models have boxes for view cells");
        };
        let [min, max] = model.scene.bounds().expect("the model has triangles");
        let camera = Camera::looking_at(eye, (min + max) / 2.0, 45f64.to_radians(), 512);
        let textures = Textures::new(&model.scene);
        let seconds = (0..REPEATS).map(|_| {
            let start = Instant::now();
            black_box(rasterize(&model.scene, &textures, &camera));
            start.elapsed().as_secs_f64()
        });
        let seconds = seconds.fold(f64::INFINITY, f64::min);
        let triangles = model.scene.drawn_triangles();
        println!(
            "{:<26} {triangles:>10} {:>8.1} {:>12.0}  {},{},{}",
            model.name,
            seconds * 1e3,
            seconds * 1e9 / triangles as f64,
            eye.x,
            eye.y,
            eye.z
        );
    }
}
