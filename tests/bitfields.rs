//! ID-bitfields end to end: what is baked draws all that is seen, and what is damaged is found.

use crate::setup::{contents, model, verified, write_glb};
use crate::shapes;
use farfield_bundle::{
    BitfieldsBody, Body, CELLS_FILE, CERTIFICATE_FILE, FACES_FILE, FaceLists, GLTF_FILE,
    MANIFEST_FILE, Manifest, NewFile, Technique, encode_png, glb_from_scene, read_cells,
    read_faces,
};
use farfield_scene::{AlphaMode, Filter, Image, Material, Object, Scene, Texture, Wrap};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::f32::consts::{PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};
use xtask::{
    BakeReport, BitfieldsOptions, BuiltIn, Console, SampleChoice, SceneChoice, SeenFrom,
    VerifyOptions, VerifyReport, Views, bake_bitfields, verify,
};

/// What a single view shows.
fn looked_at(dir: &Path, view: u64) -> VerifyReport {
    let options = VerifyOptions {
        dir: dir.to_owned(),
        scene: None,
        views: Views::One(view),
    };
    verify(&options, &Console::Silent).expect("the bundle can be verified")
}

/// A bake for small pictures that is judged by few views.
fn options(scene: SceneChoice, out: &Path) -> BitfieldsOptions {
    BitfieldsOptions {
        resolution: 96,
        held_back: Some(64),
        out: Some(out.to_owned()),
        ..BitfieldsOptions::new(scene)
    }
}

fn around(distances: Option<[f64; 2]>, samples: SampleChoice) -> SeenFrom {
    SeenFrom::Around { distances, samples }
}

/// A box through the boxes, and not along their sides: from its ends their front and their back are seen.
fn inside(cells: [u32; 3]) -> SeenFrom {
    SeenFrom::Inside {
        center: DVec3::splat(2.0),
        size: DVec3::new(0.9, 0.9, 40.0),
        cells,
    }
}

fn baked(options: &BitfieldsOptions) -> BakeReport {
    bake_bitfields(options, &Console::Silent).expect("the scene can be baked")
}

fn failure(options: &BitfieldsOptions) -> String {
    let error = bake_bitfields(options, &Console::Silent).expect_err("it cannot be baked");
    let message = format!("{error:#}");
    assert!(!message.contains('\n'), "more than one line: {message}");
    message
}

/// A block of boxes of two materials, side by side: most of their faces are hidden, whatever the
/// direction. Before it stand a pane of glass and a fence with holes.
fn boxes() -> Scene {
    let mut scene = Scene::default();
    let material = |name: &str, alpha, double_sided| Material {
        name: name.into(),
        base_color: Vec4::new(0.3, 0.6, 0.5, 0.5),
        alpha,
        double_sided,
        ..Material::default()
    };
    scene.materials = vec![
        material("stone", AlphaMode::Opaque, false),
        material("wood", AlphaMode::Opaque, false),
        material("glass", AlphaMode::Blend, true),
        Material {
            base_color: Vec4::ONE,
            base_color_texture: Some(0),
            ..material("fence", AlphaMode::Mask { cutoff: 0.5 }, true)
        },
    ];
    scene.images = vec![Image {
        name: "planks".into(),
        width: 2,
        height: 2,
        texels: vec![[200, 150, 90, 255], [0; 4], [180, 140, 80, 255], [0; 4]],
    }];
    scene.textures = vec![Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    }];
    for i in 0..125u32 {
        let cell = Vec3::new((i % 5) as f32, (i / 5 % 5) as f32, (i / 25) as f32);
        add_box(&mut scene, cell, Vec3::ONE, i % 2);
    }
    add_box(
        &mut scene,
        Vec3::new(2.0, 2.0, 5.2),
        Vec3::new(4.0, 4.0, 0.01),
        2,
    );
    add_box(
        &mut scene,
        Vec3::new(-1.4, 2.0, 2.0),
        Vec3::new(0.01, 6.0, 6.0),
        3,
    );
    scene
}

