//! Random manifests, certificates, damages and scenes for property tests.

use crate::certificate::{
    Beyond, CERTIFICATE_FORMAT, CERTIFICATE_VERSION, Certificate, ProvedBound, WorstFigures,
};
use crate::manifest::{
    BitfieldsBody, Body, Channels, FORMAT, Foliage, Generator, Impostor, LayerRecord, LayeredBody,
    Manifest, Options, Promise, Samples, SceneSource, Statistics, TdmBody, Technique, VERSION,
};
use crate::{Cost, FileRecord, GLTF_FILE, NewFile, Side, ViewSpace, sha256_hex};
use farfield_scene::{AlphaMode, Filter, Image, Material, Mesh, Object, Scene, Texture, Wrap};
use farfield_views::{Extent, Pose, ViewCell};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec2, Vec3, Vec4};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;

/// Numbers as files have them and numbers that are hard to print: whole ones, tiny and huge ones,
/// and any bits that are finite.
fn numbers() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-1000..1000i32).prop_map(f64::from),
        -1e3..1e3f64,
        Just(5e-324),
        Just(0.1 + 0.2),
        any::<f64>().prop_filter("finite", |x| x.is_finite()),
    ]
}

fn lengths() -> impl Strategy<Value = f64> {
    prop_oneof![1e-6..1e6f64, (1..1000u32).prop_map(f64::from)]
}

fn points() -> impl Strategy<Value = DVec3> {
    [numbers(), numbers(), numbers()].prop_map(DVec3::from)
}

/// Text with everything that must be escaped in JSON.
fn texts() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-z]{1,8}".prop_map(String::from),
        "[ -~]{1,20}".prop_map(String::from),
        Just("\"\\\u{0}\n\u{7f}\u{2028}\u{1f3e0}".to_owned()),
    ]
}

fn cells() -> impl Strategy<Value = ViewCell> {
    let angle = 1e-3..1.5f64;
    prop_oneof![
        (points(), points()).prop_map(|(center, size)| ViewCell::Box {
            center,
            size: size.abs(),
        }),
        (
            points(),
            -1.0..1.0f64,
            angle,
            lengths(),
            lengths(),
            any::<bool>()
        )
            .prop_map(
                |(apex, x, half_angle, near, depth, infinite)| ViewCell::Shaft {
                    apex,
                    axis: DVec3::new(x, 0.5, 1.0),
                    half_angle,
                    near,
                    far: if infinite {
                        f64::INFINITY
                    } else {
                        near + depth
                    },
                }
            ),
    ]
}

fn bodies() -> impl Strategy<Value = LayeredBody> {
    let layer = (lengths(), lengths(), lengths(), any::<u32>());
    let axis = (-1.0..1.0f64, -1.0..1.0f64);
    let size = (1..=65536u32, 1..=65536u32);
    let texels = (0..1u64 << 40, 0..1u64 << 40);
    (
        points(),
        axis,
        [lengths(), lengths()],
        size,
        vec(layer, 1..6),
        texels,
    )
        .prop_map(
            |(eye, (x, y), extent, (width, height), layers, (kept, culled))| {
                let mut depth = 0.0;
                let layers = layers.into_iter().map(|(before, front, back, quads)| {
                    let near = depth + before;
                    let layer = LayerRecord {
                        near,
                        depth: near + front,
                        far: near + front + back,
                        quads,
                        texels_sha256: sha256_hex(&quads.to_le_bytes()),
                    };
                    depth = layer.far;
                    layer
                });
                let half = DVec2::from(extent);
                LayeredBody {
                    pose: Pose::looking_along(eye, DVec3::new(x, y, 0.5)),
                    extent: Extent {
                        min: -half,
                        max: half * 2.0,
                    },
                    width,
                    height,
                    layers: layers.collect(),
                    texels_recorded: kept + culled,
                    texels_kept: kept,
                }
            },
        )
}

