//! Pictures for textures: averaged over many samples a texel.

use crate::picture::{render, srgb_bytes};
use farfield_grid::Grid;
use farfield_sampling::{NONE, Textures};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::Vec3;

/// Samples a texel along each side.
const SAMPLES: u32 = 4;

/// How far colours and depths are spread into texels where nothing is, so that interpolation at
/// silhouettes meets no colour or depth of nothing.
const SPREAD: usize = 16;

/// Texels of a picture.
pub(crate) struct Capture {
    /// sRGB and straight alpha: the share of the samples that see something.
    pub(crate) texels: Grid<[u8; 4]>,
    /// The mean depth of these samples; not a number far from all that is seen.
    pub(crate) depth: Grid<f64>,
}

/// What a texel has gathered: a sum of linear RGB and depth, and of how many samples.
#[derive(Clone, Copy)]
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
    let nothing = Gathered {
        color: Vec3::ZERO,
        depth: 0.0,
        count: 0,
    };
    let mut gathered = Grid::filled(width, height, nothing);
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
    for _ in 0..SPREAD {
        gathered = spread(&gathered);
    }
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

/// Texels without samples get those of their eight neighbours.
fn spread(gathered: &Grid<Gathered>) -> Grid<Gathered> {
    let (width, height) = (gathered.width(), gathered.height());
    let mut wider = gathered.clone();
    for y in 0..height {
        for x in 0..width {
            if gathered[(x, y)].count > 0 {
                continue;
            }
            let texel = &mut wider[(x, y)];
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for near in &gathered.row(y)[x.saturating_sub(1)..(x + 2).min(width)] {
                    texel.color += near.color;
                    texel.depth += near.depth;
                    texel.count += near.count;
                }
            }
        }
    }
    wider
}
