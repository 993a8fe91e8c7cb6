//! Levels of detail of images.

use farfield_scene::Image;
use glam::Vec3;

/// What the bytes of an image's RGB are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// sRGB.
    Srgb,
    /// Linear, as in normal textures.
    Linear,
}

/// The levels of an image after the finest, each half as large as the one before, down to 1 x 1.
///
/// Colours are averaged in linear light and weighted with alpha, so that the invisible colours of
/// transparent texels do not bleed into visible ones.
pub(crate) fn coarser_levels(image: &Image, encoding: Encoding) -> Vec<Image> {
    let decode = match encoding {
        Encoding::Srgb => linear_from_srgb,
        Encoding::Linear => |value: f32| value,
    };
    let decoded: [f32; 256] = std::array::from_fn(|i| decode(i as f32 / 255.0));
    let mut levels: Vec<Image> = Vec::new();
    loop {
        let fine = levels.last().unwrap_or(image);
        if fine.width.max(fine.height) == 1 {
            return levels;
        }
        levels.push(halved(fine, encoding, &decoded));
    }
}

fn halved(fine: &Image, encoding: Encoding, decoded: &[f32; 256]) -> Image {
    let (width, height) = ((fine.width / 2).max(1), (fine.height / 2).max(1));
    let texel = |x: u32, y: u32| {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
            let x = (2 * x + dx).min(fine.width - 1) as usize;
            let y = (2 * y + dy).min(fine.height - 1) as usize;
            fine.texels[y * fine.width as usize + x]
        });
        let alpha: f32 = four.iter().map(|t| f32::from(t[3])).sum();
        let mean: Vec3 = four
            .iter()
            .map(|&[r, g, b, a]| {
                let share = match alpha > 0.0 {
                    true => f32::from(a) / alpha,
                    false => 0.25,
                };
                Vec3::from([r, g, b].map(|c| decoded[usize::from(c)])) * share
            })
            .sum();
        let [r, g, b] = mean.to_array().map(|value| {
            let encoded = match encoding {
                Encoding::Srgb => srgb_from_linear(value),
                Encoding::Linear => value,
            };
            (encoded * 255.0).round() as u8
        });
        [r, g, b, (alpha / 4.0).round() as u8]
    };
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    Image {
        name: String::new(),
        width,
        height,
        texels: texels.map(|(x, y)| texel(x, y)).collect(),
    }
}

/// IEC 61966-2-1.
fn linear_from_srgb(value: f32) -> f32 {
    match value <= 0.040_45 {
        true => value / 12.92,
        false => ((value + 0.055) / 1.055).powf(2.4),
    }
}

fn srgb_from_linear(intensity: f32) -> f32 {
    match intensity <= 0.003_130_8 {
        true => intensity * 12.92,
        false => 1.055 * intensity.powf(1.0 / 2.4) - 0.055,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
        let at = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Image {
            name: String::new(),
            width,
            height,
            texels: at.map(|(x, y)| texel(x, y)).collect(),
        }
    }

    proptest! {
        /// Levels halve down to one texel, and an image of one colour keeps it in all of them.
        #[test]
        fn one_colour_stays(color in any::<[u8; 4]>(), width in 1..40u32, height in 1..40u32) {
            for encoding in [Encoding::Srgb, Encoding::Linear] {
                let levels = coarser_levels(&image(width, height, |_, _| color), encoding);
                prop_assert_eq!(levels.len(), width.max(height).ilog2() as usize);
                for (i, level) in (1..).zip(&levels) {
                    prop_assert_eq!(level.width, (width >> i).max(1));
                    prop_assert_eq!(level.height, (height >> i).max(1));
                    prop_assert!(level.texels.iter().all(|texel| *texel == color));
                }
            }
        }
    }

    #[test]
    fn invisible_colours_do_not_bleed_and_light_is_averaged() {
        let leaf = image(2, 2, |x, _| {
            [[0, 255, 0, 255], [255, 0, 255, 0]][x as usize]
        });
        let level = &coarser_levels(&leaf, Encoding::Srgb)[0];
        assert_eq!(level.texels, [[0, 255, 0, 128]]);
        let board = image(2, 2, |x, y| {
            [[0, 0, 0, 255], [255; 4]][((x + y) % 2) as usize]
        });
        // Half the light is 188 of 255 in sRGB.
        let level = &coarser_levels(&board, Encoding::Srgb)[0];
        assert_eq!(level.texels, [[188, 188, 188, 255]]);
    }
}
