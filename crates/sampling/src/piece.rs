//! What of a triangle is recorded: which layers and rows it can touch, and its parts in slabs of
//! depth.

use crate::coverage::Outline;
use crate::geometry::Drawn;
use farfield_scene::Scene;
use farfield_views::{Camera, Pose};
use glam::{DVec2, DVec3, DVec4};
use std::cmp::Ordering;
use std::ops::Range;

/// A triangle and what it can touch.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) drawn: Drawn,
    /// In view space.
    pub(crate) corners: [DVec3; 3],
    /// Columns and rows that its bounds touch.
    pub(crate) columns: Range<u32>,
    pub(crate) rows: Range<u32>,
    pub(crate) layers: Range<u32>,
    /// Whether it may lie over the centre of a texel.
    pub(crate) may_cover_centers: bool,
    /// Whether the camera sees its front, or its back is as good.
    pub(crate) front: bool,
}

/// A corner of the view cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint {
    /// Homogeneous, in view space.
    point: DVec4,
    /// Of its first three coordinates.
    length: f64,
}

impl Viewpoint {
    /// `point` - homogeneous, in the world
    pub(crate) fn new(pose: &Pose, point: DVec4) -> Self {
        let in_view = pose.view_from_world() * (point.truncate() - pose.eye * point.w);
        Self {
            point: in_view.extend(point.w),
            length: in_view.length(),
        }
    }

    /// Along the line of sight to a point in view space, of any length.
    pub(crate) fn sight_of(&self, point: DVec3) -> DVec3 {
        point * self.point.w - self.point.truncate()
    }
}

impl Piece {
    /// `None` where no viewpoint of the cell can see the triangle, or the camera's extent misses
    /// it.
    ///
    /// # Panics
    ///
    /// When a corner does not lie before the camera.
    #[inline]
    pub(crate) fn new(
        scene: &Scene,
        camera: &Camera,
        borders: &[f64],
        cell: &[Viewpoint],
        drawn: Drawn,
        corners: [DVec3; 3],
    ) -> Option<Self> {
        let [a, b, c] = corners;
        assert!(
            corners.iter().all(|corner| corner.z > 0.0),
            "triangle {} of object {} does not lie before the camera",
            drawn.triangle,
            drawn.object
        );
        let normal = (b - a).cross(c - a);
        let material = scene.triangle_materials[drawn.triangle as usize];
        let double_sided = scene.materials[material as usize].double_sided;
        if !double_sided && !is_seen(normal, a, cell) {
            return None;
        }
        let texels = in_texels(camera, corners);
        let outline = Outline::new(&texels);
        let columns = outline.columns_of_bounds(camera.width as usize);
        let rows = outline.rows(camera.height as usize);
        if columns.is_empty() || rows.is_empty() {
            return None;
        }
        let last = borders.len() - 2;
        let (near, far) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        // Slabs are closed: one that ends where the triangle begins holds a point of it.
        let before = borders.partition_point(|border| *border < near);
        let first = before.saturating_sub(1).min(last);
        // Most triangles end where they begin.
        let up_to = borders[before..]
            .iter()
            .take_while(|border| **border <= far);
        let end = (before + up_to.count()).clamp(first + 1, last + 1);
        Some(Self {
            drawn,
            corners,
            columns: *columns.start() as u32..*columns.end() as u32 + 1,
            rows: *rows.start() as u32..*rows.end() as u32 + 1,
            layers: first as u32..end as u32,
            may_cover_centers: outline.may_cover_centers(),
            front: double_sided || normal.dot(a) <= 0.0,
        })
    }

    /// Its corners in texels: computed again where they are needed, which is rare, so that pieces
    /// are small.
    pub(crate) fn texels(&self, camera: &Camera) -> [DVec2; 3] {
        in_texels(camera, self.corners)
    }

    /// Its layers.
    pub(crate) fn layers(&self) -> Range<usize> {
        self.layers.start as usize..self.layers.end as usize
    }
}

fn in_texels(camera: &Camera, [a, b, c]: [DVec3; 3]) -> [DVec2; 3] {
    [
        camera.pixel_from_view(a),
        camera.pixel_from_view(b),
        camera.pixel_from_view(c),
    ]
}

/// Whether a corner of the cell lies in front of the plane through `a`; in doubt it does: rounding
/// of products of three lengths is far below 1e-12 of them. Sums of coordinates stand for lengths.
fn is_seen(normal: DVec3, a: DVec3, cell: &[Viewpoint]) -> bool {
    let length = |v: DVec3| v.abs().element_sum();
    let (unit, distance) = (1e-12 * length(normal), length(a));
    cell.iter().any(|Viewpoint { point, length }| {
        let doubt = unit * (length + distance * point.w);
        normal.dot(point.truncate() - a * point.w) > -doubt
    })
}

/// A corner of a part of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// In view space.
    pub(crate) point: DVec3,
    /// Barycentric coordinates in the whole triangle.
    pub(crate) weights: DVec3,
}

/// The triangle itself.
pub(crate) fn whole(corners: [DVec3; 3]) -> [Corner; 3] {
    [0, 1, 2].map(|i| Corner {
        point: corners[i],
        weights: DVec3::AXES[i],
    })
}

/// Cuts a triangle to a closed slab of depths; what remains is convex, with at most five corners,
/// perhaps one point or a segment where the triangle only touches the slab.
///
/// * `borders` - near and far one of the slab, if it has one
/// * `scratch`, `polygon` - overwritten, the latter by the result
pub(crate) fn cut_to_slab(
    corners: [DVec3; 3],
    borders: [Option<f64>; 2],
    scratch: &mut Vec<Corner>,
    polygon: &mut Vec<Corner>,
) {
    let whole = whole(corners);
    let is_beyond = |z, border| z >= border;
    let is_before = |z, border| z <= border;
    match borders {
        [None, None] => {
            polygon.clear();
            polygon.extend(whole);
        }
        [Some(near), None] => cut(&whole, near, is_beyond, polygon),
        [None, Some(far)] => cut(&whole, far, is_before, polygon),
        [Some(near), Some(far)] => {
            cut(&whole, near, is_beyond, scratch);
            cut(scratch, far, is_before, polygon);
        }
    }
}

fn cut(polygon: &[Corner], border: f64, keeps: impl Fn(f64, f64) -> bool, rest: &mut Vec<Corner>) {
    rest.clear();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[if i + 1 == polygon.len() { 0 } else { i + 1 }];
        let kept = [a, b].map(|corner| keeps(corner.point.z, border));
        if kept[0] {
            rest.push(*a);
        }
        // A corner on the border is kept itself; it needs no cut point beside it.
        if kept[0] != kept[1] && a.point.z != border && b.point.z != border {
            rest.push(cut_point(a, b, border));
        }
    }
}

/// Where an edge meets a border, the same bits from either end.
fn cut_point(a: &Corner, b: &Corner, border: f64) -> Corner {
    let ordered = a.point.to_array().partial_cmp(&b.point.to_array()) != Some(Ordering::Greater);
    let (a, b) = if ordered { (a, b) } else { (b, a) };
    let t = (border - a.point.z) / (b.point.z - a.point.z);
    Corner {
        point: (a.point + (b.point - a.point) * t).with_z(border),
        weights: a.weights + (b.weights - a.weights) * t,
    }
}
