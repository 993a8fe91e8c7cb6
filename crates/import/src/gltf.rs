//! Reads glTF 2.0 files, as text or binary.

mod accessors;
mod check;
mod container;
mod document;
mod draco;
mod error;
mod files;
mod images;
mod instances;
mod materials;
mod meshes;
mod meshopt;
mod nodes;
#[cfg(test)]
mod testing;
mod uri;

pub use error::GltfError;

use crate::notes::{Note, Notes};
use crate::{Imported, Load};
use farfield_scene::{Object, Scene};
use glam::{DAffine3, DMat3, DVec3};
use std::collections::BTreeSet;

/// The default scene of a glTF 2.0 file, .gltf or .glb.
///
/// The document is checked as a whole before anything is read: version, required extensions, every
/// index, every bound, the types of attributes, the forest of nodes. What it refers to is checked
/// as it is read. Memory stays within bounds that follow from the size of the input.
///
/// * `bytes` - the file
/// * `load` - fetches buffers and images that stand beside the file; never asked for an absolute
///   path, but possibly for one that begins with `..`
///
/// Source: Khronos Group, glTF 2.0 Specification.
///
/// # Errors
///
/// When the file is damaged, of another version, or needs what is not supported; the first thing
/// found wrong is told with its place.
pub fn read_gltf(bytes: &[u8], load: &mut Load<'_>) -> Result<Imported, GltfError> {
    let container = container::open_container(bytes)?;
    let mut document = document::parse_document(container.json)?;
    check::check_document(&document)?;

    let mut notes = Notes::default();
    let nodes = nodes::place_nodes(&document, &mut notes)?;
    let wanted: BTreeSet<usize> = nodes.iter().map(|placed| placed.mesh).collect();
    let used = meshes::used_materials(&document, wanted.iter().copied()).collect();
    let looks = materials::read_materials(&document, &used, &mut notes)?;

    let mut names = Vec::new();
    let mut load = |path: &str| {
        names.push(path.to_owned());
        load(path)
    };
    let mut files = files::Files::new(&mut load);
    let mut buffers = files::Buffers::load(&document, container.binary, &mut files)?;
    let size = bytes.len() as u64 + buffers.size();
    meshopt::decode_views(&document, &mut buffers, size)?;
    draco::decode_primitives(&mut document, &wanted, &mut buffers, size)?;
    let size = bytes.len() as u64 + buffers.size();
    let nodes = instances::place_instances(&document, nodes, &buffers, size, &mut notes)?;
    let (images, slots) =
        images::read_images(&document, &looks.images, &buffers, &mut files, size)?;
    let mut scene = Scene::default();
    let shapes = meshes::read_meshes(
        &document, wanted, &buffers, &looks, size, &mut scene, &mut notes,
    )?;

    scene.images = images;
    scene.textures = looks.textures;
    for texture in &mut scene.textures {
        texture.image = slots[texture.image as usize];
    }
    scene.materials = looks.materials;
    for placed in nodes {
        let Some(shape) = &shapes[&placed.mesh] else {
            continue;
        };
        let world_from_mesh = placed.world_from_node * DAffine3::from_translation(shape.centre);
        if !inverts(&world_from_mesh.matrix3) {
            notes.add(Note::FlatObjects, 1);
            continue;
        }
        check_reach(&world_from_mesh, shape.reach, placed.node)?;
        scene.objects.push(Object {
            name: name_of(&document, placed.node, placed.mesh),
            mesh: shape.mesh,
            world_from_mesh,
        });
    }
    let warnings = notes.warnings();
    debug_assert_eq!(scene.check(), Ok(()));
    Ok(Imported {
        scene,
        warnings,
        files: names,
    })
}

/// Whether normals can be taken along, by the inverse of the transform.
fn inverts(matrix: &DMat3) -> bool {
    matrix.determinant() != 0.0 && matrix.inverse().is_finite()
}

