//! Reads Wavefront OBJ files with their material libraries.

mod lines;
mod materials;
mod mtl;

use crate::assemble::{Attributes, Corner, NONE, push_object};
use crate::mesh_error::{MeshFileError, quoted};
use crate::notes::{Note, Notes};
use crate::polygons::{MOST_CORNERS, triangulate};
use crate::{Imported, Load};
use farfield_scene::Scene;
use glam::{DVec3, Vec2, Vec3, Vec4};
use lines::{EXPORT, Line, lines};
use std::collections::HashMap;

pub(crate) use materials::plain;

/// The scene of a Wavefront OBJ file.
///
/// * `bytes` - the file
/// * `load` - fetches material libraries and textures that stand beside the file; never asked for
///   an absolute path, but possibly for one that begins with `..`
///
/// # Errors
///
/// When the file has no faces, or is damaged; the first thing found wrong is told with its line.
pub fn read_obj(bytes: &[u8], load: &mut Load<'_>) -> Result<Imported, MeshFileError> {
    let mut notes = Notes::default();
    let file = parse(bytes, &mut notes)?;
    if file.faces.is_empty() {
        return Err(MeshFileError::new(
            "the file",
            "has no faces, only points, lines or nothing at all",
            "export a mesh with faces",
        ));
    }
    check_faces(&file)?;

    let mut scene = Scene::default();
    let used: Vec<&str> = file.materials.iter().map(String::as_str).collect();
    let beside = materials::read_materials(
        &file.libraries,
        &used,
        bytes.len() as u64,
        load,
        &mut scene,
        &mut notes,
    )?;
    for faces in file.faces.chunk_by(|a, b| a.object == b.object) {
        let mut triangles: Vec<[Corner; 3]> = Vec::new();
        let mut materials = Vec::new();
        for face in faces {
            cut(&file, face, &mut triangles);
            materials.resize(triangles.len(), face.material);
        }
        let name = file.objects[faces[0].object as usize].clone();
        let attributes = &file.attributes;
        push_object(
            &mut scene, name, attributes, &triangles, &materials, &mut notes,
        );
    }
    let mut warnings = beside.warnings;
    warnings.extend(notes.warnings());
    debug_assert_eq!(scene.check(), Ok(()));
    Ok(Imported {
        scene,
        warnings,
        files: beside.files,
    })
}

/// An OBJ file as plain data.
#[derive(Debug, Default)]
struct File {
    attributes: Attributes,
    corners: Vec<Corner>,
    /// At least three corners each, by object.
    faces: Vec<Face>,
    /// Names, each once, in the order of their first faces.
    objects: Vec<String>,
    /// Names, each once; the empty one stands for no material.
    materials: Vec<String>,
    /// Names and the lines that mention them.
    libraries: Vec<(String, usize)>,
}

#[derive(Clone, Copy, Debug)]
struct Face {
    line: u32,
    /// The first corner, and how many there are.
    first: u32,
    count: u32,
    object: u32,
    material: u32,
}

/// Names, numbered in the order in which they came.
#[derive(Default)]
struct Names {
    names: Vec<String>,
    numbers: HashMap<String, u32>,
}

impl Names {
    fn number(&mut self, name: &str) -> u32 {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.names.len() as u32;
        self.names.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        number
    }
}

fn parse(bytes: &[u8], notes: &mut Notes) -> Result<File, MeshFileError> {
    let mut file = File::default();
    let (mut objects, mut materials) = (Names::default(), Names::default());
    let (mut object, mut group, mut material) = (String::new(), String::new(), String::new());
    for line in lines(bytes) {
        match line.keyword() {
            b"v" => push_vertex(&mut file.attributes, &line)?,
            b"vt" => {
                let [u, v] = line.numbers([None, Some(0.0)])?;
                // Rows of a texture run upwards here.
                let uv = Vec2::new(u as f32, (1.0 - v) as f32);
                notes.add(Note::Uvs, (!uv.is_finite()).into());
                let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
                file.attributes.uvs.push(uv);
            }
            b"vn" => {
                let normal = line.numbers([None; 3])?.map(|n| n as f32);
                file.attributes.normals.push(Vec3::from(normal));
            }
            b"f" | b"fo" => {
                let first = file.corners.len();
                for corner in line.arguments() {
                    let corner = parse_corner(corner, &file.attributes, &line)?;
                    file.corners.push(corner);
                }
                let count = file.corners.len() - first;
                if count < 3 {
                    notes.add(Note::IncompleteFaces, 1);
                    file.corners.truncate(first);
                    continue;
                }
                if count > MOST_CORNERS {
                    return Err(line.wrong(
                        format!("has {count} corners, at most {MOST_CORNERS} are read"),
                        "cut the polygon into smaller ones",
                    ));
                }
                file.faces.push(Face {
                    line: line.number as u32,
                    first: first as u32,
                    count: count as u32,
                    object: objects.number(&object_name(&object, &group)),
                    material: materials.number(&material),
                });
            }
            b"o" => object = line.name(),
            b"g" => group = line.name(),
            b"usemtl" => material = line.name(),
            b"mtllib" => file.libraries.push((line.name(), line.number)),
            b"p" | b"l" => notes.add(Note::PointsOrLines, 1),
            b"curv" | b"curv2" | b"surf" => notes.add(Note::FreeForm, 1),
            // Smoothing, display and whatever programs add for themselves.
            _ => {}
        }
    }
    file.faces.sort_by_key(|face| face.object);
    file.objects = objects.names;
    file.materials = materials.names;
    Ok(file)
}