fn impostors() -> impl Strategy<Value = Vec<Impostor>> {
    let impostor = (texts(), points(), points(), bodies());
    let all = (vec(impostor, 0..3), any::<bool>(), any::<u64>());
    all.prop_map(|(impostors, is_mesh, count)| {
        let numbered = impostors.into_iter().enumerate();
        numbered
            .map(|(i, (name, a, b, body))| Impostor {
                name: format!("{name}{i}"),
                side: Some(Side::ALL[i]),
                represented: [a.min(b), a.max(b)],
                body: match is_mesh {
                    false => Body::Layered(body),
                    true => Body::Tdm(TdmBody {
                        recorded: body,
                        initial_triangles: count,
                        triangles: count / 2,
                        pieces: count / 3,
                        charts: count / 4,
                    }),
                },
            })
            .collect()
    })
}

fn view_spaces() -> impl Strategy<Value = ViewSpace> {
    let boxes = (points(), lengths()).prop_map(|(center, side)| ViewCell::Box {
        center,
        size: DVec3::splat(side),
    });
    prop_oneof![
        cells().prop_map(|view_cell| ViewSpace::Before { view_cell }),
        (boxes, lengths(), vec(texts(), 1..3)).prop_map(|(view_cell, distance, objects)| {
            ViewSpace::Amid {
                view_cell,
                distance,
                objects,
            }
        }),
        (points(), lengths(), lengths()).prop_map(|(center, near, depth)| ViewSpace::Around {
            center,
            near,
            far: near + depth,
        }),
    ]
}

fn costs() -> impl Strategy<Value = Cost> {
    any::<[u64; 4]>().prop_map(
        |[triangles, draw_calls, texture_bytes, geometry_bytes]| Cost {
            triangles,
            draw_calls,
            texture_bytes,
            geometry_bytes,
        },
    )
}

fn sources() -> impl Strategy<Value = SceneSource> {
    prop_oneof![
        texts().prop_map(|name| SceneSource::File {
            path: format!("../{name}.glb"),
            sha256: sha256_hex(name.as_bytes()),
        }),
        (texts(), any::<u32>(), any::<u64>())
            .prop_map(|(name, size, seed)| { SceneSource::BuiltIn { name, size, seed } }),
    ]
}

fn promises() -> impl Strategy<Value = Promise> {
    let count = || prop::option::of(any::<u64>());
    let figure = || prop::option::of(lengths());
    let figures = [(); 6].map(|()| figure());
    ([count(), count(), count()], figures, vec(texts(), 0..3)).prop_map(
        |([gap_pixels, phantom_pixels, back_pixels], figures, notes)| {
            let [
                parallax_px,
                coverage_error,
                coverage_change,
                colour_bias,
                surface_bias,
                stray_colours,
            ] = figures;
            Promise {
                gap_pixels,
                phantom_pixels,
                back_pixels,
                parallax_px,
                coverage_error,
                coverage_change,
                colour_bias,
                surface_bias,
                stray_colours,
                notes,
                ..Promise::default()
            }
        },
    )
}

/// Manifests that pass the check.
pub(crate) fn manifests() -> impl Strategy<Value = Manifest> {
    let samples = prop_oneof![
        Just(Samples::Adaptive),
        Just(Samples::Even),
        Just(Samples::Listed)
    ];
    let counts = (any::<[u32; 4]>(), 1..u64::from(u32::MAX), 0.0..=1.0f64);
    let bitfields = prop::option::weighted(0.25, (samples, counts));
    // Boxed: values of strategies lie on the stack.
    (manifests_with_layers().boxed(), bitfields).prop_map(|(manifest, bitfields)| {
        let Some((samples, ([held_back, viewpoints, faces, most], triangles, culled))) = bitfields
        else {
            return manifest;
        };
        with_bitfields(
            manifest,
            Technique::Bitfields {
                samples,
                held_back,
                tolerated_pixels: triangles % 100,
                seed: triangles,
                patch_triangles: most.max(1),
                finer: 1.0 + culled,
                neighbors: [None, Some(false), Some(true)][viewpoints as usize % 3],
            },
            BitfieldsBody {
                triangles,
                always_drawn: triangles / 3,
                viewpoints,
                lists: faces.max(1),
                ranges: u64::from(most) * 2,
                most_ranges: most,
                culled,
            },
        )
    })
}

