//! Takes apart the binary container (GLB).

use super::GltfError;

/// The document of a glTF file as JSON text, and the binary chunk of a GLB file.
#[derive(Debug, PartialEq)]
pub(crate) struct Container<'a> {
    pub(crate) json: &'a [u8],
    pub(crate) binary: Option<&'a [u8]>,
}

/// Takes a GLB file apart, or passes a text file on without its byte order mark.
///
/// Bytes after the announced length are ignored, and so are chunks of other types.
///
/// Source: Khronos Group, glTF 2.0 Specification, section 4.4.
///
/// # Errors
///
/// When the header or a chunk is cut off or out of order.
pub(crate) fn open_container(bytes: &[u8]) -> Result<Container<'_>, GltfError> {
    if !bytes.starts_with(b"glTF") {
        let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        return Ok(Container { json, binary: None });
    }
    let cut_off = |place: String, needs: u64, has: usize| GltfError::CutOff {
        place,
        needs,
        has: has as u64,
    };
    let [version, length] = [4, 8].map(|at| word(bytes, at));
    let (Some(version), Some(length)) = (version, length) else {
        return Err(cut_off("GLB header".into(), 12, bytes.len()));
    };
    if version != 2 {
        return Err(GltfError::Version {
            place: "GLB header",
            version: version.to_string(),
        });
    }
    let file = bytes
        .get(..length as usize)
        .ok_or_else(|| cut_off("GLB header".into(), length.into(), bytes.len()))?;

    let mut json = None;
    let mut binary = None;
    let mut rest = file.get(12..).unwrap_or_default();
    for chunk in 0.. {
        if rest.is_empty() {
            break;
        }
        let place = || format!("GLB chunk {chunk}");
        let [size, kind] = [0, 4].map(|at| word(rest, at));
        let (Some(size), Some(kind)) = (size, kind) else {
            return Err(cut_off(place(), 8, rest.len()));
        };
        let content = &rest[8..];
        let (content, after) = content
            .split_at_checked(size as usize)
            .ok_or_else(|| cut_off(place(), size.into(), content.len()))?;
        let wrong = |problem| {
            let place = place();
            Err(GltfError::Container { place, problem })
        };
        match (&kind.to_le_bytes(), chunk) {
            (b"JSON", 0) if content.is_empty() => {
                return wrong("is empty, it must be the document");
            }
            (b"JSON", 0) => json = Some(content),
            (b"JSON", _) => return wrong("is another JSON chunk, there must be one"),
            (_, 0) => return wrong("is not the JSON chunk, which must be the first"),
            (b"BIN\0", 1) => binary = Some(content),
            (b"BIN\0", _) => return wrong("is the binary chunk, which must be the second"),
            _ => {}
        }
        rest = after;
    }
    match json {
        Some(json) => Ok(Container { json, binary }),
        None => Err(GltfError::Container {
            place: "GLB chunk 0".into(),
            problem: "is missing, there is no JSON chunk",
        }),
    }
}

/// The little-endian word at a byte offset.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let (&word, _) = bytes.get(at..)?.split_first_chunk()?;
    Some(u32::from_le_bytes(word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A GLB file of the given chunks.
    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, content) in chunks {
            file.extend((content.len() as u32).to_le_bytes());
            file.extend(*kind);
            file.extend(*content);
        }
        let length = file.len() as u32;
        file[8..12].copy_from_slice(&length.to_le_bytes());
        file
    }

    proptest! {
        /// The chunks come out as they were put in, whatever follows them.
        #[test]
        fn chunks_come_out_as_they_went_in(
            json in prop::collection::vec(any::<u8>(), 1..20),
            binary in prop::collection::vec(any::<u8>(), 0..20),
            after in prop::collection::vec(any::<u8>(), 0..20),
        ) {
            let mut file = glb(&[(b"JSON", &json), (b"BIN\0", &binary), (b"more", &after)]);
            file.extend(after);
            let expected = Container { json: &json, binary: Some(&binary) };
            prop_assert_eq!(open_container(&file).unwrap(), expected);
        }

        /// A container that lacks its end is refused, wherever it ends.
        #[test]
        fn a_container_without_its_end_is_refused(cut in 1..60usize) {
            let file = glb(&[(b"JSON", b"{   "), (b"BIN\0", &[7; 32])]);
            let file = &file[..file.len().saturating_sub(cut).max(4)];
            prop_assert!(matches!(open_container(file), Err(GltfError::CutOff { .. })), "{} bytes", file.len());
        }
    }

    #[test]
    fn an_empty_document_is_told_with_its_chunk() {
        let file = glb(&[(b"JSON", b""), (b"BIN\0", b"1")]);
        let message = open_container(&file).unwrap_err().to_string();
        assert!(message.starts_with("GLB chunk 0: is empty"), "{message}");
    }

    #[test]
    fn chunks_out_of_order_are_refused() {
        for (chunks, expected) in [
            (&[(b"BIN\0", b"1")] as &[_], "GLB chunk 0"),
            (&[(b"JSON", b"1"), (b"JSON", b"1")], "GLB chunk 1"),
            (
                &[(b"JSON", b"1"), (b"odd!", b"1"), (b"BIN\0", b"1")],
                "GLB chunk 2",
            ),
            (&[], "GLB chunk 0"),
        ] {
            let chunks: Vec<_> = chunks.iter().map(|&(kind, c)| (kind, c as &[u8])).collect();
            match open_container(&glb(&chunks)) {
                Err(GltfError::Container { place, .. }) => assert_eq!(place, expected),
                other => panic!("{other:?}"),
            }
        }
    }
}
