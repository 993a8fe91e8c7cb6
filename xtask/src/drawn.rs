//! A scene as ID-bitfields draw it: all triangles in one numbering, or some ranges of them.

use anyhow::{Result, bail};
use farfield_sampling::{Textures, rasterize};
use farfield_scene::{AlphaMode, Mesh, Scene};
use farfield_views::Camera;
use glam::DVec3;
use std::ops::Range;

/// Pixels that are drawn at a time: bounds memory.
const STRIP: u32 = 1 << 22;

/// A scene as one object, its triangles sorted by material, placed at the centre of its box.
///
/// # Errors
///
/// When there are more triangles than a glTF file and ids can number.
pub(crate) fn flattened(scene: &Scene, name: &str, [min, max]: [DVec3; 2]) -> Result<Scene> {
    let of_objects = |count: fn(&Mesh) -> usize| -> u64 {
        let objects = 0..scene.objects.len() as u32;
        objects
            .map(|object| count(scene.mesh_of(object)) as u64)
            .sum()
    };
    let triangles = of_objects(|mesh| mesh.triangles.len());
    let vertices = of_objects(|mesh| mesh.vertices.len());
    require_room(triangles, vertices)?;
    Ok(scene.flattened(name, (min + max) / 2.0))
}

/// Refuses what a glTF file cannot hold; all that it holds, ids can number.
///
/// # Errors
///
/// When positions and indices alone have more bytes.
fn require_room(triangles: u64, vertices: u64) -> Result<()> {
    let count = triangles.checked_add(vertices);
    let bytes = count.and_then(|count| count.checked_mul(12));
    if bytes.is_none_or(|bytes| bytes > u64::from(u32::MAX)) {
        bail!(
            "{triangles} triangles, each instance of an object for itself, take more than the 4 GiB \
             that a glTF file can hold: leave objects out with --exclude, or split the scene"
        );
    }
    Ok(())
}

/// Where the triangles of each material begin, and the number of all.
pub(crate) fn parts(scene: &Scene) -> Vec<u32> {
    let materials = &scene.triangle_materials;
    let pairs = materials.windows(2).enumerate();
    let borders = pairs.filter(|(_, pair)| pair[0] != pair[1]);
    let borders = borders.map(|(at, _)| at as u32 + 1);
    std::iter::once(0)
        .chain(borders)
        .chain([materials.len() as u32])
        .collect()
}

/// The triangles of blended materials: what is behind them is seen, so they hide nothing.
pub(crate) fn blended(scene: &Scene) -> Vec<Range<u32>> {
    of_materials(scene, |alpha| alpha == AlphaMode::Blend)
}

/// The triangles of all other materials, which hide what is behind them: a scene of them only, without
/// images.
pub(crate) fn solid(scene: &Scene) -> Scene {
    let mut solid = without_images(scene);
    let ranges = of_materials(scene, |alpha| alpha != AlphaMode::Blend);
    draw_only(&mut solid, ranges.into_iter());
    solid
}

fn of_materials(scene: &Scene, is_one: impl Fn(AlphaMode) -> bool) -> Vec<Range<u32>> {
    let parts = parts(scene);
    let parts = parts.windows(2).map(|part| part[0]..part[1]);
    let alpha = |part: &Range<u32>| {
        let material = scene.triangle_materials[part.start as usize];
        scene.materials[material as usize].alpha
    };
    parts.filter(|part| is_one(alpha(part))).collect()
}

/// Lets a scene of one object draw these ranges of its triangles only.
pub(crate) fn draw_only(scene: &mut Scene, ranges: impl Iterator<Item = Range<u32>>) {
    let (vertices, object) = (scene.meshes[0].vertices.clone(), scene.objects[0].clone());
    scene.meshes = ranges
        .map(|triangles| Mesh {
            vertices: vertices.clone(),
            triangles,
        })
        .collect();
    // Without anything to draw there is still a first one, to be changed again.
    if scene.meshes.is_empty() {
        scene.meshes.push(Mesh {
            vertices,
            triangles: 0..0,
        });
    }
    scene.objects = (0..scene.meshes.len() as u32)
        .map(|mesh| farfield_scene::Object {
            mesh,
            ..object.clone()
        })
        .collect();
}

/// The geometry of a scene without its images, to be drawn with the textures of the whole.
pub(crate) fn without_images(scene: &Scene) -> Scene {
    Scene {
        images: Vec::new(),
        positions: scene.positions.clone(),
        normals: scene.normals.clone(),
        uvs: scene.uvs.clone(),
        colors: scene.colors.clone(),
        triangles: scene.triangles.clone(),
        triangle_materials: scene.triangle_materials.clone(),
        meshes: scene.meshes.clone(),
        objects: scene.objects.clone(),
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
    }
}

/// Hands the triangles that a camera sees, [`farfield_sampling::NONE`] where there is nothing, to `take`, strip by strip.
pub(crate) fn ids(
    scene: &Scene,
    textures: &Textures<'_>,
    camera: &Camera,
    mut take: impl FnMut(&[u32]),
) {
    let rows = (STRIP / camera.width).max(1);
    for first in (0..camera.height).step_by(rows as usize) {
        let strip = first..(first + rows).min(camera.height);
        let seen = rasterize(scene, textures, &camera.window(&(0..camera.width), &strip));
        take(seen.triangles.cells());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_sampling::NONE;

    /// Up to the last byte of a glTF file there is room, beyond there is not, and what is refused is named;
    /// what there is room for has fewer triangles than there are ids.
    #[test]
    fn what_no_file_holds_is_refused() {
        let most = u64::from(u32::MAX) / 12;
        for vertices in [0, 3, most / 2] {
            assert!(require_room(most - vertices, vertices).is_ok());
            assert!(require_room(most - vertices + 1, vertices).is_err());
        }
        assert!(most < u64::from(NONE));
        for (triangles, vertices) in [(0, most + 1), (u64::MAX / 12, 1), (u64::MAX, u64::MAX)] {
            let message = require_room(triangles, vertices).unwrap_err().to_string();
            assert!(
                message.starts_with(&format!("{triangles} triangles"))
                    && message.contains("--exclude"),
                "{message}"
            );
        }
    }
}
