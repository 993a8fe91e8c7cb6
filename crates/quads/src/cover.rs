//! The cheapest rectangles that splitting, growing and reworking find.

use crate::area::{Area, transpose};
use crate::rework::rework;
use crate::split::{Scratch, Search, Sheet, least_cost_of_any_several};
use crate::{Growth, Price, grow_boxes};
use farfield_grid::{BitMask, Rect};

/// Blocks of the boxes that `cover` compares with, in texels.
const BLOCKS: [u32; 6] = [1, 2, 4, 8, 16, 32];

/// Rectangles around all opaque texels that weigh little.
///
/// There are two ways to start:
///
/// - The bounds of the mask are cut in two where both sides, shrunk to their opaque texels,
///   look cheapest, then these alike, down to pieces that no cut can make cheaper; on the way
///   back, two sides that are cheaper in one rectangle become one.
/// - Boxes are grown, with blocks of 1, 2, 4, 8, 16 and 32 texels and the default fill ratio.
///
/// The cheapest start is reworked: wherever two neighbours, with at most two more that reach
/// between them, can be covered by cheaper rectangles, they are. Cuts alone leave pieces of
/// unfit length and separate neighbours early; this moves borders, merges and divides, and
/// saves another 5 to 10 % of the bytes. (Jeschke, Accelerating the Rendering Process Using
/// Impostors, 2005, section 3.5, found split and merge inferior to box growing. Here the cuts
/// lie between any two texels, and each is judged by what it costs, gutters included.)
///
/// * `mask` - the opaque texels, of any size
/// * `price` - what texels and quads weigh; it takes the place of block size and fill ratio
///
/// Returns disjoint tight rectangles, sorted by row and column of their top left texels, none
/// for an empty mask. They never weigh more than those of [`grow_boxes`] with the blocks named.
/// Takes a few milliseconds for a typical layer of 500 x 500 texels, some hundred for a million
/// texels of noise; the time grows like the texels of the mask.
///
/// # Panics
///
/// When a field of `price` is out of its range.
pub fn cover(mask: &BitMask, price: &Price) -> Vec<Rect> {
    let quad = price.texels_per_quad();
    let Some(bounds) = mask.bounds() else {
        return Vec::new();
    };
    let whole = Area::from_rect(bounds);
    if whole.cost(quad) <= least_cost_of_any_several(whole, mask.count() as u32, quad) {
        return vec![bounds];
    }
    let cost = |areas: &[Area]| areas.iter().map(|a| a.cost(quad)).sum::<f64>();

    let mut start = split(mask, whole, quad);
    for block in BLOCKS {
        let growth = Growth {
            block,
            ..Growth::default()
        };
        let boxes = grow_boxes(mask, &growth).into_iter();
        let grown: Vec<Area> = boxes.map(Area::from_rect).collect();
        if cost(&grown) < cost(&start) {
            start = grown;
        }
    }

    let mut areas = rework(mask, quad, start);
    areas.sort_unstable_by_key(|a| (a.top, a.left));
    areas.into_iter().map(Area::rect).collect()
}

