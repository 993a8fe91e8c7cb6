//! Culling by opaque blocks of 3 x 3 texels, and shifts of whole rows.

use farfield_grid::BitMask;

/// The texels of the next layer that are hidden behind 3 x 3 blocks of texels which
/// occlude or are `hidden` themselves.
///
/// Start with an empty `hidden` mask at the first layer and feed the result back for each
/// following one. Nothing outside the masks occludes. All that it hides, `Culler` hides
/// too.
///
/// Section 3.4 of Jeschke, Accelerating the Rendering Process Using Impostors, 2005.
///
/// # Panics
///
/// When the masks differ in size.
pub fn umbra_3x3(occluding: &BitMask, hidden: &BitMask) -> BitMask {
    let (width, height) = (occluding.width(), occluding.height());
    assert!(
        (width, height) == (hidden.width(), hidden.height()),
        "the masks of a layer are {width} x {height} and {} x {} texels large",
        hidden.width(),
        hidden.height()
    );
    let words = occluding.words_per_row();
    let mut umbra = BitMask::empty(width, height);
    // The last three rows, each where a texel and its neighbours left and right block.
    let mut rows = [(); 3].map(|()| vec![0; words]);
    let mut blocked = vec![0; words];
    let mut with_left = vec![0; words];
    for y in 0..height {
        for ((blocked, o), h) in blocked.iter_mut().zip(occluding.row(y)).zip(hidden.row(y)) {
            *blocked = o | h;
        }
        let row = &mut rows[y % 3];
        and_left(&blocked, &mut with_left);
        and_right(&blocked, row);
        for (row, left) in row.iter_mut().zip(&with_left) {
            *row &= left;
        }
        if y >= 2 {
            let [a, b, c] = &rows;
            for (i, blocked) in blocked.iter_mut().enumerate() {
                *blocked = a[i] & b[i] & c[i];
            }
            umbra.set_row(y - 1, &blocked);
        }
    }
    umbra
}

/// Which texels of `row` are set together with their left neighbour.
pub(crate) fn and_left(row: &[u64], result: &mut [u64]) {
    let mut carry = 0;
    for (result, &word) in result.iter_mut().zip(row) {
        *result = word & (word << 1 | carry);
        carry = word >> 63;
    }
}

/// Which texels of `row` are set together with their right neighbour.
pub(crate) fn and_right(row: &[u64], result: &mut [u64]) {
    let mut carry = 0;
    for (result, &word) in result.iter_mut().zip(row).rev() {
        *result = word & (word >> 1 | carry);
        carry = word << 63;
    }
}
