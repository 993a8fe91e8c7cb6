//! Triangles before a camera, as the search for what they touch has them: rounded, with bounds of how
//! far that is off.

use crate::GpuError;
use bytemuck::{Pod, Zeroable};
use farfield_scene::{Mesh, Scene};
use farfield_views::Camera;
use glam::{DAffine3, DVec2, DVec3, DVec4};
use std::collections::BTreeMap;

/// A bit of what a material is like; another one is [`crate::scene::DOUBLE_SIDED`].
pub(crate) const MASKED: u32 = 1;

/// Everything that is drawn.
#[derive(Debug, Default)]
pub(crate) struct Drawn {
    /// Vertices of the meshes that are drawn, relative to the middle of their mesh.
    pub(crate) positions: Vec<[f32; 3]>,
    /// Three vertices and what the material is like.
    pub(crate) triangles: Vec<[u32; 4]>,
    /// Objects that have triangles.
    pub(crate) objects: Vec<Placed>,
    /// Of each of these, its index in the scene and that of its first triangle.
    pub(crate) ids: Vec<[u32; 2]>,
    /// Triangles of all objects.
    pub(crate) count: u64,
}

/// Where an object stands before a camera.
///
/// The unit of depth is the distance to the scene's farthest corner.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Placed {
    /// Takes a point of the mesh, relative to its middle, to texels right of the middle of the picture
    /// times the depth.
    pub(crate) x: [f32; 4],
    /// To texels below it.
    pub(crate) y: [f32; 4],
    /// To the depth.
    pub(crate) depth: [f32; 4],
    /// How far each of the three can be off, computed in f32.
    pub(crate) doubt: [f32; 3],
    /// Number of its first triangle among all that are drawn.
    pub(crate) first_drawn: u32,
    /// Index of its first triangle in the list.
    pub(crate) first_triangle: u32,
    /// -1 where triangles turn their winding, else 1.
    pub(crate) winding: f32,
    pub(crate) padding: [u32; 2],
}

/// Where one mesh lies in the lists.
struct Listed {
    first_triangle: u32,
    middle: DVec3,
    /// Half of the size of its bounds.
    reach: DVec3,
}

impl Drawn {
    /// All triangles of a scene before a camera.
    ///
    /// # Errors
    ///
    /// When there are more than 2^32 - 1 triangles, or numbers of 24 bits say nothing about where one lies.
    pub(crate) fn new(scene: &Scene, space: &Space) -> Result<Self, GpuError> {
        let mut drawn = Self::default();
        let mut meshes = BTreeMap::new();
        for (index, object) in (0u32..).zip(&scene.objects) {
            let mesh = scene.mesh_of(index);
            if mesh.triangles.is_empty() {
                continue;
            }
            let listed = meshes
                .entry(object.mesh)
                .or_insert_with(|| drawn.list(scene, mesh));
            let placed = space.placed(&object.world_from_mesh, listed.middle, listed.reach);
            let Some((rows, doubt)) = placed else {
                return Err(GpuError::Imprecise {
                    what: format!("object {:?}", object.name),
                });
            };
            drawn.ids.push([index, mesh.triangles.start]);
            drawn.objects.push(Placed {
                x: rows[0],
                y: rows[1],
                depth: rows[2],
                doubt,
                first_drawn: drawn.count as u32,
                first_triangle: listed.first_triangle,
                winding: match object.is_mirrored() {
                    true => -1.0,
                    false => 1.0,
                },
                padding: [0; 2],
            });
            drawn.count += mesh.triangles.len() as u64;
            if drawn.count > u64::from(u32::MAX) {
                return Err(GpuError::TooLarge {
                    what: "the number of triangles".into(),
                    size: drawn.count,
                    limit: "greatest instance index",
                    allowed: u32::MAX.into(),
                });
            }
        }
        Ok(drawn)
    }

