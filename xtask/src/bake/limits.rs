//! What the impostors of a bundle may cost, and what is tried to stay within it.

use super::Making;
use farfield_bundle::Cost;

/// The most that the impostors of a bundle may cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Triangles.
    pub triangles: Option<u64>,
    /// Uncompressed pages, vertices and indices.
    pub bytes: Option<u64>,
}

impl Limits {
    /// How many times what is allowed a cost is, whichever of the two is worse; at most 1 where it is
    /// within the limits.
    pub(super) fn excess(&self, cost: &Cost) -> f64 {
        let share =
            |value: u64, most: Option<u64>| most.map_or(0.0, |most| value as f64 / most as f64);
        share(cost.triangles, self.triangles).max(share(bytes(cost), self.bytes))
    }

    /// By how much a cost misses the limits.
    pub(super) fn missed(&self, cost: &Cost) -> String {
        let part = |what: &str, option: &str, value: u64, most: Option<u64>| {
            let most = most.filter(|most| value > *most)?;
            let more = value - most;
            Some(format!("{value} {what}, {more} more than {option} {most}"))
        };
        let parts = [
            part(
                "triangles",
                "--max-triangles",
                cost.triangles,
                self.triangles,
            ),
            part("bytes", "--max-bytes", bytes(cost), self.bytes),
        ];
        parts
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(" and ")
    }
}

fn bytes(cost: &Cost) -> u64 {
    cost.texture_bytes + cost.geometry_bytes
}

/// What a quad may be worth, in bytes: from what one takes in the file to as good as no texel.
const PRICES: [f64; 6] = [104.0, 416.0, 1664.0, 6656.0, 26_624.0, 106_496.0];

/// By how much voxels may be enlarged.
const ENLARGED: [f64; 3] = [1.5, 1.75, 2.0];

/// What is tried in turn where what was asked for costs too much: larger quads, or larger voxels.
pub(super) fn cheaper(asked: Making) -> Vec<Making> {
    match asked {
        Making::Layered { .. } => PRICES
            .into_iter()
            .map(|bytes_per_quad| Making::Layered { bytes_per_quad })
            .filter(|other| *other != asked)
            .collect(),
        Making::Tdm { enlarged: asked } => ENLARGED
            .into_iter()
            .filter(|enlarged| *enlarged > asked)
            .map(|enlarged| Making::Tdm { enlarged })
            .collect(),
    }
}
