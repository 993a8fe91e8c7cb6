//! What stands where: parts placed on a plan.

use crate::building::FOUNDATION;
use crate::dice::Dice;
use crate::names;
use crate::part::{
    CASTLE_SIDE, CASTLE_WALL, DESIGNS, HEDGE, Part, TREES, VARIANTS, WIDTHS, foundation_of,
    house_depth,
};
use crate::plan::{PROMENADE, Piece, Plan, Row, Usage};
use crate::tree::Species;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::TAU;

/// A part at its place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placement {
    pub(crate) name: String,
    pub(crate) part: Part,
    pub(crate) world_from_part: DAffine3,
}

/// All that stands in a town.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub(crate) placements: Vec<Placement>,
    /// Where the guildhall stands.
    pub(crate) guildhall: DAffine3,
    /// Corners of the ground that each house covers: x and z.
    pub(crate) footprints: Vec<[Vec2; 4]>,
    counts: BTreeMap<&'static str, usize>,
}

/// A spot on the ground with a direction to look to.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: Vec3,
    /// To the right seen from the front, level, of length 1.
    right: Vec3,
}

impl Spot {
    /// Away from the front's other side: where a house's door leads.
    fn out(&self) -> Vec3 {
        self.right.cross(Vec3::Y)
    }

    /// The spot some metres to the right and to the front, at the same height.
    fn moved(&self, right: f32, out: f32) -> Self {
        Self {
            at: self.at + self.right * right + self.out() * out,
            ..*self
        }
    }

    fn turned(&self, angle: f32) -> Self {
        let right = self.right * angle.cos() - self.out() * angle.sin();
        Self { right, ..*self }
    }

    fn affine(&self, scale: f32) -> DAffine3 {
        let right = self.right.as_dvec3().normalize();
        let axes = DMat3::from_cols(right, DVec3::Y, right.cross(DVec3::Y));
        DAffine3::from_mat3_translation(axes * f64::from(scale), self.at.as_dvec3())
    }
}

/// Places everything but the trees of the meadows.
pub(crate) fn settle(plan: &Plan, seed: u32) -> Places {
    let mut dice = Dice::new(seed, 2);
    let mut places = Places {
        placements: Vec::new(),
        guildhall: DAffine3::IDENTITY,
        footprints: Vec::new(),
        counts: BTreeMap::new(),
    };
    places.add_promenade(plan, &mut dice);
    for (i, row) in plan.rows.iter().enumerate() {
        let streets = [0, 1].map(|next| names::street(seed, i + next));
        let mut numbers = [1, 2];
        for piece in &row.pieces {
            match piece.usage {
                Usage::Houses => {
                    let front = edge(plan, row, piece, 0.0);
                    places.add_houses(&front, [&streets[0], "odd"], &mut numbers[0], &mut dice);
                    if row.is_double {
                        let back = edge(plan, row, piece, 1.0);
                        places.add_houses(&back, [&streets[1], "even"], &mut numbers[1], &mut dice);
                    }
                    places.add_yard(plan, row, piece, &mut dice);
                }
                Usage::Alley => {}
                Usage::Market => places.add_market(plan, row, piece, &mut dice),
                Usage::Guildhall => {
                    let spot = spot(plan, row, (piece.from + piece.to) / 2.0, 0.5);
                    places.guildhall = spot.affine(0.7);
                    places
                        .footprints
                        .push(footprint(&spot.moved(0.0, 14.0), 14.0, 28.0));
                }
                Usage::Green => places.add_green(plan, row, piece, &mut dice),
                Usage::Church => places.add_church(plan, row, piece),
                Usage::Castle => places.add_castle(plan, row, piece),
            }
        }
        places.add_street_furniture(plan, row, &mut dice);
    }
    places
}

/// The ground at a place of a row, looking to its front.
fn spot(plan: &Plan, row: &Row, u: f32, share: f32) -> Spot {
    let at = plan.point(row, u, share);
    let piece = row.pieces.iter().find(|p| (p.from..=p.to).contains(&u));
    let right = match piece {
        Some(p) => plan.point(row, p.to, share) - plan.point(row, p.from, share),
        None => Vec3::X,
    };
    let right = right.with_y(0.0).normalize();
    Spot { at, right }
}

