//! What the viewer shows, by its pictures without a window, against what `verify` sees.

#[path = "../../../tests/gpu/adapter.rs"]
mod adapter;

use adapter::gpu;
use image::RgbaImage;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Output};
use xtask::{
    Arrangement, BakeOptions, BitfieldsOptions, BuiltIn, Console, Making, SampleChoice,
    SceneChoice, SeenFrom, VerifyOptions, Views, bake, bake_bitfields, verify,
};

/// Pixels along each side of what is promised.
const RESOLUTION: u32 = 128;

/// A file of some textured blocks on a board: quick to read.
fn blocks(folder: &Path) -> SceneChoice {
    let mut text =
        String::from("mtllib blocks.mtl\nusemtl bricks\nvt 0 0\nvt 3 0\nvt 3 2\nvt 0 2\n");
    let mut add = |[x, z]: [f64; 2], [width, height]: [f64; 2], turn: f64| {
        let corner = |i: usize| {
            let side = |bit: usize| if i >> bit & 1 == 1 { width } else { -width };
            let (u, v) = (side(0), side(1));
            let [x, z] = [
                x + u * turn.cos() - v * turn.sin(),
                z + u * turn.sin() + v * turn.cos(),
            ];
            // Blocks begin inside of the slab: of faces in one plane, seen from below, any may be drawn.
            let bottom = height / 30.0;
            [x, if i >> 2 == 1 { height } else { bottom }, z]
        };
        for [x, y, z] in (0..8).map(corner) {
            text += &format!("v {x} {y} {z}\n");
        }
        // Counter-clockwise from outside, counted from the last vertex.
        for quad in [
            [-8, -7, -5, -6],
            [-4, -2, -1, -3],
            [-8, -4, -3, -7],
            [-6, -5, -1, -2],
            [-8, -6, -2, -4],
            [-7, -3, -1, -5],
        ] {
            let corners = quad.iter().zip(1..);
            let corners = corners.map(|(vertex, uv)| format!(" {vertex}/{uv}"));
            text += &format!("f{}\n", corners.collect::<String>());
        }
    };
    add([0.0, 0.0], [5.0, 0.2], 0.0);
    for i in 0..9u32 {
        let at = [i % 3, i / 3].map(|i| f64::from(i) * 3.0 - 3.0);
        let number = f64::from(i);
        add(at, [0.6 + 0.05 * number, 1.0 + 0.4 * number], 0.37 * number);
    }
    std::fs::write(folder.join("blocks.obj"), text).unwrap();
    std::fs::write(
        folder.join("blocks.mtl"),
        "newmtl bricks\nmap_Kd bricks.png\n",
    )
    .unwrap();
    let bricks = RgbaImage::from_fn(64, 64, |x, y| {
        let row = y / 16;
        let is_joint = y % 16 == 0 || (x + 16 * (row % 2)) % 32 == 0;
        let red = (100 + 37 * (x / 32 + 2 * row) % 100) as u8;
        image::Rgba(if is_joint {
            [190, 185, 175, 255]
        } else {
            [red, 70, 50, 255]
        })
    });
    bricks.save(folder.join("bricks.png")).unwrap();
    SceneChoice::File(folder.join("blocks.obj"))
}

fn options(scene: SceneChoice, dir: &Path) -> BakeOptions {
    BakeOptions {
        resolution: RESOLUTION,
        out: Some(dir.into()),
        ..BakeOptions::new(scene)
    }
}

fn baked(options: &BakeOptions) {
    bake(options, &Console::Silent).expect("the scene can be baked");
}

fn viewer(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_farfield-viewer"))
        .args(arguments)
        .arg(dir)
        // Mesa's drivers print to stderr where there is no desktop.
        .env("NODEVICE_SELECT", "1")
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the program starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn picture(path: &Path) -> RgbaImage {
    let read = image::open(path);
    read.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        .to_rgba8()
}

/// What the viewer shows.
fn shown(dir: &Path, arguments: &[&str]) -> RgbaImage {
    let folder = tempfile::tempdir().expect("there is room for a picture");
    let file = folder.path().join("picture.png");
    let file_argument = file.to_str().expect("the folder's name is UTF-8");
    let all = [arguments, &["--screenshot", file_argument]].concat();
    let output = viewer(dir, &all);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        stderr(&output)
    );
    assert!(output.stdout.is_empty());
    let text = stderr(&output);
    assert!(text.contains(&format!("saved {file_argument}")), "{text}");
    picture(&file)
}

