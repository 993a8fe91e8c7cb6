//! The conservative one-pass layer recorder.

use crate::contest::{Claim, Contest, Rank};
use crate::coverage::{Outline, nearest_on_border};
use crate::geometry::{Drawn, Interpolation, batches, run_in_view};
use crate::masked::Masked;
use crate::piece::{Corner, Piece, Viewpoint, cut_to_slab, whole};
use crate::surface::{Hit, Surface, surface_from_cell};
use crate::texel_search::TexelSearch;
use crate::{Lighting, Textures, lit_color, srgb_from_linear};
use farfield_grid::BitMask;
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;
use std::ops::{Range, RangeInclusive};

/// What a texel of a layer shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Column.
    pub x: u16,
    /// Row.
    pub y: u16,
    /// The surface point that gives the texel its colour.
    pub hit: Hit,
    /// Whether the texel hides what is behind: false where only back faces touch it.
    pub occludes: bool,
}

/// The texels of all layers, front to back, each layer row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// All texels that are set.
    pub samples: Vec<Sample>,
    /// Per layer its run of `samples`.
    pub layers: Vec<Range<usize>>,
}

impl Recording {
    /// The texels of a layer that are set, and those of them that hide what is behind, of a layer
    /// of `width` x `height` texels.
    ///
    /// # Panics
    ///
    /// When the layer does not exist or a sample lies outside.
    pub fn masks(&self, layer: usize, width: u32, height: u32) -> LayerMasks {
        let empty = BitMask::empty(width as usize, height as usize);
        let mut masks = LayerMasks {
            opaque: empty.clone(),
            occluding: empty,
        };
        for sample in &self.samples[self.layers[layer].clone()] {
            let (x, y) = (usize::from(sample.x), usize::from(sample.y));
            masks.opaque.insert(x, y);
            if sample.occludes {
                masks.occluding.insert(x, y);
            }
        }
        masks
    }
}

/// The texels of a layer as bit masks.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerMasks {
    /// Texels that are set.
    pub opaque: BitMask,
    /// Those of them that hide what is behind.
    pub occluding: BitMask,
}

/// How triangles of masked materials, those with an alpha cutoff, are recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foliage {
    /// A texel is set where anything of the surface in it is there: no gaps open, but what is
    /// thin becomes a texel wide.
    Any,
    /// A texel is set where the surface over its centre is there: as much is covered as is there,
    /// but what is thin falls apart into dots.
    Centre,
}

/// sRGB colours of samples under a light; textures and arguments as for [`sample_surfaces`].
pub fn sample_colors(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    cell: &[DVec4],
    samples: &[Sample],
    light: &Lighting,
) -> Vec<[u8; 3]> {
    let byte = |c: f32| (srgb_from_linear(c) * 255.0).round() as u8;
    let color = |surface: Surface| lit_color(&surface, light).to_array().map(byte);
    shown_to_cell(scene, textures, camera, cell, samples, color)
}

/// The materials of samples before any light, textures filtered for a texel of the camera that
/// recorded them as whoever in the view cell faces the surface most squarely would have it: what
/// the camera sees edge-on shows its details to others.
///
/// * `cell` - corners of the view cell in homogeneous coordinates of the world
///
/// # Panics
///
/// When a sample's object or triangle does not exist.
pub fn sample_surfaces(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    cell: &[DVec4],
    samples: &[Sample],
) -> Vec<Surface> {
    shown_to_cell(scene, textures, camera, cell, samples, |surface| surface)
}

fn shown_to_cell<T: Send>(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    cell: &[DVec4],
    samples: &[Sample],
    of: impl Fn(Surface) -> T + Sync,
) -> Vec<T> {
    let pose = &camera.pose;
    let cell: Vec<Viewpoint> = cell.iter().map(|v| Viewpoint::new(pose, *v)).collect();
    let shown = |sample: &Sample| {
        of(surface_from_cell(
            scene,
            textures,
            camera,
            &cell,
            &sample.hit,
        ))
    };
    samples.par_iter().map(shown).collect()
}

/// Rows of texels that one thread works on at a time.
pub(crate) const BAND: usize = 16;

