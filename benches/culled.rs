//! What ID-bitfields leave to draw, beside what else engines draw less by: back-face culling,
//! cones of meshlets, and, as about the least that any of these could draw, what an id buffer shows from
//! where the picture is taken.

use crate::bitfields::{SAMPLES, drawn, percentile};
use crate::meshlets::Meshlets;
use crate::models;
use crate::numbered::{BUFFER, FARTHEST, Numbered, PICTURES};
use farfield_bitfields::{
    Bitfield, FaceRanges, Lookup, PatchSettings, Triangulation, United, even_directions, face_sets,
    patches,
};
use farfield_sampling::{NONE, Textures};
use glam::DVec3;

const MODELS: [models::Entry; 5] = [
    models::DENSE[0],
    models::DENSE[1],
    models::DENSE[2],
    models::LARGE[0],
    models::DENSE[3],
];

/// What meshlets hold at most, as meshoptimizer recommends, and how much the spread of their
/// normals counts beside their size.
const MESHLET_VERTICES: usize = 64;
const MESHLET_TRIANGLES: usize = 124;
const CONE_WEIGHT: f32 = 0.5;

/// What is kept for a meshlet's test: the cone's apex, axis and cutoff.
const CONE_BYTES: usize = 28;

/// A picture's own set is that of an id buffer of so many times the pixels along each side, taken for every
/// so many pictures. What is smaller than its pixels is missing.
const OWN_SCALE: u32 = 2;
const OWN_STEP: usize = 8;

/// Prints the table.
pub(crate) fn table() {
    println!(
        "\nPrimitives drawn (mean over {PICTURES} pictures at distances up to {FARTHEST} times the \
         least), bytes kept for that, and pixels missed, at the 95th percentile and in the worst. \
         Each picture's own are what {} x {} pixels show from there, of every {OWN_STEP}th picture.\n",
        OWN_SCALE * BUFFER[0],
        OWN_SCALE * BUFFER[1]
    );
    println!("| model | way | drawn | of all | bytes | missed |\n|---|---|---|---|---|---|");
    for model in models::read(&MODELS) {
        rows(&Numbered::new(model.name, model.scene));
    }
}

fn rows(model: &Numbered) {
    let textures = Textures::new(&model.scene);
    let distances = model.distances();
    let pictures = model.pictures(&textures, &distances);
    let row = |way: &str, bytes: usize, step: usize, drawn: &dyn Fn(DVec3) -> Bitfield| {
        let (mut count, mut missed) = (0.0, Vec::new());
        for (offset, ids) in pictures.iter().step_by(step) {
            let drawn = drawn(*offset);
            count += f64::from(drawn.len());
            let hidden = |id: &&u32| **id != NONE && !drawn.contains(**id);
            missed.push(ids.iter().filter(hidden).count() as u32);
        }
        missed.sort_unstable();
        let count = count / missed.len() as f64;
        println!(
            "| {} | {way} | {count:.0} | {:.1} % | {bytes} | {}, {} |",
            model.name,
            100.0 * count / f64::from(model.primitives),
            percentile(&missed, 0.95),
            percentile(&missed, 1.0),
        );
    };
    row("all", 0, OWN_STEP, &|_| model.those(|_| true));

    let any_double_sided = model.double_sided.contains(&true);
    row("back faces", 0, 1, &|offset| {
        model.those(|id| model.shows(id, model.center + offset))
    });
    if any_double_sided {
        row("back faces, all single-sided", 0, 1, &|offset| {
            model.those(|id| model.fronts(id, model.center + offset))
        });
    }
    let meshlets = meshlets(model);
    let bytes = CONE_BYTES * meshlets.primitives.len();
    row("cones of meshlets", bytes, 1, &|offset| {
        meshlets.drawn(model, offset, false)
    });
    if any_double_sided {
        row("cones of meshlets, all single-sided", bytes, 1, &|offset| {
            meshlets.drawn(model, offset, true)
        });
    }

    let directions = even_directions(SAMPLES);
    let offsets = distances.viewpoints(&directions);
    let faces = Triangulation::new(&directions, DVec3::ZERO).expect("directions are all around");
    let seen = model.sets(&textures, &offsets);
    let ways = [
        ("", seen.clone()),
        (", neighbours", model.grown(&seen, &offsets)),
    ];
    for (also, sets) in ways {
        let united = face_sets(&faces, &distances.unite(&sets), United::Six);
        let lists = FaceRanges::from_sets(&united);
        let settings = PatchSettings::default();
        let patches = patches(&model.centers(), &faces, &united, settings.most_primitives);
        let joined = patches.ranges(&united, settings.most_ranges);
        let in_patches = drawn(&joined, &patches.order);
        let bytes = [lists.bytes(), joined.bytes()];
        let lookup = Lookup::new(faces.clone(), lists);
        let of = |sets: &[Bitfield], offset| sets[lookup.face(offset) as usize].clone();
        let way = |list: &str| format!("{SAMPLES} samples{also}: {list}");
        row(&way("primitives"), bytes[0], 1, &|offset| {
            of(&united, offset)
        });
        row(&way("patches"), bytes[1], 1, &|offset| {
            of(&in_patches, offset)
        });
        row(&way("patches, then back faces"), bytes[1], 1, &|offset| {
            let drawn = of(&in_patches, offset);
            let eye = model.center + offset;
            model.those(|id| drawn.contains(id) && model.shows(id, eye))
        });
    }
    let pixels = BUFFER.map(|side| OWN_SCALE * side);
    row("each picture's own", 0, OWN_STEP, &|offset| {
        Bitfield::from_ids(model.primitives, &model.ids(&textures, offset, pixels))
    });
}

/// Groups of primitives that face much the same way.
fn meshlets(model: &Numbered) -> Meshlets {
    Meshlets::new(model, |triangles, places| {
        meshopt::build_meshlets(
            triangles,
            places,
            MESHLET_VERTICES,
            MESHLET_TRIANGLES,
            CONE_WEIGHT,
        )
    })
}

impl Meshlets {
    /// Those of the meshlets that do not all face away; where a material is seen from both sides,
    /// none does, unless all are taken for single-sided.
    fn drawn(&self, model: &Numbered, offset: DVec3, all_single_sided: bool) -> Bitfield {
        let mut drawn = Bitfield::empty(model.primitives);
        for (members, &(apex, axis, cutoff)) in self.primitives.iter().zip(&self.cones) {
            let single = |id: &u32| !model.double_sided[*id as usize];
            let away = (apex - offset.as_vec3()).normalize_or_zero().dot(axis) >= cutoff;
            if !(away && (all_single_sided || members.iter().all(single))) {
                members.iter().for_each(|id| drawn.insert(*id));
            }
        }
        drawn
    }
}
