//! Box growing, the paper's greedy algorithm.

use crate::area::{Area, shrink};
use farfield_grid::{BitMask, Rect};
use std::ops::Range;

/// How boxes grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Side of the square blocks that a box consists of, in texels, at least 1. Smaller blocks
    /// waste fewer texels and need more quads. Default 4.
    pub block: u32,
    /// The share of a box's blocks that hold an opaque texel, in [0, 1]; a box that would fall
    /// below it grows no further. Default 0.8.
    pub min_fill: f64,
}

impl Default for Growth {
    fn default() -> Self {
        Self {
            block: 4,
            min_fill: 0.8,
        }
    }
}

/// Rectangles around all opaque texels, grown greedily block by block.
///
/// The mask is divided into blocks; one that holds an opaque texel is filled. The first filled
/// block, row by row, is the seed of a box. In every step the box grows by one line of blocks on a
/// side or by one on each of two adjoining sides, where the added blocks have the largest share of
/// filled ones (of equal ones the smallest addition, then left, right, up, down before the
/// diagonals). It stops when no addition has a filled block, or the best one would push
/// the fill of the box below `min_fill`. Its blocks then count as empty, and the
/// next seed is taken, until no filled block is left. At last every box is shrunk to the
/// opaque texels in it.
///
/// Jeschke, Accelerating the Rendering Process Using Impostors, 2005, section 3.5. There a
/// box may grow over the emptied blocks of an earlier one; here it may not, so
/// that rectangles never overlap.
///
/// * `mask` - the opaque texels, of any size
///
/// Returns disjoint tight rectangles in the order of their seeds, none for an empty mask.
/// Takes time proportional to the texels of the mask.
///
/// # Panics
///
/// When `growth.block` is 0 or `growth.min_fill` is not in [0, 1].
pub fn grow_boxes(mask: &BitMask, growth: &Growth) -> Vec<Rect> {
    let Growth { block, min_fill } = *growth;
    assert!(block > 0, "blocks have no texels");
    assert!(
        (0.0..=1.0).contains(&min_fill),
        "a fill ratio of {min_fill} is not between 0 and 1"
    );
    let filled = blocks_from_texels(mask, block as usize);
    let (columns, rows) = (filled.width(), filled.height());
    let mut free = BitMask::empty(columns, rows);
    for y in 0..rows {
        free.set_row(y, &vec![u64::MAX; free.words_per_row()]);
    }
    let mut board = Board { filled, free };
    let (width, height) = (mask.width() as u32, mask.height() as u32);
    let mut lines = Vec::new();
    let mut rects = Vec::new();
    for y in 0..rows {
        let mut word = 0;
        while word < board.filled.words_per_row() {
            let bits = board.filled.row(y)[word];
            if bits == 0 {
                word += 1;
                continue;
            }
            let grown = board.grow(word as u32 * 64 + bits.trailing_zeros(), y as u32, min_fill);
            board.filled.remove_rect(grown.rect());
            board.free.remove_rect(grown.rect());
            let texels = Area {
                left: grown.left * block,
                top: grown.top * block,
                right: grown.right.saturating_mul(block).min(width),
                bottom: grown.bottom.saturating_mul(block).min(height),
            };
            rects.extend(shrink(mask, texels, &mut lines).map(Area::rect));
        }
    }
    rects
}

/// One bit per block of `block` x `block` texels, set where any texel is opaque.
fn blocks_from_texels(mask: &BitMask, block: usize) -> BitMask {
    let mut blocks = BitMask::empty(mask.width().div_ceil(block), mask.height().div_ceil(block));
    let mut any = vec![0u64; mask.words_per_row()];
    for by in 0..blocks.height() {
        any.fill(0);
        for y in by * block..mask.height().min(by * block + block) {
            for (any, word) in any.iter_mut().zip(mask.row(y)) {
                *any |= word;
            }
        }
        for (i, &word) in any.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                let bx = (i * 64 + rest.trailing_zeros() as usize) / block;
                blocks.insert(bx, by);
                // The other texels of the same block say nothing new.
                let next = (bx + 1) * block - i * 64;
                rest &= u64::MAX.checked_shl(next.min(64) as u32).unwrap_or(0);
            }
        }
    }
    blocks
}

