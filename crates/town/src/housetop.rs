//! Roofs of town houses, and the gables under them.
//!
//! A roof sits on walls that end at the eaves' height and in it, so that no wall needs a top.
//! Roofs are closed.

use crate::building::add_raised;
use crate::facade::{Cell, Facade, add_wall, add_wall_with_niche};
use crate::shape::{Shape, rectangle};
use crate::skin::Skin;
use crate::windows::sill;
use glam::{Affine3A, Mat3, Vec2, Vec3};

/// The kinds of roofs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Housetop {
    /// The ridge runs along the street, the roof falls towards it.
    Eaves,
    /// The same with a steep lower part.
    Mansard,
    /// The ridge runs away from the street, under an overhanging gable.
    Gable,
    /// The same behind a gable that rises in steps.
    Stepped,
    /// Falls to all sides.
    Hip,
}

/// Rise over run of roofs whose gable looks onto the street.
const GABLE_SLOPE: f32 = 1.15;
/// Height of the steep part of a mansard roof; it is one metre deep.
const STEEP: f32 = 2.3;
/// Rise over run of its upper part.
const FLAT_SLOPE: f32 = 0.6;
/// How far the inner side of roofs lies under the walls' ends, in metres.
const SINK: f32 = 0.12;
/// Vertical thickness of roofs, in metres.
const THICKNESS: f32 = 0.28;
/// How far roofs reach over party walls: less than the walls' tops stick into them, in metres.
const RIM: f32 = 0.04;

/// Points of the side wall's outline above the eaves, (z, y) from the front to the back.
pub(crate) fn side_outline(kind: Housetop, [back, front]: [f32; 2], eaves: f32) -> Vec<[f32; 2]> {
    let (middle, run) = ((front + back) / 2.0, (front - back) / 2.0);
    match kind {
        Housetop::Eaves => vec![[middle, eaves + run]],
        Housetop::Mansard => vec![
            [front - 1.0, eaves + STEEP],
            [middle, eaves + STEEP + (run - 1.0) * FLAT_SLOPE],
            [back + 1.0, eaves + STEEP],
        ],
        Housetop::Gable | Housetop::Stepped | Housetop::Hip => Vec::new(),
    }
}

/// Height of the roof's surface over the eaves, `inward` metres behind the front wall.
pub(crate) fn roof_height(kind: Housetop, inward: f32) -> f32 {
    let slope = if kind == Housetop::Mansard {
        STEEP
    } else {
        1.0
    };
    inward * slope + THICKNESS - SINK
}

/// Height of the ridge.
pub(crate) fn ridge_height(kind: Housetop, half: f32, [back, front]: [f32; 2], eaves: f32) -> f32 {
    let run = (front - back) / 2.0;
    let rise = match kind {
        Housetop::Eaves => run,
        Housetop::Mansard => STEEP + (run - 1.0) * FLAT_SLOPE,
        Housetop::Gable | Housetop::Stepped => half * GABLE_SLOPE,
        Housetop::Hip => half.min(run),
    };
    eaves + rise + THICKNESS - SINK
}

/// Adds the roof over walls at x = -`half` and `half` and at z = `back` and `front`.
pub(crate) fn add_roof(
    shape: &mut Shape,
    kind: Housetop,
    tiles: Skin,
    half: f32,
    [back, front]: [f32; 2],
    eaves: f32,
) {
    let (middle, run) = ((front + back) / 2.0, (front - back) / 2.0);
    let low = eaves - SINK;
    let along_street = |chain: &[Vec2], shape: &mut Shape| {
        let from = -half - RIM;
        let place = |p: Vec2| Vec3::new(from, p.y, middle - p.x);
        add_slab(shape, tiles, chain, place, Vec3::X * -2.0 * from);
    };
    match kind {
        Housetop::Eaves => {
            let chain = [[run + 0.45, low - 0.45], [0.0, low + run]].map(Vec2::from);
            along_street(&chain, shape);
        }
        Housetop::Mansard => {
            let top = low + STEEP;
            let chain = [
                [run + 0.35, low - 0.12],
                [run, low],
                [run - 1.0, top],
                [0.0, top + (run - 1.0) * FLAT_SLOPE],
            ];
            along_street(&chain.map(Vec2::from), shape);
        }
        Housetop::Gable | Housetop::Stepped => {
            let over = if kind == Housetop::Gable { 0.3 } else { -0.2 };
            let eave = half + RIM;
            let rise = low + half * GABLE_SLOPE;
            let chain = [[eave, rise - eave * GABLE_SLOPE], [0.0, rise]].map(Vec2::from);
            let place = |p: Vec2| Vec3::new(p.x, p.y, back - 0.12);
            let length = front - back + 0.12 + over;
            add_slab(shape, tiles, &chain, place, Vec3::Z * length);
        }
        Housetop::Hip => {
            let min = Vec3::new(-half - RIM, eaves - 0.1, back - 0.35);
            let max = Vec3::new(half + RIM, eaves + 0.14, front + 0.35);
            add_hip(shape, tiles, min, max, 1.0);
        }
    }
}

