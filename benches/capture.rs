//! Pictures for textures: averaged over many samples a texel.

use crate::picture::{render, srgb_bytes};
use farfield_grid::Grid;
use farfield_sampling::{NONE, Textures};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::Vec3;

/// Samples a texel along each side.
const SAMPLES: u32 = 4;

/// Texels of a picture.
pub(crate) struct Capture {
    /// sRGB and straight alpha: the share of the samples that see something.
    pub(crate) texels: Grid<[u8; 4]>,
    /// The mean depth of these samples, where there are none that of near ones; not a number where
    /// nothing is seen at all.
    pub(crate) depth: Grid<f64>,
}

/// What a texel has gathered: a sum of linear RGB and depth, and of how many samples.
#[derive(Clone, Copy, Default)]
struct Gathered {
    color: Vec3,
    depth: f64,
    count: u32,
}

/// What the pixels of a camera see, as texels.
pub(crate) fn capture(scene: &Scene, textures: &Textures<'_>, camera: &Camera) -> Capture {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let fine = Camera {
        width: camera.width * SAMPLES,
        height: camera.height * SAMPLES,
        ..*camera
    };
    let picture = render(scene, textures, &fine);
    let mut gathered = Grid::filled(width, height, Gathered::default());
    for y in 0..picture.ids.height() {
        for x in 0..picture.ids.width() {
            if picture.ids[(x, y)] != NONE {
                let texel = &mut gathered[(x / SAMPLES as usize, y / SAMPLES as usize)];
                texel.color += picture.color[(x, y)];
                texel.depth += picture.depth[(x, y)];
                texel.count += 1;
            }
        }
    }
    let alphas: Vec<u8> = gathered
        .cells()
        .iter()
        .map(|texel| (texel.count * 255 / (SAMPLES * SAMPLES)) as u8)
        .collect();
    fill(&mut gathered);
    let texel = |(texel, alpha): (&Gathered, u8)| {
        let [r, g, b] = srgb_bytes(texel.color / texel.count.max(1) as f32);
        [r, g, b, alpha]
    };
    let cells = gathered.cells();
    Capture {
        texels: Grid::from_cells(width, height, cells.iter().zip(alphas).map(texel).collect()),
        depth: Grid::from_cells(
            width,
            height,
            cells
                .iter()
                .map(|texel| texel.depth / f64::from(texel.count))
                .collect(),
        ),
    }
}

/// Texels without samples get those of the smallest square around them that has some, so that
/// interpolation at silhouettes meets no colour or depth of nothing.
fn fill(gathered: &mut Grid<Gathered>) {
    let (width, height) = (gathered.width(), gathered.height());
    if width.max(height) == 1 {
        return;
    }
    let mut coarse = Grid::filled(width.div_ceil(2), height.div_ceil(2), Gathered::default());
    for y in 0..height {
        for x in 0..width {
            let (texel, sum) = (gathered[(x, y)], &mut coarse[(x / 2, y / 2)]);
            sum.color += texel.color;
            sum.depth += texel.depth;
            sum.count += texel.count;
        }
    }
    fill(&mut coarse);
    for y in 0..height {
        for x in 0..width {
            if gathered[(x, y)].count == 0 {
                gathered[(x, y)] = coarse[(x / 2, y / 2)];
            }
        }
    }
}
