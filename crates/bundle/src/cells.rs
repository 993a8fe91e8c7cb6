//! What ID-bitfields draw from a view cell.

use crate::BundleError;
use crate::check::{Checked, check_header};
use crate::lists;
use crate::manifest::{BitfieldsBody, Manifest};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The name of the file in a bundle's folder.
pub const CELLS_FILE: &str = "cells.json";

/// The value of [`CellLists::format`].
pub const CELLS_FORMAT: &str = "farfield-cells";

/// The value of [`CellLists::version`] that this crate writes and reads.
pub const CELLS_VERSION: u32 = 1;

/// The JSON schema of `cells.json`, draft 2020-12. It is also a file beside this crate's source.
pub const CELLS_SCHEMA: &str = include_str!("../schema/cells-1.schema.json");

/// What of `impostors.glb` can be seen from which view cell, in any direction.
///
/// The box of the manifest's `options.view_space.view_cell` is cut into as many equal cells along x, y
/// and z as `options.view_space.cells` says. The cell of a camera is
/// (z rows + y) columns + x, with columns and rows the cells along x and y, and x, y, z the camera's
/// place in the box, each in cells, rounded down, and at least 0 and at most the last one: a camera on
/// the far border of the box is in the last cell, and one outside has the list of the nearest.
///
/// What is drawn is counted and drawn as that of faces is; see [`FaceLists`](crate::FaceLists).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellLists {
    /// Always "farfield-cells".
    #[schemars(extend("const" = CELLS_FORMAT))]
    pub format: String,
    /// The format's version: 1.
    #[schemars(extend("const" = CELLS_VERSION))]
    pub version: u32,
    /// The first triangle of each primitive of the mesh in `impostors.glb`, and behind them the number
    /// of all.
    pub parts: Vec<u32>,
    /// Ascending in x first, then in y, then in z.
    pub cells: Vec<CellRecord>,
}

/// What is drawn from one view cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellRecord {
    /// Triangles from the first to before the second, in ascending order; may be none.
    pub draw: Vec<[u32; 2]>,
}

impl CellLists {
    /// The file's text: one line for each cell.
    ///
    /// # Panics
    ///
    /// Never: whole numbers are JSON.
    pub fn to_json(&self) -> String {
        let text = |value: serde_json::Result<String>| value.expect("whole numbers are JSON");
        let cells = self.cells.iter();
        let cells: Vec<String> = cells
            .map(|cell| text(serde_json::to_string(cell)))
            .collect();
        format!(
            "{{\n  \"format\": {:?},\n  \"version\": {},\n  \"parts\": {},\n  \"cells\": [\n    {}\n  ]\n}}\n",
            self.format,
            self.version,
            text(serde_json::to_string(&self.parts)),
            cells.join(",\n    ")
        )
    }

    /// Checks that ranges are in order and each in one part, and that all is as the manifest says.
    ///
    /// # Errors
    ///
    /// The first thing found wrong.
    pub fn check(&self, body: &BitfieldsBody) -> Checked {
        check_header(&self.format, self.version, CELLS_FORMAT, CELLS_VERSION)?;
        let lists = self.cells.iter().map(|cell| &cell.draw[..]);
        lists::check(lists, &self.parts, body, "cells")
    }
}

/// Reads the lists of the bundle in the folder `dir`, whose manifest was read from there.
///
/// Takes memory in proportion to the file, of which at most 64 MiB are read.
///
/// # Errors
///
/// When the bundle has none, or they cannot be true; the error names the file and the place in it.
pub fn read_cells(dir: &Path, manifest: &Manifest) -> Result<CellLists, BundleError> {
    lists::read(dir, manifest, CELLS_FILE, CellLists::check)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{check_schema, sample_bitfields_body};

    /// Two cells that draw ten of twenty triangles each, of two parts.
    fn lists() -> (CellLists, BitfieldsBody) {
        let cell = |i: u32| CellRecord {
            draw: vec![[i, i + 4], [12, 18]],
        };
        let lists = CellLists {
            format: CELLS_FORMAT.into(),
            version: CELLS_VERSION,
            parts: vec![0, 12, 20],
            cells: (0..2).map(cell).collect(),
        };
        let body = BitfieldsBody {
            lists: 2,
            ranges: 4,
            ..sample_bitfields_body()
        };
        (lists, body)
    }

    /// The text is JSON that gives the lists back.
    #[test]
    fn lists_round_trip() {
        let (lists, body) = lists();
        assert_eq!(lists.check(&body), Ok(()));
        let back: CellLists = serde_json::from_str(&lists.to_json()).unwrap();
        assert_eq!(back, lists);
    }

    /// Whatever is damaged, the check names the place.
    #[test]
    fn every_damage_is_found() {
        type Damage = fn(&mut CellLists, &mut BitfieldsBody);
        let damages: [(&str, Damage); 9] = [
            ("format", |l, _| l.format = "farfield-faces".into()),
            ("version", |l, _| l.version = 2),
            ("parts", |l, _| l.parts[0] = 1),
            ("parts", |_, b| b.triangles = 21),
            ("cells", |l, _| {
                l.cells.pop();
            }),
            ("cells", |_, b| b.most_ranges = 3),
            ("cells", |_, b| b.culled = 0.4),
            ("cells[1].draw[1]", |l, _| l.cells[1].draw[1] = [4, 10]),
            ("cells[1].draw[1]", |l, _| l.cells[1].draw[1] = [11, 17]),
        ];
        for (i, (place, damage)) in damages.into_iter().enumerate() {
            let (mut lists, mut body) = lists();
            damage(&mut lists, &mut body);
            let found = lists.check(&body).map_err(|e| e.place);
            assert_eq!(found, Err(place.to_owned()), "damage {i}");
        }
    }

    /// The schema beside the source is that of the types.
    #[test]
    fn the_schema_is_current() {
        let schema = schemars::schema_for!(CellLists);
        check_schema("cells-1.schema.json", CELLS_SCHEMA, &schema);
    }
}
