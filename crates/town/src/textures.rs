//! The paintings on the surfaces, a file for each family.
//!
//! Textures that repeat are built from noise that tiles and whole numbers of stones.
//! Light from above is hinted at: edges are brighter on top and darker below, and joints, corners
//! and the walls under eaves are dark.

pub(crate) mod clay;
pub(crate) mod foliage;
pub(crate) mod glass;
pub(crate) mod ground;
pub(crate) mod masonry;
pub(crate) mod metal;
pub(crate) mod plaster;
pub(crate) mod wood;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Detail;
    use farfield_scene::Image;

    /// Mean difference of neighbouring columns, each with the one to its right, the last with the
    /// first.
    fn steps_across(image: &Image) -> Vec<f64> {
        let (width, height) = (image.width as usize, image.height as usize);
        let difference = |x: usize, y: usize| {
            let a = image.texels[y * width + x];
            let b = image.texels[y * width + (x + 1) % width];
            (0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>()
        };
        (0..width)
            .map(|x| (0..height).map(|y| difference(x, y)).sum::<f64>() / height as f64)
            .collect()
    }

    fn transposed(image: &Image) -> Image {
        let (width, height) = (image.width, image.height);
        let texel = |i| image.texels[((i % height) * width + i / height) as usize];
        Image {
            name: image.name.clone(),
            width: height,
            height: width,
            texels: (0..width * height).map(texel).collect(),
        }
    }

    /// Over the seam, neighbours differ no more than somewhere within the image.
    fn check_seam(image: &Image) {
        let mut steps = steps_across(image);
        let seam = steps.pop().unwrap();
        let most = steps.into_iter().fold(0.0, f64::max);
        assert!(
            seam <= most,
            "{}: {seam} at the seam, {most} inside",
            image.name
        );
    }

    #[test]
    fn repeating_textures_have_no_seam() {
        for seed in [0, 9, 77] {
            check_seam(&masonry::sandstone(seed).image(Detail::Full));
            for painting in [
                masonry::trim(seed),
                masonry::granite(seed),
                masonry::rubble(seed),
                masonry::brick(seed),
                clay::tiles(seed),
                wood::beam(seed),
                wood::planks(seed),
                metal::copper(seed),
                clay::slates(seed),
                foliage::bark(seed),
                foliage::hedge(seed),
                ground::setts(seed),
                ground::flags(seed),
                ground::grass(seed),
                ground::rock(seed),
                plaster::plaster(seed),
            ] {
                let image = painting.image(Detail::Full);
                check_seam(&image);
                check_seam(&transposed(&image));
            }
        }
    }

    /// Nowhere so dark or bright that light and weathering could not be told any more.
    #[test]
    fn textures_are_neither_black_nor_burnt_out() {
        for painting in [masonry::sandstone(3), clay::tiles(3), wood::braced_panel(3)] {
            let image = painting.image(Detail::Full);
            let texels = image.texels.len();
            let extreme = image.texels.iter().filter(|[r, g, b, _]| {
                let sum = u32::from(*r) + u32::from(*g) + u32::from(*b);
                !(30..740).contains(&sum)
            });
            assert!(extreme.count() * 100 < texels, "{}", image.name);
        }
    }
}
