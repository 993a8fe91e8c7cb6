//! From where a bundle is looked at, by the numbers of `verify`.

use crate::console::Console;
use crate::{parts, viewpoints};
use anyhow::{Context, Result, bail};
use farfield_bundle::{CertificateState, Impostor, Manifest, read_certificate};
use farfield_layers::Aim;
use glam::DVec3;
use serde::Serialize;
use std::path::Path;

/// A viewpoint as `verify` numbers it. Coordinates are the world's, in metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sight {
    /// Its number.
    pub view: u64,
    /// Index of the impostor that `verify` looks at from there.
    pub impostor: usize,
    /// Where the camera is.
    pub eye: DVec3,
    /// A point that it looks at.
    pub target: DVec3,
}

/// Viewpoint number `view` of a bundle of impostors, which take turns.
///
/// # Errors
///
/// When the manifest has nothing to look at, or nothing can be looked at from there.
pub(super) fn of_impostors(manifest: &Manifest, view: u64) -> Result<Sight> {
    let count = manifest.impostors.len() as u64;
    if count == 0 {
        bail!("impostors: there are none; bake the bundle again");
    }
    let (number, index) = ((view % count) as usize, view / count);
    let impostor = &manifest.impostors[number];
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
    Ok(Sight {
        view,
        impostor: number,
        eye,
        target,
    })
}

/// Whether the camera of a bundle of impostors looks anywhere, not at the centre of what is represented.
pub(super) fn aims_anywhere(manifest: &Manifest) -> bool {
    let anywhere = |one: &Impostor| parts::stated(manifest, one).1 == Aim::Anywhere;
    manifest.impostors.iter().any(anywhere)
}

/// The numbers of the worst viewpoints, the worst first: what `verify.json` says, or else the certificate;
/// empty where the bundle was not verified.
///
/// # Errors
///
/// When the certificate cannot be read.
pub(super) fn worst(dir: &Path, manifest: &Manifest, console: &Console) -> Result<Vec<u64>> {
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
