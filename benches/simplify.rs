//! Simplifying meshes over voxels: time and memory a triangle, and what meshoptimizer makes of the
//! same meshes.

use crate::models::{self, Model};
use farfield_sampling::Textures;
use farfield_tdm::{Mesh, VoxelLayers, initial_mesh, simplify, touched};
use meshopt::{SimplifyOptions, VertexDataAdapter};
use std::time::Instant;
use xtask::{Console, Device, peak_rss_bytes, voxelize};

/// Sides of the pictures for which the house is looked at, smallest first, as the peak of memory is
/// that of all so far.
const RESOLUTIONS: [u32; 5] = [256, 362, 512, 1024, 1200];

/// Side of an enlarged voxel, in voxels.
const ENLARGED: f32 = 1.5;

/// Halvings of the interval of errors, which spans 2^10.
const HALVINGS: u32 = 12;

/// Prints one line for the house at each resolution, and for each model.
pub(crate) fn table() {
    println!(
        "\nInitial meshes simplified, voxels enlarged by {ENLARGED}; by meshoptimizer to half of that, in \
         voxels, and to the greatest error at which it loses no voxel that the mesh stands for. Bytes \
         are all that the program takes.\n"
    );
    println!(
        "| scene | initial | triangles | s | us a triangle | bytes a triangle | meshoptimizer | voxels \
         lost | s | without loss |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut largest = 0;
    for resolution in RESOLUTIONS {
        row(&models::house(), resolution, &mut largest);
    }
    for model in models::read(&models::DENSE)
        .iter()
        .chain(&models::read(&models::CITY))
    {
        row(model, 512, &mut largest);
    }
}

/// * `largest` - triangles of the largest mesh so far
fn row(model: &Model, resolution: u32, largest: &mut usize) {
    let mut settings = models::settings(&model.scene, model.cell);
    settings.camera.resolution = resolution;
    let textures = Textures::new(&model.scene);
    let found = voxelize::voxelize(
        &model.scene,
        &textures,
        &settings,
        &Device::cpu(),
        &Console::Silent,
    );
    let found = found
        .expect("the cell lies before the scene")
        .expect("it can be seen");
    let voxels = found.layers();
    let mesh = initial_mesh(&voxels, found.points(), ENLARGED);
    let before = Instant::now();
    let simple = simplify(&mesh, &voxels, ENLARGED).mesh;
    let seconds = before.elapsed().as_secs_f64();
    // The peak of a mesh that is smaller than one before is that one's.
    let is_largest = mesh.triangles.len() > *largest;
    *largest = mesh.triangles.len().max(*largest);
    let bytes = match is_largest {
        true => (peak_rss_bytes() / mesh.triangles.len() as u64).to_string(),
        false => String::new(),
    };
    let theirs = |error: f32| {
        let before = Instant::now();
        let triangles = meshoptimized(&mesh, error);
        let seconds = before.elapsed().as_secs_f64();
        (lost(&mesh, &triangles, &voxels), triangles.len(), seconds)
    };
    let (lost, theirs_at_once, their_seconds) = theirs(ENLARGED / 2.0);
    let mut errors = [ENLARGED / 1024.0, ENLARGED];
    let mut without_loss = mesh.triangles.len();
    for _ in 0..HALVINGS {
        let middle = (errors[0] * errors[1]).sqrt();
        let (lost, count, _) = theirs(middle);
        if lost == 0 {
            (errors[0], without_loss) = (middle, count);
        } else {
            errors[1] = middle;
        }
    }
    println!(
        "| {}, {resolution} | {} | {} | {seconds:.2} | {:.1} | {bytes} | {theirs_at_once} | {lost} | \
         {their_seconds:.2} | {without_loss} |",
        model.name,
        mesh.triangles.len(),
        simple.triangles.len(),
        seconds * 1e6 / mesh.triangles.len() as f64,
    );
}

/// As few triangles as meshoptimizer leaves within an error, in voxels.
fn meshoptimized(mesh: &Mesh, error: f32) -> Vec<[u32; 3]> {
    let places: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
    let vertices =
        VertexDataAdapter::new(meshopt::typed_to_bytes(&places), size_of::<[f32; 3]>(), 0)
            .expect("places are whole");
    let options = SimplifyOptions::ErrorAbsolute;
    let indices = mesh.triangles.as_flattened();
    let left = meshopt::simplify(indices, &vertices, 0, error, options, None);
    let (triangles, _) = left.as_chunks();
    triangles.to_vec()
}

/// How many voxels that a mesh stands for some of its triangles do not touch.
fn lost(mesh: &Mesh, triangles: &[[u32; 3]], voxels: &VoxelLayers<'_>) -> usize {
    let touched = touched(&mesh.positions, triangles, voxels, ENLARGED);
    let needed = mesh.voxels.iter().flatten();
    needed.filter(|voxel| !touched[**voxel as usize]).count()
}
