//! Damaged bundles: verify finds each damage and names it, and minds no harmless change.
//!
//! A bundle that was damaged has its checksums computed anew, so that only what it shows can tell.

use crate::setup::{options, verified};
use crate::shapes;
use farfield_atlas::pack;
use farfield_bundle::{
    CERTIFICATE_FILE, CertificateState, GLTF_FILE, LayeredBody, Manifest, NewFile, Promise,
    SceneSource, ViewSpace, cost, encode_png, glb_from_scene, read_certificate, sha256_hex,
};
use farfield_grid::Grid;
use farfield_pages::{GUTTER, Patch, blank_page, compose_layer, patches_of, quad_scene};
use farfield_scene::{AlphaMode, Image, Material, Object, Scene};
use farfield_views::{Camera, ViewCell};
use glam::{DAffine3, DVec2, DVec3, Vec3, Vec4};
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use xtask::{
    Channels, Console, Place, SceneChoice, VerifyOptions, VerifyReport, Views, bake, verify,
};

/// A bundle, open for changes.
#[derive(Clone)]
struct Bundle {
    manifest: Manifest,
    /// What `impostors.glb` draws, with its pages.
    display: Scene,
    /// The scene that it says it was baked from.
    original: Scene,
}

/// A scene file: slabs on slabs before a wall, each of one colour and facing the view cell.
///
/// Its colours differ little: impostors reach a texel over silhouettes, so where what is near were
/// brighter than what is behind, colours would be biased.
fn slabs() -> Scene {
    let mut scene = Scene::default();
    for i in 0..12u32 {
        let (column, row) = (i % 4, i / 4);
        let size = match i {
            0 => Vec3::new(12.0, 9.0, 0.1),
            _ => Vec3::new(2.3, 1.7, 0.4 + 0.35 * ((7 * i) % 12) as f32),
        };
        let center = match i {
            0 => Vec3::ZERO,
            _ => Vec3::new(
                2.9 * column as f32 - 4.3,
                2.8 * row as f32 - 2.8,
                size.z / 2.0,
            ),
        };
        let shade = 0.3 + 0.004 * ((5 * i) % 12) as f32;
        add_box(
            &mut scene,
            center,
            size,
            Vec4::new(shade, 0.34, 0.64 - shade, 1.0),
        );
    }
    scene
}

/// A box with sides along the axes, of one colour whatever the light.
fn add_box(scene: &mut Scene, center: Vec3, size: Vec3, base_color: Vec4) {
    let material = scene.materials.len() as u32;
    shapes::add_box(scene, center, size, material);
    scene.materials.push(Material {
        base_color,
        metallic: 0.0,
        unlit: true,
        ..Material::default()
    });
    scene.objects.push(Object {
        name: format!("slab {material}"),
        mesh: material,
        world_from_mesh: DAffine3::IDENTITY,
    });
}

/// The slabs on several pages, a bundle that keeps its promise.
fn good() -> Bundle {
    static GOOD: OnceLock<Bundle> = OnceLock::new();
    GOOD.get_or_init(|| Bundle::of(slabs(), Channels::Lit))
        .clone()
}

/// Small enough for several pages.
const PAGE_SIZE: u32 = 144;

/// Views that find a damage: the reference viewpoint and the cell's corners.
const VIEWS: u64 = 9;

