//! What can be wrong with a glTF file.

/// Why a glTF file cannot be read: the place in it, what is wrong there and what helps.
///
/// Places are paths into the document, such as `accessors[3].bufferView`, or parts of a GLB, such
/// as `GLB chunk 1`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GltfError {
    /// The binary container ends before it should.
    #[error(
        "{place}: {needs} bytes are announced, {has} are there; the file was cut off or damaged, fetch or export it again"
    )]
    CutOff {
        /// The part of the container.
        place: String,
        /// Bytes announced.
        needs: u64,
        /// Bytes that are there.
        has: u64,
    },
    /// The binary container is put together wrongly.
    #[error("{place}: {problem}; export the file again")]
    Container {
        /// The part of the container.
        place: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The document is no JSON, or something in it has the wrong type.
    #[error("{place}: {error}; the glTF document is damaged or was written by a faulty exporter")]
    Json {
        /// Where in the document.
        place: String,
        /// What the JSON parser says.
        error: serde_json::Error,
    },
    /// The file is of another version of glTF.
    #[error("{place}: glTF version {version:?} is not supported; convert the file to glTF 2.0")]
    Version {
        /// Where the version stands.
        place: &'static str,
        /// The version.
        version: String,
    },
    /// The file cannot be read without extensions that are not supported.
    #[error(
        "extensionsRequired: {} not supported; export the file without {}",
        listed(names),
        if names.len() == 1 { "it" } else { "them" }
    )]
    Extensions {
        /// All of them, in the order of the file.
        names: Vec<String>,
    },
    /// An index points to nothing.
    #[error("{place}: {index} does not exist, the file has {count} {array}; export it again")]
    Reference {
        /// Where the index stands.
        place: String,
        /// The index.
        index: usize,
        /// What it counts.
        array: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A value is not one of those that glTF allows.
    #[error("{place}: {value}, expected {expected}")]
    Value {
        /// Where the value stands.
        place: String,
        /// The value.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// Something reaches beyond what contains it.
    #[error(
        "{place}: needs {needs} bytes of {container}, which has {has}; the file was cut off or damaged, fetch or export it again"
    )]
    OutOfBounds {
        /// What reaches too far.
        place: String,
        /// Bytes up to its end; `u64::MAX` where that overflows.
        needs: u64,
        /// What should contain it.
        container: String,
        /// The bytes it has.
        has: u64,
    },
    /// A position is infinite or not a number.
    #[error("{place}: element {element} is not finite; repair the mesh or remove the vertex")]
    NotFinite {
        /// The accessor.
        place: String,
        /// The element.
        element: u64,
    },
    /// A triangle uses a vertex that does not exist.
    #[error(
        "{place}: element {element} is vertex {index}, the primitive has {vertices}; export the file again"
    )]
    Vertex {
        /// The accessor with the indices, and who uses it.
        place: String,
        /// The element of the accessor.
        element: u64,
        /// The vertex.
        index: u32,
        /// How many there are.
        vertices: u64,
    },
    /// The nodes are no forest.
    #[error("{place}: node {node} {problem}; nodes must form trees, export the file again")]
    Nodes {
        /// Where the node is mentioned.
        place: String,
        /// The node.
        node: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Reading on would take more memory than a file of this size should need.
    #[error("{place}: would take the file over {limit} {unit}; {remedy}")]
    TooLarge {
        /// What is too large.
        place: String,
        /// The limit for the whole file.
        limit: u64,
        /// What is limited.
        unit: &'static str,
        /// What helps.
        remedy: &'static str,
    },
    /// A URI is none that is followed.
    #[error("{place}: the URI {uri:?} {problem}")]
    Uri {
        /// Where the URI stands.
        place: String,
        /// The URI, shortened.
        uri: String,
        /// Why it is not followed, and what helps.
        problem: &'static str,
    },
    /// A file beside the glTF file cannot be read.
    #[error("{place}: {uri:?} cannot be read: {error}; put it beside the glTF file")]
    File {
        /// Where the file is mentioned.
        place: String,
        /// Its name, as in the glTF file.
        uri: String,
        /// What the loader says.
        error: std::io::Error,
    },
    /// A buffer has no bytes.
    #[error("{place}: has no uri, and the file has no binary chunk for it; export the file again")]
    NoBytes {
        /// The buffer.
        place: String,
    },
    /// Compressed geometry cannot be decoded.
    #[error("{place}: {problem}; compress the file again, or export it without compression")]
    Compressed {
        /// What is compressed.
        place: String,
        /// What the decoder says.
        problem: String,
    },
    /// An image cannot be decoded.
    #[error("{place}: {problem}; store it as PNG or JPEG")]
    Image {
        /// The image.
        place: String,
        /// What the decoder says.
        problem: String,
    },
}

fn listed(names: &[String]) -> String {
    match names {
        [one] => format!("{one} is"),
        _ => format!("{} are", names.join(", ")),
    }
}