/// A box with sides along the axes, an object of its own.
fn add_box(scene: &mut Scene, center: Vec3, size: Vec3, material: u32) {
    shapes::add_box(scene, Vec3::ZERO, size, material);
    scene.objects.push(Object {
        name: format!("box {}", scene.objects.len()),
        mesh: scene.meshes.len() as u32 - 1,
        world_from_mesh: DAffine3::from_translation(center.as_dvec3()),
    });
}

/// The boxes, baked, in a folder that is removed at the end.
struct Baked {
    folder: tempfile::TempDir,
    report: BakeReport,
}

impl Baked {
    fn of(scene: &Scene, change: impl FnOnce(&mut BitfieldsOptions)) -> Self {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        let path = write_glb(scene, folder.path());
        let mut options = options(SceneChoice::File(path), &folder.path().join("bundle"));
        change(&mut options);
        let report = baked(&options);
        Self { folder, report }
    }

    fn dir(&self) -> PathBuf {
        self.folder.path().join("bundle")
    }

    fn manifest(&self) -> Manifest {
        farfield_bundle::read(&self.dir()).expect("the bundle is sound")
    }

    fn lists(&self) -> FaceLists {
        read_faces(&self.dir(), &self.manifest()).expect("the lists are sound")
    }

    /// Writes the bundle anew with other lists, or something else changed, and checksums that are right.
    fn write(&self, manifest: &Manifest, lists: &FaceLists, display: &Scene) {
        let uris: Vec<String> = (0..display.images.len())
            .map(|i| format!("textures/{i:03}.png"))
            .collect();
        let images = display.images.iter().zip(&uris);
        let mut files: Vec<NewFile> = images
            .map(|(image, path)| NewFile {
                path: path.clone(),
                bytes: encode_png(image),
            })
            .collect();
        files.push(NewFile {
            path: GLTF_FILE.into(),
            bytes: glb_from_scene(display, &uris).expect("the display is small"),
        });
        files.push(NewFile {
            path: FACES_FILE.into(),
            bytes: lists.to_json().into_bytes(),
        });
        farfield_bundle::write(&self.dir(), manifest, &files).expect("it can be written");
    }

    fn display(&self) -> Scene {
        let imported = farfield_import::read(&self.dir().join(GLTF_FILE));
        imported.expect("the bundle can be read").scene
    }
}

/// Whether neighbours were added, as the manifest tells.
fn neighbors(manifest: &Manifest) -> Option<bool> {
    match manifest.technique {
        Technique::Bitfields { neighbors, .. } => neighbors,
        Technique::Layered { .. } | Technique::Tdm { .. } => panic!("bitfields were asked for"),
    }
}

fn body(manifest: &mut Manifest) -> &mut BitfieldsBody {
    match &mut manifest.impostors[0].body {
        Body::Bitfields(body) => body,
        Body::Layered(_) | Body::Tdm(_) => panic!("bitfields were asked for"),
    }
}

/// Lets a manifest tell what lists come to.
fn count(manifest: &mut Manifest, lists: &FaceLists) {
    let body = body(manifest);
    let lengths = || lists.faces.iter().map(|face| face.draw.len() as u64);
    body.ranges = lengths().sum();
    body.most_ranges = lengths().max().expect("there are faces") as u32;
    body.culled = lists.culled();
}

