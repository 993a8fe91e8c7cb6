//! What a camera sees: nearest surfaces, then their colours.

use crate::geometry::{Drawn, Interpolation, batches, corners_in_view, run_in_view};
use crate::masked::Masked;
use crate::surface::Hit;
use crate::{Lighting, Surface, Textures, lit_color, surface_at};
use farfield_grid::Grid;
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// The id of nothing.
pub const NONE: u32 = u32::MAX;

/// The nearest surface at each pixel's centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    /// Along the view axis, in metres; infinite where nothing is seen.
    pub depth: Grid<f64>,
    /// Index into the scene's objects, or [`NONE`].
    pub objects: Grid<u32>,
    /// Index into the scene's triangles, or [`NONE`].
    pub triangles: Grid<u32>,
}

/// Rows of pixels that one thread works on at a time: enough to keep small triangles in one band,
/// few enough that a picture of 512 rows keeps 16 cores busy.
const BAND: usize = 32;

/// Finds the nearest surface at each pixel's centre.
///
/// Watertight: of two triangles that share an edge exactly one covers a centre on it. Triangles
/// may reach behind the camera. Back faces of single-sided materials are not seen, nor points
/// where alpha is below the material's cutoff ([`farfield_scene::AlphaMode::cutoff`]; alpha is
/// looked up at the textures' finest level of detail). Where two surfaces are equally far, the
/// first in the scene is seen.
///
/// Bound by triangles set up (about 0.1 µs each and core) and pixels covered.
pub fn rasterize(scene: &Scene, textures: &Textures<'_>, camera: &Camera) -> Visibility {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let nothing = Pixel {
        inverse_depth: 0.0,
        object: NONE,
        triangle: NONE,
    };
    let mut pixels = vec![nothing; width * height];
    for batch in batches(scene) {
        let triangles: Vec<Vec<ScreenTriangle>> = batch
            .par_iter()
            .map(|run| {
                let triangles = run_in_view(scene, &camera.pose, run);
                triangles
                    .filter_map(|(drawn, corners)| set_up(scene, camera, drawn, corners))
                    .collect()
            })
            .collect();
        let mut bins = vec![Vec::new(); height.div_ceil(BAND)];
        for triangle in triangles.iter().flatten() {
            let bands = triangle.rows.start / BAND..triangle.rows.end.div_ceil(BAND);
            bins[bands]
                .iter_mut()
                .for_each(|bin: &mut Vec<&ScreenTriangle>| bin.push(triangle));
        }
        let bands = pixels
            .par_chunks_mut(width.max(1) * BAND)
            .zip(bins)
            .enumerate();
        bands.for_each(|(band, (pixels, bin))| {
            for triangle in bin {
                draw(scene, textures, camera, triangle, band * BAND, pixels);
            }
        });
    }
    let grid =
        |ids: fn(&Pixel) -> u32| Grid::from_cells(width, height, pixels.iter().map(ids).collect());
    Visibility {
        depth: Grid::from_cells(
            width,
            height,
            pixels.iter().map(|p| p.inverse_depth.recip()).collect(),
        ),
        objects: grid(|p| p.object),
        triangles: grid(|p| p.triangle),
    }
}

/// Linear RGB of the visible surfaces at each pixel's centre; zero where nothing is seen.
///
/// # Panics
///
/// When `visibility` is not of the camera's size or not of this scene.
pub fn shade(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    visibility: &Visibility,
    light: &Lighting,
) -> Grid<Vec3> {
    let lit = |surface: &Surface| lit_color(surface, light);
    at_centers(scene, textures, camera, visibility, Vec3::ZERO, lit)
}

/// The visible surfaces at each pixel's centre before any light; `None` where nothing is seen.
///
/// # Panics
///
/// As for [`shade`].
pub fn surfaces(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    visibility: &Visibility,
) -> Grid<Option<Surface>> {
    let all = |surface: &Surface| Some(*surface);
    at_centers(scene, textures, camera, visibility, None, all)
}

