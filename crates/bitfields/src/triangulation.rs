//! Viewpoints around a model, and the faces between them.

use glam::{DVec2, DVec3};
use robust::{Coord3D, orient3d};
use spade::{DelaunayTriangulation, Point2, Triangulation as _};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use thiserror::Error;

/// Directions closer than this many radians are one: their projections would be little but
/// rounding.
pub(crate) const CLOSEST: f64 = 1e-6;

/// A direction's length differs from 1 by no more than roundings.
const UNIT: f64 = 1e-9;

/// The faces between viewpoints on the sphere around a model: the convex hull of their directions, or
/// what a file has ([`from_faces`](Self::from_faces)).
///
/// Invariants: the faces tile the sphere, exactly: each direction lies in a face, and in only one
/// unless it lies on an edge. Every viewpoint is a corner of at least three faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangulation {
    directions: Vec<DVec3>,
    faces: Vec<Face>,
}

/// A triangle between three viewpoints.
///
/// ```text
///            opposite        corners 0, 1 and 2 are counter-clockwise seen from outside;
///           of neighbour 0   neighbour i shares the edge from corner i to corner i + 1
///               . ' .
///             .   0   .
///           1 ---------- 0
///            \         /
///         1   \       /   2
///              \     /
///                 2
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Viewpoints.
    pub corners: [u32; 3],
    /// Faces across the edges.
    pub neighbors: [u32; 3],
}

/// Why viewpoints have no triangulation.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TriangulationError {
    /// Fewer than four, which never surround anything.
    #[error("at least 4 viewpoints are needed to surround the model, not {count}")]
    TooFew {
        /// Number of viewpoints.
        count: usize,
    },
    /// A viewpoint that is not finite, or that is the centre itself.
    #[error("viewpoint {viewpoint} at {position} lies in no direction from the centre {center}")]
    NoDirection {
        /// Its index.
        viewpoint: usize,
        /// Where it is, in metres.
        position: DVec3,
        /// Where the centre is, in metres.
        center: DVec3,
    },
    /// Two viewpoints in the same direction, which [`merge_directions`](crate::merge_directions)
    /// makes one.
    #[error("viewpoints {first} and {second} lie in the same direction from the centre")]
    SameDirection {
        /// Index of the first.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// Viewpoints on one side only, in a plane or on a line.
    #[error(
        "the viewpoints do not surround the centre: from one of its sides, nobody looks at it; \
         add viewpoints there"
    )]
    OneSided,
    /// A direction of another length than 1, as told to [`Triangulation::from_faces`].
    #[error("direction {viewpoint} has the length {length}, not 1")]
    NotUnit {
        /// Its index.
        viewpoint: usize,
        /// NaN where a coordinate is.
        length: f64,
    },
    /// A face with a corner that is no viewpoint, that does not face outwards, or that is not closed
    /// with its neighbours.
    #[error(
        "face {face} names a viewpoint that there is not, is not counter-clockwise seen from outside, or \
         has an edge that it does not share with just one other"
    )]
    NoFace {
        /// Its index.
        face: usize,
    },
    /// Faces that are each as they should be, but lie over each other or leave viewpoints out.
    #[error("the faces lie over each other, or leave viewpoints out")]
    NoTiling,
}