/// Records a scene into layers: in one pass over the triangles, each is cut to every slab of
/// depth it crosses, and every texel whose closed square the piece touches is set in the slab's
/// layer.
///
/// Slab i reaches from `borders[i]` to `borders[i + 1]`, both included; the first and the last
/// also hold what lies before and behind. Cut points are computed once per edge and border from
/// an ordered pair of corners, so neighbouring pieces get the same bits. A doubtful square is set.
/// So the texels set are the supercover of the surface, and a line of sight that moves by at most
/// one texel between neighbouring layers cannot slip through.
/// (Jeschke, 2005, section 3.3.2 draws outlines and repairs diagonals instead.)
///
/// A texel of a material with an alpha cutoff is set, with [`Foliage::Any`], if alpha reaches it
/// anywhere on what of the piece lies in the texel. That is exact where the triangle's vertices have the same alpha, and
/// can miss a peak within a texel of the texture where they differ. A triangle of a single-sided
/// material is left out where no corner of the view cell lies in front of its plane.
///
/// Where several pieces touch a texel of a layer, front faces win over back faces (seen from the
/// camera), those over the texel's centre over those beside it, and among these the nearest: in
/// depth over the centre, to the centre beside it.
///
/// * `camera` - at the reference viewpoint; its pixels are the layers' texels, at most 65,536 a
///   side. What lies beyond its extent is not recorded.
/// * `borders` - ascending depths, one more than layers
/// * `cell` - corners of the view cell in homogeneous coordinates of the world
/// * `foliage` - how masked materials are recorded
///
/// Memory follows the texels touched, in tiles of 4 x 4, not layers x resolution nor triangles:
/// these are set up and drawn batch by batch. Bound by triangles where they are about as small as
/// texels, each set up in about the time a plain pass of the z-buffer takes for it, and by the
/// pairs of triangle and texel that touch where they are larger; see the crate's figures.
///
/// # Panics
///
/// When there are fewer than two borders, or a triangle does not lie before the camera.
pub fn record(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    borders: &[f64],
    cell: &[DVec4],
    foliage: Foliage,
) -> Recording {
    assert!(
        borders.len() >= 2,
        "{} borders hold no layer",
        borders.len()
    );
    let task = Task {
        scene,
        textures,
        camera,
        borders,
        foliage,
    };
    let pose = &camera.pose;
    let cell: Vec<Viewpoint> = cell.iter().map(|v| Viewpoint::new(pose, *v)).collect();
    let mut bands = task.bands();
    for batch in batches(scene) {
        let pieces: Vec<Vec<Piece>> = batch
            .par_iter()
            .map(|run| {
                let triangles = run_in_view(scene, pose, run);
                triangles
                    .filter_map(|(drawn, corners)| {
                        Piece::new(scene, camera, borders, &cell, drawn, corners)
                    })
                    .collect()
            })
            .collect();
        let mut bins = vec![Vec::new(); bands.len()];
        for piece in pieces.iter().flatten() {
            let Range { start, end } = piece.rows;
            let bands = start as usize / BAND..(end as usize).div_ceil(BAND);
            bins[bands]
                .iter_mut()
                .for_each(|bin: &mut Vec<&Piece>| bin.push(piece));
        }
        bands.par_iter_mut().zip(bins).for_each(|(band, bin)| {
            // Centres first: what lies beside them mostly loses, and is told by a glance then.
            for piece in bin.iter().filter(|piece| piece.may_cover_centers) {
                draw_over_centers(&task, piece, band);
            }
            for piece in bin {
                draw_beside_centers(&task, piece, band);
            }
        });
    }
    stacked(bands, borders.len() - 1)
}

/// Puts bands of rows below each other, layer by layer.
pub(crate) fn stacked(bands: Vec<Band>, layers: usize) -> Recording {
    let bands: Vec<Recording> = bands.into_par_iter().map(Band::into_recording).collect();
    let mut all = Recording::default();
    all.samples
        .reserve_exact(bands.iter().map(|band| band.samples.len()).sum());
    for layer in 0..layers {
        let start = all.samples.len();
        for band in &bands {
            all.samples
                .extend_from_slice(&band.samples[band.layers[layer].clone()]);
        }
        all.layers.push(start..all.samples.len());
    }
    all
}

