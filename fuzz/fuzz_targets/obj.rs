//! An OBJ file of any bytes, which is its own material library, is refused, or a sound scene.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut beside = |_: &str| Ok(bytes.to_vec());
    if let Ok(imported) = farfield_import::read_obj(bytes, &mut beside) {
        assert_eq!(imported.scene.check(), Ok(()));
    }
});
