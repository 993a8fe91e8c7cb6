//! What is compared with what.

use crate::view_cell::represented_box;
use anyhow::{Result, bail};
use farfield_bundle::{Body, Impostor, LayeredBody, Manifest, Technique};
use farfield_layers::{Layer, LayerStack, PromisedCamera};
use farfield_sampling::{Foliage, Textures, Tracer};
use farfield_scene::Scene;
use farfield_views::{Camera, Pose, ViewCell};
use glam::{DVec2, DVec3};

/// A scene with what is needed to look at it.
pub(super) struct Side<'a> {
    pub(super) scene: &'a Scene,
    pub(super) textures: Textures<'a>,
}

impl<'a> Side<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            textures: Textures::new(scene),
        }
    }
}

/// The original and its impostor, and the camera that the promise is made for.
pub(super) struct Subject<'a> {
    pub(super) original: Side<'a>,
    pub(super) impostor: Side<'a>,
    /// Meets the impostor's geometry.
    pub(super) tracer: Tracer,
    /// Where the layers are, as the manifest says.
    pub(super) stack: LayerStack,
    /// Checksum of where each layer has texels, as the manifest says.
    pub(super) texels_sha256: Vec<&'a str>,
    /// Depths between the layers, from the reference viewpoint.
    pub(super) borders: Vec<f64>,
    /// How masked materials were recorded.
    pub(super) foliage: Foliage,
    pub(super) cell: ViewCell,
    /// Least and greatest corner of what is represented, in the world.
    pub(super) represented: [DVec3; 2],
    pub(super) lens: PromisedCamera,
    /// Pixels of parallax that are promised.
    pub(super) most_parallax: f64,
}

/// Distinguishes verify's viewpoints from any that a bake may look from.
pub(super) const SEED: u64 = 0x7665_7269_6679;

impl<'a> Subject<'a> {
    /// The one impostor of a bundle and its original.
    pub(super) fn new(
        manifest: &'a Manifest,
        original: &'a Scene,
        impostor: &'a Scene,
    ) -> Result<Self> {
        let [one] = manifest.impostors.as_slice() else {
            bail!(
                "the bundle holds {} impostors; this version verifies one",
                manifest.impostors.len()
            );
        };
        let Impostor {
            represented, body, ..
        } = one;
        let Body::Layered(body) = body;
        let filled = represented_box(original)?;
        require_same_box(*represented, filled)?;
        let checksums = body.layers.iter().map(|layer| layer.texels_sha256.as_str());
        Ok(Self {
            original: Side::new(original),
            impostor: Side::new(impostor),
            tracer: Tracer::new(impostor),
            stack: stack_of(body),
            texels_sha256: checksums.collect(),
            borders: body.borders(),
            foliage: match manifest.technique {
                Technique::Layered {
                    foliage: farfield_bundle::Foliage::Centre,
                    ..
                } => Foliage::Centre,
                Technique::Layered { .. } => Foliage::Any,
            },
            cell: manifest.options.view_cell,
            represented: filled,
            lens: PromisedCamera {
                aim: farfield_layers::Aim::Center,
                fov: manifest.options.fov_degrees.to_radians(),
                resolution: manifest.options.resolution,
            },
            most_parallax: manifest.promise.parallax_px.unwrap_or(f64::INFINITY),
        })
    }

    /// What the promised camera looks at, in the world.
    pub(super) fn target(&self) -> DVec3 {
        (self.represented[0] + self.represented[1]) / 2.0
    }

    /// Corners of a box around what is represented and the original, in the world.
    pub(super) fn corners(&self) -> [DVec3; 8] {
        let [min, max] = self.represented;
        std::array::from_fn(|i| {
            let side = |axis: usize| {
                if i >> axis & 1 == 0 {
                    min[axis]
                } else {
                    max[axis]
                }
            };
            DVec3::new(side(0), side(1), side(2))
        })
    }

    /// The promised camera at a place, with its resolution divided.
    pub(super) fn camera(&self, eye: DVec3, divisor: u32) -> Camera {
        let resolution = (self.lens.resolution / divisor).max(1);
        Camera::looking_at(eye, self.target(), self.lens.fov, resolution)
    }

    /// Viewpoint number `view` in the world: 0 is the reference viewpoint.
    pub(super) fn eye(&self, view: u64) -> DVec3 {
        match view.checked_sub(1) {
            None => self.reference().eye,
            Some(index) => self.cell.viewpoint(index, SEED),
        }
    }

    /// The reference viewpoint, with the axis that the layers are across.
    pub(super) fn reference(&self) -> &Pose {
        &self.stack.pose
    }

    /// Width and height of a texel at unit depth.
    pub(super) fn texel(&self) -> DVec2 {
        let texels = DVec2::new(self.stack.width.into(), self.stack.height.into());
        self.stack.extent.size() / texels
    }
}

/// Refuses a manifest whose impostor stands for something else than the original.
fn require_same_box(stated: [DVec3; 2], found: [DVec3; 2]) -> Result<()> {
    // Other builds round otherwise.
    let digits = 1e-9 * found[0].abs().max(found[1].abs()).max_element();
    let is_same = (0..2).all(|i| stated[i].abs_diff_eq(found[i], digits));
    if !is_same {
        bail!(
            "the manifest says that the box from {} to {} is represented, but the original fills \
             {} to {}: bake it again",
            stated[0],
            stated[1],
            found[0],
            found[1]
        );
    }
    Ok(())
}

fn stack_of(body: &LayeredBody) -> LayerStack {
    let layers = body.layers.iter().map(|layer| Layer {
        depth: layer.depth,
        near: layer.near,
        far: layer.far,
    });
    LayerStack {
        pose: body.pose,
        extent: body.extent,
        width: body.width,
        height: body.height,
        layers: layers.collect(),
    }
}