/// What is recorded, and for whom.
pub(crate) struct Task<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) textures: &'a Textures<'a>,
    pub(crate) camera: &'a Camera,
    pub(crate) borders: &'a [f64],
    pub(crate) foliage: Foliage,
}

impl Task<'_> {
    /// The rows of all layers, band by band.
    pub(crate) fn bands(&self) -> Vec<Band> {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let layers = self.borders.len() - 1;
        let tops = (0..height).step_by(BAND);
        tops.map(|top| Band::new(top..height.min(top + BAND), width, layers))
            .collect()
    }
}

/// Some rows of all layers.
pub(crate) struct Band {
    pub(crate) rows: Range<usize>,
    pub(crate) width: usize,
    pub(crate) contest: Contest,
    pub(crate) part: Part,
}

impl Band {
    fn new(rows: Range<usize>, width: usize, layers: usize) -> Self {
        Self {
            contest: Contest::new(width, rows.len(), layers),
            rows,
            width,
            part: Part::default(),
        }
    }

    pub(crate) fn into_recording(self) -> Recording {
        let mut recording = Recording::default();
        for layer in 0..self.contest.layers() {
            let start = recording.samples.len();
            self.contest.for_each_in(layer, |x, y, rank, hit| {
                recording.samples.push(Sample {
                    x: x as u16,
                    y: (self.rows.start + y) as u16,
                    hit,
                    occludes: rank.is_front(),
                });
            });
            recording.layers.push(start..recording.samples.len());
        }
        recording
    }
}

/// Claims the texels over whose centres a triangle lies, in every slab it crosses.
fn draw_over_centers(task: &Task<'_>, piece: &Piece, band: &mut Band) {
    let Some(inside) = Interpolation::new(task.camera, piece.corners) else {
        return;
    };
    let masked = Masked::new(task.scene, task.textures, piece.drawn);
    for layer in piece.layers() {
        band.part.cut(task, piece, layer);
        let outline = band.part.outline();
        for y in within(outline.rows(task.camera.height as usize), &band.rows) {
            for x in outline.centers_in(y, band.width) {
                let claim = band.contest.claim_mut(layer, x, y - band.rows.start);
                claim_over_center(piece, &inside, masked.as_ref(), center_of(x, y), claim);
            }
        }
    }
}

/// Claims a texel over whose centre a triangle lies.
#[inline]
pub(crate) fn claim_over_center(
    piece: &Piece,
    inside: &Interpolation,
    masked: Option<&Masked<'_>>,
    center: DVec2,
    claim: &mut Claim,
) {
    let rank = Rank {
        class: Rank::class(piece.front, true),
        distance: inside.inverse_depth(center).recip(),
    };
    if !rank.is_better_than(&claim.rank) {
        return;
    }
    let weights = inside.barycentric(center);
    if masked.is_none_or(|masked| masked.is_there(masked.place(weights))) {
        *claim = Claim::new(rank, hit(piece.drawn, weights));
    }
}

/// Claims what texels are left that a triangle touches, in every slab it crosses.
fn draw_beside_centers(task: &Task<'_>, piece: &Piece, band: &mut Band) {
    let mut layers = piece.layers();
    let Some(first) = layers.find(|layer| !is_settled(task, piece, *layer, band)) else {
        return;
    };
    let masked = Masked::new(task.scene, task.textures, piece.drawn);
    if masked.is_some() && task.foliage == Foliage::Centre {
        return;
    }
    let mut beside = Beside::new(task, piece, masked.as_ref());
    for layer in std::iter::once(first).chain(layers) {
        if layer != first && is_settled(task, piece, layer, band) {
            continue;
        }
        band.part.cut(task, piece, layer);
        let outline = band.part.outline();
        for y in within(outline.rows(task.camera.height as usize), &band.rows) {
            let tried = beside.tried(&outline, y, band.width);
            for x in outline.columns(y, band.width) {
                let claim = band.contest.claim_mut(layer, x, y - band.rows.start);
                beside.claim(
                    &band.part,
                    &outline,
                    center_of(x, y),
                    tried.contains(&x),
                    claim,
                );
            }
        }
    }
}