impl Bundle {
    /// The bundle that is baked of a scene.
    fn of(original: Scene, channels: Channels) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (scene, dir) = (
            folder.path().join("scene.glb"),
            folder.path().join("bundle"),
        );
        fs::write(&scene, glb_from_scene(&original, &[]).unwrap()).unwrap();
        let mut options = options(SceneChoice::File(scene), 128, &dir);
        options.page_size = PAGE_SIZE;
        options.channels = channels;
        bake(&options, &Console::Silent).unwrap();
        let display = farfield_import::read(&dir.join(GLTF_FILE)).unwrap().scene;
        Self {
            manifest: farfield_bundle::read(&dir).unwrap(),
            display,
            original,
        }
    }

    /// Writes the bundle, with checksums that are right, and its scene into a folder; returns the
    /// bundle's own folder.
    fn write(&self, folder: &Path) -> PathBuf {
        self.write_with(folder, encode_png)
    }

    fn write_with(&self, folder: &Path, encode: impl Fn(&Image) -> Vec<u8>) -> PathBuf {
        let dir = folder.join("bundle");
        let original = glb_from_scene(&self.original, &[]).unwrap();
        let mut manifest = self.manifest.clone();
        if let SceneSource::File { sha256, .. } = &mut manifest.scene {
            *sha256 = sha256_hex(&original);
        }
        fs::write(folder.join("scene.glb"), original).unwrap();
        farfield_bundle::write(&dir, &manifest, &self.files(encode)).unwrap();
        dir
    }

    fn files(&self, encode: impl Fn(&Image) -> Vec<u8>) -> Vec<NewFile> {
        let images = &self.display.images;
        let uris: Vec<_> = (0..images.len())
            .map(|i| format!("pages/{i:03}.png"))
            .collect();
        let glb = NewFile {
            path: GLTF_FILE.into(),
            bytes: glb_from_scene(&self.display, &uris).unwrap(),
        };
        let pages = images.iter().zip(&uris).map(|(image, uri)| NewFile {
            path: uri.clone(),
            bytes: encode(image),
        });
        std::iter::once(glb).chain(pages).collect()
    }

    /// What verify says about the bundle.
    fn verified(&self, views: u64) -> VerifyReport {
        let folder = tempfile::tempdir().unwrap();
        verified(&self.write(folder.path()), views)
    }

    /// Why verify refuses the bundle.
    fn refused(&self) -> String {
        let folder = tempfile::tempdir().unwrap();
        let options = VerifyOptions {
            dir: self.write(folder.path()),
            scene: None,
            views: Views::First(1),
        };
        let error = verify(&options, &Console::Silent).unwrap_err();
        format!("{error:#}")
    }

    fn body(&self) -> &LayeredBody {
        self.manifest.impostors[0]
            .body
            .layers()
            .expect("it has layers")
    }

    /// The centre of what is represented.
    fn center(&self) -> DVec3 {
        let [min, max] = self.manifest.impostors[0].represented;
        (min + max) / 2.0
    }

    /// The camera whose pixels are the layers' texels.
    fn recording_camera(&self) -> Camera {
        let body = self.body();
        Camera {
            pose: body.pose,
            extent: body.extent,
            width: body.width,
            height: body.height,
        }
    }

    fn depths(&self) -> Vec<f64> {
        self.body().layers.iter().map(|layer| layer.depth).collect()
    }

    /// What each quad shows.
    fn patches(&self) -> Vec<Patch> {
        patches_of(&self.display, &self.recording_camera(), &self.depths()).unwrap()
    }

    /// The texels of each layer.
    fn layers(&self) -> Vec<Grid<[u8; 4]>> {
        let patches = self.patches();
        let size = [self.body().width, self.body().height];
        let compose = |layer: u32| {
            let of_layer = patches.iter().filter(|patch| patch.layer == layer);
            let of_layer: Vec<_> = of_layer.copied().collect();
            compose_layer(&of_layer, &self.display.images, size)
        };
        (0..self.body().layers.len() as u32).map(compose).collect()
    }

    /// The four vertices of a quad.
    fn vertices(&self, quad: usize) -> Vec<usize> {
        let triangles = &self.display.triangles[2 * quad..2 * quad + 2];
        let mut vertices: Vec<usize> = triangles.iter().flatten().map(|v| *v as usize).collect();
        vertices.sort_unstable();
        vertices.dedup();
        assert_eq!(vertices.len(), 4);
        vertices
    }

    /// The quad that shows most texels.
    fn largest_quad(&self) -> usize {
        let patches = self.patches();
        (0..patches.len())
            .max_by_key(|i| patches[*i].rect.area())
            .unwrap()
    }

    /// The quads that are seen along a seam to quads on their left, from the reference viewpoint,
    /// those with the longest seams first.
    fn quads_at_seams(&self) -> Vec<usize> {
        let (patches, layers) = (self.patches(), self.layers());
        let seam = |quad: &usize| {
            let Patch { rect, layer, .. } = patches[*quad];
            let (x, layer) = (rect.x, layer as usize);
            let opaque = |layer: &Grid<[u8; 4]>, x, y| layer[(x as usize, y as usize)][3] != 0;
            let is_seen = |y: &u32| {
                let mut own = patches.iter().filter(|other| other.layer as usize == layer);
                x > 0
                    && opaque(&layers[layer], x - 1, *y)
                    && !layers[..layer].iter().any(|before| opaque(before, x, *y))
                    && own.all(|other| *other == patches[*quad] || !other.rect.contains(x, *y))
            };
            (rect.y..rect.bottom()).filter(is_seen).count()
        };
        let mut quads: Vec<_> = (0..patches.len()).filter(|quad| seam(quad) > 0).collect();
        quads.sort_by_key(|quad| std::cmp::Reverse(seam(quad)));
        quads
    }

    /// The layer of which most texels are seen from the reference viewpoint.
    fn most_seen_layer(&self) -> u32 {
        let layers = self.layers();
        let mut seen = vec![0; layers.len()];
        for i in 0..layers[0].cells().len() {
            if let Some(layer) = layers.iter().position(|layer| layer.cells()[i][3] != 0) {
                seen[layer] += 1;
            }
        }
        (0..layers.len()).max_by_key(|i| seen[*i]).unwrap() as u32
    }

    /// A texel that a pixel of the reference viewpoint's picture samples near its centre: the
    /// index of its page, its own on the page, and the pixel. Its neighbours are opaque and of the
    /// same quad, and no other layer has anything there.
    fn lone_texel(&self) -> (usize, usize, Place) {
        let (layers, depths) = (self.layers(), self.depths());
        let lens = &self.manifest.options;
        let fov = lens.fov_degrees.to_radians();
        let eye = self.body().pose.eye;
        let picture = Camera::looking_at(eye, self.center(), fov, lens.resolution);
        let camera = self.recording_camera();
        let mut found = (
            f64::INFINITY,
            (
                0,
                0,
                Place {
                    view: 0,
                    x: 0,
                    y: 0,
                },
            ),
        );
        let patch = self.patches()[self.largest_quad()];
        for y in patch.rect.y + 2..patch.rect.bottom() - 2 {
            for x in patch.rect.x + 2..patch.rect.right() - 2 {
                let opaque = |layer: &Grid<[u8; 4]>, i: u32| {
                    layer[((x + i % 5 - 2) as usize, (y + i / 5 - 2) as usize)][3] != 0
                };
                let is_lone = layers
                    .iter()
                    .zip(0..)
                    .all(|(layer, i)| match i == patch.layer {
                        true => (0..25).all(|i| opaque(layer, i)),
                        false => !(0..25).any(|i| opaque(layer, i)),
                    });
                let center = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                let point = camera.view_from_pixel(center, depths[patch.layer as usize]);
                let seen = picture
                    .pose
                    .point_in_view(camera.pose.point_in_world(point));
                let pixel = picture.pixel_from_view(seen);
                let beside = (pixel - pixel.floor() - 0.5).length();
                if is_lone && beside < found.0 {
                    let page = patch.page as usize;
                    let [column, row] = [
                        patch.x + GUTTER + x - patch.rect.x,
                        patch.y + GUTTER + y - patch.rect.y,
                    ];
                    let texel = (row * self.display.images[page].width + column) as usize;
                    let place = Place {
                        view: 0,
                        x: pixel.x as u32,
                        y: pixel.y as u32,
                    };
                    found = (beside, (page, texel, place));
                }
            }
        }
        assert!(
            found.0 < 0.2,
            "no pixel samples a lone texel near its centre"
        );
        found.1
    }

    /// Moves a quad by texels of its layer, to the right and down.
    fn shift_quad(&mut self, quad: usize, texels: DVec2) {
        let camera = self.recording_camera();
        let depth = self.depths()[self.patches()[quad].layer as usize];
        let by = texels * camera.pixel_size() * depth;
        let by = camera.pose.right * by.x + camera.pose.down * by.y;
        for vertex in self.vertices(quad) {
            self.display.positions[vertex] += by.as_vec3();
        }
    }

    /// Moves a layer's quads in depth, where the reference viewpoint sees no difference.
    fn move_layer(&mut self, layer: u32, factor: f64) {
        let eye = self.body().pose.eye;
        let mesh_from_world = self.display.objects[0].world_from_mesh.inverse();
        for (quad, patch) in self.patches().into_iter().enumerate() {
            if patch.layer != layer {
                continue;
            }
            for vertex in self.vertices(quad) {
                let old = self.display.world_position(0, vertex as u32);
                let new = mesh_from_world.transform_point3(eye + (old - eye) * factor);
                self.display.positions[vertex] = new.as_vec3();
            }
        }
    }

    /// Draws only these quads, in this order.
    fn take_quads(&mut self, quads: &[usize]) {
        let scene = &mut self.display;
        assert_eq!(scene.meshes.len(), 1);
        let triangles = || quads.iter().flat_map(|quad| [2 * quad, 2 * quad + 1]);
        scene.triangle_materials = triangles().map(|t| scene.triangle_materials[t]).collect();
        scene.triangles = triangles().map(|t| scene.triangles[t]).collect();
        scene.meshes[0].triangles = 0..scene.triangles.len() as u32;
    }
}

