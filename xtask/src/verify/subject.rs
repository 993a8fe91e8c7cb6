//! What is compared with what.

use crate::bake::recording::Settings;
use crate::parts::Part;
use crate::viewpoints;
use crate::voxels::Projection;
use anyhow::{Context, Result, bail};
use farfield_bundle::{Body, Channels, Impostor, LayeredBody, Manifest, TdmBody, Technique};
use farfield_layers::{Aim, Layer, LayerStack, PromisedCamera};
use farfield_sampling::{Foliage, NearestPoints, Textures, Tracer};
use farfield_scene::Scene;
use farfield_views::{Camera, Pose, ViewCell};
use glam::{DVec2, DVec3, DVec4};
use std::borrow::Cow;

/// A scene with what is needed to look at it.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) scene: &'a Scene,
    pub(super) textures: &'a Textures<'a>,
}

/// A part of the original and its impostor, and the camera that the promise is made for.
pub(super) struct Subject<'a> {
    /// The impostor's name.
    pub(super) name: &'a str,
    pub(super) original: Side<'a>,
    /// What is displayed of it alone.
    pub(super) impostor: Side<'a>,
    /// How it shows what was recorded.
    pub(super) shape: Shape,
    /// Where the layers are, as the manifest says.
    pub(super) stack: LayerStack,
    /// Checksum of where each layer has texels, as the manifest says.
    pub(super) texels_sha256: Vec<&'a str>,
    /// Depths between the layers, from the reference viewpoint.
    pub(super) borders: Vec<f64>,
    /// How masked materials were recorded.
    pub(super) foliage: Foliage,
    /// What the pages hold.
    pub(super) channels: Channels,
    pub(super) cell: ViewCell,
    /// Least and greatest corner of what is represented, in the world.
    pub(super) represented: [DVec3; 2],
    /// Corners of a convex body around it.
    hull: [DVec3; 8],
    pub(super) lens: PromisedCamera,
    /// Pixels of parallax that are promised.
    pub(super) most_parallax: f64,
}

/// How an impostor shows what was recorded.
pub(super) enum Shape {
    /// On quads in the layers, where rays from the reference viewpoint meet them.
    Layers(Tracer),
    /// On a mesh that passes near it.
    Mesh(Box<MeshShape>),
}

/// A mesh in the warped grid.
pub(super) struct MeshShape {
    /// The mesh as it was made.
    pub(super) body: TdmBody,
    /// Side of a voxel in which the mesh touches it, in voxels.
    pub(super) enlarged: f64,
    pub(super) projection: Projection,
    /// Of its triangles, in the grid.
    pub(super) points: NearestPoints,
}

/// How far from a point its place on a mesh is looked for, in voxels.
const NEAR: f64 = 8.0;

impl MeshShape {
    fn new(body: &TdmBody, enlarged: f64, stack: &LayerStack, mesh: &Scene) -> Result<Self> {
        let projection = Projection::of(stack);
        let triangles: Vec<_> = mesh
            .triangles_in_world()
            .map(|corners| corners.map(|point| projection.place(point)))
            .collect();
        let places = triangles.as_flattened();
        if let Some(place) = places.iter().find(|place| !place.as_vec3().is_finite()) {
            bail!("the mesh has a corner at {place} in the grid of its layers; bake again");
        }
        Ok(Self {
            body: body.clone(),
            enlarged,
            projection,
            points: NearestPoints::new(&triangles),
        })
    }

    /// The point of the mesh that is nearest to a point of the world, measured in the grid.
    pub(super) fn nearest(&self, point: DVec3) -> Option<DVec3> {
        let found = self.points.nearest(self.projection.place(point), NEAR);
        found.map(|place| self.projection.point_in_world(place))
    }
}

impl<'a> Subject<'a> {
    /// One impostor of a bundle and the part of the original that it stands for.
    pub(super) fn new(
        manifest: &'a Manifest,
        impostor: &'a Impostor,
        part: &'a Part<'_>,
        original: &'a Textures<'a>,
        quads: Side<'a>,
    ) -> Result<Self> {
        let body = impostor.body.layers();
        let body = body.expect("what has pages has layers");
        let settings = settings(manifest, part);
        require_same_box(impostor.represented, part.represented)?;
        let stack = stack_of(body);
        let shape = match (&impostor.body, &manifest.technique) {
            (Body::Tdm(mesh), Technique::Tdm { enlarged, .. }) => {
                let shape = MeshShape::new(mesh, *enlarged, &stack, quads.scene);
                Shape::Mesh(Box::new(shape.with_context(|| impostor.name.clone())?))
            }
            _ => Shape::Layers(Tracer::new(quads.scene)),
        };
        let checksums = body.layers.iter().map(|layer| layer.texels_sha256.as_str());
        Ok(Self {
            name: &impostor.name,
            original: Side {
                scene: &part.scene,
                textures: original,
            },
            impostor: quads,
            shape,
            stack,
            texels_sha256: checksums.collect(),
            borders: body.borders(),
            foliage: settings.foliage,
            channels: settings.channels,
            cell: part.cell,
            represented: part.represented,
            hull: part.hull,
            lens: settings.camera,
            most_parallax: manifest.promise.parallax_px.unwrap_or(f64::INFINITY),
        })
    }

