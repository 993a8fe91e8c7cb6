//! What surfaces look like: glTF's metallic-roughness materials as plain data.

use glam::{Vec3, Vec4};

/// A glTF 2.0 metallic-roughness material; textures are indices into
/// [`Scene::textures`](crate::Scene::textures).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For messages; need not be unique.
    pub name: String,
    /// Linear RGB and straight alpha, in [0, 1]; multiplies texture and vertex colour.
    pub base_color: Vec4,
    /// sRGB colour and linear alpha.
    pub base_color_texture: Option<u32>,
    /// In [0, 1]; multiplies the texture's blue channel.
    pub metallic: f32,
    /// In [0, 1]; multiplies the texture's green channel.
    pub roughness: f32,
    /// Linear; metallic in blue, roughness in green.
    pub metallic_roughness_texture: Option<u32>,
    /// Linear; tangent space, x along growing u, y against growing v, as in glTF.
    pub normal_texture: Option<u32>,
    /// Scales the normal texture's x and y.
    pub normal_scale: f32,
    /// Linear RGB, not below 0; multiplies the texture.
    pub emissive: Vec3,
    /// sRGB.
    pub emissive_texture: Option<u32>,
    /// How alpha is understood.
    pub alpha: AlphaMode,
    /// Whether back faces are seen. Where not, a triangle is seen only from the side from which
    /// its vertices run counter-clockwise.
    pub double_sided: bool,
    /// Whether the base colour is shown as it is, without light.
    pub unlit: bool,
}

impl Default for Material {
    /// glTF's default material: white, single-sided, opaque, rough metal.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
        }
    }
}

impl Material {
    /// The textures it shows.
    pub(crate) fn textures(&self) -> impl Iterator<Item = u32> {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.emissive_texture,
        ]
        .into_iter()
        .flatten()
    }

    /// The same with other numbers of textures.
    pub(crate) fn renumbered(&self, number: impl Fn(u32) -> u32) -> Self {
        Self {
            base_color_texture: self.base_color_texture.map(&number),
            metallic_roughness_texture: self.metallic_roughness_texture.map(&number),
            normal_texture: self.normal_texture.map(&number),
            emissive_texture: self.emissive_texture.map(&number),
            ..self.clone()
        }
    }
}

/// How a material's alpha is understood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Opaque where alpha is at least `cutoff`, transparent elsewhere.
    Mask {
        /// In [0, 1].
        cutoff: f32,
    },
    /// Blended over what is behind.
    Blend,
}

impl AlphaMode {
    /// The alpha from which on a surface counts as there, or `None` where alpha is ignored.
    ///
    /// Blended materials count from 0.5 on: impostors have no half-transparent texels.
    pub fn cutoff(&self) -> Option<f32> {
        match *self {
            Self::Opaque => None,
            Self::Mask { cutoff } => Some(cutoff),
            Self::Blend => Some(0.5),
        }
    }
}

/// An image and how it is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`](crate::Scene::images).
    pub image: u32,
    /// Beyond [0, 1], along u and along v.
    pub wrap: [Wrap; 2],
    /// Between texels and when minified.
    pub filter: Filter,
}

/// What a texture shows beyond [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// The texture again, every other time mirrored.
    MirroredRepeat,
    /// The outermost texels.
    ClampToEdge,
}

/// How a texture is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The texel that contains the point.
    Nearest,
    /// Between the four texels around the point, also when minified.
    Linear,
    /// Linear, and between the two best fitting levels of detail when minified.
    Mipmapped,
}

/// A picture of 8-bit texels.
#[derive(Clone, PartialEq)]
pub struct Image {
    /// For messages; need not be unique.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width` x `height` texels RGBA with straight alpha, row by row from the top left. Whether
    /// the colours are sRGB or linear is told by the material that uses them.
    pub texels: Vec<[u8; 4]>,
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Image({:?}, {} x {})",
            self.name, self.width, self.height
        )
    }
}
