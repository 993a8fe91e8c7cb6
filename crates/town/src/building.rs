//! Town houses: walls with storeys of windows on all sides that are seen, under one of several
//! roofs.
//!
//! A house stands with the middle of its front's foot in the origin, its front towards +Z, between
//! x = -width / 2 and x = width / 2. It reaches below the ground, which may slope.

use crate::chimneys::chimney;
use crate::dice::Dice;
use crate::facade::{Cell, Facade, NICHE_DEPTH, add_wall, add_wall_with_niche};
use crate::housetop::{self, Housetop};
use crate::palette;
use crate::roof::dormer;
use crate::shape::Shape;
use crate::skin::Skin;
use crate::windows::{shutters, sill};
use glam::{Affine3A, Vec2, Vec3};

/// How far a house reaches below the ground at its front, and where [`foundation`] ends that it
/// stands on where the ground may fall more, in metres.
pub(crate) const FOUNDATION: f32 = 2.4;
const DEEP_FOUNDATION: f32 = 6.2;
/// Height of the ground floor over the street, in metres.
const PLINTH: f32 = 0.5;

/// What the walls are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Walls {
    Plaster,
    /// Timber-framed over a ground floor of stone, jutting out.
    Timber,
    Brick,
}

/// What is decided about a house before it is built.
#[derive(Clone, Debug)]
struct Design {
    width: f32,
    depth: f32,
    walls: Walls,
    /// Where storeys end, from the ground storey's top to the eaves, in metres.
    tops: Vec<f32>,
    /// How far the upper storeys jut out, in metres.
    jetty: f32,
    columns: usize,
    housetop: Housetop,
    wall_tint: Vec3,
    roof_tint: Vec3,
    wood_tint: Vec3,
    slate: bool,
    shop: bool,
    shutters: bool,
    flowers: bool,
    /// The left side stands free and has windows.
    corner: bool,
}

/// A row house; its left side has windows where `corner` is set.
///
/// * `width`, `depth` - in metres
/// * `dice` - decide everything else
pub(crate) fn row_house(width: f32, depth: f32, corner: bool, dice: &mut Dice) -> Shape {
    let design = design(width, depth, corner, dice);
    let mut shape = Shape::default();
    add_base(&mut shape, &design);
    add_front(&mut shape, &design, dice);
    add_back(&mut shape, &design);
    add_sides(&mut shape, &design);
    add_top(&mut shape, &design, dice);
    shape
}

/// What a house stands on where the ground falls.
pub(crate) fn foundation(width: f32, depth: f32) -> Shape {
    let half = width / 2.0;
    let mut shape = Shape::default();
    shape.shaft(
        Skin::Plinth,
        Vec3::new(-half, -DEEP_FOUNDATION, -depth),
        Vec3::new(half, -FOUNDATION, 0.0),
    );
    shape
}

fn design(width: f32, depth: f32, corner: bool, dice: &mut Dice) -> Design {
    let walls = dice.pick(&[
        Walls::Plaster,
        Walls::Plaster,
        Walls::Plaster,
        Walls::Timber,
        Walls::Timber,
        Walls::Brick,
    ]);
    let storeys = match dice.roll() {
        r if r < 0.15 => 2,
        r if r < 0.75 => 3,
        _ => 4,
    };
    let mut top = dice.between(3.2, 3.7);
    let height = dice.between(2.65, 3.0);
    let mut tops = vec![top];
    for _ in 1..storeys {
        top += height;
        tops.push(top);
    }
    let housetop = match walls {
        _ if corner && dice.chance(0.35) => Housetop::Hip,
        Walls::Plaster => dice.pick(&[
            Housetop::Eaves,
            Housetop::Eaves,
            Housetop::Mansard,
            Housetop::Gable,
            Housetop::Stepped,
        ]),
        Walls::Timber => dice.pick(&[Housetop::Gable, Housetop::Gable, Housetop::Eaves]),
        Walls::Brick => dice.pick(&[Housetop::Stepped, Housetop::Stepped, Housetop::Eaves]),
    };
    let jetty = match walls {
        Walls::Timber => dice.between(0.25, 0.4),
        _ => 0.0,
    };
    Design {
        width,
        depth,
        walls,
        tops,
        jetty,
        columns: ((width - 0.4) / 2.35).round() as usize,
        housetop,
        wall_tint: match walls {
            Walls::Timber => palette::timbered(dice),
            _ => palette::plaster(dice),
        },
        roof_tint: palette::roof(dice),
        wood_tint: palette::woodwork(dice),
        slate: housetop == Housetop::Mansard && dice.chance(0.6),
        shop: dice.chance(0.35),
        shutters: walls == Walls::Plaster && dice.chance(0.5),
        flowers: dice.chance(0.3),
        corner,
    }
}

