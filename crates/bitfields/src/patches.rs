//! Primitives that are seen together, drawn together.

use crate::{Bitfield, FaceRanges, Triangulation};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Primitives of a group that are looked at to choose how it is cut: with fewer, cuts get worse;
/// more cost time and change nothing.
const LOOKED_AT: usize = 1024;

/// Cuts into so many patches or fewer are judged by what these draw. Above, nearly all faces see
/// something of either part, whatever the cut.
const FEW: usize = 16;

/// A model's primitives in an order in which those that are seen together follow each other.
///
/// A patch is a few neighbouring primitives that most views see all of or nothing of. Patches are
/// what faces draw: lists of their ranges are far shorter than those of single primitives, and all
/// faces share one index buffer in this order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patches {
    /// The primitive at each place of the new order.
    pub order: Vec<u32>,
    /// Patch p holds the places from `starts[p]` to before `starts[p + 1]`.
    ///
    /// All have between a half and all of the primitives that were allowed, unless there are too
    /// few. Primitives that no set has come last: with [`patches`] and [`cell_patches`] as one patch of
    /// any size, of a model in parts ([`patches_in_parts`](crate::patches_in_parts)) as the last patches
    /// of each part.
    pub starts: Vec<u32>,
}

/// How patches are made and drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSettings {
    /// Primitives in a patch at most. From 64 to 256 is usual: smaller ones are culled more
    /// sharply, and make a renderer that draws them one by one slower.
    pub most_primitives: u32,
    /// Ranges that are drawn for a face at most. Those with the fewest primitives between them are
    /// joined.
    pub most_ranges: u32,
}

impl Default for PatchSettings {
    fn default() -> Self {
        Self {
            most_primitives: 64,
            most_ranges: 64,
        }
    }
}

/// Groups primitives into patches.
///
/// Groups are cut in two, again and again, in the middle along an axis, small ones also at the
/// quarters: an axis of space, or one of the mean direction in which the faces lie that see a
/// primitive. Each time it is the axis that leaves the least doubt about which faces see what (the sum over both parts and all faces of
/// p (1 - p), p the share of the part that the face sees), and in the end the least that is drawn
/// (the primitives of both parts, each times the faces that see any of the part). Axes of space
/// have neighbours stay together; those of directions separate the front of a thin wall from its
/// back, and the inside of a pipe from both.
///
/// * `centers` - of each primitive, in any unit
/// * `sets` - what each face sees
/// * `most_primitives` - see [`PatchSettings`]
///
/// # Panics
///
/// When there is not one set for each face, the sets are not of as many primitives as there are
/// centres, or no primitive is allowed in a patch.
pub fn patches(
    centers: &[Vec3],
    faces: &Triangulation,
    sets: &[Bitfield],
    most_primitives: u32,
) -> Patches {
    let middle = |face| faces.corners(face).iter().sum::<DVec3>().normalize();
    let middles: Vec<DVec3> = (0..faces.faces().len() as u32).map(middle).collect();
    grouped(centers, &middles, sets, most_primitives)
}

/// Groups primitives into patches for view cells, as [`patches`] does for faces: all cells share
/// one order, and have a list of ranges each ([`Patches::ranges`]).
///
/// Where faces lie in directions, cells lie in places: what is seen from the same cells is drawn
/// together.
///
/// * `centers` - of each primitive, in any unit
/// * `cells` - the middle of each cell, in metres
/// * `sets` - what each cell sees
/// * `most_primitives` - see [`PatchSettings`]
///
/// # Panics
///
/// When there is not one set for each cell, the sets are not of as many primitives as there are
/// centres, or no primitive is allowed in a patch.
pub fn cell_patches(
    centers: &[Vec3],
    cells: &[DVec3],
    sets: &[Bitfield],
    most_primitives: u32,
) -> Patches {
    // Single precision is for what is near the origin.
    let middle = cells.iter().sum::<DVec3>() / cells.len().max(1) as f64;
    let offsets: Vec<DVec3> = cells.iter().map(|cell| *cell - middle).collect();
    grouped(centers, &offsets, sets, most_primitives)
}