/// Adds a closed roof of even thickness over a symmetric section.
///
/// * `chain` - of the lower side's right half, from the eaves to the ridge at x = 0
/// * `place` - where a point of the section lies, at the end from which `along` leads
fn add_slab(
    shape: &mut Shape,
    tiles: Skin,
    chain: &[Vec2],
    place: impl Fn(Vec2) -> Vec3,
    along: Vec3,
) {
    let upper = |p: Vec2| p + Vec2::Y * THICKNESS;
    let mirrored = |p: Vec2| Vec2::new(-p.x, p.y);
    let n = chain.len() - 1;
    let mut outline = vec![chain[0]];
    outline.extend(chain.iter().map(|&p| upper(p)));
    outline.extend(chain[..n].iter().rev().map(|&p| upper(mirrored(p))));
    outline.extend(chain.iter().map(|&p| mirrored(p)));
    outline.extend(chain[1..n].iter().rev());
    let outline: Vec<Vec3> = outline.into_iter().map(&place).collect();
    let mut skins = vec![Skin::Beam];
    skins.extend(vec![tiles; 2 * n]);
    skins.extend(vec![Skin::Beam; 2 * n + 1]);
    shape.tube(&outline, along, &skins);
    for pair in chain.windows(2) {
        let right = [pair[0], upper(pair[0]), upper(pair[1]), pair[1]];
        let [a, b, c, d] = right.map(mirrored);
        for section in [right, [d, c, b, a]] {
            let [a, b, c, d] = section.map(&place);
            shape.face(Skin::Beam, &[d, c, b, a]);
            shape.face(Skin::Beam, &[a, b, c, d].map(|p| p + along));
        }
    }
}

/// Adds a closed roof that falls to all sides, over a box that holds its rim.
pub(crate) fn add_hip(shape: &mut Shape, tiles: Skin, min: Vec3, max: Vec3, slope: f32) {
    let half = (max - min) / 2.0;
    let middle = (max + min) / 2.0;
    let run = half.x.min(half.z);
    let [a, b, c, d] = rectangle(min, max).map(|p| p.with_y(max.y));
    let top = max.y + run * slope;
    let low = rectangle(min, max);
    shape.tube(&low, Vec3::Y * (max.y - min.y), &[Skin::Beam; 4]);
    shape.face(Skin::Beam, &[low[3], low[2], low[1], low[0]]);
    if half.x < half.z {
        let reach = half.z - run;
        let [front, back] = [reach, -reach].map(|z| Vec3::new(middle.x, top, middle.z + z));
        shape.face(tiles, &[a, b, front]);
        shape.face(tiles, &[b, c, back, front]);
        shape.face(tiles, &[c, d, back]);
        shape.face(tiles, &[d, a, front, back]);
    } else {
        let reach = half.x - run;
        let [left, right] = [-reach, reach].map(|x| Vec3::new(middle.x + x, top, middle.z));
        if reach > 1e-3 {
            shape.face(tiles, &[a, b, right, left]);
            shape.face(tiles, &[c, d, left, right]);
        } else {
            shape.face(tiles, &[a, b, left]);
            shape.face(tiles, &[c, d, left]);
        }
        shape.face(tiles, &[b, c, right]);
        shape.face(tiles, &[d, a, left]);
    }
}