/// What `of` says of the visible surface at each pixel's centre; `nothing` where none is seen.
fn at_centers<T: Copy + Send + Sync>(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    visibility: &Visibility,
    nothing: T,
    of: impl Fn(&Surface) -> T + Sync,
) -> Grid<T> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    assert_eq!(
        (visibility.depth.width(), visibility.depth.height()),
        (width, height)
    );
    let ids = visibility
        .objects
        .cells()
        .par_iter()
        .zip(visibility.triangles.cells());
    let value = |(i, (&object, &triangle)): (usize, (&u32, &u32))| {
        if object == NONE {
            return nothing;
        }
        let pixel = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let corners = corners_in_view(scene, &camera.pose, Drawn { object, triangle });
        let hit = match Interpolation::new(camera, corners) {
            Some(interpolation) => hit(object, triangle, interpolation.barycentric(pixel)),
            None => Hit {
                object,
                triangle,
                barycentric: [1.0 / 3.0; 2],
            },
        };
        of(&surface_at(scene, textures, camera, &hit))
    };
    Grid::from_cells(width, height, ids.enumerate().map(value).collect())
}

#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// Zero where nothing is seen.
    inverse_depth: f64,
    object: u32,
    triangle: u32,
}

/// A triangle ready to be drawn. With a pixel's slopes as d = (x, y, 1), the pixel's centre lies
/// inside of edge i where `edges[i].dot(d) >= 0`, and the reciprocal depth there is
/// `inverse_depth.dot(d)`.
///
/// Edges are cross products of corners in view space. These are exactly antisymmetric in floating
/// point, so two triangles get the same numbers at a shared edge, of opposite sign.
#[derive(Clone, Debug)]
struct ScreenTriangle {
    edges: [DVec3; 3],
    inverse_depth: DVec3,
    columns: Range<usize>,
    rows: Range<usize>,
    drawn: Drawn,
}

/// `None` where the triangle cannot be seen.
fn set_up(
    scene: &Scene,
    camera: &Camera,
    drawn: Drawn,
    corners: [DVec3; 3],
) -> Option<ScreenTriangle> {
    let [a, b, c] = corners;
    let mut edges = [b.cross(c), c.cross(a), a.cross(b)];
    // Positive where the camera is behind the triangle.
    let determinant = a.dot(edges[0]);
    let material = &scene.materials[scene.triangle_materials[drawn.triangle as usize] as usize];
    if determinant == 0.0 || (determinant > 0.0 && !material.double_sided) {
        return None;
    }
    let (columns, rows) = pixel_bounds(camera, corners)?;
    let inverse_depth = (edges[0] + edges[1] + edges[2]) / determinant;
    if determinant < 0.0 {
        edges = edges.map(|edge| -edge);
    }
    Some(ScreenTriangle {
        edges,
        inverse_depth,
        columns,
        rows,
        drawn,
    })
}

/// Columns and rows whose centres a triangle may cover; `None` where there are none.
fn pixel_bounds(camera: &Camera, corners: [DVec3; 3]) -> Option<(Range<usize>, Range<usize>)> {
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    if corners.iter().all(|corner| corner.z <= 0.0) {
        return None;
    }
    let (mut min, mut max) = (DVec2::ZERO, size);
    if corners.iter().all(|corner| corner.z > 0.0) {
        let [a, b, c] = corners;
        let pixels = [
            camera.pixel_from_view(a),
            camera.pixel_from_view(b),
            camera.pixel_from_view(c),
        ];
        // A hair more than the rounding of the projection, of some 1e-12 pixels.
        min = pixels[0].min(pixels[1]).min(pixels[2]) - 1e-6;
        max = pixels[0].max(pixels[1]).max(pixels[2]) + 1e-6;
    }
    let first = (min - 0.5).ceil().clamp(DVec2::ZERO, size);
    let end = ((max - 0.5).floor() + 1.0).clamp(DVec2::ZERO, size);
    (first.x < end.x && first.y < end.y).then_some((
        first.x as usize..end.x as usize,
        first.y as usize..end.y as usize,
    ))
}

