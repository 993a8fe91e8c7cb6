//! Timber frames, boards, shutters and the door.

use crate::canvas::{Painting, along_and_distance, distance_to_rect, paint, smooth, srgb};
use crate::noise::{fractal, random};
use crate::windows::WINDOW;
use glam::{Vec2, Vec3};

/// The paint of the shutters, sRGB.
pub(crate) const SHUTTER: Vec3 = srgb(0x2c6e6a);

const OAK: Vec3 = srgb(0x5b3a26);

/// Side of a half-timbered panel, in metres.
pub(crate) const PANEL: f32 = 3.6;

/// Height of a window's opening above its panel's lower edge, in metres.
pub(crate) const PARAPET: f32 = 1.0;

/// A straight timber: from, to, width; in metres from the panel's lower left.
type Timber = [f32; 5];

/// Half-timbered wall of 3.6 m around a window, which hides the middle.
pub(crate) fn window_panel(seed: u32) -> Painting {
    let (left, right) = (PANEL / 2.0 - WINDOW.x / 2.0, PANEL / 2.0 + WINDOW.x / 2.0);
    let (sill, lintel) = (PARAPET, PARAPET + WINDOW.y);
    let post = 0.11;
    let mut timbers = vec![
        // Struts in the corners under the sill.
        [0.1, sill - 0.1, 0.78, 0.1, 0.19],
        [PANEL - 0.1, sill - 0.1, PANEL - 0.78, 0.1, 0.19],
        // The cross under the sill.
        [left, 0.1, right, sill, 0.17],
        [left, sill, right, 0.1, 0.17],
        // Sill, lintel and the posts at the window's sides.
        [0.0, sill - 0.08, PANEL, sill - 0.08, 0.19],
        [0.0, lintel + 0.09, PANEL, lintel + 0.09, 0.2],
        [left - post, 0.0, left - post, PANEL, 0.22],
        [right + post, 0.0, right + post, PANEL, 0.22],
    ];
    timbers.extend(frame());
    half_timbered("window panel", timbers, seed)
}

/// Half-timbered wall of 3.6 m: a post with long braces to both sides.
pub(crate) fn braced_panel(seed: u32) -> Painting {
    let middle = PANEL / 2.0;
    let mut timbers = vec![
        [0.0, PARAPET - 0.08, PANEL, PARAPET - 0.08, 0.19],
        [0.0, 2.99, PANEL, 2.99, 0.2],
        [0.42, 0.1, middle - 0.12, 2.9, 0.21],
        [PANEL - 0.42, 0.1, middle + 0.12, 2.9, 0.21],
        [middle, 0.0, middle, PANEL, 0.24],
    ];
    timbers.extend(frame());
    half_timbered("braced panel", timbers, seed)
}

/// Timbers that all panels have on their edges; half of each belongs to the neighbour.
fn frame() -> [Timber; 4] {
    [
        [0.0, 0.0, 0.0, PANEL, 0.26],
        [PANEL, 0.0, PANEL, PANEL, 0.26],
        [0.0, 0.07, PANEL, 0.07, 0.2],
        [0.0, PANEL - 0.07, PANEL, PANEL - 0.07, 0.2],
    ]
}

/// Plaster between timbers; later ones lie on top.
fn half_timbered(name: &'static str, timbers: Vec<Timber>, seed: u32) -> Painting {
    paint(name, 512, move |uv| {
        let p = Vec2::new(uv.x, 1.0 - uv.y) * PANEL;
        // The topmost timber here, and the distance to the nearest edge of any.
        let mut wood = None;
        let mut clearance = f32::INFINITY;
        for (i, &[ax, ay, bx, by, width]) in timbers.iter().enumerate() {
            let (a, b) = (Vec2::new(ax, ay), Vec2::new(bx, by));
            let (along, distance) = along_and_distance(p, a, b);
            let inside = width / 2.0 - distance;
            clearance = clearance.min(-inside);
            if inside >= 0.0 {
                wood = Some((
                    i,
                    along,
                    distance * (b - a).perp_dot(p - a).signum(),
                    inside,
                ));
            }
        }
        // Darker under the eaves or the storey above.
        let eaves = 0.72 + 0.28 * smooth(0.0, 0.3, uv.y);
        let color = match wood {
            Some((i, along, across, inside)) => {
                let grain_at = Vec2::new(along / 3.0, across / 0.5 + 0.37 * i as f32);
                let edge = 0.72 + 0.28 * smooth(0.0, 0.03, inside);
                oak(grain_at, seed + i as u32) * edge
            }
            None => plaster(uv, seed) * (0.74 + 0.26 * smooth(0.0, 0.16, clearance)),
        };
        color * eaves
    })
}

