//! What is seen from anywhere in a view cell.

use crate::held_back::{missed_pixels, until_clean};
use crate::{Bitfield, Round};
use farfield_views::{ViewCell, lattice_viewpoints, low_discrepancy_point};
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::convert::Infallible;

/// When a cell has been sampled enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSettings {
    /// Samples at most, beside the 27 that are taken first. From then on, only what views show is
    /// added.
    pub most_samples: u32,
    /// Pixels that a view may miss and still be clean: the error bound, 0 for nothing.
    pub tolerated_pixels: u64,
    /// Views one after another that must be clean; what their number says of others is told at
    /// [`AdaptiveSettings`](crate::AdaptiveSettings::clean_views).
    pub clean_views: u32,
    /// Views at most, clean or not.
    pub most_views: u32,
    /// Moves all views.
    pub seed: u64,
}

/// What a cell sees, and how well it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct CellSet {
    /// All that was seen from any viewpoint of the cell, by samples and views.
    pub set: Bitfield,
    /// Where samples were taken, in metres: first those at corners, edges and faces of the cell
    /// and in its middle.
    pub viewpoints: Vec<DVec3>,
    /// Views one after another, the last of all, that were clean. Fewer than asked for only where
    /// there were as many views as allowed.
    pub clean_views: u32,
    /// After each batch of views.
    pub rounds: Vec<Round>,
}

