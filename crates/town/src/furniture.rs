//! What stands in streets and on squares.
//!
//! Everything stands on the ground around the origin, its front towards +Z, and reaches a little
//! below the ground.

use crate::dice::Dice;
use crate::palette;
use crate::shape::Shape;
use crate::skin::Skin;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A ring of points, counter-clockwise seen from above.
fn ring(sides: usize, radius: f32, y: f32) -> Vec<Vec3> {
    (0..sides)
        .map(|i| {
            let angle = TAU * (i as f32 + 0.5) / sides as f32;
            Vec3::new(radius * angle.cos(), y, -radius * angle.sin())
        })
        .collect()
}

/// Adds a closed body of revolution: radii at heights, from below.
fn add_turned(shape: &mut Shape, skin: Skin, sides: usize, profile: &[[f32; 2]]) {
    let rings: Vec<Vec<Vec3>> = profile.iter().map(|&[r, y]| ring(sides, r, y)).collect();
    for pair in rings.windows(2) {
        for i in 0..sides {
            let j = (i + 1) % sides;
            shape.face(skin, &[pair[0][i], pair[0][j], pair[1][j], pair[1][i]]);
        }
    }
    let mut bottom = rings[0].clone();
    bottom.reverse();
    shape.face(skin, &bottom);
    shape.face(skin, &rings[rings.len() - 1]);
}

fn add_box(shape: &mut Shape, skin: Skin, min: [f32; 3], max: [f32; 3]) {
    shape.cuboid(skin, Vec3::from(min), Vec3::from(max));
}

/// A street lantern on a pole.
pub(crate) fn lantern() -> Shape {
    let mut shape = Shape::default();
    add_turned(
        &mut shape,
        Skin::Iron,
        6,
        &[
            [0.16, -0.3],
            [0.16, 0.5],
            [0.055, 0.7],
            [0.045, 3.0],
            [0.2, 3.15],
        ],
    );
    add_turned(&mut shape, Skin::Lamp, 6, &[[0.15, 3.12], [0.24, 3.6]]);
    add_turned(
        &mut shape,
        Skin::Iron,
        6,
        &[[0.3, 3.58], [0.3, 3.64], [0.06, 3.86], [0.03, 4.0]],
    );
    shape
}

/// A bench of boards on iron legs.
pub(crate) fn bench() -> Shape {
    let mut shape = Shape::tinted(palette::tint(0x7d5a3c));
    for z in [-0.2, 0.02] {
        add_box(
            &mut shape,
            Skin::Paint,
            [-0.95, 0.42, z],
            [0.95, 0.47, z + 0.18],
        );
    }
    add_box(
        &mut shape,
        Skin::Paint,
        [-0.95, 0.62, -0.3],
        [0.95, 0.84, -0.25],
    );
    for x in [-0.75, 0.7] {
        add_box(
            &mut shape,
            Skin::Iron,
            [x, -0.15, -0.19],
            [x + 0.05, 0.43, 0.18],
        );
        add_box(
            &mut shape,
            Skin::Iron,
            [x, 0.4, -0.31],
            [x + 0.05, 0.9, -0.24],
        );
    }
    shape
}

/// A fountain: steps, an eight-sided basin, a column with a bowl and a figure on top.
pub(crate) fn fountain() -> Shape {
    let mut shape = Shape::default();
    add_turned(&mut shape, Skin::Granite, 8, &[[3.3, -0.4], [3.3, 0.17]]);
    // The basin's wall is hollow: outside, rim, inside, and the water.
    let (outer, inner) = (2.5, 2.15);
    let rings =
        [[outer, 0.1], [outer, 0.95], [inner, 0.95], [inner, 0.7]].map(|[r, y]| ring(8, r, y));
    for pair in rings.windows(2) {
        for i in 0..8 {
            let j = (i + 1) % 8;
            shape.face(
                Skin::Trim,
                &[pair[0][i], pair[0][j], pair[1][j], pair[1][i]],
            );
        }
    }
    shape.face(Skin::Water, &rings[3]);
    add_turned(
        &mut shape,
        Skin::Trim,
        8,
        &[
            [0.55, 0.6],
            [0.5, 1.1],
            [0.3, 1.3],
            [0.26, 2.1],
            [0.9, 2.5],
            [0.95, 2.65],
        ],
    );
    add_turned(&mut shape, Skin::Water, 8, &[[0.8, 2.6], [0.8, 2.68]]);
    add_turned(
        &mut shape,
        Skin::Trim,
        8,
        &[[0.24, 2.6], [0.2, 3.6], [0.36, 3.75], [0.36, 3.9]],
    );
    add_turned(
        &mut shape,
        Skin::Gold,
        7,
        &[
            [0.26, 3.88],
            [0.17, 4.5],
            [0.24, 5.0],
            [0.1, 5.2],
            [0.16, 5.4],
            [0.06, 5.62],
        ],
    );
    shape
}

