//! Where a mesh lets one look through a closed surface, as seen from the view cell.

use super::recording::Settings;
use crate::voxels::Projection;
use farfield_grid::Grid;
use farfield_layers::LayerStack;
use farfield_metrics::{LayersSeen, NONE, greatest_of_nine};
use farfield_sampling::{Textures, rasterize};
use farfield_scene::{Material, Scene};
use farfield_tdm::{Mesh, VoxelIndex, VoxelLayers, rectangles, shrunk};
use farfield_views::{Camera, ViewCell, lattice_viewpoints, random_point};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// Viewpoints from which is looked first, at the middles of pixels: corners, edges and faces of the
/// cell, and within.
const FIRST: Range<u64> = 0..150;

/// Viewpoints from which is looked then, from each at another place in all pixels.
///
/// Holes are narrow, and seen from few directions: as many pictures find more of them from as many
/// viewpoints than several from each.
const OTHERS: Range<u64> = 150..8050;

/// Viewpoints from which is looked at last, at the mesh as it is: its borders farther in hide, now and then,
/// what they leave open where they are.
const LAST: Range<u64> = 0..1050;

/// So many of these at a time: what is closed for some need not be found by others.
const AT_A_TIME: u64 = 60;

/// How far around gaps squares are put, in voxels along each axis: in the voxel itself and those around it,
/// as where there is one gap there are mostly more, then farther, and at last given up.
const REACHES: [f32; 3] = [1.0, 1.5, 2.5];

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
    /// Voxels whose squares close a mesh: those where one looks through it, although the scene covers a
    /// pixel and those around it, and sees nothing or what is behind; where they do not suffice, those
    /// around them. And in how many pixels one still looks through it then.
    ///
    /// * `seen` - of the scene
    /// * `voxels` - of the stack, `index` them
    pub(super) fn open_voxels(
        &self,
        seen: &Scene,
        mesh: &Mesh,
        voxels: &VoxelLayers<'_>,
        index: &VoxelIndex,
    ) -> (BTreeSet<u32>, usize) {
        let others = OTHERS.step_by(AT_A_TIME as usize);
        let others = others.map(|first| first..(first + AT_A_TIME).min(OTHERS.end));
        let (mut open, mut left) = (BTreeSet::new(), 0);
        let shrunk = shrunk(mesh, MARGIN);
        let with_margin = std::iter::once(FIRST).chain(others);
        let looks = with_margin.map(|viewpoints| (&shrunk, viewpoints));
        for (mesh, viewpoints) in looks.chain([(mesh, LAST)]) {
            let look = |viewpoints: &[u64], open: &BTreeSet<u32>| {
                self.gaps(seen, viewpoints, &with_rectangles(mesh, voxels, open))
            };
            let mut gaps = look(&viewpoints.collect::<Vec<u64>>(), &open);
            for reach in REACHES {
                if gaps.is_empty() {
                    break;
                }
                let near = |(_, gap): &(u64, Vec3)| index.near(*gap, Vec3::splat(reach));
                open.extend(gaps.iter().flat_map(near).map(|(voxel, _)| voxel));
                let mut viewpoints: Vec<u64> =
                    gaps.iter().map(|(viewpoint, _)| *viewpoint).collect();
                viewpoints.dedup();
                gaps = look(&viewpoints, &open);
            }
            left += gaps.len();
        }
        (open, left)
    }

    /// What the first viewpoints see of the scene, as a scene of its own: what they miss is little, and costs
    /// as much as the rest. And which points of its surface they see: those before which nothing is, as far
    /// as a pixel and those around it can tell.
    pub(super) fn seen(&self, points: &[DVec3]) -> (Scene, Vec<bool>) {
        let shown: Vec<AtomicBool> = points.iter().map(|_| AtomicBool::new(false)).collect();
        let of_view = |viewpoint| {
            let view = self.view(viewpoint);
            let picture = rasterize(self.scene, self.textures, &view);
            let farthest = farthest(&picture.depth);
            for (point, shown) in points.iter().zip(&shown) {
                if !shown.load(Relaxed) && is_before(*point, &view, &farthest) {
                    shown.store(true, Relaxed);
                }
            }
            let drawn = picture
                .objects
                .cells()
                .iter()
                .zip(picture.triangles.cells());
            let drawn = drawn.filter(|(object, _)| **object != farfield_sampling::NONE);
            drawn
                .map(|(object, triangle)| [*object, *triangle])
                .collect()
        };
        let views = FIRST.into_par_iter().map(of_view);
        let drawn: BTreeSet<[u32; 2]> = views.reduce(BTreeSet::new, |mut all, of_view| {
            all.extend(of_view);
            all
        });
        let shown = shown.into_iter().map(AtomicBool::into_inner).collect();
        (self.scene.drawing_only(&drawn), shown)
    }

    /// The camera at a viewpoint.
    fn view(&self, viewpoint: u64) -> Camera {
        let Settings { cell, camera, .. } = self.settings;
        let eye = eye(cell, viewpoint);
        let view = Camera::looking_at(eye, self.center(), camera.fov, camera.resolution);
        view.shifted(aside(viewpoint))
    }

    /// What is looked at.
    fn center(&self) -> DVec3 {
        let hull = &self.settings.hull;
        hull.iter().sum::<DVec3>() / hull.len() as f64
    }

    /// Places in the warped grid where a mesh is open, and from which viewpoint.
    ///
    /// * `seen` - of the scene
    fn gaps(
        &self,
        seen: &Scene,
        viewpoints: &[u64],
        (positions, triangles): &(Vec<Vec3>, Vec<[u32; 3]>),
    ) -> Vec<(u64, Vec3)> {
        let place = |p: &Vec3| self.projection.point_in_world(p.as_dvec3());
        let world: Vec<DVec3> = positions.iter().map(place).collect();
        let mesh = bare(&world, triangles, self.center());
        let mesh_textures = Textures::new(&mesh);
        let of_view = |&index: &u64| {
            let view = self.view(index);
            let original = rasterize(seen, self.textures, &view).depth;
            let shown = rasterize(&mesh, &mesh_textures, &view).depth;
            let gaps = self.open(&view, &original, &shown);
            let place = |[x, y]: [usize; 2]| {
                let in_view = view.view_from_pixel(middle([x, y]), original[(x, y)]);
                let point = view.pose.point_in_world(in_view);
                self.projection.place(point).as_vec3()
            };
            gaps.into_iter().map(|at| (index, place(at))).collect()
        };
        let views: Vec<Vec<(u64, Vec3)>> = viewpoints.par_iter().map(of_view).collect();
        views.concat()
    }

    /// Pixels in which a picture of the mesh shows nothing or what is by more layers than allowed behind
    /// all that the original shows in them and around, if it is covered there.
    fn open(&self, camera: &Camera, original: &Grid<f64>, shown: &Grid<f64>) -> Vec<[usize; 2]> {
        let borders = self.stack.borders();
        let layers = LayersSeen::new(camera, &self.stack.pose, &borders);
        let seen =
            |picture: &Grid<f64>, [x, y]: [usize; 2]| layers.at(middle([x, y]), picture[(x, y)]);
        let is_gap = |[x, y]: &[usize; 2]| {
            let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| [x, y]));
            let behind = around.map(|at| seen(original, at)).max();
            let behind = behind.expect("a pixel is around itself");
            let seen = seen(shown, [*x, *y]);
            behind != NONE && (seen == NONE || seen > behind + SLACK)
        };
        let pixels = (0..shown.height()).flat_map(|y| (0..shown.width()).map(move |x| [x, y]));
        // What lies before the farthest around is no gap, and quick to tell; at the picture's border nothing
        // is behind it.
        let farthest = greatest_of_nine(original, f64::INFINITY, f64::max);
        let suspect = |[x, y]: &[usize; 2]| shown[(*x, *y)] > farthest[(*x, *y)];
        pixels.filter(suspect).filter(is_gap).collect()
    }
}

