//! Follows URIs: data that stands in the document, and files beside it.

use super::GltfError;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::{percent_decode, percent_decode_str};

/// What a URI stands for.
#[derive(Debug, PartialEq)]
pub(crate) enum Target {
    /// The bytes themselves.
    Data(Vec<u8>),
    /// A file, by its path relative to the document, with `/` between folders.
    File(String),
}

/// Decodes a URI.
///
/// Relative paths are followed, also upwards through `..`, as real files use them. Absolute paths
/// and network addresses are not: a scene must not choose what is read elsewhere.
///
/// # Errors
///
/// When the URI is absolute or damaged; `place` says where it stands.
pub(crate) fn decode_uri(uri: &str, place: &dyn Fn() -> String) -> Result<Target, GltfError> {
    let refuse = |problem| {
        let uri = match uri.char_indices().nth(60) {
            Some((end, _)) => format!("{}...", &uri[..end]),
            None => uri.to_owned(),
        };
        let place = place();
        Err(GltfError::Uri {
            place,
            uri,
            problem,
        })
    };
    if let Some(data) = uri.strip_prefix("data:") {
        return match decode_data(data) {
            Ok(bytes) => Ok(Target::Data(bytes)),
            Err(problem) => refuse(problem),
        };
    }
    let Ok(path) = percent_decode_str(uri).decode_utf8() else {
        return refuse("is not UTF-8 after percent-decoding; rename the file and export again");
    };
    if path.is_empty() || path.contains('\0') {
        return refuse("names no file; export the glTF file again");
    }
    // A scheme is also how a drive letter looks.
    if path.starts_with(['/', '\\']) || has_scheme(&path) {
        return refuse("is absolute; use a path relative to the glTF file");
    }
    Ok(Target::File(path.into_owned()))
}

/// The bytes of a data URI without its scheme, after RFC 2397.
fn decode_data(data: &str) -> Result<Vec<u8>, &'static str> {
    const LENIENT: GeneralPurposeConfig =
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let (header, content) = data
        .split_once(',')
        .ok_or("has no comma before its data; export the glTF file again")?;
    if header.split(';').skip(1).any(str::is_empty) {
        return Err("has an empty parameter before its data; export the glTF file again");
    }
    if header.ends_with(";base64") {
        GeneralPurpose::new(&STANDARD, LENIENT)
            .decode(content)
            .or(Err("is not base64; export the glTF file again"))
    } else {
        Ok(percent_decode(content.as_bytes()).collect())
    }
}

fn has_scheme(path: &str) -> bool {
    path.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
    use proptest::prelude::*;

    fn decode(uri: &str) -> Result<Target, String> {
        decode_uri(uri, &|| "here".into()).map_err(|e| e.to_string())
    }

    proptest! {
        /// Data come out as they went in, in either encoding.
        #[test]
        fn data_come_out_as_they_went_in(bytes in prop::collection::vec(any::<u8>(), 0..50)) {
            let base64 = base64::prelude::BASE64_STANDARD.encode(&bytes);
            let percent: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
            for uri in [
                format!("data:application/octet-stream;base64,{base64}"),
                format!("data:;base64,{}", base64.trim_end_matches('=')),
                format!("data:,{percent}"),
            ] {
                prop_assert_eq!(decode(&uri), Ok(Target::Data(bytes.clone())));
            }
        }

        /// A relative path comes out as it was, blanks and all, encoded or not.
        #[test]
        fn paths_come_out_as_they_went_in(path in "(\\.\\./)?[a-z äß]{1,5}/[a-z]{1,5} [0-9]\\.png") {
            let encoded = utf8_percent_encode(&path, NON_ALPHANUMERIC).to_string();
            prop_assert_eq!(decode(&path), Ok(Target::File(path.clone())));
            prop_assert_eq!(decode(&encoded), Ok(Target::File(path)));
        }
    }

    #[test]
    fn what_lies_elsewhere_is_refused() {
        for uri in [
            "/etc/passwd",
            "%2Fetc/passwd",
            "\\\\server\\share",
            "C:/a.bin",
            "file:///a.bin",
            "https://example.org/a.bin",
            "http%3A//example.org/a.bin",
        ] {
            let message = decode(uri).unwrap_err();
            assert!(message.contains("is absolute"), "{message}");
        }
        for uri in [
            "",
            "a%00",
            "a%FF",
            "data:x",
            "data:;base64,=?",
            "data:a/b;;base64,AA==",
        ] {
            let message = decode(uri).unwrap_err();
            assert!(message.starts_with("here: the URI"), "{message}");
        }
    }
}
