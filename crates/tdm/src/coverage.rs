//! Which voxels any mesh touches.

use crate::VoxelLayers;
use crate::near::VoxelIndex;
use crate::touch::Target;
use glam::Vec3;

/// Whether some triangle touches each voxel, enlarged about its centre by a factor.
///
/// Of any triangles, whoever made them: what [`crate::simplify`] keeps to can be asked of others.
///
/// # Panics
///
/// When a triangle refers to a vertex that is not there, or there are not as many borders as layers
/// and one.
pub fn touched(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    voxels: &VoxelLayers<'_>,
    enlarged: f32,
) -> Vec<bool> {
    let boxes = voxels.boxes(enlarged);
    let index = VoxelIndex::new(voxels);
    let halves = boxes.iter().map(|place| place.half);
    let reach = halves.fold(Vec3::ZERO, Vec3::max);
    let mut touched = vec![false; boxes.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let target = Target::new([a, b, c]);
        for (voxel, _) in index.near((low + high) / 2.0, (high - low) / 2.0 + reach) {
            let voxel = voxel as usize;
            touched[voxel] = touched[voxel] || target.touches(&boxes[voxel]);
        }
    }
    touched
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::blobs;
    use crate::{initial_mesh, simplify};
    use proptest::prelude::*;

    proptest! {
        /// What is touched is what a search through all triangles finds, and all that the simplified mesh
        /// stands for is among it.
        #[test]
        fn what_is_touched_is_found(blob in blobs(), enlarged in 1.0..2.0f32) {
            let voxels = blob.layers();
            let mesh = initial_mesh(&voxels, &blob.points(), enlarged);
            let simple = simplify(&mesh, &voxels, enlarged).mesh;
            let found = touched(&simple.positions, &simple.triangles, &voxels, enlarged);
            for (place, found) in voxels.boxes(enlarged).iter().zip(&found) {
                let mut all = simple.triangles.iter().map(|t| t.map(|v| simple.positions[v as usize]));
                prop_assert_eq!(all.any(|t| Target::new(t).touches(place)), *found);
            }
            let mut stood_for = mesh.voxels.iter().flatten();
            prop_assert!(stood_for.all(|voxel| found[*voxel as usize]));
        }
    }
}
