//! The pass over the document before anything is read: whether all of it fits together.
//!
//! Afterwards every index exists, every accessor lies in its view and every view in its buffer,
//! attributes have the types they must have, and the nodes are a forest. What is left for the
//! readers are the bytes themselves: vertex indices, positions, images.

use super::GltfError;
use super::accessors::{Component, layout};
use super::document::{
    BufferView, Document, Instancing, Material, MeshoptCompression, Primitive, TextureInfo,
};

/// Extensions that are read, so that a file may require them.
pub(crate) const EXTENSIONS: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// The longest accessor without a buffer view, whose count nothing else bounds. All its elements
/// are zero but the sparse ones; real ones hold a few thousand.
const LONGEST_WITHOUT_VIEW: u64 = 1 << 24;

/// Checks version, extensions, indices, bounds, types and nodes.
///
/// # Errors
///
/// The first thing found wrong.
pub(crate) fn check_document(document: &Document) -> Result<(), GltfError> {
    check_version(document)?;
    check_extensions(document)?;
    check_views(document)?;
    check_accessors(document)?;
    check_looks(document)?;
    check_meshes(document)?;
    check_nodes(document)
}

fn check_version(document: &Document) -> Result<(), GltfError> {
    let asset = &document.asset;
    let supported = match &asset.min_version {
        Some(version) => version == "2.0",
        None => asset.version.split('.').next() == Some("2"),
    };
    match (supported, &asset.min_version) {
        (true, _) => Ok(()),
        (false, Some(version)) => Err(GltfError::Version {
            place: "asset.minVersion",
            version: version.clone(),
        }),
        (false, None) => Err(GltfError::Version {
            place: "asset.version",
            version: asset.version.clone(),
        }),
    }
}

fn check_extensions(document: &Document) -> Result<(), GltfError> {
    let names: Vec<String> = document
        .extensions_required
        .iter()
        .filter(|name| !EXTENSIONS.contains(&name.as_str()))
        .cloned()
        .collect();
    match names.is_empty() {
        true => Ok(()),
        false => Err(GltfError::Extensions { names }),
    }
}

fn check_views(document: &Document) -> Result<(), GltfError> {
    for (i, view) in document.buffer_views.iter().enumerate() {
        let place = || format!("bufferViews[{i}]");
        exists(view.buffer, &document.buffers, "buffers", place, "buffer")?;
        let has = document.buffers[view.buffer].byte_length;
        let container = || format!("buffers[{}]", view.buffer);
        let end = view.byte_offset.checked_add(view.byte_length);
        inside(end, has, place, container)?;
        if let Some(compressed) = &view.extensions.meshopt {
            check_compressed(document, view, compressed, &|| {
                format!("bufferViews[{i}].extensions.EXT_meshopt_compression")
            })?;
        }
    }
    Ok(())
}

/// Whether a compressed buffer view is one that the extension allows and becomes what it stands
/// for.
fn check_compressed(
    document: &Document,
    view: &BufferView,
    compressed: &MeshoptCompression,
    place: &dyn Fn() -> String,
) -> Result<(), GltfError> {
    let buffers = &document.buffers;
    exists(compressed.buffer, buffers, "buffers", place, "buffer")?;
    let has = buffers[compressed.buffer].byte_length;
    let end = compressed.byte_offset.checked_add(compressed.byte_length);
    inside(end, has, place, || {
        format!("buffers[{}]", compressed.buffer)
    })?;
    let wrong = |field: &str, value: String, expected| {
        let place = format!("{}.{field}", place());
        Err(GltfError::Value {
            place,
            value,
            expected,
        })
    };
    let MeshoptCompression {
        byte_stride,
        count,
        mode,
        filter,
        ..
    } = compressed;
    let (stride_fits, expected) = match mode.as_str() {
        "ATTRIBUTES" => (
            (4..=256).contains(byte_stride) && byte_stride % 4 == 0,
            "a multiple of 4 up to 256",
        ),
        "TRIANGLES" | "INDICES" => (matches!(byte_stride, 2 | 4), "2 or 4"),
        _ => {
            let expected = "ATTRIBUTES, TRIANGLES or INDICES";
            return wrong("mode", format!("{mode:?}"), expected);
        }
    };
    if !stride_fits {
        return wrong("byteStride", byte_stride.to_string(), expected);
    }
    let filter_fits = match filter.as_deref().unwrap_or("NONE") {
        "NONE" => true,
        "OCTAHEDRAL" => mode == "ATTRIBUTES" && matches!(byte_stride, 4 | 8),
        "QUATERNION" => mode == "ATTRIBUTES" && *byte_stride == 8,
        "EXPONENTIAL" => mode == "ATTRIBUTES",
        _ => false,
    };
    if !filter_fits {
        let value = format!("{filter:?} of {mode} of {byte_stride} bytes");
        let expected = "NONE, or OCTAHEDRAL, QUATERNION or EXPONENTIAL of attributes that fit";
        return wrong("filter", value, expected);
    }
    if mode == "TRIANGLES" && count % 3 > 0 {
        return wrong("count", count.to_string(), "three for each triangle");
    }
    if count.checked_mul(*byte_stride) != Some(view.byte_length) {
        let value = format!("{count} elements of {byte_stride} bytes");
        return wrong("count", value, "as many bytes as the buffer view has");
    }
    Ok(())
}

