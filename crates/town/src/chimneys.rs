//! Chimneys.

use crate::shape::Shape;
use crate::skin::Skin;
use glam::Vec3;

/// A brick chimney around the y axis from 0 up to `height`, with a corbelled head and two pots.
pub(crate) fn chimney(height: f32) -> Shape {
    let mut shape = Shape::default();
    let block = |half_x: f32, half_z: f32, low: f32, high: f32| {
        (
            Vec3::new(-half_x, low, -half_z),
            Vec3::new(half_x, high, half_z),
        )
    };
    let head = height - 0.35;
    let (min, max) = block(0.5, 0.75, 0.0, head - 0.2);
    shape.shaft(Skin::Brick, min, max);
    let (min, max) = block(0.6, 0.85, head - 0.45, head);
    shape.cuboid(Skin::Brick, min, max);
    for z in [-0.36, 0.36] {
        let pot: [Vec3; 6] = std::array::from_fn(|i| {
            let angle = std::f32::consts::FRAC_PI_3 * (i as f32 + 0.5);
            // Counter-clockwise seen from above is from +x to -z.
            Vec3::new(0.22 * angle.cos(), head - 0.05, z - 0.22 * angle.sin())
        });
        let up = Vec3::Y * (height - head + 0.05);
        shape.tube(&pot, up, &[Skin::RidgeTiles; 6]);
        shape.face(Skin::RidgeTiles, &pot.map(|p| p + up));
    }
    shape
}
