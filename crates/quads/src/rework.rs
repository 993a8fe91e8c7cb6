//! Local search: neighbouring rectangles are taken back and their texels covered anew.

use crate::area::{Area, transpose};
use crate::split::{Scratch, Search, Sheet};
use farfield_grid::BitMask;

/// A neighbour is nearer than this many texels. On layers of four models 1, which leaves those
/// that adjoin, weighs up to 0.4 % more, and 8 weighs 0.2 % less but takes half as long again.
const NEIGHBOURHOOD: u32 = 4;

/// At most this many rectangles are covered anew together. 2 weighs 1 to 5 % more, 6 weighs
/// the same and takes longer.
const MOST_TOGETHER: usize = 4;

/// First cuts tried for each group; 1 weighs up to 1 % more, 4 some 0.1 % less.
const FIRST_CUTS: usize = 3;

/// Side of the cells that rectangles are looked up by, in texels.
const CELL: u32 = 32;

/// Replaces groups of neighbours by cheaper rectangles around the same opaque texels.
///
/// The areas stay disjoint, tight and around the same texels. New areas are tried with their
/// neighbours; a pair that did not get cheaper is not tried again before something in it
/// changes. Every change lowers the cost, so this ends; the lines it reads are also limited to
/// a number proportional to the texels of the mask, which only dense noise and
/// lattices of long lines reach.
pub(crate) fn rework(mask: &BitMask, quad: f64, areas: Vec<Area>) -> Vec<Area> {
    let mut state = State::new(mask, areas);
    let mut scratch = Scratch::default();
    let mut work = 0;
    // A typical layer of 500 x 500 texels needs some 100,000.
    let limit = 1_000_000 + 4 * (mask.width() * mask.height()) as u64;
    let mut next = 0;
    // New areas are appended, so the list of areas is its own queue.
    while next < state.areas.len() && work < limit {
        let id = next;
        next += 1;
        let Some(area) = state.areas[id] else {
            continue;
        };
        for other in state.touching(area.grown(NEIGHBOURHOOD)) {
            // Those behind in the queue will try the pair themselves.
            if other >= id {
                break;
            }
            let Some(neighbour) = state.areas[other] else {
                continue;
            };
            if let Some((group, parts)) =
                cheaper(&state, area.join(&neighbour), quad, &mut scratch, &mut work)
            {
                state.replace(&group, &parts);
                break;
            }
        }
    }
    state.areas.into_iter().flatten().collect()
}

/// The areas in `window` and cheaper ones in their place, if there are any.
fn cheaper(
    state: &State<'_>,
    window: Area,
    quad: f64,
    scratch: &mut Scratch,
    work: &mut u64,
) -> Option<(Vec<usize>, Vec<Area>)> {
    let group = state.touching(window);
    if group.len() > MOST_TOGETHER {
        return None;
    }
    let members: Vec<Area> = group.iter().filter_map(|&id| state.areas[id]).collect();
    let window = members.iter().fold(window, |w, a| w.join(a));
    let taken: Vec<Area> = state
        .touching(window)
        .into_iter()
        .filter(|id| !group.contains(id))
        .filter_map(|id| state.areas[id])
        .map(|a| relative(a, window))
        .collect();
    let rows = cut_out(state.mask, window, &members);
    let sheet = Sheet {
        columns: transpose(&rows),
        rows,
    };
    let mut search = Search {
        sheet: &sheet,
        taken: &taken,
        quad,
        scratch,
        work: 0,
    };
    let whole = Area {
        left: 0,
        top: 0,
        right: window.width(),
        bottom: window.height(),
    };
    let (cost, parts) = search.split_thoroughly::<FIRST_CUTS>(whole);
    *work += search.work + u64::from(window.height());
    let before: f64 = members.iter().map(|a| a.cost(quad)).sum();
    // Costs are sums of a few numbers, each rounded to about 1e-16 of itself; anything cheaper
    // by less is noise of the order of summation.
    (cost < before * (1.0 - 1e-12)).then(|| {
        let parts = parts.into_iter().map(|a| absolute(a, window)).collect();
        (group, parts)
    })
}

/// The part of `area` in `window`, seen from its corner.
fn relative(area: Area, window: Area) -> Area {
    Area {
        left: area.left.max(window.left) - window.left,
        top: area.top.max(window.top) - window.top,
        right: area.right.min(window.right) - window.left,
        bottom: area.bottom.min(window.bottom) - window.top,
    }
}

fn absolute(area: Area, window: Area) -> Area {
    Area {
        left: area.left + window.left,
        top: area.top + window.top,
        right: area.right + window.left,
        bottom: area.bottom + window.top,
    }
}

/// The opaque texels of `members`, as a mask of the window's size.
fn cut_out(mask: &BitMask, window: Area, members: &[Area]) -> BitMask {
    let mut out = BitMask::empty(window.width() as usize, window.height() as usize);
    let mut row = vec![0u64; out.words_per_row()];
    for y in window.top..window.bottom {
        row.fill(0);
        let words = mask.row(y as usize);
        for a in members.iter().filter(|a| a.top <= y && y < a.bottom) {
            let (from, to) = (a.left - window.left, a.right - window.left);
            for i in from / 64..to.div_ceil(64) {
                // 64 texels from column x on, those of this member only.
                let x = (window.left + i * 64) as usize;
                let low = words[x / 64] >> (x % 64);
                let high = words
                    .get(x / 64 + 1)
                    .map_or(0, |w| w.checked_shl(64 - x as u32 % 64).unwrap_or(0));
                let first = from.max(i * 64) - i * 64;
                let end = to.min(i * 64 + 64) - i * 64;
                row[i as usize] |= (low | high) & (u64::MAX << first) & (u64::MAX >> (64 - end));
            }
        }
        out.set_row((y - window.top) as usize, &row);
    }
    out
}

