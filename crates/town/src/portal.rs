//! The round-arched portal and the steps before it.

use crate::facade::{Cell, Facade, add_wall};
use crate::shape::{Shape, rectangle};
use crate::skin::Skin;
use glam::{Vec2, Vec3};

const HALF_WIDTH: f32 = 1.05;
/// Height of the arch's centre above the threshold.
const SPRING: f32 = 1.8;
/// The stone frame's width and how far it stands out of the wall.
const FRAME: [f32; 2] = [0.22, 0.1];
/// How far the door lies behind the wall.
const DEPTH: f32 = 0.6;
/// Straight pieces of the arch, even.
const SEGMENTS: usize = 8;

/// The outline of the opening, widened by `margin`: up the right side, over the arch, down the
/// left, from the middle of the threshold.
fn outline(margin: f32) -> Vec<Vec2> {
    let radius = HALF_WIDTH + margin;
    let arch = (0..=SEGMENTS).map(|i| {
        let angle = std::f32::consts::PI * i as f32 / SEGMENTS as f32;
        Vec2::new(0.0, SPRING) + radius * Vec2::from_angle(angle)
    });
    let [right, left] = [radius, -radius].map(|x| Vec2::new(x, 0.0));
    std::iter::once(right).chain(arch).chain([left]).collect()
}

/// Adds the wall of a cell around the portal, whose threshold is `above` the cell's lower edge.
pub(crate) fn add_wall_around_portal(
    shape: &mut Shape,
    facade: &Facade,
    skin: Skin,
    cell: Cell,
    above: f32,
) {
    let threshold = cell.opening(Vec2::ZERO, above).min;
    let inner: Vec<Vec2> = outline(0.0).iter().map(|&p| p + threshold).collect();
    let (top, last) = (inner.len() / 2, inner.len() - 1);
    let [_, low_right, high_right, high_left] = cell.corners();
    let mut add = |polygon: &[Vec2]| add_wall(shape, facade, skin, cell, polygon);
    // Down to the cell's lower edge, which the steps hide.
    let [foot_right, foot_left] = [inner[0], inner[last]].map(|p| p.with_y(cell.min.y));
    add(&[foot_right, low_right, high_right, inner[1]]);
    add(&[cell.min, foot_left, inner[last - 1], high_left]);
    for i in 1..last - 1 {
        let corner = if i < top { high_right } else { high_left };
        add(&[inner[i], corner, inner[i + 1]]);
    }
    add(&[inner[top], high_right, high_left]);
}

/// Stone frame, reveal, door leaves, transom and fanlight, around the middle of the threshold.
pub(crate) fn portal() -> Shape {
    let mut shape = Shape::default();
    let at = |p: Vec2, out: f32| p.extend(out);
    let (inner, outer) = (outline(0.0), outline(FRAME[0]));
    for i in 0..inner.len() - 1 {
        let [a, b, c, d] = [inner[i], outer[i], outer[i + 1], inner[i + 1]];
        let front = [a, b, c, d].map(|p| at(p, FRAME[1]));
        shape.face(Skin::Trim, &front);
        shape.face(
            Skin::Trim,
            &[at(b, -0.05), at(c, -0.05), front[2], front[1]],
        );
        shape.face(
            Skin::Trim,
            &[front[0], front[3], at(d, -DEPTH), at(a, -DEPTH)],
        );
    }

    // The leaves, and the fanlight over them fitted into a square and its upper half.
    let [w, h] = [HALF_WIDTH, SPRING];
    let leaves = [[-w, 0.0], [w, 0.0], [w, h], [-w, h]];
    shape.picture(Skin::Door, leaves.map(|p| at(Vec2::from(p), -DEPTH)));
    let arch = &inner[1..inner.len() - 1];
    let corners: Vec<Vec3> = arch.iter().map(|&p| at(p, -DEPTH)).collect();
    let uvs: Vec<Vec2> = arch
        .iter()
        .map(|p| Vec2::new(0.5 + p.x / (2.0 * w), 1.0 - (p.y - h) / w))
        .collect();
    shape.fitted(Skin::Fanlight, &corners, &uvs);
    // A beam with its ends in the reveals.
    let (min, max) = (
        Vec3::new(-w - 0.02, h - 0.07, -DEPTH - 0.02),
        Vec3::new(w + 0.02, h + 0.07, -DEPTH + 0.1),
    );
    shape.cuboid(Skin::Frame, min, max);
    shape
}

/// Steps to three sides, the lowest in front.
///
/// * `count` - steps, the uppermost of which is the landing that reaches into the portal
/// * `rise`, `tread` - height and depth of each, in metres
/// * `front` - z of the lowest, in metres
pub(crate) fn steps(count: u32, rise: f32, tread: f32, front: f32) -> Shape {
    let mut shape = Shape::default();
    for i in 0..count {
        let half_width = 1.7 + tread * (count - 1 - i) as f32;
        let back = front - 3.5;
        let (top, front) = (rise * (i + 1) as f32, front - tread * i as f32);
        let [a, b, c, d] = rectangle(
            Vec3::new(-half_width, 0.0, back),
            Vec3::new(half_width, 0.0, front),
        );
        let up = |p: Vec3| p.with_y(top);
        // The back is in the plinth.
        for [p, q] in [[d, a], [a, b], [b, c]] {
            shape.face(Skin::Granite, &[p, q, up(q), up(p)]);
        }
        shape.face(Skin::Granite, &[a, b, c, d].map(up));
    }
    shape
}
