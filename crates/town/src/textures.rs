//! The paintings on the surfaces, a file for each family.
//!
//! Textures that repeat are built from noise that tiles and whole numbers of stones.
//! Light from above is hinted at: edges are brighter on top and darker below, and joints, corners
//! and the walls under eaves are dark.

pub(crate) mod clay;
pub(crate) mod glass;
pub(crate) mod masonry;
pub(crate) mod metal;
pub(crate) mod wood;
