//! A glTF file of any bytes is refused, or a sound scene.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // What lies beside the file is of no other bytes.
    let mut beside = |_: &str| Ok(bytes.to_vec());
    if let Ok(imported) = farfield_import::read_gltf(bytes, &mut beside) {
        assert_eq!(imported.scene.check(), Ok(()));
    }
});
