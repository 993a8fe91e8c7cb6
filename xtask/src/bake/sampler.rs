//! What of a scene is seen from where.

use super::grouped::Grouped;
use crate::drawn;
use crate::orbit::{FINER, Orbit};
use farfield_bitfields::{Bitfield, Lookup, with_neighbors};
use farfield_sampling::{NONE, Textures};
use farfield_scene::Scene;
use farfield_views::Camera;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Looks at a scene.
pub(crate) struct Sampler<'a> {
    /// What hides what is behind it.
    solid: Scene,
    textures: &'a Textures<'a>,
    pub(super) orbit: &'a Orbit,
    triangles: u32,
    /// What is seen from everywhere.
    always: Vec<Range<u32>>,
}

impl<'a> Sampler<'a> {
    pub(crate) fn new(scene: &Scene, textures: &'a Textures<'a>, orbit: &'a Orbit) -> Self {
        Self {
            solid: drawn::solid(scene),
            textures,
            orbit,
            triangles: scene.triangles.len() as u32,
            always: drawn::blended(scene),
        }
    }

    /// The triangles that can be seen from each offset from the centre.
    pub(crate) fn sets(&self, offsets: &[DVec3]) -> Vec<Bitfield> {
        self.seen_from(offsets, |set, _| set)
    }

    /// The same, and those that share a vertex with
    /// one of them and face the viewer: at grazing angles and between pixels these are seen next.
    pub(super) fn grown_sets(&self, offsets: &[DVec3], welded: &[[u32; 3]]) -> Vec<Bitfield> {
        self.seen_from(offsets, |set, offset| {
            with_neighbors(&set, welded, |id| self.faces(id, offset))
        })
    }

    /// Whether a triangle can be seen from a point, given from the centre, if nothing is before it.
    fn faces(&self, triangle: u32, point: DVec3) -> bool {
        let scene = &self.solid;
        let material = scene.triangle_materials[triangle as usize];
        let [a, b, c] = scene.triangles[triangle as usize]
            .map(|vertex| scene.positions[vertex as usize].as_dvec3());
        scene.materials[material as usize].double_sided || (b - a).cross(c - a).dot(point - a) > 0.0
    }

    fn seen_from(
        &self,
        offsets: &[DVec3],
        grown: impl Fn(Bitfield, DVec3) -> Bitfield + Sync,
    ) -> Vec<Bitfield> {
        let set = |offset: &DVec3| {
            let mut set = Bitfield::empty(self.triangles);
            let camera = self.orbit.recorder(*offset, FINER);
            drawn::ids(&self.solid, self.textures, &camera, |ids| {
                set.union_with(&Bitfield::from_ids(self.triangles, ids));
            });
            let mut set = grown(set, *offset);
            set.union_with(&Bitfield::from_ranges(self.triangles, &self.always));
            set
        };
        offsets.par_iter().map(set).collect()
    }

    /// The patches that pictures from offsets from the centre show, each with its number of pixels.
    pub(super) fn pictures(&self, grouped: &Grouped, offsets: &[DVec3]) -> Vec<Vec<[u32; 2]>> {
        let picture = |offset: &DVec3| {
            let mut counts = vec![0; grouped.patches.count() as usize];
            self.look(&self.orbit.camera(*offset), |id| {
                counts[grouped.patch_of[id as usize] as usize] += 1;
            });
            let counts = (0..).zip(counts).filter(|(_, pixels)| *pixels > 0);
            counts.map(|(patch, pixels)| [patch, pixels]).collect()
        };
        offsets.par_iter().map(picture).collect()
    }

    /// The triangles that a camera sees, each with its number of pixels, ascending.
    pub(crate) fn counted(&self, camera: &Camera) -> Vec<[u32; 2]> {
        let mut all = Vec::new();
        self.look(camera, |id| all.push(id));
        all.sort_unstable();
        let runs = all.chunk_by(|a, b| a == b);
        runs.map(|run| [run[0], run.len() as u32]).collect()
    }

    /// Names the triangle at each pixel that shows one.
    fn look(&self, camera: &Camera, mut name: impl FnMut(u32)) {
        let window = self.orbit.window(camera);
        drawn::ids(&self.solid, self.textures, &window, |ids| {
            ids.iter()
                .copied()
                .filter(|id| *id != NONE)
                .for_each(&mut name);
        });
    }

    /// How many pixels of views show what is not drawn for them, ascending.
    pub(super) fn missed(
        &self,
        lookup: &Lookup,
        grouped: &Grouped,
        views: u32,
        seed: u64,
    ) -> Vec<u64> {
        let missed = |view: u64| -> u64 {
            let camera = self.orbit.view(view, seed);
            let ranges = lookup.ranges(camera.pose.eye - self.orbit.center);
            let mut missed = 0;
            self.look(&camera, |id| {
                missed += u64::from(!is_in(ranges, grouped.places[id as usize]));
            });
            missed
        };
        let mut all: Vec<u64> = (0..u64::from(views)).into_par_iter().map(missed).collect();
        all.sort_unstable();
        all
    }
}

/// Whether one of some ascending ranges holds a place.
pub(crate) fn is_in(ranges: &[Range<u32>], place: u32) -> bool {
    let at = ranges.partition_point(|range| range.end <= place);
    ranges.get(at).is_some_and(|range| range.contains(&place))
}

/// The value that a share of ascending values do not exceed.
pub(crate) fn percentile(ascending: &[u64], share: f64) -> u64 {
    let at = (ascending.len() as f64 * share).ceil() as usize;
    ascending.get(at.max(1) - 1).copied().unwrap_or(0)
}
