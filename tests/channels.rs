//! What the pages hold: colours that are shown as they are, or what an engine lights.

use crate::setup::{display, model, options, options_in_cell, verified};
use farfield_grid::Grid;
use farfield_metrics::{ColorDifference, Picture, color_difference, compared_region};
use farfield_sampling::{Lighting, Textures, Visibility, rasterize, shade, srgb_from_linear};
use farfield_scene::Scene;
use farfield_views::{Camera, ViewCell};
use glam::{DVec3, Vec3};
use xtask::{BakeOptions, BuiltIn, Channels, Console, SceneChoice, bake};

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

/// How an impostor differs from the original under a light, seen from a few places of the cell.
fn difference(original: &Scene, impostor: &Scene, light: &Lighting) -> ColorDifference {
    let cell = ViewCell::Box {
        center: DVec3::new(0.0, 10.0, 70.0),
        size: DVec3::splat(20.0),
    };
    let textures = [original, impostor].map(Textures::new);
    let mut all = ColorDifference::default();
    for view in [0, 3, 5, 6, 20, 30] {
        let eye = cell.viewpoint(view, 0);
        let camera = Camera::looking_at(eye, DVec3::new(0.0, 10.0, 0.0), 0.8, 192);
        let [(a, colors_a), (b, colors_b)] = [(original, &textures[0]), (impostor, &textures[1])]
            .map(|(scene, textures)| {
                let seen: Visibility = rasterize(scene, textures, &camera);
                let colors = shade(scene, textures, &camera, &seen, light);
                let byte = |c: f32| (srgb_from_linear(c) * 255.0).round() as u8;
                let colors = colors.cells().iter().map(|c| c.to_array().map(byte));
                (seen.objects, Grid::from_cells(192, 192, colors.collect()))
            });
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

/// An impostor with channels, lit by lights that it was not recorded under, looks as good as one that
/// was recorded under them, and much better than colours recorded under another light.
#[test]
fn an_impostor_is_relit() {
    let folder = tempfile::tempdir().unwrap();
    let original = farfield_town::house(0);
    let baked = |channels| {
        let dir = folder.path().join(format!("{channels:?}"));
        let cell = "box:0,10,70:20,20,20";
        let options = BakeOptions {
            channels,
            ..options_in_cell(house(), cell, 192, &dir)
        };
        bake(&options, &Console::Silent).unwrap();
        display(&dir)
    };
    let (lit, pbr) = (baked(Channels::Lit), baked(Channels::Pbr));
    let own = difference(&original, &lit, &Lighting::default());
    for light in unseen_lights() {
        let relit = difference(&original, &pbr, &light);
        let bias = relit
            .typical_bias()
            .map(f64::abs)
            .into_iter()
            .fold(0.0, f64::max);
        assert!(bias < 1.0 / 255.0, "{light:?}: a bias of {bias}");
        // As far from the original as colours under the light that they were recorded under.
        let [relit, own] = [&relit, &own].map(|d| d.psnr().unwrap());
        assert!(relit > own - 1.5, "{light:?}: {relit} dB, baked {own} dB");
        let wrong = difference(&original, &lit, &light).psnr().unwrap();
        assert!(
            relit > wrong + 3.0,
            "{light:?}: {relit} dB, not relit {wrong} dB"
        );
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
