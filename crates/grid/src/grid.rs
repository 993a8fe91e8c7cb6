//! Two-dimensional arrays.

use std::ops::{Index, IndexMut};

/// A `width` x `height` array, row by row from the top left.
///
/// Invariant: there are exactly `width * height` cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    width: usize,
    height: usize,
    cells: Vec<T>,
}

impl<T> Grid<T> {
    /// The grid whose rows, from the top, follow each other in `cells`.
    ///
    /// # Panics
    ///
    /// When `cells` does not hold `width * height` cells.
    pub fn from_cells(width: usize, height: usize, cells: Vec<T>) -> Self {
        assert!(
            width.checked_mul(height) == Some(cells.len()),
            "a grid of {width} x {height} cannot hold {} cells",
            cells.len()
        );
        Self {
            width,
            height,
            cells,
        }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All cells, row by row from the top left.
    pub fn cells(&self) -> &[T] {
        &self.cells
    }

    /// All cells, row by row from the top left.
    pub fn cells_mut(&mut self) -> &mut [T] {
        &mut self.cells
    }

    /// Row `y`, from the left.
    ///
    /// # Panics
    ///
    /// When `y` is not below the height.
    pub fn row(&self, y: usize) -> &[T] {
        &self.cells[y * self.width..][..self.width]
    }

    /// Row `y`, from the left.
    ///
    /// # Panics
    ///
    /// When `y` is not below the height.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.cells[y * self.width..][..self.width]
    }
}

impl<T: Clone> Grid<T> {
    /// A grid of `width` x `height` copies of `value`.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self {
            width,
            height,
            cells: vec![value; width * height],
        }
    }
}

impl<T> Index<(usize, usize)> for Grid<T> {
    type Output = T;

    /// The cell in column `x` and row `y`.
    fn index(&self, (x, y): (usize, usize)) -> &T {
        &self.row(y)[x]
    }
}

impl<T> IndexMut<(usize, usize)> for Grid<T> {
    fn index_mut(&mut self, (x, y): (usize, usize)) -> &mut T {
        &mut self.row_mut(y)[x]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_each_other() {
        let grid = Grid::from_cells(3, 2, vec![0, 1, 2, 10, 11, 12]);
        assert_eq!(grid.row(1), [10, 11, 12]);
        assert_eq!(grid[(2, 0)], 2);
        assert_eq!(grid[(0, 1)], 10);
    }

    #[test]
    #[should_panic(expected = "index out of bounds")]
    fn a_column_outside_panics_instead_of_wrapping() {
        let grid = Grid::filled(3, 2, 0);
        let _ = grid[(3, 0)];
    }
}
