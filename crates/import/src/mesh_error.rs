//! What can be wrong with an OBJ or PLY file.

/// Why an OBJ or PLY file cannot be read: the place in it, what is wrong there and what helps.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}; {remedy}")]
pub struct MeshFileError {
    /// A line or an element, of a file beside the scene's own with its name, such as `line 7`,
    /// `face 3` or `house.mtl line 2`.
    pub place: String,
    /// What is wrong there.
    pub problem: String,
    /// What helps.
    pub remedy: &'static str,
}

impl MeshFileError {
    pub(crate) fn new(
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: &'static str,
    ) -> Self {
        Self {
            place: place.into(),
            problem: problem.into(),
            remedy,
        }
    }
}

/// Bytes from a file in a message: what is not text is replaced, what is long shortened.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}