/// A straight side of a block, from left to right seen from the street.
struct Edge {
    /// Points a metre apart, and the end: heights are between them.
    points: Vec<Vec3>,
    right: Vec3,
    length: f32,
}

fn edge(plan: &Plan, row: &Row, piece: &Piece, share: f32) -> Edge {
    let (from, to) = match share < 0.5 {
        true => (piece.from, piece.to),
        false => (piece.to, piece.from),
    };
    let along = plan.point(row, to, share) - plan.point(row, from, share);
    let along = along.with_y(0.0);
    let length = along.length();
    let count = length.ceil() as usize;
    let point = |i: usize| {
        let t = (i as f32 / length).min(1.0);
        plan.point(row, from + (to - from) * t, share)
    };
    Edge {
        points: (0..=count).map(point).collect(),
        right: along / length,
        length,
    }
}

impl Edge {
    fn spot(&self, along: f32) -> Spot {
        let from = self.points[0];
        let near = self.points[(along.round() as usize).min(self.points.len() - 1)];
        let at = from + self.right * along;
        Spot {
            at: at.with_y(near.y),
            right: self.right,
        }
    }
}

/// Corners of a rectangle behind a spot.
fn footprint(front: &Spot, width: f32, depth: f32) -> [Vec2; 4] {
    [(-0.5, 0.0), (0.5, 0.0), (0.5, -1.0), (-0.5, -1.0)].map(|(x, z)| {
        let at = front.moved(x * width, z * depth).at;
        Vec2::new(at.x, at.z)
    })
}

/// Widths in half metres that fill a length but for less than a metre.
fn widths(length: f32, dice: &mut Dice) -> Vec<u8> {
    let (least, most) = (u32::from(*WIDTHS.start()), u32::from(*WIDTHS.end()));
    let mut left = (2.0 * length + 1e-3) as u32;
    let mut widths = Vec::new();
    while left >= least {
        // What remains must be nothing or wide enough for a house.
        let fits = |w: &u32| left == *w || left >= w + least;
        let fitting: Vec<u32> = (least..=most).filter(fits).collect();
        let width = match fitting.is_empty() {
            true => left.min(most),
            false => dice.pick(&fitting),
        };
        widths.push(width as u8);
        left -= width;
    }
    widths
}

impl Places {
    fn add(&mut self, what: &'static str, part: Part, world_from_part: DAffine3) {
        let number = self.count(what);
        self.placements.push(Placement {
            name: format!("{what} {number}"),
            part,
            world_from_part,
        });
    }

    /// How many there are of something, this one included.
    fn count(&mut self, what: &'static str) -> usize {
        let count = self.counts.entry(what).or_default();
        *count += 1;
        *count
    }

    /// A row of houses along an edge, wall to wall.
    fn add_houses(
        &mut self,
        edge: &Edge,
        [street, _]: [&str; 2],
        number: &mut usize,
        dice: &mut Dice,
    ) {
        let widths = widths(edge.length, dice);
        let count = widths.len();
        let mut from = 0.0;
        let mut previous = DESIGNS;
        for (i, width) in widths.into_iter().enumerate() {
            let metres = f32::from(width) / 2.0;
            let is_end = i == 0 || i + 1 == count;
            let mut design = dice.below(usize::from(DESIGNS)) as u8;
            if design == previous {
                design = (design + 1) % DESIGNS;
            }
            previous = design;
            let part = Part::House {
                width,
                corner: is_end,
                design,
            };
            let setback = dice.between(0.02, 0.4);
            let front = edge.spot(from + metres / 2.0).moved(0.0, -setback);
            let mut place = front.affine(1.0);
            if is_end && i > 0 {
                // The free side is the right one: mirrored.
                place *= DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
            }
            let house = self.count("house");
            self.placements.push(Placement {
                name: format!("house {house}, {number} {street}"),
                part,
                world_from_part: place,
            });
            *number += 2;
            // The ground is nowhere below 0, so that those further down need no more.
            if front.at.y > FOUNDATION {
                let below = foundation_of(part);
                self.add("foundation", below, front.affine(1.0));
            }
            self.footprints
                .push(footprint(&front, metres, house_depth(part)));
            if dice.chance(0.3) {
                let variant = dice.below(usize::from(VARIANTS)) as u8;
                let beside = edge.spot(from).moved(0.0, 1.05);
                self.add("flower tub", Part::Tub { variant }, beside.affine(1.0));
            }
            if dice.chance(0.12) {
                let beside = edge.spot(from + metres - 0.1).moved(0.0, 1.1);
                self.add("barrel", Part::Barrel, beside.affine(1.0));
            }
            from += metres;
        }
    }

