//! From a direction to what is drawn.

use crate::{FaceRanges, Triangulation};
use farfield_grid::Grid;
use glam::{DVec2, DVec3, Vec2Swizzles};
use std::ops::Range;

/// Cells of the map for each face: with fewer, walks get longer; with more, the map grows.
const CELLS_PER_FACE: f64 = 4.0;

/// Finds the face that contains a direction, and the ranges to draw for it.
///
/// An octahedral map of the sphere has for each of its cells the face at the centre of the cell;
/// from there it is hardly a step to the face that contains a direction. This step is exact.
#[derive(Clone, Debug, PartialEq)]
pub struct Lookup {
    faces: Triangulation,
    lists: FaceRanges,
    /// Faces, as many columns as rows.
    map: Grid<u32>,
}

impl Lookup {
    /// A lookup in the ranges of a triangulation's faces.
    ///
    /// # Panics
    ///
    /// When there is not one list for each face.
    pub fn new(faces: Triangulation, lists: FaceRanges) -> Self {
        let count = faces.faces().len();
        assert!(
            lists.count() as usize == count,
            "{} lists for {count} faces",
            lists.count()
        );
        let side = (CELLS_PER_FACE * count as f64).sqrt().ceil() as usize;
        let mut cells = Vec::with_capacity(side * side);
        for y in 0..side {
            for x in 0..side {
                let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / side as f64;
                let near = cells.last().copied().unwrap_or(0);
                cells.push(faces.walk(near, direction_from_map(center)));
            }
        }
        let map = Grid::from_cells(side, side, cells);
        Self { faces, lists, map }
    }

    /// The face that contains a direction from the model's centre to the viewer, of any length.
    ///
    /// On an edge it is one of the faces there; the same direction always has the same face.
    ///
    /// # Panics
    ///
    /// When the direction is zero or not finite.
    pub fn face(&self, direction: DVec3) -> u32 {
        let side = self.map.width();
        let cell = map_from_direction(direction) * side as f64;
        // Outside of the map there is nothing but what is no direction.
        let [x, y] = cell.to_array().map(|c| (c as usize).min(side - 1));
        self.faces.walk(self.map[(x, y)], direction)
    }

    /// What to draw for a direction from the model's centre to the viewer, of any length: ascending
    /// ranges. Allocates nothing.
    ///
    /// # Panics
    ///
    /// When the direction is zero or not finite.
    pub fn ranges(&self, direction: DVec3) -> &[Range<u32>] {
        self.lists.of(self.face(direction))
    }

    /// Where the faces are.
    pub fn faces(&self) -> &Triangulation {
        &self.faces
    }

    /// What they show.
    pub fn lists(&self) -> &FaceRanges {
        &self.lists
    }
}

/// Where the octahedral map, [0, 1] on both axes, has a direction.
///
/// Z. H. Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, 2014.
fn map_from_direction(direction: DVec3) -> DVec2 {
    let d = direction / direction.abs().max_element();
    let d = d / d.abs().element_sum();
    let folded = match d.z < 0.0 {
        // The lower half is folded over the edges of the upper one.
        true => {
            (1.0 - d.truncate().abs().yx()) * DVec2::new(1f64.copysign(d.x), 1f64.copysign(d.y))
        }
        false => d.truncate(),
    };
    (folded + 1.0) / 2.0
}

/// The direction at a place of the octahedral map, not of length 1.
fn direction_from_map(place: DVec2) -> DVec3 {
    let folded = place * 2.0 - 1.0;
    let z = 1.0 - folded.abs().element_sum();
    let lateral = match z < 0.0 {
        true => {
            (1.0 - folded.abs().yx()) * DVec2::new(1f64.copysign(folded.x), 1f64.copysign(folded.y))
        }
        false => folded,
    };
    lateral.extend(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::tests::samples;
    use crate::triangulation::tests::probes;
    use crate::{United, face_sets};
    use proptest::prelude::*;

    proptest! {
        /// The lookup gives the ranges of a face that contains the direction, by a search over all
        /// faces; of the only such face, where the direction is on no edge.
        #[test]
        fn lookup_equals_search((faces, sets) in samples()) {
            let lists = FaceRanges::from_sets(&face_sets(&faces, &sets, United::Six));
            let lookup = Lookup::new(faces.clone(), lists.clone());
            for direction in probes(&faces, 200) {
                let scaled = direction / direction.abs().max_element();
                let containing = |&face: &u32| faces.contains(face, scaled);
                let all: Vec<u32> = (0..lists.count()).filter(containing).collect();
                prop_assert!(all.contains(&lookup.face(direction)));
                prop_assert_eq!(lookup.ranges(direction), lists.of(lookup.face(direction)));
            }
        }

        /// A place of the map taken to a direction and back is the same place.
        #[test]
        fn direction_from_map_inverts_map_from_direction(x in 0.0..1.0f64, y in 0.0..1.0f64) {
            let place = DVec2::new(x, y);
            let back = map_from_direction(direction_from_map(place));
            // Numbers of at most 2 are rounded a few times.
            prop_assert!(back.abs_diff_eq(place, 1e-15), "{back} is not {place}");
        }
    }

    /// The centre itself is in no direction, nor is anything with a coordinate that is infinite or
    /// no number, whichever that is.
    #[test]
    fn what_is_no_direction_panics() {
        let faces = Triangulation::new(&crate::even_directions(6), DVec3::ZERO).unwrap();
        let lookup = Lookup::new(faces, FaceRanges::from_lists(vec![Vec::new(); 8]));
        let panics = |direction: DVec3| {
            let found = std::panic::catch_unwind(|| lookup.ranges(direction));
            let message = found.expect_err("it has no face");
            let message = message.downcast::<String>().expect("it is formatted");
            assert!(message.contains("is no direction"), "{message}");
        };
        panics(DVec3::ZERO);
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for axis in 0..3 {
                let mut direction = DVec3::ONE;
                direction[axis] = wrong;
                panics(direction);
            }
        }
    }
}