/// Whether all of an object stands where f32 has numbers, as drawing needs.
fn check_reach(world_from_mesh: &DAffine3, reach: DVec3, node: usize) -> Result<(), GltfError> {
    let axes = world_from_mesh.matrix3;
    let reach = axes.x_axis.abs() * reach.x
        + axes.y_axis.abs() * reach.y
        + axes.z_axis.abs() * reach.z
        + world_from_mesh.translation.abs();
    // Written so that what is not a number fails.
    match reach.max_element() <= f64::from(f32::MAX) && reach.is_finite() {
        true => Ok(()),
        false => Err(GltfError::Value {
            place: format!("nodes[{node}]"),
            value: "puts its mesh too far away".into(),
            expected: "coordinates of at most 3.4e38",
        }),
    }
}

/// A node's name, else its mesh's, else its number.
fn name_of(document: &document::Document, node: usize, mesh: usize) -> String {
    [&document.nodes[node].name, &document.meshes[mesh].name]
        .into_iter()
        .flatten()
        .find(|name| !name.is_empty())
        .cloned()
        .unwrap_or_else(|| format!("node {node}"))
}

#[cfg(test)]
mod tests {
    use super::testing::{Binary, encode, example, glb, read};
    use super::*;
    use farfield_scene::{AlphaMode, Filter, Wrap};
    use glam::{DVec3, Vec2, Vec3, Vec4};
    use image::ImageFormat;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    #[test]
    fn a_file_with_everything_reads_as_it_was_meant() {
        let (document, binary) = example();
        let Imported {
            scene, warnings, ..
        } = read(&glb(&document, &binary)).unwrap();
        assert_eq!(
            warnings,
            [
                "materials whose textures use different texture coordinates, all read with the first one's: 1"
            ]
        );
        let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, ["node 1", "plain", "strip"]);
        assert_eq!(scene.drawn_triangles(), 8);
        // Two meshes of the same accessors, with materials of their own.
        assert_eq!(scene.meshes[0].vertices, scene.meshes[1].vertices);
        assert_ne!(scene.meshes[0].triangles, scene.meshes[1].triangles);
        assert!(scene.objects[0].is_mirrored() && !scene.objects[1].is_mirrored());
        // Half a turn around z, then 10 along x.
        let at = scene.world_position(1, scene.meshes[1].vertices.start);
        assert!((at - DVec3::new(5.0, -6.0, 7.0)).length() < 1e-14, "{at}");

        let textured = &scene.materials[scene.triangle_materials[0] as usize];
        assert_eq!(textured.base_color, Vec4::new(1.0, 0.5, 0.25, 1.0));
        assert_eq!((textured.metallic, textured.roughness), (0.0, 0.5));
        assert_eq!(textured.alpha, AlphaMode::Mask { cutoff: 0.25 });
        assert_eq!((textured.normal_scale, textured.double_sided), (0.5, true));
        let texture = &scene.textures[textured.base_color_texture.unwrap() as usize];
        assert_eq!(texture.wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
        assert_eq!(texture.filter, Filter::Linear);
        let other = &scene.textures[textured.normal_texture.unwrap() as usize];
        assert_eq!(
            (other.wrap, other.filter),
            ([Wrap::Repeat; 2], Filter::Mipmapped)
        );
        assert_eq!(
            scene.images[texture.image as usize].texels,
            [[10, 20, 30, 40]; 4]
        );
        let unlit = scene.materials.iter().find(|m| m.unlit).unwrap();
        assert_eq!(
            (unlit.alpha, unlit.emissive),
            (AlphaMode::Blend, Vec3::ZERO)
        );
        assert_eq!(scene.colors[0], Vec4::new(1.0, 128.0 / 255.0, 0.0, 1.0));
        assert_eq!(scene.normals[0], Vec3::Z);
        // (0, 1), doubled, turned by 1 and moved.
        let (sin, cos) = 1f64.sin_cos();
        let expected = glam::DVec2::new(2.0 * sin + 0.5, 2.0 * cos).as_vec2();
        assert!(
            (scene.uvs[0] - expected).length() <= 2.0 * f32::EPSILON,
            "{}",
            scene.uvs[0]
        );
    }

    /// A corner of a triangle as drawn: position and texture coordinate, as bits.
    type Corner = ([u32; 3], [u32; 2]);