fn check_accessors(document: &Document) -> Result<(), GltfError> {
    for (i, accessor) in document.accessors.iter().enumerate() {
        let place = || format!("accessors[{i}]");
        let size = layout(accessor, i)?.size;
        if let Some(view) = accessor.buffer_view {
            let at = (view, accessor.byte_offset);
            check_run(document, at, size, accessor.count, &place)?;
        } else if accessor.count > LONGEST_WITHOUT_VIEW {
            return Err(GltfError::Value {
                place: format!("accessors[{i}].count"),
                value: accessor.count.to_string(),
                expected: "at most 16777216 where there is no bufferView; export the file again",
            });
        }
        let Some(sparse) = &accessor.sparse else {
            continue;
        };
        let code = sparse.indices.component_type;
        let component = Component::from_code(code).filter(|&c| is_index(c));
        let component = component.ok_or_else(|| GltfError::Value {
            place: format!("accessors[{i}].sparse.indices.componentType"),
            value: code.to_string(),
            expected: "5121, 5123 or 5125",
        })?;
        let at = (sparse.indices.buffer_view, sparse.indices.byte_offset);
        let place = || format!("accessors[{i}].sparse.indices");
        check_run(document, at, component.size(), sparse.count, &place)?;
        let at = (sparse.values.buffer_view, sparse.values.byte_offset);
        let place = || format!("accessors[{i}].sparse.values");
        check_run(document, at, size, sparse.count, &place)?;
    }
    Ok(())
}

fn is_index(component: Component) -> bool {
    use Component::{U8, U16, U32};
    matches!(component, U8 | U16 | U32)
}

/// Whether `count` elements of `size` bytes from an offset on lie in a buffer view.
fn check_run(
    document: &Document,
    (view, offset): (usize, u64),
    size: u64,
    count: u64,
    place: &dyn Fn() -> String,
) -> Result<(), GltfError> {
    let views = &document.buffer_views;
    exists(view, views, "bufferViews", place, "bufferView")?;
    let stride = views[view].byte_stride.unwrap_or(size);
    if stride < size {
        return Err(GltfError::Value {
            place: format!("bufferViews[{view}].byteStride"),
            value: format!("{stride} is less than the {size} bytes of {}", place()),
            expected: "at least the size of an element",
        });
    }
    let Some(steps) = count.checked_sub(1) else {
        return Ok(());
    };
    let end = stride
        .checked_mul(steps)
        .and_then(|bytes| bytes.checked_add(size))
        .and_then(|bytes| bytes.checked_add(offset));
    inside(end, views[view].byte_length, place, || {
        format!("bufferViews[{view}]")
    })
}

/// Textures, images and materials.
fn check_looks(document: &Document) -> Result<(), GltfError> {
    for (i, image) in document.images.iter().enumerate() {
        if let Some(view) = image.buffer_view {
            let place = || format!("images[{i}]");
            let views = &document.buffer_views;
            exists(view, views, "bufferViews", place, "bufferView")?;
        }
    }
    for (i, texture) in document.textures.iter().enumerate() {
        let place = || format!("textures[{i}]");
        if let Some(sampler) = texture.sampler {
            exists(sampler, &document.samplers, "samplers", place, "sampler")?;
        }
        let images = &document.images;
        if let Some(source) = texture.source {
            exists(source, images, "images", place, "source")?;
        }
        for (name, extension) in [
            ("EXT_texture_webp", &texture.extensions.webp),
            ("KHR_texture_basisu", &texture.extensions.basisu),
        ] {
            if let Some(source) = extension.as_ref().and_then(|e| e.source) {
                let place = || format!("textures[{i}].extensions.{name}");
                exists(source, images, "images", place, "source")?;
            }
        }
    }
    for (i, material) in document.materials.iter().enumerate() {
        for (name, info) in texture_infos(material) {
            let place = || format!("materials[{i}].{name}");
            exists(info.index, &document.textures, "textures", place, "index")?;
        }
    }
    Ok(())
}

