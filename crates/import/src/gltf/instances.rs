//! Places meshes many times: EXT_mesh_gpu_instancing.

use super::GltfError;
use super::accessors::Elements;
use super::document::Document;
use super::files::Buffers;
use super::nodes::{Placed, unit_rotation};
use crate::notes::Notes;
use glam::{DAffine3, DQuat, DVec3};

/// Objects that any file may have, and one more for each of its bytes. An instance takes four
/// bytes at least; beyond, nodes share their instances' accessors.
const OBJECTS: u64 = 1 << 20;

/// How far the length of a rotation of bytes may be from 1 by rounding: half a step of 1/127 along
/// each of four axes.
const BYTE_ROUNDING: f64 = 0.008;

/// Replaces each node with instances by one for each instance, in their order.
///
/// Source: Khronos Group, EXT_mesh_gpu_instancing.
///
/// # Errors
///
/// When an instance stands nowhere, or there are more than a file of `size` bytes should have.
pub(crate) fn place_instances(
    document: &Document,
    nodes: Vec<Placed>,
    buffers: &Buffers<'_>,
    size: u64,
    notes: &mut Notes,
) -> Result<Vec<Placed>, GltfError> {
    let mut placed = Vec::new();
    for node in nodes {
        let instancing = &document.nodes[node.node].extensions.gpu_instancing;
        let attributes = match instancing {
            Some(instancing) if !instancing.attributes.is_empty() => &instancing.attributes,
            _ => {
                placed.push(node);
                continue;
            }
        };
        let place = |name: &str| {
            let node = node.node;
            format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes{name}")
        };
        let first = attributes.values().next().expect("there are some");
        let count = document.accessors[*first].count;
        if placed.len() as u64 + count > OBJECTS + size {
            return Err(GltfError::TooLarge {
                place: place(""),
                limit: OBJECTS + size,
                unit: "objects",
                remedy: "split the file",
            });
        }
        let open = |name: &str| {
            let accessor = attributes.get(name);
            accessor
                .map(|&accessor| Elements::open(document, buffers, accessor))
                .transpose()
        };
        let translations = open("TRANSLATION")?;
        let rotations = open("ROTATION")?;
        let scales = open("SCALE")?;
        for i in 0..count as usize {
            let wrong = |name: &str, value| GltfError::Value {
                place: place(name),
                value: format!("element {i} {value}"),
                expected: "finite numbers",
            };
            let vector = |elements: &Option<Elements<'_>>, default| {
                elements.as_ref().map_or(default, |elements| {
                    let [x, y, z, _] = elements.get(i).map(f64::from);
                    DVec3::new(x, y, z)
                })
            };
            let translation = vector(&translations, DVec3::ZERO);
            let scale = vector(&scales, DVec3::ONE);
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |elements| {
                DQuat::from_array(elements.get(i).map(f64::from))
            });
            let rotation = unit_rotation(rotation, 2.0 * BYTE_ROUNDING, notes)
                .ok_or_else(|| wrong(".ROTATION", "has no direction"))?;
            let node_from_instance =
                DAffine3::from_scale_rotation_translation(scale, rotation, translation);
            let world_from_node = node.world_from_node * node_from_instance;
            if !world_from_node.is_finite() {
                return Err(wrong("", "is not finite"));
            }
            placed.push(Placed {
                world_from_node,
                ..node
            });
        }
    }
    Ok(placed)
}

#[cfg(test)]
mod tests {
    use crate::gltf::testing::{Binary, read};
    use glam::{DQuat, DVec3};
    use proptest::prelude::*;
    use serde_json::json;

    /// How rotations are stored.
    #[derive(Clone, Copy, Debug)]
    enum Stored {
        Floats,
        Shorts,
        Bytes,
    }

