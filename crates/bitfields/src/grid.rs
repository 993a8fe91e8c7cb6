//! View cells side by side.

use farfield_views::ViewCell;
use glam::DVec3;

/// A box of view cells of the same size, row by row.
///
/// Each has a set ([`cell_set`](crate::cell_set)); all share the order of their patches
/// ([`cell_patches`](crate::cell_patches)) and have a list of ranges each, by the cell's index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellGrid {
    /// The least corner of the first cell, in metres.
    pub min: DVec3,
    /// Full lengths of a cell's sides, in metres, all positive.
    pub size: DVec3,
    /// Cells along each axis.
    pub counts: [u32; 3],
}

impl CellGrid {
    /// The cells, ascending in x first, then in y, then in z.
    pub fn cells(&self) -> impl Iterator<Item = ViewCell> {
        let Self { min, size, counts } = *self;
        let [columns, rows, layers] = counts;
        let all = (0..layers).flat_map(move |z| {
            (0..rows).flat_map(move |y| {
                (0..columns).map(move |x| DVec3::new(x.into(), y.into(), z.into()))
            })
        });
        all.map(move |at| ViewCell::Box {
            center: min + (at + 0.5) * size,
            size,
        })
    }

    /// The index of the cell that contains a viewpoint, in metres; of those that share a border,
    /// the one behind it. `None` outside of the grid.
    pub fn index(&self, viewpoint: DVec3) -> Option<u32> {
        let at = ((viewpoint - self.min) / self.size).to_array();
        let [x, y, z] = std::array::from_fn(|axis| {
            let count = self.counts[axis];
            let inside = at[axis] >= 0.0 && at[axis] <= f64::from(count) && count > 0;
            // The outermost border has no cell behind it.
            inside.then(|| (at[axis] as u32).min(count - 1))
        });
        let [columns, rows, _] = self.counts;
        Some((z? * rows + y?) * columns + x?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A viewpoint is in the cell that has its index, and outside of all cells if it has none.
        #[test]
        fn a_viewpoint_is_in_its_cell(
            min in prop::array::uniform3(-99.0..99.0f64),
            size in prop::array::uniform3(0.1..9.0f64),
            counts in prop::array::uniform3(0..5u32),
            place in prop::array::uniform3(prop_oneof![
                -1.0..6.0f64,
                (0..6u32).prop_map(f64::from),
            ]),
        ) {
            let [min, size, place] = [min, size, place].map(DVec3::from);
            let grid = CellGrid { min, size, counts };
            let viewpoint = min + place * size;
            let cells: Vec<ViewCell> = grid.cells().collect();
            prop_assert_eq!(cells.len() as u32, counts.iter().product::<u32>());
            // Coordinates of some 150 m are rounded a few times.
            const ROUNDING: f64 = 1e-12;
            match grid.index(viewpoint) {
                Some(index) => prop_assert!(cells[index as usize].contains(viewpoint, ROUNDING)),
                None => prop_assert!(cells.iter().all(|c| !c.contains(viewpoint, -ROUNDING))),
            }
        }
    }

    #[test]
    fn what_is_no_place_is_in_no_cell() {
        let grid = CellGrid {
            min: DVec3::ZERO,
            size: DVec3::ONE,
            counts: [1; 3],
        };
        assert_eq!(grid.index(DVec3::NAN), None);
        assert_eq!(grid.index(DVec3::INFINITY), None);
        assert_eq!(grid.index(DVec3::ONE), Some(0));
    }
}
