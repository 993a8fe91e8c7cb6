//! Counts what was dropped or changed, for the caller's warnings.

use std::collections::BTreeMap;
use std::fmt;

/// What can be dropped or changed in a file that is read all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Note {
    DegenerateTriangles,
    IncompleteTriangles,
    IncompleteFaces,
    PointsOrLines,
    FreeForm,
    NoPositions,
    FlatObjects,
    Skinned,
    Morphed,
    Rotations,
    Normals,
    Uvs,
    Colors,
    NoUvs,
    MixedUvs,
    NoImage,
    Factors,
    SpecularGlossiness,
    NoMaterial,
    TextureOptions,
    PlyTextures,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::DegenerateTriangles => "triangles without area, dropped",
            Self::IncompleteTriangles => "primitives with an incomplete last triangle, which was dropped",
            Self::IncompleteFaces => "faces of fewer than three corners, dropped",
            Self::FreeForm => "free-form curves and surfaces, left out",
            Self::NoMaterial => "materials that no library has, replaced by white ones",
            Self::PlyTextures => "textures named in comments, left out",
            Self::TextureOptions => "textures with options, which were ignored",
            Self::PointsOrLines => "primitives of points or lines, dropped",
            Self::NoPositions => "primitives without positions, dropped",
            Self::FlatObjects => "objects scaled to nothing along an axis, dropped",
            Self::Skinned => "skinned objects, read as if they had no skin",
            Self::Morphed => "objects of morphed meshes, read without morphing",
            Self::Rotations => "rotations of another length than 1, brought to it",
            Self::Normals => "normals without direction, computed",
            Self::Uvs => "texture coordinates that are not finite, set to 0",
            Self::Colors => "vertex colours outside [0, 1], clamped",
            Self::NoUvs => "textured primitives without texture coordinates, which were set to 0",
            Self::MixedUvs => {
                "materials whose textures use different texture coordinates, all read with the first one's"
            }
            Self::NoImage => "uses of textures without an image, left out",
            Self::Factors => "material factors outside their range, clamped",
            Self::SpecularGlossiness => {
                "specular-glossiness materials, read without their specular colour"
            }
        })
    }
}

/// How often each was noted.
#[derive(Debug, Default)]
pub(crate) struct Notes(BTreeMap<Note, u64>);

impl Notes {
    pub(crate) fn add(&mut self, note: Note, count: usize) {
        if count > 0 {
            *self.0.entry(note).or_default() += count as u64;
        }
    }

    /// One sentence each, such as "3 objects scaled to nothing along an axis, dropped".
    pub(crate) fn warnings(&self) -> Vec<String> {
        let sentence = |(note, count): (&Note, &u64)| format!("{note}: {count}");
        self.0.iter().map(sentence).collect()
    }
}
