//! Decodes images, within limits.

use super::GltfError;
use super::document::Document;
use super::files::{Buffers, Files};
use farfield_scene::Image;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io::Cursor;

/// The greatest side in texels; beyond it no common graphics card holds a texture.
const GREATEST_SIDE: u32 = 32_768;

/// An upper bound of the texels that one byte of a file can hold. A PNG has at most 8 texels in a
/// byte, and deflate shrinks at most 1032 times; a JPEG has at least one bit for 64 texels. What
/// claims more lies, and would have memory allocated for nothing.
const MOST_TEXELS_PER_BYTE: u64 = 8 * 1032;

/// Bytes of decoded images that any file may have, and how many more for each of its bytes.
/// Files with much flat colour shrink about a hundredfold.
const DECODED_BYTES: u64 = 1 << 30;
const DECODED_BYTES_PER_BYTE: u64 = 128;

/// Decodes the given images of a document, in parallel. Those with the same bytes are decoded once
/// and the second list tells which of the first each one is.
///
/// # Errors
///
/// When an image cannot be fetched or decoded, or all together are too large for a file of
/// `size` bytes with those the images add.
pub(crate) fn read_images(
    document: &Document,
    wanted: &[usize],
    buffers: &Buffers<'_>,
    files: &mut Files<'_>,
    size: u64,
) -> Result<(Vec<Image>, Vec<u32>), GltfError> {
    // Fetch first, so that the same source is known by the same key.
    let mut places = BTreeMap::new();
    let mut sources: Vec<(usize, Bytes)> = Vec::new();
    let mut slots = Vec::new();
    for &index in wanted {
        let image = &document.images[index];
        let bytes = match (image.buffer_view, &image.uri) {
            (Some(view), _) => Bytes::View(view),
            (None, Some(uri)) => Bytes::File(files.fetch(uri, &|| format!("images[{index}].uri"))?),
            (None, None) => return Err(fault(index, "has neither uri nor bufferView")),
        };
        slots.push(*places.entry(bytes).or_insert_with(|| {
            sources.push((index, bytes));
            sources.len() as u32 - 1
        }));
    }
    let limit = DECODED_BYTES + DECODED_BYTES_PER_BYTE * (size + files.size());

    let mut encoded = Vec::new();
    let mut decoded_size = 0;
    for &(index, bytes) in &sources {
        let bytes = match bytes {
            Bytes::View(view) => buffers.view(document, view, 0)?,
            Bytes::File(file) => files.content(file),
        };
        let [width, height] = check_size(bytes).map_err(|problem| fault(index, &problem))?;
        decoded_size += 4 * u64::from(width) * u64::from(height);
        if decoded_size > limit {
            return Err(GltfError::TooLarge {
                place: format!("images[{index}]"),
                limit,
                unit: "bytes of images",
                remedy: "use smaller images",
            });
        }
        encoded.push((index, bytes));
    }
    let decoded: Vec<_> = encoded
        .into_par_iter()
        .map(|(index, bytes)| {
            let mut image = decode(bytes).map_err(|problem| fault(index, &problem))?;
            let source = &document.images[index];
            let uri = source.uri.as_ref().filter(|uri| !uri.starts_with("data:"));
            image.name = match (&source.name, uri) {
                (Some(name), _) if !name.is_empty() => name.clone(),
                (_, Some(uri)) => uri.clone(),
                _ => format!("image {index}"),
            };
            Ok(image)
        })
        .collect();
    // The first error of the file, not of the fastest thread.
    let images = decoded.into_iter().collect::<Result<_, _>>()?;
    Ok((images, slots))
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Bytes {
    View(usize),
    File(usize),
}

fn fault(image: usize, problem: &str) -> GltfError {
    GltfError::Image {
        place: format!("images[{image}]"),
        problem: problem.into(),
    }
}

/// Width and height, from the header alone.
fn check_size(bytes: &[u8]) -> Result<[u32; 2], String> {
    let (width, height) = open(bytes)?.dimensions();
    let texels = u64::from(width) * u64::from(height);
    if width.max(height) > GREATEST_SIDE {
        Err(format!(
            "is {width} x {height} texels large, at most {GREATEST_SIDE} a side are read"
        ))
    } else if texels > MOST_TEXELS_PER_BYTE * bytes.len() as u64 {
        Err(format!(
            "claims {width} x {height} texels, {} bytes cannot hold them",
            bytes.len()
        ))
    } else {
        Ok([width, height])
    }
}

/// All kinds of PNG and JPEG files become 8-bit RGBA.
fn decode(bytes: &[u8]) -> Result<Image, String> {
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
        None => Err("is neither PNG nor JPEG".into()),
        Some(_) => reader.into_decoder().map_err(|e| e.to_string()),
    }
}
