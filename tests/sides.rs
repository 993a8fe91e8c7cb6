//! Bundles of several impostors: round a view cell amid the scene, and of views from all around.

use crate::setup::{display, model, options, options_in_cell, verified, write_bundle};
use farfield_bundle::{Manifest, NewFile, Side, ViewSpace, glb_from_scene};
use farfield_sampling::{NONE, Textures, rasterize};
use farfield_scene::{AlphaMode, Material, Mesh, Object, Scene};
use farfield_views::{Camera, ViewCell, low_discrepancy_point, sphere_direction};
use glam::{DAffine3, DQuat, DVec3, Vec2, Vec4};
use std::path::Path;
use xtask::{
    Arrangement, BakeOptions, BuiltIn, Console, SceneChoice, VerifyOptions, Views, bake, verify,
};

/// The smallest town.
const TOWN: BuiltIn = BuiltIn::Town {
    triangles: 100_000,
    seed: 1,
};

fn town() -> SceneChoice {
    SceneChoice::BuiltIn(TOWN)
}

/// On the market place of the built-in town.
const AMID_TOWN: &str = "box:0,12,0:10,3,10";

fn amid_town(out: &Path) -> BakeOptions {
    BakeOptions {
        arrangement: Arrangement::Far(60.0),
        ..options_in_cell(town(), AMID_TOWN, 192, out)
    }
}

/// Changes a bundle's manifest and writes it with checksums that are right.
fn rewritten(dir: &Path, change: impl FnOnce(&mut Manifest)) {
    let mut manifest = farfield_bundle::read(dir).unwrap();
    change(&mut manifest);
    let files = manifest.files.iter().map(|file| NewFile {
        path: file.path.clone(),
        bytes: std::fs::read(dir.join(&file.path)).unwrap(),
    });
    let files: Vec<_> = files.collect();
    farfield_bundle::write(dir, &manifest, &files).unwrap();
}

fn refused(dir: &Path) -> String {
    let options = VerifyOptions {
        dir: dir.to_owned(),
        scene: None,
        views: Views::First(1),
    };
    format!("{:#}", verify(&options, &Console::Silent).unwrap_err())
}

/// Pixels at which the original covers the 3 x 3 neighbourhood and the impostors nothing.
fn holes(original: &Scene, impostors: &Scene, cameras: &[Camera]) -> usize {
    let textures = [original, impostors].map(Textures::new);
    let mut holes = 0;
    for camera in cameras {
        let [there, shown] = [(original, &textures[0]), (impostors, &textures[1])]
            .map(|(scene, textures)| rasterize(scene, textures, camera).objects);
        for y in 1..there.height() - 1 {
            for x in 1..there.width() - 1 {
                let nine = (0..9).map(|i| there[(x + i % 3 - 1, y + i / 3 - 1)]);
                let covered = nine.clone().all(|id| id != NONE);
                holes += usize::from(covered && shown[(x, y)] == NONE);
            }
        }
    }
    holes
}

/// Each impostor keeps its promise, and together they have no seam at which one sees through.
#[test]
fn what_is_far_surrounds_the_cell_without_a_seam() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let report = bake(&amid_town(&dir), &Console::Silent).unwrap();
    assert!(report.impostors.len() >= 3, "{:?}", report.impostors);
    assert_eq!(report.draw_calls, report.impostors.len() as u64);
    let verified = verified(&dir, 60);
    assert!(verified.holds, "{:?}", verified.broken);
    assert_eq!(verified.seams.unwrap().gap_pixels, 0);
    assert!(verified.proved.iter().all(|found| found.bound <= 1.0));

    let manifest = farfield_bundle::read(&dir).unwrap();
    let ViewSpace::Amid {
        view_cell, objects, ..
    } = &manifest.options.view_space
    else {
        panic!("{:?}", manifest.options.view_space);
    };
    let mut original = farfield_town::town(1, 100_000);
    let is_far = |name: &String| objects.contains(name);
    original.objects.retain(|object| is_far(&object.name));
    assert_eq!(original.objects.len(), objects.len());
    let ViewCell::Box { center, size } = view_cell else {
        panic!("{view_cell:?}");
    };
    for object in 0..original.objects.len() as u32 {
        let [min, max] = original.bounds_of(object).unwrap();
        let nearest = center.clamp(min, max);
        assert!(nearest.distance(*center) > 60.0 && nearest.distance(*center) < 1000.0);
    }

    // Along the seams, where |x| = |z| or |x| = |y|, and all around.
    let impostors = display(&dir);
    let along = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|z| [0.0, 0.3, 1.0].map(|y| [x, y, z])));
    let along = along.as_flattened().as_flattened().to_vec();
    let seams = along.into_iter().map(DVec3::from);
    let around = (0..24).map(|i| sphere_direction(i, 24));
    let cameras: Vec<_> = (0..)
        .zip(seams.chain(around))
        .map(|(i, direction)| {
            let eye = view_cell.viewpoint(i % 26, 0);
            assert!(((eye - center).abs() * 2.0 - size).max_element() < 1e-9);
            Camera::looking_at(eye, eye + direction, 1.0, 256)
        })
        .collect();
    assert_eq!(holes(&original, &impostors, &cameras), 0);
    // Without one of them there are some.
    let mut fewer = impostors.clone();
    fewer.objects.pop();
    assert!(holes(&original, &fewer, &cameras) > 100);
}

