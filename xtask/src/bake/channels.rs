//! What the texels of a bake hold: colours as they are seen, or what an engine needs to light them.

use farfield_bundle::Channels;
use farfield_pages::normal_texel;
use farfield_sampling::{Surface, srgb_from_linear};
use farfield_scene::Scene;
use farfield_views::Pose;
use glam::Vec3;

/// The scene as its colours are to be recorded and compared: lit, or as if all of it were unlit.
pub(crate) fn prepare(scene: &mut Scene, channels: Channels) {
    if channels == Channels::Unlit {
        for material in &mut scene.materials {
            material.unlit = true;
        }
    }
}

/// Texels of samples, channel by channel.
pub(super) struct Texels {
    /// sRGB.
    pub(super) base_color: Vec<[u8; 3]>,
    /// In the quads' tangent space.
    pub(super) normal: Vec<[u8; 3]>,
    /// Roughness in green, metallic in blue.
    pub(super) metallic_roughness: Vec<[u8; 3]>,
    /// sRGB, and what it is multiplied with; none where nothing shines.
    pub(super) emissive: Option<(Vec<[u8; 3]>, f32)>,
}

/// How metallic a surface is recorded: black metal is what reflects nothing.
pub(crate) fn metallic(surface: &Surface) -> f32 {
    match surface.unlit {
        true => 1.0,
        false => surface.metallic,
    }
}

/// How much brighter than white what shines can be. All of an impostor shares one factor, and what is
/// dim beside it has few digits left.
const BRIGHTEST: f32 = 8.0;

/// The texels that surfaces seen from a pose need to be lit as quads.
pub(super) fn texels(surfaces: &[Surface], pose: &Pose) -> Texels {
    let linear = |c: f32| (c * 255.0).round().clamp(0.0, 255.0) as u8;
    let srgb = |color: Vec3| color.to_array().map(|c| linear(srgb_from_linear(c)));
    // What is unlit shines with its base colour, and reflects nothing.
    let base = |s: &Surface| if s.unlit { Vec3::ZERO } else { s.base_color };
    let emissive = |s: &Surface| s.emissive + if s.unlit { s.base_color } else { Vec3::ZERO };
    let brightest = surfaces.iter().map(|s| emissive(s).max_element());
    let strength = brightest.fold(0.0, f32::max).min(BRIGHTEST);
    Texels {
        base_color: surfaces.iter().map(|s| srgb(base(s))).collect(),
        normal: surfaces
            .iter()
            .map(|s| normal_texel(pose, s.normal))
            .collect(),
        metallic_roughness: surfaces
            .iter()
            .map(|s| [255, linear(s.roughness), linear(metallic(s))])
            .collect(),
        emissive: (strength > 0.0).then(|| {
            let texels = surfaces.iter().map(|s| srgb(emissive(s) / strength));
            (texels.collect(), strength)
        }),
    }
}
