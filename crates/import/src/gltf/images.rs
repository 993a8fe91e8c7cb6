//! Fetches a document's images and has them decoded.

use super::GltfError;
use super::document::Document;
use super::files::{Buffers, Files};
use crate::pictures::{check_size, decode, decoded_limit};
use farfield_scene::Image;
use rayon::prelude::*;
use std::collections::BTreeMap;

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
    let limit = decoded_limit(size + files.size());

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
