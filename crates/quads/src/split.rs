//! Cutting an area top down.

use crate::area::{Area, Line, read_lines};
use farfield_grid::BitMask;

/// A mask, and the same with rows and columns exchanged.
pub(crate) struct Sheet {
    pub(crate) rows: BitMask,
    pub(crate) columns: BitMask,
}

/// The tight area of one side of a cut and its number of opaque texels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    area: Area,
    opaque: u32,
}

impl Side {
    const NONE: Self = Self {
        area: Area {
            left: u32::MAX,
            top: u32::MAX,
            right: 0,
            bottom: 0,
        },
        opaque: 0,
    };

    /// Adds the opaque texels of row `y`.
    fn add(&mut self, line: &Line, y: u32) {
        if line.count > 0 {
            self.area = self.area.join(&Area {
                left: line.first,
                top: y,
                right: line.end,
                bottom: y + 1,
            });
            self.opaque += line.count;
        }
    }

    fn transposed(self) -> Self {
        Self {
            area: self.area.transposed(),
            ..self
        }
    }
}

/// Buffers of a search, kept to be used again.
#[derive(Default)]
pub(crate) struct Scratch {
    rows: Vec<Line>,
    columns: Vec<Line>,
    below: Vec<Side>,
}

/// Which cuts of an area come into question.
#[derive(Clone, Copy, PartialEq)]
enum Reach {
    Anywhere,
    /// Both sides keep at most three quarters of the length.
    MiddleHalf,
}

/// Below this depth areas are cut in their middle half, so that the depth of the recursion is
/// bounded by [`FREE_DEPTH`] + 2 log(side) / log(4/3). Noise tempts the search to peel off line by
/// line and to read the whole mask each time.
const FREE_DEPTH: u32 = 32;

/// Share of the transparent texels of a side that later cuts are expected to save, beyond those
/// that a further quad costs. At 0 all cuts of a frame of thin lines are alike and it is cut
/// across, at 0.3 and more curved bands are torn to pieces.
const DISCOUNT: f64 = 0.1;

/// The smallest cost of two rectangles or more around `opaque` texels that touch `rows` rows
/// and `columns` columns: every texel is paid for once, every row by a rectangle's gutter left
/// and right of it, every column by one above and below, every rectangle by its gutter's four
/// corners and the price of a quad.
fn least_cost_of_several(opaque: u32, rows: u32, columns: u32, quad: f64) -> f64 {
    f64::from(opaque) + 2.0 * (f64::from(rows) + f64::from(columns)) + 2.0 * (4.0 + quad)
}

/// The same from fewer facts: `opaque` texels need at least so many rows and columns of an area.
/// That settles most areas without reading them.
pub(crate) fn least_cost_of_any_several(area: Area, opaque: u32, quad: f64) -> f64 {
    let (rows, columns) = (
        opaque.div_ceil(area.width()),
        opaque.div_ceil(area.height()),
    );
    least_cost_of_several(opaque, rows, columns, quad)
}

/// A search for the cheapest rectangles that come from cutting areas in two, again and again.
pub(crate) struct Search<'a> {
    pub(crate) sheet: &'a Sheet,
    /// What no rectangle may touch.
    pub(crate) taken: &'a [Area],
    /// Price of a quad in texels.
    pub(crate) quad: f64,
    pub(crate) scratch: &'a mut Scratch,
    /// Lines read so far.
    pub(crate) work: u64,
}

