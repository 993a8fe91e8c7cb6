//! The built-in town.

use crate::assembly::{add_mesh, add_object, empty_scene, place};
use crate::canvas::Detail;
use crate::grove::grow_trees;
use crate::house::add_house;
use crate::part::Catalogue;
use crate::plan::plan;
use crate::settle::{Places, settle};
use crate::skin::Skin;
use crate::terrain::{Terrain, terrain};
use farfield_scene::Scene;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// The fewest and the most triangles that [`town`] can be asked for.
pub const TOWN_TRIANGLES: std::ops::RangeInclusive<u64> = 100_000..=10_000_000;

/// A town on a hill above a quay: a market with a guildhall, a church, rows of houses along
/// streets that climb to a castle, and trees.
///
/// Its front looks towards +Z and its middle is above the origin; the lowest ground is y = 0, the
/// quay's foot, the lowest point of all, 4 m below. All lengths are metres. The more triangles,
/// the larger the town; houses, trees and streets keep their size, and there are never more than
/// about 320 different meshes.
///
/// * `seed` - another seed, another town; the same seed, the same bytes
/// * `triangles` - how many are to be drawn, instances included; the town has at most as many, and
///   at least 95 % of them
///
/// Half a second for the smallest town, twice that for the largest, on two cores; textures take
/// most of it.
///
/// # Panics
///
/// When `triangles` is not in [`TOWN_TRIANGLES`].
pub fn town(seed: u32, triangles: u64) -> Scene {
    assert!(
        TOWN_TRIANGLES.contains(&triangles),
        "{triangles} triangles are not between {} and {}",
        TOWN_TRIANGLES.start(),
        TOWN_TRIANGLES.end()
    );
    // Seeds are below 2^24, so that small numbers can be added.
    let seed = crate::noise::fold(u64::from(seed));
    let (mut scene, catalogue) = rayon::join(
        || empty_scene(seed, Skin::ALL.len(), Detail::Half),
        || Catalogue::new(seed),
    );
    add_house(&mut scene);
    let guildhall = 0..scene.objects.len();
    let (ground, places) = arrange(seed, &catalogue, triangles - scene.drawn_triangles());

    move_guildhall(&mut scene, guildhall, &places);
    add_ground(&mut scene, &ground);
    add_parts(&mut scene, &catalogue, &places);
    let center = center(&ground);
    for object in &mut scene.objects {
        object.world_from_mesh.translation -= center;
    }
    scene
}

/// Ground and places of a town of at most `wanted` triangles.
fn arrange(seed: u32, catalogue: &Catalogue, wanted: u64) -> (Terrain, Places) {
    let (ground, mut places) = fit(seed, catalogue, wanted);
    let left = wanted - count(catalogue, &ground, &places);
    grow_trees(seed, catalogue, &ground, &mut places, left);
    (ground, places)
}

/// The largest town whose streets leave a share of the triangles to the meadows' trees.
fn fit(seed: u32, catalogue: &Catalogue, wanted: u64) -> (Terrain, Places) {
    let build = |size: f32| {
        let plan = plan(seed, size);
        (terrain(&plan, seed), settle(&plan, seed))
    };
    // Sizes of towns that are too small and too large for all that can be asked for.
    let (mut low, mut high) = (0.5f32, 16.0f32);
    for _ in 0..14 {
        let middle = (low * high).sqrt();
        let share = 1.0 - (0.2 / middle).min(0.2);
        let (ground, places) = build(middle);
        match count(catalogue, &ground, &places) as f32 <= wanted as f32 * share {
            true => low = middle,
            false => high = middle,
        }
    }
    build(low)
}

/// Triangles to be drawn.
fn count(catalogue: &Catalogue, ground: &Terrain, places: &Places) -> u64 {
    let shapes = ground.strips.iter().chain([&ground.bank]);
    let placed = places.placements.iter();
    let placed = placed.map(|p| catalogue.shape(catalogue.index(p.part)));
    let counts = shapes.chain(placed).map(|s| s.triangles.len() as u64);
    counts.sum()
}

