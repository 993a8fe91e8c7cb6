//! A manifest of any bytes is read or refused.

#![no_main]

use std::sync::LazyLock;

static FOLDER: LazyLock<tempfile::TempDir> =
    LazyLock::new(|| tempfile::tempdir().expect("there is room for a folder"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let dir = FOLDER.path();
    let manifest = dir.join(farfield_bundle::MANIFEST_FILE);
    std::fs::write(manifest, bytes).expect("the file can be written");
    let _ = farfield_bundle::read(dir);
});
