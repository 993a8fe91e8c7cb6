//! Where meshes stand: the transforms of the nodes of a scene, composed in f64.

use super::GltfError;
use super::document::{Document, Node};
use crate::notes::{Note, Notes};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// A node with a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) node: usize,
    pub(crate) mesh: usize,
    pub(crate) world_from_node: DAffine3,
}

/// The nodes with meshes of the default scene (or the first, or of all roots where there is no
/// scene), parents before children, in the order of the file.
///
/// The walk is a loop, so that deep trees are no danger.
///
/// # Errors
///
/// When a transform is not affine or not finite.
pub(crate) fn place_nodes(
    document: &Document,
    notes: &mut Notes,
) -> Result<Vec<Placed>, GltfError> {
    let nodes = &document.nodes;
    let scene = document.scenes.get(document.scene.unwrap_or(0));
    let mut open: Vec<(usize, DAffine3)> = Vec::new();
    match scene {
        Some(scene) => open.extend(scene.nodes.iter().map(|&n| (n, DAffine3::IDENTITY))),
        None => {
            let mut is_root = vec![true; nodes.len()];
            for &child in nodes.iter().flat_map(|node| &node.children) {
                is_root[child] = false;
            }
            let roots = (0..nodes.len()).filter(|&node| is_root[node]);
            open.extend(roots.map(|n| (n, DAffine3::IDENTITY)));
        }
    }
    open.reverse();

    let mut placed = Vec::new();
    while let Some((i, world_from_parent)) = open.pop() {
        let node = &nodes[i];
        let world_from_node = world_from_parent * parent_from_node(node, i, notes)?;
        if !world_from_node.is_finite() {
            return Err(wrong(
                i,
                "transform",
                "is not finite with those of its parents",
            ));
        }
        open.extend(node.children.iter().rev().map(|&c| (c, world_from_node)));
        if let Some(mesh) = node.mesh {
            placed.push(Placed {
                node: i,
                mesh,
                world_from_node,
            });
            let morphed = document.meshes[mesh].weights.iter().any(|&w| w != 0.0);
            notes.add(Note::Skinned, node.skin.is_some().into());
            notes.add(Note::Morphed, morphed.into());
        }
    }
    Ok(placed)
}

/// The transform of one node, from its matrix or from scale, rotation and translation.
fn parent_from_node(node: &Node, index: usize, notes: &mut Notes) -> Result<DAffine3, GltfError> {
    if let Some(m) = node.matrix {
        if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
            return Err(wrong(
                index,
                "matrix",
                "has a last row other than 0, 0, 0, 1",
            ));
        }
        if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            return Err(wrong(index, "matrix", "stands beside another transform"));
        }
        let column = |c: usize| DVec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
        return Ok(DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        });
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let Some(rotation) = unit_rotation(rotation, 1e-3, notes) else {
        return Err(wrong(index, "rotation", "has no direction"));
    };
    Ok(DAffine3::from_scale_rotation_translation(
        node.scale.unwrap_or([1.0; 3]).into(),
        rotation,
        node.translation.unwrap_or_default().into(),
    ))
}

/// A rotation brought to length 1, which is noted where it is off by more than `tolerance`; `None`
/// where it has no direction.
///
/// Quaternions that were written with few digits are a little off, which is no news.
pub(crate) fn unit_rotation(rotation: DQuat, tolerance: f64, notes: &mut Notes) -> Option<DQuat> {
    let length = rotation.length();
    if !(1e-6..1e6).contains(&length) {
        return None;
    }
    notes.add(Note::Rotations, ((length - 1.0).abs() > tolerance).into());
    Some(rotation / length)
}

