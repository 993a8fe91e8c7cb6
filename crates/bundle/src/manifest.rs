//! What stands in `bundle.json`.

use crate::view_space::{Side, ViewSpace};
use farfield_views::{Extent, Pose, ViewCell};
use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The value of [`Manifest::format`].
pub const FORMAT: &str = "farfield-bundle";

/// The value of [`Manifest::version`] that this crate writes, and the greatest it reads.
pub const VERSION: u32 = 1;

/// The name of the manifest's file in a bundle's folder.
pub const MANIFEST_FILE: &str = "bundle.json";

/// The name of the glTF file in a bundle's folder; every bundle has one.
pub const GLTF_FILE: &str = "impostors.glb";

/// The JSON schema of `bundle.json`, draft 2020-12. It is also a file beside this crate's source.
pub const SCHEMA: &str = include_str!("../schema/bundle-1.schema.json");

/// Everything that is known about a bundle: how it was made, from what, what it promises, what
/// it costs, and its files.
///
/// Lengths are metres, angles radians unless said otherwise, coordinates the world's:
/// right-handed with +Y up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Always "farfield-bundle".
    #[schemars(extend("const" = FORMAT))]
    pub format: String,
    /// The format's version: 1.
    #[schemars(extend("const" = VERSION))]
    pub version: u32,
    /// What wrote the bundle.
    pub generator: Generator,
    /// How the impostors were made, with the settings of that technique.
    pub technique: Technique,
    /// The settings that all techniques share, as they were used.
    pub options: Options,
    /// What was baked.
    pub scene: SceneSource,
    /// What the bundle keeps to, seen from anywhere in the view space.
    pub promise: Promise,
    /// What was saved.
    pub statistics: Statistics,
    /// What happened during the bake and should be known, a sentence each.
    pub warnings: Vec<String>,
    /// The impostors; together they replace the scene, less what was excluded, or what of it is far.
    pub impostors: Vec<Impostor>,
    /// All files of the bundle but the manifest and what verifying adds, ordered by path. Filled
    /// in when the bundle is written.
    pub files: Vec<FileRecord>,
    /// SHA-256 of the manifest's own file in which the 64 digits of this field are replaced by
    /// zeros, in lower-case hexadecimal digits. Filled in when the bundle is written.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub sha256: String,
}

/// A program and its version.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Generator {
    /// The program's name.
    pub name: String,
    /// The program's version.
    pub version: String,
}

/// How impostors are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "name", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Technique {
    /// Layered impostors: textured quads on parallel layers.
    Layered {
        /// What a quad is thought to cost, in bytes, when quads are weighed against texels.
        bytes_per_quad: f64,
        /// Longest side of an atlas page, in texels.
        page_size: u32,
        /// How masked materials are recorded.
        foliage: Foliage,
        /// What the pages hold.
        channels: Channels,
    },
    /// Textured depth meshes: the layers' texels connected and simplified.
    Tdm {
        /// Side of a voxel when it is asked whether the mesh touches it, in voxels, from 1 to 2.
        enlarged: f64,
        /// Longest side of an atlas page, in texels.
        page_size: u32,
        /// How masked materials are recorded.
        foliage: Foliage,
        /// What the pages hold.
        channels: Channels,
    },
    /// ID-bitfields: the original geometry, and what of it can be seen from each direction or cell.
    Bitfields {
        /// From where the bake looked.
        samples: Samples,
        /// Views held back from the samples that were to judge them: with adaptive samples so many one
        /// after another had to miss nothing, unless that was given up.
        held_back: u32,
        /// Pixels that such a view could miss and still pass, while there were adaptive samples to add.
        #[serde(default)]
        tolerated_pixels: u64,
        /// Of these views.
        seed: u64,
        /// Triangles of a patch at most, at least 1. Patches are drawn whole.
        #[schemars(range(min = 1))]
        patch_triangles: u32,
        /// How many times finer than the pixels of the promised camera those of the bake are.
        finer: f64,
        /// Whether what samples saw was taken to be seen together with the triangles that share a vertex
        /// with it and face the sample. `None` in bundles that do not tell.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        neighbors: Option<bool>,
    },
}

impl Technique {
    /// The technique's name, as on the command line and in the manifest.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Layered { .. } => "layered",
            Self::Tdm { .. } => "tdm",
            Self::Bitfields { .. } => "bitfields",
        }
    }

    /// How masked materials are recorded; `None` where none are.
    pub fn foliage(&self) -> Option<Foliage> {
        match *self {
            Self::Layered { foliage, .. } | Self::Tdm { foliage, .. } => Some(foliage),
            Self::Bitfields { .. } => None,
        }
    }

    /// What the pages hold; `None` where there are none.
    pub fn channels(&self) -> Option<Channels> {
        match *self {
            Self::Layered { channels, .. } | Self::Tdm { channels, .. } => Some(channels),
            Self::Bitfields { .. } => None,
        }
    }
}

