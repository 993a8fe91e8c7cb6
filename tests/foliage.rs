//! Masked leaves: how much more an impostor covers than the original, from near and from afar.

use crate::setup::{display, model, options, options_in_cell, verified, write_bundle, write_glb};
use farfield_bundle::{Body, Manifest, sha256_hex};
use farfield_pages::place_as_object;
use farfield_pages::{opaque_texels, patches_of};
use farfield_scene::{AlphaMode, Filter, Image, Material, Scene, Texture, Wrap};
use farfield_views::{Camera, low_discrepancy_point, sphere_direction};
use glam::{DQuat, DVec3, Vec2, Vec4};
use std::path::{Path, PathBuf};
use xtask::{BakeOptions, Console, Foliage, SceneChoice, VerifyReport, bake};

/// The reference viewpoint, the view cell's corners and a few of its edges.
const VIEWS: u64 = 12;

/// By what share `--foliage centre` promises to keep the coverage, on average.
const KEPT: f64 = 0.05;

/// Leaves a card shows, along each side.
const LEAVES: u32 = 3;

/// A tree of 4 m: a trunk, and cards that each show a few leaves and nothing between them.
fn tree() -> Scene {
    let mut scene = Scene {
        images: vec![leaves()],
        textures: vec![Texture {
            image: 0,
            wrap: [Wrap::ClampToEdge; 2],
            filter: Filter::Linear,
        }],
        materials: vec![
            Material {
                base_color: Vec4::new(0.25, 0.16, 0.1, 1.0),
                metallic: 0.0,
                double_sided: true,
                ..Material::default()
            },
            Material {
                base_color_texture: Some(0),
                metallic: 0.0,
                alpha: AlphaMode::Mask { cutoff: 0.5 },
                double_sided: true,
                ..Material::default()
            },
        ],
        ..Scene::default()
    };
    for turn in [0.0, 0.5] {
        let wide = DQuat::from_rotation_y(turn * std::f64::consts::PI) * DVec3::X * 0.12;
        add_card(&mut scene, 0, DVec3::Y, wide, DVec3::Y);
    }
    for card in 0..240 {
        let at = low_discrepancy_point(card, 1);
        // Evenly within a ball, and turned every way.
        let out = sphere_direction(card as u32, 240) * at.x.cbrt() * DVec3::new(1.2, 1.0, 1.2);
        let normal = sphere_direction((card * 97 % 240) as u32, 240);
        let turn = DQuat::from_rotation_arc(DVec3::Z, normal)
            * DQuat::from_rotation_z(at.y * std::f64::consts::TAU);
        let [wide, high] = [DVec3::X, DVec3::Y].map(|axis| turn * axis * 0.25);
        add_card(&mut scene, 1, DVec3::Y * 2.9 + out, wide, high);
    }
    place_as_object(&mut scene, "tree", DVec3::ZERO);
    scene
}

/// A rectangle around a centre, with half of its sides.
fn add_card(scene: &mut Scene, material: u32, center: DVec3, wide: DVec3, high: DVec3) {
    let first = scene.positions.len() as u32;
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let corner = center + wide * x + high * y;
        scene.positions.push(corner.as_vec3());
        scene.normals.push(wide.cross(high).normalize().as_vec3());
        scene.uvs.push(Vec2::new(x as f32, -y as f32) * 0.5 + 0.5);
        scene.colors.push(Vec4::ONE);
    }
    let corners = [[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|i| first + i));
    scene.triangles.extend(corners);
    scene.triangle_materials.extend([material; 2]);
}

/// Ellipses of two greens, opaque inside and nothing outside.
fn leaves() -> Image {
    let side = 64 * LEAVES;
    let texel = |x: u32, y: u32| {
        let cell = Vec2::new(x as f32, y as f32).rem_euclid(Vec2::splat(64.0)) / 32.0 - 1.0;
        let (along, across) = (cell.x + cell.y, cell.x - cell.y);
        let is_leaf = along * along / 3.0 + across * across / 0.6 < 1.0;
        let green = 110 + 40 * ((x / 64 + y / 64) % 2) as u8;
        [60, green, 40, if is_leaf { 255 } else { 0 }]
    };
    let texels = (0..side).flat_map(|y| (0..side).map(move |x| texel(x, y)));
    Image {
        name: "leaves".into(),
        width: side,
        height: side,
        texels: texels.collect(),
    }
}

/// The tree's bundle in a folder.
fn bake_tree(folder: &Path, foliage: Foliage) -> PathBuf {
    let dir = folder.join(format!("{foliage:?}"));
    let options = BakeOptions {
        foliage,
        ..options(SceneChoice::File(write_glb(&tree(), folder)), 160, &dir)
    };
    bake(&options, &Console::Silent).unwrap();
    dir
}

/// By what share an impostor covers more at full, half and quarter resolution.
fn changes(report: &VerifyReport) -> [f64; 3] {
    let full = report.coverage_at[0].resolution;
    let at: Vec<_> = report.coverage_at.iter().collect();
    assert_eq!(at.len(), 3);
    [0, 1, 2].map(|i| {
        assert_eq!(at[i].resolution, full >> i);
        at[i].change
    })
}

/// Baked by the centres of texels, as much is covered as by the original, from near and from afar.
fn check_kept(report: &VerifyReport) {
    assert!(report.holds, "{:?}", report.broken);
    assert!(report.coverage_change.abs() <= KEPT, "{report:?}");
    let changes = changes(report);
    assert!(
        changes.iter().all(|change| change.abs() <= KEPT),
        "{changes:?}"
    );
}

