//! One view of original and impostor, compared.

use crate::pictures;
use anyhow::{Context, Result};
use farfield_grid::Grid;
use farfield_metrics::{
    Coverage, coverage, covered_in_any_sample, gap_pixels, layer_indices, phantom_pixels,
};
use farfield_sampling::{Lighting, Textures, rasterize, shade};
use farfield_scene::Scene;
use farfield_views::{Camera, Pose};
use glam::{DVec3, Vec3};
use std::path::Path;

/// What is compared with what.
pub(super) struct Subject<'a> {
    original: &'a Scene,
    original_textures: Textures<'a>,
    impostor: &'a Scene,
    impostor_textures: Textures<'a>,
    /// The reference viewpoint.
    pub(super) reference: Pose,
    /// Depths between the layers, from the reference viewpoint.
    borders: Vec<f64>,
    /// What cameras look at.
    target: DVec3,
    fov: f64,
    resolution: u32,
}

impl<'a> Subject<'a> {
    pub(super) fn new(
        original: &'a Scene,
        impostor: &'a Scene,
        reference: Pose,
        borders: Vec<f64>,
        target: DVec3,
        fov: f64,
        resolution: u32,
    ) -> Self {
        Self {
            original_textures: Textures::new(original),
            impostor_textures: Textures::new(impostor),
            original,
            impostor,
            reference,
            borders,
            target,
            fov,
            resolution,
        }
    }

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

/// Samples a pixel along each side when looking for thin things of the original.
const SAMPLES: u32 = 4;

/// Compares original and impostor as seen from `eye`.
pub(super) fn look(subject: &Subject<'_>, view: u64, eye: DVec3) -> ViewFigures {
    let camera = subject.camera(eye);
    let original = rasterize(subject.original, &subject.original_textures, &camera);
    let impostor = rasterize(subject.impostor, &subject.impostor_textures, &camera);
    let layers =
        |depth: &Grid<f64>| layer_indices(depth, &camera, &subject.reference, &subject.borders);
    let single = covered_in_any_sample(&original.objects, 1);
    // Finer samples can only acquit pixels that single ones suspect.
    let phantoms = match phantom_pixels(&single, &impostor.objects).is_empty() {
        true => Vec::new(),
        false => {
            let fine = Camera {
                width: camera.width * SAMPLES,
                height: camera.height * SAMPLES,
                ..camera
            };
            let samples = rasterize(subject.original, &subject.original_textures, &fine);
            let covered = covered_in_any_sample(&samples.objects, SAMPLES as usize);
            phantom_pixels(&covered, &impostor.objects)
        }
    };
    ViewFigures {
        view,
        eye,
        gaps: gap_pixels(&layers(&original.depth), &layers(&impostor.depth)),
        phantoms,
        coverage: coverage(&original.objects, &impostor.objects),
    }
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
