//! Octahedral impostors: 8 x 8 pictures from a hemisphere of directions, of which the three
//! nearest to the viewer's are blended, as R. Brucks made popular in 2018. Displayed here by
//! casting rays.

use crate::capture::capture;
use crate::picture::Picture;
use farfield_grid::Grid;
use farfield_sampling::{NONE, Textures, linear_from_srgb};
use farfield_scene::Scene;
use farfield_views::{Camera, Extent, Pose};
use glam::{DVec2, DVec3, Vec4};
use rayon::prelude::*;

/// Pictures along each side of the atlas.
const SIDE: u32 = 8;

/// Colour, alpha and depth of a texel.
const BYTES_PER_TEXEL: u64 = 5;

/// From where a frame is recorded, in radii of the scene: the picture is that of a parallel
/// projection, but for a ten-thousandth of a radius.
const FAR: f64 = 1e4;

/// An atlas of parallel projections onto planes through the scene's centre.
pub(crate) struct OctahedralImpostor {
    /// Middle of the atlas' hemisphere: `forward` looks away from the viewers, `eye` is the
    /// scene's centre.
    pole: Pose,
    /// Row by row.
    places: Vec<Place>,
    /// Row by row; those that no viewpoint asked for are empty.
    frames: Vec<Option<Frame>>,
}

/// What a frame shows, and how finely.
#[derive(Clone, Copy)]
struct Place {
    /// `forward` looks away from the viewers, `eye` is the scene's centre.
    pose: Pose,
    /// Half of the box that just holds the scene, in view space, in metres.
    half: DVec3,
    /// Columns and rows of texels.
    size: DVec2,
}

/// The picture from one direction.
struct Frame {
    place: Place,
    /// sRGB and straight alpha.
    texels: Grid<[u8; 4]>,
    /// Depth behind the plane through the centre: 0 is `-half.z` of its box, 255 is `half.z`.
    depths: Grid<u8>,
}

/// How large the texels of the frames are.
#[derive(Clone, Copy)]
pub(crate) enum TexelSize {
    /// As large as an atlas of so many bytes asks for.
    OfAtlas(u64),
    /// In metres.
    Metres(f64),
}

impl OctahedralImpostor {
    /// Records the frames that viewers at `eyes` will ask for; all of them count as bytes.
    ///
    /// * `pole` - towards the viewers, from `center`
    pub(crate) fn new(
        scene: &Scene,
        center: DVec3,
        pole: DVec3,
        texel: TexelSize,
        eyes: &[DVec3],
    ) -> Self {
        let pole = Pose::looking_along(center, -pole);
        let poses: Vec<Pose> = (0..SIDE * SIDE)
            .map(|frame| {
                let at = DVec2::new(f64::from(frame % SIDE), f64::from(frame / SIDE));
                let direction = pole_direction(at / f64::from(SIDE - 1) * 2.0 - 1.0);
                Pose::looking_along(center, pole.point_in_world(direction) - center)
            })
            .collect();
        // Every frame is as tight around the scene as it can be.
        let vertices = vertices(scene);
        let reach = poses.par_iter().map(|pose| {
            let reach = vertices
                .iter()
                .map(|vertex| pose.point_in_view(*vertex).abs());
            reach.fold(DVec3::ZERO, DVec3::max)
        });
        let halves: Vec<DVec3> = reach.collect();
        let texel = match texel {
            TexelSize::Metres(metres) => metres,
            TexelSize::OfAtlas(bytes) => {
                let area: f64 = halves.iter().map(|half| 4.0 * half.x * half.y).sum();
                (area * BYTES_PER_TEXEL as f64 / bytes as f64).sqrt()
            }
        };
        let place = |(&pose, &half): (&Pose, &DVec3)| Place {
            pose,
            half,
            size: (half.truncate() * 2.0 / texel).round().max(DVec2::ONE),
        };
        let mut impostor = Self {
            pole,
            places: poses.iter().zip(&halves).map(place).collect(),
            frames: poses.iter().map(|_| None).collect(),
        };
        let textures = Textures::new(scene);
        for eye in eyes {
            for (frame, _) in impostor.nearest_frames(*eye) {
                if impostor.frames[frame].is_none() {
                    impostor.frames[frame] = Some(impostor.places[frame].frame(scene, &textures));
                }
            }
        }
        impostor
    }

