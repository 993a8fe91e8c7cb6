//! Which texels the quads of a file show: the way back from a display scene to its patches.

use crate::paint::{GUTTER, Patch};
use crate::quads::OVERLAP;
use farfield_grid::Rect;
use farfield_scene::Scene;
use farfield_views::{Camera, Extent};
use glam::{BVec2, DVec2, DVec3};

/// A quad that does not show a rectangle of a layer as it was recorded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("quad {quad}: {damage}")]
pub struct QuadError {
    /// Index of the quad, in the order of objects and, in each, of pairs of triangles.
    pub quad: usize,
    /// What is wrong with it.
    pub damage: Damage,
}

/// What is wrong with a quad, and by how much.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Damage {
    /// An object has an odd number of triangles.
    #[error("its second triangle is missing")]
    Half,
    /// Its triangles have different materials, or one that shows no image.
    #[error("its two triangles do not show one page")]
    NotOnePage,
    /// Coordinates are too large for their type.
    #[error(
        "its coordinates are only known to within {texels} texels, at most {COARSEST} will do: \
         its vertices are too far from the origin of their object or from the camera"
    )]
    Coarse {
        /// To how many texels positions or texture coordinates are rounded.
        texels: f64,
    },
    /// It is not parallel to the layers.
    #[error("its corners differ in depth by {metres} m: it is tilted against the layers")]
    Tilted {
        /// Between the nearest and the farthest corner.
        metres: f64,
    },
    /// It is not on a layer.
    #[error(
        "it lies at the depth of {depth} m, where no layer is: the nearest, layer {layer}, is at \
         {expected} m, {:.4} % or {:.6} m off", 100.0 * (expected / depth - 1.0), expected - depth
    )]
    NoLayer {
        /// Its depth, in metres from the reference viewpoint.
        depth: f64,
        /// Index of the nearest layer.
        layer: usize,
        /// That layer's depth.
        expected: f64,
    },
    /// A corner is not where a rectangle has one.
    #[error("a corner is {texels} texels off the rectangle that bounds it: it is torn or turned")]
    Torn {
        /// Of its layer, along the axis that is worse.
        texels: f64,
    },
    /// Its triangles overlap, or leave a part of the rectangle open.
    #[error("its two triangles are not the two halves of a rectangle")]
    NotHalves,
    /// It faces away from the camera.
    #[error("its vertices run clockwise: it faces away from the view cell")]
    Flipped,
    /// Page and layer do not run side by side.
    #[error(
        "its texels are turned, mirrored, scaled or sheared: one texel to the right in the layer \
         is {right} on the page, one down is {down}, a corner is {texels} texels off"
    )]
    Distorted {
        /// On the page, per texel to the right in the layer: should be (1, 0).
        right: DVec2,
        /// On the page, per texel down in the layer: should be (0, 1).
        down: DVec2,
        /// How far the texel that a corner shows is from the one that it should show.
        texels: f64,
    },
    /// The page's texels are not on the layer's.
    #[error(
        "its texels lie {} to the right of and {} below the layer's grid, in texels", by.x, by.y
    )]
    Beside {
        /// To the right and down, in texels, from -1/2 to 1/2: whole texels cannot be told from
        /// another rectangle.
        by: DVec2,
    },
    /// Its border is not half a texel around whole texels.
    #[error(
        "it reaches {:.4} texels to the left, {:.4} above, {:.4} to the right and {:.4} below \
         over whole texels, where each must be {OVERLAP}", over[0], over[1], over[2], over[3]
    )]
    Overlap {
        /// In texels, from 0 to 1: to the left, above, to the right, below.
        over: [f64; 4],
    },
    /// It does not hold a texel.
    #[error("it holds {columns} x {rows} texels besides its border")]
    Empty {
        /// Texels in a row.
        columns: i64,
        /// Rows.
        rows: i64,
    },
    /// It shows what is not in the layer.
    #[error(
        "it shows columns {} to {} and rows {} to {} of a layer of {width} x {height} texels",
        min[0], max[0], min[1], max[1]
    )]
    OutsideLayer {
        /// First column and row.
        min: [i64; 2],
        /// Last column and row.
        max: [i64; 2],
        /// Columns of the layer.
        width: u32,
        /// Rows of the layer.
        height: u32,
    },
    /// It, or its gutter, shows what is not on the page.
    #[error(
        "with its gutter it takes columns {} to {} and rows {} to {} of page {page} of {width} x \
         {height} texels", min[0], max[0], min[1], max[1]
    )]
    OutsidePage {
        /// Index of the page.
        page: u32,
        /// First column and row.
        min: [i64; 2],
        /// Last column and row.
        max: [i64; 2],
        /// Columns of the page.
        width: u32,
        /// Rows of the page.
        height: u32,
    },
}