    fn add_tree(&mut self, species: Species, at: Vec3, dice: &mut Dice) -> Part {
        let variant = dice.below(usize::from(TREES)) as u8;
        let tree = Part::Tree { species, variant };
        let spot = Spot { at, right: Vec3::X };
        let turned = spot.turned(dice.between(0.0, TAU));
        let scale = dice.between(0.85, 1.12);
        self.add(species.name(), tree, turned.affine(scale));
        tree
    }

    /// Adds a tree of a kind that grows on meadows or on cliffs, and returns it.
    pub(crate) fn add_meadow_tree(&mut self, at: Vec3, is_steep: bool, dice: &mut Dice) -> Part {
        let species = match is_steep {
            true => dice.pick(&[Species::Cypress, Species::Birch, Species::Birch]),
            false => dice.pick(&[
                Species::Lime,
                Species::Birch,
                Species::Apple,
                Species::Cypress,
            ]),
        };
        self.add_tree(species, at, dice)
    }

    /// Trees behind the houses.
    fn add_yard(&mut self, plan: &Plan, row: &Row, piece: &Piece, dice: &mut Dice) {
        let (share, pitch, species) = match row.is_double {
            true => (0.5, 13.0, Species::Apple),
            false => (0.85, 24.0, Species::Cypress),
        };
        let count = ((piece.to - piece.from) / pitch) as usize;
        for i in 0..count {
            let t = (i as f32 + dice.between(0.3, 0.7)) / count as f32;
            let at = plan.point(row, piece.from + (piece.to - piece.from) * t, share);
            self.add_tree(species, at, dice);
        }
    }

    /// Limes with benches between them and lanterns before the first row.
    fn add_promenade(&mut self, plan: &Plan, dice: &mut Dice) {
        let row = &plan.rows[0];
        let view = row.pieces.iter().find(|p| p.usage == Usage::Market);
        let (left, right) = view.map_or((0.0, 0.0), |p| (p.from - 2.0, p.to + 16.0));
        let [near, far] = PROMENADE;
        let v = near + 0.35 * (far - near);
        let count = (2.0 * row.half / 12.5) as usize;
        let at = |u: f32| {
            let at = plan.bend(u, v);
            Vec3::new(at.x, 0.0, at.y)
        };
        for i in 0..count {
            let u = row.half * (2.0 * (i as f32 + 0.5) / count as f32 - 1.0);
            if u < left || u > right {
                self.add_tree(Species::Lime, at(u), dice);
                let bench = Spot {
                    at: at(u + 4.0),
                    right: Vec3::X,
                };
                self.add("bench", Part::Bench, bench.affine(1.0));
            }
            let lantern = Spot {
                at: at(u - 5.5),
                right: Vec3::X,
            };
            self.add("lantern", Part::Lantern, lantern.affine(1.0));
        }
    }