/// * `places` - where each of the sets is seen from: a direction or an offset
fn grouped(centers: &[Vec3], places: &[DVec3], sets: &[Bitfield], most_primitives: u32) -> Patches {
    assert!(most_primitives > 0, "patches without primitives");
    assert!(
        sets.len() == places.len(),
        "{} sets for {} faces or cells",
        sets.len(),
        places.len()
    );
    let seen = Seen::new(centers, places, sets);
    let some = |id: &u32| seen.signature(*id).iter().any(|word| *word != 0);
    let (mut order, hidden): (Vec<u32>, Vec<u32>) = (0..centers.len() as u32).partition(some);
    let groups = match order.len() {
        0 => Vec::new(),
        _ => seen.cut(&mut order, 0, most_primitives as usize),
    };
    let (mut sorted, mut starts) = (Vec::with_capacity(centers.len()), vec![0]);
    let all = groups.iter().map(|group| &order[group.places.clone()]);
    for patch in all.chain((!hidden.is_empty()).then_some(&hidden[..])) {
        let start = sorted.len();
        sorted.extend_from_slice(patch);
        // Neighbours in the model's own order are likely to share vertices.
        sorted[start..].sort_unstable();
        starts.push(sorted.len() as u32);
    }
    Patches {
        order: sorted,
        starts,
    }
}

impl Patches {
    /// Number of patches.
    pub fn count(&self) -> u32 {
        self.starts.len() as u32 - 1
    }

    /// The patches that hold any of a set of primitives.
    ///
    /// # Panics
    ///
    /// When the set is not of as many primitives as the patches have.
    pub fn holding(&self, set: &Bitfield) -> Bitfield {
        assert!(
            set.primitives() as usize == self.order.len(),
            "a set of {} primitives for patches of {}",
            set.primitives(),
            self.order.len()
        );
        let mut holding = Bitfield::empty(self.count());
        for (patch, range) in (0..).zip(self.starts.windows(2)) {
            let mut primitives = self.order[range[0] as usize..range[1] as usize].iter();
            if primitives.any(|&id| set.contains(id)) {
                holding.insert(patch);
            }
        }
        holding
    }

    /// For each set, the ranges of places that hold all its primitives: whole patches, and what
    /// lies between them where there are too many ranges.
    ///
    /// * `sets` - of primitives, not of patches
    /// * `most_ranges` - see [`PatchSettings`]
    ///
    /// # Panics
    ///
    /// When a set is not of as many primitives as the patches have, or no range is allowed.
    pub fn ranges(&self, sets: &[Bitfield], most_ranges: u32) -> FaceRanges {
        assert!(most_ranges > 0, "no range is allowed");
        let holding: Vec<Bitfield> = sets.iter().map(|set| self.holding(set)).collect();
        self.ranges_in_parts(&holding, &[0, self.order.len() as u32], most_ranges)
    }
}

/// What is known of each primitive.
struct Seen {
    /// Of the primitive's centre and of the mean direction in which the faces lie that see it.
    axes: Vec<[f32; 6]>,
    /// One bit for each face that sees it.
    signatures: Vec<u64>,
    words: usize,
    faces: usize,
}

/// A patch before it has its place.
struct Group {
    places: Range<usize>,
    /// Faces that see any of it.
    signature: Vec<u64>,
}

impl Seen {
    fn new(centers: &[Vec3], places: &[DVec3], sets: &[Bitfield]) -> Self {
        let words = sets.len().div_ceil(64);
        let mut signatures = vec![0u64; words * centers.len()];
        let mut directions = vec![(DVec3::ZERO, 0u32); centers.len()];
        for (face, (set, place)) in sets.iter().zip(places).enumerate() {
            assert!(
                set.primitives() as usize == centers.len(),
                "a set of {} primitives for {} centres",
                set.primitives(),
                centers.len()
            );
            for id in set.iter() {
                signatures[id as usize * words + face / 64] |= 1 << (face % 64);
                let (sum, count) = &mut directions[id as usize];
                *sum += place;
                *count += 1;
            }
        }
        let axes = centers
            .iter()
            .zip(directions)
            .map(|(center, (sum, count))| {
                let mean = (sum / f64::from(count.max(1))).as_vec3();
                [center.x, center.y, center.z, mean.x, mean.y, mean.z]
            });
        Self {
            axes: axes.collect(),
            signatures,
            words,
            faces: sets.len(),
        }
    }

