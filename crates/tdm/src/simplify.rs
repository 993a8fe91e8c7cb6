//! Simplification by edge contraction that loses no voxel.

use crate::Mesh;
use crate::touch::{interval_in_cube, touches_cube};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A simplified mesh, and what it took.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// What is left, vertices that nothing uses left out.
    pub mesh: Mesh,
    /// Contractions that were made.
    pub contracted: usize,
    /// Contractions that were tried and would have lost a voxel or torn the mesh.
    pub refused: usize,
}

/// Contracts edges, the shortest first, until each of those left would lose something
/// (Jeschke, 2005, section 4.5).
///
/// A contraction moves one end of an edge to the other, which stays where it is. It is made if the
/// triangles around it still touch all voxels that they stood for, each enlarged about its centre by
/// `enlarged`; none of them turns by a right angle or more, or vanishes; and the mesh stays of one
/// piece, with the holes it had. A vertex on a border moves only along the border, and the border
/// that it leaves behind must lie in enlarged voxels as a whole: so a border shrinks no farther than
/// voxels are enlarged, and never reaches across what is empty. Vertices where an edge has three
/// triangles or more stay.
///
/// Every voxel that a triangle of `mesh` stands for is touched, enlarged, by a triangle that stands
/// for it in the result.
///
/// * `centers` - of the voxels, in the warped grid ([`VoxelLayers::centers`](crate::VoxelLayers))
/// * `enlarged` - side of a voxel for this purpose, in voxels: 1 keeps to them as they are, 1.5
///   gives far fewer triangles, up to 2
///
/// The same mesh gives the same result. Bound by the voxels that contractions look at: about those
/// around an edge, for each of about six times as many edges as there are vertices.
///
/// # Panics
///
/// When `enlarged` is below 1, or a triangle refers to a vertex or a voxel that is not there.
pub fn simplify(mesh: &Mesh, centers: &[Vec3], enlarged: f32) -> Simplified {
    assert!(enlarged >= 1.0, "voxels cannot be enlarged by {enlarged}");
    let mut work = Work::new(mesh, centers, enlarged / 2.0);
    for triangle in &mesh.triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            // Each edge once, but for those on borders that run the other way.
            if triangle[a] < triangle[b] || work.shared(triangle[a], triangle[b]).len() == 1 {
                work.queue(triangle[a], triangle[b]);
            }
        }
    }
    let (mut contracted, mut refused) = (0, 0);
    while let Some(Reverse(edge)) = work.edges.pop() {
        let Some([a, b]) = work.is_current(&edge) else {
            continue;
        };
        match work.contract(b, a) || work.contract(a, b) {
            true => contracted += 1,
            false => refused += 1,
        }
    }
    Simplified {
        mesh: work.result(),
        contracted,
        refused,
    }
}

/// An edge that may be contracted: ordered by length, then by its ends, so that results do not depend
/// on anything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// Squared; positive floats are ordered like their bits.
    length: u32,
    ends: [u32; 2],
    /// How often the surroundings of the ends had changed when it was queued.
    versions: [u32; 2],
}

struct Work<'a> {
    centers: &'a [Vec3],
    /// Half the side of a voxel.
    half: f32,
    positions: Vec<Vec3>,
    /// `None` where it is gone.
    triangles: Vec<Option<[u32; 3]>>,
    voxels: Vec<Vec<u32>>,
    /// Of each vertex its triangles.
    around: Vec<Vec<u32>>,
    versions: Vec<u32>,
    edges: BinaryHeap<Reverse<Edge>>,
}

/// How triangles surround a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Surroundings {
    /// All around.
    Inside,
    /// From one border edge to another; the vertices at the other ends of these.
    Border([u32; 2]),
    /// In several fans, or an edge has more than two triangles.
    Tangled,
}

impl<'a> Work<'a> {
    fn new(mesh: &Mesh, centers: &'a [Vec3], half: f32) -> Self {
        let mut around = vec![Vec::new(); mesh.positions.len()];
        for (i, triangle) in (0..).zip(&mesh.triangles) {
            triangle.iter().for_each(|v| around[*v as usize].push(i));
        }
        Self {
            centers,
            half,
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.iter().copied().map(Some).collect(),
            voxels: mesh.voxels.clone(),
            versions: vec![0; around.len()],
            around,
            edges: BinaryHeap::new(),
        }
    }

