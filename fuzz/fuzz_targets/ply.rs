//! A PLY file of any bytes is refused, or a sound scene.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(imported) = farfield_import::read_ply(bytes) {
        assert_eq!(imported.scene.check(), Ok(()));
    }
});