/// Asserts that verify names something among what is broken.
fn assert_broken(report: &VerifyReport, words: &[&str]) {
    assert!(!report.holds, "it holds");
    let named = |line: &String| words.iter().all(|word| line.contains(word));
    assert!(
        report.broken.iter().any(named),
        "{words:?} are not in one of {:#?}",
        report.broken
    );
}

#[test]
fn a_dropped_layer_opens_gaps() {
    let mut bundle = good();
    let (patches, layer) = (bundle.patches(), bundle.most_seen_layer());
    let quads: Vec<_> = (0..patches.len())
        .filter(|quad| patches[*quad].layer != layer)
        .collect();
    bundle.take_quads(&quads);
    let report = bundle.verified(VIEWS);
    assert!(report.gap_pixels > 1000, "{:?}", report.broken);
    assert_broken(&report, &["gap pixels, promised at most 0", "view 0 at"]);
    let named = format!("layer {layer} shows other texels than were baked, in 0 quads 0 texels");
    assert_broken(&report, &[&named]);
}

/// What a layer shows may be so little that no view misses it.
#[test]
fn a_dropped_layer_is_found_though_hardly_seen() {
    let mut bundle = good();
    let patches = bundle.patches();
    let texels = |layer: &u32| {
        let of_layer = patches.iter().filter(|patch| patch.layer == *layer);
        of_layer.map(|patch| patch.rect.area()).sum::<u64>()
    };
    let layers = 0..bundle.body().layers.len() as u32;
    let least = layers.filter(|layer| texels(layer) > 0).min_by_key(texels);
    let least = least.unwrap();
    let quads: Vec<_> = (0..patches.len())
        .filter(|quad| patches[*quad].layer != least)
        .collect();
    bundle.take_quads(&quads);
    let named = format!("layer {least} shows other texels than were baked, in 0 quads 0 texels");
    assert_broken(&bundle.verified(1), &[&named]);
}