/// The primitives that are seen from a view cell, which may lie amid the scene: a potentially
/// visible set, from samples.
///
/// Samples are taken at the corners of the cell, in the middle of its edges and faces and in its
/// own. Then come views, each only once and all held back until then, from points of a sequence that
/// fills the cell evenly, and every second one its border. For the worst view of each part of the cell that misses more than is
/// tolerated, a sample is taken there, and the part is cut in two across its longest side, with
/// samples in the middle of either half; so is another part for each of these, that whose samples
/// disagree most: in the middle of which most primitives are seen that nobody else has seen. (The
/// share of what is seen only once estimates the share that was not seen yet: I. J. Good, The
/// Population Frequencies of Species and the Estimation of Population Parameters, 1953.) This ends
/// when as many views in a row as asked for are clean. The set is the union of all that was seen
/// on the way, so that it only grows.
///
/// The set is aggressive: it holds nothing that is not seen from somewhere in the cell, and what
/// can be seen only from where nobody looked is missing. For a viewpoint inside of a solid, let
/// `sample` and `look` see nothing.
///
/// Memory: one set for each part of the cell, which are about two thirds of the samples.
///
/// * `cell` - a box of any size, flat ones and points included, or a shaft that ends
/// * `sample` - for each viewpoint, in metres, all that is seen around it, as by a
///   [`cube_map`](crate::cube_map())
/// * `look` - for each viewpoint, in metres, what a view from there shows: primitives, each with its
///   number of pixels
///
/// # Panics
///
/// When `sample` or `look` do not give as much as they are asked for, or of different models, or a
/// part of the cell lies at infinity.
pub fn cell_set(
    cell: &ViewCell,
    settings: &CellSettings,
    mut sample: impl FnMut(&[DVec3]) -> Vec<Bitfield>,
    look: impl FnMut(&[DVec3]) -> Vec<Vec<[u32; 2]>>,
) -> CellSet {
    let mut sample = |viewpoints: &[DVec3]| {
        let sets = sample(viewpoints);
        assert!(
            sets.len() == viewpoints.len(),
            "{} sets for {} viewpoints",
            sets.len(),
            viewpoints.len()
        );
        sets
    };
    let mut viewpoints = first_viewpoints(cell);
    let mut first = sample(&viewpoints);
    let mut seen = Seen::new(first[0].primitives());
    first.iter().for_each(|set| seen.add(set.iter()));
    let mut parts = vec![Part {
        min: DVec3::ZERO,
        max: DVec3::ONE,
        seen: first.pop().expect("the last one is from the middle"),
    }];

    let at = |index: u64| view_fractions(index, settings.seed);
    let mut looked = 0;
    let learn = |views: &[DVec3], shown: &[Vec<[u32; 2]>]| {
        let mut round = Round::new(viewpoints.len());
        // The worst view of each part.
        let mut worst: BTreeMap<usize, (u64, DVec3)> = BTreeMap::new();
        for ((index, &view), shown) in (looked..).zip(views).zip(shown) {
            let pixels = missed_pixels(shown, &seen.once);
            round.count(pixels, settings.tolerated_pixels);
            if pixels > settings.tolerated_pixels {
                let part = (parts.iter().position(|part| part.contains(at(index))))
                    .expect("parts tile the cell");
                let worst = worst.entry(part).or_insert((pixels, view));
                if pixels > worst.0 {
                    *worst = (pixels, view);
                }
            }
        }
        looked += views.len() as u64;
        (shown.iter()).for_each(|shown| seen.add(shown.iter().map(|[id, _]| *id)));

        let room = (settings.most_samples as usize + FIRST).saturating_sub(viewpoints.len());
        let mut failing: Vec<(usize, (u64, DVec3))> = worst.into_iter().collect();
        failing.sort_by_key(|(_, (pixels, _))| Reverse(*pixels));
        failing.truncate(room);
        let mut added: Vec<DVec3> = failing.iter().map(|(_, (_, view))| *view).collect();
        let failing: Vec<usize> = failing.into_iter().map(|(part, _)| part).collect();
        let cut = parts_to_cut(cell, &parts, &failing, &seen, (room - added.len()) / 2);
        let halves: Vec<[DVec3; 4]> = cut.iter().map(|&part| parts[part].halves(cell)).collect();
        let middles = halves.iter().flat_map(|[a, b, c, d]| [a + b, c + d]);
        added.extend(middles.map(|sum| cell.point(sum / 2.0)));

        let mut sets = sample(&added);
        sets.iter().for_each(|set| seen.add(set.iter()));
        let mut sets = sets.drain(failing.len()..);
        for (part, [min, to, from, max]) in cut.into_iter().zip(halves) {
            let mut half = |[min, max]: [DVec3; 2]| Part {
                min,
                max,
                seen: sets.next().expect("there are two for each part"),
            };
            parts[part] = half([min, to]);
            parts.push(half([from, max]));
        }
        viewpoints.extend(added);
        Ok::<_, Infallible>(round)
    };
    let Ok((clean_views, rounds)) = until_clean(
        settings.clean_views,
        settings.most_views,
        |index| cell.point(at(index)),
        look,
        learn,
    );
    CellSet {
        set: seen.once,
        viewpoints,
        clean_views,
        rounds,
    }
}

/// View `index` of a sequence, as fractions of the cell: one in the cell, one on its border.
///
/// Of what is seen through the border of a cell, the border sees at least as much; and corners,
/// edges and faces, where the most is seen, are a small share of any volume.
fn view_fractions(index: u64, seed: u64) -> DVec3 {
    let mut fractions = low_discrepancy_point(index / 2, seed);
    if index % 2 == 1 {
        let inside = |axis: &usize| fractions[*axis].min(1.0 - fractions[*axis]);
        let nearest = (0..3).min_by(|a, b| inside(a).total_cmp(&inside(b)));
        let axis = nearest.expect("there are three");
        fractions[axis] = fractions[axis].round();
    }
    fractions
}

/// Samples that are taken first, unless the cell is flat.
const FIRST: usize = 27;

/// Corners, edges, faces and at last the middle of a cell, each once where it is flat.
fn first_viewpoints(cell: &ViewCell) -> Vec<DVec3> {
    let mut viewpoints: Vec<DVec3> = Vec::with_capacity(FIRST);
    let middle = cell.center();
    for fractions in lattice_viewpoints() {
        let viewpoint = cell.point(fractions);
        if viewpoint != middle && !viewpoints.contains(&viewpoint) {
            viewpoints.push(viewpoint);
        }
    }
    viewpoints.push(middle);
    viewpoints
}

