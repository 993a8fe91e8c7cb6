//! Axis-parallel rectangles of whole texels.

/// The texels `x..x + width` of the rows `y..y + height`; rows run down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Rect {
    /// The column right of the rectangle.
    pub fn right(&self) -> u32 {
        self.x + self.width
    }

    /// The row below the rectangle.
    pub fn bottom(&self) -> u32 {
        self.y + self.height
    }

    /// Number of texels.
    pub fn area(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Whether texel (x, y) lies inside.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        (self.x..self.right()).contains(&x) && (self.y..self.bottom()).contains(&y)
    }

    /// The texels in both rectangles, or `None` where they have none in common.
    pub fn intersection(&self, other: &Rect) -> Option<Rect> {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let right = self.right().min(other.right());
        let bottom = self.bottom().min(other.bottom());
        (x < right && y < bottom).then(|| Rect {
            x,
            y,
            width: right - x,
            height: bottom - y,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rects() -> impl Strategy<Value = Rect> {
        (0..9u32, 0..9u32, 0..9u32, 0..9u32).prop_map(|(x, y, width, height)| Rect {
            x,
            y,
            width,
            height,
        })
    }

    proptest! {
        /// A texel lies in the intersection exactly if it lies in both rectangles.
        #[test]
        fn intersection_is_what_both_contain(a in rects(), b in rects()) {
            let both = a.intersection(&b);
            for y in 0..20 {
                for x in 0..20 {
                    let inside = both.is_some_and(|r| r.contains(x, y));
                    prop_assert_eq!(inside, a.contains(x, y) && b.contains(x, y));
                }
            }
        }
    }
}
