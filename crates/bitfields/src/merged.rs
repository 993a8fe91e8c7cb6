//! Viewpoints in the same direction.

use crate::triangulation::{CLOSEST, direction};
use crate::{Bitfield, TriangulationError};
use glam::DVec3;

/// The directions of a list of viewpoints, of length 1 and each once, and for each viewpoint the
/// index of its direction.
///
/// For lists of the user's own, in which viewpoints may be doubled, or lie at several distances in
/// one direction: a [`Triangulation`](crate::Triangulation) takes no direction twice. Directions
/// within a millionth of a radian of one that comes before are that one.
///
/// * `viewpoints` - in metres
/// * `center` - of the model, in metres
///
/// # Errors
///
/// When a viewpoint is not finite or in the centre.
pub fn merge_directions(
    viewpoints: &[DVec3],
    center: DVec3,
) -> Result<(Vec<DVec3>, Vec<u32>), TriangulationError> {
    let (mut directions, mut merged): (Vec<DVec3>, _) = (Vec::new(), Vec::new());
    for (viewpoint, &position) in viewpoints.iter().enumerate() {
        let along = direction(position - center).ok_or(TriangulationError::NoDirection {
            viewpoint,
            position,
            center,
        })?;
        // Hundreds of viewpoints have some 10^5 pairs.
        let same = |other: &DVec3| other.distance_squared(along) < CLOSEST * CLOSEST;
        let index = directions.iter().position(same).unwrap_or_else(|| {
            directions.push(along);
            directions.len() - 1
        });
        merged.push(index as u32);
    }
    Ok((directions, merged))
}

/// One set for each direction: the union of those of the viewpoints in it.
///
/// * `sets` - what each viewpoint sees
/// * `merged` - the index of each viewpoint's direction, by [`merge_directions`]
///
/// # Panics
///
/// When there is not one set for each viewpoint, they are of different models, or there is a
/// direction that no viewpoint lies in.
pub fn unite_merged(sets: &[Bitfield], merged: &[u32]) -> Vec<Bitfield> {
    assert!(
        sets.len() == merged.len(),
        "{} sets for {} viewpoints",
        sets.len(),
        merged.len()
    );
    let directions = merged.iter().max().map_or(0, |last| last + 1);
    let mut united: Vec<Option<Bitfield>> = vec![None; directions as usize];
    for (set, &direction) in sets.iter().zip(merged) {
        match &mut united[direction as usize] {
            Some(union) => union.union_with(set),
            none => *none = Some(set.clone()),
        }
    }
    let united = united.into_iter();
    united
        .map(|set| set.expect("each direction has a viewpoint"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Triangulation;
    use crate::triangulation::tests::viewpoints;
    use proptest::prelude::*;

    proptest! {
        /// However often viewpoints are doubled, and at whatever distances, their directions have a
        /// triangulation, each viewpoint lies in its own, and what it sees is in that one's set.
        #[test]
        fn doubled_viewpoints_are_one_direction(
            apart in viewpoints(),
            doubled in prop::collection::vec((any::<prop::sample::Index>(), 0.1..9.0f64), 0..20),
            center in prop::array::uniform3(-9.0..9.0f64),
        ) {
            let center = DVec3::from(center);
            let copies = doubled.iter().map(|(index, factor)| *index.get(&apart) * *factor);
            let all: Vec<DVec3> = copies.chain(apart.iter().copied()).map(|v| v + center).collect();
            let (directions, merged) = merge_directions(&all, center).unwrap();
            prop_assert_eq!(directions.len(), apart.len());
            prop_assert!(Triangulation::new(&directions, DVec3::ZERO).is_ok());
            let count = all.len() as u32;
            let own: Vec<Bitfield> = (0..count).map(|id| Bitfield::from_ids(count, &[id])).collect();
            let united = unite_merged(&own, &merged);
            for (id, viewpoint) in (0..).zip(&all) {
                let mine = merged[id as usize] as usize;
                prop_assert!((*viewpoint - center).normalize().distance(directions[mine]) < CLOSEST);
                prop_assert!(united[mine].contains(id));
            }
            prop_assert_eq!(united.iter().map(Bitfield::len).sum::<u32>(), count);
        }
    }

    #[test]
    fn what_is_no_viewpoint_is_named() {
        let told = merge_directions(&[DVec3::X, DVec3::ZERO], DVec3::ZERO);
        assert!(matches!(
            told,
            Err(TriangulationError::NoDirection { viewpoint: 1, .. })
        ));
        assert_eq!(
            merge_directions(&[], DVec3::ZERO),
            Ok((Vec::new(), Vec::new()))
        );
        assert_eq!(unite_merged(&[], &[]), []);
    }
}