/// The most texels that coordinates may be off: differences of two of them must stay below half a
/// texel, or whole texels could be mistaken.
const COARSEST: f64 = 0.25;

/// The patches that a display scene's quads show, the inverse of [`quad_scene`](crate::quad_scene):
/// what is read from a file is compared with what was meant.
///
/// A quad is two triangles of an object that follow each other; all objects are read. Each must
/// lie on a layer, face the camera and show, texel by texel, a rectangle of whole texels of its
/// layer and half a texel around it. Which rectangle, of which layer, and where on which page,
/// follows from its corners and texture coordinates alone. What the page shows there, whether it
/// is the right rectangle and whether it is drawn as a mask are other questions.
///
/// How much may be off is what coordinates are rounded to. A vertex is an f32 relative to its
/// object's origin, so each coordinate p is within 2^-24 |p|. A reader may since have moved the
/// origin to the vertices, so |p| counts as at least the diagonal of all that the layers can show:
/// the origin that coordinates were once rounded against must lie among the quads. Layers must be farther apart than that.
/// Texture coordinates are within 2^-24 of themselves, on a page of 4096 texels 1/4096 texel.
///
/// * `scene` - one for which [`Scene::check`] finds nothing wrong
/// * `camera` - at the reference viewpoint; its pixels are the texels of the layers
/// * `depths` - per layer, ascending, in metres from the reference viewpoint
///
/// Returns the patches in the order of the quads; a patch's page is an index into the scene's
/// images. Takes time and memory in proportion to the triangles.
///
/// # Errors
///
/// The first quad that is damaged, and how.
///
/// # Panics
///
/// When there are no layers, or an index of the scene refers to nothing.
pub fn patches_of(scene: &Scene, camera: &Camera, depths: &[f64]) -> Result<Vec<Patch>, QuadError> {
    assert!(!depths.is_empty(), "there are no layers to show");
    let mut patches = Vec::new();
    for object in 0..scene.objects.len() as u32 {
        let mut triangles = scene.mesh_of(object).triangles.clone();
        while let Some(first) = triangles.next() {
            let second = triangles.next().ok_or(Damage::Half);
            let patch = second.and_then(|second| {
                let page = page_of(scene, [first, second])?;
                let image = &scene.images[page as usize];
                let quad = Quad::of(scene, camera, depths, object, [first, second], page)?;
                quad.patch(camera, page, [image.width, image.height])
            });
            let quad = patches.len();
            patches.push(patch.map_err(|damage| QuadError { quad, damage })?);
        }
    }
    Ok(patches)
}

/// The image that both triangles show.
fn page_of(scene: &Scene, triangles: [u32; 2]) -> Result<u32, Damage> {
    let [first, second] = triangles.map(|t| scene.triangle_materials[t as usize]);
    let texture = scene.materials[first as usize].base_color_texture;
    match texture {
        Some(texture) if first == second => Ok(scene.textures[texture as usize].image),
        _ => Err(Damage::NotOnePage),
    }
}

/// A vertex of a quad.
#[derive(Clone, Copy)]
struct Vertex {
    /// In the layer, in texels.
    in_layer: DVec2,
    /// On the page, in texels.
    in_page: DVec2,
}

/// A quad on a layer.
struct Quad {
    layer: u32,
    /// Of its two triangles.
    vertices: [[Vertex; 3]; 2],
    /// How far off a vertex may be in its layer, in texels.
    layer_slack: DVec2,
    /// How far off a vertex may be on its page, in texels.
    page_slack: f64,
}

