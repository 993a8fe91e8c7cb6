//! One view of original and impostor, compared.

use super::gaps::gaps;
use super::strays::strays;
use super::subject::{Shape, Side, Subject};
use super::surface::{SurfaceDifference, surface_difference};
use crate::pictures;
use farfield_bundle::{Channels, Promise};
use farfield_grid::{BitMask, Grid};
use farfield_metrics::{
    ColorDifference, Coverage, Distribution, NONE, ParallaxErrors, Picture, RecordedFrom,
    SilhouetteDisplacement, StrayColors, color_difference, compared_region, coverage,
    covered_in_any_sample, layer_indices, mesh_parallax, parallax, phantom_pixels,
    silhouette_displacement, ssim_errors,
};
use farfield_sampling::{Foliage, Lighting, Visibility, rasterize, record, shade};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::{DVec3, DVec4};
use std::cell::OnceCell;
use std::ops::Range;

/// Whether everything is where it should be in one view.
pub(super) struct Geometry {
    /// Pixels at which one looks through the impostor.
    pub(super) gaps: Vec<[u32; 2]>,
    /// Pixels that only the impostor covers, far from the original.
    pub(super) phantoms: Vec<[u32; 2]>,
    /// Pixels that the impostor covers where of the original only the backs of surfaces are whose
    /// fronts nobody in the view cell sees.
    pub(super) backs: Vec<[u32; 2]>,
    /// Pixels that the impostor covers where of the original only the backs of surfaces are whose
    /// fronts are seen from elsewhere in the view cell.
    pub(super) from_behind: Vec<[u32; 2]>,
    pub(super) parallax: ParallaxErrors,
}

/// What one view shows.
pub(super) struct ViewFigures {
    pub(super) view: u64,
    pub(super) camera: Camera,
    pub(super) geometry: Geometry,
    pub(super) coverage: Coverage,
    /// Pixels that the impostor covers.
    pub(super) covered_by_impostor: u64,
    pub(super) silhouette: SilhouetteDisplacement,
    pub(super) color: ColorDifference,
    /// What an engine lights; empty where it lights nothing.
    pub(super) surface: SurfaceDifference,
    pub(super) stray: StrayColors,
    pub(super) ssim: Distribution,
    /// Empty where FLIP is not built in.
    pub(super) flip: Distribution,
}

impl ViewFigures {
    /// Orders views: the greater the worse.
    pub(super) fn is_worse_than(&self, other: &Self) -> bool {
        let wrong = |view: &Self| {
            let geometry = &view.geometry;
            geometry.gaps.len()
                + geometry.phantoms.len()
                + geometry.backs.len()
                + geometry.parallax.above.len()
        };
        let look = |view: &Self| view.flip.mean().max(view.ssim.mean());
        let order = wrong(self).cmp(&wrong(other));
        order.then(look(self).total_cmp(&look(other))).is_gt()
    }
}

/// What both sides show to a camera.
pub(super) struct Pictures {
    pub(super) original: Shown,
    pub(super) impostor: Shown,
}

/// What one side shows to a camera.
pub(super) struct Shown {
    pub(super) seen: Visibility,
    /// sRGB, over the background.
    pub(super) colors: Grid<[u8; 3]>,
}

/// Renders both sides with the same renderer and light.
pub(super) fn show(subject: &Subject<'_>, camera: &Camera) -> Pictures {
    Pictures {
        original: shown_by(&subject.original, camera),
        impostor: shown_by(&subject.impostor, camera),
    }
}

/// Renders one side.
pub(super) fn shown_by(side: &Side<'_>, camera: &Camera) -> Shown {
    let seen = rasterize(side.scene, side.textures, camera);
    let light = Lighting::default();
    let colors = shade(side.scene, side.textures, camera, &seen, &light);
    Shown {
        colors: pictures::over_background(&colors, &seen.objects),
        seen,
    }
}

