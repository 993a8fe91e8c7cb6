//! Samples where they are needed.

use crate::directions::circumcenter;
use crate::held_back::{missed_pixels, until_clean};
use crate::{Bitfield, Distances, Round, Triangulation, TriangulationError, United, face_sets};
use farfield_views::{direction_at, low_discrepancy_point};
use glam::DVec3;
use std::collections::BTreeMap;

/// Closer to another viewpoint than this, in radians, a direction does not become one of its own: the
/// other sees the same from there.
const NEAR: f64 = 1e-4;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSettings {
    /// Where views are, and at which distances each sample is taken.
    pub distances: Distances,
    /// Viewpoints at most, each a direction. The more, the smaller the faces and the more is
    /// culled, and the more bytes they take. From then on, what views miss joins the nearest
    /// viewpoint's set.
    pub most_viewpoints: u32,
    /// Pixels that a view may miss and still be clean: 0 for nothing.
    pub tolerated_pixels: u64,
    /// Views one after another that must be clean.
    ///
    /// If a share s of independent views is not, n in a row are with probability (1 - s)^n: after
    /// 1,000 the share is less than 0.3 % with 95 % confidence, after 3,000 less than 0.1 %.
    pub clean_views: u32,
    /// Views at most, clean or not.
    pub most_views: u32,
    /// Moves all views.
    pub seed: u64,
}

/// Samples, and how well they did.
#[derive(Clone, Debug, PartialEq)]
pub struct Adapted {
    /// Between the viewpoints.
    pub faces: Triangulation,
    /// What each viewpoint sees at all distances, and what views nearby saw that would have been
    /// missed.
    pub sets: Vec<Bitfield>,
    /// Samples that were taken: of viewpoints, at each of the distances, and where views missed something
    /// when there were as many viewpoints as allowed.
    pub samples: u32,
    /// Views one after another, the last of all, that were clean. Fewer than asked for only where
    /// there were as many views as allowed.
    pub clean_views: u32,
    /// After each batch of views.
    pub rounds: Vec<Round>,
}

/// Adds viewpoints where views miss something and where neighbouring samples disagree, until views
/// that were held back miss nothing, or no more than is tolerated.
///
/// Views come in batches from directions and distances of a sequence that fills both evenly, each
/// only once. A view that misses more than is tolerated is taken as a sample: its direction becomes
/// a viewpoint, one for each face, and for each of these another one comes in the middle of the
/// face whose three corners disagree most, that is, where most primitives are seen by just one of
/// them. When there are as many viewpoints as allowed, a sample from where the view was joins the
/// nearest viewpoint instead. What a view itself shows joins the nearest viewpoint in any case, so
/// that what is too small for a sample is not missed again. Sets only grow from then on, so that
/// there is an end.
///
/// Goes beyond the paper, which has samples spread evenly only: with more of these, faces shrink,
/// and so do the sets that are united for them, so that little less is missed.
///
/// * `start` - directions from the model's centre to the first viewpoints, of any length
/// * `sample` - for each offset from the model's centre, in metres, what is seen from there
/// * `look` - for each offset from the model's centre, in metres, what a view from there shows:
///   primitives, each with its number of pixels
///
/// # Errors
///
/// When the first viewpoints have no triangulation.
///
/// # Panics
///
/// When `sample` or `look` do not give as much as they are asked for, or of different models, or
/// the distances are none (see [`Distances::viewpoints`]).
pub fn adapt(
    start: &[DVec3],
    settings: &AdaptiveSettings,
    mut sample: impl FnMut(&[DVec3]) -> Vec<Bitfield>,
    look: impl FnMut(&[DVec3]) -> Vec<Vec<[u32; 2]>>,
) -> Result<Adapted, TriangulationError> {
    let distances = &settings.distances;
    let mut samples = 0;
    let mut sample = |offsets: &[DVec3]| {
        samples += offsets.len() as u32;
        sample(offsets)
    };
    let mut faces = Triangulation::new(start, DVec3::ZERO)?;
    let mut sets = distances.unite(&sample(&distances.viewpoints(faces.directions())));
    let view = |index| view_offset(index, distances, settings.seed);
    let learn = |views: &[DVec3], shown: &[Vec<[u32; 2]>]| {
        let united = face_sets(&faces, &sets, United::Six);
        let mut round = Round::new(sets.len());
        let mut missing = Vec::new();
        let mut face = 0;
        for (&offset, shown) in views.iter().zip(shown) {
            face = faces.walk(face, offset);
            let pixels = missed_pixels(shown, &united[face as usize]);
            round.count(pixels, settings.tolerated_pixels);
            if pixels > 0 {
                missing.push(Missing {
                    pixels,
                    face,
                    offset,
                    shown,
                });
            }
        }

        let failing = missing.iter();
        let failing: Vec<&Missing<'_>> = failing
            .filter(|view| view.pixels > settings.tolerated_pixels)
            .collect();
        let room = settings.most_viewpoints.saturating_sub(sets.len() as u32) as usize;
        let added = viewpoints(&faces, &sets, &failing, room);
        if added.is_empty() {
            let offsets: Vec<DVec3> = failing.iter().map(|view| view.offset).collect();
            for (view, seen) in failing.iter().zip(&sample(&offsets)) {
                sets[nearest(&faces, view.face, view.offset)].union_with(seen);
            }
        } else {
            sets.extend(distances.unite(&sample(&distances.viewpoints(&added))));
            let all = [faces.directions(), &added].concat();
            faces = Triangulation::new(&all, DVec3::ZERO)?;
        }
        for view in &missing {
            face = faces.walk(0, view.offset);
            let set = &mut sets[nearest(&faces, face, view.offset)];
            view.shown.iter().for_each(|[id, _]| set.insert(*id));
        }
        Ok(round)
    };
    let (clean_views, rounds) =
        until_clean(settings.clean_views, settings.most_views, view, look, learn)?;
    Ok(Adapted {
        faces,
        sets,
        samples,
        clean_views,
        rounds,
    })
}

