//! Puts meshes into scenes that were read as lists of triangles: from OBJ and PLY files.

use crate::normals::smooth_normals;
use crate::notes::{Note, Notes};
use crate::recentre::centre_of;
use farfield_scene::{Mesh, Object, Scene};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// What the corners of triangles refer to.
#[derive(Debug, Default)]
pub(crate) struct Attributes {
    /// Finite as f32, in metres.
    pub(crate) positions: Vec<DVec3>,
    /// Linear, in [0, 1]; one for each position, or none.
    pub(crate) colors: Vec<Vec4>,
    /// Of any length, also 0 and not finite.
    pub(crate) normals: Vec<Vec3>,
    /// Finite.
    pub(crate) uvs: Vec<Vec2>,
}

/// Position, texture coordinate and normal of a triangle's corner, the latter two [`NONE`] where
/// there is none.
pub(crate) type Corner = [u32; 3];

pub(crate) const NONE: u32 = u32::MAX;

/// Appends an object and its mesh; nothing where no triangle has an area.
///
/// Corners of the same position, texture coordinate and normal become one vertex. Normals that are
/// missing are smooth over all triangles that share a position.
///
/// * `triangles` - of existing attributes
/// * `materials` - of each triangle
pub(crate) fn push_object(
    scene: &mut Scene,
    name: String,
    attributes: &Attributes,
    triangles: &[[Corner; 3]],
    materials: &[u32],
    notes: &mut Notes,
) {
    let used = || triangles.iter().flatten().map(|corner| corner[0] as usize);
    let centre = centre_of(used().map(|position| attributes.positions[position]));
    // Positions in the order of their first use.
    let mut local: HashMap<u32, u32> = HashMap::new();
    let mut positions: Vec<Vec3> = Vec::new();
    for position in used() {
        local.entry(position as u32).or_insert_with(|| {
            positions.push((attributes.positions[position] - centre).as_vec3());
            positions.len() as u32 - 1
        });
    }
    let shapes: Vec<[u32; 3]> = triangles
        .iter()
        .map(|triangle| triangle.map(|corner| local[&corner[0]]))
        .collect();
    let kept: Vec<usize> = (0..triangles.len())
        .filter(|&t| has_area(shapes[t].map(|v| positions[v as usize])))
        .collect();
    notes.add(Note::DegenerateTriangles, triangles.len() - kept.len());
    if kept.is_empty() {
        return;
    }

    let normal_of = |corner: &Corner| {
        let normal = attributes.normals.get(corner[2] as usize);
        let normal = normal.map(|n| n.as_dvec3().normalize_or_zero().as_vec3());
        normal.filter(|&n| n != Vec3::ZERO)
    };
    let mut bad_normals = 0;
    let whole: Vec<[u32; 3]> = kept.iter().map(|&t| shapes[t]).collect();
    let corners = || kept.iter().flat_map(|&t| &triangles[t]);
    let smooth = match corners().all(|corner| normal_of(corner).is_some()) {
        true => Vec::new(),
        false => smooth_normals(&positions, &whole),
    };
    let first_vertex = scene.positions.len() as u32;
    let first_triangle = scene.triangles.len() as u32;
    let mut vertices: HashMap<Corner, u32> = HashMap::new();
    for &t in &kept {
        let triangle = triangles[t].map(|corner| {
            *vertices.entry(corner).or_insert_with(|| {
                let position = local[&corner[0]] as usize;
                let normal = normal_of(&corner).unwrap_or_else(|| {
                    bad_normals += usize::from(corner[2] != NONE);
                    smooth[position]
                });
                let uv = attributes.uvs.get(corner[1] as usize);
                let color = attributes.colors.get(corner[0] as usize);
                scene.positions.push(positions[position]);
                scene.normals.push(normal);
                scene.uvs.push(uv.copied().unwrap_or_default());
                scene.colors.push(color.copied().unwrap_or(Vec4::ONE));
                scene.positions.len() as u32 - 1
            })
        });
        scene.triangles.push(triangle);
        scene.triangle_materials.push(materials[t]);
    }
    notes.add(Note::Normals, bad_normals);
    scene.objects.push(Object {
        name,
        mesh: scene.meshes.len() as u32,
        world_from_mesh: DAffine3::from_translation(centre),
    });
    scene.meshes.push(Mesh {
        vertices: first_vertex..scene.positions.len() as u32,
        triangles: first_triangle..scene.triangles.len() as u32,
    });
}

/// Whether a triangle has an area that is not 0.
///
/// In f64 the area of a triangle of f32 coordinates is exactly 0 where its corners lie on a line
/// and the coordinates have similar exponents; elsewhere it may be off by rounding.
pub(crate) fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}