/// Compares original and impostor as seen from viewpoint number `index` of the impostor, in all
/// view number `view`.
pub(super) fn look(subject: &Subject<'_>, index: u64, view: u64) -> ViewFigures {
    let camera = subject.camera(index, 1);
    let Pictures { original, impostor } = show(subject, &camera);
    let ids = [&original.seen.objects, &impostor.seen.objects];
    let region = compared_region(ids[0], ids[1]);
    let colors = [&original.colors, &impostor.colors];
    let pictures = [0, 1].map(|i| Picture {
        colors: colors[i],
        ids: ids[i],
    });
    let alike = alike(subject, &camera, &original.seen, &impostor.seen);
    let of_alike = Picture {
        colors: colors[1],
        ids: &alike,
    };
    ViewFigures {
        view,
        camera,
        geometry: compare_geometry(subject, &camera, &original.seen, &impostor.seen),
        coverage: coverage(ids[0], ids[1]),
        covered_by_impostor: covered(ids[1]),
        silhouette: silhouette_displacement(ids[0], ids[1]),
        color: color_difference(pictures[0], of_alike, &region),
        surface: match subject.channels {
            Channels::Lit | Channels::Unlit => SurfaceDifference::default(),
            Channels::Pbr => {
                let seen = [&original.seen, &impostor.seen];
                surface_difference(subject, &camera, seen, &alike, &region)
            }
        },
        stray: strays(subject, &camera, pictures[0], pictures[1]),
        ssim: ssim_errors(colors[0], colors[1], &region),
        flip: flip(colors, &region),
    }
}

/// What the impostor shows at each pixel where it shows the layer that the original's surface is in,
/// else [`NONE`]. What is near is up to a texel wider in the impostor, so elsewhere it shows something
/// else, and more so the fewer texels there are.
fn alike(
    subject: &Subject<'_>,
    camera: &Camera,
    original: &Visibility,
    impostor: &Visibility,
) -> Grid<u32> {
    let [before, after] = [original, impostor].map(|seen| layers(subject, camera, seen));
    let ids = impostor.objects.cells().iter();
    let pairs = before.cells().iter().zip(after.cells());
    let alike = ids.zip(pairs);
    let alike = alike.map(|(id, (before, after))| if before == after { *id } else { NONE });
    Grid::from_cells(
        camera.width as usize,
        camera.height as usize,
        alike.collect(),
    )
}

/// The layer at each pixel.
fn layers(subject: &Subject<'_>, camera: &Camera, seen: &Visibility) -> Grid<u32> {
    layer_indices(&seen.depth, camera, subject.reference(), &subject.borders)
}

#[cfg(feature = "flip")]
pub(super) fn flip([original, impostor]: [&Grid<[u8; 3]>; 2], region: &BitMask) -> Distribution {
    farfield_metrics::flip_errors(original, impostor, region).errors
}

#[cfg(not(feature = "flip"))]
pub(super) fn flip(_: [&Grid<[u8; 3]>; 2], _: &BitMask) -> Distribution {
    Distribution::default()
}

/// Whether a promise about where things are is kept, as seen from a place inside or outside of the
/// view cell. What costs least is asked first, and nothing more once something is broken.
pub(super) fn geometry_holds(subject: &Subject<'_>, eye: DVec3, promise: &Promise) -> bool {
    let camera = subject.camera_at(eye);
    let [original, impostor] = [&subject.original, &subject.impostor]
        .map(|side| rasterize(side.scene, side.textures, &camera));
    let sight = Sight::new(subject, &camera, &original, &impostor);
    let within = |count: usize, most: Option<u64>| most.is_none_or(|most| count as u64 <= most);
    let is_where_it_should_be = || {
        let unseen = sight.unseen(&sight.alone());
        // Of either kind: there is none, or that is wrong already.
        if unseen.is_empty() || (promise.phantom_pixels, promise.back_pixels) == (Some(0), Some(0))
        {
            return unseen.is_empty();
        }
        let [phantoms, backs] = sight.phantoms_and_backs(unseen);
        within(phantoms.len(), promise.phantom_pixels) && within(backs.len(), promise.back_pixels)
    };
    within(sight.gaps().len(), promise.gap_pixels)
        && is_where_it_should_be()
        && sight.parallax().above.is_empty()
}

/// Pixels that original and impostor cover at a lower resolution.
pub(super) fn coverage_at(subject: &Subject<'_>, index: u64, divisor: u32) -> [u64; 2] {
    let camera = subject.camera(index, divisor);
    [&subject.original, &subject.impostor]
        .map(|side| covered(&rasterize(side.scene, side.textures, &camera).objects))
}

