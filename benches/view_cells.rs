//! What view cells amid scenes see: how many triangles, and how much is missed.

use crate::models;
use crate::numbered::{Numbered, counted};
use farfield_bitfields::{
    Bitfield, CellGrid, CellSettings, FaceRanges, PatchSettings, cell_patches, cell_set, cube_map,
    missed_pixels,
};
use farfield_sampling::{Textures, Tracer};
use farfield_views::{ViewCell, lattice_viewpoints, low_discrepancy_point};
use glam::DVec3;
use std::time::Instant;

/// Pixels on each side of a cube map's faces: of samples, and of views.
const SAMPLE: u32 = 512;
const VIEW: u32 = 256;

/// Pixels that a view may miss: 0.01 % of those of its cube map.
const TOLERATED: u64 = 40;

/// Views in a row that must not miss more, and samples at most.
const CLEAN: u32 = 200;
const MOST_SAMPLES: u32 = 400;

/// Other views, which cells are judged by.
const OTHERS: u64 = 50;

/// How high a cell's middle is above the ground, and how high a cell is, in metres.
const EYE: f64 = 1.8;
const HEIGHT: f64 = 1.6;

/// Houses within so many metres tell where the ground is, where there is none.
const NEAR: f64 = 30.0;

/// Sides of cells, in metres.
const SIDES: [f64; 2] = [2.0, 10.0];

const CITIES: [models::Entry; 2] = [
    models::CITY[0],
    ("city_lyon1_lod1", [0.0, 25.0, 0.0], [60.0; 3]),
];

/// Cells of a grid along either side.
const GRID: u32 = 2;

/// Prints the tables.
pub(crate) fn tables() {
    println!(
        "\nCells of {HEIGHT} m height, from cube maps of {SAMPLE} x {SAMPLE} pixels a face, until \
         {CLEAN} views in a row miss at most {TOLERATED} pixels of 6 x {VIEW} x {VIEW}. Then views \
         of {OTHERS} other points: means and worst.\n"
    );
    println!(
        "| scene | triangles | side | samples | views | s | kept | seen from a point | missed: mean | \
         worst | with 27 samples: kept | missed: mean | worst |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let town = |triangles| Numbered::new("town", farfield_town::town(0, triangles));
    let rows = |model: &Numbered| {
        let place = Place::new(model, SIDES[1]);
        SIDES.iter().for_each(|side| row(&place, *side));
    };
    let small = town(100_000);
    rows(&small);
    for model in models::read(&CITIES) {
        rows(&Numbered::new(model.name, model.scene));
    }
    rows(&town(500_000));
    grid(&Place::new(&small, SIDES[1]));
}

/// Where to stand in a scene.
struct Place<'a> {
    model: &'a Numbered,
    textures: Textures<'a>,
    eye: DVec3,
}

impl<'a> Place<'a> {
    /// A place near the middle of the scene, on the ground, where a cell has nothing above it and
    /// nothing in it.
    fn new(model: &'a Numbered, side: f64) -> Self {
        let tracer = Tracer::new(&model.scene);
        let [min, max] = model.scene.bounds().expect("the scene has triangles");
        let mut ground = model.scene.clone();
        ground
            .objects
            .retain(|object| object.name.starts_with("ground"));
        let ground = (!ground.objects.is_empty()).then(|| Tracer::new(&ground));
        let below = |tracer: &Tracer, from| {
            tracer.nearest_to_range(from, DVec3::NEG_Y, [0.0, f64::INFINITY])
        };
        let lowest_near = |place: DVec3| {
            let corners = model.scene.triangles_in_world().flatten();
            let near = corners.filter(|c| (*c - place).with_y(0.0).length() < NEAR);
            near.map(|corner| corner.y).min_by(f64::total_cmp)
        };
        let free = |eye: &DVec3| {
            let cell = cell(*eye, side);
            let blocked = |fractions: DVec3| {
                let way = cell.point(fractions) - *eye;
                let hit = tracer.nearest_to_range(*eye, way, [0.0, f64::INFINITY]);
                hit.is_some_and(|hit| hit < 1.0)
            };
            let up = tracer.nearest_to_range(*eye, DVec3::Y, [0.0, f64::INFINITY]);
            up.is_none() && !lattice_viewpoints().into_iter().any(blocked)
        };
        let eye = |index| {
            let place = low_discrepancy_point(index, 0);
            // Near the middle of the scene first.
            let share = (index as f64 / 2000.0).min(1.0);
            let offset = (place - 0.5) * (max - min) * share;
            let above = DVec3::new(
                model.center.x + offset.x,
                max.y + 1.0,
                model.center.z + offset.z,
            );
            let first = below(&tracer, above);
            let ground = match &ground {
                Some(ground) => first
                    .filter(|first| below(ground, above) == Some(*first))
                    .map(|first| above.y - first),
                // In models of houses alone, it is where houses nearby end.
                None if first.is_none() => lowest_near(above),
                None => None,
            };
            Some(DVec3::new(above.x, ground? + EYE, above.z))
        };
        let eye = (0..20_000).filter_map(eye).find(free);
        let eye = eye.expect("somewhere is room");
        Self {
            model,
            textures: Textures::new(&model.scene),
            eye,
        }
    }