fn plaster(uv: Vec2, seed: u32) -> Vec3 {
    let mottle = fractal(uv, [5, 5], 4, seed + 11) - 0.5;
    let streak = fractal(uv, [28, 3], 3, seed + 12) - 0.5;
    let grit = fractal(uv, [90, 90], 1, seed + 13) - 0.5;
    srgb(0xf1e2bf) * (1.0 + 0.12 * mottle + 0.08 * streak + 0.05 * grit)
}

/// Dark wood, its grain along u; 1 m.
fn oak(uv: Vec2, seed: u32) -> Vec3 {
    let fibre = fractal(uv, [3, 36], 3, seed + 21) - 0.5;
    let broad = fractal(uv, [2, 5], 2, seed + 22) - 0.5;
    OAK * (1.0 + 0.55 * fibre + 0.3 * broad)
}

/// Dark wood, its grain along u; 1 m.
pub(crate) fn beam(seed: u32) -> Painting {
    paint("beam", 256, move |uv| oak(uv, seed))
}

/// Upright boards of 20 cm; 1.6 m.
pub(crate) fn planks(seed: u32) -> Painting {
    paint("planks", 256, move |uv| {
        let at = uv.x * 8.0;
        let tone = 0.85 + 0.3 * random([at as i32, 0], seed + 31);
        let gap = 0.5 - (at - at.floor() - 0.5).abs();
        let fibre = fractal(uv, [48, 3], 3, seed + 32) - 0.5;
        srgb(0x8a6a48) * tone * (1.0 + 0.5 * fibre) * (0.45 + 0.55 * smooth(0.01, 0.07, gap))
    })
}

/// A leaf of two fields of slats in a frame.
pub(crate) fn shutter(seed: u32) -> Painting {
    slatted("shutter", SHUTTER, seed)
}

/// The same nearly white, to be tinted.
pub(crate) fn plain_shutter(seed: u32) -> Painting {
    slatted("plain shutter", Vec3::splat(0.9), seed)
}

fn slatted(name: &'static str, color: Vec3, seed: u32) -> Painting {
    paint(name, 256, move |uv| {
        let fields =
            [0.28, 0.74].map(|y| distance_to_rect(uv, Vec2::new(0.5, y), Vec2::new(0.36, 0.2)));
        let to_field = fields[0].min(fields[1]);
        let slat = (uv.y * 26.0).fract();
        let slats = 0.62 + 0.5 * smooth(0.9, 0.05, slat) - 0.35 * smooth(0.8, 1.0, slat);
        let light = match to_field < 0.0 {
            true => slats * (0.65 + 0.35 * smooth(0.0, 0.05, -to_field)),
            false => 1.0 - 0.25 * smooth(0.02, 0.0, to_field),
        };
        painted(color, uv, seed) * light
    })
}

/// A wall of the turret: boards around an arched hole with slats.
pub(crate) fn louvre(seed: u32) -> Painting {
    paint("louvre", 256, move |uv| {
        let hole = distance_to_rect(uv, Vec2::new(0.5, 0.6), Vec2::new(0.25, 0.2))
            .min(uv.distance(Vec2::new(0.5, 0.4)) - 0.25);
        let slat = (uv.y * 12.0).fract();
        let frame = smooth(0.06, 0.05, hole);
        let boards = srgb(0xefe3c6) * (1.0 + 0.2 * (fractal(uv, [30, 2], 3, seed + 41) - 0.5));
        let post = (uv.x - 0.5).abs() > 0.42 || !(0.09..0.93).contains(&uv.y);
        match hole < 0.0 {
            true => OAK * (0.5 + 0.9 * (1.0 - slat)),
            false if post => oak(uv, seed + 42),
            false => boards.lerp(oak(uv, seed + 43), frame),
        }
    })
}

