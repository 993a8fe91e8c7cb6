//! Culling by the four quadrants of disparity signs.

use crate::umbra::{and_left, and_right};
use farfield_grid::BitMask;

/// Walks through the layers of an impostor, front to back, and tells which of their
/// texels can be seen.
///
/// From layer to layer, the point where a line of sight passes moves by less than a
/// texel on either axis, and never turns back. So the lines of sight fall into four
/// quadrants by the signs (sx, sy) of their movement. A line in texel (x, y) of one layer
/// has come from (x, y), (x - sx, y), (x, y - sy) or (x - sx, y - sy) of the layer before;
/// if each of these holds an occluding texel, or could only be reached through one
/// itself, no line of the quadrant arrives. What no quadrant reaches is culled. A line
/// that does not move on an axis belongs to both signs, and either is right about it.
///
/// Outside the mask nothing occludes: lines may enter from the side.
///
/// Refines section 3.4.1 of Jeschke, Accelerating the Rendering Process Using Impostors,
/// 2005, by occluders that are fewer than the opaque texels.
#[derive(Clone, Debug)]
pub struct Culler {
    /// Texels of the next layer that no line of sight of a quadrant reaches.
    quadrants: [Quadrant; 4],
}

#[derive(Clone, Debug)]
struct Quadrant {
    /// Whether lines come from the left, sx = 1, or from the right.
    from_left: bool,
    /// Whether lines come from above, sy = 1, or from below.
    from_above: bool,
    hidden: BitMask,
}

impl Culler {
    /// A culler in front of the first layer of `width` x `height` texels: nothing is
    /// hidden.
    pub fn new(width: usize, height: usize) -> Self {
        let quadrants =
            [(true, true), (false, true), (true, false), (false, false)].map(|(left, above)| {
                Quadrant {
                    from_left: left,
                    from_above: above,
                    hidden: BitMask::empty(width, height),
                }
            });
        Self { quadrants }
    }

    /// The texels of the next layer's `opaque` ones that some line of sight may reach.
    ///
    /// Call it for *every* layer in turn, nearest first, with empty masks for empty
    /// layers: behind each layer, lines of sight close in by up to a texel.
    ///
    /// * `opaque` - the layer's texels
    /// * `occluding` - those of them that stop a line of sight, mostly all; a texel that
    ///   only holds faces turned away is drawn for nobody, so it hides nothing
    ///
    /// # Panics
    ///
    /// When a mask is not of the culler's size or an occluding texel is not opaque.
    pub fn next(&mut self, opaque: &BitMask, occluding: &BitMask) -> BitMask {
        let (width, height) = (opaque.width(), opaque.height());
        for mask in [occluding, &self.quadrants[0].hidden] {
            assert!(
                (mask.width(), mask.height()) == (width, height),
                "the masks of a layer are {width} x {height} and {} x {} texels large",
                mask.width(),
                mask.height()
            );
        }
        let mut visible = BitMask::empty(width, height);
        let mut row = vec![0; opaque.words_per_row()];
        for y in 0..height {
            let [a, b, c, d] = self.quadrants.each_ref().map(|q| q.hidden.row(y));
            for (i, (&opaque, &occluding)) in opaque.row(y).iter().zip(occluding.row(y)).enumerate()
            {
                assert!(
                    occluding & !opaque == 0,
                    "row {y} holds an occluding texel that is not opaque"
                );
                row[i] = opaque & !(a[i] & b[i] & c[i] & d[i]);
            }
            visible.set_row(y, &row);
        }
        for quadrant in &mut self.quadrants {
            quadrant.step(occluding);
        }
        visible
    }
}

