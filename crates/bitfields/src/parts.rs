//! Patches of a model that is drawn part by part.

use crate::{Bitfield, FaceRanges, Patches, Triangulation, cell_patches, patches};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Groups the primitives of each part of a model into patches, as [`patches`] does, and also those
/// that no set has.
///
/// A renderer draws what has one material at a time, so no patch reaches over the border of a part:
/// the places of a part's primitives in the new order are the numbers that they had. Primitives that
/// no set has are the last of their part, in patches of neighbours: a set that is still to come may
/// have some of them.
///
/// * `centers` - of each primitive, in any unit
/// * `sets` - what each face sees
/// * `parts` - part p holds the primitives from `parts[p]` to before `parts[p + 1]`
/// * `most_primitives` - see [`PatchSettings`](crate::PatchSettings)
///
/// # Panics
///
/// As for [`patches`], and when the parts are not those of all primitives, in order.
pub fn patches_in_parts(
    centers: &[Vec3],
    faces: &Triangulation,
    sets: &[Bitfield],
    parts: &[u32],
    most_primitives: u32,
) -> Patches {
    in_parts(centers, sets, parts, most_primitives, |places, sets| {
        patches(places, faces, sets, most_primitives)
    })
}

/// Groups the primitives of each part of a model into patches for view cells, as [`cell_patches`]
/// does, otherwise as [`patches_in_parts`].
///
/// * `cells` - the middle of each cell, in metres
/// * `sets` - what each cell sees
///
/// # Panics
///
/// As for [`cell_patches`], and when the parts are not those of all primitives, in order.
pub fn cell_patches_in_parts(
    centers: &[Vec3],
    cells: &[DVec3],
    sets: &[Bitfield],
    parts: &[u32],
    most_primitives: u32,
) -> Patches {
    in_parts(centers, sets, parts, most_primitives, |places, sets| {
        cell_patches(places, cells, sets, most_primitives)
    })
}

/// * `grouped` - patches of some primitives, by their centres and what of them is seen
fn in_parts(
    centers: &[Vec3],
    sets: &[Bitfield],
    parts: &[u32],
    most_primitives: u32,
    grouped: impl Fn(&[Vec3], &[Bitfield]) -> Patches,
) -> Patches {
    assert_parts(parts, centers.len() as u32);
    let mut seen = Bitfield::empty(centers.len() as u32);
    sets.iter().for_each(|set| seen.union_with(set));
    let mut all = Patches {
        order: Vec::with_capacity(centers.len()),
        starts: vec![0],
    };
    for part in parts.windows(2) {
        let (visible, hidden): (Vec<u32>, Vec<u32>) =
            (part[0]..part[1]).partition(|id| seen.contains(*id));
        let places =
            |ids: &[u32]| -> Vec<Vec3> { ids.iter().map(|id| centers[*id as usize]).collect() };
        let of_visible: Vec<Bitfield> = sets.iter().map(|set| picked(set, &visible)).collect();
        let of_hidden = Bitfield::from_ids(
            hidden.len() as u32,
            &(0..hidden.len() as u32).collect::<Vec<u32>>(),
        );
        // Nothing is known of what nobody sees: as if one cell saw all of it, only its places count.
        let hidden_patches = cell_patches(
            &places(&hidden),
            &[DVec3::ZERO],
            &[of_hidden],
            most_primitives,
        );
        let visible_patches = grouped(&places(&visible), &of_visible);
        for (ids, new) in [(visible, visible_patches), (hidden, hidden_patches)] {
            let start = all.order.len() as u32;
            all.order
                .extend(new.order.iter().map(|at| ids[*at as usize]));
            all.starts
                .extend(new.starts[1..].iter().map(|at| at + start));
        }
    }
    all
}

/// Those of some primitives, numbered anew, that a set has.
fn picked(set: &Bitfield, ids: &[u32]) -> Bitfield {
    let mut picked = Bitfield::empty(ids.len() as u32);
    let with_numbers = (0..).zip(ids);
    with_numbers
        .filter(|(_, id)| set.contains(**id))
        .for_each(|(number, _)| picked.insert(number));
    picked
}

