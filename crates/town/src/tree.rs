//! Trees: a trunk, boughs and twigs as tapered tubes, and thousands of cards with clusters of
//! leaves around the twigs' ends.

use crate::dice::Dice;
use crate::palette;
use crate::shape::Shape;
use crate::skin::Skin;
use glam::{Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Species {
    Lime,
    Birch,
    Cypress,
    /// A small round tree of gardens.
    Apple,
}

/// How a species grows, in metres.
struct Habit {
    height: f32,
    /// Height of the crown's lower end.
    crown: f32,
    /// Greatest radius of the crown, and where it is: 0 at its lower end, 1 at its top.
    spread: f32,
    widest: f32,
    boughs: usize,
    twigs: usize,
    /// Cards a twig, their side, and how far around the twig's end they lie.
    cards: usize,
    card: f32,
    tuft: f32,
    leaves: Skin,
    bark: u32,
    tint: u32,
}

impl Species {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Lime => "lime tree",
            Self::Birch => "birch",
            Self::Cypress => "cypress",
            Self::Apple => "apple tree",
        }
    }

    fn habit(self) -> Habit {
        match self {
            Self::Lime => Habit {
                height: 10.5,
                crown: 2.6,
                spread: 3.9,
                widest: 0.38,
                boughs: 10,
                twigs: 64,
                cards: 22,
                card: 0.62,
                tuft: 0.95,
                leaves: Skin::LimeLeaves,
                bark: 0xd8cdbd,
                tint: 0xffffff,
            },
            Self::Birch => Habit {
                height: 11.5,
                crown: 2.4,
                spread: 2.6,
                widest: 0.35,
                boughs: 11,
                twigs: 60,
                cards: 19,
                card: 0.56,
                tuft: 0.8,
                leaves: Skin::BirchLeaves,
                bark: 0xffffff,
                tint: 0xffffff,
            },
            Self::Cypress => Habit {
                height: 11.0,
                crown: 0.7,
                spread: 1.25,
                widest: 0.3,
                boughs: 12,
                twigs: 60,
                cards: 20,
                card: 0.5,
                tuft: 0.6,
                leaves: Skin::CypressLeaves,
                bark: 0xb8a38e,
                tint: 0xffffff,
            },
            Self::Apple => Habit {
                height: 5.4,
                crown: 1.4,
                spread: 2.3,
                widest: 0.42,
                boughs: 8,
                twigs: 44,
                cards: 24,
                card: 0.46,
                tuft: 0.62,
                leaves: Skin::LimeLeaves,
                bark: 0xc4b4a2,
                tint: 0xf0e6b8,
            },
        }
    }
}

impl Habit {
    /// Radius of the crown at a height.
    fn radius(&self, height: f32) -> f32 {
        let t = ((height - self.crown) / (self.height - self.crown)).clamp(0.0, 1.0);
        let from_widest = match t < self.widest {
            true => (self.widest - t) / self.widest,
            false => (t - self.widest) / (1.0 - self.widest),
        };
        self.spread * (1.0 - from_widest * from_widest).max(0.0).sqrt()
    }

    /// The crown's middle axis, where its lumps begin.
    fn middle(&self) -> Vec3 {
        Vec3::Y * (self.crown + (self.height - self.crown) * self.widest)
    }
}

/// A tree around the y axis, its roots a little under the ground.
pub(crate) fn tree(species: Species, dice: &mut Dice) -> Shape {
    let habit = species.habit();
    let mut shape = Shape {
        tint: palette::tint(habit.bark),
        ..Shape::default()
    };
    let trunk = trunk(&habit, dice);
    let girth = 0.028 * habit.height;
    add_limb(&mut shape, &trunk, [girth, 0.03], 7);

    let boughs: Vec<Vec<Vec3>> = (0..habit.boughs)
        .map(|i| bough(&habit, &trunk, i, dice))
        .collect();
    for bough in &boughs {
        let thick = girth * (0.5 - 0.3 * bough[0].y / habit.height);
        add_limb(&mut shape, bough, [thick, 0.02], 5);
    }
    let tips: Vec<Vec3> = (0..habit.twigs).map(|i| tip(&habit, i, dice)).collect();
    for &tip in &tips {
        let from = nearest_below(&boughs, &trunk, tip);
        let sag = (from + tip) / 2.0 + Vec3::Y * 0.12 * from.distance(tip);
        add_limb(&mut shape, &[from, sag, tip], [0.035, 0.0], 3);
    }
    for &tip in &tips {
        add_tuft(&mut shape, &habit, tip, dice);
    }
    shape
}