impl Quadrant {
    /// Replaces what is hidden in a layer, whose occluders are given, by what is hidden in
    /// the next one.
    fn step(&mut self, occluding: &BitMask) {
        let (height, words) = (occluding.height(), occluding.words_per_row());
        // Rows are overwritten in place, each after its last use: lines that come from
        // above need row y and the one above, so the lowest row goes first.
        let order = |i: usize| {
            if self.from_above { height - 1 - i } else { i }
        };
        let mut blocked = vec![0; words];
        // Where both horizontal origins are blocked, in this row and in the one that
        // lines come from.
        let mut here = vec![0; words];
        let mut origin = vec![0; words];
        for i in 0..=height {
            if i == height {
                origin.fill(0);
            } else {
                let y = order(i);
                for ((blocked, o), h) in blocked
                    .iter_mut()
                    .zip(occluding.row(y))
                    .zip(self.hidden.row(y))
                {
                    *blocked = o | h;
                }
                if self.from_left {
                    and_left(&blocked, &mut origin);
                } else {
                    and_right(&blocked, &mut origin);
                }
            }
            if i > 0 {
                for (here, origin) in here.iter_mut().zip(&origin) {
                    *here &= origin;
                }
                self.hidden.set_row(order(i - 1), &here);
            }
            std::mem::swap(&mut here, &mut origin);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::umbra_3x3;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// Layers front to back, each with its opaque and its occluding texels.
    type Stack = Vec<(BitMask, BitMask)>;

    fn mask(width: usize, height: usize, bits: impl Iterator<Item = bool>) -> BitMask {
        let mut mask = BitMask::empty(width, height);
        for (i, _) in bits.enumerate().filter(|(_, bit)| *bit) {
            mask.insert(i % width, i / width);
        }
        mask
    }

    /// Layers around the word borders, from empty over nearly full (where culling
    /// happens) to full, with none, few or many texels that do not occlude.
    fn stacks() -> impl Strategy<Value = Stack> {
        let widths = prop_oneof![0..6usize, 62..67usize, 126..131usize];
        (widths, 0..7usize).prop_flat_map(|(width, height)| {
            let density = prop_oneof![Just(0.0), 0.1..0.9, 0.9..1.0, Just(1.0)];
            let layer = (density, prop_oneof![Just(0.0), 0.0..0.2, Just(1.0)]).prop_flat_map(
                move |(density, through)| {
                    let texel = (prop::bool::weighted(density), prop::bool::weighted(through));
                    vec(texel, width * height).prop_map(move |texels| {
                        let opaque = texels.iter().map(|t| t.0);
                        let occluding = texels.iter().map(|t| t.0 && !t.1);
                        (mask(width, height, opaque), mask(width, height, occluding))
                    })
                },
            );
            vec(layer, 1..7)
        })
    }

    fn cull(stack: &Stack) -> Vec<BitMask> {
        let mut culler = Culler::new(stack[0].0.width(), stack[0].0.height());
        stack.iter().map(|(o, c)| culler.next(o, c)).collect()
    }

    fn contains(mask: &BitMask, x: i64, y: i64) -> bool {
        (0..mask.width() as i64).contains(&x)
            && (0..mask.height() as i64).contains(&y)
            && mask.contains(x as usize, y as usize)
    }

    /// The visible texels, found by following each quadrant's lines of sight texel by
    /// texel from the front, with enough room around the mask for lines from outside.
    fn follow_lines(stack: &Stack) -> Vec<BitMask> {
        let (w, h) = (stack[0].0.width() as i64, stack[0].0.height() as i64);
        let room = stack.len() as i64;
        let mut visible: Vec<_> = stack
            .iter()
            .map(|_| BitMask::empty(w as usize, h as usize))
            .collect();
        for (sx, sy) in [(1, 1), (-1, 1), (1, -1), (-1, -1)] {
            let places = || (-room..h + room).flat_map(|y| (-room..w + room).map(move |x| (x, y)));
            let mut reached: std::collections::BTreeSet<_> = places().collect();
            for (layer, (opaque, occluding)) in stack.iter().enumerate() {
                for &(x, y) in reached.iter().filter(|p| contains(opaque, p.0, p.1)) {
                    visible[layer].insert(x as usize, y as usize);
                }
                let passing = |&&(x, y): &&(i64, i64)| !contains(occluding, x, y);
                reached = (reached.iter().filter(passing))
                    .flat_map(|&(x, y)| [(x, y), (x + sx, y), (x, y + sy), (x + sx, y + sy)])
                    .collect();
            }
        }
        visible
    }

    proptest! {
        /// Exactly those texels are kept that a chain of texels reaches which moves by at
        /// most one texel a layer, in one of the four quadrants.
        #[test]
        fn keeps_what_chains_of_texels_reach(stack in stacks()) {
            prop_assert_eq!(cull(&stack), follow_lines(&stack));
        }

        /// No line of sight meets a culled texel before an occluding one: where it passes
        /// moves by less than a texel a layer, on each axis ever the same way.
        #[test]
        fn no_line_of_sight_meets_a_culled_texel_first(
            stack in stacks(),
            // In sixteenths of a texel, so that sums are exact.
            lines in vec((any::<[u16; 2]>(), [0..=15i32, 0..=15i32], vec([0..16i32, 0..16i32], 7), [-1..2i32, -1..2i32]), 100),
        ) {
            let visible = cull(&stack);
            let size = [stack[0].0.width(), stack[0].0.height()].map(|n| n as i32);
            for (start, at_most, steps, signs) in lines {
                // Somewhere in the mask or up to two texels beside it.
                let mut q = [0, 1].map(|i| i32::from(start[i]) % (16 * (size[i] + 4)) - 32);
                for (layer, (opaque, occluding)) in stack.iter().enumerate() {
                    let (x, y) = (i64::from(q[0].div_euclid(16)), i64::from(q[1].div_euclid(16)));
                    prop_assert!(!contains(opaque, x, y) || contains(&visible[layer], x, y));
                    if contains(occluding, x, y) {
                        break;
                    }
                    for axis in 0..2 {
                        q[axis] += signs[axis] * steps[layer][axis].min(at_most[axis]);
                    }
                }
            }
        }

        /// The quadrants cull at least what blocks of 3 x 3 texels cull, which in turn is
        /// what a slow search over the blocks finds.
        #[test]
        fn the_quadrants_cull_more_than_the_blocks(stack in stacks()) {
            let (w, h) = (stack[0].0.width(), stack[0].0.height());
            let mut hidden = BitMask::empty(w, h);
            for ((_, occluding), visible) in stack.iter().zip(cull(&stack)) {
                prop_assert!(hidden.iter().all(|(x, y)| !visible.contains(x, y)));
                let block = |x, y| (-1..=1).all(|j| (-1..=1).all(|i| {
                    contains(occluding, x + i, y + j) || contains(&hidden, x + i, y + j)
                }));
                let slow = mask(w, h, (0..w * h).map(|i| block((i % w) as i64, (i / w) as i64)));
                hidden = umbra_3x3(occluding, &hidden);
                prop_assert_eq!(&hidden, &slow);
            }
        }
    }

    /// Two screens that meet at a border, one a layer behind the other: the texel behind
    /// the border is hidden from one side by the near screen and the far one together. This is the
    /// overlapping penumbra of section 3.4.1.
    #[test]
    fn overlapping_penumbrae_are_found_by_the_quadrants_alone() {
        let columns = |range: std::ops::Range<usize>| {
            mask(9, 9, (0..81).map(move |i| range.contains(&(i % 9))))
        };
        let stack = [columns(0..4), columns(4..9), columns(0..9)];
        let visible = cull(&stack.iter().map(|m| (m.clone(), m.clone())).collect());
        let mut hidden = BitMask::empty(9, 9);
        for screen in &stack[..2] {
            hidden = umbra_3x3(screen, &hidden);
        }
        assert!(!hidden.contains(4, 4) && visible[2].contains(4, 0));
        assert!(!visible[2].contains(4, 4));
    }

    #[test]
    #[should_panic(expected = "not opaque")]
    fn an_occluder_must_be_opaque() {
        let (mut occluding, opaque) = (BitMask::empty(3, 3), BitMask::empty(3, 3));
        occluding.insert(1, 1);
        Culler::new(3, 3).next(&opaque, &occluding);
    }
}
