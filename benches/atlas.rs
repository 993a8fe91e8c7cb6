//! Fill and time of the atlas packer, beside other packers on the same rectangles.

use std::time::Instant;

/// Rectangles by width and height, in texels.
type Sizes = [[u32; 2]];

/// A packer of one page of a given size: whether all rectangles fit on it.
type Fits = fn(&Sizes, [u32; 2]) -> bool;

/// Prints which share of the pages is covered by rectangles, and the time taken, for each
/// set of rectangle sizes.
///
/// The packers compared with fill a page of a given size. They are given the rectangles
/// from high to low, and a square page whose side, a multiple of 4, is found by bisection:
/// the smallest on which they all fit. Their time is that of the successful run alone.
#[expect(clippy::print_stdout, reason = "a table to read")]
pub(crate) fn table(sets: &[(String, Vec<[u32; 2]>)]) {
    println!("set | n | packer | fill, % | time, ms");
    println!("--- | --- | --- | --- | ---");
    for (name, sizes) in sets {
        let row = |packer: &str, page_area: u64, seconds: f64| {
            println!(
                "{name} | {} | {packer} | {:.1} | {:.1}",
                sizes.len(),
                100.0 * area(sizes) as f64 / page_area as f64,
                1e3 * seconds
            );
        };
        for (packer, sizes) in [
            ("farfield-atlas", sizes),
            ("farfield-atlas, all upright", &upright(sizes)),
        ] {
            let start = Instant::now();
            let atlas = farfield_atlas::pack(sizes, 4096).expect("they fit");
            let seconds = start.elapsed().as_secs_f64();
            row(packer, area(&atlas.pages), seconds);
        }
        for (packer, fits, at_most) in PACKERS {
            // Some take quadratic time.
            if sizes.len() > at_most {
                continue;
            }
            let mut sizes = sizes.clone();
            sizes.sort_by_key(|&[w, h]| std::cmp::Reverse((h, w)));
            if let Some((side, seconds)) = smallest_square(&sizes, fits) {
                row(packer, u64::from(side).pow(2), seconds);
            }
        }
    }
}

/// Packers of one page, and for how many rectangles they are fast enough.
const PACKERS: [(&str, Fits, usize); 9] = [
    (
        "lowest place, from high to low (Jeschke 2005, 3.6)",
        lowest_place,
        100_000,
    ),
    ("shelves, from high to low", shelves, 100_000),
    (
        "binpack2d, MaxRects",
        |s, p| binpack2d(s, p, binpack2d::BinType::MaxRects),
        1_500,
    ),
    (
        "binpack2d, Guillotine",
        |s, p| binpack2d(s, p, binpack2d::BinType::Guillotine),
        1_500,
    ),
    ("crunch", crunch, 6_000),
    ("etagere", etagere, 100_000),
    ("guillotiere", guillotiere, 30_000),
    ("rect_packer", rect_packer, 30_000),
    ("rectangle-pack", rectangle_pack, 6_000),
];

/// The side of the smallest square page on which all fit, and how long packing took.
fn smallest_square(sizes: &Sizes, fits: Fits) -> Option<(u32, f64)> {
    // In units of 4 texels; the greater side is always known to fit.
    let longest = sizes.iter().flatten().max()?;
    let mut fails = ((area(sizes) as f64).sqrt() as u32)
        .max(*longest)
        .div_ceil(4)
        - 1;
    let mut found = None;
    let mut side = fails + 1;
    loop {
        let start = Instant::now();
        if fits(sizes, [4 * side; 2]) {
            found = Some((4 * side, start.elapsed().as_secs_f64()));
        } else {
            fails = side;
        }
        match found {
            None if side > 4_096 => return None,
            None => side += side.div_ceil(50),
            Some((fitting, _)) if fitting / 4 == fails + 1 => return found,
            Some((fitting, _)) => side = (fitting / 4 + fails) / 2,
        }
    }
}

