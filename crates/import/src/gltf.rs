//! Reads glTF 2.0 files, as text or binary.

mod accessors;
mod check;
mod container;
mod document;
mod error;
mod files;
mod images;
mod materials;
mod meshes;
mod nodes;
mod uri;

pub use error::GltfError;

use crate::Imported;
use crate::notes::{Note, Notes};
use farfield_scene::{Object, Scene};
use glam::{DAffine3, DMat3, DVec3};
use std::collections::BTreeSet;
use std::io;

/// Fetches a file by its path relative to the glTF file, with `/` between folders.
pub type Load<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// The default scene of a glTF 2.0 file, .gltf or .glb.
///
/// The document is checked as a whole before anything is read: version, required extensions, every
/// index, every bound, the types of attributes, the forest of nodes. What it refers to is checked
/// as it is read. Memory stays within bounds that follow from the size of the input.
///
/// * `bytes` - the file
/// * `load` - fetches buffers and images that stand beside the file; never asked for an absolute
///   path, but possibly for one that begins with `..`
///
/// Source: Khronos Group, glTF 2.0 Specification.
///
/// # Errors
///
/// When the file is damaged, of another version, or needs what is not supported; the first thing
/// found wrong is told with its place.
pub fn read_gltf(bytes: &[u8], load: &mut Load<'_>) -> Result<Imported, GltfError> {
    let container = container::open_container(bytes)?;
    let document = document::parse_document(container.json)?;
    check::check_document(&document)?;

    let mut notes = Notes::default();
    let nodes = nodes::place_nodes(&document, &mut notes)?;
    let wanted: BTreeSet<usize> = nodes.iter().map(|placed| placed.mesh).collect();
    let used = meshes::used_materials(&document, wanted.iter().copied()).collect();
    let looks = materials::read_materials(&document, &used, &mut notes)?;

    let mut load = |path: &str| load(path);
    let mut files = files::Files::new(&mut load);
    let buffers = files::Buffers::load(&document, container.binary, &mut files)?;
    let size = bytes.len() as u64 + buffers.size();
    let (images, slots) =
        images::read_images(&document, &looks.images, &buffers, &mut files, size)?;
    let mut scene = Scene::default();
    let shapes = meshes::read_meshes(
        &document, wanted, &buffers, &looks, size, &mut scene, &mut notes,
    )?;

    scene.images = images;
    scene.textures = looks.textures;
    for texture in &mut scene.textures {
        texture.image = slots[texture.image as usize];
    }
    scene.materials = looks.materials;
    for placed in nodes {
        let Some(shape) = &shapes[&placed.mesh] else {
            continue;
        };
        let world_from_mesh = placed.world_from_node * DAffine3::from_translation(shape.centre);
        if !inverts(&world_from_mesh.matrix3) {
            notes.add(Note::FlatObjects, 1);
            continue;
        }
        check_reach(&world_from_mesh, shape.reach, placed.node)?;
        scene.objects.push(Object {
            name: name_of(&document, placed.node, placed.mesh),
            mesh: shape.mesh,
            world_from_mesh,
        });
    }
    let warnings = notes.warnings();
    debug_assert_eq!(scene.check(), Ok(()));
    Ok(Imported { scene, warnings })
}

/// Whether normals can be taken along, by the inverse of the transform.
fn inverts(matrix: &DMat3) -> bool {
    matrix.determinant() != 0.0 && matrix.inverse().is_finite()
}

/// Whether all of an object stands where f32 has numbers, as drawing needs.
fn check_reach(world_from_mesh: &DAffine3, reach: DVec3, node: usize) -> Result<(), GltfError> {
    let axes = world_from_mesh.matrix3;
    let reach = axes.x_axis.abs() * reach.x
        + axes.y_axis.abs() * reach.y
        + axes.z_axis.abs() * reach.z
        + world_from_mesh.translation.abs();
    // Written so that what is not a number fails.
    match reach.max_element() <= f64::from(f32::MAX) && reach.is_finite() {
        true => Ok(()),
        false => Err(GltfError::Value {
            place: format!("nodes[{node}]"),
            value: "puts its mesh too far away".into(),
            expected: "coordinates of at most 3.4e38",
        }),
    }
}

/// A node's name, else its mesh's, else its number.
fn name_of(document: &document::Document, node: usize, mesh: usize) -> String {
    [&document.nodes[node].name, &document.meshes[mesh].name]
        .into_iter()
        .flatten()
        .find(|name| !name.is_empty())
        .cloned()
        .unwrap_or_else(|| format!("node {node}"))
}