/// The greatest depth of a surface in each pixel and the eight around it; infinite where there is none, and 0
/// at the picture's border, where nothing is known.
fn farthest(depths: &Grid<f64>) -> Grid<f64> {
    greatest_of_nine(depths, 0.0, |a, b| match (a.is_finite(), b.is_finite()) {
        (true, false) => a,
        (false, true) => b,
        _ => a.max(b),
    })
}

/// Whether a point is in a picture, and no deeper than what the picture shows around it.
fn is_before(point: DVec3, view: &Camera, farthest: &Grid<f64>) -> bool {
    let in_view = view.pose.point_in_view(point);
    let [x, y] = view.pixel_from_view(in_view).to_array();
    let is_within = in_view.z > 0.0
        && (0.0..f64::from(view.width)).contains(&x)
        && (0.0..f64::from(view.height)).contains(&y);
    is_within && in_view.z <= farthest[(x as usize, y as usize)]
}

/// From where is looked: first from corners, edges and faces of the cell, then from more of these and
/// from within.
fn eye(cell: &ViewCell, viewpoint: u64) -> DVec3 {
    match lattice_viewpoints().get(viewpoint as usize) {
        Some(fractions) => cell.point(*fractions),
        None => cell.viewpoint_to_border(viewpoint, SEED),
    }
}