/// What is baked misses nothing in views that the bake did not see, culls most of what is hidden, draws
/// glass from everywhere, and leaves a certificate and a report.
#[test]
fn hidden_boxes_are_culled_and_nothing_is_missed() {
    let baked = Baked::of(&boxes(), |_| {});
    let found = baked.report.bitfields.expect("these are bitfields");
    assert_eq!(baked.report.triangles_in, 127 * 12);
    // 0.997^1000 = 0.05: so many judge it, however few were held back.
    assert_eq!((found.missed_pixels, found.missed_share), (0, 0.997));
    assert_eq!(neighbors(&baked.manifest()), Some(true));
    assert_eq!(found.always_drawn, 12);
    assert!(found.culled > 0.3, "{} culled", found.culled);
    assert!(found.most_ranges <= 64);

    let lists = baked.lists();
    let display = baked.display();
    assert_eq!(
        (display.objects.len(), display.triangles.len()),
        (1, 127 * 12)
    );
    let glass = display
        .materials
        .iter()
        .position(|m| m.name == "glass")
        .unwrap() as u32;
    for face in &lists.faces {
        let drawn = |at: u32| {
            face.draw
                .iter()
                .any(|[first, end]| (*first..*end).contains(&at))
        };
        for (at, material) in (0..).zip(&display.triangle_materials) {
            assert!(*material != glass || drawn(at));
        }
    }

    let report = verified(&baked.dir(), 96);
    assert!(report.holds, "{:?}", report.broken);
    let figures = report.bitfields.expect("these are bitfields");
    assert_eq!((figures.missed_pixels, figures.wrong_pixels), (0, 0));
    assert!(figures.culled > 0.3 && report.covered_pixels > 10_000);
    // More samples cull more, as the paper has it; six samples cull less than three.
    let over = figures.over_samples;
    assert!(over.is_sorted_by(|a, b| a.samples < b.samples));
    assert!(over.iter().all(|o| o.culled_by_six <= o.culled_by_three));
    assert!(over.iter().all(|o| o.missed_by_six <= o.missed_by_three));
    assert!(over[0].culled_by_six < over[over.len() - 1].culled_by_six);
    assert!(baked.dir().join(CERTIFICATE_FILE).exists());
    let page = fs::read_to_string(baked.dir().join("report.html")).unwrap();
    assert!(page.contains("with the neighbours of what they see"));
    assert!(page.contains("The promise holds") && page.matches("<svg").count() == 2);
}

/// Single views are looked at without leaving more than pictures behind.
#[test]
fn single_views_leave_pictures_only() {
    let baked = Baked::of(&boxes(), |_| {});
    for (view, pictures) in [(7, 4), (0, 8)] {
        let report = looked_at(&baked.dir(), view);
        assert!(report.holds && report.worst_view == view);
        for file in ["report.html", "verify.json", CERTIFICATE_FILE] {
            assert!(!baked.dir().join(file).exists(), "view {view} left {file}");
        }
        let left = fs::read_dir(baked.dir().join("report")).unwrap();
        assert_eq!(left.count(), pictures);
    }
}

/// A ball of triangles, each of which is there twice, in two colours: first all in one, then in the other.
fn doubled_ball() -> Scene {
    const AROUND: u32 = 24;
    let corner = |ring: u32, at: u32| {
        let (up, turn) = (ring as f32 / 12.0, (at % AROUND) as f32 / AROUND as f32);
        let (sin, cos) = (up * PI).sin_cos();
        let (z, x) = (turn * TAU).sin_cos();
        Vec3::new(sin * x, cos, sin * z)
    };
    let quads = (0..12).flat_map(|ring| (0..AROUND).map(move |at| (ring, at)));
    let triangles: Vec<[Vec3; 3]> = quads
        .flat_map(|(ring, at)| {
            let [a, b] = [corner(ring, at), corner(ring, at + 1)];
            let [c, d] = [corner(ring + 1, at), corner(ring + 1, at + 1)];
            [[a, b, c], [b, d, c]]
        })
        .collect();
    let mut scene = shapes::triangle([Vec3::X, Vec3::Y, Vec3::Z]);
    for (color, corners) in [Vec4::new(1.0, 0.2, 0.1, 1.0), Vec4::new(0.1, 0.9, 0.3, 1.0)]
        .into_iter()
        .flat_map(|color| triangles.iter().map(move |t| (color, t)))
    {
        let first = scene.positions.len() as u32;
        scene.positions.extend(corners);
        scene.normals.extend(corners);
        scene.uvs.extend([Vec2::ZERO; 3]);
        scene.colors.extend([color; 3]);
        scene.triangles.push([first, first + 1, first + 2]);
        scene.triangle_materials.push(0);
    }
    scene.meshes[0].vertices.end = scene.positions.len() as u32;
    scene.meshes[0].triangles = 1..scene.triangles.len() as u32;
    scene
}

