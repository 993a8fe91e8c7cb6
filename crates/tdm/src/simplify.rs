//! Simplification by edge contraction that loses no voxel.

use crate::mesh::{join, root};
use crate::near::VoxelIndex;
use crate::touch::{Target, interval_in_box};
use crate::{Cuboid, Mesh, VoxelLayers};
use glam::Vec3;
use smallvec::SmallVec;
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
/// piece, with the holes it had.
///
/// A vertex on a border, or on a seam where three surfaces or more meet, moves only along it, and the
/// border that it leaves behind must lie in enlarged voxels as a whole, so that it never reaches across
/// what is empty.
///
/// Every voxel that a triangle of `mesh` stands for is touched, enlarged, by a triangle that stands
/// for it in the result.
///
/// First all contractions are made that leave the mesh where it is, of what is flat or straight; then those
/// that take nothing away from voxels as they are; then those that `enlarged` allows. Otherwise short edges
/// at the corners of what is large and flat would go before the long ones that cost nothing.
/// Edges are tried in rounds. What was refused is tried again in the next if something around it has
/// changed, until a round changes nothing.
///
/// * `voxels` - what the mesh was made for
/// * `enlarged` - side of a voxel for this purpose, in voxels: 1 keeps to them as they are, 1.5
///   gives far fewer triangles, up to 2
///
/// The same mesh gives the same result. Time grows with voxels times the logarithm of their number:
/// each time the triangles that are left are twice as large, all voxels are looked at again.
///
/// # Panics
///
/// When `enlarged` is below 1, or a triangle refers to a vertex or a voxel that is not there.
pub fn simplify(mesh: &Mesh, voxels: &VoxelLayers<'_>, enlarged: f32) -> Simplified {
    assert!(enlarged >= 1.0, "voxels cannot be enlarged by {enlarged}");
    let mut work = Work::new(mesh, voxels);
    let (mut contracted, mut refused) = (0, 0);
    for (is_exact, enlarged) in [(true, 1.0), (false, 1.0), (false, enlarged)] {
        work.is_exact = is_exact;
        work.enlarge(voxels, enlarged);
        let [made, failed] = work.contract_all();
        contracted += made;
        refused += failed;
    }
    Simplified {
        mesh: work.result(),
        contracted,
        refused,
    }
}

/// As many as are mostly around a vertex: that needs no memory of its own.
type Few<T> = SmallVec<[T; 8]>;

/// The voxels of a triangle, few of most.
type Voxels = SmallVec<[u32; 4]>;

struct Work {
    index: VoxelIndex,
    /// Voxels, enlarged.
    boxes: Vec<Cuboid>,
    /// How far from its centre the thickest of them reaches.
    reach: Vec3,
    /// Whether the mesh must go on to pass through each vertex that goes.
    is_exact: bool,
    positions: Vec<Vec3>,
    /// `None` where it is gone.
    triangles: Vec<Option<[u32; 3]>>,
    voxels: Vec<Voxels>,
    /// Of each vertex its triangles; none where it is gone.
    around: Vec<Few<u32>>,
    /// How often the triangles around each vertex have changed.
    changes: Vec<u32>,
    /// Edges that are still to be tried in this round, the shortest last.
    round: Vec<ByLength>,
    /// Edges that contractions made in this round.
    new: BinaryHeap<Reverse<ByLength>>,
}

/// An edge, ordered by length, then by ends, so that results do not depend on anything else. Lengths
/// are squared; positive floats are ordered like their bits.
type ByLength = (u32, [u32; 2]);

/// How triangles surround a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Surroundings {
    /// All around.
    Inside,
    /// It lies on a line of edges that do not have two triangles: a border, or a seam of several
    /// surfaces. The vertices before and behind it on the line.
    Line([u32; 2]),
    /// Anything else: a corner of such lines, or surfaces that touch in it.
    Corner,
}

