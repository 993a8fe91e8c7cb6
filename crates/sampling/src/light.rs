//! Light for pictures of surfaces.

use crate::Surface;
use glam::Vec3;

/// A sun and a sky without shadows or reflections: what a surface looks like does not depend on
/// the viewpoint, so that it can be recorded from one and shown to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lighting {
    /// Towards the sun, of length 1.
    pub to_sun: Vec3,
    /// Linear RGB that a white surface facing the sun gets from it.
    pub sun: Vec3,
    /// Linear RGB that a white surface facing up gets from the sky.
    pub sky: Vec3,
    /// Linear RGB that a white surface facing down gets from the ground.
    pub ground: Vec3,
}

impl Default for Lighting {
    /// A warm morning sun from the upper right behind a viewer who looks along -Z, and a blue sky.
    fn default() -> Self {
        Self {
            to_sun: Vec3::new(0.48, 0.64, 0.6),
            sun: Vec3::new(0.74, 0.69, 0.60),
            sky: Vec3::new(0.40, 0.45, 0.52),
            ground: Vec3::new(0.20, 0.18, 0.16),
        }
    }
}

/// Linear RGB of a surface under a light.
///
/// Diffuse only (Lambert): the sky's light goes over into the ground's with the height of the
/// normal. Metals are lit like coloured paint, since there is nothing to be reflected. Unlit
/// surfaces show their base colour.
pub fn lit_color(surface: &Surface, light: &Lighting) -> Vec3 {
    if surface.unlit {
        return surface.base_color + surface.emissive;
    }
    let from_sun = light.sun * surface.normal.dot(light.to_sun).max(0.0);
    let from_around = light.ground.lerp(light.sky, surface.normal.y * 0.5 + 0.5);
    surface.base_color * (from_sun + from_around) + surface.emissive
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// No white surface gets more light than white shows, and none is black.
        #[test]
        fn light_neither_clips_nor_vanishes(direction in prop::array::uniform3(-1.0..1.0f32)) {
            let normal = Vec3::from(direction);
            prop_assume!(normal.length() > 0.1);
            let white = Surface {
                base_color: Vec3::ONE,
                normal: normal.normalize(),
                metallic: 0.0,
                roughness: 1.0,
                emissive: Vec3::ZERO,
                unlit: false,
            };
            let color = lit_color(&white, &Lighting::default());
            prop_assert!(color.max_element() <= 1.13 && color.min_element() >= 0.15, "{color}");
            let unlit = Surface { unlit: true, ..white };
            prop_assert_eq!(lit_color(&unlit, &Lighting::default()), Vec3::ONE);
        }
    }
}
