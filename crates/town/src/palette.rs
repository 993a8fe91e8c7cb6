//! Colours that go together.

use crate::canvas::{linear, srgb};
use crate::dice::Dice;
use glam::Vec3;

/// Plaster of town houses, sRGB: warm and light, a few cool ones between them.
const PLASTER: [u32; 14] = [
    0xf6ead0, 0xf1dcae, 0xeccb86, 0xe8b873, 0xe9bfa0, 0xdda08a, 0xf2e6dc, 0xc9d2b4, 0xb9cbcf,
    0xe6d3c3, 0xf4dfb2, 0xd98f6b, 0xefd5a0, 0xd8c6a8,
];

/// Half-timbered walls: white and cream, the timber takes the tint too.
const TIMBERED: [u32; 5] = [0xffffff, 0xfff6e0, 0xfff0d0, 0xf6e4d2, 0xf3ead8];

/// Painted doors, shutters and shop fronts.
const WOODWORK: [u32; 9] = [
    0x3f6e5a, 0x8c3b32, 0x2f5f78, 0x6b4a35, 0x46624a, 0x9a5a3a, 0x54677a, 0x7d2f3a, 0x2d4f4a,
];

/// What roof tiles are multiplied with: new, weathered, brown, dark.
const ROOF: [u32; 6] = [0xffffff, 0xeadfd8, 0xdac6ba, 0xc9b8ae, 0xf3d6c6, 0xbfaea4];

/// Cloth of awnings and stalls.
const CLOTH: [u32; 5] = [0xb8433a, 0x2f6d8a, 0x3f7d55, 0xd09a3a, 0x8a4a6d];

/// White cloth and paint.
pub(crate) const WHITE: u32 = 0xf4efe2;

/// Linear RGB of an sRGB colour.
pub(crate) fn tint(hex: u32) -> Vec3 {
    linear(srgb(hex))
}

pub(crate) fn plaster(dice: &mut Dice) -> Vec3 {
    tint(dice.pick(&PLASTER))
}

pub(crate) fn timbered(dice: &mut Dice) -> Vec3 {
    tint(dice.pick(&TIMBERED))
}

pub(crate) fn woodwork(dice: &mut Dice) -> Vec3 {
    tint(dice.pick(&WOODWORK))
}

pub(crate) fn roof(dice: &mut Dice) -> Vec3 {
    tint(dice.pick(&ROOF))
}

pub(crate) fn cloth(dice: &mut Dice) -> Vec3 {
    tint(dice.pick(&CLOTH))
}
