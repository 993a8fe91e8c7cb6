//! What each impostor of a bundle stands for, and from where it is seen.

use crate::view_cell::represented_box;
use anyhow::{Result, bail};
use farfield_bundle::{Impostor, Manifest, Side, ViewSpace};
use farfield_layers::{Aim, PromisedCamera, box_corners};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::{DVec3, DVec4};
use std::borrow::Cow;

/// A part of a scene that one impostor stands for.
pub(crate) struct Part<'a> {
    /// `None` where it is all.
    pub(crate) side: Option<Side>,
    /// A cut part has no images: it shows those of the whole scene.
    pub(crate) scene: Cow<'a, Scene>,
    /// Least and greatest corner in the world.
    pub(crate) represented: [DVec3; 2],
    /// Corners of a convex body around it.
    pub(crate) hull: [DVec3; 8],
    /// Where the viewer may be.
    pub(crate) cell: ViewCell,
    /// The viewer's camera.
    pub(crate) camera: PromisedCamera,
}

/// Leaves in a scene only what is to be represented: in views from amid it, the objects that lie
/// wholly at the distance from the cell or beyond. Returns the names of what is left.
pub(crate) fn keep_represented(scene: &mut Scene, space: &ViewSpace) -> Vec<String> {
    if let ViewSpace::Amid {
        view_cell: ViewCell::Box { center, size },
        distance,
        ..
    } = *space
    {
        let cell = [center - size / 2.0, center + size / 2.0];
        let is_far = |object: u32| {
            let bounds = scene.bounds_of(object);
            bounds.is_some_and(|bounds| distance_between(cell, bounds) >= distance)
        };
        let far: Vec<bool> = (0..scene.objects.len() as u32).map(is_far).collect();
        let mut far = far.iter();
        scene.objects.retain(|_| far.next().is_some_and(|far| *far));
    }
    let names = scene.objects.iter().map(|object| object.name.clone());
    names.collect()
}

/// Between two boxes, in metres; 0 where they meet.
fn distance_between([min_a, max_a]: [DVec3; 2], [min_b, max_b]: [DVec3; 2]) -> f64 {
    (min_a - max_b).max(min_b - max_a).max(DVec3::ZERO).length()
}

/// The parts of a scene that the impostors of a bundle stand for, those in which nothing is left
/// out. `scene` is what [`keep_represented`] left.
///
/// # Errors
///
/// When the scene has no triangles, or is too small for its coordinates.
pub(crate) fn parts<'a>(
    scene: &'a Scene,
    space: &ViewSpace,
    camera: &PromisedCamera,
) -> Result<Vec<Part<'a>>> {
    let represented = represented_box(scene)?;
    let whole = |side| Part {
        side,
        scene: Cow::Borrowed(scene),
        represented,
        hull: box_corners(represented),
        cell: space.cell(side),
        camera: PromisedCamera {
            aim: Aim::Center,
            ..*camera
        },
    };
    Ok(match *space {
        ViewSpace::Before { .. } => vec![whole(None)],
        ViewSpace::Around { .. } => Side::ALL.map(Some).map(whole).into(),
        ViewSpace::Amid {
            view_cell: ViewCell::Box { center, size },
            ..
        } => {
            let cut = |side| frustum(scene, center, size, side, camera);
            Side::ALL.into_iter().filter_map(cut).collect()
        }
        ViewSpace::Amid { .. } => bail!("only a box lies amid a scene"),
        ViewSpace::Shell { .. } | ViewSpace::Inside { .. } => {
            bail!("options.view_space is one for bitfields only")
        }
    })
}

/// How many texels a part reaches over its borders to its neighbours. Within a texel of a border a
/// ray may slip through; two such texels more, and what verify judges by the neighbours of a pixel is
/// judged there as well.
const OVERLAP_TEXELS: f64 = 4.0;

/// What of a scene is nearer to a side of a box than to the others, by the greatest of the
/// distances along the axes: a frustum that widens from that side by 45 degrees, and a little more.
/// `None` where nothing is there.
fn frustum<'a>(
    scene: &Scene,
    center: DVec3,
    size: DVec3,
    side: Side,
    camera: &PromisedCamera,
) -> Option<Part<'a>> {
    let outwards = side.direction();
    let reach = |axis: DVec3| (size / 2.0).dot(axis.abs());
    let widening = widening(camera);
    let laterals = laterals(outwards);
    let plane = |lateral: DVec3| -> DVec4 {
        // widening (depth before the side) >= what is beside the box
        let normal = outwards * widening - lateral;
        normal.extend(reach(lateral) - widening * reach(outwards) - normal.dot(center))
    };
    let planes: Vec<DVec4> = laterals
        .iter()
        .flat_map(|axis| [plane(*axis), plane(-*axis)])
        .collect();
    let cut = scene.clipped(&planes);
    let represented = cut.bounds()?;
    Some(Part {
        side: Some(side),
        scene: Cow::Owned(cut),
        represented,
        hull: hull_amid(represented, [center, size], side, camera),
        cell: ViewCell::Box { center, size },
        camera: PromisedCamera {
            aim: Aim::Anywhere,
            ..*camera
        },
    })
}

