//! Reads PLY files: scans and other single meshes.

mod elements;

use crate::Imported;
use crate::assemble::{Attributes, Corner, NONE, push_object};
use crate::mesh_error::MeshFileError;
use crate::notes::{Note, Notes};
use crate::obj::{linear_from_srgb, plain};
use crate::polygons::{MOST_CORNERS, triangulate};
use elements::{Face, Skipped, Strip, Vertex};
use farfield_scene::Scene;
use glam::{DVec3, Vec3, Vec4};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Header, PropertyAccess, PropertyType, ScalarType};

/// The scene of a PLY file, text or binary: one object named `mesh`.
///
/// Source: G. Turk, The PLY Polygon File Format, 1994.
///
/// # Errors
///
/// When the file has no faces, or is damaged; the first thing found wrong is told with its line
/// or element.
pub fn read_ply(bytes: &[u8]) -> Result<Imported, MeshFileError> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new()
        .read_header(&mut reader)
        .map_err(|error| fault("the header", &error))?;
    check_header(&header, bytes.len())?;

    let mut notes = Notes::default();
    let is_texture = |comment: &&String| comment.starts_with("TextureFile");
    let textures = header.comments.iter().filter(is_texture);
    notes.add(Note::PlyTextures, textures.count());
    let mut attributes = Attributes::default();
    let mut triangles: Vec<[Corner; 3]> = Vec::new();
    // Vertices first: faces may come before them.
    let (mut faces, mut strips) = (Vec::new(), Vec::new());
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                let vertices: Vec<Vertex> = read(&mut reader, element, &header)?;
                attributes = attributes_from(vertices, element, &mut notes)?;
            }
            "face" => faces = read::<Face>(&mut reader, element, &header)?,
            "tristrips" => strips = read::<Strip>(&mut reader, element, &header)?,
            _ => drop(read::<Skipped>(&mut reader, element, &header)?),
        }
    }
    for (i, face) in faces.iter().enumerate() {
        push_face(face, i, &attributes, &mut triangles, &mut notes)?;
    }
    for (i, strip) in strips.iter().enumerate() {
        push_strips(strip, i, &attributes, &mut triangles)?;
    }

    let mut scene = Scene {
        materials: vec![plain("")],
        ..Scene::default()
    };
    let materials = vec![0; triangles.len()];
    push_object(
        &mut scene,
        "mesh".into(),
        &attributes,
        &triangles,
        &materials,
        &mut notes,
    );
    debug_assert_eq!(scene.check(), Ok(()));
    Ok(Imported {
        scene,
        warnings: notes.warnings(),
        files: Vec::new(),
    })
}

const EXPORT: &str = "the file was cut off or damaged, fetch or export it again";

/// What the parser says, in one line.
fn fault(place: &str, error: &ParseError) -> MeshFileError {
    let place = match error.line() {
        Some(line) => format!("line {line}"),
        None => place.into(),
    };
    let text = error.to_string();
    // The parser quotes whole lines first.
    let text = match text.rsplit_once("Error: ") {
        Some((quoted, _)) if quoted.contains("parse element line") => "is no line of numbers",
        Some((_, problem)) => problem,
        None => &text,
    };
    let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let problem: String = text.trim_end_matches('.').chars().take(120).collect();
    MeshFileError::new(place, problem, EXPORT)
}

/// Whether there are vertices and faces, with the properties that are read, and no more of anything
/// than the file has bytes.
fn check_header(header: &Header, size: usize) -> Result<(), MeshFileError> {
    let wrong = |problem: String, remedy| Err(MeshFileError::new("the header", problem, remedy));
    for element in header.elements.values() {
        let ElementDef {
            name,
            count,
            properties,
            ..
        } = element;
        // Each takes a byte at least, unless it is nothing at all.
        if *count > size || properties.is_empty() && *count > 0 {
            return wrong(
                format!("announces {count} of {name:?}, more than the file can hold"),
                EXPORT,
            );
        }
    }
    let count = |name: &str| header.elements.get(name).map_or(0, |element| element.count);
    let vertices = header.elements.get("vertex");
    for axis in ["x", "y", "z"] {
        let axis_is_there = vertices.is_some_and(|element| {
            let property = element.properties.get(axis);
            property.is_some_and(|p| matches!(p.data_type, PropertyType::Scalar(_)))
        });
        if !axis_is_there {
            let problem = format!("has no coordinate {axis:?} of vertices");
            return wrong(problem, "export a mesh");
        }
    }
    if count("face") == 0 && count("tristrips") == 0 {
        return wrong(
            format!(
                "has {} vertices but no faces: a point cloud",
                count("vertex")
            ),
            "reconstruct a mesh from it",
        );
    }
    Ok(())
}