impl Quad {
    /// Finds the layer of two triangles, and with it their place in it.
    fn of(
        scene: &Scene,
        camera: &Camera,
        depths: &[f64],
        object: u32,
        triangles: [u32; 2],
        page: u32,
    ) -> Result<Self, Damage> {
        let indices = triangles.map(|t| scene.triangle_in(object, t));
        let points =
            indices.map(|t| t.map(|v| camera.pose.point_in_view(scene.world_position(object, v))));
        let slack = indices
            .as_flattened()
            .iter()
            .map(|v| position_slack(scene, camera, depths, object, *v))
            .fold(0.0, f64::max);
        let all = points.as_flattened().iter().map(|p| p.z);
        let near = all.clone().fold(f64::INFINITY, f64::min);
        let far = all.fold(f64::NEG_INFINITY, f64::max);
        let depth = (near + far) / 2.0;
        let layer = nearest(depths, depth);
        let expected = depths[layer];

        // A slope is off by a part of the depth's error besides its own.
        let slopes = points.as_flattened().iter().map(|p| p.truncate() / p.z);
        let steepest = slopes.map(DVec2::length).fold(0.0, f64::max);
        // Adding the extent's border and dividing rounds twice more.
        let border = camera.extent.min.length() + camera.extent.max.length();
        let slope_slack =
            slack * (1.0 + steepest) / depth.abs() + 4.0 * f64::EPSILON * (steepest + border);
        let layer_slack = slope_slack / camera.pixel_size();
        let image = &scene.images[page as usize];
        let size = DVec2::new(f64::from(image.width), f64::from(image.height));
        let in_page = |v: u32| scene.uvs[v as usize].as_dvec2() * size;
        let page_slack = indices
            .as_flattened()
            .iter()
            .map(|v| HALF_STEP * in_page(*v).abs().max_element())
            .fold(0.0, f64::max);

        if far - near > 2.0 * slack {
            return Err(Damage::Tilted { metres: far - near });
        }
        if (depth - expected).abs() > slack {
            return Err(Damage::NoLayer {
                depth,
                layer,
                expected,
            });
        }
        let texels = layer_slack.max_element() + page_slack;
        // What is not a number is caught here as well.
        let is_known = texels <= COARSEST;
        if !is_known {
            return Err(Damage::Coarse { texels });
        }
        let vertex = |triangle: usize, corner: usize| Vertex {
            in_layer: camera.pixel_from_view(points[triangle][corner]),
            in_page: in_page(indices[triangle][corner]),
        };
        Ok(Self {
            layer: layer as u32,
            vertices: [0, 1].map(|t| [0, 1, 2].map(|c| vertex(t, c))),
            layer_slack,
            page_slack,
        })
    }

    /// The patch that the quad shows, if nothing is wrong with it.
    fn patch(&self, camera: &Camera, page: u32, page_size: [u32; 2]) -> Result<Patch, Damage> {
        let (min, max) = self.bounds();
        self.check_halves(min, max)?;
        let to_page = self.shift_to_page(min, max)?;

        // The whole texels inside, also where there is no border but a rounding error.
        let first = (min - self.layer_slack).ceil();
        let end = (max + self.layer_slack).floor();
        let (before, behind) = (first - min, max - end);
        let off = (before - OVERLAP).abs().max((behind - OVERLAP).abs());
        if !off.cmple(self.layer_slack).all() {
            return Err(Damage::Overlap {
                over: [before.x, before.y, behind.x, behind.y],
            });
        }
        let (first, end) = (whole(first), whole(end));
        let size = [end[0] - first[0], end[1] - first[1]];
        if size[0] < 1 || size[1] < 1 {
            return Err(Damage::Empty {
                columns: size[0],
                rows: size[1],
            });
        }
        let inside = |min: [i64; 2], end: [i64; 2], [width, height]: [u32; 2]| {
            min[0] >= 0 && min[1] >= 0 && end[0] <= width.into() && end[1] <= height.into()
        };
        let (width, height) = (camera.width, camera.height);
        if !inside(first, end, [width, height]) {
            return Err(Damage::OutsideLayer {
                min: first,
                max: end.map(|i| i - 1),
                width,
                height,
            });
        }
        let gutter = i64::from(GUTTER);
        let shift = whole(to_page);
        let at = [0, 1].map(|axis| first[axis] + shift[axis] - gutter);
        let at_end = [0, 1].map(|axis| end[axis] + shift[axis] + gutter);
        let [width, height] = page_size;
        if !inside(at, at_end, page_size) {
            return Err(Damage::OutsidePage {
                page,
                min: at,
                max: at_end.map(|i| i - 1),
                width,
                height,
            });
        }
        // None is negative or beyond a layer or a page.
        Ok(Patch {
            layer: self.layer,
            rect: Rect {
                x: first[0] as u32,
                y: first[1] as u32,
                width: size[0] as u32,
                height: size[1] as u32,
            },
            page,
            x: at[0] as u32,
            y: at[1] as u32,
        })
    }

