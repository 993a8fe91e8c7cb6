//! What the tests share: scenes and cameras.

use crate::adapter::skipped;
use farfield_scene::Scene;
use farfield_views::{Camera, Extent, Pose};
use glam::{DVec2, DVec3};
use std::path::PathBuf;
use xtask::{BakeOptions, BuiltIn, Console, SceneChoice};

/// A real model, where the environment variable `FARFIELD_MODELS` names a folder that has it.
pub(crate) fn model(name: &str) -> Option<Scene> {
    let path = std::env::var_os("FARFIELD_MODELS").map(|folder| PathBuf::from(folder).join(name));
    let Some(path) = path.filter(|path| path.exists()) else {
        skipped(&format!("{name} is in no folder named by FARFIELD_MODELS"));
        return None;
    };
    Some(
        farfield_import::read(&path)
            .expect("the model can be read")
            .scene,
    )
}

/// What a bundle of the built-in house displays.
pub(crate) fn house_bundle() -> Scene {
    let folder = tempfile::tempdir().expect("there is room for a bundle");
    let options = BakeOptions {
        resolution: 192,
        out: Some(folder.path().to_owned()),
        ..BakeOptions::new(SceneChoice::BuiltIn(BuiltIn::House))
    };
    xtask::bake(&options, &Console::Silent).expect("the house bakes");
    let display = folder.path().join(farfield_bundle::GLTF_FILE);
    farfield_import::read(&display)
        .expect("the bundle can be read")
        .scene
}

/// Cameras before, beside and within a scene, the last with a frustum that is not centred.
pub(crate) fn cameras(scene: &Scene, resolution: u32) -> Vec<Camera> {
    let [min, max] = scene.bounds().expect("the scene shows something");
    let (middle, size) = ((min + max) / 2.0, max - min);
    let away = size.length();
    let at = |x: f64, y: f64, z: f64| middle + DVec3::new(x, y, z) * away;
    let looking = |eye| Camera::looking_at(eye, middle, 0.8, resolution);
    vec![
        looking(at(0.1, 0.2, 1.2)),
        looking(at(0.5, 0.1, 0.7)),
        looking(at(0.02, 0.04, 0.1)),
        Camera {
            pose: Pose::looking_along(at(0.0, 0.1, 0.4), DVec3::new(0.2, -0.3, -1.0)),
            extent: Extent {
                min: DVec2::new(-0.2, -0.5),
                max: DVec2::new(0.6, 0.1),
            },
            width: resolution + 7,
            height: resolution - 5,
        },
    ]
}

/// Moved by some metres.
pub(crate) fn moved(mut scene: Scene, by: DVec3) -> Scene {
    for object in &mut scene.objects {
        object.world_from_mesh.translation += by;
    }
    scene
}