    /// All that is seen from a point.
    fn around(&self, eye: DVec3, resolution: u32) -> Vec<u32> {
        let cameras = cube_map(eye, resolution).into_iter();
        let ids = cameras.map(|camera| self.model.ids_of(&self.textures, &camera));
        ids.flatten().collect()
    }

    fn sets(&self, viewpoints: &[DVec3]) -> Vec<Bitfield> {
        let set =
            |eye: &DVec3| Bitfield::from_ids(self.model.primitives, &self.around(*eye, SAMPLE));
        viewpoints.iter().map(set).collect()
    }

    fn look(&self, viewpoints: &[DVec3]) -> Vec<Vec<[u32; 2]>> {
        let shown = |eye: &DVec3| counted(self.around(*eye, VIEW));
        viewpoints.iter().map(shown).collect()
    }
}

fn cell(center: DVec3, side: f64) -> ViewCell {
    ViewCell::Box {
        center,
        size: DVec3::new(side, HEIGHT, side),
    }
}

fn settings() -> CellSettings {
    CellSettings {
        most_samples: MOST_SAMPLES,
        tolerated_pixels: TOLERATED,
        clean_views: CLEAN,
        most_views: 3000,
        seed: 0,
    }
}

fn row(place: &Place<'_>, side: f64) {
    let model = place.model;
    let cell = cell(place.eye, side);
    let start = Instant::now();
    let mut looked = 0;
    let look = |viewpoints: &[DVec3]| {
        looked += viewpoints.len();
        place.look(viewpoints)
    };
    let found = cell_set(&cell, &settings(), |v| place.sets(v), look);
    let seconds = start.elapsed().as_secs_f64();

    // Of the sequence of another seed, within the cell and, as in the loop, on its border.
    let others = (0..OTHERS).map(|i| cell.viewpoint_to_border(i, 1));
    let others: Vec<DVec3> = others.collect();
    let views = place.look(&others);
    let missed = |set: &Bitfield| {
        let missed = views.iter().map(|shown| missed_pixels(shown, set));
        let missed: Vec<u64> = missed.collect();
        let mean = missed.iter().sum::<u64>() as f64 / missed.len() as f64;
        format!(
            "{mean:.1} | {}",
            missed.iter().max().expect("there are views")
        )
    };
    let mut first = Bitfield::empty(model.primitives);
    let few = &found.viewpoints[..27.min(found.viewpoints.len())];
    place.sets(few).iter().for_each(|set| first.union_with(set));
    let point = &place.sets(&[place.eye])[0];
    let share = |set: &Bitfield| 100.0 * f64::from(set.len()) / f64::from(model.primitives);
    println!(
        "| {} at {:.0} | {} | {side} m | {} | {looked} | {seconds:.0} | {} ({:.1} %) | {:.1} % | {} | {:.1} % | {} |",
        model.name,
        place.eye,
        model.primitives,
        found.viewpoints.len(),
        found.set.len(),
        share(&found.set),
        share(point),
        missed(&found.set),
        share(&first),
        missed(&first),
    );
}

/// Cells side by side, with lists of ranges in one order of patches.
fn grid(place: &Place<'_>) {
    let model = place.model;
    let all = DVec3::new(SIDES[1], HEIGHT, SIDES[1]);
    let grid = CellGrid {
        min: place.eye - all / 2.0,
        size: all / DVec3::new(GRID.into(), 1.0, GRID.into()),
        counts: [GRID, 1, GRID],
    };
    let start = Instant::now();
    let cells: Vec<ViewCell> = grid.cells().collect();
    let sets = cells
        .iter()
        .map(|cell| cell_set(cell, &settings(), |v| place.sets(v), |v| place.look(v)).set);
    let sets: Vec<Bitfield> = sets.collect();
    let seconds = start.elapsed().as_secs_f64();
    let middles: Vec<DVec3> = cells.iter().map(ViewCell::center).collect();
    let most = PatchSettings::default();
    let patches = cell_patches(&model.centers(), &middles, &sets, most.most_primitives);
    let joined = patches.ranges(&sets, most.most_ranges);
    let exact = FaceRanges::from_sets(&sets);
    let kept = |lists: &FaceRanges| {
        100.0 * (1.0 - farfield_bitfields::culled_share(lists, model.primitives))
    };
    println!(
        "\n{GRID} x {GRID} cells of {:.1} m in the {} of {} triangles, {seconds:.0} s: primitives kept \
         {:.1} %, {} bytes; in patches of {}, {} ranges a cell at most: {:.1} %, {} bytes.\n",
        grid.size.x,
        model.name,
        model.primitives,
        kept(&exact),
        exact.bytes(),
        most.most_primitives,
        most.most_ranges,
        kept(&joined),
        joined.bytes(),
    );
}
