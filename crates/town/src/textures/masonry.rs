//! Stones in courses: ashlar, rubble, brick.

use crate::canvas::{Painting, paint, smooth, srgb};
use crate::noise::{fractal, random};
use glam::{Vec2, Vec3};

/// Courses of equal stones, every other one shifted by half a stone.
struct Bond {
    /// Stones side by side and courses in a texture, the latter even.
    counts: [i32; 2],
    /// Width of the joints, in the height of a course.
    joint: f32,
    /// How much the joints wander, in the height of a course.
    wobble: f32,
}

/// Where a point lies in a bond.
struct InBond {
    /// Which stone.
    stone: [i32; 2],
    /// Distance to the joint, in the height of a course; below 0 in the joint.
    inside: f32,
    /// 0 at the stone's top, 1 at its bottom.
    down: f32,
}

impl Bond {
    /// `stretch` is the width of a stone in the height of a course.
    fn locate(&self, uv: Vec2, stretch: f32, seed: u32) -> InBond {
        let wander = |seed| self.wobble * (fractal(uv, [12, 12], 2, seed) - 0.5);
        let [across, courses] = self.counts;
        debug_assert!(courses % 2 == 0, "{courses} courses do not tile");
        let v = uv.y * courses as f32 + wander(seed);
        let course = v.floor();
        let odd = (course as i32).rem_euclid(2) as f32;
        let u = uv.x * across as f32 + 0.5 * odd + wander(seed + 7) / stretch;
        let from_side = 0.5 - (u - u.floor() - 0.5).abs();
        let from_top = 0.5 - (v - course - 0.5).abs();
        InBond {
            stone: [
                (u.floor() as i32).rem_euclid(across),
                (course as i32).rem_euclid(courses),
            ],
            inside: (from_side * stretch).min(from_top) - self.joint / 2.0,
            down: v - course,
        }
    }
}

/// Honey-coloured sandstone blocks of 80 by 40 cm for a wall of 3.2 m, in the shade of what juts
/// out above, and stained by rain that splashes up from below.
pub(crate) fn sandstone(seed: u32) -> Painting {
    let bond = Bond {
        counts: [4, 8],
        joint: 0.035,
        wobble: 0.02,
    };
    let tones = [0xdcbf8f, 0xd2b07c, 0xe3cb9f, 0xcfae80, 0xd9b98c].map(srgb);
    paint("sandstone", 512, move |uv| {
        let at = bond.locate(uv, 2.0, seed);
        let tone = pick(&tones, at.stone, seed);
        let grain = fractal(uv, [8, 32], 3, seed + 1) - 0.5;
        let speckle = fractal(uv, [80, 80], 1, seed + 2) - 0.5;
        let stone = tone * (1.0 + 0.22 * grain + 0.14 * speckle) * bevel(&at, 0.09, 0.12);
        let wall = joint(stone, srgb(0x8f7855), &at, 0.03);
        let shade = 0.6 + 0.4 * smooth(0.0, 0.2, uv.y);
        let splash = smooth(0.8, 1.0, uv.y + 0.2 * (random(at.stone, seed + 8) - 0.5));
        wall.lerp(srgb(0x7d6a4c), 0.4 * splash) * shade
    })
}

/// Pale smooth stone; 1 m.
pub(crate) fn trim(seed: u32) -> Painting {
    smooth_stone("trim", srgb(0xe2d4b4), 0.6, seed)
}

/// Grey stone with coarse grain; 1 m.
pub(crate) fn granite(seed: u32) -> Painting {
    smooth_stone("granite", srgb(0xa39b8e), 1.0, seed + 1)
}

fn smooth_stone(name: &'static str, tone: Vec3, contrast: f32, seed: u32) -> Painting {
    paint(name, 256, move |uv| {
        let cloud = fractal(uv, [4, 4], 3, seed + 14) - 0.5;
        let grain = fractal(uv, [64, 64], 2, seed + 17) - 0.5;
        tone * (1.0 + contrast * (0.25 * cloud + 0.3 * grain))
    })
}

/// Grey-brown stones of many tones; 1.8 m.
pub(crate) fn rubble(seed: u32) -> Painting {
    let bond = Bond {
        counts: [4, 6],
        joint: 0.07,
        wobble: 0.3,
    };
    let tones = [0x8d8478, 0x7c756c, 0x9a8f7f, 0x857a6b, 0xa09685].map(srgb);
    paint("rubble", 256, move |uv| {
        let at = bond.locate(uv, 1.5, seed);
        let tone = pick(&tones, at.stone, seed);
        let rough = fractal(uv, [12, 12], 4, seed + 3) - 0.5;
        let stone = tone * (1.0 + 0.45 * rough) * bevel(&at, 0.14, 0.22);
        joint(stone, srgb(0x57504a), &at, 0.08)
    })
}

/// Red bricks of 25 by 8 cm; 1 m.
pub(crate) fn brick(seed: u32) -> Painting {
    let bond = Bond {
        counts: [4, 12],
        joint: 0.16,
        wobble: 0.05,
    };
    let tones = [0xa9573a, 0x984a30, 0xb66748, 0x8c4630, 0xaf5f3c].map(srgb);
    paint("brick", 256, move |uv| {
        let at = bond.locate(uv, 3.0, seed);
        let tone = pick(&tones, at.stone, seed);
        let rough = fractal(uv, [16, 16], 3, seed + 4) - 0.5;
        let stone = tone * (1.0 + 0.4 * rough) * bevel(&at, 0.12, 0.15);
        joint(stone, srgb(0xb3a48e), &at, 0.06)
    })
}

/// A tone and a brightness of its own for each stone.
fn pick(tones: &[Vec3; 5], stone: [i32; 2], seed: u32) -> Vec3 {
    let tone = tones[(random(stone, seed + 5) * 5.0) as usize];
    tone * (0.95 + 0.1 * random(stone, seed + 6))
}

/// Brightness of a stone with worn edges: light along the top, dark along the bottom.
fn bevel(at: &InBond, width: f32, strength: f32) -> f32 {
    let edge = 1.0 - smooth(0.0, width, at.inside);
    1.0 + strength * edge * (1.0 - 2.0 * smooth(0.3, 0.8, at.down))
}

fn joint(stone: Vec3, mortar: Vec3, at: &InBond, softness: f32) -> Vec3 {
    mortar.lerp(stone, smooth(-softness, softness, at.inside))
}