    fn corner(position: Vec3, uv: Vec2) -> Corner {
        // Adding zero makes -0 to 0.
        (
            (position + 0.0).to_array().map(f32::to_bits),
            uv.to_array().map(f32::to_bits),
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// What a scene draws is what the primitives say, whatever their modes and index types,
        /// whichever vertices they use and share, and whatever materials they have.
        #[test]
        fn the_scene_draws_the_triangles_of_the_file(
            vertices in prop::collection::vec(prop::array::uniform3(-2i8..3), 3..9),
            primitives in prop::collection::vec(
                (4..7u32, 0..4usize, 0..2usize, 0..3usize, prop::collection::vec(any::<prop::sample::Index>(), 0..12)),
                1..6,
            ),
            meshes in 1..4usize,
        ) {
            let mut binary = Binary::default();
            let count = vertices.len();
            let moved = |by: f32| vertices.iter().map(|v| v.map(|c| f32::from(c) + by)).collect::<Vec<_>>();
            let uvs: Vec<[f32; 2]> = (0..count).map(|i| [i as f32, 0.5]).collect();
            let sets = [0.0, 8.0].map(|by| (binary.floats(&moved(by)), moved(by)));
            let uv_accessor = binary.floats(&uvs);
            let mut documents = vec![Vec::new(); meshes];
            let mut expected = Vec::new();
            for (i, (mode, index_type, set, material, indices)) in primitives.iter().enumerate() {
                let indices: Vec<u32> = indices.iter().map(|at| at.index(count) as u32).collect();
                let accessor = match index_type {
                    0 => None,
                    1 => Some((indices.iter().map(|&v| v as u8).collect::<Vec<_>>(), 5121)),
                    2 => Some((indices.iter().flat_map(|&v| (v as u16).to_le_bytes()).collect(), 5123)),
                    _ => Some((indices.iter().flat_map(|v| v.to_le_bytes()).collect(), 5125)),
                }.map(|(bytes, code)| binary.accessor(&bytes, code, "SCALAR", indices.len()));
                let corners = if accessor.is_some() { indices } else { (0..count as u32).collect() };
                let (accessor_of_set, positions) = &sets[*set];
                // The last material, 2, has no number in the file.
                documents[i % meshes].push(json!({
                    "attributes": {"POSITION": accessor_of_set, "TEXCOORD_0": uv_accessor}, "mode": mode,
                    "indices": accessor, "material": Some(material).filter(|&&m| m < 2),
                }));
                let triangles: Vec<[u32; 3]> = match mode {
                    4 => corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
                    5 => (2..corners.len()).map(|i| {
                        let flip = i % 2;
                        [corners[i - 2], corners[i - 1 + flip], corners[i - flip]]
                    }).collect(),
                    _ => (2..corners.len()).map(|i| [corners[i - 1], corners[i], corners[0]]).collect(),
                };
                for triangle in triangles {
                    let [a, b, c] = triangle.map(|v| Vec3::from(positions[v as usize]));
                    // Whole numbers: the area is exact.
                    if (b - a).cross(c - a) != Vec3::ZERO {
                        let corners = triangle.map(|v| corner(positions[v as usize].into(), uvs[v as usize].into()));
                        expected.push((["a", "b", ""][*material].to_owned(), corners));
                    }
                }
            }
            let file = binary.file(json!({
                "nodes": (0..meshes).map(|mesh| json!({"mesh": mesh})).collect::<Vec<_>>(),
                "meshes": documents.iter().map(|p| json!({"primitives": p})).collect::<Vec<_>>(),
                "materials": [{"name": "a"}, {"name": "b"}],
            }));
            let scene = read(&file).unwrap().scene;
            let mut drawn = Vec::new();
            for (i, object) in scene.objects.iter().enumerate() {
                let mesh = &scene.meshes[object.mesh as usize];
                for t in mesh.triangles.clone() {
                    let corners = scene.triangles[t as usize].map(|v| {
                        corner(scene.world_position(i as u32, v).as_vec3(), scene.uvs[v as usize])
                    });
                    let material = scene.triangle_materials[t as usize];
                    drawn.push((scene.materials[material as usize].name.clone(), corners));
                }
            }
            drawn.sort();
            expected.sort();
            prop_assert_eq!(drawn, expected);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1500))]

