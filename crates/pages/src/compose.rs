//! Copies texels from pages back into a layer.

use crate::paint::{GUTTER, Patch};
use farfield_grid::Grid;
use farfield_scene::Image;

/// A layer as its patches show it, the inverse of [`paint`](crate::paint()): `width` x `height`
/// texels of sRGB colour and straight alpha, zero where no patch shows anything.
///
/// Where patches overlap, the most opaque texel counts, of equals the first.
///
/// * `patches` - of this layer; of others they would show the wrong texels
/// * `pages` - the images that the patches' pages are indices of
///
/// # Panics
///
/// When a patch reaches out of its page or of the layer.
pub fn compose_layer(
    patches: &[Patch],
    pages: &[Image],
    [width, height]: [u32; 2],
) -> Grid<[u8; 4]> {
    let mut layer = Grid::filled(width as usize, height as usize, [0; 4]);
    for Patch {
        rect, page, x, y, ..
    } in patches
    {
        let page = &pages[*page as usize];
        let (columns, left) = (rect.width as usize, (x + GUTTER) as usize);
        for row in 0..rect.height as usize {
            let page_row = (*y + GUTTER) as usize + row;
            let shown = &page.texels[page_row * page.width as usize..][..page.width as usize];
            let hidden = &mut layer.row_mut(rect.y as usize + row)[rect.x as usize..];
            for (to, from) in hidden[..columns].iter_mut().zip(&shown[left..][..columns]) {
                if from[3] > to[3] {
                    *to = *from;
                }
            }
        }
    }
    layer
}

/// Column and row of each texel of a layer that its patches show at least half opaque, row by row
/// from the top left, each once.
///
/// Memory follows the texels, whatever the size of the layer.
///
/// * `patches` - of this layer
/// * `pages` - the images that the patches' pages are indices of
///
/// # Panics
///
/// When a patch reaches out of its page, or beyond column or row 65,535 of the layer.
pub fn opaque_texels(patches: &[Patch], pages: &[Image]) -> Vec<[u16; 2]> {
    let mut texels = Vec::new();
    for Patch {
        rect, page, x, y, ..
    } in patches
    {
        let page = &pages[*page as usize];
        for (row, column) in (0..rect.height).flat_map(|row| (0..rect.width).map(move |c| (row, c)))
        {
            let shown = (y + GUTTER + row) as usize * page.width as usize;
            if page.texels[shown + (x + GUTTER + column) as usize][3] >= 128 {
                let at = [rect.x + column, rect.y + row];
                texels
                    .push(at.map(|i| u16::try_from(i).expect("layers have 65,536 texels a side")));
            }
        }
    }
    texels.sort_unstable_by_key(|[x, y]| (*y, *x));
    texels.dedup();
    texels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LayerTexels, blank_page, paint};
    use farfield_grid::Rect;
    use proptest::prelude::*;

    proptest! {
        /// A layer that is painted is composed again: every opaque texel that lies in a patch is
        /// as it was, all else is empty; patches may overlap.
        #[test]
        fn painted_layers_are_composed(
            opaque in prop::collection::vec(any::<bool>(), 8 * 6),
            rects in prop::collection::vec((0..8u32, 0..6u32, 1..8u32, 1..6u32, 0..2u32), 0..4),
        ) {
            let positions: Vec<[u16; 2]> = (0..48u16).filter(|i| opaque[usize::from(*i)])
                .map(|i| [i % 8, i / 8]).collect();
            let colors: Vec<[u8; 3]> =
                positions.iter().map(|[x, y]| [*x as u8 * 8, *y as u8 * 8, 7]).collect();
            let layer = LayerTexels { width: 8, height: 6, positions: &positions, colors: &colors };
            let patches: Vec<Patch> = rects.iter().zip(0..).map(|((x, y, w, h, page), i)| {
                let rect = Rect { x: *x, y: *y, width: *w.min(&(8 - x)), height: *h.min(&(6 - y)) };
                Patch { layer: 0, rect, page: *page, x: i * 10, y: i }
            }).collect();
            let mut pages = vec![blank_page([40, 12]); 2];
            paint(&layer, &patches, &mut pages, &mut Grid::filled(8, 6, [0; 4]));

            let images: Vec<Image> = pages.iter().map(|page| Image {
                name: String::new(),
                width: page.width() as u32,
                height: page.height() as u32,
                texels: page.cells().to_vec(),
            }).collect();
            let composed = compose_layer(&patches, &images, [8, 6]);
            for i in 0..48u32 {
                let (x, y) = (i % 8, i / 8);
                let shown = opaque[i as usize] && patches.iter().any(|p| p.rect.contains(x, y));
                let expected = if shown { [x as u8 * 8, y as u8 * 8, 7, 255] } else { [0; 4] };
                prop_assert_eq!(composed[(x as usize, y as usize)], expected);
            }
            let is_shown = |[x, y]: &[u16; 2]| composed[((*x).into(), (*y).into())][3] != 0;
            let shown: Vec<[u16; 2]> =
                (0..48).map(|i| [i % 8, i / 8]).filter(is_shown).collect();
            prop_assert_eq!(opaque_texels(&patches, &images), shown);
        }
    }
}
