//! Decodes pictures, within limits.

pub(crate) mod ktx2;

use farfield_scene::Image;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// The greatest side in texels; beyond it no common graphics card holds a texture.
const GREATEST_SIDE: u32 = 32_768;

/// Upper bounds of the texels that one byte of a PNG or JPEG can hold. A PNG has at most 8 texels
/// in a byte, and deflate shrinks at most 1032 times; a JPEG has at least one bit for 64 texels.
/// What claims more lies, and would have memory allocated for nothing.
///
/// Of WebP and KTX2 there is no such bound: one colour takes a few bytes at any size. Those that
/// are larger than `FREE_TEXELS` must hold the bound as well.
const MOST_TEXELS_PER_BYTE: u64 = 8 * 1032;
const MOST_TEXELS_PER_BYTE_OF_JPEG: u64 = 8 * 64;
const FREE_TEXELS: u64 = 1 << 24;

/// How a JPEG begins.
const JPEG: &[u8] = b"\xFF\xD8";

/// Bytes of decoded pictures that any scene may have, and how many more for each byte of its files.
/// Files with much flat colour shrink about a hundredfold.
const DECODED_BYTES: u64 = 1 << 30;
const DECODED_BYTES_PER_BYTE: u64 = 128;

/// The bytes that all decoded pictures of a scene may take, whose files have `size` bytes.
pub(crate) fn decoded_limit(size: u64) -> u64 {
    DECODED_BYTES + DECODED_BYTES_PER_BYTE * size
}

/// Width and height in texels, from the header alone.
///
/// # Errors
///
/// When the format is unknown, the header damaged or the picture too large; says what.
pub(crate) fn check_size(bytes: &[u8]) -> Result<[u32; 2], String> {
    let (width, height, free) = if ktx2::is_ktx2(bytes) {
        let [width, height] = ktx2::check_header(bytes)?;
        (width, height, FREE_TEXELS)
    } else {
        let (width, height) = open(bytes)?.dimensions();
        let is_webp = bytes.starts_with(b"RIFF");
        (width, height, if is_webp { FREE_TEXELS } else { 0 })
    };
    let texels = u64::from(width) * u64::from(height);
    let per_byte = match bytes.starts_with(JPEG) {
        true => MOST_TEXELS_PER_BYTE_OF_JPEG,
        false => MOST_TEXELS_PER_BYTE,
    };
    if width.max(height) > GREATEST_SIDE {
        Err(format!(
            "is {width} x {height} texels large, at most {GREATEST_SIDE} a side are read"
        ))
    } else if texels > (per_byte * bytes.len() as u64).max(free) {
        Err(format!(
            "claims {width} x {height} texels, {} bytes cannot hold them",
            bytes.len()
        ))
    } else {
        Ok([width, height])
    }
}

/// A picture whose size was checked, as 8-bit RGBA and without a name.
///
/// # Errors
///
/// When the picture is damaged; says where.
pub(crate) fn decode(bytes: &[u8]) -> Result<Image, String> {
    if ktx2::is_ktx2(bytes) {
        return ktx2::decode(bytes);
    }
    let image = DynamicImage::from_decoder(open(bytes)?).map_err(one_line)?;
    let rgba = image.into_rgba8();
    Ok(Image {
        name: String::new(),
        width: rgba.width(),
        height: rgba.height(),
        texels: rgba.as_raw().as_chunks().0.to_vec(),
    })
}

fn open(bytes: &[u8]) -> Result<impl ImageDecoder + '_, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| e.to_string())?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(GREATEST_SIDE);
    limits.max_image_height = Some(GREATEST_SIDE);
    // The side and the texels a byte are checked instead, before anything is decoded.
    limits.max_alloc = None;
    reader.limits(limits);
    match reader.format() {
        None => Err("is none of PNG, JPEG, WebP and KTX2".into()),
        Some(_) => reader.into_decoder().map_err(one_line),
    }
}

/// A decoder's message, without the line breaks that some have.
fn one_line(error: image::ImageError) -> String {
    let words = error.to_string();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, RgbImage};

    fn jpeg() -> Vec<u8> {
        let picture = RgbImage::from_fn(40, 24, |x, y| image::Rgb([x as u8 * 6, y as u8 * 9, 7]));
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, ImageFormat::Jpeg).unwrap();
        file.into_inner()
    }

    /// The decoder's own message for these ends with a line break.
    #[test]
    fn a_jpeg_that_is_cut_off_is_one_line() {
        let jpeg = jpeg();
        let mut failed = 0;
        for length in 2..jpeg.len() {
            let cut = &jpeg[..length];
            if let Err(message) = check_size(cut).and_then(|_| decode(cut)) {
                assert!(!message.contains('\n'), "{message:?}");
                failed += 1;
            }
        }
        assert!(failed > jpeg.len() / 2, "only {failed} are refused");
    }

    /// A frame header has no checksum, so its size may be anything.
    #[test]
    fn a_jpeg_that_claims_more_than_it_can_hold_is_refused() {
        let mut jpeg = jpeg();
        assert_eq!(check_size(&jpeg), Ok([40, 24]));
        let frame = jpeg.windows(2).position(|m| m == b"\xFF\xC0").unwrap();
        // After the marker, a length and the bits of a sample.
        jpeg[frame + 5..frame + 9].copy_from_slice(&[0x40, 0, 0x40, 0]);
        let message = check_size(&jpeg).unwrap_err();
        assert!(message.contains("claims 16384 x 16384 texels"), "{message}");
    }
}