    /// By how many layers a surface may be shown behind where it is.
    pub(super) fn slack(&self) -> u32 {
        match &self.shape {
            Shape::Layers(_) => 1,
            // From one border of a voxel to the other of the enlarged one.
            Shape::Mesh(mesh) => 1 + ((1.0 + mesh.enlarged) / 2.0).ceil() as u32,
        }
    }

    /// The centre of what is represented, in the world.
    pub(super) fn target(&self) -> DVec3 {
        (self.represented[0] + self.represented[1]) / 2.0
    }

    /// Corners of a box around what is represented and the original, in the world.
    pub(super) fn corners(&self) -> [DVec3; 8] {
        farfield_layers::box_corners(self.represented)
    }

    /// The promised camera at viewpoint number `index`, with its resolution divided.
    pub(super) fn camera(&self, index: u64, divisor: u32) -> Camera {
        self.camera_towards(self.eye(index), self.looked_at(index), divisor)
    }

    /// Where the promised camera looks from viewpoint number `index`.
    pub(super) fn looked_at(&self, index: u64) -> DVec3 {
        match self.lens.aim {
            Aim::Center => self.target(),
            Aim::Anywhere => viewpoints::sight(&self.hull, index),
        }
    }

    /// The promised camera at a place, looking at the centre of what is represented.
    pub(super) fn camera_at(&self, eye: DVec3) -> Camera {
        self.camera_towards(eye, self.target(), 1)
    }

    fn camera_towards(&self, eye: DVec3, target: DVec3, divisor: u32) -> Camera {
        let resolution = (self.lens.resolution / divisor).max(1);
        Camera::looking_at(eye, target, self.lens.fov, resolution)
    }

    /// Viewpoint number `index` of this impostor in the world: 0 is the reference viewpoint.
    pub(super) fn eye(&self, index: u64) -> DVec3 {
        viewpoints::eye(self.reference().eye, &self.cell, index)
    }

    /// The original, or what of it can be in a camera's picture, all before the camera.
    pub(super) fn before(&self, camera: &Camera) -> Cow<'a, Scene> {
        match self.lens.aim {
            Aim::Center => Cow::Borrowed(self.original.scene),
            Aim::Anywhere => Cow::Owned(self.in_picture(camera)),
        }
    }

    /// The original as far as it can be in a camera's picture.
    pub(super) fn in_picture(&self, camera: &Camera) -> Scene {
        self.original.scene.clipped(&pyramid(camera))
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

/// What a bundle says the impostor of a part was made for.
pub(super) fn settings(manifest: &Manifest, part: &Part<'_>) -> Settings {
    let (Technique::Layered {
        page_size,
        foliage,
        channels,
        ..
    }
    | Technique::Tdm {
        page_size,
        foliage,
        channels,
        ..
    }) = manifest.technique
    else {
        unreachable!("bitfields are no impostors");
    };
    Settings {
        cell: part.cell,
        hull: part.hull,
        camera: part.camera,
        page_size,
        foliage: match foliage {
            farfield_bundle::Foliage::Any => Foliage::Any,
            farfield_bundle::Foliage::Centre => Foliage::Centre,
        },
        channels,
    }
}

/// The four planes round what a camera sees, and a little more.
fn pyramid(camera: &Camera) -> [DVec4; 4] {
    let Camera { pose, extent, .. } = camera;
    let slack = extent.size() * 0.01;
    let (min, max) = (extent.min - slack, extent.max + slack);
    [
        pose.right - pose.forward * min.x,
        pose.forward * max.x - pose.right,
        pose.down - pose.forward * min.y,
        pose.forward * max.y - pose.down,
    ]
    .map(|normal| normal.extend(-normal.dot(pose.eye)))
}

/// Refuses a manifest whose impostor stands for something else than the original.
pub(super) fn require_same_box(stated: [DVec3; 2], found: [DVec3; 2]) -> Result<()> {
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
