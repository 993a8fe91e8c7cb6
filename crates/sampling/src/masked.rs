//! Where a masked triangle is there: where its alpha reaches the material's cutoff.

use crate::Textures;
use crate::geometry::Drawn;
use crate::textures::AlphaTexture;
use farfield_scene::Scene;
use glam::{DVec2, DVec3, I64Vec2};
use std::ops::Range;

/// The alpha of a triangle: that of its vertices, interpolated, times that of the texture.
///
/// Points are given by their barycentric coordinates, and what is linear in them by its values at
/// the triangle's corners.
#[derive(Clone, Debug)]
pub(crate) struct Masked<'a> {
    cutoff: f32,
    /// Alpha of the vertices times that of the material.
    vertex_alpha: DVec3,
    texture: AlphaTexture<'a>,
    /// Columns and rows of the texture's cells.
    at: [DVec3; 2],
}

impl<'a> Masked<'a> {
    /// `None` where the material has no cutoff.
    pub(crate) fn new(scene: &Scene, textures: &'a Textures<'_>, drawn: Drawn) -> Option<Self> {
        let material = scene.triangle_materials[drawn.triangle as usize];
        let material = &scene.materials[material as usize];
        let cutoff = material.alpha.cutoff()?;
        let vertices = scene
            .triangle_in(drawn.object, drawn.triangle)
            .map(|v| v as usize);
        let alpha = vertices.map(|v| f64::from(scene.colors[v].w));
        let vertex_alpha = DVec3::from(alpha) * f64::from(material.base_color.w);
        let texture = textures.alpha(material.base_color_texture);
        let at = vertices.map(|v| texture.cell_at(scene.uvs[v]));
        Some(Self {
            cutoff,
            vertex_alpha,
            texture,
            at: [at.map(|p| p.x).into(), at.map(|p| p.y).into()],
        })
    }

    /// A point, and where it lies on the texture.
    pub(crate) fn place(&self, weights: DVec3) -> Place {
        Place {
            weights,
            at: DVec2::new(self.at[0].dot(weights), self.at[1].dot(weights)),
        }
    }

    /// Whether the surface is there at a point.
    pub(crate) fn is_there(&self, place: Place) -> bool {
        self.is_enough(self.alpha_in(cell_of(place.at), place))
    }

    /// A point of a convex polygon where the surface is there, if there is one.
    ///
    /// Halves the polygon along borders of the texture's cells, and leaves out what lies in cells
    /// that are too transparent, until one cell is left. There the texture is bilinear: a saddle,
    /// whose greatest value on the polygon lies on its border, along whose edges it is a parabola.
    /// So the search is exact, but for rounding, where the vertices have the same alpha. Where
    /// they differ, a peak within the polygon's part of a cell can be missed.
    ///
    /// `polygon` is a run of `places`, which holds its parts during the search.
    pub(crate) fn some_point(
        &self,
        places: &mut Vec<Place>,
        polygon: Range<usize>,
    ) -> Option<DVec3> {
        self.search(places, polygon, [I64Vec2::MIN, I64Vec2::MAX])
    }

    /// Searches a polygon that lies in the cells from a first to a last column and row.
    fn search(
        &self,
        places: &mut Vec<Place>,
        polygon: Range<usize>,
        cells: [I64Vec2; 2],
    ) -> Option<DVec3> {
        if polygon.is_empty() {
            return None;
        }
        let part = &places[polygon.clone()];
        // What lies on a border, or by rounding beside it, is in the cells it is known to be in.
        let [first, last] = bounds(part).map(|at| cell_of(at).clamp(cells[0], cells[1]));
        if !self.reaches(self.texture.greatest([first, last])) {
            return None;
        }
        let middle = middle(part);
        if self.is_there(middle) {
            return Some(middle.weights);
        }
        if first == last {
            return self.point_in_cell(first, part);
        }
        let axis = usize::from(last.x - first.x < last.y - first.y);
        let border = first[axis] + (last[axis] - first[axis] + 1) / 2;
        let beyond = |place: &Place| place.at[axis] - border as f64;
        let (mut before_border, mut on_border) = (last, first);
        (before_border[axis], on_border[axis]) = (border - 1, border);
        let rest = places.len();

        let half = cut_to_side(places, polygon.clone(), |place| -beyond(place));
        let found = self.search(places, half, [first, before_border]);
        places.truncate(rest);
        if found.is_some() {
            return found;
        }
        let half = cut_to_side(places, polygon, beyond);
        let found = self.search(places, half, [on_border, last]);
        places.truncate(rest);
        found
    }

