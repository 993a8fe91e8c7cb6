//! Layers recorded with the GPU's help.

use crate::adapter::gpu;
use crate::setup::{model, moved};
use crate::touches;
use farfield_gpu::{Gpu, GpuError, LayerSearch, Touches};
use farfield_sampling::{Foliage, Recording, Sample, Textures, record, record_touches};
use farfield_scene::{AlphaMode, Filter, Image, Material, Mesh, Object, Scene, Texture, Wrap};
use farfield_views::{Camera, Extent, Pose, ViewCell};
use glam::{DAffine3, DVec2, DVec3, DVec4, Vec2, Vec3, Vec4};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use std::cell::Cell;

/// Layers of a scene, and a cell that they are seen from.
#[derive(Clone, Debug)]
struct Layers {
    camera: Camera,
    borders: Vec<f64>,
    corners: Vec<DVec4>,
}

/// Some layers from a least to a greatest depth, of the same relative thickness.
fn borders(near: f64, far: f64, count: u32) -> Vec<f64> {
    let border = |i: u32| near * (far / near).powf(f64::from(i) / f64::from(count));
    (0..=count).map(border).collect()
}

/// Layers for viewers in a box before a scene, so many times its size away.
fn before(scene: &Scene, away: f64, resolution: u32, count: u32) -> Layers {
    let [min, max] = scene.bounds().expect("the scene shows something");
    let (middle, size) = ((min + max) / 2.0, (max - min).length());
    let eye = middle + DVec3::new(0.1, 0.15, 1.0).normalize() * away * size;
    let cell = ViewCell::Box {
        center: eye,
        size: DVec3::splat(0.2 * size),
    };
    let fov = 2.0 * (0.5 / away).atan();
    Layers {
        camera: Camera::looking_at(eye, middle, fov, resolution),
        borders: borders((away - 0.5) * size, (away + 0.5) * size, count),
        corners: cell.corners().to_vec(),
    }
}

fn search(gpu: &Gpu, scene: &Scene, layers: &Layers) -> Touches {
    let search = LayerSearch::new(gpu).unwrap();
    let Layers {
        camera,
        borders,
        corners,
    } = layers;
    search.find(gpu, scene, camera, borders, corners).unwrap()
}

fn recorded(scene: &Scene, layers: &Layers, foliage: Foliage, found: &Touches) -> [Recording; 2] {
    let textures = Textures::new(scene);
    let Layers {
        camera,
        borders,
        corners,
    } = layers;
    let touches = touches::of_search(found);
    [
        record(scene, &textures, camera, borders, corners, foliage),
        record_touches(
            scene, &textures, camera, borders, corners, foliage, &touches,
        ),
    ]
}

/// Panics unless layers that the GPU helped to record are those of the CPU to the last bit. Returns how
/// many texels were set, and how many touches the CPU looked at for each.
fn check(gpu: &Gpu, scene: &Scene, layers: &Layers, foliage: Foliage) -> (usize, f64) {
    let found = search(gpu, scene, layers);
    let [expected, recorded] = recorded(scene, layers, foliage, &found);
    assert_eq!(differing(&expected, &recorded), [] as [Entry; 0]);
    // Nor is any of it in another order.
    assert!(expected == recorded);
    let count = expected.samples.len();
    (count, found.list.len() as f64 / count as f64)
}

type Entry = (usize, Sample);

/// What only one of two recordings has, the first of it.
fn differing(a: &Recording, b: &Recording) -> Vec<Entry> {
    let layers = a.layers.iter().zip(&b.layers).enumerate();
    let mut found = Vec::new();
    for (layer, (a_run, b_run)) in layers {
        let (a, b) = (&a.samples[a_run.clone()], &b.samples[b_run.clone()]);
        if a != b {
            found.extend(
                a.iter()
                    .filter(|one| !b.contains(one))
                    .map(|one| (layer, *one)),
            );
            found.extend(
                b.iter()
                    .filter(|one| !a.contains(one))
                    .map(|one| (layer, *one)),
            );
        }
        if !found.is_empty() {
            found.truncate(8);
            return found;
        }
    }
    found
}