/// Of triangles that lie in the same place those are seen in a bundle that are seen in the original.
#[test]
fn doubled_triangles_keep_their_order() {
    let baked = Baked::of(&doubled_ball(), |_| {});
    let report = verified(&baked.dir(), 64);
    assert!(report.holds, "{:?}", report.broken);
    let figures = report.bitfields.expect("these are bitfields");
    assert_eq!((figures.missed_pixels, figures.wrong_pixels), (0, 0));
    assert!(report.covered_pixels > 10_000);
}

/// The built-in house, with the usual options but for the size of its pictures.
#[test]
fn the_house_holds() {
    let folder = tempfile::tempdir().unwrap();
    let scene = SceneChoice::BuiltIn(BuiltIn::House);
    let report = baked(&options(scene, &folder.path().join("house")));
    let report = verified(&report.bundle, 64);
    assert!(report.holds, "{:?}", report.broken);
}

/// Given samples promise what they were found to miss, of most views, and say so; the more they are, the
/// more is culled.
#[test]
fn given_samples_promise_what_was_measured() {
    let culled = [8, 40].map(|samples| {
        let baked = Baked::of(&boxes(), |options| {
            options.seen_from = around(None, SampleChoice::Even(samples));
            options.held_back = Some(1200);
        });
        let found = baked.report.bitfields.unwrap();
        assert_eq!(found.viewpoints, samples);
        assert!(found.missed_share >= 0.95);
        assert_eq!(neighbors(&baked.manifest()), Some(false));
        let report = verified(&baked.dir(), 128);
        assert!(report.holds, "{:?}", report.broken);
        assert!(report.bitfields.unwrap().missed_pixels_p95 <= found.missed_pixels);
        let notes = baked.manifest().promise.notes.join(" ");
        assert!(notes.contains("of 1200 views"), "{notes}");
        found.culled
    });
    assert!(culled[0] < culled[1], "{culled:?}");
}

/// Neighbours are added where they are asked for, around the scene and in view cells; then less is culled.
#[test]
fn neighbors_are_added_where_they_are_asked_for() {
    for seen_from in [around(None, SampleChoice::Even(25)), inside([1; 3])] {
        let culled = [Some(true), Some(false), None].map(|asked| {
            let baked = Baked::of(&boxes(), |options| {
                options.seen_from = seen_from.clone();
                options.neighbors = asked;
            });
            assert_eq!(neighbors(&baked.manifest()), Some(asked == Some(true)));
            baked.report.bitfields.unwrap().culled
        });
        assert!(
            culled[0] < culled[1] && culled[1] == culled[2],
            "{culled:?}"
        );
    }
    let baked = Baked::of(&boxes(), |options| options.neighbors = Some(false));
    assert_eq!(neighbors(&baked.manifest()), Some(false));
}

/// A list of viewpoints gives the samples and the distances.
#[test]
fn listed_viewpoints_are_the_samples() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("viewpoints.txt");
    let points: Vec<String> = (0..20)
        .map(|i| {
            let direction = farfield_views::sphere_direction(i, 20);
            let [x, y, z] = (DVec3::splat(2.0) + direction * (12.0 + f64::from(i))).to_array();
            format!("{x} {y} {z}")
        })
        .collect();
    fs::write(&file, format!("# x y z\n{}\n", points.join("\n"))).unwrap();
    let baked = Baked::of(&boxes(), |options| {
        options.seen_from = around(None, SampleChoice::Listed(file));
    });
    assert_eq!(baked.lists().viewpoints.len(), 20);
    let farfield_bundle::ViewSpace::Shell { near, far, .. } = baked.manifest().options.view_space
    else {
        panic!("bitfields are seen from all around");
    };
    assert!(
        near > 11.0 && near < 14.0 && far > 30.0 && far < 33.0,
        "{near} {far}"
    );
    assert!(verified(&baked.dir(), 64).holds);
}