        /// A file with bytes changed or cut off is refused or read soundly.
        #[test]
        fn damaged_bytes_do_no_harm(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
            length in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let (document, binary) = example();
            let mut file = glb(&document, &binary);
            for (at, byte) in changes {
                let at = at.index(file.len());
                file[at] = byte;
            }
            if let Some(length) = length {
                file.truncate(length.index(file.len()));
            }
            let _ = read(&file);
        }

        /// A document with values changed is refused or read soundly.
        #[test]
        fn damaged_values_do_no_harm(
            changes in prop::collection::vec((any::<prop::sample::Index>(), 0..12usize), 1..4),
        ) {
            let odd = [
                json!(0), json!(1), json!(2), json!(255), json!(-1), json!(0.5), json!(1e300),
                json!(u32::MAX), json!(u64::MAX), json!("VEC4"), json!([]), json!({}),
            ];
            let (mut document, binary) = example();
            for (at, value) in changes {
                let mut places = Vec::new();
                leaves(&document, String::new(), &mut places);
                *document.pointer_mut(&places[at.index(places.len())]).unwrap() = odd[value].clone();
            }
            let _ = read(&glb(&document, &binary));
        }
    }

    /// The JSON pointers of all values that contain no others.
    fn leaves(value: &Value, place: String, places: &mut Vec<String>) {
        match value {
            Value::Array(array) => {
                for (i, value) in array.iter().enumerate() {
                    leaves(value, format!("{place}/{i}"), places);
                }
            }
            Value::Object(object) => {
                for (name, value) in object {
                    leaves(value, format!("{place}/{name}"), places);
                }
            }
            _ => places.push(place),
        }
    }

    /// A change of the example, as JSON pointer and value, and how the message begins.
    const FAULTS: &str = r#"/asset/version = "1.0" -> asset.version: glTF version "1.0"
