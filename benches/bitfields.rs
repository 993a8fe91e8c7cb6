//! ID-bitfields: the experiment of Meruvia Pastor and Strothotte, how sets are best stored, and what
//! patches and lookups cost.

use crate::meshlets::Meshlets;
use crate::models;
use crate::numbered::{BUFFER, FARTHEST, Numbered, PICTURE, PICTURES, counted};
use farfield_bitfields::{
    Adapted, AdaptiveSettings, Bitfield, Distances, Face, FaceRanges, Lookup, PatchSettings,
    Patches, Triangulation, United, adapt, culled_share, even_directions, face_sets, patches,
};
use farfield_bundle::{FACES_FORMAT, FACES_VERSION, FaceLists, FaceRecord};
use farfield_sampling::{NONE, Textures};
use farfield_views::sphere_direction;
use glam::DVec3;
use meshopt::VertexDataAdapter;
use roaring::RoaringBitmap;
use std::hint::black_box;
use std::ops::Range;
use std::time::Instant;

/// The paper's samples.
pub(crate) const SAMPLES: u32 = 25;

const MODELS: [models::Entry; 4] = [
    models::DENSE[0],
    models::DENSE[1],
    models::DENSE[2],
    models::LARGE[0],
];

/// A model with its samples, and the pictures that they are judged by.
struct Sampled<'a> {
    model: &'a Numbered,
    /// Of samples.
    distances: Distances,
    faces: Triangulation,
    sets: Vec<Bitfield>,
    pictures: Vec<(DVec3, Vec<u32>)>,
}

/// Prints all tables.
pub(crate) fn tables() {
    let read = models::read(&MODELS).into_iter();
    let models: Vec<Numbered> = read
        .map(|model| Numbered::new(model.name, model.scene))
        .collect();
    let sampled: Vec<Sampled<'_>> = models.iter().map(|m| sample(m, nearest(m))).collect();
    views_table(&sampled);
    sets_table(&sampled);
    patches_table(&sampled);
    buffers(&sampled);
    unions();
    lookups(&sampled);
}

/// The paper's distances of buffers and of pictures: both as near as they can be.
fn nearest(model: &Numbered) -> [Distances; 2] {
    [BUFFER, [PICTURE; 2]].map(|pixels| Distances::only(model.distance(pixels)))
}

/// Prints the table of patches alone.
///
/// * `name` - of the only model that it is to be of; empty for all
///
/// # Panics
///
/// When there is no model of this name; names the others.
pub(crate) fn patches_tables(name: &str) {
    let models = models::read(&chosen(name, &MODELS, |entry| entry.0)).into_iter();
    for model in models {
        let model = Numbered::new(model.name, model.scene);
        patches_table(&[sample(&model, nearest(&model))]);
    }
}

/// The entry of a name, or all where it is empty.
fn chosen<T: Copy>(name: &str, all: &[T], name_of: impl Fn(&T) -> &'static str) -> Vec<T> {
    let chosen = all
        .iter()
        .filter(|one| name.is_empty() || name_of(one) == name);
    let chosen: Vec<T> = chosen.copied().collect();
    let names: Vec<&str> = all.iter().map(name_of).collect();
    assert!(
        !chosen.is_empty(),
        "there is no {name}, but {}",
        names.join(", ")
    );
    chosen
}

/// Prints the tables of samples at two distances, judged by pictures at any between.
pub(crate) fn distances_table() {
    for model in models::read(&MODELS) {
        let model = Numbered::new(model.name, model.scene);
        ranges_table(&model);
        views_table(&[sample(&model, [model.distances(); 2])]);
    }
}

