//! Lines of OBJ and MTL files: a keyword and its arguments.

use crate::mesh_error::{MeshFileError, quoted};
use std::borrow::Cow;

/// A line that says something.
#[derive(Debug)]
pub(super) struct Line<'a> {
    /// From 1 on; of the first where several are joined.
    pub(super) number: usize,
    text: Cow<'a, [u8]>,
}

impl Line<'_> {
    pub(super) fn keyword(&self) -> &[u8] {
        words(&self.text).next().unwrap_or_default()
    }

    /// What follows the keyword, without blanks around it.
    pub(super) fn rest(&self) -> &[u8] {
        let text = self.text.trim_ascii_start();
        text[self.keyword().len()..].trim_ascii()
    }

    /// The words after the keyword.
    pub(super) fn arguments(&self) -> impl Iterator<Item = &[u8]> {
        words(&self.text).skip(1)
    }

    /// All after the keyword, as names with blanks are written.
    pub(super) fn name(&self) -> String {
        String::from_utf8_lossy(self.rest()).into_owned()
    }

    pub(super) fn wrong(&self, problem: impl Into<String>, remedy: &'static str) -> MeshFileError {
        MeshFileError::new(format!("line {}", self.number), problem, remedy)
    }

    /// The first arguments as numbers; those that are missing are what `defaults` say, `None` is
    /// an error.
    pub(super) fn numbers<const N: usize>(
        &self,
        defaults: [Option<f64>; N],
    ) -> Result<[f64; N], MeshFileError> {
        let mut numbers = [0.0; N];
        let mut arguments = self.arguments();
        for (i, default) in defaults.into_iter().enumerate() {
            numbers[i] = match (arguments.next(), default) {
                (Some(word), _) => self.number_from(word)?,
                (None, Some(default)) => default,
                (None, None) => {
                    let keyword = String::from_utf8_lossy(self.keyword());
                    let problem = format!("{keyword} has {i} numbers, expected {N}");
                    return Err(self.wrong(problem, EXPORT));
                }
            };
        }
        Ok(numbers)
    }

    /// A word of the line as a number.
    pub(super) fn number_from(&self, word: &[u8]) -> Result<f64, MeshFileError> {
        let text = std::str::from_utf8(word).ok();
        text.and_then(|text| text.parse().ok())
            .ok_or_else(|| self.wrong(format!("{} is no number", quoted(word)), EXPORT))
    }
}

pub(super) const EXPORT: &str = "export the file again";

pub(super) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// A file's lines, without comments and empty ones; those that end with a backslash are joined
/// with the next.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let mut plain = (1..).zip(bytes.split(|&byte| byte == b'\n'));
    std::iter::from_fn(move || {
        loop {
            let (number, text) = plain.next()?;
            let mut text = Cow::Borrowed(without_comment(text));
            while let Some(open) = text.strip_suffix(b"\\") {
                let mut joined = open.to_vec();
                joined.push(b' ');
                if let Some((_, next)) = plain.next() {
                    joined.extend(without_comment(next));
                }
                text = Cow::Owned(joined);
            }
            if words(&text).next().is_some() {
                return Some(Line { number, text });
            }
        }
    })
}

/// A line up to its comment, without blanks at its end.
fn without_comment(line: &[u8]) -> &[u8] {
    let end = line.iter().position(|&byte| byte == b'#');
    line[..end.unwrap_or(line.len())].trim_ascii_end()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_joined_numbered_and_stripped() {
        let text = b"\xEF\xBB\xBF# comment\r\n  v 1 \\\r\n2 3 # more\n\n\t g  a b  \nf\\";
        let found: Vec<_> = lines(text)
            .map(|line| {
                let [keyword, rest] = [line.keyword(), line.rest()].map(String::from_utf8_lossy);
                (line.number, keyword.into_owned(), rest.into_owned())
            })
            .collect();
        let expected = [(2, "v", "1  2 3"), (5, "g", "a b"), (6, "f", "")];
        assert_eq!(
            found,
            expected.map(|(n, k, r)| (n, k.to_owned(), r.to_owned()))
        );
    }

    #[test]
    fn numbers_are_read_or_told_to_be_none() {
        let line = |text: &'static str| lines(text.as_bytes()).next().unwrap();
        assert_eq!(line("v 1 -2e3 .5").numbers([None; 3]), Ok([1.0, -2e3, 0.5]));
        assert_eq!(line("vt 1").numbers([None, Some(7.0)]), Ok([1.0, 7.0]));
        let message = line("v 1 2").numbers([None; 3]).unwrap_err().to_string();
        assert_eq!(
            message,
            "line 1: v has 2 numbers, expected 3; export the file again"
        );
        let message = line("v 1 x 3").numbers([None; 3]).unwrap_err().to_string();
        assert_eq!(message, "line 1: \"x\" is no number; export the file again");
    }
}