/// A market stall: a table with goods in crates under striped cloth.
pub(crate) fn stall(dice: &mut Dice) -> Shape {
    let mut shape = Shape::default();
    let (half, deep) = (1.6, 0.95);
    shape.tint = palette::tint(0x8f6d48);
    for x in [-half, half - 0.09] {
        for (z, top) in [(-deep, 2.75), (deep - 0.09, 2.35)] {
            add_box(
                &mut shape,
                Skin::Paint,
                [x, -0.2, z],
                [x + 0.09, top, z + 0.09],
            );
        }
    }
    add_box(
        &mut shape,
        Skin::Planks,
        [-half, 0.12, -0.5],
        [half, 0.86, 0.7],
    );
    let goods = [0xd0532f, 0xe0a92f, 0x7fa23a, 0xb03a4a, 0xd9c48a, 0x7a4a78];
    for i in 0..4 {
        let x = -half + 0.12 + i as f32 * 0.77;
        shape.tint = palette::tint(0xa98558);
        add_box(
            &mut shape,
            Skin::Paint,
            [x, 0.84, -0.3],
            [x + 0.66, 1.0, 0.6],
        );
        shape.tint = palette::tint(dice.pick(&goods));
        let low = [
            [x + 0.05, -0.22],
            [x + 0.61, -0.22],
            [x + 0.61, 0.52],
            [x + 0.05, 0.52],
        ];
        let center = Vec3::new(x + 0.33, 1.2, 0.15);
        let corners = low.map(|[x, z]| Vec3::new(x, 1.0, z));
        for i in 0..4 {
            shape.face(Skin::Paint, &[corners[(i + 1) % 4], corners[i], center]);
        }
        shape.face(Skin::Paint, &corners);
    }
    let cloth = palette::cloth(dice);
    let stripes = 7;
    let width = 2.0 * (half + 0.25) / stripes as f32;
    let section = [
        [2.95, -deep - 0.25],
        [2.3, deep + 0.45],
        [2.02, deep + 0.45],
        [2.85, -deep - 0.25],
    ];
    for i in 0..stripes {
        shape.tint = match i % 2 {
            0 => cloth,
            _ => palette::tint(palette::WHITE),
        };
        let left = -half - 0.25 + width * i as f32;
        let outline = section.map(|[y, z]| Vec3::new(left, y, z));
        shape.prism(Skin::Paint, &outline, Vec3::X * width);
    }
    shape
}

/// A piece of clipped hedge along x.
pub(crate) fn hedge(length: f32, dice: &mut Dice) -> Shape {
    let mut shape = Shape::default();
    let half = length / 2.0;
    shape.tint = Vec3::splat(dice.between(0.85, 1.0));
    let section = [
        [0.45, -0.6],
        [0.5, 0.75],
        [0.3, 1.05],
        [-0.3, 1.05],
        [-0.5, 0.75],
        [-0.45, -0.6],
    ];
    let outline = section.map(|[z, y]| Vec3::new(-half, y, -z));
    shape.prism(Skin::Hedge, &outline, Vec3::X * length);
    shape
}

/// A fence of pickets along x.
pub(crate) fn fence(length: f32) -> Shape {
    let mut shape = Shape::default();
    let half = length / 2.0;
    shape.tint = palette::tint(0xe8e0cc);
    for y in [0.3, 0.75] {
        add_box(
            &mut shape,
            Skin::Paint,
            [-half, y, -0.05],
            [half, y + 0.08, -0.01],
        );
    }
    let count = (length / 0.25).round() as usize;
    let pitch = length / count as f32;
    for i in 0..count {
        let x = pitch * (i as f32 + 0.5) - half;
        let outline = [
            [-0.055, -0.3],
            [0.055, -0.3],
            [0.055, 0.95],
            [0.0, 1.05],
            [-0.055, 0.95],
        ];
        let outline = outline.map(|[dx, y]| Vec3::new(x + dx, y, -0.01));
        shape.prism(Skin::Paint, &outline, Vec3::Z * 0.03);
    }
    shape
}

