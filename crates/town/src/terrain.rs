//! The ground: strips of triangles between lines across the town, one line at each edge of a
//! street, so that paving ends exactly where the street does.

use crate::bank::bank;
use crate::dice::Dice;
use crate::plan::{Level, PROMENADE, Plan, Row, Usage};
use crate::shape::Shape;
use crate::skin::Skin;
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Longest edge along a line, in metres.
const STEP: f32 = 7.0;
/// Ground whose normal rises less is rock.
const STEEPEST_GRASS: f32 = 0.74;

/// The ground of a town.
#[derive(Clone, Debug, Default)]
pub(crate) struct Terrain {
    /// A mesh for each row with the street before it, and one for what lies behind.
    pub(crate) strips: Vec<Shape>,
    /// What closes the ground to all sides, down to the foot.
    pub(crate) bank: Shape,
    /// Triangles of meadow around the town.
    pub(crate) meadow: Vec<[Vec3; 3]>,
}

/// A line from border to border.
struct Line {
    points: Vec<Vec3>,
    /// Which points are the ends of what is built.
    ends: [usize; 2],
}

/// Triangles of all strips, before normals are known.
#[derive(Default)]
struct Builder {
    points: Vec<Vec3>,
    triangles: Vec<([u32; 3], Skin)>,
    /// Where strips begin among the triangles.
    starts: Vec<usize>,
    meadow: Vec<usize>,
    /// The points of each line.
    lines: Vec<Range<usize>>,
}

/// Builds the ground of a plan.
pub(crate) fn terrain(plan: &Plan, seed: u32) -> Terrain {
    let mut builder = Builder::default();
    let first = &plan.rows[0];
    let flat = |v: f32| Level { v, ..first.front };
    let border = builder.add_line(open_line(plan, &flat(0.0), first.half));
    let edge = builder.add_line(open_line(plan, &flat(PROMENADE[0]), first.half));
    builder.starts.push(0);
    builder.zip(&border, &edge, Skin::Grass);
    let mut last = edge;
    for row in &plan.rows {
        let lines = [0.0, 0.35, 0.65, 1.0].map(|share| row_line(plan, row, share));
        let lines = lines.map(|line| builder.add_line(line));
        builder.zip(&last, &lines[0], Skin::Setts);
        builder.starts.push(builder.triangles.len());
        let skins = cell_skins(plan, row);
        for (i, pair) in lines.windows(2).enumerate() {
            builder.grid(&pair[0], &pair[1], &skins[i]);
        }
        let [_, _, _, back] = lines;
        last = back;
    }
    let top = plan.rows[plan.rows.len() - 1].back;
    for (share, height) in [(0.22, 0.86), (0.5, 0.5), (0.78, 0.17), (1.0, 0.0)] {
        let level = Level {
            v: top.v + (plan.end - top.v) * share,
            height: top.height * height,
            half: top.half * (1.0 - 0.3 * share),
        };
        let line = builder.add_line(open_line(plan, &level, level.half));
        builder.zip(&last, &line, Skin::Grass);
        last = line;
    }
    builder.finish(seed)
}

/// A line outside of the rows.
fn open_line(plan: &Plan, level: &Level, half: f32) -> Line {
    let place = |u: f32| {
        let at = plan.bend(u, level.v);
        Vec3::new(at.x, plan.height(level, u), at.y)
    };
    line(plan, level.v, half, &[-half, half], place)
}

/// A line in a row, `share` of its depth behind its front.
fn row_line(plan: &Plan, row: &Row, share: f32) -> Line {
    let breaks: Vec<f32> = std::iter::once(-row.half)
        .chain(row.pieces.iter().map(|p| p.to))
        .collect();
    let v = row.front.v + (row.back.v - row.front.v) * share;
    line(plan, v, row.half, &breaks, |u| plan.point(row, u, share))
}

/// Points at breaks and in between, out to the border.
fn line(plan: &Plan, v: f32, half: f32, breaks: &[f32], place: impl Fn(f32) -> Vec3) -> Line {
    let border = plan.border(v);
    let margin = margin_steps(plan, half);
    let outside = |i: usize| half + (border - half) * i as f32 / margin as f32;
    let mut us: Vec<f32> = (1..=margin).rev().map(|i| -outside(i)).collect();
    let left = us.len();
    us.push(breaks[0]);
    for pair in breaks.windows(2) {
        let steps = steps(pair[1] - pair[0]);
        us.extend((1..=steps).map(|i| pair[0] + (pair[1] - pair[0]) * i as f32 / steps as f32));
    }
    let right = us.len() - 1;
    us.extend((1..=margin).map(outside));
    Line {
        points: us.into_iter().map(place).collect(),
        ends: [left, right],
    }
}

fn steps(length: f32) -> usize {
    (length / STEP).ceil().max(1.0) as usize
}

/// Steps between what is built and the border: the same on all lines of a row.
fn margin_steps(plan: &Plan, half: f32) -> usize {
    steps(plan.border(plan.end / 2.0) - half)
}

/// What covers each cell of a row, in the three strips from the front to the back.
fn cell_skins(plan: &Plan, row: &Row) -> [Vec<Skin>; 3] {
    let margin = margin_steps(plan, row.half);
    [0, 1, 2].map(|strip| {
        let mut skins = vec![Skin::Grass; margin];
        for piece in &row.pieces {
            let skin = match piece.usage {
                Usage::Houses if strip == 1 || (strip == 2 && !row.is_double) => Skin::Grass,
                Usage::Church | Usage::Green => Skin::Grass,
                Usage::Market | Usage::Guildhall => Skin::Flags,
                _ => Skin::Setts,
            };
            skins.resize(skins.len() + steps(piece.to - piece.from), skin);
        }
        skins.resize(skins.len() + margin, Skin::Grass);
        skins
    })
}