    /// Fountain, stalls, benches and two trees.
    fn add_market(&mut self, plan: &Plan, row: &Row, piece: &Piece, dice: &mut Dice) {
        let width = piece.to - piece.from;
        let on = |x: f32, share: f32| spot(plan, row, piece.from + width * x, share);
        self.add("fountain", Part::Fountain, on(0.5, 0.5).affine(1.0));
        for (x, share) in [
            (0.14, 0.24),
            (0.3, 0.2),
            (0.12, 0.55),
            (0.26, 0.66),
            (0.7, 0.22),
            (0.86, 0.26),
            (0.72, 0.68),
            (0.88, 0.6),
        ] {
            let variant = dice.below(usize::from(VARIANTS)) as u8;
            let turned = on(x, share).turned(dice.between(-0.2, 0.2));
            self.add("market stall", Part::Stall { variant }, turned.affine(1.0));
        }
        for (x, share) in [(0.06, 0.86), (0.94, 0.86)] {
            self.add_tree(Species::Lime, on(x, share).at, dice);
        }
        for (x, angle) in [(-4.6, 1.57), (4.6, -1.57)] {
            let bench = on(0.5, 0.5).moved(x, 0.0).turned(angle);
            self.add("bench", Part::Bench, bench.affine(1.0));
        }
        for (x, share) in [(0.36, 0.08), (0.64, 0.08), (0.36, 0.9), (0.64, 0.9)] {
            self.add("lantern", Part::Lantern, on(x, share).affine(1.0));
        }
        for (x, share, angle) in [(0.4, 0.14, 0.7), (0.62, 0.78, -2.0)] {
            let cart = on(x, share).turned(angle);
            self.add("handcart", Part::Cart, cart.affine(1.0));
        }
        for x in [0.2, 0.215, 0.79] {
            self.add("barrel", Part::Barrel, on(x, 0.32).affine(1.0));
        }
    }

    /// A small square: a well, trees and benches behind hedges.
    fn add_green(&mut self, plan: &Plan, row: &Row, piece: &Piece, dice: &mut Dice) {
        let width = piece.to - piece.from;
        let on = |x: f32, share: f32| spot(plan, row, piece.from + width * x, share);
        self.add("well", Part::Well, on(0.5, 0.45).affine(1.0));
        for (x, share) in [(0.2, 0.5), (0.8, 0.5)] {
            self.add_tree(Species::Lime, on(x, share).at, dice);
        }
        for x in [0.36, 0.64] {
            self.add("bench", Part::Bench, on(x, 0.3).affine(1.0));
        }
        self.add_hedges(plan, row, piece, dice);
    }

    /// Hedges along the front of a piece, with an opening in the middle.
    fn add_hedges(&mut self, plan: &Plan, row: &Row, piece: &Piece, dice: &mut Dice) {
        let count = ((piece.to - piece.from) / (HEDGE - 0.02)) as usize;
        for i in 0..count {
            if 2 * i + 1 == count || 2 * i == count {
                continue;
            }
            let t = (i as f32 + 0.5) / count as f32;
            let u = piece.from + (piece.to - piece.from) * t;
            let variant = dice.below(usize::from(VARIANTS)) as u8;
            let hedge = spot(plan, row, u, 0.03);
            self.add("hedge", Part::Hedge { variant }, hedge.affine(1.0));
        }
    }

    fn add_church(&mut self, plan: &Plan, row: &Row, piece: &Piece) {
        let front = spot(plan, row, (piece.from + piece.to) / 2.0, 0.0).moved(0.0, -2.4);
        let left = -(piece.to - piece.from) / 2.0;
        let tower = front.moved(left + 4.5, -4.8);
        let nave = front.moved(left + 4.5 + 12.6, 0.0);
        self.add("church tower", Part::Tower, tower.affine(1.0));
        self.add("church nave", Part::Nave, nave.affine(1.0));
        self.footprints
            .push(footprint(&tower.moved(0.0, 2.9), 5.8, 5.8));
        self.footprints
            .push(footprint(&nave.moved(2.52, 0.0), 24.36, 9.6));
        let mut dice = Dice::new(4, 4);
        self.add_hedges(plan, row, piece, &mut dice);
    }