/// Blocks beside a box.
#[derive(Clone, Copy)]
struct Strip {
    filled: u32,
    /// Blocks that lie outside the mask or belong to an earlier box.
    closed: u32,
}

/// The sides of a box.
#[derive(Clone, Copy)]
enum Side {
    Left,
    Right,
    Up,
    Down,
}
use Side::{Down, Left, Right, Up};

/// Steps of growth, in the order of preference.
const STEPS: [(Side, Option<Side>); 8] = [
    (Left, None),
    (Right, None),
    (Up, None),
    (Down, None),
    (Left, Some(Up)),
    (Right, Some(Up)),
    (Left, Some(Down)),
    (Right, Some(Down)),
];

/// The blocks still to be covered, and all that belong to no finished box.
struct Board {
    filled: BitMask,
    free: BitMask,
}

/// A box and what lies beside it; corners excluded.
struct Growing {
    area: Area,
    filled: u64,
    strips: [Strip; 4],
}

impl Board {
    /// The box that grows from block (x, y).
    fn grow(&self, x: u32, y: u32, min_fill: f64) -> Area {
        let area = Area {
            left: x,
            top: y,
            right: x + 1,
            bottom: y + 1,
        };
        let mut growing = Growing {
            area,
            filled: 1,
            strips: [Left, Right, Up, Down].map(|side| self.strip(area, side)),
        };
        loop {
            // The step whose blocks have the largest share of filled ones.
            let mut best: Option<(f64, u32, u32, usize)> = None;
            for (i, &(side, second)) in STEPS.iter().enumerate() {
                let (strip, size) = self.addition(&growing, side, second);
                if strip.closed > 0 || strip.filled == 0 {
                    continue;
                }
                let share = f64::from(strip.filled) / f64::from(size);
                if best.is_none_or(|(s, n, ..)| share > s || share == s && size < n) {
                    best = Some((share, size, strip.filled, i));
                }
            }
            let Some((_, size, filled, i)) = best else {
                return growing.area;
            };
            let filled = (growing.filled + u64::from(filled)) as f64;
            if filled < min_fill * (growing.area.rect().area() + u64::from(size)) as f64 {
                return growing.area;
            }
            self.push(&mut growing, STEPS[i].0);
            if let Some(second) = STEPS[i].1 {
                self.push(&mut growing, second);
            }
        }
    }

    /// What a step adds, and how many blocks these are.
    fn addition(&self, growing: &Growing, side: Side, second: Option<Side>) -> (Strip, u32) {
        let area = growing.area;
        let strip = growing.strips[side as usize];
        let length = |side| match side {
            Left | Right => area.height(),
            Up | Down => area.width(),
        };
        let Some(second) = second else {
            return (strip, length(side));
        };
        let x = if matches!(side, Left) {
            i64::from(area.left) - 1
        } else {
            i64::from(area.right)
        };
        let y = if matches!(second, Up) {
            i64::from(area.top) - 1
        } else {
            i64::from(area.bottom)
        };
        let other = growing.strips[second as usize];
        let corner = self.block(x, y);
        let sum = Strip {
            filled: strip.filled + other.filled + corner.filled,
            closed: strip.closed + other.closed + corner.closed,
        };
        (sum, length(side) + length(second) + 1)
    }

    /// Moves `side` by one block.
    fn push(&self, growing: &mut Growing, side: Side) {
        growing.filled += u64::from(growing.strips[side as usize].filled);
        match side {
            Left => growing.area.left -= 1,
            Right => growing.area.right += 1,
            Up => growing.area.top -= 1,
            Down => growing.area.bottom += 1,
        }
        // The strips at right angles get one block longer, this one moves.
        let a = growing.area;
        let (left, right) = (i64::from(a.left), i64::from(a.right) - 1);
        let (top, bottom) = (i64::from(a.top), i64::from(a.bottom) - 1);
        let ends = match side {
            Left => [(Up, left, top - 1), (Down, left, bottom + 1)],
            Right => [(Up, right, top - 1), (Down, right, bottom + 1)],
            Up => [(Left, left - 1, top), (Right, right + 1, top)],
            Down => [(Left, left - 1, bottom), (Right, right + 1, bottom)],
        };
        for (strip, x, y) in ends {
            let block = self.block(x, y);
            growing.strips[strip as usize].filled += block.filled;
            growing.strips[strip as usize].closed += block.closed;
        }
        growing.strips[side as usize] = self.strip(a, side);
    }

