//! What lines of sight reach, and how far meshes go into shadows.

use crate::VoxelLayers;
use farfield_grid::BitMask;

/// How far into shadows what is not seen from elsewhere is covered, in texels. A line of sight that grazes
/// what hides a surface meets it within a texel or two of the shadow's border, as the mesh may shrink by as
/// much there and where it is hidden by.
const GRAZED: usize = 4;

/// How much farther a mesh may go, in texels: so its borders there need not follow the shadow's.
const LEEWAY: usize = 2;

/// A gap between two layers in a column: column, row, and the layer behind it.
pub(crate) type Gap = [i32; 3];

/// Where between layers lines of sight pass.
pub(crate) struct Light {
    occupied: Vec<BitMask>,
    /// Of each layer the texels that lines of sight reach, and somewhat more.
    grazed: Vec<BitMask>,
    /// Even more.
    near: Vec<BitMask>,
}

impl Light {
    pub(crate) fn new(voxels: &VoxelLayers<'_>) -> Self {
        let occupied = voxels.layers.iter().zip(voxels.reached);
        let occupied: Vec<BitMask> = occupied
            .map(|(layer, reached)| {
                let mut occupied = BitMask::empty(reached.width(), reached.height());
                for [x, y] in layer {
                    occupied.insert((*x).into(), (*y).into());
                }
                occupied
            })
            .collect();
        let grazed = widened(voxels.reached, &occupied, GRAZED);
        Self {
            near: widened(&grazed, &occupied, LEEWAY),
            grazed,
            occupied,
        }
    }

    /// Which voxels lines of sight reach, or nearly so.
    pub(crate) fn reaches(&self, voxels: &VoxelLayers<'_>) -> Vec<bool> {
        let layers = voxels.layers.iter().zip(&self.grazed);
        layers
            .flat_map(|(layer, mask)| {
                let beside = mask.dilated();
                layer
                    .iter()
                    .map(move |[x, y]| beside.contains((*x).into(), (*y).into()))
            })
            .collect()
    }

    /// Whether there are voxels on both sides of a gap.
    pub(crate) fn is_solid(&self, [x, y, layer]: Gap) -> bool {
        [layer - 1, layer]
            .iter()
            .all(|l| self.is_occupied([x, y], *l))
    }

    fn is_occupied(&self, [x, y]: [i32; 2], layer: i32) -> bool {
        let mask = usize::try_from(layer)
            .ok()
            .and_then(|l| self.occupied.get(l));
        mask.is_some_and(|mask| is_in(mask, x, y) == Some(true))
    }

    /// Whether lines of sight pass in or near a gap that is not solid. They come from the layer before, or
    /// from beside behind a voxel that ends there. Nothing hides what is before the first layer, behind the
    /// last or beside the grid.
    pub(crate) fn is_lit(&self, [x, y, layer]: Gap) -> bool {
        let from = match self.is_occupied([x, y], layer - 1) {
            true => layer,
            false => layer - 1,
        };
        let mask = usize::try_from(from).ok().and_then(|l| self.near.get(l));
        mask.is_none_or(|mask| is_in(mask, x, y) != Some(false))
    }
}

/// Whether a mask has a texel; `None` outside of it.
fn is_in(mask: &BitMask, x: i32, y: i32) -> Option<bool> {
    let [x, y] = [usize::try_from(x).ok()?, usize::try_from(y).ok()?];
    (x < mask.width() && y < mask.height()).then(|| mask.contains(x, y))
}

/// Masks and, of what is not occupied, the texels beside, as far as nothing lies in between.
fn widened(masks: &[BitMask], occupied: &[BitMask], by: usize) -> Vec<BitMask> {
    let widen = |(mask, occupied): (&BitMask, &BitMask)| {
        (0..by).fold(mask.clone(), |mut mask, _| {
            let mut free = BitMask::empty(mask.width(), mask.height());
            free.insert_all(&mask, occupied);
            mask.insert_all(&free.dilated(), occupied);
            mask
        })
    };
    masks.iter().zip(occupied).map(widen).collect()
}
