//! Texture look-up: wrap modes, filters, levels of detail.

use farfield_grid::Grid;
use farfield_scene::{Filter, Image, Scene, Texture, Wrap};
use glam::{DVec2, I64Vec2, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// A scene's images, with coarser levels of detail for those that are minified.
///
/// Colours are averaged in linear light and weighted with alpha, so that the invisible colours of
/// transparent texels do not bleed into visible ones.
#[derive(Debug)]
pub struct Textures<'a> {
    scene: &'a Scene,
    /// Per image: finest first.
    color: Vec<Vec<Level<'a>>>,
    /// Per image, for data that is linear at rest (normals, roughness): finest first.
    data: Vec<Vec<Level<'a>>>,
    /// Per image that masks: greatest alpha in blocks of texels, finest first; else empty.
    greatest_alpha: Vec<Vec<Grid<u8>>>,
    /// The same of an image of one opaque texel.
    opaque: [Grid<u8>; 1],
    linear: [f32; 256],
}

#[derive(Debug)]
struct Level<'a> {
    width: u32,
    height: u32,
    texels: Cow<'a, [[u8; 4]]>,
}

impl<'a> Textures<'a> {
    /// Prepares the images of a scene for look-up.
    pub fn new(scene: &'a Scene) -> Self {
        let mut minified = [
            vec![false; scene.images.len()],
            vec![false; scene.images.len()],
        ];
        let mut note = |index: Option<u32>, kind: usize| {
            let texture = index.map(|i| &scene.textures[i as usize]);
            if let Some(texture) = texture.filter(|t| t.filter == Filter::Mipmapped) {
                minified[kind][texture.image as usize] = true;
            }
        };
        for material in &scene.materials {
            note(material.base_color_texture, 0);
            note(material.emissive_texture, 0);
            note(material.metallic_roughness_texture, 1);
            note(material.normal_texture, 1);
        }
        let mut masks = vec![false; scene.images.len()];
        for material in scene
            .materials
            .iter()
            .filter(|m| m.alpha.cutoff().is_some())
        {
            if let Some(texture) = material.base_color_texture {
                masks[scene.textures[texture as usize].image as usize] = true;
            }
        }
        let greatest_alpha = scene.images.par_iter().zip(&masks);
        let greatest_alpha = greatest_alpha.map(|(image, &masks)| match masks {
            true => greatest_alpha_pyramid(image),
            false => Vec::new(),
        });
        let linear = std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0));
        let pyramids = |minified: &[bool], decode: fn(f32) -> f32, encode: fn(f32) -> f32| {
            let images = scene.images.par_iter().zip(minified);
            images
                .map(|(image, &minified)| pyramid(image, minified, decode, encode))
                .collect()
        };
        Self {
            scene,
            color: pyramids(&minified[0], linear_from_srgb, srgb_from_linear),
            data: pyramids(&minified[1], |v| v, |v| v),
            greatest_alpha: greatest_alpha.collect(),
            opaque: [Grid::filled(1, 1, u8::MAX)],
            linear,
        }
    }

    /// Linear RGBA of an sRGB texture at `uv`; `footprint` is the growth of uv per column and per
    /// row of the picture.
    pub(crate) fn color(&self, texture: u32, uv: Vec2, footprint: [Vec2; 2]) -> Vec4 {
        let texture = &self.scene.textures[texture as usize];
        let levels = &self.color[texture.image as usize];
        sample(levels, texture, uv, footprint, |[r, g, b, a]| {
            let linear = |c: u8| self.linear[usize::from(c)];
            Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0)
        })
    }

    /// RGBA of a texture that is linear at rest, in [0, 1]; arguments as for `color`.
    pub(crate) fn data(&self, texture: u32, uv: Vec2, footprint: [Vec2; 2]) -> Vec4 {
        let texture = &self.scene.textures[texture as usize];
        let levels = &self.data[texture.image as usize];
        sample(levels, texture, uv, footprint, |texel| {
            Vec4::from_array(texel.map(|c| f32::from(c) / 255.0))
        })
    }

    /// Alpha of a texture that masks, or of none, which is opaque; always at the finest level of
    /// detail: averaged alpha would make thin leaves vanish or swell with distance.
    pub(crate) fn alpha(&self, texture: Option<u32>) -> AlphaTexture<'_> {
        let texture = texture.map(|i| &self.scene.textures[i as usize]);
        match texture {
            Some(texture) => AlphaTexture {
                levels: &self.greatest_alpha[texture.image as usize],
                wrap: texture.wrap,
                reach: i64::from(texture.filter != Filter::Nearest),
            },
            None => AlphaTexture {
                levels: &self.opaque,
                wrap: [Wrap::ClampToEdge; 2],
                reach: 0,
            },
        }
    }
}

