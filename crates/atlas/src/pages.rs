//! How many pages, how large, and what goes where.

use crate::skyline::{Placed, fill};
use crate::waiting::{Order, Waiting};
use thiserror::Error;

/// Where a rectangle goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Index of the page.
    pub page: u32,
    /// The page's column that the rectangle's leftmost one goes to.
    pub x: u32,
    /// The page's row that the rectangle's topmost one goes to.
    pub y: u32,
}

/// Pages, and a place for each rectangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Atlas {
    /// Width and height of each page in texels, multiples of 4.
    pub pages: Vec<[u32; 2]>,
    /// One for each rectangle, in the order in which they were given.
    pub placements: Vec<Placement>,
}

/// Why rectangles cannot be packed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PackError {
    /// A rectangle without texels.
    #[error("rectangle {index} is empty: {} x {}", size[0], size[1])]
    Empty {
        /// Which one.
        index: usize,
        /// Its width and height.
        size: [u32; 2],
    },
    /// A rectangle that no page can hold.
    #[error(
        "rectangle {index} of {} x {} does not fit on a page of at most {limit} x {limit}; pages of \
         {least} x {least} hold each of them",
        size[0], size[1]
    )]
    TooLarge {
        /// Which one.
        index: usize,
        /// Its width and height.
        size: [u32; 2],
        /// The largest multiple of 4 up to the largest side allowed.
        limit: u32,
        /// The least side of pages, a multiple of 4, that hold each of the rectangles.
        least: u32,
    },
}

/// Packs rectangles into few pages, each as small as the search makes it.
///
/// Rectangles keep their orientation and never overlap; any gutter between them must be
/// part of their sizes. What fits on one page comes on one page. Otherwise pages of the
/// largest size are filled one after the other, the large rectangles first, so that the
/// small ones, which leave the fewest gaps, come last; then each page is packed anew, as
/// small as possible.
///
/// The size of a page is searched for: its width is varied, and so is the order in which
/// rectangles are chosen, and each try must beat the smallest page found so far. Tries are
/// many for few rectangles, and few for many, which fill a page well anyway.
///
/// * `sizes` - width and height of each rectangle, in texels
/// * `max_side` - the largest width and height of a page, in texels, rounded down to a
///   multiple of 4
///
/// Takes time in proportion to n (log n + s) for n rectangles, s the steps of a page's
/// skyline: about the square root of the number of rectangles on it, if they are alike.
///
/// # Errors
///
/// When a rectangle is empty or larger than a page may be.
///
/// # Panics
///
/// When `max_side` exceeds 65,536 or there are 2^32 rectangles or more.
pub fn pack(sizes: &[[u32; 2]], max_side: u32) -> Result<Atlas, PackError> {
    assert!(max_side <= 1 << 16, "pages of {max_side} texels a side");
    let limit = max_side / 4 * 4;
    for (index, &size) in sizes.iter().enumerate() {
        if size.contains(&0) {
            return Err(PackError::Empty { index, size });
        }
        if size.iter().any(|&side| side > limit) {
            let longest = sizes.as_flattened().iter().max();
            let least = longest.and_then(|side| side.checked_next_multiple_of(4));
            let least = least.unwrap_or(u32::MAX);
            return Err(PackError::TooLarge {
                index,
                size,
                limit,
                least,
            });
        }
    }
    if sizes.is_empty() {
        return Ok(Atlas {
            pages: Vec::new(),
            placements: Vec::new(),
        });
    }
    let count = u32::try_from(sizes.len()).expect("fewer than 2^32 rectangles");
    let all: Vec<u32> = (0..count).collect();

    let pages = match smallest_page(sizes, &all, limit, None) {
        Some(page) => vec![page],
        None => ORDERS
            .map(|order| full_pages(sizes, Waiting::new(sizes, &all, order), limit))
            .into_iter()
            // The first of the shortest, and among these the one that leaves the least
            // for its last page.
            .min_by_key(|pages| {
                let last = pages.last().map_or(0, |page| area(sizes, &page.ids()));
                (pages.len(), last)
            })
            .expect("there are orders")
            .into_iter()
            .map(|page| {
                let ids = page.ids();
                smallest_page(sizes, &ids, limit, Some(page)).expect("a page was given")
            })
            .collect(),
    };

    let nowhere = Placement {
        page: u32::MAX,
        x: 0,
        y: 0,
    };
    let mut placements = vec![nowhere; sizes.len()];
    for (page, number) in pages.iter().zip(0..) {
        for &Placed { id, x, y } in &page.placed {
            placements[id as usize] = Placement { page: number, x, y };
        }
    }
    Ok(Atlas {
        pages: pages.iter().map(|page| page.size).collect(),
        placements,
    })
}