/// Pictures differ in at most 0.1 % of the pixels by more than 2 of 255.
fn assert_alike(a: &RgbaImage, b: &RgbaImage, what: &str) {
    assert_eq!(a.dimensions(), b.dimensions(), "{what}");
    let apart = |a: &image::Rgba<u8>, b: &image::Rgba<u8>| {
        let channels = a.0.iter().zip(b.0);
        channels.map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0)
    };
    let pairs = a.pixels().zip(b.pixels());
    let count = pairs.filter(|(a, b)| apart(a, b) > 2).count();
    let share = count as f64 / f64::from(a.width() * a.height());
    assert!(share <= 1e-3, "{what}: {count} pixels differ");
}

/// The viewer shows original and impostor as `verify` sees them, and leaves pictures of, from some views.
///
/// * `name` - what the pictures of the impostor are called
fn assert_shown_as_verified(dir: &Path, views: Range<u64>, name: &str) {
    for view in views {
        let options = VerifyOptions {
            dir: dir.into(),
            scene: None,
            views: Views::One(view),
        };
        verify(&options, &Console::Silent).expect("the bundle can be verified");
        let number = view.to_string();
        for (mode, name) in [("original", "original"), ("impostor", name)] {
            let expected = picture(&dir.join(format!("report/view-{view:04}-{name}.png")));
            let seen = shown(dir, &["--mode", mode, "--view", &number]);
            assert_alike(&seen, &expected, &format!("view {view}, {mode}"));
        }
    }
}

/// Original and impostor, and what all modes make of the two.
#[test]
fn layers_are_shown_as_verify_sees_them() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = &folder.path().join("bundle");
    baked(&options(SceneChoice::BuiltIn(BuiltIn::House), dir));
    assert_shown_as_verified(dir, 26..28, "impostor");
    baked(&options(blocks(folder.path()), dir));
    assert_shown_as_verified(dir, 2..3, "impostor");

    let seen = |mode| shown(dir, &["--mode", mode, "--view", "3"]);
    let (original, impostor) = (seen("original"), seen("impostor"));
    assert_ne!(original, impostor);
    let (split, difference) = (seen("split"), seen("difference"));
    assert_eq!(shown(dir, &["--view", "3"]), split);
    assert_eq!(seen("flicker"), original);
    for (x, y, pixel) in split.enumerate_pixels() {
        let (a, b) = (original.get_pixel(x, y), impostor.get_pixel(x, y));
        let expected = match x.cmp(&(RESOLUTION / 2)) {
            std::cmp::Ordering::Less => *a,
            std::cmp::Ordering::Equal => image::Rgba([255; 4]),
            std::cmp::Ordering::Greater => *b,
        };
        assert_eq!(*pixel, expected, "at {x}, {y}");
        let apart = |i: usize| a.0[i].abs_diff(b.0[i]).saturating_mul(4);
        // The background is not rounded before it is compared: four times half a step, and half a step.
        let is_near = |i: usize| difference.get_pixel(x, y).0[i].abs_diff(apart(i)) <= 2;
        assert!((0..3).all(is_near), "at {x}, {y}");
    }
    // Neither side is empty.
    let background = *original.get_pixel(0, 0);
    let covered = |picture: &RgbaImage| picture.pixels().filter(|p| **p != background).count();
    assert!([&original, &impostor].iter().all(|one| covered(one) > 500));
    let wide = shown(dir, &["--size", "96x64"]);
    assert_eq!(wide.dimensions(), (96, 64));
}

#[test]
fn meshes_are_shown_as_verify_sees_them() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let options = BakeOptions {
        making: Making::Tdm { enlarged: 1.5 },
        ..options(blocks(folder.path()), &dir)
    };
    baked(&options);
    assert_shown_as_verified(&dir, 8..10, "impostor");
}

/// Of several impostors the one that a viewpoint is for is shown alone.
#[test]
fn views_around_are_shown_as_verify_sees_them() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    let options = BakeOptions {
        arrangement: Arrangement::Around(None),
        ..options(blocks(folder.path()), &dir)
    };
    baked(&options);
    // Of two of the six the reference viewpoint, and of others corners, on the borders between sides.
    assert_shown_as_verified(&dir, 4..8, "impostor");
}

