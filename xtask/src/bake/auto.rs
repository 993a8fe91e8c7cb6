//! Which technique is cheaper, told from recorded layers before quads or meshes are made of them.
//!
//! What counts is bytes of uncompressed pages, and [`TRIANGLE_BYTES`] a triangle. Both are predicted as
//! powers of what the layers hold; for how good that is, see [`LAYERED`] and [`TDM`].

use super::Making;
use super::recording::{Settings, cull, place};
use crate::console::Console;
use crate::device::Device;
use crate::parts::Part;
use anyhow::Result;
use farfield_sampling::{Recording, Textures};
use farfield_scene::Scene;
use glam::Vec3;
use rayon::prelude::*;

/// What a triangle counts, in bytes: half of what a quad takes in the file.
pub const TRIANGLE_BYTES: u64 = 52;

/// What recorded layers hold, as far as it can be seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Survey {
    /// Texels.
    pub texels: f64,
    /// Rectangles that the texels of each layer make: a texel counts as one over the texels side by
    /// side with it in its row, and over those in its column. So a rectangle counts as one.
    pub rectangles: f64,
    /// Sides of texels beside which no surface goes on in about the same direction: neither the layer
    /// nor those before and behind it have one there.
    pub turns: f64,
    /// Triangles of the scene that the texels show, those of shared meshes once per object.
    pub triangles: f64,
}

/// Surveys the layers of a scene's impostor, which are placed, recorded and culled for it.
///
/// # Errors
///
/// As for [`place`].
pub fn survey(
    scene: &Scene,
    textures: &Textures<'_>,
    settings: &Settings,
    device: &Device,
    console: &Console,
) -> Result<Survey> {
    let stack = place(scene, settings)?;
    let Settings { cell, foliage, .. } = settings;
    let recording = device.record(scene, textures, &stack, cell, *foliage, console);
    Ok(counted(scene, &cull(&recording, stack.width, stack.height)))
}

/// Counts what is left of a recording of a scene after culling.
///
/// Takes time in proportion to n log n for n texels.
fn counted(scene: &Scene, visible: &Recording) -> Survey {
    let samples = visible.samples.iter();
    let mut triangles: Vec<[u32; 2]> = samples
        .map(|sample| [sample.hit.object, sample.hit.triangle])
        .collect();
    triangles.par_sort_unstable();
    triangles.dedup();
    let rectangles = visible.layers.iter().map(|run| {
        let samples = &visible.samples[run.clone()];
        let texels: Vec<[u16; 2]> = samples.iter().map(|sample| [sample.x, sample.y]).collect();
        rectangles(&texels)
    });
    Survey {
        texels: visible.samples.len() as f64,
        rectangles: rectangles.sum(),
        turns: turns(scene, visible) as f64,
        triangles: triangles.len() as f64,
    }
}

/// Cosine of the angle up to which directions are about the same.
const ALIKE: f32 = 0.97;

/// Sides of texels beside which no surface goes on in about the same direction, in the layers about
/// theirs.
fn turns(scene: &Scene, visible: &Recording) -> usize {
    let layers = (0u32..).zip(&visible.layers);
    // One texel to the right and down, so that all have neighbours to the left and above.
    let mut voxels: Vec<([u32; 3], Vec3)> = layers
        .flat_map(|(layer, run)| {
            visible.samples[run.clone()].iter().map(move |sample| {
                let place = [u32::from(sample.y) + 1, u32::from(sample.x) + 1, layer + 1];
                (place, sample.hit.normal_in_world(scene).as_vec3())
            })
        })
        .collect();
    voxels.par_sort_unstable_by_key(|(place, _)| *place);
    let goes_on = |[y, x, layer]: [u32; 3], normal: Vec3| {
        let first = voxels.partition_point(|(place, _)| *place < [y, x, layer - 1]);
        let from_there = voxels[first..].iter();
        let mut about = from_there.take_while(|(place, _)| *place <= [y, x, layer + 1]);
        about.any(|(_, other)| other.dot(normal).abs() > ALIKE)
    };
    let turns_of = |([y, x, layer], normal): &([u32; 3], Vec3)| {
        let sides = [[y - 1, *x], [y + 1, *x], [*y, x - 1], [*y, x + 1]];
        let ends = |[y, x]: &[u32; 2]| !goes_on([*y, *x, *layer], *normal);
        sides.iter().filter(|side| ends(side)).count()
    };
    voxels.par_iter().map(turns_of).sum()
}

/// Rectangles that texels make, each of them one.
fn rectangles(texels: &[[u16; 2]]) -> f64 {
    let [rows, columns] = [0, 1].map(|axis| run_lengths(texels, axis));
    let shares = rows.iter().zip(columns);
    shares
        .map(|(row, column)| 1.0 / (f64::from(*row) * f64::from(column)))
        .sum()
}

