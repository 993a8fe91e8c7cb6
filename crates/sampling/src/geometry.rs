//! Triangles as a camera sees them.

use farfield_scene::Scene;
use farfield_views::{Camera, Extent, Pose};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// One triangle of one object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Drawn {
    pub(crate) object: u32,
    pub(crate) triangle: u32,
}

/// Consecutive triangles of one object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) object: u32,
    pub(crate) triangles: Range<u32>,
}

/// Triangles that one thread sets up at a time.
const RUN: u32 = 1024;

/// Triangles that are set up before they are drawn. Bounds the memory for what is set up, which
/// would otherwise follow the triangles drawn: with instances these can be many more than are
/// stored. Far fewer would not keep 16 cores busy.
const BATCH: u32 = 1 << 17;

/// All triangles of all objects, objects first, in batches of runs.
pub(crate) fn batches(scene: &Scene) -> impl Iterator<Item = Vec<Run>> {
    let mut runs = (0..scene.objects.len() as u32).flat_map(|object| {
        let Range { start, end } = scene.mesh_of(object).triangles;
        (start..end).step_by(RUN as usize).map(move |first| Run {
            object,
            triangles: first..end.min(first.saturating_add(RUN)),
        })
    });
    std::iter::from_fn(move || {
        let mut batch = Vec::new();
        let mut rest = BATCH;
        while rest > 0
            && let Some(run) = runs.next()
        {
            rest = rest.saturating_sub(run.triangles.len() as u32);
            batch.push(run);
        }
        (!batch.is_empty()).then_some(batch)
    })
}

/// The triangles of a run, and their corners as [`corners_in_view`] gives them.
pub(crate) fn run_in_view(
    scene: &Scene,
    pose: &Pose,
    run: &Run,
) -> impl Iterator<Item = (Drawn, [DVec3; 3])> {
    let object = run.object;
    let world_from_mesh = scene.objects[object as usize].world_from_mesh;
    let mirrored = scene.objects[object as usize].is_mirrored();
    let pose = *pose;
    run.triangles.clone().map(move |triangle| {
        let [a, b, c] = scene.triangles[triangle as usize];
        let [b, c] = if mirrored { [c, b] } else { [b, c] };
        let in_view = |vertex: u32| {
            let in_mesh = scene.positions[vertex as usize].as_dvec3();
            pose.point_in_view(world_from_mesh.transform_point3(in_mesh))
        };
        // One by one: `map` of an array is a call here, and this is a tenth of a bake.
        let corners = [in_view(a), in_view(b), in_view(c)];
        (Drawn { object, triangle }, corners)
    })
}

/// Corners of a triangle in view space, counter-clockwise seen from the front.
///
/// The same vertex gives the same bits in every triangle that shares it.
pub(crate) fn corners_in_view(scene: &Scene, pose: &Pose, drawn: Drawn) -> [DVec3; 3] {
    let world_from_mesh = &scene.objects[drawn.object as usize].world_from_mesh;
    scene
        .triangle_in(drawn.object, drawn.triangle)
        .map(|vertex| {
            let in_mesh = scene.positions[vertex as usize].as_dvec3();
            pose.point_in_view(world_from_mesh.transform_point3(in_mesh))
        })
}

/// Lateral bounds per unit of depth, and least and greatest depth, of all that is drawn, seen from
/// a pose; `None` where nothing is drawn.
///
/// # Panics
///
/// When a vertex does not lie before the pose.
pub fn seen_bounds(scene: &Scene, pose: &Pose) -> Option<(Extent, [f64; 2])> {
    let bounds = |(drawn, points): (Drawn, [DVec3; 3])| {
        assert!(
            points.iter().all(|point| point.z > 0.0),
            "triangle {} of object {} does not lie before the viewer",
            drawn.triangle,
            drawn.object
        );
        // (x / z, y / z, z)
        let bounds = points
            .map(|point| (point / point.z).with_z(point.z))
            .map(|p| [p, p]);
        bounds.into_iter().reduce(enclose).unwrap_or_default()
    };
    let of_batch = |batch: Vec<Run>| {
        batch
            .par_iter()
            .filter_map(|run| run_in_view(scene, pose, run).map(bounds).reduce(enclose))
            .reduce_with(enclose)
    };
    let [min, max] = batches(scene).filter_map(of_batch).reduce(enclose)?;
    let extent = Extent {
        min: min.truncate(),
        max: max.truncate(),
    };
    Some((extent, [min.z, max.z]))
}