fn covered(ids: &Grid<u32>) -> u64 {
    ids.cells().iter().filter(|id| **id != NONE).count() as u64
}

fn compare_geometry(
    subject: &Subject<'_>,
    camera: &Camera,
    original: &Visibility,
    impostor: &Visibility,
) -> Geometry {
    let sight = Sight::new(subject, camera, original, impostor);
    let alone = sight.alone();
    let unseen = sight.unseen(&alone);
    let from_behind = alone.into_iter().filter(|at| !unseen.contains(at));
    let from_behind = from_behind.collect();
    let [phantoms, backs] = sight.phantoms_and_backs(unseen);
    Geometry {
        gaps: sight.gaps(),
        phantoms,
        backs,
        from_behind,
        parallax: sight.parallax(),
    }
}

/// What both sides show to a camera, for what is to be found in it.
struct Sight<'a> {
    subject: &'a Subject<'a>,
    camera: &'a Camera,
    original: &'a Visibility,
    impostor: &'a Visibility,
    close_look: CloseLook<'a>,
}

impl<'a> Sight<'a> {
    fn new(
        subject: &'a Subject<'a>,
        camera: &'a Camera,
        original: &'a Visibility,
        impostor: &'a Visibility,
    ) -> Self {
        Self {
            subject,
            camera,
            original,
            impostor,
            close_look: CloseLook::new(subject, camera),
        }
    }

    fn gaps(&self) -> Vec<[u32; 2]> {
        let Self {
            subject, camera, ..
        } = self;
        let [original, impostor] =
            [self.original, self.impostor].map(|seen| layers(subject, camera, seen));
        gaps(subject, camera, &original, &impostor)
    }

    fn parallax(&self) -> ParallaxErrors {
        let subject = self.subject;
        let reference = subject.reference();
        let recorded = RecordedFrom {
            reference: *reference,
            borders: &subject.borders,
            texel: subject.texel(),
        };
        let touches = |at, layer| self.close_look.touches(at, layer);
        let (original, impostor) = (&self.original.depth, &self.impostor.depth);
        let limit = subject.most_parallax;
        match &subject.shape {
            Shape::Layers(tracer) => {
                let eye = reference.eye;
                let meet = |direction, range| tracer.nearest_to_range(eye, direction, range);
                parallax(
                    original,
                    impostor,
                    self.camera,
                    &recorded,
                    limit,
                    meet,
                    touches,
                )
            }
            Shape::Mesh(mesh) => {
                let nearest = |point| mesh.nearest(point);
                mesh_parallax(
                    original,
                    impostor,
                    self.camera,
                    &recorded,
                    limit,
                    nearest,
                    touches,
                )
            }
        }
    }

    /// The pixels that only the impostor covers, far from any surface of the original that is
    /// turned to the camera.
    fn alone(&self) -> Vec<[u32; 2]> {
        let single = covered_in_any_sample(&self.original.objects, 1);
        let suspects = phantom_pixels(&single, &self.impostor.objects);
        far_from(self.subject, self.camera, suspects, touched)
    }

    /// Those of them that are far from any surface whose front is turned to some place of the cell.
    fn unseen(&self, alone: &[[u32; 2]]) -> Vec<[u32; 2]> {
        far_from(self.subject, self.camera, alone.to_vec(), touched_from_cell)
    }

    /// Those of these that are far from anything, and those that show its back.
    fn phantoms_and_backs(&self, unseen: Vec<[u32; 2]>) -> [Vec<[u32; 2]>; 2] {
        let phantoms = far_from(
            self.subject,
            self.camera,
            unseen.clone(),
            touched_on_any_side,
        );
        let backs = unseen.into_iter().filter(|at| !phantoms.contains(at));
        let backs = backs.collect();
        [phantoms, backs]
    }
}

/// The nearest layers that the original has at pixels, where they are asked for.
struct CloseLook<'a> {
    subject: &'a Subject<'a>,
    camera: &'a Camera,
    /// Of samples, by strips of rows.
    sampled: Vec<OnceCell<Grid<u32>>>,
    /// Of everything, however thin.
    touched: Vec<OnceCell<Grid<u32>>>,
}

/// Samples a pixel along each side.
const SAMPLES: u32 = 4;

