//! Ids and depths.

use crate::adapter::gpu;
use crate::setup::{cameras, house_bundle, moved};
use farfield_gpu::{Gpu, GpuScene, IdBuffers, NONE, Seen};
use farfield_sampling::{Textures, Visibility, rasterize};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::{DVec2, DVec3};

/// How two pictures of ids differ.
#[derive(Debug, Default)]
struct Differences {
    /// Of them all, that see something on one side at least.
    seen: usize,
    /// With other ids.
    differ: usize,
    /// With other ids, though the surfaces are not equally far and the pixel is on no edge.
    unexplained: usize,
    /// Relative, where ids are the same.
    depth: f64,
}

/// Vertices are snapped to 1/256 pixel.
const ON_EDGE: f64 = 1.0 / 128.0;
/// Relative; three times what is measured at most.
const SAME_DEPTH: f64 = 1e-5;

fn compare(scene: &Scene, camera: &Camera, cpu: &Visibility, gpu: &Seen) -> Differences {
    let mut found = Differences::default();
    for y in 0..camera.height as usize {
        for x in 0..camera.width as usize {
            let at = (x, y);
            let ids = [
                (cpu.objects[at], cpu.triangles[at]),
                (gpu.objects[at], gpu.triangles[at]),
            ];
            let depths = [cpu.depth[at], f64::from(gpu.depth[at])];
            assert_eq!(gpu.objects[at] == NONE, depths[1].is_infinite());
            found.seen += usize::from(ids != [(NONE, NONE); 2]);
            let apart = (depths[1] / depths[0] - 1.0).abs();
            if ids[0] == ids[1] {
                if ids[0].0 != NONE {
                    found.depth = found.depth.max(apart);
                }
                continue;
            }
            found.differ += 1;
            let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let on_edge = |(object, triangle): (u32, u32)| {
                object != NONE
                    && distance_to_edges(scene, camera, object, triangle, pixel) < ON_EDGE
            };
            if apart.is_nan() || apart > SAME_DEPTH {
                found.unexplained += usize::from(!ids.into_iter().any(on_edge));
            }
        }
    }
    found
}

/// From a pixel to the nearest of the lines through a triangle's edges, in pixels.
fn distance_to_edges(
    scene: &Scene,
    camera: &Camera,
    object: u32,
    triangle: u32,
    pixel: DVec2,
) -> f64 {
    let corners = scene.triangle_in(object, triangle).map(|vertex| {
        let point = scene.world_position(object, vertex);
        camera.pose.point_in_view(point)
    });
    let [a, b, c] = corners;
    let sight = camera.view_from_pixel(pixel, 1.0);
    let distance = |edge: DVec3| {
        let per_pixel = edge.truncate() * camera.pixel_size();
        edge.dot(sight).abs() / per_pixel.length()
    };
    [a.cross(b), b.cross(c), c.cross(a)]
        .map(distance)
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

fn check(gpu: &Gpu, scene: &Scene, cameras: &[Camera]) -> Vec<Differences> {
    let uploaded = GpuScene::new(gpu, scene).unwrap();
    let ids = IdBuffers::new(gpu).unwrap();
    let seen = ids.see(gpu, &uploaded, &uploaded.all(), cameras).unwrap();
    assert_eq!(seen.len(), cameras.len());
    let textures = Textures::new(scene);
    let pairs = cameras.iter().zip(&seen);
    pairs
        .map(|(camera, seen)| compare(scene, camera, &rasterize(scene, &textures, camera), seen))
        .collect()
}

/// Ids are the CPU's but on edges and where surfaces are equally far, depths are the CPU's to five
/// digits: near, far, within, and with frusta that are not centred.
#[test]
fn ids_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for scene in [farfield_town::town(1, 100_000), farfield_town::house(1)] {
        for found in check(&gpu, &scene, &cameras(&scene, 256)) {
            assert!(found.seen > 10_000, "{found:?}");
            assert_eq!(found.unexplained, 0, "{found:?}");
            assert!(found.depth < SAME_DEPTH, "{found:?}");
        }
    }
}

