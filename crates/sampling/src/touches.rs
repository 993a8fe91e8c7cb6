//! Recording where it is known beforehand what may touch what.

use crate::Textures;
use crate::geometry::{Drawn, Interpolation, corners_in_view};
use crate::masked::Masked;
use crate::piece::{Piece, Viewpoint};
use crate::record::{
    BAND, Band, Beside, Foliage, Recording, Task, center_of, claim_over_center, stacked,
};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::DVec4;
use rayon::prelude::*;

/// A triangle that may touch a texel of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Touch {
    /// Index into the scene's objects.
    pub object: u32,
    /// Index into the scene's triangles, of the object's mesh.
    pub triangle: u32,
    /// From the front.
    pub layer: u32,
    /// Row.
    pub y: u16,
    /// Column.
    pub x: u16,
}

/// What [`record`](crate::record()) records, found by looking at nothing but some triples of triangle,
/// layer and texel, given in any order and perhaps more than once.
///
/// It is the same to the last bit if each triple that is missing is
/// - of a triangle that does not touch the texel in that layer, or is not seen from the cell, or
/// - of one that another triple beats: an opaque front face over the texel's centre is nearer there, or,
///   where no masked triangle touches the texel in that layer, an opaque one is better by class or
///   nearer to the centre.
///
/// So whoever finds the triples need not be exact, as long as nothing is left out in doubt: a GPU, say,
/// that computes with 24 bits.
///
/// * `touches` - what may touch what; those that do not are looked at in vain
///
/// The other arguments are those of [`record`](crate::record()). Bound by the triples.
///
/// # Panics
///
/// When there are fewer than two borders, a triple's object, triangle, layer or texel does not exist, or
/// its triangle does not lie before the camera.
pub fn record_touches(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    borders: &[f64],
    cell: &[DVec4],
    foliage: Foliage,
    touches: &[Touch],
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
    let mut bins = vec![Vec::new(); bands.len()];
    for touch in touches {
        let (x, y) = (u32::from(touch.x), u32::from(touch.y));
        assert!(
            x < camera.width && y < camera.height && touch.layer as usize + 1 < borders.len(),
            "there is no texel ({x}, {y}) of layer {}",
            touch.layer
        );
        bins[y as usize / BAND].push(*touch);
    }
    bands
        .par_iter_mut()
        .zip(bins)
        .for_each(|(band, touches)| record_band(&task, &cell, touches, band));
    stacked(bands, borders.len() - 1)
}

/// Records what touches some rows.
fn record_band(task: &Task<'_>, cell: &[Viewpoint], mut touches: Vec<Touch>, band: &mut Band) {
    // In the order in which triangles are drawn, and each cut to a layer once.
    touches.sort_unstable();
    touches.dedup();
    let of_triangles = touches.chunk_by(|a, b| (a.object, a.triangle) == (b.object, b.triangle));
    let pieces: Vec<(Piece, &[Touch])> = of_triangles
        .filter_map(|of_triangle| {
            let drawn = Drawn {
                object: of_triangle[0].object,
                triangle: of_triangle[0].triangle,
            };
            let corners = corners_in_view(task.scene, &task.camera.pose, drawn);
            let piece = Piece::new(task.scene, task.camera, task.borders, cell, drawn, corners)?;
            Some((piece, of_triangle))
        })
        .collect();
    for (piece, touches) in &pieces {
        if piece.may_cover_centers {
            touch_over_centers(task, piece, touches, band);
        }
    }
    for (piece, touches) in &pieces {
        touch_beside_centers(task, piece, touches, band);
    }
}

/// The touches of a piece by layer, those of layers that it does not cross left out.
fn by_layer<'a>(piece: &Piece, touches: &'a [Touch]) -> impl Iterator<Item = (usize, &'a [Touch])> {
    let layers = piece.layers();
    let of_layers = touches.chunk_by(|a, b| a.layer == b.layer);
    of_layers
        .map(|of_layer| (of_layer[0].layer as usize, of_layer))
        .filter(move |(layer, _)| layers.contains(layer))
}

fn touch_over_centers(task: &Task<'_>, piece: &Piece, touches: &[Touch], band: &mut Band) {
    let Some(inside) = Interpolation::new(task.camera, piece.corners) else {
        return;
    };
    let masked = Masked::new(task.scene, task.textures, piece.drawn);
    for (layer, touches) in by_layer(piece, touches) {
        band.part.cut(task, piece, layer);
        let outline = band.part.outline();
        let rows = outline.rows(task.camera.height as usize);
        for touch in touches {
            let (x, y) = (usize::from(touch.x), usize::from(touch.y));
            if rows.contains(&y) && outline.centers_in(y, band.width).contains(&x) {
                let claim = band.contest.claim_mut(layer, x, y - band.rows.start);
                claim_over_center(piece, &inside, masked.as_ref(), center_of(x, y), claim);
            }
        }
    }
}

