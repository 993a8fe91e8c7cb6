//! Where faces meet.

use crate::faces::{Face, Kind};
use std::ops::Range;

/// A side of a face.
pub(crate) struct Edge {
    /// Corners of the grid, the lesser first.
    pub ends: [[u32; 3]; 2],
    /// Which corner of all faces is at each of the ends.
    pub corners: [u32; 2],
    /// Which side of all faces it is; four are of the same face.
    pub side: u32,
    kind: Kind,
}

impl Edge {
    pub(crate) fn face(&self) -> u32 {
        self.side / 4
    }
}

/// The edges of faces, those together at which faces hang together.
pub(crate) struct Joints {
    edges: Vec<Edge>,
    joints: Vec<Range<u32>>,
    /// Of each side of all faces.
    of_sides: Vec<u32>,
}

impl Joints {
    pub(crate) fn new(faces: &[Face]) -> Self {
        let mut edges = edges(faces);
        let mut joints = Vec::with_capacity(edges.len() / 2);
        let mut start = 0;
        let mut add = |joint: &[Edge]| {
            joints.push(start..start + joint.len() as u32);
            start += joint.len() as u32;
        };
        for same in edges.chunk_by_mut(|a, b| a.ends == b.ends) {
            // Where there are fronts and backs only, a surface ends: they are its two sides.
            if same.iter().all(|edge| edge.kind != Kind::Wall) {
                same.chunk_by(|a, b| a.kind == b.kind).for_each(&mut add);
                continue;
            }
            // Where two that are solid touch in an edge, two surfaces pass each other.
            let from = |edge: &Edge| faces[edge.face() as usize].from;
            same.sort_by_key(from);
            match same {
                [a, b, c, d] if from(a) == from(b) && from(c) == from(d) => {
                    add(&same[..2]);
                    add(&same[2..]);
                }
                _ => add(same),
            }
        }
        let mut of_sides = vec![0; edges.len()];
        for (i, joint) in (0..).zip(&joints) {
            for edge in &edges[as_indices(joint)] {
                of_sides[edge.side as usize] = i;
            }
        }
        Self {
            edges,
            joints,
            of_sides,
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &[Edge]> {
        let joints = self.joints.iter();
        joints.map(|joint| &self.edges[as_indices(joint)])
    }

    /// What meets at the sides of a face.
    pub(crate) fn of_face(&self, face: u32) -> [&[Edge]; 4] {
        [0, 1, 2, 3].map(|side| {
            let joint = self.of_sides[(4 * face + side) as usize];
            &self.edges[as_indices(&self.joints[joint as usize])]
        })
    }
}

fn as_indices(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

/// All sides of all faces, equal ones beside each other.
fn edges(faces: &[Face]) -> Vec<Edge> {
    let of_face = |(face, one): (u32, &Face)| {
        [0, 1, 2, 3].map(|side| {
            let next = (side + 1) % 4;
            let ends = [side, next].map(|i| (one.corners[i], 4 * face + i as u32));
            let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            Edge {
                ends: ends.map(|end| end.0),
                corners: ends.map(|end| end.1),
                side: 4 * face + side as u32,
                kind: one.kind,
            }
        })
    };
    let mut edges: Vec<Edge> = (0..).zip(faces).flat_map(of_face).collect();
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.kind, edge.side));
    edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::faces;
    use crate::reach::Light;
    use crate::testing::Blob;

    /// Of two slopes that touch in edges, front and back, each is a sheet of its own.
    #[test]
    fn surfaces_that_pass_each_other_are_apart() {
        let blob = Blob::of(5, |x, _, l| {
            (1..5).contains(&x) && (usize::from(x) == l || usize::from(x) == l + 1)
        });
        let layers = blob.layers();
        let faces = faces(&layers, &Light::new(&layers));
        let joints = Joints::new(&faces);
        assert!(joints.iter().all(|joint| joint.len() <= 2));
        // Where they touch there are four sides, in two joints.
        let mut all: Vec<_> = joints.iter().map(|joint| joint[0].ends).collect();
        let count = all.len();
        all.dedup();
        assert!(all.len() < count);
    }
}