    /// The point of greatest alpha on the border of a polygon within one cell, if the surface is
    /// there.
    fn point_in_cell(&self, cell: I64Vec2, polygon: &[Place]) -> Option<DVec3> {
        let alpha = |place: Place| self.alpha_in(cell, place);
        let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
        let mut take = |place: Place| {
            let alpha = alpha(place);
            if alpha > best.0 {
                best = (alpha, place.weights);
            }
        };
        for (i, a) in polygon.iter().enumerate() {
            take(*a);
            let b = polygon[(i + 1) % polygon.len()];
            // f(t) = f(0) + slope t - curvature t^2, through three of its points.
            let values = [*a, a.lerp(&b, 0.5), b].map(alpha);
            let curvature = 4.0 * values[1] - 2.0 * (values[0] + values[2]);
            let slope = values[2] - values[0] + curvature;
            let peak = slope / (2.0 * curvature);
            if curvature > 0.0 && 0.0 < peak && peak < 1.0 {
                take(a.lerp(&b, peak));
            }
        }
        self.is_enough(best.0).then_some(best.1)
    }

    /// Whether the surface may be there between two corners of a rectangle on the texture, in
    /// columns and rows of cells.
    pub(crate) fn may_be_in(&self, rectangle: [DVec2; 2]) -> bool {
        let cells = rectangle.map(cell_of);
        self.reaches(self.texture.greatest(cells))
    }

    /// Whether alpha of the texture, of 255, can reach the cutoff.
    fn reaches(&self, texel: u8) -> bool {
        self.is_enough(self.vertex_alpha.max_element() * f64::from(texel) / 255.0)
    }

    /// Alpha at a point that lies in a cell.
    fn alpha_in(&self, cell: I64Vec2, place: Place) -> f64 {
        let t = place.at - cell.as_dvec2();
        let [[a, b], [c, d]] = self.texture.cell(cell);
        let (a, b, c, d) = (f64::from(a), f64::from(b), f64::from(c), f64::from(d));
        let (above, below) = (a + (b - a) * t.x, c + (d - c) * t.x);
        let texture = above + (below - above) * t.y;
        self.vertex_alpha.dot(place.weights) * texture / 255.0
    }

    /// Whether alpha reaches the cutoff, but for rounding to the precision in which it is given.
    fn is_enough(&self, alpha: f64) -> bool {
        alpha as f32 >= self.cutoff
    }
}

/// A point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Barycentric coordinates.
    pub(crate) weights: DVec3,
    /// On the texture, in columns and rows of cells.
    pub(crate) at: DVec2,
}

impl Place {
    fn lerp(&self, other: &Self, t: f64) -> Self {
        Self {
            weights: self.weights.lerp(other.weights, t),
            at: self.at.lerp(other.at, t),
        }
    }
}

/// The cell that a position lies in, which is rounded down.
fn cell_of(at: DVec2) -> I64Vec2 {
    // Conversion rounds towards zero, and is much faster than `floor` where that is a call.
    let down = |at: f64| at as i64 - i64::from(at < (at as i64) as f64);
    I64Vec2::new(down(at.x), down(at.y))
}

/// Bounds on the texture.
pub(crate) fn bounds(places: &[Place]) -> [DVec2; 2] {
    let nothing = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    places.iter().fold(nothing, |[min, max], place| {
        [min.min(place.at), max.max(place.at)]
    })
}

fn middle(places: &[Place]) -> Place {
    let count = places.len() as f64;
    Place {
        weights: places.iter().map(|place| place.weights).sum::<DVec3>() / count,
        at: places.iter().map(|place| place.at).sum::<DVec2>() / count,
    }
}