    /// Least and greatest coordinates in the layer.
    fn bounds(&self) -> (DVec2, DVec2) {
        let places = self.vertices.as_flattened().iter().map(|v| v.in_layer);
        places.fold(
            (DVec2::INFINITY, DVec2::NEG_INFINITY),
            |(min, max), place| (min.min(place), max.max(place)),
        )
    }

    /// Whether the triangles halve the rectangle between `min` and `max` and face the camera.
    fn check_halves(&self, min: DVec2, max: DVec2) -> Result<(), Damage> {
        // Two vertices at the same corner are each off a little.
        let slack = 2.0 * self.layer_slack;
        let mut missing = [0; 2];
        for (triangle, missing) in self.vertices.iter().zip(&mut missing) {
            let mut corners = 0u32;
            for vertex in triangle {
                let (from_min, to_max) = (vertex.in_layer - min, max - vertex.in_layer);
                let off = from_min.min(to_max);
                if !off.cmple(slack).all() {
                    return Err(Damage::Torn {
                        texels: off.max_element(),
                    });
                }
                let BVec2 { x, y } = from_min.cmpgt(slack);
                let corner = u32::from(x) + 2 * u32::from(y);
                corners |= 1 << corner;
                // The exclusive or of all four numbers is 0.
                *missing ^= corner;
            }
            if corners.count_ones() != 3 {
                return Err(Damage::NotHalves);
            }
        }
        // Opposite corners differ in both bits.
        if missing[0] ^ missing[1] != 3 {
            return Err(Damage::NotHalves);
        }
        let clockwise = |[a, b, c]: &[Vertex; 3]| {
            // Rows run down.
            (b.in_layer - a.in_layer).perp_dot(c.in_layer - a.in_layer) > 0.0
        };
        match self.vertices.iter().any(clockwise) {
            true => Err(Damage::Flipped),
            false => Ok(()),
        }
    }

    /// From a place in the layer to the one on the page, in whole texels.
    fn shift_to_page(&self, min: DVec2, max: DVec2) -> Result<DVec2, Damage> {
        let vertices = self.vertices.as_flattened();
        let shift = |v: &Vertex| v.in_page - v.in_layer;
        let mean = vertices.iter().map(shift).sum::<DVec2>() / 6.0;
        let slack = self.layer_slack + self.page_slack;
        // The mean is off as well.
        let worst = vertices.iter().map(|v| (shift(v) - mean).abs());
        let worst = worst.fold(DVec2::ZERO, DVec2::max);
        if !worst.cmple(2.0 * slack).all() {
            // By corner: bit 0 tells the side in x, bit 1 in y.
            let center = (min + max) / 2.0;
            let mut at = [DVec2::ZERO; 4];
            for v in vertices {
                let BVec2 { x, y } = v.in_layer.cmpgt(center);
                at[usize::from(x) + 2 * usize::from(y)] = v.in_page;
            }
            let size = 2.0 * (max - min);
            return Err(Damage::Distorted {
                right: (at[1] - at[0] + at[3] - at[2]) / size.x,
                down: (at[2] - at[0] + at[3] - at[1]) / size.y,
                texels: worst.max_element(),
            });
        }
        let by = mean.round() - mean;
        match by.abs().cmple(slack).all() {
            true => Ok(mean.round()),
            // What is shown lies where it is in the layer less the shift.
            false => Err(Damage::Beside { by }),
        }
    }
}

/// Half the distance between two f32 near 1.
const HALF_STEP: f64 = f32::EPSILON as f64 / 2.0;

/// How far a vertex may be from where it was meant, in metres.
fn position_slack(scene: &Scene, camera: &Camera, depths: &[f64], object: u32, vertex: u32) -> f64 {
    let world_from_mesh = scene.objects[object as usize].world_from_mesh;
    let in_mesh = scene.positions[vertex as usize].as_dvec3();
    let linear = world_from_mesh.matrix3;
    let rounded = DVec3::new(
        linear.x_axis.length() * in_mesh.x,
        linear.y_axis.length() * in_mesh.y,
        linear.z_axis.length() * in_mesh.z,
    );
    // What the layers can show is no larger than the last one and the longest way to it.
    let [near, far] = [depths[0], depths[depths.len() - 1]];
    let Extent { min, max } = camera.extent;
    let steepest = min.abs().max(max.abs()).extend(1.0).length();
    let diagonal = far * (max - min).length() + (far - near) * steepest;
    // To view space and back through the world, a dozen roundings of numbers no larger than these.
    let world = world_from_mesh.translation.length() + camera.pose.eye.length() + far;
    HALF_STEP * rounded.length().max(diagonal) + 12.0 * f64::EPSILON * world
}

