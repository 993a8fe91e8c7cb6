//! Whether a manifest or a certificate can be true.

use crate::ManifestError;
use crate::certificate::{CERTIFICATE_FILE, CERTIFICATE_FORMAT, CERTIFICATE_VERSION, Certificate};
use crate::manifest::{
    BitfieldsBody, Body, FORMAT, GLTF_FILE, Impostor, LayeredBody, MANIFEST_FILE, Manifest,
    Samples, SceneSource, Technique, VERSION,
};
use crate::view_space::ViewSpace;
use farfield_views::{Pose, ViewCell};
use glam::{DMat3, DVec3};
use std::collections::BTreeSet;
use std::fmt::Display;

/// No side of a page, a layer or a promised view has more texels.
const MAX_SIDE: u32 = 1 << 16;

/// Pixels along each side of a picture; its depths and colours must fit into memory.
const MAX_RESOLUTION: u32 = 1 << 14;

/// Pixels of a bake beside one of the promised camera, along each side.
const MAX_FINER: f64 = 64.0;

pub(crate) type Checked = Result<(), ManifestError>;

impl Manifest {
    /// Checks that format and version are this crate's, numbers are finite and in range, view
    /// cell, poses, extents and layers are possible and in order, totals are the sums of their
    /// parts, and file names are distinct, ordered and stay inside the folder.
    ///
    /// # Errors
    ///
    /// The first thing found wrong.
    pub fn check(&self) -> Checked {
        check_header(&self.format, self.version, FORMAT, VERSION)?;
        not_empty(&self.generator.name, "generator.name")?;
        match self.technique {
            Technique::Layered { bytes_per_quad, .. } => {
                not_negative(bytes_per_quad, "technique.bytes_per_quad")?;
            }
            Technique::Tdm { enlarged, .. } => {
                let is_in_range = (1.0..=2.0).contains(&enlarged);
                require(is_in_range, "technique.enlarged", || {
                    format!("is {enlarged}, not from 1 to 2")
                })?;
            }
            Technique::Bitfields {
                patch_triangles,
                finer,
                ..
            } => {
                require(patch_triangles > 0, "technique.patch_triangles", || {
                    "is 0".into()
                })?;
                let is_in_range = (1.0..=MAX_FINER).contains(&finer);
                require(is_in_range, "technique.finer", || {
                    format!("is {finer}, not from 1 to {MAX_FINER}")
                })?;
            }
        }
        let options = &self.options;
        check_camera(options.resolution, options.fov_degrees, "options.")?;
        check_view_space(&options.view_space, "options.view_space")?;
        check_source(&self.scene)?;
        for (name, figure) in [
            ("parallax_px", self.promise.parallax_px),
            ("coverage_error", self.promise.coverage_error),
            ("coverage_change", self.promise.coverage_change),
            ("colour_bias", self.promise.colour_bias),
            ("surface_bias", self.promise.surface_bias),
            ("stray_colours", self.promise.stray_colours),
        ] {
            not_negative(figure.unwrap_or(0.0), format_args!("promise.{name}"))?;
        }
        self.check_missed()?;
        self.check_impostors()?;
        self.check_totals()?;
        self.check_files()
    }

    /// Checks what is promised of missed pixels, and that ID-bitfields are seen from where they can be.
    fn check_missed(&self) -> Checked {
        let promise = &self.promise;
        if let Some(share) = promise.missed_share {
            require(share > 0.0 && share <= 1.0, "promise.missed_share", || {
                format!("is {share}, not above 0 and at most 1")
            })?;
        }
        let is_bitfields = matches!(self.technique, Technique::Bitfields { .. });
        let has_lists = self.options.view_space.lists_file().is_some();
        require(
            is_bitfields == has_lists,
            "options.view_space",
            || match has_lists {
                true => "is one for bitfields only".into(),
                false => "is none that bitfields are seen from".into(),
            },
        )?;
        match self.technique {
            Technique::Bitfields { samples, .. } => {
                require(
                    promise.missed_pixels.is_some(),
                    "promise.missed_pixels",
                    || "is missing".into(),
                )?;
                let misses_some =
                    promise.missed_pixels != Some(0) && promise.missed_share.is_none();
                let is_adaptive = samples == Samples::Adaptive;
                require(
                    !(is_adaptive && misses_some),
                    "promise.missed_pixels",
                    || "is not 0, which adaptive samples keep to unless a share is told".into(),
                )
            }
            Technique::Layered { .. } | Technique::Tdm { .. } => Ok(()),
        }
    }

