//! Views of the original and of what is drawn, compared.

use super::super::report::BitfieldsFigures;
use super::super::subject::Side;
use super::super::totals::{Place, Totals};
use super::super::view::{Geometry, Shown, ViewFigures, flip, shown_by};
use crate::bake::is_in;
use crate::drawn;
use crate::lists::Lists;
use crate::pictures::{marked, png};
use farfield_grid::Grid;
use farfield_metrics::{
    ParallaxErrors, Picture, color_difference, compared_region, coverage, gap_pixels,
    silhouette_displacement, ssim_errors, stray_colors,
};
use farfield_sampling::{NONE, Textures, rasterize};
use farfield_scene::Scene;
use farfield_views::Camera;
use rayon::prelude::*;
use std::ops::Range;

/// The original and the file, both as one object, and what is drawn for whom.
pub(super) struct Sides<'a> {
    original: Side<'a>,
    /// What of the original hides what is behind it; none where all of it does.
    solid: Option<Scene>,
    display: Side<'a>,
    /// Where in the file each triangle of the original is.
    places: &'a [u32],
    lists: &'a Lists,
}

/// What one view shows.
pub(super) struct Seen {
    pub(super) view: u64,
    pub(super) camera: Camera,
    /// Pixels that show a triangle which is not drawn.
    pub(super) missed: Vec<[u32; 2]>,
    /// Pixels of another colour than the original's.
    pub(super) wrong: u64,
    pub(super) drawn: u64,
    pub(super) list: u32,
    figures: Option<ViewFigures>,
}

/// PNG files of one view.
pub(super) struct Pictures {
    view: u64,
    pub(super) original: Vec<u8>,
    pub(super) drawn: Vec<u8>,
    /// Where something is missed.
    pub(super) marked: Vec<u8>,
    /// What is drawn, seen from the other side or from above.
    pub(super) aside: Vec<u8>,
}

impl Pictures {
    /// Names and contents.
    pub(super) fn files(&self) -> impl Iterator<Item = (String, &[u8])> {
        [
            ("original", &self.original),
            ("drawn", &self.drawn),
            ("marked", &self.marked),
            ("aside", &self.aside),
        ]
        .into_iter()
        .map(|(what, png)| (format!("view-{:04}-{what}.png", self.view), &png[..]))
    }
}

const MISSED: [u8; 3] = [255, 32, 32];

/// How far colours may be apart that are the same: nothing but what is not drawn differs.
const TOLERANCE: u8 = 16;

impl<'a> Sides<'a> {
    pub(super) fn new(
        original: &'a Scene,
        display: &'a Scene,
        [of_original, of_display]: &'a [Textures<'a>; 2],
        places: &'a [u32],
        lists: &'a Lists,
    ) -> Self {
        let has_blended = !drawn::blended(original).is_empty();
        Self {
            original: Side {
                scene: original,
                textures: of_original,
            },
            solid: has_blended.then(|| drawn::solid(original)),
            display: Side {
                scene: display,
                textures: of_display,
            },
            places,
            lists,
        }
    }

    /// How many there are in all.
    pub(super) fn triangles(&self) -> u64 {
        self.places.len() as u64
    }

    /// Looks from views, in the order of their numbers.
    pub(super) fn look(&self, views: Range<u64>, done: impl Fn() + Sync) -> Vec<Seen> {
        let camera = |view| self.lists.view(view);
        let mut of_lists: Vec<(u32, u64)> = views
            .map(|view| (self.lists.of(camera(view).pose.eye), view))
            .collect();
        of_lists.sort_unstable();
        let mut drawn = drawn::without_images(self.display.scene);
        let mut all: Vec<Seen> = Vec::new();
        for views in of_lists.chunk_by(|a, b| a.0 == b.0) {
            drawn::draw_only(&mut drawn, self.ranges(views[0].0).iter().cloned());
            let seen = views.par_iter().map(|&(list, view)| {
                let seen = self.look_at(&drawn, list, view, camera(view));
                done();
                seen
            });
            all.extend(seen.collect::<Vec<_>>());
        }
        all.sort_by_key(|seen| seen.view);
        all
    }

    fn ranges(&self, list: u32) -> &[Range<u32>] {
        self.lists.ranges().of(list)
    }

    fn look_at(&self, drawn: &Scene, list: u32, view: u64, camera: Camera) -> Seen {
        let original = shown_by(&self.original, &camera);
        let shown = self.shown(drawn, &camera);
        let ids = match &self.solid {
            None => original.seen.triangles.clone(),
            Some(solid) => rasterize(solid, self.original.textures, &camera).triangles,
        };
        let ranges = self.ranges(list);
        let is_missed = |id: u32| id != NONE && !is_in(ranges, self.places[id as usize]);
        let missed = at_pixels(&ids, |id| is_missed(*id));
        let pairs = original.colors.cells().iter().zip(shown.colors.cells());
        Seen {
            view,
            missed,
            wrong: pairs.filter(|(a, b)| a != b).count() as u64,
            drawn: u64::from(self.lists.ranges().primitives_of(list)),
            list,
            figures: Some(figures(view, camera, &original, &shown)),
            camera,
        }
    }

    fn shown(&self, drawn: &Scene, camera: &Camera) -> Shown {
        let side = Side {
            scene: drawn,
            textures: self.display.textures,
        };
        shown_by(&side, camera)
    }

    /// Renders a view again.
    pub(super) fn pictures(&self, seen: &Seen) -> Pictures {
        let mut drawn = drawn::without_images(self.display.scene);
        drawn::draw_only(&mut drawn, self.ranges(seen.list).iter().cloned());
        let shown = self.shown(&drawn, &seen.camera).colors;
        let aside = self.lists.aside(&seen.camera);
        let marks = seen.missed.iter().map(|at| (*at, MISSED));
        Pictures {
            view: seen.view,
            original: png(&shown_by(&self.original, &seen.camera).colors),
            marked: png(&marked(&shown, marks)),
            drawn: png(&shown),
            aside: png(&self.shown(&drawn, &aside).colors),
        }
    }
}