/// A manifest made into one of bitfields.
fn with_bitfields(mut manifest: Manifest, technique: Technique, body: BitfieldsBody) -> Manifest {
    let is_adaptive = matches!(
        technique,
        Technique::Bitfields {
            samples: Samples::Adaptive,
            ..
        }
    );
    manifest.promise.missed_pixels = Some(u64::from(body.lists) * u64::from(!is_adaptive));
    manifest.promise.missed_share = (!is_adaptive).then_some(1.0 - body.culled / 2.0);
    manifest.technique = technique;
    manifest.options.view_space = match body.viewpoints % 2 {
        0 => ViewSpace::Shell {
            center: DVec3::new(body.culled, -0.0, 5e-324),
            near: 1.0 + body.culled,
            far: 2.0,
        },
        _ => ViewSpace::Inside {
            view_cell: ViewCell::Box {
                center: DVec3::new(body.culled, -0.0, 5e-324),
                size: DVec3::new(1.0, 0.0, body.culled),
            },
            cells: [1, body.lists.max(1), 1],
        },
    };
    let lists_file = manifest.options.view_space.lists_file();
    manifest.impostors = vec![Impostor {
        name: "all".into(),
        side: None,
        represented: [DVec3::NEG_ONE, DVec3::ONE],
        body: Body::Bitfields(body),
    }];
    manifest.statistics = Statistics {
        before: manifest.statistics.before,
        after: manifest.statistics.after,
        ..Statistics::default()
    };
    manifest.files.insert(
        0,
        FileRecord {
            path: lists_file.expect("it is one of bitfields").into(),
            bytes: 1,
            sha256: sha256_hex(b"x"),
        },
    );
    manifest
}

/// A manifest of bitfields to be damaged.
pub(crate) fn sample_of_bitfields() -> Manifest {
    with_bitfields(
        sample(),
        Technique::Bitfields {
            samples: Samples::Adaptive,
            held_back: 1000,
            tolerated_pixels: 0,
            seed: 0,
            patch_triangles: 64,
            finer: 1.5,
            neighbors: Some(true),
        },
        sample_bitfields_body(),
    )
}

/// What fits to the lists of an octahedron's faces, two ranges each.
pub(crate) fn sample_bitfields_body() -> BitfieldsBody {
    BitfieldsBody {
        triangles: 20,
        always_drawn: 0,
        viewpoints: 6,
        lists: 8,
        ranges: 16,
        most_ranges: 2,
        culled: 0.5,
    }
}

/// Manifests of layers that pass the check, as they are after writing a GLB file that is `x`.
pub(crate) fn manifests_with_layers() -> impl Strategy<Value = Manifest> {
    let foliage = prop_oneof![Just(Foliage::Any), Just(Foliage::Centre)];
    let channels = prop_oneof![
        Just(Channels::Lit),
        Just(Channels::Unlit),
        Just(Channels::Pbr)
    ];
    let technique = (lengths(), any::<u32>(), foliage, channels);
    let options = (
        1..=16384u32,
        1e-3..179.9f64,
        view_spaces(),
        vec(texts(), 0..3),
    );
    let rest = (sources(), promises(), costs(), costs(), vec(texts(), 0..3));
    (technique, options, rest, impostors()).prop_map(|(technique, options, rest, mut impostors)| {
        if !options.2.has_sides() {
            impostors.truncate(1);
            impostors.iter_mut().for_each(|one| one.side = None);
        }
        let (scene, promise, before, after, warnings) = rest;
        let bodies = || impostors.iter().filter_map(|one| one.body.layers());
        let is_mesh = |one: &Impostor| matches!(one.body, Body::Tdm(_));
        let layers = || bodies().flat_map(|b| &b.layers);
        Manifest {
            format: FORMAT.into(),
            version: VERSION,
            generator: Generator {
                name: "farfield".into(),
                version: "0.1.0".into(),
            },
            technique: match impostors.iter().any(is_mesh) {
                false => Technique::Layered {
                    bytes_per_quad: technique.0,
                    page_size: technique.1,
                    foliage: technique.2,
                    channels: technique.3,
                },
                true => Technique::Tdm {
                    enlarged: 1.0 + technique.0.fract(),
                    page_size: technique.1,
                    foliage: technique.2,
                    channels: technique.3,
                },
            },
            options: Options {
                resolution: options.0,
                fov_degrees: options.1,
                view_space: options.2,
                exclude: options.3,
            },
            scene,
            promise,
            statistics: Statistics {
                before,
                after,
                layers: layers().count() as u64,
                quads: layers().map(|l| u64::from(l.quads)).sum(),
                texels_recorded: bodies().map(|b| b.texels_recorded).sum(),
                texels_kept: bodies().map(|b| b.texels_kept).sum(),
            },
            warnings,
            impostors,
            files: vec![FileRecord {
                path: GLTF_FILE.into(),
                bytes: 1,
                sha256: sha256_hex(b"x"),
            }],
            sha256: sha256_hex(b"y"),
        }
    })
}

