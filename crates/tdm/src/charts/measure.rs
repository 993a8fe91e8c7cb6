use super::*;
use crate::{VoxelLayers, initial_mesh, simplify};
use std::time::Instant;

pub(crate) fn layers_of(side: u16, depth: impl Fn(i32, i32) -> Option<i32>) -> Vec<Vec<[u16; 2]>> {
    let mut layers = vec![Vec::new(); 4 * usize::from(side)];
    let s = i32::from(side);
    let get = |x: i32, y: i32| if x < 0 || y < 0 || x >= s || y >= s { None } else { depth(x, y) };
    for y in 0..s {
        for x in 0..s {
            if let Some(d) = depth(x, y) {
                let far = [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().filter_map(|(i, j)| get(x + i, y + j)).max().unwrap_or(d);
                for l in d..=(far - 1).clamp(d, d + 8) {
                    layers[l as usize].push([x as u16, y as u16]);
                }
                if far > d { layers[far.min(d + 9) as usize].push([x as u16, y as u16]); }
            }
        }
    }
    layers.iter_mut().for_each(|l| { l.sort_by_key(|[x, y]| (*y, *x)); l.dedup(); });
    layers
}

fn report(name: &str, positions: &[Vec3], triangles: &[[u32; 3]]) {
    for gutter in [1u32, 2, 4] {
        let start = Instant::now();
        let densities = vec![1.0; triangles.len()];
        let found = charts(positions, triangles, &densities, gutter);
        let took = start.elapsed();
        let area: u64 = found.iter().map(|c| u64::from(c.width) * u64::from(c.height)).sum();
        let real: f32 = triangles.iter().map(|t| { let [a, b, c] = t.map(|v| positions[v as usize]); (b - a).cross(c - a).length() / 2.0 }).sum();
        let inside: f32 = found.iter().flat_map(|c| &c.corners).map(|[a, b, c]| -(b - a).perp_dot(c - a) / 2.0).sum();
        let g = gutter as f32;
        let lone: f32 = 0.0 * g;
        let start = Instant::now();
        let texels: usize = found.iter().map(|c| c.texels(gutter).len()).sum();
        println!("{name:28} g{gutter} {:7} tri {:6} charts {area:8} texels = {:.3} of area, filled {:.3}, used {:.3}, {:.2} s, texels {:.2} s {lone}",
            triangles.len(), found.len(), area as f32 / real, inside / area as f32, texels as f32 / area as f32, took.as_secs_f32(), start.elapsed().as_secs_f32());
    }
}

fn both(name: &str, side: u16, depth: impl Fn(i32, i32) -> Option<i32>, simple: bool) {
    let layers = layers_of(side, depth);
    let voxels = VoxelLayers { width: side.into(), height: side.into(), layers: &layers };
    let mesh = initial_mesh(&voxels);
    report(&format!("{name} initial"), &mesh.positions, &mesh.triangles);
    if simple {
        let mesh = simplify(&mesh, &voxels.centers(), 1.5).mesh;
        report(&format!("{name} simplified"), &mesh.positions, &mesh.triangles);
    }
}

fn noise(x: i32, y: i32) -> i32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B9) ^ (y as u32).wrapping_mul(0x85EB_CA6B);
    h ^= h >> 15; h = h.wrapping_mul(0x2C1B_3C6D); h ^= h >> 12; h = h.wrapping_mul(0x297A_2D39); h ^= h >> 15;
    (h & 0xff) as i32
}

#[test]
#[ignore]
fn measure() {
    both("slope", 96, |x, _| Some(x), true);
    let house = |side: i32| move |x: i32, y: i32| {
        let base = (x - side / 3).abs() / 2;
        let window = x % 12 > 7 && y % 12 > 5 && y > side / 3;
        let roof = (side / 3 - y).max(0);
        (x > side / 10 && x < side - side / 10 && y > side / 10).then_some(base + roof + if window { 2 } else { 0 })
    };
    both("house", 96, house(96), true);
    both("ball", 96, |x, y| { let r = 45.0f32; let d = r * r - ((x - 48).pow(2) + (y - 48).pow(2)) as f32; (d > 0.0).then(|| (46.0 - d.sqrt()) as i32) }, true);
    both("noise2", 64, |x, y| Some(noise(x, y) % 3), true);
    both("noise8", 64, |x, y| (noise(x, y) < 200).then_some(noise(x / 2, y / 2) % 9), true);
    both("slope-large", 200, |x, y| Some((x + y) / 2), false);
    both("house-large", 250, house(250), false);
    both("noise-large", 120, |x, y| Some(noise(x, y) % 6), false);
}