/// With few layers and many: a plain scene, and one with leaves.
#[test]
fn scenes_are_recorded_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let (house, town) = (farfield_town::house(1), farfield_town::town(1, 100_000));
    for count in [1, 9, 60] {
        let (texels, touches) = check(&gpu, &house, &before(&house, 1.2, 256, count), Foliage::Any);
        assert!(texels > 10_000);
        // What is beaten for sure is left out: without, there are 3 to 9 touches a texel.
        assert!(touches < 1.2, "{touches} touches a texel");
        let layers = before(&town, 1.5, 256, count);
        let (texels, touches) = check(&gpu, &town, &layers, Foliage::Any);
        assert!(texels > 10_000);
        // Of leaves nothing is sure.
        assert!(touches < 6.0, "{touches} touches a texel");
    }
    check(&gpu, &town, &before(&town, 1.5, 256, 9), Foliage::Centre);
}

/// Thousands of kilometres from the origin, and seen from afar.
#[test]
fn scenes_far_away_are_recorded_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = moved(farfield_town::house(1), DVec3::new(4e6, -3e6, 2e6));
    check(&gpu, &scene, &before(&scene, 1.2, 200, 30), Foliage::Any);
    check(&gpu, &scene, &before(&scene, 300.0, 200, 5), Foliage::Any);
}

/// A flat mesh in a plane through the eye, upright, level, or along both: its texels are exactly in the
/// middle of the picture, and so are those of another one across.
#[test]
fn meshes_in_planes_through_the_eye_are_recorded_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let quad = |at: [[f32; 3]; 4]| {
        let corners = [0, 1, 2, 0, 2, 3].map(|i: usize| Vec3::from(at[i]));
        let material = Material {
            double_sided: true,
            ..Material::default()
        };
        soup(&corners, material)
    };
    let from_the_axis = |x: f32, y: f32| {
        quad([
            [0.0, 0.0, -1.2],
            [x, y, -1.2],
            [x, y, -2.4],
            [0.0, 0.0, -2.4],
        ])
    };
    let across = quad([
        [-1.0, -1.0, -2.0],
        [1.0, -1.0, -2.0],
        [1.0, 1.0, -2.0],
        [-1.0, 1.0, -2.0],
    ]);
    let layers = Layers {
        camera: Camera {
            extent: Extent {
                min: DVec2::splat(-0.5),
                max: DVec2::splat(0.5),
            },
            ..camera()
        },
        borders: BORDERS.to_vec(),
        corners: vec![DVec4::W, DVec4::new(0.1, 0.3, 0.0, 1.0)],
    };
    for (x, y) in [(0.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
        let flat = from_the_axis(x, y);
        let mut scene = across.clone();
        scene.append(&flat);
        assert!(check(&gpu, &scene, &layers, Foliage::Any).0 > 1000);
        check(&gpu, &flat, &layers, Foliage::Any);
    }
}

/// Objects that mirror their mesh, share it, or show both sides.
#[test]
fn mirrored_and_shared_meshes_are_recorded_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let mut scene = farfield_town::house(1);
    let size = scene.bounds().map(|[min, max]| max - min).unwrap();
    let mut mirrored = scene.objects.clone();
    for object in &mut mirrored {
        let turned = DAffine3::from_scale_rotation_translation(
            DVec3::new(-1.0, 0.7, 1.2),
            glam::DQuat::from_rotation_y(0.4),
            DVec3::new(1.5 * size.x, 0.0, -0.3 * size.z),
        );
        object.world_from_mesh = turned * object.world_from_mesh;
    }
    scene.objects.extend(mirrored);
    for material in scene.materials.iter_mut().step_by(2) {
        material.double_sided = true;
    }
    check(&gpu, &scene, &before(&scene, 1.2, 200, 30), Foliage::Any);
}