/// One texel is enough, and its pixel is named.
#[test]
fn a_holed_texel_is_a_gap_where_it_is() {
    let mut bundle = good();
    let (page, texel, place) = bundle.lone_texel();
    bundle.display.images[page].texels[texel] = [0; 4];
    let report = bundle.verified(1);
    assert_eq!(report.gaps, [place]);
    let at = format!("view 0 at ({}, {})", place.x, place.y);
    assert_broken(&report, &["1 gap pixels, promised at most 0", &at]);
}

/// What was baked to be seen from both sides is shown though nobody sees the front of it any more.
#[test]
fn a_surface_turned_away_from_the_cell_shows_its_back() {
    let mut plates = Scene::default();
    for x in [-1.5, 1.5] {
        add_box(
            &mut plates,
            Vec3::X * x,
            Vec3::new(2.0, 2.0, 0.1),
            Vec4::ONE,
        );
    }
    // Of each box one side that faces the cell, if it is one-sided.
    for (mesh, material) in plates.meshes.iter_mut().zip(&mut plates.materials) {
        mesh.triangles.start += 10;
        material.double_sided = true;
    }
    let mut bundle = Bundle::of(plates, Channels::Lit);
    let turned = bundle.original.meshes[1].triangles.clone();
    for triangle in turned {
        bundle.original.triangles[triangle as usize].swap(1, 2);
    }
    for material in &mut bundle.original.materials {
        material.double_sided = false;
    }
    let report = bundle.verified(VIEWS);
    assert!(report.back_pixels > 1000, "{:?}", report.broken);
    assert_eq!((report.phantom_pixels, report.behind_pixels), (0, 0));
    assert_broken(&report, &["show backs", "promised at most 0", "view 0 at"]);
}