fn enclose([min_a, max_a]: [DVec3; 2], [min_b, max_b]: [DVec3; 2]) -> [DVec3; 2] {
    [min_a.min(min_b), max_a.max(max_b)]
}

/// Barycentric coordinates over the pixels of a camera, perspective-correct.
///
/// With the corners as columns of a matrix M, the ray through a pixel with direction d meets the
/// triangle's plane where M w = d, so w is linear in the pixel; barycentric coordinates are w
/// over its sum, and the sum is the reciprocal depth (M. Olano and T. Greer, Triangle Scan
/// Conversion Using 2D Homogeneous Coordinates, 1997).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interpolation {
    /// w at pixel coordinates (0, 0).
    origin: DVec3,
    /// Growth of w per column.
    per_x: DVec3,
    /// Growth of w per row.
    per_y: DVec3,
}

impl Interpolation {
    /// `None` where the camera lies in the triangle's plane.
    pub(crate) fn new(camera: &Camera, [a, b, c]: [DVec3; 3]) -> Option<Self> {
        let rows = [b.cross(c), c.cross(a), a.cross(b)];
        let determinant = a.dot(rows[0]);
        let scale = determinant.recip();
        if !scale.is_finite() {
            return None;
        }
        let solve = |d: DVec3| DVec3::from(rows.map(|row| row.dot(d) * scale));
        let pixel = camera.pixel_size();
        Some(Self {
            origin: solve(camera.extent.min.extend(1.0)),
            per_x: solve(DVec3::X * pixel.x),
            per_y: solve(DVec3::Y * pixel.y),
        })
    }

    /// Reciprocal depth at pixel coordinates.
    pub(crate) fn inverse_depth(&self, pixel: DVec2) -> f64 {
        self.weights(pixel).element_sum()
    }

    /// Barycentric coordinates at pixel coordinates; outside of the triangle some are negative.
    pub(crate) fn barycentric(&self, pixel: DVec2) -> DVec3 {
        let w = self.weights(pixel);
        w / w.element_sum()
    }

    /// Growth of the barycentric coordinates per column and per row at pixel coordinates.
    pub(crate) fn derivatives(&self, pixel: DVec2) -> [DVec3; 2] {
        let w = self.weights(pixel);
        let sum = w.element_sum();
        [self.per_x, self.per_y].map(|per| (per * sum - w * per.element_sum()) / (sum * sum))
    }