/asset = {"version": "2.1", "minVersion": "2.1"} -> asset.minVersion: glTF
/asset = [] -> asset: invalid length
/buffers/0/byteLength = 9999 -> buffers[0].byteLength: needs 9999 bytes of the GLB
/buffers/0 = {"byteLength": 400, "uri": "a%20b.bin"} -> buffers[0].uri: "a b.bin" cannot
/buffers/0/byteLength = 10 -> bufferViews[0]: needs 96 bytes of buffers[0]
/bufferViews/1/buffer = 3 -> bufferViews[1].buffer: 3 does not exist
/bufferViews/1/byteOffset = 18446744073709551615 -> bufferViews[1]: needs 18446744073709551615
/bufferViews/0/byteStride = 8 -> bufferViews[0].byteStride: 8 is less than the 12
/bufferViews/0/byteStride = 13 -> accessors[0]: needs 103 bytes of bufferViews[0]
/bufferViews/0/byteStride = 18446744073709551615 -> accessors[0]: needs 18446744073709551615
/accessors/0/bufferView = 99 -> accessors[0].bufferView: 99 does not exist
/accessors/0/count = 9 -> accessors[0]: needs 108 bytes of bufferViews[0]
/accessors/0/count = "x" -> accessors[0].count: invalid type
/accessors/0/byteOffset = 18446744073709551615 -> accessors[0]: needs
/accessors/0/componentType = 5124 -> accessors[0].componentType: 5124
/accessors/0/type = "VEC5" -> accessors[0].type: "VEC5"
/accessors/0/type = "VEC2" -> meshes[0].primitives[0].attributes.POSITION: is VEC2
/accessors/1/normalized = true -> is read
/accessors/2/count = 7 -> meshes[0].primitives[0].attributes.TEXCOORD_0: has 7
/accessors/3/normalized = false -> meshes[0].primitives[0].attributes.COLOR_0
/accessors/4/componentType = 5122 -> meshes[0].primitives[0].indices: is SCALAR
/accessors/4/type = "VEC2" -> accessors[4]: needs 36 bytes
/accessors/6/sparse/indices/componentType = 5126 -> accessors[6].sparse.indices.comp
/accessors/6/sparse/count = 3 -> accessors[6].sparse.indices: needs 3
/accessors/6/sparse/values/bufferView = 6 -> accessors[6].sparse.values: needs
/accessors/6/sparse/indices/bufferView = 0 -> accessors[6].sparse.indices: do not ascend
/meshes/0/primitives/0/mode = 7 -> meshes[0].primitives[0].mode: 7
/meshes/0/primitives/0/material = 3 -> meshes[0].primitives[0].material: 3 does
/meshes/0/primitives/0/indices = 7 -> meshes[0].primitives[0].indices: 7 does not
/meshes/0/primitives/0/attributes/POSITION = 7 -> meshes[0].primitives[0].attributes.POSITION: 7
/nodes/1/mesh = 3 -> nodes[1].mesh: 3 does not exist
/nodes/0/children/1 = 4 -> nodes[0].children[1]: 4 does not exist
/nodes/0/children/1 = 1 -> nodes[0].children[1]: node 1 has another parent
/nodes/0/children/1 = 0 -> nodes[0]: node 0 is its own ancestor
/nodes/0/translation/0 = 1e300 -> nodes[1]: puts its mesh too far away
/nodes/0/rotation = [0, 0, 0] -> nodes[0].rotation: invalid length 3
/scene = 1 -> scene: 1 does not exist, the file has 1 scenes
/scenes/0/nodes/1 = 2 -> scenes[0].nodes[1]: node 2 is another node's child
/scenes/0/nodes/1 = 0 -> scenes[0].nodes[1]: node 0 is listed twice
/materials/0/alphaMode = "CLIP" -> materials[0].alphaMode: "CLIP"
/materials/0/alphaCutoff = 1.5 -> materials[0].alphaCutoff: 1.5
/materials/0/normalTexture/index = 2 -> materials[0].normalTexture.index: 2
/textures/0/source = 2 -> textures[0].source: 2 does not exist
/textures/0/sampler = 1 -> textures[0].sampler: 1 does not exist
/samplers/0/wrapT = 1 -> samplers[0].wrapT: 1
/samplers/0/minFilter = 1 -> samplers[0].minFilter: 1
/samplers/0/magFilter = 9984 -> samplers[0].magFilter: 9984
/images/0/bufferView = 0 -> images[0]: is none of PNG, JPEG
/images/0 = {} -> images[0]: has neither uri nor bufferView
/images/1/uri = "/etc/passwd" -> images[1].uri: the URI "/etc/passwd" is absolute"#;

    /// Each fault is told with its place.
    #[test]
    fn faults_are_told_with_their_places() {
        for fault in FAULTS.lines() {
            let (change, message) = fault.split_once(" ->").unwrap();
            let (place, value) = change.split_once(" = ").unwrap();
            let (value, message): (Value, _) = (value.parse().unwrap(), message.trim());
            let (parent, name) = place.rsplit_once('/').unwrap();
            let (mut document, binary) = example();
            match document.pointer_mut(parent).unwrap() {
                Value::Array(array) => array[name.parse::<usize>().unwrap()] = value,
                object => object[name] = value,
            }
            match read(&glb(&document, &binary)) {
                Ok(_) => assert_eq!(message, "is read", "{fault}"),
                Err(e) => assert!(e.to_string().starts_with(message), "{fault}: {e}"),
            }
        }
    }

    #[test]
    fn all_unsupported_extensions_are_named() {
        let (mut document, binary) = example();
        document["extensionsRequired"] =
            json!(["MSFT_texture_dds", "KHR_materials_unlit", "EXT_new"]);
        let message = read(&glb(&document, &binary)).unwrap_err().to_string();
        assert!(
            message.contains("MSFT_texture_dds, EXT_new are not supported"),
            "{message}"
        );
        document["extensionsRequired"] = json!(check::EXTENSIONS);
        assert!(read(&glb(&document, &binary)).is_ok());
    }

    #[test]
    fn faulty_bytes_are_told_with_their_places() {
        let triangle = |position: f32, index: u16| {
            let mut binary = Binary::default();
            binary.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, position, 0.0]]);
            binary.shorts(&[0, 1, index]);
            let primitive = json!({"attributes": {"POSITION": 0}, "indices": 1});
            read(&binary.file(json!({
                "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
            })))
        };
        assert_eq!(triangle(1.0, 2).unwrap().scene.drawn_triangles(), 1);
        assert_eq!(
            triangle(f32::NAN, 2).unwrap_err().to_string(),
            "accessors[0] (POSITION): element 2 is not finite; repair the mesh or remove the vertex"
        );
        assert_eq!(
            triangle(1.0, 3).unwrap_err().to_string(),
            "accessors[1] (indices of meshes[0].primitives[0]): element 2 is vertex 3, the primitive has 3; export the file again"
        );
    }

    /// A kilobyte cannot ask for gigabytes, in any of the ways it could.
    #[test]
    fn small_files_take_little_memory() {
        let scene = |primitives: Vec<Value>| json!({"nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}]});

        // Zeros out of nothing.
        let mut binary = Binary::default();
        binary
            .accessors
            .push(json!({"componentType": 5126, "type": "VEC3", "count": u32::MAX}));
        let error = read(&binary.file(scene(vec![json!({"attributes": {"POSITION": 0}})])));
        assert!(matches!(error, Err(GltfError::Value { .. })), "{error:?}");

        // The same triangles over and over, each time with other vertices.
        let mut binary = Binary::default();
        let positions = binary.floats(&[[0.0; 3]; 300]);
        let indices = binary.shorts(&[0, 1, 2].repeat(20_000));
        binary
            .accessors
            .extend(vec![binary.accessors[0].clone(); 400]);
        let primitive =
            |i| json!({"attributes": {"POSITION": positions, "NORMAL": 2 + i}, "indices": indices});
        let error = read(&binary.file(scene((0..400).map(primitive).collect())));
        assert!(error.is_ok(), "{error:?}");
        let error = read(&binary.file(scene((0..4_000).map(|i| primitive(i % 400)).collect())));
        assert!(
            matches!(error, Err(GltfError::TooLarge { .. })),
            "{error:?}"
        );

        // A picture that lies about its size, with the header's checksum made right.
        let mut png = encode(image::GrayImage::new(8, 8), ImageFormat::Png);
        png[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
        let checksum = !png[12..29].iter().fold(!0u32, |sum, &byte| {
            let step = |sum: u32, _| (sum >> 1) ^ (0xEDB8_8320 * (sum & 1));
            (0..8).fold(sum ^ u32::from(byte), step)
        });
        png[29..33].copy_from_slice(&checksum.to_be_bytes());
        let (mut document, mut binary) = example();
        document["images"][0] =
            json!({"bufferView": document["bufferViews"].as_array().unwrap().len()});
        document["bufferViews"]
            .as_array_mut()
            .unwrap()
            .push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": png.len()}));
        binary.extend(png);
        document["buffers"][0]["byteLength"] = json!(binary.len());
        let message = read(&glb(&document, &binary)).unwrap_err().to_string();
        let expected = "images[0]: claims 16384 x 16384 texels";
        assert!(message.starts_with(expected), "{message}");
    }

    #[test]
    fn instances_share_their_mesh() {
        let (mut document, binary) = example();
        document["scenes"][0]["nodes"] = json!((3..1003).collect::<Vec<_>>());
        document["nodes"]
            .as_array_mut()
            .unwrap()
            .extend(vec![json!({"mesh": 0}); 999]);
        let scene = read(&glb(&document, &binary)).unwrap().scene;
        assert_eq!((scene.objects.len(), scene.meshes.len()), (1000, 2));
        assert!(scene.positions.len() < 16);
    }

    /// What lies far from its origin is moved there, and stays where it was in the world, exactly.
    #[test]
    fn far_meshes_get_small_coordinates() {
        let mut binary = Binary::default();
        let far = [
            [4.4e6f32, 0.0, -5.4e6],
            [4.4e6 + 0.5, 0.0, -5.4e6],
            [4.4e6, 1.0, -5.4e6 - 0.5],
        ];
        binary.floats(&far);
        let file = binary.file(json!({
            "nodes": [{"mesh": 0, "translation": [0.25, 0, 0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        }));
        let scene = read(&file).unwrap().scene;
        for (i, far) in (0..).zip(far) {
            let world = DVec3::from(far.map(f64::from)) + DVec3::X * 0.25;
            assert_eq!(scene.world_position(0, i), world);
            assert!(scene.positions[i as usize].abs().max_element() <= 1.0);
        }
    }

    /// How a bundle's impostors look: external pages, masked, unlit, without mipmaps.
    #[test]
    fn pages_beside_the_file_are_fetched_once_each() {
        let mut binary = Binary::default();
        let positions = binary.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let uvs = binary.floats(&[[0.0; 2]; 3]);
        let info = |index| {
            json!({
                "pbrMetallicRoughness": {"baseColorTexture": {"index": index}, "metallicFactor": 0},
                "alphaMode": "MASK", "alphaCutoff": 0.24, "extensions": {"KHR_materials_unlit": {}},
            })
        };
        let primitive = |material| json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": material});
        let file = binary.file(json!({
            "extensionsUsed": ["KHR_materials_unlit"], "extensionsRequired": ["KHR_materials_unlit"],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": (0..3).map(primitive).collect::<Vec<_>>()}],
            "materials": [info(0), info(1), info(2)],
            "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}, {"source": 2, "sampler": 0}],
            "samplers": [{"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071}],
            "images": [{"uri": "pages/000.png"}, {"uri": "pages/001%20b.png"}, {"uri": "pages/000.png"}],
        }));
        let mut asked = Vec::new();
        let mut load = |path: &str| {
            asked.push(path.to_owned());
            let grey = image::GrayImage::from_pixel(3, 2, image::Luma([asked.len() as u8]));
            Ok(encode(grey, ImageFormat::Png))
        };
        let Imported {
            scene, warnings, ..
        } = read_gltf(&file, &mut load).unwrap();
        assert_eq!(asked, ["pages/000.png", "pages/001 b.png"]);
        assert_eq!(warnings, [""; 0]);
        assert_eq!(scene.images.len(), 2);
        assert_eq!(scene.images[1].name, "pages/001%20b.png");
        assert_eq!(scene.images[1].texels, [[2, 2, 2, 255]; 6]);
        assert_eq!(
            scene.textures.iter().map(|t| t.image).collect::<Vec<_>>(),
            [0, 1, 0]
        );
        assert!(scene.textures.iter().all(|t| t.filter == Filter::Linear));
        let mask = AlphaMode::Mask { cutoff: 0.24 };
        assert!(scene.materials.iter().all(|m| m.unlit && m.alpha == mask));
        assert_eq!(scene.positions.len(), 3);
    }

    /// Textures of extensions are read where there is no plain one.
    #[test]
    fn textures_of_extensions_are_read() {
        let webp = encode(
            image::RgbaImage::from_pixel(4, 4, image::Rgba([1, 2, 3, 4])),
            ImageFormat::WebP,
        );
        let ktx2 = crate::pictures::ktx2::tests::file(4, 4, &[[5, 6, 7, 8]], 0);
        for (name, bytes, texel) in [
            ("EXT_texture_webp", webp, [1, 2, 3, 4]),
            ("KHR_texture_basisu", ktx2, [5, 6, 7, 8]),
        ] {
            for has_plain in [true, false] {
                let (mut document, binary) = example();
                document["extensionsUsed"] = json!([name]);
                let images = document["images"].as_array_mut().unwrap();
                images.push(json!({"uri": "a.picture"}));
                let mut texture = json!({"extensions": {name: {"source": 2}}});
                if has_plain {
                    texture["source"] = json!(0);
                }
                document["textures"][0] = texture;
                let mut load = |_: &str| Ok(bytes.clone());
                let scene = read_gltf(&glb(&document, &binary), &mut load)
                    .unwrap()
                    .scene;
                let texture = scene.materials[0].base_color_texture.unwrap();
                let image = &scene.images[scene.textures[texture as usize].image as usize];
                let expected = if has_plain { [10, 20, 30, 40] } else { texel };
                assert_eq!(image.texels[0], expected, "{name}");
            }
        }
    }

    /// Every kind of picture becomes 8-bit RGBA.
    #[test]
    fn pictures_of_all_depths_are_read() {
        use image::{DynamicImage, ImageBuffer};
        for (picture, format, texel, tolerance) in [
            (
                DynamicImage::from(ImageBuffer::from_pixel(8, 8, image::Luma([7u8]))),
                ImageFormat::Png,
                [7, 7, 7, 255],
                0,
            ),
            (
                ImageBuffer::from_pixel(8, 8, image::LumaA([7u8, 9])).into(),
                ImageFormat::Png,
                [7, 7, 7, 9],
                0,
            ),
            (
                ImageBuffer::from_pixel(8, 8, image::Rgba([257 * 7u16, 0, 65535, 257 * 9])).into(),
                ImageFormat::Png,
                [7, 0, 255, 9],
                0,
            ),
            // JPEG rounds in its colour space and once more in its frequencies.
            (
                ImageBuffer::from_pixel(8, 8, image::Rgb([200u8, 100, 50])).into(),
                ImageFormat::Jpeg,
                [200, 100, 50, 255],
                4,
            ),
        ] {
            let (mut document, binary) = example();
            document["images"][0] = json!({"uri": "a.picture", "name": "leaf"});
            let mut load = |_: &str| Ok(encode(picture.clone(), format));
            let scene = read_gltf(&glb(&document, &binary), &mut load)
                .unwrap()
                .scene;
            let image = scene
                .images
                .iter()
                .find(|image| image.name == "leaf")
                .unwrap();
            assert_eq!((image.width, image.height), (8, 8));
            let near = |t: &[u8; 4]| (0..4).all(|c| t[c].abs_diff(texel[c]) <= tolerance);
            assert!(image.texels.iter().all(near), "{:?}", image.texels[0]);
        }
    }

    #[test]
    fn missing_parts_are_made_up_and_odd_ones_counted() {
        let mut binary = Binary::default();
        let positions = binary.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let normals = binary.floats(&[[0.0; 3], [f32::NAN, 0.0, 0.0], [0.0, 1e-30, 0.0]]);
        let uvs = binary.floats(&[[f32::INFINITY, 0.0], [1.0; 2], [2.0; 2]]);
        let colors = binary.floats(&[[2.0, -1.0, 0.5], [f32::NAN, 0.0, 0.0], [0.5; 3]]);
        let odd =
            json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors});
        let file = |attributes: Value, node: Value| {
            binary.file(json!({
            "nodes": [node], "meshes": [{"primitives": [{"attributes": attributes}, {"attributes": {}, "mode": 0}]}],
        }))
        };
        let Imported {
            scene, warnings, ..
        } = read(&file(odd, json!({"mesh": 0}))).unwrap();
        assert_eq!(scene.normals, [Vec3::Z, Vec3::Z, Vec3::Y]);
        assert_eq!(scene.uvs, [Vec2::ZERO, Vec2::ONE, Vec2::splat(2.0)]);
        assert_eq!(scene.colors[0], Vec4::new(1.0, 0.0, 0.5, 1.0));
        assert_eq!(scene.colors[1], Vec4::new(1.0, 0.0, 0.0, 1.0));
        let counts: Vec<&str> = warnings
            .iter()
            .map(|w| w.rsplit(' ').next().unwrap())
            .collect();
        assert_eq!(counts, ["1", "2", "1", "2"], "{warnings:?}");

        let plain = json!({"POSITION": positions});
        let scene = read(&file(plain.clone(), json!({"mesh": 0})))
            .unwrap()
            .scene;
        assert_eq!(
            (scene.normals[0], scene.uvs[0], scene.colors[0]),
            (Vec3::Z, Vec2::ZERO, Vec4::ONE)
        );
        assert_eq!(scene.materials, [farfield_scene::Material::default()]);

        let flat = file(plain, json!({"mesh": 0, "scale": [1, 1, 0]}));
        let Imported {
            scene, warnings, ..
        } = read(&flat).unwrap();
        assert_eq!(scene.objects, []);
        assert_eq!(
            warnings[1],
            "objects scaled to nothing along an axis, dropped: 1"
        );
    }
}