/// How the viewpoints of ID-bitfields were found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Samples {
    /// Added where views missed something, until none did or it was given up.
    Adaptive,
    /// Spread evenly.
    Even,
    /// Listed by the user.
    Listed,
}

/// How masked materials are recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Foliage {
    /// A texel is set where any of its samples passes the cutoff: no gaps.
    Any,
    /// A texel is set where its centre passes the cutoff: the coverage is kept.
    Centre,
}

/// What the pages of a bundle hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Channels {
    /// Colours under a plain sun and sky, to be shown as they are.
    Lit,
    /// Base colours, to be shown as they are.
    Unlit,
    /// Base colours, normals, metallic and roughness, and what shines by itself, to be lit.
    Pbr,
}

/// The settings that all techniques share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// Pixels along each side of the camera the promise is made for, from 1 to 16384.
    #[schemars(range(min = 1, max = 16384))]
    pub resolution: u32,
    /// Full angle that camera sees, in degrees, between 0 and 180.
    pub fov_degrees: f64,
    /// Where that camera may be, and what it sees from there.
    pub view_space: ViewSpace,
    /// Names of objects that were left out.
    pub exclude: Vec<String>,
}

/// What was baked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SceneSource {
    /// A scene in a file.
    File {
        /// Path relative to the bundle's folder, with slashes; may begin with "..".
        path: String,
        /// SHA-256 of that file, in lower-case hexadecimal digits; where it refers to other
        /// files, of the digits of all of them, its own first, the others as they are read.
        #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
        sha256: String,
    },
    /// A scene that the generator makes itself.
    BuiltIn {
        /// Name, as on the command line.
        name: String,
        /// How much of it; the scene tells in which unit. 1 where it has one size only.
        size: u32,
        /// Seed of its random choices.
        seed: u64,
    },
}

/// What a bundle keeps to, for the camera of the options, from anywhere in its view space.
///
/// A figure is the most that may be measured; where there is none, nothing is promised.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Promise {
    /// Pixels at which one sees through the impostor or into a layer too far behind, in all
    /// views together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_pixels: Option<u64>,
    /// Pixels that only the impostor covers, far from the original, in all views together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phantom_pixels: Option<u64>,
    /// Pixels that the impostor covers where of the original there are only the backs of
    /// single-sided surfaces whose fronts nobody in the view space sees, in all views together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back_pixels: Option<u64>,
    /// The farthest that a point appears from where it is, in pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parallax_px: Option<f64>,
    /// Pixels of the original that the impostor misses, as a share of the original's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_error: Option<f64>,
    /// By what share the covered pixels, averaged over all views, may differ from the
    /// original's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_change: Option<f64>,
    /// The mean signed colour difference a channel, over pixels where both show the same layer, as a
    /// share of full intensity; to either side of 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour_bias: Option<f64>,
    /// The mean signed difference of normals, roughness and metallic, over pixels where both show the
    /// same layer, as a share of their whole range; to either side of 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface_bias: Option<f64>,
    /// Pixels in the midst of colours that the original does not show anywhere near, as a share of
    /// those inside of what both cover.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stray_colours: Option<f64>,
    /// Pixels of a picture that show a primitive which is not drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// The share of pictures that miss no more than `missed_pixels`, above 0; where there is none, all
    /// of them. From around, of those in uniformly distributed directions and from distances whose
    /// reciprocals are uniformly distributed; from a view cell, of those in uniformly distributed
    /// directions, 19 of 27 from its faces, edges and corners, and the others from anywhere within.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missed_share: Option<f64>,
    /// The limits of the promise, a sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// What the baked part of the scene costs as it is, and as impostors.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Statistics {
    /// The original.
    pub before: Cost,
    /// The impostors; of ID-bitfields triangles and draw calls are the mean over all faces.
    pub after: Cost,
    /// Layers of all impostors; 0 where they have none.
    pub layers: u64,
    /// Quads of all impostors; 0 where they have none.
    pub quads: u64,
    /// Opaque texels that were recorded, of all impostors; 0 where there are none.
    pub texels_recorded: u64,
    /// Opaque texels that can be seen and were kept, of all impostors.
    pub texels_kept: u64,
}

