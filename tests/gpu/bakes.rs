//! Bakes whose layers are recorded with the help of a GPU.

use crate::adapter::gpu;
use std::collections::BTreeMap;
use std::path::Path;
use xtask::{
    Arrangement, BakeOptions, BuiltIn, Console, Device, DeviceChoice, Making, SceneChoice,
    VerifyOptions, Views, bake_on, verify_on,
};

/// A mesh of a metre, and one that is too small to be computed with in f32.
const DUST: &str = "o wall\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n\
    o dust\nv -1e-20 -1e-20 0\nv 1e-20 -1e-20 0\nv 0 1e-20 0\nf 4 5 6\n";

/// A bake of the house, small.
fn options(making: Making, arrangement: Arrangement) -> BakeOptions {
    BakeOptions {
        resolution: 96,
        making,
        arrangement,
        ..BakeOptions::new(SceneChoice::BuiltIn(BuiltIn::House))
    }
}

const LAYERED: Making = Making::Layered {
    bytes_per_quad: 104.0,
};

/// All files of a folder.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        match path.is_dir() {
            true => found.extend(
                files(&path)
                    .into_iter()
                    .map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)),
            ),
            false => {
                found.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// The files of a bundle, and the device that its layers were recorded with.
fn baked(options: &BakeOptions, device: &Device) -> (BTreeMap<String, Vec<u8>>, String) {
    let folder = tempfile::tempdir().unwrap();
    let options = BakeOptions {
        out: Some(folder.path().join("bundle")),
        ..options.clone()
    };
    let report = bake_on(&options, device, &Console::Silent).unwrap();
    (files(&report.bundle), report.device)
}

/// Bundles are the same, byte by byte, with a GPU and without: layers and meshes, for views from before
/// and from all around.
#[test]
fn bundles_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let device = Device::open(DeviceChoice::Gpu, &Console::Silent).unwrap();
    assert_eq!(device.name(), gpu.name());
    for options in [
        options(LAYERED, Arrangement::Before),
        options(LAYERED, Arrangement::Around(None)),
        options(Making::Tdm { enlarged: 1.5 }, Arrangement::Before),
    ] {
        let (expected, by) = baked(&options, &Device::cpu());
        assert_eq!(by, "cpu");
        let (found, by) = baked(&options, &device);
        assert_eq!(by, gpu.name());
        assert!(found.len() >= 3 && found == expected);
    }
    // The GPU was not given up in silence.
    let tally = device.tally();
    assert!(tally.helped > 0 && tally.refused == 0, "{tally:?}");
}

/// And verify holds them, on either.
#[test]
fn bundles_hold() {
    if gpu().is_none() {
        return;
    }
    let device = Device::open(DeviceChoice::Gpu, &Console::Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = BakeOptions {
        out: Some(folder.path().join("bundle")),
        ..options(LAYERED, Arrangement::Around(None))
    };
    let report = bake_on(&options, &device, &Console::Silent).unwrap();
    let options = VerifyOptions {
        dir: report.bundle,
        scene: None,
        views: Views::First(16),
    };
    let report = verify_on(&options, &device, &Console::Silent).unwrap();
    assert!(report.holds, "{:?}", report.broken);
    assert_eq!(device.tally().refused, 0);
    assert_eq!(
        verify_on(&options, &Device::cpu(), &Console::Silent).unwrap(),
        report
    );
}

/// A GPU that is lost, before a bake or amid it, changes nothing but who records.
#[test]
fn a_lost_gpu_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    let options = options(LAYERED, Arrangement::Around(None));
    let (expected, _) = baked(&options, &Device::cpu());
    for helped in [0, 1, 3] {
        let device = Device::open(DeviceChoice::Gpu, &Console::Silent).unwrap();
        device.lose_after(helped);
        let (found, by) = baked(&options, &device);
        assert!(found == expected, "lost after {helped} recordings");
        let tally = device.tally();
        assert!(tally.helped == helped && tally.refused > 0, "{tally:?}");
        // Who helped is told, and who is there to help.
        assert_eq!(by, if helped > 0 { gpu.name() } else { "cpu" });
        assert_eq!(device.name(), "cpu");
        let (_, by) = baked(&options, &device);
        assert_eq!(by, "cpu");
    }
}

/// A driver that does without a GPU is slower than the CPU alone, so it is taken only where it is asked for.
#[test]
fn software_drivers_are_not_chosen() {
    let Some(gpu) = gpu() else { return };
    let device = Device::open(DeviceChoice::Auto, &Console::Silent).unwrap();
    let expected = if gpu.is_software() { "cpu" } else { gpu.name() };
    assert_eq!(device.name(), expected);
}

/// What the GPU does not take, the CPU records alone, and the report says so.
#[test]
fn a_gpu_that_refuses_is_not_named() {
    if gpu().is_none() {
        return;
    }
    let device = Device::open(DeviceChoice::Gpu, &Console::Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("dust.obj");
    std::fs::write(&scene, DUST).unwrap();
    let options = BakeOptions {
        resolution: 32,
        ..BakeOptions::new(SceneChoice::File(scene))
    };
    let (_, by) = baked(&options, &device);
    let tally = device.tally();
    assert!(tally.helped == 0 && tally.refused > 0, "{tally:?}");
    assert_eq!(by, "cpu");
}
