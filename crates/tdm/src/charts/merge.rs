//! Merging pieces while that saves texels.

use super::piece::{Piece, Surface};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// Pieces, and which of them each triangle is in.
pub(super) struct Pieces<'a> {
    surface: &'a Surface,
    /// By one of their triangles; `None` elsewhere.
    pieces: Vec<Option<Piece>>,
    /// Of each triangle one that is in the same piece; the one that a piece is kept at has itself.
    same: Vec<u32>,
    /// How many mergers had been made when a piece was last changed.
    changed: Vec<u32>,
    merged: u32,
}

/// Two pieces that may be merged, ordered by what that saves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    saved: u64,
    pieces: Reverse<[u32; 2]>,
    /// Whether it was known to be so after that many mergers.
    known: u32,
}

impl<'a> Pieces<'a> {
    /// Each triangle on its own.
    pub(super) fn new(surface: &'a Surface, count: u32) -> Self {
        Self {
            surface,
            pieces: (0..count)
                .map(|t| Some(Piece::single(surface, t)))
                .collect(),
            same: (0..count).collect(),
            changed: vec![0; count as usize],
            merged: 0,
        }
    }

    /// Merges neighbours as long as a merger takes no more texels than the two.
    pub(super) fn merge(&mut self, neighbours: &[[u32; 2]]) {
        let mut before = 0;
        for pass in 0..PASSES {
            let start = self.merged;
            self.pass(neighbours, (pass > 0).then_some(before));
            if self.merged == start {
                break;
            }
            before = start;
        }
    }

    fn pass(&mut self, neighbours: &[[u32; 2]], changed_after: Option<u32>) {
        let mut pairs: Vec<[u32; 2]> = neighbours.iter().map(|pair| self.pair(*pair)).collect();
        pairs.retain(|[a, b]| a != b);
        pairs.retain(|pair| {
            changed_after.is_none_or(|after| pair.iter().any(|p| self.changed[*p as usize] > after))
        });
        pairs.sort_unstable();
        pairs.dedup();
        let mut refused = BTreeMap::new();
        let pairs = pairs.into_iter();
        let mut queue: BinaryHeap<Pair> = pairs.filter_map(|pair| self.look_at(pair)).collect();
        while let Some(pair) = queue.pop() {
            let pieces = self.pair(pair.pieces.0);
            if pieces[0] == pieces[1] {
                continue;
            }
            let changed = pieces.map(|p| self.changed[p as usize]);
            if refused.get(&pieces) == Some(&changed) {
                continue;
            }
            if changed.iter().any(|changed| *changed > pair.known) {
                let Some(now) = self.look_at(pieces) else {
                    refused.insert(pieces, changed);
                    continue;
                };
                let next = queue.peek().map_or(0, |next| next.saved);
                if now.saved < next && now.saved < pair.saved / 2 {
                    queue.push(now);
                    continue;
                }
            }
            if !self.try_merge(pieces) {
                refused.insert(pieces, changed);
            }
        }
    }

    /// The pieces that two triangles are in, the one with more triangles first.
    fn pair(&mut self, triangles: [u32; 2]) -> [u32; 2] {
        let [a, b] = triangles.map(|t| self.piece(t));
        let count = |p: u32| self.pieces[p as usize].as_ref().map(|p| p.triangles.len());
        match (count(a), Reverse(a)) >= (count(b), Reverse(b)) {
            true => [a, b],
            false => [b, a],
        }
    }

    fn piece(&mut self, mut triangle: u32) -> u32 {
        while self.same[triangle as usize] != triangle {
            let next = self.same[triangle as usize];
            self.same[triangle as usize] = self.same[next as usize];
            triangle = next;
        }
        triangle
    }

    fn get(&self, piece: u32) -> &Piece {
        self.pieces[piece as usize]
            .as_ref()
            .expect("a piece is kept here")
    }

    /// What it saves to merge two pieces, if anything; whether triangles overlap remains to be seen.
    fn look_at(&self, pieces: [u32; 2]) -> Option<Pair> {
        let [big, small] = pieces.map(|p| self.get(p));
        let layouts = big.layouts_with(small, self.surface);
        let merged = layouts.first()?.1.rectangle.area();
        Some(Pair {
            saved: (big.area() + small.area()).checked_sub(merged)?,
            pieces: Reverse(pieces),
            known: self.merged,
        })
    }

    fn try_merge(&mut self, [big, small]: [u32; 2]) -> bool {
        let surface = self.surface;
        let taken = self.pieces[small as usize]
            .take()
            .expect("a piece is kept here");
        let into = self.pieces[big as usize]
            .as_mut()
            .expect("a piece is kept here");
        let most = into.area() + taken.area();
        let layouts = into.layouts_with(&taken, surface).into_iter();
        let mut fitting = layouts.filter(|(_, layout)| layout.rectangle.area() <= most);
        if !fitting.any(|layout| into.take_in(&taken, layout, surface)) {
            self.pieces[small as usize] = Some(taken);
            return false;
        }
        self.merged += 1;
        self.changed[big as usize] = self.merged;
        self.same[small as usize] = big;
        true
    }

    /// Those that are left, by their first triangles.
    pub(super) fn into_pieces(self) -> Vec<Piece> {
        let mut pieces: Vec<Piece> = self.pieces.into_iter().flatten().collect();
        for piece in &mut pieces {
            piece.triangles.sort_unstable();
        }
        pieces.sort_by_key(|piece| piece.triangles[0]);
        pieces
    }
}

/// After the first few, hardly a piece changes.
const PASSES: usize = 8;