/// Draws a triangle into the rows from `top` on that `pixels` holds.
fn draw(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    triangle: &ScreenTriangle,
    top: usize,
    pixels: &mut [Pixel],
) {
    let width = camera.width as usize;
    let bottom = top + pixels.len() / width;
    let Drawn {
        object,
        triangle: id,
    } = triangle.drawn;
    let masked = Masked::new(scene, textures, triangle.drawn);
    let (size, min) = (camera.pixel_size(), camera.extent.min);
    for y in triangle.rows.start.max(top)..triangle.rows.end.min(bottom) {
        let slope_y = min.y + (y as f64 + 0.5) * size.y;
        let in_row = |plane: DVec3| plane.y * slope_y + plane.z;
        let edges = triangle
            .edges
            .map(|edge| (edge.x, in_row(edge), owns_border(edge)));
        let (depth_x, depth_0) = (triangle.inverse_depth.x, in_row(triangle.inverse_depth));
        let row = &mut pixels[(y - top) * width..][..width];
        for x in columns_inside(&edges, &triangle.columns, min.x, size.x) {
            let slope_x = min.x + (x as f64 + 0.5) * size.x;
            let values = edges.map(|(per_x, at_0, _)| per_x * slope_x + at_0);
            let inside = (0..3).all(|i| values[i] > 0.0 || (values[i] == 0.0 && edges[i].2));
            let inverse_depth = depth_x * slope_x + depth_0;
            if !inside || inverse_depth <= row[x].inverse_depth {
                continue;
            }
            if let Some(masked) = &masked {
                let weights = DVec3::from(values) / values.iter().sum::<f64>();
                if !masked.is_there(masked.place(weights)) {
                    continue;
                }
            }
            row[x] = Pixel {
                inverse_depth,
                object,
                triangle: id,
            };
        }
    }
}

/// Whether a centre exactly on an edge belongs to the triangle: true for one of the two triangles
/// at an edge, whose edges are opposite.
fn owns_border(edge: DVec3) -> bool {
    edge.x > 0.0 || (edge.x == 0.0 && edge.y > 0.0)
}

/// The columns of a row that can lie inside of all edges, found by division and widened by one,
/// so that wide triangles do not test every pixel of their bounds.
fn columns_inside(
    edges: &[(f64, f64, bool); 3],
    columns: &Range<usize>,
    min: f64,
    size: f64,
) -> Range<usize> {
    let (mut first, mut end) = (columns.start, columns.end);
    for &(per_x, at_0, _) in edges {
        let border = (-at_0 / per_x - min) / size - 0.5;
        if per_x > 0.0 {
            first = first.max((border.ceil() - 1.0).max(0.0) as usize);
        } else if per_x < 0.0 {
            end = end.min((border.floor() + 2.0).max(0.0) as usize);
        }
    }
    first..end
}

