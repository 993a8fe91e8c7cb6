//! The ridge turret, and the clock in the gable.

use crate::shape::{Shape, rectangle};
use crate::skin::Skin;
use glam::{Vec2, Vec3};

/// A square turret around the y axis from `foot` up to the tip of its flared spire, in metres.
pub(crate) fn turret(foot: f32, tip: f32) -> Shape {
    let mut shape = Shape::default();
    let (half, eaves) = (1.0, tip - 1.5);
    let square =
        |half: f32, y: f32| rectangle(Vec3::new(-half, y, -half), Vec3::new(half, y, half));
    let (bottom, top) = (square(half, foot), square(half, eaves));
    let spire = [
        square(half + 0.35, eaves - 0.08),
        square(half - 0.45, eaves + 0.5),
    ];
    for i in 0..4 {
        let j = (i + 1) % 4;
        shape.picture(Skin::Louvre, [bottom[i], bottom[j], top[j], top[i]]);
        let [low, high] = spire;
        shape.face(Skin::Copper, &[low[i], low[j], high[j], high[i]]);
        shape.face(Skin::Copper, &[high[i], high[j], Vec3::Y * tip]);
    }
    let [a, b, c, d] = spire[0];
    shape.face(Skin::Beam, &[d, c, b, a]);
    shape
}

/// A round dial that stands out of a wall, in wall coordinates around its centre.
pub(crate) fn clock(radius: f32) -> Shape {
    const SIDES: usize = 16;
    let mut shape = Shape::default();
    let rim: [Vec2; SIDES] =
        std::array::from_fn(|i| Vec2::from_angle(std::f32::consts::TAU * i as f32 / SIDES as f32));
    let thickness = 0.16;
    let back = rim.map(|p| (p * radius).extend(-0.04));
    shape.tube(&back, Vec3::Z * thickness, &[Skin::Gold; SIDES]);
    let front = back.map(|p| p + Vec3::Z * thickness);
    let uvs = rim.map(|p| Vec2::new(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y));
    shape.fitted(Skin::Clock, &front, &uvs);
    shape
}