    fn queue(&mut self, a: u32, b: u32) {
        let ends = [a.min(b), a.max(b)];
        let [p, q] = ends.map(|v| self.positions[v as usize]);
        self.edges.push(Reverse(Edge {
            length: p.distance_squared(q).to_bits(),
            ends,
            versions: ends.map(|v| self.versions[v as usize]),
        }));
    }

    /// The ends of a queued edge, if nothing has changed around it since.
    fn is_current(&self, edge: &Edge) -> Option<[u32; 2]> {
        let versions = edge.ends.map(|v| self.versions[v as usize]);
        (versions == edge.versions).then_some(edge.ends)
    }

    fn triangle(&self, index: u32) -> [u32; 3] {
        self.triangles[index as usize].expect("vertices know only triangles that are there")
    }

    /// The triangles at an edge.
    fn shared(&self, a: u32, b: u32) -> Vec<u32> {
        let around = self.around[a as usize].iter().copied();
        around.filter(|t| self.triangle(*t).contains(&b)).collect()
    }

    fn surroundings(&self, vertex: u32) -> Surroundings {
        // From each triangle an arrow between its other two vertices, in its direction.
        let mut arrows: Vec<[u32; 2]> = Vec::new();
        for t in &self.around[vertex as usize] {
            let t = self.triangle(*t);
            let at = t.iter().position(|v| *v == vertex).unwrap_or(0);
            arrows.push([t[(at + 1) % 3], t[(at + 2) % 3]]);
        }
        let from = |v: u32| arrows.iter().filter(move |arrow| arrow[0] == v);
        let starts = |v: u32| from(v).count();
        let ends = |v: u32| arrows.iter().filter(|arrow| arrow[1] == v).count();
        if arrows.iter().any(|[a, b]| starts(*a) > 1 || ends(*b) > 1) {
            return Surroundings::Tangled;
        }
        // Where nothing leads to is a border's beginning.
        let mut beginnings = arrows
            .iter()
            .map(|arrow| arrow[0])
            .filter(|v| ends(*v) == 0);
        let beginning = beginnings.next();
        let Some(start) = beginning.or(arrows.first().map(|arrow| arrow[0])) else {
            return Surroundings::Tangled;
        };
        let (mut at, mut count) = (start, 0);
        while let Some([_, next]) = from(at).next() {
            (at, count) = (*next, count + 1);
            if at == start {
                break;
            }
        }
        match (count == arrows.len(), beginning) {
            (false, _) => Surroundings::Tangled,
            (true, None) => Surroundings::Inside,
            (true, Some(_)) => Surroundings::Border([start, at]),
        }
    }

    /// Moves vertex `gone` to `kept`, if nothing is lost by it.
    fn contract(&mut self, gone: u32, kept: u32) -> bool {
        let border = match self.surroundings(gone) {
            Surroundings::Tangled => return false,
            Surroundings::Inside => None,
            Surroundings::Border(ends) if ends.contains(&kept) => {
                Some(if ends[0] == kept { ends[1] } else { ends[0] })
            }
            Surroundings::Border(_) => return false,
        };
        let around = self.around[gone as usize].clone();
        let (vanishing, moving): (Vec<u32>, Vec<u32>) = around
            .iter()
            .partition(|t| self.triangle(**t).contains(&kept));
        if !self.stays_whole(gone, kept, vanishing.len()) {
            return false;
        }
        let to = |v: u32| if v == gone { kept } else { v };
        let moved: Vec<[u32; 3]> = moving.iter().map(|t| self.triangle(*t).map(to)).collect();
        let before_and_after = moving.iter().map(|t| self.triangle(*t)).zip(&moved);
        for (before, after) in before_and_after {
            let (before, after) = (self.normal(before), self.normal(*after));
            if after.length_squared() < SMALLEST || before.dot(after) <= 0.0 {
                return false;
            }
        }
        let mut needed: Vec<u32> = around
            .iter()
            .flat_map(|t| self.voxels[*t as usize].iter().copied())
            .collect();
        needed.sort_unstable();
        needed.dedup();
        let Some(voxels) = self.divided(&needed, &moved) else {
            return false;
        };
        if border.is_some_and(|end| !self.is_covered([kept, end], &needed)) {
            return false;
        }

        for triangle in &vanishing {
            for vertex in self.triangle(*triangle) {
                self.around[vertex as usize].retain(|t| t != triangle);
            }
            self.triangles[*triangle as usize] = None;
            self.voxels[*triangle as usize] = Vec::new();
        }
        for ((triangle, corners), voxels) in moving.iter().zip(moved).zip(voxels) {
            self.triangles[*triangle as usize] = Some(corners);
            self.voxels[*triangle as usize] = voxels;
            self.around[kept as usize].push(*triangle);
        }
        self.around[gone as usize].clear();
        self.versions[gone as usize] += 1;
        self.queue_around(kept);
        true
    }

