//! The lists of a bundle, and the views that they are for.

use crate::inside::Inside;
use crate::opened;
use crate::orbit::Orbit;
use crate::viewpoints::{SEED, require_end};
use anyhow::{Context, Result, bail};
use farfield_bitfields::{FaceRanges, Lookup, Triangulation};
use farfield_bundle::{FACES_FILE, Manifest, ViewSpace, read_cells, read_faces};
use farfield_views::{Camera, Extent, Pose, ViewCell};
use glam::DVec3;
use std::ops::Range;
use std::path::Path;

/// What is drawn for whom.
#[derive(Debug)]
pub(crate) enum Lists {
    /// For viewers all around, by direction.
    Faces { lookup: Lookup, orbit: Orbit },
    /// For viewers in a box, by place.
    Cells {
        inside: Inside,
        lists: FaceRanges,
        /// Of the original.
        represented: [DVec3; 2],
    },
}

/// Those of the bundle in `dir`, and the first triangle of each primitive of its file.
///
/// * `represented` - the box of the original
///
/// # Errors
///
/// When the lists are not there, or cannot be those of the original.
pub(crate) fn read(
    dir: &Path,
    manifest: &Manifest,
    represented: [DVec3; 2],
) -> Result<(Lists, Vec<u32>)> {
    let in_manifest = || opened::in_manifest(dir);
    let options = &manifest.options;
    let fov = options.fov_degrees.to_radians();
    let ranges = |draw: &Vec<[u32; 2]>| -> Vec<Range<u32>> {
        draw.iter().map(|[first, end]| *first..*end).collect()
    };
    match options.view_space {
        ViewSpace::Shell { center, near, far } => {
            let lists = read_faces(dir, manifest)?;
            let corners: Vec<[u32; 3]> = lists.faces.iter().map(|face| face.corners).collect();
            let faces = Triangulation::from_faces(&lists.viewpoints, &corners)
                .with_context(|| dir.join(FACES_FILE).display().to_string())?;
            let orbit = Orbit::new(represented, Some([near, far]), fov, options.resolution)
                .and_then(|orbit| at_center(orbit, center, represented))
                .with_context(in_manifest)?;
            let ranges = lists.faces.iter().map(|face| ranges(&face.draw));
            let lookup = Lookup::new(faces, FaceRanges::from_lists(ranges));
            Ok((Lists::Faces { lookup, orbit }, lists.parts))
        }
        ViewSpace::Inside { view_cell, cells } => {
            let lists = read_cells(dir, manifest)?;
            require_end(&view_cell).with_context(in_manifest)?;
            let ViewCell::Box { center, size } = view_cell else {
                bail!("{}: options.view_space.view_cell is no box", in_manifest());
            };
            let inside = Inside::new([center, size], cells, fov, options.resolution)
                .with_context(in_manifest)?;
            let ranges = lists.cells.iter().map(|cell| ranges(&cell.draw));
            let all = Lists::Cells {
                inside,
                lists: FaceRanges::from_lists(ranges),
                represented,
            };
            Ok((all, lists.parts))
        }
        ViewSpace::Before { .. } | ViewSpace::Amid { .. } | ViewSpace::Around { .. } => bail!(
            "{}: options.view_space is none that bitfields are seen from: bake again",
            in_manifest()
        ),
    }
}

/// The same around the centre that a manifest tells.
///
/// # Errors
///
/// When it is not that of the original.
fn at_center(orbit: Orbit, center: DVec3, represented: [DVec3; 2]) -> Result<Orbit> {
    let digits = 1e-9 * represented[0].abs().max(represented[1].abs()).max_element();
    if !center.abs_diff_eq(orbit.center, digits) {
        bail!(
            "options.view_space.center is {center}, but the centre of the original is {}: bake again",
            orbit.center
        );
    }
    Ok(Orbit { center, ..orbit })
}

impl Lists {
    /// What each draws.
    pub(crate) fn ranges(&self) -> &FaceRanges {
        match self {
            Self::Faces { lookup, .. } => lookup.lists(),
            Self::Cells { lists, .. } => lists,
        }
    }

    /// View `index` of those that bundles are verified from.
    pub(crate) fn view(&self, index: u64) -> Camera {
        match self {
            Self::Faces { orbit, .. } => orbit.view(index, SEED),
            Self::Cells { inside, .. } => inside.view(index, SEED),
        }
    }

    /// The list for a viewpoint; at the centre of what is looked at from around, any.
    pub(crate) fn of(&self, eye: DVec3) -> u32 {
        match self {
            Self::Faces { orbit, .. } if eye == orbit.center => 0,
            Self::Faces { lookup, orbit } => lookup.face(eye - orbit.center),
            Self::Cells { inside, .. } => inside.list(eye),
        }
    }

    /// From where one sees what is not drawn for a view: from the other side, or from above.
    pub(crate) fn aside(&self, camera: &Camera) -> Camera {
        match self {
            Self::Faces { orbit, .. } => orbit.camera(orbit.center - camera.pose.eye),
            Self::Cells { represented, .. } => above(*represented, camera),
        }
    }

    /// Views from around, where they are.
    pub(crate) fn orbit(&self) -> Option<&Orbit> {
        match self {
            Self::Faces { orbit, .. } => Some(orbit),
            Self::Cells { .. } => None,
        }
    }
}

/// A camera that looks down at all of a box, in pictures as large as another one's.
fn above([min, max]: [DVec3; 2], like: &Camera) -> Camera {
    const FOV: f64 = std::f64::consts::FRAC_PI_4;
    let (center, radius) = ((min + max) / 2.0, min.distance(max) / 2.0);
    // From a little to the south, so that walls are seen.
    let up = DVec3::new(0.0, 1.0, 0.6).normalize();
    let eye = center + up * radius / (FOV / 2.0).sin();
    Camera {
        pose: Pose::looking_along(eye, -up),
        extent: Extent::symmetric(FOV, like.width, like.height),
        ..*like
    }
}
