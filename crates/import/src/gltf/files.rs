//! Fetches what a document refers to: its buffers, and other files.

use super::GltfError;
use super::document::Document;
use super::uri::{Target, decode_uri};
use crate::Load;
use std::collections::BTreeMap;
use std::ops::Range;

/// Files and data that stand behind URIs, each file fetched once.
pub(crate) struct Files<'l> {
    load: &'l mut Load<'l>,
    contents: Vec<Vec<u8>>,
    by_path: BTreeMap<String, usize>,
}

impl<'l> Files<'l> {
    pub(crate) fn new(load: &'l mut Load<'l>) -> Self {
        Self {
            load,
            contents: Vec::new(),
            by_path: BTreeMap::new(),
        }
    }

    /// Fetches what a URI stands for and returns its number.
    ///
    /// # Errors
    ///
    /// When the URI is not followed, or the file cannot be read.
    pub(crate) fn fetch(
        &mut self,
        uri: &str,
        place: &dyn Fn() -> String,
    ) -> Result<usize, GltfError> {
        let content = match decode_uri(uri, place)? {
            Target::Data(bytes) => bytes,
            Target::File(path) => {
                if let Some(&file) = self.by_path.get(&path) {
                    return Ok(file);
                }
                let content = (self.load)(&path).map_err(|error| GltfError::File {
                    place: place(),
                    uri: path.clone(),
                    error,
                })?;
                self.by_path.insert(path, self.contents.len());
                content
            }
        };
        self.contents.push(content);
        Ok(self.contents.len() - 1)
    }

    pub(crate) fn content(&self, file: usize) -> &[u8] {
        &self.contents[file]
    }

    /// Bytes fetched so far.
    pub(crate) fn size(&self) -> u64 {
        self.contents.iter().map(|bytes| bytes.len() as u64).sum()
    }
}

/// The bytes of a document's buffers.
#[derive(Debug)]
pub(crate) struct Buffers<'a> {
    contents: Vec<Vec<u8>>,
    binary: Option<&'a [u8]>,
    sources: Vec<Option<Source>>,
    /// What buffer views hold that were compressed.
    decoded: BTreeMap<usize, Vec<u8>>,
}

#[derive(Clone, Copy, Debug)]
enum Source {
    Binary,
    Content(usize),
}

impl<'a> Buffers<'a> {
    /// Fetches all buffers, and leaves `files` empty.
    ///
    /// A buffer without bytes is an error only once it is used: extensions have such buffers.
    ///
    /// # Errors
    ///
    /// When a buffer cannot be fetched, or has fewer bytes than it says.
    pub(crate) fn load(
        document: &Document,
        binary: Option<&'a [u8]>,
        files: &mut Files<'_>,
    ) -> Result<Self, GltfError> {
        let mut sources = Vec::new();
        for (i, buffer) in document.buffers.iter().enumerate() {
            if buffer.is_fallback() {
                sources.push(None);
                continue;
            }
            let (source, container, has) = match (&buffer.uri, binary) {
                (Some(uri), _) => {
                    let file = files.fetch(uri, &|| format!("buffers[{i}].uri"))?;
                    let has = files.content(file).len();
                    (Source::Content(file), "its file", has)
                }
                (None, Some(bytes)) if i == 0 => (Source::Binary, "the GLB's chunk 1", bytes.len()),
                _ => {
                    sources.push(None);
                    continue;
                }
            };
            if buffer.byte_length > has as u64 {
                return Err(GltfError::OutOfBounds {
                    place: format!("buffers[{i}].byteLength"),
                    needs: buffer.byte_length,
                    container: container.into(),
                    has: has as u64,
                });
            }
            sources.push(Some(source));
        }
        files.by_path.clear();
        Ok(Self {
            contents: std::mem::take(&mut files.contents),
            binary,
            sources,
            decoded: BTreeMap::new(),
        })
    }

    /// Bytes fetched and decoded, without the binary chunk.
    pub(crate) fn size(&self) -> u64 {
        let all = self.contents.iter().chain(self.decoded.values());
        all.map(|bytes| bytes.len() as u64).sum()
    }

    /// Lets bytes stand for a buffer view.
    pub(crate) fn insert(&mut self, view: usize, bytes: Vec<u8>) {
        self.decoded.insert(view, bytes);
    }

    /// The bytes of a buffer view of a checked document, from an offset in it on.
    ///
    /// # Errors
    ///
    /// When the buffer has no bytes.
    pub(crate) fn view(
        &self,
        document: &Document,
        view: usize,
        offset: u64,
    ) -> Result<&[u8], GltfError> {
        let bytes = match self.decoded.get(&view) {
            Some(bytes) => bytes,
            None => {
                let view = &document.buffer_views[view];
                let end = view.byte_offset + view.byte_length;
                self.bytes(view.buffer, view.byte_offset..end)?
            }
        };
        // An empty accessor may point beyond its view.
        Ok(bytes.get(offset as usize..).unwrap_or_default())
    }

    /// A part of a buffer of a checked document.
    ///
    /// # Errors
    ///
    /// When the buffer has no bytes.
    pub(crate) fn bytes(&self, buffer: usize, range: Range<u64>) -> Result<&[u8], GltfError> {
        let bytes = match self.sources[buffer] {
            Some(Source::Binary) => self.binary.expect("a source has bytes"),
            Some(Source::Content(file)) => &self.contents[file],
            None => {
                return Err(GltfError::NoBytes {
                    place: format!("buffers[{buffer}]"),
                });
            }
        };
        Ok(&bytes[range.start as usize..range.end as usize])
    }
}
