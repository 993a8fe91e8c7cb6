//! Fills one page from the bottom of its skyline.

use crate::waiting::Waiting;

/// A piece of the skyline: the rows before `y` are used or given up, those from `y` on are
/// free.
#[derive(Clone, Copy, Debug)]
struct Step {
    x: u32,
    y: u32,
    width: u32,
}

/// A rectangle and its top left texel in the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) id: u32,
    pub(crate) x: u32,
    pub(crate) y: u32,
}

/// Moves rectangles from `waiting` to a page of `width` x `height` texels.
///
/// The skyline is the border between the used part of the page and the free rows that
/// follow. Its lowest (that is, least used) gap is filled again and again: by a rectangle
/// exactly as wide as the gap if there is one (the highest of these), else by the first
/// in order that fits; where none does, the gap is given up to the level of its lower
/// neighbour. A rectangle goes to the side of the gap where it ends level with the
/// neighbour, else to the side of the neighbour that is used further, which keeps the
/// skyline even. The page's borders count as neighbours used up to the last row.
///
/// Stops as soon as more than `waste` texels were given up: if that is all the page has
/// to spare, the rectangles no longer all fit.
///
/// Takes a logarithmic time for each rectangle, and one in proportion to the steps of the
/// skyline, of which there are at most `width` and rarely more than a few hundred.
pub(crate) fn fill(
    [width, height]: [u32; 2],
    mut waste: u64,
    waiting: &mut Waiting,
    placed: &mut Vec<Placed>,
) {
    let mut steps = vec![Step { x: 0, y: 0, width }];
    while waiting.len() > 0 {
        let lowest = (0..steps.len())
            .min_by_key(|&i| steps[i].y)
            .expect("the skyline spans the page");
        let gap = steps[lowest];
        // The page's borders are neighbours up to the top.
        let left = if lowest > 0 {
            steps[lowest - 1].y
        } else {
            height
        };
        let right = steps.get(lowest + 1).map_or(height, |step| step.y);

        let Some(rank) = choose(waiting, gap.width, height - gap.y) else {
            let level = left.min(right);
            if level == gap.y {
                // The page is used up to its last row.
                return;
            }
            let lost = u64::from(gap.width) * u64::from(level - gap.y);
            let Some(rest) = waste.checked_sub(lost) else {
                return;
            };
            waste = rest;
            steps[lowest].y = level;
            merge(&mut steps, lowest);
            continue;
        };

        let [w, h] = waiting.size(rank);
        let top = gap.y + h;
        let at_right = top == right || top != left && right > left;
        let x = if at_right {
            gap.x + gap.width - w
        } else {
            gap.x
        };
        placed.push(Placed {
            id: waiting.take(rank),
            x,
            y: gap.y,
        });
        steps[lowest] = Step {
            x,
            y: top,
            width: w,
        };
        if w < gap.width {
            let rest = Step {
                x: if at_right { gap.x } else { gap.x + w },
                y: gap.y,
                width: gap.width - w,
            };
            steps.insert(lowest + usize::from(!at_right), rest);
            merge(&mut steps, lowest + usize::from(at_right));
        } else {
            merge(&mut steps, lowest);
        }
    }
}

/// Which rectangle goes into a gap, given the page's free rows above it.
fn choose(waiting: &mut Waiting, width: u32, height: u32) -> Option<usize> {
    waiting
        .highest_of_width(width, height)
        .or_else(|| waiting.first_within(width, height))
}

/// Unites step `i` with its neighbours of the same height.
fn merge(steps: &mut Vec<Step>, i: usize) {
    if i + 1 < steps.len() && steps[i + 1].y == steps[i].y {
        steps[i].width += steps.remove(i + 1).width;
    }
    if i > 0 && steps[i - 1].y == steps[i].y {
        steps[i - 1].width += steps.remove(i).width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waiting::Order;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        /// If all rectangles fit, they fit without giving up more than the page has to
        /// spare, in the same places.
        #[test]
        fn stops_only_when_not_all_fit(
            sizes in vec([1..12u32, 1..12u32], 0..30),
            page in [12..60u32, 12..60u32],
        ) {
            let ids: Vec<u32> = (0..sizes.len() as u32).collect();
            let waiting = Waiting::new(&sizes, &ids, Order::Perimeter);
            let place = |waste| {
                let mut placed = Vec::new();
                fill(page, waste, &mut waiting.clone(), &mut placed);
                placed
            };
            let all = place(u64::MAX);
            if all.len() == sizes.len() {
                let content: u32 = sizes.iter().map(|[w, h]| w * h).sum();
                prop_assert_eq!(place(u64::from(page[0] * page[1] - content)), all);
            }
        }
    }
}
