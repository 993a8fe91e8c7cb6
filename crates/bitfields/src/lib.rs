#![doc = include_str!("../README.md")]

mod bitfield;
mod connectivity;

mod directions;
mod merged;
mod triangulation;

mod faces;
mod lookup;

mod coincident;
mod parts;
mod patches;

mod distances;
mod held_back;

mod adaptive;

mod cells;
mod cube_map;
mod grid;

pub use adaptive::{Adapted, AdaptiveSettings, adapt};
pub use bitfield::Bitfield;
pub use cells::{CellSet, CellSettings, cell_set};
pub use connectivity::{welded, with_neighbors};
pub use cube_map::cube_map;
pub use directions::{even_directions, widest_gap};
pub use distances::Distances;
pub use faces::{FaceRanges, United, culled_share, face_sets};
pub use grid::CellGrid;
pub use held_back::{Round, missed_pixels};
pub use lookup::Lookup;
pub use merged::merge_directions;
pub use parts::{cell_patches_in_parts, patches_in_parts};
pub use patches::{PatchSettings, Patches, cell_patches, patches};
pub use triangulation::{Face, Triangulation, TriangulationError};
