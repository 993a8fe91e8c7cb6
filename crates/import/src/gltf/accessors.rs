//! Reads accessors: typed, strided, normalised and sparse runs of numbers.

use super::GltfError;
use super::document::{Accessor, Document};
use super::files::Buffers;

/// How one number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// The component type of a code of glTF's, or `None` where there is none.
    pub(crate) fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// In bytes.
    pub(crate) fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at the start of `bytes`; normalised ones are in [-1, 1].
    ///
    /// Source: Khronos Group, glTF 2.0 Specification, section 3.6.2.2.
    fn read(self, bytes: &[u8], normalized: bool) -> f32 {
        let scaled = |value: f32, greatest: f32| match normalized {
            true => (value / greatest).max(-1.0),
            false => value,
        };
        match self {
            Self::I8 => scaled((bytes[0] as i8).into(), i8::MAX.into()),
            Self::U8 => scaled(bytes[0].into(), u8::MAX.into()),
            Self::I16 => scaled(i16::from_le_bytes(first(bytes)).into(), i16::MAX.into()),
            Self::U16 => scaled(u16::from_le_bytes(first(bytes)).into(), u16::MAX.into()),
            Self::U32 => u32::from_le_bytes(first(bytes)) as f32,
            Self::F32 => f32::from_le_bytes(first(bytes)),
        }
    }

    /// The unsigned whole number at the start of `bytes`.
    fn read_index(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => bytes[0].into(),
            Self::U16 => u16::from_le_bytes(first(bytes)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes)),
            Self::I8 | Self::I16 | Self::F32 => unreachable!("indices were checked"),
        }
    }
}

fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    *bytes.first_chunk().expect("accessors were checked")
}

/// How one element is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) component: Component,
    /// Numbers in an element, 1 for scalars.
    pub(crate) components: usize,
    /// Of an element, in bytes, with the padding of matrices' columns.
    pub(crate) size: u64,
}

/// The layout of an accessor's elements.
///
/// # Errors
///
/// When component type or type do not exist.
pub(crate) fn layout(accessor: &Accessor, index: usize) -> Result<Layout, GltfError> {
    let unknown = |field, value, expected| GltfError::Value {
        place: format!("accessors[{index}].{field}"),
        value,
        expected,
    };
    let component = Component::from_code(accessor.component_type).ok_or_else(|| {
        let value = accessor.component_type.to_string();
        unknown("componentType", value, "5120 to 5126 without 5124")
    })?;
    let (columns, rows) = match accessor.shape.as_str() {
        "SCALAR" => (1, 1),
        "VEC2" => (1, 2),
        "VEC3" => (1, 3),
        "VEC4" => (1, 4),
        "MAT2" => (2, 2),
        "MAT3" => (3, 3),
        "MAT4" => (4, 4),
        _ => {
            let value = format!("{:?}", accessor.shape);
            return Err(unknown("type", value, "SCALAR, VEC2 to 4 or MAT2 to 4"));
        }
    };
    let mut column = rows * component.size();
    if columns > 1 {
        column = column.next_multiple_of(4);
    }
    Ok(Layout {
        component,
        components: (columns * rows) as usize,
        size: columns * column,
    })
}

/// The elements of an accessor, decoded as they are asked for.
///
/// Nothing is allocated but the positions of sparse elements, so a bogus count costs nothing.
#[derive(Debug)]
pub(crate) struct Elements<'a> {
    pub(crate) count: usize,
    layout: Layout,
    normalized: bool,
    /// From the first element on; `None` where all are zero.
    base: Option<&'a [u8]>,
    stride: usize,
    /// Elements that differ from the base, ascending, and their values.
    sparse: Vec<u32>,
    sparse_values: &'a [u8],
}