/// Of each texel, how many lie side by side with it, along x (0) or y (1).
fn run_lengths(texels: &[[u16; 2]], axis: usize) -> Vec<u32> {
    let place = |index: &usize| [texels[*index][1 - axis], texels[*index][axis]];
    let mut order: Vec<usize> = (0..texels.len()).collect();
    order.sort_unstable_by_key(place);
    let mut lengths = vec![0; texels.len()];
    let is_next = |a: &usize, b: &usize| {
        let ([line, at], next) = (place(a), place(b));
        next == [line, at + 1]
    };
    for run in order.chunk_by(is_next) {
        run.iter()
            .for_each(|index| lengths[*index] = run.len() as u32);
    }
    lengths
}

/// A cost in bytes that is predicted as `factor` times powers of two counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Powers {
    /// Bytes where both counts are 1.
    pub factor: f64,
    /// Of the counts.
    pub exponents: [f64; 2],
}

impl Powers {
    fn of(&self, counts: [f64; 2]) -> f64 {
        self.factor * counts[0].powf(self.exponents[0]) * counts[1].powf(self.exponents[1])
    }
}

/// The cost of layered impostors, of their texels and rectangles.
///
/// Fitted by least squares of logarithms on 23 bakes at 512 x 512 pixels, among them the built-in house
/// at seven distances; `cargo bench -p farfield-benches -- auto` does it again. It is off by 5 % on
/// average there, and by 8 % for 12 bakes that it was not fitted on. Which counts to take was chosen with
/// all of these in sight, so elsewhere it may be worse.
pub const LAYERED: Powers = Powers {
    factor: 36.6,
    exponents: [0.684, 0.307],
};

/// The cost of textured depth meshes with voxels enlarged by 1.5, of turns and triangles of the scene:
/// where a surface goes on as it is, a mesh needs no vertices and has large charts.
///
/// Fitted like [`LAYERED`]. It is off by 42 % on average there, and by 48 % for the other bakes: a house
/// costs a third to two thirds of what is predicted, leaves and houses of a city, each a mesh of its own,
/// two or three times as much. The technique that is predicted to cost less does so in 19 of the 23 bakes,
/// and in 11 of the 12.
pub const TDM: Powers = Powers {
    factor: 13.5,
    exponents: [1.026, 0.011],
};

/// Bytes that are predicted for layers of a survey as quads.
pub fn layered_bytes(survey: &Survey) -> f64 {
    LAYERED.of([survey.texels, survey.rectangles])
}

/// Bytes that are predicted for layers of a survey as a mesh.
pub fn tdm_bytes(survey: &Survey) -> f64 {
    TDM.of([survey.turns, survey.triangles])
}

/// What impostors cost, in bytes, and what was counted for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Forecast {
    counted: Survey,
    layered: f64,
    tdm: f64,
}

impl Forecast {
    /// Adds what the impostor of a part of a scene will cost, which is recorded for it.
    pub(super) fn add(
        &mut self,
        part: &Part<'_>,
        textures: &Textures<'_>,
        settings: &Settings,
        device: &Device,
        console: &Console,
    ) -> Result<()> {
        let found = survey(&part.scene, textures, settings, device, console)?;
        self.counted.texels += found.texels;
        self.counted.rectangles += found.rectangles;
        self.counted.turns += found.turns;
        self.counted.triangles += found.triangles;
        self.layered += layered_bytes(&found);
        self.tdm += tdm_bytes(&found);
        Ok(())
    }

    /// Bytes that a technique is predicted to cost.
    pub(super) fn bytes(&self, making: Making) -> f64 {
        match making {
            Making::Layered { .. } => self.layered,
            Making::Tdm { .. } => self.tdm,
        }
    }
}

impl std::fmt::Display for Forecast {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "about {:.0} kB are predicted of layers, {:.0} kB of a mesh: {} texels in {:.0} rectangles, with \
             {} sides where their surfaces end or turn, show {} triangles",
            self.layered / 1e3,
            self.tdm / 1e3,
            self.counted.texels,
            self.counted.rectangles,
            self.counted.turns,
            self.counted.triangles
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Rectangles that touch nothing count as one each, and each texel alone too.
        #[test]
        fn a_rectangle_counts_as_one(
            sizes in prop::collection::vec([1..9u16, 1..9u16], 1..9),
            seed in any::<u64>(),
        ) {
            let mut texels = Vec::new();
            let mut left = 0;
            for [width, height] in &sizes {
                texels.extend((0..*height).flat_map(|y| (0..*width).map(move |x| [left + x, y])));
                left += width + 1;
            }
            // In any order.
            let length = texels.len();
            texels.rotate_left(seed as usize % length);
            let found = rectangles(&texels);
            // A rounding error for each texel.
            prop_assert!((found - sizes.len() as f64).abs() < 1e-12, "{}", found);

            let checkers: Vec<[u16; 2]> = (0..81).map(|i| [i % 9, i / 9]).collect();
            let black: Vec<_> = checkers.into_iter().filter(|[x, y]| (x + y) % 2 == 0).collect();
            prop_assert_eq!(rectangles(&black), black.len() as f64);
        }
    }
}