/// From view cells before the boxes their backs are not drawn, from those behind not their fronts; a pane
/// of glass is, from all; and whoever looks finds nothing missing.
#[test]
fn view_cells_hold() {
    let baked = Baked::of(&boxes(), |options| {
        options.seen_from = inside([1, 1, 5]);
        options.held_back = Some(8);
    });
    let found = baked.report.bitfields.unwrap();
    assert_eq!(found.lists, 5);
    assert_eq!(neighbors(&baked.manifest()), Some(false));
    // 0.997^1000 = 0.05.
    assert_eq!((found.missed_pixels, found.missed_share), (0, 0.997));
    assert!(found.culled > 0.6, "{}", found.culled);
    let lists = read_cells(&baked.dir(), &baked.manifest()).expect("the lists are sound");
    // 12 triangles of glass, the next to last material.
    let [.., glass, fence, _] = lists.parts[..] else {
        panic!("there are four parts");
    };
    assert_eq!(fence - glass, 12);
    for cell in &lists.cells {
        assert!(cell.draw.contains(&[glass, fence]));
    }
    assert!(lists.cells[0] != lists.cells[4]);
    // The middle one lies amid the boxes.
    let warnings = baked.manifest().warnings;
    let [warning] = &warnings[..] else {
        panic!("not one warning: {warnings:?}");
    };
    assert!(
        warning.contains("reach into something solid: 1 of 5. ")
            && warning.contains("cell 2, box:2,2,2:0.9,0.9,8, the viewpoint 2,2,2 has 100 % "),
        "{warning}"
    );
    let report = verified(&baked.dir(), 96);
    assert!(report.holds, "{:?}", report.broken);
    assert!(report.covered_pixels > 0);
}

/// A cell in the built-in house is told, one in its yard is not.
#[test]
fn view_cells_in_solids_are_told() {
    let warnings = |center| {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("house");
        baked(&BitfieldsOptions {
            seen_from: SeenFrom::Inside {
                center,
                size: DVec3::new(4.0, 1.0, 4.0),
                cells: [2, 1, 1],
            },
            held_back: Some(2),
            ..options(SceneChoice::BuiltIn(BuiltIn::House), &dir)
        });
        farfield_bundle::read(&dir).unwrap().warnings
    };
    assert_eq!(warnings(DVec3::new(0.0, 1.8, 25.0)), [""; 0]);
    let told = warnings(DVec3::new(0.0, 2.5, 0.0));
    assert_eq!(told.len(), 1, "{told:?}");
    for part in [
        "something solid: 2 of 2. ",
        "cell 0, box:-1,2.5,0:2,1,4, the viewpoint -2,",
        "--view-cell",
        "--cells",
    ] {
        assert!(told[0].contains(part), "{told:?}");
    }
}

