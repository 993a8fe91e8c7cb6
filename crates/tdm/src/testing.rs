//! Voxels for tests.

use crate::VoxelLayers;
use farfield_grid::BitMask;
use glam::Vec3;
use proptest::prelude::*;

/// Columns, rows and layers of a blob.
pub(crate) const SIDE: u16 = 6;

/// Layers a voxel thick.
pub(crate) const BORDERS: [f32; 7] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];

/// Any voxels of a small grid.
#[derive(Clone, Debug)]
pub(crate) struct Blob {
    layers: Vec<Vec<[u16; 2]>>,
    reached: Vec<BitMask>,
}

impl Blob {
    /// Those of `count` layers for which `is_there` (column, row, layer) holds.
    pub(crate) fn of(count: usize, is_there: impl Fn(u16, u16, usize) -> bool) -> Self {
        let layer = |l: usize| {
            let all = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| [x, y]));
            all.filter(|[x, y]| is_there(*x, *y, l)).collect()
        };
        Self {
            layers: (0..count).map(layer).collect(),
            reached: vec![BitMask::full(SIDE.into(), SIDE.into()); count],
        }
    }

    /// The same where lines of sight reach only some places.
    pub(crate) fn reached_where(mut self, is_reached: impl Fn(u16, u16, usize) -> bool) -> Self {
        for (l, reached) in self.reached.iter_mut().enumerate() {
            for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
                if !is_reached(x, y, l) {
                    reached.remove(x.into(), y.into());
                }
            }
        }
        self
    }

    pub(crate) fn layers(&self) -> VoxelLayers<'_> {
        VoxelLayers {
            width: SIDE.into(),
            height: SIDE.into(),
            layers: &self.layers,
            reached: &self.reached,
            borders: &BORDERS[..=self.layers.len()],
        }
    }

    pub(crate) fn centers(&self) -> Vec<Vec3> {
        let boxes = self.layers().boxes(1.0);
        boxes.into_iter().map(|cuboid| cuboid.center).collect()
    }

    /// Anywhere in the voxels.
    pub(crate) fn points(&self) -> Vec<Vec3> {
        let centers = self.centers().into_iter().enumerate();
        let shift = |i: usize, step: usize| ((i * step) % 11) as f32 / 11.0 - 0.45;
        centers
            .map(|(i, center)| center + Vec3::new(shift(i, 3), shift(i, 5), shift(i, 7)))
            .collect()
    }

    pub(crate) fn contains(&self, x: u16, y: u16, layer: usize) -> bool {
        let found = self.layers.get(layer);
        found.is_some_and(|layer| layer.contains(&[x, y]))
    }
}

/// Voxels at random: sparse ones, dense ones, and surfaces.
pub(crate) fn blobs() -> impl Strategy<Value = Blob> {
    let noise = (prop::collection::vec(any::<u8>(), 216), 30..220u8).prop_map(|(bytes, most)| {
        Blob::of(6, |x, y, l| {
            bytes[usize::from(x) + 6 * usize::from(y) + 36 * l] < most
        })
    });
    let surface = prop::array::uniform3(-1.5..1.5f32).prop_map(|[a, b, c]| {
        Blob::of(6, |x, y, l| {
            let depth = 2.5 + a * (f32::from(x) - 3.0) + b * (f32::from(y) - 3.0);
            (depth + c - l as f32).abs() < 0.5 + (a.abs() + b.abs()) / 2.0
        })
    });
    prop_oneof![noise, surface]
}