impl Search<'_> {
    /// Appends the rectangles around the opaque texels of `area`, which is tight, and returns
    /// their cost. The area is cut where the two sides look cheapest, then these alike; on
    /// the way back, what is cheaper in one rectangle becomes one.
    pub(crate) fn split(&mut self, area: Area, out: &mut Vec<Area>) -> f64 {
        let opaque = self.sheet.rows.count_in(area.rect()) as u32;
        self.split_side(Side { area, opaque }, 0, out)
    }

    /// Like `split`, but tries the `N` first cuts that look best.
    pub(crate) fn split_thoroughly<const N: usize>(&mut self, area: Area) -> (f64, Vec<Area>) {
        let opaque = self.sheet.rows.count_in(area.rect()) as u32;
        let whole = self.cost_in_one(area);
        let mut best = (whole, vec![area]);
        let cuts = self.best_cuts::<N>(Side { area, opaque }, whole, 0);
        for [a, b] in cuts.into_iter().flatten() {
            let mut out = Vec::new();
            let cost = self.split_side(a, 1, &mut out) + self.split_side(b, 1, &mut out);
            if cost < best.0 {
                best = (cost, out);
            }
        }
        best
    }

    fn split_side(&mut self, side: Side, depth: u32, out: &mut Vec<Area>) -> f64 {
        let whole = self.cost_in_one(side.area);
        let [cut] = self.best_cuts::<1>(side, whole, depth);
        let Some([a, b]) = cut else {
            out.push(side.area);
            return whole;
        };
        let start = out.len();
        let parts = self.split_side(a, depth + 1, out) + self.split_side(b, depth + 1, out);
        if whole <= parts {
            out.truncate(start);
            out.push(side.area);
            return whole;
        }
        parts
    }

    /// Cost of one rectangle, infinite where it touches what is taken.
    fn cost_in_one(&self, area: Area) -> f64 {
        if self.taken.iter().any(|t| t.meets(&area)) {
            f64::INFINITY
        } else {
            area.cost(self.quad)
        }
    }

    /// The `N` cuts of least estimated cost, the best first; none when no cut can be cheaper
    /// than `whole`.
    fn best_cuts<const N: usize>(
        &mut self,
        side: Side,
        whole: f64,
        depth: u32,
    ) -> [Option<[Side; 2]>; N] {
        let quad = self.quad;
        let Side { area, opaque } = side;
        // A row holds at most as many texels as it is wide, which settles most areas unread.
        let (rows, columns) = (
            opaque.div_ceil(area.width()),
            opaque.div_ceil(area.height()),
        );
        if whole <= least_cost_of_several(opaque, rows, columns, quad) {
            return [None; N];
        }

        let Scratch {
            rows,
            columns,
            below,
        } = &mut *self.scratch;
        read_lines(&self.sheet.rows, area, rows);
        read_lines(&self.sheet.columns, area.transposed(), columns);
        self.work += (rows.len() + columns.len()) as u64;
        let filled = |lines: &[Line]| lines.iter().filter(|l| l.count > 0).count() as u32;
        if whole <= least_cost_of_several(opaque, filled(rows), filled(columns), quad) {
            return [None; N];
        }

        let reach = if depth < FREE_DEPTH {
            Reach::Anywhere
        } else {
            Reach::MiddleHalf
        };
        let mut best = [(f64::INFINITY, None); N];
        for_each_cut(rows, area.top, reach, below, |sides| {
            rank(&mut best, estimate(sides, quad), sides);
        });
        for_each_cut(columns, area.left, reach, below, |sides| {
            rank(
                &mut best,
                estimate(sides, quad),
                sides.map(Side::transposed),
            );
        });
        best.map(|(_, sides)| sides)
    }
}

/// What two sides will cost once they are cut further, by rule of thumb, less what all
/// cuts of an area have in common.
fn estimate(sides: [Side; 2], quad: f64) -> f64 {
    let [a, b] = sides.map(|Side { area, opaque }| {
        let texels = f64::from(area.width()) * f64::from(area.height());
        let gutter = 2.0 * f64::from(area.width() + area.height());
        texels + gutter - DISCOUNT * (texels - f64::from(opaque) - 4.0 - quad).max(0.0)
    });
    a + b
}

/// Puts a cut in its place among the best so far, behind those of equal cost.
fn rank<const N: usize>(best: &mut [(f64, Option<[Side; 2]>); N], cost: f64, sides: [Side; 2]) {
    if cost < best[N - 1].0 {
        let place = best.partition_point(|b| b.0 <= cost);
        best[place..].rotate_right(1);
        best[place] = (cost, Some(sides));
    }
}

