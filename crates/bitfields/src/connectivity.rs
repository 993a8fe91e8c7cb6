//! Primitives that an id buffer is too coarse to show.

use crate::Bitfield;
use glam::DVec3;
use std::collections::BTreeMap;

/// A set, and those primitives that share a vertex with one of the set and face the viewpoint.
///
/// Of primitives that are smaller than pixels, an id buffer shows some; those between them are most
/// often their neighbours. Called again, it adds the neighbours of these, and so on; in the end all
/// that faces the viewpoint and is connected with what is seen, hidden or not.
///
/// Section 3.1.1 of Meruvia Pastor and Strothotte.
///
/// * `triangles` - three vertices of each primitive. Vertices that lie in the same place must be
///   the same one, as [`welded`] makes them
/// * `facing` - whether a primitive faces the viewpoint; for those seen from both sides, true
///
/// # Panics
///
/// When the set is not one of as many primitives as there are triangles.
pub fn with_neighbors(
    set: &Bitfield,
    triangles: &[[u32; 3]],
    facing: impl Fn(u32) -> bool,
) -> Bitfield {
    assert!(
        set.primitives() as usize == triangles.len(),
        "a set of {} primitives for {} triangles",
        set.primitives(),
        triangles.len()
    );
    let vertices = triangles.iter().flatten().max().map_or(0, |last| last + 1);
    let mut touched = Bitfield::empty(vertices);
    for id in set.iter() {
        triangles[id as usize]
            .iter()
            .for_each(|&vertex| touched.insert(vertex));
    }
    let mut grown = set.clone();
    for (id, triangle) in (0..).zip(triangles) {
        let near = triangle.iter().any(|&vertex| touched.contains(vertex));
        if near && !set.contains(id) && facing(id) {
            grown.insert(id);
        }
    }
    grown
}

/// Triangles with the same vertex wherever theirs are in the same place: many files double vertices
/// where normals or texture coordinates differ.
///
/// Vertices are numbered anew, in the order in which triangles first have them. The same place is that of
/// the same coordinates, of which -0.0 and 0.0 are one.
///
/// * `positions` - of vertices, in metres
/// * `triangles` - three vertices each
///
/// # Panics
///
/// When a triangle names a vertex that there is not.
pub fn welded(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut vertices: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut weld = |vertex: u32| {
        // -0.0 + 0.0 is 0.0.
        let place = positions[vertex as usize] + 0.0;
        let next = vertices.len() as u32;
        let place = place.to_array().map(f64::to_bits);
        *vertices.entry(place).or_insert(next)
    };
    (triangles.iter())
        .map(|triangle| triangle.map(&mut weld))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        /// Vertices are the same just where their places are, and numbered without gaps.
        #[test]
        fn welded_vertices_are_places(
            positions in vec(prop::array::uniform3(prop::sample::select(vec![-0.0, 0.0, 1.0, 2.0])), 1..40),
            triangles in vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..30),
        ) {
            let positions: Vec<DVec3> = positions.into_iter().map(DVec3::from).collect();
            let triangles: Vec<[u32; 3]> = triangles
                .iter()
                .map(|t| t.map(|index| index.index(positions.len()) as u32))
                .collect();
            let welded = welded(&positions, &triangles);
            prop_assert_eq!(welded.len(), triangles.len());
            let old = triangles.as_flattened();
            let new = welded.as_flattened();
            let mut next = 0;
            for (i, &vertex) in new.iter().enumerate() {
                prop_assert!(vertex <= next);
                next = next.max(vertex + 1);
                for j in 0..i {
                    let same = positions[old[i] as usize] == positions[old[j] as usize];
                    prop_assert_eq!(same, vertex == new[j]);
                }
            }
        }

        /// What is added shares a vertex with the set and faces the viewpoint; what is not either
        /// faces away or shares none.
        #[test]
        fn neighbors_that_face_the_viewpoint_are_added(
            primitives in vec((prop::array::uniform3(0..40u32), any::<[bool; 2]>()), 0..30),
        ) {
            let triangles: Vec<[u32; 3]> = primitives.iter().map(|p| p.0).collect();
            let count = triangles.len() as u32;
            let ids: Vec<u32> = (0..count).filter(|i| primitives[*i as usize].1[0]).collect();
            let set = Bitfield::from_ids(count, &ids);
            let facing = |id: u32| primitives[id as usize].1[1];
            let grown = with_neighbors(&set, &triangles, facing);
            for id in 0..count {
                let mine = triangles[id as usize];
                let shares = |other: &u32| triangles[*other as usize].iter().any(|v| mine.contains(v));
                let expected = ids.contains(&id) || (facing(id) && ids.iter().any(shares));
                prop_assert_eq!(grown.contains(id), expected);
            }
        }
    }
}