#[test]
fn a_shifted_quad_opens_gaps_and_lies_beside_its_texels() {
    let mut gap_pixels = 0;
    for quad in good().quads_at_seams() {
        let mut bundle = good();
        bundle.shift_quad(quad, DVec2::new(1.5, 0.0));
        let report = bundle.verified(VIEWS);
        let named = format!("quad {quad}: its texels lie");
        assert_broken(&report, &[&named, "the layer's grid"]);
        gap_pixels = report.gap_pixels;
        // The gap is half a texel wide: pixels can miss it, and the next layer fill it.
        if gap_pixels > 0 {
            assert_broken(&report, &["gap pixels, promised at most 0"]);
            break;
        }
    }
    assert!(gap_pixels > 0, "no view saw the gap beside any quad");
}

/// A quad that fits the grid is a sound quad, but not the one that was baked.
#[test]
fn a_quad_shifted_by_whole_texels_shows_other_texels() {
    let mut bundle = good();
    let quad = bundle.quads_at_seams()[0];
    let layer = bundle.patches()[quad].layer;
    let to_the_right = bundle.patches()[quad].rect.right() < bundle.body().width;
    let by = if to_the_right { 1.0 } else { -1.0 };
    bundle.shift_quad(quad, DVec2::new(by, 0.0));
    let named = format!("layer {layer} shows other texels than were baked");
    assert_broken(&bundle.verified(1), &[&named]);
}

/// Seen from the reference viewpoint nothing changes: it is found from elsewhere.
#[test]
fn a_layer_moved_in_depth_is_displaced_and_on_no_layer() {
    for factor in [0.95, 1.05] {
        let mut bundle = good();
        let (patches, layer) = (bundle.patches(), bundle.most_seen_layer());
        bundle.move_layer(layer, factor);
        let report = bundle.verified(VIEWS);
        assert!(report.parallax_px > 1.0, "{:?}", report.broken);
        assert!(
            report.displaced_pixels > 0 && report.worst_view > 0,
            "{:?}",
            report.broken
        );
        assert_broken(&report, &["a parallax of", "points are displaced by more"]);
        let first = patches.iter().position(|patch| patch.layer == layer);
        let named = format!("quad {}: it lies at the depth of", first.unwrap());
        assert_broken(&report, &[&named, "where no layer is"]);
    }
}

#[test]
fn swapped_pages_open_gaps() {
    let mut bundle = good();
    let [first, second, ..] = bundle.display.images.as_mut_slice() else {
        panic!("the bundle has one page");
    };
    assert_eq!([first.width, first.height], [second.width, second.height]);
    std::mem::swap(&mut first.texels, &mut second.texels);
    let report = bundle.verified(VIEWS);
    assert!(report.gap_pixels > 1000, "{:?}", report.broken);
    assert!(report.coverage_error > 0.01, "{:?}", report.broken);
    assert_broken(&report, &["gap pixels, promised at most 0"]);
}

#[test]
fn shifted_colours_are_a_bias() {
    for (by, sign) in [(3, "+"), (-3, "-")] {
        let mut bundle = good();
        for texel in bundle
            .display
            .images
            .iter_mut()
            .flat_map(|page| &mut page.texels)
        {
            for channel in &mut texel[..3] {
                *channel = channel.saturating_add_signed(by);
            }
        }
        let report = bundle.verified(VIEWS);
        assert!(
            report.colour_bias.abs() > 2.0 / 255.0,
            "{:?}",
            report.broken
        );
        assert_broken(
            &report,
            &["colours are off by", sign, "promised at most 1.00"],
        );
    }
}

/// Too few texels to change what is typical, on one page of several.
#[test]
fn a_painted_block_of_one_page_is_of_stray_colours() {
    let mut bundle = good();
    assert!(bundle.display.images.len() > 1);
    let page = &mut bundle.display.images[0];
    let (width, height) = (page.width as usize, page.height as usize);
    // A tenth of the page's area, in its middle.
    let block = |side: usize| side / 3..side / 3 + side * 32 / 100;
    for (x, y) in block(height).flat_map(|y| block(width).map(move |x| (x, y))) {
        page.texels[y * width + x][..3].copy_from_slice(&[255, 0, 255]);
    }
    let report = bundle.verified(VIEWS);
    assert_broken(
        &report,
        &["stray", "%", "promised at most 0.05", "view 0 at"],
    );
    assert_eq!(report.broken.len(), 1, "{:?}", report.broken);
    let sound = good().verified(VIEWS);
    assert_eq!((sound.stray_pixels, sound.stray_colours), (0, 0.0));
    assert!(sound.interior_pixels > 10_000);
}

