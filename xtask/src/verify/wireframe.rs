//! The edges of an impostor's triangles, over a dimmed picture of it.

use super::subject::{Shape, Side, Subject};
use super::view::shown_by;
use farfield_grid::Grid;
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Where an impostor's edges are looked at from, and how they look from there.
pub(super) struct Wireframe {
    /// Number of the viewpoint among the impostor's own.
    pub(super) index: u64,
    pub(super) picture: Grid<[u8; 3]>,
}

/// Edges of an impostor as seen from its reference viewpoint, and from the corner of the view cell from
/// which it is seen most obliquely: of a mesh all, of quads their outlines.
pub(super) fn wireframes(subject: &Subject<'_>) -> [Wireframe; 2] {
    let edges = match subject.shape {
        Shape::Mesh(_) => Edges::All,
        Shape::Layers(_) => Edges::OfOneTriangle,
    };
    [0, most_oblique(subject)].map(|index| Wireframe {
        index,
        picture: wireframe(&subject.impostor, &close_up(subject, index), edges),
    })
}

/// The corner of the cell from which the middle of what is represented lies farthest off the axis that
/// the layers are across.
fn most_oblique(subject: &Subject<'_>) -> u64 {
    let axis = subject.reference().forward;
    let along = |index: &u64| {
        let sight = subject.target() - subject.eye(*index);
        sight.normalize().dot(axis)
    };
    let corners = 1..=8;
    corners
        .min_by(|a, b| along(a).total_cmp(&along(b)))
        .expect("a cell has corners")
}

/// Pixels along the longer side of a picture.
const SIDE: f64 = 1024.0;

/// Slopes up to which a picture is as large as what it shows; beside that, it is cut off.
const STEEPEST: f64 = 2.0;

/// A camera at a viewpoint of an impostor that sees no more than what is represented, as far as this is
/// before it.
fn close_up(subject: &Subject<'_>, index: u64) -> Camera {
    let mut camera = subject.camera_at(subject.eye(index));
    let slopes = subject.corners().map(|corner| {
        let corner = camera.pose.point_in_view(corner);
        match corner.z > 0.0 {
            true => corner.truncate() / corner.z,
            false => DVec2::INFINITY.copysign(corner.truncate()),
        }
        .clamp(DVec2::splat(-STEEPEST), DVec2::splat(STEEPEST))
    });
    let min = slopes.into_iter().fold(DVec2::INFINITY, DVec2::min);
    let max = slopes.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
    let margin = (max - min).max_element() / 50.0;
    (camera.extent.min, camera.extent.max) = (min - margin, max + margin);
    let size = camera.extent.size();
    let pixels = (size / size.max_element() * SIDE).ceil();
    (camera.width, camera.height) = (pixels.x as u32, pixels.y as u32);
    camera
}

/// Which edges are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Edges {
    /// All.
    All,
    /// Those at which no two triangles share their vertices: of a quad not the diagonal.
    OfOneTriangle,
}

/// What an impostor shows to a camera, dimmed, and the edges that nothing it shows hides.
fn wireframe(side: &Side<'_>, camera: &Camera, edges: Edges) -> Grid<[u8; 3]> {
    const LINE: [u8; 3] = [255, 220, 96];
    let shown = shown_by(side, camera);
    let lines = visible_lines(side.scene, camera, &shown.seen.depth, edges);
    let pixels = shown.colors.cells().iter().zip(lines.cells());
    let pixels = pixels.map(|(color, line)| {
        let mixed = |i: usize| {
            let dimmed = f64::from(color[i]) * 0.4;
            (dimmed + (f64::from(LINE[i]) - dimmed) * line).round() as u8
        };
        [0, 1, 2].map(mixed)
    });
    Grid::from_cells(
        shown.colors.width(),
        shown.colors.height(),
        pixels.collect(),
    )
}

/// How much of each pixel edges of triangles cover, from 0 to 1, where they lie no deeper than what is
/// seen. Lines are drawn inside of triangles, a pixel wide from either side, and as far away as these;
/// so nothing of what is hidden shows through, but what lies before a transparent texel is drawn.
/// Triangles that reach behind the camera are left out.
fn visible_lines(scene: &Scene, camera: &Camera, depth: &Grid<f64>, edges: Edges) -> Grid<f64> {
    // The renderer and this file round differently.
    const SLACK: f64 = 1e-6;
    let mut lines: Grid<f64> = Grid::filled(depth.width(), depth.height(), 0.0);
    for object in 0..scene.objects.len() as u32 {
        let triangles = scene.mesh_of(object).triangles.clone();
        let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
        let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        for triangle in triangles.clone() {
            let [a, b, c] = scene.triangle_in(object, triangle);
            for edge in [[a, b], [b, c], [c, a]] {
                *uses.entry(sorted(edge)).or_default() += 1;
            }
        }
        for triangle in triangles {
            let [a, b, c] = scene.triangle_in(object, triangle);
            let is_drawn = [[b, c], [c, a], [a, b]]
                .map(|edge| edges == Edges::All || uses[&sorted(edge)] == 1);
            let corners = [a, b, c].map(|v| scene.world_position(object, v));
            let corners = corners.map(|point| camera.pose.point_in_view(point));
            if corners.iter().any(|corner| corner.z <= 0.0) {
                continue;
            }
            for_inside(camera, corners, |[x, y], distances, nearness| {
                if nearness * depth[(x, y)] >= 1.0 - SLACK || depth[(x, y)].is_infinite() {
                    let nearest = (0..3).filter(|i| is_drawn[*i]).map(|i| distances[i]);
                    let nearest = nearest.fold(f64::INFINITY, f64::min);
                    let line = &mut lines[(x, y)];
                    *line = line.max((1.0 - nearest).clamp(0.0, 1.0));
                }
            });
        }
    }
    lines
}