fn read<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, MeshFileError> {
    Parser::<E>::new()
        .read_payload_for_element(reader, element, header)
        .map_err(|error| fault(&format!("element {:?}", element.name), &error))
}

/// Positions with what else the vertices have.
fn attributes_from(
    vertices: Vec<Vertex>,
    element: &ElementDef,
    notes: &mut Notes,
) -> Result<Attributes, MeshFileError> {
    let scale = |name: &str| {
        let property = element.properties.get(name);
        property.map(|property| match property.data_type {
            PropertyType::Scalar(ScalarType::UChar) => 1.0 / 255.0,
            PropertyType::Scalar(ScalarType::UShort) => 1.0 / 65535.0,
            _ => 1.0,
        })
    };
    let has = |names: &[&str]| {
        names
            .iter()
            .all(|name| element.properties.contains_key(*name))
    };
    let mut attributes = Attributes::default();
    for (i, vertex) in vertices.iter().enumerate() {
        let position = DVec3::from(vertex.position);
        if !position.as_vec3().is_finite() {
            return Err(MeshFileError::new(
                format!("vertex {i}"),
                "the position is not finite",
                "repair the mesh or remove the vertex",
            ));
        }
        attributes.positions.push(position);
    }
    if has(&["nx", "ny", "nz"]) {
        attributes.normals = vertices.iter().map(|v| Vec3::from(v.normal)).collect();
    }
    if let (Some(r), Some(g), Some(b)) = (scale("red"), scale("green"), scale("blue")) {
        let colors = vertices.iter().map(|v| {
            let [red, green, blue, alpha] = v.color;
            let opacity = scale("alpha").map_or(1.0, |a| alpha * a);
            let color = Vec4::new(red * r, green * g, blue * b, opacity);
            let clamped = color.map(|c| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) });
            notes.add(Note::Colors, (clamped != color).into());
            let [r, g, b] = [clamped.x, clamped.y, clamped.z].map(linear_from_srgb);
            Vec4::new(r, g, b, clamped.w)
        });
        attributes.colors = colors.collect();
    }
    Ok(attributes)
}

/// A vertex as a corner; what it has, it has at the same index.
fn corner(
    vertex: i64,
    attributes: &Attributes,
    place: &dyn Fn() -> String,
) -> Result<Corner, MeshFileError> {
    let count = attributes.positions.len();
    match u32::try_from(vertex) {
        Ok(vertex) if (vertex as usize) < count => {
            let has_normal = !attributes.normals.is_empty();
            Ok([vertex, NONE, if has_normal { vertex } else { NONE }])
        }
        _ => Err(MeshFileError::new(
            place(),
            format!("uses vertex {vertex}, the file has {count}"),
            "export the file again",
        )),
    }
}

fn push_face(
    face: &Face,
    number: usize,
    attributes: &Attributes,
    triangles: &mut Vec<[Corner; 3]>,
    notes: &mut Notes,
) -> Result<(), MeshFileError> {
    let place = || format!("face {number}");
    let corners: Vec<Corner> = face
        .vertices
        .iter()
        .map(|&vertex| corner(vertex, attributes, &place))
        .collect::<Result<_, _>>()?;
    if corners.len() < 3 {
        notes.add(Note::IncompleteFaces, 1);
        return Ok(());
    }
    if corners.len() > MOST_CORNERS {
        return Err(MeshFileError::new(
            place(),
            format!(
                "has {} corners, at most {MOST_CORNERS} are read",
                corners.len()
            ),
            "cut the polygon into smaller ones",
        ));
    }
    let positions = corners.iter().map(|c| attributes.positions[c[0] as usize]);
    let positions: Vec<DVec3> = positions.collect();
    let mut cut = Vec::new();
    triangulate(&positions, &mut cut);
    triangles.extend(cut.iter().map(|t| t.map(|i| corners[i as usize])));
    Ok(())
}