    /// The blocks along a side of `area`.
    fn strip(&self, area: Area, side: Side) -> Strip {
        let (left, right) = (i64::from(area.left), i64::from(area.right));
        let (top, bottom) = (i64::from(area.top), i64::from(area.bottom));
        let (columns, rows) = match side {
            Left => (left - 1..left, top..bottom),
            Right => (right..right + 1, top..bottom),
            Up => (left..right, top - 1..top),
            Down => (left..right, bottom..bottom + 1),
        };
        self.blocks(columns, rows)
    }

    fn block(&self, x: i64, y: i64) -> Strip {
        self.blocks(x..x + 1, y..y + 1)
    }

    fn blocks(&self, columns: Range<i64>, rows: Range<i64>) -> Strip {
        let all = ((columns.end - columns.start) * (rows.end - rows.start)) as u32;
        let inside = columns.start >= 0
            && columns.end <= self.filled.width() as i64
            && rows.start >= 0
            && rows.end <= self.filled.height() as i64;
        if !inside {
            return Strip {
                filled: 0,
                closed: all,
            };
        }
        let rect = Rect {
            x: columns.start as u32,
            y: rows.start as u32,
            width: (columns.end - columns.start) as u32,
            height: (rows.end - rows.start) as u32,
        };
        Strip {
            filled: self.filled.count_in(rect) as u32,
            closed: all - self.free.count_in(rect) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{check_rects, mask_where, masks};
    use proptest::prelude::*;

    fn growths() -> impl Strategy<Value = Growth> {
        let block = prop_oneof![1..10u32, Just(64), Just(700), Just(u32::MAX)];
        let min_fill = prop_oneof![Just(0.0), Just(0.8), Just(1.0), 0.0..=1.0f64];
        (block, min_fill).prop_map(|(block, min_fill)| Growth { block, min_fill })
    }

    /// The same algorithm on arrays of bools, every count taken anew.
    fn grow_boxes_slowly(mask: &BitMask, growth: &Growth) -> Vec<Rect> {
        let block = growth.block as usize;
        let columns = mask.width().div_ceil(block) as i64;
        let rows = mask.height().div_ceil(block) as i64;
        let mut filled = vec![false; (columns * rows) as usize];
        for (x, y) in mask.iter() {
            filled[y / block * columns as usize + x / block] = true;
        }
        let mut free = vec![true; filled.len()];
        let mut rects = Vec::new();
        while let Some(seed) = filled.iter().position(|&f| f) {
            let (x, y) = (seed as i64 % columns, seed as i64 / columns);
            let count = |[l, t, r, b]: [i64; 4], of: &[bool]| {
                (t..b)
                    .flat_map(|y| (l..r).map(move |x| (y * columns + x) as usize))
                    .filter(|&i| of[i])
                    .count() as i64
            };
            let size = |[l, t, r, b]: [i64; 4]| (r - l) * (b - t);
            let mut grown = [x, y, x + 1, y + 1];
            loop {
                let [l, t, r, b] = grown;
                // The first of several best ones: largest share, then smallest addition.
                let best = [
                    [l - 1, t, r, b],
                    [l, t, r + 1, b],
                    [l, t - 1, r, b],
                    [l, t, r, b + 1],
                    [l - 1, t - 1, r, b],
                    [l, t - 1, r + 1, b],
                    [l - 1, t, r, b + 1],
                    [l, t, r + 1, b + 1],
                ]
                .into_iter()
                .filter(|&[l, t, r, b]| l >= 0 && t >= 0 && r <= columns && b <= rows)
                .filter(|&next| count(next, &free) == size(next))
                .map(|next| {
                    (
                        count(next, &filled) - count(grown, &filled),
                        size(next) - size(grown),
                        next,
                    )
                })
                .filter(|&(added, ..)| added > 0)
                .min_by(|a, b| (b.0 * a.1).cmp(&(a.0 * b.1)).then(a.1.cmp(&b.1)));
                let Some((.., next)) = best else { break };
                if (count(next, &filled) as f64) < growth.min_fill * size(next) as f64 {
                    break;
                }
                grown = next;
            }
            let [l, t, r, b] = grown;
            let texels: Vec<_> = mask
                .iter()
                .filter(|(x, y)| {
                    let (x, y) = ((x / block) as i64, (y / block) as i64);
                    (l..r).contains(&x) && (t..b).contains(&y)
                })
                .collect();
            let mut own = BitMask::empty(mask.width(), mask.height());
            texels.iter().for_each(|&(x, y)| own.insert(x, y));
            rects.extend(own.bounds());
            for i in (t..b).flat_map(|y| (l..r).map(move |x| (y * columns + x) as usize)) {
                filled[i] = false;
                free[i] = false;
            }
        }
        rects
    }

    proptest! {
        /// Every opaque texel is in exactly one rectangle; these are disjoint and tight.
        #[test]
        fn every_opaque_texel_is_in_exactly_one_rectangle(mask in masks(), growth in growths()) {
            check_rects(&mask, &grow_boxes(&mask, &growth)).map_err(TestCaseError::fail)?;
        }

        /// Counting only what a step changes finds the boxes that counting everything finds.
        #[test]
        fn boxes_are_those_of_the_slow_algorithm(mask in masks(), growth in growths()) {
            // Slow is cubic; small masks take all the turns there are.
            let mask = mask_where(mask.width().min(34), mask.height().min(34), |x, y| mask.contains(x, y));
            prop_assert_eq!(grow_boxes(&mask, &growth), grow_boxes_slowly(&mask, &growth));
        }

        /// With blocks of one texel, opaque texels make up at least `min_fill` of every box.
        #[test]
        fn boxes_of_single_texels_keep_the_fill_ratio(mask in masks(), min_fill in 0.0..=1.0f64) {
            for rect in grow_boxes(&mask, &Growth { block: 1, min_fill }) {
                prop_assert!(mask.count_in(rect) as f64 >= min_fill * rect.area() as f64);
            }
        }

        /// A block as large as the mask gives its bounds.
        #[test]
        fn one_large_block_gives_one_rectangle(mask in masks()) {
            let growth = Growth { block: mask.width().max(mask.height()) as u32, ..Growth::default() };
            let bounds: Vec<_> = mask.bounds().into_iter().collect();
            prop_assert_eq!(grow_boxes(&mask, &growth), bounds);
        }
    }

    #[test]
    fn a_box_grows_along_a_diagonal() {
        let mask = mask_where(4, 4, |x, y| x == y);
        let half = Growth {
            block: 1,
            min_fill: 0.5,
        };
        // Two of four blocks are half; three of nine would be less.
        assert_eq!(grow_boxes(&mask, &half).len(), 2);
        assert_eq!(
            grow_boxes(
                &mask,
                &Growth {
                    min_fill: 0.0,
                    ..half
                }
            )
            .len(),
            1
        );
        assert_eq!(
            grow_boxes(
                &mask,
                &Growth {
                    min_fill: 0.8,
                    ..half
                }
            )
            .len(),
            4
        );
    }

    #[test]
    fn a_mask_without_texels_has_no_boxes() {
        for (width, height) in [(0, 0), (0, 5), (5, 0), (70, 70)] {
            assert_eq!(
                grow_boxes(&BitMask::empty(width, height), &Growth::default()),
                []
            );
        }
    }

    #[test]
    #[should_panic(expected = "blocks have no texels")]
    fn blocks_without_texels_are_refused() {
        grow_boxes(
            &BitMask::empty(1, 1),
            &Growth {
                block: 0,
                min_fill: 0.8,
            },
        );
    }

    #[test]
    #[should_panic(expected = "a fill ratio of NaN")]
    fn a_fill_ratio_that_is_no_number_is_refused() {
        grow_boxes(
            &BitMask::empty(1, 1),
            &Growth {
                block: 1,
                min_fill: f64::NAN,
            },
        );
    }
}
