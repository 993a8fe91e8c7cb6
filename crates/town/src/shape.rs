//! A mesh under construction, made of flat faces.

use crate::skin::Skin;
use glam::{Affine3A, Vec2, Vec3, Vec4};

/// Faces with normals, texture coordinates, colours and skins; faces share no vertices.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) colors: Vec<Vec4>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) skins: Vec<Skin>,
    /// Linear RGB of what is added from now on, where the skin takes a tint.
    pub(crate) tint: Vec3,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            triangles: Vec::new(),
            skins: Vec::new(),
            tint: Vec3::ONE,
        }
    }
}

impl Shape {
    /// An empty shape with a tint.
    pub(crate) fn tinted(tint: Vec3) -> Self {
        Self {
            tint,
            ..Self::default()
        }
    }

    /// Adds a flat convex polygon, counter-clockwise seen from the front, its texture laid on in
    /// metres from the origin: level on walls and slopes, or with the grain along the longest
    /// edge.
    pub(crate) fn face(&mut self, skin: Skin, corners: &[Vec3]) {
        let normal = normal_of(corners);
        let right = Vec3::Y.cross(normal).try_normalize().unwrap_or(Vec3::X);
        let up = normal.cross(right);
        let (right, up) = match skin.has_grain() && longest_edge(corners).dot(up).abs() > 0.7 {
            true => (up, -right),
            false => (right, up),
        };
        let uvs: Vec<Vec2> = corners
            .iter()
            .map(|p| Vec2::new(p.dot(right), -p.dot(up)) / skin.metres())
            .collect();
        self.fitted(skin, corners, &uvs);
    }

    /// Adds a flat convex polygon with given texture coordinates.
    pub(crate) fn fitted(&mut self, skin: Skin, corners: &[Vec3], uvs: &[Vec2]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.normals.extend(vec![normal_of(corners); corners.len()]);
        self.uvs.extend(uvs);
        self.colors.resize(self.positions.len(), self.color(skin));
        for i in 2..corners.len() as u32 {
            self.triangles.push([first, first + i - 1, first + i]);
            self.skins.push(skin);
        }
    }

    /// Colour of vertices of a skin.
    fn color(&self, skin: Skin) -> Vec4 {
        match skin.takes_tint() {
            true => self.tint.extend(1.0),
            false => Vec4::ONE,
        }
    }

    /// Adds triangles between points with normals of their own.
    pub(crate) fn smooth(
        &mut self,
        skin: Skin,
        points: impl Iterator<Item = (Vec3, Vec3, Vec2)>,
        triangles: impl Iterator<Item = [u32; 3]>,
    ) {
        let first = self.positions.len() as u32;
        for (position, normal, uv) in points {
            self.positions.push(position);
            self.normals.push(normal);
            self.uvs.push(uv);
        }
        self.colors.resize(self.positions.len(), self.color(skin));
        self.triangles
            .extend(triangles.map(|t| t.map(|v| v + first)));
        self.skins.resize(self.triangles.len(), skin);
    }

    /// Adds a quad that shows the whole texture; corners from the lower left.
    pub(crate) fn picture(&mut self, skin: Skin, corners: [Vec3; 4]) {
        self.fitted(skin, &corners, &[Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]);
    }

    /// Adds the sides of a prism without its ends.
    ///
    /// * `outline` - of the base, counter-clockwise seen from where `along` points
    /// * `skins` - one for each edge of the outline
    pub(crate) fn tube(&mut self, outline: &[Vec3], along: Vec3, skins: &[Skin]) {
        for (i, &a) in outline.iter().enumerate() {
            let b = outline[(i + 1) % outline.len()];
            self.face(skins[i], &[a, b, b + along, a + along]);
        }
    }

    /// Adds a closed prism over a convex outline, counter-clockwise seen from where `along` points.
    pub(crate) fn prism(&mut self, skin: Skin, outline: &[Vec3], along: Vec3) {
        self.tube(outline, along, &vec![skin; outline.len()]);
        let near: Vec<Vec3> = outline.iter().rev().copied().collect();
        let far: Vec<Vec3> = outline.iter().map(|&p| p + along).collect();
        self.face(skin, &near);
        self.face(skin, &far);
    }

    /// Adds a closed box.
    pub(crate) fn cuboid(&mut self, skin: Skin, min: Vec3, max: Vec3) {
        self.prism(skin, &rectangle(min, max), Vec3::Y * (max.y - min.y));
    }

    /// Adds another shape, moved.
    pub(crate) fn append(&mut self, other: &Self, by: Vec3) {
        self.extend(other, |p| p + by, |n| n);
    }

    /// Adds another shape, moved, turned and scaled by the same factor along all axes.
    pub(crate) fn append_placed(&mut self, other: &Self, place: &Affine3A) {
        let normal = |n| place.transform_vector3(n).normalize();
        self.extend(other, |p| place.transform_point3(p), normal);
    }

    fn extend(
        &mut self,
        other: &Self,
        position: impl Fn(Vec3) -> Vec3,
        normal: impl Fn(Vec3) -> Vec3,
    ) {
        let first = self.positions.len() as u32;
        self.positions
            .extend(other.positions.iter().map(|&p| position(p)));
        self.normals
            .extend(other.normals.iter().map(|&n| normal(n)));
        self.uvs.extend(&other.uvs);
        self.colors.extend(&other.colors);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        self.skins.extend(&other.skins);
    }

    /// Adds a box without top and bottom.
    pub(crate) fn shaft(&mut self, skin: Skin, min: Vec3, max: Vec3) {
        self.tube(&rectangle(min, max), Vec3::Y * (max.y - min.y), &[skin; 4]);
    }
}

/// The base of a box, counter-clockwise seen from above, from the front left.
pub(crate) fn rectangle(min: Vec3, max: Vec3) -> [Vec3; 4] {
    [
        Vec3::new(min.x, min.y, max.z),
        Vec3::new(max.x, min.y, max.z),
        Vec3::new(max.x, min.y, min.z),
        Vec3::new(min.x, min.y, min.z),
    ]
}

/// Newell's method: the mean normal over all corners, also where three lie on one line.
fn normal_of(corners: &[Vec3]) -> Vec3 {
    let n = corners.len();
    let origin = corners[0];
    (0..n)
        .map(|i| (corners[i] - origin).cross(corners[(i + 1) % n] - origin))
        .sum::<Vec3>()
        .normalize()
}

fn longest_edge(corners: &[Vec3]) -> Vec3 {
    let n = corners.len();
    (0..n)
        .map(|i| corners[(i + 1) % n] - corners[i])
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(Vec3::X)
        .normalize()
}