    /// Lists the vertices and triangles of a mesh.
    fn list(&mut self, scene: &Scene, mesh: &Mesh) -> Listed {
        let vertices = mesh.vertices.start as usize..mesh.vertices.end as usize;
        let triangles = mesh.triangles.start as usize..mesh.triangles.end as usize;
        let points = || {
            scene.positions[vertices.clone()]
                .iter()
                .map(|p| p.as_dvec3())
        };
        let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [min, max] = points().fold(nothing, |[min, max], p| [min.min(p), max.max(p)]);
        let listed = Listed {
            first_triangle: self.triangles.len() as u32,
            middle: (min + max) / 2.0,
            reach: (max - min) / 2.0,
        };
        let first_vertex = self.positions.len() as u32;
        let moved = points().map(|point| (point - listed.middle).as_vec3().to_array());
        self.positions.extend(moved);
        let materials = &scene.triangle_materials[triangles.clone()];
        let of_mesh = scene.triangles[triangles].iter().zip(materials);
        self.triangles.extend(of_mesh.map(|(triangle, material)| {
            let [a, b, c] = triangle.map(|vertex| vertex - mesh.vertices.start + first_vertex);
            let material = &scene.materials[*material as usize];
            let flag = |flag: u32, is_set: bool| if is_set { flag } else { 0 };
            let like = flag(MASKED, material.alpha.cutoff().is_some())
                | flag(crate::scene::DOUBLE_SIDED, material.double_sided);
            [a, b, c, like]
        }));
        listed
    }

    /// Object and triangle, in the scene, of a number among all that are drawn.
    pub(crate) fn ids_of(&self, drawn: u32) -> [u32; 2] {
        let after = self
            .objects
            .partition_point(|object| object.first_drawn <= drawn);
        let [object, triangle] = self.ids[after - 1];
        [
            object,
            triangle + (drawn - self.objects[after - 1].first_drawn),
        ]
    }
}

/// The space that objects are placed in: depth along the view axis, and texels beside the middle of the
/// picture times the depth.
#[derive(Debug)]
pub(crate) struct Space {
    camera: Camera,
    /// Of depth, in metres.
    pub(crate) unit: f64,
}

/// A rounding to f32.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// No doubt is smaller, not even that of what lies exactly in a plane through the eye: of numbers that are
/// far smaller, f32 has fewer digits.
const LEAST_DOUBT: f64 = 1e-12;

impl Space {
    /// Before a camera, for a scene.
    pub(crate) fn new(scene: &Scene, camera: &Camera) -> Self {
        let eye = camera.pose.eye;
        let farthest = scene.bounds().map_or(1.0, |[min, max]| {
            (eye - min).abs().max((eye - max).abs()).length()
        });
        Self {
            camera: *camera,
            unit: if farthest > 0.0 { farthest } else { 1.0 },
        }
    }

    /// The rows that take a vector of view space here.
    fn rows(&self) -> [DVec3; 3] {
        let extent = &self.camera.extent;
        let middle = (extent.min + extent.max) / 2.0;
        let pixel = self.camera.pixel_size();
        [
            DVec3::new(1.0, 0.0, -middle.x) / (pixel.x * self.unit),
            DVec3::new(0.0, 1.0, -middle.y) / (pixel.y * self.unit),
            DVec3::Z / self.unit,
        ]
    }

    /// A corner of a view cell, in homogeneous coordinates of the world, and here: of such a length that
    /// nothing overflows.
    pub(crate) fn corner(&self, corner: DVec4) -> [f32; 4] {
        let pose = &self.camera.pose;
        let in_view = pose.view_from_world() * (corner.truncate() - pose.eye * corner.w);
        let here = DVec3::from(self.rows().map(|row| row.dot(in_view)));
        let here = here.extend(corner.w);
        (here / here.abs().max_element()).as_vec4().to_array()
    }