/// A triangle that claims texels beside whose centres it lies.
pub(crate) struct Beside<'a> {
    camera: &'a Camera,
    piece: &'a Piece,
    class: u8,
    masked: Option<&'a Masked<'a>>,
    search: Option<TexelSearch<'a>>,
}

impl<'a> Beside<'a> {
    pub(crate) fn new(task: &Task<'a>, piece: &'a Piece, masked: Option<&'a Masked<'a>>) -> Self {
        let camera = task.camera;
        Self {
            camera,
            piece,
            class: Rank::class(piece.front, false),
            masked,
            search: masked.map(|masked| TexelSearch::new(camera, piece.corners, masked)),
        }
    }

    /// The columns of a row whose centres need not be tried: opaque triangles have claimed what they
    /// lie over, masked ones have tried the centre.
    pub(crate) fn tried(&self, outline: &Outline<'_>, y: usize, width: usize) -> Range<usize> {
        match &self.search {
            Some(search) if search.sees_centers() => outline.centers_in(y, width),
            _ => 0..0,
        }
    }

    /// Claims a texel that the part touches.
    #[inline]
    pub(crate) fn claim(
        &mut self,
        part: &Part,
        outline: &Outline<'_>,
        center: DVec2,
        was_tried: bool,
        claim: &mut Claim,
    ) {
        let (class, piece) = (self.class, self.piece);
        if !claim.may_lose_to(class, || outline.distance_squared(center)) {
            return;
        }
        if !was_tried {
            let (point, weights) = beside(&part.polygon, outline.corners(), center);
            let rank = Rank {
                class,
                distance: point.distance_squared(center),
            };
            if !rank.is_better_than(&claim.rank) {
                return;
            }
            let is_there = |masked: &Masked<'_>| masked.is_there(masked.place(weights));
            if self.masked.is_none_or(is_there) {
                *claim = Claim::new(rank, hit(piece.drawn, weights));
                return;
            }
        }
        // Something else of the texel is worth a search only while nothing occludes.
        let Some(search) = &mut self.search else {
            return;
        };
        if claim.rank.is_front() || (claim.is_set() && !piece.front) {
            return;
        }
        if let Some(weights) = search.some_point(&part.polygon, center) {
            let [a, b, c] = piece.corners;
            let point = a * weights.x + b * weights.y + c * weights.z;
            let distance = self.camera.pixel_from_view(point).distance_squared(center);
            *claim = Claim::new(Rank { class, distance }, hit(piece.drawn, weights));
        }
    }
}

/// Whether a small triangle can claim no texel of a layer any more, whatever its class; found by
/// the triangle's bounds, before it is cut. So end most triangles of a dense mesh.
fn is_settled(task: &Task<'_>, piece: &Piece, layer: usize, band: &Band) -> bool {
    let Piece { columns, rows, .. } = piece;
    // Of longer ones the bounds hold much that they do not touch.
    if columns.len().max(rows.len()) > 4 {
        return false;
    }
    let class = Rank::class(piece.front, false);
    let first = band.rows.start.max(rows.start as usize);
    let end = band.rows.end.min(rows.end as usize);
    (first..end).all(|y| {
        columns.clone().all(|x| {
            let center = center_of(x as usize, y);
            let bound = || Outline::new(&piece.texels(task.camera)).distance_squared(center);
            let claim = band.contest.claim(layer, x as usize, y - band.rows.start);
            !claim.may_lose_to(class, bound)
        })
    })
}

pub(crate) fn center_of(x: usize, y: usize) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}

fn within(touched: RangeInclusive<usize>, rows: &Range<usize>) -> Range<usize> {
    rows.start.max(*touched.start())..rows.end.min(touched.end() + 1)
}

/// The part of a triangle that lies in a slab, and room to cut it.
#[derive(Debug, Default)]
pub(crate) struct Part {
    polygon: Vec<Corner>,
    /// The same in texels.
    texels: Vec<DVec2>,
    beyond_near: Vec<Corner>,
}

