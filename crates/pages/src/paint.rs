//! Copies texels into pages, with gutters that survive bilinear look-up.

use farfield_grid::{Grid, Rect};

/// Texels around every rectangle on a page.
pub const GUTTER: u32 = 1;

/// A rectangle of a layer and where it lies in the atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Index of the layer.
    pub layer: u32,
    /// Its texels, without the gutter.
    pub rect: Rect,
    /// Index of the page.
    pub page: u32,
    /// Column of the page where the gutter begins.
    pub x: u32,
    /// Row of the page where the gutter begins.
    pub y: u32,
}

/// The opaque texels of a layer of `width` x `height` texels; all others are transparent.
#[derive(Clone, Copy, Debug)]
pub struct LayerTexels<'a> {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Column and row of each opaque texel.
    pub positions: &'a [[u16; 2]],
    /// sRGB, in the order of `positions`.
    pub colors: &'a [[u8; 3]],
}

/// A transparent page of RGBA texels.
pub fn blank_page([width, height]: [u32; 2]) -> Grid<[u8; 4]> {
    Grid::filled(width as usize, height as usize, [0; 4])
}

/// Copies the patches of one layer, each with its gutter, into pages of sRGB colour and straight
/// alpha.
///
/// The gutter holds the layer's real neighbours, opaque where they are. Transparent texels next to
/// opaque ones get their mean colour, so that bilinear look-up mixes no foreign colour in; others
/// stay zero.
///
/// * `patches` - of this layer; of others they would show the wrong texels
/// * `scratch` - transparent, of the layer's size; left as it was found, for the next layer
///
/// # Panics
///
/// When a patch reaches out of its page or its layer, or `scratch` is not of the layer's size.
pub fn paint(
    layer: &LayerTexels<'_>,
    patches: &[Patch],
    pages: &mut [Grid<[u8; 4]>],
    scratch: &mut Grid<[u8; 4]>,
) {
    let (width, height) = (layer.width as usize, layer.height as usize);
    assert_eq!((scratch.width(), scratch.height()), (width, height));
    let at = |[x, y]: &[u16; 2]| (usize::from(*x), usize::from(*y));
    for (position, &[r, g, b]) in layer.positions.iter().zip(layer.colors) {
        scratch[at(position)] = [r, g, b, 255];
    }
    for patch in patches {
        let page = &mut pages[patch.page as usize];
        for row in 0..patch.rect.height + 2 * GUTTER {
            for column in 0..patch.rect.width + 2 * GUTTER {
                let x = i64::from(patch.rect.x) + i64::from(column) - i64::from(GUTTER);
                let y = i64::from(patch.rect.y) + i64::from(row) - i64::from(GUTTER);
                page[((patch.x + column) as usize, (patch.y + row) as usize)] =
                    dilated(scratch, x, y);
            }
        }
    }
    for position in layer.positions {
        scratch[at(position)] = [0; 4];
    }
}

/// The texel at (x, y), also outside of the layer; a transparent one gets the mean colour of its
/// opaque neighbours.
fn dilated(texels: &Grid<[u8; 4]>, x: i64, y: i64) -> [u8; 4] {
    let texel = |x: i64, y: i64| {
        let inside =
            (0..texels.width() as i64).contains(&x) && (0..texels.height() as i64).contains(&y);
        if inside {
            texels[(x as usize, y as usize)]
        } else {
            [0; 4]
        }
    };
    let center = texel(x, y);
    if center[3] != 0 {
        return center;
    }
    let (mut sum, mut count) = ([0u32; 3], 0u32);
    for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
        let [r, g, b, a] = texel(x + dx, y + dy);
        if a != 0 {
            count += 1;
            sum = [
                sum[0] + u32::from(r),
                sum[1] + u32::from(g),
                sum[2] + u32::from(b),
            ];
        }
    }
    let mean = |channel: u32| channel.checked_div(count).unwrap_or(0) as u8;
    [mean(sum[0]), mean(sum[1]), mean(sum[2]), 0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A page shows, in every patch and its gutter, exactly the layer's texels; scratch is
        /// transparent again; outside of patches the page stays blank.
        #[test]
        fn patches_show_their_layer(
            opaque in prop::collection::vec(any::<bool>(), 8 * 6),
            x in 0..8u32, y in 0..6u32, w in 1..8u32, h in 1..6u32, px in 0..4u32, py in 0..4u32,
        ) {
            let rect = Rect { x, y, width: w.min(8 - x), height: h.min(6 - y) };
            let positions: Vec<[u16; 2]> = (0..48u16).filter(|i| opaque[usize::from(*i)])
                .map(|i| [i % 8, i / 8]).collect();
            let colors: Vec<[u8; 3]> =
                positions.iter().map(|[x, y]| [*x as u8 * 8, *y as u8 * 8, 7]).collect();
            let layer = LayerTexels { width: 8, height: 6, positions: &positions, colors: &colors };
            let mut pages = vec![blank_page([16, 12])];
            let mut scratch = Grid::filled(8, 6, [0; 4]);
            let patch = Patch { layer: 0, rect, page: 0, x: px, y: py };
            paint(&layer, &[patch], &mut pages, &mut scratch);

            prop_assert!(scratch.cells().iter().all(|t| *t == [0; 4]));
            let padded = Rect { x: px, y: py, width: rect.width + 2, height: rect.height + 2 };
            for row in 0..12 {
                for column in 0..16 {
                    let texel = pages[0][(column, row)];
                    let (lx, ly) = (
                        column as i64 - i64::from(px) + i64::from(rect.x) - 1,
                        row as i64 - i64::from(py) + i64::from(rect.y) - 1,
                    );
                    let set = (0..8).contains(&lx) && (0..6).contains(&ly)
                        && opaque[(ly * 8 + lx) as usize];
                    if !padded.contains(column as u32, row as u32) {
                        prop_assert_eq!(texel, [0; 4]);
                    } else if set {
                        prop_assert_eq!(texel, [lx as u8 * 8, ly as u8 * 8, 7, 255]);
                    } else {
                        prop_assert_eq!(texel[3], 0);
                    }
                }
            }
        }
    }

    #[test]
    fn transparent_neighbours_take_on_the_mean_colour() {
        let layer = LayerTexels {
            width: 3,
            height: 1,
            positions: &[[0, 0], [2, 0]],
            colors: &[[10, 20, 30], [30, 40, 50]],
        };
        let mut pages = vec![blank_page([8, 4])];
        let patch = Patch {
            layer: 0,
            rect: Rect {
                x: 0,
                y: 0,
                width: 3,
                height: 1,
            },
            page: 0,
            x: 0,
            y: 0,
        };
        paint(
            &layer,
            &[patch],
            &mut pages,
            &mut Grid::filled(3, 1, [0; 4]),
        );
        assert_eq!(pages[0][(2, 1)], [20, 30, 40, 0]);
        assert_eq!(pages[0][(0, 0)], [10, 20, 30, 0]);
    }
}