impl Design {
    /// Of the ground storey and of those above: plain wall, wall around windows, reveals.
    fn skins(&self, storey: usize) -> [Skin; 3] {
        match (self.walls, storey) {
            (Walls::Plaster, _) => [Skin::Plaster, Skin::Plaster, Skin::Trim],
            (Walls::Timber, 0) => [Skin::Sandstone, Skin::Sandstone, Skin::Trim],
            (Walls::Timber, _) => [Skin::BracedPanel, Skin::WindowPanel, Skin::Beam],
            (Walls::Brick, _) => [Skin::Brick, Skin::Brick, Skin::Trim],
        }
    }

    fn eaves(&self) -> f32 {
        self.tops[self.tops.len() - 1]
    }

    /// The front of a storey.
    fn front(&self, storey: usize) -> Facade {
        let out = if storey == 0 { 0.0 } else { self.jetty };
        Facade {
            origin: Vec3::Z * out,
            right: Vec3::X,
            normal: Vec3::Z,
        }
    }

    fn back(&self) -> Facade {
        Facade {
            origin: Vec3::NEG_Z * self.depth,
            right: Vec3::NEG_X,
            normal: Vec3::NEG_Z,
        }
    }

    /// The free side, its coordinates from the front.
    fn left(&self) -> Facade {
        Facade {
            origin: Vec3::NEG_X * self.width / 2.0,
            right: Vec3::Z,
            normal: Vec3::NEG_X,
        }
    }

    /// Cells of a storey between two positions.
    fn cells(&self, storey: usize, [left, right]: [f32; 2], count: usize) -> Vec<Cell> {
        let bottom = match storey {
            0 => PLINTH,
            _ => self.tops[storey - 1],
        };
        let width = (right - left) / count as f32;
        (0..count)
            .map(|i| Cell {
                min: Vec2::new(left + width * i as f32, bottom),
                max: Vec2::new(left + width * (i + 1) as f32, self.tops[storey]),
            })
            .collect()
    }

    /// The window of a cell; in timber walls where the panel's picture leaves room for it.
    fn window(&self, cell: &Cell, storey: usize) -> Cell {
        let size = cell.max - cell.min;
        match self.walls {
            Walls::Timber if storey > 0 => {
                cell.opening(Vec2::new(0.444 * size.x, 0.528 * size.y), 0.278 * size.y)
            }
            _ => {
                let height: f32 = if storey == 0 { 1.45 } else { 1.6 };
                let width = (0.46 * size.x).min(1.1);
                cell.opening(Vec2::new(width, height.min(size.y - 1.0)), 0.75)
            }
        }
    }
}

/// Foundations, the plinth's cladding, and the beam under what juts out.
fn add_base(shape: &mut Shape, design: &Design) {
    let (half, depth) = (design.width / 2.0, design.depth);
    let inset = half - 0.03;
    shape.cuboid(
        Skin::Plinth,
        Vec3::new(-inset, -FOUNDATION, -depth - 0.06),
        Vec3::new(inset, PLINTH, 0.06),
    );
    shape.tint = design.wall_tint;
    for facade in [design.front(0), design.back()] {
        let below = [-half, half].map(|x| Vec2::new(x, -FOUNDATION));
        let above = [half, -half].map(|x| Vec2::new(x, PLINTH));
        let strip = [below[0], below[1], above[0], above[1]].map(|p| facade.at(p, 0.0));
        shape.face(Skin::Plinth, &strip);
    }
    if design.jetty > 0.0 {
        let (half, top) = (half + 0.02, design.tops[0]);
        shape.cuboid(
            Skin::Beam,
            Vec3::new(-half, top - 0.14, -0.3),
            Vec3::new(half, top + 0.12, design.jetty + 0.05),
        );
    }
}

