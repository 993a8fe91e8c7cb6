//! Decodes pictures, within limits.

pub(crate) mod ktx2;

use farfield_scene::Image;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// The greatest side in texels; beyond it no common graphics card holds a texture.
const GREATEST_SIDE: u32 = 32_768;

/// An upper bound of the texels that one byte of a PNG or JPEG can hold. A PNG has at most 8 texels
/// in a byte, and deflate shrinks at most 1032 times; a JPEG has at least one bit for 64 texels.
/// What claims more lies, and would have memory allocated for nothing.
///
/// Of WebP and KTX2 there is no such bound: one colour takes a few bytes at any size. Those that
/// are larger than `FREE_TEXELS` must hold the bound as well.
const MOST_TEXELS_PER_BYTE: u64 = 8 * 1032;
const FREE_TEXELS: u64 = 1 << 24;

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
    if width.max(height) > GREATEST_SIDE {
        Err(format!(
            "is {width} x {height} texels large, at most {GREATEST_SIDE} a side are read"
        ))
    } else if texels > (MOST_TEXELS_PER_BYTE * bytes.len() as u64).max(free) {
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
    let image = DynamicImage::from_decoder(open(bytes)?).map_err(|e| e.to_string())?;
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
        Some(_) => reader.into_decoder().map_err(|e| e.to_string()),
    }
}
