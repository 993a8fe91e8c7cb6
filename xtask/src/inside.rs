//! Views from within a box, in any direction.

use crate::orbit::{MOST_PIXELS, number};
use crate::viewpoints::AIM_SEED;
use anyhow::{Result, bail};
use farfield_bitfields::{CellGrid, cube_map};
use farfield_bundle::ViewSpace;
use farfield_views::{Camera, Extent, Pose, ViewCell, direction_at, random_point};
use glam::DVec3;

/// Cells that a box is cut into: with more, their lists take more memory than the scene.
const MOST_CELLS: u64 = 10_000;

/// Into how many cells a box is cut, as the command line names it: `X,Y,Z`.
///
/// # Errors
///
/// When it is not, or into far too many.
pub fn cells_from_argument(text: &str) -> Result<[u32; 3], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.parse().ok()).collect();
    let counts = numbers.and_then(|numbers| <[u32; 3]>::try_from(numbers).ok());
    let counts = counts.ok_or("cells are three whole numbers X,Y,Z, such as 4,1,4")?;
    require_possible(counts)?;
    Ok(counts)
}

/// Refuses the size of a view cell that nobody can stand in, in metres.
///
/// # Errors
///
/// When it is flat.
pub fn require_volume(size: DVec3) -> Result<(), String> {
    match size.min_element() > 0.0 {
        true => Ok(()),
        false => Err(format!(
            "the view cell is {size} m large: give it a width, a height and a depth"
        )),
    }
}

fn require_possible(counts: [u32; 3]) -> Result<(), String> {
    let mut cells = counts.map(u64::from).into_iter();
    let count = cells.try_fold(1, u64::checked_mul);
    match count.is_some_and(|count| (1..=MOST_CELLS).contains(&count)) {
        true => Ok(()),
        false => Err(format!("a view cell is cut into 1 to {MOST_CELLS} cells")),
    }
}

/// A point as people name it, to millimetres.
pub(crate) fn point_name(point: DVec3) -> String {
    let rounded = point.to_array().map(|at| (at * 1e3).round() / 1e3);
    // -0 + 0 is 0.
    rounded.map(|at| number(at + 0.0)).join(",")
}

/// A box as the command line names it.
pub(crate) fn box_name(center: DVec3, size: DVec3) -> String {
    format!("box:{}:{}", point_name(center), point_name(size))
}

/// Cameras of one kind in a box that is cut into view cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inside {
    center: DVec3,
    /// Full lengths of the box's sides, in metres.
    size: DVec3,
    /// Cells along each axis.
    counts: [u32; 3],
    /// Full angle that pictures show, in radians.
    fov: f64,
    /// Pixels along each side of pictures.
    resolution: u32,
}

impl Inside {
    /// # Errors
    ///
    /// When the box is flat, or there are no cells or far too many.
    pub(crate) fn new(
        [center, size]: [DVec3; 2],
        counts: [u32; 3],
        fov: f64,
        resolution: u32,
    ) -> Result<Self> {
        require_volume(size).map_err(anyhow::Error::msg)?;
        if let Err(why) = require_possible(counts) {
            let [x, y, z] = counts;
            bail!("--cells {x},{y},{z}: {why}");
        }
        Ok(Self {
            center,
            size,
            counts,
            fov,
            resolution,
        })
    }

    /// All of it.
    pub(crate) fn cell(&self) -> ViewCell {
        ViewCell::Box {
            center: self.center,
            size: self.size,
        }
    }

    /// What it is cut into.
    pub(crate) fn grid(&self) -> CellGrid {
        let counts = self.counts.map(f64::from);
        CellGrid {
            min: self.center - self.size / 2.0,
            size: self.size / DVec3::from(counts),
            counts: self.counts,
        }
    }

    /// The index of the cell that has a viewpoint; of one outside, by a rounding or more, the nearest.
    pub(crate) fn list(&self, eye: DVec3) -> u32 {
        self.grid().nearest(eye)
    }

    /// As the manifest tells it.
    pub(crate) fn space(&self) -> ViewSpace {
        ViewSpace::Inside {
            view_cell: self.cell(),
            cells: self.counts,
        }
    }

    /// The camera that the promise is made for, at a viewpoint.
    fn camera(&self, eye: DVec3, direction: DVec3) -> Camera {
        Camera {
            pose: Pose::looking_along(eye, direction),
            extent: Extent::symmetric(self.fov, self.resolution, self.resolution),
            width: self.resolution,
            height: self.resolution,
        }
    }

    /// View `index` of an endless sequence of views that have nothing to do with each other, another one
    /// for each seed: 19 of 27 from faces, edges and corners of the box, the others from within, in
    /// uniformly distributed directions.
    pub(crate) fn view(&self, index: u64, seed: u64) -> Camera {
        let direction = direction_at(random_point(index, seed ^ AIM_SEED).truncate());
        let eye = self.cell().point_to_border(random_point(index, seed));
        self.camera(eye, direction)
    }