/// What a face belongs to, by the names of its object and its group.
fn object_name(object: &str, group: &str) -> String {
    match (object, group) {
        ("", "") => "unnamed".into(),
        (name, "") | ("", name) => name.into(),
        (object, "default") => object.into(),
        (object, group) if object == group => object.into(),
        (object, group) => format!("{object}/{group}"),
    }
}

/// A position, perhaps with a weight, which only curves use, or a colour.
fn push_vertex(attributes: &mut Attributes, line: &Line<'_>) -> Result<(), MeshFileError> {
    let position = DVec3::from(line.numbers([None; 3])?);
    if !position.as_vec3().is_finite() {
        return Err(line.wrong(
            "the position is not finite",
            "repair the mesh or remove the vertex",
        ));
    }
    attributes.positions.push(position);
    let extra = line.arguments().count() - 3;
    if extra >= 3 {
        let mut color = Vec4::ONE;
        for (channel, word) in line.arguments().skip(3).take(3).enumerate() {
            color[channel] = linear_from_srgb(line.number_from(word)? as f32);
        }
        // Vertices before the first colour are white.
        attributes
            .colors
            .resize(attributes.positions.len() - 1, Vec4::ONE);
        attributes.colors.push(color);
    }
    Ok(())
}

/// The intensity that a display shows for a value in [0, 1]; others are clamped, what is no number
/// is 1.
///
/// Source: IEC 61966-2-1.
pub(crate) fn linear_from_srgb(value: f32) -> f32 {
    match value {
        _ if value.is_nan() => 1.0,
        ..=0.04045 => value.max(0.0) / 12.92,
        _ => ((value.min(1.0) + 0.055) / 1.055).powf(2.4),
    }
}

/// Indices of a corner such as `7`, `7/3`, `7//-1` or `7/3/2`, counted from 0.
fn parse_corner(
    word: &[u8],
    attributes: &Attributes,
    line: &Line<'_>,
) -> Result<Corner, MeshFileError> {
    let wrong = || line.wrong(format!("{} is no corner of a face", quoted(word)), EXPORT);
    let counts = [
        attributes.positions.len(),
        attributes.uvs.len(),
        attributes.normals.len(),
    ];
    let mut corner = [NONE; 3];
    for (i, part) in word.split(|&byte| byte == b'/').enumerate() {
        let count = *counts.get(i).ok_or_else(wrong)?;
        if part.is_empty() && i > 0 {
            continue;
        }
        let text = std::str::from_utf8(part).map_err(|_| wrong())?;
        let index: i64 = text.parse().map_err(|_| wrong())?;
        // Negative ones count from the last so far.
        let index = match index {
            1.. => index - 1,
            _ => count as i64 + index,
        };
        corner[i] = match u32::try_from(index) {
            Ok(index) if text != "0" && index != NONE => index,
            _ => return Err(wrong()),
        };
    }
    Ok(corner)
}

/// Whether all that faces refer to exists, also what comes after them in the file.
fn check_faces(file: &File) -> Result<(), MeshFileError> {
    let attributes = &file.attributes;
    let counts = [
        ("vertex", "vertices", attributes.positions.len()),
        (
            "texture coordinate",
            "texture coordinates",
            attributes.uvs.len(),
        ),
        ("normal", "normals", attributes.normals.len()),
    ];
    for face in &file.faces {
        for corner in corners_of(file, face) {
            for (i, (one, many, count)) in counts.iter().enumerate() {
                if corner[i] as usize >= *count && (i == 0 || corner[i] != NONE) {
                    let index = u64::from(corner[i]) + 1;
                    return Err(MeshFileError::new(
                        format!("line {}", face.line),
                        format!("uses {one} {index}, the file has {count} {many}"),
                        EXPORT,
                    ));
                }
            }
        }
    }
    Ok(())
}