/// What ranges of distances cost: from where pictures just hold the model to where id buffers do, to twice
/// and to four times as far.
fn ranges_table(model: &Numbered) {
    println!(
        "\n{}, {SAMPLES} samples at either end of a range of distances, united by six; distances in radii \
         of the model.\n",
        model.name
    );
    println!("| nearest | farthest | culled | missed |\n|---|---|---|---|");
    let [nearest, of_buffers] = [[PICTURE; 2], BUFFER].map(|size| model.distance(size));
    for farthest in [of_buffers, 2.0 * nearest, 4.0 * nearest] {
        let distances = Distances {
            nearest,
            farthest,
            samples: 2,
        };
        let Sampled {
            faces,
            sets,
            pictures,
            ..
        } = sample(model, [distances; 2]);
        let united = face_sets(&faces, &sets, United::Six);
        let share = culled_share(&FaceRanges::from_sets(&united), model.primitives);
        let missed = missed(&pictures, &faces, &united);
        let [half, most, worst] = [0.5, 0.95, 1.0].map(|share| percentile(&missed, share));
        println!(
            "| {:.2} | {:.2} | {:.1} % | {half}, {most}, {worst} |",
            nearest / model.radius,
            farthest / model.radius,
            100.0 * share
        );
    }
}

/// Prints the table of viewpoints that are added where they are needed, a matter of an hour.
///
/// * `name` - of the only model that it is to be of; empty for all
///
/// # Panics
///
/// When there is no model of this name; names the others.
pub(crate) fn adaptive_tables(name: &str) {
    // A picture of the dragon takes ten times as long.
    let models = [(MODELS[0], 3000), (MODELS[2], 3000), (MODELS[3], 1000)];
    for (entry, clean_views) in chosen(name, &models, |(entry, _)| entry.0) {
        for model in models::read(&[entry]) {
            let model = Numbered::new(model.name, model.scene);
            adaptive(&model, clean_views);
        }
    }
}

/// * `distances` - of samples and of pictures
fn sample(model: &Numbered, [distances, of_pictures]: [Distances; 2]) -> Sampled<'_> {
    let textures = Textures::new(&model.scene);
    let directions = even_directions(SAMPLES);
    let offsets = distances.viewpoints(&directions);
    Sampled {
        model,
        distances,
        faces: Triangulation::new(&directions, DVec3::ZERO).expect("directions are all around"),
        sets: distances.unite(&model.sets(&textures, &offsets)),
        pictures: model.pictures(&textures, &of_pictures),
    }
}

/// Pixels of each picture whose primitive is not in the set of the face, ascending.
fn missed(pictures: &[(DVec3, Vec<u32>)], faces: &Triangulation, united: &[Bitfield]) -> Vec<u32> {
    let lookup = Lookup::new(faces.clone(), FaceRanges::from_sets(united));
    let count = |(offset, ids): &(DVec3, Vec<u32>)| {
        let set = &united[lookup.face(*offset) as usize];
        ids.iter()
            .filter(|&&id| id != NONE && !set.contains(id))
            .count() as u32
    };
    let mut missed: Vec<u32> = pictures.iter().map(count).collect();
    missed.sort_unstable();
    missed
}

/// The value that a share of ascending values do not exceed.
pub(crate) fn percentile(ascending: &[u32], share: f64) -> u32 {
    ascending[((ascending.len() as f64 * share).ceil() as usize).max(1) - 1]
}