    fn check_impostors(&self) -> Checked {
        let (mut names, mut sides) = (BTreeSet::new(), BTreeSet::new());
        let has_sides = self.options.view_space.has_sides();
        for (i, impostor) in self.impostors.iter().enumerate() {
            let place = format!("impostors[{i}]");
            not_empty(&impostor.name, format_args!("{place}.name"))?;
            require(
                names.insert(&impostor.name),
                format_args!("{place}.name"),
                || format!("{:?} is the name of an earlier impostor too", impostor.name),
            )?;
            let is_for_a_side = impostor.side.is_some_and(|side| sides.insert(side));
            require(
                is_for_a_side == has_sides,
                format_args!("{place}.side"),
                || match (impostor.side, has_sides) {
                    (Some(side), true) => format!("is {side}, that of an earlier impostor too"),
                    (Some(side), false) => format!("is {side}, but views are from before only"),
                    (None, _) => "is missing".into(),
                },
            )?;
            let is_of_technique = matches!(
                (&self.technique, &impostor.body),
                (Technique::Layered { .. }, Body::Layered(_))
                    | (Technique::Tdm { .. }, Body::Tdm(_))
                    | (Technique::Bitfields { .. }, Body::Bitfields(_))
            );
            require(is_of_technique, format_args!("{place}.body"), || {
                format!("is not of the technique {}", self.technique.name())
            })?;
            if let (&ViewSpace::Inside { cells, .. }, Body::Bitfields(body)) =
                (&self.options.view_space, &impostor.body)
            {
                let count: u128 = cells.map(u128::from).into_iter().product();
                require(
                    u128::from(body.lists) == count,
                    format_args!("{place}.body.lists"),
                    || format!("are {} for {count} cells", body.lists),
                )?;
            }
            check_impostor(impostor, &place)?;
        }
        require(has_sides || self.impostors.len() <= 1, "impostors", || {
            "are several, but views are of one only".into()
        })?;
        let is_missing =
            matches!(self.technique, Technique::Bitfields { .. }) && self.impostors.is_empty();
        require(!is_missing, "impostors", || "are none".into())
    }

    fn check_totals(&self) -> Checked {
        let layered = || self.impostors.iter().filter_map(|i| i.body.layers());
        let total = &self.statistics;
        for (name, stated, sum) in [
            (
                "layers",
                total.layers,
                sum(layered().map(|b| b.layers.len() as u64)),
            ),
            (
                "quads",
                total.quads,
                sum(layered()
                    .flat_map(|b| &b.layers)
                    .map(|l| u64::from(l.quads))),
            ),
            (
                "texels_recorded",
                total.texels_recorded,
                sum(layered().map(|b| b.texels_recorded)),
            ),
            (
                "texels_kept",
                total.texels_kept,
                sum(layered().map(|b| b.texels_kept)),
            ),
        ] {
            require(
                sum == Some(stated),
                format_args!("statistics.{name}"),
                || format!("is {stated}, which is not the sum over the impostors"),
            )?;
        }
        Ok(())
    }

    fn check_files(&self) -> Checked {
        let mut names = BTreeSet::new();
        for (i, file) in self.files.iter().enumerate() {
            let place = format!("files[{i}]");
            check_path(&file.path).map_err(|problem| ManifestError {
                place: format!("{place}.path"),
                problem,
            })?;
            check_sha256(&file.sha256, format_args!("{place}.sha256"))?;
            // Also where a file system does not tell upper from lower case.
            require(
                names.insert(file.path.to_lowercase()),
                format_args!("{place}.path"),
                || format!("{:?} is the name of an earlier file too", file.path),
            )?;
        }
        require(
            self.files.is_sorted_by(|a, b| a.path < b.path),
            "files",
            || "are not ordered by path".into(),
        )?;
        let mut needed = [Some(GLTF_FILE), self.options.view_space.lists_file()]
            .into_iter()
            .flatten();
        needed.try_for_each(|name| {
            let is_there = self.files.iter().any(|file| file.path == name);
            require(is_there, "files", || format!("lack {name}"))
        })
    }
}