/// Alpha of a texture, a bilinear function in each of its cells: the squares between the centres
/// of four texels, or the texels where the filter takes the nearest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlphaTexture<'a> {
    levels: &'a [Grid<u8>],
    wrap: [Wrap; 2],
    /// Columns and rows from the first to the last texel of a cell: 0 or 1.
    reach: i64,
}

impl AlphaTexture<'_> {
    /// Where texture coordinates lie, in columns and rows of cells.
    pub(crate) fn cell_at(&self, uv: Vec2) -> DVec2 {
        let size = DVec2::from(self.size().map(f64::from));
        let at = uv.as_dvec2() * size - 0.5 * self.reach as f64;
        let limit = DVec2::splat(f64::from(FARTHEST));
        at.clamp(-limit, limit)
    }

    /// Alpha at the corners of a cell, of 255, row by row.
    pub(crate) fn cell(&self, I64Vec2 { x, y }: I64Vec2) -> [[u8; 2]; 2] {
        let [width, height] = self.size();
        let column = |x: i64| wrapped(x, width, self.wrap[0]) as usize;
        let row = |y: i64| self.levels[0].row(wrapped(y, height, self.wrap[1]) as usize);
        let (left, right) = (column(x), column(x + self.reach));
        let (above, below) = (row(y), row(y + self.reach));
        [[above[left], above[right]], [below[left], below[right]]]
    }

    /// A bound of alpha in the cells from a first to a last column and row, of 255: exact for one
    /// cell.
    pub(crate) fn greatest(&self, [first, last]: [I64Vec2; 2]) -> u8 {
        let size = self.size();
        let end = last + self.reach + 1;
        let columns = wrapped_runs(first.x..end.x, size[0], self.wrap[0]);
        let rows = wrapped_runs(first.y..end.y, size[1], self.wrap[1]);
        // Few blocks, but not much larger together than what is asked for.
        let longer = |runs: &[Range<usize>; 2]| runs[0].len().max(runs[1].len());
        let longest = longer(&columns).max(longer(&rows));
        let level = (longest - 1).checked_ilog2().unwrap_or(0).saturating_sub(1);
        let blocks = |run: &Range<usize>| run.start >> level..run.end.div_ceil(1 << level);
        let mut greatest = 0;
        for rows in &rows {
            for y in blocks(rows) {
                let row = self.levels[level as usize].row(y);
                for columns in &columns {
                    for alpha in &row[blocks(columns)] {
                        greatest = greatest.max(*alpha);
                    }
                }
            }
        }
        greatest
    }

    fn size(&self) -> [u32; 2] {
        [
            self.levels[0].width() as u32,
            self.levels[0].height() as u32,
        ]
    }
}

/// The greatest alpha in blocks of 1, 2, 4, ... texels a side, up to the whole image.
fn greatest_alpha_pyramid(image: &Image) -> Vec<Grid<u8>> {
    let alpha = image.texels.iter().map(|texel| texel[3]).collect();
    let finest = Grid::from_cells(image.width as usize, image.height as usize, alpha);
    let coarser = |fine: &Grid<u8>| {
        let (width, height) = (fine.width(), fine.height());
        (width.max(height) > 1).then(|| {
            let greatest = |x: usize, y: usize| {
                let columns = 2 * x..(2 * x + 2).min(width);
                let rows = 2 * y..(2 * y + 2).min(height);
                let alpha = rows.flat_map(|y| &fine.row(y)[columns.clone()]);
                alpha.copied().max().unwrap_or(0)
            };
            let (width, height) = (width.div_ceil(2), height.div_ceil(2));
            let blocks = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            Grid::from_cells(width, height, blocks.map(|(x, y)| greatest(x, y)).collect())
        })
    };
    std::iter::successors(Some(finest), coarser).collect()
}

