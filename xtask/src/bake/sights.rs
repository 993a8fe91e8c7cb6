//! Where a mesh lets one look through a closed surface, as seen from the view cell.

use super::recording::Settings;
use crate::voxels::Projection;
use farfield_layers::LayerStack;
use farfield_metrics::{gap_pixels, layer_indices};
use farfield_sampling::{Textures, rasterize};
use farfield_scene::{Material, Scene};
use farfield_views::Camera;
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::ops::Range;

/// From where is looked while something is open: from corners, edges and faces of the cell, and from
/// within.
const SOME: Range<u64> = 0..150;

/// From where is looked when nothing is open any more.
const MANY: Range<u64> = 150..750;

/// Of the viewpoints within: others than those from which bundles are verified.
const SEED: u64 = 0x0062_616b_6564;

/// By how many layers a mesh may show a surface behind where it is.
const SLACK: u32 = 2;

/// A scene, and how its layers are placed.
pub(super) struct Sights<'a> {
    pub scene: &'a Scene,
    pub textures: &'a Textures<'a>,
    pub settings: &'a Settings,
    pub stack: &'a LayerStack,
    pub projection: &'a Projection,
}

impl Sights<'_> {
    /// Places in the warped grid where the scene covers a pixel and those around it, but the mesh shows
    /// nothing there, or what is behind.
    pub(super) fn gaps(&self, positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
        let from_some = self.gaps_from(SOME, positions, triangles);
        match from_some.is_empty() {
            true => self.gaps_from(MANY, positions, triangles),
            false => from_some,
        }
    }

    fn gaps_from(
        &self,
        viewpoints: Range<u64>,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
    ) -> Vec<Vec3> {
        let Settings {
            cell, hull, camera, ..
        } = self.settings;
        let center = hull.iter().sum::<DVec3>() / hull.len() as f64;
        let mesh = bare(positions, triangles, center);
        let mesh_textures = Textures::new(&mesh);
        let borders = self.stack.borders();
        let of_view = |index| {
            let eye = cell.viewpoint(index, SEED);
            let view = Camera::looking_at(eye, center, camera.fov, camera.resolution);
            let original = rasterize(self.scene, self.textures, &view).depth;
            let shown = rasterize(&mesh, &mesh_textures, &view).depth;
            let [a, b] = [&original, &shown]
                .map(|depth| layer_indices(depth, &view, &self.stack.pose, &borders));
            let place = |[x, y]: [u32; 2]| {
                let at = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                let in_view = view.view_from_pixel(at, original[(x as usize, y as usize)]);
                let point = view.pose.point_in_world(in_view);
                self.projection.place(point).as_vec3()
            };
            gap_pixels(&a, &b, SLACK).into_iter().map(place).collect()
        };
        let views: Vec<Vec<Vec3>> = viewpoints.into_par_iter().map(of_view).collect();
        views.concat()
    }
}

/// A mesh as a scene, seen from both sides, without textures.
fn bare(positions: &[DVec3], triangles: &[[u32; 3]], origin: DVec3) -> Scene {
    let mut scene = Scene {
        positions: positions.iter().map(|p| (*p - origin).as_vec3()).collect(),
        normals: vec![Vec3::Y; positions.len()],
        uvs: vec![Vec2::ZERO; positions.len()],
        colors: vec![Vec4::ONE; positions.len()],
        triangles: triangles.to_vec(),
        triangle_materials: vec![0; triangles.len()],
        materials: vec![Material {
            double_sided: true,
            ..Material::default()
        }],
        ..Scene::default()
    };
    farfield_pages::place_as_object(&mut scene, "", origin);
    scene
}