/// A tub with a clipped bush or flowers.
pub(crate) fn tub(dice: &mut Dice) -> Shape {
    let mut shape = Shape::default();
    add_turned(
        &mut shape,
        Skin::RidgeTiles,
        8,
        &[[0.26, -0.2], [0.36, 0.5]],
    );
    add_turned(
        &mut shape,
        Skin::Hedge,
        8,
        &[[0.22, 0.45], [0.42, 0.75], [0.36, 1.1], [0.1, 1.28]],
    );
    let tint = match dice.chance(0.5) {
        true => Vec3::ONE,
        false => palette::tint(0xf6d9a0),
    };
    shape.tint = tint;
    for i in 0..6 {
        let out = Vec2::from_angle(TAU * i as f32 / 6.0);
        let center = Vec3::new(out.x * 0.42, 0.85 + 0.2 * (i % 2) as f32, -out.y * 0.42);
        let right = Vec3::new(-out.y, 0.0, -out.x) * 0.26;
        let up = Vec3::new(-out.x * 0.12, 0.26, out.y * 0.12);
        let corners = [-right - up, right - up, right + up, up - right];
        shape.picture(Skin::Flowers, corners.map(|p| center + p));
    }
    shape
}

/// A barrel with hoops.
pub(crate) fn barrel() -> Shape {
    let mut shape = Shape::tinted(palette::tint(0x8a6440));
    add_turned(
        &mut shape,
        Skin::Paint,
        10,
        &[[0.3, -0.1], [0.38, 0.45], [0.3, 0.95]],
    );
    for y in [0.16, 0.66] {
        add_turned(&mut shape, Skin::Iron, 10, &[[0.375, y], [0.375, y + 0.07]]);
    }
    shape
}

/// A handcart with two wheels, loaded with sacks.
pub(crate) fn cart() -> Shape {
    let mut shape = Shape::tinted(palette::tint(0x7f5c3c));
    add_box(&mut shape, Skin::Paint, [-0.6, 0.62, -1.0], [0.6, 0.7, 1.0]);
    for x in [-0.6, 0.54] {
        add_box(
            &mut shape,
            Skin::Paint,
            [x, 0.68, -1.0],
            [x + 0.06, 1.0, 1.0],
        );
        add_box(
            &mut shape,
            Skin::Paint,
            [x * 0.9, 0.6, 0.95],
            [x * 0.9 + 0.06, 0.66, 2.2],
        );
    }
    add_box(
        &mut shape,
        Skin::Paint,
        [-0.55, 0.69, -0.98],
        [0.55, 0.98, -0.92],
    );
    add_box(
        &mut shape,
        Skin::Paint,
        [-0.06, -0.1, 1.9],
        [0.06, 0.62, 2.0],
    );
    let wheel = |x: f32| -> Vec<Vec3> {
        (0..12)
            .map(|i| {
                let angle = TAU * i as f32 / 12.0;
                // Counter-clockwise seen from +x is from +y to +z.
                Vec3::new(x, 0.52 + 0.55 * angle.cos(), -0.1 + 0.55 * angle.sin())
            })
            .collect()
    };
    for x in [-0.78, 0.68] {
        shape.tint = palette::tint(0x5f4630);
        shape.prism(Skin::Paint, &wheel(x), Vec3::X * 0.1);
    }
    shape.tint = palette::tint(0xcbb58a);
    for (x, z) in [(-0.25, -0.5), (0.2, 0.1), (-0.2, 0.6)] {
        let low = Vec3::new(x - 0.28, 0.68, z - 0.26);
        shape.cuboid(Skin::Paint, low, low + Vec3::new(0.55, 0.42, 0.5));
    }
    shape
}

/// A well under a small roof.
pub(crate) fn well() -> Shape {
    let mut shape = Shape::default();
    add_turned(&mut shape, Skin::Plinth, 10, &[[0.95, -0.4], [0.95, 0.85]]);
    add_turned(&mut shape, Skin::Trim, 10, &[[1.02, 0.8], [1.02, 0.95]]);
    for x in [-0.85, 0.75] {
        add_box(
            &mut shape,
            Skin::Beam,
            [x, 0.9, -0.06],
            [x + 0.1, 2.3, 0.06],
        );
    }
    add_box(
        &mut shape,
        Skin::Beam,
        [-0.8, 1.75, -0.05],
        [0.8, 1.85, 0.05],
    );
    crate::housetop::add_hip(
        &mut shape,
        Skin::Tiles,
        Vec3::new(-1.2, 2.2, -0.9),
        Vec3::new(1.2, 2.3, 0.9),
        0.9,
    );
    shape
}