impl Part {
    /// Cuts a triangle to the slab of a layer.
    pub(crate) fn cut(&mut self, task: &Task<'_>, piece: &Piece, layer: usize) {
        self.texels.clear();
        if piece.layers.len() == 1 {
            self.polygon.clear();
            self.polygon.extend(whole(piece.corners));
            self.texels.extend(piece.texels(task.camera));
            return;
        }
        // The first and the last slab reach as far as the triangle does.
        let near = (layer > piece.layers().start).then(|| task.borders[layer]);
        let far = (layer + 1 < piece.layers().end).then(|| task.borders[layer + 1]);
        let scratch = &mut self.beyond_near;
        cut_to_slab(piece.corners, [near, far], scratch, &mut self.polygon);
        let in_texels = |corner: &Corner| task.camera.pixel_from_view(corner.point);
        self.texels.extend(self.polygon.iter().map(in_texels));
    }

    pub(crate) fn outline(&self) -> Outline<'_> {
        Outline::new(&self.texels)
    }
}

/// The point of a polygon nearest to a texel's centre beside it, in texels, and its barycentric
/// coordinates in the whole triangle.
fn beside(polygon: &[Corner], outline: &[DVec2], center: DVec2) -> (DVec2, DVec3) {
    let (i, t) = nearest_on_border(outline, center);
    let j = (i + 1) % polygon.len();
    // Equal steps on the screen are larger ones in space where it is farther.
    let (z, w) = (polygon[i].point.z, polygon[j].point.z);
    let s = t * z / (t * z + (1.0 - t) * w);
    (
        outline[i].lerp(outline[j], t),
        polygon[i].weights.lerp(polygon[j].weights, s),
    )
}