    /// Of the whole atlas, as if its frames filled it.
    pub(crate) fn bytes(&self) -> u64 {
        let texels = self.places.iter().map(|place| place.size.element_product());
        texels.sum::<f64>() as u64 * BYTES_PER_TEXEL
    }

    /// The corners of the atlas' triangle that holds the direction to a viewer, and their shares.
    fn nearest_frames(&self, eye: DVec3) -> [(usize, f64); 3] {
        let square = square_from_direction(self.pole.point_in_view(eye));
        let last = f64::from(SIDE - 1);
        let at = ((square + 1.0) / 2.0 * last).clamp(DVec2::ZERO, DVec2::splat(last));
        let corner = at.floor().min(DVec2::splat(last - 1.0));
        let t = at - corner;
        let index = |step: DVec2| {
            let frame = corner + step;
            frame.y as usize * SIDE as usize + frame.x as usize
        };
        let side = if t.x > t.y { DVec2::X } else { DVec2::Y };
        [
            (index(DVec2::ZERO), 1.0 - t.max_element()),
            (index(side), t.max_element() - t.min_element()),
            (index(DVec2::ONE), t.min_element()),
        ]
    }

    /// What a camera sees of the impostor.
    ///
    /// # Panics
    ///
    /// When the camera is at none of the places the impostor was recorded for.
    pub(crate) fn render(&self, camera: &Camera, linear: &[f32; 256]) -> Picture {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let frames = self.nearest_frames(camera.pose.eye).map(|(frame, share)| {
            let frame = self.frames[frame].as_ref().expect("it was asked for");
            (
                frame,
                frame.place.pose.point_in_view(camera.pose.eye),
                share,
            )
        });
        let world_from_view = camera.pose.view_from_world().transpose();
        let look = |i: usize| {
            let pixel = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            // Depth along the camera's axis is the ray's parameter.
            let ray = world_from_view * camera.view_from_pixel(pixel, 1.0);
            let (mut color, mut depth) = (Vec4::ZERO, 0.0);
            for (frame, eye, share) in &frames {
                let ray = frame.place.pose.view_from_world() * ray;
                // Where the ray meets the plane through the centre, then where it meets the plane
                // as far behind it as the surface seen there, and what is seen there.
                let meet = |behind: f64| {
                    let t = (behind - eye.z) / ray.z;
                    (t, frame.place.texel_at((*eye + ray * t).truncate()))
                };
                let (_, at) = meet(0.0);
                let (_, at) = meet(frame.depth_behind(at));
                let seen = color_at(&frame.texels, at, linear) * *share as f32;
                let (t, _) = meet(frame.depth_behind(at));
                color += seen;
                depth += t * f64::from(seen.w);
            }
            (color, depth / f64::from(color.w))
        };
        let seen: Vec<(Vec4, f64)> = (0..width * height).into_par_iter().map(look).collect();
        let shown = |(color, _): &(Vec4, f64)| color.w >= 0.5;
        let grid = |ids| Grid::from_cells(width, height, ids);
        Picture {
            depth: Grid::from_cells(
                width,
                height,
                seen.iter()
                    .map(|s| if shown(s) { s.1 } else { f64::INFINITY })
                    .collect(),
            ),
            ids: grid(
                seen.iter()
                    .map(|s| if shown(s) { 0 } else { NONE })
                    .collect(),
            ),
            color: Grid::from_cells(
                width,
                height,
                seen.iter()
                    .map(|(color, _)| color.truncate() / color.w)
                    .collect(),
            ),
        }
    }
}

