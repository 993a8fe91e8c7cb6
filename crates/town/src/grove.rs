//! Trees on the meadows around a town.

use crate::dice::Dice;
use crate::part::{Catalogue, Part};
use crate::settle::Places;
use crate::terrain::Terrain;
use glam::{Vec2, Vec3};

/// Room around a trunk to the next one and to houses, and from the quay to the first, in metres.
const TO_TREE: f32 = 3.4;
const TO_HOUSE: f32 = 3.2;
const TO_QUAY: f32 = 26.0;
/// Trees on ground whose normal rises less are of kinds that grow on cliffs.
const STEEP: f32 = 0.8;

/// Adds trees wherever there is room until `triangles` are used up but for less than a tree.
pub(crate) fn grow_trees(
    seed: u32,
    catalogue: &Catalogue,
    ground: &Terrain,
    places: &mut Places,
    triangles: u64,
) {
    let mut dice = Dice::new(seed, 6);
    let meadow = Meadow::new(ground);
    let mut trees: Vec<Vec2> = Vec::new();
    let mut left = triangles;
    let most = most_triangles(catalogue);
    // Where there is no more room, enough is enough.
    for _ in 0..200_000 {
        if left < most {
            break;
        }
        let (at, rises) = meadow.random_point(&mut dice);
        let flat = Vec2::new(at.x, at.z);
        let is_free = at.z < meadow.front - TO_QUAY
            && trees.iter().all(|tree| tree.distance(flat) > TO_TREE)
            && places
                .footprints
                .iter()
                .all(|f| distance(f, flat) > TO_HOUSE);
        if is_free {
            trees.push(flat);
            let tree = places.add_meadow_tree(at, rises < STEEP, &mut dice);
            left -= count(catalogue, tree);
        }
    }
}

fn count(catalogue: &Catalogue, part: Part) -> u64 {
    catalogue.shape(catalogue.index(part)).triangles.len() as u64
}

/// Triangles of the largest tree.
fn most_triangles(catalogue: &Catalogue) -> u64 {
    let all = Part::all().into_iter();
    let trees = all.filter(|part| matches!(part, Part::Tree { .. }));
    trees.map(|tree| count(catalogue, tree)).max().unwrap_or(0)
}

/// Triangles of grass with the sums of their areas up to each.
struct Meadow<'a> {
    triangles: &'a [[Vec3; 3]],
    sums: Vec<f32>,
    /// The largest z.
    front: f32,
}

impl<'a> Meadow<'a> {
    fn new(ground: &'a Terrain) -> Self {
        let triangles = &ground.meadow[..];
        let mut sum = 0.0;
        let sums = triangles.iter().map(|[a, b, c]| {
            sum += (b - a).cross(c - a).length() / 2.0;
            sum
        });
        let zs = triangles.iter().flatten().map(|p| p.z);
        Self {
            triangles,
            sums: sums.collect(),
            front: zs.fold(f32::MIN, f32::max),
        }
    }

    /// A point, all equally likely, and how much the ground's normal rises there.
    fn random_point(&self, dice: &mut Dice) -> (Vec3, f32) {
        let last = self.sums.len() - 1;
        let area = dice.between(0.0, self.sums[last]);
        let found = self.sums.partition_point(|&sum| sum < area);
        let [a, b, c] = self.triangles[found.min(last)];
        let (s, t) = (dice.roll().sqrt(), dice.roll());
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        (a + (b - a) * s + (c - b) * s * t, normal.y)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::plan;
    use crate::settle::settle;
    use crate::terrain::terrain;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        /// Trees of meadows stand on grass, on no house and not in each other.
        #[test]
        fn trees_have_room(seed: u32, size in 0.6..2.0f32) {
            let seed = seed >> 8;
            let plan = plan(seed, size);
            let (ground, mut places) = (terrain(&plan, seed), settle(&plan, seed));
            let before = places.placements.len();
            grow_trees(seed, &Catalogue::new(seed), &ground, &mut places, 60_000);
            let trees: Vec<Vec2> = places.placements[before..]
                .iter()
                .map(|p| p.world_from_part.translation.as_vec3())
                .map(|at| Vec2::new(at.x, at.z))
                .collect();
            prop_assert!(trees.len() > 10, "{} trees", trees.len());
            for (i, &tree) in trees.iter().enumerate() {
                prop_assert!(places.footprints.iter().all(|f| distance(f, tree) > 3.0));
                prop_assert!(trees[..i].iter().all(|other| other.distance(tree) > 3.0));
            }
        }
    }
}
