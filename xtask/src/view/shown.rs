//! A bundle beside its original, ready to be shown: the same for the page and for the window.

use super::ViewOptions;
use super::sights::{self, Sight};
use crate::bake::cost_of_a_list;
use crate::console::Console;
use crate::lists::{self, Lists};
use crate::{opened, pictures, source, viewpoints};
use anyhow::{Context, Result, bail};
use farfield_bundle::{Cost, GLTF_FILE, Manifest, ViewSpace};
use farfield_sampling::Lighting;
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;
use std::ops::Range;
use std::path::Path;

/// A bundle and its original. Lengths are metres, coordinates the world's.
#[derive(Debug)]
pub struct Shown {
    /// Of the bundle's folder.
    pub name: String,
    /// What the bundle says of itself.
    pub manifest: Manifest,
    /// What of the original the bundle stands for; `None` where it is not there any more.
    pub original: Option<Scene>,
    /// All that the bundle's glTF file draws.
    pub impostor: Scene,
    /// What both take.
    pub cost: CostOfShown,
    /// Of each impostor, the cell that it is seen from; empty where viewers are in a shell.
    pub cells: Vec<ViewCell>,
    /// Whether the promise is for a camera that looks anywhere, not at the centre of what is represented.
    pub aims_anywhere: bool,
    /// The numbers of the worst viewpoints, the worst first; empty where the bundle was not verified.
    pub worst: Vec<u64>,
    /// What lights both.
    pub light: Lighting,
    /// sRGB from 0 to 1, behind everything.
    pub background: [f32; 3],
    /// What ID-bitfields draw for whom.
    lists: Option<Lists>,
}

/// What is shown takes. Of ID-bitfields, triangles and draw calls are those of a viewpoint, on average.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CostOfShown {
    /// `None` where it is not there.
    pub original: Option<Cost>,
    /// All that the bundle draws.
    pub impostor: Cost,
}

impl Shown {
    /// Opens a bundle and its original.
    ///
    /// Where the original's file is not there any more, and no other is named, that is said and the
    /// impostor is shown alone.
    ///
    /// # Errors
    ///
    /// When the bundle is damaged or says what cannot be, in the words of `verify`, or the original is not
    /// the one that was baked.
    pub fn open(options: &ViewOptions, console: &Console) -> Result<Self> {
        let manifest = opened::manifest(&options.dir, console)?;
        Self::of(manifest, options, console)
    }

    /// The same of a bundle whose manifest was read.
    pub(super) fn of(manifest: Manifest, options: &ViewOptions, console: &Console) -> Result<Self> {
        let dir = &options.dir;
        let in_manifest = || opened::in_manifest(dir);
        let original = original(&manifest, options, console)?;
        let impostor = opened::display(dir, &manifest)?;
        let lists = match manifest.technique.channels() {
            Some(_) => None,
            None => Some(read_lists(dir, &manifest, &impostor)?),
        };
        let cells = cells(&manifest).with_context(in_manifest)?;
        let worst = sights::worst(dir, &manifest, console).with_context(in_manifest)?;
        let cost = CostOfShown {
            original: original.as_ref().map(farfield_bundle::cost),
            impostor: match &lists {
                Some(lists) => cost_of_a_list(&impostor, lists.ranges()),
                None => farfield_bundle::cost(&impostor),
            },
        };
        let name = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
        let name = name.file_name().unwrap_or_default().to_string_lossy();
        Ok(Self {
            name: name.into_owned(),
            cells,
            aims_anywhere: match &lists {
                Some(Lists::Cells { .. }) => true,
                Some(Lists::Faces { .. }) => false,
                None => sights::aims_anywhere(&manifest),
            },
            worst,
            light: Lighting::default(),
            background: pictures::background(),
            manifest,
            original,
            impostor,
            cost,
            lists,
        })
    }

    /// Viewpoint number `view`, as `verify` counts.
    ///
    /// # Errors
    ///
    /// When the manifest has nothing to look at, or nothing can be looked at from there.
    pub fn sight(&self, view: u64) -> Result<Sight> {
        let Some(lists) = &self.lists else {
            return sights::of_impostors(&self.manifest, view);
        };
        let pose = lists.view(view).pose;
        Ok(Sight {
            view,
            impostor: 0,
            eye: pose.eye,
            target: match self.aims_anywhere {
                true => pose.eye + pose.forward,
                false => self.center(),
            },
        })
    }