/// Baked without gaps, more is covered, but not more and more from afar: each texel that is set is as
/// large as it is, however few pixels show it.
fn check_alike(report: &VerifyReport) {
    assert!(report.holds, "{:?}", report.broken);
    assert_eq!(report.gap_pixels, 0);
    let changes = changes(report);
    let [least, most] = [f64::min, f64::max].map(|of| changes.into_iter().reduce(of).unwrap());
    assert!(least > KEPT && most < 0.3, "{changes:?}");
    assert!(most - least < 0.02, "{changes:?}");
}

#[test]
fn leaves_set_by_their_centres_cover_as_much_at_every_size() {
    let folder = tempfile::tempdir().unwrap();
    let dir = bake_tree(folder.path(), Foliage::Centre);
    let promise = farfield_bundle::read(&dir).unwrap().promise;
    assert_eq!(promise.coverage_change, Some(KEPT));
    assert_eq!(promise.gap_pixels, None);
    check_kept(&verified(&dir, VIEWS));
}

#[test]
fn leaves_without_gaps_cover_alike_at_every_size() {
    let folder = tempfile::tempdir().unwrap();
    let dir = bake_tree(folder.path(), Foliage::Any);
    let promise = farfield_bundle::read(&dir).unwrap().promise;
    assert_eq!(promise.coverage_change, None);
    assert_eq!(promise.gap_pixels, Some(0));
    check_alike(&verified(&dir, VIEWS));
}

/// The checksums of where a bundle's layers have texels, as what it displays has them.
fn state_texels(manifest: &mut Manifest, display: &Scene) {
    let Body::Layered(body) = &mut manifest.impostors[0].body else {
        panic!("layers were baked");
    };
    let camera = Camera {
        pose: body.pose,
        extent: body.extent,
        width: body.width,
        height: body.height,
    };
    let depths: Vec<f64> = body.layers.iter().map(|layer| layer.depth).collect();
    let patches = patches_of(display, &camera, &depths).unwrap();
    for (i, layer) in (0..).zip(&mut body.layers) {
        let of_layer = patches.iter().filter(|patch| patch.layer == i);
        let of_layer: Vec<_> = of_layer.copied().collect();
        let texels = opaque_texels(&of_layer, &display.images);
        let numbers = texels.as_flattened().iter();
        let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        layer.texels_sha256 = sha256_hex(&bytes);
    }
}

/// Sets the texels to the left and right of those that are set.
fn widen(page: &mut Image) {
    let old = page.texels.clone();
    for (row, old) in page
        .texels
        .chunks_mut(page.width as usize)
        .zip(old.chunks(page.width as usize))
    {
        for (x, texel) in row.iter_mut().enumerate() {
            let beside = [x.checked_sub(1), Some(x + 1)].into_iter().flatten();
            let mut beside = beside.filter_map(|x| old.get(x));
            if let Some(set) = beside.find(|texel| texel[3] == 255) {
                texel[3] = set[3];
            }
        }
    }
}

fn covers_too_much(fault: &str) -> bool {
    fault.contains("more pixels than the original, promised at most")
}

/// Whoever makes leaves wider breaks the promise, though the manifest has the right checksums.
#[test]
fn leaves_that_were_widened_cover_too_much() {
    let folder = tempfile::tempdir().unwrap();
    let dir = bake_tree(folder.path(), Foliage::Centre);
    let mut manifest = farfield_bundle::read(&dir).unwrap();
    let mut display = display(&dir);
    state_texels(&mut manifest, &display);
    assert_eq!(manifest, farfield_bundle::read(&dir).unwrap());

    display.images.iter_mut().for_each(widen);
    write_bundle(&dir, &manifest, &display);
    let broken = verified(&dir, 9).broken;
    let named = |fault: &String| fault.contains("shows other texels than were baked");
    assert!(broken.iter().any(named), "{broken:?}");
    assert!(
        broken.iter().any(|fault| covers_too_much(fault)),
        "{broken:?}"
    );

    state_texels(&mut manifest, &display);
    write_bundle(&dir, &manifest, &display);
    let broken = verified(&dir, 9).broken;
    assert!(!broken.iter().any(named), "{broken:?}");
    assert!(
        broken.iter().any(|fault| covers_too_much(fault)),
        "{broken:?}"
    );
}

/// All texels that leaves touch are more than was promised by who says that he set centres, and nothing
/// else tells.
#[test]
fn leaves_without_gaps_are_too_wide_for_who_promises_coverage() {
    let folder = tempfile::tempdir().unwrap();
    let dir = bake_tree(folder.path(), Foliage::Any);
    let by_centres = farfield_bundle::read(&bake_tree(folder.path(), Foliage::Centre)).unwrap();
    let manifest = Manifest {
        technique: by_centres.technique,
        promise: by_centres.promise,
        ..farfield_bundle::read(&dir).unwrap()
    };
    let mut display = display(&dir);
    for material in &mut display.materials {
        material.alpha = AlphaMode::Mask { cutoff: 0.5 };
    }
    write_bundle(&dir, &manifest, &display);
    let broken = verified(&dir, 9).broken;
    assert!(
        broken.len() == 1 && covers_too_much(&broken[0]),
        "{broken:?}"
    );
}

/// A real tree of 5,280 leaf cards.
#[test]
fn an_oak_covers_as_promised() {
    let Some(oak) = model("tree_oak_large.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for (foliage, check) in [
        (Foliage::Centre, check_kept as fn(&VerifyReport)),
        (Foliage::Any, check_alike),
    ] {
        let dir = folder.path().join(format!("{foliage:?}"));
        let scene = SceneChoice::File(oak.clone());
        let options = BakeOptions {
            foliage,
            ..options_in_cell(scene, "box:0,50,220:40,40,40", 192, &dir)
        };
        bake(&options, &Console::Silent).unwrap();
        check(&verified(&dir, VIEWS));
    }
}