/// A slightly crooked line from the roots to near the top.
fn trunk(habit: &Habit, dice: &mut Dice) -> Vec<Vec3> {
    let top = habit.height * 0.9;
    let bend = 0.035 * habit.height.min(3.0 * habit.spread);
    let mut points = vec![Vec3::new(0.0, -0.4, 0.0), Vec3::new(0.0, 0.35, 0.0)];
    for i in 1..=6 {
        let sideways = Vec3::new(dice.between(-1.0, 1.0), 0.0, dice.between(-1.0, 1.0));
        let up = 0.35 + (top - 0.35) * i as f32 / 6.0;
        points.push(sideways * bend + Vec3::Y * up);
    }
    points
}

/// A bough from the trunk out into the crown, rising.
fn bough(habit: &Habit, trunk: &[Vec3], i: usize, dice: &mut Dice) -> Vec<Vec3> {
    let share = (i as f32 + 0.3 * dice.roll()) / habit.boughs as f32;
    let span = habit.height - habit.crown;
    let from = along(trunk, 0.8 * habit.crown + 0.68 * span * share);
    let angle = 2.4 * i as f32 + dice.between(-0.3, 0.3);
    let outward = Vec3::new(angle.cos(), 0.0, angle.sin());
    let end_height = (from.y + 0.22 * span).min(habit.height * 0.93);
    let reach = 0.72 * habit.radius(end_height).max(0.3);
    let end = outward * reach + Vec3::Y * end_height;
    let knee = from.lerp(end, 0.5) - Vec3::Y * 0.06 * span
        + Vec3::new(dice.between(-0.2, 0.2), 0.0, dice.between(-0.2, 0.2));
    vec![from, knee, end]
}

/// The point of a line of points at a height.
fn along(line: &[Vec3], height: f32) -> Vec3 {
    for pair in line.windows(2) {
        if height <= pair[1].y {
            let t = ((height - pair[0].y) / (pair[1].y - pair[0].y)).clamp(0.0, 1.0);
            return pair[0].lerp(pair[1], t);
        }
    }
    line[line.len() - 1]
}

/// Where a twig ends: evenly spread over the crown, near its surface.
fn tip(habit: &Habit, i: usize, dice: &mut Dice) -> Vec3 {
    let share = (i as f32 + dice.roll()) / habit.twigs as f32;
    // More where the crown is wide.
    let up = 0.5 - 0.5 * (1.0 - 2.0 * share) * (1.35 - 0.35 * (1.0 - 2.0 * share).powi(2));
    let height = habit.crown + (habit.height - habit.crown) * up;
    let height = height.clamp(habit.crown + 0.2, habit.height - 0.3);
    let angle = 2.4 * i as f32 + dice.between(-0.25, 0.25);
    let inside = dice.between(0.62, 0.92) + 0.12 * (2.0 * angle).sin();
    let radius = (habit.radius(height) - 0.6 * habit.tuft).max(0.1) * inside;
    Vec3::new(angle.cos() * radius, height, angle.sin() * radius)
}

/// The point of the boughs or the trunk from which a twig would grow.
fn nearest_below(boughs: &[Vec<Vec3>], trunk: &[Vec3], tip: Vec3) -> Vec3 {
    let on_trunk = along(trunk, tip.y - 0.6 * Vec2::new(tip.x, tip.z).length());
    let on_boughs = boughs.iter().flat_map(|bough| {
        let steps = [[0, 1, 2], [1, 1, 2], [1, 2, 1], [1, 2, 2]];
        steps.map(|[a, b, _]| bough[a].lerp(bough[b], 0.7))
    });
    on_boughs.fold(on_trunk, |best, point| {
        // Downwards is the wrong way to grow.
        let cost = |p: Vec3| p.distance(tip) + 2.0 * (p.y - tip.y).max(0.0);
        match cost(point) < cost(best) {
            true => point,
            false => best,
        }
    })
}

