//! The church: a nave along the street, an apse at its right end, a tower with a spire at its left.

use crate::building::add_raised;
use crate::facade::{Cell, Facade};
use crate::housetop::{self, Housetop};
use crate::shape::Shape;
use crate::skin::Skin;
use crate::turret::clock;
use glam::{Affine3A, Mat3, Vec2, Vec3};
use std::f32::consts::TAU;

/// Half the nave's length, its depth and its walls' height, in metres.
const NAVE: [f32; 3] = [10.0, 9.6, 8.2];
/// Half the tower's width, and its height under the spire, in metres.
const TOWER: [f32; 2] = [2.9, 20.5];
/// How far foundations reach below the ground at the front, in metres.
const BELOW: f32 = 3.4;

/// Nave and apse; the front's middle is the origin, as of houses.
pub(crate) fn nave() -> Shape {
    let mut shape = Shape::default();
    let [half, depth, eaves] = NAVE;
    let walls = |shape: &mut Shape, min: Vec3, max: Vec3| {
        let base = crate::shape::rectangle(min, max);
        shape.tube(&base, Vec3::Y * (max.y - min.y), &[Skin::Plaster; 4]);
    };
    shape.tint = crate::palette::tint(0xf6ecd6);
    walls(
        &mut shape,
        Vec3::new(-half, 0.0, -depth),
        Vec3::new(half, eaves, 0.0),
    );
    shape.cuboid(
        Skin::Plinth,
        Vec3::new(-half - 0.12, -BELOW, -depth - 0.12),
        Vec3::new(half + 0.12, 0.8, 0.12),
    );
    // Gable ends go up into the roof.
    let apex = eaves + depth / 2.0;
    for x in [-half, half] {
        let mut gable =
            [[0.0, eaves], [-depth, eaves], [-depth / 2.0, apex]].map(|[z, y]| Vec3::new(x, y, z));
        if x < 0.0 {
            gable.reverse();
        }
        shape.face(Skin::Plaster, &gable);
    }
    housetop::add_roof(
        &mut shape,
        Housetop::Eaves,
        Skin::Slates,
        half + 0.2,
        [-depth, 0.0],
        eaves,
    );

    let sides = [
        Facade {
            origin: Vec3::ZERO,
            right: Vec3::X,
            normal: Vec3::Z,
        },
        Facade {
            origin: Vec3::Z * -depth,
            right: Vec3::NEG_X,
            normal: Vec3::NEG_Z,
        },
    ];
    let bays = 5;
    let bay = 2.0 * half / bays as f32;
    for facade in sides {
        for i in 0..bays {
            let x = bay * (i as f32 + 0.5) - half;
            let window = Cell {
                min: Vec2::new(x - 0.95, 2.0),
                max: Vec2::new(x + 0.95, 7.0),
            };
            let skins = [Skin::ChurchWindow, Skin::Trim];
            add_raised(&mut shape, &facade, skins, &window, 0.07);
        }
        for i in 0..=bays {
            let x = (bay * i as f32 - half).clamp(0.35 - half, half - 0.35);
            add_buttress(&mut shape, &facade, x, eaves - 1.0);
        }
    }
    add_apse(
        &mut shape,
        Vec3::new(half, 0.0, -depth / 2.0),
        3.6,
        eaves - 1.2,
    );
    shape
}

/// A pillar against a wall, with a sloping top.
fn add_buttress(shape: &mut Shape, facade: &Facade, x: f32, top: f32) {
    let [low, high] = [1.05, 0.1];
    let section = [
        [0.0, top],
        [high, top],
        [low, top - 1.8],
        [low, -BELOW],
        [0.0, -BELOW],
    ];
    let outline = section.map(|[out, y]| facade.at(Vec2::new(x - 0.35, y), out));
    shape.prism(Skin::Trim, &outline, facade.right * 0.7);
}

/// Five sides of an octagon against a wall that faces +X, with a roof.
fn add_apse(shape: &mut Shape, center: Vec3, radius: f32, eaves: f32) {
    let ring = |radius: f32, y: f32| -> Vec<Vec3> {
        (0..=4)
            .map(|i| {
                let angle = TAU / 8.0 * (i as f32 - 2.0);
                center + Vec3::new(radius * angle.cos() + 0.6, y, -radius * angle.sin())
            })
            .collect()
    };
    let (low, high) = (ring(radius, -BELOW), ring(radius, eaves));
    let rim = ring(radius + 0.35, eaves - 0.1);
    let rim_top = ring(radius + 0.35, eaves + 0.12);
    let back =
        |y: f32, reach: f32| [1.0, -1.0].map(|side| center + Vec3::new(-0.3, y, side * reach));
    let tip = center + Vec3::new(-0.3, eaves + radius * 0.95, 0.0);
    for i in 0..4 {
        let j = i + 1;
        shape.face(Skin::Plaster, &[low[i], low[j], high[j], high[i]]);
        shape.face(Skin::Trim, &[rim[i], rim[j], rim_top[j], rim_top[i]]);
        shape.face(Skin::Slates, &[rim_top[i], rim_top[j], tip]);
        let facade = Facade {
            origin: (low[i] + low[j]) / 2.0 - Vec3::Y * low[i].y,
            right: (low[j] - low[i]).normalize(),
            normal: (low[j] - low[i]).cross(Vec3::Y).normalize(),
        };
        let window = Cell {
            min: Vec2::new(-0.75, 1.8),
            max: Vec2::new(0.75, eaves - 0.7),
        };
        add_raised(
            shape,
            &facade,
            [Skin::ChurchWindow, Skin::Trim],
            &window,
            0.06,
        );
    }
    // To the nave's wall, and the soffit.
    let [front, behind] = back(0.0, radius + 0.35);
    let up = |p: Vec3, y: f32| p.with_y(y + center.y);
    for (p, q, is_front) in [(rim_top[0], front, true), (rim_top[4], behind, false)] {
        let q = up(q, eaves + 0.12);
        let triangle = [q, p, tip];
        let side = [up(q, eaves - 0.1), up(p, eaves - 0.1), p, q];
        let wall = [up(q, -BELOW), up(p, -BELOW), up(p, eaves), up(q, eaves)]
            .map(|w| w + Vec3::Z * if is_front { -0.35 } else { 0.35 });
        for (skin, mut face) in [
            (Skin::Slates, triangle.to_vec()),
            (Skin::Trim, side.to_vec()),
            (Skin::Plaster, wall.to_vec()),
        ] {
            if !is_front {
                face.reverse();
            }
            shape.face(skin, &face);
        }
    }
    let mut soffit = rim.clone();
    soffit.push(up(behind, eaves - 0.1));
    soffit.push(up(front, eaves - 0.1));
    soffit.reverse();
    shape.face(Skin::Trim, &soffit);
}