    /// The rows that take a point of a mesh here, and how far what they give is off, computed in f32 in
    /// any order; `None` where that says nothing.
    ///
    /// Of each product the row, the point and the product are rounded, and each sum at most three times:
    /// that is 6 roundings of the sum of magnitudes.
    fn placed(
        &self,
        world_from_mesh: &DAffine3,
        middle: DVec3,
        reach: DVec3,
    ) -> Option<([[f32; 4]; 3], [f32; 3])> {
        let pose = &self.camera.pose;
        let linear = pose.view_from_world() * world_from_mesh.matrix3;
        let at = pose.point_in_view(world_from_mesh.transform_point3(middle));
        let rows = self.rows().map(|row| {
            // Row by row of the matrix that takes the mesh's axes to view space.
            let axes = DVec3::new(
                row.dot(linear.x_axis),
                row.dot(linear.y_axis),
                row.dot(linear.z_axis),
            );
            axes.extend(row.dot(at))
        });
        let magnitude = |row: &DVec4| row.abs().dot(reach.extend(1.0));
        let doubts = rows.each_ref().map(|row| 8.0 * ROUNDING * magnitude(row));
        let single = rows.map(|row| row.as_vec4().to_array());
        // Far from where f32 overflows, also squared; nor is any of them no number.
        let is_usable = |doubt: &f64| *doubt < 1e12;
        let mesh_is_usable = (reach.max_element() == 0.0 || reach.max_element() > 1e-18)
            && reach.max_element() < 1e18;
        (mesh_is_usable && doubts.iter().all(is_usable))
            .then(|| (single, doubts.map(|doubt| doubt.max(LEAST_DOUBT) as f32)))
    }

    /// From the middle of the picture to its borders, in texels.
    pub(crate) fn half(&self) -> DVec2 {
        DVec2::new(self.camera.width.into(), self.camera.height.into()) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_views::{Extent, Pose};
    use glam::DQuat;
    use proptest::prelude::*;

    proptest! {
        /// Computed in f32, a point lies where it does in f64 but for the doubt, also a million metres
        /// from the origin and in frusta that are not centred.
        #[test]
        fn points_are_as_far_off_as_is_told(
            at in prop::array::uniform3(-1.0..1.0f32),
            turn in prop::array::uniform3(-3.0..3.0f64),
            scale in 0.01..100.0f64,
            far in prop_oneof![Just(0.0), Just(1e6)],
            bounds in prop::array::uniform4(0.1..1.5f64),
            middle in prop_oneof![Just(DVec3::ZERO), Just(DVec3::new(3e3, 2.0, -1e4))],
        ) {
            let min = DVec2::new(bounds[0] - 0.8, bounds[1] - 0.8);
            let eye = DVec3::new(far, -far, 2.0);
            let camera = Camera {
                pose: Pose::looking_along(eye, DVec3::new(0.1, -0.2, -1.0)),
                extent: Extent { min, max: min + DVec2::new(bounds[2], bounds[3]) },
                width: 512,
                height: 301,
            };
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2]);
            let turned = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, DVec3::ZERO);
            let to = eye + camera.pose.forward * 9.0 * scale - turned.transform_point3(middle);
            let object = DAffine3 { translation: to, ..turned };
            let point = (middle + DVec3::from(at.map(f64::from))).as_vec3().as_dvec3();
            let space = Space { camera, unit: 12.0 * scale };

            let (rows, doubts) = space.placed(&object, middle, DVec3::splat(1.01)).unwrap();
            let p = (point - middle).as_vec3();
            let found = rows.map(|[x, y, z, w]| f64::from(x * p.x + y * p.y + z * p.z + w));
            let in_view = camera.pose.point_in_view(object.transform_point3(point));
            let texel = camera.pixel_from_view(in_view) - space.half();
            let depth = in_view.z / space.unit;
            // The unit in the last place of coordinates of a million metres, over the unit of depth.
            let coordinates = 1e-9 * 512.0 / scale;
            for (found, (expected, doubt)) in
                found.into_iter().zip([texel.x * depth, texel.y * depth, depth].into_iter().zip(doubts))
            {
                let off = (found - expected).abs();
                prop_assert!(off <= f64::from(doubt) + coordinates, "{off} is more than {doubt}");
            }
            prop_assert!(doubts[2] < 2e-6 && doubts[0] < 2e-3);
        }
    }
}
