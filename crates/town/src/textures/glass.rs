//! Panes with the sky in them.

use crate::canvas::{Painting, along_and_distance, distance_to_rect, paint, smooth, srgb};
use crate::noise::fractal;
use glam::{Vec2, Vec3};

const FRAME: Vec3 = srgb(0xf2ecdf);

/// A window of two lights with a transom and glazing bars.
pub(crate) fn pane(seed: u32) -> Painting {
    paint("pane", 256, move |uv| {
        let transom = 0.3;
        let half = |center: Vec2, size: Vec2| distance_to_rect(uv, center, size);
        // Two tall lights and two small ones above; frame is what lies outside of all.
        let lights = [0.27, 0.73].map(|x| {
            let tall = half(Vec2::new(x, 0.645), Vec2::new(0.185, 0.305));
            let small = half(Vec2::new(x, 0.165), Vec2::new(0.185, 0.1));
            tall.min(small)
        });
        let outside = lights[0].min(lights[1]);
        let bar = match uv.y > transom {
            true => (uv.y - 0.645).abs().min(((uv.x - 0.5).abs() - 0.23).abs()),
            false => ((uv.x - 0.5).abs() - 0.23).abs(),
        };
        let wood = smooth(-0.006, 0.006, outside).max(1.0 - smooth(0.009, 0.017, bar));
        // The frame throws a shadow onto the glass.
        let recess = 0.6 + 0.4 * smooth(0.0, 0.05, -outside);
        sky(uv, seed)
            .lerp(Vec3::ZERO, 1.0 - recess)
            .lerp(frame(uv), wood)
    })
}

/// A half disc with spokes; the lower edge's middle is its centre.
pub(crate) fn fanlight(seed: u32) -> Painting {
    paint("fanlight", 256, move |uv| {
        let from_center = Vec2::new(2.0 * uv.x - 1.0, 1.0 - uv.y);
        let radius = from_center.length();
        let spokes = [[1.0, 0.0], [0.866, 0.5], [0.5, 0.866], [0.0, 1.0]];
        let to_spoke = spokes
            .map(|[x, y]| {
                let p = Vec2::new(from_center.x.abs(), from_center.y);
                along_and_distance(p, Vec2::ZERO, Vec2::new(x, y)).1
            })
            .into_iter()
            .fold(1.0, f32::min);
        let wood = (1.0 - smooth(0.02, 0.035, to_spoke))
            .max(smooth(0.88, 0.9, radius))
            .max(1.0 - smooth(0.3, 0.32, radius))
            .max(1.0 - smooth(0.015, 0.03, (radius - 0.62).abs()));
        sky(uv, seed + 9).lerp(frame(uv), wood)
    })
}

/// A bright sky mirrored above a dark room, with soft clouds and a slanting gleam.
fn sky(uv: Vec2, seed: u32) -> Vec3 {
    let cloud = fractal(uv, [3, 4], 3, seed + 1);
    let dark = srgb(0x23364a);
    let light = srgb(0x9cc3dc);
    let height = smooth(1.0, 0.05, uv.y + 0.35 * (cloud - 0.5));
    let slant = uv.x + 0.8 * uv.y;
    let gleam =
        smooth(0.12, 0.05, (slant - 0.62).abs()).max(smooth(0.04, 0.015, (slant - 0.84).abs()));
    dark.lerp(light, 0.15 + 0.6 * height)
        .lerp(srgb(0xe4f1f7), 0.28 * gleam)
}

fn frame(uv: Vec2) -> Vec3 {
    FRAME * (0.96 + 0.08 * (1.0 - uv.y) * fractal(uv, [4, 32], 2, 3))
}

/// A tall pointed window with leaded panes and tracery in a wall of pale stone.
pub(crate) fn church_window(seed: u32) -> Painting {
    paint("church window", 256, move |uv| {
        let p = Vec2::new((uv.x - 0.5).abs(), uv.y);
        // Two arcs around each other's feet make the pointed arch.
        let opening = |half: f32, spring: f32| match p.y > spring {
            true => (p.x - half).max(p.y - 0.95),
            false => Vec2::new(p.x + half, 0.55 * (p.y - spring)).length() - 2.0 * half,
        };
        let (outer, inner) = (opening(0.4, 0.42), opening(0.3, 0.45));
        let mullion = 0.018 - p.x.min((p.x - 0.16).abs());
        let lead = Vec2::new(p.x * 14.0 + uv.y * 22.0, p.x * 14.0 - uv.y * 22.0);
        let lead = lead.fract().abs().min_element();
        let glass = sky(uv, seed + 5) * 0.7 * (0.7 + 0.3 * smooth(0.05, 0.2, lead));
        let stone = srgb(0xd9cbab) * (0.92 + 0.16 * fractal(uv, [12, 12], 3, seed + 6));
        let shade = 0.75 + 0.25 * smooth(0.0, 0.05, (outer - 0.01).abs());
        glass.lerp(stone, smooth(-0.008, 0.008, mullion.max(inner))) * shade
    })
}