/// The tower around the y axis, with a clock on each side and an octagonal spire.
pub(crate) fn tower() -> Shape {
    let mut shape = Shape::default();
    let [half, top] = TOWER;
    shape.tint = crate::palette::tint(0xf6ecd6);
    let block = |shape: &mut Shape, skin: Skin, half: f32, low: f32, high: f32| {
        shape.cuboid(
            skin,
            Vec3::new(-half, low, -half),
            Vec3::new(half, high, half),
        );
    };
    block(&mut shape, Skin::Plaster, half, -BELOW, top - 0.1);
    block(&mut shape, Skin::Plinth, half + 0.15, -BELOW - 0.1, 1.1);
    for y in [7.4, 13.4, top - 0.2] {
        block(&mut shape, Skin::Trim, half + 0.18, y, y + 0.32);
    }
    for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let corner = Vec3::new(sx * (half - 0.2), 0.0, sz * (half - 0.2));
        let reach = Vec3::new(0.36, 0.0, 0.36);
        shape.cuboid(
            Skin::Trim,
            corner - reach - Vec3::Y * BELOW,
            corner + reach + Vec3::Y * (top - 0.3),
        );
    }
    for facade in Facade::around(half, half) {
        let cell = |half: f32, low: f32, high: f32| Cell {
            min: Vec2::new(-half, low),
            max: Vec2::new(half, high),
        };
        let belfry = cell(1.3, 14.4, 18.6);
        add_raised(
            &mut shape,
            &facade,
            [Skin::Louvre, Skin::Trim],
            &belfry,
            0.08,
        );
        let window = cell(0.7, 8.6, 12.4);
        add_raised(
            &mut shape,
            &facade,
            [Skin::ChurchWindow, Skin::Trim],
            &window,
            0.08,
        );
    }
    for facade in Facade::around(half, half).into_iter().take(2) {
        let at = facade.at(Vec2::new(0.0, 5.6), 0.0);
        let axes = Mat3::from_cols(facade.right, Vec3::Y, facade.normal);
        shape.append_placed(&clock(1.05), &Affine3A::from_mat3_translation(axes, at));
    }
    add_spire(&mut shape, half + 0.3, top + 0.1, 14.5);
    shape
}

/// A spire that goes over from a square with a flare into an octagon.
fn add_spire(shape: &mut Shape, half: f32, foot: f32, height: f32) {
    let square = |i: usize, half: f32, y: f32| {
        let angle = TAU / 8.0 * (2.0 * i as f32 + 1.0);
        let reach = half * std::f32::consts::SQRT_2;
        Vec3::new(reach * angle.cos(), y, -reach * angle.sin())
    };
    let octagon = |i: usize, radius: f32, y: f32| {
        let angle = TAU / 8.0 * (i as f32 + 0.5);
        Vec3::new(radius * angle.cos(), y, -radius * angle.sin())
    };
    let rim: Vec<Vec3> = (0..4).map(|i| square(i, half, foot)).collect();
    let mut soffit = rim.clone();
    soffit.reverse();
    shape.face(Skin::Beam, &soffit);
    let neck: Vec<Vec3> = (0..8)
        .map(|i| octagon(i, half * 0.78, foot + 2.4))
        .collect();
    let tip = Vec3::Y * (foot + height);
    for i in 0..4 {
        // The square's corner i lies between the octagon's corners 2 i and 2 i + 1.
        let [a, b, c] = [2 * i, 2 * i + 1, (2 * i + 2) % 8].map(|k| neck[k]);
        shape.face(Skin::Copper, &[rim[i], b, a]);
        shape.face(Skin::Copper, &[rim[i], rim[(i + 1) % 4], c, b]);
    }
    for i in 0..8 {
        shape.face(Skin::Copper, &[neck[i], neck[(i + 1) % 8], tip]);
    }
    let top = tip.y - 0.5;
    shape.cuboid(
        Skin::Gold,
        Vec3::new(-0.28, top, -0.28),
        Vec3::new(0.28, top + 0.56, 0.28),
    );
    let bar = |x: f32, low: f32, high: f32| {
        (
            Vec3::new(-x, top + low, -0.07),
            Vec3::new(x, top + high, 0.07),
        )
    };
    for (min, max) in [bar(0.075, 0.5, 2.3), bar(0.55, 1.5, 1.68)] {
        shape.cuboid(Skin::Gold, min, max);
    }
}