fn hit(drawn: Drawn, weights: DVec3) -> Hit {
    // Rounding can leave the triangle by a hair; texture and alpha must not.
    let inside = weights.clamp(DVec3::ZERO, DVec3::ONE);
    let inside = inside / inside.element_sum();
    Hit {
        object: drawn.object,
        triangle: drawn.triangle,
        barycentric: [inside.y as f32, inside.z as f32],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::corners_in_view;
    use crate::geometry::tests::soup;
    use crate::masked::tests::{leaves, margin};
    use crate::rasterize;
    use farfield_scene::{AlphaMode, Filter};
    use farfield_views::{Extent, Pose};
    use glam::Vec4;
    use proptest::prelude::*;
    use std::collections::HashSet;

    const WIDTH: u32 = 12;
    const HEIGHT: u32 = 9;
    const BORDERS: [f64; 4] = [1.0, 1.5, 1.75, 3.0];

    fn camera() -> Camera {
        Camera {
            pose: Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z),
            extent: Extent {
                min: DVec2::new(-1.0, -0.8),
                max: DVec2::new(1.0, 0.7),
            },
            width: WIDTH,
            height: HEIGHT,
        }
    }

    const EVERYWHERE: [DVec4; 2] = [
        DVec4::new(0.0, 0.0, 1e9, 1.0),
        DVec4::new(0.0, 0.0, -1e9, 1.0),
    ];

    fn double_sided(points: &[[f32; 3]]) -> Scene {
        let mut scene = soup(points);
        scene.materials[0].double_sided = true;
        scene
    }

    fn set(recording: &Recording) -> Vec<(usize, u16, u16)> {
        let layers = recording.layers.iter().enumerate();
        layers
            .flat_map(|(l, run)| {
                recording.samples[run.clone()]
                    .iter()
                    .map(move |s| (l, s.x, s.y))
            })
            .collect()
    }

    fn points(count: usize) -> impl Strategy<Value = Vec<[f32; 3]>> {
        // Depths on borders are the trouble: some points lie exactly there.
        let depth = prop_oneof![3 => -3.0..-1.0f32, 1 => prop::sample::select(vec![-1.0, -1.5, -1.75, -3.0])];
        prop::collection::vec(
            (-1.0..1.0f32, -0.7..0.8f32, depth).prop_map(|(x, y, z)| [-x * z, -y * z, z]),
            count,
        )
    }

    proptest! {
        /// Every point of every triangle lies in a texel that is set, in every slab that contains
        /// its depth.
        #[test]
        fn every_surface_point_is_recorded(points in points(9), inside in prop::collection::vec((0.0..=1.0f64, 0.0..=1.0f64), 60)) {
            let scene = double_sided(&points);
            let recording = record(&scene, &Textures::new(&scene), &camera(), &BORDERS, &EVERYWHERE, Foliage::Any);
            let texels = set(&recording);
            for (n, (s, t)) in inside.into_iter().enumerate() {
                let [a, b, c] = corners_in_view(&scene, &camera().pose, Drawn { object: 0, triangle: n as u32 % 3 });
                let point = a + (b - a) * (s * (1.0 - t)) + (c - a) * t;
                let at = camera().pixel_from_view(point).floor();
                let texel = (at.x.min(11.0) as u16, at.y.min(8.0) as u16);
                for layer in 0..3 {
                    if (BORDERS[layer]..=BORDERS[layer + 1]).contains(&point.z) {
                        prop_assert!(texels.contains(&(layer, texel.0, texel.1)));
                    }
                }
            }
        }

        /// No texel is set far from the surface: a triangle's point within the slab, as a dense
        /// sampling finds it, lies within the texel's square or next to it.
        #[test]
        fn only_touched_texels_are_set(points in points(3)) {
            let scene = double_sided(&points);
            let recording = record(&scene, &Textures::new(&scene), &camera(), &BORDERS, &EVERYWHERE, Foliage::Any);
            let [a, b, c] = corners_in_view(&scene, &camera().pose, Drawn { object: 0, triangle: 0 });
            let steps = 100;
            let dense: Vec<DVec3> = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j)))
                .map(|(i, j)| a + (b - a) * (f64::from(i) / 100.0) + (c - a) * (f64::from(j) / 100.0))
                .map(|p| camera().pixel_from_view(p).extend(p.z))
                .collect();
            for (layer, x, y) in set(&recording) {
                let square = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                // Neighbouring samples are at most 0.2 texels and 0.02 in depth apart.
                let near = dense.iter().any(|p| {
                    (p.truncate() - square).abs().max_element() <= 0.75
                        && p.z >= BORDERS[layer] - 0.03 && p.z <= BORDERS[layer + 1] + 0.03
                });
                prop_assert!(near, "({x}, {y}) of layer {layer} is far from the triangle");
            }
        }

        /// Samples are sorted, lie in their layer once, and name points of their texel's
        /// triangle that project into the texel's circumcircle.
        #[test]
        fn samples_lie_in_their_texels(points in points(9)) {
            let scene = double_sided(&points);
            let recording = record(&scene, &Textures::new(&scene), &camera(), &BORDERS, &EVERYWHERE, Foliage::Any);
            for run in &recording.layers {
                let texels = recording.samples[run.clone()].iter().map(|s| (s.y, s.x)).collect::<Vec<_>>();
                prop_assert!(texels.is_sorted_by(|a, b| a < b));
            }
            for sample in &recording.samples {
                let drawn = Drawn { object: sample.hit.object, triangle: sample.hit.triangle };
                let [a, b, c] = corners_in_view(&scene, &camera().pose, drawn);
                let [s, t] = sample.hit.barycentric.map(f64::from);
                let at = camera().pixel_from_view(a + (b - a) * s + (c - a) * t);
                let center = DVec2::new(f64::from(sample.x) + 0.5, f64::from(sample.y) + 0.5);
                // A piece may touch no more than a corner; the hit is kept in f32.
                prop_assert!(at.distance(center) < 0.5f64.sqrt() + 1e-3, "{at} is not in {center}");
            }
        }

        /// A texel of a masked triangle is set exactly where the surface is there, as a dense
        /// sampling of the triangle finds it.
        #[test]
        fn masked_texels_are_set_where_the_surface_is_there(
            (scene, same_alpha) in points(3)
                .prop_flat_map(|p| leaves([p[0], p[1], p[2]]))
                .prop_map(|scene| {
                    let same_alpha = scene.colors.iter().all(|c| *c == scene.colors[0]);
                    (scene, same_alpha)
                }),
        ) {
            let recording = record(&scene, &Textures::new(&scene), &camera(), &BORDERS, &EVERYWHERE, Foliage::Any);
            let texels: HashSet<_> = set(&recording).into_iter().collect();
            let [a, b, c] = corners_in_view(&scene, &camera().pose, Drawn { object: 0, triangle: 0 });
            let lattice = (0..=300).flat_map(|i| (0..=300 - i).map(move |j| (i, j)));
            for (i, j) in lattice.filter(|_| same_alpha) {
                let weights = DVec3::new(f64::from(300 - i - j), f64::from(i), f64::from(j)) / 300.0;
                // More than rounding, of alpha to f32 and of positions.
                if margin(&scene, weights) < 1e-6 {
                    continue;
                }
                let point = a * weights.x + b * weights.y + c * weights.z;
                let at = camera().pixel_from_view(point).floor();
                let texel = (at.x.min(11.0) as u16, at.y.min(8.0) as u16);
                for layer in 0..3 {
                    if (BORDERS[layer]..=BORDERS[layer + 1]).contains(&point.z) {
                        prop_assert!(texels.contains(&(layer, texel.0, texel.1)), "{point} is missing");
                    }
                }
            }
            for sample in recording.samples.iter().filter(|_| scene.textures[0].filter == Filter::Linear) {
                let [s, t] = sample.hit.barycentric.map(f64::from);
                // The hit is kept in f32, and alpha changes by at most 24 texels times 1.
                let margin = margin(&scene, DVec3::new(1.0 - s - t, s, t));
                prop_assert!(margin > -1e-5, "{sample:?} is not there");
            }
        }

        /// Two triangles that share an edge across a border set the same texels along the cut.
        #[test]
        fn both_layers_hold_the_cut(points in points(4)) {
            let [a, b, c, d] = [points[0], points[1], points[2], points[3]];
            let cuts = |scene: &Scene, triangle: u32, layer: usize| {
                let corners = corners_in_view(scene, &camera().pose, Drawn { object: 0, triangle });
                let slab = [BORDERS[layer], BORDERS[layer + 1]].map(Some);
                let mut polygon = Vec::new();
                cut_to_slab(corners, slab, &mut Vec::new(), &mut polygon);
                polygon.into_iter()
                    .filter(|corner| corner.point.z == BORDERS[1])
                    .map(|corner| corner.point.to_array().map(f64::to_bits)).collect::<Vec<_>>()
            };
            let scene = double_sided(&[a, b, c, b, a, d]);
            let shared = |cuts: &[[u64; 3]]| cuts.to_vec();
            for triangle in 0..2 {
                let (mut front, mut back) = (cuts(&scene, triangle, 0), cuts(&scene, triangle, 1));
                front.sort_unstable();
                back.sort_unstable();
                // A piece that only touches the border leaves the other slab its whole outline.
                if front.len() == 2 && back.len() == 2 {
                    prop_assert_eq!(shared(&front), shared(&back));
                }
            }
            // The edge from a to b is cut at the same bits in both triangles.
            if (a[2] < -1.5) != (b[2] < -1.5) && a[2] != -1.5 && b[2] != -1.5 {
                let (one, two) = (cuts(&scene, 0, 0), cuts(&scene, 1, 0));
                prop_assert!(one.iter().any(|p| two.contains(p)));
            }
        }
    }

    proptest! {
        /// Recorded by centres, a masked triangle covers in all layers together just the texels
        /// that a plain pass covers.
        #[test]
        fn centres_cover_what_a_plain_pass_covers(
            scene in prop::array::uniform3(prop::array::uniform3(-3.0..3.0f32))
                .prop_flat_map(|points| leaves(points.map(|[x, y, z]| [x, y, z / 8.0 - 1.4]))),
        ) {
            let textures = Textures::new(&scene);
            let recording =
                record(&scene, &textures, &camera(), &BORDERS, &EVERYWHERE, Foliage::Centre);
            let seen = rasterize(&scene, &textures, &camera());
            let mut recorded: Vec<(u16, u16)> =
                recording.samples.iter().map(|s| (s.y, s.x)).collect();
            recorded.sort_unstable();
            recorded.dedup();
            let covered: Vec<(u16, u16)> = (0..camera().height as u16)
                .flat_map(|y| (0..camera().width as u16).map(move |x| (y, x)))
                .filter(|(y, x)| seen.objects[((*x).into(), (*y).into())] == 0)
                .collect();
            prop_assert_eq!(recorded, covered);
        }
    }

    #[test]
    fn front_faces_hide_back_faces_in_the_same_texel() {
        let back = [[2.0, -2.0, -1.1], [-2.0, -2.0, -1.1], [0.0, 3.0, -1.1]];
        let front = [[-6.0, -6.0, -1.2], [6.0, -6.0, -1.2], [0.0, 9.0, -1.2]];
        let scene = soup(&[back, front].concat());
        let recording = record(
            &scene,
            &Textures::new(&scene),
            &camera(),
            &BORDERS,
            &EVERYWHERE,
            Foliage::Any,
        );
        assert!(
            recording
                .samples
                .iter()
                .all(|s| s.hit.triangle == 1 && s.occludes)
        );
        let scene = soup(&back);
        let recording = record(
            &scene,
            &Textures::new(&scene),
            &camera(),
            &BORDERS,
            &EVERYWHERE,
            Foliage::Any,
        );
        assert!(!recording.samples.is_empty());
        assert!(recording.samples.iter().all(|s| !s.occludes));
    }

    #[test]
    fn faces_that_no_viewpoint_sees_are_left_out() {
        let scene = soup(&[[2.0, -2.0, -1.1], [-2.0, -2.0, -1.1], [0.0, 3.0, -1.1]]);
        let count = |cell: &[DVec4]| {
            record(
                &scene,
                &Textures::new(&scene),
                &camera(),
                &BORDERS,
                cell,
                Foliage::Any,
            )
            .samples
            .len()
        };
        assert_eq!(
            count(&[
                DVec4::new(0.0, 0.0, 0.0, 1.0),
                DVec4::new(5.0, 3.0, -1.0, 1.0)
            ]),
            0
        );
        assert!(
            count(&[
                DVec4::new(0.0, 0.0, 0.0, 1.0),
                DVec4::new(5.0, 3.0, -1.2, 1.0)
            ]) > 0
        );
        // A corner at infinity sees what faces its direction.
        assert_eq!(count(&[DVec4::new(0.3, 0.0, 1.0, 0.0)]), 0);
        assert!(count(&[DVec4::new(0.3, 0.0, -1.0, 0.0)]) > 0);
    }

    #[test]
    fn a_masked_texel_is_set_as_far_as_alpha_reaches_into_it() {
        // Alpha falls along x from 1 at -1.2 to 0 at 1.2: the cutoff is reached left of the
        // middle, and every texel counts that it is reached in.
        let mut scene = double_sided(&[[-6.0, -6.0, -1.2], [6.0, -6.0, -1.2], [0.0, 6.0, -1.2]]);
        for (color, x) in scene.colors.iter_mut().zip([-6.0, 6.0, 0.0]) {
            *color = Vec4::new(1.0, 1.0, 1.0, 0.5 - x / 2.4);
        }
        let columns = |scene: &Scene| {
            let recording = record(
                scene,
                &Textures::new(scene),
                &camera(),
                &BORDERS,
                &EVERYWHERE,
                Foliage::Any,
            );
            recording.samples.iter().map(|s| s.x).max().unwrap()
        };
        assert_eq!(columns(&scene), 11);
        scene.materials[0].alpha = AlphaMode::Mask { cutoff: 0.501 };
        // x = 0 lies on the border between columns 5 and 6.
        assert_eq!(columns(&scene), 5);
        scene.materials[0].alpha = AlphaMode::Mask { cutoff: 0.475 };
        // Reached up to x = 0.06, 0.3 texels into column 6: not up to its middle.
        assert_eq!(columns(&scene), 6);
    }
}