/// Adds the wall of a gable with a window.
pub(crate) fn add_front_gable(
    shape: &mut Shape,
    facade: &Facade,
    [plain, around, reveal]: [Skin; 3],
    half: f32,
    eaves: f32,
) {
    let rise = half * GABLE_SLOPE;
    let height = (rise - 1.3).min(2.5);
    let inner = 1.15_f32.min((rise - height) / GABLE_SLOPE - 0.05);
    let cell = Cell {
        min: Vec2::new(-inner, eaves),
        max: Vec2::new(inner, eaves + height),
    };
    let size = cell.max - cell.min;
    let opening = match around {
        Skin::WindowPanel => {
            cell.opening(Vec2::new(0.444 * size.x, 0.528 * size.y), 0.278 * size.y)
        }
        _ => cell.opening(Vec2::new(0.9, 0.55 * size.y), 0.25 * size.y),
    };
    add_wall_with_niche(shape, facade, [around, reveal], cell, opening, false);
    let stone = if reveal == Skin::Beam {
        Skin::Beam
    } else {
        Skin::Trim
    };
    let foot = facade.at(Vec2::new(0.0, opening.min.y), 0.0);
    let on_wall = Affine3A::from_mat3_translation(
        Mat3::from_cols(facade.right, Vec3::Y, facade.normal),
        foot,
    );
    shape.append_placed(&sill(opening.max.x - opening.min.x, stone), &on_wall);

    // The rest of the triangle: beside and above the cell.
    let across = (rise - height) / GABLE_SLOPE;
    let top = eaves + height;
    let whole = |min: [f32; 2], max: [f32; 2]| Cell {
        min: Vec2::from(min),
        max: Vec2::from(max),
    };
    let left = whole([-half, eaves], [-inner, top]);
    let right = whole([inner, eaves], [half, top]);
    let above = whole([-across, top], [across, eaves + rise]);
    let at = |x: f32, y: f32| Vec2::new(x, y);
    for (cell, polygon) in [
        (
            left,
            vec![
                at(-half, eaves),
                at(-inner, eaves),
                at(-inner, top),
                at(-across, top),
            ],
        ),
        (
            right,
            vec![
                at(inner, eaves),
                at(half, eaves),
                at(across, top),
                at(inner, top),
            ],
        ),
        (
            above,
            vec![
                at(0.0, eaves + rise),
                at(-across, top),
                at(-inner, top),
                at(inner, top),
                at(across, top),
            ],
        ),
    ] {
        add_wall(shape, facade, plain, cell, &polygon);
    }
    if plain == Skin::BracedPanel {
        for y in [eaves, top] {
            let reach = half - (y - eaves) / GABLE_SLOPE;
            let outline = [[-reach, 0.1], [reach, 0.1], [reach, -0.1], [-reach, -0.1]];
            let outline = outline.map(|[x, out]| facade.at(Vec2::new(x, y - 0.1), out));
            shape.prism(Skin::Beam, &outline, Vec3::Y * 0.22);
        }
    }
}

/// Adds the wall of a gable without windows.
pub(crate) fn add_plain_gable(
    shape: &mut Shape,
    facade: &Facade,
    skin: Skin,
    half: f32,
    eaves: f32,
) {
    let corners = [
        [-half, eaves],
        [half, eaves],
        [0.0, eaves + half * GABLE_SLOPE],
    ];
    let corners = corners.map(|p| facade.at(Vec2::from(p), 0.0));
    shape.face(skin, &corners);
}

/// Adds a gable that rises over the roof in steps, with a window.
pub(crate) fn add_steps(shape: &mut Shape, facade: &Facade, skin: Skin, half: f32, eaves: f32) {
    let count = 4;
    let rise = half * GABLE_SLOPE / (count as f32 - 0.5);
    let front = facade.origin.z;
    // A course of stones hides where the gable's corners meet the wall's edges.
    shape.cuboid(
        Skin::Trim,
        Vec3::new(-half - 0.05, eaves - 0.12, front - 0.42),
        Vec3::new(half + 0.05, eaves + 0.1, front + 0.06),
    );
    for i in 0..count {
        let reach = (half - i as f32 * rise / GABLE_SLOPE + 0.15).min(half);
        let (bottom, top) = (eaves + rise * i as f32, eaves + rise * (i + 1) as f32);
        shape.cuboid(
            skin,
            Vec3::new(-reach, bottom, front - 0.38),
            Vec3::new(reach, top, front),
        );
        shape.cuboid(
            Skin::Trim,
            Vec3::new(-reach - 0.05, top - 0.03, front - 0.42),
            Vec3::new(reach + 0.05, top + 0.1, front + 0.06),
        );
    }
    let cell = Cell {
        min: Vec2::new(-0.5, eaves + 0.45),
        max: Vec2::new(0.5, eaves + 1.85),
    };
    add_raised(shape, facade, [Skin::Pane, Skin::Trim], &cell, 0.08);
}