/// Calls `visit` with what lies above and below of every cut between `lines`, whose first is
/// row `top`. Of all cuts through one gap between opaque texels it takes a single one, for the
/// sides are tight.
fn for_each_cut(
    lines: &[Line],
    top: u32,
    reach: Reach,
    below: &mut Vec<Side>,
    mut visit: impl FnMut([Side; 2]),
) {
    // From the last line up, what lies at and below each.
    below.clear();
    below.resize(lines.len(), Side::NONE);
    let mut side = Side::NONE;
    for (i, line) in lines.iter().enumerate().rev() {
        side.add(line, top + i as u32);
        below[i] = side;
    }
    // From the first line down, what lies above.
    let quarter = match reach {
        Reach::Anywhere => 0,
        Reach::MiddleHalf => lines.len() / 4,
    };
    let mut above = Side::NONE;
    for (i, line) in lines.iter().enumerate().filter(|(_, l)| l.count > 0) {
        // The gap between both sides must reach into the middle.
        if above.opaque > 0
            && i >= quarter
            && (above.area.bottom - top) as usize + quarter <= lines.len()
        {
            visit([above, below[i]]);
        }
        above.add(line, top + i as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::transpose;
    use crate::shapes::{check_rects, masks};
    use proptest::prelude::*;

    fn lines_of(mask: &BitMask) -> Vec<Line> {
        let mut lines = Vec::new();
        read_lines(mask, whole(mask), &mut lines);
        lines
    }

    fn whole(mask: &BitMask) -> Area {
        Area {
            left: 0,
            top: 0,
            right: mask.width() as u32,
            bottom: mask.height() as u32,
        }
    }

    /// The tight areas and texels of the rows above and from `y` on, texel by texel.
    fn sides_at(mask: &BitMask, y: u32) -> [Side; 2] {
        let mut sides = [Side::NONE; 2];
        for (x, row) in mask.iter().map(|(x, y)| (x as u32, y as u32)) {
            let texel = Line {
                first: x,
                end: x + 1,
                count: 1,
            };
            sides[usize::from(row >= y)].add(&texel, row);
        }
        sides
    }

    proptest! {
        /// The sides of every cut are tight; there is one cut for every gap.
        #[test]
        fn cuts_agree_with_single_texels(mask in masks()) {
            let mut found = Vec::new();
            let lines = lines_of(&mask);
            for_each_cut(&lines, 0, Reach::Anywhere, &mut Vec::new(), |sides| found.push(sides));
            let expected: Vec<_> = (1..mask.height() as u32)
                .filter(|&y| lines[y as usize].count > 0)
                .map(|y| sides_at(&mask, y))
                .filter(|sides| sides[0].opaque > 0)
                .collect();
            prop_assert_eq!(found, expected);
        }

        /// In the middle half neither side keeps more than three quarters of the lines, rounded
        /// up, and an area that begins and ends with opaque texels has such a cut.
        #[test]
        fn cuts_in_the_middle_half_shorten_both_sides(mask in masks()) {
            let Some(bounds) = mask.bounds() else { return Ok(()) };
            let area = Area::from_rect(bounds);
            let mut lines = Vec::new();
            read_lines(&mask, area, &mut lines);
            let most = area.height() - area.height() / 4;
            let mut cuts = 0;
            for_each_cut(&lines, area.top, Reach::MiddleHalf, &mut Vec::new(), |[a, b]| {
                cuts += 1;
                assert!(a.area.height() <= most && b.area.height() <= most);
            });
            prop_assert!(cuts > 0 || area.height() == 1);
        }

        /// At whatever depth the search begins, it covers every opaque texel once, and its cost
        /// is that of its areas.
        #[test]
        fn splitting_covers_every_opaque_texel_once(mask in masks(), deep in any::<bool>(), quad in 0.0..99.0f64) {
            let Some(bounds) = mask.bounds() else { return Ok(()) };
            let sheet = Sheet { columns: transpose(&mask), rows: mask.clone() };
            let scratch = &mut Scratch::default();
            let mut search = Search { sheet: &sheet, taken: &[], quad, scratch, work: 0 };
            let side = Side { area: Area::from_rect(bounds), opaque: mask.count() as u32 };
            let mut out = Vec::new();
            let cost = search.split_side(side, if deep { FREE_DEPTH } else { 0 }, &mut out);
            let sum: f64 = out.iter().map(|a| a.cost(quad)).sum();
            // Sums of at most 1e4 terms in another order, each rounded by 1e-16 of the sum.
            prop_assert!((cost - sum).abs() <= 1e-12 * sum);
            let rects: Vec<_> = out.into_iter().map(Area::rect).collect();
            check_rects(&mask, &rects).map_err(TestCaseError::fail)?;
        }

        /// No cover by several rectangles costs less than the bound says.
        #[test]
        fn several_rectangles_never_cost_less_than_their_bound(mask in masks(), quad in 0.0..99.0f64) {
            let filled = |lines: &[Line]| lines.iter().filter(|l| l.count > 0).count() as u32;
            let rows = filled(&lines_of(&mask));
            let columns = filled(&lines_of(&transpose(&mask)));
            for block in [1, 3, 8] {
                let growth = crate::Growth { block, min_fill: 1.0 };
                let rects = crate::grow_boxes(&mask, &growth);
                if rects.len() > 1 {
                    let cost: f64 = rects.iter().map(|&r| Area::from_rect(r).cost(quad)).sum();
                    let bound = least_cost_of_several(mask.count() as u32, rows, columns, quad);
                    prop_assert!(cost >= bound * (1.0 - 1e-12));
                }
            }
        }
    }
}