impl Patches {
    /// For each set of patches, the ranges of places that hold all its primitives: none reaches over
    /// the border of a part, and what lies between them is added where there are too many, the least
    /// first.
    ///
    /// A face that sees something of more parts than ranges are allowed has a range for each of these.
    ///
    /// * `sets` - of patches, not of primitives: those [`holding`](Self::holding) what is seen
    /// * `parts` - see [`patches_in_parts`]
    /// * `most_ranges` - see [`PatchSettings`](crate::PatchSettings)
    ///
    /// # Panics
    ///
    /// When a set is not one of as many as there are patches, or the parts are not those of all
    /// primitives, in order.
    pub fn ranges_in_parts(
        &self,
        sets: &[Bitfield],
        parts: &[u32],
        most_ranges: u32,
    ) -> FaceRanges {
        assert_parts(parts, self.order.len() as u32);
        FaceRanges::from_lists(sets.iter().map(|set| {
            assert!(
                set.primitives() == self.count(),
                "a set of {} patches, but there are {}",
                set.primitives(),
                self.count()
            );
            let patch = |number: u32| {
                let at = number as usize;
                self.starts[at]..self.starts[at + 1]
            };
            join_in_parts(set.iter().map(patch), parts, most_ranges as usize)
        }))
    }
}

/// Ascending ranges, each within one part, joined where they touch and, while there are more than
/// `most`, where the least is between them; never over a border.
///
/// What is added is the sum of the gaps that are closed, so closing the smallest adds the least.
fn join_in_parts(
    ranges: impl Iterator<Item = Range<u32>>,
    parts: &[u32],
    most: usize,
) -> Vec<Range<u32>> {
    let ranges: Vec<Range<u32>> = ranges.collect();
    // The gap behind each range but the last; none where a border is in it.
    let gaps: Vec<Option<u32>> = ranges
        .windows(2)
        .map(|pair| {
            let (end, start) = (pair[0].end, pair[1].start);
            let border = parts[parts.partition_point(|border| *border < end)];
            (border > start).then(|| start - end)
        })
        .collect();
    let touching = gaps.iter().filter(|gap| **gap == Some(0)).count();
    let mut closable: Vec<(u32, usize)> = gaps
        .iter()
        .enumerate()
        .filter_map(|(at, gap)| gap.filter(|gap| *gap > 0).map(|gap| (gap, at)))
        .collect();
    closable.sort_unstable();
    let surplus = (ranges.len() - touching).saturating_sub(most);
    let mut closed: Vec<bool> = gaps.iter().map(|gap| *gap == Some(0)).collect();
    for &(_, at) in closable.iter().take(surplus) {
        closed[at] = true;
    }
    let mut joined: Vec<Range<u32>> = Vec::new();
    for (at, range) in ranges.into_iter().enumerate() {
        match joined.last_mut() {
            Some(last) if closed[at - 1] => last.end = range.end,
            _ => joined.push(range),
        }
    }
    joined
}

