//! Bark, clusters of leaves with holes between them, hedges and flowers.

use crate::canvas::{Painting, along_and_distance, paint, smooth, srgb};
use crate::noise::{fractal, random};
use glam::{Vec2, Vec3};

/// Furrowed bark, to be tinted; 1 m.
pub(crate) fn bark(seed: u32) -> Painting {
    paint("bark", 256, move |uv| {
        let furrow = fractal(uv, [14, 3], 3, seed + 91);
        let fine = fractal(uv, [40, 10], 2, seed + 92) - 0.5;
        srgb(0x8a7a66) * (0.65 + 0.6 * furrow + 0.2 * fine)
    })
}

/// A leaf in a cluster: from its stalk to its tip.
#[derive(Clone, Copy)]
struct Leaf {
    stalk: Vec2,
    tip: Vec2,
    /// Half its greatest width, as a share of its length.
    breadth: f32,
    /// Brightness.
    tone: f32,
}

impl Leaf {
    /// How far inside of the outline a point lies, below 0 outside, and how near the midrib; in
    /// the leaf's length.
    fn inside(&self, p: Vec2) -> (f32, f32) {
        let length = self.stalk.distance(self.tip);
        let (along, _) = along_and_distance(p, self.stalk, self.tip);
        let axis = (self.tip - self.stalk) / length;
        let across = axis.perp_dot(p - self.stalk).abs() / length;
        let beyond = ((p - self.stalk).dot(axis) - along).abs() / length;
        let t = along / length;
        // Widest a third of the way, pointed at the tip.
        let half = self.breadth * 2.6 * t.sqrt() * (1.0 - t).powf(0.8);
        (half - across - beyond, across)
    }
}

/// Leaves around a few twigs that spread from the middle of the lower edge.
struct Cluster {
    leaves: Vec<Leaf>,
    green: [Vec3; 2],
}

impl Cluster {
    fn new(count: i32, length: f32, breadth: f32, green: [Vec3; 2], seed: u32) -> Self {
        let leaf = |i: i32| {
            let dice = |n: i32| random([i, n], seed);
            // On a sunflower's spiral, so that the cluster is evenly full.
            let radius = 0.36 * ((i as f32 + 0.5) / count as f32).sqrt();
            let center = Vec2::splat(0.5) + radius * Vec2::from_angle(2.4 * i as f32);
            let outward = Vec2::from_angle(2.4 * i as f32 + 2.2 * (dice(0) - 0.5));
            let reach = outward * length * (0.8 + 0.4 * dice(1)) / 2.0;
            let inner = Vec2::splat(0.03);
            Leaf {
                stalk: (center - reach).clamp(inner, 1.0 - inner),
                tip: (center + reach).clamp(inner, 1.0 - inner),
                breadth,
                tone: 0.82 + 0.36 * dice(2),
            }
        };
        // Outer leaves first, inner ones lie on them.
        let leaves = (0..count).rev().map(leaf).collect();
        Self { leaves, green }
    }

    fn painting(self, name: &'static str, seed: u32) -> Painting {
        let leaves = self.leaves.clone();
        let color = move |uv: Vec2| {
            let mut color = self.green[0] * 0.9;
            for leaf in &self.leaves {
                let (inside, across) = leaf.inside(uv);
                if inside > -0.02 {
                    let rib = 1.0 + 0.18 * smooth(0.03, 0.0, across);
                    let rim = 0.85 + 0.15 * smooth(0.0, 0.06, inside);
                    let green = self.green[0].lerp(self.green[1], 2.0 * (leaf.tone - 0.82));
                    color = green * rib * rim * leaf.tone;
                }
            }
            color * (0.95 + 0.1 * fractal(uv, [20, 20], 1, seed))
        };
        paint(name, 512, color).cut_out(move |uv| {
            let most = leaves.iter().map(|leaf| leaf.inside(uv).0);
            smooth(-0.03, 0.03, most.fold(-1.0, f32::max))
        })
    }
}

/// Heart-shaped leaves of a lime.
pub(crate) fn lime(seed: u32) -> Painting {
    let green = [srgb(0x4f7a2c), srgb(0x7f9f3f)];
    Cluster::new(15, 0.3, 0.36, green, seed + 1).painting("lime leaves", seed)
}

/// Small leaves of a birch, yellowish.
pub(crate) fn birch(seed: u32) -> Painting {
    let green = [srgb(0x71903a), srgb(0xa5b04e)];
    Cluster::new(26, 0.2, 0.26, green, seed + 2).painting("birch leaves", seed)
}

/// Dark narrow leaves of a cypress.
pub(crate) fn cypress(seed: u32) -> Painting {
    let green = [srgb(0x2f5230), srgb(0x50713c)];
    Cluster::new(26, 0.26, 0.16, green, seed + 3).painting("cypress leaves", seed)
}

/// Flowers between leaves.
pub(crate) fn flowers(seed: u32) -> Painting {
    let red = [srgb(0xc8324a), srgb(0xf06a7c)];
    Cluster::new(18, 0.22, 0.42, red, seed + 4).painting("flowers", seed)
}

/// The clipped face of a hedge; 1.5 m.
pub(crate) fn hedge(seed: u32) -> Painting {
    paint("hedge", 512, move |uv| {
        let lumps = fractal(uv, [6, 6], 2, seed + 95);
        let leaves = fractal(uv, [26, 26], 2, seed + 96);
        let green = srgb(0x2f4f22).lerp(srgb(0x6d8f3c), smooth(0.25, 0.8, leaves));
        green * (0.7 + 0.5 * lumps)
    })
}
