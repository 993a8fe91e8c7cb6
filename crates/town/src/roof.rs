//! The main roof with its ridge and gutters, and the dormers.

use crate::facade::{Cell, Facade, add_wall_with_niche};
use crate::shape::Shape;
use crate::skin::Skin;
use crate::windows;
use glam::{Vec2, Vec3};

/// Height of the roof's surface where x is 0; it falls at 45 degrees, and less steeply beyond
/// [`KINK`], in metres.
pub(crate) const RIDGE: f32 = 17.38;

/// Where the roof begins to flare out, x in metres.
const KINK: f32 = 8.4;

/// The tiled slab with flared eaves; its inner side meets x = `9` under the walls' top.
pub(crate) fn roof(half_depth: f32) -> Shape {
    let mut shape = Shape::default();
    // The right half of the section: outer side from the eaves up, then the inner side down.
    let half = [
        Vec2::new(9.8, 7.3),
        Vec2::new(9.88, 7.55),
        Vec2::new(KINK, RIDGE - KINK),
        Vec2::new(0.0, RIDGE),
        Vec2::new(0.0, 16.8),
        Vec2::new(9.0, 7.8),
    ];
    let mirrored = |p: Vec2| Vec2::new(-p.x, p.y);
    let [e0, e1, kink, ridge, inner_ridge, wall] = half;
    let [m0, m1, m_kink, m_wall] = [e0, e1, kink, wall].map(mirrored);
    let section = [
        e0,
        e1,
        kink,
        ridge,
        m_kink,
        m1,
        m0,
        m_wall,
        inner_ridge,
        wall,
    ];
    let (tile, wood) = (Skin::Tiles, Skin::Beam);
    let skins = [wood, tile, tile, tile, tile, wood, wood, wood, wood, wood];
    let back = section.map(|p| p.extend(-half_depth));
    shape.tube(&back, Vec3::Z * (2.0 * half_depth), &skins);
    let ends = [
        [e0, e1, kink, wall],
        [wall, kink, ridge, inner_ridge],
        [inner_ridge, ridge, m_kink, m_wall],
        [m_wall, m_kink, m1, m0],
    ];
    for end in ends {
        shape.face(wood, &end.map(|p| p.extend(half_depth)));
        let [a, b, c, d] = end.map(|p| p.extend(-half_depth));
        shape.face(wood, &[d, c, b, a]);
    }
    shape
}

/// A row of half-round tiles along the ridge.
pub(crate) fn ridge(half_depth: f32) -> Shape {
    let mut shape = Shape::default();
    let section = [[0.24, -0.27], [0.17, 0.08], [-0.17, 0.08], [-0.24, -0.27]]
        .map(|[x, y]| Vec3::new(x, RIDGE + y, -half_depth));
    shape.prism(Skin::RidgeTiles, &section, Vec3::Z * (2.0 * half_depth));
    shape
}

/// The gutters along both eaves; `outermost` is the greatest x.
pub(crate) fn gutters(outermost: f32, half_depth: f32) -> Shape {
    let mut shape = Shape::default();
    let right = [[-0.2, 7.46], [-0.16, 7.3], [-0.05, 7.3], [0.0, 7.46]]
        .map(|[x, y]| Vec3::new(outermost + x, y, -half_depth));
    let mut left = right.map(|p| Vec3::new(-p.x, p.y, p.z));
    left.reverse();
    for section in [right, left] {
        shape.prism(Skin::Zinc, &section, Vec3::Z * (2.0 * half_depth));
    }
    shape
}

/// A dormer with a gable of its own, in wall coordinates: the origin where the middle of its front
/// meets a roof of 45 degrees. `tint` is of its tiles.
pub(crate) fn dormer(tint: Vec3) -> Shape {
    let mut shape = Shape {
        tint,
        ..Shape::default()
    };
    let facade = Facade {
        origin: Vec3::ZERO,
        right: Vec3::X,
        normal: Vec3::Z,
    };
    let (half, top) = (1.0, 1.85);
    let cell = Cell {
        min: Vec2::new(-half, -0.2),
        max: Vec2::new(half, top),
    };
    let size = Vec2::new(1.3, 1.35);
    let opening = cell.opening(size, 0.45);
    let skins = [Skin::Trim, Skin::Beam];
    add_wall_with_niche(&mut shape, &facade, skins, cell, opening, false);
    let sill = windows::window(size, Skin::Beam);
    shape.append(&sill, Vec3::new(0.0, opening.min.y, 0.0));

    // The gable, and cheeks that vanish in the roof.
    let point = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let [left, right] = [-half, half].map(|x| point(x, top, 0.0));
    shape.face(Skin::Trim, &[left, right, point(0.0, top + half, 0.0)]);
    let behind = -top - 0.4;
    for [a, b, c] in [
        [right, point(half, -0.2, 0.0), point(half, top, behind)],
        [point(-half, -0.2, 0.0), left, point(-half, top, behind)],
    ] {
        shape.face(Skin::Tiles, &[a, b, c]);
    }

    // The roof: its inner side a little below the gable's top, so that the walls end in it.
    let (rise, thick, eave) = (top + half - 0.05, 0.17, half + 0.3);
    let outline = [
        [eave, rise - eave],
        [eave, rise - eave + thick],
        [0.0, rise + thick],
        [-eave, rise - eave + thick],
        [-eave, rise - eave],
        [0.0, rise],
    ];
    let (front, length) = (0.28, 3.6);
    let back = outline.map(|[x, y]| point(x, y, front - length));
    let (tile, wood) = (Skin::Tiles, Skin::Beam);
    shape.tube(
        &back,
        Vec3::Z * length,
        &[wood, tile, tile, wood, wood, wood],
    );
    let end = back.map(|p| p.with_z(front));
    shape.face(wood, &[end[0], end[1], end[2], end[5]]);
    shape.face(wood, &[end[5], end[2], end[3], end[4]]);
    shape
}