/// A line whose points are in the builder, from an index on.
struct Placed {
    first: u32,
    line: Line,
}

impl Builder {
    fn add_line(&mut self, line: Line) -> Placed {
        let first = self.points.len() as u32;
        self.points.extend(&line.points);
        self.lines.push(first as usize..self.points.len());
        Placed { first, line }
    }

    fn add(&mut self, corners: [u32; 3], skin: Skin) {
        self.triangles.push((corners, skin));
    }

    /// Cells between two lines with equally many points.
    fn grid(&mut self, near: &Placed, far: &Placed, skins: &[Skin]) {
        let count = near.line.points.len() - 1;
        assert_eq!(count, skins.len(), "a skin for each cell");
        for (i, &skin) in skins.iter().enumerate() {
            let i = i as u32;
            let [a, b] = [near.first + i, near.first + i + 1];
            let [d, c] = [far.first + i, far.first + i + 1];
            let is_outside = (i as usize) < near.line.ends[0] || i as usize >= near.line.ends[1];
            let from = self.triangles.len();
            self.add([a, b, c], skin);
            self.add([a, c, d], skin);
            if is_outside {
                self.meadow.extend(from..from + 2);
            }
        }
    }

    /// Triangles between two lines with any points: paved where both are built, else meadow.
    fn zip(&mut self, near: &Placed, far: &Placed, paving: Skin) {
        let last = |placed: &Placed| placed.line.points.len() - 1;
        let [n0, n1] = near.line.ends;
        let [f0, f1] = far.line.ends;
        for (section, [a, b, c, d]) in [
            [0, n0, 0, f0],
            [n0, n1, f0, f1],
            [n1, last(near), f1, last(far)],
        ]
        .into_iter()
        .enumerate()
        {
            let skin = if section == 1 { paving } else { Skin::Grass };
            let from = self.triangles.len();
            let (mut i, mut j) = (a, c);
            while i < b || j < d {
                let [p, q] = [near.first + i as u32, far.first + j as u32];
                // The line that lags behind goes on.
                let ahead = |line: &Line, i: usize| line.points[i].x;
                let near_first =
                    j == d || (i < b && ahead(&near.line, i + 1) <= ahead(&far.line, j + 1));
                match near_first {
                    true => self.add([p, p + 1, q], skin),
                    false => self.add([p, q + 1, q], skin),
                }
                match near_first {
                    true => i += 1,
                    false => j += 1,
                }
            }
            if skin == Skin::Grass {
                self.meadow.extend(from..self.triangles.len());
            }
        }
    }

    /// The sides, from all lines' ends.
    fn bank(&self) -> Shape {
        let [first, between @ .., last] = &self.lines[..] else {
            return Shape::default();
        };
        let left = between.iter().rev().map(|line| line.start);
        let right = between.iter().map(|line| line.end - 1);
        let back = last.clone().rev();
        let border = first.clone().chain(right).chain(back).chain(left);
        let border: Vec<Vec3> = border.map(|i| self.points[i]).collect();
        bank(&border, first.len())
    }

    /// Smooth normals, and shapes by strip.
    fn finish(self, seed: u32) -> Terrain {
        let mut normals = vec![Vec3::ZERO; self.points.len()];
        let flat = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.points[i as usize]);
            (b - a).cross(c - a)
        };
        for (t, _) in &self.triangles {
            for &i in t {
                normals[i as usize] += flat(t);
            }
        }
        let normals: Vec<Vec3> = normals
            .into_iter()
            .map(|n| n.normalize_or(Vec3::Y))
            .collect();
        let mut dice = Dice::new(seed, 5);
        let tints: Vec<Vec3> = (0..self.points.len())
            .map(|_| {
                Vec3::new(
                    dice.between(0.8, 1.0),
                    dice.between(0.9, 1.0),
                    dice.between(0.7, 0.9),
                )
            })
            .collect();
        let mut ends = self.starts[1..].to_vec();
        ends.push(self.triangles.len());
        let strips = self.starts.iter().zip(ends).map(|(&start, end)| {
            let mut shape = Shape::default();
            for (t, skin) in &self.triangles[start..end] {
                let rises = flat(t).normalize_or(Vec3::Y).y;
                let skin = match *skin {
                    Skin::Grass if rises < STEEPEST_GRASS => Skin::Rock,
                    skin => skin,
                };
                let first = shape.colors.len();
                let corners = t.map(|i| {
                    let (p, n) = (self.points[i as usize], normals[i as usize]);
                    let uv = match skin {
                        Skin::Rock => Vec2::new(p.x + p.z, -p.y),
                        _ => Vec2::new(p.x, p.z),
                    };
                    (p, n, uv / skin.metres())
                });
                shape.smooth(skin, corners.into_iter(), [[0, 1, 2]].into_iter());
                if skin == Skin::Grass {
                    for (color, &i) in shape.colors[first..].iter_mut().zip(t) {
                        *color = tints[i as usize].extend(1.0);
                    }
                }
            }
            shape
        });
        let strips = strips.collect();
        let meadow = self.meadow.iter().map(|&t| self.triangles[t].0);
        Terrain {
            strips,
            bank: self.bank(),
            meadow: meadow.map(|t| t.map(|i| self.points[i as usize])).collect(),
        }
    }
}
