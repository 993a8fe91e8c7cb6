//! From where a scene is to be seen: before it, amid it or all around it.

use crate::bake::{Arrangement, BakeOptions};
use crate::parts::keep_represented;
use crate::view_cell::{self, ViewCellSpec, represented_box};
use anyhow::{Result, anyhow, bail};
use farfield_bundle::{Side, ViewSpace};
use farfield_layers::PromisedCamera;
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;
use std::collections::BTreeMap;

/// The view space that the options name for a scene, in which only what is to be represented is
/// left. What should be known of that is added to `warnings`.
///
/// # Errors
///
/// When the scene has nothing to represent, or the options do not suit it.
pub(crate) fn resolve(
    options: &BakeOptions,
    scene: &mut Scene,
    camera: &PromisedCamera,
    warnings: &mut Vec<String>,
) -> Result<ViewSpace> {
    let represented = represented_box(scene)?;
    let spec = options.view_cell.as_ref();
    match options.arrangement {
        Arrangement::Before => Ok(ViewSpace::Before {
            view_cell: view_cell::resolve(spec, represented, camera)?,
        }),
        Arrangement::Far(distance) => amid(spec, scene, distance, warnings),
        Arrangement::Around(distance) => {
            if spec.is_some() {
                bail!("views from all around have no view cell: leave --view-cell out");
            }
            around(represented, distance, camera)
        }
    }
}

fn amid(
    spec: Option<&ViewCellSpec>,
    scene: &mut Scene,
    distance: f64,
    warnings: &mut Vec<String>,
) -> Result<ViewSpace> {
    let Some(&ViewCellSpec::Box { center, size }) = spec else {
        bail!("with --far, name the box that the viewer is in: --view-cell box:cx,cy,cz:sx,sy,sz");
    };
    let view_cell = ViewCell::Box { center, size };
    let space = |objects| ViewSpace::Amid {
        view_cell,
        distance,
        objects,
    };
    let all: Vec<String> = scene
        .objects
        .iter()
        .map(|object| object.name.clone())
        .collect();
    let before = all.len();
    let objects = keep_represented(scene, &space(Vec::new()));
    if objects.is_empty() {
        bail!(
            "none of the {before} objects lies wholly {distance} m from the view cell or beyond: \
             lower --far, or split what is large into several objects"
        );
    }
    warnings.extend(ambiguous(&all, &objects));
    Ok(space(objects))
}

/// Names cannot tell an engine which objects to leave out where a near one has the same.
fn ambiguous(all: &[String], far: &[String]) -> Option<String> {
    let mut counts = BTreeMap::new();
    all.iter()
        .for_each(|name| *counts.entry(name).or_insert(0) += 1);
    far.iter()
        .for_each(|name| *counts.entry(name).or_insert(0) -= 1);
    let is_near_too = |name: &&String| counts.get(name).is_some_and(|near| *near > 0);
    let name = far.iter().find(is_near_too)?;
    Some(format!(
        "'{name}' is the name of objects that are far and of others that stay geometry: give them \
         different names, or an engine cannot tell which of them to leave out"
    ))
}

/// Where no distance is given: a scene seen from there covers some 130 texels.
const DEFAULT_DISTANCE: f64 = 8.0;

fn around(
    represented: [DVec3; 2],
    distance: Option<f64>,
    camera: &PromisedCamera,
) -> Result<ViewSpace> {
    let [min, max] = represented;
    let center = (min + max) / 2.0;
    let distance = distance.unwrap_or(DEFAULT_DISTANCE * min.distance(max));
    // Whoever is that far away, is so far along at least one axis.
    let near = distance / 3f64.sqrt();
    let reach = (max - min).max_element() / 2.0;
    let too_near = || {
        anyhow!(
            "{distance} m is too near for views from all around: the scene reaches {reach} m from \
             its centre along an axis; name at least {} m",
            (4.0 * reach).max(1.5 * distance)
        )
    };
    if near <= reach {
        return Err(too_near());
    }
    let shaft = |side| {
        let space = ViewSpace::Around {
            center,
            near,
            far: f64::INFINITY,
        };
        view_cell::farthest(&space.cell(Some(side)), represented, camera)
    };
    let far = Side::ALL
        .into_iter()
        .map(shaft)
        .try_fold(f64::INFINITY, |least, far| far.map(|far| least.min(far)))
        .map_err(|_| too_near())?;
    // Or viewers straight before a side, where texels are smallest, would be left out.
    if far < distance {
        return Err(too_near());
    }
    Ok(ViewSpace::Around { center, near, far })
}

/// In words and in the form of the command line.
pub(crate) fn describe(space: &ViewSpace) -> String {
    match space {
        ViewSpace::Before { view_cell } => format!("cell {}", view_cell::describe(view_cell)),
        ViewSpace::Amid {
            view_cell,
            distance,
            objects,
        } => format!(
            "cell {}, amid {} objects at {distance} m and beyond",
            view_cell::describe(view_cell),
            objects.len()
        ),
        ViewSpace::Around { center, near, far } => format!(
            "around {}, from {:.6} m on; up to {far:.6} m along an axis",
            to_a_millionth(*center, *near),
            near * 3f64.sqrt()
        ),
        ViewSpace::Inside {
            view_cell,
            cells: [x, y, z],
        } => format!(
            "cell {}, cut into {x} x {y} x {z}",
            view_cell::describe(view_cell)
        ),
        ViewSpace::Shell { center, near, far } => format!(
            "around {}, from {near:.6} m to {far:.6} m",
            to_a_millionth(*center, *near)
        ),
    }
}

/// A point, rounded to about a millionth of a length.
fn to_a_millionth(point: DVec3, length: f64) -> String {
    let scale = 10f64.powi(6 - length.log10().floor() as i32);
    // Adding 0 leaves no -0.
    let [x, y, z] = point
        .to_array()
        .map(|at| (at * scale).round() / scale + 0.0);
    format!("{x},{y},{z}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No more digits are told than anybody needs to find the place.
    #[test]
    fn centers_are_rounded() {
        let told = |center: [f64; 3], near| {
            let center = DVec3::from(center);
            describe(&ViewSpace::Shell {
                center,
                near,
                far: 2.0 * near,
            })
        };
        assert_eq!(
            told([-0.00004686157572564298, 1.0 / 3.0, -1e-12], 0.25),
            "around -0.0000469,0.3333333,0, from 0.250000 m to 0.500000 m"
        );
        assert_eq!(
            told([1e6 + 1.0 / 3.0, -2.5, 0.0], 1630.0),
            "around 1000000.333,-2.5,0, from 1630.000000 m to 3260.000000 m"
        );
    }
}
