//! What surfaces are covered with: one material and at most one texture each.

use crate::canvas::srgb;
use crate::textures::{clay, glass, masonry, metal, wood};
use farfield_scene::{Image, Material};
use glam::{Vec3, Vec4};

/// How a texture is laid onto the cells of a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fit {
    /// It runs on in metres.
    Metres,
    /// It runs on in metres to the sides, and once from a cell's top to its bottom.
    Storey,
    /// Each cell shows it once.
    Cell,
}

/// A surface; its number is the index of its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Skin {
    /// Blocks of sandstone, the walls of the ground storey.
    Sandstone,
    /// Smooth light stone of sills, reveals and the portal.
    Trim,
    /// Grey stone of steps.
    Granite,
    /// Rough stone of the plinth.
    Plinth,
    /// Half-timbered wall around a window; one texture a cell.
    WindowPanel,
    /// Half-timbered wall with braces; one texture a cell.
    BracedPanel,
    /// Dark beams.
    Beam,
    /// Upright boards.
    Planks,
    /// Clay tiles of the roofs.
    Tiles,
    /// Half-round tiles on the ridge.
    RidgeTiles,
    /// Chimneys.
    Brick,
    /// Window panes with their frame; one texture a pane.
    Pane,
    /// The half-round window over the door.
    Fanlight,
    /// White wood of window posts.
    Frame,
    /// A leaf with slats; one texture a leaf.
    Shutter,
    /// The painted wood of shutters.
    Slat,
    /// The two-leaved door.
    Door,
    /// The turret's patinated roof.
    Copper,
    /// The turret's walls with sound holes; one texture a wall.
    Louvre,
    /// The clock's face.
    Clock,
    /// Gutters.
    Zinc,
    /// Gilded trim.
    Gold,
}

impl Skin {
    /// All, in the order of their numbers.
    pub(crate) const ALL: [Self; 22] = [
        Self::Sandstone,
        Self::Trim,
        Self::Granite,
        Self::Plinth,
        Self::WindowPanel,
        Self::BracedPanel,
        Self::Beam,
        Self::Planks,
        Self::Tiles,
        Self::RidgeTiles,
        Self::Brick,
        Self::Pane,
        Self::Fanlight,
        Self::Frame,
        Self::Shutter,
        Self::Slat,
        Self::Door,
        Self::Copper,
        Self::Louvre,
        Self::Clock,
        Self::Zinc,
        Self::Gold,
    ];

    /// The texture, or `None` where one colour does.
    pub(crate) fn image(self, seed: u32) -> Option<Image> {
        Some(match self {
            Self::Sandstone => masonry::sandstone(seed),
            Self::Trim => masonry::trim(seed),
            Self::Granite => masonry::granite(seed),
            Self::Plinth => masonry::rubble(seed),
            Self::Brick => masonry::brick(seed),
            Self::WindowPanel => wood::window_panel(seed),
            Self::BracedPanel => wood::braced_panel(seed),
            Self::Beam => wood::beam(seed),
            Self::Planks => wood::planks(seed),
            Self::Tiles => clay::tiles(seed),
            Self::Pane => glass::pane(seed),
            Self::Fanlight => glass::fanlight(seed),
            Self::Shutter => wood::shutter(seed),
            Self::Louvre => wood::louvre(seed),
            Self::Door => wood::door(seed),
            Self::Copper => metal::copper(seed),
            Self::Clock => metal::clock(),
            Self::RidgeTiles | Self::Frame | Self::Slat | Self::Zinc | Self::Gold => {
                return None;
            }
        })
    }

    /// Length that one repetition of the texture covers, in metres.
    pub(crate) fn metres(self) -> f32 {
        match self {
            Self::Sandstone => 3.2,
            Self::Plinth => 1.8,
            Self::Tiles => 4.0,
            Self::Planks => 1.6,
            Self::Copper => 2.0,
            _ => 1.0,
        }
    }

    /// How the texture is laid onto a wall.
    pub(crate) fn fit(self) -> Fit {
        match self {
            Self::WindowPanel | Self::BracedPanel => Fit::Cell,
            Self::Sandstone => Fit::Storey,
            _ => Fit::Metres,
        }
    }

    /// Whether the texture repeats without seams.
    pub(crate) fn tiles(self) -> bool {
        matches!(
            self,
            Self::Sandstone
                | Self::Trim
                | Self::Granite
                | Self::Plinth
                | Self::Beam
                | Self::Planks
                | Self::Tiles
                | Self::Brick
                | Self::Copper
        )
    }

    /// Whether the texture's grain runs along a face's longest edge.
    pub(crate) fn has_grain(self) -> bool {
        self == Self::Beam
    }

    /// The material without its texture.
    pub(crate) fn material(self) -> Material {
        let (color, metallic, roughness) = match self {
            Self::RidgeTiles => (srgb(0x9c4630), 0.0, 0.8),
            Self::Frame => (srgb(0xf2ecdf), 0.0, 0.6),
            Self::Slat => (wood::SHUTTER, 0.0, 0.6),
            Self::Zinc => (srgb(0x6e7a80), 0.0, 0.5),
            Self::Gold => (srgb(0xd9a441), 0.0, 0.4),
            Self::Pane | Self::Fanlight => (Vec3::ONE, 0.0, 0.15),
            Self::Copper => (Vec3::ONE, 0.0, 0.6),
            _ => (Vec3::ONE, 0.0, 0.9),
        };
        Material {
            name: format!("{self:?}").to_lowercase(),
            base_color: Vec4::from((linear(color), 1.0)),
            metallic,
            roughness,
            ..Material::default()
        }
    }
}

/// Linear light from sRGB, both in [0, 1], after IEC 61966-2-1.
fn linear(srgb: Vec3) -> Vec3 {
    srgb.map(|c| match c <= 0.04045 {
        true => c / 12.92,
        false => ((c + 0.055) / 1.055).powf(2.4),
    })
}