fn at_pixels<T>(grid: &Grid<T>, is_one: impl Fn(&T) -> bool) -> Vec<[u32; 2]> {
    let width = grid.width();
    let cells = grid.cells().iter().enumerate();
    let found = cells.filter(|(_, cell)| is_one(cell));
    found
        .map(|(i, _)| [(i % width) as u32, (i / width) as u32])
        .collect()
}

/// What is measured of impostors too: of the same geometry nothing is where it should not be.
fn figures(view: u64, camera: Camera, original: &Shown, shown: &Shown) -> ViewFigures {
    let ids = [&original.seen.objects, &shown.seen.objects];
    let region = compared_region(ids[0], ids[1]);
    let colors = [&original.colors, &shown.colors];
    let pictures = [0, 1].map(|i| Picture {
        colors: colors[i],
        ids: ids[i],
    });
    let covered = |ids: &Grid<u32>| ids.cells().iter().filter(|id| **id != NONE).count() as u64;
    let one_layer = |ids: &Grid<u32>| {
        let cells = ids
            .cells()
            .iter()
            .map(|id| if *id == NONE { NONE } else { 0 });
        Grid::from_cells(ids.width(), ids.height(), cells.collect())
    };
    ViewFigures {
        view,
        camera,
        geometry: Geometry {
            gaps: gap_pixels(&one_layer(ids[0]), &one_layer(ids[1]), 0),
            phantoms: Vec::new(),
            backs: Vec::new(),
            from_behind: Vec::new(),
            parallax: ParallaxErrors::default(),
        },
        coverage: coverage(ids[0], ids[1]),
        covered_by_impostor: covered(ids[1]),
        silhouette: silhouette_displacement(ids[0], ids[1]),
        color: color_difference(pictures[0], pictures[1], &region),
        surface: Default::default(),
        stray: stray_colors(pictures[0], pictures[1], TOLERANCE),
        ssim: ssim_errors(colors[0], colors[1], &region),
        flip: flip(colors, &region),
    }
}

/// All views together.
#[derive(Default)]
pub(super) struct Looked {
    pub(super) totals: Totals,
    /// Missed pixels of each view.
    missed: Vec<u64>,
    wrong: u64,
    drawn: Vec<u64>,
    triangles: u64,
    /// The first that were found.
    places: Vec<Place>,
    /// The worst views, the worst first.
    pub(super) worst: Vec<Seen>,
}

/// How many views the report shows pictures of, and how many pixels it names.
const WORST: usize = 4;
const MOST_PLACES: usize = 1000;

impl Looked {
    pub(super) fn add(&mut self, mut seen: Seen) {
        if let Some(figures) = seen.figures.take() {
            self.totals.add(figures);
        }
        self.missed.push(seen.missed.len() as u64);
        self.wrong += seen.wrong;
        self.drawn.push(seen.drawn);
        let room = MOST_PLACES - self.places.len();
        let new = seen.missed.iter().take(room);
        let view = seen.view;
        self.places.extend(new.map(|&[x, y]| Place { view, x, y }));
        let rank = |seen: &Seen| (seen.missed.len(), seen.wrong, seen.drawn);
        let at = (self.worst).partition_point(|worse| rank(worse) >= rank(&seen));
        self.worst.insert(at, seen);
        self.worst.truncate(WORST);
    }

    /// The number of pixels that a share of the views do not miss more than.
    fn missed_at(&self, share: f64) -> u64 {
        let mut ascending = self.missed.clone();
        ascending.sort_unstable();
        crate::bake::percentile(&ascending, share)
    }

    /// Views that miss more pixels than so many.
    fn missing_more_than(&self, most: u64) -> u64 {
        self.missed.iter().filter(|missed| **missed > most).count() as u64
    }

    /// * `most` - missed pixels that are promised
    /// * `allowed` - how many views may miss more; nothing where that is not judged
    pub(super) fn figures(&self, most: u64, allowed: Option<u64>) -> BitfieldsFigures {
        let all = self.triangles.max(1) as f64;
        let culled = |drawn: u64| 1.0 - drawn as f64 / all;
        let views = self.drawn.len().max(1) as f64;
        BitfieldsFigures {
            missed_pixels: self.missed.iter().sum(),
            missed_pixels_worst: self.missed_at(1.0),
            missed_pixels_p95: self.missed_at(0.95),
            missing_views: self.missing_more_than(0),
            missing_more_than_promised: self.missing_more_than(most),
            may_miss_more_than_promised: allowed,
            wrong_pixels: self.wrong,
            culled: self.drawn.iter().map(|drawn| culled(*drawn)).sum::<f64>() / views,
            culled_least: culled(self.drawn.iter().copied().max().unwrap_or(0)),
            over_samples: Vec::new(),
            missed: self.places.clone(),
        }
    }

    /// Nothing yet, of as many triangles.
    pub(super) fn of(triangles: u64) -> Self {
        Self {
            triangles,
            ..Self::default()
        }
    }
}
