//! The warped grid of a stack of layers, as textured depth meshes need it.

use farfield_grid::BitMask;
use farfield_layers::LayerStack;
use farfield_sampling::{Recording, Sample};
use farfield_scene::Scene;
use farfield_tdm::VoxelLayers;
use farfield_views::{Camera, Pose};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// Maps the world to the warped grid and back (Jeschke, 2005, section 4.3): x and y are texels, z is
/// 1 / depth, scaled so that layers are 1 thick on average. A projection, so that what is straight in
/// one is so in the other.
pub(crate) struct Projection {
    camera: Camera,
    /// 1 / depth where z is 0.
    nearest: f64,
    /// Of z, per unit of 1 / depth.
    scale: f64,
}

impl Projection {
    pub(crate) fn of(stack: &LayerStack) -> Self {
        let borders = stack.borders();
        let [near, far] = [borders[0], borders[borders.len() - 1]].map(f64::recip);
        // What has no depth lies in the middle of a layer.
        let is_flat = near - far <= near * 1e-9;
        Self {
            camera: crate::bake::recording::recording_camera(stack),
            nearest: near,
            scale: match is_flat {
                true => 0.0,
                false => stack.layers.len() as f64 / (near - far),
            },
        }
    }

    fn pose(&self) -> &Pose {
        &self.camera.pose
    }

    fn z(&self, depth: f64) -> f64 {
        (self.nearest - depth.recip()) * self.scale
    }

    /// The depth, from the reference viewpoint, of a place in the grid.
    pub(crate) fn depth(&self, z: f64) -> f64 {
        match self.scale == 0.0 {
            true => self.nearest.recip(),
            false => (self.nearest - z / self.scale).recip(),
        }
    }

    /// Where a point of the world is in the grid.
    pub(crate) fn place(&self, point: DVec3) -> DVec3 {
        let in_view = self.pose().point_in_view(point);
        let pixel = self.camera.pixel_from_view(in_view);
        pixel.extend(self.z(in_view.z))
    }

    /// Where a place in the grid is in the world.
    pub(crate) fn point_in_world(&self, place: DVec3) -> DVec3 {
        let at = DVec2::new(place.x, place.y);
        let in_view = self.camera.view_from_pixel(at, self.depth(place.z));
        self.pose().point_in_world(in_view)
    }

    /// Where the surface points of samples are in the grid.
    pub(crate) fn points(&self, scene: &Scene, samples: &[Sample]) -> Vec<Vec3> {
        let place = |sample: &Sample| self.place(sample.hit.point_in_world(scene)).as_vec3();
        samples.par_iter().map(place).collect()
    }

    /// How much more texels a triangle needs at its nearest corner than on average, where a texture
    /// is laid evenly over it in the world, as clients do.
    pub(crate) fn stretch(&self, corners: [Vec3; 3]) -> f32 {
        let depths = corners.map(|p| self.depth(p.z.into()));
        let nearest = depths.into_iter().fold(f64::INFINITY, f64::min);
        let farthest = depths.into_iter().fold(0.0, f64::max);
        (farthest / nearest) as f32
    }
}

/// The voxels of a stack's layers that can be seen.
pub(crate) struct VoxelGrid {
    width: u32,
    height: u32,
    layers: Vec<Vec<[u16; 2]>>,
    reached: Vec<BitMask>,
    borders: Vec<f32>,
}

impl VoxelGrid {
    /// * `visible` - the texels of the layers that can be seen
    /// * `reached` - of each layer the texels that lines of sight reach
    pub(crate) fn new(
        stack: &LayerStack,
        projection: &Projection,
        visible: &Recording,
        reached: Vec<BitMask>,
    ) -> Self {
        let layers = visible.layers.iter().map(|run| {
            let samples = &visible.samples[run.clone()];
            samples.iter().map(|sample| [sample.x, sample.y]).collect()
        });
        let borders = match projection.scale == 0.0 {
            true => vec![-0.5, 0.5],
            false => stack
                .borders()
                .iter()
                .map(|depth| projection.z(*depth) as f32)
                .collect(),
        };
        Self {
            width: stack.width,
            height: stack.height,
            layers: layers.collect(),
            reached,
            borders,
        }
    }

    pub(crate) fn layers(&self) -> VoxelLayers<'_> {
        VoxelLayers {
            width: self.width,
            height: self.height,
            layers: &self.layers,
            reached: &self.reached,
            borders: &self.borders,
        }
    }
}