/// How far from the middle of pixels is looked from a viewpoint, in pixels.
fn aside(viewpoint: u64) -> DVec2 {
    match FIRST.contains(&viewpoint) {
        true => DVec2::ZERO,
        false => random_point(viewpoint, SEED).truncate() - 0.5,
    }
}

fn middle([x, y]: [usize; 2]) -> DVec2 {
    DVec2::new(x as f64, y as f64) + 0.5
}

/// Vertices and triangles of a mesh, and after them those of the rectangles that some voxels make.
pub(super) fn with_rectangles(
    mesh: &Mesh,
    voxels: &VoxelLayers<'_>,
    chosen: &BTreeSet<u32>,
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (mesh.positions.clone(), mesh.triangles.clone());
    let first = positions.len() as u32;
    let (corners, rectangles) = rectangles(voxels, chosen);
    positions.extend(corners);
    triangles.extend(rectangles.iter().map(|half| half.map(|v| first + v)));
    (positions, triangles)
}

/// By how much borders are moved inwards when a mesh is looked at, in voxels: a hole is found however
/// narrow it is, and the mesh is closed where it hardly is.
const MARGIN: f32 = 0.25;

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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// A wall two metres away fills the left half of a picture: what is behind it is hidden, also a pixel
    /// beside it, and what is before it or well beside it is not. What is at the border or outside of the
    /// picture is not seen.
    #[test]
    fn what_is_behind_a_wall_is_hidden() {
        let view = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, FRAC_PI_2, 8);
        let mut depths = Grid::filled(8, 8, f64::INFINITY);
        (0..8).for_each(|y| depths.row_mut(y)[..4].fill(2.0));
        let farthest = farthest(&depths);
        let is_shown = |x: f64, depth: f64| {
            let in_view = view.view_from_pixel(DVec2::new(x, 3.5), depth);
            is_before(view.pose.point_in_world(in_view), &view, &farthest)
        };
        let columns = [1.5, 3.5, 4.5, 5.5, 6.5];
        assert_eq!(columns.map(|x| is_shown(x, 1.9)), [true; 5]);
        assert_eq!(
            columns.map(|x| is_shown(x, 2.1)),
            [false, false, false, true, true]
        );
        assert_eq!([-0.5, 0.5, 7.5, 8.5].map(|x| is_shown(x, 1.9)), [false; 4]);
    }
}