    /// Whether the mesh keeps its pieces and holes: besides the triangles between them, the ends of
    /// the edge have no neighbour in common.
    fn stays_whole(&self, gone: u32, kept: u32, vanishing: usize) -> bool {
        let neighbors = |v: u32| {
            let around = self.around[v as usize].iter();
            let mut all: Vec<u32> = around.flat_map(|t| self.triangle(*t)).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let (ours, theirs) = (neighbors(gone), neighbors(kept));
        let common = ours.iter().filter(|v| theirs.binary_search(v).is_ok());
        // Among them the two ends themselves.
        common.count() == vanishing + 2
    }

    /// Twice the area, along the normal.
    fn normal(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|v| self.positions[v as usize]);
        (b - a).cross(c - a)
    }

    /// Which of the voxels each triangle touches; `None` where none touches one.
    fn divided(&self, voxels: &[u32], triangles: &[[u32; 3]]) -> Option<Vec<Vec<u32>>> {
        let corners = |t: &[u32; 3]| t.map(|v| self.positions[v as usize]);
        let triangles: Vec<[Vec3; 3]> = triangles.iter().map(corners).collect();
        let mut divided = vec![Vec::new(); triangles.len()];
        for voxel in voxels {
            let center = self.centers[*voxel as usize];
            let mut is_touched = false;
            for (corners, voxels) in triangles.iter().zip(&mut divided) {
                if touches_cube(*corners, center, self.half) {
                    voxels.push(*voxel);
                    is_touched = true;
                }
            }
            if !is_touched {
                return None;
            }
        }
        Some(divided)
    }

    /// Whether an edge lies in enlarged voxels as a whole.
    fn is_covered(&self, ends: [u32; 2], voxels: &[u32]) -> bool {
        let [a, b] = ends.map(|v| self.positions[v as usize]);
        let centers = voxels.iter().map(|voxel| self.centers[*voxel as usize]);
        let mut intervals: Vec<[f32; 2]> = centers
            .filter_map(|center| interval_in_cube(a, b, center, self.half))
            .collect();
        intervals.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut covered = 0.0;
        for [from, to] in intervals {
            if from > covered + ROUNDING {
                return false;
            }
            covered = covered.max(to);
        }
        covered >= 1.0 - ROUNDING
    }