    /// Six cameras that see all around, in pixels `finer` times as fine as those of pictures where
    /// both are coarsest.
    pub(crate) fn around(&self, eye: DVec3, finer: f64) -> [Camera; 6] {
        cube_map(eye, self.recorded_pixels(finer) as u32)
    }

    /// Pixels along each side of the faces of such a cube map.
    fn recorded_pixels(&self, finer: f64) -> f64 {
        let pixel = 2.0 * (self.fov / 2.0).tan() / f64::from(self.resolution) / finer;
        (2.0 / pixel).ceil()
    }

    /// Refuses a box from which nothing can be made out.
    ///
    /// * `represented` - the scene's box
    ///
    /// # Errors
    ///
    /// When all of the scene is less than a pixel, seen from where the box is nearest to it.
    pub(crate) fn require_near(&self, [min, max]: [DVec3; 2]) -> Result<()> {
        let (center, size) = ((min + max) / 2.0, max - min);
        let between = (self.center - center).abs() - (self.size + size) / 2.0;
        let distance = between.max(DVec3::ZERO).length();
        let pixel = 2.0 * (self.fov / 2.0).tan() / f64::from(self.resolution);
        // An infinite distance is too far as well.
        if size.length() < pixel * distance {
            bail!(
                "seen from the view cell the scene is less than a pixel wide: bring --view-cell near to \
                 {} or into it",
                box_name(center, size)
            );
        }
        Ok(())
    }

    /// Refuses what takes too many pixels to look at.
    ///
    /// # Errors
    ///
    /// When a cube map would.
    pub(crate) fn require_pixels(&self, finer: f64) -> Result<()> {
        let pixels = self.recorded_pixels(finer);
        if pixels > MOST_PIXELS {
            bail!(
                "pictures all around, as fine as is needed, are {pixels:.0} pixels wide, more than \
                 {MOST_PIXELS}: lower the resolution, or widen the field of view"
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn insides() -> impl Strategy<Value = Inside> {
        let vector =
            |range: std::ops::Range<f64>| prop::array::uniform3(range).prop_map(DVec3::from);
        let counts = prop::array::uniform3(1..4u32);
        (
            prop_oneof![vector(-99.0..99.0), vector(-1e7..1e7)],
            vector(0.1..9.0),
            counts,
            20.0..120.0f64,
            16..600u32,
        )
            .prop_map(|(center, size, counts, fov, resolution)| {
                let inside = Inside::new([center, size], counts, fov.to_radians(), resolution);
                inside.expect("the box can be cut")
            })
    }

    proptest! {
        /// Views are taken from within the box, from cells of its grid, and those that follow each other
        /// look elsewhere.
        #[test]
        fn views_stay_inside(inside in insides(), index in 0..1000u64, seed: u64) {
            let camera = inside.view(index, seed);
            // At most 1e7 m from the origin numbers are 2e-9 m apart; three of them are rounded.
            const ROUNDING: f64 = 3e-9;
            prop_assert!(inside.cell().contains(camera.pose.eye, ROUNDING));
            let cells: Vec<ViewCell> = inside.grid().cells().collect();
            let cell = cells[inside.list(camera.pose.eye) as usize];
            prop_assert!(cell.contains(camera.pose.eye, ROUNDING));
            let axis = |index| inside.view(index, seed).pose.forward;
            prop_assert!(axis(index) != axis(index + 1));
        }

        /// The middle of a picture is seen all around as finely as it says.
        #[test]
        fn cube_maps_are_fine_enough(inside in insides(), finer in 1.0..3.0f64) {
            let picture = inside.view(0, 0).pixel_size().x;
            for camera in inside.around(inside.center, finer) {
                prop_assert!(camera.pixel_size().x * finer <= picture * (1.0 + 1e-9));
            }
        }
    }

    #[test]
    fn what_cannot_be_cut_is_refused() {
        for (size, counts, what) in [
            (DVec3::new(1.0, 0.0, 1.0), [1; 3], "a height"),
            (DVec3::ONE, [1, 0, 1], "--cells 1,0,1"),
            (DVec3::ONE, [u32::MAX; 3], "1 to 10000 cells"),
        ] {
            let error = Inside::new([DVec3::ZERO, size], counts, 0.8, 512).unwrap_err();
            assert!(error.to_string().contains(what), "{error}");
        }
        for (at, is_near) in [(0.0, true), (90.0, true), (1e4, false), (1e200, false)] {
            let center = DVec3::X * at;
            let inside = Inside::new([center, DVec3::ONE], [1; 3], 0.8, 512).unwrap();
            let near = inside.require_near([DVec3::NEG_ONE, DVec3::ONE]);
            assert_eq!(near.is_ok(), is_near, "{at}: {near:?}");
        }
        let inside = Inside::new([DVec3::ZERO, DVec3::ONE], [1; 3], 0.02, 16384).unwrap();
        assert!(inside.require_pixels(2.0).is_err());
    }
}