/// Calls `each` for every pixel whose centre lies in a triangle: with the distances, in pixels, to the
/// edges opposite to its corners, and 1 / depth there.
fn for_inside(
    camera: &Camera,
    corners: [DVec3; 3],
    mut each: impl FnMut([usize; 2], [f64; 3], f64),
) {
    let on_screen = corners.map(|corner| camera.pixel_from_view(corner));
    let [a, b, c] = on_screen;
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return;
    }
    let size = DVec2::new(camera.width.into(), camera.height.into());
    let first = (a.min(b).min(c) - 0.5).ceil().clamp(DVec2::ZERO, size);
    let end = (a.max(b).max(c) + 0.5).floor().clamp(DVec2::ZERO, size);
    let edges = [[b, c], [c, a], [a, b]];
    for y in first.y as usize..end.y as usize {
        for x in first.x as usize..end.x as usize {
            let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let weights = edges.map(|[from, to]| (to - from).perp_dot(pixel - from) / area);
            if weights.iter().all(|weight| *weight >= 0.0) {
                let distance =
                    |i: usize| weights[i] * area.abs() / edges[i][0].distance(edges[i][1]);
                let nearness = (0..3).map(|i| weights[i] / corners[i].z).sum();
                each([x, y], [0, 1, 2].map(distance), nearness);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_sampling::{Textures, rasterize};
    use farfield_scene::{Material, Mesh, Object};
    use glam::{DAffine3, Vec2, Vec3, Vec4};
    use proptest::prelude::*;

    /// Triangles before a camera that looks along -Z, seen from both sides.
    fn scene(corners: &[[f32; 3]]) -> Scene {
        let count = corners.len() as u32;
        Scene {
            positions: corners.iter().copied().map(Vec3::from).collect(),
            normals: vec![Vec3::Z; corners.len()],
            uvs: vec![Vec2::ZERO; corners.len()],
            colors: vec![Vec4::ONE; corners.len()],
            triangles: (0..count / 3)
                .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
                .collect(),
            triangle_materials: vec![0; corners.len() / 3],
            meshes: vec![Mesh {
                vertices: 0..count,
                triangles: 0..count / 3,
            }],
            objects: vec![Object {
                name: "triangles".into(),
                mesh: 0,
                world_from_mesh: DAffine3::IDENTITY,
            }],
            materials: vec![Material {
                double_sided: true,
                ..Material::default()
            }],
            ..Scene::default()
        }
    }

    fn lines(scene: &Scene, edges: Edges) -> Grid<f64> {
        let camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 48);
        let seen = rasterize(scene, &Textures::new(scene), &camera);
        visible_lines(scene, &camera, &seen.depth, edges)
    }

    proptest! {
        /// A wall before everything leaves only its own edges; without it, each pixel has the edge of
        /// the triangle that is seen there, and nothing where none is.
        #[test]
        fn hidden_lines_do_not_show(
            corners in prop::collection::vec([-3.0..3.0f32, -3.0..3.0f32, -9.0..-3.0f32], 30),
        ) {
            let wall = [[-9.0, -9.0, -2.0], [9.0, -9.0, -2.0], [0.0, 9.0, -2.0]];
            let alone = lines(&scene(&wall), Edges::All);
            let before = lines(&scene(&[&wall[..], &corners].concat()), Edges::All);
            prop_assert_eq!(alone, before);

            let all = scene(&corners);
            let camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 48);
            let seen = rasterize(&all, &Textures::new(&all), &camera).triangles;
            let drawn = lines(&all, Edges::All);
            for (at, (triangle, line)) in seen.cells().iter().zip(drawn.cells()).enumerate() {
                let expected = corners.chunks(3).nth(*triangle as usize).map_or(0.0, |corners| {
                    let on_screen: Vec<DVec2> = corners
                        .iter()
                        .map(|p| camera.pose.point_in_view(Vec3::from(*p).as_dvec3()))
                        .map(|p| camera.pixel_from_view(p))
                        .collect();
                    let pixel = DVec2::new((at % 48) as f64 + 0.5, (at / 48) as f64 + 0.5);
                    let distance = |i: usize| {
                        let (a, b) = (on_screen[i], on_screen[(i + 1) % 3]);
                        ((b - a).normalize().perp_dot(pixel - a)).abs()
                    };
                    let nearest = distance(0).min(distance(1)).min(distance(2));
                    (1.0 - nearest).max(0.0)
                });
                // Slivers that are less than a millionth of a pixel wide may be seen or not.
                prop_assert!((line - expected).abs() < 1e-6, "{} {}", line, expected);
            }
        }
    }

    /// Two triangles that share an edge are drawn as a quad, if only outlines are asked for.
    #[test]
    fn outlines_have_no_diagonal() {
        let corners = [
            [-1.0, -1.0, -4.0],
            [1.0, -1.0, -4.0],
            [1.0, 1.0, -4.0],
            [-1.0, 1.0, -4.0],
        ];
        let mut quad = scene(&corners);
        quad.triangles = vec![[0, 1, 2], [0, 2, 3]];
        quad.triangle_materials = vec![0; 2];
        quad.meshes[0].triangles = 0..2;
        let middle = (24, 24);
        assert!(lines(&quad, Edges::All)[middle] > 0.0);
        let outline = lines(&quad, Edges::OfOneTriangle);
        assert_eq!(outline[middle], 0.0);
        assert!(outline.cells().iter().any(|line| *line > 0.0));
    }
}