/// What drawing a scene takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cost {
    /// Triangles drawn, those of shared meshes once per object.
    pub triangles: u64,
    /// Draw calls: one for every material of every object.
    pub draw_calls: u64,
    /// Uncompressed images without mipmaps, 4 bytes a texel.
    pub texture_bytes: u64,
    /// Vertices and indices, as `impostors.glb` stores them.
    pub geometry_bytes: u64,
}

/// What replaces a part of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Impostor {
    /// Also the name of its node in `impostors.glb`; unique.
    pub name: String,
    /// The side of the view space it is for: where it is seen amid the scene, where the camera is in
    /// views from all around. Distinct; absent where there is but one impostor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
    /// Least and greatest coordinates in the world of what it replaces, in metres.
    #[schemars(with = "[[f64; 3]; 2]")]
    pub represented: [DVec3; 2],
    /// What its technique tells about it.
    pub body: Body,
}

/// The part of an impostor's description that depends on its technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "technique", rename_all = "kebab-case")]
pub enum Body {
    /// Textured quads on parallel layers.
    Layered(LayeredBody),
    /// A textured mesh over the texels of layers.
    Tdm(TdmBody),
    /// Lists of what to draw for a direction, or from a view cell.
    Bitfields(BitfieldsBody),
}

impl Body {
    /// The layers that it was recorded in; `None` where there are none.
    pub fn layers(&self) -> Option<&LayeredBody> {
        match self {
            Self::Layered(layers) => Some(layers),
            Self::Tdm(body) => Some(&body.recorded),
            Self::Bitfields(_) => None,
        }
    }
}

/// What the lists come to: those of faces between viewpoints ([`FaceLists`](crate::FaceLists)), or those
/// of view cells ([`CellLists`](crate::CellLists)).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BitfieldsBody {
    /// Triangles of `impostors.glb`: all that the scene draws.
    pub triangles: u64,
    /// Those of them that have blended materials, which are in all lists.
    pub always_drawn: u64,
    /// From where samples were taken: directions, or points in all cells together.
    pub viewpoints: u32,
    /// Lists: one for each face between directions, or for each cell.
    pub lists: u32,
    /// Ranges of all lists together.
    pub ranges: u64,
    /// Ranges of the list that has most.
    pub most_ranges: u32,
    /// Mean share of the triangles that a list leaves out.
    pub culled: f64,
}

/// A mesh, and the layers whose texels it connects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TdmBody {
    /// The layers, without quads: their texels are the voxels that the mesh touches.
    pub recorded: LayeredBody,
    /// Triangles before the mesh was simplified.
    pub initial_triangles: u64,
    /// Triangles.
    pub triangles: u64,
    /// Pieces of the mesh that do not hang together.
    pub pieces: u64,
    /// Rectangles of texture, each of neighbouring triangles.
    pub charts: u64,
}

/// Where the layers of an impostor are and what they hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayeredBody {
    /// The reference viewpoint, from which the layers were recorded, and the axis they are
    /// perpendicular to.
    #[serde(with = "PoseRecord")]
    #[schemars(with = "PoseRecord")]
    pub pose: Pose,
    /// Lateral bounds of the recorded frustum per unit of depth.
    #[serde(with = "ExtentRecord")]
    #[schemars(with = "ExtentRecord")]
    pub extent: Extent,
    /// Columns of texels of every layer, from 1 to 65536.
    #[schemars(range(min = 1, max = 65536))]
    pub width: u32,
    /// Rows of texels of every layer, from 1 to 65536.
    #[schemars(range(min = 1, max = 65536))]
    pub height: u32,
    /// Front to back; at least one.
    pub layers: Vec<LayerRecord>,
    /// Opaque texels that were recorded, in all layers.
    pub texels_recorded: u64,
    /// Opaque texels that can be seen and were kept, in all layers.
    pub texels_kept: u64,
}

impl LayeredBody {
    /// Depths before the first, between neighbouring, and behind the last of the layers: one more
    /// than there are layers.
    pub fn borders(&self) -> Vec<f64> {
        let last = self.layers.last().map(|layer| layer.far);
        self.layers
            .iter()
            .map(|layer| layer.near)
            .chain(last)
            .collect()
    }
}