/// Corners of a convex body around what lies before a side of a box in its frustum.
///
/// * `represented` - least and greatest corner of what lies there
/// * `[center, size]` - of the box
fn hull_amid(
    represented: [DVec3; 2],
    [center, size]: [DVec3; 2],
    side: Side,
    camera: &PromisedCamera,
) -> [DVec3; 8] {
    let outwards = side.direction();
    let reach = |axis: DVec3| (size / 2.0).dot(axis.abs());
    let widening = widening(camera);
    let laterals = laterals(outwards);
    let depths = represented.map(|corner| (corner - center).dot(outwards) - reach(outwards));
    let depths = [depths[0].min(depths[1]), depths[0].max(depths[1])];
    std::array::from_fn(|i| {
        let depth = depths[i >> 2];
        let lateral = |bit: usize| {
            let axis = laterals[bit];
            let sign = if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            axis * sign * (reach(axis) + widening * depth)
        };
        center + outwards * (reach(outwards) + depth) + lateral(0) + lateral(1)
    })
}

/// How much a frustum widens with the distance from its side.
fn widening(camera: &PromisedCamera) -> f64 {
    1.0 + OVERLAP_TEXELS * camera.pixel()
}

/// The two axes of the world across a side's direction.
fn laterals(outwards: DVec3) -> Vec<DVec3> {
    let axes = DVec3::AXES.into_iter();
    axes.filter(|axis| axis.dot(outwards) == 0.0).collect()
}

/// Corners of a convex body around what an impostor of a bundle stands for, and whether the camera
/// looks at its centre or anywhere in it: what [`parts`] finds, told by the manifest.
pub(crate) fn stated(manifest: &Manifest, impostor: &Impostor) -> ([DVec3; 8], Aim) {
    let Impostor {
        represented, side, ..
    } = *impostor;
    match (&manifest.options.view_space, side) {
        (
            ViewSpace::Amid {
                view_cell: ViewCell::Box { center, size },
                ..
            },
            Some(side),
        ) => {
            let camera = PromisedCamera {
                aim: Aim::Anywhere,
                fov: manifest.options.fov_degrees.to_radians(),
                resolution: manifest.options.resolution,
            };
            let hull = hull_amid(represented, [*center, *size], side, &camera);
            (hull, Aim::Anywhere)
        }
        _ => (box_corners(represented), Aim::Center),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_scene::{Material, Mesh, Object};
    use glam::{DAffine3, Vec2, Vec3, Vec4};
    use proptest::prelude::*;

    /// A triangle an object.
    fn triangles(corners: &[[f32; 3]]) -> Scene {
        let count = corners.len() as u32 / 3;
        Scene {
            positions: corners.iter().copied().map(Vec3::from).collect(),
            normals: vec![Vec3::Y; corners.len()],
            uvs: vec![Vec2::ZERO; corners.len()],
            colors: vec![Vec4::ONE; corners.len()],
            triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            triangle_materials: vec![0; count as usize],
            meshes: (0..count)
                .map(|i| Mesh {
                    vertices: 3 * i..3 * i + 3,
                    triangles: i..i + 1,
                })
                .collect(),
            objects: (0..count)
                .map(|i| Object {
                    name: format!("triangle {i}"),
                    mesh: i,
                    world_from_mesh: DAffine3::IDENTITY,
                })
                .collect(),
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    proptest! {
        /// Every point of what is far is in the part of a side, within its hull and before the cell,
        /// and what is near is in none.
        #[test]
        fn parts_hold_what_is_far(
            corners in prop::collection::vec([-9.0..9.0f32, -9.0..9.0f32, -9.0..9.0f32], 30),
            size in prop::array::uniform3(0.0..4.0f64),
        ) {
            let mut scene = triangles(&corners);
            let view_cell = ViewCell::Box { center: DVec3::ZERO, size: size.into() };
            let space = ViewSpace::Amid { view_cell, distance: 1.0, objects: Vec::new() };
            let camera = PromisedCamera { aim: Aim::Anywhere, fov: 0.8, resolution: 64 };
            let all = scene.clone();
            let names = keep_represented(&mut scene, &space);
            let cell = [-DVec3::from(size) / 2.0, DVec3::from(size) / 2.0];
            for (object, triangle) in (0..).zip(all.objects) {
                let is_far = distance_between(cell, {
                    let p = |i: usize| Vec3::from(corners[3 * object + i]).as_dvec3();
                    [p(0).min(p(1)).min(p(2)), p(0).max(p(1)).max(p(2))]
                }) >= 1.0;
                prop_assert_eq!(names.contains(&triangle.name), is_far);
            }
            let Ok(parts) = parts(&scene, &space, &camera) else { return Ok(()) };
            let area = |scene: &Scene| -> f64 {
                let all = (0..scene.objects.len() as u32)
                    .flat_map(|o| scene.mesh_of(o).triangles.clone().map(move |t| (o, t)));
                all.map(|(o, t)| {
                    let [a, b, c] = scene.triangle_in(o, t).map(|v| scene.world_position(o, v));
                    (b - a).cross(c - a).length() / 2.0
                }).sum()
            };
            let (whole, cut) = (area(&scene), parts.iter().map(|p| area(&p.scene)).sum::<f64>());
            prop_assert!(cut >= whole * (1.0 - 1e-4), "{cut} of {whole}");
            for part in &parts {
                let side = part.side.unwrap();
                let depth = |p: DVec3| p.dot(side.direction());
                let front = DVec3::from(size).dot(side.direction().abs()) / 2.0;
                prop_assert!(part.represented.iter().all(|p| depth(*p) > front));
                let reach = |p: DVec3| (p.abs() - p.abs() * side.direction().abs()).max_element();
                let widest = part.hull.iter().map(|p| reach(*p)).fold(0.0, f64::max);
                prop_assert!(part.represented.iter().all(|p| reach(*p) <= widest * (1.0 + 1e-6)));
            }
        }
    }
}