/// A sheet with one side that is seen from behind is told only where it is more than a speck of what is
/// around, and not as a solid; from where nothing else is seen, nothing is baked.
#[test]
fn sheets_seen_from_behind_are_told() {
    let mut scene = shapes::triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
    shapes::add_box(&mut scene, Vec3::new(0.0, 0.0, -40.0), Vec3::ONE, 0);
    scene.objects.push(Object {
        name: "box".into(),
        mesh: 1,
        world_from_mesh: DAffine3::IDENTITY,
    });
    let seen_from = |center| SeenFrom::Inside {
        center,
        size: DVec3::splat(0.2),
        cells: [1; 3],
    };
    for (distance, is_told) in [(1.0, true), (9.0, false)] {
        let baked = Baked::of(&scene, |options| {
            options.seen_from = seen_from(DVec3::NEG_Z * distance);
        });
        let warnings = baked.manifest().warnings.join(" ");
        let is_named = warnings.contains("backs of single-sided surfaces, and may reach");
        assert_eq!(is_named, is_told, "{distance} m: {warnings:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let triangle = shapes::triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let path = write_glb(&triangle, folder.path());
    for (at, what) in [
        (-1.0, "nothing of the scene is seen from the view cell"),
        (1e200, "less than a pixel wide"),
    ] {
        let message = failure(&BitfieldsOptions {
            seen_from: seen_from(DVec3::Z * at),
            ..options(
                SceneChoice::File(path.clone()),
                &folder.path().join("bundle"),
            )
        });
        assert!(
            message.contains(what) && message.contains("box:0.5,0.5,0:1,1,0"),
            "{message}"
        );
    }
}

/// A range that is lost from a cell's list is found.
#[test]
fn a_range_lost_from_a_cell_is_found() {
    let baked = Baked::of(&boxes(), |options| {
        options.seen_from = inside([1; 3]);
        // Each box is looked into from a fortieth of the cell.
        options.held_back = Some(400);
    });
    let mut manifest = baked.manifest();
    assert_eq!(manifest.promise.missed_pixels, Some(0));
    let mut lists = read_cells(&baked.dir(), &manifest).unwrap();
    let draw = &mut lists.cells[0].draw;
    let longest = (0..draw.len()).max_by_key(|i| draw[*i][1] - draw[*i][0]);
    draw.remove(longest.unwrap());
    if let Body::Bitfields(body) = &mut manifest.impostors[0].body {
        let draw = &lists.cells[0].draw;
        let drawn: u32 = draw.iter().map(|[first, end]| end - first).sum();
        body.ranges = draw.len() as u64;
        body.most_ranges = draw.len() as u32;
        body.culled = 1.0 - f64::from(drawn) / body.triangles as f64;
    }
    let kept = manifest.files.iter().filter(|file| file.path != CELLS_FILE);
    let mut files: Vec<NewFile> = kept
        .map(|file| NewFile {
            path: file.path.clone(),
            bytes: fs::read(baked.dir().join(&file.path)).unwrap(),
        })
        .collect();
    files.push(NewFile {
        path: CELLS_FILE.into(),
        bytes: lists.to_json().into_bytes(),
    });
    farfield_bundle::write(&baked.dir(), &manifest, &files).unwrap();
    let report = verified(&baked.dir(), 64);
    assert!(!report.holds);
    assert!(
        report.broken[0].contains("miss more than"),
        "{:?}",
        report.broken
    );
}

/// One triangle, seen from one side: half of the faces draw nothing.
#[test]
fn one_triangle_is_enough() {
    let mut scene = shapes::triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let baked = Baked::of(&scene, |_| {});
    let lists = baked.lists();
    assert!(lists.faces.iter().any(|face| face.draw.is_empty()));
    assert!(lists.faces.iter().any(|face| face.draw == [[0, 1]]));
    assert!(verified(&baked.dir(), 64).holds);
    // Behind something that is not there no more.
    scene.objects.clear();
    let folder = tempfile::tempdir().unwrap();
    let path = write_glb(&scene, folder.path());
    let message = failure(&options(
        SceneChoice::File(path),
        &folder.path().join("bundle"),
    ));
    assert!(message.contains("no triangles"), "{message}");
}

/// The same input gives the same bytes, on one thread and on several; another seed does not keep the
/// promise from being kept.
#[test]
fn threads_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_glb(&boxes(), folder.path());
    let bundles = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let out = folder.path().join("bundle");
        let options = options(SceneChoice::File(path.clone()), &out);
        pool.build().unwrap().install(|| baked(&options));
        contents(&out)
    });
    assert!(bundles[0] == bundles[1]);
    let out = folder.path().join("other");
    let other = BitfieldsOptions {
        seed: 7,
        ..options(SceneChoice::File(path), &out)
    };
    baked(&other);
    assert!(verified(&out, 64).holds);
}

