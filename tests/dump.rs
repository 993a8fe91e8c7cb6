//! What `--dump` writes is what was recorded.

use crate::setup::{contents, options};
use exr::prelude::{AttributeValue, FlatSamples, Text, read_all_flat_layers_from_file};
use farfield_sampling::{Foliage, Lighting, Textures, linear_from_srgb, sample_colors};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use xtask::recording::{Settings, cull, place, record_layers, recording_camera};
use xtask::{BakeOptions, BuiltIn, Console, Making, SceneChoice, bake};

const RESOLUTION: u32 = 128;

fn dumping(folder: &Path, dump: &Path) -> BakeOptions {
    let out = folder.join("bundle");
    BakeOptions {
        dump: Some(dump.to_owned()),
        ..options(SceneChoice::BuiltIn(BuiltIn::House), RESOLUTION, &out)
    }
}

/// The layers are recorded again, and every part of the file is compared with them, texel by
/// texel: its window, its attributes, where it is opaque, its colours, its depths, what is kept.
#[test]
fn the_layers_are_those_that_were_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let dump = folder.path().join("dump");
    bake(&dumping(folder.path(), &dump), &Console::Silent).unwrap();
    let manifest = farfield_bundle::read(&folder.path().join("bundle")).unwrap();

    let scene = farfield_town::house(0);
    let settings = Settings {
        cell: manifest.options.view_space.cell(None),
        hull: farfield_layers::box_corners(manifest.impostors[0].represented),
        camera: farfield_layers::PromisedCamera {
            aim: farfield_layers::Aim::Center,
            fov: manifest.options.fov_degrees.to_radians(),
            resolution: RESOLUTION,
        },
        page_size: 4096,
        foliage: Foliage::Any,
        channels: xtask::Channels::Lit,
    };
    let stack = place(&scene, &settings).unwrap();
    let textures = Textures::new(&scene);
    let recording = record_layers(&scene, &textures, &stack, &settings.cell, Foliage::Any);
    let visible = cull(&recording, stack.width, stack.height);
    let camera = recording_camera(&stack);
    let light = Lighting::default();
    let cell = settings.cell.corners();
    let colors = sample_colors(
        &scene,
        &textures,
        &camera,
        &cell,
        &recording.samples,
        &light,
    );

    let file = read_all_flat_layers_from_file(dump.join("house.exr")).unwrap();
    assert_eq!(file.layer_data.len(), stack.layers.len());
    let display = file.attributes.display_window.size;
    assert_eq!(
        [display.0, display.1],
        [stack.width, stack.height].map(|n| n as usize)
    );
    for (i, part) in file.layer_data.iter().enumerate() {
        let (layer, samples) = (
            &stack.layers[i],
            &recording.samples[recording.layers[i].clone()],
        );
        let attributes = &part.attributes;
        let name = Text::from(&*format!("layer.{i:03}"));
        assert_eq!(attributes.layer_name.as_ref(), Some(&name));
        let depth = &attributes.other[&Text::from("planeDepth")];
        assert_eq!(*depth, AttributeValue::F64(layer.depth));
        assert_eq!(attributes.near_clip_plane, Some(layer.near as f32));
        assert_eq!(attributes.far_clip_plane, Some(layer.far as f32));

        let channels = &part.channel_data.list;
        let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["A", "B", "G", "R", "Z", "kept"]);
        let halves = channels
            .iter()
            .filter(|c| matches!(c.sample_data, FlatSamples::F16(_)));
        assert_eq!(halves.count(), 5);
        let (width, height) = (part.size.0, part.size.1);
        let corner = part.attributes.layer_position;
        let values = |x: u16, y: u16| {
            let (x, y) = (i32::from(x) - corner.0, i32::from(y) - corner.1);
            let inside = (0..width as i32).contains(&x) && (0..height as i32).contains(&y);
            assert!(
                inside,
                "a texel of layer {i} lies outside of the data window"
            );
            let at = y as usize * width + x as usize;
            [0, 1, 2, 3, 4, 5].map(|c| channels[c].sample_data.value_by_flat_index(at).to_f32())
        };
        let seen = &visible.samples[visible.layers[i].clone()];
        let seen: BTreeSet<[u16; 2]> = seen.iter().map(|s| [s.x, s.y]).collect();
        for (index, sample) in recording.layers[i].clone().zip(samples) {
            let [a, b, g, r, z, kept] = values(sample.x, sample.y);
            assert_eq!(a, 1.0);
            // A half float is rounded to within 2^-11 of itself, or 2^-25 near zero; z is rounded
            // once.
            for (half, byte) in [r, g, b].into_iter().zip(colors[index]) {
                let linear = linear_from_srgb(f32::from(byte) / 255.0);
                assert!(
                    (half - linear).abs() <= linear / 2048.0 + 1e-7,
                    "{half} {linear}"
                );
            }
            let depth = camera
                .pose
                .point_in_view(sample.hit.point_in_world(&scene))
                .z;
            assert_eq!(z, depth as f32);
            assert_eq!(kept == 1.0, seen.contains(&[sample.x, sample.y]));
        }
        // All others are empty, and the window is as small as it can be.
        let opaque = (0..width * height)
            .filter(|at| channels[0].sample_data.value_by_flat_index(*at).to_f32() != 0.0);
        assert_eq!(opaque.clone().count(), samples.len());
        let bounds = |of: fn(usize, usize) -> usize| {
            let all: Vec<usize> = opaque.clone().map(|at| of(at, width)).collect();
            [all.iter().min().copied(), all.iter().max().copied()]
        };
        if !samples.is_empty() {
            assert_eq!(bounds(|at, width| at % width), [Some(0), Some(width - 1)]);
            assert_eq!(bounds(|at, width| at / width), [Some(0), Some(height - 1)]);
        }
    }
}

