//! The built-in town, seen from where it is meant to be seen.

use farfield_sampling::{Textures, rasterize};
use farfield_scene::Scene;
use farfield_views::{Camera, ViewCell};
use glam::DVec3;

/// The cell that scenes are seen from unless another is asked for: a cube of half the scene's
/// extent, one extent before its front, from its foot upwards.
fn cell(scene: &Scene) -> (ViewCell, DVec3) {
    let [min, max] = scene.bounds().unwrap();
    let extent = (max - min).max_element();
    let center = (min + max) / 2.0;
    let side = extent / 2.0;
    let cell = ViewCell::Box {
        center: DVec3::new(center.x, min.y + side / 2.0, max.z + extent + side / 2.0),
        size: DVec3::splat(side),
    };
    (cell, center)
}

/// How many pixels show a surface from behind.
fn count_backs(scene: &Scene, eye: DVec3, target: DVec3) -> usize {
    let mut both_sides = scene.clone();
    for material in &mut both_sides.materials {
        material.double_sided = true;
    }
    let camera = Camera::looking_at(eye, target, 30f64.to_radians(), 512);
    let seen = rasterize(scene, &Textures::new(scene), &camera).depth;
    let there = rasterize(&both_sides, &Textures::new(&both_sides), &camera).depth;
    let pairs = seen.cells().iter().zip(there.cells());
    pairs.filter(|(seen, there)| there < seen).count()
}

/// Whoever looks from the cell sees fronts of triangles only: the town hangs nowhere, and nothing
/// in it is open to the viewer.
#[test]
fn a_town_is_closed_to_all_who_look_from_the_cell() {
    for seed in [1, 2] {
        let town = farfield_town::town(seed, 100_000);
        let (cell, center) = cell(&town);
        // Corners, middles of edges and of faces, and a few places inside.
        for i in (0..32).step_by(3) {
            let eye = cell.viewpoint(i, seed.into());
            let backs = count_backs(&town, eye, center);
            assert_eq!(backs, 0, "pixels of seed {seed} from {eye}");
        }
    }
}
