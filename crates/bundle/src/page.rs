//! Images as PNG files.

use farfield_scene::Image;

/// The image as a PNG file of 8-bit RGBA texels, without further chunks.
///
/// The colours of transparent texels are kept. The same image gives the same bytes. Takes about
/// 0.1 s for a million texels.
///
/// # Panics
///
/// When the image has no texels, or not `width` x `height`.
pub fn encode_png(image: &Image) -> Vec<u8> {
    let (width, height) = (image.width, image.height);
    let texels = image.texels.as_flattened();
    assert!(
        width > 0 && height > 0 && texels.len() == width as usize * height as usize * 4,
        "{image:?} has {} texels",
        image.texels.len()
    );
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(texels)?;
        writer.finish()
    });
    written.expect("sizes are right and memory does not fail");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::images;
    use proptest::prelude::*;

    proptest! {
        /// Every texel is kept, colours under transparent ones too.
        #[test]
        fn images_round_trip(image in images()) {
            let bytes = encode_png(&image);
            let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
            let mut texels = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut texels).unwrap();
            prop_assert_eq!((info.width, info.height), (image.width, image.height));
            prop_assert_eq!(info.color_type, png::ColorType::Rgba);
            prop_assert_eq!(&texels, image.texels.as_flattened());
            prop_assert_eq!(encode_png(&image), bytes);
        }
    }
}