/// The bundle is the same as without, and a second dump, which replaces the first, has the same
/// bytes.
#[test]
fn a_dump_changes_nothing_and_repeats() {
    let folder = tempfile::tempdir().unwrap();
    let (dump, out) = (folder.path().join("dump"), folder.path().join("bundle"));
    let with = dumping(folder.path(), &dump);
    let without = BakeOptions {
        dump: None,
        ..with.clone()
    };
    bake(&without, &Console::Silent).unwrap();
    let bundle = contents(&out);
    bake(&with, &Console::Silent).unwrap();
    let first = contents(&dump);
    assert!(contents(&out) == bundle, "the dump changes the bundle");
    bake(&with, &Console::Silent).unwrap();
    assert!(contents(&dump) == first, "the dump does not repeat");
    let names: Vec<_> = first
        .iter()
        .map(|(name, _)| name.to_str().unwrap())
        .collect();
    for name in [
        "dump.json",
        "house.exr",
        "house-recorded-000.png",
        "house-kept-000.png",
    ] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
}

/// What was made of the layers, by any technique, is beside them as it is in the bundle, and can be opened.
#[test]
fn a_dump_has_what_is_displayed() {
    let folder = tempfile::tempdir().unwrap();
    let (dump, out) = (folder.path().join("dump"), folder.path().join("bundle"));
    let makings = [
        Making::Layered {
            bytes_per_quad: 104.0,
        },
        Making::Tdm { enlarged: 1.5 },
    ];
    for making in makings {
        let options = BakeOptions {
            making,
            ..dumping(folder.path(), &dump)
        };
        let report = bake(&options, &Console::Silent).unwrap();
        let opened = farfield_import::read(&dump.join("impostors.glb")).unwrap();
        assert_eq!(opened.scene.drawn_triangles(), report.triangles_out);
        let (dumped, bundle) = (contents(&dump), contents(&out));
        for name in ["impostors.glb", "pages/000.png"] {
            let of = |files: &[(PathBuf, Vec<u8>)]| {
                let found = files.iter().find(|(path, _)| path == Path::new(name));
                found.map(|(_, bytes)| bytes.clone()).unwrap()
            };
            assert!(of(&dumped) == of(&bundle), "{name} differs");
        }
        assert!(dump.join("house.exr").exists() && dump.join("house-kept-000.png").exists());
    }
}

/// Where the dump cannot be, nothing is written at all, and nobody's files are touched.
#[test]
fn a_dump_that_cannot_be_written_fails_the_bake() {
    let folder = tempfile::tempdir().unwrap();
    let mine = folder.path().join("mine");
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("notes.txt"), "keep").unwrap();
    let before = contents(folder.path());
    let bundle = folder.path().join("bundle");
    for (dump, reason) in [
        (mine.as_path(), "neither empty nor a farfield dump"),
        (&mine.join("notes.txt/dump"), "notes.txt"),
        (&bundle, "cannot lie in each other"),
        (&bundle.join("dump"), "cannot lie in each other"),
        (folder.path(), "cannot lie in each other"),
    ] {
        let error = bake(&dumping(folder.path(), dump), &Console::Silent).unwrap_err();
        let text = format!("{error:#}");
        assert!(text.contains(reason), "{}: {text}", dump.display());
        assert!(contents(folder.path()) == before, "{}", dump.display());
    }
}
