//! The shaders' sources: constants from here, then the files a pipeline names.

use crate::comparison::{DIFFERENCE, SECOND, SPLIT};
use crate::layers::{IS_UNCOUNTED, IS_VAGUE, MOST_COUNTED};
use crate::placed::MASKED;
use crate::scene::{
    ATTRIBUTES, BENT_NORMAL, CLAMP_TO_EDGE, DOUBLE_SIDED, MIRRORED_REPEAT, NEAREST, UNLIT,
};

/// Of pipelines that draw ids.
pub(crate) fn ids() -> String {
    composed(&[
        include_str!("wgsl/scene.wgsl"),
        include_str!("wgsl/alpha.wgsl"),
        include_str!("wgsl/ids.wgsl"),
    ])
}

/// Of pipelines that draw colours.
pub(crate) fn display() -> String {
    composed(&[
        include_str!("wgsl/scene.wgsl"),
        include_str!("wgsl/alpha.wgsl"),
        include_str!("wgsl/display.wgsl"),
    ])
}

/// Of pipelines that find what triangles touch of layers.
pub(crate) fn layers() -> String {
    let numbers = [
        ("MASKED", MASKED),
        ("DOUBLE_SIDED", DOUBLE_SIDED),
        ("IS_VAGUE", IS_VAGUE),
        ("IS_UNCOUNTED", IS_UNCOUNTED),
        ("MOST_COUNTED", MOST_COUNTED),
    ];
    let constants = numbers.map(|(name, value)| format!("const {name} = {value}u;\n"));
    let doubt = format!("const SQUARE_DOUBT = {SQUARE_DOUBT:?};\n");
    constants.concat() + &doubt + include_str!("wgsl/layers.wgsl")
}

/// Of the pipeline that shows two pictures as one.
pub(crate) fn comparison() -> String {
    let constants = format!(
        "const SECOND = {SECOND}u;\nconst SPLIT = {SPLIT}u;\nconst DIFFERENCE = {DIFFERENCE}u;\n"
    );
    constants + include_str!("wgsl/comparison.wgsl")
}

/// Twice as much as a texel's square may be missed by and still count as touched, in texels, by whoever
/// looks exactly.
const SQUARE_DOUBT: f32 = 2.0 / (1 << 20) as f32;

/// Texel coordinates reach this far in both directions, so that they are numbers of 32 bits.
const FARTHEST: f32 = (1 << 29) as f32;

fn composed(files: &[&str]) -> String {
    let numbers = [
        ("ATTRIBUTES", ATTRIBUTES as u32),
        ("UNLIT", UNLIT),
        ("DOUBLE_SIDED", DOUBLE_SIDED),
        ("BENT_NORMAL", BENT_NORMAL),
        ("NEAREST", NEAREST),
        ("MIRRORED_REPEAT", MIRRORED_REPEAT),
        ("CLAMP_TO_EDGE", CLAMP_TO_EDGE),
    ];
    let constants = numbers.map(|(name, value)| format!("const {name} = {value}u;\n"));
    let farthest = format!("const FARTHEST = {FARTHEST:.1};\n");
    constants.concat() + &farthest + &files.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Placement, View};
    use crate::comparison::Shown;
    use crate::layers::{HEADER, Header, Task};
    use crate::placed::Placed;
    use crate::scene::{Instance, Material};
    use std::mem::offset_of;
    use wgpu::naga::{
        self,
        valid::{Capabilities, ValidationFlags, Validator},
    };

    fn module(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        if let Err(error) = validator.validate(&module) {
            panic!("{}", error.emit_to_string(source));
        }
        module
    }

    /// Without capabilities beyond WebGPU's own.
    #[test]
    fn shaders_are_valid() {
        for source in [ids(), display()] {
            let entries = module(&source).entry_points;
            let names: Vec<_> = entries.iter().map(|entry| entry.name.as_str()).collect();
            assert_eq!(names, ["vertex", "opaque", "masked"]);
        }
        let entries = module(&layers()).entry_points;
        let names: Vec<_> = entries.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["vertex", "sure", "possible"]);
        let entries = module(&comparison()).entry_points;
        let names: Vec<_> = entries.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["vertex", "fragment"]);
    }

    /// Members of a shader's struct with their offsets, and its size.
    fn layout(name: &str) -> (Vec<(String, u32)>, u32) {
        layout_in(&display(), name)
    }

    fn layout_in(source: &str, name: &str) -> (Vec<(String, u32)>, u32) {
        let module = module(source);
        let found = module
            .types
            .iter()
            .find(|(_, ty)| ty.name.as_deref() == Some(name));
        let (_, ty) = found.unwrap_or_else(|| panic!("no shader has {name}"));
        let naga::TypeInner::Struct { members, span } = &ty.inner else {
            panic!("{name} is no struct")
        };
        let member = |m: &naga::StructMember| (m.name.clone().unwrap(), m.offset);
        (members.iter().map(member).collect(), *span)
    }

    /// Rust's fields with their offsets, and its size.
    macro_rules! fields {
        ($of:ty: $($field:ident),*) => {(
            vec![$((stringify!($field).to_owned(), offset_of!($of, $field) as u32)),*],
            size_of::<$of>() as u32,
        )};
    }

    #[test]
    fn structs_are_laid_out_alike() {
        assert_eq!(
            layout("View"),
            fields!(View: to_sun, sun, sky, ground, near)
        );
        assert_eq!(layout("Placement"), fields!(Placement: x, y, depth));
        let instance = fields!(Instance: x, object, y, mirrored, z, padding);
        assert_eq!(layout("Instance"), instance);
        let material = fields!(Material: base_color, emissive, cutoff, normal_scale, flags, wrap);
        assert_eq!(layout("Material"), material);
        let placed =
            fields!(Placed: x, y, depth, doubt, first_drawn, first_triangle, winding, padding);
        assert_eq!(layout_in(&layers(), "Placed"), placed);
        let task = fields!(Task: half, width, texels, begin, end, layers, objects, corners, room);
        assert_eq!(layout_in(&layers(), "Task"), task);
        let (mut touches, _) = fields!(Header: count, wrong);
        touches.push(("list".to_owned(), HEADER as u32));
        assert_eq!(layout_in(&layers(), "Touches").0, touches);
        let (shown, span) = fields!(Shown: background, mode, gain, border);
        assert_eq!(layout_in(&comparison(), "Shown"), (shown, span));
    }
}