    /// Queues all edges of the triangles around a vertex, whose neighbourhoods have changed.
    fn queue_around(&mut self, vertex: u32) {
        let around = self.around[vertex as usize].iter();
        let mut vertices: Vec<u32> = around.flat_map(|t| self.triangle(*t)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        for v in &vertices {
            self.versions[*v as usize] += 1;
        }
        let mut edges: Vec<[u32; 2]> = vertices
            .iter()
            .flat_map(|v| self.around[*v as usize].iter().map(|t| self.triangle(*t)))
            .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
            .filter(|edge| edge.iter().any(|v| vertices.binary_search(v).is_ok()))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges.into_iter().for_each(|[a, b]| self.queue(a, b));
    }

    fn result(self) -> Mesh {
        let mut result = Mesh::default();
        let mut moved = vec![None; self.positions.len()];
        for (triangle, voxels) in self.triangles.into_iter().zip(self.voxels) {
            let Some(triangle) = triangle else { continue };
            result.triangles.push(triangle.map(|vertex| {
                *moved[vertex as usize].get_or_insert_with(|| {
                    result.positions.push(self.positions[vertex as usize]);
                    result.positions.len() as u32 - 1
                })
            }));
            result.voxels.push(voxels);
        }
        result
    }
}

/// Squared, of twice the area of the least triangle, in voxels: vertices are whole numbers.
const SMALLEST: f32 = 1e-6;

/// What intervals may be off, as shares of an edge.
const ROUNDING: f32 = 1e-5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::blobs;
    use crate::{VoxelLayers, initial_mesh};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn edges(mesh: &Mesh) -> BTreeMap<[u32; 2], usize> {
        let mut edges = BTreeMap::new();
        for t in &mesh.triangles {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry([t[a].min(t[b]), t[a].max(t[b])]).or_insert(0) += 1;
            }
        }
        edges
    }

    /// Vertices less edges plus faces.
    fn characteristic(mesh: &Mesh) -> i64 {
        (mesh.positions.len() + mesh.triangles.len()) as i64 - edges(mesh).len() as i64
    }

    proptest! {
        /// No voxel that a triangle stood for is lost, by brute force; the mesh keeps its pieces and
        /// holes; what is simplified is simple.
        #[test]
        fn no_voxel_is_lost(blob in blobs(), enlarged in 1.0..2.0f32) {
            let layers = blob.layers();
            let (mesh, centers) = (initial_mesh(&layers), layers.centers());
            let found = simplify(&mesh, &centers, enlarged);
            let simple = &found.mesh;
            prop_assert_eq!(characteristic(simple), characteristic(&mesh));
            prop_assert_eq!(found.contracted, mesh.positions.len() - simple.positions.len());
            let needed: std::collections::BTreeSet<u32> =
                mesh.voxels.iter().flatten().copied().collect();
            for voxel in needed {
                let center = centers[voxel as usize];
                let mut standing = simple.triangles.iter().zip(&simple.voxels)
                    .filter(|(_, voxels)| voxels.contains(&voxel))
                    .map(|(t, _)| t.map(|v| simple.positions[v as usize]));
                prop_assert!(standing.any(|t| touches_cube(t, center, enlarged / 2.0)));
            }
            let again = simplify(simple, &centers, enlarged);
            prop_assert!(again.mesh.triangles.len() <= simple.triangles.len());
            prop_assert_eq!(simplify(&mesh, &centers, enlarged), found);
        }

        /// Borders stay where voxels are: each lies in enlarged voxels as a whole.
        #[test]
        fn borders_stay_in_voxels(blob in blobs(), enlarged in 1.0..2.0f32) {
            let layers = blob.layers();
            let centers = layers.centers();
            let simple = simplify(&initial_mesh(&layers), &centers, enlarged).mesh;
            for ([a, b], count) in edges(&simple) {
                if count == 1 {
                    let [a, b] = [a, b].map(|v| simple.positions[v as usize]);
                    for i in 0..=50 {
                        let point = a.lerp(b, i as f32 / 50.0);
                        let nearest = centers.iter()
                            .map(|c| (point - c).abs().max_element())
                            .fold(f32::INFINITY, f32::min);
                        prop_assert!(nearest <= enlarged / 2.0 + 1e-3, "{point} is {nearest} off");
                    }
                }
            }
        }
    }

    fn wall(side: u16, depth: impl Fn(u16, u16) -> usize, thick: usize) -> Vec<Vec<[u16; 2]>> {
        let mut layers = vec![Vec::new(); 4 * usize::from(side)];
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let first = depth(x, y);
            (first..first + thick).for_each(|l| layers[l].push([x, y]));
        }
        layers
    }

    fn simplified(side: u16, layers: &[Vec<[u16; 2]>]) -> (usize, usize) {
        let voxels = VoxelLayers {
            width: side.into(),
            height: side.into(),
            layers,
        };
        let mesh = initial_mesh(&voxels);
        let found = simplify(&mesh, &voxels.centers(), 1.5);
        (mesh.triangles.len(), found.mesh.triangles.len())
    }

    /// What is flat takes two triangles, however large, and what slopes evenly as well, however many
    /// layers it passes.
    #[test]
    fn what_is_flat_or_slopes_evenly_takes_few_triangles() {
        for side in [8, 32, 64] {
            let (before, after) = simplified(side, &wall(side, |_, _| 3, 1));
            assert_eq!((before, after), (2 * usize::from(side).pow(2), 2));
            let slope = wall(side, |x, _| usize::from(x), 2);
            let (before, after) = simplified(side, &slope);
            assert!(before > 4 * usize::from(side).pow(2) - 4 * usize::from(side));
            assert!(after <= 16, "{after} of {before}");
        }
    }
}
