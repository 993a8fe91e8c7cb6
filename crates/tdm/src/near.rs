//! Finding voxels by place.

use crate::VoxelLayers;
use glam::Vec3;

/// The voxels of layers, by columns of the warped grid.
#[derive(Clone, Debug)]
pub struct VoxelIndex {
    width: usize,
    height: usize,
    /// Where the voxels of each column begin in `ids`, row by row.
    starts: Vec<u32>,
    /// Numbers of voxels, column by column, front to back.
    ids: Vec<u32>,
    /// Depth of the middle of each voxel, in the order of `ids`.
    depths: Vec<f32>,
}

/// Farther away than any voxel.
const FARTHEST: f32 = 1e9;

impl VoxelIndex {
    /// Sorts the voxels of layers into columns.
    ///
    /// # Panics
    ///
    /// When a voxel lies outside of its layer, or there are not as many borders as layers and one.
    pub fn new(voxels: &VoxelLayers<'_>) -> Self {
        Self::of(voxels, |_| true)
    }

    /// Sorts only those voxels into columns whose numbers are chosen.
    ///
    /// # Panics
    ///
    /// As [`VoxelIndex::new`].
    pub fn of(voxels: &VoxelLayers<'_>, is_chosen: impl Fn(u32) -> bool) -> Self {
        let (width, height) = (voxels.width as usize, voxels.height as usize);
        let column = |[x, y]: [u16; 2]| {
            assert!(usize::from(x) < width, "a voxel in column {x} of {width}");
            usize::from(x) + width * usize::from(y)
        };
        let places = voxels.layers.iter().enumerate();
        let places = places.flat_map(|(l, layer)| layer.iter().map(move |at| (l, *at)));
        let chosen = || (0..).zip(places.clone()).filter(|(id, _)| is_chosen(*id));
        let mut starts = vec![0u32; width * height + 1];
        for (_, (_, at)) in chosen() {
            starts[column(at) + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let count = starts[width * height] as usize;
        let (mut ids, mut depths) = (vec![0; count], vec![0.0; count]);
        let mut next = starts.clone();
        for (id, (layer, at)) in chosen() {
            let place = &mut next[column(at)];
            ids[*place as usize] = id;
            depths[*place as usize] = voxels.middle(layer);
            *place += 1;
        }
        Self {
            width,
            height,
            starts,
            ids,
            depths,
        }
    }

    /// The voxels that a place shows, and how much of each: linearly less with the distance of their
    /// centres along each axis, up to a voxel; or the nearest where none is so near.
    ///
    /// # Panics
    ///
    /// When there are no voxels, or the place is farther from all of them than any grid is large.
    pub fn blended(&self, place: Vec3) -> Vec<(u32, f32)> {
        let blended: Vec<_> = self.weighted(place, 1.0).collect();
        if !blended.is_empty() {
            return blended;
        }
        let mut reach = 1.0;
        loop {
            reach *= 2.0;
            let near = self.near(place, Vec3::splat(reach));
            let by_distance = near.min_by(|a, b| {
                let [a, b] = [a, b].map(|one| (place - one.1).abs().max_element());
                a.total_cmp(&b)
            });
            if let Some((id, _)) = by_distance {
                return vec![(id, 1.0)];
            }
            assert!(reach < FARTHEST, "there is no voxel at all");
        }
    }

    /// The voxels around a place, and how much each has to say of it: linearly less with the distance of its
    /// centre along each axis, nothing from `reach` voxels on.
    pub fn weighted(&self, place: Vec3, reach: f32) -> impl Iterator<Item = (u32, f32)> {
        let weight = move |(id, center): (u32, Vec3)| {
            let closeness = (1.0 - (place - center).abs() / reach).max(Vec3::ZERO);
            (id, closeness.element_product())
        };
        let near = self.near(place, Vec3::splat(reach)).map(weight);
        near.filter(|(_, weight)| *weight > 0.0)
    }

    /// The voxels whose centres are at most `reach` from a point along each axis: their numbers and
    /// centres, row by row.
    pub fn near(&self, point: Vec3, reach: Vec3) -> impl Iterator<Item = (u32, Vec3)> {
        let range = |at: f32, reach: f32, count: usize| {
            // Centres are at halves; casts round towards 0, and give 0 for what is below.
            let first = (at - reach - 0.5).ceil() as usize;
            let end = ((at + reach + 0.5) as usize).min(count);
            first..end
        };
        let columns = range(point.x, reach.x, self.width);
        let rows = range(point.y, reach.y, self.height);
        let [least, most] = [point.z - reach.z, point.z + reach.z];
        rows.flat_map(move |y| columns.clone().map(move |x| (x, y)))
            .flat_map(move |(x, y)| {
                let column = x + self.width * y;
                let run = self.starts[column] as usize..self.starts[column + 1] as usize;
                let depths = &self.depths[run.clone()];
                let first = run.start + depths.partition_point(|z| *z < least);
                let end = run.start + depths.partition_point(|z| *z <= most);
                let center = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0);
                (first..end).map(move |i| (self.ids[i], center.with_z(self.depths[i])))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::blobs;
    use proptest::prelude::*;

    proptest! {
        /// What is near is what a search through all voxels, or through those that were chosen, finds.
        #[test]
        fn what_is_near_is_found(
            blob in blobs(),
            point in prop::array::uniform3(-3.0..9.0f32),
            reach in prop::array::uniform3(0.0..4.0f32),
        ) {
            let voxels = blob.layers();
            let (point, reach) = (Vec3::from(point), Vec3::from(reach));
            let mut found: Vec<_> = VoxelIndex::new(&voxels).near(point, reach).collect();
            found.sort_by_key(|(id, _)| *id);
            let all = (0..).zip(voxels.boxes(1.0).into_iter().map(|b| b.center));
            let near = all.filter(|(_, center)| (point - *center).abs().cmple(reach).all());
            let mut near: Vec<_> = near.collect();
            prop_assert_eq!(&found, &near);

            let is_chosen = |id: u32| id % 3 == 1;
            let mut chosen: Vec<_> = VoxelIndex::of(&voxels, is_chosen).near(point, reach).collect();
            chosen.sort_by_key(|(id, _)| *id);
            near.retain(|(id, _)| is_chosen(*id));
            prop_assert_eq!(chosen, near);
        }
    }
}
