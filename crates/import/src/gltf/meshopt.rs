//! Decodes buffer views that are compressed with EXT_meshopt_compression.

use super::GltfError;
use super::document::Document;
use super::files::Buffers;
use meshoptimizer_rs::codec::{BufferView, Filter, Mode};
use meshoptimizer_rs::{Error, Workspace};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// An upper bound of the bytes that one byte of a stream becomes: attributes take two bits at
/// least for sixteen of their bytes.
const MOST_BYTES_PER_BYTE: u64 = 64;

/// Bytes that all buffer views of any file may become, and how many more for each of its bytes:
/// views can share a stream.
const DECODED_BYTES: u64 = 1 << 28;

/// Decodes the compressed buffer views that accessors use, in parallel.
///
/// They are decoded also where another buffer holds the same data uncompressed: it may be absent,
/// and nothing is lost by this compression.
///
/// * `size` - of the file with its buffers, in bytes
///
/// Source: Khronos Group, EXT_meshopt_compression.
///
/// # Errors
///
/// When a stream is damaged or cannot be as long as it says, or all together are too large.
pub(crate) fn decode_views(
    document: &Document,
    buffers: &mut Buffers<'_>,
    size: u64,
) -> Result<(), GltfError> {
    let sparse = document.accessors.iter().filter_map(|a| a.sparse.as_ref());
    let sparse = sparse.flat_map(|s| [s.indices.buffer_view, s.values.buffer_view]);
    let dense = document.accessors.iter().filter_map(|a| a.buffer_view);
    let used: BTreeSet<usize> = dense.chain(sparse).collect();

    let limit = DECODED_BYTES + MOST_BYTES_PER_BYTE * size;
    let mut streams = Vec::new();
    let mut total = 0;
    for view in used {
        let source = &document.buffer_views[view];
        let Some(compressed) = &source.extensions.meshopt else {
            continue;
        };
        let place = || format!("bufferViews[{view}].extensions.EXT_meshopt_compression");
        if source.byte_length > MOST_BYTES_PER_BYTE * compressed.byte_length {
            return Err(GltfError::Compressed {
                place: place(),
                problem: format!(
                    "{} bytes cannot become {}",
                    compressed.byte_length, source.byte_length
                ),
            });
        }
        total += source.byte_length;
        if total > limit {
            return Err(GltfError::TooLarge {
                place: place(),
                limit,
                unit: "bytes of decoded buffer views",
                remedy: "it decodes the same data many times; export it again",
            });
        }
        let start = compressed.byte_offset;
        let stream = buffers.bytes(compressed.buffer, start..start + compressed.byte_length)?;
        if compressed.count > 0 {
            streams.push((view, compressed, stream));
        }
    }
    let decoded: Vec<_> = streams
        .into_par_iter()
        .map(|(view, compressed, stream)| {
            let filter = compressed.filter.as_deref().unwrap_or("NONE");
            let decode = || -> Result<Vec<u8>, Error> {
                let (count, stride) = (compressed.count as usize, compressed.byte_stride as usize);
                let layout = BufferView::new(
                    Mode::parse(&compressed.mode)?,
                    Filter::parse(filter)?,
                    count,
                    stride,
                )?;
                layout.decode(stream, &mut Workspace::default())
            };
            let bytes = decode().map_err(|error| GltfError::Compressed {
                place: format!("bufferViews[{view}].extensions.EXT_meshopt_compression"),
                problem: format!("the stream is damaged ({error})"),
            })?;
            Ok((view, bytes))
        })
        .collect();
    // The first error of the file, not of the fastest thread.
    for decoded in decoded {
        let (view, bytes) = decoded?;
        buffers.insert(view, bytes);
    }
    Ok(())
}
