//! What to draw for views through a face.

use crate::{Bitfield, Triangulation};
use std::ops::Range;

/// Which samples are united for the views through a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum United {
    /// Those at its corners.
    Three,
    /// Those at its corners and at the opposite corners of its neighbours
    /// ([`Triangulation::six`]): fewer primitives are missed.
    Six,
}

/// For each face, what the samples around it see.
///
/// Section 3.2 of Meruvia Pastor and Strothotte.
///
/// * `sets` - what each viewpoint of the triangulation sees, of one model
///
/// # Panics
///
/// When there is not one set for each viewpoint, or they are of different models.
pub fn face_sets(faces: &Triangulation, sets: &[Bitfield], united: United) -> Vec<Bitfield> {
    let viewpoints = faces.directions().len();
    assert!(
        sets.len() == viewpoints,
        "{} sets for {viewpoints} viewpoints",
        sets.len()
    );
    let of_face = |face: u32| {
        let six = faces.six(face);
        let around = match united {
            United::Three => &six[..3],
            United::Six => &six[..],
        };
        let mut union = sets[around[0] as usize].clone();
        (around[1..].iter()).for_each(|&sample| union.union_with(&sets[sample as usize]));
        union
    };
    (0..faces.faces().len() as u32).map(of_face).collect()
}

/// A list of ranges for each face, all in one array.
///
/// What is numbered is the caller's affair: primitives as they are in a model, or as
/// patches have ordered them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceRanges {
    /// The ranges of face f are `ranges[starts[f]..starts[f + 1]]`.
    pub starts: Vec<u32>,
    /// Ascending within a face, none empty, none that overlap.
    pub ranges: Vec<Range<u32>>,
}

impl FaceRanges {
    /// One list after the other.
    pub fn from_lists(lists: impl IntoIterator<Item = Vec<Range<u32>>>) -> Self {
        let (mut starts, mut ranges) = (vec![0], Vec::new());
        for list in lists {
            ranges.extend(list);
            starts.push(ranges.len() as u32);
        }
        Self { starts, ranges }
    }

    /// Exactly the primitives of each set.
    pub fn from_sets(sets: &[Bitfield]) -> Self {
        Self::from_lists(sets.iter().map(Bitfield::ranges))
    }

    /// Number of lists: of faces, or of cells.
    pub fn count(&self) -> u32 {
        self.starts.len() as u32 - 1
    }

    /// The ranges of a face.
    ///
    /// # Panics
    ///
    /// When there is no such face.
    #[inline]
    pub fn of(&self, face: u32) -> &[Range<u32>] {
        let face = face as usize;
        &self.ranges[self.starts[face] as usize..self.starts[face + 1] as usize]
    }

    /// Number of primitives in the ranges of a face.
    ///
    /// # Panics
    ///
    /// When there is no such face.
    pub fn primitives_of(&self, face: u32) -> u32 {
        self.of(face)
            .iter()
            .map(|range| range.end - range.start)
            .sum()
    }

    /// Bytes of both arrays: 4 a face and 8 a range.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.ranges[..])
    }
}

/// Mean share of a model's primitives that the ranges of a face leave out, over all faces.
///
/// # Panics
///
/// When there is no face.
pub fn culled_share(lists: &FaceRanges, primitives: u32) -> f64 {
    let faces = lists.count();
    assert!(faces > 0, "no face culls anything");
    let drawn = (0..faces).map(|face| f64::from(lists.primitives_of(face)));
    1.0 - drawn.sum::<f64>() / (f64::from(faces) * f64::from(primitives).max(1.0))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::triangulation::tests::viewpoints;
    use glam::DVec3;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// A triangulation, and for each viewpoint some of 500 primitives.
    pub(crate) fn samples() -> impl Strategy<Value = (Triangulation, Vec<Bitfield>)> {
        viewpoints().prop_flat_map(|viewpoints| {
            let sets = vec(vec(0..500u32, 0..80), viewpoints.len());
            sets.prop_map(move |sets| {
                let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
                let sets = sets.iter().map(|ids| Bitfield::from_ids(500, ids));
                (faces, sets.collect())
            })
        })
    }

    proptest! {
        /// Whatever a sample sees is in the sets of all faces at its viewpoint, and three
        /// samples never see more than six.
        #[test]
        fn what_a_sample_sees_is_in_all_its_faces((faces, sets) in samples()) {
            let three = face_sets(&faces, &sets, United::Three);
            let six = face_sets(&faces, &sets, United::Six);
            for (index, face) in faces.faces().iter().enumerate() {
                for corner in face.corners {
                    prop_assert_eq!(sets[corner as usize].count_missing_in(&three[index]), 0);
                }
                prop_assert_eq!(three[index].count_missing_in(&six[index]), 0);
            }
        }

        /// A face has what one of its six sees, and nothing else, whether as a set or as ranges.
        #[test]
        fn the_ranges_of_a_face_are_what_its_six_see((faces, sets) in samples()) {
            let united = face_sets(&faces, &sets, United::Six);
            let lists = FaceRanges::from_sets(&united);
            prop_assert_eq!(lists.count() as usize, faces.faces().len());
            let mut drawn = 0;
            for face in 0..lists.count() {
                let six = faces.six(face);
                let seen = |id: &u32| six.iter().any(|&sample| sets[sample as usize].contains(*id));
                let expected: Vec<u32> = (0..500).filter(seen).collect();
                prop_assert!(lists.of(face).iter().cloned().flatten().eq(expected.clone()));
                prop_assert_eq!(lists.primitives_of(face) as usize, expected.len());
                drawn += expected.len();
            }
            let culled = 1.0 - drawn as f64 / (500.0 * f64::from(lists.count()));
            prop_assert!((culled_share(&lists, 500) - culled).abs() < 1e-12);
        }
    }
}
