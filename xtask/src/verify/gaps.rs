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
    let found = in_tiles(camera, suspects, 1, |[columns, rows], suspects| {
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
    });
    if std::env::var_os("DBG").is_some() {
        for [x, y] in &found {
            let n: Vec<u32> = (0..9).map(|i| original[(*x as usize + i % 3 - 1, *y as usize + i / 3 - 1)]).collect();
            let m: Vec<i64> = (0..9).map(|i| impostor[(*x as usize + i % 3 - 1, *y as usize + i / 3 - 1)] as i32 as i64).collect();
            let seen = super::view::shown_by(&subject.original, camera).seen;
            let depth = seen.depth[(*x as usize, *y as usize)];
            let at = camera.view_from_pixel(glam::DVec2::new(f64::from(*x) + 0.5, f64::from(*y) + 0.5), depth);
            let world = camera.pose.point_in_world(at);
            let proj = crate::voxels::Projection::of(&subject.stack);
            let d = if let super::subject::Shape::Mesh(m) = &subject.shape { m.nearest(world).map(|p| proj.place(p) - proj.place(world)) } else { None };
            eprintln!("gap {x} {y} orig {n:?} imp {m:?} world {world:.3} grid {:.2} step {:.2} nearest {d:.2?}", proj.place(world), proj.place(world) - proj.place(world - (world - camera.pose.eye) * 0.01));
        }
    }
    found
}
