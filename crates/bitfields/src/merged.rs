//! Viewpoints in the same direction.

use crate::TriangulationError;
use crate::triangulation::{CLOSEST, direction};
use glam::DVec3;

/// The directions of a list of viewpoints, of length 1 and each once, in the order in which they come
/// first.
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
) -> Result<Vec<DVec3>, TriangulationError> {
    let mut directions: Vec<DVec3> = Vec::new();
    for (viewpoint, &position) in viewpoints.iter().enumerate() {
        let along = direction(position - center).ok_or(TriangulationError::NoDirection {
            viewpoint,
            position,
            center,
        })?;
        // Hundreds of viewpoints have some 10^5 pairs.
        let same = |other: &DVec3| other.distance_squared(along) < CLOSEST * CLOSEST;
        if !directions.iter().any(same) {
            directions.push(along);
        }
    }
    Ok(directions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Triangulation;
    use crate::triangulation::tests::viewpoints;
    use proptest::prelude::*;

    proptest! {
        /// However often viewpoints are doubled, and at whatever distances, their directions have a
        /// triangulation, and each viewpoint lies in one of them.
        #[test]
        fn doubled_viewpoints_are_one_direction(
            apart in viewpoints(),
            doubled in prop::collection::vec((any::<prop::sample::Index>(), 0.1..9.0f64), 0..20),
            center in prop::array::uniform3(-9.0..9.0f64),
        ) {
            let center = DVec3::from(center);
            let copies = doubled.iter().map(|(index, factor)| *index.get(&apart) * *factor);
            let all: Vec<DVec3> = copies.chain(apart.iter().copied()).map(|v| v + center).collect();
            let directions = merge_directions(&all, center).unwrap();
            prop_assert_eq!(directions.len(), apart.len());
            prop_assert!(Triangulation::new(&directions, DVec3::ZERO).is_ok());
            for viewpoint in &all {
                let along = (*viewpoint - center).normalize();
                prop_assert!(directions.iter().any(|d| along.distance(*d) < CLOSEST));
            }
        }
    }

    #[test]
    fn what_is_no_viewpoint_is_named() {
        let told = merge_directions(&[DVec3::X, DVec3::ZERO], DVec3::ZERO);
        assert!(matches!(
            told,
            Err(TriangulationError::NoDirection { viewpoint: 1, .. })
        ));
        assert_eq!(merge_directions(&[], DVec3::ZERO), Ok(Vec::new()));
    }
}