/// A layer of a layered impostor. Depths are distances from the reference viewpoint along the
/// view axis, in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerRecord {
    /// Where its quads are.
    pub depth: f64,
    /// Least depth of what it shows; not greater than `depth`.
    pub near: f64,
    /// Greatest depth of what it shows; not less than `depth`.
    pub far: f64,
    /// Number of its quads; 0 where a mesh takes their place.
    pub quads: u32,
    /// SHA-256 of where its opaque texels are, in lower-case hexadecimal digits: of column and row
    /// of each, row by row from the top left, as 16-bit little-endian numbers. However quads are
    /// cut, packed and ordered, a layer shows these texels.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub texels_sha256: String,
}

/// A file of a bundle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileRecord {
    /// Path relative to the bundle's folder, with slashes; never leaves the folder.
    pub path: String,
    /// Size.
    pub bytes: u64,
    /// SHA-256 of its content, in lower-case hexadecimal digits.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub sha256: String,
}

/// How a viewer stands.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Pose", deny_unknown_fields)]
#[schemars(rename = "Pose")]
struct PoseRecord {
    /// Position in the world, in metres.
    #[schemars(with = "[f64; 3]")]
    eye: DVec3,
    /// Of length 1.
    #[schemars(with = "[f64; 3]")]
    right: DVec3,
    /// Of length 1.
    #[schemars(with = "[f64; 3]")]
    down: DVec3,
    /// The view axis, of length 1.
    #[schemars(with = "[f64; 3]")]
    forward: DVec3,
}

/// Lateral bounds of a frustum per unit of depth, to the right and down.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Extent", deny_unknown_fields)]
#[schemars(rename = "Extent")]
struct ExtentRecord {
    /// Slopes of the left and upper bounds.
    #[schemars(with = "[f64; 2]")]
    min: DVec2,
    /// Slopes of the right and lower bounds.
    #[schemars(with = "[f64; 2]")]
    max: DVec2,
}

/// Where the viewer may be.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(
    remote = "ViewCell",
    tag = "kind",
    rename_all = "kebab-case",
    deny_unknown_fields
)]
#[schemars(rename = "ViewCell")]
pub(crate) enum ViewCellRecord {
    /// A box with sides along the world's axes.
    Box {
        /// Centre, in metres.
        #[schemars(with = "[f64; 3]")]
        center: DVec3,
        /// Full lengths of the sides, in metres.
        #[schemars(with = "[f64; 3]")]
        size: DVec3,
    },
    /// A four-sided pyramid without its top.
    Shaft {
        /// The tip, in metres.
        #[schemars(with = "[f64; 3]")]
        apex: DVec3,
        /// From the apex towards the viewers, of any length.
        #[schemars(with = "[f64; 3]")]
        axis: DVec3,
        /// Between the axis and each of the four sides, in radians.
        half_angle: f64,
        /// Along the axis to the border nearest to the apex, in metres.
        near: f64,
        /// Along the axis to the farthest border, in metres; infinite where it is left out.
        #[serde(default = "infinity", skip_serializing_if = "is_infinite")]
        far: f64,
    },
}

fn infinity() -> f64 {
    f64::INFINITY
}

fn is_infinite(x: &f64) -> bool {
    *x == f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{check_schema, manifests};
    use proptest::prelude::*;

    proptest! {
        /// Every manifest is read back as it was, numbers with all their bits.
        #[test]
        fn manifests_round_trip(manifest in manifests()) {
            let text = serde_json::to_string_pretty(&manifest).unwrap();
            let back: Manifest = serde_json::from_str(&text).unwrap();
            prop_assert_eq!(&back, &manifest);
            // Equal numbers may have other bits (0 and -0), equal texts may not.
            prop_assert_eq!(serde_json::to_string_pretty(&back).unwrap(), text);
        }
    }

    /// Nothing of a manifest is ignored in silence.
    #[test]
    fn unknown_fields_are_errors() {
        let manifest = serde_json::to_value(crate::generate::sample()).unwrap();
        let places = [
            "",
            "/technique",
            "/options",
            "/options/view_space",
            "/options/view_space/view_cell",
            "/scene",
            "/promise",
            "/statistics/after",
            "/impostors/0",
            "/impostors/0/body",
            "/impostors/0/body/pose",
            "/impostors/0/body/layers/0",
            "/files/0",
        ];
        for place in places {
            let mut manifest = manifest.clone();
            manifest.pointer_mut(place).unwrap()["colour"] = 1.into();
            let error = serde_json::from_value::<Manifest>(manifest).unwrap_err();
            assert!(error.to_string().contains("colour"), "{place}: {error}");
        }
    }

    /// The published schema is that of the code.
    #[test]
    fn the_published_schema_is_up_to_date() {
        let schema = schemars::schema_for!(Manifest);
        check_schema("bundle-1.schema.json", SCHEMA, &schema);
    }
}
