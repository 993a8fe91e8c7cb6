//! Cutting an area top down.

use crate::area::{Area, Line, read_lines};
use farfield_grid::BitMask;

/// A mask, and the same with rows and columns exchanged.
pub(crate) struct Sheet {
    pub(crate) rows: BitMask,
    pub(crate) columns: BitMask,
}

/// The tight area of one side of a cut and its number of opaque texels.
#[derive(Clone, Copy)]
struct Side {
    area: Area,
    opaque: u32,
}

/// Buffers of a search, kept to be used again.
#[derive(Default)]
pub(crate) struct Scratch {
    rows: Vec<Line>,
    columns: Vec<Line>,
    below: Vec<Option<Side>>,
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

/// How far the estimated cost of a side follows its bounds, in [0, 1]. The rest follows a lower
/// bound on the cost of several rectangles. At 1 the cuts of a frame of thin lines are all alike
/// and it is cut across, at 0.8 and less curved bands are torn to pieces.
const TRUST: f64 = 0.9;

/// The smallest cost of two rectangles or more around `opaque` texels that touch `rows` rows
/// and `columns` columns: every texel is paid for once, every row by a rectangle's gutter left
/// and right of it, every column by one above and below, every rectangle by its gutter's four
/// corners and the price of a quad.
fn least_cost_of_several(opaque: u32, rows: u32, columns: u32, quad: f64) -> f64 {
    f64::from(opaque) + 2.0 * (f64::from(rows) + f64::from(columns)) + 2.0 * (4.0 + quad)
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
        self.split_at_depth(area, 0, out)
    }

    fn split_at_depth(&mut self, area: Area, depth: u32, out: &mut Vec<Area>) -> f64 {
        let whole = self.cost_in_one(area);
        let [Some([a, b]), ..] = self.best_cuts::<1>(area, whole, depth) else {
            out.push(area);
            return whole;
        };
        let start = out.len();
        let parts = self.split_at_depth(a, depth + 1, out) + self.split_at_depth(b, depth + 1, out);
        if whole <= parts {
            out.truncate(start);
            out.push(area);
            return whole;
        }
        parts
    }

    /// Like `split`, but tries the `N` best first cuts.
    pub(crate) fn split_thoroughly<const N: usize>(&mut self, area: Area) -> (f64, Vec<Area>) {
        let whole = self.cost_in_one(area);
        let mut best = (whole, vec![area]);
        for [a, b] in self.best_cuts::<N>(area, whole, 0).into_iter().flatten() {
            let mut out = Vec::new();
            let cost = self.split_at_depth(a, 1, &mut out) + self.split_at_depth(b, 1, &mut out);
            if cost < best.0 {
                best = (cost, out);
            }
        }
        best
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
        area: Area,
        whole: f64,
        depth: u32,
    ) -> [Option<[Area; 2]>; N] {
        let quad = self.quad;
        let Scratch {
            rows,
            columns,
            below,
        } = &mut *self.scratch;
        read_lines(&self.sheet.rows, area, rows);
        read_lines(&self.sheet.columns, area.transposed(), columns);
        self.work += (rows.len() + columns.len()) as u64;

        let filled = |lines: &[Line]| lines.iter().filter(|l| l.count > 0).count() as u32;
        let opaque = rows.iter().map(|l| l.count).sum();
        if whole <= least_cost_of_several(opaque, filled(rows), filled(columns), quad) {
            return [None; N];
        }

        let reach = if depth < FREE_DEPTH {
            Reach::Anywhere
        } else {
            Reach::MiddleHalf
        };
        let mut best = [(f64::INFINITY, None); N];
        let mut rank = |cost: f64, sides: [Area; 2]| {
            if cost < best[N - 1].0 {
                let place = best.partition_point(|b| b.0 <= cost);
                best[place..].rotate_right(1);
                best[place] = (cost, Some(sides));
            }
        };
        for_each_cut(rows, area.top, reach, below, |a, b| {
            rank(estimate(a, quad) + estimate(b, quad), [a.area, b.area]);
        });
        for_each_cut(columns, area.left, reach, below, |a, b| {
            let sides = [a.area.transposed(), b.area.transposed()];
            rank(estimate(a, quad) + estimate(b, quad), sides);
        });
        best.map(|(_, sides)| sides)
    }
}

/// What a side will cost once it is cut further, by rule of thumb.
fn estimate(side: Side, quad: f64) -> f64 {
    let Side { area, opaque } = side;
    let one = area.cost(quad);
    let several = least_cost_of_several(opaque, area.height(), area.width(), quad);
    TRUST * one + (1.0 - TRUST) * one.min(several)
}

/// Calls `visit` with what lies above and below of every cut between `lines`, whose first is
/// row `top`. Of all cuts through one gap between opaque texels it takes a single one, for the
/// sides are tight.
fn for_each_cut(
    lines: &[Line],
    top: u32,
    reach: Reach,
    below: &mut Vec<Option<Side>>,
    mut visit: impl FnMut(Side, Side),
) {
    // From the last line up, what lies at and below each.
    below.clear();
    below.resize(lines.len(), None);
    let mut side = None;
    for (i, line) in lines.iter().enumerate().rev() {
        side = with_line(side, line, top + i as u32);
        below[i] = side;
    }
    // From the first line down, what lies above.
    let quarter = if reach == Reach::MiddleHalf {
        lines.len() / 4
    } else {
        0
    };
    let mut above: Option<Side> = None;
    for (i, line) in lines.iter().enumerate() {
        if line.count == 0 {
            continue;
        }
        if let (Some(a), Some(b)) = (above, below[i])
            && i >= quarter
            && (a.area.bottom - top) as usize <= lines.len() - quarter
        {
            visit(a, b);
        }
        above = with_line(above, line, top + i as u32);
    }
}

/// `side` and the opaque texels of row `y`.
fn with_line(side: Option<Side>, line: &Line, y: u32) -> Option<Side> {
    if line.count == 0 {
        return side;
    }
    let area = Area {
        left: line.first,
        top: y,
        right: line.end,
        bottom: y + 1,
    };
    Some(match side {
        None => Side {
            area,
            opaque: line.count,
        },
        Some(side) => Side {
            area: side.area.join(&area),
            opaque: side.opaque + line.count,
        },
    })
}