/// Seen together, too, impostors that lack something let one see through.
#[test]
fn quads_that_are_missing_at_a_seam_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let (file, dir) = (folder.path().join("hall.glb"), folder.path().join("bundle"));
    std::fs::write(&file, glb_from_scene(&hall(), &[]).unwrap()).unwrap();
    let options = BakeOptions {
        arrangement: Arrangement::Far(5.0),
        ..options_in_cell(SceneChoice::File(file), "box:0,0,0:2,2,2", 96, &dir)
    };
    bake(&options, &Console::Silent).unwrap();
    let mut display = display(&dir);
    let quads = &mut display.meshes[0].triangles;
    quads.end = quads.start + (quads.end - quads.start) / 4 * 2;
    write_bundle(&dir, &farfield_bundle::read(&dir).unwrap(), &display);
    let report = verified(&dir, 6);
    assert!(report.seams.unwrap().gap_pixels > 100);
    let named =
        |fault: &String| fault.contains("gap pixels where impostors meet, promised at most 0");
    assert!(report.broken.iter().any(named), "{:?}", report.broken);
}

#[test]
fn a_bundle_that_leaves_out_a_side_or_objects_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    bake(&amid_town(&dir), &Console::Silent).unwrap();
    let good = farfield_bundle::read(&dir).unwrap();

    rewritten(&dir, |manifest| {
        let dropped = manifest.impostors.pop().unwrap();
        let body = dropped.body.layers().unwrap();
        let total = &mut manifest.statistics;
        total.layers -= body.layers.len() as u64;
        total.quads -= body.layers.iter().map(|l| u64::from(l.quads)).sum::<u64>();
        total.texels_recorded -= body.texels_recorded;
        total.texels_kept -= body.texels_kept;
    });
    let why = refused(&dir);
    assert!(why.contains("the original needs them for"), "{why}");

    rewritten(&dir, |manifest| {
        *manifest = good.clone();
        let ViewSpace::Amid { objects, .. } = &mut manifest.options.view_space else {
            panic!("{:?}", good.options.view_space);
        };
        objects.pop();
    });
    let why = refused(&dir);
    assert!(why.contains("that are far from the view cell"), "{why}");

    rewritten(&dir, |manifest| {
        *manifest = good.clone();
        for (impostor, other) in manifest
            .impostors
            .iter_mut()
            .zip(["a", "b", "c", "d", "e", "f"])
        {
            impostor.name = other.into();
        }
    });
    let why = refused(&dir);
    assert!(why.contains("impostors.glb: has no object"), "{why}");
}

/// Other borders cut other parts, and layers are too near.
#[test]
fn a_cell_that_grew_amid_the_scene_is_found_out() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    bake(&amid_town(&dir), &Console::Silent).unwrap();
    rewritten(&dir, |manifest| {
        let ViewSpace::Amid {
            view_cell: ViewCell::Box { size, .. },
            ..
        } = &mut manifest.options.view_space
        else {
            panic!("{:?}", manifest.options.view_space);
        };
        *size *= 1.05;
    });
    let options = VerifyOptions {
        dir,
        scene: None,
        views: Views::First(12),
    };
    // Refused, where a border cuts something, or else too near.
    let found = verify(&options, &Console::Silent);
    assert!(found.is_err() || found.is_ok_and(|report| !report.holds));
}

