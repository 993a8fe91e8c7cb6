//! A piece of a mesh, laid out in a plane.

use super::cells::Cells;
use super::plane::{Plane, normal};
use super::rectangle::{Rectangle, hull};
use glam::{DVec2, DVec3, Vec3};

/// What pieces are made of.
pub(super) struct Surface {
    corners: Vec<[DVec3; 3]>,
    normals: Vec<DVec3>,
    densities: Vec<f64>,
    pub gutter: u32,
}

impl Surface {
    pub(super) fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        densities: &[f32],
        gutter: u32,
    ) -> Self {
        let at = |t: &[u32; 3]| t.map(|v| positions[v as usize].as_dvec3());
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(at).collect();
        Self {
            normals: corners.iter().copied().map(normal).collect(),
            corners,
            densities: densities.iter().copied().map(f64::from).collect(),
            gutter,
        }
    }

    pub(super) fn places(&self, triangle: u32, plane: &Plane) -> [DVec2; 3] {
        self.corners[triangle as usize].map(|corner| plane.place(corner))
    }

    /// The texels that triangles need per unit of length in a plane, so that those tilted against
    /// it have their own density in every direction; `None` where one is tilted too far.
    fn density(&self, triangles: &[u32], plane: &Plane) -> Option<f64> {
        triangles.iter().try_fold(0.0, |most, t| {
            let cosine = self.normals[*t as usize].dot(plane.axis).min(1.0);
            (cosine >= LEAST_COSINE).then(|| f64::max(most, self.densities[*t as usize] / cosine))
        })
    }

    /// About the direction that the farthest off of two pieces' normals is least far off.
    fn middle(&self, pieces: [&Piece; 2], start: DVec3) -> DVec3 {
        let mut middle = start;
        for step in 1..=STEPS {
            let triangles = pieces.iter().flat_map(|piece| &piece.triangles);
            let normals = triangles.map(|t| self.normals[*t as usize]);
            let (_, farthest) =
                normals.fold((f64::INFINITY, start), |(least, farthest), normal| {
                    let cosine = normal.dot(middle);
                    match cosine < least {
                        true => (cosine, normal),
                        false => (least, farthest),
                    }
                });
            // Smaller and smaller steps, each towards what is farthest off.
            middle = middle.lerp(farthest, 1.0 / f64::from(step + 1));
            middle = middle.normalize_or(start);
        }
        middle
    }
}

/// Of the search for the middle of normals: to within a few degrees.
const STEPS: u32 = 9;

/// Of the angle between a triangle and the plane of its chart: 60 degrees.
///
/// The faces of a voxel are at 54.7 degrees to a plane across its diagonal, so stairs in whatever
/// direction can be one chart. Farther on, what the whole chart grows by for the tilted triangle's
/// sake hardly ever pays: without a limit there are up to four charts fewer in a hundred.
pub(super) const LEAST_COSINE: f64 = 0.5;

/// Triangles that are connected, and do not overlap seen along the axis of a plane.
pub(super) struct Piece {
    pub triangles: Vec<u32>,
    pub plane: Plane,
    pub layout: Layout,
    cells: Cells,
}

/// How much room triangles take in a plane.
pub(super) struct Layout {
    /// Texels per unit of length.
    density: f64,
    hull: Vec<DVec2>,
    pub rectangle: Rectangle,
}

impl Layout {
    fn new(density: f64, points: Vec<DVec2>, gutter: u32) -> Self {
        let hull = hull(points);
        Self {
            density,
            rectangle: Rectangle::around(&hull, density, gutter),
            hull,
        }
    }
}

impl Piece {
    pub(super) fn single(surface: &Surface, triangle: u32) -> Self {
        let plane = Plane::new(surface.normals[triangle as usize]);
        let places = surface.places(triangle, &plane);
        let mut cells = Cells::default();
        cells.insert_apart(triangle, |t| surface.places(t, &plane));
        let density = surface.densities[triangle as usize];
        Self {
            triangles: vec![triangle],
            plane,
            layout: Layout::new(density, places.to_vec(), surface.gutter),
            cells,
        }
    }

    /// In texels, the gutter included.
    pub(super) fn area(&self) -> u64 {
        self.layout.rectangle.area()
    }

    /// How this and a smaller piece could be laid out as one, the tightest way first.
    ///
    /// In this one's plane only the smaller one's triangles are looked at. Other planes are tried
    /// where this one has not many times as many, so no triangle is looked at too often.
    pub(super) fn layouts_with(&self, small: &Self, surface: &Surface) -> Vec<(Plane, Layout)> {
        let mut planes = vec![self.plane];
        let flat = self.plane.is_parallel(&small.plane);
        if !flat && self.triangles.len() <= FEW.max(4 * small.triangles.len()) {
            let axes = [self, small].map(|piece| piece.plane.axis);
            let between = (axes[0] + axes[1]).normalize_or(axes[0]);
            let middle = surface.middle([self, small], between);
            planes.extend([small.plane, Plane::new(between), Plane::new(middle)]);
        }
        let lay_out = |plane: Plane| Some((plane, self.layout_in(&plane, small, surface)?));
        let mut found: Vec<(Plane, Layout)> = planes.into_iter().filter_map(lay_out).collect();
        found.sort_by_key(|(_, layout)| layout.rectangle.area());
        found
    }

    fn layout_in(&self, plane: &Plane, small: &Self, surface: &Surface) -> Option<Layout> {
        let mut density = surface.density(&small.triangles, plane)?;
        let mut points = Vec::new();
        let mut add = |piece: &Self| match piece.plane.axis == plane.axis {
            true => points.extend(&piece.layout.hull),
            false => {
                let places = |t: &u32| surface.places(*t, plane);
                points.extend(piece.triangles.iter().flat_map(places));
            }
        };
        add(self);
        add(small);
        density = density.max(match self.plane.axis == plane.axis {
            true => self.layout.density,
            false => surface.density(&self.triangles, plane)?,
        });
        Some(Layout::new(density, points, surface.gutter))
    }

    /// Takes a smaller piece in, unless triangles would overlap.
    pub(super) fn take_in(
        &mut self,
        small: &Self,
        (plane, layout): (Plane, Layout),
        surface: &Surface,
    ) -> bool {
        let places = |t: u32| surface.places(t, &plane);
        if plane.axis == self.plane.axis {
            let mut done = 0..0;
            for triangle in &small.triangles {
                if !self.cells.insert_apart(*triangle, places) {
                    let inserted = &small.triangles[done];
                    inserted
                        .iter()
                        .for_each(|t| self.cells.remove(*t, places(*t)));
                    return false;
                }
                done.end += 1;
            }
        } else {
            let mut cells = Cells::default();
            let mut all = self.triangles.iter().chain(&small.triangles);
            if !all.all(|t| cells.insert_apart(*t, places)) {
                return false;
            }
            self.cells = cells;
        }
        self.triangles.extend(&small.triangles);
        (self.plane, self.layout) = (plane, layout);
        true
    }
}

/// Triangles of a piece that may be looked at whenever a neighbour is.
const FEW: usize = 16;