    proptest! {
        /// Each instance stands where its scale, rotation and translation, then the node's, put
        /// it, however rotations are stored.
        #[test]
        fn instances_stand_where_they_should(
            instances in prop::collection::vec(
                (prop::array::uniform3(-9i8..9), prop::array::uniform4(-9i8..9), prop::array::uniform3(1i8..4)), 1..9),
            stored in prop::sample::select(vec![Stored::Floats, Stored::Shorts, Stored::Bytes]),
            given in prop::array::uniform3(any::<bool>()),
        ) {
            let mut binary = Binary::default();
            let positions = binary.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
            let turns: Vec<DQuat> = instances.iter().map(|(_, turn, _)| {
                let turn = turn.map(f64::from);
                if turn == [0.0; 4] { DQuat::IDENTITY } else { DQuat::from_array(turn).normalize() }
            }).collect();
            let (step, rotations) = match stored {
                Stored::Floats => {
                    let turns: Vec<[f32; 4]> = turns.iter().map(|q| q.as_quat().to_array()).collect();
                    (1e-7, binary.floats(&turns))
                }
                Stored::Shorts => {
                    let bytes: Vec<u8> = turns.iter().flat_map(|q| q.to_array())
                        .flat_map(|c| ((c * 32767.0).round() as i16).to_le_bytes()).collect();
                    (1.0 / 32767.0, binary.accessor(&bytes, 5122, "VEC4", turns.len()))
                }
                Stored::Bytes => {
                    let bytes: Vec<u8> = turns.iter().flat_map(|q| q.to_array())
                        .map(|c| (c * 127.0).round() as i8 as u8).collect();
                    (1.0 / 127.0, binary.accessor(&bytes, 5120, "VEC4", turns.len()))
                }
            };
            binary.accessors[rotations]["normalized"] = json!(!matches!(stored, Stored::Floats));
            let moves: Vec<[f32; 3]> = instances.iter().map(|i| i.0.map(f32::from)).collect();
            let scales: Vec<[f32; 3]> = instances.iter().map(|i| i.2.map(f32::from)).collect();
            let accessors = [binary.floats(&moves), rotations, binary.floats(&scales)];
            let mut attributes = json!({});
            for (i, name) in ["TRANSLATION", "ROTATION", "SCALE"].into_iter().enumerate() {
                if given[i] {
                    attributes[name] = json!(accessors[i]);
                }
            }
            prop_assume!(given != [false; 3]);
            let file = binary.file(json!({
                "extensionsRequired": ["EXT_mesh_gpu_instancing"],
                "nodes": [{"mesh": 0, "name": "tree", "translation": [100, 0, 0], "scale": [2, 2, 2],
                    "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": positions}}]}],
            }));
            let imported = read(&file).unwrap();
            prop_assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
            let scene = imported.scene;
            prop_assert_eq!((scene.objects.len(), scene.meshes.len()), (instances.len(), 1));
            for (i, object) in scene.objects.iter().enumerate() {
                let point = DVec3::new(0.25, 0.5, 3.0);
                let scaled = if given[2] { point * DVec3::from(scales[i].map(f64::from)) } else { point };
                let turned = if given[1] { turns[i] * scaled } else { scaled };
                let moved = if given[0] { turned + DVec3::from(moves[i].map(f64::from)) } else { turned };
                let expected = moved * 2.0 + DVec3::X * 100.0;
                let actual = object.world_from_mesh.transform_point3(point);
                // Half a step in each of four components of the rotation turns by two steps at most,
                // and points are up to 3 * 3.1 * 2 away.
                prop_assert!((actual - expected).length() <= 19.0 * 2.0 * step, "{} and {}", actual, expected);
                prop_assert_eq!(object.name.as_str(), "tree");
            }
        }
    }

    #[test]
    fn faulty_instances_are_told_with_their_places() {
        let refusal = |translation: f32, turn: f32, change: (&str, serde_json::Value)| {
            let mut binary = Binary::default();
            binary.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
            binary.floats(&[[translation, 0.0, 0.0], [0.0; 3]]);
            binary.floats(&[[0.0, 0.0, 0.0, turn]; 2]);
            let mut document = binary.document(json!({
                "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing":
                    {"attributes": {"TRANSLATION": 1, "ROTATION": 2}}}}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            }));
            *document.pointer_mut(change.0).unwrap() = change.1;
            match read(&crate::gltf::testing::glb(&document, &binary.bytes)) {
                Ok(_) => String::new(),
                Err(error) => error.to_string(),
            }
        };
        let same = ("/asset/version", json!("2.0"));
        assert_eq!(refusal(1.0, 1.0, same.clone()), "");
        let at = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes";
        for (message, expected) in [
            (refusal(f32::NAN, 1.0, same.clone()), ": element 0 is not"),
            (refusal(1.0, 0.0, same), ".ROTATION: element 0 has no"),
            (
                refusal(1.0, 1.0, ("/accessors/1/count", json!(1))),
                ".TRANSLATION: has 1",
            ),
            (
                refusal(1.0, 1.0, ("/accessors/2/type", json!("VEC3"))),
                ".ROTATION: is VEC3",
            ),
            (
                refusal(1.0, 1.0, ("/accessors/1/componentType", json!(5122))),
                ".TRANSLATION: is VEC3 of component type 5122",
            ),
            (
                refusal(
                    1.0,
                    1.0,
                    (
                        "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION",
                        json!(7),
                    ),
                ),
                ".TRANSLATION: 7 does not exist",
            ),
        ] {
            assert!(message.starts_with(&format!("{at}{expected}")), "{message}");
        }
    }

    /// Zeros out of nothing cannot ask for gigabytes of objects.
    #[test]
    fn instances_cost_bytes() {
        let mut binary = Binary::default();
        let positions = binary.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        binary
            .accessors
            .push(json!({"componentType": 5126, "type": "VEC3", "count": 1 << 24}));
        let file = binary.file(json!({
            "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": positions}}]}],
        }));
        let message = read(&file).unwrap_err().to_string();
        assert!(message.contains("objects; split the file"), "{message}");
    }
}