/// Strips that -1 separates; every other triangle is turned.
fn push_strips(
    strip: &Strip,
    number: usize,
    attributes: &Attributes,
    triangles: &mut Vec<[Corner; 3]>,
) -> Result<(), MeshFileError> {
    let place = || format!("tristrips {number}");
    for run in strip.vertices.split(|&vertex| vertex == -1) {
        let corners: Vec<Corner> = run
            .iter()
            .map(|&vertex| corner(vertex, attributes, &place))
            .collect::<Result<_, _>>()?;
        for (i, window) in corners.windows(3).enumerate() {
            let [a, b, c] = [window[0], window[1], window[2]];
            triangles.push(if i % 2 == 0 { [a, b, c] } else { [a, c, b] });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_scene::Material;
    use proptest::prelude::*;

    /// How numbers are stored.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Stored {
        Text,
        Little,
        Big,
    }

    const STORED: [Stored; 3] = [Stored::Text, Stored::Little, Stored::Big];

    /// The body of a file, number by number.
    struct Body {
        stored: Stored,
        bytes: Vec<u8>,
    }

    impl Body {
        fn push<const N: usize>(&mut self, text: String, little: [u8; N]) {
            match self.stored {
                Stored::Text => self.bytes.extend(format!("{text} ").bytes()),
                Stored::Little => self.bytes.extend(little),
                Stored::Big => self.bytes.extend(little.iter().rev()),
            }
        }

        fn end_element(&mut self) {
            if self.stored == Stored::Text {
                self.bytes.push(b'\n');
            }
        }
    }

    /// A file of vertices with normals and colours, something unknown, and polygons.
    fn file(
        stored: Stored,
        vertices: &[[f64; 3]],
        colors: &[[u8; 3]],
        faces: &[Vec<i32>],
    ) -> Vec<u8> {
        let format = ["ascii", "binary_little_endian", "binary_big_endian"][stored as usize];
        let header = format!(
            "ply\nformat {format} 1.0\ncomment of a test\nelement vertex {}\n\
            property double x\nproperty double y\nproperty double z\n\
            property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int id\n\
            element noise 1\nproperty list uchar float values\n\
            element face {}\nproperty list uchar int vertex_indices\nproperty uchar flags\nend_header\n",
            vertices.len(),
            faces.len(),
        );
        let mut body = Body {
            stored,
            bytes: header.into_bytes(),
        };
        for (vertex, color) in vertices.iter().zip(colors) {
            vertex
                .iter()
                .for_each(|c| body.push(c.to_string(), c.to_le_bytes()));
            color.iter().for_each(|c| body.push(c.to_string(), [*c]));
            body.push("7".into(), 7i32.to_le_bytes());
            body.end_element();
        }
        body.push("2".into(), [2]);
        for value in [0.5f32, 1.5] {
            body.push(value.to_string(), value.to_le_bytes());
        }
        body.end_element();
        for face in faces {
            body.push(face.len().to_string(), [face.len() as u8]);
            face.iter()
                .for_each(|v| body.push(v.to_string(), v.to_le_bytes()));
            body.push("1".into(), [1]);
            body.end_element();
        }
        body.bytes
    }

    fn read(bytes: &[u8]) -> Result<Imported, MeshFileError> {
        let imported = read_ply(bytes)?;
        imported.scene.check().unwrap();
        Ok(imported)
    }

    proptest! {
        /// Vertices, colours and triangles come out as they went in, in all three encodings.
        #[test]
        fn meshes_come_out_as_they_went_in(
            vertices in prop::collection::vec((prop::array::uniform3(-4i8..4), prop::array::uniform3(any::<u8>())), 3..12),
            faces in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..12),
            far in prop::sample::select(vec![0.0, 3e6]),
        ) {
            let (at, colors): (Vec<[i8; 3]>, Vec<[u8; 3]>) = vertices.into_iter().unzip();
            let positions: Vec<[f64; 3]> = at.iter().map(|p| p.map(|c| f64::from(c) * 0.125 + far)).collect();
            let faces: Vec<Vec<i32>> = faces.iter()
                .map(|f| f.iter().map(|i| i.index(positions.len()) as i32).collect()).collect();
            let mut expected: Vec<_> = faces.iter().filter_map(|face| {
                let corners: [DVec3; 3] = [0, 1, 2].map(|i| positions[face[i] as usize].into());
                let [a, b, c] = corners;
                ((b - a).cross(c - a) != DVec3::ZERO)
                    .then(|| corners.map(|c| c.to_array().map(f64::to_bits)))
            }).collect();
            expected.sort();
            for stored in STORED {
                let scene = read(&file(stored, &positions, &colors, &faces)).unwrap().scene;
                let mut drawn: Vec<_> = scene.triangles.iter()
                    .map(|t| t.map(|v| scene.world_position(0, v).to_array().map(f64::to_bits))).collect();
                drawn.sort();
                prop_assert_eq!(&drawn, &expected, "{:?}", stored);
                for (v, color) in scene.colors.iter().enumerate() {
                    let at = scene.world_position(0, v as u32);
                    let stored = (0..at.to_array().len()).find_map(|_| positions.iter().zip(&colors)
                        .filter(|(p, _)| DVec3::from(**p) == at)
                        .map(|(_, c)| c.map(|c| linear_from_srgb(f32::from(c) * (1.0 / 255.0))))
                        .find(|c| *c == [color.x, color.y, color.z]));
                    prop_assert!(stored.is_some(), "colour {} of vertex {}", color, v);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        /// A file with bytes changed or cut off is refused or read soundly.
        #[test]
        fn damaged_bytes_do_no_harm(
            stored in prop::sample::select(STORED.to_vec()),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
            length in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
            let mut bytes = file(stored, &vertices, &[[255; 3]; 4], &[vec![0, 1, 2, 3], vec![2, 1, 0]]);
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            if let Some(length) = length {
                bytes.truncate(length.index(bytes.len()));
            }
            if let Err(error) = read(&bytes) {
                prop_assert!(!error.to_string().contains('\n'), "{}", error);
            }
        }
    }

    #[test]
    fn faults_are_told_with_their_places() {
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let of = |positions: &[[f64; 3]], faces: &[Vec<i32>]| {
            read(&file(Stored::Big, positions, &[[0; 3]; 3], faces))
                .unwrap_err()
                .to_string()
        };
        let text = String::from_utf8(file(
            Stored::Text,
            &vertices,
            &[[0; 3]; 3],
            &[vec![0, 1, 2]],
        ))
        .unwrap();
        let changed = |from: &str, to: &str| {
            let changed = text.replacen(from, to, 1);
            assert_ne!(changed, text);
            read(changed.as_bytes()).unwrap_err().to_string()
        };
        for (message, expected) in [
            (
                of(&vertices, &[]),
                "the header: has 3 vertices but no faces: a point cloud; reconstruct",
            ),
            (
                of(&vertices, &[vec![0, 1, 3]]),
                "face 0: uses vertex 3, the file has 3",
            ),
            (
                of(&vertices, &[vec![0, 1, 2], vec![-1, 1, 2]]),
                "face 1: uses vertex -1",
            ),
            (
                of(&[[f64::NAN; 3]; 3], &[vec![0, 1, 2]]),
                "vertex 0: the position is not finite",
            ),
            (
                of(&[[1e300; 3]; 3], &[vec![0, 1, 2]]),
                "vertex 0: the position is not finite",
            ),
            (
                changed("double x", "double w"),
                "the header: has no coordinate \"x\"",
            ),
            (
                changed("face 1", "face 1000000000000"),
                "the header: announces 1000000000000 of \"face\"",
            ),
            (
                changed("property list uchar float values\n", ""),
                "the header: announces 1 of \"noise\"",
            ),
            (changed("3 0 1 2", "3 0 1 x"), "line 22: "),
            (changed("3 0 1 2", "9 0 1 2"), "line 22: "),
            (changed("\n3 0 1 2 1", ""), "line 22: "),
            (changed("element", "elephant"), "line 4: "),
        ] {
            assert!(
                message.starts_with(expected),
                "{message}, expected {expected}"
            );
            assert!(!message.contains('\n'), "{message}");
        }
    }

    /// The Stanford repository's strips, and what MeshLab writes in comments.
    #[test]
    fn strips_and_comments_are_understood() {
        let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty float x\n\
            property float y\nproperty float z\nelement tristrips 1\nproperty list int int vertex_indices\n\
            end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 2 3\n";
        let imported = read(text.as_bytes()).unwrap();
        let scene = imported.scene;
        assert_eq!(scene.triangles, [[0, 1, 2], [1, 3, 2], [0, 2, 3]]);
        assert_eq!(
            scene.materials[0],
            Material {
                metallic: 0.0,
                double_sided: true,
                ..Material::default()
            }
        );
        assert_eq!(
            imported.warnings,
            ["textures named in comments, left out: 1"]
        );
    }
}