/// The uses of textures that are read.
fn texture_infos(material: &Material) -> impl Iterator<Item = (&'static str, &TextureInfo)> {
    let pbr = &material.pbr_metallic_roughness;
    let specular = material.extensions.specular_glossiness.as_ref();
    [
        (
            "extensions.KHR_materials_pbrSpecularGlossiness.diffuseTexture",
            specular.and_then(|s| s.diffuse_texture.as_ref()),
        ),
        (
            "pbrMetallicRoughness.baseColorTexture",
            pbr.base_color_texture.as_ref(),
        ),
        (
            "pbrMetallicRoughness.metallicRoughnessTexture",
            pbr.metallic_roughness_texture.as_ref(),
        ),
        ("normalTexture", material.normal_texture.as_ref()),
        ("emissiveTexture", material.emissive_texture.as_ref()),
    ]
    .into_iter()
    .filter_map(|(name, info)| Some((name, info?)))
}

fn check_meshes(document: &Document) -> Result<(), GltfError> {
    for (i, mesh) in document.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            check_primitive(document, primitive, &|| {
                format!("meshes[{i}].primitives[{j}]")
            })?;
        }
    }
    Ok(())
}

fn check_primitive(
    document: &Document,
    primitive: &Primitive,
    place: &dyn Fn() -> String,
) -> Result<(), GltfError> {
    use Component::{F32, I8, I16, U8, U16};
    let wrong = |field: &str, value: String, expected| {
        let place = format!("{}.{field}", place());
        Err(GltfError::Value {
            place,
            value,
            expected,
        })
    };
    let describe = |accessor: usize| {
        let accessor = &document.accessors[accessor];
        let normalized = if accessor.normalized {
            ", normalized"
        } else {
            ""
        };
        let (code, shape) = (accessor.component_type, &accessor.shape);
        format!("is {shape} of component type {code}{normalized}")
    };
    if primitive.mode > 6 {
        return wrong("mode", primitive.mode.to_string(), "0 to 6");
    }
    if let Some(material) = primitive.material {
        let materials = &document.materials;
        exists(material, materials, "materials", place, "material")?;
    }
    let accessors = &document.accessors;
    let vertices = primitive
        .attributes
        .get("POSITION")
        .and_then(|&accessor| accessors.get(accessor))
        .map(|accessor| accessor.count);
    for (name, &index) in &primitive.attributes {
        let field = format!("attributes.{name}");
        exists(index, accessors, "accessors", place, &field)?;
        let accessor = &accessors[index];
        let component = layout(accessor, index)?.component;
        let (shape, normalized) = (accessor.shape.as_str(), accessor.normalized);
        // With the types that KHR_mesh_quantization adds: they cannot be mistaken for others.
        let (sound, expected) = match name.as_str() {
            "POSITION" => (
                shape == "VEC3" && matches!(component, F32 | I8 | U8 | I16 | U16),
                "VEC3 of floats (5126), or of bytes or shorts",
            ),
            "NORMAL" => (
                shape == "VEC3"
                    && (component == F32 || matches!(component, I8 | I16) && normalized),
                "VEC3 of floats (5126), or of normalized bytes or shorts",
            ),
            "COLOR_0" => (
                matches!(shape, "VEC3" | "VEC4")
                    && (component == F32 || matches!(component, U8 | U16) && normalized),
                "VEC3 or VEC4 of floats (5126), or of normalized unsigned bytes or shorts",
            ),
            _ if name.starts_with("TEXCOORD_") => (
                shape == "VEC2" && matches!(component, F32 | I8 | U8 | I16 | U16),
                "VEC2 of floats (5126), or of bytes or shorts",
            ),
            _ => continue,
        };
        if !sound {
            return wrong(&field, describe(index), expected);
        }
        if vertices.is_some_and(|vertices| vertices != accessor.count) {
            let value = format!("has {} elements", accessor.count);
            return wrong(&field, value, "as many as attributes.POSITION has");
        }
    }
    if let Some(index) = primitive.indices {
        exists(index, accessors, "accessors", place, "indices")?;
        let accessor = &accessors[index];
        let sound = is_index(layout(accessor, index)?.component)
            && accessor.shape == "SCALAR"
            && !accessor.normalized;
        if !sound {
            let expected = "SCALAR of unsigned bytes, shorts or ints (5121, 5123, 5125)";
            return wrong("indices", describe(index), expected);
        }
    }
    if let Some(draco) = &primitive.extensions.draco {
        let views = &document.buffer_views;
        let field = "extensions.KHR_draco_mesh_compression.bufferView";
        exists(draco.buffer_view, views, "bufferViews", place, field)?;
        if !matches!(primitive.mode, 4 | 5) {
            let expected = "4 or 5 with KHR_draco_mesh_compression";
            return wrong("mode", primitive.mode.to_string(), expected);
        }
    }
    Ok(())
}

