//! One view of original and impostor, compared.

use crate::pictures;
use anyhow::{Context, Result};
use farfield_grid::{BitMask, Grid};
use farfield_metrics::{
    Coverage, NONE, coverage, covered_in_any_sample, gap_pixels, layer_indices, phantom_pixels,
};
use farfield_sampling::{Lighting, Textures, rasterize, record, shade};
use farfield_scene::Scene;
use farfield_views::{Camera, Pose};
use glam::{DVec3, Vec3};
use std::path::Path;

/// What is compared with what.
pub(super) struct Subject<'a> {
    pub(super) original: &'a Scene,
    pub(super) original_textures: Textures<'a>,
    pub(super) impostor: &'a Scene,
    pub(super) impostor_textures: Textures<'a>,
    /// The reference viewpoint.
    pub(super) reference: Pose,
    /// Depths between the layers, from the reference viewpoint.
    pub(super) borders: Vec<f64>,
    /// What cameras look at, in the world.
    pub(super) target: DVec3,
    /// In radians.
    pub(super) fov: f64,
    /// Pixels along each side.
    pub(super) resolution: u32,
}

impl Subject<'_> {
    fn camera(&self, eye: DVec3) -> Camera {
        Camera::looking_at(eye, self.target, self.fov, self.resolution)
    }
}

/// What one view shows wrong.
pub(super) struct ViewFigures {
    pub(super) view: u64,
    pub(super) eye: DVec3,
    pub(super) gaps: Vec<[u32; 2]>,
    pub(super) phantoms: Vec<[u32; 2]>,
    pub(super) coverage: Coverage,
}

/// Side of the tiles that suspects are looked at in, in pixels: bounds time and memory.
const TILE: u32 = 64;

/// Compares original and impostor as seen from `eye`.
pub(super) fn look(subject: &Subject<'_>, view: u64, eye: DVec3) -> ViewFigures {
    let camera = subject.camera(eye);
    let original = rasterize(subject.original, &subject.original_textures, &camera);
    let impostor = rasterize(subject.impostor, &subject.impostor_textures, &camera);
    let layers =
        |depth: &Grid<f64>| layer_indices(depth, &camera, &subject.reference, &subject.borders);
    let single = covered_in_any_sample(&original.objects, 1);
    let suspects = phantom_pixels(&single, &impostor.objects);
    ViewFigures {
        view,
        eye,
        gaps: gap_pixels(&layers(&original.depth), &layers(&impostor.depth)),
        phantoms: convicted(subject, &camera, suspects),
        coverage: coverage(&original.objects, &impostor.objects),
    }
}

/// The phantom pixels among suspects: those with nothing of the original near them, however thin,
/// that a sample a pixel could have missed.
fn convicted(subject: &Subject<'_>, camera: &Camera, mut suspects: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    let tile = |[x, y]: &[u32; 2]| (y / TILE, x / TILE);
    suspects.sort_by_key(tile);
    let tiles = suspects.chunk_by(|a, b| tile(a) == tile(b));
    let mut phantoms: Vec<_> = tiles
        .flat_map(|suspects| {
            // The suspects, and two more pixels on every side.
            let bound = |axis: usize, limit: u32| {
                let along = suspects.iter().map(|at| at[axis]);
                let (min, max) = (along.clone().min().unwrap_or(0), along.max().unwrap_or(0));
                min.saturating_sub(2)..(max + 3).min(limit)
            };
            let (columns, rows) = (bound(0, camera.width), bound(1, camera.height));
            let covered = touched(subject, &camera.window(&columns, &rows));
            let mut ids = Grid::filled(covered.width(), covered.height(), NONE);
            for [x, y] in suspects {
                ids[((x - columns.start) as usize, (y - rows.start) as usize)] = 0;
            }
            let phantoms = phantom_pixels(&covered, &ids);
            phantoms
                .into_iter()
                .map(move |[x, y]| [x + columns.start, y + rows.start])
        })
        .collect();
    phantoms.sort_by_key(|[x, y]| (*y, *x));
    phantoms
}

/// The pixels that anything of the original touches, hidden or not.
fn touched(subject: &Subject<'_>, camera: &Camera) -> BitMask {
    let everything = record(
        subject.original,
        &subject.original_textures,
        camera,
        &[0.0, f64::INFINITY],
        &[camera.pose.eye.extend(1.0)],
    );
    everything.masks(0, camera.width, camera.height).opaque
}

const GAP: Vec3 = Vec3::new(1.0, 0.0, 0.0);
const PHANTOM: Vec3 = Vec3::new(0.0, 0.6, 1.0);

/// Writes a view's original, impostor, their difference, and gaps and phantoms marked.
pub(super) fn write_pictures(
    subject: &Subject<'_>,
    figures: &ViewFigures,
    dir: &Path,
) -> Result<()> {
    let camera = subject.camera(figures.eye);
    let light = Lighting::default();
    let picture = |scene: &Scene, textures: &Textures<'_>| {
        let seen = rasterize(scene, textures, &camera);
        pictures::over_background(
            &shade(scene, textures, &camera, &seen, &light),
            &seen.objects,
        )
    };
    let original = picture(subject.original, &subject.original_textures);
    let impostor = picture(subject.impostor, &subject.impostor_textures);
    let marks = figures.phantoms.iter().map(|at| (*at, PHANTOM));
    let marks: Vec<_> = marks
        .chain(figures.gaps.iter().map(|at| (*at, GAP)))
        .collect();

    std::fs::create_dir_all(dir).with_context(|| dir.display().to_string())?;
    let name = |what: &str| dir.join(format!("view-{:04}-{what}.png", figures.view));
    pictures::write_png(&name("original"), &original)?;
    pictures::write_png(&name("impostor"), &impostor)?;
    pictures::write_png(
        &name("difference"),
        &pictures::difference(&original, &impostor),
    )?;
    pictures::write_png(&name("marked"), &pictures::marked(&impostor, &marks))
}