fn wrong(node: usize, field: &str, value: &str) -> GltfError {
    GltfError::Value {
        place: format!("nodes[{node}].{field}"),
        value: value.into(),
        expected: "a finite affine matrix, or scale, rotation and translation",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::check::check_document;
    use crate::gltf::document::parse_document;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    fn place(document: &Value) -> Result<Vec<Placed>, GltfError> {
        let document = parse_document(document.to_string().as_bytes())?;
        check_document(&document)?;
        place_nodes(&document, &mut Notes::default())
    }

    proptest! {
        /// Any forest is walked once, and each node stands where its chain of parents puts it.
        #[test]
        fn every_node_stands_where_its_parents_put_it(
            parents in prop::collection::vec(any::<prop::sample::Index>(), 1..20),
            moves in prop::collection::vec(prop::array::uniform3(-9i32..9), 20),
        ) {
            // Node 0 is a root; "parent i of i" makes another one.
            let parents: Vec<usize> = (0..).zip(&parents).map(|(i, p)| p.index(i + 1)).collect();
            let children = |of: usize| (0..parents.len()).filter(|&n| n != of && parents[n] == of).collect::<Vec<_>>();
            let nodes: Vec<Value> = (0..parents.len()).map(|n| json!({
                "children": children(n), "translation": moves[n], "scale": [2, 2, -2], "mesh": 0,
            })).collect();
            let placed = place(&json!({"asset": {"version": "2.0"}, "nodes": nodes, "meshes": [{}]})).unwrap();
            let mut seen: Vec<usize> = placed.iter().map(|p| p.node).collect();
            seen.sort_unstable();
            prop_assert_eq!(seen, (0..parents.len()).collect::<Vec<_>>());
            for p in placed {
                let (mut node, mut point) = (p.node, DVec3::new(0.5, 0.25, 3.0));
                loop {
                    let by = DVec3::from(moves[node].map(f64::from));
                    point = point * DVec3::new(2.0, 2.0, -2.0) + by;
                    if parents[node] == node { break }
                    node = parents[node];
                }
                // Powers of two and small whole numbers: both ways are exact.
                prop_assert_eq!(p.world_from_node.transform_point3(DVec3::new(0.5, 0.25, 3.0)), point);
            }
        }

        /// Where a node is given another parent, or becomes its own ancestor, the file is refused.
        #[test]
        fn what_is_no_forest_is_refused(count in 2..30usize, from in any::<prop::sample::Index>(), to in any::<prop::sample::Index>()) {
            // A chain with one more link: to an earlier node a cycle, to a later one a second parent.
            let (from, to) = (from.index(count), to.index(count));
            let nodes: Vec<Value> = (0..count).map(|n| {
                let mut children = if n + 1 < count { vec![n + 1] } else { vec![] };
                if n == from { children.push(to) }
                json!({"children": children})
            }).collect();
            let result = place(&json!({"asset": {"version": "2.0"}, "nodes": nodes}));
            prop_assert!(matches!(result, Err(GltfError::Nodes { .. })), "{:?}", result);
        }
    }

    #[test]
    fn a_chain_of_a_hundred_thousand_nodes_is_walked() {
        let nodes: Vec<Value> = (1..100_000)
            .map(|n| json!({"children": [n], "translation": [1, 0, 0]}))
            .chain([json!({"mesh": 0})])
            .collect();
        let document = json!({"asset": {"version": "2.0"}, "nodes": nodes, "meshes": [{}]});
        let placed = place(&document).unwrap();
        assert_eq!(placed[0].world_from_node.translation.x, 99_999.0);
    }

    #[test]
    fn transforms_are_exact_in_f64_and_checked() {
        let node = |node: Value| {
            let document = json!({"asset": {"version": "2.0"}, "nodes": [node], "meshes": [{}]});
            place(&document).map(|placed| placed[0].world_from_node)
        };
        // A national grid's coordinates in millimetres; f32 has steps of half a metre there.
        let placed = node(json!({"mesh": 0, "translation": [4_468_298.123, 0, 0]})).unwrap();
        assert_eq!(placed.translation.x, 4_468_298.123);
        let turned = node(json!({"mesh": 0, "rotation": [0, 3, 0, 3]})).unwrap();
        let x = turned.transform_vector3(DVec3::X);
        // A few operations on numbers near 1.
        assert!((x + DVec3::Z).length() < 8.0 * f64::EPSILON, "{x}");
        for bad in [
            json!({"rotation": [0, 0, 0, 0]}),
            json!({"matrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}),
            json!({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "scale": [1, 1, 1]}),
            json!({"scale": [1e308, 1, 1], "children": [0]}),
        ] {
            assert!(node(bad.clone()).is_err(), "{bad}");
        }
    }
}