/// The corner of a face that is nearest to a direction, of any length.
fn nearest(faces: &Triangulation, face: u32, direction: DVec3) -> usize {
    let corners = faces.faces()[face as usize].corners;
    let cosine = |corner: &u32| faces.directions()[*corner as usize].dot(direction);
    let nearest = corners
        .into_iter()
        .max_by(|a, b| cosine(a).total_cmp(&cosine(b)));
    nearest.expect("there are three") as usize
}

/// A view that misses something.
struct Missing<'a> {
    pixels: u64,
    face: u32,
    offset: DVec3,
    shown: &'a [[u32; 2]],
}

/// Directions of new viewpoints, at most `room`: the worst view of each face, and as many faces in
/// which samples disagree most.
fn viewpoints(
    faces: &Triangulation,
    sets: &[Bitfield],
    missing: &[&Missing<'_>],
    room: usize,
) -> Vec<DVec3> {
    let mut worst: BTreeMap<u32, &Missing<'_>> = BTreeMap::new();
    for &view in missing {
        let worst = worst.entry(view.face).or_insert(view);
        if view.pixels > worst.pixels {
            *worst = view;
        }
    }
    let mut views: Vec<&Missing<'_>> = worst.values().copied().collect();
    views.sort_by_key(|view| std::cmp::Reverse(view.pixels));
    let mut added: Vec<DVec3> = Vec::new();
    // Hundreds of viewpoints, with tens that are added.
    let is_apart = |direction: DVec3, added: &[DVec3]| {
        let mut others = faces.directions().iter().chain(added);
        others.all(|other| other.distance(direction) > NEAR)
    };
    for direction in views.iter().map(|view| view.offset.normalize()) {
        if added.len() < room && is_apart(direction, &added) {
            added.push(direction);
        }
    }

    let mut others: Vec<u32> = (0..faces.faces().len() as u32)
        .filter(|face| !worst.contains_key(face))
        .collect();
    others.sort_by_cached_key(|&face| std::cmp::Reverse(disagreement(faces, sets, face)));
    let most = room.min(2 * added.len());
    // Faces between viewpoints on one circle have the same middle.
    for direction in others.iter().map(|&face| middle(faces, face)) {
        if added.len() < most && is_apart(direction, &added) {
            added.push(direction);
        }
    }
    added
}

/// A direction in a face that is far from its corners.
fn middle(faces: &Triangulation, face: u32) -> DVec3 {
    let corners = faces.corners(face);
    // The centre of an obtuse face's circle lies in another one.
    match circumcenter(corners) {
        center if faces.contains(face, center) => center,
        _ => corners.iter().sum::<DVec3>().normalize(),
    }
}

/// Number of primitives that only one of a face's three corners sees.
fn disagreement(faces: &Triangulation, sets: &[Bitfield], face: u32) -> u32 {
    let corners = faces.faces()[face as usize].corners;
    let [a, b, c] = corners.map(|corner| &sets[corner as usize]);
    let alone = |one: &Bitfield, two: &Bitfield, three: &Bitfield| {
        let mut others = two.clone();
        others.union_with(three);
        one.count_missing_in(&others)
    };
    alone(a, b, c) + alone(b, c, a) + alone(c, a, b)
}

/// View `index` of a sequence that fills directions and distances evenly, from the centre.
fn view_offset(index: u64, distances: &Distances, seed: u64) -> DVec3 {
    let point = low_discrepancy_point(index, seed);
    direction_at(point.truncate()) * distances.at(point.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::even_directions;
    use farfield_views::{lattice_viewpoints, sphere_direction};
    use proptest::prelude::*;

    const DISTANCES: Distances = Distances {
        nearest: 1.5,
        farthest: 6.0,
        samples: 2,
    };

    const SETTINGS: AdaptiveSettings = AdaptiveSettings {
        distances: DISTANCES,
        most_viewpoints: 20,
        tolerated_pixels: 0,
        clean_views: 1000,
        most_views: 100_000,
        seed: 0,
    };

    /// Primitives on the unit sphere: most are seen from all that is before their tangent plane,
    /// some only through a hole, from within 10 degrees, and some from neither near nor far, where
    /// no sample is taken.
    struct Ball(Vec<DVec3>);

    impl Ball {
        fn new(count: u32) -> Self {
            Self((0..count).map(|i| sphere_direction(i, count)).collect())
        }

        fn ids(&self, offset: DVec3) -> Vec<u32> {
            let distance = offset.length();
            let seen = |id: &u32| {
                let height = self.0[*id as usize].dot(offset);
                match id % 20 {
                    0 => height > distance * 10f64.to_radians().cos(),
                    10 => height > 0.6 * distance && (2.0..3.0).contains(&distance),
                    _ => height > 1.0,
                }
            };
            (0..self.0.len() as u32).filter(seen).collect()
        }

        fn sets(&self, offsets: &[DVec3]) -> Vec<Bitfield> {
            let set = |d: &DVec3| Bitfield::from_ids(self.0.len() as u32, &self.ids(*d));
            offsets.iter().map(set).collect()
        }

        fn look(&self, offsets: &[DVec3]) -> Vec<Vec<[u32; 2]>> {
            let shown = |d: &DVec3| self.ids(*d).iter().map(|id| [*id, 3]).collect();
            offsets.iter().map(shown).collect()
        }
    }

    /// Spread evenly, or the corners of a cube, or these and the middles of its edges and faces:
    /// there, four viewpoints and more lie on a circle, so that faces share their middles.
    fn starts() -> impl Strategy<Value = Vec<DVec3>> {
        let lattice: Vec<DVec3> = (lattice_viewpoints().iter())
            .map(|fractions| fractions * 2.0 - 1.0)
            .collect();
        let corners = lattice.iter().filter(|v| v.length_squared() == 3.0);
        let corners: Vec<DVec3> = corners.copied().collect();
        prop_oneof![Just(even_directions(12)), Just(corners), Just(lattice)]
    }

    proptest! {
        /// However many views of whatever faces miss something, the viewpoints that are added have a
        /// triangulation with those that are there, and are not too many.
        #[test]
        fn added_viewpoints_are_apart(
            start in starts(),
            views in prop::collection::vec((0..999u32, 1..9u64), 1..20),
            room in 0..40usize,
        ) {
            let faces = Triangulation::new(&start, DVec3::ZERO).unwrap();
            let sets = vec![Bitfield::empty(1); start.len()];
            let views = views.iter().map(|&(index, pixels)| {
                let offset = 3.0 * sphere_direction(index, 999);
                Missing { pixels, face: faces.walk(0, offset), offset, shown: &[] }
            });
            let views: Vec<Missing<'_>> = views.collect();
            let added = viewpoints(&faces, &sets, &views.iter().collect::<Vec<_>>(), room);
            prop_assert!(added.len() <= room && (room == 0 || !added.is_empty()));
            let all = [faces.directions(), &added].concat();
            prop_assert!(Triangulation::new(&all, DVec3::ZERO).is_ok());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        /// In the end as many views in a row as asked for miss nothing, there are no more
        /// viewpoints than allowed, every viewpoint's set has what is seen from there at each of
        /// the distances, and other views, which the loop never saw, at distances between them,
        /// hardly miss anything.
        #[test]
        fn held_back_views_miss_nothing(
            start in starts(),
            seed: u64,
            most_viewpoints in 0..80u32,
        ) {
            let model = Ball::new(200);
            let settings = AdaptiveSettings { most_viewpoints, seed, ..SETTINGS };
            let mut samples = 0;
            let sample = |offsets: &[DVec3]| {
                samples += offsets.len() as u32;
                model.sets(offsets)
            };
            let adapted = adapt(&start, &settings, sample, |d| model.look(d)).unwrap();
            prop_assert_eq!(adapted.samples, samples);
            prop_assert_eq!(adapted.clean_views, 1000);
            // 15 batches of 64, and one of 40.
            let clean = adapted.rounds.iter().rev().take_while(|round| round.missing_views == 0);
            prop_assert_eq!(clean.count(), 16);
            prop_assert!(adapted.sets.len() as u32 <= most_viewpoints.max(start.len() as u32));
            prop_assert_eq!(adapted.sets.len(), adapted.faces.directions().len());
            for distance in [1.5, 6.0] {
                let directions = adapted.faces.directions().iter();
                let offsets: Vec<DVec3> = directions.map(|d| *d * distance).collect();
                for (seen, set) in model.sets(&offsets).iter().zip(&adapted.sets) {
                    prop_assert_eq!(seen.count_missing_in(set), 0);
                }
            }
            // The first samples cannot see through all of the holes.
            prop_assert!(adapted.rounds.iter().any(|round| round.missed_pixels > 0));
            let united = face_sets(&adapted.faces, &adapted.sets, United::Six);
            let missing = |i: &u32| {
                let distance = DISTANCES.at(f64::from(i % 37) / 36.0);
                let offset = sphere_direction(*i, 2000) * distance;
                let face = adapted.faces.walk(0, offset);
                model.ids(offset).iter().any(|id| !united[face as usize].contains(*id))
            };
            // Of a share of 1 %, a thousand in a row would be clean once in 20,000 times.
            prop_assert!((0..2000).filter(missing).count() < 20);
        }

        /// Where no viewpoints may be added, nothing that a view ever showed is missing in the end.
        #[test]
        fn what_a_view_showed_is_not_missed_again(seed: u64) {
            let model = Ball::new(200);
            let settings = AdaptiveSettings {
                most_viewpoints: 12,
                clean_views: 100,
                most_views: 300,
                seed,
                ..SETTINGS
            };
            let mut looked = Vec::new();
            let look = |offsets: &[DVec3]| {
                looked.extend_from_slice(offsets);
                model.look(offsets)
            };
            // These samples see nothing at all.
            let blind = |offsets: &[DVec3]| vec![Bitfield::empty(200); offsets.len()];
            let adapted = adapt(&even_directions(12), &settings, blind, look).unwrap();
            let united = face_sets(&adapted.faces, &adapted.sets, United::Six);
            for offset in looked {
                prop_assert!((1.5..=6.0).contains(&offset.length()));
                let set = &united[adapted.faces.walk(0, offset) as usize];
                prop_assert!(model.ids(offset).iter().all(|id| set.contains(*id)));
            }
        }
    }

    /// The views end where no more are allowed, and it is told.
    #[test]
    fn too_few_views_are_told() {
        let model = Ball::new(200);
        let settings = AdaptiveSettings {
            most_views: 100,
            ..SETTINGS
        };
        let (mut looked, start) = (0, even_directions(12));
        let look = |offsets: &[DVec3]| {
            looked += offsets.len();
            model.look(offsets)
        };
        let adapted = adapt(&start, &settings, |d| model.sets(d), look).unwrap();
        assert!(adapted.clean_views < 100 && looked == 100);
    }

    /// What is tolerated does not count: views of three pixels a primitive are clean at once where
    /// all of them may be missed.
    #[test]
    fn what_is_tolerated_is_clean() {
        let model = Ball::new(200);
        let settings = AdaptiveSettings {
            tolerated_pixels: 600,
            clean_views: 100,
            most_views: 1000,
            ..SETTINGS
        };
        let blind = |offsets: &[DVec3]| vec![Bitfield::empty(200); offsets.len()];
        let start = even_directions(12);
        let adapted = adapt(&start, &settings, blind, |d| model.look(d)).unwrap();
        assert_eq!((adapted.clean_views, adapted.rounds.len()), (100, 2));
        assert!(adapted.rounds[0].missed_pixels > 0 && adapted.sets.len() == 12);
    }
}
