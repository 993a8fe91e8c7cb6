//! The parts that a town is put together from; each is one mesh, however often it is placed.

use crate::building::{foundation, row_house};
use crate::castle;
use crate::church;
use crate::dice::Dice;
use crate::furniture;
use crate::shape::Shape;
use crate::tree::{Species, tree};
use rayon::prelude::*;

/// Designs of row houses for each width, in the middle of a row and at its end.
pub(crate) const DESIGNS: u8 = 9;
/// How many depths row houses have.
const DEPTHS: u8 = 5;
/// Widths of row houses, in half metres.
pub(crate) const WIDTHS: std::ops::RangeInclusive<u8> = 11..=20;
/// Trees of each species.
pub(crate) const TREES: u8 = 3;
/// Variants of stalls, tubs and hedges.
pub(crate) const VARIANTS: u8 = 4;

/// Something that stands in a town.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    House {
        width: u8,
        corner: bool,
        design: u8,
    },
    /// Below the house of a width and a step of depth.
    Foundation {
        width: u8,
        step: u8,
    },
    Tree {
        species: Species,
        variant: u8,
    },
    Nave,
    Tower,
    CastleWall,
    CastleSideWall,
    RoundTower {
        tall: bool,
    },
    Keep,
    Palace,
    Lantern,
    Bench,
    Fountain,
    Stall {
        variant: u8,
    },
    Hedge {
        variant: u8,
    },
    Fence,
    Tub {
        variant: u8,
    },
    Barrel,
    Cart,
    Well,
}

/// Length of the castle's long walls, of the short ones, of its palace, of hedges and of fences.
pub(crate) const CASTLE_WALL: f32 = 50.0;
pub(crate) const CASTLE_SIDE: f32 = 22.0;
pub(crate) const PALACE: f32 = 22.0;
pub(crate) const HEDGE: f32 = 4.0;
pub(crate) const FENCE: f32 = 4.0;

impl Part {
    /// All of them, in order.
    pub(crate) fn all() -> Vec<Self> {
        let mut parts = Vec::new();
        for width in WIDTHS {
            for corner in [false, true] {
                parts.extend((0..DESIGNS).map(|design| Self::House {
                    width,
                    corner,
                    design,
                }));
            }
        }
        for width in WIDTHS {
            parts.extend((0..DEPTHS).map(|step| Self::Foundation { width, step }));
        }
        for species in [
            Species::Lime,
            Species::Birch,
            Species::Cypress,
            Species::Apple,
        ] {
            parts.extend((0..TREES).map(|variant| Self::Tree { species, variant }));
        }
        parts.extend([
            Self::Nave,
            Self::Tower,
            Self::CastleWall,
            Self::CastleSideWall,
            Self::RoundTower { tall: false },
            Self::RoundTower { tall: true },
            Self::Keep,
            Self::Palace,
            Self::Lantern,
            Self::Bench,
            Self::Fountain,
            Self::Fence,
            Self::Barrel,
            Self::Cart,
            Self::Well,
        ]);
        for variant in 0..VARIANTS {
            parts.extend([
                Self::Stall { variant },
                Self::Hedge { variant },
                Self::Tub { variant },
            ]);
        }
        parts.sort_unstable();
        parts
    }

    /// Its shape in a town of a seed.
    fn build(self, seed: u32, index: u32) -> Shape {
        let dice = &mut Dice::new(seed, 1000 + index);
        match self {
            Self::House { width, corner, .. } => {
                row_house(f32::from(width) / 2.0, house_depth(self), corner, dice)
            }
            Self::Foundation { width, .. } => foundation(f32::from(width) / 2.0, house_depth(self)),
            Self::Tree { species, .. } => tree(species, dice),
            Self::Nave => church::nave(),
            Self::Tower => church::tower(),
            Self::CastleWall => castle::wall(CASTLE_WALL),
            Self::CastleSideWall => castle::wall(CASTLE_SIDE),
            Self::RoundTower { tall: false } => castle::round_tower(2.9, 10.5),
            Self::RoundTower { tall: true } => castle::round_tower(3.4, 14.0),
            Self::Keep => castle::keep(),
            Self::Palace => castle::palace(PALACE),
            Self::Lantern => furniture::lantern(),
            Self::Bench => furniture::bench(),
            Self::Fountain => furniture::fountain(),
            Self::Stall { .. } => furniture::stall(dice),
            Self::Hedge { .. } => furniture::hedge(HEDGE, dice),
            Self::Fence => furniture::fence(FENCE),
            Self::Tub { .. } => furniture::tub(dice),
            Self::Barrel => furniture::barrel(),
            Self::Cart => furniture::cart(),
            Self::Well => furniture::well(),
        }
    }
}

/// Depth of a house's body, or of its foundation, behind its front, in metres.
pub(crate) fn house_depth(part: Part) -> f32 {
    let step = match part {
        Part::House { width, design, .. } => (width + design) % DEPTHS,
        Part::Foundation { step, .. } => step,
        _ => return 0.0,
    };
    8.4 + 0.4 * f32::from(step)
}

/// What a house stands on where the ground falls.
///
/// # Panics
///
/// When the part is no house.
pub(crate) fn foundation_of(house: Part) -> Part {
    let Part::House { width, design, .. } = house else {
        panic!("{house:?} is no house")
    };
    let step = (width + design) % DEPTHS;
    Part::Foundation { width, step }
}

/// All parts with their shapes.
pub(crate) struct Catalogue {
    parts: Vec<(Part, Shape)>,
}

impl Catalogue {
    pub(crate) fn new(seed: u32) -> Self {
        let parts = Part::all().into_par_iter().enumerate();
        Self {
            parts: parts
                .map(|(i, part)| (part, part.build(seed, i as u32)))
                .collect(),
        }
    }

    /// The number of a part.
    ///
    /// # Panics
    ///
    /// When it is not in the catalogue.
    pub(crate) fn index(&self, part: Part) -> usize {
        let found = self.parts.binary_search_by_key(&part, |(p, _)| *p);
        found.unwrap_or_else(|_| panic!("{part:?} is not in the catalogue"))
    }

    pub(crate) fn len(&self) -> usize {
        self.parts.len()
    }

    pub(crate) fn shape(&self, index: usize) -> &Shape {
        &self.parts[index].1
    }
}
