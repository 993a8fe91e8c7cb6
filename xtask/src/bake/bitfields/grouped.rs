//! The triangles of a scene in patches.

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