/// Indices of at most `room` parts: those where views missed something, then as many others in
/// whose middle the most is seen that was seen nowhere else.
fn parts_to_cut(
    cell: &ViewCell,
    parts: &[Part],
    failing: &[usize],
    seen: &Seen,
    room: usize,
) -> Vec<usize> {
    let alone = |part: &usize| parts[*part].seen.count_missing_in(&seen.twice);
    let mut others: Vec<usize> = (0..parts.len())
        .filter(|part| !failing.contains(part) && alone(part) > 0)
        .collect();
    others.sort_by_cached_key(|part| Reverse(alone(part)));
    others.truncate(failing.len());
    let all = failing.iter().copied().chain(others);
    let divisible = all.filter(|&part| parts[part].longest(cell).1 > 0.0);
    divisible.take(room).collect()
}

/// What was seen how often.
struct Seen {
    /// At least once.
    once: Bitfield,
    /// At least twice.
    twice: Bitfield,
}

impl Seen {
    fn new(primitives: u32) -> Self {
        Self {
            once: Bitfield::empty(primitives),
            twice: Bitfield::empty(primitives),
        }
    }

    /// Adds what is seen from one viewpoint, each primitive once.
    fn add(&mut self, ids: impl Iterator<Item = u32>) {
        for id in ids {
            match self.once.contains(id) {
                true => self.twice.insert(id),
                false => self.once.insert(id),
            }
        }
    }
}

/// A part of a cell, with a sample in its middle. Parts tile the cell.
struct Part {
    /// Corners, as fractions of the cell.
    min: DVec3,
    max: DVec3,
    /// From the middle.
    seen: Bitfield,
}

impl Part {
    fn contains(&self, fractions: DVec3) -> bool {
        self.min.cmple(fractions).all() && fractions.cmple(self.max).all()
    }

    /// The axis along which the part is longest, and its length through the middle, in metres.
    fn longest(&self, cell: &ViewCell) -> (usize, f64) {
        let middle = (self.min + self.max) / 2.0;
        let length = |axis: usize| {
            let end = |side: DVec3| {
                let mut end = middle;
                end[axis] = side[axis];
                cell.point(end)
            };
            (axis, end(self.min).distance(end(self.max)))
        };
        let axes = (0..3).map(length);
        let longest = axes.max_by(|a, b| a.1.total_cmp(&b.1));
        longest.expect("there are three")
    }