/// The same thousands of kilometres from the origin.
#[test]
fn ids_far_from_the_origin_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = moved(farfield_town::house(1), DVec3::new(4e6, -3e6, 2e6));
    for found in check(&gpu, &scene, &cameras(&scene, 256)) {
        assert!(found.seen > 10_000, "{found:?}");
        assert_eq!(found.unexplained, 0, "{found:?}");
        assert!(found.depth < SAME_DEPTH, "{found:?}");
    }
}

/// Masks are cut where the CPU cuts them: texture coordinates are rounded to 24 bits, a thousandth
/// of a texel, which at most one in a thousand of the pixels on a mask's border is near to.
#[test]
fn masks_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = house_bundle();
    for found in check(&gpu, &scene, &cameras(&scene, 256)) {
        assert!(found.seen > 10_000, "{found:?}");
        assert!(found.unexplained * 1000 <= found.seen, "{found:?}");
        assert!(found.depth < SAME_DEPTH, "{found:?}");
    }
}

/// Ranges of triangles show what a scene of nothing else would show; several sizes of pictures come
/// in one batch, each with its own.
#[test]
fn ranges_show_nothing_else() {
    let Some(gpu) = gpu() else { return };
    let scene = farfield_town::house(1);
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    let count = scene.triangles.len() as u32;
    let ranges: Vec<_> = (0..count / 30).map(|i| 30 * i + 7..30 * i + 19).collect();
    let shown = |id: u32| (7..19).contains(&(id % 30)) && id / 30 < count / 30;
    let ids = IdBuffers::new(&gpu).unwrap();
    let draws = uploaded.restricted(&ranges);
    let cameras = [cameras(&scene, 64), cameras(&scene, 128)].concat();
    let seen = ids.see(&gpu, &uploaded, &draws, &cameras).unwrap();
    let mut fewer = scene.clone();
    for (id, triangle) in (0..).zip(&mut fewer.triangles) {
        if !shown(id) {
            *triangle = [triangle[0]; 3];
        }
    }
    let textures = Textures::new(&fewer);
    for (camera, seen) in cameras.iter().zip(&seen) {
        let expected = rasterize(&fewer, &textures, camera);
        let found = compare(&scene, camera, &expected, seen);
        assert!(found.seen > 100, "{found:?}");
        assert_eq!(found.unexplained, 0, "{found:?}");
    }
}

/// The same pictures come of one call for many cameras and of a call for each.
#[test]
fn batches_change_nothing() {
    let Some(gpu) = gpu() else { return };
    let scene = farfield_town::house(1);
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    let ids = IdBuffers::new(&gpu).unwrap();
    let (cameras, all) = (cameras(&scene, 100), uploaded.all());
    let together = ids.see(&gpu, &uploaded, &all, &cameras).unwrap();
    for (camera, together) in cameras.iter().zip(&together) {
        let alone = ids.see(&gpu, &uploaded, &all, &[*camera]).unwrap();
        assert_eq!(&alone[0], together);
    }
}

/// Objects that mirror their mesh, share it, or show both sides are seen from where the CPU sees
/// them; triangles reach behind the camera.
#[test]
fn mirrored_shared_and_open_meshes_are_seen_from_the_right_side() {
    let Some(gpu) = gpu() else { return };
    let mut scene = farfield_town::house(1);
    let size = scene.bounds().map(|[min, max]| max - min).unwrap();
    let mut mirrored = scene.objects.clone();
    for object in &mut mirrored {
        let beside = DVec3::new(1.5 * size.x, 0.0, -0.3 * size.z);
        let turned = glam::DAffine3::from_scale_rotation_translation(
            DVec3::new(-1.0, 0.7, 1.2),
            glam::DQuat::from_rotation_y(0.4),
            beside,
        );
        object.world_from_mesh = turned * object.world_from_mesh;
    }
    scene.objects.extend(mirrored);
    for material in scene.materials.iter_mut().step_by(2) {
        material.double_sided = true;
    }
    assert_eq!(scene.check(), Ok(()));
    for found in check(&gpu, &scene, &cameras(&scene, 200)) {
        assert!(found.seen > 3_000, "{found:?}");
        assert_eq!(found.unexplained, 0, "{found:?}");
    }
}