impl Triangulation {
    /// The convex hull of the directions in which viewpoints lie, with triangles as faces.
    ///
    /// Found as the Delaunay triangulation of the stereographic projection from the first
    /// viewpoint, which takes circles on the sphere to circles in the plane; the edges around it
    /// form triangles with the first viewpoint, whose own image is at infinity. Where four or more
    /// viewpoints lie on a circle with none inside, as those of a cube do, any of the possible
    /// diagonals is taken, the same one each time.
    ///
    /// * `viewpoints` - in metres; their distances from the centre do not matter
    /// * `center` - of the model, in metres
    ///
    /// # Errors
    ///
    /// When viewpoints are fewer than four, not finite or in the centre, two in the same direction
    /// (within a millionth of a radian), or on one side of a plane through the centre.
    pub fn new(viewpoints: &[DVec3], center: DVec3) -> Result<Self, TriangulationError> {
        let count = viewpoints.len();
        if count < 4 {
            return Err(TriangulationError::TooFew { count });
        }
        let directions = (viewpoints.iter().enumerate())
            .map(|(viewpoint, &position)| {
                direction(position - center).ok_or(TriangulationError::NoDirection {
                    viewpoint,
                    position,
                    center,
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        if let Some([first, second]) = same_direction(&directions) {
            return Err(TriangulationError::SameDirection { first, second });
        }
        let corners = hull(&directions);
        Self::tiling(directions, &corners).map_err(|_| TriangulationError::OneSided)
    }

    /// The faces of a file, such as `faces.json` of a bundle, as they stand there.
    ///
    /// To compute them again from the viewpoints would do in most cases; but where four lie on a
    /// circle, another version of this crate may take another diagonal, and what is listed for the
    /// faces is that of the version which wrote them.
    ///
    /// Any tiling of the sphere will do, not only the convex hull, though a [`Lookup`](crate::Lookup) is
    /// quickest in that. That the faces are one is checked, with exact signs of determinants: a closed
    /// surface that faces outwards everywhere covers all directions equally often, and its area tells
    /// how often that is.
    ///
    /// * `directions` - from the centre to the viewpoints, of length 1 to within 1e-9; they are kept
    ///   to the bit
    /// * `corners` - viewpoints, counter-clockwise seen from outside
    ///
    /// # Errors
    ///
    /// When directions are fewer than four or not of length 1, or the faces do not tile the sphere
    /// with all of them as corners.
    pub fn from_faces(
        directions: &[DVec3],
        corners: &[[u32; 3]],
    ) -> Result<Self, TriangulationError> {
        let count = directions.len();
        if count < 4 {
            return Err(TriangulationError::TooFew { count });
        }
        for (viewpoint, length) in directions.iter().map(|d| d.length()).enumerate() {
            // Nor is one that is no number.
            let is_unit = (length - 1.0).abs() <= UNIT;
            if !is_unit {
                return Err(TriangulationError::NotUnit { viewpoint, length });
            }
        }
        Self::tiling(directions.to_vec(), corners)
    }

    /// Faces that tile the sphere.
    fn tiling(directions: Vec<DVec3>, corners: &[[u32; 3]]) -> Result<Self, TriangulationError> {
        let place = |corner: u32| directions.get(corner as usize).copied();
        let mut area = 0.0;
        for (face, &[a, b, c]) in corners.iter().enumerate() {
            let places = [place(a), place(b), place(c)];
            match places {
                [Some(a), Some(b), Some(c)] if sign([a, b, c]) > 0.0 => {
                    area += solid_angle([a, b, c]);
                }
                _ => return Err(TriangulationError::NoFace { face }),
            }
        }
        let faces = with_neighbors(corners).map_err(|face| TriangulationError::NoFace { face })?;
        // A closed surface that faces outwards everywhere winds around the centre once or more, so
        // that its area is a multiple of 4 pi. By Euler's formula one that does so once has two faces
        // for each of its corners, less four.
        if faces.len() + 4 != 2 * directions.len() || area > 6.0 * PI {
            return Err(TriangulationError::NoTiling);
        }
        Ok(Self { directions, faces })
    }

    /// The directions in which the viewpoints lie, of length 1.
    pub fn directions(&self) -> &[DVec3] {
        &self.directions
    }

    /// Twice as many as viewpoints, less four.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The viewpoints that complement each other for views through a face: its corners, then the
    /// opposite corners of its three neighbours.
    ///
    /// The six of Meruvia Pastor and Strothotte, section 3.2.1. With four or five viewpoints some of
    /// the last three are the same.
    ///
    /// # Panics
    ///
    /// When there is no such face.
    pub fn six(&self, face: u32) -> [u32; 6] {
        let Face { corners, neighbors } = self.faces[face as usize];
        let opposite = neighbors.map(|neighbor| {
            let theirs = self.faces[neighbor as usize];
            let at = theirs.neighbors.iter().position(|back| *back == face);
            let at = at.expect("neighbours are mutual");
            theirs.corners[(at + 2) % 3]
        });
        std::array::from_fn(|i| if i < 3 { corners[i] } else { opposite[i - 3] })
    }

    /// The directions of a face's corners, of length 1.
    ///
    /// # Panics
    ///
    /// When there is no such face.
    pub fn corners(&self, face: u32) -> [DVec3; 3] {
        let corners = self.faces[face as usize].corners;
        corners.map(|corner| self.directions[corner as usize])
    }

    /// Whether a direction, of any length, lies in a face or on its border. Exact.
    ///
    /// # Panics
    ///
    /// When there is no such face.
    pub fn contains(&self, face: u32, direction: DVec3) -> bool {
        self.first_edge_before(face, direction).is_none()
    }

    /// The face that contains a direction, walking there from face `start`.
    ///
    /// On an edge it is one of the faces there, the same whenever the walk begins in the same face.
    /// The walk crosses any edge that has the direction on its other side.
    ///
    /// # Panics
    ///
    /// When the direction is zero or not finite, or there is no such face.
    pub(crate) fn walk(&self, start: u32, direction: DVec3) -> u32 {
        let longest = direction.abs().max_element();
        // The largest of some numbers and one that is none is a number.
        assert!(
            direction.is_finite() && longest > 0.0,
            "{direction} is no direction"
        );
        // Against products that overflow or vanish.
        let direction = direction / longest;
        let mut face = start;
        // A walk over a hull ends. Of four viewpoints that lie in a plane but for rounding, the
        // diagonal may bend inwards, so that is not a proof.
        for _ in &self.faces {
            match self.first_edge_before(face, direction) {
                Some(edge) => face = self.faces[face as usize].neighbors[edge],
                None => return face,
            }
        }
        (0..self.faces.len() as u32)
            .find(|&face| self.contains(face, direction))
            .expect("faces tile the sphere")
    }

    /// The first edge of a face that has a direction on its other side.
    #[inline]
    fn first_edge_before(&self, face: u32, direction: DVec3) -> Option<usize> {
        let [a, b, c] = self.corners(face);
        [[a, b], [b, c], [c, a]]
            .iter()
            .position(|&[from, to]| sign([from, to, direction]) < 0.0)
    }
}

/// Of length 1, or nothing for what is zero or not finite.
pub(crate) fn direction(offset: DVec3) -> Option<DVec3> {
    let longest = offset.abs().max_element();
    // Twice, as the squares of the largest and smallest numbers overflow and vanish.
    (longest > 0.0 && longest.is_finite() && offset.is_finite())
        .then(|| (offset / longest).normalize())
        .filter(|direction| direction.is_finite())
}

/// The sign of the determinant of three directions: positive where they are counter-clockwise seen
/// from outside. Exact, and so of opposite sign for an edge passed in the other direction.
#[inline]
fn sign([a, b, c]: [DVec3; 3]) -> f64 {
    let coord = |v: DVec3| Coord3D {
        x: v.x,
        y: v.y,
        z: v.z,
    };
    orient3d(coord(a), coord(b), coord(c), coord(DVec3::ZERO))
}

/// The area of a spherical triangle, which faces outwards, in steradians.
///
/// A. Van Oosterom and J. Strackee, The Solid Angle of a Plane Triangle, 1983.
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    2.0 * a
        .dot(b.cross(c))
        .atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// The first two directions that are nearly the same, if any.
fn same_direction(directions: &[DVec3]) -> Option<[usize; 2]> {
    let close = |first: usize, second: &usize| {
        directions[first].distance_squared(directions[*second]) < CLOSEST * CLOSEST
    };
    // Hundreds of viewpoints have some 10^5 pairs.
    (0..directions.len()).find_map(|first| {
        let second = (first + 1..directions.len()).find(|second| close(first, second))?;
        Some([first, second])
    })
}

/// The corners of the hull's faces, counter-clockwise seen from outside; empty where all directions
/// lie on a circle.
fn hull(directions: &[DVec3]) -> Vec<[u32; 3]> {
    let pole = directions[0];
    // Seen from outside, opposite to the pole, x runs to the right and y upwards.
    let x = pole.any_orthonormal_vector();
    let y = x.cross(pole);
    let mut plane = DelaunayTriangulation::<Point2<f64>>::new();
    for direction in &directions[1..] {
        // 1 - cos of the angle to the pole, without cancellation.
        let height = (*direction - pole).length_squared() / 2.0;
        let at = DVec2::new(direction.dot(x), direction.dot(y)) / height;
        // Numbers below 2^-142 are more than spade takes, and nothing beside 1e-6.
        let at = at.to_array().map(|c| if c.abs() < 1e-40 { 0.0 } else { c });
        plane
            .insert(Point2::new(at[0], at[1]))
            .expect("directions that are apart have images within 1e7 of the centre");
    }
    if plane.all_vertices_on_line() {
        return Vec::new();
    }
    let viewpoint = |index: usize| index as u32 + 1;
    let inner = plane.inner_faces().map(|face| {
        face.vertices()
            .map(|vertex| viewpoint(vertex.fix().index()))
    });
    // With the outside to the left of its edges.
    let outer = plane.convex_hull().map(|edge| {
        [
            viewpoint(edge.from().fix().index()),
            viewpoint(edge.to().fix().index()),
            0,
        ]
    });
    inner.chain(outer).collect()
}

/// The faces of a closed surface, or the first one that has an edge which another one has too, or whose
/// edge nobody has in the other direction.
fn with_neighbors(corners: &[[u32; 3]]) -> Result<Vec<Face>, usize> {
    let edge = |face: &[u32; 3], i: usize| [face[i], face[(i + 1) % 3]];
    let mut left_of: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for (index, face) in corners.iter().enumerate() {
        for i in 0..3 {
            if left_of.insert(edge(face, i), index as u32).is_some() {
                return Err(index);
            }
        }
    }
    let face = |(index, corners): (usize, &[u32; 3])| {
        let mut neighbors = [0; 3];
        for (i, neighbor) in neighbors.iter_mut().enumerate() {
            let [from, to] = edge(corners, i);
            *neighbor = *left_of.get(&[to, from]).ok_or(index)?;
        }
        Ok(Face {
            corners: *corners,
            neighbors,
        })
    };
    corners.iter().enumerate().map(face).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::even_directions;
    use farfield_views::sphere_direction;
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// Viewpoints all around: at random, at random among the points of a coarse lattice (many on
    /// common circles and planes through the centre), or evenly spread; at various distances.
    pub(crate) fn viewpoints() -> impl Strategy<Value = Vec<DVec3>> {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let around = axes.into_iter().flat_map(|axis| [axis, -axis]);
        let around: Vec<DVec3> = around.collect();
        let random = vec(prop::array::uniform3(-1.0..1.0f64), 0..40);
        let lattice = vec(prop::array::uniform3(-2..3i32), 0..40)
            .prop_map(|points| points.iter().map(|p| p.map(f64::from)).collect());
        let some = prop_oneof![random, lattice].prop_map(move |points: Vec<[f64; 3]>| {
            let mut all = around.clone();
            for point in points.into_iter().map(DVec3::from) {
                let apart = |other: &DVec3| point.normalize().distance(other.normalize()) > 1e-3;
                if point.length() > 0.1 && all.iter().all(apart) {
                    all.push(point);
                }
            }
            all
        });
        // The six of the axes are as well in the middle of the list as in front.
        let shuffled = some.prop_shuffle();
        prop_oneof![shuffled, (4..60u32).prop_map(even_directions)]
    }

    /// Directions at random, those of the viewpoints, and those of points on the edges.
    pub(crate) fn probes(faces: &Triangulation, count: u32) -> Vec<DVec3> {
        let around = (0..count).map(|i| sphere_direction(i, count));
        let edges = (0..faces.faces().len() as u32).flat_map(|face| {
            let [a, b, c] = faces.corners(face);
            [a, a + b, b + 3.0 * c]
        });
        around.chain(edges).collect()
    }

    proptest! {
        /// The faces tile the sphere: every direction lies in a face, and inside of only one; all
        /// others that contain it have it on their edges.
        #[test]
        fn faces_tile_the_sphere(viewpoints in viewpoints()) {
            let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
            prop_assert_eq!(faces.faces().len(), 2 * viewpoints.len() - 4);
            let all = 0..faces.faces().len() as u32;
            for direction in probes(&faces, 50) {
                let inside = |&face: &u32| {
                    let [a, b, c] = faces.corners(face);
                    [[a, b], [b, c], [c, a]].iter().all(|&[a, b]| sign([a, b, direction]) > 0.0)
                };
                let closed = all.clone().filter(|&face| faces.contains(face, direction)).count();
                let open = all.clone().filter(inside).count();
                prop_assert!(closed >= 1 && (open == 0 || (open == 1 && closed == 1)));
            }
            let area: f64 = all.map(|face| solid_angle(faces.corners(face))).sum();
            prop_assert!((area - 4.0 * PI).abs() < 1e-9);
        }

        /// No viewpoint lies before the plane of a face, so the faces are the hull's.
        #[test]
        fn no_viewpoint_is_outside_of_a_face(viewpoints in viewpoints()) {
            let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
            for face in 0..faces.faces().len() as u32 {
                let [a, b, c] = faces.corners(face);
                for v in faces.directions() {
                    // Images are up to 2e3 from the centre of the plane, as no direction is within
                    // 1e-3 of the pole, and rounded to 1e-16 of that: 1e-13 to 1e-10 on the sphere.
                    prop_assert!((b - a).cross(c - a).dot(*v - a) < 1e-10);
                }
            }
        }

        /// Neighbours share two corners, in opposite order, and the six of a face are its corners
        /// and the ones across its edges.
        #[test]
        fn the_six_are_the_corners_and_those_across(viewpoints in viewpoints()) {
            let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
            for (index, face) in faces.faces().iter().enumerate() {
                let six = faces.six(index as u32);
                prop_assert_eq!(&six[..3], &face.corners);
                for i in 0..3 {
                    let mut expected = vec![face.corners[(i + 1) % 3], face.corners[i], six[3 + i]];
                    let theirs = faces.faces()[face.neighbors[i] as usize].corners;
                    let first = theirs.iter().position(|c| *c == expected[0]).unwrap();
                    expected.rotate_right(first);
                    prop_assert_eq!(&expected, &theirs);
                }
            }
        }

        /// However far from each other start and end are, a walk ends in a face that contains the
        /// direction, of whatever length that is.
        #[test]
        fn a_walk_ends_in_the_containing_face(viewpoints in viewpoints(), start: prop::sample::Index) {
            let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
            let start = start.index(faces.faces().len()) as u32;
            for direction in probes(&faces, 50) {
                for length in [1e-300, 1.0, 1e300] {
                    let face = faces.walk(start, direction * length);
                    let longest = direction.abs().max_element();
                    // Scaling rounds.
                    let scaled = direction * length / (longest * length);
                    prop_assert!(faces.contains(face, scaled) || length != 1.0);
                    let [a, b, c] = faces.corners(face);
                    let edges = [[a, b], [b, c], [c, a]];
                    prop_assert!(edges.iter().all(|&[a, b]| a.cross(b).dot(scaled) > -1e-14));
                }
            }
        }

        /// Faces that were written are the same when they are read.
        #[test]
        fn faces_are_read_back(viewpoints in viewpoints()) {
            let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
            let corners: Vec<[u32; 3]> = faces.faces().iter().map(|face| face.corners).collect();
            let back = Triangulation::from_faces(faces.directions(), &corners);
            prop_assert_eq!(back, Ok(faces));
        }

        /// Other faces are taken only if each direction is in one of them, and inside of only one:
        /// some with another diagonal are, and none with a corner or a direction too many, too few
        /// or in the wrong place.
        #[test]
        fn only_tilings_are_read(
            viewpoints in viewpoints(),
            flips in vec(any::<prop::sample::Index>(), 0..6),
            (what, at) in (0..7u32, any::<prop::sample::Index>()),
        ) {
            let faces = Triangulation::new(&viewpoints, DVec3::ZERO).unwrap();
            let mut directions = faces.directions().to_vec();
            let mut corners: Vec<[u32; 3]> = faces.faces().iter().map(|f| f.corners).collect();
            for flip in flips {
                // The other diagonal of the two faces at an edge.
                let face = flip.index(corners.len());
                let [a, b, c] = corners[face];
                let other = corners.iter().position(|f| f.contains(&b) && f.contains(&a) && !f.contains(&c));
                let Some(other) = other else { continue };
                let d = corners[other].into_iter().find(|v| *v != a && *v != b).unwrap();
                corners[face] = [a, d, c];
                corners[other] = [d, b, c];
            }
            let index = at.index(corners.len());
            match what {
                0 => corners.truncate(index),
                1 => corners[index].reverse(),
                2 => corners[index][1] = directions.len() as u32,
                3 => corners.push(corners[index]),
                4 => corners[index][0] = (corners[index][0] + 1) % directions.len() as u32,
                5 => {
                    let index = at.index(directions.len());
                    directions[index] = -directions[index];
                }
                _ => {}
            }
            if let Ok(read) = Triangulation::from_faces(&directions, &corners) {
                prop_assert!(what > 3);
                for direction in probes(&faces, 100) {
                    let edges = |face: u32| {
                        let [a, b, c] = read.corners(face);
                        [[a, b], [b, c], [c, a]].map(|[a, b]| sign([a, b, direction]))
                    };
                    let all = 0..corners.len() as u32;
                    let open = all.clone().filter(|&f| edges(f).iter().all(|s| *s > 0.0)).count();
                    let closed = all.filter(|&f| read.contains(f, direction)).count();
                    prop_assert!(closed >= 1 && (open == 0 || (open == 1 && closed == 1)));
                    // Scaling rounds.
                    let scaled = direction / direction.abs().max_element();
                    prop_assert!(read.contains(read.walk(0, scaled), scaled));
                }
            }
        }

        /// Viewpoints on one side of the centre, or in a plane through it, are refused.
        #[test]
        fn one_sided_viewpoints_are_refused(
            points in vec([-9..10i32, -9..10i32], 4..12),
            height in prop_oneof![Just(0), 1..4i32],
        ) {
            let mut all: Vec<DVec3> = points
                .iter()
                .map(|&[x, z]| DVec3::new(x.into(), height.into(), z.into()))
                .filter(|point| *point != DVec3::ZERO)
                .map(DVec3::normalize)
                .collect();
            let mut kept: Vec<DVec3> = Vec::new();
            for point in all.drain(..) {
                if kept.iter().all(|other| other.distance(point) > 1e-3) {
                    kept.push(point);
                }
            }
            prop_assume!(kept.len() >= 4);
            prop_assert_eq!(
                Triangulation::new(&kept, DVec3::ZERO),
                Err(TriangulationError::OneSided)
            );
        }
    }

    #[test]
    fn what_is_no_direction_is_named() {
        let octahedron: Vec<DVec3> = [DVec3::X, DVec3::Y, DVec3::Z]
            .into_iter()
            .flat_map(|axis| [axis, -axis])
            .collect();
        let told = |viewpoints: &[DVec3]| {
            let found = Triangulation::new(viewpoints, DVec3::ZERO);
            found.expect_err("these are degenerate").to_string()
        };
        assert!(told(&[]).starts_with("at least 4") && told(&[]).ends_with("not 0"));
        assert!(told(&octahedron[..3]).ends_with("not 3"));
        let with = |extra: DVec3| [octahedron.clone(), vec![extra]].concat();
        assert!(told(&with(DVec3::ZERO)).contains("viewpoint 6 at"));
        assert!(told(&with(DVec3::NAN)).contains("viewpoint 6 at"));
        assert!(told(&with(DVec3::INFINITY)).contains("viewpoint 6 at"));
        assert!(told(&with(DVec3::Y * 7.0)).contains("viewpoints 2 and 6"));
        assert!(Triangulation::new(&octahedron, DVec3::ZERO).is_ok());
    }

    /// A surface that winds around the centre twice is no tiling though each of its faces is as it should
    /// be and there are as many as there should be: a double pyramid whose ring closes after two turns.
    #[test]
    fn faces_over_each_other_are_refused() {
        let ring = (0..6).map(|i| {
            let (y, x) = (f64::from(i) * 2.0 * PI / 3.0).sin_cos();
            DVec3::new(x, y, 0.0)
        });
        let directions: Vec<DVec3> = ring.chain([DVec3::Z, -DVec3::Z]).collect();
        let corners = (0..6).flat_map(|i| [[6, i, (i + 1) % 6], [7, (i + 1) % 6, i]]);
        let corners: Vec<[u32; 3]> = corners.collect();
        assert_eq!(
            Triangulation::from_faces(&directions, &corners),
            Err(TriangulationError::NoTiling)
        );
    }

    #[test]
    fn what_is_no_tiling_is_named() {
        let once = even_directions(4);
        let faces = Triangulation::new(&once, DVec3::ZERO).unwrap();
        let corners: Vec<[u32; 3]> = faces.faces().iter().map(|face| face.corners).collect();
        let told = |directions: &[DVec3], corners: &[[u32; 3]]| {
            Triangulation::from_faces(directions, corners).unwrap_err()
        };
        let more = [once.clone(), vec![DVec3::X]].concat();
        assert_eq!(told(&more, &corners), TriangulationError::NoTiling);
        let doubled = [corners.clone(), corners.clone()].concat();
        assert_eq!(
            told(&once, &doubled),
            TriangulationError::NoFace { face: 4 }
        );
        assert_eq!(
            told(&once, &corners[..3]),
            TriangulationError::NoFace { face: 0 }
        );
        assert_eq!(
            told(&once[..3], &corners),
            TriangulationError::TooFew { count: 3 }
        );
        for wrong in [2.0, 0.0, f64::NAN, f64::INFINITY] {
            let mut directions = once.clone();
            directions[1] *= wrong;
            let message = told(&directions, &corners).to_string();
            assert!(
                message.starts_with("direction 1 has the length"),
                "{message}"
            );
        }
    }

    #[test]
    fn a_tetrahedron_has_the_fourth_corner_three_times() {
        let tetrahedron = [
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
        ];
        let moved = tetrahedron.map(|v| 3.0 * v + DVec3::splat(100.0));
        let faces = Triangulation::new(&moved, DVec3::splat(100.0)).unwrap();
        for face in 0..4 {
            let six = faces.six(face);
            assert_eq!(six.iter().sum::<u32>(), 6 + 2 * six[3]);
        }
    }
}
