//! What ID-bitfields draw for a direction.

use crate::BundleError;
use crate::check::{Checked, check_header, finite, require};
use crate::lists;
use crate::manifest::{BitfieldsBody, Manifest};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

/// The name of the file in a bundle's folder.
pub const FACES_FILE: &str = "faces.json";

/// The value of [`FaceLists::format`].
pub const FACES_FORMAT: &str = "farfield-faces";

/// The value of [`FaceLists::version`] that this crate writes and reads.
pub const FACES_VERSION: u32 = 1;

/// The JSON schema of `faces.json`, draft 2020-12. It is also a file beside this crate's source.
pub const FACES_SCHEMA: &str = include_str!("../schema/faces-1.schema.json");

/// Viewpoints at most, which are more than anybody has time to sample.
pub const FACES_MOST_VIEWPOINTS: u32 = 10_000;

/// A direction's length differs from 1 by no more than roundings.
const UNIT: f64 = 1e-9;

/// What of `impostors.glb` can be seen from where.
///
/// Triangles are counted through the primitives of the one mesh in `impostors.glb`, in the order in
/// which they stand there. To draw a view:
///
/// 1. The direction is that from the centre (of the manifest's `options.view_space`) to the camera.
/// 2. The face is the one that has it between its corners: with the viewpoints a, b and c there, it
///    is on the inner side of all three planes, (a x b) . d >= 0, (b x c) . d >= 0, (c x a) . d >= 0.
/// 3. Draw the face's ranges. Each lies in one primitive: the range from `first` to before `end`, in
///    the primitive that begins with the triangle `parts[p]`, are the 3 (end - first) indices from
///    number 3 (first - `parts[p]`) of its index accessor on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceLists {
    /// Always "farfield-faces".
    #[schemars(extend("const" = FACES_FORMAT))]
    pub format: String,
    /// The format's version: 1.
    #[schemars(extend("const" = FACES_VERSION))]
    pub version: u32,
    /// Directions from the centre to the viewpoints, of length 1; 4 to 10,000 of them.
    #[schemars(with = "Vec<[f64; 3]>", extend("maxItems" = FACES_MOST_VIEWPOINTS))]
    pub viewpoints: Vec<DVec3>,
    /// The first triangle of each primitive of the mesh in `impostors.glb`, and behind them the number
    /// of all.
    pub parts: Vec<u32>,
    /// The spherical triangles between the viewpoints: their convex hull.
    pub faces: Vec<FaceRecord>,
}

/// One of the triangles between viewpoints, and what is drawn for directions in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceRecord {
    /// Viewpoints, counter-clockwise seen from outside.
    pub corners: [u32; 3],
    /// Triangles from the first to before the second, in ascending order; may be none.
    pub draw: Vec<[u32; 2]>,
}

impl FaceLists {
    /// The file's text: one line for each viewpoint and each face.
    ///
    /// # Panics
    ///
    /// When a number is not finite.
    pub fn to_json(&self) -> String {
        let line = |value: serde_json::Result<String>| value.expect("finite numbers are JSON");
        let lines = |lines: Vec<String>| lines.join(",\n    ");
        let viewpoints = self.viewpoints.iter();
        let viewpoints = viewpoints.map(|v| line(serde_json::to_string(v))).collect();
        let faces = self.faces.iter();
        let faces = faces
            .map(|face| line(serde_json::to_string(face)))
            .collect();
        format!(
            "{{\n  \"format\": {:?},\n  \"version\": {},\n  \"viewpoints\": [\n    {}\n  ],\n  \
             \"parts\": {},\n  \"faces\": [\n    {}\n  ]\n}}\n",
            self.format,
            self.version,
            lines(viewpoints),
            line(serde_json::to_string(&self.parts)),
            lines(faces)
        )
    }

