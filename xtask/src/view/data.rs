//! What a page must know besides the manifest: where to look from, what it costs, how to light it.

use super::shown::{CostOfShown, Shown};
use super::sights::Sight;
use anyhow::Result;
use farfield_sampling::Lighting;
use glam::{DVec3, Vec3};
use serde::Serialize;
use std::collections::BTreeSet;

/// Viewpoints that a page can be told to look from, besides the worst ones.
const VIEWS: u64 = 256;

/// What `view.json` holds. Lengths are metres, coordinates the world's.
#[derive(Serialize)]
pub(super) struct Data<'a> {
    /// Of the bundle's folder.
    name: &'a str,
    /// Where the glTF file of the original lies; null where there is none.
    original: Option<&'static str>,
    cost: CostOfShown,
    /// Of each impostor of the manifest, the eight corners of the cell that it is seen from: bit 0 of an
    /// index tells the side along the first axis, bit 1 along the second, bit 2 along the third.
    cells: Vec<[DVec3; 8]>,
    /// Whether the camera looks at the centre of what is represented or anywhere.
    aim: &'static str,
    /// Ordered by number.
    views: Vec<Sight>,
    /// The numbers of the worst viewpoints, the worst first; empty where the bundle was not verified.
    worst: &'a [u64],
    light: Light,
    /// sRGB from 0 to 1, behind everything.
    background: [f32; 3],
}

/// [`Lighting`], field by field.
#[derive(Serialize)]
struct Light {
    to_sun: Vec3,
    sun: Vec3,
    sky: Vec3,
    ground: Vec3,
}

/// What the page of a bundle must know.
///
/// # Errors
///
/// When the manifest names viewpoints from which nothing can be looked at.
pub(super) fn data(shown: &Shown) -> Result<Data<'_>> {
    let numbers: BTreeSet<u64> = (0..VIEWS).chain(shown.worst.iter().copied()).collect();
    let views = numbers.into_iter().map(|view| shown.sight(view));
    let Lighting {
        to_sun,
        sun,
        sky,
        ground,
    } = shown.light;
    let cells = shown.cells.iter();
    Ok(Data {
        name: &shown.name,
        original: shown.original.as_ref().map(|_| super::ORIGINAL),
        cost: shown.cost,
        cells: cells
            .map(|cell| cell.corners().map(|corner| corner.truncate()))
            .collect(),
        aim: match shown.aims_anywhere {
            true => "anywhere",
            false => "centre",
        },
        views: views.collect::<Result<_>>()?,
        worst: &shown.worst,
        light: Light {
            to_sun,
            sun,
            sky,
            ground,
        },
        background: shown.background,
    })
}
