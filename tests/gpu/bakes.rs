//! Bakes whose layers are recorded with the help of a GPU.

use crate::setup::gpu;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;
use xtask::{
    Arrangement, BakeOptions, BuiltIn, Console, Device, DeviceChoice, Making, SceneChoice,
    VerifyOptions, bake_on, verify_on,
};

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
        views: 0..16,
    };
    let report = verify_on(&options, &device, &Console::Silent).unwrap();
    assert!(report.holds, "{:?}", report.broken);
    assert_eq!(
        verify_on(&options, &Device::cpu(), &Console::Silent).unwrap(),
        report
    );
}

/// A GPU that is lost, before a bake or amid it, changes nothing but who records.
#[test]
fn a_lost_gpu_changes_nothing() {
    if gpu().is_none() {
        return;
    }
    let options = options(LAYERED, Arrangement::Around(None));
    let (expected, _) = baked(&options, &Device::cpu());
    for delay in [None, Some(0), Some(50), Some(200), Some(600)] {
        let device = Device::open(DeviceChoice::Gpu, &Console::Silent).unwrap();
        let (found, by) = std::thread::scope(|scope| {
            match delay {
                None => device.lose(),
                Some(delay) => {
                    let device = &device;
                    scope.spawn(move || {
                        std::thread::sleep(Duration::from_millis(delay));
                        device.lose();
                    });
                }
            }
            baked(&options, &device)
        });
        assert!(found == expected, "lost after {delay:?} ms");
        if delay.is_none() {
            assert_eq!(by, "cpu");
        }
    }
}