/// Appends the part of a convex polygon, a run of `places`, where `distance`, which is linear, is
/// not negative, and returns its run.
pub(crate) fn cut_to_side(
    places: &mut Vec<Place>,
    polygon: Range<usize>,
    distance: impl Fn(&Place) -> f64,
) -> Range<usize> {
    let start = places.len();
    if polygon.is_empty() {
        return start..start;
    }
    let first = (places[polygon.start], distance(&places[polygon.start]));
    let (mut a, mut from_a) = first;
    for i in polygon.clone() {
        let (b, from_b) = if i + 1 == polygon.end {
            first
        } else {
            (places[i + 1], distance(&places[i + 1]))
        };
        if from_a >= 0.0 {
            places.push(a);
        }
        if from_a * from_b < 0.0 {
            places.push(a.lerp(&b, from_a / (from_a - from_b)));
        }
        (a, from_a) = (b, from_b);
    }
    start..places.len()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::geometry::tests::soup;
    use farfield_scene::{AlphaMode, Filter, Image, Texture, Wrap};
    use glam::{Vec2, Vec4};
    use proptest::prelude::*;

    const CUTOFF: f32 = 0.5;

    /// A double-sided triangle with a small masked texture of few, abrupt alphas.
    pub(crate) fn leaves(points: [[f32; 3]; 3]) -> impl Strategy<Value = Scene> {
        let uv = prop_oneof![3 => -1.5..2.5f32, 1 => (-6..10).prop_map(|i| i as f32 / 4.0)];
        let uvs = prop::array::uniform3([uv.clone(), uv].prop_map(Vec2::from));
        let wrap =
            prop::sample::select(vec![Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge]);
        let filter = prop::sample::select(vec![Filter::Nearest, Filter::Linear]);
        let alpha = prop::sample::select(vec![0, 0, 90, 127, 128, 150, 255]);
        let image = (1..7u32, 1..7u32).prop_flat_map(move |(width, height)| {
            let texels = prop::collection::vec(alpha.clone(), (width * height) as usize);
            texels.prop_map(move |alpha| Image {
                name: String::new(),
                width,
                height,
                texels: alpha.into_iter().map(|a| [0, 0, 0, a]).collect(),
            })
        });
        let color = (0.6..=1.0f32).prop_map(|a| Vec4::ONE.with_w(a));
        let colors = prop_oneof![
            3 => color.clone().prop_map(|c| [c; 3]),
            1 => prop::array::uniform3(color),
        ];
        (uvs, [wrap.clone(), wrap], filter, image, colors).prop_map(
            move |(uvs, wrap, filter, image, colors)| {
                let mut scene = soup(&points);
                (scene.uvs, scene.colors) = (uvs.into(), colors.into());
                scene.images = vec![image];
                scene.textures = vec![Texture {
                    image: 0,
                    wrap,
                    filter,
                }];
                let material = &mut scene.materials[0];
                material.double_sided = true;
                material.alpha = AlphaMode::Mask { cutoff: CUTOFF };
                material.base_color_texture = Some(0);
                scene
            },
        )
    }

    /// How far alpha is above the cutoff, straight from the definition.
    pub(crate) fn margin(scene: &Scene, weights: DVec3) -> f64 {
        let (texture, image) = (&scene.textures[0], &scene.images[0]);
        let weights = weights.to_array();
        let mix = |value: &dyn Fn(usize) -> f64| (0..3).map(|i| value(i) * weights[i]).sum::<f64>();
        let texel = |at: [f64; 2]| {
            let size = [f64::from(image.width), f64::from(image.height)];
            let [x, y] = [0, 1].map(|axis| match texture.wrap[axis] {
                Wrap::Repeat => at[axis].rem_euclid(size[axis]),
                Wrap::ClampToEdge => at[axis].clamp(0.0, size[axis] - 1.0),
                Wrap::MirroredRepeat => {
                    let from_turn = at[axis].rem_euclid(2.0 * size[axis]) - size[axis] + 0.5;
                    size[axis] - 0.5 - from_turn.abs()
                }
            });
            f64::from(image.texels[(y * size[0] + x) as usize][3]) / 255.0
        };
        let x = mix(&|i| f64::from(scene.uvs[i].x)) * f64::from(image.width);
        let y = mix(&|i| f64::from(scene.uvs[i].y)) * f64::from(image.height);
        let sampled = match texture.filter {
            Filter::Nearest => texel([x.floor(), y.floor()]),
            _ => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (left, top) = (x.floor(), y.floor());
                let four = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
                let share =
                    |(i, j): (f64, f64)| (1.0 - (x - left - i).abs()) * (1.0 - (y - top - j).abs());
                four.map(|corner| share(corner) * texel([left + corner.0, top + corner.1]))
                    .iter()
                    .sum()
            }
        };
        mix(&|i| f64::from(scene.colors[i].w)) * sampled - f64::from(CUTOFF)
    }

    /// Rounding: of alpha to f32, and of positions of up to 20 texels in f64.
    const DOUBT: f64 = 1e-6;

    fn triangle() -> impl Strategy<Value = Scene> {
        leaves([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        /// Where a dense lattice on a polygon finds a point that is there, so does the search, and
        /// what the search finds is there and in the polygon.
        #[test]
        fn finds_a_point_exactly_where_there_is_one(
            scene in triangle(),
            sides in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 0..4),
        ) {
            let textures = Textures::new(&scene);
            let masked = Masked::new(&scene, &textures, Drawn { object: 0, triangle: 0 }).unwrap();
            let mut points = DVec3::AXES.map(|weights| masked.place(weights)).to_vec();
            let polygon = sides.iter().fold(0..3, |rest, side| {
                cut_to_side(&mut points, rest, |place| DVec3::from(*side).dot(place.weights))
            });
            let polygon = points[polygon].to_vec();
            let mut scratch = polygon.clone();
            let found = masked.some_point(&mut scratch, 0..polygon.len());
            prop_assert_eq!(&scratch, &polygon);

            if let Some(point) = found {
                let inside = |side: DVec3| side.dot(point) > -1e-9;
                prop_assert!(DVec3::AXES.into_iter().all(inside));
                prop_assert!(sides.iter().all(|side| inside(DVec3::from(*side))));
                match scene.textures[0].filter {
                    // On the border of two texels, but for rounding, either is the nearest.
                    Filter::Nearest => {
                        let at = masked.place(point).at;
                        let around = [-DOUBT, DOUBT].map(|d| (at + d).floor().as_i64vec2());
                        prop_assert!(masked.reaches(masked.texture.greatest(around)));
                    }
                    _ => prop_assert!(margin(&scene, point) > -DOUBT),
                }
            } else if scene.colors.iter().all(|color| *color == scene.colors[0]) {
                for i in 1..polygon.len().saturating_sub(1) {
                    let [a, b, c] = [0, i, i + 1].map(|i| polygon[i].weights);
                    for (s, t) in (0..=64).flat_map(|s| (0..=64 - s).map(move |t| (s, t))) {
                        let point = a + (b - a) * (f64::from(s) / 64.0) + (c - a) * (f64::from(t) / 64.0);
                        prop_assert!(margin(&scene, point) < DOUBT, "{point} is there");
                    }
                }
            }
        }

        /// A point is there if alpha, straight from its definition, reaches the cutoff.
        #[test]
        fn is_there_where_alpha_reaches_the_cutoff(scene in triangle(), s in 0.0..1.0f64, t in 0.0..1.0f64) {
            let textures = Textures::new(&scene);
            let masked = Masked::new(&scene, &textures, Drawn { object: 0, triangle: 0 }).unwrap();
            let weights = DVec3::new(1.0 - s, s * (1.0 - t), s * t);
            let margin = margin(&scene, weights);
            prop_assume!(margin.abs() > DOUBT);
            prop_assert_eq!(masked.is_there(masked.place(weights)), margin > 0.0);
        }
    }

    #[test]
    fn a_texture_far_away_from_its_first_tile_is_searched_in_finite_time() {
        let mut scene = soup(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        scene.uvs = vec![Vec2::MAX, Vec2::MIN, Vec2::new(f32::MAX, f32::MIN)];
        scene.materials[0].alpha = AlphaMode::Mask { cutoff: CUTOFF };
        scene.materials[0].base_color_texture = Some(0);
        scene.textures = vec![Texture {
            image: 0,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
        }];
        for (alpha, found) in [([255, 0], true), ([127, 0], false)] {
            scene.images = vec![Image {
                name: String::new(),
                width: 2,
                height: 1,
                texels: alpha.map(|a| [0, 0, 0, a]).to_vec(),
            }];
            let textures = Textures::new(&scene);
            let drawn = Drawn {
                object: 0,
                triangle: 0,
            };
            let masked = Masked::new(&scene, &textures, drawn).unwrap();
            let mut points = DVec3::AXES.map(|weights| masked.place(weights)).to_vec();
            assert_eq!(masked.some_point(&mut points, 0..3).is_some(), found);
        }
    }
}