/// Levels of detail of an image, each half as large as the one before, down to 1 x 1; only the
/// finest if not `minified`.
fn pyramid(
    image: &Image,
    minified: bool,
    decode: fn(f32) -> f32,
    encode: fn(f32) -> f32,
) -> Vec<Level<'_>> {
    let mut levels = vec![Level {
        width: image.width,
        height: image.height,
        texels: Cow::Borrowed(&image.texels),
    }];
    while let Some(fine) = levels.last()
        && minified
        && fine.width.max(fine.height) > 1
    {
        let coarse = fine.halved(decode, encode);
        levels.push(coarse);
    }
    levels
}

/// Texel coordinates reach this far in both directions. Farther out single texels have no place in
/// f32, and they must have numbers.
const FARTHEST: f32 = (1_u64 << 40) as f32;

impl Level<'_> {
    fn halved(&self, decode: fn(f32) -> f32, encode: fn(f32) -> f32) -> Level<'static> {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let decoded: [f32; 256] = std::array::from_fn(|i| decode(i as f32 / 255.0));
        let texel = |x: u32, y: u32| {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
                let x = (2 * x + dx).min(self.width - 1);
                let y = (2 * y + dy).min(self.height - 1);
                self.texels[(y * self.width + x) as usize]
            });
            let color =
                |t: &[u8; 4]| Vec3::from_array([t[0], t[1], t[2]].map(|c| decoded[usize::from(c)]));
            let weights = four.map(|t| f32::from(t[3]));
            let total: f32 = weights.iter().sum();
            let mean = match total > 0.0 {
                true => four
                    .iter()
                    .zip(weights)
                    .map(|(t, w)| color(t) * (w / total))
                    .sum(),
                false => four.iter().map(|t| color(t) / 4.0).sum::<Vec3>(),
            };
            let byte = |c: f32| (encode(c) * 255.0).round() as u8;
            [
                byte(mean.x),
                byte(mean.y),
                byte(mean.z),
                (total / 4.0).round() as u8,
            ]
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Level {
            width,
            height,
            texels: texels.map(|(x, y)| texel(x, y)).collect(),
        }
    }

    fn sample(&self, texture: &Texture, uv: Vec2, decode: impl Fn([u8; 4]) -> Vec4) -> Vec4 {
        let size = Vec2::new(self.width as f32, self.height as f32);
        let number = |c: f32| match c.is_nan() {
            true => 0.0,
            false => c.clamp(-FARTHEST, FARTHEST),
        };
        let at = Vec2::from((uv * size).to_array().map(number));
        let texel = |x: i64, y: i64| {
            let x = wrapped(x, self.width, texture.wrap[0]);
            let y = wrapped(y, self.height, texture.wrap[1]);
            decode(self.texels[(y * self.width + x) as usize])
        };
        if texture.filter == Filter::Nearest {
            return texel(at.x.floor() as i64, at.y.floor() as i64);
        }
        let corner = (at - 0.5).floor();
        let t = at - 0.5 - corner;
        let (x, y) = (corner.x as i64, corner.y as i64);
        let above = texel(x, y).lerp(texel(x + 1, y), t.x);
        let below = texel(x, y + 1).lerp(texel(x + 1, y + 1), t.x);
        above.lerp(below, t.y)
    }
}

/// Looks a texture up between the two levels of detail whose texels are as large as the longer
/// side of the footprint.
fn sample(
    levels: &[Level<'_>],
    texture: &Texture,
    uv: Vec2,
    footprint: [Vec2; 2],
    decode: impl Fn([u8; 4]) -> Vec4,
) -> Vec4 {
    let size = Vec2::new(levels[0].width as f32, levels[0].height as f32);
    let texels = footprint.map(|side| (side * size).length());
    let lod = texels[0].max(texels[1]).log2();
    let last = levels.len() - 1;
    // `max` also turns what is not a number into 0.
    let lod = lod.max(0.0);
    if texture.filter != Filter::Mipmapped || lod == 0.0 || last == 0 {
        return levels[0].sample(texture, uv, decode);
    }
    let lod = lod.min(last as f32);
    let (fine, t) = (lod.floor() as usize, lod.fract());
    let near = levels[fine].sample(texture, uv, &decode);
    match t > 0.0 {
        true => near.lerp(levels[fine + 1].sample(texture, uv, &decode), t),
        false => near,
    }
}

/// The texel of `0..size` that a texture shows at texel coordinate `i`.
fn wrapped(i: i64, size: u32, wrap: Wrap) -> u32 {
    let size = i64::from(size);
    let inside = match wrap {
        _ if (0..size).contains(&i) => i,
        Wrap::ClampToEdge => i.clamp(0, size - 1),
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let twice = i.rem_euclid(2 * size);
            twice.min(2 * size - 1 - twice)
        }
    };
    inside as u32
}