    fn add_castle(&mut self, plan: &Plan, row: &Row, piece: &Piece) {
        let front = spot(plan, row, (piece.from + piece.to) / 2.0, 0.0).moved(0.0, -2.0);
        let (half, deep) = (CASTLE_WALL / 2.0, CASTLE_SIDE + 1.0);
        let quarter = std::f32::consts::FRAC_PI_2;
        self.add("castle wall", Part::CastleWall, front.affine(1.0));
        let back = front.moved(0.0, -deep).turned(2.0 * quarter);
        self.add("castle wall", Part::CastleWall, back.affine(1.0));
        for side in [-1.0, 1.0] {
            let wall = front.moved(side * half, -deep / 2.0).turned(side * quarter);
            self.add("castle wall", Part::CastleSideWall, wall.affine(1.0));
            for (out, tall) in [(-0.6, side < 0.0), (0.6 - deep, false)] {
                let tower = front.moved(side * (half - 0.4), out);
                self.add("castle tower", Part::RoundTower { tall }, tower.affine(1.0));
            }
        }
        self.add(
            "castle keep",
            Part::Keep,
            front.moved(-9.5, -12.0).affine(1.0),
        );
        self.add(
            "castle palace",
            Part::Palace,
            front.moved(8.0, -9.5).affine(1.0),
        );
        self.footprints.push(footprint(&front, 2.0 * half, deep));
    }

    /// Lanterns along the street before a row, and benches and carts here and there.
    fn add_street_furniture(&mut self, plan: &Plan, row: &Row, dice: &mut Dice) {
        for piece in &row.pieces {
            if !matches!(piece.usage, Usage::Houses | Usage::Church | Usage::Green) {
                continue;
            }
            let edge = edge(plan, row, piece, 0.0);
            let count = (edge.length / 17.0).round().max(1.0) as usize;
            for i in 0..count {
                let along = edge.length * (i as f32 + 0.5) / count as f32;
                let spot = edge.spot(along).moved(0.0, 1.7);
                self.add("lantern", Part::Lantern, spot.affine(1.0));
            }
            if dice.chance(0.25) {
                let along = edge.length * dice.between(0.1, 0.3);
                let spot = edge.spot(along).moved(0.0, 2.6).turned(1.5);
                self.add("handcart", Part::Cart, spot.affine(1.0));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::plan;
    use proptest::prelude::*;

    /// How far two rectangles reach into each other: along the axis of either on which they do
    /// the least.
    fn overlap(a: &[Vec2; 4], b: &[Vec2; 4]) -> f32 {
        let axes = [a[1] - a[0], a[2] - a[1], b[1] - b[0], b[2] - b[1]];
        let along = |axis: Vec2| {
            let axis = axis.normalize();
            let span = |corners: &[Vec2; 4]| {
                let at = corners.map(|p| p.dot(axis));
                let far = [f32::INFINITY, f32::NEG_INFINITY];
                at.iter()
                    .fold(far, |[low, high], &t| [low.min(t), high.max(t)])
            };
            let ([a0, a1], [b0, b1]) = (span(a), span(b));
            a1.min(b1) - a0.max(b0)
        };
        axes.map(along).into_iter().fold(f32::INFINITY, f32::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        /// No building stands on another's ground.
        #[test]
        fn footprints_do_not_overlap(seed: u32, size in 0.6..4.0f32) {
            let places = settle(&plan(seed >> 8, size), seed >> 8);
            prop_assert!(places.footprints.len() > 10);
            for (i, a) in places.footprints.iter().enumerate() {
                for b in &places.footprints[..i] {
                    // Neighbours share a wall; a centimetre is far above rounding.
                    let overlap = overlap(a, b);
                    prop_assert!(overlap < 0.01, "{overlap} m of {a:?} and {b:?}");
                }
            }
        }

        /// Houses fill a street's side but for less than a metre: no house is 10.5 m wide, nor are two.
        #[test]
        fn houses_fill_their_street(seed: u32, length in 6.0..90.0f32) {
            let widths = widths(length, &mut Dice::new(seed >> 8, 1));
            let sum: f32 = widths.iter().map(|&w| f32::from(w) / 2.0).sum();
            prop_assert!(sum <= length + 1e-3 && sum > length - 1.0, "{sum} of {length}");
            prop_assert!(widths.iter().all(|w| WIDTHS.contains(w)));
        }
    }
}