    /// Checks that directions are of length 1, faces a closed surface through all viewpoints, ranges
    /// in order and each in one part, and that all is as the manifest says.
    ///
    /// Whether the faces are the convex hull of the viewpoints is not looked at.
    ///
    /// # Errors
    ///
    /// The first thing found wrong.
    pub fn check(&self, body: &BitfieldsBody) -> Checked {
        check_header(&self.format, self.version, FACES_FORMAT, FACES_VERSION)?;
        let viewpoints = self.viewpoints.len();
        require(
            viewpoints <= FACES_MOST_VIEWPOINTS as usize,
            "viewpoints",
            || format!("are {viewpoints}, more than {FACES_MOST_VIEWPOINTS}"),
        )?;
        for (i, viewpoint) in self.viewpoints.iter().enumerate() {
            finite(*viewpoint, format_args!("viewpoints[{i}]"))?;
            let length = viewpoint.length();
            require(
                (length - 1.0).abs() <= UNIT,
                format_args!("viewpoints[{i}]"),
                || format!("has the length {length}, not 1"),
            )?;
        }
        self.check_surface()?;
        require(viewpoints == body.viewpoints as usize, "viewpoints", || {
            format!(
                "are {viewpoints}, but the manifest says {}",
                body.viewpoints
            )
        })?;
        lists::check(self.lists(), &self.parts, body, "faces")
    }

    /// What each face draws.
    fn lists(&self) -> impl Iterator<Item = &[[u32; 2]]> + Clone {
        self.faces.iter().map(|face| &face.draw[..])
    }

    fn check_surface(&self) -> Checked {
        let viewpoints = self.viewpoints.len();
        let expected = (2 * viewpoints).saturating_sub(4);
        require(
            viewpoints >= 4 && self.faces.len() == expected,
            "faces",
            || format!("are {} between {viewpoints} viewpoints", self.faces.len()),
        )?;
        let mut edges = BTreeSet::new();
        for (i, face) in self.faces.iter().enumerate() {
            for (k, &corner) in face.corners.iter().enumerate() {
                require(
                    (corner as usize) < viewpoints,
                    format_args!("faces[{i}].corners"),
                    || format!("name viewpoint {corner} of {viewpoints}"),
                )?;
                let next = face.corners[(k + 1) % 3];
                require(
                    corner != next && edges.insert([corner, next]),
                    format_args!("faces[{i}].corners"),
                    || format!("have an edge from {corner} to {next} that an earlier face has"),
                )?;
            }
        }
        let open = edges.iter().find(|[a, b]| !edges.contains(&[*b, *a]));
        require(open.is_none(), "faces", || {
            let [a, b] = open.expect("one was found");
            format!("leave the edge from viewpoint {a} to {b} open")
        })
    }

    /// Triangles that a face draws.
    ///
    /// # Panics
    ///
    /// When there is no such face.
    pub fn drawn(&self, face: u32) -> u64 {
        lists::drawn(&self.faces[face as usize].draw)
    }

    /// Mean share of the triangles that a face does not draw, over all faces; 0 where there is none.
    pub fn culled(&self) -> f64 {
        let triangles = self.parts.last().copied().unwrap_or(0);
        lists::culled(self.lists(), triangles)
    }
}