/// The texels of `0..size` that a texture shows at a range of texel coordinates: two runs, the
/// second often empty; in doubt all.
fn wrapped_runs(texels: Range<i64>, size: u32, wrap: Wrap) -> [Range<usize>; 2] {
    let all = size as usize;
    if texels.start >= 0 && texels.end <= i64::from(size) {
        return [texels.start as usize..texels.end as usize, 0..0];
    }
    let texel = |i: i64| wrapped(i, size, wrap) as usize;
    let (first, last) = (texel(texels.start), texel(texels.end - 1));
    let tile = |i: i64| i.div_euclid(i64::from(size));
    let (tile, end) = (tile(texels.start), tile(texels.end - 1));
    if wrap == Wrap::ClampToEdge || tile == end {
        return [first.min(last)..first.max(last) + 1, 0..0];
    }
    match wrap {
        _ if end - tile > 1 => [0..all, 0..0],
        // Turns around at the last texel, or at the first.
        Wrap::MirroredRepeat if tile % 2 == 0 => [first.min(last)..all, 0..0],
        Wrap::MirroredRepeat => [0..first.max(last) + 1, 0..0],
        _ => [first..all, 0..last + 1],
    }
}

/// Linear intensity of an sRGB value in [0, 1] (IEC 61966-2-1).
pub fn linear_from_srgb(value: f32) -> f32 {
    match value <= 0.040_45 {
        true => value / 12.92,
        false => ((value + 0.055) / 1.055).powf(2.4),
    }
}

