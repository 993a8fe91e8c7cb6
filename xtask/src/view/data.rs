//! What a page must know besides the manifest: where to look from, what it costs, how to light it.

use crate::console::Console;
use crate::{parts, pictures, viewpoints};
use anyhow::{Context, Result, bail};
use farfield_bundle::{CertificateState, Cost, Impostor, Manifest, read_certificate};
use farfield_layers::Aim;
use farfield_sampling::Lighting;
use farfield_scene::Scene;
use glam::{DVec3, Vec3};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// Viewpoints that a page can be told to look from, besides the worst ones.
const VIEWS: u64 = 256;

/// What `view.json` holds. Lengths are metres, coordinates the world's.
#[derive(Serialize)]
pub(super) struct Data {
    /// Of the bundle's folder.
    name: String,
    /// Where the glTF file of the original lies; null where there is none.
    original: Option<&'static str>,
    cost: CostOfShown,
    /// Of each impostor of the manifest, the eight corners of the cell that it is seen from: bit 0 of an
    /// index tells the side along the first axis, bit 1 along the second, bit 2 along the third.
    cells: Vec<[DVec3; 8]>,
    /// Whether the camera looks at the centre of what is represented or anywhere.
    aim: &'static str,
    /// Ordered by number.
    views: Vec<View>,
    /// The numbers of the worst viewpoints, the worst first; empty where the bundle was not verified.
    worst: Vec<u64>,
    light: Light,
    /// sRGB from 0 to 1, behind everything.
    background: [f32; 3],
}

#[derive(Serialize)]
struct CostOfShown {
    original: Option<Cost>,
    impostor: Cost,
}

/// A viewpoint as `verify` numbers it.
#[derive(Serialize)]
struct View {
    view: u64,
    /// Index of the impostor that `verify` looks at from there.
    impostor: usize,
    eye: DVec3,
    target: DVec3,
}

/// [`Lighting`], field by field.
#[derive(Serialize)]
struct Light {
    to_sun: Vec3,
    sun: Vec3,
    sky: Vec3,
    ground: Vec3,
}

/// What the page of the bundle in `dir` must know.
///
/// # Errors
///
/// When the manifest names viewpoints from which nothing can be looked at.
pub(super) fn data(
    dir: &Path,
    manifest: &Manifest,
    original: Option<&Scene>,
    display: &Scene,
    console: &Console,
) -> Result<Data> {
    let space = &manifest.options.view_space;
    let cells = manifest.impostors.iter().map(|impostor| {
        let cell = space.cell(impostor.side);
        viewpoints::require_end(&cell)?;
        Ok(cell.corners().map(|corner| corner.truncate()))
    });
    let cells = cells.collect::<Result<Vec<_>>>()?;
    let worst = worst(dir, manifest, console)?;
    let numbers: BTreeSet<u64> = (0..VIEWS).chain(worst.iter().copied()).collect();
    let count = manifest.impostors.len() as u64;
    let views = numbers.into_iter().filter(|_| count > 0).map(|view| {
        // Impostors take turns.
        let (impostor, index) = ((view % count) as usize, view / count);
        let [eye, target] = sight(manifest, &manifest.impostors[impostor], index)?;
        Ok(View {
            view,
            impostor,
            eye,
            target,
        })
    });
    let Lighting {
        to_sun,
        sun,
        sky,
        ground,
    } = Lighting::default();
    let aims_anywhere = |one: &Impostor| parts::stated(manifest, one).1 == Aim::Anywhere;
    let name = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    Ok(Data {
        name: name
            .file_name()
            .map_or(String::new(), |name| name.to_string_lossy().into_owned()),
        original: original.map(|_| super::ORIGINAL),
        cost: CostOfShown {
            original: original.map(farfield_bundle::cost),
            impostor: farfield_bundle::cost(display),
        },
        cells,
        aim: match manifest.impostors.iter().any(aims_anywhere) {
            true => "anywhere",
            false => "centre",
        },
        views: views.collect::<Result<_>>()?,
        worst,
        light: Light {
            to_sun,
            sun,
            sky,
            ground,
        },
        background: pictures::background(),
    })
}

/// Where the camera is that looks at an impostor from its viewpoint number `index`, and what it looks
/// at.
fn sight(manifest: &Manifest, impostor: &Impostor, index: u64) -> Result<[DVec3; 2]> {
    let cell = manifest.options.view_space.cell(impostor.side);
    let layers = impostor
        .body
        .layers()
        .context("an impostor without layers")?;
    let eye = viewpoints::eye(layers.pose.eye, &cell, index);
    let (hull, aim) = parts::stated(manifest, impostor);
    let target = match aim {
        Aim::Center => (impostor.represented[0] + impostor.represented[1]) / 2.0,
        Aim::Anywhere => viewpoints::sight(&hull, index),
    };
    if (target - eye).try_normalize().is_none() {
        bail!(
            "viewpoint {index} of {} at {eye} has no direction to look along to {target}; bake the \
             bundle again",
            impostor.name
        );
    }
    Ok([eye, target])
}

/// What `verify` left: the field of `verify.json`, or what the certificate says.
fn worst(dir: &Path, manifest: &Manifest, console: &Console) -> Result<Vec<u64>> {
    #[derive(serde::Deserialize)]
    struct Report {
        worst_view: u64,
        /// Not told by earlier versions.
        #[serde(default)]
        worst_views: Vec<u64>,
    }
    let path = dir.join("verify.json");
    if path.exists() {
        let read = std::fs::read(&path).map_err(anyhow::Error::from);
        let report = read.and_then(|text| Ok(serde_json::from_slice::<Report>(&text)?));
        match report {
            Ok(report) if report.worst_views.is_empty() => return Ok(vec![report.worst_view]),
            Ok(report) => return Ok(report.worst_views),
            Err(error) => console.warn(format_args!(
                "{}: the worst views are not known: {error:#}; verify again",
                path.display()
            )),
        }
    }
    Ok(match read_certificate(dir, manifest)? {
        CertificateState::Valid(certificate) => vec![certificate.worst.worst_view],
        CertificateState::Missing => Vec::new(),
        CertificateState::Stale { why } => {
            console.warn(format_args!("the certificate {why}"));
            Vec::new()
        }
    })
}
