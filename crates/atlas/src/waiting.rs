//! The rectangles that wait for a place, largest first.

use std::cmp::Reverse;

/// By what rectangles are sorted, largest first. Among those of one width, every order
/// has the highest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    Perimeter,
    Area,
    LongerSide,
    Height,
    Width,
}

/// Rectangles in order of preference, some of them taken.
///
/// Finds the first that fits into a gap, in about logarithmic time, and the first of a
/// given width.
#[derive(Clone, Debug)]
pub(crate) struct Waiting {
    /// Which rectangle stands at each rank.
    ids: Vec<u32>,
    /// A complete binary tree, its root at 1 and the ranks at the leaves: the least width
    /// and the least height of the rectangles below that are still waiting.
    least: Vec<[u32; 2]>,
    /// The ranks, sorted by width; among equal widths by rank, and so from high to low.
    by_width: Vec<u32>,
    /// For each place in `by_width`, this or a later one up to which all are taken.
    next: Vec<u32>,
    /// Where each rank stands in `by_width`.
    place: Vec<u32>,
    sizes: Vec<[u32; 2]>,
    len: usize,
}

/// What a taken rectangle leaves in the tree: no gap is as large.
const TAKEN: [u32; 2] = [u32::MAX; 2];

impl Waiting {
    /// The rectangles `ids` of the `sizes`, in `order`.
    pub(crate) fn new(sizes: &[[u32; 2]], ids: &[u32], order: Order) -> Self {
        let key = |id: u32| {
            let [w, h] = sizes[id as usize].map(u64::from);
            match order {
                Order::Perimeter => (w + h, h),
                Order::Area => (w * h, h),
                Order::LongerSide => (w.max(h), w + h),
                Order::Height => (h, w),
                Order::Width => (w, h),
            }
        };
        let mut ids = ids.to_vec();
        ids.sort_unstable_by_key(|&id| (Reverse(key(id)), id));
        let sizes: Vec<_> = ids.iter().map(|&id| sizes[id as usize]).collect();

        let n = ids.len();
        let leaves = n.next_power_of_two();
        let mut least = vec![TAKEN; leaves];
        least.extend(&sizes);
        least.resize(2 * leaves, TAKEN);
        for node in (1..leaves).rev() {
            least[node] = least_of(least[2 * node], least[2 * node + 1]);
        }

        let mut by_width: Vec<u32> = (0..n as u32).collect();
        by_width.sort_by_key(|&rank| sizes[rank as usize][0]);
        let mut place = vec![0; n];
        for (i, &rank) in by_width.iter().enumerate() {
            place[rank as usize] = i as u32;
        }
        Self {
            ids,
            least,
            by_width,
            next: (0..=n as u32).collect(),
            place,
            sizes,
            len: n,
        }
    }

    /// Number of rectangles that wait.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Width and height of the rectangle at `rank`.
    pub(crate) fn size(&self, rank: usize) -> [u32; 2] {
        self.sizes[rank]
    }

    /// The rank of the first that is at most `width` x `height` large.
    pub(crate) fn first_within(&self, width: u32, height: u32) -> Option<usize> {
        self.first_below(1, width, height)
    }

    /// The rank of the highest that is exactly `width` wide and at most `height` high.
    pub(crate) fn highest_of_width(&mut self, width: u32, height: u32) -> Option<usize> {
        let place = self.by_width.partition_point(|&rank| {
            let [w, h] = self.sizes[rank as usize];
            w < width || w == width && h > height
        });
        let place = self.skip_taken(place);
        let rank = *self.by_width.get(place)? as usize;
        (self.sizes[rank][0] == width).then_some(rank)
    }

    /// Takes the rectangle at `rank` away, and gives its id.
    pub(crate) fn take(&mut self, rank: usize) -> u32 {
        let mut node = self.least.len() / 2 + rank;
        self.least[node] = TAKEN;
        while node > 1 {
            node /= 2;
            self.least[node] = least_of(self.least[2 * node], self.least[2 * node + 1]);
        }
        self.next[self.place[rank] as usize] += 1;
        self.len -= 1;
        self.ids[rank]
    }

    fn first_below(&self, node: usize, width: u32, height: u32) -> Option<usize> {
        let [w, h] = self.least[node];
        if w > width || h > height {
            return None;
        }
        let leaves = self.least.len() / 2;
        if node >= leaves {
            return Some(node - leaves);
        }
        self.first_below(2 * node, width, height)
            .or_else(|| self.first_below(2 * node + 1, width, height))
    }

    /// The first place from `place` on that is not taken, or the end.
    fn skip_taken(&mut self, place: usize) -> usize {
        let mut end = place;
        while self.next[end] as usize != end {
            end = self.next[end] as usize;
        }
        // The next search skips the whole run at once.
        let mut passed = place;
        while passed != end {
            passed = std::mem::replace(&mut self.next[passed], end as u32) as usize;
        }
        end
    }
}

fn least_of(a: [u32; 2], b: [u32; 2]) -> [u32; 2] {
    [a[0].min(b[0]), a[1].min(b[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        /// Both searches find what a walk through the sorted rectangles finds, whatever was
        /// taken before.
        #[test]
        fn searches_agree_with_a_walk(
            sizes in vec([1..9u32, 1..9u32], 0..40),
            gaps in vec((any::<bool>(), 0..10u32, 0..10u32), 60),
            order in prop::sample::select(vec![Order::Perimeter, Order::Area, Order::LongerSide, Order::Height, Order::Width]),
        ) {
            let ids: Vec<u32> = (0..sizes.len() as u32).collect();
            let mut waiting = Waiting::new(&sizes, &ids, order);
            let mut left: Vec<usize> = (0..sizes.len()).collect();
            for (exact, w, h) in gaps {
                let fits = |&&rank: &&usize| {
                    let size = waiting.size(rank);
                    (if exact { size[0] == w } else { size[0] <= w }) && size[1] <= h
                };
                let expected = left.iter().find(fits).copied();
                let found = if exact {
                    waiting.highest_of_width(w, h)
                } else {
                    waiting.first_within(w, h)
                };
                prop_assert_eq!(found, expected);
                if let Some(rank) = found {
                    let id = waiting.take(rank);
                    prop_assert_eq!(sizes[id as usize], waiting.size(rank));
                    left.retain(|&r| r != rank);
                }
                prop_assert_eq!(waiting.len(), left.len());
            }
        }
    }
}