/// Two leaves with three panels each, a knob and a strip of brass at the foot.
pub(crate) fn door(seed: u32) -> Painting {
    let panels = [
        ([0.25, 0.2], [0.15, 0.12]),
        ([0.25, 0.52], [0.15, 0.13]),
        ([0.25, 0.82], [0.15, 0.09]),
    ];
    paint("door", 512, move |uv| {
        // The right leaf mirrors the left one.
        let p = Vec2::new(0.5 - (uv.x - 0.5).abs(), uv.y);
        let [bulge, to_panel] = panels
            .map(|(center, half)| distance_to_rect(p, Vec2::from(center), Vec2::from(half)))
            .into_iter()
            .fold([0.0, 1.0f32], |[bulge, nearest], d| {
                [bulge + smooth(-0.03, -0.05, d), nearest.min(d)]
            });
        // A groove around each panel, its field raised; light comes from above.
        let groove = 1.0 - 0.45 * smooth(0.02, 0.0, (to_panel + 0.012).abs());
        let joint = 0.4 + 0.6 * smooth(0.002, 0.012, (uv.x - 0.5).abs());
        let edge = 0.6 + 0.4 * smooth(0.0, 0.08, p.x.min(uv.y));
        let leaf = painted(srgb(0x7d2f26), uv, seed) * groove * joint * edge * (1.0 + 0.12 * bulge);
        let knob = p.distance(Vec2::new(0.46, 0.55)) - 0.014;
        let brass = srgb(0xd6a84a) * (1.0 - 4.0 * (p.y - 0.55).max(0.0));
        leaf.lerp(brass, smooth(0.004, 0.0, knob))
            .lerp(srgb(0xa88339), smooth(0.965, 0.97, uv.y) * 0.8)
    })
}

/// A house door of one leaf with two panels and a light over it, nearly white, to be tinted.
pub(crate) fn house_door(seed: u32) -> Painting {
    let fields = [([0.5, 0.52], [0.3, 0.14]), ([0.5, 0.82], [0.3, 0.1])];
    paint("house door", 256, move |uv| {
        let to_field = fields
            .map(|(center, half)| distance_to_rect(uv, Vec2::from(center), Vec2::from(half)))
            .into_iter()
            .fold(1.0, f32::min);
        let groove = 1.0 - 0.45 * smooth(0.025, 0.0, (to_field + 0.015).abs());
        let light = distance_to_rect(uv, Vec2::new(0.5, 0.17), Vec2::new(0.36, 0.1));
        let knob = smooth(0.012, 0.0, uv.distance(Vec2::new(0.88, 0.58)) - 0.02);
        let edge = 0.6 + 0.4 * smooth(0.0, 0.07, uv.x.min(1.0 - uv.x).min(uv.y));
        (painted(Vec3::splat(0.9), uv, seed + 5) * groove * edge)
            .lerp(srgb(0x2a3b48), smooth(0.01, -0.01, light))
            .lerp(srgb(0xd6a84a), knob)
    })
}

/// A shop window between boards with a lettering board over it, nearly white, to be tinted.
pub(crate) fn shop_front(seed: u32) -> Painting {
    paint("shop front", 512, move |uv| {
        let glass = [0.27, 0.73]
            .map(|x| distance_to_rect(uv, Vec2::new(x, 0.53), Vec2::new(0.2, 0.25)))
            .into_iter()
            .fold(1.0, f32::min);
        let goods = random([(uv.x * 18.0) as i32, (uv.y * 16.0) as i32], seed + 57);
        let inside = match uv.y > 0.62 {
            true => srgb(0x4a3a2c).lerp(srgb(0xd9a860), goods * goods),
            false => srgb(0x2c3a42).lerp(srgb(0xe9c98a), 0.5 * smooth(0.3, 0.62, uv.y)),
        };
        let board = distance_to_rect(uv, Vec2::new(0.5, 0.13), Vec2::new(0.43, 0.07));
        let script = smooth(0.55, 0.62, fractal(uv, [26, 5], 2, seed + 58))
            * smooth(
                0.0,
                0.02,
                -distance_to_rect(uv, Vec2::new(0.5, 0.13), Vec2::new(0.3, 0.035)),
            );
        let wood = painted(Vec3::splat(0.85), uv, seed + 6)
            * (0.75 + 0.25 * smooth(0.0, 0.02, board.abs()))
            * (0.7 + 0.3 * smooth(0.0, 0.03, glass));
        wood.lerp(Vec3::splat(0.98), script)
            .lerp(inside, smooth(0.004, -0.004, glass))
    })
}

/// Paint that has seen weather.
fn painted(color: Vec3, uv: Vec2, seed: u32) -> Vec3 {
    let fibre = fractal(uv, [40, 4], 3, seed + 51) - 0.5;
    let worn = fractal(uv, [5, 5], 3, seed + 52) - 0.5;
    color * (1.0 + 0.18 * fibre + 0.2 * worn)
}
