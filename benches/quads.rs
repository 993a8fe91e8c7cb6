//! Quads: Jeschke's Table 3.1 for his box growing and for `cover`, at no more quads.

use farfield_grid::{BitMask, Rect};
use farfield_quads::{Growth, Price, count_padded_texels, cover, grow_boxes};
use std::collections::BTreeMap;

/// Jeschke, Accelerating the Rendering Process Using Impostors, 2005, Table 3.1: side of a block
/// in texels, quads, texture memory in kB; a dragon, 6 layers of 397 x 677 texels of 4 bytes
/// (one full quad a layer is 6.15 MB).
const TABLE_3_1: [(u32, u32, u32); 10] = [
    (1, 539, 414),
    (2, 340, 423),
    (4, 207, 447),
    (8, 114, 490),
    (16, 71, 555),
    (32, 39, 719),
    (64, 25, 996),
    (128, 11, 1697),
    (256, 11, 1833),
    (700, 6, 2131),
];

/// Bytes of a quad and of a texel.
const PRICE: Price = Price {
    bytes_per_quad: 104.0,
    bytes_per_texel: 4.0,
};

/// Halvings of the interval of prices in which `cover` gets its number of quads.
const HALVINGS: u32 = 10;

/// Prints, for every model and for blocks of 1 to 256 texels, what box growing needs and what
/// `cover` needs with no more quads, then `cover` at its default price.
///
/// * waste - texels with gutters less opaque texels, ours as a share of box growing's
/// * of one quad a layer - texture memory as a share of that for one tight quad a layer, so that
///   it compares with Table 3.1, of which we do not know the opaque texels
#[expect(clippy::print_stdout, reason = "the table is what this bench makes")]
pub(crate) fn table(models: &[(String, Vec<BitMask>)]) {
    let mut wastes: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for (name, layers) in models {
        let opaque: usize = layers.iter().map(BitMask::count).sum();
        let tight: Vec<Rect> = layers.iter().filter_map(BitMask::bounds).collect();
        let tight_texels = count_padded_texels(&tight);
        println!("\n{name}: {} layers, {opaque} opaque texels", layers.len());
        println!(
            "one tight quad a layer: {} quads, {tight_texels} texels",
            tight.len()
        );
        println!(
            "      |        box growing        |     cover, no more quads     | cover / growing     | of one quad a layer"
        );
        println!(
            "block |  quads    texels       kB |  quads    texels       kB    | waste texels  bytes | growing cover Jeschke (quads a layer)"
        );
        for (block, his_quads, his_kb) in TABLE_3_1.into_iter().filter(|row| row.0 <= 256) {
            let growth = Growth {
                block,
                ..Growth::default()
            };
            let grown = all_rects(layers, |mask| grow_boxes(mask, &growth));
            let ours = cover_with_at_most(layers, grown.len());
            let [a, b] = [&grown, &ours].map(|rects| count_padded_texels(rects) as f64);
            let waste = (b - opaque as f64) / (a - opaque as f64);
            wastes.entry(block).or_default().push(waste);
            let [a_bytes, b_bytes] = [&grown, &ours].map(|rects| PRICE.bytes(rects));
            println!(
                "{block:5} | {:6} {a:9} {:8.0} | {:6} {b:9} {:8.0}    | {waste:5.3} {:6.3} {:6.3} | {:7.3} {:5.3} {:7.3} ({:.1} {:.1} {:.1})",
                grown.len(),
                a_bytes / 1000.0,
                ours.len(),
                b_bytes / 1000.0,
                b / a,
                b_bytes / a_bytes,
                a / tight_texels as f64,
                b / tight_texels as f64,
                f64::from(his_kb) / f64::from(TABLE_3_1[9].2),
                grown.len() as f64 / layers.len() as f64,
                ours.len() as f64 / layers.len() as f64,
                f64::from(his_quads) / f64::from(TABLE_3_1[9].1),
            );
        }
        let best = all_rects(layers, |mask| cover(mask, &PRICE));
        println!(
            "cover at its default price: {} quads, {} texels, {:.0} kB",
            best.len(),
            count_padded_texels(&best),
            PRICE.bytes(&best) / 1000.0
        );
    }
    println!("\nwaste of cover as a share of box growing's, over all models");
    for (block, mut shares) in wastes {
        shares.sort_by(f64::total_cmp);
        let (median, worst) = (shares[shares.len() / 2], shares[shares.len() - 1]);
        println!("block {block:3}: median {median:.3}, worst {worst:.3}");
    }
}

/// `cover` at the lowest price of a quad that gives at most `quads` of them, one price for all
/// layers; one quad a layer where none does.
fn cover_with_at_most(layers: &[BitMask], quads: usize) -> Vec<Rect> {
    let at = |log_price: f64| {
        let price = Price {
            bytes_per_quad: log_price.exp2(),
            ..PRICE
        };
        all_rects(layers, |mask| cover(mask, &price))
    };
    let (mut low, mut high) = (0.0, 24.0);
    let mut best = at(low);
    if best.len() <= quads {
        return best;
    }
    best = at(high);
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        let rects = at(middle);
        if rects.len() <= quads {
            high = middle;
            best = rects;
        } else {
            low = middle;
        }
    }
    best
}

fn all_rects(layers: &[BitMask], rects: impl Fn(&BitMask) -> Vec<Rect>) -> Vec<Rect> {
    layers.iter().flat_map(rects).collect()
}
