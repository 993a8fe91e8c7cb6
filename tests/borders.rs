//! Surfaces that end in mid-air.

use crate::setup::{options_in_cell, verified};
use farfield_bundle::glb_from_scene;
use farfield_grid::BitMask;
use farfield_layers::{Aim, LayerStack, PromisedCamera, box_corners};
use farfield_sampling::{Foliage, Textures};
use farfield_scene::{Material, Mesh, Object, Scene};
use farfield_views::{Camera, ViewCell, low_discrepancy_point};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3, Vec4};
use proptest::prelude::*;
use xtask::recording::{Settings, cull, place, record_layers, recording_camera};
use xtask::{Channels, Console, SceneChoice, bake};

/// Triangles, seen from both sides.
fn scene_of(triangles: &[[Vec3; 3]]) -> Scene {
    let count = 3 * triangles.len() as u32;
    let normals = triangles.iter().flat_map(|[a, b, c]| {
        let normal = (*b - *a).cross(*c - *a).normalize_or(Vec3::Z);
        [normal; 3]
    });
    Scene {
        positions: triangles.as_flattened().to_vec(),
        normals: normals.collect(),
        uvs: vec![Vec2::ZERO; count as usize],
        colors: vec![Vec4::ONE; count as usize],
        triangles: (0..count / 3)
            .map(|i| [0, 1, 2].map(|k| 3 * i + k))
            .collect(),
        triangle_materials: vec![0; triangles.len()],
        materials: vec![Material {
            base_color: Vec4::new(0.5, 0.5, 0.5, 1.0),
            double_sided: true,
            unlit: true,
            ..Material::default()
        }],
        meshes: vec![Mesh {
            vertices: 0..count,
            triangles: 0..count / 3,
        }],
        objects: vec![Object {
            name: "strips".into(),
            mesh: 0,
            world_from_mesh: DAffine3::IDENTITY,
        }],
        ..Scene::default()
    }
}

const CELL: ViewCell = ViewCell::Box {
    center: DVec3::new(0.0, 0.0, 6.0),
    size: DVec3::new(4.0, 3.0, 2.0),
};

const LENS: PromisedCamera = PromisedCamera {
    aim: Aim::Center,
    fov: 0.6,
    resolution: 64,
};

/// What is displayed of a scene: the texels of each layer that are left after culling.
struct Layers {
    stack: LayerStack,
    camera: Camera,
    kept: Vec<BitMask>,
}

impl Layers {
    fn of(scene: &Scene) -> Self {
        let settings = Settings {
            cell: CELL,
            hull: box_corners(scene.bounds().unwrap()),
            camera: LENS,
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
        };
        let stack = place(scene, &settings).unwrap();
        let textures = Textures::new(scene);
        let (width, height) = (stack.width, stack.height);
        let recording = record_layers(scene, &textures, &stack, &CELL, Foliage::Any);
        let visible = cull(&recording, width, height);
        let masks = |layer| visible.masks(layer, width, height).opaque;
        Self {
            camera: recording_camera(&stack),
            kept: (0..stack.layers.len()).map(masks).collect(),
            stack,
        }
    }

    /// The first layer of which a ray meets a texel.
    fn first_met(&self, eye: DVec3, target: DVec3) -> Option<usize> {
        let [eye, target] = [eye, target].map(|p| self.stack.pose.point_in_view(p));
        self.kept.iter().enumerate().position(|(layer, texels)| {
            let depth = self.stack.layers[layer].depth;
            let t = (depth - eye.z) / (target.z - eye.z);
            let at = self.camera.pixel_from_view(eye.lerp(target, t)).floor();
            let size = DVec2::new(texels.width() as f64, texels.height() as f64);
            at.cmpge(DVec2::ZERO).all()
                && at.cmplt(size).all()
                && texels.contains(at.x as usize, at.y as usize)
        })
    }
}

/// Looks at points of a triangle from viewpoints of the cell, corners first, and checks that the
/// impostor shows something there, at most a layer behind, wherever the triangle reaches as far as
/// the centres of the eight neighbouring pixels. Returns how many rays were looked along.
fn check_shown(
    layers: &Layers,
    triangle: [Vec3; 3],
    target: DVec3,
    rays: u64,
) -> Result<usize, String> {
    let [a, b, c] = triangle.map(Vec3::as_dvec3);
    let normal = (b - a).cross(c - a);
    let mut looked = 0;
    for ray in 0..rays {
        let eye = CELL.viewpoint(ray % 40, 3);
        let camera = Camera::looking_at(eye, target, LENS.fov, LENS.resolution);
        let [mut s, mut t, _] = low_discrepancy_point(ray, 8).to_array();
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let point = a + (b - a) * s + (c - a) * t;
        let at = camera.pixel_from_view(camera.pose.point_in_view(point));
        // Where the rays through the corners of the neighbourhood meet the triangle.
        let meet = |(x, y): (f64, f64)| -> Option<DVec3> {
            let near = camera.view_from_pixel(at + DVec2::new(x, y), 1.0);
            let direction = camera.pose.point_in_world(near) - eye;
            let distance = normal.dot(a - eye) / normal.dot(direction);
            let met = eye + direction * distance;
            let is_left = |p: DVec3, q: DVec3| normal.dot((q - p).cross(met - p)) >= 0.0;
            let inside = is_left(a, b) && is_left(b, c) && is_left(c, a);
            (distance > 0.0 && inside).then_some(met)
        };
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let met: Vec<DVec3> = corners.into_iter().filter_map(meet).collect();
        if met.len() < corners.len() {
            continue;
        }
        looked += 1;
        let depth = |p: &DVec3| layers.stack.pose.point_in_view(*p).z;
        let farthest = met.iter().map(depth).fold(0.0, f64::max);
        let behind = layers.stack.layer_at(farthest);
        let seen = layers.first_met(eye, point);
        if seen.is_none_or(|seen| seen > behind + 1) {
            return Err(format!(
                "ray {ray} from {eye} to {point}, of layer {behind}, meets {seen:?}"
            ));
        }
    }
    Ok(looked)
}

