//! Real models, and their layers as a bake makes them.

use farfield_grid::BitMask;
use farfield_layers::{Aim, LayerStack, PromisedCamera, box_corners};
use farfield_quads::{Price, cover};
use farfield_sampling::{Foliage, Textures};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;
use std::path::PathBuf;
use xtask::Channels;
use xtask::recording::{Settings, cull, place, record_layers};
use xtask::{BuiltIn, SceneChoice};

/// A scene and the view cell it is looked at from.
pub(crate) struct Model {
    pub(crate) name: &'static str,
    pub(crate) source: SceneChoice,
    pub(crate) scene: Scene,
    pub(crate) cell: ViewCell,
}

/// A scene with the layers that 512 x 512 pixels from its view cell need.
pub(crate) struct Layered {
    pub(crate) name: String,
    pub(crate) scene: Scene,
    pub(crate) cell: ViewCell,
    pub(crate) stack: LayerStack,
    pub(crate) visible: Vec<BitMask>,
}

/// A model's file and its view cell: name without ending, centre, size.
pub(crate) type Entry = (&'static str, [f64; 3], [f64; 3]);

/// Dense models: what the tables of quads and pages are about.
pub(crate) const DENSE: [Entry; 4] = [
    ("stanford_bunny", [0.0, 0.11, 0.45], [0.2; 3]),
    ("stanford_armadillo_86k", [0.0, 0.0, 3.0], [1.0; 3]),
    ("2CylinderEngine", [0.0, 0.0, 1200.0], [500.0; 3]),
    ("DiffuseTransmissionPlant", [0.0, 0.4, 1.5], [0.3; 3]),
];

/// Few triangles with photographs of facades.
pub(crate) const CITY: [Entry; 1] = [("city_tokyo_lod2_b", [0.0, 25.0, 300.0], [60.0, 40.0, 60.0])];

/// What photographs are on: a car and a helmet.
pub(crate) const TEXTURED: [Entry; 2] = [
    ("CesiumMilkTruck", [0.0, 1.3, 9.0], [3.0, 2.0, 3.0]),
    ("FlightHelmet", [0.0, 0.36, 1.6], [0.4; 3]),
];

/// Many triangles, from far away and from near: few layers and many.
pub(crate) const LARGE: [Entry; 2] = [
    ("stanford_dragon", [0.0, 0.12, 0.5], [0.1; 3]),
    ("stanford_dragon", [0.0, 0.12, 0.35], [0.2; 3]),
];

/// Masked leaves, from near and from far away.
pub(crate) const LEAVES: [Entry; 2] = [
    ("tree_oak_large", [0.0, 50.0, 250.0], [50.0; 3]),
    ("tree_oak_large", [0.0, 50.0, 2500.0], [500.0; 3]),
];

/// The built-in house in its view cell.
pub(crate) fn house() -> Model {
    Model {
        name: "house",
        source: SceneChoice::BuiltIn(BuiltIn::House),
        scene: farfield_town::house(0),
        cell: view_cell([0.0, 10.0, 70.0], [20.0; 3]),
    }
}

/// The file of a model that is in the folder that `FARFIELD_MODELS` names.
pub(crate) fn file(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("FARFIELD_MODELS").map(PathBuf::from);
    let path = folder.map(|folder| folder.join(name).with_extension("glb"));
    let found = path.filter(|path| path.exists());
    if found.is_none() {
        println!("SKIPPED: {name} is in no folder named by FARFIELD_MODELS");
    }
    found
}

/// Those of the models that are in the folder that `FARFIELD_MODELS` names.
pub(crate) fn read(entries: &[Entry]) -> Vec<Model> {
    let read = |&(name, center, size): &Entry| {
        let path = file(name)?;
        let imported = farfield_import::read(&path).expect("the model can be read");
        Some(Model {
            name,
            source: SceneChoice::File(path),
            scene: imported.scene,
            cell: view_cell(center, size),
        })
    };
    entries.iter().filter_map(read).collect()
}

fn view_cell(center: [f64; 3], size: [f64; 3]) -> ViewCell {
    ViewCell::Box {
        center: DVec3::from(center),
        size: DVec3::from(size),
    }
}

/// An impostor of a scene for 512 x 512 pixels, as a bake makes it unless asked otherwise.
pub(crate) fn settings(scene: &Scene, cell: ViewCell) -> Settings {
    Settings {
        cell,
        hull: box_corners(scene.bounds().expect("the scene has triangles")),
        camera: PromisedCamera {
            aim: Aim::Center,
            fov: 45f64.to_radians(),
            resolution: 512,
        },
        page_size: 4096,
        foliage: Foliage::Any,
        channels: Channels::Lit,
    }
}

/// Places, records and culls a model's layers.
pub(crate) fn prepare(model: Model) -> Layered {
    let Model {
        name, scene, cell, ..
    } = model;
    let settings = settings(&scene, cell);
    let stack = place(&scene, &settings).expect("the cell lies before the scene");
    let recording = record_layers(&scene, &Textures::new(&scene), &stack, &cell, Foliage::Any);
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