/// Orders of choice, the mostly best first.
const ORDERS: [Order; 5] = [
    Order::Perimeter,
    Order::Area,
    Order::LongerSide,
    Order::Height,
    Order::Width,
];

/// A page and what lies on it.
#[derive(Debug)]
struct Page {
    size: [u32; 2],
    placed: Vec<Placed>,
}

impl Page {
    /// The page just large enough for what was placed.
    fn around(sizes: &[[u32; 2]], placed: Vec<Placed>) -> Self {
        let mut size = [0, 0];
        for &Placed { id, x, y } in &placed {
            let [w, h] = sizes[id as usize];
            size = [size[0].max(x + w), size[1].max(y + h)];
        }
        Self {
            size: size.map(multiple_of_4),
            placed,
        }
    }

    fn ids(&self) -> Vec<u32> {
        self.placed.iter().map(|p| p.id).collect()
    }

    fn area(&self) -> u64 {
        texels(self.size)
    }
}

/// Fills page after page of the largest size until nothing waits.
fn full_pages(sizes: &[[u32; 2]], mut waiting: Waiting, limit: u32) -> Vec<Page> {
    let mut pages = Vec::new();
    while waiting.len() > 0 {
        let mut placed = Vec::new();
        fill([limit; 2], u64::MAX, &mut waiting, &mut placed);
        pages.push(Page::around(sizes, placed));
    }
    pages
}

/// The smallest page found that holds all of `ids`, or `None` when none was found. A page
/// to `beat` is returned if it stays the smallest.
fn smallest_page(
    sizes: &[[u32; 2]],
    ids: &[u32],
    limit: u32,
    mut best: Option<Page>,
) -> Option<Page> {
    let content = area(sizes, ids);
    let least = ids.iter().fold([0, 0], |least, &id| {
        [0, 1].map(|axis| multiple_of_4(sizes[id as usize][axis]).max(least[axis]))
    });
    // No page is smaller than this.
    let bound = content.next_multiple_of(16).max(texels(least));

    // At most 400 tries, at least 3 for an order; in between about as much work as for a
    // few tens of thousands of rectangles, some 20 ms.
    let tries = (40_000 / ids.len()).clamp(3 * ORDERS.len(), 400) / ORDERS.len();
    let widths = widths(content, least, limit, tries);
    for order in ORDERS {
        let waiting = Waiting::new(sizes, ids, order);
        for &width in &widths {
            loop {
                // The highest page of this width that would be smaller.
                let height = match &best {
                    Some(page) if page.area() <= bound => return best,
                    Some(page) => ((page.area() - 1) / u64::from(width)).min(limit.into()) as u32,
                    None => limit,
                } / 4
                    * 4;
                let Some(waste) = texels([width, height]).checked_sub(content) else {
                    break;
                };
                let mut placed = Vec::with_capacity(ids.len());
                fill([width, height], waste, &mut waiting.clone(), &mut placed);
                if placed.len() < ids.len() {
                    break;
                }
                best = Some(Page::around(sizes, placed));
            }
        }
    }
    best
}

/// Up to `count` widths to try, multiples of 4, from narrow to wide: for pages twice as high
/// as wide to twice as wide as high, as far as the largest rectangles allow.
fn widths(content: u64, least: [u32; 2], limit: u32, count: usize) -> Vec<u32> {
    let square = (content as f64).sqrt();
    // Where the highest rectangle makes the page higher than that, it should be narrow, but
    // leave room beside that rectangle.
    let filled = content as f64 / f64::from(least[1]);
    let from = (square / 2f64.sqrt()).min(filled).max(least[0].into());
    let to = (square * 2f64.sqrt()).min(1.5 * filled).max(1.5 * from);
    let mut widths: Vec<u32> = (0..count)
        .map(|i| {
            let t = (i as f64 + 0.5) / count as f64;
            let width = from * (to / from).powf(t);
            multiple_of_4(width as u32).min(limit)
        })
        .collect();
    widths.dedup();
    widths
}