/// Adds a closed tapered tube with smooth normals.
fn add_limb(shape: &mut Shape, line: &[Vec3], [thick, thin]: [f32; 2], sides: u32) {
    let n = line.len();
    let mut points = Vec::new();
    let mut side = Vec3::X;
    for (i, &center) in line.iter().enumerate() {
        let ahead = (line[(i + 1).min(n - 1)] - line[i.saturating_sub(1)]).normalize();
        side = (side - ahead * side.dot(ahead))
            .try_normalize()
            .unwrap_or_else(|| ahead.any_orthonormal_vector());
        let other = ahead.cross(side);
        let t = i as f32 / (n - 1) as f32;
        // Roots flare.
        let flare = if i == 0 && n > 4 { 1.4 } else { 1.0 };
        let radius = (thick + (thin - thick) * t) * flare;
        for k in 0..=sides {
            // The last point is the first again, to the last bit.
            let angle = TAU * (k % sides) as f32 / sides as f32;
            let out = side * angle.cos() + other * angle.sin();
            let uv = Vec2::new(k as f32 / sides as f32, -center.y);
            points.push((center + out * radius, out, uv));
        }
    }
    let ring = sides + 1;
    let quads = (0..n as u32 - 1).flat_map(|i| (0..sides).map(move |k| i * ring + k));
    let is_pointed = thin == 0.0;
    let triangles = quads.flat_map(|q| {
        let last = q / ring == n as u32 - 2;
        let lower = [q, q + 1, q + ring];
        let upper = [q + 1, q + 1 + ring, q + ring];
        match last && is_pointed {
            true => vec![lower],
            false => vec![lower, upper],
        }
    });
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let ring_at = |i: usize| {
        let first = i * ring as usize;
        points[first..first + sides as usize]
            .iter()
            .map(|p: &(Vec3, Vec3, Vec2)| p.0)
    };
    let foot: Vec<Vec3> = ring_at(0).rev().collect();
    let head: Vec<Vec3> = ring_at(n - 1).collect();
    shape.smooth(Skin::Bark, points.into_iter(), triangles.into_iter());
    shape.face(Skin::Bark, &foot);
    if !is_pointed {
        shape.face(Skin::Bark, &head);
    }
}

/// Adds cards with leaves around the end of a twig.
///
/// Normals point out of the crown, so that light and shade model it as a whole; cards face
/// outwards too, and are darker inside.
fn add_tuft(shape: &mut Shape, habit: &Habit, tip: Vec3, dice: &mut Dice) {
    let hue = dice.between(0.85, 1.1);
    for _ in 0..habit.cards {
        let spin = Quat::from_rotation_y(dice.between(0.0, TAU));
        let height = dice.between(-0.8, 1.0);
        let out = spin * Vec3::new((1.0 - height * height).max(0.0).sqrt(), height, 0.0);
        let center = tip + out * habit.tuft * dice.roll().powf(0.4) * Vec3::new(1.0, 0.75, 1.0);

        let from_axis = center - habit.middle().with_y(center.y.min(habit.middle().y));
        let outward = (from_axis.normalize_or(Vec3::Y) + 0.6 * out).normalize_or(Vec3::Y);
        let tilt = Vec3::new(
            dice.between(-1.0, 1.0),
            dice.between(-0.6, 1.0),
            dice.between(-1.0, 1.0),
        );
        let facing = (outward + 0.75 * tilt).normalize_or(outward);
        let facing = match facing.dot(outward) > 0.1 {
            true => facing,
            false => outward,
        };
        let right = facing.any_orthonormal_vector();
        let turn = Quat::from_axis_angle(facing, dice.between(0.0, TAU));
        let half = habit.card / 2.0 * dice.between(0.8, 1.25);
        let right = turn * right * half;
        let up = facing.cross(right);

        let rim = habit.radius(center.y).max(0.3);
        let depth = (Vec2::new(center.x, center.z).length() / rim).clamp(0.0, 1.1);
        let shade = (0.45 + 0.55 * depth.powi(2)).min(1.0) * (0.86 + 0.14 * (out.y * 0.5 + 0.5));
        let tone = palette::tint(habit.tint) * shade * dice.between(0.88, 1.0);
        shape.tint = (tone * Vec3::new(hue, 1.0, 0.9)).min(Vec3::ONE);
        let corners = [-right - up, right - up, right + up, up - right];
        let uvs = [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO];
        let points = corners
            .into_iter()
            .zip(uvs)
            .map(|(corner, uv)| (center + corner, outward, uv));
        shape.smooth(habit.leaves, points, [[0, 1, 2], [0, 2, 3]].into_iter());
    }
}
