//! Stray colours, looked at closely.

use super::subject::Subject;
use super::view::{finer, in_tiles, shown_by};
use farfield_metrics::{Picture, StrayColors, is_within, stray_colors};
use farfield_views::Camera;
use std::ops::Range;

/// By how many levels of 255 a colour may lie outside of what the original shows around it: what
/// filtering and shading of texels that lie elsewhere adds. With half of it a hundredth of a town's
/// pixels are strays, though hardly any nine together.
const TOLERANCE: u8 = 16;

/// The pixels amidst colours that the original does not show near them, not even in 4 x 4 samples of
/// each of the 5 x 5 pixels around: what is thin lies between the centres of the original's pixels,
/// and is up to a texel wider in the impostor.
pub(super) fn strays(
    subject: &Subject<'_>,
    camera: &Camera,
    original: Picture<'_>,
    impostor: Picture<'_>,
) -> StrayColors {
    let found = stray_colors(original, impostor, TOLERANCE);
    let look = |[columns, rows]: [Range<u32>; 2], suspects: &[[u32; 2]]| {
        let (samples, window) = finer(&camera.window(&columns, &rows));
        let shown = shown_by(&subject.original, &window).colors;
        let is_stray = |[x, y]: &[u32; 2]| {
            let around = |at: u32, start: u32| {
                let first = (at - start - 2) * samples;
                first as usize..(first + 5 * samples) as usize
            };
            let part = [around(*x, columns.start), around(*y, rows.start)];
            let color = impostor.colors[(*x as usize, *y as usize)];
            !is_within(&shown, part, color, TOLERANCE)
        };
        let strays = suspects.iter().filter(|at| is_stray(at));
        strays
            .map(|[x, y]| [x - columns.start, y - rows.start])
            .collect()
    };
    StrayColors {
        interior: found.interior,
        stray: in_tiles(camera, found.stray, 2, look),
    }
}
