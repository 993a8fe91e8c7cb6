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
/// The same mesh gives the same charts, by their first triangles. Takes about ten microseconds per
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