    /// Least and greatest corner of what is represented.
    pub fn represented(&self) -> [DVec3; 2] {
        let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let boxes = self.manifest.impostors.iter().map(|one| one.represented);
        boxes.fold(nothing, |[min, max], [low, high]| {
            [min.min(low), max.max(high)]
        })
    }

    /// The middle of what is represented.
    pub fn center(&self) -> DVec3 {
        let [min, max] = self.represented();
        (min + max) / 2.0
    }

    /// Index of the impostor that is to be shown alone from a viewpoint; `None` where all are.
    ///
    /// On borders between sides it is one of them.
    pub fn shown_alone(&self, eye: DVec3) -> Option<usize> {
        let ViewSpace::Around { center, .. } = self.manifest.options.view_space else {
            return None;
        };
        let outwards = |index: &usize| {
            let side = self.manifest.impostors[*index].side;
            side.map_or(f64::NEG_INFINITY, |side| side.direction().dot(eye - center))
        };
        let all = 0..self.manifest.impostors.len();
        all.max_by(|a, b| outwards(a).total_cmp(&outwards(b)))
    }

    /// What the bundle draws for a viewpoint: ascending ranges of triangles of [`Self::impostor`]; `None`
    /// where it draws all.
    ///
    /// * `alone` - index of the impostor that is shown, as [`Self::shown_alone`] or a [`Sight`] tell
    pub fn drawn_from(&self, eye: DVec3, alone: Option<usize>) -> Option<Vec<Range<u32>>> {
        if let Some(lists) = &self.lists {
            return Some(lists.ranges().of(lists.of(eye)).to_vec());
        }
        let name = &self.manifest.impostors[alone?].name;
        let objects = (0..).zip(&self.impostor.objects);
        let named = objects.filter(|(_, object)| object.name == *name);
        let mut ranges: Vec<_> = named
            .map(|(index, _)| self.impostor.mesh_of(index).triangles.clone())
            .collect();
        ranges.sort_by_key(|range| range.start);
        Some(ranges)
    }
}

/// The original; `None`, which is said, where it is not where it was baked from.
fn original(
    manifest: &Manifest,
    options: &ViewOptions,
    console: &Console,
) -> Result<Option<Scene>> {
    let (dir, scene) = (&options.dir, options.scene.as_deref());
    let moved = source::moved(manifest, dir).filter(|_| scene.is_none());
    if let Some(why) = moved {
        console.warn(format_args!("{why}; only the impostor is shown"));
        return Ok(None);
    }
    Ok(Some(match manifest.technique.channels() {
        Some(channels) => opened::original(manifest, dir, scene, channels, console)?,
        None => opened::whole_original(manifest, dir, scene, console)?,
    }))
}

/// The lists of a bundle, which name no triangle that is not there.
fn read_lists(dir: &Path, manifest: &Manifest, impostor: &Scene) -> Result<Lists> {
    let represented = manifest.impostors.first().map(|one| one.represented);
    let represented = represented.context("impostors: there are none; bake the bundle again")?;
    let (lists, _) = lists::read(dir, manifest, represented)?;
    let end = lists.ranges().ranges.iter().map(|range| range.end).max();
    let triangles = impostor.triangles.len();
    if let Some(end) = end.filter(|end| *end as usize > triangles) {
        bail!(
            "{}: has {triangles} triangles, and triangle {} is to be drawn: bake again",
            dir.join(GLTF_FILE).display(),
            end - 1
        );
    }
    Ok(lists)
}

/// The cells of a bundle's impostors.
fn cells(manifest: &Manifest) -> Result<Vec<ViewCell>> {
    let space = &manifest.options.view_space;
    if matches!(space, ViewSpace::Shell { .. }) {
        return Ok(Vec::new());
    }
    let cells = manifest.impostors.iter().map(|impostor| {
        let cell = space.cell(impostor.side);
        viewpoints::require_end(&cell)?;
        Ok(cell)
    });
    cells.collect()
}