/// Certificates that pass the check, of the bundle whose manifest is given.
pub(crate) fn certificates(manifest: &Manifest) -> impl Strategy<Value = Certificate> + use<> {
    let figures = [lengths(), lengths(), lengths(), lengths(), lengths()];
    let flip = prop::option::of(0.0..=1.0f64);
    let worst = (any::<[u64; 2]>(), figures, flip).prop_map(
        |([gap_pixels, phantom_pixels], figures, flip)| {
            let [
                parallax_px,
                silhouette_px,
                coverage_error,
                colour_bias,
                stray_colours,
            ] = figures;
            WorstFigures {
                gap_pixels,
                phantom_pixels,
                parallax_px,
                silhouette_px,
                coverage_error,
                colour_bias,
                stray_colours,
                missed_pixels: (gap_pixels % 2 == 0).then_some(phantom_pixels),
                flip,
                worst_view: 0,
            }
        },
    );
    let proved =
        (texts(), numbers(), numbers()).prop_map(|(statement, bound, limit)| ProvedBound {
            statement,
            bound,
            limit,
        });
    let beyond = [lengths(), lengths(), lengths(), lengths()].prop_map(
        |[
            cell_scale,
            switch_distance_m,
            screen_coverage,
            geometric_error_m,
        ]| Beyond {
            cell_scale,
            switch_distance_m,
            screen_coverage,
            geometric_error_m,
        },
    );
    let sentences = (vec(proved, 0..3), vec(texts(), 0..3));
    let numbers = (1..=u64::MAX, any::<Index>(), any::<u64>());
    let sample = sample_certificate(manifest);
    (worst, sentences, prop::option::of(beyond), numbers).prop_map(
        move |(worst, (proved, sampled), beyond, (viewpoints, view, seed))| Certificate {
            viewpoints,
            seed,
            worst: WorstFigures {
                worst_view: view.index(viewpoints.min(1 << 30) as usize) as u64,
                ..worst
            },
            proved,
            sampled,
            beyond,
            ..sample.clone()
        },
    )
}

/// What may happen to a file.
#[derive(Clone, Debug)]
pub(crate) enum Damage {
    /// Only its beginning is left.
    CutOff(Index),
    /// A digit becomes another one; most such files are well-formed.
    Digit(Index, u8),
    /// Bits of some bytes are flipped.
    Flips(Vec<(Index, u8)>),
    /// A piece is left out, doubled or replaced.
    Splice([Index; 3], Vec<u8>),
}