impl Certificate {
    /// Checks that format and version are this crate's, checksums are such, numbers are finite and
    /// in range, and the view cell is possible.
    ///
    /// Its own checksum, filled in when it is written, is not looked at.
    ///
    /// # Errors
    ///
    /// The first thing found wrong.
    pub fn check(&self) -> Checked {
        check_header(
            &self.format,
            self.version,
            CERTIFICATE_FORMAT,
            CERTIFICATE_VERSION,
        )?;
        not_empty(&self.generator.name, "generator.name")?;
        check_sha256(&self.bundle_sha256, "bundle_sha256")?;
        check_source(&self.scene)?;
        check_view_space(&self.view_space, "view_space")?;
        check_camera(self.resolution, self.fov_degrees, "")?;
        require(self.viewpoints > 0, "viewpoints", || "are none".into())?;
        let worst = &self.worst;
        for (name, figure) in [
            ("parallax_px", worst.parallax_px),
            ("silhouette_px", worst.silhouette_px),
            ("coverage_error", worst.coverage_error),
            ("colour_bias", worst.colour_bias),
            ("stray_colours", worst.stray_colours),
            ("flip", worst.flip.unwrap_or(0.0)),
        ] {
            not_negative(figure, format_args!("worst.{name}"))?;
        }
        require(
            worst.worst_view < self.viewpoints,
            "worst.worst_view",
            || {
                format!(
                    "is {}, not less than the {} viewpoints",
                    worst.worst_view, self.viewpoints
                )
            },
        )?;
        for (i, proved) in self.proved.iter().enumerate() {
            for (name, figure) in [("bound", proved.bound), ("limit", proved.limit)] {
                require(
                    figure.is_finite(),
                    format_args!("proved[{i}].{name}"),
                    || format!("is {figure}, not finite"),
                )?;
            }
        }
        if let Some(beyond) = &self.beyond {
            for (name, figure) in [
                ("cell_scale", beyond.cell_scale),
                ("switch_distance_m", beyond.switch_distance_m),
                ("screen_coverage", beyond.screen_coverage),
                ("geometric_error_m", beyond.geometric_error_m),
            ] {
                not_negative(figure, format_args!("beyond.{name}"))?;
            }
        }
        Ok(())
    }
}

pub(crate) fn check_header(
    format: &str,
    version: u32,
    our_format: &str,
    our_version: u32,
) -> Checked {
    require(format == our_format, "format", || {
        format!("is {format:?}, expected {our_format:?}")
    })?;
    require(version == our_version, "version", || {
        format!("is {version}, expected {our_version}")
    })
}

fn check_camera(resolution: u32, fov: f64, place: &str) -> Checked {
    require(
        (1..=MAX_RESOLUTION).contains(&resolution),
        format_args!("{place}resolution"),
        || format!("is {resolution}, not from 1 to {MAX_RESOLUTION}"),
    )?;
    // In radians it must be between 0 and pi too.
    let radians = fov.to_radians();
    require(
        radians > 0.0 && radians < std::f64::consts::PI,
        format_args!("{place}fov_degrees"),
        || format!("is {fov}, not between 0 and 180"),
    )
}

fn check_view_space(space: &ViewSpace, place: &str) -> Checked {
    match space {
        ViewSpace::Before { view_cell } => check_view_cell(view_cell, place),
        ViewSpace::Amid {
            view_cell,
            distance,
            objects,
        } => {
            check_view_cell(view_cell, place)?;
            require(
                matches!(view_cell, ViewCell::Box { .. }),
                format_args!("{place}.view_cell"),
                || "is no box, which a cell amid the scene is".into(),
            )?;
            not_negative(*distance, format_args!("{place}.distance"))?;
            require(!objects.is_empty(), format_args!("{place}.objects"), || {
                "are none".into()
            })
        }
        ViewSpace::Inside { view_cell, cells } => {
            check_view_cell(view_cell, place)?;
            require(
                matches!(view_cell, ViewCell::Box { .. }),
                format_args!("{place}.view_cell"),
                || "is no box, which can be cut into cells".into(),
            )?;
            require(!cells.contains(&0), format_args!("{place}.cells"), || {
                format!("are {cells:?}, none along an axis")
            })
        }
        ViewSpace::Around { center, near, far } | ViewSpace::Shell { center, near, far } => {
            require(center.is_finite(), format_args!("{place}.center"), || {
                format!("is {center}")
            })?;
            require(
                *near > 0.0 && near <= far && far.is_finite(),
                format_args!("{place}.near"),
                || format!("is {near}, not between 0 and {far}"),
            )
        }
    }
}

fn check_view_cell(cell: &ViewCell, place: &str) -> Checked {
    let place = &format!("{place}.view_cell");
    match *cell {
        ViewCell::Box { center, size } => {
            finite(center, format_args!("{place}.center"))?;
            finite(size, format_args!("{place}.size"))?;
            not_negative(size.min_element(), format_args!("{place}.size"))
        }
        ViewCell::Shaft {
            apex,
            axis,
            half_angle,
            near,
            far,
        } => {
            finite(apex, format_args!("{place}.apex"))?;
            finite(axis, format_args!("{place}.axis"))?;
            require(
                axis.try_normalize().is_some(),
                format_args!("{place}.axis"),
                || "has no direction".into(),
            )?;
            require(
                half_angle > 0.0 && half_angle < std::f64::consts::FRAC_PI_2,
                format_args!("{place}.half_angle"),
                || format!("is {half_angle}, not between 0 and pi / 2"),
            )?;
            require(
                near > 0.0 && near.is_finite() && far >= near,
                format_args!("{place}.near"),
                || format!("is {near}, not between 0 and the far border at {far}"),
            )
        }
    }
}