    /// Least and greatest corners of one half, then of the other, as fractions of the cell.
    fn halves(&self, cell: &ViewCell) -> [DVec3; 4] {
        let (axis, _) = self.longest(cell);
        let [mut to, mut from] = [self.max, self.min];
        to[axis] = (self.min[axis] + self.max[axis]) / 2.0;
        from[axis] = to[axis];
        [self.min, to, from, self.max]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_views::sphere_direction;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// Rays from each viewpoint.
    const RAYS: u32 = 300;

    /// Balls that hide each other.
    #[derive(Debug)]
    struct Balls(Vec<(DVec3, f64)>);

    impl Balls {
        /// The nearest ball on each ray from a viewpoint; from inside of a ball it is that.
        fn ids(&self, eye: DVec3) -> Vec<u32> {
            let hit = |ray: DVec3| {
                let distance = |&(center, radius): &(DVec3, f64)| {
                    let along = (center - eye).dot(ray);
                    let half =
                        (radius * radius - (center - eye - along * ray).length_squared()).sqrt();
                    // NaN where the ray misses it.
                    [along - half, along + half].into_iter().find(|t| *t > 0.0)
                };
                let hits = (0..)
                    .zip(&self.0)
                    .filter_map(|(id, ball)| Some((id, distance(ball)?)));
                let nearest = hits.min_by(|a: &(u32, f64), b| a.1.total_cmp(&b.1));
                nearest.map_or(u32::MAX, |(id, _)| id)
            };
            (0..RAYS).map(|i| hit(sphere_direction(i, RAYS))).collect()
        }

        fn set(&self, eye: DVec3) -> Bitfield {
            Bitfield::from_ids(self.0.len() as u32, &self.ids(eye))
        }

        fn look(&self, eye: DVec3) -> Vec<[u32; 2]> {
            let mut ids = self.ids(eye);
            ids.retain(|id| *id != u32::MAX);
            ids.sort_unstable();
            let runs = ids.chunk_by(|a, b| a == b);
            runs.map(|run| [run[0], run.len() as u32]).collect()
        }
    }

    /// Balls of all sizes around the origin, and a cell amid them: a box, a flat one, one that is a
    /// point, or a shaft.
    fn scenes() -> impl Strategy<Value = (Balls, ViewCell)> {
        let vector = || prop::array::uniform3(-4.0..4.0f64).prop_map(DVec3::from);
        let balls = vec((vector(), 0.05..0.9f64), 30..80).prop_map(Balls);
        let center = || prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from);
        let sizes = prop_oneof![
            prop::array::uniform3(0.1..2.0f64),
            (0.1..2.0f64, 0.1..2.0f64).prop_map(|(x, z)| [x, 0.0, z]),
            Just([0.0; 3]),
        ];
        let boxes = (center(), sizes).prop_map(|(center, size)| ViewCell::Box {
            center,
            size: DVec3::from(size),
        });
        let shafts = (center(), 0.1..0.5f64).prop_map(|(apex, half_angle)| ViewCell::Shaft {
            apex,
            axis: DVec3::X,
            half_angle,
            near: 1.0,
            far: 3.0,
        });
        (balls, prop_oneof![4 => boxes, 1 => shafts])
    }

    const SETTINGS: CellSettings = CellSettings {
        most_samples: 400,
        tolerated_pixels: 0,
        clean_views: 600,
        most_views: 20_000,
        seed: 0,
    };

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        /// The set holds all that samples and views saw, and nothing else: nothing that is not
        /// seen from somewhere in the cell.
        #[test]
        fn the_set_is_what_was_seen_in_the_cell(
            (balls, cell) in scenes(),
            most_samples in 0..60u32,
            // Few, so that samples see what no view did.
            most_views in 1..40u32,
            seed: u64,
        ) {
            let settings = CellSettings { most_samples, most_views, seed, ..SETTINGS };
            let [mut sampled, mut looked] = [Vec::new(), Vec::new()];
            let found = cell_set(
                &cell,
                &settings,
                |viewpoints| {
                    sampled.extend_from_slice(viewpoints);
                    viewpoints.iter().map(|eye| balls.set(*eye)).collect()
                },
                |viewpoints| {
                    looked.extend_from_slice(viewpoints);
                    viewpoints.iter().map(|eye| balls.look(*eye)).collect()
                },
            );
            prop_assert_eq!(&found.viewpoints, &sampled);
            prop_assert!(sampled.len() <= 27 + most_samples as usize);
            // The corners of the cell are among them.
            prop_assert!(cell.corners().iter().all(|c| sampled.contains(&c.truncate())));
            let mut union = Bitfield::empty(balls.0.len() as u32);
            for eye in sampled.iter().chain(&looked) {
                prop_assert!(cell.contains(*eye, 1e-9));
                union.union_with(&balls.set(*eye));
            }
            prop_assert_eq!(found.set, union);
        }