impl Damage {
    /// The file's bytes after it happened; they may be the same as before.
    pub(crate) fn of(&self, sound: &[u8]) -> Vec<u8> {
        match self {
            Self::CutOff(end) => sound[..end.index(sound.len())].to_vec(),
            Self::Digit(at, digit) => {
                let mut damaged = sound.to_vec();
                let digits = damaged.iter_mut().filter(|byte| byte.is_ascii_digit());
                let mut digits: Vec<_> = digits.collect();
                **at.get_mut(&mut digits) = *digit;
                damaged
            }
            Self::Flips(flips) => {
                let mut damaged = sound.to_vec();
                for (at, bits) in flips {
                    damaged[at.index(sound.len())] ^= bits;
                }
                damaged
            }
            Self::Splice(cuts, junk) => {
                let [a, b, c] = cuts.map(|cut| cut.index(sound.len()));
                let (a, b) = (a.min(b), a.max(b));
                [&sound[..a], &sound[c..], junk, &sound[b..]].concat()
            }
        }
    }
}

pub(crate) fn damages() -> impl Strategy<Value = Damage> {
    let flips = vec((any::<Index>(), 1..=255u8), 1..5);
    prop_oneof![
        any::<Index>().prop_map(Damage::CutOff),
        (any::<Index>(), b'0'..=b'9').prop_map(|(at, digit)| Damage::Digit(at, digit)),
        flips.prop_map(Damage::Flips),
        (any::<[Index; 3]>(), vec(any::<u8>(), 0..4)).prop_map(|(a, b)| Damage::Splice(a, b)),
    ]
}

/// Checks that the file `name` in the folder `schema`, with the text `published`, is the schema
/// that the types give.
#[track_caller]
pub(crate) fn check_schema(name: &str, published: &str, schema: &schemars::Schema) {
    let path = format!("{}/schema/{name}", env!("CARGO_MANIFEST_DIR"));
    let generated = serde_json::to_string_pretty(schema).unwrap() + "\n";
    if std::env::var_os("FARFIELD_BLESS").is_some() {
        std::fs::write(&path, &generated).unwrap();
    }
    // Compared as values: the order of keys depends on what other crates ask of serde_json.
    let value = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    assert!(
        value(published) == value(&generated),
        "{path} is not what the types say. If the change is meant, and readers of this version can \
         live with it, run the test twice, first with FARFIELD_BLESS=1."
    );
}

/// Files of a bundle, the glTF file among them; some are empty, some in folders.
pub(crate) fn files() -> impl Strategy<Value = Vec<NewFile>> {
    let names = [
        "pages/000.png",
        "pages/001.png",
        "a/b/c",
        GLTF_FILE,
        "zoë.bin",
    ];
    let contents = vec(any::<u8>(), 0..40);
    [
        contents.clone(),
        contents.clone(),
        contents.clone(),
        contents.clone(),
        contents,
    ]
    .prop_map(move |contents| {
        let named = names.into_iter().zip(contents);
        named
            .map(|(path, bytes)| NewFile {
                path: path.into(),
                bytes,
            })
            .collect()
    })
}

/// A manifest to be damaged: two impostors with three layers.
pub(crate) fn sample() -> Manifest {
    let layer = |depth: f64| LayerRecord {
        depth,
        near: depth - 0.5,
        far: depth + 0.5,
        quads: 7,
        texels_sha256: sha256_hex(b"texels"),
    };
    let impostor = |side: Side, depths: &[f64]| Impostor {
        name: format!("house {side}"),
        side: Some(side),
        represented: [DVec3::splat(-1.0), DVec3::ONE],
        body: Body::Layered(LayeredBody {
            pose: Pose::looking_along(DVec3::Z * 5.0, DVec3::NEG_Z),
            extent: Extent::symmetric(0.5, 100, 50),
            width: 100,
            height: 50,
            layers: depths.iter().copied().map(layer).collect(),
            texels_recorded: 1000,
            texels_kept: 600,
        }),
    };
    Manifest {
        format: FORMAT.into(),
        version: VERSION,
        generator: Generator {
            name: "farfield".into(),
            version: "0.1.0".into(),
        },
        technique: Technique::Layered {
            bytes_per_quad: 104.0,
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
        },
        options: Options {
            resolution: 512,
            fov_degrees: 45.0,
            view_space: ViewSpace::Amid {
                view_cell: ViewCell::Box {
                    center: DVec3::Z * 5.0,
                    size: DVec3::ONE,
                },
                distance: 2.0,
                objects: vec!["house".into()],
            },
            exclude: vec!["tree".into()],
        },
        scene: SceneSource::BuiltIn {
            name: "house".into(),
            size: 1,
            seed: 3,
        },
        promise: Promise {
            gap_pixels: Some(0),
            parallax_px: Some(1.0),
            ..Promise::default()
        },
        statistics: Statistics {
            layers: 3,
            quads: 21,
            texels_recorded: 2000,
            texels_kept: 1200,
            ..Statistics::default()
        },
        warnings: vec![],
        impostors: vec![
            impostor(Side::Front, &[4.5, 5.5]),
            impostor(Side::Back, &[20.0]),
        ],
        files: vec![FileRecord {
            path: GLTF_FILE.into(),
            bytes: 1,
            sha256: sha256_hex(b"x"),
        }],
        sha256: sha256_hex(b"y"),
    }
}