fn check_source(scene: &SceneSource) -> Checked {
    match scene {
        SceneSource::File { path, sha256 } => {
            not_empty(path, "scene.path")?;
            require(!is_absolute(path), "scene.path", || {
                format!("{path:?} is not relative to the bundle")
            })?;
            check_sha256(sha256, "scene.sha256")
        }
        SceneSource::BuiltIn { name, .. } => not_empty(name, "scene.name"),
    }
}

fn check_impostor(impostor: &Impostor, place: &str) -> Checked {
    let [min, max] = impostor.represented;
    require(
        min.is_finite() && max.is_finite() && min.cmple(max).all(),
        format_args!("{place}.represented"),
        || format!("is no box: {min} to {max}"),
    )?;
    match &impostor.body {
        Body::Layered(body) => check_layered(body, &format!("{place}.body")),
        Body::Tdm(body) => check_layered(&body.recorded, &format!("{place}.body.recorded")),
        Body::Bitfields(body) => check_bitfields(body, &format!("{place}.body")),
    }
}

/// What the lists come to is compared with the lists where these are read.
fn check_bitfields(body: &BitfieldsBody, place: &str) -> Checked {
    require(
        (1..u64::from(u32::MAX)).contains(&body.triangles),
        format_args!("{place}.triangles"),
        || format!("is {}, not from 1 to 2^32 - 2", body.triangles),
    )?;
    require(
        body.always_drawn <= body.triangles,
        format_args!("{place}.always_drawn"),
        || format!("is more than the {} triangles", body.triangles),
    )?;
    require(
        (0.0..=1.0).contains(&body.culled),
        format_args!("{place}.culled"),
        || format!("is {}, not from 0 to 1", body.culled),
    )
}

fn check_layered(body: &LayeredBody, place: &str) -> Checked {
    check_pose(&body.pose, format_args!("{place}.pose"))?;
    let (min, max) = (body.extent.min, body.extent.max);
    require(
        min.is_finite() && max.is_finite() && min.cmplt(max).all(),
        format_args!("{place}.extent"),
        || format!("is no rectangle: {min} to {max}"),
    )?;
    for (side, texels) in [("width", body.width), ("height", body.height)] {
        require(
            (1..=MAX_SIDE).contains(&texels),
            format_args!("{place}.{side}"),
            || format!("is {texels}, not from 1 to {MAX_SIDE}"),
        )?;
    }
    require(
        !body.layers.is_empty(),
        format_args!("{place}.layers"),
        || "are none".into(),
    )?;
    let mut behind = 0.0;
    for (i, layer) in body.layers.iter().enumerate() {
        let place = format_args!("{place}.layers[{i}]");
        let depths = [layer.near, layer.depth, layer.far];
        require(
            depths.iter().all(|d| d.is_finite()) && depths.is_sorted() && layer.depth > 0.0,
            place,
            || {
                format!(
                    "has near, depth and far at {depths:?}, which are not in order or not before the viewer"
                )
            },
        )?;
        require(layer.near >= behind, place, || {
            format!(
                "begins at depth {}, before the layer before it ends",
                layer.near
            )
        })?;
        check_sha256(&layer.texels_sha256, format_args!("{place}.texels_sha256"))?;
        behind = layer.far;
    }
    require(
        body.layers.is_sorted_by(|a, b| a.depth < b.depth),
        format_args!("{place}.layers"),
        || "are not ordered front to back".into(),
    )?;
    require(
        body.texels_kept <= body.texels_recorded,
        format_args!("{place}.texels_kept"),
        || format!("is more than the {} recorded", body.texels_recorded),
    )
}

fn check_pose(pose: &Pose, place: impl Display) -> Checked {
    finite(pose.eye, format_args!("{place}.eye"))?;
    let m = pose.view_from_world();
    // Unit vectors that went through a handful of operations are off by some 1e-15.
    let orthonormal = (m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-9);
    require(orthonormal && m.determinant() > 0.0, place, || {
        "has axes that are not perpendicular, of length 1 and right-handed".into()
    })
}