        /// In the end, a search over viewpoints that the loop never saw hardly finds one that
        /// sees anything else; where little is tolerated, hardly one that sees much else.
        #[test]
        fn a_search_hardly_finds_more(
            (balls, cell) in scenes(), tolerated in prop_oneof![Just(0), 1..4u64],
        ) {
            let settings = CellSettings { tolerated_pixels: tolerated, ..SETTINGS };
            let sample = |viewpoints: &[DVec3]| viewpoints.iter().map(|v| balls.set(*v)).collect();
            let look = |viewpoints: &[DVec3]| viewpoints.iter().map(|v| balls.look(*v)).collect();
            let found = cell_set(&cell, &settings, sample, look);
            prop_assert_eq!(found.clean_views, 600);
            let pixels = found.rounds.iter().rev().take(10).map(|round| round.worst).max();
            prop_assert!(pixels.unwrap() <= tolerated);
            let missing = |index: &u64| {
                let set = balls.set(cell.point(low_discrepancy_point(*index, 1)));
                u64::from(set.count_missing_in(&found.set)) > tolerated
            };
            // Every second view is inside: of a share of 3 %, 300 in a row would be clean once in
            // 10,000 times.
            prop_assert!((0..400).filter(missing).count() <= 12);
        }
    }

    /// Where each step uncovers something else, samples gather; elsewhere there are few.
    #[test]
    fn samples_gather_where_views_disagree() {
        // Primitive 0 is seen from everywhere, 1 to 100 each from within a slab 0.03 m wide.
        let ids = |eye: &DVec3| -> Vec<u32> {
            let slab = ((eye.x - 0.6) * 100.0 / 0.3).floor();
            match (0.0..100.0).contains(&slab) {
                true => vec![0, slab as u32 + 1],
                false => vec![0],
            }
        };
        let cell = ViewCell::Box {
            center: DVec3::splat(0.5),
            size: DVec3::ONE,
        };
        let found = |most_samples| {
            let settings = CellSettings {
                most_samples,
                ..SETTINGS
            };
            cell_set(
                &cell,
                &settings,
                |viewpoints| {
                    let sets = viewpoints.iter();
                    sets.map(|eye| Bitfield::from_ids(101, &ids(eye))).collect()
                },
                |viewpoints| {
                    let shown = |eye: &DVec3| ids(eye).iter().map(|id| [*id, 5]).collect();
                    viewpoints.iter().map(shown).collect()
                },
            )
        };
        let all = found(SETTINGS.most_samples);
        assert_eq!(all.set.len(), 101);
        let later = &all.viewpoints[27..];
        let near = later.iter().filter(|eye| (0.5..1.0).contains(&eye.x));
        assert!(later.len() > 50 && near.count() * 10 > later.len() * 7);
        // Views see the rest where samples may not.
        for most_samples in [0, 1, 2, 5, 10] {
            let few = found(most_samples);
            assert_eq!(few.set.len(), 101);
            assert!(few.viewpoints.len() <= 27 + most_samples as usize);
            assert!(few.viewpoints.len() + 2 > 27 + most_samples as usize);
        }
    }

    /// Every second view is on the border of the cell, on all of its faces in the end.
    #[test]
    fn every_second_view_is_on_the_border() {
        let mut faces = [0; 6];
        for index in 0..600 {
            let fractions = view_fractions(index, 3).to_array();
            assert!(fractions.iter().all(|c| (0.0..=1.0).contains(c)));
            let on = (0..6).filter(|face| fractions[face / 2] == (face % 2) as f64);
            let on: Vec<usize> = on.collect();
            assert_eq!(on.len() as u64, index % 2);
            on.iter().for_each(|face| faces[*face] += 1);
        }
        assert!(faces.iter().all(|count| *count > 30), "{faces:?}");
    }

    /// A cell that is a point is sampled once, and a flat one nine times, before views come.
    #[test]
    fn flat_cells_have_no_viewpoint_twice() {
        for (size, expected) in [
            (DVec3::ZERO, 1),
            (DVec3::X, 3),
            (DVec3::new(1.0, 0.0, 1.0), 9),
            (DVec3::ONE, 27),
        ] {
            let cell = ViewCell::Box {
                center: DVec3::ZERO,
                size,
            };
            assert_eq!(first_viewpoints(&cell).len(), expected);
        }
    }
}