fn add_front(shape: &mut Shape, design: &Design, dice: &mut Dice) {
    let half = design.width / 2.0;
    let door = dice.below(design.columns);
    for storey in 0..design.tops.len() {
        let facade = design.front(storey);
        let cells = design.cells(storey, [-half, half], design.columns);
        for (column, cell) in cells.iter().enumerate() {
            match storey {
                0 if column == door => add_door(shape, design, &facade, cell),
                0 if design.shop => add_shop(shape, design, &facade, cell),
                _ => add_window(shape, design, &facade, cell, storey),
            }
        }
    }
    if design.shop && dice.chance(0.4) {
        let tint = palette::cloth(dice);
        add_awning(shape, design.width - 0.8, design.tops[0] - 0.3, tint);
    }
}

/// A cell with a window in its niche and what hangs beside and under it.
fn add_window(shape: &mut Shape, design: &Design, facade: &Facade, cell: &Cell, storey: usize) {
    let [_, wall, reveal] = design.skins(storey);
    let opening = design.window(cell, storey);
    shape.tint = design.wall_tint;
    add_wall_with_niche(
        shape,
        facade,
        [wall, reveal],
        *cell,
        opening,
        storey % 2 == 1,
    );
    let size = opening.max - opening.min;
    let foot = Vec2::new((opening.min.x + opening.max.x) / 2.0, opening.min.y);
    let on_wall = Affine3A::from_mat3_translation(
        glam::Mat3::from_cols(facade.right, Vec3::Y, facade.normal),
        facade.at(foot, 0.0),
    );
    let stone = match reveal {
        Skin::Beam => Skin::Beam,
        _ => Skin::Trim,
    };
    shape.append_placed(&sill(size.x, stone), &on_wall);
    let room = (cell.max.x - cell.min.x - size.x) / 2.0;
    if design.shutters && storey > 0 && room > size.x / 2.0 {
        let skins = [Skin::PlainShutter, Skin::Paint];
        let leaves = shutters(size, skins, design.wood_tint);
        shape.append_placed(&leaves, &on_wall);
    }
    if design.flowers && storey == 1 {
        shape.append_placed(&flower_box(size.x), &on_wall);
    }
}

/// A box on the sill with flowers that hang over its front.
fn flower_box(width: f32) -> Shape {
    let mut shape = Shape::default();
    let half = width / 2.0;
    shape.tint = palette::tint(0x6b4a35);
    let low = Vec3::new(-half, 0.0, 0.02);
    shape.cuboid(Skin::Paint, low, Vec3::new(half, 0.2, 0.24));
    shape.tint = Vec3::ONE;
    for (bottom, top) in [([-0.12, 0.3], [0.42, 0.22]), ([0.02, 0.06], [0.5, 0.2])] {
        let at = |x: f32, [y, z]: [f32; 2]| Vec3::new(x, y, z);
        shape.picture(
            Skin::Flowers,
            [
                at(-half, bottom),
                at(half, bottom),
                at(half, top),
                at(-half, top),
            ],
        );
    }
    shape
}

/// A cell with a door behind its wall, and steps up to it.
fn add_door(shape: &mut Shape, design: &Design, facade: &Facade, cell: &Cell) {
    let [wall, _, reveal] = design.skins(0);
    let opening = cell.opening(Vec2::new(1.1, 2.3), 0.0);
    let (outer, inner) = (cell.corners(), opening.corners());
    shape.tint = design.wall_tint;
    for polygon in [
        [outer[0], inner[0], inner[3], outer[3]],
        [inner[1], outer[1], outer[2], inner[2]],
        [inner[3], inner[2], outer[2], outer[3]],
    ] {
        add_wall(shape, facade, wall, *cell, &polygon);
    }
    for i in 1..4 {
        let [a, b] = [inner[i], inner[(i + 1) % 4]];
        let corners = [(a, 0.0), (b, 0.0), (b, -NICHE_DEPTH), (a, -NICHE_DEPTH)];
        shape.face(reveal, &corners.map(|(p, out)| facade.at(p, out)));
    }
    shape.tint = design.wood_tint;
    shape.picture(Skin::HouseDoor, inner.map(|p| facade.at(p, -NICHE_DEPTH)));
    let center = (opening.min.x + opening.max.x) / 2.0;
    for (half, top, out) in [(0.7, 0.48, 0.38), (0.85, 0.31, 0.68), (1.0, 0.15, 0.98)] {
        shape.cuboid(
            Skin::Granite,
            Vec3::new(center - half, -1.2, -0.1),
            Vec3::new(center + half, top, out),
        );
    }
}

