//! Which surface gives a texel its colour, while that is contested.

use crate::rasterize::NONE;
use crate::surface::Hit;

/// Who gives a texel its colour: the least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rank {
    /// 0 front faces over the centre, 1 front faces beside it, 2 and 3 back faces alike, 4 nobody.
    pub(crate) class: u8,
    /// Depth over the centre, squared distance to it in texels beside it.
    pub(crate) distance: f64,
}

impl Rank {
    const NOBODY: Self = Self {
        class: 4,
        distance: f64::INFINITY,
    };

    pub(crate) fn class(front: bool, over_center: bool) -> u8 {
        2 * u8::from(!front) + u8::from(!over_center)
    }

    pub(crate) fn is_front(&self) -> bool {
        self.class < 2
    }

    pub(crate) fn is_better_than(&self, other: &Rank) -> bool {
        self.class < other.class
            || (self.class == other.class && self.distance.total_cmp(&other.distance).is_lt())
    }
}

/// What a texel shows so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Claim {
    pub(crate) rank: Rank,
    pub(crate) hit: Hit,
}

impl Claim {
    const NOBODY: Self = Self {
        rank: Rank::NOBODY,
        hit: Hit {
            object: NONE,
            triangle: NONE,
            barycentric: [0.0; 2],
        },
    };

    pub(crate) fn new(rank: Rank, hit: Hit) -> Self {
        Self { rank, hit }
    }

    pub(crate) fn is_set(&self) -> bool {
        self.rank.class < Rank::NOBODY.class
    }

    /// Whether a piece of a class can win, `bound` being no more than its squared distance.
    pub(crate) fn may_lose_to(&self, class: u8, bound: impl Fn() -> f64) -> bool {
        // A hair, in texels, that is more than the rounding of distances.
        class < self.rank.class || (class == self.rank.class && bound() < self.rank.distance + 1e-9)
    }
}

/// Side of a tile: small, since layers hold thin strips of surface, and not so small that the
/// table of tiles outweighs them.
const TILE: usize = 4;

/// The contested texels of all layers in some rows, in tiles that exist once they are touched.
#[derive(Clone, Debug)]
pub(crate) struct Contest {
    tiles_per_row: usize,
    tile_rows: usize,
    /// Per layer and tile, row by row, its index; of a layer that nothing touches, nothing.
    places: Vec<Vec<u32>>,
    tiles: Vec<[Claim; TILE * TILE]>,
}

impl Contest {
    /// Of `layers` of `width` x `height` texels.
    pub(crate) fn new(width: usize, height: usize, layers: usize) -> Self {
        Self {
            tiles_per_row: width.div_ceil(TILE),
            tile_rows: height.div_ceil(TILE),
            places: vec![Vec::new(); layers],
            tiles: Vec::new(),
        }
    }

    pub(crate) fn layers(&self) -> usize {
        self.places.len()
    }

    /// What texel (x, y) of a layer shows.
    pub(crate) fn claim(&self, layer: usize, x: usize, y: usize) -> &Claim {
        let place = self.places[layer].get(y / TILE * self.tiles_per_row + x / TILE);
        match place {
            Some(&place) if place != NONE => {
                &self.tiles[place as usize][y % TILE * TILE + x % TILE]
            }
            _ => &Claim::NOBODY,
        }
    }

    /// What texel (x, y) of a layer shows, to be changed.
    pub(crate) fn claim_mut(&mut self, layer: usize, x: usize, y: usize) -> &mut Claim {
        let places = &mut self.places[layer];
        if places.is_empty() {
            places.resize(self.tiles_per_row * self.tile_rows, NONE);
        }
        let place = &mut places[y / TILE * self.tiles_per_row + x / TILE];
        if *place == NONE {
            *place = self.tiles.len() as u32;
            self.tiles.push([Claim::NOBODY; TILE * TILE]);
        }
        &mut self.tiles[*place as usize][y % TILE * TILE + x % TILE]
    }

    /// Calls for every texel of a layer that is set, row by row: column, row and what it shows.
    pub(crate) fn for_each_in(&self, layer: usize, mut f: impl FnMut(usize, usize, &Rank, Hit)) {
        for (j, places) in self.places[layer].chunks(self.tiles_per_row).enumerate() {
            let tiles = places
                .iter()
                .enumerate()
                .filter(|(_, place)| **place != NONE);
            let tiles: Vec<_> = tiles
                .map(|(i, place)| (i, &self.tiles[*place as usize]))
                .collect();
            for row in 0..TILE {
                for (i, tile) in &tiles {
                    for (column, claim) in tile[row * TILE..][..TILE].iter().enumerate() {
                        if claim.is_set() {
                            f(i * TILE + column, j * TILE + row, &claim.rank, claim.hit);
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        /// Whatever is claimed stays, texel by texel, and comes out row by row, as a sorted map
        /// tells; looking at a texel claims nothing.
        #[test]
        fn texels_hold_their_last_claim_and_come_row_by_row(
            (width, height, claims) in (1..20usize, 1..17usize).prop_flat_map(|(width, height)| {
                let claim = (0..3usize, 0..height, 0..width, 0..4u8, 0..9u32);
                (Just(width), Just(height), prop::collection::vec(claim, 0..60))
            }),
        ) {
            let mut contest = Contest::new(width, height, 3);
            let mut expected = BTreeMap::new();
            for (layer, y, x, class, triangle) in claims {
                let rank = Rank { class, distance: 1.0 };
                let hit = Hit { triangle, ..Claim::NOBODY.hit };
                *contest.claim_mut(layer, x, y) = Claim::new(rank, hit);
                expected.insert((layer, y, x), (class, triangle));
            }
            let mut found = Vec::new();
            for layer in 0..contest.layers() {
                contest.for_each_in(layer, |x, y, rank, hit| {
                    found.push(((layer, y, x), (rank.class, hit.triangle)));
                });
                for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                    let claim = contest.claim(layer, x, y);
                    let shown = claim.is_set().then_some((claim.rank.class, claim.hit.triangle));
                    prop_assert_eq!(shown, expected.get(&(layer, y, x)).copied());
                }
            }
            prop_assert_eq!(found, expected.into_iter().collect::<Vec<_>>());
        }
    }
}
