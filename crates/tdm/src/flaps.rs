//! Faces that only thicken an edge.

use crate::faces::{Face, Kind};
use crate::joints::{Edge, Joints};

/// A front or a back that is left out.
pub(crate) struct Flap {
    pub face: Face,
    /// The face that has its voxel instead, among those that are left.
    pub beside: u32,
}

/// Leaves out fronts and backs that end on one side and hang on a seam, where three faces or more meet,
/// with another: where two surfaces meet in an edge that recedes, the outermost voxels stick out of it a
/// texel wide. The edge alone touches them. Otherwise each would be a border, which simplification has
/// to keep.
pub(crate) fn without_flaps(faces: Vec<Face>) -> (Vec<Face>, Vec<Flap>) {
    let joints = Joints::new(&faces);
    let sticks_out = |face: u32| {
        let sides = joints.of_face(face);
        let borders = sides.iter().filter(|joint| joint.len() == 1).count();
        let seams = sides.iter().filter(|joint| joint.len() > 2).count();
        faces[face as usize].kind != Kind::Wall && borders > 0 && borders + seams > 1
    };
    let mut fates = vec![Fate::Open; faces.len()];
    let at_seams = joints.iter().filter(|joint| joint.len() > 2);
    let mut waiting: Vec<u32> = at_seams.flatten().map(Edge::face).collect();
    waiting.sort_unstable();
    waiting.dedup();
    waiting.retain(|face| sticks_out(*face));
    for face in waiting {
        let sides = joints.of_face(face);
        let mut beside = sides.iter().filter(|joint| joint.len() == 2);
        let is_alone = beside.all(|joint| joint.iter().all(|edge| sticks_out(edge.face())));
        let others = |joint: &&[Edge]| -> Vec<u32> {
            let others = joint.iter().map(Edge::face);
            others
                .filter(|other| *other != face && !fates[*other as usize].is_flap())
                .collect()
        };
        let seam = sides.iter().map(others).find(|others| others.len() > 1);
        if let (Fate::Open, true, Some(seam)) = (fates[face as usize], is_alone, seam) {
            fates[face as usize] = Fate::Flap { beside: seam[0] };
            fates[seam[0] as usize] = Fate::Kept;
        }
    }
    divided(faces, &fates)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Fate {
    Open,
    /// It has the voxel of a flap.
    Kept,
    Flap {
        beside: u32,
    },
}

impl Fate {
    fn is_flap(self) -> bool {
        matches!(self, Self::Flap { .. })
    }
}

/// The faces that are kept, and flaps in the order of what they are beside.
fn divided(faces: Vec<Face>, fates: &[Fate]) -> (Vec<Face>, Vec<Flap>) {
    let mut numbers = Vec::with_capacity(faces.len());
    let mut count = 0;
    for fate in fates {
        numbers.push(count);
        count += u32::from(!fate.is_flap());
    }
    let (mut kept, mut flaps) = (Vec::with_capacity(count as usize), Vec::new());
    for (face, fate) in faces.into_iter().zip(fates) {
        match fate {
            Fate::Flap { beside } => flaps.push(Flap {
                face,
                beside: numbers[*beside as usize],
            }),
            Fate::Open | Fate::Kept => kept.push(face),
        }
    }
    flaps.sort_by_key(|flap| flap.beside);
    (kept, flaps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::faces;
    use crate::reach::Light;
    use crate::testing::{Blob, blobs};
    use proptest::prelude::*;

    fn of(blob: &Blob) -> (usize, Vec<Face>, Vec<Flap>) {
        let layers = blob.layers();
        let faces = faces(&layers, &Light::new(&layers));
        let count = faces.len();
        let (kept, flaps) = without_flaps(faces);
        (count, kept, flaps)
    }

    proptest! {
        /// No face is lost, and each flap shares a side with the face that has its voxel.
        #[test]
        fn flaps_hang_on_what_has_their_voxels(blob in blobs()) {
            let (count, kept, flaps) = of(&blob);
            prop_assert_eq!(kept.len() + flaps.len(), count);
            prop_assert!(flaps.is_sorted_by_key(|flap| flap.beside));
            for Flap { face, beside } in flaps {
                let beside = &kept[beside as usize];
                let shared = face.corners.iter().filter(|at| beside.corners.contains(at)).count();
                prop_assert!(shared >= 2);
                prop_assert!(face.kind != Kind::Wall);
            }
        }
    }

    /// A block from which a fin sticks out: a fin a texel wide only thickens the block's edge, a wider
    /// one is a surface of its own.
    #[test]
    fn wide_fins_are_no_flaps() {
        let block = |fin: u16| {
            Blob::of(3, move |x, y, l| {
                (1..5).contains(&y) && (x < 2 || (x < 2 + fin && l == 1))
            })
        };
        let [(_, _, narrow), (_, _, wide)] = [1, 2].map(|fin| of(&block(fin)));
        assert_eq!((narrow.len(), wide.len()), (4, 0));
    }
}