impl Place {
    fn frame(&self, scene: &Scene, textures: &Textures<'_>) -> Frame {
        let distance = FAR * self.half.length();
        let max = self.half.truncate() / distance;
        let camera = Camera {
            pose: Pose {
                eye: self.pose.eye - self.pose.forward * distance,
                ..self.pose
            },
            extent: Extent { min: -max, max },
            width: self.size.x as u32,
            height: self.size.y as u32,
        };
        let seen = capture(scene, textures, &camera);
        let byte = |depth: &f64| {
            let share = ((depth - distance) / self.half.z + 1.0) / 2.0;
            (share * 255.0).round() as u8
        };
        let depths = seen.depth.cells().iter().map(byte).collect();
        Frame {
            place: *self,
            depths: Grid::from_cells(seen.depth.width(), seen.depth.height(), depths),
            texels: seen.texels,
        }
    }

    /// Where in the frame a point of its plane is, in texels.
    fn texel_at(&self, point: DVec2) -> DVec2 {
        (point / self.half.truncate() + 1.0) / 2.0 * self.size
    }
}

impl Frame {
    /// The recorded depth behind the plane through the centre, in metres.
    fn depth_behind(&self, at: DVec2) -> f64 {
        let byte = bilinear(&self.depths, at, |depth| Vec4::splat(f32::from(depth))).x;
        (f64::from(byte) / 255.0 * 2.0 - 1.0) * self.place.half.z
    }
}

/// Linear RGB times alpha, and alpha; nothing outside of the frame.
fn color_at(texels: &Grid<[u8; 4]>, at: DVec2, linear: &[f32; 256]) -> Vec4 {
    let size = DVec2::new(texels.width() as f64, texels.height() as f64);
    if at.cmplt(DVec2::ZERO).any() || at.cmpgt(size).any() {
        return Vec4::ZERO;
    }
    bilinear(texels, at, |[r, g, b, a]| {
        let [r, g, b] = [r, g, b].map(|c| linear[usize::from(c)]);
        Vec4::new(r, g, b, 1.0) * (f32::from(a) / 255.0)
    })
}

/// Between the four texels around a point.
fn bilinear<T: Copy>(texels: &Grid<T>, at: DVec2, decode: impl Fn(T) -> Vec4) -> Vec4 {
    let last = DVec2::new((texels.width() - 1) as f64, (texels.height() - 1) as f64);
    let at = (at - 0.5).clamp(DVec2::ZERO, last);
    let corner = at.floor();
    let t = (at - corner).as_vec2();
    let next = (corner + 1.0).min(last);
    let texel = |x: f64, y: f64| decode(texels[(x as usize, y as usize)]);
    let above = texel(corner.x, corner.y).lerp(texel(next.x, corner.y), t.x);
    let below = texel(corner.x, next.y).lerp(texel(next.x, next.y), t.x);
    above.lerp(below, t.y)
}

/// Linear intensities of all sRGB bytes.
pub(crate) fn linear_bytes() -> [f32; 256] {
    std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0))
}

/// The viewing direction, in the pole's view space, of a place in the square [-1, 1]^2: the
/// hemi-octahedral map (Z. H. Cigolle et al., A Survey of Efficient Representations for
/// Independent Unit Vectors, 2014), the pole in the middle.
fn pole_direction(square: DVec2) -> DVec3 {
    let lateral = DVec2::new(square.x + square.y, square.x - square.y) / 2.0;
    let toward_viewer = lateral.extend(lateral.abs().element_sum() - 1.0);
    -toward_viewer.normalize()
}

/// The inverse, for a point seen from the centre, in the pole's view space.
fn square_from_direction(viewer: DVec3) -> DVec2 {
    let lateral = viewer.truncate() / viewer.abs().element_sum();
    DVec2::new(lateral.x + lateral.y, lateral.x - lateral.y)
}

/// In the world, of all that is drawn.
fn vertices(scene: &Scene) -> Vec<DVec3> {
    let objects = 0..scene.objects.len() as u32;
    let vertices = objects.flat_map(|object| {
        let triangles = scene.mesh_of(object).triangles.clone();
        let triangles = &scene.triangles[triangles.start as usize..triangles.end as usize];
        let vertices = triangles.iter().flatten();
        vertices.map(move |vertex| scene.world_position(object, *vertex))
    });
    vertices.collect()
}
