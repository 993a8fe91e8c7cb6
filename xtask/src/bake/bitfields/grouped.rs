//! The triangles of a scene in patches.

use anyhow::{Result, bail};
use farfield_bitfields::Patches;
use farfield_scene::Scene;

/// Triangles in patches.
pub(super) struct Grouped {
    pub(super) patches: Patches,
    /// The patch of each triangle.
    pub(super) patch_of: Vec<u32>,
    /// The place of each triangle in the order of patches.
    pub(super) places: Vec<u32>,
}

/// Triangles times faces or cells: to group them takes [`BYTES`] for each.
const MOST_SEEN: u64 = 1 << 33;

/// A bit each in the sets, in their copies part by part, and in what each triangle is seen from; with
/// summaries of words, and numbers of bits that fill no word.
const BYTES: f64 = 0.39;

/// Refuses what takes too much memory to be grouped.
///
/// * `owner` - of sets, several: faces or cells
/// * `remedy` - what to do to have fewer
///
/// # Errors
///
/// When it does.
pub(super) fn require_memory(triangles: u64, sets: u64, owner: &str, remedy: &str) -> Result<()> {
    let seen = triangles.saturating_mul(sets);
    if seen > MOST_SEEN {
        bail!(
            "{triangles} triangles, seen from {sets} {owner}, take {:.1} GB of memory to be grouped, more than \
             {:.1} GB: {remedy}, so that there are at most {}",
            seen as f64 * BYTES / 1e9,
            MOST_SEEN as f64 * BYTES / 1e9,
            MOST_SEEN / triangles,
        );
    }
    Ok(())
}

impl Grouped {
    pub(super) fn new(patches: Patches) -> Self {
        let mut patch_of = vec![0; patches.order.len()];
        let mut places = vec![0; patches.order.len()];
        for (patch, range) in (0..).zip(patches.starts.windows(2)) {
            for place in range[0]..range[1] {
                let id = patches.order[place as usize] as usize;
                patch_of[id] = patch;
                places[id] = place;
            }
        }
        Self {
            patches,
            patch_of,
            places,
        }
    }

    /// The scene with its triangles in the order of patches.
    pub(super) fn ordered(&self, scene: &Scene) -> Scene {
        let order = self.patches.order.iter();
        let triangles = order.map(|id| scene.triangles[*id as usize]);
        Scene {
            triangles: triangles.collect(),
            ..scene.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dragon is baked with a thousand viewpoints, and not with ten thousand, of which the message says
    /// what to do.
    #[test]
    fn what_takes_too_much_memory_is_refused() {
        assert!(require_memory(871_306, 1996, "faces", "lower --samples").is_ok());
        let error = require_memory(871_306, 19_996, "faces", "lower --samples").unwrap_err();
        assert_eq!(
            error.to_string(),
            "871306 triangles, seen from 19996 faces, take 6.8 GB of memory to be grouped, more than 3.4 GB: \
             lower --samples, so that there are at most 9858"
        );
        assert!(require_memory(u64::MAX, 2, "cells", "lower --cells").is_err());
    }
}
