//! Gap pixels, looked at closely.

use super::subject::Subject;
use super::view::{farthest_sampled, in_tiles};
use farfield_grid::Grid;
use farfield_metrics::gap_pixels;
use farfield_views::Camera;

/// The pixels at which one looks through the impostor although the original covers their whole
/// neighbourhood: not only its nine centres, but 4 x 4 samples of each of its pixels.
///
/// A slit of the original that lies between the centres of two pixels may lie on one of them in the
/// impostor, which shows it where it is to within a pixel, and perhaps narrower. What is seen
/// through it is what the original shows beside that centre: no gap. A slit so narrow that it lies
/// between the samples too is taken for none.
///
/// * `original`, `impostor` - the layers that the camera sees at the centres of its pixels
pub(super) fn gaps(
    subject: &Subject<'_>,
    camera: &Camera,
    original: &Grid<u32>,
    impostor: &Grid<u32>,
) -> Vec<[u32; 2]> {
    let suspects = gap_pixels(original, impostor, subject.slack());
    in_tiles(camera, suspects, 1, |[columns, rows], suspects| {
        let window = camera.window(&columns, &rows);
        let mut farthest = farthest_sampled(subject, &window);
        // What is no suspect shows what cannot be a gap.
        let mut seen = Grid::filled(farthest.width(), farthest.height(), 0);
        for y in 0..farthest.height() {
            let original = &original.row(rows.start as usize + y)[columns.start as usize..];
            let farthest = farthest.row_mut(y).iter_mut();
            farthest.zip(original).for_each(|(f, o)| *f = (*f).max(*o));
        }
        for [x, y] in suspects {
            let at = ((x - columns.start) as usize, (y - rows.start) as usize);
            seen[at] = impostor[(*x as usize, *y as usize)];
        }
        gap_pixels(&farthest, &seen, subject.slack())
    })
}