/// Moves the built-in house to the market.
fn move_guildhall(scene: &mut Scene, objects: Range<usize>, places: &Places) {
    for (i, object) in scene.objects[objects].iter_mut().enumerate() {
        object.name = format!("guildhall {}, {}", i + 1, object.name);
        object.world_from_mesh = places.guildhall * object.world_from_mesh;
    }
}

fn add_ground(scene: &mut Scene, ground: &Terrain) {
    for (i, strip) in ground.strips.iter().enumerate() {
        add_object(scene, &format!("ground {}", i + 1), strip);
    }
    add_object(scene, "bank", &ground.bank);
}

/// Adds what is placed, and meshes of the parts that are.
fn add_parts(scene: &mut Scene, catalogue: &Catalogue, places: &Places) {
    let mut meshes = vec![None; catalogue.len()];
    for placement in &places.placements {
        let part = catalogue.index(placement.part);
        let mesh = *meshes[part].get_or_insert_with(|| add_mesh(scene, catalogue.shape(part)));
        place(scene, &placement.name, mesh, placement.world_from_part);
    }
}

/// The middle of the ground, at height 0.
fn center(ground: &Terrain) -> DVec3 {
    let points = ground.strips.iter().flat_map(|s| &s.positions);
    let far = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [min, max] = points.fold(far, |[min, max], &p| [min.min(p), max.max(p)]);
    ((min + max) / 2.0).as_dvec3().with_y(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4))]

        /// A town is a valid scene with as many triangles as promised, its front towards +Z, its
        /// foot the lowest point; every object has a name of its own, and every mesh is shown.
        #[test]
        fn a_town_is_what_is_promised(seed: u32, triangles in 100_000..600_000_u64) {
            let town = town(seed, triangles);
            prop_assert_eq!(town.check(), Ok(()));
            let drawn = town.drawn_triangles();
            prop_assert!(drawn <= triangles && drawn * 100 >= triangles * 95, "{drawn} of {triangles}");
            let [min, max] = town.bounds().unwrap();
            prop_assert_eq!(min.y, f64::from(crate::bank::FOOT));
            prop_assert!((min.x + max.x).abs() < 1.0 && (min.z + max.z).abs() < 1.0);
            let names: BTreeSet<&str> = town.objects.iter().map(|o| &*o.name).collect();
            prop_assert!(names.len() == town.objects.len() && !names.contains(""));
            let shown: BTreeSet<u32> = town.objects.iter().map(|o| o.mesh).collect();
            prop_assert_eq!(shown.len(), town.meshes.len());
        }
    }

    /// Whatever the number, the town has it nearly; without its textures this is quick.
    #[test]
    fn sizes_follow_the_triangles_asked_for() {
        for seed in 0..3 {
            let catalogue = Catalogue::new(seed);
            for wanted in [
                98_000, 120_000, 150_000, 200_000, 330_000, 1_000_000, 3_000_000,
            ] {
                let (ground, places) = arrange(seed, &catalogue, wanted);
                let drawn = count(&catalogue, &ground, &places);
                assert!(
                    drawn <= wanted && drawn * 100 >= wanted * 95,
                    "{drawn} of {wanted}, seed {seed}"
                );
            }
        }
    }

    /// The same seed gives the same bytes on any number of threads, another seed another town.
    #[test]
    fn towns_repeat() {
        let on = |threads: usize, seed| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| town(seed, 100_000))
        };
        let first = on(1, 5);
        assert!(first == on(4, 5));
        let other = on(2, 6);
        assert!(first.objects != other.objects && first.images != other.images);
    }

    #[test]
    #[should_panic(expected = "99999 triangles are not between")]
    fn too_few_triangles_are_refused() {
        town(1, 99_999);
    }
}