pub(crate) fn assert_parts(parts: &[u32], primitives: u32) {
    assert!(
        parts.first() == Some(&0) && parts.last() == Some(&primitives) && parts.is_sorted(),
        "the parts {parts:?} are not those of {primitives} primitives"
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::tests::samples;
    use crate::{United, face_sets};
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        /// Every primitive is in one patch of its part, seen or not, and no patch is too large, of
        /// faces and of cells.
        #[test]
        fn patches_stay_in_their_parts(
            (faces, sets) in samples(),
            places in vec(prop::array::uniform3(-1.0..1.0f32), 500),
            mut borders in vec(0..=500u32, 0..6),
            most in 1..300u32,
        ) {
            borders.extend([0, 500]);
            borders.sort_unstable();
            let sets = face_sets(&faces, &sets, United::Six);
            let centers: Vec<Vec3> = places.into_iter().map(Vec3::from).collect();
            let cells: Vec<DVec3> = (0..sets.len()).map(|i| DVec3::X * i as f64).collect();
            for patches in [
                patches_in_parts(&centers, &faces, &sets, &borders, most),
                cell_patches_in_parts(&centers, &cells, &sets, &borders, most),
            ] {
                for part in borders.windows(2) {
                    let places = part[0] as usize..part[1] as usize;
                    let mut ids = patches.order[places].to_vec();
                    ids.sort_unstable();
                    prop_assert!(ids.into_iter().eq(part[0]..part[1]));
                    prop_assert!(patches.starts.contains(&part[0]));
                }
                for patch in patches.starts.windows(2) {
                    prop_assert!(patch[0] < patch[1] && patch[1] - patch[0] <= most);
                    let is_seen = |at: &u32| {
                        let id = patches.order[*at as usize];
                        sets.iter().any(|set| set.contains(id))
                    };
                    let seen = (patch[0]..patch[1]).filter(is_seen).count() as u32;
                    prop_assert!(seen == 0 || seen == patch[1] - patch[0]);
                }
            }
        }

        /// Ranges hold all of a set's patches, lie in one part each, and are as few as allowed or
        /// one a part; one more range allowed never draws more.
        #[test]
        fn ranges_stay_in_their_parts(
            sizes in vec(1..5u32, 60),
            chosen in vec(any::<bool>(), 60),
            cuts in vec(0..60usize, 0..6),
            most in 1..20u32,
        ) {
            let starts: Vec<u32> = std::iter::once(0)
                .chain(sizes.iter().scan(0, |sum, size| { *sum += size; Some(*sum) }))
                .collect();
            let all = *starts.last().unwrap();
            let mut parts: Vec<u32> = cuts.iter().map(|cut| starts[*cut]).chain([0, all]).collect();
            parts.sort_unstable();
            let patches = Patches { order: (0..all).collect(), starts: starts.clone() };
            let ids: Vec<u32> = (0..60).filter(|i| chosen[*i as usize]).collect();
            let set = Bitfield::from_ids(60, &ids);
            let part_of = |at: u32| parts.partition_point(|border| *border <= at);
            let lists = [most, most + 1].map(|most| {
                patches.ranges_in_parts(std::slice::from_ref(&set), &parts, most)
            });
            let ranges = lists[0].of(0);
            for range in ranges {
                prop_assert!(range.start < range.end);
                prop_assert_eq!(part_of(range.start), part_of(range.end - 1));
            }
            prop_assert!(ranges.is_sorted_by(|a, b| a.end <= b.start));
            for id in ids {
                let patch = starts[id as usize]..starts[id as usize + 1];
                prop_assert!(ranges.iter().any(|r| r.start <= patch.start && patch.end <= r.end));
            }
            let mut seen: Vec<usize> = ranges.iter().map(|range| part_of(range.start)).collect();
            seen.dedup();
            prop_assert!(ranges.len() <= seen.len().max(most as usize));
            prop_assert!(lists[1].primitives_of(0) <= lists[0].primitives_of(0));
        }

        /// Of all ways to join ranges, none that leaves as few has fewer places between them.
        #[test]
        fn the_smallest_gaps_are_closed(
            lengths in vec((0..4u32, 1..3u32), 0..9),
            most in 1..6u32,
        ) {
            let mut end = 0;
            let ranges: Vec<Range<u32>> = lengths.iter().map(|&(gap, len)| {
                let start = end + gap;
                end = start + len;
                start..end
            }).collect();
            let joined = join_in_parts(ranges.iter().cloned(), &[0, end + 1], most as usize);
            prop_assert!(joined.windows(2).all(|pair| pair[0].end < pair[1].start));
            let gaps = ranges.len().saturating_sub(1);
            let least = (0..1u32 << gaps).filter_map(|open| {
                let opened = (0..gaps).filter(|i| open >> i & 1 != 0);
                let wide = |i: &usize| ranges[*i].end < ranges[i + 1].start;
                let closed = (0..gaps).filter(|i| open >> i & 1 == 0);
                (open.count_ones() < most && opened.clone().all(|i| wide(&i))).then(|| {
                    closed.map(|i| ranges[i + 1].start - ranges[i].end).sum::<u32>()
                })
            }).min().unwrap_or(0);
            let len = |ranges: &[Range<u32>]| ranges.iter().map(|r| r.end - r.start).sum::<u32>();
            prop_assert_eq!(len(&joined), len(&ranges) + least);
        }
    }
}