/// A bundle whose lists lost something is found: refused where the manifest tells otherwise, and where it
/// does not, seen.
#[test]
fn lost_ranges_are_found() {
    let baked = Baked::of(&boxes(), |_| {});
    let (mut manifest, sound, display) = (baked.manifest(), baked.lists(), baked.display());
    let mut lists = sound.clone();
    for face in &mut lists.faces {
        face.draw.remove(0);
    }
    baked.write(&manifest, &lists, &display);
    let options = VerifyOptions {
        dir: baked.dir(),
        scene: None,
        views: Views::First(32),
    };
    let message = format!("{:#}", verify(&options, &Console::Silent).unwrap_err());
    assert!(
        message.contains(FACES_FILE) && message.contains("the manifest says"),
        "{message}"
    );

    count(&mut manifest, &lists);
    baked.write(&manifest, &lists, &display);
    let report = verify(&options, &Console::Silent).unwrap();
    assert!(!report.holds);
    assert!(
        report.broken[0].contains("miss more than 0 pixels"),
        "{:?}",
        report.broken
    );
    assert!(report.broken[0].contains("view ") && report.broken[0].contains(" at ("));
    let figures = report.bitfields.unwrap();
    assert!(figures.missed_pixels > 0 && figures.wrong_pixels > 0);
    assert!(figures.may_miss_more_than_promised < Some(figures.missing_more_than_promised));
    assert!(!baked.dir().join(CERTIFICATE_FILE).exists());

    // The worst view alone decides nothing of a share of all views, but of all of them.
    let worst = looked_at(&baked.dir(), report.worst_view);
    assert!(worst.holds, "{:?}", worst.broken);
    assert!(worst.undecided[0].contains("one view decides nothing"));
    let shown = worst.bitfields.unwrap();
    assert_eq!(shown.missing_more_than_promised, 1);
    assert_eq!(shown.may_miss_more_than_promised, None);
    let of_all = Manifest {
        promise: farfield_bundle::Promise {
            missed_share: None,
            ..manifest.promise.clone()
        },
        ..manifest.clone()
    };
    baked.write(&of_all, &lists, &display);
    let worst = looked_at(&baked.dir(), report.worst_view);
    assert!(!worst.holds && worst.undecided.is_empty());

    // As many as were found are no surprise where it is promised of as few.
    let mut of_few = of_all;
    let missing = figures.missing_more_than_promised as f64 / 32.0;
    of_few.promise.missed_share = Some((1.0 - missing).max(0.001));
    baked.write(&of_few, &lists, &display);
    let report = verified(&baked.dir(), 32);
    assert!(
        report.holds && report.undecided.is_empty(),
        "{:?}",
        report.broken
    );

    // As it was, it holds.
    count(&mut manifest, &sound);
    baked.write(&manifest, &sound, &display);
    assert!(verified(&baked.dir(), 32).holds);
}

/// Whatever of the geometry or of its look is changed is named.
#[test]
fn changed_geometry_is_found() {
    type Damage = fn(&mut Scene);
    let damages: [(&str, Damage); 6] = [
        ("other triangles", |scene| scene.positions[7].x += 0.25),
        ("other triangles", |scene| scene.triangles[3].swap(0, 1)),
        ("does not draw one object", |scene| {
            scene.objects[0].world_from_mesh.translation.x += 0.25;
        }),
        ("other primitives", |scene| {
            scene.meshes[0].triangles.end -= 1;
        }),
        ("another base colour than", |scene| {
            scene.materials[0].base_color.x = 0.9;
        }),
        ("another base colour texture", |scene| {
            scene.images[0].texels[0] = [255, 0, 0, 255];
        }),
    ];
    let baked = Baked::of(&boxes(), |_| {});
    let (manifest, lists, display) = (baked.manifest(), baked.lists(), baked.display());
    for (what, damage) in damages {
        let mut display = display.clone();
        damage(&mut display);
        baked.write(&manifest, &lists, &display);
        let options = VerifyOptions {
            dir: baked.dir(),
            scene: None,
            views: Views::One(1),
        };
        let found = match verify(&options, &Console::Silent) {
            Ok(report) => report.broken.join("; "),
            Err(error) => format!("{error:#}"),
        };
        assert!(found.contains(what), "{found}, expected {what}");
    }
}

