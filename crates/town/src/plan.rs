//! The plan of a town: rows of blocks between streets that climb a hill, row over row.
//!
//! A plan has coordinates of its own: u along the streets, to the right seen from the front, and v
//! from the front to the back, both in metres. [`Plan::point`] bends them into the world.

use crate::canvas::smooth;
use crate::dice::Dice;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Width of streets, and of alleys between blocks, in metres.
pub(crate) const STREET: f32 = 6.5;
const ALLEY: f32 = 3.6;
/// From the front border to the first row: meadow, then the promenade.
pub(crate) const PROMENADE: [f32; 2] = [4.5, 14.0];
/// Depth of rows with houses on one side and on both, and of the castle's, in metres.
const SINGLE: f32 = 15.5;
const DOUBLE: f32 = 29.0;
const CASTLE: f32 = 27.0;

/// What a piece of a row is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Usage {
    Houses,
    Alley,
    Market,
    Guildhall,
    /// A small square with trees.
    Green,
    Church,
    Castle,
}

/// A part of a row from one alley to the next, straight in front and behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Where it begins and ends: u.
    pub(crate) from: f32,
    pub(crate) to: f32,
    pub(crate) usage: Usage,
}

/// A line across the terrain: how high it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    pub(crate) v: f32,
    /// Height in the middle, in metres.
    pub(crate) height: f32,
    /// Half width of what is nearly level; beyond, the ground falls to the border.
    pub(crate) half: f32,
}

/// Blocks side by side along a street.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) front: Level,
    pub(crate) back: Level,
    pub(crate) half: f32,
    /// Whether houses look onto the street behind, too.
    pub(crate) is_double: bool,
    pub(crate) pieces: Vec<Piece>,
}

/// Where everything is to stand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plan {
    pub(crate) rows: Vec<Row>,
    /// Of the first row, the widest.
    half: f32,
    /// v of the border behind.
    pub(crate) end: f32,
    /// How far hill streets bend backwards at their ends, in metres.
    bow: f32,
    phases: [f32; 4],
}

/// Lays out a town that is `size` times as wide and as deep as the smallest.
pub(crate) fn plan(seed: u32, size: f32) -> Plan {
    let mut dice = Dice::new(seed, 1);
    let depth = 92.0 * size;
    let double_hill = size >= 2.0;
    let flat_rows = (0.3 * depth / (DOUBLE + STREET)).round().max(1.0) as usize;
    let hill_pitch = STREET + if double_hill { DOUBLE } else { SINGLE };
    let flat_depth = flat_rows as f32 * (DOUBLE + STREET);
    let hill_rows = ((depth - flat_depth) / hill_pitch).round().max(2.0) as usize;
    let actual = flat_depth + hill_rows as f32 * hill_pitch;
    let half = 62.0 * size * depth / actual;
    let top = 29.0 * size.powf(0.6);

    let mut rows = Vec::new();
    let mut v = PROMENADE[1];
    for i in 0..=flat_rows + hill_rows {
        let is_castle = i == flat_rows + hill_rows;
        let hill = |i: usize| i.saturating_sub(flat_rows) as f32 / hill_rows as f32;
        let half_at = |i: usize| half * (1.0 - 0.42 * hill(i).powf(1.2));
        let level = |v: f32, i: usize| Level {
            v,
            height: top * hill(i).powf(1.1),
            half: half_at(i),
        };
        let is_double = i < flat_rows || (double_hill && !is_castle);
        let deep = match (is_castle, is_double) {
            (true, _) => CASTLE,
            (_, true) => DOUBLE,
            _ => SINGLE,
        };
        let half = if is_castle { 30.0 } else { half_at(i) };
        let mut back = level(v + deep, (i + 1).min(flat_rows + hill_rows));
        let mut front = level(v, i);
        if is_castle {
            (front.half, back.half) = (half + 6.0, half);
            back.height += 1.0;
        } else if i + 1 == flat_rows + hill_rows {
            back.half = half_at(i + 1).max(36.0);
        }
        rows.push(Row {
            front,
            back,
            half,
            is_double,
            pieces: match i {
                _ if is_castle => vec![Piece {
                    from: -half,
                    to: half,
                    usage: Usage::Castle,
                }],
                0 => market_row(half, &mut dice),
                _ if i == flat_rows + hill_rows.div_ceil(3) - 1 => church_row(half, &mut dice),
                _ => row(-half, half, &mut dice),
            },
        });
        v += deep + STREET;
    }
    let end = v - STREET + 20.0 * size.powf(0.6);
    Plan {
        rows,
        half,
        end,
        bow: 7.0 * size.sqrt(),
        phases: [(); 4].map(|()| dice.between(0.0, TAU)),
    }
}

/// Blocks from `left` to `right` with alleys between them.
fn row(left: f32, right: f32, dice: &mut Dice) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut from = left;
    while right - from > 1.0 {
        let mut to = from + dice.between(24.0, 40.0);
        // No block at the end that is too short for two houses.
        if right - to < ALLEY + 16.0 {
            to = right;
        }
        let usage = match pieces.len() > 3 && to < right && dice.chance(0.05) {
            true => Usage::Green,
            false => Usage::Houses,
        };
        pieces.push(Piece { from, to, usage });
        from = to;
        if to < right {
            to += ALLEY;
            let usage = Usage::Alley;
            pieces.push(Piece { from, to, usage });
            from = to;
        }
    }
    pieces
}