impl Work {
    fn new(mesh: &Mesh, voxels: &VoxelLayers<'_>) -> Self {
        let mut around = vec![Few::new(); mesh.positions.len()];
        for (i, triangle) in (0..).zip(&mesh.triangles) {
            triangle.iter().for_each(|v| around[*v as usize].push(i));
        }
        let standing = mesh.voxels.iter().map(|voxels| Voxels::from_slice(voxels));
        Self {
            index: VoxelIndex::new(voxels),
            boxes: Vec::new(),
            reach: Vec3::ZERO,
            is_exact: true,
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.iter().copied().map(Some).collect(),
            voxels: standing.collect(),
            changes: vec![0; around.len()],
            around,
            round: Vec::new(),
            new: BinaryHeap::new(),
        }
    }

    /// Enlarges voxels about their centres.
    fn enlarge(&mut self, voxels: &VoxelLayers<'_>, enlarged: f32) {
        self.boxes = voxels.boxes(enlarged);
        let halves = self.boxes.iter().map(|place| place.half);
        self.reach = halves.fold(Vec3::ZERO, Vec3::max);
    }

    /// Contracts edges until all are refused; returns how many contractions were made and refused.
    fn contract_all(&mut self) -> [usize; 2] {
        let triangles = self.triangles.iter().flatten();
        let mut edges: Vec<[u32; 2]> = triangles
            .flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]])
            .map(ascending)
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let (mut contracted, mut refused) = (0, 0);
        while !edges.is_empty() {
            self.round = edges.drain(..).map(|edge| self.by_length(edge)).collect();
            self.round.sort_unstable_by_key(|edge| Reverse(*edge));
            let mut stuck = Vec::new();
            while let Some([a, b]) = self.shortest() {
                if !self.is_edge(a, b) {
                    continue;
                }
                if self.contract(b, a) || self.contract(a, b) {
                    contracted += 1;
                } else {
                    refused += 1;
                    stuck.push(([a, b], self.changes_of([a, b])));
                }
            }
            let may_succeed = |(ends, changes): &([u32; 2], [u32; 2])| {
                self.is_edge(ends[0], ends[1]) && self.changes_of(*ends) != *changes
            };
            edges.extend(stuck.iter().filter(|one| may_succeed(one)).map(|one| one.0));
        }
        [contracted, refused]
    }

    fn by_length(&self, [a, b]: [u32; 2]) -> ByLength {
        let [p, q] = [a, b].map(|v| self.positions[v as usize]);
        (p.distance_squared(q).to_bits(), ascending([a, b]))
    }

    /// Takes the edge that is to be tried next.
    fn shortest(&mut self) -> Option<[u32; 2]> {
        let edge = match (self.round.last(), self.new.peek()) {
            (Some(old), Some(Reverse(new))) if new < old => self.new.pop().map(|new| new.0),
            (None, Some(_)) => self.new.pop().map(|new| new.0),
            _ => self.round.pop(),
        };
        edge.map(|(_, ends)| ends)
    }

    fn is_edge(&self, a: u32, b: u32) -> bool {
        let mut around = self.around[a as usize].iter();
        around.any(|t| self.triangle(*t).contains(&b))
    }

    fn changes_of(&self, ends: [u32; 2]) -> [u32; 2] {
        ends.map(|v| self.changes[v as usize])
    }

    fn triangle(&self, index: u32) -> [u32; 3] {
        self.triangles[index as usize].expect("vertices know only triangles that are there")
    }

    fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|v| self.positions[v as usize])
    }

    fn surroundings(&self, vertex: u32) -> Surroundings {
        // The other two vertices of each triangle, by vertices.
        let mut beside: SmallVec<[(u32, u32); 16]> = SmallVec::new();
        for (i, t) in (0..).zip(&self.around[vertex as usize]) {
            let others = self.triangle(*t).into_iter().filter(|v| *v != vertex);
            beside.extend(others.map(|v| (v, i)));
        }
        beside.sort_unstable();
        let mut joined: Few<u32> = (0..self.around[vertex as usize].len() as u32).collect();
        let mut ends: Few<(u32, usize)> = Few::new();
        let mut at_ends: Few<u32> = Few::new();
        for at_edge in beside.chunk_by(|a, b| a.0 == b.0) {
            match at_edge {
                [(_, a), (_, b)] => join(&mut joined, *a, *b),
                [(v, _), ..] => {
                    ends.push((*v, at_edge.len()));
                    at_ends.extend(at_edge.iter().map(|(_, i)| *i));
                }
                [] => {}
            }
        }
        let count = joined.len() as u32;
        let mut roots: Few<u32> = (0..count).map(|i| root(&mut joined, i)).collect();
        roots.sort_unstable();
        roots.dedup();
        match ends[..] {
            [] if roots.len() == 1 => Surroundings::Inside,
            [(a, of_a), (b, of_b)] if of_a == of_b => {
                // Each surface lies between the two; none touches only the vertex.
                let mut reached: Few<u32> = at_ends.iter().map(|i| root(&mut joined, *i)).collect();
                reached.sort_unstable();
                reached.dedup();
                match reached == roots {
                    true => Surroundings::Line([a, b]),
                    false => Surroundings::Corner,
                }
            }
            _ => Surroundings::Corner,
        }
    }

    /// Moves vertex `gone` to `kept`, if nothing is lost by it.
    fn contract(&mut self, gone: u32, kept: u32) -> bool {
        let around = &self.around[gone as usize];
        let (vanishing, moving): (Few<u32>, Few<u32>) = around
            .iter()
            .copied()
            .partition(|t| self.triangle(*t).contains(&kept));
        // What would lose its last triangle stays.
        let loses_all = |v: u32| {
            let around = &self.around[v as usize];
            let gains = v == kept && !moving.is_empty();
            v != gone && !gains && around.iter().all(|t| vanishing.contains(t))
        };
        let mut at_vanishing = vanishing.iter().flat_map(|t| self.triangle(*t));
        if at_vanishing.any(loses_all) {
            return false;
        }
        let to = |v: u32| if v == gone { kept } else { v };
        let moved: Few<[u32; 3]> = moving.iter().map(|t| self.triangle(*t).map(to)).collect();
        if self.is_exact && !self.passes(&moved, self.positions[gone as usize]) {
            return false;
        }
        let before_and_after = moving.iter().map(|t| self.triangle(*t)).zip(&moved);
        for (before, after) in before_and_after {
            let (before, after) = (self.normal(before), self.normal(*after));
            // What had no area before may become anything.
            let had_area = before.length_squared() >= SMALLEST;
            if had_area && (after.length_squared() < SMALLEST || before.dot(after) <= 0.0) {
                return false;
            }
        }
        let is_there = |moved: &[u32; 3]| {
            let around = self.around[kept as usize].iter();
            let mut others = around.map(|t| self.triangle(*t));
            others.any(|other| other.iter().all(|v| moved.contains(v)))
        };
        if moved.iter().any(is_there) {
            return false;
        }
        let border = match self.surroundings(gone) {
            Surroundings::Inside => None,
            Surroundings::Line(ends) if ends.contains(&kept) => {
                Some(if ends[0] == kept { ends[1] } else { ends[0] })
            }
            Surroundings::Line(_) | Surroundings::Corner => return false,
        };
        let ring = self.neighbors(gone);
        let before = self.neighbors(kept);
        let new = |v: &&u32| before.binary_search(v).is_err();
        let new: Few<u32> = ring.iter().filter(new).copied().collect();
        // The mesh keeps its pieces and holes if the ends of the edge have no neighbours in common
        // but those of the triangles between them. Among the ring are the two ends themselves.
        if ring.len() - new.len() != vanishing.len() + 2 {
            return false;
        }
        if border.is_some_and(|end| !self.is_covered([kept, end])) {
            return false;
        }
        let Some(divided) = self.divided(around, &moved) else {
            return false;
        };
        if !moved.iter().all(|t| self.is_in_voxels(self.corners(*t))) {
            return false;
        }

        for triangle in &vanishing {
            for vertex in self.triangle(*triangle) {
                self.around[vertex as usize].retain(|t| t != triangle);
            }
            self.triangles[*triangle as usize] = None;
            self.voxels[*triangle as usize] = Voxels::new();
        }
        for ((triangle, corners), voxels) in moving.iter().zip(moved).zip(divided) {
            self.triangles[*triangle as usize] = Some(corners);
            self.voxels[*triangle as usize] = voxels;
            self.around[kept as usize].push(*triangle);
        }
        self.around[gone as usize] = Few::new();
        for v in ring {
            self.changes[v as usize] += 1;
        }
        for v in new {
            self.new.push(Reverse(self.by_length([kept, v])));
        }
        true
    }

    /// The vertices of the triangles around one, itself included, in ascending order.
    fn neighbors(&self, vertex: u32) -> SmallVec<[u32; 24]> {
        let around = self.around[vertex as usize].iter();
        let mut all: SmallVec<[u32; 24]> = around.flat_map(|t| self.triangle(*t)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Twice the area, along the normal.
    fn normal(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Whether triangles pass through a place.
    fn passes(&self, triangles: &[[u32; 3]], center: Vec3) -> bool {
        let half = Vec3::splat(ROUNDING);
        let touches =
            |t: &[u32; 3]| Target::new(self.corners(*t)).touches(&Cuboid { center, half });
        triangles.iter().any(touches)
    }

    /// For the voxels of some triangles, which of others touches each; `None` where none touches one.
    fn divided(&self, before: &[u32], after: &[[u32; 3]]) -> Option<Few<Voxels>> {
        let voxels = || before.iter().map(|t| &self.voxels[*t as usize]);
        let targets: Few<Target> = after
            .iter()
            .map(|t| Target::new(self.corners(*t)))
            .collect();
        // The last that touched one is likely to touch the next.
        let mut last = 0;
        let mut touching = |voxel: &u32| {
            let place = &self.boxes[*voxel as usize];
            let is_touching = |target: &usize| targets[*target].touches(place);
            let order = std::iter::once(last).chain((0..targets.len()).filter(|t| *t != last));
            let found = order.filter(|t| *t < targets.len()).find(is_touching);
            last = found.unwrap_or(last);
            found
        };
        // What is refused is mostly refused by many voxels: a few tell soon.
        for voxels in voxels() {
            let few = voxels.iter().step_by(voxels.len() / 8 + 1);
            if few.map(&mut touching).any(|found| found.is_none()) {
                return None;
            }
        }
        let mut divided: Few<Voxels> = SmallVec::from_elem(Voxels::new(), after.len());
        for voxel in voxels().flatten() {
            divided[touching(voxel)?].push(*voxel);
        }
        Some(divided)
    }

    /// Whether a triangle lies in enlarged voxels, as far as places about a voxel apart can tell.
    fn is_in_voxels(&self, [a, b, c]: [Vec3; 3]) -> bool {
        let steps = |from: Vec3, to: Vec3| (to - from).abs().max_element().ceil().max(1.0) as u32;
        let across = steps(a, b);
        (0..=across).all(|i| {
            let from = a.lerp(b, i as f32 / across as f32);
            let along = steps(from, c);
            (0..along).all(|j| self.is_in_voxel(from.lerp(c, j as f32 / along as f32)))
        })
    }

    fn is_in_voxel(&self, place: Vec3) -> bool {
        self.index
            .near(place, self.reach + ROUNDING.sqrt())
            .any(|(id, center)| {
                let reach = self.boxes[id as usize].half + ROUNDING.sqrt();
                (place - center).abs().cmple(reach).all()
            })
    }

    /// Whether an edge lies in enlarged voxels as a whole.
    fn is_covered(&self, ends: [u32; 2]) -> bool {
        let [a, b] = ends.map(|v| self.positions[v as usize]);
        let steps = (b - a).abs().max_element().ceil().max(1.0);
        let step = (b - a) / steps;
        let mut covered = 0.0;
        let mut intervals: Vec<[f32; 2]> = Vec::new();
        for i in 0..steps as usize {
            // All boxes that reach into this piece.
            let [from, to] = [i, i + 1].map(|i| a + step * i as f32);
            let near = self
                .index
                .near((from + to) / 2.0, self.reach + step.abs() / 2.0);
            let boxes = near.map(|(id, _)| &self.boxes[id as usize]);
            intervals.clear();
            intervals.extend(boxes.filter_map(|place| interval_in_box(from, to, place)));
            intervals.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
            covered = 0.0;
            for [from, to] in &intervals {
                if *from > covered + ROUNDING {
                    return false;
                }
                covered = to.max(covered);
            }
            if covered < 1.0 - ROUNDING {
                return false;
            }
        }
        covered > 0.0
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
            result.voxels.push(voxels.into_vec());
        }
        result
    }
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Squared, of twice the area of the least triangle, in voxels: vertices are whole numbers.
const SMALLEST: f32 = 1e-6;

/// What places and intervals may be off, in voxels.
const ROUNDING: f32 = 1e-5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::initial_mesh;
    use crate::testing::blobs;
    use farfield_grid::BitMask;
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
        /// No voxel that a triangle stood for is lost, by brute force; the mesh keeps its pieces and holes;
        /// what is simplified is simple.
        #[test]
        fn no_voxel_is_lost(
            blob in blobs(), enlarged in 1.0..2.0f32,
        ) {
            let (layers, points) = (blob.layers(), blob.points());
            let mesh = initial_mesh(&layers, &points, enlarged);
            let boxes = layers.boxes(enlarged);
            let found = simplify(&mesh, &layers, enlarged);
            let simple = &found.mesh;
            prop_assert_eq!(characteristic(simple), characteristic(&mesh));
            prop_assert_eq!(found.contracted, mesh.positions.len() - simple.positions.len());
            let needed: std::collections::BTreeSet<u32> =
                mesh.voxels.iter().flatten().copied().collect();
            for voxel in needed {
                let place = &boxes[voxel as usize];
                let mut standing = simple.triangles.iter().zip(&simple.voxels)
                    .filter(|(_, voxels)| voxels.contains(&voxel))
                    .map(|(t, _)| t.map(|v| simple.positions[v as usize]));
                prop_assert!(standing.any(|t| Target::new(t).touches(place)));
            }
            let again = simplify(simple, &layers, enlarged);
            prop_assert!(again.mesh.triangles.len() <= simple.triangles.len());
            prop_assert_eq!(simplify(&mesh, &layers, enlarged), found);
        }

        /// Borders stay where voxels are: each that was not there at first lies in enlarged voxels as a
        /// whole.
        #[test]
        fn borders_stay_in_voxels(blob in blobs(), enlarged in 1.0..2.0f32) {
            let layers = blob.layers();
            let boxes = layers.boxes(enlarged);
            let mesh = initial_mesh(&layers, &blob.points(), enlarged);
            let simple = simplify(&mesh, &layers, enlarged).mesh;
            let places = |mesh: &Mesh, ends: [u32; 2]| ends.map(|v| mesh.positions[v as usize]);
            let at_first: Vec<[Vec3; 2]> = edges(&mesh).keys().map(|ends| places(&mesh, *ends)).collect();
            let was_there = |[a, b]: [Vec3; 2]| at_first.contains(&[a, b]) || at_first.contains(&[b, a]);
            for (ends, count) in edges(&simple) {
                let [a, b] = places(&simple, ends);
                if count == 1 && !was_there([a, b]) {
                    for i in 0..=50 {
                        let point = a.lerp(b, i as f32 / 50.0);
                        let nearest = boxes.iter()
                            .map(|b| ((point - b.center).abs() - b.half).max_element())
                            .fold(f32::INFINITY, f32::min);
                        prop_assert!(nearest <= 1e-3, "{point} is {nearest} off");
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

    /// What lies before the last voxel of each column.
    fn reached(side: u16, layers: &[Vec<[u16; 2]>]) -> Vec<BitMask> {
        let mut reached = vec![BitMask::empty(side.into(), side.into()); layers.len()];
        for (l, layer) in layers.iter().enumerate() {
            for [x, y] in layer {
                let before = reached[..=l].iter_mut();
                before.for_each(|mask| mask.insert((*x).into(), (*y).into()));
            }
        }
        reached
    }

    fn simplified(side: u16, layers: &[Vec<[u16; 2]>]) -> (usize, usize) {
        let borders: Vec<f32> = (0..=layers.len()).map(|l| l as f32).collect();
        let voxels = VoxelLayers {
            width: side.into(),
            height: side.into(),
            layers,
            reached: &reached(side, layers),
            borders: &borders,
        };
        let centers: Vec<Vec3> = voxels.boxes(1.0).iter().map(|b| b.center).collect();
        let mesh = initial_mesh(&voxels, &centers, 1.5);
        let found = simplify(&mesh, &voxels, 1.5);
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
