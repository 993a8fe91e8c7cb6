//! Primitives in the same place.

use crate::Patches;
use crate::parts::assert_parts;

impl Patches {
    /// The same patches, with primitives that lie in the same place in the order of their numbers.
    ///
    /// Of triangles with the same corners a renderer shows the one that is drawn first, or last, as its
    /// depth test has it, so that the picture depends on their order. They change places with each other
    /// only; nothing else moves but within its patch.
    ///
    /// * `triangles` - three vertices of each primitive. Vertices that lie in the same place must be
    ///   the same one, as [`welded`](crate::welded) makes them
    /// * `parts` - those of the patches, see [`patches_in_parts`](crate::patches_in_parts): what lies in
    ///   the same place stays in its part
    ///
    /// # Panics
    ///
    /// When there is not one triangle for each primitive, or the parts are not those of all primitives, in
    /// order.
    pub fn with_coincident_in_order(mut self, triangles: &[[u32; 3]], parts: &[u32]) -> Self {
        assert!(
            triangles.len() == self.order.len(),
            "{} triangles for patches of {}",
            triangles.len(),
            self.order.len()
        );
        assert_parts(parts, triangles.len() as u32);
        let mut place_of = vec![0; triangles.len()];
        for (place, &id) in (0u32..).zip(&self.order) {
            place_of[id as usize] = place;
        }
        let key = |id: u32| {
            let mut corners = triangles[id as usize];
            corners.sort_unstable();
            (parts.partition_point(|border| *border <= id), corners)
        };
        let mut ids: Vec<u32> = (0..triangles.len() as u32).collect();
        ids.sort_by_cached_key(|id| key(*id));
        for coincident in ids.chunk_by(|a, b| key(*a) == key(*b)) {
            let mut places: Vec<u32> = (coincident.iter())
                .map(|id| place_of[*id as usize])
                .collect();
            places.sort_unstable();
            for (place, id) in places.into_iter().zip(coincident) {
                self.order[place as usize] = *id;
            }
        }
        for patch in self.starts.windows(2) {
            self.order[patch[0] as usize..patch[1] as usize].sort_unstable();
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use crate::faces::tests::samples;
    use crate::{United, face_sets, patches_in_parts};
    use glam::Vec3;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        /// Whatever lies in the same place of a part follows each other in its old order, every place still
        /// has a primitive of its part, and patches are where they were.
        #[test]
        fn what_coincides_keeps_its_order(
            (faces, sets) in samples(),
            places in vec(prop::array::uniform3(-1.0..1.0f32), 500),
            corners in vec(0..4u32, 500),
            border in 0..=500u32,
            most in 1..100u32,
        ) {
            let sets = face_sets(&faces, &sets, United::Six);
            let centers: Vec<Vec3> = places.into_iter().map(Vec3::from).collect();
            // Of few places, some with their corners in another order.
            let triangles: Vec<[u32; 3]> = (corners.into_iter().enumerate())
                .map(|(i, at)| if i % 3 == 0 { [9, at, 8] } else { [at, 8, 9] })
                .collect();
            let parts = [0, border, 500];
            let before = patches_in_parts(&centers, &faces, &sets, &parts, most);
            let after = before.clone().with_coincident_in_order(&triangles, &parts);
            prop_assert_eq!(&after.starts, &before.starts);
            for part in parts.windows(2) {
                let ids = &after.order[part[0] as usize..part[1] as usize];
                let mut sorted = ids.to_vec();
                sorted.sort_unstable();
                prop_assert!(sorted.into_iter().eq(part[0]..part[1]));
                for at in 0..4 {
                    let there = ids.iter().filter(|id| triangles[**id as usize].contains(&at));
                    prop_assert!(there.is_sorted());
                }
            }
        }

        /// Where no two primitives lie in the same place, nothing changes.
        #[test]
        fn what_lies_apart_stays(
            (faces, sets) in samples(),
            places in vec(prop::array::uniform3(-1.0..1.0f32), 500),
        ) {
            let sets = face_sets(&faces, &sets, United::Six);
            let centers: Vec<Vec3> = places.into_iter().map(Vec3::from).collect();
            let triangles: Vec<[u32; 3]> = (0..500).map(|i| [i, i + 1, i + 2]).collect();
            let patches = patches_in_parts(&centers, &faces, &sets, &[0, 500], 64);
            prop_assert_eq!(&patches.clone().with_coincident_in_order(&triangles, &[0, 500]), &patches);
        }
    }
}