/// Manifests and lists that cannot be are refused in one line, which names the file.
#[test]
fn impossible_bundles_are_refused() {
    type Damage = fn(&mut Manifest, &mut FaceLists);
    let damages: [(&str, Damage); 4] = [
        ("inside of the scene", |m, _| {
            if let farfield_bundle::ViewSpace::Shell { near, .. } = &mut m.options.view_space {
                *near = 0.1;
            }
        }),
        ("the centre of the original is", |m, _| {
            if let farfield_bundle::ViewSpace::Shell { center, .. } = &mut m.options.view_space {
                center.x += 0.5;
            }
        }),
        ("is represented", |m, _| {
            m.impostors[0].represented[0].x -= 1.0;
        }),
        ("seen from outside", |_, lists| {
            // Closed, but not around anything.
            lists.viewpoints.iter_mut().for_each(|v| v.y = v.y.abs());
        }),
    ];
    let baked = Baked::of(&boxes(), |_| {});
    let (manifest, lists, display) = (baked.manifest(), baked.lists(), baked.display());
    for (what, damage) in damages {
        let (mut manifest, mut lists) = (manifest.clone(), lists.clone());
        damage(&mut manifest, &mut lists);
        baked.write(&manifest, &lists, &display);
        let options = VerifyOptions {
            dir: baked.dir(),
            scene: None,
            views: Views::One(1),
        };
        let message = format!("{:#}", verify(&options, &Console::Silent).unwrap_err());
        assert!(message.contains(what), "{message}, expected {what}");
        assert!(
            message.contains(MANIFEST_FILE) || message.contains(FACES_FILE),
            "{message}"
        );
        assert!(!message.contains('\n'), "{message}");
    }
}

/// What does not suit a scene is refused before it is looked at, and nothing is left behind.
#[test]
fn wrong_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_glb(&boxes(), folder.path());
    let out = folder.path().join("bundle");
    let sound = options(SceneChoice::File(path), &out);
    let cases: [(&str, BitfieldsOptions); 9] = [
        (
            "--cells 3,0,1",
            BitfieldsOptions {
                seen_from: inside([3, 0, 1]),
                ..sound.clone()
            },
        ),
        (
            "a height",
            BitfieldsOptions {
                seen_from: SeenFrom::Inside {
                    center: DVec3::ZERO,
                    size: DVec3::new(1.0, 0.0, 1.0),
                    cells: [1; 3],
                },
                ..sound.clone()
            },
        ),
        (
            "pixels wide",
            BitfieldsOptions {
                fov_degrees: 0.01,
                seen_from: inside([1; 3]),
                ..sound.clone()
            },
        ),
        (
            "not in order",
            BitfieldsOptions {
                seen_from: around(Some([40.0, 20.0]), SampleChoice::Adaptive),
                ..sound.clone()
            },
        ),
        (
            "inside of the scene",
            BitfieldsOptions {
                seen_from: around(Some([1.0, 20.0]), SampleChoice::Adaptive),
                ..sound.clone()
            },
        ),
        (
            "from 4 to",
            BitfieldsOptions {
                seen_from: around(None, SampleChoice::Even(0)),
                ..sound.clone()
            },
        ),
        (
            "no/such/file",
            BitfieldsOptions {
                seen_from: around(None, SampleChoice::Listed("no/such/file".into())),
                ..sound.clone()
            },
        ),
        (
            "pixels wide",
            BitfieldsOptions {
                fov_degrees: 0.01,
                seen_from: around(Some([20.0, 40.0]), SampleChoice::Adaptive),
                ..sound.clone()
            },
        ),
        (
            "no object has the name",
            BitfieldsOptions {
                exclude: vec!["tree".into()],
                ..sound.clone()
            },
        ),
    ];
    for (what, options) in cases {
        let message = failure(&options);
        assert!(message.contains(what), "{message}, expected {what}");
        assert!(!out.exists());
    }
}

/// Real models: what is promised holds, and what the paper says of culling.
#[test]
fn real_models_hold() {
    for (name, culled) in [("stanford_bunny.glb", 0.15), ("2CylinderEngine.glb", 0.7)] {
        let Some(path) = model(name) else { continue };
        let folder = tempfile::tempdir().unwrap();
        let options = BitfieldsOptions {
            resolution: 255,
            held_back: Some(64),
            seen_from: around(None, SampleChoice::Even(25)),
            ..options(SceneChoice::File(path), &folder.path().join("bundle"))
        };
        let found = baked(&options).bitfields.unwrap();
        assert!(found.culled > culled, "{name}: {} culled", found.culled);
        let report = verified(&folder.path().join("bundle"), 64);
        assert!(report.holds, "{name}: {:?}", report.broken);
    }
}
