//! What the pages hold: colours that are shown as they are, or what an engine lights.

use crate::setup::{display, model, options, verified, write_glb};
use farfield_grid::Grid;
use farfield_metrics::{ColorDifference, Picture, color_difference, compared_region};
use farfield_pages::place_as_object;
use farfield_sampling::{
    Lighting, Surface, Textures, Visibility, lit_color, rasterize, srgb_from_linear, surfaces,
};
use farfield_scene::{Filter, Image, Material, Scene, Texture, Wrap};
use farfield_views::{Camera, ViewCell};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use std::f32::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use xtask::{BakeOptions, BuiltIn, Channels, Console, SceneChoice, ViewCellSpec, bake};

fn house() -> SceneChoice {
    SceneChoice::BuiltIn(BuiltIn::House)
}

/// Three lights that no bake has seen: low from the left, straight from above, coloured from behind
/// the viewer.
fn unseen_lights() -> [Lighting; 3] {
    let light = |to_sun: Vec3, sun: Vec3, around: f32| Lighting {
        to_sun: to_sun.normalize(),
        sun,
        sky: Vec3::splat(around),
        ground: Vec3::splat(around / 2.0),
    };
    [
        light(Vec3::new(-1.0, 0.2, 0.3), Vec3::new(0.9, 0.6, 0.4), 0.1),
        light(Vec3::Y, Vec3::splat(0.6), 0.3),
        light(Vec3::new(0.1, -0.2, 1.0), Vec3::new(0.3, 0.4, 0.8), 0.05),
    ]
}

/// How an engine shows a surface to a viewer in a direction.
type Look<'a> = &'a (dyn Fn(&Surface, Vec3) -> Vec3 + Sync);

/// A scene to be relit, with the view cell that it is seen from.
struct Relit {
    source: SceneChoice,
    original: Scene,
    center: DVec3,
    size: DVec3,
}

impl Relit {
    /// A scene of a file.
    fn read(path: PathBuf, center: DVec3, size: f64) -> Self {
        Self {
            original: farfield_import::read(&path).unwrap().scene,
            source: SceneChoice::File(path),
            center,
            size: DVec3::splat(size),
        }
    }

    fn house() -> Self {
        Self {
            source: house(),
            original: farfield_town::house(0),
            center: DVec3::new(0.0, 10.0, 70.0),
            size: DVec3::splat(20.0),
        }
    }

    /// The impostor, as it is displayed.
    fn baked(&self, channels: Channels, dir: &Path) -> Scene {
        let options = BakeOptions {
            channels,
            view_cell: Some(ViewCellSpec::Box {
                center: self.center,
                size: self.size,
            }),
            ..options(self.source.clone(), 192, dir)
        };
        bake(&options, &Console::Silent).unwrap();
        display(dir)
    }

    /// How an impostor differs from the original, seen from a few places of the cell.
    fn difference(&self, impostor: &Scene, look: Look<'_>) -> ColorDifference {
        let cell = ViewCell::Box {
            center: self.center,
            size: self.size,
        };
        let [min, max] = self.original.bounds().unwrap();
        let textures = [&self.original, impostor].map(Textures::new);
        let mut all = ColorDifference::default();
        for view in [0, 3, 5, 6, 20, 30] {
            let eye = cell.viewpoint(view, 0);
            let camera = Camera::looking_at(eye, (min + max) / 2.0, 0.8, 192);
            let [(a, colors_a), (b, colors_b)] =
                [(&self.original, &textures[0]), (impostor, &textures[1])]
                    .map(|(scene, textures)| picture(scene, textures, &camera, look));
            let region = compared_region(&a, &b);
            all.merge(&color_difference(
                Picture {
                    colors: &colors_a,
                    ids: &a,
                },
                Picture {
                    colors: &colors_b,
                    ids: &b,
                },
                &region,
            ));
        }
        all
    }
}

/// What is seen at each pixel, and its sRGB colour.
fn picture(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    look: Look<'_>,
) -> (Grid<u32>, Grid<[u8; 3]>) {
    let seen: Visibility = rasterize(scene, textures, camera);
    let found = surfaces(scene, textures, camera, &seen);
    let (width, height) = (found.width(), found.height());
    let colors = (0..width * height).map(|i| {
        let (x, y) = (i % width, i / width);
        let pixel = DVec2::new(x as f64, y as f64) + 0.5;
        let point = camera
            .pose
            .point_in_world(camera.view_from_pixel(pixel, 1.0));
        let to_viewer = (camera.pose.eye - point).normalize().as_vec3();
        let color = found[(x, y)].map_or(Vec3::ZERO, |surface| look(&surface, to_viewer));
        color
            .to_array()
            .map(|c| (srgb_from_linear(c) * 255.0).round() as u8)
    });
    let colors = colors.collect();
    (seen.objects, Grid::from_cells(width, height, colors))
}

