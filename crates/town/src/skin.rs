//! What surfaces are covered with: one material and at most one texture each.

use crate::canvas::{Painting, linear, srgb};
use crate::textures::{clay, foliage, glass, ground, masonry, metal, plaster, wood};
use farfield_scene::{AlphaMode, Material};
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
    /// Plaster, tinted.
    Plaster,
    /// Slates of spires and better houses.
    Slates,
    /// A house door, tinted; one texture a door.
    HouseDoor,
    /// A shop window, tinted; one texture a cell.
    ShopFront,
    /// A leaf with slats, tinted; one texture a leaf.
    PlainShutter,
    /// Paving of streets.
    Setts,
    /// Paving of squares.
    Flags,
    /// Meadows and yards.
    Grass,
    /// Cliffs.
    Rock,
    /// Trunks and branches, tinted.
    Bark,
    /// Clusters of leaves with holes, tinted.
    LimeLeaves,
    /// Clusters of small leaves.
    BirchLeaves,
    /// Clusters of narrow leaves.
    CypressLeaves,
    /// Clusters of flowers, tinted.
    Flowers,
    /// Clipped hedges.
    Hedge,
    /// Painted wood or cloth, tinted, without texture.
    Paint,
    /// Wrought iron.
    Iron,
    /// Glass of lanterns, which glows.
    Lamp,
    /// Water of fountains.
    Water,
    /// A pointed window in pale stone; one texture a window.
    ChurchWindow,
}

impl Skin {
    /// All, in the order of their numbers; those of the house come first.
    pub(crate) const ALL: [Self; 42] = [
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
        Self::Plaster,
        Self::Slates,
        Self::HouseDoor,
        Self::ShopFront,
        Self::PlainShutter,
        Self::Setts,
        Self::Flags,
        Self::Grass,
        Self::Rock,
        Self::Bark,
        Self::LimeLeaves,
        Self::BirchLeaves,
        Self::CypressLeaves,
        Self::Flowers,
        Self::Hedge,
        Self::Paint,
        Self::Iron,
        Self::Lamp,
        Self::Water,
        Self::ChurchWindow,
    ];

    /// How many of [`Skin::ALL`] the house uses.
    pub(crate) const OF_HOUSE: usize = 22;

    /// The texture, or `None` where one colour does.
    pub(crate) fn painting(self, seed: u32) -> Option<Painting> {
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
            Self::Plaster => plaster::plaster(seed),
            Self::Slates => clay::slates(seed),
            Self::HouseDoor => wood::house_door(seed),
            Self::ShopFront => wood::shop_front(seed),
            Self::PlainShutter => wood::plain_shutter(seed),
            Self::Setts => ground::setts(seed),
            Self::Flags => ground::flags(seed),
            Self::Grass => ground::grass(seed),
            Self::Rock => ground::rock(seed),
            Self::Bark => foliage::bark(seed),
            Self::LimeLeaves => foliage::lime(seed),
            Self::BirchLeaves => foliage::birch(seed),
            Self::CypressLeaves => foliage::cypress(seed),
            Self::Flowers => foliage::flowers(seed),
            Self::Hedge => foliage::hedge(seed),
            Self::ChurchWindow => glass::church_window(seed),
            Self::RidgeTiles | Self::Frame | Self::Slat | Self::Zinc | Self::Gold => return None,
            Self::Paint | Self::Iron | Self::Lamp | Self::Water => return None,
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
            Self::Plaster | Self::Setts => 3.0,
            Self::Slates | Self::Flags => 4.0,
            Self::Grass | Self::Rock => 6.0,
            Self::Hedge => 1.5,
            _ => 1.0,
        }
    }

    /// How the texture is laid onto a wall.
    pub(crate) fn fit(self) -> Fit {
        match self {
            Self::WindowPanel | Self::BracedPanel | Self::ShopFront => Fit::Cell,
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
                | Self::Plaster
                | Self::Slates
                | Self::Setts
                | Self::Flags
                | Self::Grass
                | Self::Rock
                | Self::Bark
                | Self::Hedge
        )
    }

    /// Whether it shows clusters of leaves or flowers, with holes between them, from both sides.
    pub(crate) fn is_foliage(self) -> bool {
        matches!(
            self,
            Self::LimeLeaves | Self::BirchLeaves | Self::CypressLeaves | Self::Flowers
        )
    }

    /// Whether it takes the tint of the shape it is added to.
    pub(crate) fn takes_tint(self) -> bool {
        self.is_foliage()
            || matches!(
                self,
                Self::Plaster
                    | Self::WindowPanel
                    | Self::BracedPanel
                    | Self::Tiles
                    | Self::RidgeTiles
                    | Self::Slates
                    | Self::HouseDoor
                    | Self::ShopFront
                    | Self::PlainShutter
                    | Self::Bark
                    | Self::Grass
                    | Self::Hedge
                    | Self::Paint
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
            Self::Pane | Self::Fanlight | Self::ChurchWindow => (Vec3::ONE, 0.0, 0.15),
            Self::Copper => (Vec3::ONE, 0.0, 0.6),
            Self::Iron => (srgb(0x2e3233), 0.0, 0.5),
            Self::Lamp => (srgb(0xf4d58a), 0.0, 0.3),
            Self::Water => (srgb(0x5f93a8), 0.0, 0.1),
            _ => (Vec3::ONE, 0.0, 0.9),
        };
        Material {
            name: format!("{self:?}").to_lowercase(),
            base_color: Vec4::from((linear(color), 1.0)),
            metallic,
            roughness,
            emissive: match self {
                Self::Lamp => linear(srgb(0x8a6a30)),
                _ => Vec3::ZERO,
            },
            alpha: match self.is_foliage() {
                true => AlphaMode::Mask { cutoff: 0.5 },
                false => AlphaMode::Opaque,
            },
            double_sided: self.is_foliage(),
            ..Material::default()
        }
    }
}
