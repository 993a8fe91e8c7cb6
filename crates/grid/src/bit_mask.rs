//! Bit masks, 64 texels a word.

use crate::Rect;

/// One bit per texel of a `width` x `height` grid, 64 texels a word.
///
/// ```text
/// texel  0 1 2 … 63 | 64 65 …  w-1  -  -
/// bit    0 1 2 … 63 |  0  1 …       0  0     every row starts a new word
/// ```
///
/// Invariant: the bits from `width` to the end of a row's last word are zero, so whole
/// words can be counted, shifted and compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BitMask {
    width: usize,
    height: usize,
    words: Vec<u64>,
}

impl BitMask {
    /// The mask without any texel.
    pub fn empty(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            words: vec![0; width.div_ceil(64) * height],
        }
    }

    /// The mask of all texels.
    pub fn full(width: usize, height: usize) -> Self {
        let mut mask = Self::empty(width, height);
        let row = vec![u64::MAX; mask.words_per_row()];
        (0..height).for_each(|y| mask.set_row(y, &row));
        mask
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Words in a row.
    pub fn words_per_row(&self) -> usize {
        self.width.div_ceil(64)
    }

    /// The words of row `y`, from the left; texel x is bit x % 64 of word x / 64.
    ///
    /// # Panics
    ///
    /// When `y` is not below the height.
    pub fn row(&self, y: usize) -> &[u64] {
        let n = self.words_per_row();
        &self.words[y * n..][..n]
    }

    /// Replaces row `y`; bits beyond the width are ignored.
    ///
    /// # Panics
    ///
    /// When `y` is not below the height or `words` is not one row long.
    pub fn set_row(&mut self, y: usize, words: &[u64]) {
        let n = self.words_per_row();
        let row = &mut self.words[y * n..][..n];
        row.copy_from_slice(words);
        if let Some(last) = row.last_mut()
            && !self.width.is_multiple_of(64)
        {
            *last &= (1 << (self.width % 64)) - 1;
        }
    }

    /// Whether texel (x, y) is in the mask.
    ///
    /// # Panics
    ///
    /// When the texel lies outside the grid.
    pub fn contains(&self, x: usize, y: usize) -> bool {
        self.words[self.word(x, y)] >> (x % 64) & 1 != 0
    }

    /// Adds texel (x, y).
    ///
    /// # Panics
    ///
    /// When the texel lies outside the grid.
    pub fn insert(&mut self, x: usize, y: usize) {
        let word = self.word(x, y);
        self.words[word] |= 1 << (x % 64);
    }

    /// Removes texel (x, y).
    ///
    /// # Panics
    ///
    /// When the texel lies outside the grid.
    pub fn remove(&mut self, x: usize, y: usize) {
        let word = self.word(x, y);
        self.words[word] &= !(1 << (x % 64));
    }

    /// The mask and the neighbours of its texels: left, right, above and below.
    pub fn dilated(&self) -> Self {
        let n = self.words_per_row();
        let mut dilated = self.clone();
        let mut row = vec![0; n];
        for y in 0..self.height {
            let here = self.row(y);
            for i in 0..n {
                let right = here.get(i + 1).map_or(0, |next| next << 63);
                let left = if i > 0 { here[i - 1] >> 63 } else { 0 };
                row[i] = here[i] | here[i] << 1 | left | here[i] >> 1 | right;
            }
            for other in [y.checked_sub(1), Some(y + 1).filter(|y| *y < self.height)] {
                let words = other.map_or(&[][..], |y| self.row(y));
                row.iter_mut()
                    .zip(words)
                    .for_each(|(word, more)| *word |= more);
            }
            dilated.set_row(y, &row);
        }
        dilated
    }

    /// Adds the texels of another mask, less those of a third.
    ///
    /// # Panics
    ///
    /// When the masks are not equally large.
    pub fn insert_all(&mut self, other: &Self, but: &Self) {
        for mask in [other, but] {
            assert_eq!((mask.width, mask.height), (self.width, self.height));
        }
        let both = other.words.iter().zip(&but.words);
        let words = self.words.iter_mut().zip(both);
        words.for_each(|(word, (more, but))| *word |= more & !but);
    }

    /// Number of texels in the mask.
    pub fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Number of texels of `rect` in the mask.
    ///
    /// # Panics
    ///
    /// When `rect` reaches out of the grid.
    pub fn count_in(&self, rect: Rect) -> usize {
        self.spans(rect)
            .map(|(word, bits)| (self.words[word] & bits).count_ones() as usize)
            .sum()
    }

    /// Removes all texels of `rect`.
    ///
    /// # Panics
    ///
    /// When `rect` reaches out of the grid.
    pub fn remove_rect(&mut self, rect: Rect) {
        for (word, bits) in self.spans(rect).collect::<Vec<_>>() {
            self.words[word] &= !bits;
        }
    }

    /// All texels (x, y) in the mask, row by row from the top left.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let n = self.words_per_row();
        self.words.iter().enumerate().flat_map(move |(i, &word)| {
            let (y, first) = (i / n, i % n * 64);
            let nonzero = |rest: u64| (rest != 0).then_some(rest);
            std::iter::successors(nonzero(word), move |rest| nonzero(rest & (rest - 1)))
                .map(move |rest| (first + rest.trailing_zeros() as usize, y))
        })
    }

    /// The smallest rectangle around all texels in the mask, or `None` when it is empty.
    pub fn bounds(&self) -> Option<Rect> {
        let rows = |y: &usize| self.row(*y).iter().any(|&w| w != 0);
        let top = (0..self.height).find(rows)?;
        let bottom = (0..self.height).rev().find(rows)?;
        let (mut left, mut right) = (usize::MAX, 0);
        for y in top..=bottom {
            let row = self.row(y);
            if let Some(i) = row.iter().position(|&w| w != 0) {
                left = left.min(i * 64 + row[i].trailing_zeros() as usize);
            }
            if let Some(i) = row.iter().rposition(|&w| w != 0) {
                right = right.max(i * 64 + 63 - row[i].leading_zeros() as usize);
            }
        }
        Some(Rect {
            x: left as u32,
            y: top as u32,
            width: (right - left + 1) as u32,
            height: (bottom - top + 1) as u32,
        })
    }

    fn word(&self, x: usize, y: usize) -> usize {
        assert!(
            x < self.width && y < self.height,
            "texel ({x}, {y}) lies outside a mask of {} x {}",
            self.width,
            self.height
        );
        y * self.words_per_row() + x / 64
    }

    /// The words that hold texels of `rect`, each with the bits of those texels.
    fn spans(&self, rect: Rect) -> impl Iterator<Item = (usize, u64)> + use<> {
        assert!(
            rect.right() as usize <= self.width && rect.bottom() as usize <= self.height,
            "{rect:?} reaches out of a mask of {} x {}",
            self.width,
            self.height
        );
        let n = self.words_per_row();
        let (left, right) = (rect.x as usize, rect.right() as usize);
        let words = if left < right {
            left / 64..right.div_ceil(64)
        } else {
            0..0
        };
        (rect.y as usize..rect.bottom() as usize).flat_map(move |y| {
            words.clone().map(move |i| {
                let from = left.max(i * 64) % 64;
                let below = right.min(i * 64 + 64) - i * 64;
                (y * n + i, (u64::MAX << from) & (u64::MAX >> (64 - below)))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// Masks of all widths around the word borders, from empty to full.
    fn masks() -> impl Strategy<Value = (BitMask, Vec<bool>)> {
        let sizes = (
            prop_oneof![0..4usize, 60..70usize, 126..131usize],
            0..6usize,
        );
        (sizes, 0.0..=1.0f64).prop_flat_map(|((width, height), density)| {
            vec(prop::bool::weighted(density), width * height).prop_map(move |bits| {
                let mut mask = BitMask::empty(width, height);
                for (i, _) in bits.iter().enumerate().filter(|(_, bit)| **bit) {
                    mask.insert(i % width, i / width);
                }
                (mask, bits)
            })
        })
    }

    proptest! {
        /// Counting, listing and bounding agree with the same on a plain array of bools.
        #[test]
        fn agrees_with_an_array_of_bools((mask, bits) in masks()) {
            let (w, ones): (_, Vec<usize>) =
                (mask.width(), (0..bits.len()).filter(|&i| bits[i]).collect());
            prop_assert_eq!(mask.count(), ones.len());
            let listed: Vec<_> = mask.iter().map(|(x, y)| y * w + x).collect();
            prop_assert_eq!(&listed, &ones);
            match mask.bounds() {
                None => prop_assert!(ones.is_empty()),
                Some(r) => {
                    prop_assert_eq!(mask.count_in(r), ones.len());
                    let xs = ones.iter().map(|i| i % w);
                    prop_assert_eq!(r.x as usize, xs.clone().min().unwrap());
                    prop_assert_eq!(r.right() as usize, xs.max().unwrap() + 1);
                    prop_assert_eq!(r.y as usize, ones[0] / w);
                    prop_assert_eq!(r.bottom() as usize, ones[ones.len() - 1] / w + 1);
                }
            }
        }

        /// Removing a rectangle removes the texels inside and no others.
        #[test]
        fn a_mask_dilated_has_the_neighbours_of_each_texel((mask, bits) in masks()) {
            let (w, h) = (mask.width(), mask.height());
            let dilated = mask.dilated();
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                let is_set = |x: usize, y: usize| x < w && y < h && bits[x + w * y];
                let expected = is_set(x, y)
                    || is_set(x.wrapping_sub(1), y)
                    || is_set(x + 1, y)
                    || is_set(x, y.wrapping_sub(1))
                    || is_set(x, y + 1);
                prop_assert_eq!(dilated.contains(x, y), expected);
            }
            let mut rim = BitMask::empty(w, h);
            rim.insert_all(&dilated, &mask);
            prop_assert!(rim.iter().all(|(x, y)| dilated.contains(x, y) && !bits[x + w * y]));
            prop_assert_eq!(rim.count() + mask.count(), dilated.count());
        }

        #[test]
        fn removing_a_rectangle_leaves_the_rest((mask, _) in masks(), f in [0.0..1.0f64, 0.0..1.0, 0.0..1.0, 0.0..1.0]) {
            let (w, h) = (mask.width() as f64, mask.height() as f64);
            let (x, y) = ((f[0] * w) as u32, (f[1] * h) as u32);
            let rect = Rect {
                x, y,
                width: (f[2] * (w - f64::from(x) + 0.999)) as u32,
                height: (f[3] * (h - f64::from(y) + 0.999)) as u32,
            };
            let mut rest = mask.clone();
            rest.remove_rect(rect);
            let expected: Vec<_> = mask.iter()
                .filter(|&(x, y)| !rect.contains(x as u32, y as u32)).collect();
            prop_assert_eq!(rest.iter().collect::<Vec<_>>(), expected);
            prop_assert_eq!(mask.count_in(rect), mask.count() - rest.count());
        }

        /// However a row is set, no bit beyond the width survives.
        #[test]
        fn bits_beyond_the_width_stay_zero(width in 1..130usize, words in vec(any::<u64>(), 3)) {
            let mut mask = BitMask::empty(width, 1);
            mask.set_row(0, &words[..width.div_ceil(64)]);
            prop_assert!(mask.iter().all(|(x, _)| x < width));
            prop_assert_eq!(mask.iter().count(), mask.count());
        }
    }
}