/// The farthest that a channel is off.
fn bias(difference: &ColorDifference) -> f64 {
    let bias = difference.typical_bias().map(f64::abs);
    bias.into_iter().fold(0.0, f64::max)
}

/// A ball of dented metal with spots of paint: textures for its normals, for what is metal, and for how
/// rough it is.
fn dented_ball() -> Scene {
    const COLUMNS: u32 = 96;
    const ROWS: u32 = 48;
    const SIDE: u32 = 256;
    let image = |name: &str, texel: fn(f32, f32) -> [u8; 3]| Image {
        name: name.into(),
        width: SIDE,
        height: SIDE,
        texels: (0..SIDE * SIDE)
            .map(|i| {
                let [u, v] = [i % SIDE, i / SIDE].map(|i| (i as f32 + 0.5) / SIDE as f32);
                let [r, g, b] = texel(u, v);
                [r, g, b, 255]
            })
            .collect(),
    };
    let mut scene = Scene {
        images: vec![
            image("colours", |u, v| match is_painted(u, v) {
                true => [60, 90, 160],
                false => [220, 190, 120],
            }),
            image("normals", |u, v| {
                let wave = |t: f32| 0.35 * (t * 8.0 * TAU).sin();
                let normal = Vec3::new(wave(u), wave(v), 1.0).normalize();
                (normal * 127.5 + 127.5).round().to_array().map(|c| c as u8)
            }),
            image("metallic-roughness", |u, v| match is_painted(u, v) {
                true => [0, 220, 0],
                false => [0, 120, 255],
            }),
        ],
        textures: (0..3)
            .map(|image| Texture {
                image,
                wrap: [Wrap::Repeat; 2],
                filter: Filter::Mipmapped,
            })
            .collect(),
        materials: vec![Material {
            base_color_texture: Some(0),
            normal_texture: Some(1),
            metallic_roughness_texture: Some(2),
            ..Material::default()
        }],
        ..Scene::default()
    };
    for row in 0..=ROWS {
        for column in 0..=COLUMNS {
            let (u, v) = (column as f32 / COLUMNS as f32, row as f32 / ROWS as f32);
            let ((sin_u, cos_u), (sin_v, cos_v)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
            let direction = Vec3::new(sin_u * sin_v, cos_v, cos_u * sin_v);
            scene.positions.push(direction);
            scene.normals.push(direction);
            scene.uvs.push(Vec2::new(2.0 * u, v));
            scene.colors.push(Vec4::ONE);
        }
    }
    for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        let [a, b] = [row, row + 1].map(|row| row * (COLUMNS + 1) + column);
        scene.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    // At the poles every other triangle is a line.
    scene.triangles.retain(|triangle| {
        let [a, b, c] = triangle.map(|v| scene.positions[v as usize]);
        (b - a).cross(c - a).length() > 1e-6
    });
    scene.triangle_materials = vec![0; scene.triangles.len()];
    place_as_object(&mut scene, "ball", DVec3::ZERO);
    scene
}

fn is_painted(u: f32, v: f32) -> bool {
    (u * 6.0).fract() < 0.5 && (v * 4.0).fract() < 0.5
}

/// What is of dented or painted metal: the ball, and the helmet where it is.
fn metals(folder: &Path) -> Vec<Relit> {
    let ball = write_glb(&dented_ball(), folder);
    let ball = Relit::read(ball, DVec3::new(0.0, 0.0, 5.0), 1.5);
    let helmet = model("FlightHelmet.glb");
    let helmet = helmet.map(|path| Relit::read(path, DVec3::new(0.0, 0.36, 1.6), 0.4));
    std::iter::once(ball).chain(helmet).collect()
}

/// An impostor with channels, lit by lights that it was not recorded under, looks as good as one that
/// was recorded under them, and much better than colours recorded under another light.
#[test]
fn an_impostor_is_relit() {
    let folder = tempfile::tempdir().unwrap();
    for scene in std::iter::once(Relit::house()).chain(metals(folder.path())) {
        let baked = |channels| scene.baked(channels, &folder.path().join(format!("{channels:?}")));
        let (lit, pbr) = (baked(Channels::Lit), baked(Channels::Pbr));
        let under = |impostor: &Scene, light: &Lighting| {
            scene.difference(impostor, &|surface, _| lit_color(surface, light))
        };
        let own = under(&lit, &Lighting::default()).psnr().unwrap();
        for light in unseen_lights() {
            let of = format!("{:?}, {light:?}", scene.source);
            let relit = under(&pbr, &light);
            assert!(
                bias(&relit) < 1.0 / 255.0,
                "{of}: a bias of {}",
                bias(&relit)
            );
            // As far from the original as colours under the light that they were recorded under.
            let relit = relit.psnr().unwrap();
            assert!(relit > own - 1.5, "{of}: {relit} dB, baked {own} dB");
            let wrong = under(&lit, &light).psnr().unwrap();
            assert!(
                relit > wrong + 3.0,
                "{of}: {relit} dB, not relit {wrong} dB"
            );
        }
    }
}

/// What glTF's metallic-roughness material looks like under a sun, and under a sky that is alike all
/// around: the model of its specification, appendix B.
fn as_engines_do(surface: &Surface, light: &Lighting, to_viewer: Vec3) -> Vec3 {
    let half = (light.to_sun + to_viewer).normalize();
    let cosine = |a: Vec3, b: Vec3| a.dot(b).clamp(0.0, 1.0);
    let (to_sun, facing) = (
        cosine(surface.normal, light.to_sun),
        cosine(surface.normal, to_viewer).max(1e-3),
    );
    let alpha_squared = surface.roughness.powi(4);
    let spread = cosine(surface.normal, half).powi(2) * (alpha_squared - 1.0) + 1.0;
    let facets = alpha_squared / (PI * spread * spread);
    let shadow = |a: f32, b: f32| a * (b * b * (1.0 - alpha_squared) + alpha_squared).sqrt();
    let unshadowed = 0.5 / (shadow(to_sun, facing) + shadow(facing, to_sun)).max(1e-6);
    let paint = Vec3::splat(0.04);
    let straight = paint.lerp(surface.base_color, surface.metallic);
    let mirrored = straight + (1.0 - straight) * (1.0 - cosine(to_viewer, half)).powi(5);
    let diffuse = surface.base_color * (1.0 - surface.metallic) * (1.0 - mirrored);
    let from_sun = (diffuse + mirrored * facets * unshadowed * PI) * light.sun * to_sun;
    from_sun + surface.base_color * light.sky + surface.emissive
}

/// Metals shine where the original's do: where an engine did not know what is metal and how rough, the
/// impostor would look otherwise.
#[test]
fn metals_shine_like_the_originals() {
    let folder = tempfile::tempdir().unwrap();
    for scene in metals(folder.path()) {
        let baked = |channels| scene.baked(channels, &folder.path().join(format!("{channels:?}")));
        let (lit, pbr) = (baked(Channels::Lit), baked(Channels::Pbr));
        let plain = |surface: &Surface, _: Vec3| lit_color(surface, &Lighting::default());
        let own = scene.difference(&lit, &plain).psnr().unwrap();
        let mut flat = pbr.clone();
        for material in &mut flat.materials {
            material.metallic_roughness_texture = None;
        }
        for light in unseen_lights() {
            let of = format!("{:?}, {light:?}", scene.source);
            let look = |surface: &Surface, to_viewer| as_engines_do(surface, &light, to_viewer);
            let shown = scene.difference(&pbr, &look);
            let bias = bias(&shown);
            assert!(bias < 1.0 / 255.0, "{of}: a bias of {bias}");
            let [shown, flat] = [shown, scene.difference(&flat, &look)].map(|d| d.psnr().unwrap());
            assert!(shown > own - 1.5, "{of}: {shown} dB, baked {own} dB");
            assert!(shown > flat + 0.5, "{of}: {shown} dB, else {flat} dB");
        }
    }
}

/// Whatever the pages hold, the promise is kept, and the glTF says how they are to be shown.
#[test]
fn every_kind_of_pages_keeps_its_promise() {
    let folder = tempfile::tempdir().unwrap();
    let helmet = model("FlightHelmet.glb").map(SceneChoice::File);
    for (i, scene) in std::iter::once(house()).chain(helmet).enumerate() {
        for channels in [Channels::Lit, Channels::Unlit, Channels::Pbr] {
            let dir = folder.path().join(format!("{i}-{channels:?}"));
            let options = BakeOptions {
                channels,
                page_size: 1024,
                ..options(scene.clone(), 192, &dir)
            };
            let report = bake(&options, &Console::Silent).unwrap();
            let verified = verified(&dir, 9);
            assert!(verified.holds, "{channels:?}: {:?}", verified.broken);
            let display = display(&dir);
            let pages = display.materials.len();
            let per_page = if channels == Channels::Pbr { 3 } else { 1 };
            assert_eq!(display.images.len(), per_page * pages);
            assert_eq!(report.draw_calls, pages as u64);
            for material in &display.materials {
                assert_eq!(material.unlit, channels != Channels::Pbr);
            }
        }
    }
}