/// Of bitfields the ranges for the viewpoint are drawn.
#[test]
fn bitfields_are_shown_as_verify_sees_them() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let options = |dir: &Path, seen_from: SeenFrom| BitfieldsOptions {
        resolution: RESOLUTION,
        held_back: Some(20),
        out: Some(dir.into()),
        seen_from,
        ..BitfieldsOptions::new(blocks(folder.path()))
    };
    let around = SeenFrom::Around {
        distances: None,
        samples: SampleChoice::Even(25),
    };
    let inside = SeenFrom::Inside {
        center: glam::DVec3::new(0.0, 2.0, 7.0),
        size: glam::DVec3::splat(2.0),
        cells: [2, 1, 1],
    };
    for (name, seen_from) in [("around", around), ("inside", inside)] {
        let dir = folder.path().join(name);
        bake_bitfields(&options(&dir, seen_from), &Console::Silent).unwrap();
        assert_shown_as_verified(&dir, 9..11, "drawn");
    }
}

/// What is wrong with a bundle is said in the words of `verify`, and nothing is written.
#[test]
fn bad_bundles_are_refused_as_by_verify() {
    let folder = tempfile::tempdir().unwrap();
    let (dir, file) = (folder.path().join("house"), folder.path().join("a.png"));
    let assert_same_words = || {
        let options = VerifyOptions {
            dir: dir.clone(),
            scene: None,
            views: Views::First(1),
        };
        let of_verify = verify(&options, &Console::Silent).unwrap_err();
        let output = viewer(&dir, &["--screenshot", file.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(1));
        let expected = format!("error: {of_verify:#}");
        let text = stderr(&output);
        assert!(
            text.lines().any(|line| line == expected),
            "{expected}\n{text}"
        );
        assert!(!file.exists());
    };
    assert_same_words();
    baked(&options(triangle(folder.path(), 8), &dir));
    let page = dir.join("pages/000.png");
    let sound = std::fs::read(&page).unwrap();
    std::fs::write(&page, &sound[1..]).unwrap();
    assert_same_words();
    std::fs::remove_file(&page).unwrap();
    assert_same_words();
}

/// A file of a triangle with a texture of one row.
fn triangle(folder: &Path, texels: u32) -> SceneChoice {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("scene.mtl", "newmtl row\nmap_Kd row.png\n");
    write(
        "scene.obj",
        "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl row\nf 1/1 2/2 3/3\n",
    );
    let row = RgbaImage::from_pixel(texels, 1, image::Rgba([200, 120, 40, 255]));
    row.save(folder.join("row.png")).unwrap();
    SceneChoice::File(folder.join("scene.obj"))
}

/// Without the file that was baked the impostor is shown alone, with a warning.
#[test]
fn a_moved_original_leaves_the_impostor() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    baked(&options(triangle(folder.path(), 8), &dir));
    let alone = shown(&dir, &["--mode", "impostor"]);
    let moved = folder.path().join("elsewhere");
    std::fs::create_dir(&moved).unwrap();
    for name in ["scene.obj", "scene.mtl", "row.png"] {
        std::fs::rename(folder.path().join(name), moved.join(name)).unwrap();
    }
    assert_eq!(shown(&dir, &[]), alone);
    let file = folder.path().join("a.png");
    let file = file.to_str().unwrap();
    let output = viewer(&dir, &["--screenshot", file]);
    let text = stderr(&output);
    assert!(
        text.contains("warning: ") && text.contains("only the impostor is shown"),
        "{text}"
    );
    let output = viewer(&dir, &["--mode", "split", "--screenshot", file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("--scene FILE"),
        "{}",
        stderr(&output)
    );
    let scene = moved.join("scene.obj");
    let named = shown(&dir, &["--scene", scene.to_str().unwrap()]);
    assert_ne!(named, alone, "it is split");
}

/// What the adapter does not take is refused with the limit's name.
#[test]
fn textures_above_the_limit_are_refused() {
    let Some(gpu) = gpu() else { return };
    let limit = gpu.device().limits().max_texture_dimension_2d;
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    baked(&options(triangle(folder.path(), limit + 1), &dir));
    let file = folder.path().join("a.png");
    let output = viewer(&dir, &["--screenshot", file.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    for words in [
        "the original cannot be shown",
        "max_texture_dimension_2d",
        &limit.to_string(),
    ] {
        assert!(text.contains(words), "{words} is not in\n{text}");
    }
    assert!(!file.exists());
}

/// Where there is no display, that is said with what else there is.
#[cfg(target_os = "linux")]
#[test]
fn without_a_display_there_are_other_ways() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bundle");
    baked(&options(triangle(folder.path(), 8), &dir));
    let output = viewer(&dir, &[]);
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    let errors = text.lines().filter(|line| line.starts_with("error: "));
    assert_eq!(errors.count(), 1, "{text}");
    for way in ["no display", "DISPLAY is set;", "--web", "--screenshot"] {
        assert!(text.contains(way), "{text}");
    }
    assert!(!text.contains(".rs:"), "{text}");
}
