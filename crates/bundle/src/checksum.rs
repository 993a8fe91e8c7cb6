//! SHA-256 in hexadecimal digits, of files and of JSON documents that contain their own.

use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::io::{self, Read};

/// Stands in the place of a document's own checksum while it is computed.
const NO_CHECKSUM: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// SHA-256 of `bytes`, as 64 lower-case hexadecimal digits: the form of every checksum in a
/// manifest.
pub fn sha256_hex(bytes: &[u8]) -> String {
    digits(&Sha256::digest(bytes))
}

/// Number of bytes that `source` yields, and their SHA-256. Stops at `limit` + 1 bytes.
pub(crate) fn sha256_of_reader(source: impl Read, limit: u64) -> io::Result<(u64, String)> {
    let mut hash = Sha256::new();
    let bytes = io::copy(&mut source.take(limit.saturating_add(1)), &mut hash)?;
    Ok((bytes, digits(&hash.finalize())))
}

/// Fills in the checksum of a document, which is where `place` says, and returns the document's
/// JSON text.
pub(crate) fn seal<T: Serialize>(document: &mut T, place: fn(&mut T) -> &mut String) -> String {
    let json = |document: &T| {
        let text = serde_json::to_string_pretty(document);
        text.expect("the documents have only string keys") + "\n"
    };
    *place(document) = NO_CHECKSUM.into();
    let sha256 = sha256_hex(json(document).as_bytes());
    *place(document) = sha256.clone();
    let text = json(document);
    debug_assert!(is_sealed(text.as_bytes(), &sha256));
    text
}

/// Whether `stated`, which must occur just once, is the checksum of a document's text in which
/// it counts as zeros.
pub(crate) fn is_sealed(text: &[u8], stated: &str) -> bool {
    let Ok(text) = std::str::from_utf8(text) else {
        return false;
    };
    match text.split_once(stated) {
        Some((before, after)) if !after.contains(stated) => {
            sha256_hex([before, NO_CHECKSUM, after].concat().as_bytes()) == stated
        }
        _ => false,
    }
}

fn digits(hash: &[u8]) -> String {
    hash.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FIPS 180-2, appendix B.1.
    #[test]
    fn abc_has_the_published_checksum() {
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(b"abc"), expected);
        let from_reader = sha256_of_reader(&b"abc"[..], 3).unwrap();
        assert_eq!(from_reader, (3, expected.to_owned()));
    }

    #[test]
    fn an_endless_reader_is_left_after_the_limit() {
        assert_eq!(sha256_of_reader(io::repeat(1), 10_000).unwrap().0, 10_001);
    }
}
