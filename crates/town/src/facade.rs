//! Walls: rectangular cells side by side, some with a window niche.

use crate::shape::Shape;
use crate::skin::{Fit, Skin};
use glam::{DAffine3, DMat3, Vec2, Vec3};

/// How far panes lie behind the wall, in metres.
pub(crate) const NICHE_DEPTH: f32 = 0.22;

/// A vertical plane with coordinates of its own: x to the right seen from outside, y up, z out of
/// the wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facade {
    pub(crate) origin: Vec3,
    pub(crate) right: Vec3,
    pub(crate) normal: Vec3,
}

impl Facade {
    /// The four sides of a box around the y axis: front, right, back, left.
    pub(crate) fn around(half_width: f32, half_depth: f32) -> [Self; 4] {
        let facade = |right: Vec3, normal: Vec3, distance: f32| Self {
            origin: normal * distance,
            right,
            normal,
        };
        [
            facade(Vec3::X, Vec3::Z, half_depth),
            facade(Vec3::NEG_Z, Vec3::X, half_width),
            facade(Vec3::NEG_X, Vec3::NEG_Z, half_depth),
            facade(Vec3::Z, Vec3::NEG_X, half_width),
        ]
    }

    /// The point at (x, y), `out` metres in front of the wall.
    pub(crate) fn at(&self, p: Vec2, out: f32) -> Vec3 {
        self.origin + self.right * p.x + Vec3::Y * p.y + self.normal * out
    }

    /// Places a mesh with its origin at (x, y) on the wall and its z axis out of it.
    pub(crate) fn world_from_wall(&self, p: Vec2) -> DAffine3 {
        let axes = DMat3::from_cols(
            self.right.as_dvec3(),
            glam::DVec3::Y,
            self.normal.as_dvec3(),
        );
        DAffine3::from_mat3_translation(axes, self.at(p, 0.0).as_dvec3())
    }
}

/// A rectangle on a wall, in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub(crate) min: Vec2,
    pub(crate) max: Vec2,
}

impl Cell {
    /// Counter-clockwise from the lower left.
    pub(crate) fn corners(&self) -> [Vec2; 4] {
        [
            self.min,
            Vec2::new(self.max.x, self.min.y),
            self.max,
            Vec2::new(self.min.x, self.max.y),
        ]
    }

    /// Texture coordinates that fit one texture into the cell.
    fn uv(&self, p: Vec2) -> Vec2 {
        let t = (p - self.min) / (self.max - self.min);
        Vec2::new(t.x, 1.0 - t.y)
    }

    /// The opening of `size` centred in the cell's width, its lower edge `above` the cell's.
    pub(crate) fn opening(&self, size: Vec2, above: f32) -> Cell {
        let center = (self.min.x + self.max.x) / 2.0;
        let min = Vec2::new(center - size.x / 2.0, self.min.y + above);
        Cell {
            min,
            max: min + size,
        }
    }
}

/// Adds a convex polygon of the wall, a part of `cell`, its texture laid on as the skin demands.
pub(crate) fn add_wall(
    shape: &mut Shape,
    facade: &Facade,
    skin: Skin,
    cell: Cell,
    polygon: &[Vec2],
) {
    let corners: Vec<Vec3> = polygon.iter().map(|&p| facade.at(p, 0.0)).collect();
    let fitted =
        |uv: &dyn Fn(Vec2) -> Vec2| -> Vec<Vec2> { polygon.iter().map(|&p| uv(p)).collect() };
    match skin.fit() {
        Fit::Metres => shape.face(skin, &corners),
        Fit::Storey => {
            let uvs = fitted(&|p| Vec2::new(p.x / skin.metres(), cell.uv(p).y));
            shape.fitted(skin, &corners, &uvs);
        }
        Fit::Cell => shape.fitted(skin, &corners, &fitted(&|p| cell.uv(p))),
    }
}

/// Adds a cell with a niche: the wall around the opening, three reveals and the pane behind.
///
/// The window's sill, which is a part of [`windows`](crate::windows), closes the niche's bottom.
/// `flip` mirrors the pane's reflections.
pub(crate) fn add_wall_with_niche(
    shape: &mut Shape,
    facade: &Facade,
    [wall, reveal]: [Skin; 2],
    cell: Cell,
    opening: Cell,
    flip: bool,
) {
    let (outer, inner) = (cell.corners(), opening.corners());
    for i in 0..4 {
        let j = (i + 1) % 4;
        add_wall(
            shape,
            facade,
            wall,
            cell,
            &[outer[i], outer[j], inner[j], inner[i]],
        );
    }
    for i in 1..4 {
        let [a, b] = [inner[i], inner[(i + 1) % 4]];
        let corners = [(a, 0.0), (b, 0.0), (b, -NICHE_DEPTH), (a, -NICHE_DEPTH)];
        shape.face(reveal, &corners.map(|(p, out)| facade.at(p, out)));
    }
    let pane = inner.map(|p| facade.at(p, -NICHE_DEPTH));
    let uvs = inner.map(|p| {
        let uv = opening.uv(p);
        match flip {
            true => Vec2::new(1.0 - uv.x, uv.y),
            false => uv,
        }
    });
    shape.fitted(Skin::Pane, &pane, &uvs);
}