impl<'a> Elements<'a> {
    /// The elements of an accessor of a checked document.
    ///
    /// # Errors
    ///
    /// When the bytes do not exist, or sparse elements are out of order.
    pub(crate) fn open(
        document: &Document,
        buffers: &'a Buffers<'_>,
        index: usize,
    ) -> Result<Self, GltfError> {
        let accessor = &document.accessors[index];
        let layout = layout(accessor, index)?;
        let mut elements = Self {
            count: accessor.count as usize,
            layout,
            normalized: accessor.normalized,
            base: None,
            stride: layout.size as usize,
            sparse: Vec::new(),
            sparse_values: &[],
        };
        if let Some(view) = accessor.buffer_view {
            elements.base = Some(buffers.view(document, view, accessor.byte_offset)?);
            if let Some(stride) = document.buffer_views[view].byte_stride {
                elements.stride = stride as usize;
            }
        }
        if let Some(sparse) = &accessor.sparse {
            let (at, values) = (&sparse.indices, &sparse.values);
            elements.sparse_values =
                buffers.view(document, values.buffer_view, values.byte_offset)?;
            let component =
                Component::from_code(at.component_type).expect("the document was checked");
            elements.sparse = buffers
                .view(document, at.buffer_view, at.byte_offset)?
                .chunks_exact(component.size() as usize)
                .take(sparse.count as usize)
                .map(|bytes| component.read_index(bytes))
                .collect();
            let ascending = elements.sparse.is_sorted_by(|a, b| a < b);
            let last = elements.sparse.last().copied().unwrap_or(0);
            if !ascending || u64::from(last) >= accessor.count.max(1) {
                return Err(GltfError::Value {
                    place: format!("accessors[{index}].sparse.indices"),
                    value: "do not ascend or exceed the count".into(),
                    expected: "ascending elements of the accessor",
                });
            }
        }
        Ok(elements)
    }

    /// An element's numbers, zeros behind the last.
    pub(crate) fn get(&self, element: usize) -> [f32; 4] {
        let mut numbers = [0.0; 4];
        if let Some(bytes) = self.bytes(element) {
            let Layout {
                component,
                components,
                ..
            } = self.layout;
            let size = component.size() as usize;
            for (i, number) in numbers.iter_mut().enumerate().take(components) {
                *number = component.read(&bytes[i * size..], self.normalized);
            }
        }
        numbers
    }

    /// An element that is a vertex index.
    pub(crate) fn get_index(&self, element: usize) -> u32 {
        self.bytes(element)
            .map_or(0, |bytes| self.layout.component.read_index(bytes))
    }

