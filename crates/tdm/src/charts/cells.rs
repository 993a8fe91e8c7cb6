//! Where triangles lie in a plane, for finding those near another.

use super::plane::overlap;
use glam::DVec2;
use std::collections::BTreeSet;

/// Triangles by where the middles of their bounding boxes are, in grids of squares as large as the
/// boxes, or up to twice: level, row, column and triangle.
#[derive(Debug, Default)]
pub(super) struct Cells {
    triangles: BTreeSet<(i32, i32, i32, u32)>,
}

impl Cells {
    /// Adds a triangle unless it overlaps another, all of them placed by `places`.
    pub(super) fn insert_apart(
        &mut self,
        triangle: u32,
        places: impl Fn(u32) -> [DVec2; 3],
    ) -> bool {
        let corners = places(triangle);
        let (least, most) = bounds(corners);
        let mut near = self.near(least, most);
        let apart = !near.any(|other| overlap(corners, places(other)));
        drop(near);
        if apart {
            self.triangles.insert(cell(triangle, corners));
        }
        apart
    }

    pub(super) fn remove(&mut self, triangle: u32, corners: [DVec2; 3]) {
        self.triangles.remove(&cell(triangle, corners));
    }

    /// All whose bounding boxes meet a box, and some that only nearly do.
    fn near(&self, least: DVec2, most: DVec2) -> impl Iterator<Item = u32> {
        let level_from = |level| Some(self.triangles.range((level, i32::MIN, 0, 0)..).next()?.0);
        let levels = std::iter::successors(level_from(i32::MIN), move |l| level_from(l + 1));
        levels.flat_map(move |level| {
            let square = f64::from(level).exp2();
            let at = |p: DVec2| (p / square).floor().to_array().map(|i| i as i32);
            let [left, top] = at(least - square / 2.0);
            let [right, bottom] = at(most + square / 2.0);
            let row_from = move |row: i32| {
                let next = self.triangles.range((level, row, left, 0)..).next()?;
                (next.0 == level && next.1 <= bottom).then_some(next.1)
            };
            // Rows without a triangle are passed over.
            let rows = std::iter::successors(row_from(top), move |row| row_from(row + 1));
            rows.flat_map(move |row| {
                let ends = (level, row, left, 0)..=(level, row, right, u32::MAX);
                self.triangles.range(ends).map(|cell| cell.3)
            })
        })
    }
}

fn bounds([a, b, c]: [DVec2; 3]) -> (DVec2, DVec2) {
    (a.min(b).min(c), a.max(b).max(c))
}

fn cell(triangle: u32, corners: [DVec2; 3]) -> (i32, i32, i32, u32) {
    let (least, most) = bounds(corners);
    // A sliver's box may be as small as can be.
    let level = (most - least).max_element().max(1e-3).log2().ceil();
    let middle = ((least + most) / 2.0 / level.exp2()).floor();
    (level as i32, middle.y as i32, middle.x as i32, triangle)
}
