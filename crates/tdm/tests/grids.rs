//! Grids as odd as they come: a mesh that touches all that is seen, or none.

use farfield_grid::BitMask;
use farfield_tdm::{Mesh, VoxelLayers, charts, initial_mesh, simplify, touched};
use glam::Vec3;

/// Side of an enlarged voxel, in voxels.
const ENLARGED: f32 = 1.5;

/// Layers, a voxel thick, in which lines of sight reach every place.
struct Open {
    side: u16,
    layers: Vec<Vec<[u16; 2]>>,
    reached: Vec<BitMask>,
    borders: Vec<f32>,
}

impl Open {
    fn new(side: u16, layers: Vec<Vec<[u16; 2]>>) -> Self {
        Self {
            side,
            reached: vec![BitMask::full(side.into(), side.into()); layers.len()],
            borders: (0..=layers.len()).map(|l| l as f32).collect(),
            layers,
        }
    }

    /// Voxels for which `is_there` (column, row, layer) holds.
    fn of(side: u16, count: u16, is_there: impl Fn(u16, u16, u16) -> bool) -> Self {
        let all = || (0..side).flat_map(|y| (0..side).map(move |x| [x, y]));
        let layer = |l| all().filter(|[x, y]| is_there(*x, *y, l)).collect();
        Self::new(side, (0..count).map(layer).collect())
    }

    fn voxels(&self) -> VoxelLayers<'_> {
        VoxelLayers {
            width: self.side.into(),
            height: self.side.into(),
            layers: &self.layers,
            reached: &self.reached,
            borders: &self.borders,
        }
    }

    /// The initial mesh and the simplified one, of which all voxels that the first stands for are
    /// touched, and all triangles are in a chart.
    fn meshes(&self) -> [Mesh; 2] {
        let voxels = self.voxels();
        let points: Vec<Vec3> = voxels.boxes(1.0).iter().map(|b| b.center).collect();
        let mesh = initial_mesh(&voxels, &points, ENLARGED);
        let simple = simplify(&mesh, &voxels, ENLARGED).mesh;
        let touched = touched(&simple.positions, &simple.triangles, &voxels, ENLARGED);
        let mut stood_for = mesh.voxels.iter().flatten();
        assert!(stood_for.all(|voxel| touched[*voxel as usize]));
        let densities = vec![1.0; simple.triangles.len()];
        let charts = charts(&simple.positions, &simple.triangles, &densities, 1);
        let laid_out: usize = charts.iter().map(|chart| chart.triangles.len()).sum();
        assert_eq!(laid_out, simple.triangles.len());
        [mesh, simple]
    }

    /// How many voxels a mesh stands for.
    fn stands_for(mesh: &Mesh) -> usize {
        mesh.voxels.iter().map(Vec::len).sum()
    }
}

#[test]
fn of_nothing_there_is_no_mesh() {
    for count in 0..3 {
        let [mesh, simple] = Open::of(4, count, |_, _, _| false).meshes();
        assert!(mesh.triangles.is_empty() && simple.triangles.is_empty());
    }
}

#[test]
fn a_voxel_alone_is_touched() {
    for [x, y] in [[0, 0], [2, 1], [3, 3]] {
        for count in 1..3 {
            let open = Open::of(4, count, |column, row, l| [column, row, l] == [x, y, 0]);
            let [mesh, simple] = open.meshes();
            assert_eq!(Open::stands_for(&mesh), 1);
            assert_eq!(Open::stands_for(&simple), 1);
        }
    }
}

/// What fills its layer to all sides is two triangles; nobody looks behind the last layer.
#[test]
fn a_full_layer_reaches_the_border_of_the_grid() {
    let [_, simple] = Open::of(64, 1, |_, _, _| true).meshes();
    assert_eq!(simple.triangles.len(), 2);
    let most = simple.positions.iter().fold(Vec3::ZERO, |a, b| a.max(*b));
    let least = simple
        .positions
        .iter()
        .fold(Vec3::splat(64.0), |a, b| a.min(*b));
    assert_eq!(least.truncate().to_array(), [0.0; 2]);
    assert_eq!(most.truncate().to_array(), [64.0; 2]);
}

/// Voxels that touch in edges and corners only.
#[test]
fn every_voxel_of_a_checkerboard_is_touched() {
    let open = Open::of(24, 24, |x, y, l| (x + y + l) % 2 == 0);
    let [mesh, simple] = open.meshes();
    assert_eq!(Open::stands_for(&mesh), 24 * 24 * 24 / 2);
    assert_eq!(Open::stands_for(&simple), 24 * 24 * 24 / 2);
    // In one layer, where they touch in corners.
    let [mesh, _] = Open::of(64, 1, |x, y, _| (x + y) % 2 == 0).meshes();
    assert_eq!(Open::stands_for(&mesh), 64 * 64 / 2);
}

/// A grid of more than 10^8 voxels takes memory for its columns, not for what is empty.
#[test]
fn a_huge_grid_with_little_in_it_is_no_matter() {
    let mut layers = vec![Vec::new(); 8];
    for (l, layer) in layers.iter_mut().enumerate() {
        // A strip in each layer, farther down in each, and the four corners of the grid.
        layer.extend([[0, 0], [4095, 0]]);
        layer.extend((0..100).map(|x| [x, 7 * l as u16 + 1]));
        layer.extend([[0, 4095], [4095, 4095]]);
    }
    let open = Open::new(4096, layers);
    let [mesh, simple] = open.meshes();
    assert_eq!(Open::stands_for(&mesh), 8 * 104);
    assert!(simple.triangles.len() < mesh.triangles.len() / 4);
}
