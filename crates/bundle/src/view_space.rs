//! From where the impostors of a bundle are seen, all together and one by one.

use crate::cells::CELLS_FILE;
use crate::faces::FACES_FILE;
use crate::manifest::ViewCellRecord;
use farfield_views::ViewCell;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_4;

/// Where the camera of the promise may be, and what it sees from there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ViewSpace {
    /// Before everything: one impostor stands for the whole scene. The camera looks at the centre of
    /// what is represented.
    Before {
        /// Where the camera may be.
        #[serde(with = "ViewCellRecord")]
        #[schemars(with = "ViewCellRecord")]
        view_cell: ViewCell,
    },
    /// Amid the scene: up to six impostors round the cell, one a side, stand for what is far from
    /// it; what is near stays geometry. The camera looks anywhere.
    ///
    /// (S. Jeschke, 2005, section 3.8.1: layered environment-map impostors.)
    Amid {
        /// Where the camera may be; a box.
        #[serde(with = "ViewCellRecord")]
        #[schemars(with = "ViewCellRecord")]
        view_cell: ViewCell,
        /// Objects are represented if they lie wholly at least this far from the cell, in metres.
        distance: f64,
        /// The names of these objects, in the scene's order: they need not be drawn any more.
        objects: Vec<String>,
    },
    /// Around the scene: up to six impostors of all of it, one for each side that the camera may be
    /// on, of which only that one is to be shown: the side along whose direction it is farthest from
    /// the centre. The camera looks at the centre.
    ///
    /// (S. Jeschke, 2005, section 3.8.2: layered view-independent impostors.)
    Around {
        /// Of what is represented, in metres.
        #[schemars(with = "[f64; 3]")]
        center: DVec3,
        /// The camera is outside of a cube round the centre that reaches this far on every side, in
        /// metres.
        near: f64,
        /// The camera is inside of a cube round the centre that reaches this far on every side, in
        /// metres.
        far: f64,
    },
    /// Around the scene, between two distances from its centre, in any direction. The camera looks at
    /// the centre.
    Shell {
        /// Of what is represented, in metres.
        #[schemars(with = "[f64; 3]")]
        center: DVec3,
        /// The least distance, in metres.
        near: f64,
        /// The greatest distance, in metres.
        far: f64,
    },
    /// In the scene or beside it, anywhere in a box, and the camera looks anywhere.
    Inside {
        /// Where the camera may be; a box.
        #[serde(with = "ViewCellRecord")]
        #[schemars(with = "ViewCellRecord")]
        view_cell: ViewCell,
        /// Into how many view cells it is cut along x, y and z; each has a list of what is drawn.
        cells: [u32; 3],
    },
}

impl ViewSpace {
    /// Where the camera may be when it looks at the impostor on a side, `None` where there is but
    /// one: of views from all around the part on that side, a shaft of 45 degrees.
    ///
    /// # Panics
    ///
    /// When an impostor of views from all around has no side; [`Manifest::check`] tells. When the
    /// space is a shell, which is no cell.
    ///
    /// [`Manifest::check`]: crate::Manifest::check
    pub fn cell(&self, side: Option<Side>) -> ViewCell {
        match *self {
            Self::Before { view_cell }
            | Self::Amid { view_cell, .. }
            | Self::Inside { view_cell, .. } => view_cell,
            Self::Around { center, near, far } => ViewCell::Shaft {
                apex: center,
                axis: side.expect("each impostor is for one side").direction(),
                half_angle: FRAC_PI_4,
                near,
                far,
            },
            Self::Shell { .. } => panic!("a shell is no view cell"),
        }
    }

    /// The file that tells what ID-bitfields draw; `None` where impostors stand for the scene.
    pub fn lists_file(&self) -> Option<&'static str> {
        match self {
            Self::Shell { .. } => Some(FACES_FILE),
            Self::Inside { .. } => Some(CELLS_FILE),
            Self::Before { .. } | Self::Amid { .. } | Self::Around { .. } => None,
        }
    }

    /// Whether its impostors are for one side each.
    pub fn has_sides(&self) -> bool {
        matches!(self, Self::Amid { .. } | Self::Around { .. })
    }
}

/// A side of a box, along an axis of the world.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
pub enum Side {
    /// +X.
    #[serde(rename = "+x")]
    Right,
    /// -X.
    #[serde(rename = "-x")]
    Left,
    /// +Y.
    #[serde(rename = "+y")]
    Top,
    /// -Y.
    #[serde(rename = "-y")]
    Bottom,
    /// +Z.
    #[serde(rename = "+z")]
    Front,
    /// -Z.
    #[serde(rename = "-z")]
    Back,
}

impl Side {
    /// All six, in the order in which impostors are baked.
    pub const ALL: [Self; 6] = [
        Self::Right,
        Self::Left,
        Self::Top,
        Self::Bottom,
        Self::Front,
        Self::Back,
    ];

    /// Outwards, of length 1.
    pub fn direction(self) -> DVec3 {
        match self {
            Self::Right => DVec3::X,
            Self::Left => DVec3::NEG_X,
            Self::Top => DVec3::Y,
            Self::Bottom => DVec3::NEG_Y,
            Self::Front => DVec3::Z,
            Self::Back => DVec3::NEG_Z,
        }
    }
}

impl std::fmt::Display for Side {
    /// As in the manifest.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Right => "+x",
            Self::Left => "-x",
            Self::Top => "+y",
            Self::Bottom => "-y",
            Self::Front => "+z",
            Self::Back => "-z",
        })
    }
}
