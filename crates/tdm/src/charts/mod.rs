//! Charts: pieces of a mesh, each laid out in a plane, for textures.

mod cells;
mod merge;
mod piece;
mod plane;
mod rectangle;
mod texels;

use glam::{Vec2, Vec3};
use merge::Pieces;
use piece::{Piece, Surface};
pub use texels::ChartTexel;

/// A piece of a mesh laid out in a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Indices into the mesh's triangles, ascending.
    pub triangles: Vec<u32>,
    /// Of each of these the corners' places, in texels from the chart's upper left corner.
    pub corners: Vec<[Vec2; 3]>,
    /// In texels, the gutter included; at least the height.
    pub width: u32,
    /// In texels, the gutter included.
    pub height: u32,
}

/// Charts that hold each triangle of a mesh once, and take few texels as rectangles.
///
/// Each is a connected piece of the mesh seen along the axis of a plane, a parallel projection, and
/// turned as its rectangle is tightest. In a chart
///
/// * a vertex has one place, so triangles with a common edge are neighbours in the texture as well;
/// * triangles are counter-clockwise, as in the mesh when it is seen from outside, and do not
///   overlap;
/// * triangles are tilted by at most 60 degrees against the plane. There are so many texels per
///   unit of length that none is worse off for it: every line on a triangle is at least as many
///   texels long as it has units, times the triangle's density;
/// * places are `gutter` texels or more from the sides, to within a thousandth of a texel.
///
/// At first each triangle is a chart. Then neighbours, triangles with a common edge that no third
/// has, become one chart as long as its rectangle has no more texels than theirs have together,
/// gutters included; what saves most comes first.
///
/// The same mesh gives the same charts, by their first triangles. Takes some ten microseconds per
/// triangle.
///
/// * `positions` - in the warped grid, or any other space
/// * `triangles` - three vertices each
/// * `densities` - the least number of texels per unit of length, of each triangle
/// * `gutter` - in texels
///
/// # Limitations
///
/// Triangles that are no neighbours may lie close together in a chart, or touch, so a bilinear
/// filter mixes their colours along such a border. A chart can be larger than a page.
///
/// # Panics
///
/// When there are not as many densities as triangles, one is not positive, or a triangle refers to
/// a vertex that is not there.
pub fn charts(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    densities: &[f32],
    gutter: u32,
) -> Vec<Chart> {
    let (count, expected) = (densities.len(), triangles.len());
    assert!(
        count == expected,
        "{count} densities for {expected} triangles"
    );
    assert!(
        densities.iter().all(|d| *d > 0.0 && d.is_finite()),
        "densities must be positive"
    );
    let surface = Surface::new(positions, triangles, densities, gutter);
    let mut pieces = Pieces::new(&surface, count as u32);
    pieces.merge(&neighbours(triangles));
    let pieces = pieces.into_pieces();
    pieces.iter().map(|piece| chart(piece, &surface)).collect()
}

fn chart(piece: &Piece, surface: &Surface) -> Chart {
    let rectangle = &piece.layout.rectangle;
    let corners = |triangle: &u32| {
        let places = surface.places(*triangle, &piece.plane);
        places.map(|place| rectangle.place(place).as_vec2())
    };
    let [width, height] = rectangle.size;
    Chart {
        corners: piece.triangles.iter().map(corners).collect(),
        triangles: piece.triangles.clone(),
        width,
        height,
    }
}