/// Whether the attributes of a node's instances have types that are read, and equally many
/// elements.
fn check_instances(
    document: &Document,
    instancing: &Instancing,
    place: &dyn Fn() -> String,
) -> Result<(), GltfError> {
    use Component::{F32, I8, I16};
    let mut count = None;
    for (name, &index) in &instancing.attributes {
        exists(index, &document.accessors, "accessors", place, name)?;
        let accessor = &document.accessors[index];
        let component = layout(accessor, index)?.component;
        let wrong = |value: String, expected| {
            let place = format!("{}.{name}", place());
            Err(GltfError::Value {
                place,
                value,
                expected,
            })
        };
        let (shape, normalized) = (accessor.shape.as_str(), accessor.normalized);
        let (sound, expected) = match name.as_str() {
            "TRANSLATION" | "SCALE" => {
                (shape == "VEC3" && component == F32, "VEC3 of floats (5126)")
            }
            "ROTATION" => (
                shape == "VEC4"
                    && (component == F32 || matches!(component, I8 | I16) && normalized),
                "VEC4 of floats (5126), or of normalized bytes or shorts",
            ),
            _ => (true, ""),
        };
        if !sound {
            let code = accessor.component_type;
            return wrong(format!("is {shape} of component type {code}"), expected);
        }
        if *count.get_or_insert(accessor.count) != accessor.count {
            let value = format!("has {} elements", accessor.count);
            return wrong(value, "as many as the other attributes have");
        }
    }
    Ok(())
}

/// Nodes have one parent each and are not their own ancestors; scenes list roots.
fn check_nodes(document: &Document) -> Result<(), GltfError> {
    let nodes = &document.nodes;
    let mut has_parent = vec![false; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        if let Some(mesh) = node.mesh {
            let place = || format!("nodes[{i}]");
            exists(mesh, &document.meshes, "meshes", place, "mesh")?;
        }
        if let Some(instancing) = &node.extensions.gpu_instancing {
            check_instances(document, instancing, &|| {
                format!("nodes[{i}].extensions.EXT_mesh_gpu_instancing.attributes")
            })?;
        }
        for (k, &child) in node.children.iter().enumerate() {
            let place = || format!("nodes[{i}].children[{k}]");
            exists(child, nodes, "nodes", place, "")?;
            if std::mem::replace(&mut has_parent[child], true) {
                return Err(GltfError::Nodes {
                    place: place(),
                    node: child,
                    problem: "has another parent already",
                });
            }
        }
    }
    // With one parent each, what cannot be reached from a root hangs on a cycle.
    let mut reached: Vec<bool> = has_parent.iter().map(|has| !has).collect();
    let mut open: Vec<usize> = (0..nodes.len()).filter(|&node| reached[node]).collect();
    while let Some(node) = open.pop() {
        for &child in &nodes[node].children {
            reached[child] = true;
            open.push(child);
        }
    }
    if let Some(node) = reached.iter().position(|reached| !reached) {
        return Err(GltfError::Nodes {
            place: format!("nodes[{node}]"),
            node,
            problem: "is its own ancestor, or has such an ancestor",
        });
    }

    if let Some(scene) = document.scene {
        exists(scene, &document.scenes, "scenes", String::new, "scene")?;
    }
    let mut listed_in = vec![None; nodes.len()];
    for (i, scene) in document.scenes.iter().enumerate() {
        for (k, &node) in scene.nodes.iter().enumerate() {
            let place = || format!("scenes[{i}].nodes[{k}]");
            exists(node, nodes, "nodes", place, "")?;
            let twice = listed_in[node].replace(i) == Some(i);
            if twice || has_parent[node] {
                return Err(GltfError::Nodes {
                    place: place(),
                    node,
                    problem: match twice {
                        true => "is listed twice",
                        false => "is another node's child, scenes list roots only",
                    },
                });
            }
        }
    }
    Ok(())
}

fn exists<T>(
    index: usize,
    all: &[T],
    array: &'static str,
    place: impl Fn() -> String,
    field: &str,
) -> Result<(), GltfError> {
    if index < all.len() {
        return Ok(());
    }
    let place = place();
    let dot = if place.is_empty() || field.is_empty() {
        ""
    } else {
        "."
    };
    Err(GltfError::Reference {
        place: format!("{place}{dot}{field}"),
        index,
        array,
        count: all.len(),
    })
}

fn inside(
    end: Option<u64>,
    has: u64,
    place: impl Fn() -> String,
    container: impl Fn() -> String,
) -> Result<(), GltfError> {
    let needs = end.unwrap_or(u64::MAX);
    match needs <= has {
        true => Ok(()),
        false => Err(GltfError::OutOfBounds {
            place: place(),
            needs,
            container: container(),
            has,
        }),
    }
}
