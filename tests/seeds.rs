//! Writes good files to start fuzzing from into the folder given, one folder for each target, and
//! no file longer than the fuzzer takes.
//!
//! Where the environment variable `FARFIELD_MODELS` names a folder of real models, its small glTF
//! files are copied as well.

mod good;

use farfield_bundle::{CELLS_FILE, FACES_FILE, GLTF_FILE, MANIFEST_FILE};
use glam::DVec3;
use good::{good_scenes, ktx2, picture};
use image::ImageFormat;
use std::path::{Path, PathBuf};
use std::{env, fs, io};
use xtask::{
    Arrangement, BakeOptions, BitfieldsOptions, Console, Making, SceneChoice, SeenFrom, bake,
    bake_bitfields,
};

/// What the fuzzer takes, in bytes.
const LONGEST: u64 = 1 << 14;

fn main() -> anyhow::Result<()> {
    let Some(corpus) = env::args_os().nth(1).map(PathBuf::from) else {
        anyhow::bail!("name the folder to write to, such as fuzz/corpus");
    };
    let write = |target: &str, name: &str, bytes: &[u8]| {
        let folder = corpus.join(target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(name), bytes)
    };
    for good in good_scenes() {
        let (name, bytes) = good.scene;
        match name.rsplit_once('.') {
            Some((_, "obj")) => {
                // There is one file, which is its own library.
                let library = good.beside.iter().find(|file| file.0.ends_with(".mtl"));
                let library = library.map_or(&[][..], |file| &file.1);
                write("obj", name, &[&bytes, library].concat())?;
            }
            Some((_, "ply")) => write("ply", name, &bytes)?,
            _ => write("gltf", name, &bytes)?,
        }
    }
    for (format, name) in [
        (ImageFormat::Png, "picture.png"),
        (ImageFormat::Jpeg, "picture.jpg"),
        (ImageFormat::WebP, "picture.webp"),
    ] {
        write("picture", name, &picture(format))?;
    }
    write("picture", "picture.ktx2", &ktx2())?;

    for (name, bytes) in bundles()? {
        write("bundle", &name, &bytes)?;
    }
    if let Some(models) = env::var_os("FARFIELD_MODELS") {
        for path in small_files(Path::new(&models))? {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            write("gltf", &name, &fs::read(&path)?)?;
        }
    }
    Ok(())
}

/// Two view cells beside the scene.
const BESIDE: SeenFrom = SeenFrom::Inside {
    center: DVec3::new(0.5, 0.5, 4.0),
    size: DVec3::ONE,
    cells: [2, 1, 1],
};

/// Files of bundles of all kinds: those that the target of the fuzzer bakes itself, of the scene
/// beside it, and manifests of others.
fn bundles() -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let folder = tempfile::tempdir()?;
    let scene = folder.path().join("scene.obj");
    fs::copy(
        concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/scene.obj"),
        &scene,
    )?;
    let options = |name: &str| BakeOptions {
        resolution: 16,
        out: Some(folder.path().join(name)),
        ..BakeOptions::new(SceneChoice::File(scene.clone()))
    };
    let bakes = [
        ("layered", options("layered")),
        (
            "tdm",
            BakeOptions {
                making: Making::Tdm { enlarged: 1.0 },
                ..options("tdm")
            },
        ),
        (
            "pbr",
            BakeOptions {
                channels: farfield_bundle::Channels::Pbr,
                ..options("pbr")
            },
        ),
        (
            "far",
            BakeOptions {
                arrangement: Arrangement::Far(1.0),
                view_cell: Some("box:0.5,0.5,8:1,1,1".parse().map_err(anyhow::Error::msg)?),
                ..options("far")
            },
        ),
        (
            "around",
            BakeOptions {
                arrangement: Arrangement::Around(None),
                ..options("around")
            },
        ),
    ];
    let mut files = Vec::new();
    for (name, options) in bakes {
        bake(&options, &Console::Silent)?;
        for file in [MANIFEST_FILE, GLTF_FILE, "pages/000.png"] {
            let bytes = fs::read(folder.path().join(name).join(file))?;
            files.push((format!("{name}-{}", file.replace('/', "-")), bytes));
        }
    }
    for (name, lists, seen_from) in [
        ("bitfields", FACES_FILE, None),
        ("cells", CELLS_FILE, Some(BESIDE)),
    ] {
        let dir = folder.path().join(name);
        let mut options = BitfieldsOptions {
            resolution: 16,
            held_back: Some(16),
            out: Some(dir.clone()),
            ..BitfieldsOptions::new(SceneChoice::File(scene.clone()))
        };
        options.seen_from = seen_from.unwrap_or(options.seen_from);
        bake_bitfields(&options, &Console::Silent)?;
        for file in [MANIFEST_FILE, GLTF_FILE, lists] {
            files.push((format!("{name}-{file}"), fs::read(dir.join(file))?));
        }
    }
    Ok(files)
}

/// The glTF files in a folder and all below it that are not too long.
fn small_files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_gltf = path
            .extension()
            .is_some_and(|end| end == "glb" || end == "gltf");
        if path.is_dir() {
            found.extend(small_files(&path)?);
        } else if is_gltf && fs::metadata(&path)?.len() <= LONGEST {
            found.push(path);
        }
    }
    Ok(found)
}
