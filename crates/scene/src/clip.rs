//! The part of a scene within a convex region.

use crate::{Mesh, Object, Scene};
use glam::{DVec3, DVec4};
use std::collections::HashMap;

impl Scene {
    /// What lies in the region of the world where `plane . (x, y, z, 1) >= 0` for all `planes`,
    /// triangles cut at its border. Objects that lie wholly inside keep their meshes, those that
    /// reach over the border get one of their own; those outside are left out.
    ///
    /// A cut edge gets the same point in both triangles that share it, so that what was closed
    /// stays closed but for the border; the point is rounded to `f32` in the mesh's space, as all
    /// positions are.
    ///
    /// The images stay behind, as they may be large: the result has none, and its materials and
    /// textures have the numbers they have here.
    pub fn clipped(&self, planes: &[DVec4]) -> Scene {
        let mut clipped = Scene {
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            ..Scene::default()
        };
        let mut whole = HashMap::new();
        for (index, object) in (0..).zip(&self.objects) {
            let planes: Vec<DVec4> = planes.iter().copied().map(|p| in_mesh(object, p)).collect();
            let mesh = self.mesh_of(index);
            let corners = mesh.vertices.clone().map(|v| self.positions[v as usize]);
            let corners: Vec<DVec3> = corners.map(|p| p.as_dvec3()).collect();
            let outside = |p: &DVec4| corners.iter().all(|c| height(*p, *c) < 0.0);
            if planes.iter().any(outside) {
                continue;
            }
            let inside = |p: &DVec4| corners.iter().all(|c| height(*p, *c) >= 0.0);
            let mesh = match planes.iter().all(inside) {
                true => *whole
                    .entry(object.mesh)
                    .or_insert_with(|| clipped.add_mesh(self, mesh, &[])),
                false => clipped.add_mesh(self, mesh, &planes),
            };
            if !clipped.meshes[mesh as usize].triangles.is_empty() {
                clipped.objects.push(Object {
                    mesh,
                    ..object.clone()
                });
            }
        }
        clipped
    }

    /// Appends what of a mesh of `source` lies inside all `planes`, which are in the mesh's space,
    /// with no more vertices than that uses.
    fn add_mesh(&mut self, source: &Scene, mesh: &Mesh, planes: &[DVec4]) -> u32 {
        let vertices = mesh.vertices.start as usize..mesh.vertices.end as usize;
        let mut cut = Scene {
            positions: source.positions[vertices.clone()].to_vec(),
            normals: source.normals[vertices.clone()].to_vec(),
            uvs: source.uvs[vertices.clone()].to_vec(),
            colors: source.colors[vertices].to_vec(),
            ..Scene::default()
        };
        let triangles = mesh.triangles.clone().map(|t| {
            let moved = source.triangles[t as usize].map(|v| v - mesh.vertices.start);
            (moved, source.triangle_materials[t as usize])
        });
        let mut triangles: Vec<_> = triangles.collect();
        for plane in planes {
            triangles = cut.cut(&triangles, *plane);
        }
        let (first_vertex, first_triangle) = (self.positions.len(), self.triangles.len());
        let mut moved = vec![None; cut.positions.len()];
        for (triangle, material) in triangles {
            let triangle = triangle.map(|vertex| {
                let vertex = vertex as usize;
                *moved[vertex].get_or_insert_with(|| {
                    self.positions.push(cut.positions[vertex]);
                    self.normals.push(cut.normals[vertex]);
                    self.uvs.push(cut.uvs[vertex]);
                    self.colors.push(cut.colors[vertex]);
                    self.positions.len() as u32 - 1
                })
            });
            self.triangles.push(triangle);
            self.triangle_materials.push(material);
        }
        self.meshes.push(Mesh {
            vertices: first_vertex as u32..self.positions.len() as u32,
            triangles: first_triangle as u32..self.triangles.len() as u32,
        });
        self.meshes.len() as u32 - 1
    }

    /// Triangles cut at a plane, what lies behind it left out.
    fn cut(&mut self, triangles: &[([u32; 3], u32)], plane: DVec4) -> Vec<([u32; 3], u32)> {
        let mut points = HashMap::new();
        let mut kept = Vec::with_capacity(triangles.len());
        for &(triangle, material) in triangles {
            let heights = triangle.map(|v| height(plane, self.positions[v as usize].as_dvec3()));
            if heights.iter().all(|h| *h >= 0.0) {
                kept.push((triangle, material));
                continue;
            }
            let mut polygon = Vec::with_capacity(4);
            for i in 0..3 {
                let j = (i + 1) % 3;
                if heights[i] >= 0.0 {
                    polygon.push(triangle[i]);
                }
                if (heights[i] >= 0.0) != (heights[j] >= 0.0) {
                    // In one order, whichever triangle asks.
                    let ends = [triangle[i].min(triangle[j]), triangle[i].max(triangle[j])];
                    let point = points
                        .entry(ends)
                        .or_insert_with(|| self.point_between(ends, plane));
                    polygon.push(*point);
                }
            }
            for i in 2..polygon.len() {
                kept.push(([polygon[0], polygon[i - 1], polygon[i]], material));
            }
        }
        kept
    }