/// The light that pictures are rendered under does not show what is rough or metallic.
#[test]
fn a_painted_page_of_what_light_meets_is_a_bias() {
    let mut slabs = slabs();
    for (i, material) in (0u8..).zip(&mut slabs.materials) {
        material.unlit = false;
        material.roughness = 0.4 + f32::from(i) / 100.0;
        material.metallic = 0.2;
    }
    let good = Bundle::of(slabs, Channels::Pbr);
    let report = good.verified(VIEWS);
    assert!(report.holds, "{:?}", report.broken);
    assert!(report.surface_bias.unwrap().abs() < 1.0 / 255.0);
    for channel in [1, 2] {
        let mut bundle = good.clone();
        let material = &bundle.display.materials[0];
        let page = &bundle.display.textures[material.metallic_roughness_texture.unwrap() as usize];
        for texel in &mut bundle.display.images[page.image as usize].texels {
            texel[channel] = 255;
        }
        let report = bundle.verified(VIEWS);
        assert_eq!(report.broken.len(), 1, "{:?}", report.broken);
        assert_broken(
            &report,
            &["what light meets is off", "promised at most 8.00"],
        );
    }
    let mut unpromised = good.clone();
    unpromised.manifest.promise.surface_bias = None;
    let report = unpromised.verified(1);
    assert_broken(&report, &["promises nothing for surface_bias"]);
}

/// Layers that suit a view cell need not suit a larger one: seen from its corners, and proved.
#[test]
fn an_enlarged_view_cell_finds_layers_too_far_apart() {
    let mut bundle = good();
    let ViewSpace::Before {
        view_cell: ViewCell::Box { size, .. },
    } = &mut bundle.manifest.options.view_space
    else {
        panic!("the default cell is a box");
    };
    *size *= 1.3;
    let report = bundle.verified(VIEWS);
    assert!(report.parallax_px > 1.0, "{:?}", report.broken);
    assert_broken(&report, &["a parallax of"]);
    assert!(report.proved.iter().any(|found| found.bound > found.limit));
    assert_broken(&report, &["layers", "are too far apart for the view cell"]);
}

/// By a quarter as by half a turn, where the quad still shows all of its texels.
#[test]
fn a_quad_with_turned_texels_is_named() {
    for turn in [1, 2] {
        let mut bundle = good();
        let quad = bundle.largest_quad();
        let vertices = bundle.vertices(quad);
        let uvs: Vec<_> = vertices.iter().map(|i| bundle.display.uvs[*i]).collect();
        for (i, vertex) in vertices.into_iter().enumerate() {
            bundle.display.uvs[vertex] = uvs[(i + turn) % 4];
        }
        let report = bundle.verified(VIEWS);
        assert!(report.gap_pixels > 100, "{:?}", report.broken);
        assert_broken(&report, &["gap pixels, promised at most 0"]);
        let named = format!("quad {quad}: its texels are turned");
        assert_broken(&report, &[&named]);
    }
}

/// A rod so thin that it covers no 3 x 3 pixels, before nothing: no gap, and nowhere to be seen.
#[test]
fn a_missing_rod_is_nowhere() {
    let mut bundle = good();
    let (center, size) = (Vec3::new(5.9, 0.0, 3.5), Vec3::new(0.1, 6.0, 0.1));
    add_box(&mut bundle.original, center, size, Vec4::ONE);
    let report = bundle.verified(VIEWS);
    assert!(report.unmet_pixels > 0, "{:?}", report.broken);
    assert_broken(&report, &["a parallax of", "are nowhere at all"]);
}