/// Nearer than the layers are made for, the promise is broken, and each impostor is named.
#[test]
fn views_from_too_near_break_the_promise() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let options = BakeOptions {
        arrangement: Arrangement::Around(None),
        ..options(SceneChoice::BuiltIn(BuiltIn::House), 128, &dir)
    };
    bake(&options, &Console::Silent).unwrap();
    rewritten(&dir, |manifest| {
        let ViewSpace::Around { near, .. } = &mut manifest.options.view_space else {
            panic!("{:?}", manifest.options.view_space);
        };
        *near *= 0.7;
    });
    let report = verified(&dir, 6);
    assert!(!report.holds);
    for side in Side::ALL {
        let name = format!("house {side}: ");
        assert!(
            report.broken.iter().any(|fault| fault.starts_with(&name)),
            "{side}"
        );
    }
}

/// Four rough walls and a ceiling of 8 m round the origin, longer than they are away, so that they
/// cross the seams.
fn hall() -> Scene {
    let mut scene = Scene {
        materials: vec![Material {
            double_sided: true,
            ..Material::default()
        }],
        ..Scene::default()
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let turns = (0..4).map(|i| DQuat::from_rotation_y(f64::from(i) * quarter));
    for turn in turns.chain([DQuat::from_rotation_x(quarter)]) {
        add_wall(&mut scene, turn);
    }
    scene
}

/// A rough wall of 24 m x 24 m, 8 m behind the origin and turned about it.
fn add_wall(scene: &mut Scene, turn: DQuat) {
    const SIDE: u32 = 24;
    let first = scene.positions.len() as u32;
    let triangles = scene.triangles.len() as u32;
    for i in 0..(SIDE + 1) * (SIDE + 1) {
        let (x, y) = (i % (SIDE + 1), i / (SIDE + 1));
        let rough = low_discrepancy_point(u64::from(i), 5).x;
        let half = f64::from(SIDE) / 2.0;
        let point = DVec3::new(f64::from(x) - half, f64::from(y) - half, -8.0 - rough);
        scene.positions.push((turn * point).as_vec3());
        scene.normals.push((turn * DVec3::Z).as_vec3());
        scene.uvs.push(Vec2::ZERO);
        scene.colors.push(Vec4::ONE);
        if x < SIDE && y < SIDE {
            let [a, b] = [first + i, first + i + SIDE + 1];
            scene.triangles.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
        }
    }
    scene.triangle_materials.resize(scene.triangles.len(), 0);
    scene.objects.push(Object {
        name: format!("wall {}", scene.objects.len()),
        mesh: scene.meshes.len() as u32,
        world_from_mesh: DAffine3::IDENTITY,
    });
    scene.meshes.push(Mesh {
        vertices: first..scene.positions.len() as u32,
        triangles: triangles..scene.triangles.len() as u32,
    });
}

/// What crosses the border between two impostors is in both, so that it has no seam.
#[test]
fn walls_across_the_borders_have_no_seams() {
    let folder = tempfile::tempdir().unwrap();
    let (file, dir) = (folder.path().join("hall.glb"), folder.path().join("bundle"));
    std::fs::write(&file, glb_from_scene(&hall(), &[]).unwrap()).unwrap();
    let options = BakeOptions {
        arrangement: Arrangement::Far(5.0),
        ..options_in_cell(SceneChoice::File(file), "box:0,0,0:2,2,2", 128, &dir)
    };
    let report = bake(&options, &Console::Silent).unwrap();
    assert_eq!(report.impostors.len(), 6, "the walls reach under the cell");
    let verified = verified(&dir, 120);
    assert!(verified.holds, "{:?}", verified.broken);
    let impostors = display(&dir);
    let cell = ViewCell::Box {
        center: DVec3::ZERO,
        size: DVec3::splat(2.0),
    };
    let cameras: Vec<_> = (0..120)
        .map(|i| {
            let eye = cell.viewpoint(i % 40, 1);
            Camera::looking_at(eye, eye + sphere_direction(i as u32, 120), 1.0, 256)
        })
        .collect();
    assert_eq!(holes(&hall(), &impostors, &cameras), 0);
}

/// Each of six impostors holds for the viewers on its side; what is seen from behind is counted.
#[test]
fn views_from_all_around_hold() {
    let folder = tempfile::tempdir().unwrap();
    let house = SceneChoice::BuiltIn(BuiltIn::House);
    let bunny = model("stanford_bunny.glb").map(SceneChoice::File);
    for (i, scene) in std::iter::once(house).chain(bunny).enumerate() {
        let dir = folder.path().join(i.to_string());
        let options = BakeOptions {
            arrangement: Arrangement::Around(None),
            ..options(scene, 256, &dir)
        };
        let report = bake(&options, &Console::Silent).unwrap();
        assert_eq!(report.impostors.len(), 6);
        let report = verified(&dir, 72);
        assert_eq!(report.seams, None);
        assert!(report.holds, "{:?}", report.broken);
        assert_eq!((report.gap_pixels, report.phantom_pixels), (0, 0));
        // The house's porch has no underside, but a front that is seen from below it.
        assert!(i > 0 || report.behind_pixels > 0);
        let manifest = farfield_bundle::read(&dir).unwrap();
        let sides: Vec<_> = manifest.impostors.iter().map(|one| one.side).collect();
        assert_eq!(sides, Side::ALL.map(Some));
        let boxes = manifest.impostors.iter().map(|one| one.represented);
        assert!(
            boxes
                .clone()
                .all(|one| one == manifest.impostors[0].represented)
        );
    }
}

/// A side on which all is transparent needs no impostor.
#[test]
fn a_side_that_shows_nothing_is_left_out() {
    let mut scene = hall();
    // The walls before, beside and behind stay as they are; the ceiling becomes glass.
    scene.materials.push(Material {
        base_color: Vec4::new(1.0, 1.0, 1.0, 0.0),
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        double_sided: true,
        ..Material::default()
    });
    let ceiling = scene.meshes[4].triangles.clone();
    for triangle in ceiling {
        scene.triangle_materials[triangle as usize] = 1;
    }
    // Walls that do not reach over or under the cell.
    for position in &mut scene.positions {
        if position.y.abs() < 8.0 {
            continue;
        }
        let is_ceiling = position.y > 0.0 && position.x.abs().max(position.z.abs()) < 7.5;
        if !is_ceiling {
            position.y = position.y.clamp(-6.0, 6.0);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let (file, dir) = (folder.path().join("hall.glb"), folder.path().join("bundle"));
    std::fs::write(&file, glb_from_scene(&scene, &[]).unwrap()).unwrap();
    let options = BakeOptions {
        arrangement: Arrangement::Far(5.0),
        ..options_in_cell(SceneChoice::File(file), "box:0,0,0:2,2,2", 96, &dir)
    };
    let report = bake(&options, &Console::Silent).unwrap();
    let names: Vec<_> = report.impostors.iter().map(|one| &one.name).collect();
    assert!(!names.contains(&&"hall +y".to_owned()), "{names:?}");
    let verified = verified(&dir, 40);
    assert!(verified.holds, "{:?}", verified.broken);
}

#[test]
fn arrangements_that_do_not_suit_the_scene_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let refused = |arrangement, cell: Option<&str>| {
        let options = BakeOptions {
            arrangement,
            view_cell: cell.map(|cell| cell.parse().unwrap()),
            ..options(town(), 64, &dir)
        };
        let error = bake(&options, &Console::Silent).unwrap_err();
        assert!(!dir.exists());
        format!("{error:#}")
    };
    for (arrangement, cell, expected) in [
        (Arrangement::Far(1e6), Some(AMID_TOWN), "lower --far"),
        (Arrangement::Far(60.0), None, "name the box"),
        (
            Arrangement::Far(60.0),
            Some("shaft:0,0,1:10:900"),
            "name the box",
        ),
        (Arrangement::Around(Some(10.0)), None, "too near for views"),
        // As far as the scene reaches and a little more: of the farthest viewers texels would be too
        // small before they are as far on all sides.
        (Arrangement::Around(Some(135.0)), None, "too near for views"),
        (
            Arrangement::Around(None),
            Some(AMID_TOWN),
            "leave --view-cell out",
        ),
    ] {
        let why = refused(arrangement, cell);
        assert!(why.contains(expected), "{why}");
    }
}