    fn signature(&self, id: u32) -> &[u64] {
        &self.signatures[id as usize * self.words..][..self.words]
    }

    /// Sorts primitives into groups, which it names in an order in which neighbours are seen from
    /// much the same faces.
    ///
    /// * `start` - place of the first of the primitives
    fn cut(&self, primitives: &mut [u32], start: usize, most: usize) -> Vec<Group> {
        let groups = primitives.len().div_ceil(most);
        if groups <= 1 {
            return vec![Group {
                places: start..start + primitives.len(),
                signature: self.united(primitives),
            }];
        }
        // In proportion, so that all groups are of the same size in the end.
        let (axis, near_groups) = self.best_cut(primitives, groups);
        let left = primitives.len() * near_groups / groups;
        primitives.select_nth_unstable_by(left, |a, b| self.compare(axis, *a, *b));
        let (near, far) = primitives.split_at_mut(left);
        let near = self.cut(near, start, most);
        let far = self.cut(far, start + left, most);
        chained(near, far)
    }

    /// The axis along which a cut costs the least, judged by some of the primitives, and the groups
    /// that come before it.
    fn best_cut(&self, primitives: &[u32], groups: usize) -> (usize, usize) {
        let step = primitives.len().div_ceil(LOOKED_AT);
        let mut some: Vec<u32> = primitives.iter().copied().step_by(step).collect();
        let extent = |axis: usize| {
            let values = some.iter().map(|id| self.axes[*id as usize][axis]);
            let bounds = values.fold([f32::MAX, f32::MIN], |[min, max], v| {
                [v.min(min), v.max(max)]
            });
            bounds[1] - bounds[0]
        };
        // Where all cuts cost the same, groups are cut in the middle of their longest side.
        let mut axes: Vec<usize> = (0..3).collect();
        axes.sort_by(|a, b| extent(*b).total_cmp(&extent(*a)));
        axes.extend(3..6);
        let few = groups <= FEW;
        let near_groups = match few {
            true => vec![groups / 2, groups.div_ceil(4), groups - groups.div_ceil(4)],
            false => vec![groups / 2],
        };
        let cost = |part: &[u32]| match few {
            true => self.drawn(part),
            false => self.doubt(part),
        };
        let mut least = (f64::INFINITY, (axes[0], groups / 2));
        for near in near_groups {
            let cut = some.len() * near / groups;
            for &axis in &axes {
                some.select_nth_unstable_by(cut, |a, b| self.compare(axis, *a, *b));
                let (before, behind) = some.split_at(cut);
                let cost = cost(before) + cost(behind);
                if cost < least.0 {
                    least = (cost, (axis, near));
                }
            }
        }
        least.1
    }

    fn compare(&self, axis: usize, a: u32, b: u32) -> std::cmp::Ordering {
        let value = |id: u32| self.axes[id as usize][axis];
        value(a).total_cmp(&value(b)).then(a.cmp(&b))
    }

    /// The faces that see any of some primitives.
    fn united(&self, primitives: &[u32]) -> Vec<u64> {
        let mut all = vec![0; self.words];
        for &id in primitives {
            let words = all.iter_mut().zip(self.signature(id));
            words.for_each(|(all, one)| *all |= one);
        }
        all
    }

    /// What the primitives cost as one patch: as many as they are for each face that sees any.
    fn drawn(&self, primitives: &[u32]) -> f64 {
        let faces: u32 = (self.united(primitives).iter())
            .map(|word| word.count_ones())
            .sum();
        f64::from(faces) * primitives.len() as f64
    }