    /// Barycentric coordinates over the depth, at pixel coordinates.
    pub(crate) fn weights(&self, pixel: DVec2) -> DVec3 {
        self.origin + self.per_x * pixel.x + self.per_y * pixel.y
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use farfield_scene::{Material, Mesh, Object};
    use glam::{DAffine3, Vec2, Vec3, Vec4};
    use proptest::prelude::*;

    /// Three points a triangle, one single-sided opaque material, one object.
    pub(crate) fn soup(points: &[[f32; 3]]) -> Scene {
        let count = points.len() as u32;
        Scene {
            positions: points.iter().copied().map(Vec3::from).collect(),
            normals: vec![Vec3::Y; points.len()],
            uvs: vec![Vec2::ZERO; points.len()],
            colors: vec![Vec4::ONE; points.len()],
            triangles: (0..count / 3)
                .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
                .collect(),
            triangle_materials: vec![0; points.len() / 3],
            meshes: vec![Mesh {
                vertices: 0..count,
                triangles: 0..count / 3,
            }],
            objects: vec![Object {
                name: "soup".into(),
                mesh: 0,
                world_from_mesh: DAffine3::IDENTITY,
            }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    fn camera() -> Camera {
        Camera {
            pose: Pose::looking_along(DVec3::ZERO, DVec3::Z),
            extent: Extent {
                min: DVec2::new(-0.5, -0.2),
                max: DVec2::new(0.1, 0.4),
            },
            width: 120,
            height: 100,
        }
    }

    #[test]
    fn batches_hold_every_triangle_once_and_in_order() {
        let mut scene = soup(&[]);
        scene.meshes[0].triangles = 0..3 * RUN + 5;
        scene.objects = vec![scene.objects[0].clone(); 50];
        let (mut object, mut next, mut largest) = (0, 0, 0);
        for batch in batches(&scene) {
            let count = batch
                .iter()
                .map(|run| run.triangles.len() as u32)
                .sum::<u32>();
            largest = count.max(largest);
            for run in batch {
                assert_eq!((run.object, run.triangles.start), (object, next));
                assert!(!run.triangles.is_empty() && run.triangles.len() <= RUN as usize);
                next = run.triangles.end;
                if next == 3 * RUN + 5 {
                    (object, next) = (object + 1, 0);
                }
            }
        }
        assert_eq!((object, next), (50, 0));
        assert!(largest < BATCH + RUN, "a batch holds {largest} triangles");
    }

    proptest! {
        /// Every vertex lies within the bounds, and each bound is reached by one.
        #[test]
        fn seen_bounds_are_tight(
            points in prop::collection::vec([-2.0..2.0f32, -2.0..2.0f32, 0.5..4.0f32], 6),
        ) {
            let pose = camera().pose;
            let (extent, [near, far]) = seen_bounds(&soup(&points), &pose).unwrap();
            let seen: Vec<DVec3> = points.iter()
                .map(|p| pose.point_in_view(Vec3::from(*p).as_dvec3()))
                .map(|p| (p / p.z).with_z(p.z)).collect();
            let least = seen.iter().copied().reduce(DVec3::min).unwrap();
            let greatest = seen.iter().copied().reduce(DVec3::max).unwrap();
            prop_assert_eq!((extent.min.extend(near), extent.max.extend(far)), (least, greatest));
        }

        /// Projecting any point of a triangle and interpolating there gives the point's own
        /// barycentric coordinates and depth, and derivatives agree with differences.
        #[test]
        fn interpolation_inverts_projection(
            corners in prop::array::uniform3(
                (-1.0..1.0f64, -1.0..1.0f64, 0.5..3.0f64).prop_map(|(x, y, z)| DVec3::new(x, y, z))),
            b in (0.0..1.0f64, 0.0..1.0f64),
        ) {
            let camera = camera();
            let [p, q, r] = corners;
            let normal = (q - p).cross(r - p);
            // Edge-on triangles have no barycentric coordinates on the screen.
            prop_assume!(normal.dot(p).abs() > 1e-2);
            let b = DVec3::new(b.0 * (1.0 - b.1), b.1, (1.0 - b.0) * (1.0 - b.1));
            let point = p * b.x + q * b.y + r * b.z;
            let pixel = camera.pixel_from_view(point);
            let interpolation = Interpolation::new(&camera, corners).unwrap();
            let found = interpolation.barycentric(pixel);
            // Rounding of 2^-53 grows by at most the inverse determinant, 100, times some 10^2.
            prop_assert!(found.abs_diff_eq(b, 1e-10), "{found} is not {b}");
            prop_assert!((interpolation.inverse_depth(pixel) * point.z - 1.0).abs() < 1e-10);
            let [per_x, per_y] = interpolation.derivatives(pixel);
            let h = 1e-5;
            let step = |d: DVec2| (interpolation.barycentric(pixel + d * h)
                - interpolation.barycentric(pixel - d * h)) / (2.0 * h);
            // Central differences err by h^2 and by rounding / h.
            let scale = 1.0 + per_x.length() + per_y.length();
            prop_assert!(step(DVec2::X).abs_diff_eq(per_x, 1e-4 * scale * scale));
            prop_assert!(step(DVec2::Y).abs_diff_eq(per_y, 1e-4 * scale * scale));
        }
    }
}