/// Index of the depth nearest to another.
fn nearest(depths: &[f64], depth: f64) -> usize {
    let behind = depths.partition_point(|d| *d < depth);
    let off = |i: usize| (depths[i] - depth).abs();
    match behind {
        0 => 0,
        _ if behind == depths.len() || off(behind - 1) < off(behind) => behind - 1,
        _ => behind,
    }
}

fn whole(at: DVec2) -> [i64; 2] {
    [at.x.round() as i64, at.y.round() as i64]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{blank_page, quad_scene};
    use farfield_scene::{Mesh, Object};
    use farfield_views::Pose;
    use glam::{DAffine3, Vec2, Vec3};
    use proptest::prelude::*;
    use proptest::sample::{Index, select};

    const PAGES: [[u32; 2]; 3] = [[4096, 72], [128, 128], [72, 4096]];

    /// What quads are made of.
    #[derive(Clone, Debug)]
    struct Setup {
        camera: Camera,
        depths: Vec<f64>,
        origin: DVec3,
        patches: Vec<Patch>,
    }

    impl Setup {
        fn scene(&self) -> Scene {
            let Self {
                camera,
                depths,
                origin,
                patches,
            } = self;
            quad_scene(
                "quads",
                camera,
                depths,
                *origin,
                patches,
                &PAGES.map(blank_page),
            )
        }

        /// A texel's side at the depth of a patch, in metres, to the right and down.
        fn texel(&self, quad: usize) -> [DVec3; 2] {
            let pose = &self.camera.pose;
            let size = self.camera.pixel_size() * self.depths[self.patches[quad].layer as usize];
            [pose.right * size.x, pose.down * size.y]
        }
    }

    /// Stacks in views that are turned, off the axis and far from the world's origin; quads of
    /// all sizes anywhere on large pages.
    fn setups() -> impl Strategy<Value = Setup> {
        let poses = (
            prop::array::uniform3(-1e5..1e5f64),
            prop::array::uniform3(-1.0..1.0f64),
        )
            .prop_filter("a direction", |(_, axis)| DVec3::from(*axis).length() > 0.1);
        let extents = (
            prop::array::uniform2(-1.0..0.5f64),
            prop::array::uniform2(0.1..1.0f64),
        );
        let steps = prop::collection::vec(1.001..1.2f64, 1..10);
        let layer = any::<Index>();
        let patch = (
            layer,
            0..600u32,
            0..400u32,
            1..60u32,
            1..60u32,
            0..3usize,
            any::<(Index, Index)>(),
        );
        let patches = prop::collection::vec(patch, 1..20);
        (poses, extents, 50.0..500.0f64, steps, 0.0..1.0f64, patches).prop_map(
            |((eye, axis), (min, size), start, steps, share, patches)| {
                let min = DVec2::from(min);
                let camera = Camera {
                    pose: Pose::looking_along(eye.into(), axis.into()),
                    extent: Extent {
                        min,
                        max: min + DVec2::from(size),
                    },
                    width: 600,
                    height: 400,
                };
                let depths: Vec<f64> = steps
                    .iter()
                    .scan(start, |depth, step| {
                        *depth *= step;
                        Some(*depth)
                    })
                    .collect();
                let mut patches: Vec<Patch> = patches
                    .into_iter()
                    .map(|(layer, x, y, w, h, page, at)| {
                        let rect = Rect {
                            x,
                            y,
                            width: w.min(600 - x),
                            height: h.min(400 - y),
                        };
                        let [width, height] = PAGES[page];
                        Patch {
                            layer: layer.index(depths.len()) as u32,
                            rect,
                            page: page as u32,
                            x: at.0.index((width - rect.width - 1) as usize) as u32,
                            y: at.1.index((height - rect.height - 1) as usize) as u32,
                        }
                    })
                    .collect();
                patches.sort_by_key(|patch| patch.page);
                let depth = depths[0] + (depths[depths.len() - 1] - depths[0]) * share;
                let center = camera.view_from_pixel(DVec2::new(300.0, 200.0), depth);
                let origin = camera.pose.point_in_world(center);
                Setup {
                    camera,
                    depths,
                    origin,
                    patches,
                }
            },
        )
    }

    /// The same quads in another order, spread over objects whose origins are moved to the
    /// vertices where that rounds nothing, with triangles and vertices in another order too.
    fn scrambled(scene: &Scene, order: &[usize], objects: usize) -> Scene {
        let origin = scene.objects[0].world_from_mesh.translation;
        let mut result = Scene {
            objects: Vec::new(),
            meshes: Vec::new(),
            ..scene.clone()
        };
        (result.triangles, result.triangle_materials) = Default::default();
        (result.positions, result.uvs) = Default::default();
        for quads in order.chunks(order.len().div_ceil(objects)) {
            let vertices = result.positions.len() as u32;
            let triangles = result.triangles.len() as u32;
            for quad in quads {
                let first = result.positions.len() as u32;
                result.positions.extend(&scene.positions[4 * quad..][..4]);
                result.uvs.extend(&scene.uvs[4 * quad..][..4]);
                let at = |v: u32| v - 4 * *quad as u32 + first;
                let [[a, b, c], [d, e, f]] = [0, 1].map(|t| scene.triangles[2 * quad + t].map(at));
                result.triangles.extend([[f, d, e], [b, c, a]]);
                result
                    .triangle_materials
                    .extend([scene.triangle_materials[2 * quad]; 2]);
            }
            let positions = &mut result.positions[vertices as usize..];
            let mut centre = Vec3::ZERO;
            for axis in 0..3 {
                // The difference of numbers within a factor of two is exact.
                let near = positions[0][axis];
                if positions
                    .iter()
                    .all(|p| (0.5..=2.0).contains(&(p[axis] / near)))
                {
                    centre[axis] = near;
                }
            }
            positions.iter_mut().for_each(|p| *p -= centre);
            result.meshes.push(Mesh {
                vertices: vertices..result.positions.len() as u32,
                triangles: triangles..result.triangles.len() as u32,
            });
            result.objects.push(Object {
                name: String::new(),
                mesh: result.meshes.len() as u32 - 1,
                world_from_mesh: DAffine3::from_translation(origin + centre.as_dvec3()),
            });
        }
        result
    }

    /// Moves a quad's vertices, the corners being upper left, lower left, lower right, upper
    /// right, by texels of its layer to the right and down.
    fn move_corners(scene: &mut Scene, setup: &Setup, quad: usize, by: [[f64; 2]; 4]) {
        let [right, down] = setup.texel(quad);
        for (corner, [x, y]) in by.into_iter().enumerate() {
            scene.positions[4 * quad + corner] += (right * x + down * y).as_vec3();
        }
    }

    /// Moves what a quad's corners show by texels of its page.
    fn move_texels(scene: &mut Scene, setup: &Setup, quad: usize, by: [[f64; 2]; 4]) {
        let [width, height] = PAGES[setup.patches[quad].page as usize].map(f64::from);
        for (corner, [x, y]) in by.into_iter().enumerate() {
            let uv = &mut scene.uvs[4 * quad + corner];
            *uv = (uv.as_dvec2() + DVec2::new(x / width, y / height)).as_vec2();
        }
    }

    /// A quad's corners reach farther on every side.
    fn outwards([x, y]: [f64; 2]) -> [[f64; 2]; 4] {
        [[-x, -y], [-x, y], [x, y], [x, -y]]
    }

    proptest! {
        /// What is read back from the quads are the patches that they were made for, in whatever
        /// order and from whatever origin.
        #[test]
        fn quads_are_read_back_as_their_patches(
            setup in setups(),
            shuffled in Just((0..20usize).collect::<Vec<_>>()).prop_shuffle(),
            objects in 1..5usize,
        ) {
            let Setup { camera, depths, patches, .. } = &setup;
            let scene = setup.scene();
            prop_assert_eq!(patches_of(&scene, camera, depths), Ok(patches.clone()));

            let order: Vec<usize> = shuffled.into_iter().filter(|i| *i < patches.len()).collect();
            let scene = scrambled(&scene, &order, objects);
            let expected: Vec<Patch> = order.iter().map(|i| patches[*i]).collect();
            prop_assert_eq!(patches_of(&scene, camera, depths), Ok(expected));
        }

        /// A quad that is moved in depth, by at least 1/10,000, is not on a layer, or on one
        /// where its texels have another size; the message tells how far off it is.
        #[test]
        fn a_quad_between_layers_is_found(
            setup in setups(), quad in any::<Index>(), by in 1e-4..0.3f64, sign in select(vec![-1.0, 1.0]),
        ) {
            let quad = quad.index(setup.patches.len());
            let expected = setup.depths[setup.patches[quad].layer as usize];
            let moved = expected * (1.0 + sign * by);
            let mut scene = setup.scene();
            for corner in 0..4 {
                let by = setup.camera.pose.forward * (moved - expected);
                scene.positions[4 * quad + corner] += by.as_vec3();
            }
            let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
            prop_assert_eq!(error.quad, quad);
            match error.damage {
                Damage::NoLayer { depth, layer, expected } => {
                    // Rounded to f32, at distances of up to 4 times the farthest depth.
                    prop_assert!((depth - moved).abs() < 1e-3);
                    prop_assert_eq!(expected, setup.depths[layer]);
                    let off = |d: &f64| (d - depth).abs();
                    prop_assert!(setup.depths.iter().all(|d| off(d) >= off(&expected)));
                }
                damage => {
                    let off = setup.depths.iter().map(|d| (d - moved).abs());
                    prop_assert!(off.fold(f64::INFINITY, f64::min) < 1e-3, "{damage}");
                }
            }
        }

        /// A quad that lies beside the grid, in its layer or on its page, is found, and by how
        /// many texels.
        #[test]
        fn a_quad_beside_the_grid_is_found(
            setup in setups(), quad in any::<Index>(), on_page in any::<bool>(),
            by in prop::array::uniform2(-0.49..0.49f64),
        ) {
            prop_assume!(by[0].abs().max(by[1].abs()) > 0.02);
            let quad = quad.index(setup.patches.len());
            let mut scene = setup.scene();
            // On the page the other way, so that the texels come to lie as if the quad had moved.
            match on_page {
                true => move_texels(&mut scene, &setup, quad, [by.map(|b| -b); 4]),
                false => move_corners(&mut scene, &setup, quad, [by; 4]),
            }
            let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
            prop_assert_eq!(error.quad, quad);
            let Damage::Beside { by: found } = error.damage else {
                return Err(TestCaseError::fail(error.to_string()));
            };
            // The slack of the documentation is at most 2^-24 * 1e4 texels here.
            prop_assert!(found.abs_diff_eq(by.into(), 2e-3), "{found} is not {by:?}");
        }

        /// A quad that does not reach half a texel over its rectangle, as one without any
        /// overlap, is found, and how far it reaches.
        #[test]
        fn a_quad_without_overlap_is_found(
            setup in setups(), quad in any::<Index>(),
            lacking in prop_oneof![Just(0.5), 0.02..0.48f64, -0.48..-0.02f64],
        ) {
            let quad = quad.index(setup.patches.len());
            let mut scene = setup.scene();
            move_corners(&mut scene, &setup, quad, outwards([-lacking; 2]));
            move_texels(&mut scene, &setup, quad, outwards([-lacking; 2]));
            let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
            prop_assert_eq!(error.quad, quad);
            let Damage::Overlap { over } = error.damage else {
                return Err(TestCaseError::fail(error.to_string()));
            };
            // As above.
            prop_assert!(over.iter().all(|o| (o - 0.5 + lacking).abs() < 2e-3), "{over:?}");
        }

        /// A corner that is moved tears the quad, or tilts it.
        #[test]
        fn a_moved_corner_is_found(
            setup in setups(), quad in any::<Index>(), corner in 0..4usize,
            by in prop_oneof![0.02..9.0f64, -9.0..-0.02f64], axis in 0..3usize,
        ) {
            let quad = quad.index(setup.patches.len());
            let mut scene = setup.scene();
            if axis == 2 {
                let metres = setup.texel(quad)[0].length() * by;
                let along = setup.camera.pose.forward * metres;
                scene.positions[4 * quad + corner] += along.as_vec3();
                let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
                let tilted = matches!(error.damage, Damage::Tilted { metres: found }
                    if (found - metres.abs()).abs() < 2e-4);
                prop_assert!(tilted && error.quad == quad, "{error}, not {metres}");
                return Ok(());
            }
            let mut moves = [[0.0; 2]; 4];
            moves[corner][axis] = by;
            move_corners(&mut scene, &setup, quad, moves);
            let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
            prop_assert_eq!(error.quad, quad);
            // A corner that is moved over another one takes its place.
            let torn = matches!(error.damage, Damage::Torn { texels } if texels < by.abs() + 2e-3);
            let other = matches!(error.damage, Damage::NotHalves | Damage::Flipped);
            prop_assert!(torn || other && by.abs() > 1.9, "{error}");
        }

        /// A quad whose texels are turned, mirrored or scaled is found, and how.
        #[test]
        fn distorted_texels_are_found(
            setup in setups(), quad in any::<Index>(), how in 0..6usize, by in 1.02..2.0f64,
        ) {
            let quad = quad.index(setup.patches.len());
            let mut scene = setup.scene();
            let Rect { width: columns, height: rows, .. } = setup.patches[quad].rect;
            let aspect = f64::from(rows + 1) / f64::from(columns + 1);
            let uvs: &mut [Vec2] = &mut scene.uvs[4 * quad..][..4];
            let (x, y) = (DVec2::X, DVec2::Y);
            let (right, down) = match how {
                // Corners run upper left, lower left, lower right, upper right.
                0 => { uvs.rotate_right(1); (y * aspect, -x / aspect) }
                1 => { uvs.rotate_left(2); (-x, -y) }
                2 => { uvs.rotate_left(1); (-y * aspect, x / aspect) }
                3 => { uvs.reverse(); (-x, y) }
                4 => { uvs.reverse(); uvs.rotate_left(2); (x, -y) }
                _ => {
                    let start = uvs[0];
                    uvs.iter_mut().for_each(|uv| *uv = start + (*uv - start) * by as f32);
                    (x * by, y * by)
                }
            };
            let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
            prop_assert_eq!(error.quad, quad);
            let Damage::Distorted { right: r, down: d, texels } = error.damage else {
                return Err(TestCaseError::fail(error.to_string()));
            };
            let near = |a: DVec2, b| a.abs_diff_eq(b, 2e-3 * (1.0 + a.length()));
            prop_assert!(near(r, right) && near(d, down), "{r} {d} are not {right} {down}");
            prop_assert!(texels > 0.01);
        }

        /// Whatever else is done to a quad is found.
        #[test]
        fn other_damage_is_found(setup in setups(), quad in any::<Index>(), how in 0..9usize) {
            let mut quad = quad.index(setup.patches.len());
            let mut scene = setup.scene();
            let Patch { rect, x, y, .. } = setup.patches[quad];
            let triangles = &mut scene.triangles[2 * quad..][..2];
            let is_expected: fn(&Damage) -> bool = match how {
                0 => { triangles[0].reverse(); |d| matches!(d, Damage::Flipped) }
                1 => { triangles[1] = triangles[0]; |d| matches!(d, Damage::NotHalves) }
                // The other diagonal: the halves overlap.
                2 => { triangles[1][0] += 1; |d| matches!(d, Damage::NotHalves) }
                3 => {
                    let by = [-f64::from(rect.x) - 1.0, 0.0];
                    move_corners(&mut scene, &setup, quad, [by; 4]);
                    |d| matches!(d, Damage::OutsideLayer { min: [-1, _], width: 600, .. })
                }
                4 => {
                    let by = [0.0, f64::from(401 - rect.bottom())];
                    move_corners(&mut scene, &setup, quad, [by; 4]);
                    |d| matches!(d, Damage::OutsideLayer { max: [_, 400], height: 400, .. })
                }
                5 => {
                    let by = [-f64::from(x) - 1.0, -f64::from(y) - 2.0];
                    move_texels(&mut scene, &setup, quad, [by; 4]);
                    |d| matches!(d, Damage::OutsidePage { min: [-1, -2], .. })
                }
                6 => {
                    let material = &mut scene.triangle_materials[2 * quad];
                    *material = (*material + 1) % 3;
                    |d| matches!(d, Damage::NotOnePage)
                }
                7 => {
                    scene.meshes[0].triangles.end -= 1;
                    quad = setup.patches.len() - 1;
                    |d| matches!(d, Damage::Half)
                }
                _ => {
                    let away = Vec3::splat(1e9);
                    scene.objects[0].world_from_mesh.translation -= away.as_dvec3();
                    scene.positions.iter_mut().for_each(|p| *p += away);
                    quad = 0;
                    |d| matches!(d, Damage::Coarse { texels } if *texels > 1.0)
                }
            };
            let error = patches_of(&scene, &setup.camera, &setup.depths).unwrap_err();
            prop_assert!(is_expected(&error.damage), "{error}");
            prop_assert_eq!(error.quad, quad);
        }
    }
}