fn corners_of<'a>(file: &'a File, face: &Face) -> &'a [Corner] {
    &file.corners[face.first as usize..][..face.count as usize]
}

/// Cuts a face into triangles.
fn cut(file: &File, face: &Face, triangles: &mut Vec<[Corner; 3]>) {
    let corners = corners_of(file, face);
    let positions: Vec<DVec3> = corners
        .iter()
        .map(|corner| file.attributes.positions[corner[0] as usize])
        .collect();
    let mut cut = Vec::new();
    triangulate(&positions, &mut cut);
    triangles.extend(cut.iter().map(|t| t.map(|i| corners[i as usize])));
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_scene::{AlphaMode, Wrap};
    use glam::DQuat;
    use image::{ImageFormat, Rgba, RgbaImage};
    use proptest::prelude::*;
    use std::io;

    /// Reads a file with some beside it, and checks what comes out.
    fn read_with(text: &[u8], beside: &[(&str, Vec<u8>)]) -> Result<Imported, MeshFileError> {
        let mut load = |path: &str| {
            let found = beside.iter().find(|(name, _)| *name == path);
            found
                .map(|(_, bytes)| bytes.clone())
                .ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
        };
        let imported = read_obj(text, &mut load)?;
        imported.scene.check().unwrap();
        Ok(imported)
    }

    fn read(text: &str) -> Result<Imported, MeshFileError> {
        read_with(text.as_bytes(), &[])
    }

    fn png(size: [u32; 2], texel: [u8; 4]) -> Vec<u8> {
        let picture = RgbaImage::from_pixel(size[0], size[1], Rgba(texel));
        let mut bytes = io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    /// Names of objects and how many triangles each has.
    fn objects(scene: &Scene) -> Vec<(&str, u32)> {
        let meshes = scene
            .objects
            .iter()
            .map(|o| (o, &scene.meshes[o.mesh as usize]));
        meshes
            .map(|(o, mesh)| (o.name.as_str(), mesh.triangles.len() as u32))
            .collect()
    }

    const HOUSE: &str = "mtllib house.mtl\n\
        v 0 0 0\nv 2 0 0 # right\nv 2 2 0\nv 0 2 0\nv 1 1 1\n\
        vt 0 0\nvt 1 0.25\nvt 1 1\nvn 0 0 2\n\
        o wall\nusemtl brick\nf 1/1/1 2/2/1 3/3/1 4/1/1\n\
        g gable\nusemtl leaf\nf -5 -4 -1\n\
        o roof\ng\nusemtl nothing\nf 3//1 4//1 5//1\nl 1 2\np 1\nf 1 2\n";

    const LIBRARY: &str = "newmtl brick\nKd 0 0 0\nmap_Kd wall pictures\\brick.png\nPr 0.5\n\
        newmtl leaf\nKd 0 1 0\nKe 0.5 0 0\nmap_d -clamp on leaf.png\nd 1\n\
        newmtl glass\nd 0.5\n";

    fn house() -> Vec<(&'static str, Vec<u8>)> {
        vec![
            ("house.mtl", LIBRARY.into()),
            ("wall pictures/brick.png", png([2, 2], [200, 100, 50, 0])),
            ("leaf.png", png([4, 1], [64, 128, 32, 255])),
        ]
    }

    #[test]
    fn a_file_with_everything_reads_as_it_was_meant() {
        let imported = read_with(HOUSE.as_bytes(), &house()).unwrap();
        let scene = imported.scene;
        assert_eq!(
            objects(&scene),
            [("wall", 2), ("wall/gable", 1), ("roof", 1)]
        );
        assert_eq!(
            imported.files,
            ["house.mtl", "wall pictures/brick.png", "leaf.png"]
        );
        assert_eq!(
            imported.warnings,
            [
                "faces of fewer than three corners, dropped: 1",
                "primitives of points or lines, dropped: 2",
                "materials that no library has, replaced by white ones: 1"
            ]
        );
        assert_eq!(scene.normals[0], Vec3::Z);
        // Upside down in the file.
        let uvs: Vec<Vec2> = scene.triangles[0]
            .iter()
            .map(|&v| scene.uvs[v as usize])
            .collect();
        assert_eq!(
            uvs,
            [
                Vec2::new(0.0, 1.0),
                Vec2::new(1.0, 0.75),
                Vec2::new(1.0, 0.0)
            ]
        );

        let material =
            |triangle: usize| &scene.materials[scene.triangle_materials[triangle] as usize];
        let image = |texture: Option<u32>| {
            let texture = &scene.textures[texture.unwrap() as usize];
            (&scene.images[texture.image as usize], texture.wrap[0])
        };
        // The picture counts where the colour is black, and its alpha means nothing.
        assert_eq!(material(0).base_color, Vec4::ONE);
        assert_eq!((material(0).roughness, material(0).metallic), (0.5, 0.0));
        assert_eq!(material(0).alpha, AlphaMode::Opaque);
        let (brick, wrap) = image(material(0).base_color_texture);
        assert_eq!((brick.texels[0], wrap), ([200, 100, 50, 255], Wrap::Repeat));
        // A mask of its own is white, as opaque as it is bright.
        assert_eq!(material(2).alpha, AlphaMode::Mask { cutoff: 0.5 });
        assert_eq!(material(2).emissive, Vec3::new(0.5, 0.0, 0.0));
        let (leaf, wrap) = image(material(2).base_color_texture);
        assert_eq!(
            (leaf.texels[3], wrap),
            ([255, 255, 255, 128], Wrap::ClampToEdge)
        );
        assert_eq!(material(3).name, "nothing");
        assert!(scene.materials.iter().all(|m| m.double_sided));
    }

    #[test]
    fn opacity_of_another_size_is_looked_up_between() {
        let mut mask = RgbaImage::from_pixel(4, 2, Rgba([0, 0, 0, 255]));
        mask.put_pixel(3, 1, Rgba([255; 4]));
        let mut bytes = io::Cursor::new(Vec::new());
        mask.write_to(&mut bytes, ImageFormat::Png).unwrap();
        let library = "newmtl a\nmap_Kd a.png\nmap_d b.png\nTr 0.5\n";
        let text = "mtllib m\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let beside = [
            ("m", library.into()),
            ("a.png", png([2, 2], [9, 9, 9, 255])),
            ("b.png", bytes.into_inner()),
        ];
        let scene = read_with(text.as_bytes(), &beside).unwrap().scene;
        let alphas: Vec<u8> = scene.images[0].texels.iter().map(|t| t[3]).collect();
        // Texels 1 and 3 along x and row 1: the middles of halves.
        assert_eq!(alphas, [0, 0, 0, 255]);
        assert_eq!(scene.materials[0].alpha, AlphaMode::Blend);
        assert_eq!(scene.materials[0].base_color.w, 0.5);
    }

    proptest! {
        /// What a scene draws covers the polygons of the file, wherever they lie, with positive
        /// and negative indices.
        #[test]
        fn polygons_are_covered(
            radii in prop::collection::vec(1u8..9, 3..12),
            turn in prop::array::uniform4(-1f64..1.0),
            far in prop::sample::select(vec![0.0, 5e6]),
            negative in any::<bool>(),
        ) {
            prop_assume!(turn != [0.0; 4]);
            let turn = DQuat::from_array(turn).normalize();
            let count = radii.len();
            let star: Vec<DVec3> = radii.iter().enumerate().map(|(i, &r)| {
                let angle = i as f64 / count as f64 * std::f64::consts::TAU;
                turn * (DVec3::new(angle.cos(), angle.sin(), 0.0) * f64::from(r)) + DVec3::splat(far)
            }).collect();
            let mut text: String = star.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
            text.push('f');
            for i in 0..count {
                let index = if negative { i as i64 - count as i64 } else { i as i64 + 1 };
                text.push_str(&format!(" {index}"));
            }
            let scene = read(&text).unwrap().scene;
            let area = |points: &[DVec3]| -> DVec3 {
                let from = points[0];
                points.windows(2).map(|w| (w[0] - from).cross(w[1] - from)).sum()
            };
            let drawn: DVec3 = scene.triangles.iter().map(|t| area(&t.map(|v| scene.world_position(0, v)))).sum();
            // Coordinates within 9 as f32 have steps of 1e-6, sides are up to 18 long.
            prop_assert!((drawn - area(&star)).length() < 1e-3, "{} and {}", drawn, area(&star));
            // What is far away keeps its place to a fraction of f32's steps there.
            for (vertex, position) in scene.triangles[0].iter().map(|&v| (v, scene.world_position(0, v))) {
                let nearest = star.iter().map(|p| (*p - position).length()).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest < 1e-5, "vertex {} is off by {}", vertex, nearest);
            }
        }

        /// A file with bytes changed or cut off is refused or read soundly, also where it is a
        /// library or a picture.
        #[test]
        fn damaged_bytes_do_no_harm(
            which in 0..4usize,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
            length in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let mut files = house();
            files.insert(0, ("house.obj", HOUSE.into()));
            let damaged = &mut files[which].1;
            for (at, byte) in changes {
                let at = at.index(damaged.len());
                damaged[at] = byte;
            }
            if let Some(length) = length {
                damaged.truncate(length.index(damaged.len()));
            }
            let _ = read_with(&files[0].1, &files[1..]);
        }

        /// Whatever the lines say, there is a scene or an error.
        #[test]
        fn odd_lines_do_no_harm(lines in prop::collection::vec(prop::sample::select(vec![
            "v 0 0 0", "v 1 0 0 1", "v 0 1 0 1 0 0", "v 1e39 0 0", "v nan 0 0", "vt 1", "vt inf 0", "vn 0 0 0",
            "vn 1e30 0 0", "f 1 2 3", "f 1//1 2//1 3//1", "f 1/1 2/1 3/1", "f -1 -2 -3", "f 0 1 2", "f 1 1 1",
            "f 9223372036854775807 1 2", "f 1/ 2/ 3/", "f / / /", "f 1/1/1/1 2 3", "g a", "o b", "usemtl c", "s 1",
            "l 1 2", "f 3 2 1 2 3", "\\", "f 1 2 3 \\", "mtllib", "surf",
        ]), 0..16)) {
            let _ = read(&lines.join("\n"));
        }
    }

    #[test]
    fn faults_are_told_with_their_lines() {
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        for (text, message) in [
            ("", "the file: has no faces"),
            ("v 0 0 0\nl 1 1", "the file: has no faces"),
            ("v 0 0", "line 1: v has 2 numbers, expected 3"),
            ("\nv 0 0 x", "line 2: \"x\" is no number"),
            ("v 0 0 inf", "line 1: the position is not finite"),
            ("v 0 0 1e300", "line 1: the position is not finite"),
            (
                "v 0 0 0\nf 1 1 2",
                "line 2: uses vertex 2, the file has 1 vertices",
            ),
            (
                "v 0 0 0\nf 1/1 1 1",
                "line 2: uses texture coordinate 1, the file has 0",
            ),
            (
                "v 0 0 0\nf 1//1 1 1",
                "line 2: uses normal 1, the file has 0 normals",
            ),
            ("f 1 0 1", "line 1: \"0\" is no corner of a face"),
            ("f 1 -1 1", "line 1: \"-1\" is no corner of a face"),
            ("f a b c", "line 1: \"a\" is no corner of a face"),
            (
                "mtllib /etc/passwd\n",
                "line 1: \"/etc/passwd\" is absolute",
            ),
        ] {
            let text = if text.starts_with("mtllib") {
                format!("{text}{triangle}")
            } else {
                text.into()
            };
            let error = read(&text).unwrap_err().to_string();
            assert!(error.starts_with(message), "{text}: {error}");
        }
        let text = format!("mtllib a.mtl\nusemtl m\n{triangle}");
        for (library, message) in [
            (
                "newmtl m\nKd 1 x 0\n",
                "\"a.mtl\" line 2: \"x\" is no number",
            ),
            (
                "newmtl m\nmap_Kd C:\\t.png\n",
                "\"a.mtl\" line 2: \"C:\\\\t.png\" is absolute",
            ),
            (
                "newmtl m\nmap_Kd t.png\n",
                "\"a.mtl\" line 2: \"t.png\" cannot be read",
            ),
            (
                "newmtl m\nmap_Kd a.mtl\n",
                "\"a.mtl\" line 2: \"a.mtl\" is none of PNG",
            ),
        ] {
            let error = read_with(text.as_bytes(), &[("a.mtl", library.into())]);
            let error = error.unwrap_err().to_string();
            assert!(error.starts_with(message), "{library}: {error}");
        }
        // A library that is missing is no fault.
        let imported = read(&text).unwrap();
        assert!(imported.warnings[0].starts_with("material library \"a.mtl\" cannot be read"));
        assert_eq!(imported.files, [""; 0]);
    }

    #[test]
    fn missing_normals_are_smooth_across_seams_of_textures() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\n\
            f 1/1 2/1 3/1\nf 1/2 3/2 4/2\n";
        let scene = read(text).unwrap().scene;
        assert_eq!(scene.positions.len(), 6);
        let diagonal = Vec3::new(1.0, 0.0, 1.0).normalize();
        let at_seam =
            (0..6).filter(|&v| scene.positions[v] == Vec3::Y || scene.positions[v] == Vec3::ZERO);
        for vertex in at_seam {
            assert!((scene.normals[vertex] - diagonal).length() < 1e-6);
        }
    }
}