/// sRGB value of a linear intensity; intensities outside [0, 1] are clamped.
pub fn srgb_from_linear(intensity: f32) -> f32 {
    let intensity = intensity.clamp(0.0, 1.0);
    match intensity <= 0.003_130_8 {
        true => intensity * 12.92,
        false => 1.055 * intensity.powf(1.0 / 2.4) - 0.055,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_scene::{AlphaMode, Material};
    use proptest::prelude::*;

    fn scene(
        width: u32,
        height: u32,
        filter: Filter,
        texel: impl Fn(u32, u32) -> [u8; 4],
    ) -> Scene {
        let at = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Scene {
            materials: vec![Material {
                base_color_texture: Some(0),
                ..Material::default()
            }],
            textures: vec![Texture {
                image: 0,
                wrap: [Wrap::Repeat; 2],
                filter,
            }],
            images: vec![Image {
                name: String::new(),
                width,
                height,
                texels: at.map(|(x, y)| texel(x, y)).collect(),
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn all_bytes_survive_linear_light() {
        for byte in 0..=255u8 {
            let there = linear_from_srgb(f32::from(byte) / 255.0);
            assert_eq!((srgb_from_linear(there) * 255.0).round() as u8, byte);
        }
    }

    #[test]
    fn a_checkerboard_far_away_is_evenly_grey() {
        let board = scene(8, 8, Filter::Mipmapped, |x, y| {
            [[0, 0, 0, 255], [255; 4]][((x + y) % 2) as usize]
        });
        let textures = Textures::new(&board);
        let far = textures.color(0, Vec2::new(0.3, 0.8), [Vec2::X, Vec2::Y]);
        // Half the light, kept as the nearest of 256 sRGB values.
        assert!((far.x - 0.5).abs() < 0.005, "{far}");
    }

    #[test]
    fn invisible_colours_do_not_bleed_into_coarse_levels() {
        let leaf = scene(2, 2, Filter::Mipmapped, |x, _| {
            [[0, 255, 0, 255], [255, 0, 255, 0]][x as usize]
        });
        let far = Textures::new(&leaf).color(0, Vec2::splat(0.5), [Vec2::X, Vec2::Y]);
        assert!(
            far.x < 1e-3 && far.y > 0.999 && (far.w - 0.5).abs() < 0.005,
            "{far}"
        );
    }

    proptest! {
        /// Linear interpolation reproduces a texture that is linear in texel coordinates, except
        /// where it wraps.
        #[test]
        fn interpolates_between_texel_centres(u in 0.1..0.9f32, v in 0.1..0.9f32) {
            let ramp = scene(16, 16, Filter::Linear, |x, y| [0, 0, 0, (x * 10 + y) as u8]);
            let color = Textures::new(&ramp).color(0, Vec2::new(u, v), [Vec2::ZERO; 2]);
            let alpha = color.w * 255.0;
            let expected = (u * 16.0 - 0.5) * 10.0 + v * 16.0 - 0.5;
            // Four products of numbers up to 255, in f32.
            prop_assert!((alpha - expected).abs() < 1e-3, "{alpha} is not {expected}");
        }

        /// Whatever the coordinates, what is shown are colours of the texture.
        #[test]
        fn all_coordinates_show_the_texture(
            uv in prop::array::uniform2(prop::num::f32::ANY),
            wrap in prop::array::uniform2(prop::sample::select(
                vec![Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge])),
            filter in prop::sample::select(vec![Filter::Nearest, Filter::Linear, Filter::Mipmapped]),
            size in prop::array::uniform2(1..9u32),
        ) {
            let mut board = scene(size[0], size[1], filter, |x, y| [0, 0, 0, (51 + x + y) as u8]);
            board.textures[0].wrap = wrap;
            let color = Textures::new(&board).color(0, Vec2::from(uv), [Vec2::ZERO; 2]);
            prop_assert!((0.19..0.3).contains(&color.w), "{}", color);
        }

        /// The greatest alpha of some cells is no less than that of any of them, the same for a
        /// single one, and comes from cells that are no farther away than the cells are long.
        #[test]
        fn greatest_alpha_is_a_near_bound(
            (width, height, alpha) in (1..20u32, 1..20u32).prop_flat_map(|(width, height)| {
                let mostly_clear = prop_oneof![9 => Just(0), 1 => 0..=255u8];
                let alpha = prop::collection::vec(mostly_clear, (width * height) as usize);
                (Just(width), Just(height), alpha)
            }),
            wrap in prop::array::uniform2(prop::sample::select(
                vec![Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge])),
            filter in prop::sample::select(vec![Filter::Nearest, Filter::Linear]),
            first in prop::array::uniform2(-30..30i64),
            count in prop::array::uniform2(0..12i64),
        ) {
            let mut leaf = scene(width, height, filter, |x, y| [0, 0, 0, alpha[(y * width + x) as usize]]);
            leaf.textures[0].wrap = wrap;
            leaf.materials[0].alpha = AlphaMode::Mask { cutoff: 0.5 };
            let textures = Textures::new(&leaf);
            let texture = textures.alpha(Some(0));
            let greatest = |[first, last]: [I64Vec2; 2]| {
                let cells = (first.y..=last.y).flat_map(|y| (first.x..=last.x).map(move |x| I64Vec2::new(x, y)));
                cells.flat_map(|cell| texture.cell(cell).as_flattened().to_vec()).max().unwrap()
            };
            let first = I64Vec2::from(first);
            prop_assert_eq!(texture.greatest([first, first]), greatest([first, first]));
            let last = first + I64Vec2::from(count);
            let found = texture.greatest([first, last]);
            prop_assert!(found >= greatest([first, last]));
            // Beyond its border a clamped texture is all border.
            let near = |cell: I64Vec2| I64Vec2::from_array([0, 1].map(|axis| match wrap[axis] {
                Wrap::ClampToEdge => cell[axis].clamp(0, i64::from([width, height][axis]) - 1),
                _ => cell[axis],
            }));
            let length = count[0].max(count[1]) + 1;
            prop_assert!(found <= greatest([near(first) - length, near(last) + length]));
        }

        /// Wrapped coordinates lie in the texture, repeat with its period (mirrored: twice that)
        /// and are the identity inside.
        #[test]
        fn wrapping_stays_inside(i in -100..100i64, size in 1..9u32) {
            for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
                let w = wrapped(i, size, wrap);
                prop_assert!(w < size);
                if (0..i64::from(size)).contains(&i) {
                    prop_assert_eq!(i64::from(w), i);
                }
                if wrap != Wrap::ClampToEdge {
                    prop_assert_eq!(w, wrapped(i + 2 * i64::from(size), size, wrap));
                }
            }
            let mirrored = wrapped(-1 - i, size, Wrap::MirroredRepeat);
            prop_assert_eq!(mirrored, wrapped(i, size, Wrap::MirroredRepeat));
        }
    }
}
