//! Textured depth meshes beside layered impostors.

use farfield_layers::{Aim, PromisedCamera, box_corners};
use farfield_sampling::{Foliage, Textures};
use farfield_tdm::{VoxelLayers, initial_mesh, simplify};
use farfield_views::ViewCell;
use glam::DVec3;
use std::time::Instant;
use xtask::Channels;
use xtask::recording::{Settings, place, reached, record_layers, visible};

pub(crate) fn tables() {
    let scene = farfield_town::house(0);
    let [min, max] = scene.bounds().unwrap();
    println!("{min} {max} {} tris", scene.drawn_triangles());
    for distance in [90.0, 110.0, 140.0, 180.0, 250.0, 500.0, 1000.0] {
        let cell = ViewCell::Box {
            center: DVec3::new((min.x+max.x)/2.0, 50.0, max.z + distance + 50.0),
            size: DVec3::splat(100.0),
        };
        let settings = Settings {
            cell,
            hull: box_corners(scene.bounds().expect("the scene has triangles")),
            camera: PromisedCamera {
                aim: Aim::Center,
                fov: 45f64.to_radians(),
                resolution: 512,
            },
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
        };
        let stack = place(&scene, &settings).expect("the cell lies before the scene");
        let recording = record_layers(&scene, &Textures::new(&scene), &stack, &cell, Foliage::Any);
        let mut recording = recording;
        if std::env::var_os("CLOSED").is_some() { recording.samples.iter_mut().for_each(|s| s.occludes = true); }
        let reached = reached(&recording, stack.width, stack.height);
        let visible = visible(&recording, &reached);
        let layers: Vec<Vec<[u16; 2]>> = visible.layers.iter().map(|run| visible.samples[run.clone()].iter().map(|s| [s.x, s.y]).collect()).collect();
        let b = stack.borders();
        let n = (b.len() - 1) as f64;
        let k = n / (1.0/b[0] - 1.0/b[b.len()-1]).max(1e-12);
        let borders: Vec<f32> = b.iter().map(|d| (k * (1.0/b[0] - 1.0/d)) as f32).collect();
        let th: Vec<f32> = borders.windows(2).map(|w| w[1]-w[0]).collect();
        println!("thickness {:?}..{:?}", th.iter().copied().fold(9.0, f32::min), th.iter().copied().fold(0.0, f32::max));
        let voxels = VoxelLayers { width: stack.width, height: stack.height, layers: &layers, reached: &reached, borders: &borders };
        let t = Instant::now();
        let camera = xtask::recording::recording_camera(&stack);
        let mut points: Vec<glam::Vec3> = visible.samples.iter().map(|s| {
            let p = stack.pose.point_in_view(s.hit.point_in_world(&scene));
            let px = camera.pixel_from_view(p);
            glam::Vec3::new(px.x as f32, px.y as f32, (k * (1.0/b[0] - 1.0/p.z)) as f32)
        }).collect();
        if std::env::var_os("CENTERS").is_some() { points = voxels.boxes(1.0).iter().map(|b| b.center).collect(); }
        for (p, b) in points.iter().zip(voxels.boxes(1.0)) {
            let d = ((*p - b.center).abs() - b.half).max_element();
            if d > 0.01 { println!("off {d} {p} {}", b.center); break; }
        }
        if std::env::var_os("LEAK").is_some() && distance == 140.0 {
            // an interior floor voxel: y world about 4.45, |x| < 3, z about -5
            let world = |x: f64, y: f64, l: usize| { let d = stack.layers[l].depth; let v = camera.view_from_pixel(glam::DVec2::new(x, y), d); stack.pose.point_in_world(v) };
            let mut at = None;
            for (l, run) in visible.layers.iter().enumerate() {
                for s in &visible.samples[run.clone()] {
                    let p = s.hit.point_in_world(&scene);
                    if p.x.abs() < 3.0 && p.y > 1.0 && p.y < 12.0 && p.z < 0.0 && at.is_none() { at = Some((s.x as usize, s.y as usize, l)); println!("floor voxel {p}"); }
                }
            }
            let occ: Vec<_> = (0..stack.layers.len()).map(|l| recording.masks(l, stack.width, stack.height).occluding).collect();
            let at = at.unwrap();
            for (sx, sy) in [(1i64, 1i64), (-1, 1), (1, -1), (-1, -1)] {
                // lit of this quadrant, brute force
                let (w, h) = (stack.width as i64, stack.height as i64);
                let mut lit: Vec<Vec<bool>> = vec![vec![true; (w*h) as usize]];
                for l in 1..=at.2 {
                    let prev = &lit[l-1];
                    let free = |x: i64, y: i64| x < 0 || y < 0 || x >= w || y >= h || (prev[(x + y*w) as usize] && !occ[l-1].contains(x as usize, y as usize));
                    let next = (0..w*h).map(|i| { let (x, y) = (i % w, i / w); free(x,y)||free(x-sx,y)||free(x,y-sy)||free(x-sx,y-sy) }).collect();
                    lit.push(next);
                }
                let (mut x, mut y) = (at.0 as i64, at.1 as i64);
                println!("quadrant {sx} {sy} lit {}", lit[at.2][(x+y*w) as usize]);
                if !lit[at.2][(x+y*w) as usize] { continue; }
                for l in (0..at.2).rev() {
                    let free = |x: i64, y: i64| x < 0 || y < 0 || x >= w || y >= h || (lit[l][(x + y*w) as usize] && !occ[l].contains(x as usize, y as usize));
                    let o = [(x,y),(x-sx,y),(x,y-sy),(x-sx,y-sy)].into_iter().find(|(a,b)| free(*a,*b)).unwrap();
                    (x, y) = o;
                    println!("  layer {l} cell {x} {y} world {:.2}", world(x as f64 + 0.5, y as f64 + 0.5, l));
                    if x < 0 || y < 0 || x >= w || y >= h { break; }
                }
            }
        }
        let mut mm = Vec::new();
        for l in 0..stack.layers.len() { mm.push(visible.masks(l, stack.width, stack.height).opaque); }
        for bytes in [104.0, 1000.0, 4000.0] {
            let rects: Vec<_> = mm.iter().flat_map(|m| farfield_quads::cover(m, &farfield_quads::Price { bytes_per_quad: bytes, ..Default::default() })).collect();
            let texels: u32 = rects.iter().map(|r| (r.width+2)*(r.height+2)).sum();
            println!("layered {bytes}: tris {} kB {}", rects.len()*2, texels*4/1000 + rects.len() as u32 * 104 / 1000);
        }
        let mesh = initial_mesh(&voxels, &points, 1.5);
        let t1 = t.elapsed();

        for e in [1.0, 1.5, 2.0] {
        let t = Instant::now();
        let found = simplify(&mesh, &voxels, e);
        if std::env::var_os("OBJ").is_some() && e == 1.5 {
            use std::fmt::Write;
            let mut o = String::new();
            for (what, mesh) in [("initial", &mesh), ("final", &found.mesh)] {
            o.clear();
            for p in &mesh.positions { writeln!(o, "v {} {} {}", p.x, p.y, p.z).unwrap(); }
            for t in &mesh.triangles { writeln!(o, "f {} {} {}", t[0]+1, t[1]+1, t[2]+1).unwrap(); }
            std::fs::write(format!("/tmp/lead/tdm-{distance}-{what}.obj"), &o).unwrap();
            }
        }
        println!("{distance} layers {n} size {}x{} voxels {} initial {} ({:.2?}) e {e} final {} ({:.2?}) contracted {} refused {}", stack.width, stack.height, visible.samples.len(), mesh.triangles.len(), t1, found.mesh.triangles.len(), t.elapsed(), found.contracted, found.refused);
        }
    }
}
