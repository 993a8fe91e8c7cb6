//! What is kept of a PLY file's elements.

use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

/// A vertex; what the file does not have is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Vertex {
    pub(super) position: [f64; 3],
    pub(super) normal: [f32; 3],
    /// As stored.
    pub(super) color: [f32; 4],
    pub(super) uv: [f32; 2],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(value) = scalar(&property) else {
            return PropertyAccessResult::Ignored;
        };
        match name {
            "x" => self.position[0] = value,
            "y" => self.position[1] = value,
            "z" => self.position[2] = value,
            "nx" => self.normal[0] = value as f32,
            "ny" => self.normal[1] = value as f32,
            "nz" => self.normal[2] = value as f32,
            "red" => self.color[0] = value as f32,
            "green" => self.color[1] = value as f32,
            "blue" => self.color[2] = value as f32,
            "alpha" => self.color[3] = value as f32,
            "s" | "u" | "texture_u" => self.uv[0] = value as f32,
            "t" | "v" | "texture_v" => self.uv[1] = value as f32,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn scalar(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(value) => value.into(),
        Property::UChar(value) => value.into(),
        Property::Short(value) => value.into(),
        Property::UShort(value) => value.into(),
        Property::Int(value) => value.into(),
        Property::UInt(value) => value.into(),
        Property::Float(value) => value.into(),
        Property::Double(value) => value,
        _ => return None,
    })
}

/// A polygon.
#[derive(Debug, Default)]
pub(super) struct Face {
    pub(super) vertices: Vec<i64>,
}

/// Strips of triangles in one list.
pub(super) type Strip = Face;

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        match property {
            Property::ListChar(list) => self.vertices = list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => self.vertices = list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => self.vertices = list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => self.vertices = list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => self.vertices = list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => self.vertices = list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// An element of which nothing is kept.
#[derive(Debug)]
pub(super) struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
