//! Primitives that an id buffer is too coarse to show.

use crate::Bitfield;

/// A set, and those primitives that share a vertex with one of the set and face the viewpoint.
///
/// Of primitives that are smaller than pixels, an id buffer shows some; those between them are most
/// often their neighbours. Called again, it adds the neighbours of these, and so on; in the end all
/// that faces the viewpoint and is connected with what is seen, hidden or not.
///
/// Section 3.1.1 of Meruvia Pastor and Strothotte.
///
/// * `triangles` - three vertices of each primitive. Vertices that lie in the same place must be
///   the same one: many files double them where normals or texture coordinates differ
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
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
