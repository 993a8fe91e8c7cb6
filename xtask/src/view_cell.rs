//! View cells as they are named on the command line.

use anyhow::{Result, bail};
use farfield_layers::{PlanError, PromisedCamera, corners_in_view, reference_view};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use glam::DVec3;

/// A view cell before it is known what it looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewCellSpec {
    /// `box:cx,cy,cz:sx,sy,sz`, in metres.
    Box {
        /// Centre.
        center: DVec3,
        /// Full lengths of the sides.
        size: DVec3,
    },
    /// `shaft:dx,dy,dz:half_angle:min[:max]`, its apex in the centre of the represented box.
    Shaft {
        /// Towards the viewers.
        axis: DVec3,
        /// In radians.
        half_angle: f64,
        /// Distance of the near border from the apex, in metres.
        min: f64,
        /// Distance of the far border, in metres; where there is none, where a texel is a sixth
        /// of a pixel.
        max: Option<f64>,
    },
}

const FORMS: &str = "a view cell is box:cx,cy,cz:sx,sy,sz or shaft:dx,dy,dz:half_angle:min[:max]";

impl std::str::FromStr for ViewCellSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        match parts.as_slice() {
            ["box", center, size] => {
                let (center, size) = (vector(center)?, vector(size)?);
                if size.min_element() < 0.0 {
                    return Err(format!("the size {size} of a view cell is negative"));
                }
                Ok(Self::Box { center, size })
            }
            ["shaft", axis, half_angle, min, rest @ ..] if rest.len() <= 1 => {
                let axis = vector(axis)?;
                let (degrees, min) = (number(half_angle)?, number(min)?);
                let max = rest.first().map(|max| number(max)).transpose()?;
                if axis == DVec3::ZERO {
                    return Err("the direction of a shaft must not be 0,0,0".into());
                }
                if degrees <= 0.0 || degrees >= 90.0 {
                    return Err(format!(
                        "the half angle {degrees} is not between 0 and 90 degrees"
                    ));
                }
                if min <= 0.0 || max.is_some_and(|max| max <= min) {
                    return Err("a shaft's distances must be positive and grow".into());
                }
                Ok(Self::Shaft {
                    axis: axis.normalize(),
                    half_angle: degrees.to_radians(),
                    min,
                    max,
                })
            }
            _ => Err(FORMS.into()),
        }
    }
}

fn vector(text: &str) -> Result<DVec3, String> {
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    <[f64; 3]>::try_from(numbers)
        .map(DVec3::from)
        .map_err(|_| format!("'{text}' is not three numbers with commas between; {FORMS}"))
}

fn number(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
        .ok_or_else(|| format!("'{text}' is not a number; {FORMS}"))
}

/// Where a represented box is seen from unless asked otherwise.
///
/// A cube whose side is half the box's largest extent, its near face one extent before the +Z
/// side, at the height of the centre, but not below the box's foot: nobody looks at a flat scene
/// from under the ground.
pub(crate) fn default_cell([min, max]: [DVec3; 2]) -> ViewCell {
    let center = (min + max) / 2.0;
    let extent = (max - min).max_element();
    let side = extent / 2.0;
    ViewCell::Box {
        center: DVec3::new(
            center.x,
            center.y.max(min.y + side / 2.0),
            max.z + extent + side / 2.0,
        ),
        size: DVec3::splat(side),
    }
}

/// The cell that `spec` names for a represented box, or the default one.
pub(crate) fn resolve(
    spec: Option<&ViewCellSpec>,
    [min, max]: [DVec3; 2],
    camera: &PromisedCamera,
) -> Result<ViewCell> {
    let center = (min + max) / 2.0;
    let cell = match spec {
        None => default_cell([min, max]),
        Some(&ViewCellSpec::Box { center, size }) => ViewCell::Box { center, size },
        Some(&ViewCellSpec::Shaft {
            axis,
            half_angle,
            min: near,
            max: far,
        }) => {
            let shaft = |far| ViewCell::Shaft {
                apex: center,
                axis,
                half_angle,
                near,
                far,
            };
            match far {
                Some(far) => shaft(far),
                None => shaft(farthest(&shaft(f64::INFINITY), [min, max], camera)?),
            }
        }
    };
    Ok(cell)
}

/// Texels must not become smaller than this share of a pixel, or renderers that snap vertices to a
/// sixteenth of a pixel show pinholes.
pub(crate) const SMALLEST_TEXEL: f64 = 1.0 / 6.0;

