//! Scenes whose triangles are numbered, and what is seen of them.

use farfield_bitfields::{Bitfield, Distances, welded, with_neighbors};
use farfield_sampling::{NONE, Textures, rasterize};
use farfield_scene::Scene;
use farfield_views::{Camera, Extent, Pose, low_discrepancy_point, sphere_direction};
use glam::{DVec3, Vec3};

/// Pixels of the paper's id buffers, and of the pictures that they are judged by.
pub(crate) const BUFFER: [u32; 2] = [1320, 1074];
pub(crate) const PICTURE: u32 = 255;

/// Pictures are taken from so many directions.
pub(crate) const PICTURES: u32 = 320;

/// Where one distance is asked for, the larger side of pictures shows so many radians.
const FOV: f64 = std::f64::consts::FRAC_PI_4;

/// Of a range of distances, the greatest is so many times that distance, which is the least.
pub(crate) const FARTHEST: f64 = 4.0;

/// A scene whose triangles are numbered as they are drawn, object by object.
pub(crate) struct Numbered {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    /// The number of each object's first triangle.
    pub(crate) first: Vec<u32>,
    pub(crate) primitives: u32,
    pub(crate) center: DVec3,
    /// Of a sphere around all of it.
    pub(crate) radius: f64,
    /// Three vertices of each triangle, the same one where they are in the same place.
    pub(crate) welded: Vec<[u32; 3]>,
    /// The plane of each triangle: (normal, offset); its front is where the product with a point is
    /// greater.
    planes: Vec<(DVec3, f64)>,
    pub(crate) double_sided: Vec<bool>,
}

impl Numbered {
    pub(crate) fn new(name: &'static str, scene: Scene) -> Self {
        let mut primitives = 0;
        let first = (0..scene.objects.len() as u32)
            .map(|object| {
                let first = primitives;
                primitives += scene.mesh_of(object).triangles.len() as u32;
                first
            })
            .collect();
        let (mut places, mut planes, mut double_sided) = (Vec::new(), Vec::new(), Vec::new());
        let materials = (0..scene.objects.len() as u32).flat_map(|object| {
            let triangles = scene.mesh_of(object).triangles.clone();
            triangles.map(|triangle| scene.triangle_materials[triangle as usize])
        });
        for (corners, material) in scene.triangles_in_world().zip(materials) {
            places.extend(corners);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            planes.push((normal, normal.dot(a)));
            double_sided.push(scene.materials[material as usize].double_sided);
        }
        let triangles: Vec<[u32; 3]> = (0..primitives)
            .map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner))
            .collect();
        let [min, max] = scene.bounds().expect("the model has triangles");
        Self {
            name,
            scene,
            first,
            primitives,
            center: (min + max) / 2.0,
            radius: min.distance(max) / 2.0,
            welded: welded(&places, &triangles),
            planes,
            double_sided,
        }
    }

    /// The one distance from the centre at which a picture of these pixels, whose larger side shows
    /// [`FOV`], just holds the model, in metres.
    pub(crate) fn distance(&self, [width, height]: [u32; 2]) -> f64 {
        let extent = Extent::symmetric(FOV, width, height);
        self.radius / extent.max.min_element().atan().sin()
    }

    /// From the one distance of pictures on, with samples at either end.
    pub(crate) fn distances(&self) -> Distances {
        let nearest = self.distance([PICTURE; 2]);
        Distances {
            nearest,
            farthest: FARTHEST * nearest,
            samples: 2,
        }
    }

    /// What is seen at an offset from the centre, in a picture of these pixels that just holds the
    /// model.
    pub(crate) fn ids(
        &self,
        textures: &Textures<'_>,
        offset: DVec3,
        [width, height]: [u32; 2],
    ) -> Vec<u32> {
        let eye = self.center + offset;
        // What the model spans, along the smaller side.
        let half = (self.radius / offset.length()).asin();
        let sides = f64::from(width.max(height)) / f64::from(width.min(height));
        let fov = 2.0 * (half.tan() * sides).atan();
        let camera = Camera {
            pose: Pose::looking_along(eye, self.center - eye),
            extent: Extent::symmetric(fov, width, height),
            width,
            height,
        };
        self.ids_of(textures, &camera)
    }

    /// What a camera sees.
    pub(crate) fn ids_of(&self, textures: &Textures<'_>, camera: &Camera) -> Vec<u32> {
        let seen = rasterize(&self.scene, textures, camera);
        let pixels = seen.objects.cells().iter().zip(seen.triangles.cells());
        let id = |(&object, &triangle): (&u32, &u32)| match object {
            NONE => NONE,
            _ => {
                let start = self.scene.mesh_of(object).triangles.start;
                self.first[object as usize] + triangle - start
            }
        };
        pixels.map(id).collect()
    }

    /// Whether a point is before a triangle's front.
    pub(crate) fn fronts(&self, id: u32, eye: DVec3) -> bool {
        let (normal, offset) = self.planes[id as usize];
        normal.dot(eye) > offset
    }

    /// Whether a triangle can be seen from a point unless something is before it.
    pub(crate) fn shows(&self, id: u32, eye: DVec3) -> bool {
        self.double_sided[id as usize] || self.fronts(id, eye)
    }

    /// The triangles of which something is true.
    pub(crate) fn those(&self, is: impl Fn(u32) -> bool) -> Bitfield {
        let mut those = Bitfield::empty(self.primitives);
        let ids = (0..self.primitives).filter(|id| is(*id));
        ids.for_each(|id| those.insert(id));
        those
    }

    /// What samples see, and the neighbours of it that face them.
    pub(crate) fn grown(&self, sets: &[Bitfield], offsets: &[DVec3]) -> Vec<Bitfield> {
        let grown = |(set, &offset): (&Bitfield, &DVec3)| {
            let eye = self.center + offset;
            with_neighbors(set, &self.welded, |id| self.shows(id, eye))
        };
        sets.iter().zip(offsets).map(grown).collect()
    }

    /// What is seen at each offset from the centre.
    pub(crate) fn sets(&self, textures: &Textures<'_>, offsets: &[DVec3]) -> Vec<Bitfield> {
        let set = |&offset: &DVec3| {
            Bitfield::from_ids(self.primitives, &self.ids(textures, offset, BUFFER))
        };
        offsets.iter().map(set).collect()
    }

    /// Pictures from all around at distances in no order, and where they are taken.
    pub(crate) fn pictures(
        &self,
        textures: &Textures<'_>,
        distances: &Distances,
    ) -> Vec<(DVec3, Vec<u32>)> {
        let picture = |index| {
            let distance = distances.at(low_discrepancy_point(index, 0).z);
            let offset = sphere_direction(index as u32, PICTURES) * distance;
            (offset, self.ids(textures, offset, [PICTURE; 2]))
        };
        (0..u64::from(PICTURES)).map(picture).collect()
    }

    pub(crate) fn centers(&self) -> Vec<Vec3> {
        let triangles = self.scene.triangles_in_world();
        triangles
            .map(|[a, b, c]| ((a + b + c) / 3.0 - self.center).as_vec3())
            .collect()
    }
}

/// Primitives that an id buffer shows, each with its number of pixels.
pub(crate) fn counted(mut ids: Vec<u32>) -> Vec<[u32; 2]> {
    ids.retain(|id| *id != NONE);
    ids.sort_unstable();
    let runs = ids.chunk_by(|a, b| a == b);
    runs.map(|run| [run[0], run.len() as u32]).collect()
}