/// A certificate to be damaged, of the bundle whose manifest is given.
pub(crate) fn sample_certificate(manifest: &Manifest) -> Certificate {
    Certificate {
        format: CERTIFICATE_FORMAT.into(),
        version: CERTIFICATE_VERSION,
        generator: manifest.generator.clone(),
        bundle_sha256: manifest.sha256.clone(),
        scene: manifest.scene.clone(),
        view_space: manifest.options.view_space.clone(),
        resolution: manifest.options.resolution,
        fov_degrees: manifest.options.fov_degrees,
        viewpoints: 256,
        seed: 7,
        worst: WorstFigures {
            parallax_px: 0.75,
            silhouette_px: 1.5,
            flip: Some(0.01),
            worst_view: 255,
            ..WorstFigures::default()
        },
        proved: vec![ProvedBound {
            statement: "Neighbouring layers move apart by at most this many texels.".into(),
            bound: 0.875,
            limit: 1.0,
        }],
        sampled: vec!["Gap pixels were counted.".into()],
        beyond: Some(Beyond {
            cell_scale: 1.25,
            switch_distance_m: 40.0,
            screen_coverage: 0.5,
            geometric_error_m: 0.06,
        }),
        sha256: String::new(),
    }
}

/// The files of a small bundle.
pub(crate) fn sample_files() -> Vec<NewFile> {
    [
        (GLTF_FILE, "glb"),
        ("pages/000.png", "page 0"),
        ("pages/001.png", ""),
    ]
    .map(|(path, content)| NewFile {
        path: path.into(),
        bytes: content.into(),
    })
    .into()
}

fn affine_maps() -> impl Strategy<Value = DAffine3> {
    let small = || [-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64].prop_map(DVec3::from);
    let linear = prop_oneof![
        Just(DMat3::IDENTITY),
        // A rotation and a scale, often mirrored.
        (small(), small()).prop_map(|(turn, scale)| {
            let turn = DMat3::from_quat(DQuat::from_scaled_axis(turn));
            turn * DMat3::from_diagonal(scale)
        }),
        // A shear.
        (small(), small(), small()).prop_map(|(x, y, z)| DMat3::from_cols(x, y, z)),
        // Flat, and nothing at all.
        Just(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 2.0))),
        Just(DMat3::ZERO),
    ];
    let translation = prop_oneof![Just(DVec3::ZERO), small(), small().prop_map(|t| t * 4e6)];
    (linear, translation)
        .prop_map(|(linear, translation)| DAffine3::from_mat3_translation(linear, translation))
}