    /// Appends the vertex where the edge between two others meets a plane.
    fn point_between(&mut self, [a, b]: [u32; 2], plane: DVec4) -> u32 {
        let [a, b] = [a as usize, b as usize];
        let at = |v: usize| height(plane, self.positions[v].as_dvec3());
        let share = at(a) / (at(a) - at(b));
        let position = self.positions[a]
            .as_dvec3()
            .lerp(self.positions[b].as_dvec3(), share);
        let share = share as f32;
        let normal = self.normals[a].lerp(self.normals[b], share);
        self.positions.push(position.as_vec3());
        // Of opposite normals either will do.
        self.normals
            .push(normal.try_normalize().unwrap_or(self.normals[a]));
        self.uvs.push(self.uvs[a].lerp(self.uvs[b], share));
        self.colors.push(self.colors[a].lerp(self.colors[b], share));
        self.positions.len() as u32 - 1
    }
}

/// A plane of the world in the space of an object's mesh.
fn in_mesh(object: &Object, plane: DVec4) -> DVec4 {
    let m = &object.world_from_mesh;
    let normal = m.matrix3.transpose() * plane.truncate();
    normal.extend(plane.truncate().dot(m.translation) + plane.w)
}

fn height(plane: DVec4, point: DVec3) -> f64 {
    plane.truncate().dot(point) + plane.w
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::soup;
    use glam::DAffine3;
    use proptest::prelude::*;

    fn planes() -> impl Strategy<Value = Vec<DVec4>> {
        let plane = (prop::array::uniform3(-1.0..1.0f64), -1.0..1.0f64)
            .prop_map(|(normal, offset)| DVec3::from(normal).extend(offset));
        prop::collection::vec(plane, 0..5)
    }

    /// Of all triangles together.
    fn area(scene: &Scene) -> f64 {
        let mut area = 0.0;
        for object in 0..scene.objects.len() as u32 {
            for t in scene.mesh_of(object).triangles.clone() {
                let [a, b, c] = scene
                    .triangle_in(object, t)
                    .map(|v| scene.world_position(object, v));
                area += (b - a).cross(c - a).length() / 2.0;
            }
        }
        area
    }

    proptest! {
        /// What is kept fits together and lies inside, and a scene is as large as its part on one
        /// side of a plane and its part on the other.
        #[test]
        fn nothing_is_lost_and_nothing_is_outside(
            points in prop::collection::vec([-2.0..2.0f32, -2.0..2.0f32, -2.0..2.0f32], 12),
            planes in planes(),
            moved in prop::array::uniform3(-3.0..3.0f64),
        ) {
            let mut scene = soup(&points);
            let mut second = scene.objects[0].clone();
            second.world_from_mesh =
                DAffine3::from_translation(moved.into()) * DAffine3::from_rotation_y(1.0);
            scene.objects.push(second);
            let clipped = scene.clipped(&planes);
            prop_assert_eq!(clipped.check(), Ok(()));
            for object in 0..clipped.objects.len() as u32 {
                for t in clipped.mesh_of(object).triangles.clone() {
                    for v in clipped.triangle_in(object, t) {
                        let point = clipped.world_position(object, v);
                        for plane in &planes {
                            prop_assert!(height(*plane, point) > -1e-5);
                        }
                    }
                }
            }
            if let Some(first) = planes.first() {
                let both = area(&scene.clipped(&[*first])) + area(&scene.clipped(&[-*first]));
                prop_assert!((both - area(&scene)).abs() < 1e-4 * (1.0 + both));
            }
        }

        /// Two triangles that share an edge share the point at which it is cut.
        #[test]
        fn cut_edges_stay_shared(
            points in prop::collection::vec([-2.0..2.0f32, -2.0..2.0f32, -2.0..2.0f32], 4),
            plane in (prop::array::uniform3(-1.0..1.0f64), -1.0..1.0f64),
        ) {
            let mut scene = soup(&[&points[..], &[[0.0; 3]; 2]].concat());
            scene.triangles = vec![[0, 1, 2], [2, 1, 3]];
            let plane = DVec3::from(plane.0).extend(plane.1);
            let inside = points.iter().filter(|p| height(plane, glam::Vec3::from(**p).as_dvec3()) >= 0.0);
            let inside = inside.count();
            let clipped = scene.clipped(&[plane]);
            // Of the five edges of two triangles at most four are crossed, each in one point.
            prop_assert!(clipped.positions.len() <= inside + 4);
            prop_assert!(inside < 4 || clipped.positions.len() == 4);
        }
    }

    #[test]
    fn objects_inside_go_on_sharing_their_mesh() {
        let mut scene = soup(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        scene.objects = vec![scene.objects[0].clone(); 3];
        scene.objects[1].world_from_mesh = DAffine3::from_translation(DVec3::X * 5.0);
        scene.objects[2].world_from_mesh = DAffine3::from_translation(DVec3::X * 9.5);
        let clipped = scene.clipped(&[DVec4::new(-1.0, 0.0, 0.0, 10.0)]);
        assert_eq!(clipped.objects.len(), 3);
        assert_eq!(clipped.meshes.len(), 2);
        assert_eq!(clipped.objects[0].mesh, clipped.objects[1].mesh);
        assert_eq!(clipped.bounds().unwrap()[1].x, 10.0);
    }
}