impl<'a> CloseLook<'a> {
    fn new(subject: &'a Subject<'a>, camera: &'a Camera) -> Self {
        let strips = || vec![OnceCell::new(); camera.height.div_ceil(TILE) as usize];
        Self {
            subject,
            camera,
            sampled: strips(),
            touched: strips(),
        }
    }

    /// Whether the original touches this layer or a nearer one in the 5 x 5 neighbourhood of a
    /// pixel. Samples find most of what there is, and sooner.
    fn touches(&self, at: [u32; 2], layer: u32) -> bool {
        self.least(&self.sampled, at, nearest_sampled) <= layer
            || self.least(&self.touched, at, touched_layers) <= layer
    }

    /// The least layer in the 5 x 5 neighbourhood of a pixel.
    fn least(
        &self,
        strips: &[OnceCell<Grid<u32>>],
        [x, y]: [u32; 2],
        look: impl Fn(&Subject<'_>, &Camera) -> Grid<u32>,
    ) -> u32 {
        let Camera { width, height, .. } = *self.camera;
        let strip = y / TILE;
        let first = (strip * TILE).saturating_sub(2);
        let end = ((strip + 1) * TILE + 2).min(height);
        let layers = strips[strip as usize].get_or_init(|| {
            look(
                self.subject,
                &self.camera.window(&(0..width), &(first..end)),
            )
        });
        let columns = x.saturating_sub(2) as usize..(x + 3).min(width) as usize;
        let rows = y.saturating_sub(2) - first..(y + 3).min(end) - first;
        let least = rows
            .flat_map(|y| &layers.row(y as usize)[columns.clone()])
            .min();
        least.copied().unwrap_or(NONE)
    }
}

/// Per pixel the least layer that a sample of the original shows.
fn nearest_sampled(subject: &Subject<'_>, camera: &Camera) -> Grid<u32> {
    of_samples(subject, camera, NONE, u32::min)
}

/// Per pixel the greatest layer that a sample of the original shows; [`NONE`] where one shows
/// nothing.
pub(super) fn farthest_sampled(subject: &Subject<'_>, camera: &Camera) -> Grid<u32> {
    of_samples(subject, camera, 0, u32::max)
}

/// A camera for samples of the pixels of another, and how many it takes along their sides.
pub(super) fn finer(camera: &Camera) -> (u32, Camera) {
    let finer = Camera {
        width: camera.width * SAMPLES,
        height: camera.height * SAMPLES,
        ..*camera
    };
    (SAMPLES, finer)
}

/// Per pixel the one of its samples' layers that `chosen` prefers to the others and to `start`.
fn of_samples(
    subject: &Subject<'_>,
    camera: &Camera,
    start: u32,
    chosen: fn(u32, u32) -> u32,
) -> Grid<u32> {
    let (_, finer) = finer(camera);
    let Side { scene, textures } = subject.original;
    let seen = rasterize(scene, textures, &finer);
    let samples = layer_indices(&seen.depth, &finer, subject.reference(), &subject.borders);
    let mut layers = Grid::filled(camera.width as usize, camera.height as usize, start);
    let samples_a_side = SAMPLES as usize;
    for y in 0..samples.height() {
        for (x, layer) in samples.row(y).iter().enumerate() {
            let at = &mut layers[(x / samples_a_side, y / samples_a_side)];
            *at = chosen(*layer, *at);
        }
    }
    layers
}

/// Per pixel the least layer that the original touches, hidden or not.
fn touched_layers(subject: &Subject<'_>, camera: &Camera) -> Grid<u32> {
    let scene = &*subject.before(camera);
    let (reference, borders) = (subject.reference(), &subject.borders);
    let inner = &borders[1..borders.len() - 1];
    // Where the camera's axis meets the borders: about one slab a layer, so that what is recorded
    // in a slab is about as near as anything there.
    let along = camera.pose.forward.dot(reference.forward);
    let before = (camera.pose.eye - reference.eye).dot(reference.forward);
    let met = inner.iter().map(|border| (border - before) / along);
    let slabs: Vec<f64> = std::iter::once(0.0)
        .chain(met.filter(|depth| *depth > 0.0 && along > 0.0))
        .chain([f64::INFINITY])
        .collect();
    let eye = [camera.pose.eye.extend(1.0)];
    let textures = subject.original.textures;
    let touched = record(scene, textures, camera, &slabs, &eye, Foliage::Any);
    let mut least = Grid::filled(camera.width as usize, camera.height as usize, NONE);
    for sample in &touched.samples {
        let depth = reference.point_in_view(sample.hit.point_in_world(scene)).z;
        let layer = inner.partition_point(|border| *border <= depth) as u32;
        let at = &mut least[(sample.x.into(), sample.y.into())];
        *at = layer.min(*at);
    }
    least
}

/// Side of the tiles that suspects are looked at in, in pixels: bounds time and memory.
const TILE: u32 = 64;

/// The pixels among suspects with nothing of the original in their 5 x 5 neighbourhoods, however
/// thin, that a sample a pixel could have missed.
///
/// * `touched` - the pixels of a camera that something of the original touches
fn far_from(
    subject: &Subject<'_>,
    camera: &Camera,
    suspects: Vec<[u32; 2]>,
    touched: impl Fn(&Subject<'_>, &Camera) -> BitMask,
) -> Vec<[u32; 2]> {
    in_tiles(camera, suspects, 2, |[columns, rows], suspects| {
        let covered = touched(subject, &camera.window(&columns, &rows));
        let mut ids = Grid::filled(covered.width(), covered.height(), NONE);
        for [x, y] in suspects {
            ids[((x - columns.start) as usize, (y - rows.start) as usize)] = 0;
        }
        phantom_pixels(&covered, &ids)
    })
}

/// Looks again at suspects, tile by tile: what is found in the windows around those of each tile.
///
/// * `margin` - by how many pixels a window reaches over its suspects
/// * `look` - takes columns and rows of a window, and the suspects; returns pixels in the window
pub(super) fn in_tiles(
    camera: &Camera,
    mut suspects: Vec<[u32; 2]>,
    margin: u32,
    look: impl Fn([Range<u32>; 2], &[[u32; 2]]) -> Vec<[u32; 2]>,
) -> Vec<[u32; 2]> {
    let tile = |[x, y]: &[u32; 2]| (y / TILE, x / TILE);
    suspects.sort_by_key(tile);
    let tiles = suspects.chunk_by(|a, b| tile(a) == tile(b));
    let mut found: Vec<_> = tiles
        .flat_map(|suspects| {
            let bound = |axis: usize, limit: u32| {
                let along = suspects.iter().map(|at| at[axis]);
                let (min, max) = (along.clone().min().unwrap_or(0), along.max().unwrap_or(0));
                min.saturating_sub(margin)..(max + margin + 1).min(limit)
            };
            let window = [bound(0, camera.width), bound(1, camera.height)];
            let [left, top] = [window[0].start, window[1].start];
            let found = look(window, suspects);
            found.into_iter().map(move |[x, y]| [x + left, y + top])
        })
        .collect();
    found.sort_by_key(|[x, y]| (*y, *x));
    found
}

/// The pixels that anything of the original touches, hidden or not.
fn touched(subject: &Subject<'_>, camera: &Camera) -> BitMask {
    let eye = [camera.pose.eye.extend(1.0)];
    touched_by(&subject.before(camera), subject, camera, &eye)
}

/// The pixels that anything of the original touches whose front is turned to some place of the view
/// cell, to the camera or not.
fn touched_from_cell(subject: &Subject<'_>, camera: &Camera) -> BitMask {
    let corners = subject.cell.corners();
    touched_by(&subject.in_picture(camera), subject, camera, &corners)
}

/// The pixels that anything of the original touches or would, were all of it seen from both sides.
fn touched_on_any_side(subject: &Subject<'_>, camera: &Camera) -> BitMask {
    let mut scene = subject.in_picture(camera);
    for material in &mut scene.materials {
        material.double_sided = true;
    }
    let eye = [camera.pose.eye.extend(1.0)];
    touched_by(&scene, subject, camera, &eye)
}

/// The pixels that what of a scene is turned to one of some corners touches.
fn touched_by(scene: &Scene, subject: &Subject<'_>, camera: &Camera, corners: &[DVec4]) -> BitMask {
    let everything = record(
        scene,
        subject.original.textures,
        camera,
        &[0.0, f64::INFINITY],
        corners,
        Foliage::Any,
    );
    everything.masks(0, camera.width, camera.height).opaque
}
