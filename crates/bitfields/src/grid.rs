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
        let counts = DVec3::from(self.counts.map(f64::from));
        let at = self.cells_from_min(viewpoint);
        let is_inside =
            counts.min_element() > 0.0 && at.cmpge(DVec3::ZERO).all() && at.cmple(counts).all();
        is_inside.then(|| self.nearest(viewpoint))
    }

    /// The index of the cell that contains a viewpoint, in metres, or of the nearest one to a viewpoint
    /// outside of the grid.
    ///
    /// Far from the origin the borders of cells are rounded, and so are viewpoints on them: there is
    /// a cell for these in any case, and it contains them but for that rounding.
    ///
    /// # Panics
    ///
    /// When there is no cell, or a coordinate is not a number.
    pub fn nearest(&self, viewpoint: DVec3) -> u32 {
        assert!(!viewpoint.is_nan(), "{viewpoint} is no viewpoint");
        assert!(!self.counts.contains(&0), "{self:?} has no cell");
        let at = self.cells_from_min(viewpoint).to_array();
        // What is negative becomes 0, and the outermost border has no cell behind it.
        let [x, y, z] = std::array::from_fn(|axis| (at[axis] as u32).min(self.counts[axis] - 1));
        let [columns, rows, _] = self.counts;
        (z * rows + y) * columns + x
    }

    /// Where a viewpoint is, as a number of cells along each axis from the least corner.
    fn cells_from_min(&self, viewpoint: DVec3) -> DVec3 {
        (viewpoint - self.min) / self.size
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

        /// The nearest cell of any viewpoint, inside or outside, is as near as any other.
        #[test]
        fn no_cell_is_nearer_than_the_nearest(
            min in prop::array::uniform3(-99.0..99.0f64),
            size in prop::array::uniform3(0.1..9.0f64),
            counts in prop::array::uniform3(1..5u32),
            place in prop::array::uniform3(-3.0..8.0f64),
        ) {
            let [min, size, place] = [min, size, place].map(DVec3::from);
            let grid = CellGrid { min, size, counts };
            let viewpoint = min + place * size;
            let distance = |cell: ViewCell| {
                let beyond = (viewpoint - cell.center()).abs() - size / 2.0;
                beyond.max(DVec3::ZERO).length()
            };
            let distances: Vec<f64> = grid.cells().map(distance).collect();
            let nearest = distances[grid.nearest(viewpoint) as usize];
            // As above.
            prop_assert!(distances.iter().all(|distance| nearest <= distance + 1e-12));
        }

        /// However far from the origin a box is, each viewpoint on its borders has a cell, which
        /// contains it but for rounding.
        #[test]
        fn far_from_the_origin_borders_have_cells(
            center in prop::array::uniform3(-1e7..1e7f64),
            size in prop::array::uniform3(0.1..0.7f64),
            counts in prop::array::uniform3(1..5u32),
            seed: u64,
        ) {
            let [center, size] = [center, size].map(DVec3::from);
            let grid = CellGrid {
                min: center - size / 2.0,
                size: size / DVec3::from(counts.map(f64::from)),
                counts,
            };
            let cells: Vec<ViewCell> = grid.cells().collect();
            for index in 0..50 {
                let viewpoint = ViewCell::Box { center, size }.viewpoint_to_border(index, seed);
                let cell = cells[grid.nearest(viewpoint) as usize];
                // Coordinates up to 1e7 m have spacings of up to 2e-9 m; the least corner, the
                // centre of the cell and the viewpoint are rounded to halves of it.
                prop_assert!(cell.contains(viewpoint, 3e-9));
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
        assert_eq!(grid.nearest(DVec3::INFINITY), 0);
    }

    #[test]
    #[should_panic(expected = "is no viewpoint")]
    fn what_is_no_number_has_no_nearest_cell() {
        let grid = CellGrid {
            min: DVec3::ZERO,
            size: DVec3::ONE,
            counts: [2; 3],
        };
        grid.nearest(DVec3::new(0.0, f64::NAN, 0.0));
    }
}
