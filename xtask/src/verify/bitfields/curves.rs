//! Culling and missed pixels over the number of samples. Meruvia Pastor and Strothotte plot the former
//! (Figure 5); of missed pixels they tell those of one view of each model with 25 samples (Figure 7).

use super::super::report::OverSamples;
use crate::bake::{Sampler, percentile, sets};
use crate::orbit::Orbit;
use crate::viewpoints::SEED;
use farfield_bitfields::{
    FaceRanges, Lookup, Triangulation, United, culled_share, even_directions, face_sets,
    missed_pixels,
};
use farfield_sampling::Textures;
use farfield_scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// Numbers of samples: the paper's 14 and 25, fewer, and as many as adaptive ones grow to. More would take
/// longer than all these, and than looking at the views.
const COUNTS: [u32; 4] = [6, 14, 25, 55];

/// Views that samples are judged by.
const VIEWS: u64 = 64;

/// Without patches and without more samples where something is missed: even samples, united by three
/// and by six, list triangles one by one.
pub(super) fn over_samples(
    original: &Scene,
    textures: &Textures<'_>,
    orbit: &Orbit,
) -> Vec<OverSamples> {
    let sampler = Sampler::new(original, textures);
    let views: Vec<(DVec3, Vec<[u32; 2]>)> = (0..VIEWS)
        .into_par_iter()
        .map(|view| {
            let camera = orbit.view(view, SEED);
            let seen = sampler.counted(&[orbit.window(&camera)]);
            (camera.pose.eye - orbit.center, seen)
        })
        .collect();
    let of_count = |count| {
        let directions = even_directions(count);
        let faces = Triangulation::new(&directions, DVec3::ZERO).expect("they are all around");
        let distances = orbit.sampled();
        let offsets = distances.viewpoints(&directions);
        let sets = distances.unite(&sets(&sampler, orbit, &offsets));
        let [three, six] = [United::Three, United::Six].map(|samples| {
            let united = face_sets(&faces, &sets, samples);
            let lookup = Lookup::new(faces.clone(), FaceRanges::from_sets(&united));
            let missed = views.iter().map(|(direction, seen)| {
                missed_pixels(seen, &united[lookup.face(*direction) as usize])
            });
            let mut missed: Vec<u64> = missed.collect();
            missed.sort_unstable();
            let culled = culled_share(lookup.lists(), original.triangles.len() as u32);
            (culled, percentile(&missed, 0.95))
        });
        OverSamples {
            samples: count,
            culled_by_three: three.0,
            culled_by_six: six.0,
            missed_by_three: three.1,
            missed_by_six: six.1,
        }
    };
    COUNTS.into_iter().map(of_count).collect()
}