/// Checks that a path names a file inside of the bundle that is the bake's own.
///
/// Says what is wrong with it otherwise.
pub(crate) fn check_path(path: &str) -> Result<(), String> {
    let inside = !is_absolute(path)
        && path
            .chars()
            .all(|c| !c.is_control() && !"\\:*?\"<>|".contains(c))
        && path.split('/').all(|name| !matches!(name, "" | "." | ".."));
    if !inside {
        return Err(format!(
            "{path:?} does not name a file inside of the bundle"
        ));
    }
    let lower = path.to_lowercase();
    let first = lower.split('/').next();
    match first {
        Some(MANIFEST_FILE | CERTIFICATE_FILE | "verify.json" | "report.html" | "report") => Err(
            format!("{path:?} is kept for the manifest, the certificate and reports"),
        ),
        _ => Ok(()),
    }
}

fn is_absolute(path: &str) -> bool {
    let drive = path.as_bytes().get(1) == Some(&b':');
    drive || path.starts_with(['/', '\\'])
}

fn check_sha256(digits: &str, place: impl Display) -> Checked {
    let hexadecimal = |c: u8| matches!(c, b'0'..=b'9' | b'a'..=b'f');
    require(
        digits.len() == 64 && digits.bytes().all(hexadecimal),
        place,
        || format!("is {digits:?}, not 64 lower-case hexadecimal digits"),
    )
}

fn sum(mut parts: impl Iterator<Item = u64>) -> Option<u64> {
    parts.try_fold(0u64, u64::checked_add)
}

fn not_empty(text: &str, place: impl Display) -> Checked {
    require(!text.is_empty(), place, || "is empty".into())
}

pub(crate) fn finite(v: DVec3, place: impl Display) -> Checked {
    require(v.is_finite(), place, || format!("is not finite: {v}"))
}

fn not_negative(x: f64, place: impl Display) -> Checked {
    require(x >= 0.0 && x.is_finite(), place, || {
        format!("is {x}, not finite and at least 0")
    })
}