/// Culling and missed pixels over numbers of samples: the paper's Figures 5 and 7.
fn views_table(all: &[Sampled<'_>]) {
    println!(
        "\nCulled: mean share of primitives over faces. Missed: pixels of {PICTURES} pictures of \
         {PICTURE} x {PICTURE}, at the 50th and 95th percentile and in the worst. The paper's at 25 \
         samples: 26 % of the bunny, 53 and 70 % of two others; 23, 294 and 623 pixels.\n"
    );
    println!(
        "| model | primitives | samples | three: culled | missed | six: culled | missed | \
         with neighbours: culled | missed |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for sampled in all {
        let model = &sampled.model;
        for samples in [14, SAMPLES, 55, 110] {
            let directions = even_directions(samples);
            let faces = Triangulation::new(&directions, DVec3::ZERO).expect("these are all around");
            let distances = &sampled.distances;
            let offsets = distances.viewpoints(&directions);
            let seen = model.sets(&Textures::new(&model.scene), &offsets);
            let sets = distances.unite(&seen);
            let grown = distances.unite(&model.grown(&seen, &offsets));
            let ways = [
                (&sets, United::Three),
                (&sets, United::Six),
                (&grown, United::Six),
            ];
            let columns = ways.map(|(sets, samples)| {
                let united = face_sets(&faces, sets, samples);
                let share = culled_share(&FaceRanges::from_sets(&united), model.primitives);
                let missed = missed(&sampled.pictures, &faces, &united);
                let [half, most] = [0.5, 0.95].map(|share| percentile(&missed, share));
                let worst = percentile(&missed, 1.0);
                format!("{:.1} % | {half}, {most}, {worst}", 100.0 * share)
            });
            println!(
                "| {} | {} | {samples} | {} |",
                model.name,
                model.primitives,
                columns.join(" | ")
            );
        }
    }
}

/// Nanoseconds of one call, the least of many.
fn nanoseconds(mut work: impl FnMut()) -> f64 {
    let once = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_nanos() as f64
    };
    (0..200).map(|_| once(&mut work)).fold(f64::MAX, f64::min)
}

/// Bytes of sets, and what it takes to unite six: plain words, roaring bitmaps, runs.
fn sets_table(all: &[Sampled<'_>]) {
    println!(
        "\nBytes of a sample's set (mean), and microseconds to unite the six of a face (mean over \
         faces): plain words with a summary, roaring bitmaps whose runs are found, runs of 8 bytes.\n"
    );
    println!("| model | visible | words | µs | roaring | µs | runs | µs |");
    println!("|---|---|---|---|---|---|---|---|");
    for Sampled {
        model, faces, sets, ..
    } in all
    {
        let roaring: Vec<RoaringBitmap> = sets
            .iter()
            .map(|set| {
                let mut bitmap: RoaringBitmap = set.iter().collect();
                bitmap.optimize();
                bitmap
            })
            .collect();
        let runs: Vec<Vec<Range<u32>>> = sets.iter().map(Bitfield::ranges).collect();
        let sixes: Vec<[u32; 6]> = (0..faces.faces().len() as u32)
            .map(|f| faces.six(f))
            .collect();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let time = |unite: &dyn Fn(&[u32; 6])| {
            mean(
                sixes
                    .iter()
                    .map(|six| nanoseconds(|| unite(six)) / 1000.0)
                    .collect(),
            )
        };
        let words_time = time(&|six| {
            let mut union = sets[six[0] as usize].clone();
            six[1..]
                .iter()
                .for_each(|s| union.union_with(&sets[*s as usize]));
            black_box(union);
        });
        let roaring_time = time(&|six| {
            let mut union = roaring[six[0] as usize].clone();
            six[1..].iter().for_each(|s| union |= &roaring[*s as usize]);
            black_box(union);
        });
        let runs_time = time(&|six| {
            let first = runs[six[0] as usize].clone();
            let rest = six[1..].iter();
            black_box(rest.fold(first, |union, s| merged(&union, &runs[*s as usize])));
        });
        let words = model.primitives.div_ceil(64);
        let count = |of: &dyn Fn(usize) -> f64| mean((0..sets.len()).map(of).collect());
        println!(
            "| {} | {:.1} % | {} | {words_time:.2} | {:.0} | {roaring_time:.2} | {:.0} | {runs_time:.1} |",
            model.name,
            count(&|i| 100.0 * f64::from(sets[i].len()) / f64::from(model.primitives)),
            8 * (words + words.div_ceil(64)),
            count(&|i| roaring[i].serialized_size() as f64),
            count(&|i| 8.0 * runs[i].len() as f64),
        );
    }
}

/// The union of two ascending lists of ranges.
fn merged(a: &[Range<u32>], b: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut union: Vec<Range<u32>> = Vec::with_capacity(a.len() + b.len());
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let from_a = j == b.len() || (i < a.len() && a[i].start <= b[j].start);
        let next = match from_a {
            true => a[i].clone(),
            false => b[j].clone(),
        };
        i += usize::from(from_a);
        j += usize::from(!from_a);
        match union.last_mut() {
            Some(last) if next.start <= last.end => last.end = last.end.max(next.end),
            _ => union.push(next),
        }
    }
    union
}