fn split(mask: &BitMask, bounds: Area, quad: f64) -> Vec<Area> {
    let sheet = Sheet {
        rows: mask.clone(),
        columns: transpose(mask),
    };
    let mut search = Search {
        sheet: &sheet,
        taken: &[],
        quad,
        scratch: &mut Scratch::default(),
        work: 0,
    };
    let mut areas = Vec::new();
    search.split(bounds, &mut areas);
    areas
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{check_rects, hash, mask_where, masks};
    use proptest::prelude::*;
    use std::collections::HashMap;

    fn prices() -> impl Strategy<Value = Price> {
        let quad = prop_oneof![Just(0.0), Just(104.0), 0.0..1e4f64, Just(1e300)];
        (quad, prop_oneof![Just(4.0), 0.1..8.0f64]).prop_map(|(bytes_per_quad, bytes_per_texel)| {
            Price {
                bytes_per_quad,
                bytes_per_texel,
            }
        })
    }

    /// The least cost of any disjoint rectangles around the opaque texels, by trying all of them.
    ///
    /// The first opaque texel without a rectangle, row by row, gets every rectangle that holds
    /// it and touches no earlier one; what can come after depends on the occupied texels alone.
    fn least_cost(mask: &BitMask, quad: u32) -> u32 {
        fn rest(
            occupied: u64,
            opaque: u64,
            rects: &[(u64, u32)],
            known: &mut HashMap<u64, u32>,
        ) -> u32 {
            let open = opaque & !occupied;
            if open == 0 {
                return 0;
            }
            if let Some(&cost) = known.get(&occupied) {
                return cost;
            }
            let first = open & open.wrapping_neg();
            let cost = rects
                .iter()
                .filter(|(texels, _)| texels & first != 0 && texels & occupied == 0)
                .map(|&(texels, cost)| cost + rest(occupied | texels, opaque, rects, known))
                .min()
                .expect("the texel alone is a rectangle");
            known.insert(occupied, cost);
            cost
        }
        let (w, h) = (mask.width(), mask.height());
        let bit = |x: usize, y: usize| 1u64 << (y * w + x);
        let opaque = mask.iter().fold(0, |m, (x, y)| m | bit(x, y));
        let lines = |x0: usize, y0: usize, x1: usize, y1: usize| {
            (y0..=y1)
                .flat_map(|y| (x0..=x1).map(move |x| bit(x, y)))
                .fold(0, |m, b| m | b)
        };
        let mut rects = Vec::new();
        for (y0, x0) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            for (y1, x1) in (y0..h).flat_map(|y| (x0..w).map(move |x| (y, x))) {
                // One that is not tight is never cheapest.
                let sides = [
                    lines(x0, y0, x1, y0),
                    lines(x0, y1, x1, y1),
                    lines(x0, y0, x0, y1),
                    lines(x1, y0, x1, y1),
                ];
                if sides.iter().all(|side| side & opaque != 0) {
                    let cost = ((x1 - x0 + 3) * (y1 - y0 + 3)) as u32 + quad;
                    rects.push((lines(x0, y0, x1, y1), cost));
                }
            }
        }
        rest(0, opaque, &rects, &mut HashMap::new())
    }

    fn cost_in_texels(mask: &BitMask, quad: u32) -> u32 {
        let price = Price {
            bytes_per_quad: f64::from(quad),
            bytes_per_texel: 1.0,
        };
        price.bytes(&cover(mask, &price)) as u32
    }

    proptest! {
        /// Every opaque texel is in exactly one rectangle; these are disjoint and tight.
        #[test]
        fn every_opaque_texel_is_in_exactly_one_rectangle(mask in masks(), price in prices()) {
            check_rects(&mask, &cover(&mask, &price)).map_err(TestCaseError::fail)?;
        }

        /// One rectangle around everything never weighs less.
        #[test]
        fn the_bounds_never_weigh_less(mask in masks(), price in prices()) {
            let bounds: Vec<_> = mask.bounds().into_iter().collect();
            // Weights are sums of two products, each rounded by at most 2^-53 of itself; ours
            // may in addition be less only by what `rework` calls noise, 1e-12 of itself.
            let slack = 1.0 + 1e-12;
            prop_assert!(price.bytes(&cover(&mask, &price)) <= price.bytes(&bounds) * slack);
        }

        /// Box growing with a power of two up to 32 texels a block never weighs less.
        #[test]
        fn box_growing_never_weighs_less(mask in masks(), price in prices(), i in 0..BLOCKS.len()) {
            let growth = Growth { block: BLOCKS[i], ..Growth::default() };
            let grown = price.bytes(&grow_boxes(&mask, &growth));
            // Two sums of the same kind, each rounded by at most 1e-16 a term of at most 1e4.
            prop_assert!(price.bytes(&cover(&mask, &price)) <= grown * (1.0 + 1e-12));
        }

        /// Only the ratio of the prices counts.
        #[test]
        fn only_the_ratio_of_prices_counts(mask in masks(), price in prices()) {
            // Doubling is exact, so the ratio is the same to the last bit.
            let double = Price {
                bytes_per_quad: 2.0 * price.bytes_per_quad,
                bytes_per_texel: 2.0 * price.bytes_per_texel,
            };
            prop_assert_eq!(cover(&mask, &price), cover(&mask, &double));
        }
    }

    /// On every mask of 4 x 3 texels nothing is cheaper, not even where quads cost nothing.
    #[test]
    fn nothing_is_cheaper_on_all_masks_of_twelve_texels() {
        for bits in 0..1 << 12 {
            let mask = mask_where(4, 3, |x, y| bits >> (y * 4 + x) & 1 != 0);
            for quad in [0, 3] {
                assert_eq!(
                    cost_in_texels(&mask, quad),
                    least_cost(&mask, quad),
                    "{mask:?}"
                );
            }
        }
    }

    /// On masks of 6 x 5 texels, of all densities, at least 99 of 100 are covered at the least
    /// cost (all 400 when this was written), and none at more than 1.1 times the least.
    #[test]
    fn small_masks_are_covered_at_the_least_cost() {
        let (mut masks, mut cheapest) = (0, 0);
        for seed in 0..400u32 {
            let density = f64::from(seed % 20 + 1) / 40.0;
            let mask = mask_where(6, 5, |x, y| {
                hash(u64::from(seed), (y * 6 + x) as u64) < density
            });
            let (ours, least) = (cost_in_texels(&mask, 0), least_cost(&mask, 0));
            assert!(
                10 * ours <= 11 * least,
                "{ours} instead of {least}: {mask:?}"
            );
            masks += 1;
            cheapest += u32::from(ours == least);
        }
        assert!(100 * cheapest >= 99 * masks, "{cheapest} of {masks}");
    }

    /// On rings, the outlines that layers mostly hold, at least 9 % of the bytes that box growing
    /// takes with its best block are saved: 9.8 % when this was written, 5.9 % without reworking.
    #[test]
    fn rings_weigh_clearly_less_than_with_box_growing() {
        let price = Price::default();
        let (mut ours, mut grown) = (0.0, [0.0; BLOCKS.len()]);
        for i in 0..24 {
            let (radius, thick) = (f64::from(20 + 3 * i), f64::from(2 + i % 5));
            let ring = mask_where(200, 200, |x, y| {
                let distance = f64::hypot(x as f64 - 99.3, y as f64 - 98.7);
                (radius - thick..radius).contains(&distance)
            });
            ours += price.bytes(&cover(&ring, &price));
            for (sum, block) in grown.iter_mut().zip(BLOCKS) {
                let growth = Growth {
                    block,
                    ..Growth::default()
                };
                *sum += price.bytes(&grow_boxes(&ring, &growth));
            }
        }
        let best = grown.into_iter().fold(f64::INFINITY, f64::min);
        assert!(ours <= 0.91 * best, "{ours} is too near to {best}");
    }

    #[test]
    fn a_frame_becomes_four_bars() {
        let frame = mask_where(40, 30, |x, y| x == 0 || x == 39 || y == 0 || y == 29);
        let rects = cover(&frame, &Price::default());
        assert_eq!(rects.len(), 4);
        assert_eq!(rects.iter().map(Rect::area).sum::<u64>(), 136);
    }

    #[test]
    fn a_mask_without_texels_has_no_rectangles() {
        for (width, height) in [(0, 0), (0, 5), (5, 0), (70, 70)] {
            assert_eq!(cover(&BitMask::empty(width, height), &Price::default()), []);
        }
    }

    #[test]
    #[should_panic(expected = "-1 bytes per quad")]
    fn a_negative_price_is_refused() {
        let price = Price {
            bytes_per_quad: -1.0,
            ..Price::default()
        };
        cover(&BitMask::empty(1, 1), &price);
    }

    #[test]
    #[should_panic(expected = "0 bytes per texel")]
    fn texels_without_weight_are_refused() {
        let price = Price {
            bytes_per_texel: 0.0,
            ..Price::default()
        };
        cover(&BitMask::empty(1, 1), &price);
    }
}