/// Reads the lists of the bundle in the folder `dir`, whose manifest was read from there.
///
/// Takes memory in proportion to the file, of which at most 64 MiB are read.
///
/// # Errors
///
/// When the bundle has none, or they cannot be true; the error names the file and the place in it.
pub fn read_faces(dir: &Path, manifest: &Manifest) -> Result<FaceLists, BundleError> {
    lists::read(dir, manifest, FACES_FILE, FaceLists::check)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::check_schema;
    use crate::generate::sample_bitfields_body;

    /// An octahedron whose faces draw ten of twenty triangles each, of two parts.
    fn lists() -> (FaceLists, BitfieldsBody) {
        let [x, y, z] = DVec3::AXES;
        let corners = |i: u32| {
            // Viewpoint 2 a is +axis, 2 a + 1 its opposite; a mirror turns the winding.
            let [a, b, c] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)];
            match i.count_ones().is_multiple_of(2) {
                true => [a, b, c],
                false => [a, c, b],
            }
        };
        let face = |i: u32| FaceRecord {
            corners: corners(i),
            draw: vec![[i, i + 4], [12, 18]],
        };
        let lists = FaceLists {
            format: FACES_FORMAT.into(),
            version: FACES_VERSION,
            viewpoints: vec![x, -x, y, -y, z, -z],
            parts: vec![0, 12, 20],
            faces: (0..8).map(face).collect(),
        };
        (lists, sample_bitfields_body())
    }

    /// The text is JSON that gives the lists back.
    #[test]
    fn lists_round_trip() {
        let (mut lists, body) = lists();
        assert_eq!(lists.check(&body), Ok(()));
        lists.viewpoints[0] = DVec3::new(0.1 + 0.2, 1.0 / 3.0, 5e-324);
        let back: FaceLists = serde_json::from_str(&lists.to_json()).unwrap();
        assert_eq!(back, lists);
    }

    /// Whatever is damaged, the check names the place.
    #[test]
    fn every_damage_is_found() {
        type Damage = fn(&mut FaceLists, &mut BitfieldsBody);
        let damages: [(&str, Damage); 21] = [
            ("format", |l, _| l.format = "other".into()),
            ("version", |l, _| l.version = 2),
            ("viewpoints[1]", |l, _| l.viewpoints[1].x = f64::NAN),
            ("viewpoints[1]", |l, _| l.viewpoints[1] *= 1.001),
            ("parts", |l, _| l.parts.clear()),
            ("parts", |l, _| l.parts[1] = 0),
            ("parts", |l, _| l.parts[2] = 21),
            ("faces", |l, _| {
                l.faces.pop();
            }),
            ("faces", |l, _| {
                l.viewpoints.pop();
            }),
            ("faces[3].corners", |l, _| l.faces[3].corners[1] = 6),
            ("faces[3].corners", |l, _| l.faces[3].corners = [1; 3]),
            ("faces[3].corners", |l, _| l.faces[3].corners.reverse()),
            ("faces[2].draw[0]", |l, _| l.faces[2].draw[0] = [5, 5]),
            ("faces[2].draw[0]", |l, _| l.faces[2].draw[0] = [2, 13]),
            ("faces[2].draw[1]", |l, _| l.faces[2].draw.reverse()),
            ("faces[2].draw[1]", |l, _| l.faces[2].draw[1] = [12, 21]),
            ("faces[2].draw[1]", |l, _| l.faces[2].draw[1] = [20, 21]),
            // Lists that lost a range or a triangle.
            ("faces", |l, _| {
                l.faces[2].draw.pop();
            }),
            ("faces", |l, _| l.faces[2].draw[1][1] = 17),
            ("viewpoints", |_, b| b.viewpoints = 7),
            ("viewpoints", |l, _| l.viewpoints.resize(10_001, DVec3::X)),
        ];
        for (i, (place, damage)) in damages.into_iter().enumerate() {
            let (mut lists, mut body) = lists();
            damage(&mut lists, &mut body);
            let found = lists.check(&body).map_err(|e| e.place);
            assert_eq!(found, Err(place.to_owned()), "damage {i}");
        }
    }

    /// A face that is not closed with its neighbours is found though no edge is there twice.
    #[test]
    fn open_surfaces_are_found() {
        let (mut lists, body) = lists();
        lists.viewpoints.push(DVec3::new(0.6, 0.8, 0.0));
        let more = |corners| FaceRecord {
            corners,
            draw: vec![[0, 4], [12, 18]],
        };
        lists.faces.push(more([6, 0, 1]));
        lists.faces.push(more([6, 2, 3]));
        let error = lists.check(&body).unwrap_err();
        assert!(error.problem.contains("open"), "{error}");
    }

    /// The published schema is that of the code.
    #[test]
    fn the_published_faces_schema_is_up_to_date() {
        let schema = schemars::schema_for!(FaceLists);
        check_schema("faces-1.schema.json", FACES_SCHEMA, &schema);
    }
}