fn area(sizes: &[[u32; 2]], ids: &[u32]) -> u64 {
    ids.iter().map(|&id| texels(sizes[id as usize])).sum()
}

fn texels(size: [u32; 2]) -> u64 {
    u64::from(size[0]) * u64::from(size[1])
}

fn multiple_of_4(side: u32) -> u32 {
    side.next_multiple_of(4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// What is wrong with an atlas of `sizes`.
    fn check(atlas: &Atlas, sizes: &[[u32; 2]], max_side: u32) -> Result<(), String> {
        if atlas.placements.len() != sizes.len() {
            return Err("there is not one placement for each rectangle".into());
        }
        let mut content = vec![[0, 0]; atlas.pages.len()];
        let mut used: Vec<_> = (atlas.pages.iter())
            .map(|&page| vec![false; texels(page) as usize])
            .collect();
        for (i, (place, [w, h])) in atlas.placements.iter().zip(sizes).enumerate() {
            let (right, bottom) = (place.x + w, place.y + h);
            let page = place.page as usize;
            let Some(&[width, height]) = atlas.pages.get(page) else {
                return Err(format!(
                    "rectangle {i} is on page {page}, which is not there"
                ));
            };
            if right > width || bottom > height {
                return Err(format!("rectangle {i} reaches out of page {page}"));
            }
            content[page] = [right.max(content[page][0]), bottom.max(content[page][1])];
            for y in place.y..bottom {
                let row = (y * width) as usize;
                for texel in &mut used[page][row + place.x as usize..row + right as usize] {
                    if std::mem::replace(texel, true) {
                        return Err(format!("rectangle {i} overlaps another"));
                    }
                }
            }
        }
        for (page, content) in atlas.pages.iter().zip(content) {
            if page.iter().any(|side| side % 4 != 0 || *side > max_side) {
                return Err(format!("{page:?} is not a page of at most {max_side}"));
            }
            if [0, 1].iter().any(|&i| page[i] >= content[i] + 4) {
                return Err(format!("{page:?} is too large for {content:?}"));
            }
        }
        Ok(())
    }

    fn fill_ratio(atlas: &Atlas, sizes: &[[u32; 2]]) -> f64 {
        let sum = |sizes: &[[u32; 2]]| sizes.iter().map(|&s| texels(s)).sum::<u64>() as f64;
        sum(sizes) / sum(&atlas.pages)
    }

    /// Rectangles of all kinds, none larger than a page: small, equal, slivers both ways, one
    /// or many as large as a page.
    fn rectangles() -> impl Strategy<Value = (Vec<[u32; 2]>, u32)> {
        (4..100u32).prop_flat_map(|max_side| {
            let limit = max_side / 4 * 4;
            let small = limit.min(12);
            let kinds = prop_oneof![
                8 => [1..=small, 1..=small],
                2 => Just([limit.min(6), limit.min(7)]),
                1 => [1..=limit, 1..=2u32],
                1 => [1..=2u32, 1..=limit],
                1 => [1..=limit, 1..=limit],
                1 => Just([limit, limit]),
            ];
            (vec(kinds, 0..60), Just(max_side))
        })
    }

    /// As the quads of layered impostors are: grown on blocks of 4 texels, cropped to their
    /// content, with a gutter of one texel; few are large.
    fn quads() -> impl Strategy<Value = Vec<[u32; 2]>> {
        let side = prop_oneof![
            30 => (1..4u32, 0..4u32).prop_map(|(blocks, crop)| 4 * blocks - crop + 2),
            10 => (3..10u32, 0..4u32).prop_map(|(blocks, crop)| 4 * blocks - crop + 2),
            1 => (10..60u32).prop_map(|blocks| 4 * blocks + 2),
        ];
        vec([side.clone(), side], 200..500)
    }

    proptest! {
        /// Every rectangle lies inside its page, none overlap, and pages are multiples of 4, not
        /// too large, and no larger than their content.
        #[test]
        fn rectangles_lie_apart_on_tight_pages((sizes, max_side) in rectangles()) {
            let atlas = pack(&sizes, max_side).unwrap();
            prop_assert_eq!(check(&atlas, &sizes, max_side), Ok(()));
            prop_assert_eq!(pack(&sizes, max_side).unwrap(), atlas);
        }

        /// Equal rectangles need as many pages as rows and columns of them need.
        #[test]
        fn equal_rectangles_stand_in_rows_and_columns(
            (limit, [w, h]) in (1..20u32).prop_flat_map(|n| (Just(4 * n), [1..=4 * n, 1..=4 * n])),
            n in 1..200u32,
        ) {
            let atlas = pack(&vec![[w, h]; n as usize], limit).unwrap();
            let a_page_holds = (limit / w) * (limit / h);
            prop_assert_eq!(atlas.pages.len() as u32, n.div_ceil(a_page_holds));
        }

        /// The first rectangle that is empty or larger than the largest page is named, and the
        /// least pages that each of them fits on.
        #[test]
        fn what_cannot_be_packed_is_named(
            (mut sizes, max_side) in rectangles(),
            index in any::<prop::sample::Index>(),
            (axis, too_large) in (0..2usize, any::<bool>()),
        ) {
            let limit = max_side / 4 * 4;
            sizes.push([1, 1]);
            let index = index.index(sizes.len());
            sizes[index][axis] = if too_large { limit + 1 } else { 0 };
            sizes.push([0, 0]);
            let size = sizes[index];
            let expected = if too_large {
                let fits = |side: &u32| sizes.as_flattened().iter().all(|other| other <= side);
                let least = (4..).step_by(4).find(fits).unwrap();
                PackError::TooLarge {
                    index,
                    size,
                    limit,
                    least,
                }
            } else {
                PackError::Empty { index, size }
            };
            prop_assert_eq!(pack(&sizes, max_side), Err(expected));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        /// Two hundred quads of an impostor or more leave little more than a seventh over of what any
        /// page needs: no page is narrower than its widest quad or lower than its tallest.
        #[test]
        fn many_quads_cover_their_page(sizes in quads()) {
            let atlas = pack(&sizes, 4096).unwrap();
            prop_assert_eq!(check(&atlas, &sizes, 4096), Ok(()));
            let longest = [0, 1].map(|axis| sizes.iter().map(|size| size[axis]).max().unwrap());
            let content = sizes.iter().map(|&size| texels(size)).sum::<u64>();
            let needed = content.max(texels(longest));
            let page = atlas.pages.iter().map(|&page| texels(page)).sum::<u64>();
            prop_assert!(page as f64 <= 1.15 * needed as f64, "{:?} for {needed}", atlas.pages);
        }
    }

    /// Quads for more than one page fill all pages but the last, and that is small.
    #[test]
    fn many_pages_are_full() {
        // Sides of 3 to 42 texels, from a linear congruential generator.
        let mut state = 1u32;
        let mut side = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            3 + (state >> 16) % 40
        };
        let sizes: Vec<_> = (0..3000).map(|_| [side(), side()]).collect();
        let atlas = pack(&sizes, 512).unwrap();
        assert_eq!(check(&atlas, &sizes, 512), Ok(()));
        let content: u64 = sizes.iter().map(|&s| texels(s)).sum();
        assert_eq!(atlas.pages.len() as u64, content.div_ceil(512 * 512));
        assert!(fill_ratio(&atlas, &sizes) >= 0.98);
    }

    /// A page as high as its one tall sliver is narrow.
    #[test]
    fn a_sliver_does_not_widen_its_page() {
        for tall in [[3, 4000], [4000, 3]] {
            let mut sizes = vec![[25, 25]; 100];
            sizes.push(tall);
            let atlas = pack(&sizes, 4096).unwrap();
            assert_eq!(check(&atlas, &sizes, 4096), Ok(()));
            // One column beside the sliver, rounded up.
            assert_eq!(texels(atlas.pages[0]), 28 * 4000);
        }
    }

    #[test]
    fn no_rectangles_need_no_page() {
        let atlas = pack(&[], 4096).unwrap();
        assert!(atlas.pages.is_empty() && atlas.placements.is_empty());
    }
}