/// A cell with a shop window that stands out of its wall.
fn add_shop(shape: &mut Shape, design: &Design, facade: &Facade, cell: &Cell) {
    let [wall, ..] = design.skins(0);
    shape.tint = design.wall_tint;
    add_wall(shape, facade, wall, *cell, &cell.corners());
    let size = cell.max - cell.min;
    let front = cell.opening(Vec2::new(size.x - 0.3, size.y - 0.35), 0.05);
    shape.tint = design.wood_tint;
    add_raised(shape, facade, [Skin::ShopFront, Skin::Paint], &front, 0.1);
}

/// A picture in front of a wall, with rims.
pub(crate) fn add_raised(
    shape: &mut Shape,
    facade: &Facade,
    [picture, rim]: [Skin; 2],
    cell: &Cell,
    out: f32,
) {
    let corners = cell.corners();
    shape.picture(picture, corners.map(|p| facade.at(p, out)));
    for i in 0..4 {
        let [a, b] = [corners[i], corners[(i + 1) % 4]];
        let side = [(a, 0.0), (b, 0.0), (b, out), (a, out)];
        shape.face(rim, &side.map(|(p, out)| facade.at(p, out)));
    }
}

/// Striped cloth over a shop, closed all around.
fn add_awning(shape: &mut Shape, width: f32, top: f32, tint: Vec3) {
    let stripes = (width / 0.7).round().max(3.0) as usize;
    let section = [
        [top, -0.02],
        [top - 0.75, 1.35],
        [top - 0.95, 1.35],
        [top - 0.2, -0.02],
    ];
    for i in 0..stripes {
        let from = width * (i as f32 / stripes as f32 - 0.5);
        let outline = section.map(|[y, z]| Vec3::new(from, y, z));
        shape.tint = match i % 2 {
            0 => tint,
            _ => palette::tint(palette::WHITE),
        };
        shape.prism(Skin::Paint, &outline, Vec3::X * (width / stripes as f32));
    }
}

/// Fewer and simpler windows, behind the house and on its free side.
fn add_plain_windows(shape: &mut Shape, facade: &Facade, cells: &[Cell], design: &Design) {
    for (i, cell) in cells.iter().enumerate() {
        if i % 2 == 0 || cells.len() < 3 {
            let size = (cell.max - cell.min).min(Vec2::new(2.0, 2.9));
            let opening = cell.opening(Vec2::new(0.5 * size.x, 0.55 * size.y), 0.75);
            let rim = match design.walls {
                Walls::Timber => Skin::Beam,
                _ => Skin::Trim,
            };
            add_raised(shape, facade, [Skin::Pane, rim], &opening, 0.05);
        }
    }
}

fn add_back(shape: &mut Shape, design: &Design) {
    let (half, facade) = (design.width / 2.0, design.back());
    let skin = match design.walls {
        Walls::Brick => Skin::Brick,
        _ => Skin::Plaster,
    };
    shape.tint = design.wall_tint;
    let corners = [
        [-half, PLINTH],
        [half, PLINTH],
        [half, design.eaves()],
        [-half, design.eaves()],
    ];
    shape.face(skin, &corners.map(|p| facade.at(Vec2::from(p), 0.0)));
    for storey in 1..design.tops.len() {
        let cells = design.cells(storey, [-half, half], design.columns);
        add_plain_windows(shape, &facade, &cells, design);
    }
}

