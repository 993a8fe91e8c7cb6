//! Several impostors amid a scene, seen together: whether one sees through where they meet.

use super::promise::Measured;
use super::report::VerifyReport;
use super::subject::Side;
use super::view::{finer, in_tiles};
use crate::console::Console;
use farfield_bundle::ViewSpace;
use farfield_grid::Grid;
use farfield_layers::PromisedCamera;
use farfield_metrics::gap_pixels;
use farfield_sampling::{NONE, rasterize};
use farfield_views::{Camera, ViewCell, lattice_viewpoints};
use glam::DVec3;
use rayon::prelude::*;

/// What is seen along the borders between the impostors of a bundle.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Seams {
    /// Cameras that look along a border.
    pub views: u64,
    /// Pixels at which one sees through all impostors though the original covers their whole
    /// neighbourhood.
    pub gap_pixels: u64,
    /// From where the first of them is seen, in metres.
    pub first_from: Option<DVec3>,
    /// The first few of them in that picture: column and row.
    pub first_pixels: Vec<[u32; 2]>,
}

/// Looks along all borders between the sides of a cell amid a scene, once from each corner, edge and
/// face centre of the cell to each border; `None` where there are no borders.
///
/// What is near the cell is left out of both, as what it hides could be seen with a little of it
/// missing.
///
/// * `sides` - the original and all impostors
/// * `lens` - the promised camera
pub(super) fn seams(
    space: &ViewSpace,
    sides: &[Side<'_>; 2],
    lens: &PromisedCamera,
    console: &Console,
) -> Option<Seams> {
    let ViewSpace::Amid {
        view_cell: cell @ ViewCell::Box { center, size },
        distance,
        ..
    } = space
    else {
        return None;
    };
    let targets = borders().map(|border| *center + border * (*size / 2.0 + *distance));
    let eyes = (0..lattice_viewpoints().len() as u64).map(|i| cell.viewpoint(i, 0));
    // Neighbouring borders from neighbouring places would show the same.
    let pairs = eyes.flat_map(|eye| targets.clone().map(move |target| (eye, target)));
    let cameras: Vec<Camera> = pairs
        .step_by(STRIDE)
        // Where nothing is near, borders begin at edges of the cell.
        .filter(|(eye, target)| (target - eye).try_normalize().is_some())
        .map(|(eye, target)| Camera::looking_at(eye, target, lens.fov, lens.resolution))
        .collect();
    let bar = console.bar("look along seams", cameras.len() as u64);
    let found: Vec<_> = cameras
        .par_iter()
        .map(|camera| {
            let holes = holes(sides, camera);
            bar.inc(1);
            holes
        })
        .collect();
    bar.finish_and_clear();
    let first = found.iter().position(|holes| !holes.is_empty());
    Some(Seams {
        views: cameras.len() as u64,
        gap_pixels: found.iter().map(|holes| holes.len() as u64).sum(),
        first_from: first.map(|i| cameras[i].pose.eye),
        first_pixels: first.map_or(Vec::new(), |i| found[i].iter().take(4).copied().collect()),
    })
}

/// Every which of the pairs of places and borders is looked at: 74 of 520, all borders and all places
/// among them.
const STRIDE: usize = 7;

/// Towards the twelve edges and eight corners of a cube.
fn borders() -> impl Iterator<Item = DVec3> + Clone {
    let signs = |i: i32| DVec3::new((i % 3).into(), (i / 3 % 3).into(), (i / 9).into()) - 1.0;
    (0..27)
        .map(signs)
        .filter(|border| border.abs().element_sum() >= 2.0)
}

/// The pixels at which nothing of the impostors is seen, and the original in all samples of their
/// neighbourhood.
fn holes([original, impostors]: &[Side<'_>; 2], camera: &Camera) -> Vec<[u32; 2]> {
    let [before, after] =
        [original, impostors].map(|side| rasterize(side.scene, side.textures, camera).objects);
    let suspects = gap_pixels(&flat(&before, 1), &flat(&after, 1), 1);
    in_tiles(camera, suspects, 1, |[columns, rows], suspects| {
        let (samples, window) = finer(&camera.window(&columns, &rows));
        let covered = rasterize(original.scene, original.textures, &window).objects;
        let covered = flat(&covered, samples as usize);
        let mut seen = Grid::filled(covered.width(), covered.height(), 0);
        for [x, y] in suspects {
            seen[((x - columns.start) as usize, (y - rows.start) as usize)] = NONE;
        }
        gap_pixels(&covered, &seen, 1)
    })
}

/// 0 where all of `samples` x `samples` cells show something, else [`NONE`].
fn flat(ids: &Grid<u32>, samples: usize) -> Grid<u32> {
    let mut flat = Grid::filled(ids.width() / samples, ids.height() / samples, 0);
    for y in 0..ids.height() {
        for (x, id) in ids.row(y).iter().enumerate() {
            if *id == NONE {
                flat[(x / samples, y / samples)] = NONE;
            }
        }
    }
    flat
}

/// The figure beside others; nothing where no impostors meet.
pub(super) fn measured(report: &VerifyReport) -> Option<Measured> {
    let seams = report.seams.as_ref()?;
    let places = seams.first_from.map_or(String::new(), |eye| {
        let pixels = seams
            .first_pixels
            .iter()
            .map(|[x, y]| format!("({x}, {y})"));
        let pixels: Vec<_> = pixels.collect();
        format!("first from {eye} at {}", pixels.join(", "))
    });
    Some(Measured {
        name: "gap pixels at seams",
        figure: seams.gap_pixels as f64,
        words: |n| format!("{n:.0}"),
        is_wrong: false,
        pixels: None,
        what: format!("{} gap pixels where impostors meet", seams.gap_pixels),
        places,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All borders are looked at, and from all places.
    #[test]
    fn the_stride_leaves_no_border_out() {
        let borders = borders().count();
        assert_eq!(borders, 20);
        let places = lattice_viewpoints().len();
        let looked: Vec<usize> = (0..borders * places).step_by(STRIDE).collect();
        for border in 0..borders {
            assert!(looked.iter().any(|pair| pair % borders == border));
        }
        for place in 0..places {
            assert!(looked.iter().any(|pair| pair / borders == place));
        }
    }
}
