//! The texels of a mesh's charts.

use crate::voxels::Projection;
use farfield_atlas::Atlas;
use farfield_grid::Grid;
use farfield_sampling::Sample;
use farfield_scene::Scene;
use farfield_tdm::{Chart, ChartTexel, VoxelIndex};
use farfield_views::Pose;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Texels round each chart: what bilinear filtering touches.
pub(super) const GUTTER: u32 = 1;

/// What the texels of a mesh's charts are painted from.
pub(super) struct Painter<'a> {
    pub projection: &'a Projection,
    pub voxels: VoxelColors<'a>,
    pub triangles: &'a [[u32; 3]],
    /// Places of the vertices in the world.
    pub world: &'a [DVec3],
}

/// What voxels look like.
pub(super) struct VoxelColors<'a> {
    /// Of the voxels that a mesh stands for.
    pub index: VoxelIndex,
    /// Of all voxels.
    pub colors: &'a [[u8; 3]],
    /// Of the surfaces in them, on the side whose colour it is.
    pub normals: &'a [Vec3],
    /// Whether the point that the colour is of can be seen.
    pub shown: &'a [bool],
}

impl Painter<'_> {
    pub(super) fn pages(&self, charts: &[Chart], atlas: &Atlas) -> Vec<Grid<[u8; 4]>> {
        let mut pages: Vec<_> = atlas
            .pages
            .iter()
            .map(|[width, height]| Grid::filled(*width as usize, *height as usize, [0, 0, 0, 255]))
            .collect();
        let painted: Vec<Vec<([u32; 2], [u8; 3])>> =
            charts.par_iter().map(|chart| self.chart(chart)).collect();
        for (texels, at) in painted.iter().zip(&atlas.placements) {
            let page = &mut pages[at.page as usize];
            for ([x, y], [r, g, b]) in texels {
                page[((at.x + x) as usize, (at.y + y) as usize)] = [*r, *g, *b, 255];
            }
        }
        pages
    }

    fn chart(&self, chart: &Chart) -> Vec<([u32; 2], [u8; 3])> {
        let texels = chart.texels(GUTTER);
        let color = |texel: &ChartTexel| {
            // As a client shows it: affine in the world over each triangle.
            let [a, b, c] = self.triangles[texel.triangle as usize].map(|v| self.world[v as usize]);
            // The weights add up to 1 to 7 digits, and coordinates have more.
            let [_, to_b, to_c] = texel.weights.map(f64::from);
            let point = a + (b - a) * to_b + (c - a) * to_c;
            let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            let place = self.projection.place(point).as_vec3();
            ([texel.x, texel.y], self.voxels.blended(place, normal))
        };
        texels.iter().map(color).collect()
    }
}

impl VoxelColors<'_> {
    /// The colour of the voxels near a place in the grid, the nearer and the more alike in direction the
    /// more. Those whose colour nobody sees, as where a surface only passes a corner of them before another,
    /// have a say where there are no others.
    fn blended(&self, place: Vec3, normal: Vec3) -> [u8; 3] {
        let near = |reach: f32| -> Vec<(u32, f32)> {
            let weighted = self.index.weighted(place, reach);
            weighted
                .filter(|(voxel, _)| self.shown[*voxel as usize])
                .collect()
        };
        let shown = REACHES.into_iter().map(near).find(|near| !near.is_empty());
        let near = shown.unwrap_or_else(|| self.index.blended(place));
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for (voxel, weight) in near {
            let alike = normal.dot(self.normals[voxel as usize]);
            let weight = weight * alike.max(SIDEWAYS);
            sum += Vec3::from(self.colors[voxel as usize].map(f32::from)) * weight;
            weights += weight;
        }
        (sum / weights).round().to_array().map(|c| c as u8)
    }
}

/// How far away voxels have a say, in voxels: as far as the least of these within which there are some.
const REACHES: [f32; 3] = [1.0, 2.0, 3.0];

/// What counts of a voxel whose surface faces elsewhere: it has a say where there is no other.
const SIDEWAYS: f32 = 1e-3;

/// Normals of the surfaces of samples; where both sides are seen, that on the side of the reference
/// viewpoint, which the colours are of.
pub(super) fn normals(scene: &Scene, reference: &Pose, samples: &[Sample]) -> Vec<Vec3> {
    let normal = |sample: &Sample| {
        let normal = sample.hit.normal_in_world(scene);
        let material = scene.triangle_materials[sample.hit.triangle as usize];
        let to_viewer = reference.eye - sample.hit.point_in_world(scene);
        let is_away = normal.dot(to_viewer) < 0.0;
        match scene.materials[material as usize].double_sided && is_away {
            true => -normal.as_vec3(),
            false => normal.as_vec3(),
        }
    };
    samples.par_iter().map(normal).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_grid::BitMask;
    use farfield_tdm::VoxelLayers;

    const COLORS: [[u8; 3]; 2] = [[200, 0, 0], [0, 0, 200]];

    /// The colour between two voxels.
    fn between(normals: &[Vec3; 2], shown: &[bool; 2], normal: Vec3) -> [u8; 3] {
        let layers = VoxelLayers {
            width: 2,
            height: 1,
            layers: &[vec![[0, 0], [1, 0]]],
            reached: &[BitMask::full(2, 1)],
            borders: &[0.0, 1.0],
        };
        let voxels = VoxelColors {
            index: VoxelIndex::new(&layers),
            colors: &COLORS,
            normals,
            shown,
        };
        voxels.blended(Vec3::new(1.0, 0.5, 0.5), normal)
    }

    /// At an edge, front and back have their own colours; one that faces neither way has some.
    #[test]
    fn a_back_does_not_shine_through_an_edge() {
        let color = |normal| between(&[Vec3::Z, Vec3::NEG_Z], &[true; 2], normal);
        assert_eq!(color(Vec3::Z), COLORS[0]);
        assert_eq!(color(Vec3::NEG_Z), COLORS[1]);
        assert_eq!(color(Vec3::X), [100, 0, 100]);
    }

    /// What is hidden has a colour only where nothing else has one.
    #[test]
    fn what_is_hidden_does_not_shine_through() {
        let color = |shown| between(&[Vec3::Z; 2], &shown, Vec3::Z);
        assert_eq!(color([false, true]), COLORS[1]);
        assert_eq!(color([true, true]), [100, 0, 100]);
        assert_eq!(color([false, false]), [100, 0, 100]);
    }
}