    /// Primitives times the sum over all faces of p (1 - p), p the share that the face sees.
    fn doubt(&self, primitives: &[u32]) -> f64 {
        let mut counts = vec![0u32; self.faces];
        for &id in primitives {
            for (at, &word) in self.signature(id).iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    counts[at * 64 + rest.trailing_zeros() as usize] += 1;
                    rest &= rest - 1;
                }
            }
        }
        let all = primitives.len() as f64;
        let doubt = |&count: &u32| f64::from(count) * (1.0 - f64::from(count) / all);
        counts.iter().map(doubt).sum()
    }
}

/// One row of groups after the other, each in the direction in which the two that meet are seen
/// from the same faces, as far as can be.
fn chained(mut near: Vec<Group>, mut far: Vec<Group>) -> Vec<Group> {
    let differing = |a: &Group, b: &Group| -> u32 {
        let words = a.signature.iter().zip(&b.signature);
        words.map(|(a, b)| (a ^ b).count_ones()).sum()
    };
    let ends = |groups: &[Group]| [0, groups.len() - 1];
    let [near_ends, far_ends] = [ends(&near), ends(&far)];
    let joints = [(1, 0), (0, 0), (1, 1), (0, 1)];
    let best = joints
        .into_iter()
        .min_by_key(|&(n, f)| differing(&near[near_ends[n]], &far[far_ends[f]]));
    let (near_end, far_end) = best.expect("there are four");
    if near_end == 0 {
        near.reverse();
    }
    if far_end == 1 {
        far.reverse();
    }
    near.append(&mut far);
    near
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::tests::samples;
    use crate::{United, culled_share, even_directions, face_sets};
    use farfield_views::sphere_direction;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        /// Every primitive is in exactly one patch; patches have at most as many primitives as
        /// allowed and at least half as many, unless there are fewer or nobody sees them.
        #[test]
        fn every_primitive_is_in_one_patch(
            (faces, sets) in samples(),
            places in vec(prop::array::uniform3(-1.0..1.0f32), 500),
            most in 1..300u32,
        ) {
            let sets = face_sets(&faces, &sets, United::Six);
            let centers: Vec<Vec3> = places.into_iter().map(Vec3::from).collect();
            let patches = patches(&centers, &faces, &sets, most);
            let mut all = patches.order.clone();
            all.sort();
            prop_assert!(all.into_iter().eq(0..500));
            let seen = (0..500).filter(|id| sets.iter().any(|set| set.contains(*id))).count() as u32;
            for patch in patches.starts.windows(2).filter(|patch| patch[0] < seen) {
                let len = patch[1] - patch[0];
                prop_assert!(len <= most && 2 * len >= most.min(seen), "{len} of {most}");
            }
            prop_assert!(patches.starts.contains(&seen));
        }

        /// Ranges are few, and hold all that the set has; where ranges may be many, nothing but
        /// patches of which it has some; and never more than the patches from first to last.
        #[test]
        fn ranges_hold_the_set(
            (faces, sets) in samples(),
            places in vec(prop::array::uniform3(-1.0..1.0f32), 500),
            most_primitives in 1..40u32,
            most_ranges in 1..40u32,
        ) {
            let sets = face_sets(&faces, &sets, United::Six);
            let centers: Vec<Vec3> = places.into_iter().map(Vec3::from).collect();
            let patches = patches(&centers, &faces, &sets, most_primitives);
            let few = patches.ranges(&sets, most_ranges);
            let many = patches.ranges(&sets, 500);
            for (face, set) in sets.iter().enumerate() {
                let some = |patch: &&[u32]| {
                    let places = &patches.order[patch[0] as usize..patch[1] as usize];
                    places.iter().any(|id| set.contains(*id))
                };
                let visible = patches.starts.windows(2).filter(some);
                let places: Vec<u32> = visible.flat_map(|patch| patch[0]..patch[1]).collect();
                prop_assert!(many.of(face as u32).iter().cloned().flatten().eq(places.clone()));
                let few = few.of(face as u32);
                prop_assert!(few.len() <= most_ranges as usize);
                prop_assert!(places.iter().all(|at| few.iter().any(|range| range.contains(at))));
            }
        }
    }

    /// Of a street between two rows of houses, of which each cell sees what is not far along it,
    /// patches are culled nearly as sharply as single primitives, with far fewer ranges.
    #[test]
    fn patches_of_a_street_are_culled_sharply() {
        let place = |id: u32| {
            let [along, side, height] = [id / 40, id % 2, id / 2 % 20];
            DVec3::new(
                along.into(),
                height.into(),
                if side == 0 { -9.0 } else { 9.0 },
            )
        };
        // In no order, as models are.
        let centers: Vec<DVec3> = (0..8000).map(|i| place(i * 4801 % 8000)).collect();
        let far = DVec3::new(5e5, 0.0, 5e6);
        let cells: Vec<DVec3> = (0..20).map(|i| DVec3::X * f64::from(i) * 10.0).collect();
        let sees = |cell: &DVec3| {
            let near = |id: &u32| (centers[*id as usize] - *cell).x.abs() < 30.0;
            let ids: Vec<u32> = (0..8000).filter(near).collect();
            Bitfield::from_ids(8000, &ids)
        };
        let sets: Vec<Bitfield> = cells.iter().map(sees).collect();
        let exact = FaceRanges::from_sets(&sets);
        let small: Vec<Vec3> = centers.iter().map(|c| c.as_vec3()).collect();
        let moved: Vec<DVec3> = cells.iter().map(|cell| *cell + far).collect();
        let patches = cell_patches(&small, &moved, &sets, 64);
        let ranges = patches.ranges(&sets, 8);
        let [exact_share, share] = [&exact, &ranges].map(|lists| culled_share(lists, 8000));
        assert!(share > exact_share - 0.05, "{share} of {exact_share}");
        assert!(5 * ranges.bytes() < exact.bytes());
    }

    /// A model of one triangle is a patch, or nothing to draw; so is one of none.
    #[test]
    fn the_smallest_models_have_patches() {
        let faces = Triangulation::new(&even_directions(6), DVec3::ZERO).unwrap();
        for primitives in [0, 1] {
            let centers = vec![Vec3::ZERO; primitives as usize];
            for seen in 0..=primitives {
                let ids: Vec<u32> = (0..seen).collect();
                let sets = vec![Bitfield::from_ids(primitives, &ids); 6];
                let sets = face_sets(&faces, &sets, United::Six);
                let patches = patches(&centers, &faces, &sets, 64);
                assert_eq!(
                    (patches.order.len(), patches.count()),
                    (centers.len(), primitives)
                );
                let ranges = patches.ranges(&sets, 1);
                assert!((0..ranges.count()).all(|face| ranges.primitives_of(face) == seen));
            }
        }
    }

    /// Of a sphere, of which each view sees half, patches are culled nearly as sharply as single
    /// primitives, with far fewer ranges.
    #[test]
    fn patches_of_a_sphere_are_culled_sharply() {
        let directions = (0..20_000).map(|i| sphere_direction(i, 20_000).as_vec3());
        let centers: Vec<Vec3> = directions.collect();
        let faces = Triangulation::new(&even_directions(25), DVec3::ZERO).unwrap();
        let sees = |viewpoint: &DVec3| {
            let front = |id: &u32| centers[*id as usize].as_dvec3().dot(*viewpoint) > 0.2;
            let ids: Vec<u32> = (0..20_000).filter(front).collect();
            Bitfield::from_ids(20_000, &ids)
        };
        let sets: Vec<Bitfield> = faces.directions().iter().map(sees).collect();
        let sets = face_sets(&faces, &sets, United::Six);
        let exact = FaceRanges::from_sets(&sets);
        let settings = PatchSettings::default();
        let patches = patches(&centers, &faces, &sets, settings.most_primitives);
        let ranges = patches.ranges(&sets, settings.most_ranges);
        let [exact_share, share] = [&exact, &ranges].map(|lists| culled_share(lists, 20_000));
        assert!(share > exact_share - 0.05 && 5 * ranges.bytes() < exact.bytes());
    }
}
