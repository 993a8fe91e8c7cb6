#![doc = include_str!("../README.md")]

mod manifest;
mod view_space;

mod cells;
mod certificate;
mod check;
mod checksum;
mod error;
mod faces;
mod lists;
mod read;
mod write;

mod geometry;
mod glb;
mod gltf;
mod page;

#[cfg(test)]
mod generate;

pub use cells::{
    CELLS_FILE, CELLS_FORMAT, CELLS_SCHEMA, CELLS_VERSION, CellLists, CellRecord, read_cells,
};
pub use certificate::{
    Beyond, CERTIFICATE_FILE, CERTIFICATE_FORMAT, CERTIFICATE_SCHEMA, CERTIFICATE_VERSION,
    Certificate, CertificateState, ProvedBound, WorstFigures, read_certificate, remove_certificate,
    write_certificate,
};
pub use checksum::sha256_hex;
pub use error::{BundleError, ManifestError};
pub use faces::{
    FACES_FILE, FACES_FORMAT, FACES_MOST_VIEWPOINTS, FACES_SCHEMA, FACES_VERSION, FaceLists,
    FaceRecord, read_faces,
};
pub use glb::{GlbTooLarge, cost, glb_from_scene};
pub use lists::LISTS_MOST_BYTES;
pub use manifest::{
    BitfieldsBody, Body, Channels, Cost, FORMAT, FileRecord, Foliage, GLTF_FILE, Generator,
    Impostor, LayerRecord, LayeredBody, MANIFEST_FILE, Manifest, Options, Promise, SCHEMA, Samples,
    SceneSource, Statistics, TdmBody, Technique, VERSION,
};
pub use page::encode_png;
pub use read::read;
pub use view_space::{Side, ViewSpace};
pub use write::{
    FolderKind, NewFile, require_replaceable, require_replaceable_by, write, write_folder,
};