    fn bytes(&self, element: usize) -> Option<&'a [u8]> {
        // Without sparse elements, the usual case, this is a comparison with zero.
        match self.sparse.binary_search(&(element as u32)) {
            Ok(i) => Some(&self.sparse_values[i * self.layout.size as usize..]),
            Err(_) => self.base.map(|bytes| &bytes[element * self.stride..]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::check::check_document;
    use crate::gltf::document::parse_document;
    use crate::gltf::files::Files;
    use proptest::prelude::*;
    use serde_json::json;

    /// Reads accessor 0 of a document over one buffer.
    fn read<T>(
        bytes: &[u8],
        accessor: serde_json::Value,
        views: serde_json::Value,
        get: impl Fn(&Elements<'_>, usize) -> T,
    ) -> Result<Vec<T>, GltfError> {
        let document = json!({
            "asset": {"version": "2.0"}, "accessors": [accessor], "bufferViews": views,
            "buffers": [{"byteLength": bytes.len()}],
        });
        let document = parse_document(document.to_string().as_bytes())?;
        check_document(&document)?;
        let mut load = |_: &str| unreachable!();
        let buffers = Buffers::load(&document, Some(bytes), &mut Files::new(&mut load))?;
        let elements = Elements::open(&document, &buffers, 0)?;
        Ok((0..elements.count).map(|i| get(&elements, i)).collect())
    }

    proptest! {
        /// Floats come out bit by bit, wherever the accessor, the view and the stride put them.
        #[test]
        fn strided_floats_come_out_as_they_went_in(
            numbers in prop::collection::vec(prop::array::uniform3(any::<f32>()), 1..8),
            view_offset in 0..9usize,
            offset in 0..9usize,
            gap in 0..9usize,
        ) {
            let mut bytes = vec![0xAA; view_offset + offset];
            for (i, element) in numbers.iter().enumerate() {
                if i > 0 {
                    bytes.extend(vec![0xAA; gap]);
                }
                bytes.extend(element.iter().flat_map(|n| n.to_le_bytes()));
            }
            let read = read(
                &bytes,
                json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126,
                    "count": numbers.len(), "type": "VEC3"}),
                json!([{"buffer": 0, "byteOffset": view_offset,
                    "byteLength": bytes.len() - view_offset, "byteStride": 12 + gap}]),
                |elements, i| elements.get(i),
            ).unwrap();
            let bits = |n: &[f32]| n.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
            for (read, expected) in read.iter().zip(&numbers) {
                prop_assert_eq!(bits(&read[..3]), bits(expected));
                prop_assert_eq!(read[3], 0.0);
            }
            prop_assert_eq!(read.len(), numbers.len());
        }

        /// One byte or element less than the accessor needs is refused.
        #[test]
        fn an_accessor_beyond_its_view_is_refused(count in 1..9usize, offset in 0..9usize, more in 0..2usize) {
            let read = read(
                &[0; 200],
                json!({"bufferView": 0, "byteOffset": offset, "componentType": 5123, "count": count, "type": "VEC2"}),
                json!([{"buffer": 0, "byteLength": offset + count * 4 - more}]),
                |elements, i| elements.get(i),
            );
            prop_assert_eq!(read.is_ok(), more == 0);
        }

        /// Sparse elements replace those of the base, or zeros where there is none.
        #[test]
        fn sparse_elements_replace_the_base(
            base in prop::collection::vec(any::<u16>(), 8),
            new in prop::collection::btree_map(0..8u8, any::<u16>(), 1..8),
            has_base in any::<bool>(),
        ) {
            let mut bytes: Vec<u8> = base.iter().flat_map(|n| n.to_le_bytes()).collect();
            bytes.extend(new.keys());
            bytes.extend(new.values().flat_map(|n| n.to_le_bytes()));
            let read = read(
                &bytes,
                json!({"bufferView": if has_base { Some(0) } else { None }, "componentType": 5123, "count": 8,
                    "type": "SCALAR", "sparse": {"count": new.len(),
                    "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}}),
                json!([{"buffer": 0, "byteLength": 16},
                    {"buffer": 0, "byteOffset": 16, "byteLength": new.len()},
                    {"buffer": 0, "byteOffset": 16 + new.len(), "byteLength": 2 * new.len()}]),
                |elements, i| elements.get_index(i),
            ).unwrap();
            for (i, read) in (0..).zip(read) {
                let old = if has_base { base[i as usize] } else { 0 };
                prop_assert_eq!(read, u32::from(new.get(&i).copied().unwrap_or(old)));
            }
        }
    }

    /// All 256 bytes and all 65,536 words decode as the specification says.
    #[test]
    fn normalised_numbers_span_their_interval() {
        for bits in 0..=u16::MAX {
            let bytes = bits.to_le_bytes();
            let signed = i16::from_le_bytes(bytes);
            assert_eq!(Component::U16.read(&bytes, true), bits as f32 / 65535.0);
            assert_eq!(
                Component::I16.read(&bytes, true),
                (signed as f32 / 32767.0).max(-1.0)
            );
            assert_eq!(Component::I16.read(&bytes, false), signed as f32);
            let byte = bytes[0];
            assert_eq!(Component::U8.read(&bytes, true), byte as f32 / 255.0);
            assert_eq!(
                Component::I8.read(&bytes, true),
                (byte as i8 as f32 / 127.0).max(-1.0)
            );
        }
    }
}