/// Dense scans, leaves, and a machine whose back faces are seen.
#[test]
fn real_models_are_recorded_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for (name, away, count) in [
        ("stanford_armadillo_86k.glb", 1.5, 60),
        ("tree_oak_large.glb", 2.0, 30),
        ("2CylinderEngine.glb", 1.2, 80),
    ] {
        let Some(scene) = model(name) else { continue };
        check(
            &gpu,
            &scene,
            &before(&scene, away, 256, count),
            Foliage::Any,
        );
    }
}

/// Layers that do not fit into one buffer are looked at in turn, and what touches them, where there is no
/// room for all of it, once more: of masked surfaces, which nothing is sure of, all is listed.
#[test]
fn what_has_no_room_at_once_is_recorded_all_the_same() {
    let Some(gpu) = gpu() else { return };
    let corners = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -4.0],
        [1.0, 1.0, -4.0],
        [-1.0, 1.0, -1.0],
    ];
    let steep = [0, 1, 2, 0, 2, 3].map(|i| Vec3::from(corners[i]));
    let opaque = soup(&steep, Material::default());
    let masked = Material {
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        ..Material::default()
    };
    let masked = soup(&steep.repeat(60), masked);
    let camera = Camera {
        pose: Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z),
        extent: Extent {
            min: DVec2::new(-0.2, -0.2),
            max: DVec2::new(0.2, 0.2),
        },
        width: 128,
        height: 128,
    };
    for (scene, count, fewest) in [(opaque, 33_000, 1 << 20), (masked, 1000, (1 << 22) + 1)] {
        let layers = Layers {
            camera,
            borders: borders(1.5, 2.4, count),
            corners: vec![DVec4::W],
        };
        let found = search(&gpu, &scene, &layers);
        let (list, passes) = (found.list.len(), found.passes);
        assert!(list >= fewest && passes > 2, "{list} in {passes}");
        let [expected, recorded] = recorded(&scene, &layers, Foliage::Any, &found);
        assert!(expected == recorded);
    }
}

/// What does not fit is refused with the limit, and so is what f32 cannot tell.
#[test]
fn what_cannot_be_looked_at_is_refused() {
    let Some(gpu) = gpu() else { return };
    let search = LayerSearch::new(&gpu).unwrap();
    let mut scene = farfield_town::house(1);
    let fine = before(&scene, 1.2, 32, 3);
    let find = |scene: &Scene, camera: &Camera| {
        search.find(&gpu, scene, camera, &fine.borders, &fine.corners)
    };
    let side = gpu.device().limits().max_texture_dimension_2d;
    let wide = Camera {
        width: side + 1,
        ..fine.camera
    };
    let message = find(&scene, &wide).unwrap_err().to_string();
    assert!(message.contains("max_texture_dimension_2d"), "{message}");

    // A mesh whose coordinates are kilometres apart, of which centimetres are seen.
    let mut far = soup(&[Vec3::ZERO, Vec3::X, Vec3::Y], Material::default());
    far.positions[1] = Vec3::new(3e8, 1.0, 0.0);
    scene.append(&far);
    let error = find(&scene, &fine.camera).unwrap_err();
    assert!(matches!(error, GpuError::Imprecise { .. }), "{error}");
    assert!(find(&farfield_town::house(1), &fine.camera).is_ok());
    let nothing = find(&Scene::default(), &fine.camera).unwrap();
    assert!(nothing.list.is_empty());
}

/// Three points a triangle, of one material.
fn soup(points: &[Vec3], material: Material) -> Scene {
    let count = points.len() as u32;
    Scene {
        positions: points.to_vec(),
        normals: vec![Vec3::Y; points.len()],
        uvs: points.iter().map(|p| Vec2::new(p.x, p.y)).collect(),
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
        materials: vec![material],
        ..Scene::default()
    }
}

const BORDERS: [f64; 6] = [1.0, 1.25, 1.5, 1.6875, 2.0, 3.0];

fn camera() -> Camera {
    Camera {
        pose: Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z),
        extent: Extent {
            min: DVec2::new(-0.75, -0.5),
            max: DVec2::new(0.25, 0.5),
        },
        width: 32,
        height: 32,
    }
}

