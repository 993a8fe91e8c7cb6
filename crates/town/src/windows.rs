//! What is set into and beside a niche: window posts, sills and shutters.
//!
//! All in the wall's coordinates: the origin in the middle of the opening's lower edge, x to the
//! right, z out of the wall.

use crate::facade::NICHE_DEPTH;
use crate::shape::Shape;
use crate::skin::Skin;
use glam::{Vec2, Vec3};

/// Width and height of the openings of all storeys, in metres.
pub(crate) const WINDOW: Vec2 = Vec2::new(1.6, 1.9);

/// A post in the middle of the panes and a sill that closes the niche's bottom.
pub(crate) fn window(size: Vec2, sill: Skin) -> Shape {
    let mut shape = Shape::default();
    // The post's ends are buried in sill and lintel.
    let (half, front) = (0.05, 0.09 - NICHE_DEPTH);
    let back = -NICHE_DEPTH - 0.02;
    let along = Vec3::Y * (size.y + 0.02);
    let section = [(-half, back), (-half, front), (half, front), (half, back)]
        .map(|(x, z)| Vec3::new(x, 0.0, z));
    for [a, b] in [[0, 1], [1, 2], [2, 3]].map(|e| e.map(|i: usize| section[i])) {
        shape.face(Skin::Frame, &[a, b, b + along, a + along]);
    }
    add_sill(&mut shape, size.x / 2.0 + 0.12, sill);
    shape
}

/// The sill alone, for a niche of a width.
pub(crate) fn sill(width: f32, skin: Skin) -> Shape {
    let mut shape = Shape::default();
    add_sill(&mut shape, width / 2.0 + 0.1, skin);
    shape
}

/// A wedge that slopes from the pane to a nose in front of the wall, and back under it.
fn add_sill(shape: &mut Shape, half_width: f32, skin: Skin) {
    let section = [
        Vec2::new(0.05, -NICHE_DEPTH - 0.03),
        Vec2::new(-0.12, -0.03),
        Vec2::new(0.0, 0.14),
    ];
    let [top, bottom, nose] = section.map(|p| Vec3::new(-half_width, p.x, p.y));
    let across = Vec3::X * (2.0 * half_width);
    shape.face(skin, &[nose, nose + across, top + across, top]);
    shape.face(skin, &[bottom, bottom + across, nose + across, nose]);
    shape.face(skin, &[top, bottom, nose]);
    shape.face(skin, &[top + across, nose + across, bottom + across]);
}

/// Two shutters that stand a little ajar: wedges with their hinges in the wall.
///
/// Skins are of the leaves' fronts, and of their rims.
pub(crate) fn shutters(size: Vec2, [leaf, rim]: [Skin; 2], tint: Vec3) -> Shape {
    let mut shape = Shape {
        tint,
        ..Shape::default()
    };
    let (hinge, edge) = (size.x / 2.0 + 0.02, size.x);
    let (bottom, top) = (-0.04, size.y + 0.04);
    for side in [-1.0, 1.0] {
        let [hinge, edge, wall] = [(hinge, -0.01), (edge, 0.12), (edge, -0.01)]
            .map(|(x, z)| Vec3::new(side * x, bottom, z));
        // The two visible sides from left to right.
        let low = match side < 0.0 {
            true => [wall, edge, hinge],
            false => [hinge, edge, wall],
        };
        let high = low.map(|p| p.with_y(top));
        for [i, j] in [[0, 1], [1, 2]] {
            let corners = [low[i], low[j], high[j], high[i]];
            match low[i] == wall || low[j] == wall {
                true => shape.face(rim, &corners),
                false => shape.picture(leaf, corners),
            }
        }
        shape.face(rim, &high);
        shape.face(rim, &[low[2], low[1], low[0]]);
    }
    shape
}