#[test]
fn a_promise_taken_back_is_named() {
    let mut bundle = good();
    bundle.manifest.promise = Promise::default();
    let report = bundle.verified(1);
    assert_broken(&report, &["promises nothing for gap_pixels"]);
    let mut bundle = good();
    bundle.manifest.promise.parallax_px = Some(2.0);
    let report = bundle.verified(1);
    assert_broken(&report, &["promises 2 for parallax_px", "keeps to 1"]);
    let mut bundle = good();
    bundle.manifest.promise.stray_colours = None;
    let report = bundle.verified(1);
    assert_broken(&report, &["promises nothing for stray_colours"]);
}

/// Clients sort blended triangles, and cut masks where the file says.
#[test]
fn another_material_is_named() {
    for alpha in [AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.02 }] {
        let mut bundle = good();
        bundle.display.materials[1].alpha = alpha;
        let report = bundle.verified(1);
        assert_broken(&report, &["material 'page 1' is not an unlit mask"]);
    }
}

#[test]
fn a_camera_that_sees_nothing_proves_nothing() {
    let mut bundle = good();
    bundle.manifest.options.fov_degrees = 179.999_999_9;
    assert_broken(&bundle.verified(1), &["no viewpoint sees anything"]);
}

/// Nothing is rendered of what cannot be true.
#[test]
fn impossible_manifests_are_refused() {
    let mut elsewhere = good();
    elsewhere.manifest.impostors[0].represented[1].z -= 1.0;
    assert!(elsewhere.refused().contains("the original fills"));
    let mut behind = good();
    behind.manifest.options.view_space = ViewSpace::Before {
        view_cell: ViewCell::Box {
            center: DVec3::Z * -100.0,
            size: DVec3::ONE,
        },
    };
    let why = behind.refused();
    assert!(why.contains("the layers do not fit together"), "{why}");
}

/// What the manifest does not list could change without notice.
#[test]
fn an_unlisted_page_is_refused() {
    let bundle = good();
    let folder = tempfile::tempdir().unwrap();
    let (dir, images) = (folder.path().join("bundle"), &bundle.display.images);
    bundle.write(folder.path());
    let mut files = bundle.files(encode_png);
    let uris: Vec<_> = (0..images.len()).map(|i| format!("{i}.png")).collect();
    files[0].bytes = glb_from_scene(&bundle.display, &uris).unwrap();
    let manifest = farfield_bundle::read(&dir).unwrap();
    farfield_bundle::write(&dir, &manifest, &files).unwrap();
    for (image, uri) in images.iter().zip(&uris) {
        fs::write(dir.join(uri), encode_png(image)).unwrap();
    }
    let options = VerifyOptions {
        dir,
        scene: None,
        views: Views::First(1),
    };
    let error = verify(&options, &Console::Silent).unwrap_err().to_string();
    assert!(
        error.contains("which the manifest does not list"),
        "{error}"
    );
}

/// What verify says about the bundle as it was baked.
fn good_report() -> &'static VerifyReport {
    static REPORT: OnceLock<VerifyReport> = OnceLock::new();
    REPORT.get_or_init(|| good().verified(VIEWS))
}

/// Asserts that a bundle holds, and in all figures as the one that was baked.
fn assert_as_good(report: &VerifyReport) {
    let good = good_report();
    assert!(good.holds && report.holds, "{:?}", report.broken);
    let figures = |report: &VerifyReport| {
        let pixels = [
            report.gap_pixels,
            report.phantom_pixels,
            report.unmet_pixels,
        ];
        let shares = [report.coverage_error, report.coverage_change];
        (pixels, shares, report.parallax_px)
    };
    assert_eq!(figures(report), figures(good));
    // Colours between two texels are rounded once more, on either side of a half.
    let colours = good.colour_bias_rgb.iter().zip(report.colour_bias_rgb);
    colours.for_each(|(a, b)| assert!((a - b).abs() < 0.01 / 255.0, "{:?}", report.broken));
}

#[test]
fn pages_may_be_encoded_anew() {
    let quickly = |page: &Image| {
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::NoFilter)
            .write_image(
                page.texels.as_flattened(),
                page.width,
                page.height,
                image::ExtendedColorType::Rgba8,
            )
            .unwrap();
        assert_ne!(bytes, encode_png(page));
        bytes
    };
    let folder = tempfile::tempdir().unwrap();
    let dir = good().write_with(folder.path(), quickly);
    assert_as_good(&verified(&dir, VIEWS));
}

