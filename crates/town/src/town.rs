//! The built-in town.

use crate::assembly::{add_mesh, add_object, empty_scene, place};
use crate::canvas::Detail;
use crate::dice::Dice;
use crate::house::add_house;
use crate::part::Catalogue;
use crate::plan::{Plan, plan};
use crate::settle::{Places, settle};
use crate::skin::Skin;
use crate::terrain::{Terrain, terrain};
use farfield_scene::Scene;
use glam::{DAffine3, DVec3, Vec2, Vec3};
use rayon::prelude::*;

/// The fewest and the most triangles that [`town`] can be asked for.
pub const TOWN_TRIANGLES: std::ops::RangeInclusive<u64> = 100_000..=10_000_000;

/// TODO
pub fn town(seed: u32, triangles: u64) -> Scene {
    let wanted = triangles.clamp(*TOWN_TRIANGLES.start(), *TOWN_TRIANGLES.end());
    // Seeds are below 2^24, so that small numbers can be added.
    let seed = crate::noise::fold(u64::from(seed));
    let (mut scene, catalogue) = rayon::join(
        || empty_scene(seed, Skin::ALL.len(), Detail::Half),
        || Catalogue::new(seed),
    );
    let guildhall = scene.objects.len()..{
        add_house(&mut scene);
        scene.objects.len()
    };
    let fixed: u64 = scene.drawn_triangles();
    let (ground, mut places) = fit(seed, &catalogue, wanted - fixed);
    grow_meadow_trees(seed, &catalogue, &ground, &mut places, wanted - fixed);

    for object in &mut scene.objects[guildhall] {
        object.name = format!("guildhall, {}", object.name);
        object.world_from_mesh = places.guildhall * object.world_from_mesh;
    }
    for (i, strip) in ground.strips.iter().enumerate() {
        let mesh = add_mesh(&mut scene, strip);
        place(
            &mut scene,
            &format!("ground {}", i + 1),
            mesh,
            DAffine3::IDENTITY,
        );
    }
    add_object(&mut scene, "bank", &ground.bank);
    let mut meshes = vec![None; catalogue.len()];
    for placement in &places.placements {
        let part = catalogue.index(placement.part);
        let mesh = *meshes[part].get_or_insert_with(|| add_mesh(&mut scene, catalogue.shape(part)));
        place(&mut scene, &placement.name, mesh, placement.world_from_part);
    }
    let center = center(&ground);
    for object in &mut scene.objects {
        object.world_from_mesh.translation -= center;
    }
    scene
}

fn ground_triangles(ground: &Terrain) -> u64 {
    let shapes = ground.strips.iter().chain([&ground.bank]);
    shapes.map(|s| s.triangles.len() as u64).sum()
}

fn count(catalogue: &Catalogue, ground: &Terrain, places: &Places) -> u64 {
    let placed = places.placements.iter();
    let placed = placed.map(|p| catalogue.shape(catalogue.index(p.part)).triangles.len() as u64);
    ground_triangles(ground) + placed.sum::<u64>()
}

/// The largest plan whose streets leave a share of the triangles to the meadows' trees.
fn fit(seed: u32, catalogue: &Catalogue, wanted: u64) -> (Terrain, Places) {
    let build = |plan: &Plan| (terrain(plan, seed), settle(plan, seed));
    let triangles = |size: f32| {
        let (ground, places) = build(&plan(seed, size));
        count(catalogue, &ground, &places)
    };
    let (mut low, mut high) = (0.6f32, 16.0f32);
    for _ in 0..14 {
        let middle = (low * high).sqrt();
        let share = 1.0 - (0.2 / middle).min(0.2);
        match triangles(middle) as f32 <= wanted as f32 * share {
            true => low = middle,
            false => high = middle,
        }
    }
    build(&plan(seed, low))
}

/// Adds trees on the meadows until the wanted number of triangles is nearly reached.
fn grow_meadow_trees(
    seed: u32,
    catalogue: &Catalogue,
    ground: &Terrain,
    places: &mut Places,
    wanted: u64,
) {
    let mut dice = Dice::new(seed, 6);
    let front = ground
        .meadow
        .iter()
        .flatten()
        .map(|p| p.z)
        .fold(f32::MIN, f32::max);
    let area = |[a, b, c]: &[Vec3; 3]| (b - a).cross(c - a).length() / 2.0;
    let mut sums = Vec::with_capacity(ground.meadow.len());
    let mut sum = 0.0;
    for triangle in &ground.meadow {
        sum += area(triangle);
        sums.push(sum);
    }
    let mut trees: Vec<Vec2> = Vec::new();
    let mut total = count(catalogue, ground, places);
    // Where there is no more room, enough is enough.
    for _ in 0..200_000 {
        if total + 1_800 >= wanted {
            break;
        }
        let at = dice.between(0.0, sum);
        let [a, b, c] = ground.meadow[sums.partition_point(|&s| s < at).min(sums.len() - 1)];
        let (s, t) = (dice.roll().sqrt(), dice.roll());
        let point = a + (b - a) * s + (c - b) * s * t;
        let flat = Vec2::new(point.x, point.z);
        let is_free = point.z < front - 26.0
            && trees.iter().all(|tree| tree.distance(flat) > 3.4)
            && places.footprints.iter().all(|f| distance(f, flat) > 3.2);
        if is_free {
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
            trees.push(flat);
            places.add_meadow_tree(point, normal.y < 0.8, &mut dice);
            let last = places.placements[places.placements.len() - 1].part;
            total += catalogue.shape(catalogue.index(last)).triangles.len() as u64;
        }
    }
}

/// Distance of a point from a rectangle, 0 inside.
fn distance(corners: &[Vec2; 4], p: Vec2) -> f32 {
    let [origin, right, _, back] = *corners;
    let along = |to: Vec2| {
        let axis = to - origin;
        let length = axis.length();
        let t = (p - origin).dot(axis) / length;
        (t - length).max(-t).max(0.0)
    };
    along(right).hypot(along(back))
}

/// The middle of the ground.
fn center(ground: &Terrain) -> DVec3 {
    let points = ground
        .strips
        .par_iter()
        .flat_map_iter(|s| s.positions.iter().copied());
    let [min, max] = points
        .map(|p| [p, p])
        .reduce_with(|[a, b], [c, d]| [a.min(c), b.max(d)])
        .unwrap_or_default();
    ((min + max) / 2.0).as_dvec3().with_y(0.0)
}
