//! What is read from files besides plain glTF: real models with extensions, and OBJ up to a
//! verified bundle.

use crate::setup::{contents, model, options, verified};
use farfield_import::{Imported, read};
use farfield_scene::Scene;
use glam::DVec3;
use std::fs;
use std::path::Path;
use xtask::{Console, SceneChoice, VerifyOptions, Views, bake, verify};

/// A real model, where there is one, and whether all in it fits together.
fn imported(name: &str) -> Option<Imported> {
    let imported = read(&model(name)?).unwrap();
    imported.scene.check().unwrap();
    Some(imported)
}

/// Least and greatest corner of all objects in the world.
fn bounds(scene: &Scene) -> [DVec3; 2] {
    let points = scene.objects.iter().enumerate().flat_map(|(i, object)| {
        let vertices = scene.meshes[object.mesh as usize].vertices.clone();
        vertices.map(move |vertex| scene.world_position(i as u32, vertex))
    });
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[a, b], p| {
        [a.min(p), b.max(p)]
    })
}

/// Whether two scenes fill the same box, to a fraction of its size.
fn assert_same_bounds(a: &Scene, b: &Scene, fraction: f64) {
    let (a, b) = (bounds(a), bounds(b));
    let off = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    let size = (a[1] - a[0]).max_element();
    assert!(off.max_element() <= fraction * size, "{a:?} and {b:?}");
}

#[test]
fn a_model_compressed_with_draco_is_the_same_model() {
    let Some(compressed) = imported("ext/2CylinderEngine.draco.glb") else {
        return;
    };
    let without_area = 110_336 - compressed.scene.drawn_triangles();
    // Rounding to 11 bits or so flattens some.
    assert!(without_area < 100, "{without_area} triangles are lost");
    assert_eq!(compressed.scene.objects.len(), 67);
    if let Some(plain) = imported("2CylinderEngine.glb") {
        assert_same_bounds(&plain.scene, &compressed.scene, 1e-3);
    }
}

#[test]
fn a_model_compressed_with_meshopt_has_all_its_triangles() {
    let Some(bunny) = imported("ext/stanford-bunny.meshopt.glb") else {
        return;
    };
    assert_eq!(bunny.scene.drawn_triangles(), 144_046);
    assert_eq!(bunny.warnings, [""; 0]);
    // As the accessor in the file says.
    let [least, greatest] = bounds(&bunny.scene);
    let said = [
        DVec3::new(-0.9559, 0.021, -0.543),
        DVec3::new(0.6579, 1.6418, 0.6895),
    ];
    assert!((least - said[0]).abs().max_element() < 1e-6, "{least}");
    assert!(
        (greatest - said[1]).abs().max_element() < 1e-6,
        "{greatest}"
    );
}

#[test]
fn textures_of_basis_universal_look_like_their_originals() {
    let Some(lamp) = imported("ext/StainedGlassLamp.ktx2.glb") else {
        return;
    };
    assert_eq!(lamp.scene.drawn_triangles(), 35_132);
    let Some(plain) = imported("StainedGlassLamp.glb") else {
        return;
    };
    assert_same_bounds(&plain.scene, &lamp.scene, 1e-6);
    // Base colours of materials of the same name, on the average over the picture.
    let mean = |scene: &Scene, name: &str| {
        let material = scene.materials.iter().find(|m| m.name == name)?;
        let texture = &scene.textures[material.base_color_texture? as usize];
        let texels = &scene.images[texture.image as usize].texels;
        let sum = texels.iter().fold(DVec3::ZERO, |sum, &[r, g, b, _]| {
            sum + DVec3::new(r.into(), g.into(), b.into())
        });
        Some(sum / texels.len() as f64)
    };
    let mut compared = 0;
    for material in &plain.scene.materials {
        let means = [&plain.scene, &lamp.scene].map(|scene| mean(scene, &material.name));
        if let [Some(a), Some(b)] = means {
            let off = (a - b).abs().max_element();
            assert!(off < 4.0, "{}: {a} and {b}", material.name);
            compared += 1;
        }
    }
    assert!(compared >= 4, "{compared} materials were compared");
}

#[test]
fn instances_are_drawn_as_often_as_they_are() {
    let name = "conformance/SimpleInstancing/SimpleInstancing.gltf";
    let Some(boxes) = imported(name) else { return };
    assert_eq!(boxes.scene.objects.len(), 125);
    assert_eq!(boxes.scene.meshes.len(), 1);
    assert_eq!(boxes.scene.drawn_triangles(), 125 * 12);
}

#[test]
fn points_and_lines_are_left_out_and_counted() {
    let name = "conformance/MeshPrimitiveModes/MeshPrimitiveModes.gltf";
    let Some(modes) = imported(name) else { return };
    let dropped = ["primitives of points or lines, dropped: 4"];
    assert_eq!(modes.warnings, dropped);
    // A hexagon and some as separate triangles, as a strip and as a fan.
    assert_eq!(modes.scene.objects.len(), 3);
    assert_eq!(modes.scene.drawn_triangles(), 16);
}

#[test]
fn sparse_elements_stand_out() {
    let name = "conformance/SimpleSparseAccessor/SimpleSparseAccessor.gltf";
    let Some(sheet) = imported(name) else { return };
    assert_eq!(sheet.scene.drawn_triangles(), 12);
    // A strip of 6 x 1 without the elements that are replaced.
    let said = [DVec3::ZERO, DVec3::new(6.0, 4.0, 0.0)];
    assert_eq!(bounds(&sheet.scene), said);
}

/// A house of two textured walls and a masked one, in a folder.
fn write_house(folder: &Path) {
    let object = "mtllib house.mtl\nv -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nv 0 2 0\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        o wall\nusemtl brick\nf 1/1 2/2 3/3 4/4\no gable\nusemtl leaf\nf 4/1 3/2 5/3\n";
    let library =
        "newmtl brick\nmap_Kd brick.png\nnewmtl leaf\nmap_Kd brick.png\nmap_d brick.png\n";
    fs::write(folder.join("house.obj"), object).unwrap();
    fs::write(folder.join("house.mtl"), library).unwrap();
    let picture = image::RgbaImage::from_fn(8, 8, |x, y| {
        image::Rgba([200, 100, (x * 30) as u8, if y < 6 { 255 } else { 0 }])
    });
    picture.save(folder.join("brick.png")).unwrap();
}

/// An OBJ file is baked and verified like any scene, and its bundle knows all its files.
#[test]
fn an_obj_file_holds_and_is_known_again() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("house.obj");
    write_house(folder.path());
    let dir = folder.path().join("bundle");
    bake(
        &options(SceneChoice::File(scene), 64, &dir),
        &Console::Silent,
    )
    .unwrap();
    let report = verified(&dir, 9);
    assert!(report.holds && report.gap_pixels == 0, "{report:?}");

    let before = contents(&dir);
    for name in ["house.mtl", "brick.png"] {
        let path = folder.path().join(name);
        let sound = fs::read(&path).unwrap();
        let changed = match name {
            "house.mtl" => [&sound[..], b"Kd 0.5 0.5 0.5\n"].concat(),
            // After the end of a PNG.
            _ => [&sound[..], b"more"].concat(),
        };
        fs::write(&path, changed).unwrap();
        let look = VerifyOptions {
            dir: dir.clone(),
            scene: None,
            views: Views::First(1),
        };
        let message = format!("{:#}", verify(&look, &Console::Silent).unwrap_err());
        assert!(
            message.contains("not the scene that was baked"),
            "{message}"
        );
        fs::write(&path, sound).unwrap();
    }
    assert_eq!(contents(&dir), before, "verify changed the bundle");
}
