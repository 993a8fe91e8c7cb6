//! A picture of any bytes, PNG, JPEG, WebP or KTX2, is refused, or one texture of a sound scene.

#![no_main]

/// A triangle that shows the picture.
const SCENE: &[u8] = b"mtllib a\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
const LIBRARY: &[u8] = b"newmtl a\nmap_Kd b\n";

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut beside = |name: &str| Ok(if name == "a" { LIBRARY } else { bytes }.to_vec());
    if let Ok(imported) = farfield_import::read_obj(SCENE, &mut beside) {
        assert_eq!(imported.scene.check(), Ok(()));
        assert_eq!(imported.scene.images.len(), 1);
    }
});