/// A meshlet's vertices at most: all that it may have, so that none ends before it has its triangles.
const MESHLET_VERTICES: usize = 192;

/// How much it counts that spatial meshlets are full, as meshoptimizer recommends, and the fewest of
/// their triangles, as a part of the most.
const FILL_WEIGHT: f32 = 0.5;
const LEAST_FULL: usize = 4;

/// A way to group primitives, by the most that a group may have.
type Way<'a> = (&'a str, &'a dyn Fn(u32) -> Patches);

/// What patches cost and cull beside lists of primitives, and beside meshlets drawn whole.
fn patches_table(all: &[Sampled<'_>]) {
    println!(
        "\nPatches beside lists of primitives, and meshoptimizer's meshlets drawn as patches: bytes of all \
         faces' lists, in memory and as a bundle's file, the most ranges of a face, mean culling over faces; before ranges are joined, and after.\n"
    );
    println!(
        "| model | ranges: bytes | of file | ranges | culled | way | primitives a patch | s | patches | ranges | \
         culled | joined: bytes | of file | ranges | culled |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let most = |lists: &FaceRanges| (0..lists.count()).map(|f| lists.of(f).len()).max();
    for Sampled {
        model, faces, sets, ..
    } in all
    {
        let united = face_sets(faces, sets, United::Six);
        let exact = FaceRanges::from_sets(&united);
        let share = |lists: &FaceRanges| 100.0 * culled_share(lists, model.primitives);
        let ways: [Way<'_>; 3] = [
            ("patches", &|most| {
                patches(&model.centers(), faces, &united, most)
            }),
            ("meshlets", &|most| {
                in_meshlets(model, |triangles, places| {
                    let most = most as usize;
                    meshopt::build_meshlets(triangles, places, MESHLET_VERTICES, most, 0.0)
                })
            }),
            ("spatial meshlets", &|most| {
                in_meshlets(model, |triangles, places| {
                    let most = most as usize;
                    meshopt::build_meshlets_spatial(
                        triangles,
                        places,
                        MESHLET_VERTICES,
                        most / LEAST_FULL,
                        most,
                        FILL_WEIGHT,
                    )
                })
            }),
        ];
        // More than 64 triangles may have more vertices than a meshlet.
        let rows = [(0, 64), (0, 128), (0, 256), (1, 64), (2, 64)];
        for (way, most_primitives) in rows {
            let (way, group) = ways[way];
            let start = Instant::now();
            let patches = group(most_primitives);
            let seconds = start.elapsed().as_secs_f64();
            let whole = patches.ranges(&united, u32::MAX);
            let joined = patches.ranges(&united, PatchSettings::default().most_ranges);
            println!(
                "| {} | {} | {} | {} | {:.1} % | {way} | {most_primitives} | {seconds:.2} | {} | {} | {:.1} % | \
                 {} | {} | {} | {:.1} % |",
                model.name,
                exact.bytes(),
                file_bytes(faces, &exact, model.primitives),
                most(&exact).unwrap_or(0),
                share(&exact),
                patches.count(),
                most(&whole).unwrap_or(0),
                share(&whole),
                joined.bytes(),
                file_bytes(faces, &joined, model.primitives),
                most(&joined).unwrap_or(0),
                share(&joined),
            );
        }
    }
}

/// Bytes of lists as a bundle has them.
fn file_bytes(faces: &Triangulation, lists: &FaceRanges, primitives: u32) -> usize {
    let record = |(index, face): (u32, &Face)| FaceRecord {
        corners: face.corners,
        draw: (lists.of(index).iter())
            .map(|range| [range.start, range.end])
            .collect(),
    };
    let file = FaceLists {
        format: FACES_FORMAT.into(),
        version: FACES_VERSION,
        viewpoints: faces.directions().to_vec(),
        parts: vec![0, primitives],
        faces: (0..).zip(faces.faces()).map(record).collect(),
    };
    file.to_json().len()
}

/// Meshlets as patches, in the order in which they are built.
fn in_meshlets(
    model: &Numbered,
    build: impl FnOnce(&[u32], &VertexDataAdapter<'_>) -> meshopt::Meshlets,
) -> Patches {
    let (mut order, mut starts) = (Vec::new(), vec![0]);
    for meshlet in Meshlets::new(model, build).primitives {
        order.extend(meshlet);
        starts.push(order.len() as u32);
    }
    Patches { order, starts }
}

/// What it takes until pictures miss nothing.
fn adaptive(model: &Numbered, clean_views: u32) {
    println!(
        "\n{}: viewpoints added until {clean_views} pictures in a row, at any distance up to {FARTHEST} \
         times the least, miss nothing; then missed pixels of {PICTURES} others, in all and in the \
         worst.\n",
        model.name
    );
    println!(
        "| viewpoints | samples | seed | pictures | clean at last | s | culled | ranges: bytes | missed | patches: \
         bytes | culled | missed |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let textures = Textures::new(&model.scene);
    let distances = model.distances();
    let pictures = model.pictures(&textures, &distances);
    for seed in 0..3 {
        let settings = AdaptiveSettings {
            distances,
            most_viewpoints: SAMPLES,
            tolerated_pixels: 0,
            clean_views,
            most_views: 100_000,
            seed,
        };
        let start = Instant::now();
        let mut looked = 0;
        let look = |offsets: &[DVec3]| {
            looked += offsets.len();
            let shown = |offset: &DVec3| counted(model.ids(&textures, *offset, [PICTURE; 2]));
            offsets.iter().map(shown).collect()
        };
        let adapted = adapt(
            &even_directions(SAMPLES),
            &settings,
            |offsets| model.grown(&model.sets(&textures, offsets), offsets),
            look,
        );
        let Adapted {
            faces,
            sets,
            samples,
            clean_views,
            ..
        } = adapted.expect("the first are all around");
        let seconds = start.elapsed().as_secs_f64();
        let united = face_sets(&faces, &sets, United::Six);
        let lists = FaceRanges::from_sets(&united);
        let missed_pixels = |united: &[Bitfield]| {
            let missed = missed(&pictures, &faces, united);
            format!(
                "{}, {}",
                missed.iter().sum::<u32>(),
                percentile(&missed, 1.0)
            )
        };
        let settings = PatchSettings::default();
        let patches = patches(&model.centers(), &faces, &united, settings.most_primitives);
        let joined = patches.ranges(&united, settings.most_ranges);
        let drawn = drawn(&joined, &patches.order);
        let share = |lists: &FaceRanges| 100.0 * culled_share(lists, model.primitives);
        println!(
            "| {} | {samples} | {seed} | {looked} | {clean_views} | {seconds:.0} | {:.1} % | {} | {} | {} | {:.1} % | {} |",
            sets.len(),
            share(&lists),
            lists.bytes(),
            missed_pixels(&united),
            joined.bytes(),
            share(&joined),
            missed_pixels(&drawn),
        );
    }
}

/// What lists of ranges of patches draw.
///
/// * `order` - the primitive at each place
pub(crate) fn drawn(lists: &FaceRanges, order: &[u32]) -> Vec<Bitfield> {
    let drawn = |face| {
        let places = lists.of(face).iter().cloned().flatten();
        let ids: Vec<u32> = places.map(|at| order[at as usize]).collect();
        Bitfield::from_ids(order.len() as u32, &ids)
    };
    (0..lists.count()).map(drawn).collect()
}

/// What 55 id buffers of each model take.
fn buffers(all: &[Sampled<'_>]) {
    println!(
        "\nSeconds for 55 id buffers of {} x {} pixels and their sets.\n",
        BUFFER[0], BUFFER[1]
    );
    println!("| model | primitives | seconds |\n|---|---|---|");
    for Sampled { model, .. } in all {
        let textures = Textures::new(&model.scene);
        let offsets = Distances::only(model.distance(BUFFER)).viewpoints(&even_directions(55));
        let start = Instant::now();
        black_box(model.sets(&textures, &offsets));
        let seconds = start.elapsed().as_secs_f64();
        println!("| {} | {} | {seconds:.1} |", model.name, model.primitives);
    }
}

/// How far uniting sets of a million primitives is from reading them.
fn unions() {
    const PRIMITIVES: u32 = 1_000_000;
    // More than caches hold: 300 MB.
    let sets: Vec<Bitfield> = (0..2400)
        .map(|i| {
            let some: Vec<u32> = (0..PRIMITIVES).step_by(50 + i % 20).collect();
            Bitfield::from_ids(PRIMITIVES, &some)
        })
        .collect();
    let words = vec![1u64; sets.len() * PRIMITIVES.div_ceil(64) as usize];
    let seconds = |work: &dyn Fn()| {
        let once = |_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        };
        (0..10).map(once).fold(f64::MAX, f64::min)
    };
    let read = seconds(&|| {
        black_box(black_box(&words).iter().fold(0u64, |all, word| all ^ word));
    });
    let mut union = Bitfield::empty(PRIMITIVES);
    let union = std::cell::RefCell::new(&mut union);
    let united = seconds(&|| {
        for six in black_box(&sets).chunks(6) {
            let mut union = union.borrow_mut();
            six.iter().for_each(|set| union.union_with(set));
            black_box(&**union);
        }
    });
    let rate = |seconds: f64| (words.len() * 8) as f64 / seconds / 1e9;
    println!(
        "\nUniting six sets of {PRIMITIVES} primitives: {:.1} µs, {:.1} GB/s; reading as many bytes \
         from memory: {:.1} GB/s; ratio {:.2}",
        united * 1e6 / 400.0,
        rate(united),
        rate(read),
        united / read
    );
}

/// What a lookup takes, over numbers of samples.
fn lookups(all: &[Sampled<'_>]) {
    println!("\nNanoseconds from a direction to its ranges, over 10^5 directions in no order.\n");
    println!("| samples | faces | ns |\n|---|---|---|");
    let sets = all.first().map(|sampled| &sampled.sets[0]);
    let Some(set) = sets else { return };
    for samples in [6, SAMPLES, 55, 300, 1000] {
        let faces = Triangulation::new(&even_directions(samples), DVec3::ZERO).expect("all around");
        let count = faces.faces().len();
        let list = set.ranges().into_iter().take(64).collect::<Vec<_>>();
        let lookup = Lookup::new(faces, FaceRanges::from_lists(vec![list; count]));
        let directions: Vec<DVec3> = (0..100_000u64)
            .map(|i| sphere_direction((i * 61_803 % 100_000) as u32, 100_000))
            .collect();
        let least = (0..20)
            .map(|_| {
                let start = Instant::now();
                for &direction in &directions {
                    black_box(lookup.ranges(black_box(direction)));
                }
                start.elapsed().as_nanos() as f64 / directions.len() as f64
            })
            .fold(f64::MAX, f64::min);
        println!("| {samples} | {count} | {least:.0} |");
    }
}