fn materials(textures: u32) -> impl Strategy<Value = Material> {
    let texture = move || prop::option::of(0..textures);
    let unit = || 0.0..=1.0f32;
    let emission = prop_oneof![
        Just(Vec3::ZERO),
        Just(Vec3::new(0.5, 1.0, 0.0)),
        Just(Vec3::new(0.5, 8.0, 0.0))
    ];
    let alpha = prop_oneof![
        Just(AlphaMode::Opaque),
        unit().prop_map(|cutoff| AlphaMode::Mask { cutoff }),
        Just(AlphaMode::Blend),
    ];
    let maps = [texture(), texture(), texture(), texture()];
    (
        texts(),
        [unit(), unit(), unit(), unit()],
        unit(),
        unit(),
        maps,
        emission,
        alpha,
        any::<[bool; 2]>(),
    )
        .prop_map(
            |(name, color, metallic, roughness, maps, emissive, alpha, [double_sided, unlit])| {
                Material {
                    name,
                    base_color: Vec4::from(color),
                    base_color_texture: maps[0],
                    metallic,
                    roughness,
                    metallic_roughness_texture: maps[1],
                    normal_texture: maps[2],
                    normal_scale: roughness * 2.0,
                    emissive,
                    emissive_texture: maps[3],
                    alpha,
                    double_sided,
                    unlit,
                }
            },
        )
}

fn textures(images: u32) -> impl Strategy<Value = Texture> {
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    let filters = [Filter::Nearest, Filter::Linear, Filter::Mipmapped];
    (0..images, 0..3usize, 0..3usize, 0..3usize).prop_map(move |(image, u, v, f)| Texture {
        image,
        wrap: [wraps[u], wraps[v]],
        filter: filters[f],
    })
}

/// Images of any texels, long and thin ones included.
pub(crate) fn images() -> impl Strategy<Value = Image> {
    (1..20u32, 1..20u32).prop_flat_map(|(width, height)| {
        let texels = vec(any::<[u8; 4]>(), (width * height) as usize);
        texels.prop_map(move |texels| Image {
            name: String::new(),
            width,
            height,
            texels,
        })
    })
}

/// Small scenes: meshes that share nothing, use several materials or have no triangles; objects
/// that share meshes, are far away, mirrored, sheared or flat; things that nothing uses.
pub(crate) fn scenes() -> impl Strategy<Value = Scene> {
    let unit = || -1.0..1.0f32;
    let vertex = (
        [unit(), unit(), unit()].prop_map(Vec3::from),
        [unit(), unit(), unit()].prop_map(|n| Vec3::from(n).normalize_or(Vec3::Y)),
        [unit(), unit()].prop_map(Vec2::from),
        prop_oneof![3 => Just(Vec4::ONE), 1 => Just(Vec4::new(0.5, 0.0, 1.0, 0.25))],
    );
    let triangle = (any::<[Index; 3]>(), 0..3u32);
    let mesh = (vec(vertex, 1..9), vec(triangle, 0..9));
    let object = (texts(), any::<Index>(), affine_maps());
    let looks = (vec(materials(3), 3), vec(textures(2), 3), vec(images(), 2));
    (vec(mesh, 1..4), vec(object, 0..6), looks).prop_map(|(meshes, objects, looks)| {
        let mut scene = Scene::default();
        for (vertices, triangles) in meshes {
            let (first_vertex, first) =
                (scene.positions.len() as u32, scene.triangles.len() as u32);
            let index = |i: Index| first_vertex + i.index(vertices.len()) as u32;
            for (corners, material) in triangles {
                scene.triangles.push(corners.map(index));
                scene.triangle_materials.push(material);
            }
            for (position, normal, uv, color) in vertices {
                scene.positions.push(position);
                scene.normals.push(normal);
                scene.uvs.push(uv);
                scene.colors.push(color);
            }
            scene.meshes.push(Mesh {
                vertices: first_vertex..scene.positions.len() as u32,
                triangles: first..scene.triangles.len() as u32,
            });
        }
        (scene.materials, scene.textures, scene.images) = looks;
        scene.objects = objects
            .into_iter()
            .map(|(name, mesh, world_from_mesh)| Object {
                name,
                mesh: mesh.index(scene.meshes.len()) as u32,
                world_from_mesh,
            })
            .collect();
        scene
    })
}
