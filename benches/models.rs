//! Layers of real models, as a bake makes them.

use farfield_grid::BitMask;
use farfield_layers::{LayerStack, PromisedCamera};
use farfield_quads::{Price, cover};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;
use std::path::PathBuf;
use xtask::layered::{Settings, cull, place, record_layers};

/// A scene with the layers that 512 x 512 pixels from its view cell need.
pub(crate) struct Layered {
    pub(crate) name: String,
    pub(crate) scene: Scene,
    pub(crate) cell: ViewCell,
    pub(crate) stack: LayerStack,
    pub(crate) visible: Vec<BitMask>,
}

/// The models of the tables and their view cells: centre and size.
const MODELS: [(&str, [f64; 3], [f64; 3]); 4] = [
    ("stanford_bunny", [0.0, 0.11, 0.45], [0.2; 3]),
    ("stanford_armadillo_86k", [0.0, 0.0, 3.0], [1.0; 3]),
    ("2CylinderEngine", [0.0, 0.0, 1200.0], [500.0; 3]),
    ("DiffuseTransmissionPlant", [0.0, 0.4, 1.5], [0.3; 3]),
];

/// The built-in house, and the models of the folder that `FARFIELD_MODELS` names.
pub(crate) fn layered() -> Vec<Layered> {
    let folder = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let mut all = vec![prepare(
        "house",
        farfield_town::house(0),
        [0.0, 10.0, 70.0],
        [20.0; 3],
    )];
    for (name, center, size) in MODELS {
        let path = folder
            .as_ref()
            .map(|folder| folder.join(name).with_extension("glb"));
        match path.filter(|path| path.exists()) {
            Some(path) => {
                let scene = farfield_import::read(&path)
                    .expect("the model can be read")
                    .scene;
                all.push(prepare(name, scene, center, size));
            }
            None => println!("SKIPPED: {name} is in no folder named by FARFIELD_MODELS"),
        }
    }
    all
}

fn prepare(name: &str, scene: Scene, center: [f64; 3], size: [f64; 3]) -> Layered {
    let cell = ViewCell::Box {
        center: DVec3::from(center),
        size: DVec3::from(size),
    };
    let settings = Settings {
        cell,
        represented: scene.bounds().expect("the scene has triangles"),
        camera: PromisedCamera {
            fov: 45f64.to_radians(),
            resolution: 512,
        },
        bytes_per_quad: 104.0,
        page_size: 4096,
    };
    let stack = place(&scene, &settings).expect("the cell lies before the scene");
    let recording = record_layers(&scene, &Textures::new(&scene), &stack, &cell);
    let visible = cull(&recording, stack.width, stack.height);
    let layers = 0..stack.layers.len();
    let masks = layers.map(|layer| visible.masks(layer, stack.width, stack.height).opaque);
    let visible = masks.collect();
    Layered {
        name: name.into(),
        scene,
        cell,
        stack,
        visible,
    }
}

/// What the quads' table is made from.
pub(crate) fn masks(models: &[Layered]) -> Vec<(String, Vec<BitMask>)> {
    // The paper's table is about dense models; four are asked for, the house comes extra.
    models
        .iter()
        .map(|model| (model.name.clone(), model.visible.clone()))
        .collect()
}

/// The rectangles of each model's quads, with gutters: what the atlas packs.
pub(crate) fn padded_quads(models: &[Layered]) -> Vec<(String, Vec<[u32; 2]>)> {
    let rects = |model: &Layered| {
        let rects = model
            .visible
            .iter()
            .flat_map(|mask| cover(mask, &Price::default()));
        rects
            .map(|rect| [rect.width + 2, rect.height + 2])
            .collect()
    };
    models
        .iter()
        .map(|model| (model.name.clone(), rects(model)))
        .collect()
}
