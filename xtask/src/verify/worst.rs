//! Pictures of the worst views.

use super::subject::Subject;
use super::view::{Pictures, ViewFigures, show};
use crate::pictures::{marked, png};
use farfield_grid::{BitMask, Grid};
use farfield_metrics::compared_region;

/// PNG files of one view.
pub(super) struct ViewPictures {
    pub(super) view: u64,
    pub(super) original: Vec<u8>,
    pub(super) impostor: Vec<u8>,
    pub(super) difference: Vec<u8>,
    pub(super) marked: Vec<u8>,
}

const GAP: [u8; 3] = [255, 32, 32];
const PHANTOM: [u8; 3] = [0, 176, 255];
const BACK: [u8; 3] = [0, 200, 120];
const STRAY: [u8; 3] = [200, 80, 255];
const DISPLACED: [u8; 3] = [255, 200, 0];

/// Renders a view again: original, impostor, their difference, and gaps (red), phantoms (blue),
/// backs (green), displaced points (yellow) and stray colours (violet) marked.
pub(super) fn picture(subject: &Subject<'_>, view: &ViewFigures) -> ViewPictures {
    let Pictures { original, impostor } = show(subject, &view.camera);
    let region = compared_region(&original.seen.objects, &impostor.seen.objects);
    let geometry = &view.geometry;
    let all = [
        (&view.stray.stray, STRAY),
        (&geometry.parallax.above, DISPLACED),
        (&geometry.from_behind, BACK),
        (&geometry.backs, BACK),
        (&geometry.phantoms, PHANTOM),
        (&geometry.gaps, GAP),
    ];
    let marks = all
        .into_iter()
        .flat_map(|(pixels, color)| pixels.iter().map(move |at| (*at, color)));
    ViewPictures {
        view: view.view,
        original: png(&original.colors),
        impostor: png(&impostor.colors),
        difference: png(&errors(&original.colors, &impostor.colors, &region)),
        marked: png(&marked(&impostor.colors, marks)),
    }
}

/// FLIP errors, from black over violet and orange to white.
#[cfg(feature = "flip")]
fn errors(a: &Grid<[u8; 3]>, b: &Grid<[u8; 3]>, region: &BitMask) -> Grid<[u8; 3]> {
    let found = farfield_metrics::flip_errors(a, b, region);
    let mut errors = Grid::filled(a.width(), a.height(), [0; 3]);
    let (left, top) = (found.bounds.x as usize, found.bounds.y as usize);
    for y in 0..found.map.height() {
        for (x, error) in found.map.row(y).iter().enumerate() {
            if region.contains(left + x, top + y) {
                let color = colorous::INFERNO.eval_continuous(f64::from(*error).clamp(0.0, 1.0));
                errors[(left + x, top + y)] = color.into_array();
            }
        }
    }
    errors
}

/// Absolute differences.
#[cfg(not(feature = "flip"))]
fn errors(a: &Grid<[u8; 3]>, b: &Grid<[u8; 3]>, _: &BitMask) -> Grid<[u8; 3]> {
    crate::pictures::difference(a, b)
}

/// Names and contents of a view's files.
pub(super) fn files(pictures: &ViewPictures) -> impl Iterator<Item = (String, &[u8])> {
    [
        ("original", &pictures.original),
        ("impostor", &pictures.impostor),
        ("difference", &pictures.difference),
        ("marked", &pictures.marked),
    ]
    .into_iter()
    .map(|(what, png)| (format!("view-{:04}-{what}.png", pictures.view), &png[..]))
}