/// Walls to both sides, up into the roof.
fn add_sides(shape: &mut Shape, design: &Design) {
    let skin = match design.walls {
        Walls::Brick => Skin::Brick,
        _ => Skin::Plaster,
    };
    let (half, eaves, ground) = (design.width / 2.0, design.eaves(), design.tops[0]);
    let (back, front) = (-design.depth, design.jetty);
    let lower = [
        [back, -FOUNDATION],
        [0.0, -FOUNDATION],
        [0.0, ground],
        [back, ground],
    ];
    let mut upper = vec![[front, eaves]];
    let top = housetop::side_outline(design.housetop, [back, front], eaves);
    upper.extend(top);
    upper.extend([[back, eaves], [back, ground], [0.0, ground]]);
    if front > 0.0 {
        upper.push([front, ground]);
    }
    shape.tint = design.wall_tint;
    for x in [-half, half] {
        let place = |[z, y]: &[f32; 2]| Vec3::new(x, *y, *z);
        let mut lower: Vec<Vec3> = lower.iter().map(place).collect();
        let mut upper: Vec<Vec3> = upper.iter().map(place).collect();
        // Seen from the left, z runs to the right.
        if x > 0.0 {
            lower.reverse();
            upper.reverse();
        }
        shape.face(skin, &lower);
        shape.face(skin, &upper);
    }
    if design.corner {
        let facade = design.left();
        let count = (design.depth / 3.0) as usize;
        for storey in 0..design.tops.len() {
            let cells = design.cells(storey, [back + 0.5, -0.5], count);
            add_plain_windows(shape, &facade, &cells, design);
        }
    }
}

/// Roof, gable, dormers and chimney.
fn add_top(shape: &mut Shape, design: &Design, dice: &mut Dice) {
    let (half, eaves) = (design.width / 2.0, design.eaves());
    let span = [-design.depth, design.jetty];
    let tiles = if design.slate {
        Skin::Slates
    } else {
        Skin::Tiles
    };
    shape.tint = design.roof_tint;
    housetop::add_roof(shape, design.housetop, tiles, half, span, eaves);

    let front = design.front(design.tops.len() - 1);
    let [plain, around, reveal] = design.skins(1);
    match design.housetop {
        Housetop::Gable => {
            shape.tint = design.wall_tint;
            housetop::add_front_gable(shape, &front, [plain, around, reveal], half, eaves);
            let back = design.back();
            housetop::add_plain_gable(shape, &back, Skin::Plaster, half, eaves);
        }
        Housetop::Stepped => {
            shape.tint = design.wall_tint;
            housetop::add_steps(shape, &front, plain, half, eaves);
            let back = design.back();
            housetop::add_plain_gable(shape, &back, plain, half, eaves);
        }
        Housetop::Eaves | Housetop::Mansard => {
            let count = match design.width {
                w if w < 6.5 => 1,
                w if w < 8.5 => dice.below(2) + 1,
                _ => 2 + dice.below(2),
            };
            add_dormers(shape, design, count);
        }
        Housetop::Hip => {}
    }
    let ridge = housetop::ridge_height(design.housetop, half, span, eaves);
    let scale = 0.72;
    // Inside of the attic, wherever on the roof it comes out.
    let foot = eaves;
    let height = (ridge + 1.2 - foot) / scale;
    let x = (half - 1.0) * if dice.chance(0.5) { 0.8 } else { -0.8 };
    let z = (span[0] + span[1]) / 2.0 + dice.between(-1.0, 0.2);
    let at = Affine3A::from_scale_rotation_translation(
        Vec3::splat(scale),
        glam::Quat::IDENTITY,
        Vec3::new(x, foot, z),
    );
    shape.append_placed(&chimney(height), &at);
}

fn add_dormers(shape: &mut Shape, design: &Design, count: usize) {
    let scale = 0.62;
    let dormer = dormer(design.roof_tint);
    let inward = match design.housetop {
        Housetop::Mansard => 0.3,
        _ => 0.9,
    };
    let height = housetop::roof_height(design.housetop, inward);
    for i in 0..count {
        let x = design.width * ((i as f32 + 0.5) / count as f32 - 0.5);
        let at = Vec3::new(x, design.eaves() + height, design.jetty - inward);
        let place =
            Affine3A::from_scale_rotation_translation(Vec3::splat(scale), glam::Quat::IDENTITY, at);
        shape.append_placed(&dormer, &place);
    }
}