/// Points that the camera sees, or nearly: some of them on the corners of texels, on borders, or both.
fn point() -> impl Strategy<Value = DVec3> {
    let texel = prop_oneof![2 => -3.0..35.0f64, 1 => (-1..33i32).prop_map(f64::from)];
    let depth = prop_oneof![3 => 1.0..3.0f64, 1 => prop::sample::select(BORDERS.to_vec())];
    ([texel.clone(), texel], depth)
        .prop_map(|([x, y], depth)| camera().view_from_pixel(DVec2::new(x, y), depth))
}

/// Large triangles, small ones, slivers, ones that are seen edge-on, and points.
fn triangle() -> impl Strategy<Value = [DVec3; 3]> {
    let near = |p: DVec3, d: [f64; 3]| p + DVec3::from(d) * p.z / 32.0;
    let offset = || prop::array::uniform3(-1.0..1.0f64);
    prop_oneof![
        2 => [point(), point(), point()],
        3 => (point(), offset(), offset()).prop_map(move |(p, d, e)| [p, near(p, d), near(p, e)]),
        1 => (point(), point(), offset()).prop_map(move |(p, q, d)| [p, q, near(p, d.map(|d| d * 1e-3))]),
        1 => (point(), point(), 0.5..2.0f64).prop_map(|(p, q, t)| [p, q, p * t]),
        1 => point().prop_map(|p| [p; 3]),
    ]
}

/// Opaque triangles of one side and of both, and some with holes.
fn soups() -> impl Strategy<Value = Scene> {
    let points = |count| {
        prop::collection::vec(triangle(), count).prop_map(|triangles: Vec<[DVec3; 3]>| {
            // View space has y down and z forwards.
            let in_world = |p: &DVec3| DVec3::new(p.x, -p.y, -p.z).as_vec3();
            triangles
                .as_flattened()
                .iter()
                .map(in_world)
                .collect::<Vec<_>>()
        })
    };
    let holes = prop::collection::vec(prop::sample::select(vec![0, 100, 255]), 64);
    (points(0..40), points(0..20), points(0..6), holes).prop_map(|(one, both, masked, holes)| {
        let mut scene = soup(&one, Material::default());
        let double_sided = Material {
            double_sided: true,
            ..Material::default()
        };
        scene.append(&soup(&both, double_sided.clone()));
        let mut masked = soup(
            &masked,
            Material {
                alpha: AlphaMode::Mask { cutoff: 0.5 },
                base_color_texture: Some(0),
                ..double_sided
            },
        );
        masked.textures.push(Texture {
            image: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
        });
        masked.images.push(Image {
            name: "holes".into(),
            width: 8,
            height: 8,
            texels: holes.into_iter().map(|alpha| [0, 0, 0, alpha]).collect(),
        });
        scene.append(&masked);
        scene
    })
}

/// Whatever triangles there are, and from wherever they are seen, all is recorded as by the CPU alone.
#[test]
fn soups_are_recorded_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let foliage = prop::sample::select(vec![Foliage::Any, Foliage::Centre]);
    let away = prop_oneof![Just(0.0), Just(1.0), Just(1e3)];
    let config = Config {
        cases: 150,
        failure_persistence: None,
        ..Config::default()
    };
    let set = Cell::new(0);
    let tried = TestRunner::new(config).run(&(soups(), foliage, away), |(scene, foliage, away)| {
        prop_assert_eq!(scene.check(), Ok(()));
        let layers = Layers {
            camera: camera(),
            borders: BORDERS.to_vec(),
            corners: vec![
                DVec4::W,
                DVec4::new(away, 0.3, 0.0, 1.0),
                DVec4::new(away, 0.0, 1.0, 0.0),
            ],
        };
        set.set(set.get() + check(&gpu, &scene, &layers, foliage).0);
        Ok(())
    });
    tried.unwrap_or_else(|error| panic!("{error}"));
    assert!(set.get() > 10_000);
}