/// The areas, and which of them touch each cell of [`CELL`] x [`CELL`] texels.
struct State<'a> {
    mask: &'a BitMask,
    /// `None` once replaced; ids are indices and never used again.
    areas: Vec<Option<Area>>,
    cells: Vec<Vec<u32>>,
    cells_per_row: u32,
    rows_of_cells: u32,
}

impl<'a> State<'a> {
    fn new(mask: &'a BitMask, areas: Vec<Area>) -> Self {
        let cells_per_row = (mask.width() as u32).div_ceil(CELL);
        let rows_of_cells = (mask.height() as u32).div_ceil(CELL);
        let mut state = Self {
            mask,
            areas: Vec::new(),
            cells: vec![Vec::new(); (cells_per_row * rows_of_cells) as usize],
            cells_per_row,
            rows_of_cells,
        };
        for area in areas {
            state.add(area);
        }
        state
    }

    fn add(&mut self, area: Area) {
        let id = self.areas.len() as u32;
        self.areas.push(Some(area));
        for cell in self.cells_of(area) {
            self.cells[cell].push(id);
        }
    }

    fn replace(&mut self, group: &[usize], parts: &[Area]) {
        for &id in group {
            if let Some(area) = self.areas[id].take() {
                for cell in self.cells_of(area) {
                    self.cells[cell].retain(|&other| other as usize != id);
                }
            }
        }
        for &part in parts {
            self.add(part);
        }
    }

    /// Ids of the areas that share a texel with `window`, in ascending order.
    fn touching(&self, window: Area) -> Vec<usize> {
        let mut ids: Vec<usize> = self
            .cells_of(window)
            .flat_map(|cell| &self.cells[cell])
            .map(|&id| id as usize)
            .filter(|&id| self.areas[id].is_some_and(|a| a.meets(&window)))
            .collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    fn cells_of(&self, area: Area) -> impl Iterator<Item = usize> + use<> {
        let columns = area.left / CELL..area.right.div_ceil(CELL).min(self.cells_per_row);
        let rows = area.top / CELL..area.bottom.div_ceil(CELL).min(self.rows_of_cells);
        let per_row = self.cells_per_row;
        rows.flat_map(move |y| columns.clone().map(move |x| (y * per_row + x) as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{check_rects, mask_where, masks};
    use crate::{Growth, grow_boxes};
    use proptest::prelude::*;

    proptest! {
        /// From any rectangles on, the texels stay covered once and the cost never rises.
        #[test]
        fn reworking_never_costs_more(mask in masks(), block in 1..20u32, min_fill in 0.0..=1.0f64, quad in 0.0..999.0f64) {
            let before = grow_boxes(&mask, &Growth { block, min_fill });
            let before: Vec<_> = before.into_iter().map(Area::from_rect).collect();
            let cost = |areas: &[Area]| areas.iter().map(|a| a.cost(quad)).sum::<f64>();
            let after = rework(&mask, quad, before.clone());
            prop_assert!(cost(&after) <= cost(&before));
            let rects: Vec<_> = after.into_iter().map(Area::rect).collect();
            check_rects(&mask, &rects).map_err(TestCaseError::fail)?;
        }

        /// The cut-out mask holds the members' texels and no others.
        #[test]
        fn cutting_out_agrees_with_single_texels(mask in masks(), block in 1..20u32, pick in any::<[prop::sample::Index; 3]>()) {
            let areas = grow_boxes(&mask, &Growth { block, min_fill: 0.5 });
            if areas.is_empty() {
                return Ok(());
            }
            let members = pick.map(|i| Area::from_rect(*i.get(&areas)));
            let window = members.iter().fold(members[0], |w, a| w.join(a));
            let expected = mask_where(window.width() as usize, window.height() as usize, |x, y| {
                let (x, y) = (x as u32 + window.left, y as u32 + window.top);
                mask.contains(x as usize, y as usize) && members.iter().any(|a| a.rect().contains(x, y))
            });
            prop_assert_eq!(cut_out(&mask, window, &members), expected);
        }

        /// Looking areas up by cells finds those that touch the window, as looking at all does.
        #[test]
        fn looking_up_finds_what_touches(mask in masks(), block in 1..20u32, f in any::<[u8; 4]>()) {
            let areas = grow_boxes(&mask, &Growth { block, min_fill: 0.5 });
            let areas: Vec<_> = areas.into_iter().map(Area::from_rect).collect();
            let [left, top, width, height] = f.map(u32::from);
            let window = Area { left, top, right: left + 1 + width, bottom: top + 1 + height };
            let expected: Vec<_> = (0..areas.len()).filter(|&i| areas[i].meets(&window)).collect();
            prop_assert_eq!(State::new(&mask, areas).touching(window), expected);
        }
    }

    #[test]
    fn pieces_of_a_bar_are_joined() {
        let bar = mask_where(100, 3, |_, _| true);
        let pieces = (0..10).map(|i| Area {
            left: 10 * i,
            top: 0,
            right: 10 * i + 10,
            bottom: 3,
        });
        assert_eq!(rework(&bar, 0.0, pieces.collect()).len(), 1);
    }
}