/// The first row: the market square in its middle, the guildhall beside it.
fn market_row(half: f32, dice: &mut Dice) -> Vec<Piece> {
    let guild = 19.0;
    let square = 38.0;
    let left = -square / 2.0 - 5.0;
    let middle = [
        (ALLEY, Usage::Alley),
        (square, Usage::Market),
        (guild, Usage::Guildhall),
        (ALLEY, Usage::Alley),
    ];
    let mut pieces = row(-half, left - ALLEY, dice);
    let mut from = left - ALLEY;
    for (width, usage) in middle {
        let to = from + width;
        pieces.push(Piece { from, to, usage });
        from = to;
    }
    pieces.extend(row(from, half, dice));
    pieces
}

/// A row with a church in it.
fn church_row(half: f32, dice: &mut Dice) -> Vec<Piece> {
    let from = -0.42 * half;
    let to = from + 36.0;
    let mut pieces = row(-half, from - ALLEY, dice);
    for (from, to, usage) in [
        (from - ALLEY, from, Usage::Alley),
        (from, to, Usage::Church),
        (to, to + ALLEY, Usage::Alley),
    ] {
        pieces.push(Piece { from, to, usage });
    }
    pieces.extend(row(to + ALLEY, half, dice));
    pieces
}

impl Plan {
    /// Half the terrain's width at `v`.
    pub(crate) fn border(&self, v: f32) -> f32 {
        let t = (2.0 * v / self.end - 1.0).clamp(-1.0, 1.0);
        (1.1 * self.half + 12.0) * (0.9 + 0.1 * (1.0 - t * t).sqrt())
    }

    /// Where a point of the plan lies in the world, without its height: x and z.
    pub(crate) fn bend(&self, u: f32, v: f32) -> Vec2 {
        let [a, b, c, d] = self.phases;
        let wave = (u / 19.0 + v / 31.0 + a).sin() + 0.8 * (u / 37.0 - v / 17.0 + b).sin();
        let sway = 2.0 * (v / 27.0 + c).sin() + 0.8 * (u / 29.0 + v / 23.0 + d).sin();
        let bow = self.bow * smooth(0.1, 0.6, v / self.end) * (u / self.half).powi(2);
        Vec2::new(u + sway, -v - bow + 1.3 * wave)
    }

    /// Height of a level at `u`, where the terrain's border is `border` away.
    pub(crate) fn height(&self, level: &Level, u: f32) -> f32 {
        let across = u.abs() / level.half;
        let shoulder = 0.8;
        match across <= 1.0 {
            true => level.height * (1.0 - (1.0 - shoulder) * across * across),
            false => {
                let border = self.border(level.v);
                let t = ((u.abs() - level.half) / (border - level.half)).clamp(0.0, 1.0);
                let bumps = 0.12 * (u / 7.0 + level.v / 11.0).sin() * t * (1.0 - t);
                level.height * shoulder * (1.0 - smooth(0.0, 1.0, t) + bumps)
            }
        }
    }

    /// The point of the ground at `u` in a row: `share` is 0 at its front, 1 at its back.
    pub(crate) fn point(&self, row: &Row, u: f32, share: f32) -> Vec3 {
        let [v0, v1] = [row.front.v, row.back.v];
        let piece = row.pieces.iter().find(|p| (p.from..=p.to).contains(&u));
        let at = match piece {
            Some(piece) => {
                let t = (u - piece.from) / (piece.to - piece.from);
                let side = |v| self.bend(piece.from, v).lerp(self.bend(piece.to, v), t);
                side(v0).lerp(side(v1), share)
            }
            None => self.bend(u, v0).lerp(self.bend(u, v1), share),
        };
        let [y0, y1] = [&row.front, &row.back].map(|level| self.height(level, u));
        Vec3::new(at.x, y0 + (y1 - y0) * share, at.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// The pieces of every row follow each other without gaps from end to end, rows follow
        /// each other with a street's width between them, and the border is beyond all of it.
        #[test]
        fn pieces_tile_their_rows(seed: u32, size in 0.8..12.0f32) {
            let plan = plan(seed, size);
            for row in &plan.rows {
                let mut from = -row.half;
                for piece in &row.pieces {
                    prop_assert!((piece.from - from).abs() < 1e-3);
                    prop_assert!(piece.to - piece.from > 3.0, "{piece:?}");
                    from = piece.to;
                }
                prop_assert!((from - row.half).abs() < 1e-3, "{from} of {}", row.half);
                for v in [row.front.v, row.back.v] {
                    prop_assert!(plan.border(v) > row.half + 3.0);
                }
            }
            for pair in plan.rows.windows(2) {
                prop_assert!((pair[1].front.v - pair[0].back.v - STREET).abs() < 1e-3);
            }
        }
    }
}
