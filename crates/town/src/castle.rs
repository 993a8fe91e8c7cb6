//! The castle on the hilltop: walls with battlements, round towers, a keep and a palace.

use crate::building::add_raised;
use crate::facade::{Cell, Facade};
use crate::housetop;
use crate::palette;
use crate::shape::Shape;
use crate::skin::Skin;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// How far foundations reach below the ground at the front, in metres.
const BELOW: f32 = 9.0;
/// Height of the walls' walk, in metres.
const WALL: f32 = 5.4;

/// A wall of a length along x with battlements, its outer side at z = 0.
pub(crate) fn wall(length: f32) -> Shape {
    let mut shape = Shape::default();
    let half = length / 2.0;
    let mut block = |min: [f32; 3], max: [f32; 3]| {
        shape.cuboid(Skin::Plinth, Vec3::from(min), Vec3::from(max));
    };
    block([-half, -BELOW, -1.6], [half, WALL, 0.0]);
    let count = (length / 1.7).round() as usize;
    let pitch = length / count as f32;
    for i in 0..count {
        let x = pitch * (i as f32 + 0.5) - half;
        block(
            [x - 0.27 * pitch, WALL - 0.1, -0.55],
            [x + 0.27 * pitch, WALL + 1.1, 0.04],
        );
    }
    shape
}

/// A round tower around the y axis with a pointed roof.
pub(crate) fn round_tower(radius: f32, height: f32) -> Shape {
    // A multiple of 4: the slits are on sides, not on corners.
    const SIDES: usize = 16;
    let mut shape = Shape::default();
    let ring = |radius: f32, y: f32| -> [Vec3; SIDES] {
        std::array::from_fn(|i| {
            let angle = TAU * (i as f32 + 0.5) / SIDES as f32;
            Vec3::new(radius * angle.cos(), y, -radius * angle.sin())
        })
    };
    let sides = [Skin::Plinth; SIDES];
    shape.tube(&ring(radius, -BELOW), Vec3::Y * (height + BELOW), &sides);
    // A wider top storey on a sloping corbel.
    let (low, high) = (ring(radius, height - 2.8), ring(radius + 0.4, height - 2.2));
    for i in 0..SIDES {
        let j = (i + 1) % SIDES;
        shape.face(Skin::Trim, &[low[i], low[j], high[j], high[i]]);
    }
    shape.tube(&high, Vec3::Y * 2.3, &sides);
    let eaves = ring(radius + 0.85, height - 0.1);
    let tip = Vec3::Y * (height + 2.3 * radius);
    for i in 0..SIDES {
        shape.face(Skin::Tiles, &[eaves[i], eaves[(i + 1) % SIDES], tip]);
    }
    let mut soffit = eaves;
    soffit.reverse();
    shape.face(Skin::Beam, &soffit);
    let sides_at = radius * (TAU / 2.0 / SIDES as f32).cos();
    for facade in Facade::around(sides_at, sides_at) {
        for y in [3.5, height - 5.0] {
            add_slit(&mut shape, &facade, 0.0, y);
        }
    }
    add_flag(&mut shape, tip, palette::tint(0xb8433a));
    shape
}

/// A narrow dark window.
fn add_slit(shape: &mut Shape, facade: &Facade, x: f32, y: f32) {
    let cell = Cell {
        min: Vec2::new(x - 0.22, y),
        max: Vec2::new(x + 0.22, y + 1.3),
    };
    shape.tint = palette::tint(0x4a423a);
    add_raised(shape, facade, [Skin::Paint, Skin::Trim], &cell, 0.07);
}

/// A pennant on a pole.
fn add_flag(shape: &mut Shape, foot: Vec3, tint: Vec3) {
    let pole = |half: f32, low: f32, high: f32| {
        (
            foot + Vec3::new(-half, low, -half),
            foot + Vec3::new(half, high, half),
        )
    };
    let (min, max) = pole(0.06, -0.6, 2.6);
    shape.cuboid(Skin::Iron, min, max);
    shape.tint = tint;
    let outline =
        [[0.06, 1.5], [1.9, 2.0], [0.06, 2.5]].map(|[x, y]| foot + Vec3::new(x, y, -0.03));
    shape.prism(Skin::Paint, &outline, Vec3::Z * 0.06);
}

/// The keep: a square tower with battlements on corbels.
pub(crate) fn keep() -> Shape {
    let mut shape = Shape::default();
    let (half, top) = (4.1, 20.0);
    let block = |shape: &mut Shape, skin, half: f32, low: f32, high: f32| {
        shape.cuboid(
            skin,
            Vec3::new(-half, low, -half),
            Vec3::new(half, high, half),
        );
    };
    block(&mut shape, Skin::Plinth, half, -BELOW, top);
    block(&mut shape, Skin::Plinth, half + 0.5, top - 0.4, top + 1.2);
    block(&mut shape, Skin::Trim, half + 0.3, top - 0.75, top - 0.3);
    for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        for (dx, dz) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            let center = Vec3::new(
                sx * (half - 0.05 - 2.45 * dx),
                top + 1.2,
                sz * (half - 0.05 - 2.45 * dz),
            );
            let reach = Vec3::new(0.6, 1.15, 0.6);
            shape.cuboid(Skin::Plinth, center - reach.with_y(0.1), center + reach);
        }
    }
    housetop::add_hip(
        &mut shape,
        Skin::Slates,
        Vec3::new(-2.9, top + 1.1, -2.9),
        Vec3::new(2.9, top + 2.6, 2.9),
        1.3,
    );
    for facade in Facade::around(half, half) {
        for (x, y) in [(0.0, 6.5), (-1.6, 11.0), (1.6, 11.0), (0.0, 15.5)] {
            add_slit(&mut shape, &facade, x, y);
        }
    }
    add_flag(
        &mut shape,
        Vec3::Y * (top + 2.6 + 2.9 * 1.3),
        palette::tint(0x2f6d8a),
    );
    shape
}

/// The palace: a long house with a steep roof and two rows of windows, its front at z = 0.
pub(crate) fn palace(length: f32) -> Shape {
    let mut shape = Shape::default();
    let (half, depth, eaves) = (length / 2.0, 9.0, 9.4);
    shape.tint = palette::tint(0xefe0c2);
    let min = Vec3::new(-half, -BELOW, -depth);
    let max = Vec3::new(half, eaves, 0.0);
    shape.shaft(Skin::Plaster, min, max);
    shape.cuboid(
        Skin::Plinth,
        Vec3::new(-half - 0.1, -BELOW, -depth - 0.1),
        Vec3::new(half + 0.1, 2.4, 0.1),
    );
    let over = 0.45;
    housetop::add_hip(
        &mut shape,
        Skin::Tiles,
        Vec3::new(-half - over, eaves - 0.12, -depth - over),
        Vec3::new(half + over, eaves + 0.12, over),
        1.25,
    );
    let sides = [(0.0, Vec3::X, Vec3::Z), (-depth, Vec3::NEG_X, Vec3::NEG_Z)];
    let count = (length / 2.8) as usize;
    for (z, right, normal) in sides {
        let facade = Facade {
            origin: Vec3::Z * z,
            right,
            normal,
        };
        for i in 0..count {
            let x = length * ((i as f32 + 0.5) / count as f32 - 0.5);
            for y in [3.4, 6.6] {
                let cell = Cell {
                    min: Vec2::new(x - 0.6, y),
                    max: Vec2::new(x + 0.6, y + 1.8),
                };
                add_raised(&mut shape, &facade, [Skin::Pane, Skin::Trim], &cell, 0.08);
            }
        }
    }
    shape
}