pub(crate) fn require(
    holds: bool,
    place: impl Display,
    problem: impl FnOnce() -> String,
) -> Checked {
    match holds {
        true => Ok(()),
        false => Err(ManifestError {
            place: place.to_string(),
            problem: problem(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{
        certificates, manifests, sample, sample_certificate, sample_of_bitfields,
    };
    use crate::{Channels, Foliage};
    use proptest::prelude::*;

    fn layers(manifest: &mut Manifest, impostor: usize) -> &mut LayeredBody {
        match &mut manifest.impostors[impostor].body {
            Body::Layered(layers) => layers,
            Body::Tdm(body) => &mut body.recorded,
            Body::Bitfields(_) => panic!("there are no layers"),
        }
    }

    fn layered(bytes_per_quad: f64) -> Technique {
        Technique::Layered {
            bytes_per_quad,
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
        }
    }

    fn tdm(enlarged: f64) -> Technique {
        Technique::Tdm {
            enlarged,
            page_size: 4096,
            foliage: Foliage::Any,
            channels: Channels::Lit,
        }
    }

    #[test]
    fn a_sound_manifest_passes() {
        assert_eq!(sample().check(), Ok(()));
    }

    /// Of bitfields too.
    #[test]
    fn every_damage_to_bitfields_is_found() {
        type Damage = fn(&mut Manifest);
        fn body(manifest: &mut Manifest) -> &mut BitfieldsBody {
            match &mut manifest.impostors[0].body {
                Body::Bitfields(body) => body,
                Body::Layered(_) | Body::Tdm(_) => panic!("it is the sample of bitfields"),
            }
        }
        fn technique(samples: Samples, patch_triangles: u32, finer: f64) -> Technique {
            Technique::Bitfields {
                samples,
                held_back: 1,
                tolerated_pixels: 0,
                seed: 0,
                patch_triangles,
                finer,
                neighbors: None,
            }
        }
        fn inside(cells: [u32; 3]) -> ViewSpace {
            ViewSpace::Inside {
                view_cell: ViewCell::Box {
                    center: DVec3::ZERO,
                    size: DVec3::ONE,
                },
                cells,
            }
        }
        let damages: [(&str, Damage); 19] = [
            ("options.view_space.cells", |m| {
                m.options.view_space = inside([8, 0, 1]);
            }),
            ("impostors[0].body.lists", |m| {
                m.options.view_space = inside([3, 1, 3]);
            }),
            ("options.view_space.view_cell", |m| {
                m.options.view_space = ViewSpace::Inside {
                    view_cell: ViewCell::Shaft {
                        apex: DVec3::ZERO,
                        axis: DVec3::Z,
                        half_angle: 0.5,
                        near: 1.0,
                        far: 2.0,
                    },
                    cells: [8, 1, 1],
                };
            }),
            // Its lists are those of faces.
            ("files", |m| m.options.view_space = inside([2, 1, 4])),
            ("technique.patch_triangles", |m| {
                m.technique = technique(Samples::Even, 0, 1.0);
            }),
            ("technique.finer", |m| {
                m.technique = technique(Samples::Even, 64, f64::NAN);
            }),
            ("impostors[0].body", |m| {
                m.technique = tdm(1.5);
                m.options.view_space = sample().options.view_space;
                m.impostors[0].side = Some(crate::Side::Top);
            }),
            ("options.view_space", |m| {
                m.options.view_space = sample().options.view_space;
            }),
            ("options.view_space", |m| m.technique = tdm(1.5)),
            ("options.view_space.near", |m| {
                m.options.view_space = ViewSpace::Shell {
                    center: DVec3::ZERO,
                    near: 0.0,
                    far: 1.0,
                };
            }),
            ("promise.missed_pixels", |m| m.promise.missed_pixels = None),
            ("promise.missed_pixels", |m| {
                m.promise.missed_pixels = Some(1);
            }),
            ("promise.missed_share", |m| {
                m.promise.missed_share = Some(0.0);
            }),
            ("impostors", |m| m.impostors.clear()),
            ("impostors[0].body.triangles", |m| body(m).triangles = 0),
            ("impostors[0].body.triangles", |m| {
                body(m).triangles = 1 << 32;
            }),
            ("impostors[0].body.always_drawn", |m| {
                body(m).always_drawn = 21;
            }),
            ("impostors[0].body.culled", |m| body(m).culled = 1.5),
            ("files", |m| {
                m.files.remove(0);
            }),
        ];
        assert_eq!(sample_of_bitfields().check(), Ok(()));
        for (i, (place, damage)) in damages.into_iter().enumerate() {
            let mut manifest = sample_of_bitfields();
            damage(&mut manifest);
            let found = manifest.check().map_err(|e| e.place);
            assert_eq!(found, Err(place.to_owned()), "damage {i}");
        }
    }

    /// Whatever is damaged, the check names the place.
    #[test]
    fn every_damage_is_found() {
        type Damage = fn(&mut Manifest);
        let damages: [(&str, Damage); 52] = [
            ("format", |m| {
                m.format = "other".into();
            }),
            ("version", |m| {
                m.version = 0;
            }),
            ("generator.name", |m| {
                m.generator.name.clear();
            }),
            ("technique.bytes_per_quad", |m| {
                m.technique = layered(-1.0);
            }),
            ("technique.enlarged", |m| {
                m.technique = tdm(2.5);
            }),
            ("impostors[0].body", |m| {
                m.technique = tdm(1.5);
            }),
            ("options.resolution", |m| {
                m.options.resolution = 0;
            }),
            ("options.resolution", |m| {
                m.options.resolution = 65537;
            }),
            ("options.fov_degrees", |m| {
                m.options.fov_degrees = 180.0;
            }),
            ("options.fov_degrees", |m| {
                m.options.fov_degrees = f64::NAN;
            }),
            // None in radians.
            ("options.fov_degrees", |m| {
                m.options.fov_degrees = 5e-324;
            }),
            ("options.view_space.view_cell.center", |m| {
                m.options.view_space = ViewSpace::Before {
                    view_cell: ViewCell::Box {
                        center: DVec3::INFINITY,
                        size: DVec3::ONE,
                    },
                };
            }),
            ("options.view_space.view_cell.size", |m| {
                m.options.view_space = ViewSpace::Before {
                    view_cell: ViewCell::Box {
                        center: DVec3::ONE,
                        size: DVec3::new(1.0, -1.0, 1.0),
                    },
                };
            }),
            ("options.view_space.view_cell.axis", |m| {
                shaft(m, DVec3::ZERO, 0.1, 1.0, 2.0);
            }),
            ("options.view_space.view_cell.half_angle", |m| {
                shaft(m, DVec3::X, 1.6, 1.0, 2.0);
            }),
            ("options.view_space.view_cell.near", |m| {
                shaft(m, DVec3::X, 0.1, 2.0, 1.0);
            }),
            ("options.view_space.view_cell.near", |m| {
                shaft(m, DVec3::X, 0.1, 0.0, 1.0);
            }),
            ("options.view_space.view_cell.near", |m| {
                shaft(m, DVec3::X, 0.1, 1.0, f64::NAN);
            }),
            ("options.view_space.view_cell", |m| {
                shaft(m, DVec3::X, 0.1, 1.0, 2.0);
                let ViewSpace::Before { view_cell } = m.options.view_space else {
                    unreachable!("a shaft is before the scene");
                };
                m.options.view_space = ViewSpace::Amid {
                    view_cell,
                    distance: 1.0,
                    objects: vec!["house".into()],
                };
            }),
            ("options.view_space.distance", |m| {
                amid(m, f64::NAN, vec!["house".into()]);
            }),
            ("options.view_space.objects", |m| amid(m, 1.0, vec![])),
            ("options.view_space.near", |m| {
                m.options.view_space = ViewSpace::Around {
                    center: DVec3::ZERO,
                    near: 2.0,
                    far: 1.0,
                };
            }),
            ("options.view_space.center", |m| {
                m.options.view_space = ViewSpace::Around {
                    center: DVec3::NAN,
                    near: 1.0,
                    far: 2.0,
                };
            }),
            ("impostors[1].side", |m| {
                m.impostors[1].side = m.impostors[0].side;
            }),
            ("impostors[0].side", |m| m.impostors[0].side = None),
            ("scene.name", |m| {
                m.scene = SceneSource::BuiltIn {
                    name: String::new(),
                    size: 1,
                    seed: 1,
                };
            }),
            ("scene.path", |m| file(m, "/home/a.glb", &"0".repeat(64))),
            ("scene.path", |m| file(m, "C:/a.glb", &"0".repeat(64))),
            ("scene.sha256", |m| file(m, "../a.glb", &"A".repeat(64))),
            ("promise.parallax_px", |m| {
                m.promise.parallax_px = Some(f64::INFINITY);
            }),
            ("promise.coverage_error", |m| {
                m.promise.coverage_error = Some(-0.1);
            }),
            ("promise.coverage_change", |m| {
                m.promise.coverage_change = Some(f64::NAN);
            }),
            ("promise.colour_bias", |m| {
                m.promise.colour_bias = Some(-0.004);
            }),
            ("promise.surface_bias", |m| {
                m.promise.surface_bias = Some(-0.004);
            }),
            ("promise.stray_colours", |m| {
                m.promise.stray_colours = Some(f64::NAN);
            }),
            ("impostors[1].name", |m| {
                m.impostors[1].name = m.impostors[0].name.clone();
            }),
            ("impostors[0].represented", |m| {
                m.impostors[0].represented.swap(0, 1);
            }),
            ("impostors[0].body.pose.eye", |m| {
                layers(m, 0).pose.eye.x = f64::NAN;
            }),
            ("impostors[0].body.pose", |m| {
                layers(m, 0).pose.right *= 1.1;
            }),
            ("impostors[0].body.pose", |m| {
                layers(m, 0).pose.down *= -1.0;
            }),
            ("impostors[0].body.extent", |m| {
                layers(m, 0).extent.max.y = -9.0;
            }),
            ("impostors[0].body.width", |m| {
                layers(m, 0).width = 0;
            }),
            ("impostors[1].body.height", |m| {
                layers(m, 1).height = 1 << 20;
            }),
            ("impostors[0].body.layers[1]", |m| {
                layers(m, 0).layers[1].far = 5.0;
            }),
            ("impostors[0].body.layers[0]", |m| {
                layers(m, 0).layers[0].near = f64::NAN;
            }),
            ("impostors[0].body.layers[1]", |m| {
                layers(m, 0).layers.swap(0, 1);
            }),
            ("impostors[0].body.texels_kept", |m| {
                layers(m, 0).texels_kept = 1001;
            }),
            ("statistics.layers", |m| {
                m.statistics.layers = 4;
            }),
            ("statistics.quads", |m| {
                layers(m, 1).layers[0].quads = 8;
            }),
            ("statistics.texels_recorded", |m| {
                layers(m, 0).texels_recorded = u64::MAX;
            }),
            ("files", |m| {
                m.files[0].path = "other.glb".into();
            }),
            ("files[1].path", |m| {
                m.files.push(m.files[0].clone());
            }),
        ];
        for (i, (place, damage)) in damages.into_iter().enumerate() {
            let mut manifest = sample();
            damage(&mut manifest);
            let found = manifest.check().map_err(|e| e.place);
            assert_eq!(found, Err(place.to_owned()), "damage {i}");
        }
    }

    /// Whatever is damaged in a certificate, the check names the place.
    #[test]
    fn every_damage_of_a_certificate_is_found() {
        type Damage = fn(&mut Certificate);
        fn beyond(certificate: &mut Certificate) -> &mut crate::Beyond {
            certificate.beyond.as_mut().unwrap()
        }
        let damages: [(&str, Damage); 21] = [
            ("format", |c| c.format = FORMAT.into()),
            ("version", |c| c.version = 2),
            ("generator.name", |c| c.generator.name.clear()),
            ("bundle_sha256", |c| c.bundle_sha256.clear()),
            ("scene.name", |c| {
                c.scene = SceneSource::BuiltIn {
                    name: String::new(),
                    size: 1,
                    seed: 1,
                };
            }),
            ("view_space.view_cell.size", |c| {
                c.view_space = ViewSpace::Before {
                    view_cell: ViewCell::Box {
                        center: DVec3::ONE,
                        size: DVec3::NAN,
                    },
                };
            }),
            ("resolution", |c| c.resolution = 0),
            ("fov_degrees", |c| c.fov_degrees = 0.0),
            ("viewpoints", |c| c.viewpoints = 0),
            ("worst.parallax_px", |c| c.worst.parallax_px = f64::NAN),
            ("worst.silhouette_px", |c| {
                c.worst.silhouette_px = f64::INFINITY;
            }),
            ("worst.coverage_error", |c| c.worst.coverage_error = -0.1),
            ("worst.colour_bias", |c| c.worst.colour_bias = -0.1),
            ("worst.flip", |c| c.worst.flip = Some(f64::NAN)),
            ("worst.worst_view", |c| c.worst.worst_view = 256),
            ("proved[0].bound", |c| c.proved[0].bound = f64::INFINITY),
            ("proved[0].limit", |c| c.proved[0].limit = f64::NAN),
            ("beyond.cell_scale", |c| beyond(c).cell_scale = -1.0),
            ("beyond.switch_distance_m", |c| {
                beyond(c).switch_distance_m = f64::INFINITY;
            }),
            ("beyond.screen_coverage", |c| {
                beyond(c).screen_coverage = f64::NAN;
            }),
            ("beyond.geometric_error_m", |c| {
                beyond(c).geometric_error_m = -1.0;
            }),
        ];
        let sound = sample_certificate(&sample());
        assert_eq!(sound.check(), Ok(()));
        for (i, (place, damage)) in damages.into_iter().enumerate() {
            let mut certificate = sound.clone();
            damage(&mut certificate);
            let found = certificate.check().map_err(|e| e.place);
            assert_eq!(found, Err(place.to_owned()), "damage {i}");
        }
    }

    fn shaft(manifest: &mut Manifest, axis: DVec3, half_angle: f64, near: f64, far: f64) {
        let view_cell = ViewCell::Shaft {
            apex: DVec3::ZERO,
            axis,
            half_angle,
            near,
            far,
        };
        manifest.options.view_space = ViewSpace::Before { view_cell };
    }

    fn amid(manifest: &mut Manifest, new_distance: f64, new_objects: Vec<String>) {
        let ViewSpace::Amid {
            distance, objects, ..
        } = &mut manifest.options.view_space
        else {
            unreachable!("the sample is amid the scene");
        };
        (*distance, *objects) = (new_distance, new_objects);
    }

    fn file(manifest: &mut Manifest, path: &str, sha256: &str) {
        manifest.scene = SceneSource::File {
            path: path.into(),
            sha256: sha256.into(),
        };
    }

    #[test]
    fn paths_stay_inside() {
        for path in [
            "impostors.glb",
            "pages/000.png",
            "a/b/c.d",
            "..a/b..",
            "zoë.png",
        ] {
            assert_eq!(check_path(path), Ok(()));
        }
        let outside = [
            "",
            "/",
            "/a",
            "a/",
            "a//b",
            ".",
            "..",
            "../a",
            "a/../b",
            "a/./b",
            "a/..",
            "C:",
            "C:/a",
            "C:a",
            "\\a",
            "a\\..\\b",
            "a\0b",
            "a\nb",
            "nul?",
            "bundle.json",
            "Bundle.JSON",
            "certificate.json",
            "verify.json",
            "report.html",
            "report/worst.png",
        ];
        for path in outside {
            assert!(check_path(path).is_err(), "{path:?}");
        }
    }

    proptest! {
        /// The generator of sound manifests makes sound manifests.
        #[test]
        fn random_manifests_pass(manifest in manifests()) {
            prop_assert_eq!(manifest.check(), Ok(()));
        }

        /// The generator of sound certificates makes sound certificates.
        #[test]
        fn random_certificates_pass(certificate in certificates(&sample())) {
            prop_assert_eq!(certificate.check(), Ok(()));
        }
    }
}