#[test]
fn quads_may_be_drawn_in_another_order() {
    let mut bundle = good();
    let quads: Vec<_> = (0..bundle.patches().len()).rev().collect();
    bundle.take_quads(&quads);
    let report = bundle.verified(VIEWS);
    assert_ne!(bundle.patches(), good().patches());
    assert_as_good(&report);
}

#[test]
fn the_atlas_may_be_packed_anew() {
    let mut bundle = good();
    // The last first, on pages of another size.
    let mut patches = bundle.patches();
    patches.reverse();
    let padded = |patch: &Patch| [patch.rect.width, patch.rect.height].map(|n| n + 2 * GUTTER);
    let sizes: Vec<_> = patches.iter().map(padded).collect();
    let atlas = pack(&sizes, 2 * PAGE_SIZE).unwrap();
    let mut pages: Vec<_> = atlas.pages.iter().map(|size| blank_page(*size)).collect();
    for (patch, to) in patches.iter_mut().zip(&atlas.placements) {
        let old = &bundle.display.images[patch.page as usize];
        let [width, height] = padded(patch);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let from = (patch.y + y) * old.width + patch.x + x;
            let place = ((to.x + x) as usize, (to.y + y) as usize);
            pages[to.page as usize][place] = old.texels[from as usize];
        }
        (patch.page, patch.x, patch.y) = (to.page, to.x, to.y);
    }
    patches.sort_by_key(|patch| patch.page);
    let (camera, depths) = (bundle.recording_camera(), bundle.depths());
    let center = bundle.center();
    assert_ne!(pages.len(), bundle.display.images.len());
    bundle.display = quad_scene("scene", &camera, &depths, center, &patches, &pages);
    bundle.manifest.statistics.after = cost(&bundle.display);
    assert_as_good(&bundle.verified(VIEWS));
}

/// A certificate comes with a promise kept, says nothing about another bundle, and goes with a
/// promise broken; looking at single views changes nothing.
#[test]
fn a_certificate_is_valid_as_long_as_the_bundle_is_the_same() {
    let mut bundle = good();
    let folder = tempfile::tempdir().unwrap();
    let dir = &bundle.write(folder.path());
    let state = || {
        let manifest = farfield_bundle::read(dir).unwrap();
        read_certificate(dir, &manifest).unwrap()
    };
    let look = || {
        for view in [0, 1] {
            let options = VerifyOptions {
                dir: dir.to_owned(),
                scene: None,
                views: Views::One(view),
            };
            verify(&options, &Console::Silent).unwrap();
        }
    };
    assert_eq!(state(), CertificateState::Missing);
    look();
    assert_eq!(state(), CertificateState::Missing);
    assert!(!dir.join("report.html").exists() && !dir.join("verify.json").exists());
    assert!(verified(dir, 1).holds);
    let CertificateState::Valid(valid) = state() else {
        panic!("{:?}", state());
    };
    assert_eq!((valid.viewpoints, valid.worst.gap_pixels), (1, 0));
    assert!(!valid.proved.is_empty() && valid.beyond.is_some());

    // Writing replaces the folder; here the certificate stays.
    let text = fs::read(dir.join(CERTIFICATE_FILE)).unwrap();
    let (page, texel, _) = bundle.lone_texel();
    bundle.display.images[page].texels[texel] = [0; 4];
    bundle.write(folder.path());
    assert_eq!(state(), CertificateState::Missing);
    fs::write(dir.join(CERTIFICATE_FILE), &text).unwrap();
    let is_stale = || {
        matches!(state(), CertificateState::Stale { why }
            if why.contains("another bake") && why.contains("verify the bundle again"))
    };
    assert!(is_stale(), "{:?}", state());
    look();
    assert!(is_stale(), "{:?}", state());
    assert!(!verified(dir, 1).holds);
    assert_eq!(state(), CertificateState::Missing);
}

/// Any number of quads could show the same texels, more than there is memory for.
#[test]
fn quads_that_share_texels_are_named() {
    let mut bundle = good();
    let objects = bundle.display.objects.clone();
    for _ in 0..20 {
        bundle.display.objects.extend(objects.iter().cloned());
    }
    let broken = bundle.verified(1).broken;
    let is_named = |fault: &String| fault.contains("they share some");
    assert!(broken.iter().any(is_named), "{broken:?}");
}