/// The placement of Jeschke, Accelerating the Rendering Process Using Impostors, 2005,
/// section 3.6, on a page of any size: each at the lowest place, above whatever is there.
fn lowest_place(sizes: &Sizes, [width, height]: [u32; 2]) -> bool {
    // Left border and height of each step, from left to right.
    let mut steps = vec![(0, 0)];
    sizes.iter().all(|&[w, h]| {
        let rest = |i: usize| (steps[i].0, &steps[i..]);
        let place = (0..steps.len()).map(rest).filter(|(x, _)| x + w <= width);
        let over = |(x, steps): (u32, &[(u32, u32)])| {
            let below = steps.iter().take_while(|step| step.0 < x + w);
            (below.map(|step| step.1).max().unwrap_or(0), x)
        };
        let Some((y, x)) = place.map(over).min() else {
            return false;
        };
        let from = steps.partition_point(|step| step.0 < x);
        let to = steps.partition_point(|step| step.0 < x + w);
        let last = steps[to - 1].1;
        let ends = steps.get(to).map_or(width, |step| step.0) == x + w;
        let rest = (!ends).then_some((x + w, last));
        steps.splice(from..to, std::iter::once((x, y + h)).chain(rest));
        y + h <= height
    })
}

/// Rows of rectangles, each as high as its first.
fn shelves(sizes: &Sizes, [width, height]: [u32; 2]) -> bool {
    let (mut x, mut y, mut shelf) = (0, 0, 0);
    for &[w, h] in sizes {
        if x + w > width {
            (x, y, shelf) = (0, y + shelf, 0);
        }
        x += w;
        shelf = shelf.max(h);
    }
    y + shelf <= height
}

fn binpack2d(sizes: &Sizes, page: [u32; 2], bin: binpack2d::BinType) -> bool {
    let items: Vec<_> = sizes
        .iter()
        .zip(0..)
        .map(|(&[w, h], id)| binpack2d::Dimension::with_id(id, w as i32, h as i32, 0))
        .collect();
    let mut bin = binpack2d::bin_new(bin, page[0] as i32, page[1] as i32);
    items.iter().all(|item| bin.insert(item).is_some())
}

fn crunch(sizes: &Sizes, page: [u32; 2]) -> bool {
    let items = sizes
        .iter()
        .map(|&[w, h]| crunch::Item::new((), w as usize, h as usize, crunch::Rotation::None));
    let page = crunch::Rect::of_size(page[0] as usize, page[1] as usize);
    crunch::pack(page, items).is_ok()
}

fn etagere(sizes: &Sizes, page: [u32; 2]) -> bool {
    let size = |[w, h]: [u32; 2]| etagere::size2(w as i32, h as i32);
    let mut page = etagere::AtlasAllocator::new(size(page));
    sizes.iter().all(|&s| page.allocate(size(s)).is_some())
}

fn guillotiere(sizes: &Sizes, page: [u32; 2]) -> bool {
    let size = |[w, h]: [u32; 2]| guillotiere::size2(w as i32, h as i32);
    let mut page = guillotiere::SimpleAtlasAllocator::new(size(page));
    sizes.iter().all(|&s| page.allocate(size(s)).is_some())
}

fn rect_packer(sizes: &Sizes, page: [u32; 2]) -> bool {
    let mut packer = rect_packer::Packer::new(rect_packer::Config {
        width: page[0] as i32,
        height: page[1] as i32,
        border_padding: 0,
        rectangle_padding: 0,
    });
    let mut pack = |&[w, h]: &[u32; 2]| packer.pack(w as i32, h as i32, false);
    sizes.iter().all(|size| pack(size).is_some())
}

fn rectangle_pack(sizes: &Sizes, page: [u32; 2]) -> bool {
    use rectangle_pack::{GroupedRectsToPlace, RectToInsert, TargetBin};
    let mut rects = GroupedRectsToPlace::<usize, ()>::new();
    for (id, &[w, h]) in sizes.iter().enumerate() {
        rects.push_rect(id, None, RectToInsert::new(w, h, 1));
    }
    let mut bins = [(0, TargetBin::new(page[0], page[1], 1))].into();
    rectangle_pack::pack_rects(
        &rects,
        &mut bins,
        &rectangle_pack::volume_heuristic,
        &rectangle_pack::contains_smallest_box,
    )
    .is_ok()
}

/// The same, turned such that each is at least as high as wide.
fn upright(sizes: &Sizes) -> Vec<[u32; 2]> {
    sizes.iter().map(|&[w, h]| [w.min(h), w.max(h)]).collect()
}

fn area(sizes: &Sizes) -> u64 {
    sizes
        .iter()
        .map(|&[w, h]| u64::from(w) * u64::from(h))
        .sum()
}
