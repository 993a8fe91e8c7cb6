//! The cheapest rectangles we can find.

use crate::Price;
use crate::area::{Area, transpose};
use crate::rework::rework;
use crate::split::{Scratch, Search, Sheet};
use farfield_grid::{BitMask, Rect};

/// todo
pub fn cover(mask: &BitMask, price: &Price) -> Vec<Rect> {
    let quad = price.texels_per_quad();
    let Some(bounds) = mask.bounds() else {
        return Vec::new();
    };
    let sheet = Sheet {
        rows: mask.clone(),
        columns: transpose(mask),
    };
    let mut search = Search {
        sheet: &sheet,
        taken: &[],
        quad,
        scratch: &mut Scratch::default(),
        work: 0,
    };
    let mut areas = Vec::new();
    search.split(Area::from_rect(bounds), &mut areas);
    let mut areas = rework(mask, quad, areas);
    areas.sort_unstable_by_key(|a| (a.top, a.left));
    areas.into_iter().map(Area::rect).collect()
}