/// Triangles with a common edge that no third triangle has.
fn neighbours(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let edges_of = |(i, t): (u32, &[u32; 3])| {
        let edges = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        edges.map(|[a, b]| ([a.min(b), a.max(b)], i))
    };
    let mut edges: Vec<([u32; 2], u32)> = (0..).zip(triangles).flat_map(edges_of).collect();
    edges.sort_unstable();
    let around = edges.chunk_by(|a, b| a.0 == b.0);
    around
        .filter_map(|around| match *around {
            [(_, a), (_, b)] => Some([a, b]),
            _ => None,
        })
        .collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::testing::blobs;
    use crate::{Mesh, initial_mesh, simplify};
    use farfield_grid::BitMask;
    use proptest::prelude::*;
    use std::collections::{BTreeMap, BTreeSet};

    /// Meshes with what their triangles need, stairs and simplified ones.
    fn meshes() -> impl Strategy<Value = (Mesh, Vec<f32>)> {
        let mesh = (blobs(), any::<bool>()).prop_map(|(blob, simple)| {
            let layers = blob.layers();
            let mesh = initial_mesh(&layers, &blob.centers(), 1.5);
            let mut mesh = match simple {
                true => simplify(&mesh, &layers, 1.5).mesh,
                false => mesh,
            };
            // What has no area overlaps nothing.
            let positions = &mesh.positions;
            mesh.triangles.retain(|t| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                (b - a).cross(c - a).length() > 1e-3
            });
            mesh
        });
        mesh.prop_flat_map(|mesh| {
            let density = prop_oneof![3 => Just(1.0f32), 1 => 0.5..3.0f32];
            let densities = prop::collection::vec(density, mesh.triangles.len());
            (Just(mesh), densities)
        })
    }

    /// Charts of any mesh, with their gutters.
    pub(crate) fn any_charts() -> impl Strategy<Value = (Vec<Chart>, u32)> {
        (meshes(), 0..4u32).prop_map(|((mesh, densities), gutter)| {
            let found = charts(&mesh.positions, &mesh.triangles, &densities, gutter);
            (found, gutter)
        })
    }

    fn texels(charts: &[Chart]) -> u64 {
        let area = |chart: &Chart| u64::from(chart.width) * u64::from(chart.height);
        charts.iter().map(area).sum()
    }

    /// Twice the area of a triangle of a chart, negative where it is turned over.
    fn area([a, b, c]: [Vec2; 3]) -> f32 {
        -(b - a).perp_dot(c - a)
    }

    /// Of places, in texels: hundreds, as f32.
    const ROUNDING: f32 = 1e-4;

    proptest! {
        /// Each triangle is in one chart, as it is seen from outside, with its gutter; no line on it
        /// is shorter than its density demands; a vertex has one place.
        #[test]
        fn each_triangle_is_in_one_chart((mesh, densities) in meshes(), gutter in 0..4u32) {
            let found = charts(&mesh.positions, &mesh.triangles, &densities, gutter);
            let mut all: Vec<u32> = found.iter().flat_map(|c| c.triangles.clone()).collect();
            prop_assert!(found.is_sorted_by_key(|chart| chart.triangles[0]));
            all.sort_unstable();
            prop_assert!(all.into_iter().eq(0..mesh.triangles.len() as u32));
            for chart in &found {
                prop_assert!(chart.triangles.is_sorted());
                prop_assert!(chart.width >= chart.height);
                let size = Vec2::new(chart.width as f32, chart.height as f32);
                let mut places = BTreeMap::new();
                for (t, corners) in chart.triangles.iter().zip(&chart.corners) {
                    let vertices = mesh.triangles[*t as usize];
                    let [a, b, c] = vertices.map(|v| mesh.positions[v as usize]);
                    let density = densities[*t as usize];
                    let least = (b - a).cross(c - a).length() * density * density;
                    prop_assert!(area(*corners) >= least * (1.0 - 1e-3));
                    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                        let length = [a, b, c][i].distance([a, b, c][j]) * density;
                        let there = corners[i].distance(corners[j]);
                        prop_assert!(there >= length - ROUNDING, "{there} texels for {length}");
                    }
                    for (vertex, place) in vertices.into_iter().zip(corners) {
                        prop_assert_eq!(*places.entry(vertex).or_insert(*place), *place);
                        let inside = place.min(size - place).min_element();
                        let least = gutter as f32 - rectangle::ROUNDING as f32 - ROUNDING;
                        prop_assert!(inside >= least, "{inside} texels from a side");
                    }
                }
            }
            prop_assert_eq!(charts(&mesh.positions, &mesh.triangles, &densities, gutter), found);
        }

        /// No point of a triangle is in another one of the same chart.
        #[test]
        fn triangles_do_not_overlap(
            (charts, _) in any_charts(),
            points in prop::collection::vec(prop::array::uniform3(0.01..1.0f32), 20),
        ) {
            for chart in charts {
                for (i, corners) in chart.corners.iter().enumerate() {
                    for weights in &points {
                        let sum: f32 = weights.iter().sum();
                        let point: Vec2 =
                            corners.iter().zip(weights).map(|(c, w)| c * (w / sum)).sum();
                        let depth = |[a, b, c]: [Vec2; 3]| {
                            let from = |from: Vec2, to: Vec2| {
                                area([from, to, point]) / from.distance(to)
                            };
                            from(a, b).min(from(b, c)).min(from(c, a))
                        };
                        for (_, other) in chart.corners.iter().enumerate().filter(|(j, _)| i != *j) {
                            let depth = depth(*other);
                            prop_assert!(depth <= 10.0 * ROUNDING, "{depth} inside of another");
                        }
                    }
                }
            }
        }

        /// Charts are connected over edges of two triangles, and take no more texels than each
        /// triangle on its own.
        #[test]
        fn charts_are_connected_and_save_texels((mesh, densities) in meshes(), gutter in 0..4u32) {
            let found = charts(&mesh.positions, &mesh.triangles, &densities, gutter);
            let alone: u64 = mesh.triangles.iter().zip(&densities)
                .map(|(t, d)| texels(&charts(&mesh.positions, &[*t], &[*d], gutter)))
                .sum();
            prop_assert!(texels(&found) <= alone);
            let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
            for (i, t) in (0..).zip(&mesh.triangles) {
                for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                    edges.entry([t[a].min(t[b]), t[a].max(t[b])]).or_default().push(i);
                }
            }
            for chart in &found {
                let mut left: BTreeSet<u32> = chart.triangles.iter().copied().collect();
                let mut queue = vec![chart.triangles[0]];
                while let Some(triangle) = queue.pop() {
                    left.remove(&triangle);
                    let pairs = edges.values().filter(|t| t.len() == 2 && t.contains(&triangle));
                    queue.extend(pairs.flatten().filter(|t| left.contains(t)));
                }
                prop_assert!(left.is_empty(), "{left:?} are apart");
            }
        }
    }

    /// What is flat is one chart, without a texel too many.
    #[test]
    fn what_is_flat_is_one_chart() {
        let layers = vec![(0..40).flat_map(|y| (0..60).map(move |x| [x, y])).collect()];
        let voxels = crate::VoxelLayers {
            width: 60,
            height: 40,
            layers: &layers,
            reached: &[BitMask::full(60, 40)],
            borders: &[0.0, 1.0],
        };
        let centers: Vec<Vec3> = voxels.boxes(1.0).iter().map(|b| b.center).collect();
        let mesh = initial_mesh(&voxels, &centers, 1.5);
        let found = charts(&mesh.positions, &mesh.triangles, &[1.0; 4800], 2);
        let sizes: Vec<[u32; 2]> = found.iter().map(|c| [c.width, c.height]).collect();
        assert_eq!(sizes, [[64, 44]]);
    }

    /// A flight of stairs that seen from the front is all steps and no walls or the other way round
    /// is one chart across both, though they are at right angles.
    #[test]
    fn stairs_are_one_chart() {
        let at = |x: u32, y: f32, z: u32| Vec3::new(x as f32, y, z as f32);
        let corner = |i: u32, y: f32| at(i / 2, y, i.div_ceil(2));
        let positions: Vec<Vec3> = (0..41)
            .flat_map(|i| [corner(i, 0.0), corner(i, 9.0)])
            .collect();
        let strip = |i: u32| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]];
        let triangles: Vec<[u32; 3]> = (0..40).flat_map(strip).collect();
        let found = charts(&positions, &triangles, &[1.0; 80], 2);
        // Half of 40 steps' length each way, on the slant, at a density of a root of two.
        let sizes: Vec<[u32; 2]> = found.iter().map(|c| [c.width, c.height]).collect();
        assert_eq!(sizes, [[40 + 4, 13 + 4]]);
    }

    /// Three triangles at one edge are three charts, if that is their only edge.
    #[test]
    fn an_edge_of_three_triangles_is_a_border() {
        let positions = [[0, 0, 0], [0, 9, 0], [9, 0, 0], [9, 9, 0], [9, 5, 1]];
        let positions = positions.map(|p: [i16; 3]| Vec3::from(p.map(f32::from)));
        let triangles = [[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        assert_eq!(charts(&positions, &triangles, &[1.0; 3], 1).len(), 3);
    }
}