fn hit(object: u32, triangle: u32, barycentric: DVec3) -> Hit {
    Hit {
        object,
        triangle,
        barycentric: [barycentric.y as f32, barycentric.z as f32],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::soup;
    use farfield_scene::{AlphaMode, Material};
    use farfield_views::{Extent, Pose};
    use proptest::prelude::*;

    fn camera(width: u32, height: u32) -> Camera {
        Camera {
            pose: Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z),
            extent: Extent {
                min: DVec2::new(-1.0, -0.7),
                max: DVec2::new(0.8, 0.9),
            },
            width,
            height,
        }
    }

    fn double_sided(mut scene: Scene) -> Scene {
        scene.materials[0].double_sided = true;
        scene
    }

    fn points(count: usize) -> impl Strategy<Value = Vec<[f32; 3]>> {
        // Behind, beside and before the camera, which looks along -Z.
        prop::collection::vec([-2.0..2.0f32, -2.0..2.0f32, -4.0..1.0f32], count)
    }

    proptest! {
        /// Every pixel shows the nearest of all triangles that its ray meets, as a ray caster
        /// finds it, except within rounding of an edge.
        #[test]
        fn shows_what_rays_meet(points in points(18)) {
            let scene = double_sided(soup(&points));
            let camera = camera(23, 17);
            let seen = rasterize(&scene, &Textures::new(&scene), &camera);
            for y in 0..17 {
                for x in 0..23 {
                    let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let ray = camera.view_from_pixel(pixel, 1.0);
                    let mut nearest = (f64::INFINITY, NONE);
                    let mut doubtful = false;
                    for triangle in 0..6 {
                        let corners = corners_in_view(&scene, &camera.pose, Drawn { object: 0, triangle });
                        let m = glam::DMat3::from_cols(corners[0], corners[1], corners[2]);
                        let w = m.inverse() * ray;
                        let depth = w.element_sum().recip();
                        doubtful |= w.abs().min_element() < 1e-9 || m.determinant().abs() < 1e-9;
                        if w.min_element() > 0.0 && depth < nearest.0 {
                            nearest = (depth, triangle);
                        }
                    }
                    if doubtful { continue; }
                    prop_assert_eq!(seen.triangles[(x, y)], nearest.1);
                    let depth = seen.depth[(x, y)];
                    prop_assert!(depth == nearest.0 || (depth / nearest.0 - 1.0).abs() < 1e-6);
                }
            }
        }

        /// A fan of triangles around a point covers every pixel inside exactly once: with a mask
        /// material that hides one triangle after the other, no pixel is seen twice or never.
        #[test]
        fn a_fan_is_watertight(corner in [-0.3..0.3f32, -0.3..0.3f32], spokes in 3..9usize) {
            let ring: Vec<[f32; 3]> = (0..spokes).map(|i| {
                let angle = i as f32 / spokes as f32 * std::f32::consts::TAU;
                [3.0 * angle.cos(), 3.0 * angle.sin(), -1.0]
            }).collect();
            let center = [corner[0], corner[1], -1.0];
            let fan: Vec<_> = (0..spokes)
                .flat_map(|i| [center, ring[i], ring[(i + 1) % spokes]]).collect();
            let camera = camera(64, 64);
            let mut covered = vec![0; 64 * 64];
            for one in fan.chunks(3) {
                let scene = double_sided(soup(one));
                let seen = rasterize(&scene, &Textures::new(&scene), &camera);
                for (i, id) in seen.objects.cells().iter().enumerate() {
                    covered[i] += usize::from(*id != NONE);
                }
            }
            prop_assert!(covered.iter().all(|n| *n == 1));
        }
    }

    #[test]
    fn back_faces_are_seen_only_of_double_sided_materials() {
        let facing = soup(&[[-9.0, -9.0, -2.0], [9.0, -9.0, -2.0], [0.0, 9.0, -2.0]]);
        let away = soup(&[[9.0, -9.0, -2.0], [-9.0, -9.0, -2.0], [0.0, 9.0, -2.0]]);
        let count = |scene: &Scene| {
            let seen = rasterize(scene, &Textures::new(scene), &camera(8, 8));
            seen.objects
                .cells()
                .iter()
                .filter(|id| **id != NONE)
                .count()
        };
        assert_eq!(count(&facing), 64);
        assert_eq!(count(&away), 0);
        assert_eq!(count(&double_sided(away)), 64);
    }

    #[test]
    fn transparent_points_are_not_seen() {
        let mut scene = soup(&[[-9.0, -9.0, -2.0], [9.0, -9.0, -2.0], [0.0, 9.0, -2.0]]);
        for (alpha, seen) in [(0.49, NONE), (0.5, 0)] {
            scene.materials[0] = Material {
                alpha: AlphaMode::Mask { cutoff: 0.5 },
                base_color: glam::Vec4::new(1.0, 1.0, 1.0, alpha),
                ..Material::default()
            };
            let visibility = rasterize(&scene, &Textures::new(&scene), &camera(4, 4));
            assert!(visibility.objects.cells().iter().all(|id| *id == seen));
        }
    }
}