/// Thin triangles of any direction, and larger ones.
fn strips() -> impl Strategy<Value = Vec<[Vec3; 3]>> {
    let vector = |most: f32| prop::array::uniform3(-most..most).prop_map(Vec3::from);
    // A pixel is about 0.06 wide at this distance.
    let width = prop_oneof![0.15..0.5f32, 0.15..2.0f32];
    let strip = (vector(1.5), vector(1.5), vector(1.0), width).prop_map(|(a, b, side, width)| {
        let side = side.normalize_or(Vec3::X) * width;
        [a, b, (a + b) / 2.0 + side]
    });
    prop::collection::vec(strip, 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// From nowhere in the cell one looks through an open surface that reaches a pixel farther on
    /// all sides: only within a pixel of its border rays slip past it.
    #[test]
    fn rays_slip_past_the_borders_of_open_surfaces_only(triangles in strips()) {
        let scene = scene_of(&triangles);
        let layers = Layers::of(&scene);
        let [min, max] = scene.bounds().unwrap();
        for triangle in triangles {
            let shown = check_shown(&layers, triangle, (min + max) / 2.0, 600);
            prop_assert!(shown.is_ok(), "{}", shown.unwrap_err());
        }
    }
}

/// The check itself looks along rays, and finds a hole of one texel.
#[test]
fn a_hole_in_an_open_surface_is_found() {
    let triangle = [[-1.2, -1.0, 0.3], [1.3, -0.8, 0.2], [0.1, 1.1, 0.25]].map(Vec3::from);
    let scene = scene_of(&[triangle]);
    let [min, max] = scene.bounds().unwrap();
    let target = (min + max) / 2.0;
    let mut layers = Layers::of(&scene);
    let looked = check_shown(&layers, triangle, target, 20_000).unwrap();
    assert!(looked > 10_000, "only {looked} rays");
    let texels = layers.kept.iter_mut().max_by_key(|mask| mask.count());
    let texels = texels.unwrap();
    let all: Vec<_> = texels.iter().collect();
    let (x, y) = all[all.len() / 2];
    texels.remove(x, y);
    assert!(check_shown(&layers, triangle, target, 20_000).is_err());
}

/// A fence: panels that end in mid-air, each nearer than the one to its left, with slits between
/// them that are a third of a pixel wide, and nothing behind. The slits lean a little, so that they
/// lie otherwise between the centres of pixels in every few rows.
fn fence() -> Scene {
    let panels = (0..24).flat_map(|i| {
        let (left, width) = (0.16 * i as f32 - 1.92, 0.143);
        let depth = 0.031 * i as f32 - 0.37;
        let corner = |x: f32, y: f32| Vec3::new(left + x * width + 0.04 * y, y, depth);
        [
            [corner(0.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)],
            [corner(0.0, -1.0), corner(1.0, 1.0), corner(0.0, 1.0)],
        ]
    });
    scene_of(&panels.collect::<Vec<_>>())
}

/// A slit that lies between the centres of pixels in the original may lie on one of them in the
/// impostor: that is no gap.
#[test]
fn a_slit_between_the_centres_of_pixels_is_no_gap() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, dir) = (
        folder.path().join("scene.glb"),
        folder.path().join("bundle"),
    );
    std::fs::write(&scene, glb_from_scene(&fence(), &[]).unwrap()).unwrap();
    let options = options_in_cell(SceneChoice::File(scene), "box:0,0,6:4,3,2", 96, &dir);
    bake(&options, &Console::Silent).unwrap();
    let report = verified(&dir, 128);
    assert!(report.holds, "{:?}", report.broken);
}

/// A ground that ends in mid-air, with viewers above it and below it: these see what those are shown,
/// which is counted and breaks no promise.
#[test]
fn what_others_see_the_front_of_may_be_seen_from_behind() {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.2, z);
    let [a, b, c, d] =
        [(-2.0, 2.0), (2.0, 2.0), (2.0, -2.0), (-2.0, -2.0)].map(|(x, z)| corner(x, z));
    let mut ground = scene_of(&[[a, b, c], [a, c, d]]);
    ground.materials[0].double_sided = false;
    let folder = tempfile::tempdir().unwrap();
    let (file, dir) = (
        folder.path().join("ground.glb"),
        folder.path().join("bundle"),
    );
    std::fs::write(&file, glb_from_scene(&ground, &[]).unwrap()).unwrap();
    let options = options_in_cell(SceneChoice::File(file), "box:0,0,6:4,3,2", 64, &dir);
    bake(&options, &Console::Silent).unwrap();
    let report = verified(&dir, 27);
    assert!(report.holds, "{:?}", report.broken);
    assert!(report.behind_pixels > 1000, "{}", report.behind_pixels);
    assert_eq!((report.back_pixels, report.phantom_pixels), (0, 0));
    let manifest = farfield_bundle::read(&dir).unwrap();
    assert!(
        manifest
            .promise
            .notes
            .iter()
            .any(|note| note.contains("ends in mid-air"))
    );
}