/// How far from a shaft's apex texels are as small as they may become.
pub(crate) fn farthest(
    shaft: &ViewCell,
    represented: [DVec3; 2],
    camera: &PromisedCamera,
) -> Result<f64> {
    let ViewCell::Shaft { apex, axis, .. } = *shaft else {
        unreachable!("only shafts reach to infinity");
    };
    let view = reference_view(shaft, represented, camera)?;
    let axis = axis.normalize();
    // Of the layers the nearest gets small first: a texel of it is `texel * depth` wide, and a
    // pixel as large in the distance sought.
    let depth = corners(represented)
        .map(|corner| view.pose.point_in_view(corner).z)
        .fold(f64::INFINITY, f64::min);
    let distance = view.precision.texel * depth / (camera.pixel() * SMALLEST_TEXEL);
    Ok((view.pose.eye - apex).dot(axis) - depth + distance)
}

/// A cell in the form of the command line; a shaft's apex goes without saying.
pub(crate) fn describe(cell: &ViewCell) -> String {
    match cell {
        ViewCell::Box { center: c, size: s } => {
            format!("box:{},{},{}:{},{},{}", c.x, c.y, c.z, s.x, s.y, s.z)
        }
        ViewCell::Shaft {
            axis: d,
            half_angle,
            near,
            far,
            ..
        } => {
            let degrees = half_angle.to_degrees();
            format!("shaft:{},{},{}:{degrees:.6}:{near}:{far:.6}", d.x, d.y, d.z)
        }
    }
}

/// Says which objects keep a cell from lying before what it represents, if that is what `error`
/// is about.
pub(crate) fn explain(error: PlanError, cell: &ViewCell, scene: &Scene) -> anyhow::Error {
    match error {
        PlanError::CellNotBefore { .. } => {}
        PlanError::BadCell(_) => {
            let cell = describe(cell);
            return anyhow::anyhow!("{cell} has sizes that make no view cell");
        }
        other => return other.into(),
    }
    let axes = match *cell {
        ViewCell::Box { .. } => DVec3::AXES
            .into_iter()
            .flat_map(|axis| [axis, -axis])
            .collect(),
        ViewCell::Shaft { axis, .. } => vec![-axis.normalize()],
    };
    let in_the_way = |axis: &DVec3| -> Vec<&str> {
        let pose = farfield_views::Pose::looking_along(cell.center(), *axis);
        let end = corners_in_view(&pose, cell)
            .iter()
            .map(|c| c.z)
            .fold(f64::MIN, f64::max);
        (0..scene.objects.len() as u32)
            .filter(|object| {
                let bounds = scene.bounds_of(*object);
                let near = |bounds| {
                    corners(bounds)
                        .map(|c| pose.point_in_view(c).z)
                        .fold(f64::MAX, f64::min)
                };
                bounds.is_some_and(|bounds| near(bounds) <= end)
            })
            .map(|object| scene.objects[object as usize].name.as_str())
            .collect()
    };
    let names = axes
        .iter()
        .map(in_the_way)
        .min_by_key(Vec::len)
        .unwrap_or_default();
    let mut list = names
        .iter()
        .take(5)
        .map(|name| format!("'{name}'"))
        .collect::<Vec<_>>();
    if names.len() > 5 {
        list.push(format!("and {} more", names.len() - 5));
    }
    anyhow::anyhow!(
        "the view cell is not in front of all that is to be represented; in the way: {}; \
         move the cell with --view-cell, or leave objects out with --exclude NAME",
        list.join(", ")
    )
}

fn corners([min, max]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |i| {
        DVec3::new(
            [min, max][i & 1].x,
            [min, max][i >> 1 & 1].y,
            [min, max][i >> 2].z,
        )
    })
}

/// The box around all that a scene draws.
pub(crate) fn represented_box(scene: &Scene) -> Result<[DVec3; 2]> {
    let Some([min, max]) = scene.bounds() else {
        bail!("the scene has no triangles, so there is nothing to bake; export it with its meshes");
    };
    let (extent, farthest) = (
        (max - min).max_element(),
        min.abs().max(max.abs()).max_element(),
    );
    if extent < farthest * LEAST_RELATIVE_EXTENT {
        bail!(
            "the scene is {extent:e} m large, but {farthest:e} m from the origin, where \
             coordinates are too coarse for it: move it nearer to the origin"
        );
    }
    Ok([min, max])
}