fn touch_beside_centers(task: &Task<'_>, piece: &Piece, touches: &[Touch], band: &mut Band) {
    let masked = Masked::new(task.scene, task.textures, piece.drawn);
    if masked.is_some() && task.foliage == Foliage::Centre {
        return;
    }
    let mut beside = Beside::new(task, piece, masked.as_ref());
    for (layer, touches) in by_layer(piece, touches) {
        band.part.cut(task, piece, layer);
        let outline = band.part.outline();
        let rows = outline.rows(task.camera.height as usize);
        for touch in touches {
            let (x, y) = (usize::from(touch.x), usize::from(touch.y));
            if rows.contains(&y) && outline.columns(y, band.width).contains(&x) {
                let was_tried = beside.tried(&outline, y, band.width).contains(&x);
                let claim = band.contest.claim_mut(layer, x, y - band.rows.start);
                beside.claim(&band.part, &outline, center_of(x, y), was_tried, claim);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::soup;
    use crate::masked::tests::leaves;
    use crate::record;
    use farfield_views::{Extent, Pose};
    use glam::{DVec2, DVec3};
    use proptest::prelude::*;

    const BORDERS: [f64; 4] = [1.0, 1.5, 1.75, 3.0];

    /// A viewer before the triangles, and one beside them that sees some backs.
    const CELL: [DVec4; 2] = [
        DVec4::new(0.0, 0.0, 0.0, 1.0),
        DVec4::new(9.0, 0.0, -2.0, 1.0),
    ];

    fn camera() -> Camera {
        Camera {
            pose: Pose::looking_along(DVec3::ZERO, DVec3::NEG_Z),
            extent: Extent {
                min: DVec2::new(-1.0, -0.8),
                max: DVec2::new(1.0, 0.7),
            },
            width: 12,
            height: 21,
        }
    }

    fn points(count: usize) -> impl Strategy<Value = Vec<[f32; 3]>> {
        let point = (-1.0..1.0f32, -0.7..0.8f32, -3.0..-1.0f32);
        prop::collection::vec(point.prop_map(|(x, y, z)| [-x * z, -y * z, z]), count)
    }

    /// Opaque triangles, some of them of both sides, and a masked one.
    fn scenes() -> impl Strategy<Value = Scene> {
        let masked = points(3).prop_flat_map(|p| leaves([p[0], p[1], p[2]]));
        (points(18), points(3), masked).prop_map(|(opaque, others, masked)| {
            let mut scene = soup(&[opaque, others].concat());
            scene.materials.push(scene.materials[0].clone());
            scene.materials[1].double_sided = true;
            let half = scene.triangle_materials.len() / 2;
            scene.triangle_materials[half..].fill(1);
            scene.append(&masked);
            scene
        })
    }

    fn recorded(scene: &Scene, touches: Option<&[Touch]>, foliage: Foliage) -> Recording {
        let (textures, camera) = (Textures::new(scene), camera());
        match touches {
            None => record(scene, &textures, &camera, &BORDERS, &CELL, foliage),
            Some(touches) => {
                record_touches(scene, &textures, &camera, &BORDERS, &CELL, foliage, touches)
            }
        }
    }

    fn touches_of(recording: &Recording) -> Vec<Touch> {
        let layers = (0u32..).zip(&recording.layers);
        let of_layer = |(layer, run): (u32, &std::ops::Range<usize>)| {
            let samples = recording.samples[run.clone()].to_vec();
            samples.into_iter().map(move |sample| Touch {
                object: sample.hit.object,
                triangle: sample.hit.triangle,
                layer,
                y: sample.y,
                x: sample.x,
            })
        };
        layers.flat_map(of_layer).collect()
    }

    proptest! {
        /// If every triangle might touch every texel of every layer, in any order, all is recorded as
        /// without that knowledge.
        #[test]
        fn all_that_might_touch_is_recorded_as_ever(
            scene in scenes(),
            first in 0..1000usize,
            foliage in prop::sample::select(vec![Foliage::Any, Foliage::Centre]),
        ) {
            let mut touches = Vec::new();
            for object in 0..scene.objects.len() as u32 {
                for triangle in scene.mesh_of(object).triangles.clone() {
                    for (layer, y) in (0..3).flat_map(|layer| (0..21).map(move |y| (layer, y))) {
                        touches.extend((0..12).map(|x| Touch { object, triangle, layer, y, x }));
                    }
                }
            }
            touches.rotate_left(first);
            touches.push(touches[0]);
            let expected = recorded(&scene, None, foliage);
            prop_assert_eq!(recorded(&scene, Some(&touches), foliage), expected);
        }

        /// Of opaque triangles the winners suffice.
        #[test]
        fn winners_are_recorded_as_among_all(points in points(30)) {
            let scene = soup(&points);
            let expected = recorded(&scene, None, Foliage::Any);
            let touches = touches_of(&expected);
            prop_assert_eq!(recorded(&scene, Some(&touches), Foliage::Any), expected);
        }

        /// What no triple names is not recorded.
        #[test]
        fn nothing_else_is_recorded(scene in scenes(), kept in 0..50usize) {
            let touches = touches_of(&recorded(&scene, None, Foliage::Any));
            let some = &touches[..kept.min(touches.len())];
            let found = touches_of(&recorded(&scene, Some(some), Foliage::Any));
            prop_assert!(found.iter().all(|touch| some.contains(touch)));
        }
    }
}
