//! The sides of the ground: a quay along the front, rock around the rest.

use crate::shape::Shape;
use crate::skin::Skin;
use glam::Vec3;

/// The scene's lowest height, in metres; the lowest ground is at 0 and everything that reaches
/// into it ends above this.
pub(crate) const FOOT: f32 = -4.0;

/// The quay's coping: how far it stands out and how high, from the lower inner edge, clockwise
/// seen from its left end.
const COPING: [[f32; 2]; 4] = [[-0.35, -0.2], [-0.35, 0.4], [0.2, 0.4], [0.2, 0.05]];

/// Walls from the ground's border down to the foot.
///
/// * `border` - counter-clockwise seen from above, from the front's left end
/// * `front` - how many of its points belong to the front, from left to right
pub(crate) fn bank(border: &[Vec3], front: usize) -> Shape {
    let mut shape = Shape::default();
    for (i, &a) in border.iter().enumerate() {
        let b = border[(i + 1) % border.len()];
        let skin = match i + 1 < front {
            true => Skin::Sandstone,
            false => Skin::Rock,
        };
        let [low_a, low_b] = [a, b].map(|p| p.with_y(FOOT));
        shape.face(skin, &[low_a, low_b, b]);
        shape.face(skin, &[low_a, b, a]);
    }
    add_coping(&mut shape, &border[..front]);
    shape
}

/// Stones along a line, mitred where it bends.
fn add_coping(shape: &mut Shape, line: &[Vec3]) {
    let last = line.len() - 1;
    let section = |i: usize| {
        let along = line[(i + 1).min(last)] - line[i.saturating_sub(1)];
        let out = along.with_y(0.0).normalize().cross(Vec3::Y);
        COPING.map(|[x, y]| line[i] + out * x + Vec3::Y * y)
    };
    for i in 0..last {
        let [near, far] = [section(i), section(i + 1)];
        for k in 0..4 {
            let next = (k + 1) % 4;
            shape.face(Skin::Trim, &[near[k], near[next], far[next]]);
            shape.face(Skin::Trim, &[near[k], far[next], far[k]]);
        }
    }
    let mut start = section(0);
    start.reverse();
    shape.face(Skin::Trim, &start);
    shape.face(Skin::Trim, &section(last));
}