/// Seen from the origin, a scene at least this large keeps 22 binary digits and more of its 53 to
/// itself.
const LEAST_RELATIVE_EXTENT: f64 = 1.0 / (1u64 << 31) as f64;

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_layers::Aim;

    #[test]
    fn specs_are_read() {
        let spec: ViewCellSpec = "box:0,0.11,0.45:0.2,0.2,0.2".parse().unwrap();
        let (center, size) = (DVec3::new(0.0, 0.11, 0.45), DVec3::splat(0.2));
        assert_eq!(spec, ViewCellSpec::Box { center, size });
        let spec: ViewCellSpec = "shaft:0,0,-1:30:5".parse().unwrap();
        let ViewCellSpec::Shaft {
            half_angle,
            min: 5.0,
            max: None,
            ..
        } = spec
        else {
            panic!("{spec:?}");
        };
        assert!((half_angle - 30f64.to_radians()).abs() < 1e-15);
    }

    /// What a cell is described as names the same cell again.
    #[test]
    fn descriptions_can_be_read_back() {
        let camera = PromisedCamera {
            aim: Aim::Center,
            fov: 0.8,
            resolution: 512,
        };
        let represented = [DVec3::splat(-0.1), DVec3::splat(0.1)];
        for text in ["box:0,-0.11,0.45:0.2,0,0.25", "shaft:0,-1,0:12.5:3:40"] {
            let spec: ViewCellSpec = text.parse().unwrap();
            let cell = resolve(Some(&spec), represented, &camera).unwrap();
            let again: ViewCellSpec = describe(&cell).parse().unwrap();
            assert_eq!(resolve(Some(&again), represented, &camera).unwrap(), cell);
        }
    }

    #[test]
    fn what_is_no_cell_is_refused_with_the_reason() {
        for (text, reason) in [
            ("sphere:0,0,0:1", "box:cx,cy,cz"),
            ("box:0,0:1,1,1", "three numbers"),
            ("box:0,0,a:1,1,1", "'a' is not a number"),
            ("box:0,0,inf:1,1,1", "'inf' is not a number"),
            ("box:0,0,0:1,-1,1", "negative"),
            ("shaft:0,0,0:30:5", "0,0,0"),
            ("shaft:0,0,1:90:5", "90 degrees"),
            ("shaft:0,0,1:30:5:4", "grow"),
        ] {
            let error = text.parse::<ViewCellSpec>().unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    #[test]
    fn the_default_cell_stands_one_extent_before_the_front() {
        let represented = [DVec3::new(-1.0, 0.0, -4.0), DVec3::new(1.0, 5.0, 4.0)];
        let camera = PromisedCamera {
            aim: Aim::Center,
            fov: 0.8,
            resolution: 512,
        };
        let cell = resolve(None, represented, &camera).unwrap();
        let (center, size) = (DVec3::new(0.0, 2.5, 14.0), DVec3::splat(4.0));
        assert_eq!(cell, ViewCell::Box { center, size });
    }

    #[test]
    fn the_default_cell_of_a_flat_scene_stands_on_the_ground() {
        let represented = [DVec3::new(-4.0, 1.0, -4.0), DVec3::new(4.0, 2.0, 4.0)];
        let camera = PromisedCamera {
            aim: Aim::Center,
            fov: 0.8,
            resolution: 512,
        };
        let cell = resolve(None, represented, &camera).unwrap();
        let (center, size) = (DVec3::new(0.0, 3.0, 14.0), DVec3::splat(4.0));
        assert_eq!(cell, ViewCell::Box { center, size });
    }

    /// At the far end of a shaft without a given end, the smallest texel is a sixth of a pixel.
    #[test]
    fn a_shaft_ends_where_texels_are_a_sixth_of_a_pixel() {
        let represented = [DVec3::splat(-1.0), DVec3::splat(1.0)];
        let camera = PromisedCamera {
            aim: Aim::Center,
            fov: 0.8,
            resolution: 512,
        };
        let spec = "shaft:0,0,1:10:9".parse().unwrap();
        let cell = resolve(Some(&spec), represented, &camera).unwrap();
        let ViewCell::Shaft { far, .. } = cell else {
            panic!("{cell:?}")
        };
        let view = reference_view(&cell, represented, &camera).unwrap();
        let texel = view.precision.texel * (view.pose.eye.z - 1.0);
        let pixels = texel / (camera.pixel() * (far - 1.0));
        // The end moves the centre of the shaft, and with it perhaps the reference viewpoint.
        assert!((pixels * 6.0 - 1.0).abs() < 0.1, "{pixels}");
    }
}
