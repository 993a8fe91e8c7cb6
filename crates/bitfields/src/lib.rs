#![doc = include_str!("../README.md")]

mod bitfield;
mod connectivity;

mod directions;
mod triangulation;

mod faces;
mod lookup;

mod parts;
mod patches;

mod adaptive;

pub use adaptive::{Adapted, AdaptiveSettings, Round, adapt};
pub use bitfield::Bitfield;
pub use connectivity::with_neighbors;
pub use directions::{even_directions, widest_gap};
pub use faces::{FaceRanges, Samples, culled_share, face_sets};
pub use lookup::Lookup;
pub use parts::patches_in_parts;
pub use patches::{PatchSettings, Patches, patches};
pub use triangulation::{Face, Triangulation, TriangulationError};
