//! Bounds, and the opaque texels in them line by line.

use farfield_grid::{BitMask, Rect};

/// The texels of the columns `left..right` in the rows `top..bottom`, at least one of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) right: u32,
    pub(crate) bottom: u32,
}

impl Area {
    pub(crate) fn from_rect(r: Rect) -> Self {
        Self {
            left: r.x,
            top: r.y,
            right: r.right(),
            bottom: r.bottom(),
        }
    }

    pub(crate) fn rect(self) -> Rect {
        Rect {
            x: self.left,
            y: self.top,
            width: self.width(),
            height: self.height(),
        }
    }

    pub(crate) fn width(&self) -> u32 {
        self.right - self.left
    }

    pub(crate) fn height(&self) -> u32 {
        self.bottom - self.top
    }

    /// Texels with the gutter, and the price of a quad in texels.
    pub(crate) fn cost(&self, quad: f64) -> f64 {
        f64::from(self.width() + 2) * f64::from(self.height() + 2) + quad
    }

    pub(crate) fn meets(&self, other: &Area) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    /// The smallest area around both.
    pub(crate) fn join(&self, other: &Area) -> Area {
        Area {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }

    /// `margin` texels more on every side, as far as there are columns and rows left and above.
    pub(crate) fn grown(&self, margin: u32) -> Area {
        Area {
            left: self.left.saturating_sub(margin),
            top: self.top.saturating_sub(margin),
            right: self.right.saturating_add(margin),
            bottom: self.bottom.saturating_add(margin),
        }
    }

    /// Rows and columns exchanged.
    pub(crate) fn transposed(&self) -> Area {
        Area {
            left: self.top,
            top: self.left,
            right: self.bottom,
            bottom: self.right,
        }
    }
}

/// The opaque texels of one row within an area: their number, and the columns
/// `first..end` that hold them all (`first` is above `end` when there are none).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) first: u32,
    pub(crate) end: u32,
    pub(crate) count: u32,
}

/// Writes the rows of `area` to `lines`, from the top.
pub(crate) fn read_lines(mask: &BitMask, area: Area, lines: &mut Vec<Line>) {
    let first_word = area.left / 64;
    let words = first_word as usize..(area.right as usize).div_ceil(64);
    let first_bits = u64::MAX << (area.left % 64);
    let last_bits = u64::MAX >> ((64 - area.right % 64) % 64);
    lines.clear();
    for y in area.top..area.bottom {
        let row = &mask.row(y as usize)[words.clone()];
        let mut line = Line {
            first: u32::MAX,
            end: 0,
            count: 0,
        };
        for (i, &word) in row.iter().enumerate() {
            let from_left = if i == 0 { first_bits } else { u64::MAX };
            let to_right = if i + 1 == row.len() {
                last_bits
            } else {
                u64::MAX
            };
            line.add(word & from_left & to_right, first_word + i as u32);
        }
        lines.push(line);
    }
}

impl Line {
    /// Adds the texels of word `index`, right of all so far.
    fn add(&mut self, word: u64, index: u32) {
        if word != 0 {
            self.first = self.first.min(index * 64 + word.trailing_zeros());
            self.end = index * 64 + 64 - word.leading_zeros();
            self.count += word.count_ones();
        }
    }
}

/// The smallest area around the opaque texels of `area`, or `None` when it has none.
pub(crate) fn shrink(mask: &BitMask, area: Area, lines: &mut Vec<Line>) -> Option<Area> {
    read_lines(mask, area, lines);
    let top = lines.iter().position(|l| l.count > 0)?;
    let bottom = lines.iter().rposition(|l| l.count > 0)? + 1;
    Some(Area {
        left: lines.iter().map(|l| l.first).min()?,
        top: area.top + top as u32,
        right: lines.iter().map(|l| l.end).max()?,
        bottom: area.top + bottom as u32,
    })
}

/// The mask with rows and columns exchanged, 64 x 64 texels at a time.
pub(crate) fn transpose(mask: &BitMask) -> BitMask {
    let (width, height) = (mask.width(), mask.height());
    let mut out = BitMask::empty(height, width);
    let n = out.words_per_row();
    let mut rows = vec![0u64; 64 * n];
    for column in 0..mask.words_per_row() {
        for tile in 0..n {
            let mut bits = [0u64; 64];
            for (y, bits) in (tile * 64..height).zip(&mut bits) {
                *bits = mask.row(y)[column];
            }
            transpose_tile(&mut bits);
            for (x, bits) in bits.iter().enumerate() {
                rows[x * n + tile] = *bits;
            }
        }
        for x in column * 64..width.min(column * 64 + 64) {
            out.set_row(x, &rows[x % 64 * n..][..n]);
        }
    }
    out
}

/// Exchanges bit x of word y with bit y of word x: first the off-diagonal quarters of
/// 32 x 32 bits, then those of their quarters, down to single bits.
fn transpose_tile(tile: &mut [u64; 64]) {
    if tile.iter().all(|&w| w == 0) {
        return;
    }
    let (mut size, mut low) = (32, u64::from(u32::MAX));
    while size > 0 {
        for y in (0..64).filter(|y| y & size == 0) {
            let swap = ((tile[y] >> size) ^ tile[y + size]) & low;
            tile[y] ^= swap << size;
            tile[y + size] ^= swap;
        }
        size /= 2;
        low ^= low << size;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::masks;
    use proptest::prelude::*;

    proptest! {
        /// Texel (x, y) of the mask is texel (y, x) of the transposed one.
        #[test]
        fn transposing_exchanges_rows_and_columns(mask in masks()) {
            let transposed = transpose(&mask);
            prop_assert_eq!((transposed.width(), transposed.height()), (mask.height(), mask.width()));
            let mut expected: Vec<_> = mask.iter().map(|(x, y)| (y, x)).collect();
            expected.sort_by_key(|&(x, y)| (y, x));
            prop_assert_eq!(transposed.iter().collect::<Vec<_>>(), expected);
        }

        /// Lines and tight bounds agree with looking at every texel of the area.
        #[test]
        fn lines_agree_with_single_texels(mask in masks(), f in any::<[u32; 4]>()) {
            let (w, h) = (mask.width() as u32, mask.height() as u32);
            let (left, top) = (f[0] % w, f[1] % h);
            let area = Area {
                left,
                top,
                right: left + 1 + f[2] % (w - left),
                bottom: top + 1 + f[3] % (h - top),
            };
            let mut lines = Vec::new();
            let shrunk = shrink(&mask, area, &mut lines);
            prop_assert_eq!(lines.len(), area.height() as usize);
            let inside: Vec<(u32, u32)> = mask
                .iter()
                .map(|(x, y)| (x as u32, y as u32))
                .filter(|&(x, y)| area.rect().contains(x, y))
                .collect();
            for (line, y) in lines.iter().zip(top..) {
                let xs: Vec<u32> = inside.iter().filter(|t| t.1 == y).map(|t| t.0).collect();
                prop_assert_eq!(line.count as usize, xs.len());
                prop_assert_eq!(line.first, xs.first().copied().unwrap_or(u32::MAX));
                prop_assert_eq!(line.end, xs.last().map_or(0, |x| x + 1));
            }
            let bounds = inside
                .iter()
                .map(|&(x, y)| Area { left: x, top: y, right: x + 1, bottom: y + 1 })
                .reduce(|a, b| a.join(&b));
            prop_assert_eq!(shrunk, bounds);
        }
    }
}
