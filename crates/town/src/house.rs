//! The built-in house.

use crate::assembly::{add_mesh, add_object, empty_scene, place};
use crate::canvas::Detail;
use crate::chimneys::chimney;
use crate::facade::{Cell, Facade, add_wall, add_wall_with_niche};
use crate::noise;
use crate::portal::{add_wall_around_portal, portal, steps};
use crate::roof::{self, dormer, gutters, ridge, roof};
use crate::shape::Shape;
use crate::skin::Skin;
use crate::textures::wood::{PANEL, PARAPET};
use crate::turret::{clock, turret};
use crate::windows::{WINDOW, shutters, window};
use farfield_scene::Scene;
use glam::{DAffine3, DVec3, Vec2, Vec3};

/// Half width and half depth of the ground storey, in metres.
const GROUND: [f32; 2] = [8.7, 17.7];
/// Half width and half depth of the storeys above, which jut out, in metres.
const UPPER: [f32; 2] = [9.0, 18.0];
/// Where the plinth ends, in metres.
const PLINTH_TOP: f32 = 0.9;
/// Where the ground storey ends and the floor above begins, in metres.
const GROUND_TOP: f32 = 4.0;
/// Where the half-timbered upper storey begins; three panels stand on each other up to the
/// gable's tip, in metres.
const UPPER_BOTTOM: f32 = 4.4;

/// A half-timbered guildhall, 20 m wide (x), 20 m high (y, from 0) and 40 m deep (z), in the middle
/// of x and z, its gable and portal towards +Z.
///
/// About 2,000 triangles of single-sided materials with the front outwards, in named objects;
/// windows, shutters, dormers and chimneys share meshes. Textures are painted in code.
///
/// * `seed` - for the noise in the textures; the geometry is always the same
pub fn house(seed: u64) -> Scene {
    let mut scene = empty_scene(noise::fold(seed), Skin::OF_HOUSE, Detail::Full);
    add_house(&mut scene);
    scene
}

/// Adds the meshes and objects of the house.
pub(crate) fn add_house(scene: &mut Scene) {
    add_slabs(scene);
    add_ground_storey(scene);
    add_upper_storey(scene);
    add_gables(scene);
    add_entrance(scene);
    add_roof(scene);
    add_woodshed(scene);
}

/// Closed boxes in which the walls end, so that no wall needs a top or a bottom.
fn add_slabs(scene: &mut Scene) {
    for (name, skin, [x, z], low, high) in [
        ("plinth", Skin::Plinth, [8.85, 17.85], 0.0, PLINTH_TOP),
        ("floor", Skin::Beam, [9.12, 18.12], GROUND_TOP, 4.45),
    ] {
        let mut shape = Shape::default();
        shape.cuboid(skin, Vec3::new(-x, low, -z), Vec3::new(x, high, z));
        add_object(scene, name, &shape);
    }
}

/// Cells side by side around the house: front, right, back and left, seen from outside.
struct Storey<'a> {
    name: &'a str,
    /// Half width and half depth, in metres.
    half: [f32; 2],
    bottom: f32,
    top: f32,
    /// Height of the windows above the bottom.
    parapet: f32,
    /// A letter for each cell: W a window, P the portal, else plain.
    plan: [&'a str; 4],
    /// Of plain cells, of cells with a window, and in the niche.
    skins: [Skin; 3],
}

/// Adds the walls and places `fittings` at each window.
fn add_storey(scene: &mut Scene, storey: &Storey<'_>, fittings: &[(&str, u32)]) {
    let mut walls = Shape::default();
    let [plain, around_window, reveal] = storey.skins;
    let facades = Facade::around(storey.half[0], storey.half[1]);
    for (side, (facade, plan)) in facades.iter().zip(storey.plan).enumerate() {
        let half = storey.half[side % 2];
        let width = 2.0 * half / plan.len() as f32;
        for (i, kind) in plan.chars().enumerate() {
            let left = width * i as f32 - half;
            let cell = Cell {
                min: Vec2::new(left, storey.bottom),
                max: Vec2::new(left + width, storey.top),
            };
            match kind {
                'W' => {
                    let opening = cell.opening(WINDOW, storey.parapet);
                    let skins = [around_window, reveal];
                    add_wall_with_niche(&mut walls, facade, skins, cell, opening, i % 2 == 1);
                    place_fittings(scene, facade, &opening, storey.name, fittings);
                }
                'P' => {
                    let above = THRESHOLD - storey.bottom;
                    add_wall_around_portal(&mut walls, facade, plain, cell, above);
                }
                _ => add_wall(&mut walls, facade, plain, cell, &cell.corners()),
            }
        }
    }
    add_object(scene, &format!("{} walls", storey.name), &walls);
}

fn place_fittings(
    scene: &mut Scene,
    facade: &Facade,
    opening: &Cell,
    storey: &str,
    fittings: &[(&str, u32)],
) {
    let foot = Vec2::new((opening.min.x + opening.max.x) / 2.0, opening.min.y);
    for &(what, mesh) in fittings {
        let name = format!("{storey} {what}");
        place(scene, &name, mesh, facade.world_from_wall(foot));
    }
}

/// Sandstone, with shutters beside the windows.
fn add_ground_storey(scene: &mut Scene) {
    let fittings = [
        ("window", add_mesh(scene, &window(WINDOW, Skin::Trim))),
        (
            "shutters",
            add_mesh(
                scene,
                &shutters(WINDOW, [Skin::Shutter, Skin::Slat], Vec3::ONE),
            ),
        ),
    ];
    let storey = Storey {
        name: "ground",
        half: GROUND,
        bottom: PLINTH_TOP - 0.1,
        top: GROUND_TOP + 0.1,
        parapet: 0.9,
        plan: ["WWPWW", ".W.W..W.W.", "W...W", ".W.W..W.W."],
        skins: [Skin::Sandstone, Skin::Sandstone, Skin::Trim],
    };
    add_storey(scene, &storey, &fittings);
}

/// Half-timbered, on brackets over the front.
fn add_upper_storey(scene: &mut Scene) {
    let fittings = [("window", add_mesh(scene, &window(WINDOW, Skin::Beam)))];
    let storey = Storey {
        name: "upper",
        half: UPPER,
        bottom: UPPER_BOTTOM,
        top: UPPER_BOTTOM + PANEL,
        parapet: PARAPET,
        plan: ["WWWWW", ".W.W..W.W.", ".W.W.", ".W.W..W.W."],
        skins: [Skin::BracedPanel, Skin::WindowPanel, Skin::Beam],
    };
    add_storey(scene, &storey, &fittings);

    let bracket = add_mesh(scene, &bracket());
    let [front, ..] = Facade::around(GROUND[0], GROUND[1]);
    for i in 0..6 {
        let x = (i as f32 / 5.0 - 0.5) * 2.0 * (GROUND[0] - 0.15);
        let at = front.world_from_wall(Vec2::new(x, GROUND_TOP));
        place(scene, "bracket", bracket, at);
    }
}

/// A wedge under a jutting floor, in wall coordinates from the middle of its upper edge.
fn bracket() -> Shape {
    let mut shape = Shape::default();
    let section = [[0.05, 0.36], [-0.75, -0.05], [0.05, -0.05]];
    let left = section.map(|[y, z]| Vec3::new(-0.13, y, z));
    shape.prism(Skin::Beam, &left, Vec3::X * 0.26);
    shape
}

/// Two storeys of panels that shrink with the roof, which falls at 45 degrees.
fn add_gables(scene: &mut Scene) {
    let fittings = [("window", add_mesh(scene, &window(WINDOW, Skin::Beam)))];
    let eaves = UPPER_BOTTOM + PANEL;
    let [front, _, back, _] = Facade::around(UPPER[0], UPPER[1]);
    for (name, facade, rows) in [
        ("front gable", front, ["WWW", "."]),
        ("back gable", back, [".W.", "W"]),
    ] {
        let mut walls = Shape::default();
        let mut beams = Shape::default();
        for (row, plan) in rows.iter().enumerate() {
            let bottom = eaves + PANEL * row as f32;
            let half = PANEL * plan.len() as f32 / 2.0;
            let cell_at = |left: f32| Cell {
                min: Vec2::new(left, bottom),
                max: Vec2::new(left + PANEL, bottom + PANEL),
            };
            for (i, kind) in plan.chars().enumerate() {
                let cell = cell_at(PANEL * i as f32 - half);
                if kind == 'W' {
                    let opening = cell.opening(WINDOW, PARAPET);
                    let skins = [Skin::WindowPanel, Skin::Beam];
                    add_wall_with_niche(&mut walls, &facade, skins, cell, opening, i % 2 == 1);
                    place_fittings(scene, &facade, &opening, name, &fittings);
                } else {
                    add_wall(
                        &mut walls,
                        &facade,
                        Skin::BracedPanel,
                        cell,
                        &cell.corners(),
                    );
                }
            }
            // Half a panel at either end, under the slope.
            let (left, right) = (cell_at(-half - PANEL), cell_at(half));
            let [a, b, c, _] = left.corners();
            add_wall(&mut walls, &facade, Skin::BracedPanel, left, &[a, b, c]);
            let [a, b, _, d] = right.corners();
            add_wall(&mut walls, &facade, Skin::BracedPanel, right, &[a, b, d]);
            add_gable_beam(&mut beams, &facade, half + PANEL + 0.15, bottom);
        }
        let tip = Cell {
            min: Vec2::new(-PANEL / 2.0, eaves + 2.0 * PANEL),
            max: Vec2::new(PANEL / 2.0, eaves + 3.0 * PANEL),
        };
        let [a, b, ..] = tip.corners();
        let top = Vec2::new(0.0, tip.min.y + PANEL / 2.0);
        add_wall(&mut walls, &facade, Skin::BracedPanel, tip, &[a, b, top]);
        add_gable_beam(&mut beams, &facade, PANEL / 2.0 + 0.15, tip.min.y);
        walls.append(&beams, Vec3::ZERO);
        add_object(scene, &format!("{name} walls"), &walls);
    }
    let dial = add_mesh(scene, &clock(1.15));
    let center = Vec2::new(0.0, eaves + 1.5 * PANEL);
    place(scene, "clock", dial, front.world_from_wall(center));
}

/// A beam across a gable, its ends in the roof.
fn add_gable_beam(shape: &mut Shape, facade: &Facade, half: f32, y: f32) {
    let outline = [[-half, 0.12], [half, 0.12], [half, -0.1], [-half, -0.1]];
    let outline = outline.map(|[x, out]| facade.at(Vec2::new(x, y - 0.15), out));
    shape.prism(Skin::Beam, &outline, Vec3::Y * 0.3);
}

/// Height of the portal's threshold, a little above the plinth, in metres.
const THRESHOLD: f32 = 0.93;

fn add_entrance(scene: &mut Scene) {
    let [front, ..] = Facade::around(GROUND[0], GROUND[1]);
    let door = add_mesh(scene, &portal());
    place(
        scene,
        "door",
        door,
        front.world_from_wall(Vec2::new(0.0, THRESHOLD)),
    );
    let count = 5;
    let shape = steps(count, THRESHOLD / count as f32, 0.36, 20.0);
    add_object(scene, "steps", &shape);
}

fn add_roof(scene: &mut Scene) {
    let half_depth = 18.9;
    add_object(scene, "roof", &roof(half_depth));
    add_object(scene, "ridge", &ridge(half_depth + 0.04));
    add_object(scene, "gutters", &gutters(10.0, half_depth - 0.1));
    let shape = turret(15.7, 20.0);
    let mesh = add_mesh(scene, &shape);
    place(
        scene,
        "turret",
        mesh,
        DAffine3::from_translation(DVec3::new(0.0, 0.0, 12.0)),
    );

    let mesh = add_mesh(scene, &dormer(Vec3::ONE));
    let front = 6.9;
    let [_, right, _, left] = Facade::around(front, 0.0);
    for side in [right, left] {
        for x in [-10.8, 0.0, 10.8] {
            let foot = Vec2::new(x, roof::RIDGE - front);
            place(scene, "dormer", mesh, side.world_from_wall(foot));
        }
    }

    let mesh = add_mesh(scene, &chimney(5.6));
    for (x, z) in [(2.6, 7.2), (-2.6, -7.2)] {
        let at = DAffine3::from_translation(DVec3::new(x, 13.5, z));
        place(scene, "chimney", mesh, at);
    }
}

/// A shed of boards behind the house.
fn add_woodshed(scene: &mut Scene) {
    let mut shape = Shape::default();
    let half = 3.4;
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let (wall, back) = (-17.6, -19.6);
    // A roof that falls from the wall to the eaves, seen from the right: y over -z.
    let side = [
        at(half, 0.0, wall),
        at(half, 0.0, back),
        at(half, 2.45, back),
        at(half, 3.2, wall),
    ];
    let other = side.map(|p| p.with_x(-half));
    shape.face(Skin::Planks, &side);
    shape.face(Skin::Planks, &[other[3], other[2], other[1], other[0]]);
    shape.face(Skin::Planks, &[side[1], other[1], other[2], side[2]]);
    let section = [[3.22, wall], [2.3, -20.0], [2.42, -20.0], [3.38, wall]];
    let slab = section.map(|[y, z]| at(-half - 0.3, y, z));
    let (tile, wood) = (Skin::Tiles, Skin::Beam);
    let along = Vec3::X * (2.0 * half + 0.6);
    shape.tube(&slab, along, &[wood, wood, tile, wood]);
    shape.face(wood, &slab.map(|p| p + along));
    shape.face(wood, &[slab[3], slab[2], slab[1], slab[0]]);
    add_object(scene, "woodshed", &shape);
}

#[cfg(test)]
mod tests {
    use super::*;
    use farfield_scene::Wrap;
    use proptest::prelude::*;
    use std::collections::BTreeMap;
    use std::sync::LazyLock;

    /// Painting takes a second, so the tests share one house.
    static HOUSE: LazyLock<Scene> = LazyLock::new(|| house(1));

    /// Every triangle's corners in the world with its object.
    static TRIANGLES: LazyLock<Vec<(u32, [DVec3; 3])>> = LazyLock::new(|| {
        let objects = 0..HOUSE.objects.len() as u32;
        objects
            .flat_map(|object| {
                let triangles = HOUSE.mesh_of(object).triangles.clone();
                triangles.map(move |triangle| {
                    let corners = HOUSE.triangle_in(object, triangle);
                    (object, corners.map(|v| HOUSE.world_position(object, v)))
                })
            })
            .collect()
    });

    fn name(object: u32) -> &'static str {
        &HOUSE.objects[object as usize].name
    }

    #[test]
    fn the_scene_is_sound() {
        assert_eq!(HOUSE.check(), Ok(()));
    }

    #[test]
    fn it_is_exactly_20_by_20_by_40_metres() {
        let [min, max] = HOUSE.bounds().unwrap();
        assert_eq!(min, DVec3::new(-10.0, 0.0, -20.0));
        assert_eq!(max, DVec3::new(10.0, 20.0, 20.0));
    }

    #[test]
    fn it_has_about_2000_triangles() {
        let count = HOUSE.drawn_triangles();
        assert!((1750..=2050).contains(&count), "{count} triangles");
    }

    /// The geometry, and with it all of the scene but the texels, does not depend on the seed.
    #[test]
    fn the_same_seed_gives_the_same_house_and_another_one_only_other_texels() {
        assert_eq!(*HOUSE, house(1));
        let mut other = house(u64::MAX);
        assert_ne!(HOUSE.images, other.images);
        other.images.clone_from(&HOUSE.images);
        assert_eq!(*HOUSE, other);
    }

    #[test]
    fn no_triangle_is_a_sliver() {
        for (object, [a, b, c]) in TRIANGLES.iter() {
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let height = (b - a).cross(c - a).length() / longest;
            assert!(
                height > 0.01,
                "{} has a triangle {height} m high",
                name(*object)
            );
        }
    }

    #[test]
    fn normals_agree_with_the_winding() {
        for &[a, b, c] in &HOUSE.triangles {
            let [pa, pb, pc] = [a, b, c].map(|v| HOUSE.positions[v as usize].as_dvec3());
            let normal = (pb - pa).cross(pc - pa).normalize();
            for v in [a, b, c] {
                let stored = HOUSE.normals[v as usize].as_dvec3();
                // Coordinates up to 20 m carry errors of 2^-20 m, edges are longer than 1 cm: the
                // angle is off by 2^-20 / 0.01 < 1e-3 at most, the cosine by half its square.
                assert!(stored.dot(normal) > 1.0 - 1e-6, "{stored} against {normal}");
                assert!((stored.length() - 1.0).abs() < 1e-6);
            }
        }
    }

    /// Whether each edge of the objects' triangles is used once in each direction.
    fn check_closed(object: u32) -> Result<(), String> {
        let mut uses = BTreeMap::new();
        let triangles = TRIANGLES.iter().filter(|(o, _)| *o == object);
        for (_, corners) in triangles {
            // Adding 0 makes -0 the same as 0.
            let keys = corners.map(|p| (p + 0.0).to_array().map(f64::to_bits));
            for i in 0..3 {
                let [a, b] = [keys[i], keys[(i + 1) % 3]];
                let (edge, direction) = if a < b { ((a, b), 1) } else { ((b, a), -1) };
                let (forth, sum) = uses.entry(edge).or_insert((0, 0));
                *forth += 1;
                *sum += direction;
            }
        }
        match uses.values().find(|&&(count, sum)| count != 2 || sum != 0) {
            Some((count, _)) => Err(format!("an edge of {} is used {count} times", name(object))),
            None => Ok(()),
        }
    }

    #[test]
    fn slabs_roof_ridge_gutters_and_brackets_are_closed() {
        let closed = ["plinth", "floor", "roof", "ridge", "gutters", "bracket"];
        let objects: Vec<u32> = (0..HOUSE.objects.len() as u32)
            .filter(|&object| closed.contains(&name(object)))
            .collect();
        assert_eq!(objects.len(), 11);
        for object in objects {
            assert_eq!(check_closed(object), Ok(()));
        }
    }

    /// Corners of two triangles in one plane that share more than a millimetre of it.
    fn overlap_in_plane(a: &[DVec3; 3], b: &[DVec3; 3], normal: DVec3) -> bool {
        // Convex shapes are apart if an edge normal of either separates them.
        let separates = |p: DVec3, q: DVec3| {
            let axis = (q - p).cross(normal).normalize();
            let range = |t: &[DVec3; 3]| {
                let along = t.map(|c| axis.dot(c - p));
                let min = along.into_iter().fold(f64::INFINITY, f64::min);
                let max = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
                [min, max]
            };
            let ([a0, a1], [b0, b1]) = (range(a), range(b));
            a1.min(b1) - a0.max(b0) < 1e-3
        };
        let edges = |t: &[DVec3; 3]| [0, 1, 2].map(|i| [t[i], t[(i + 1) % 3]]);
        !edges(a)
            .into_iter()
            .chain(edges(b))
            .any(|[p, q]| separates(p, q))
    }

    /// No two triangles that face the same way lie in one plane, or nearly, on top of each other.
    #[test]
    fn nothing_fights_for_depth() {
        let planes: Vec<DVec3> = TRIANGLES
            .iter()
            .map(|(_, [a, b, c])| (b - a).cross(c - a).normalize())
            .collect();
        for (i, (object, a)) in TRIANGLES.iter().enumerate() {
            for (j, (other, b)) in TRIANGLES.iter().enumerate().skip(i + 1) {
                let near = planes[i].dot(planes[j]) > 0.999_99
                    && b.iter().all(|&p| planes[i].dot(p - a[0]).abs() < 4e-3);
                assert!(
                    !near || !overlap_in_plane(a, b, planes[i]),
                    "{} and {} at {}",
                    name(*object),
                    name(*other),
                    a[0]
                );
            }
        }
    }

    #[test]
    fn textures_that_do_not_repeat_stay_in_their_image() {
        let clamped = |t: &usize| {
            let material = &HOUSE.materials[HOUSE.triangle_materials[*t] as usize];
            material.base_color_texture.is_some_and(|texture| {
                HOUSE.textures[texture as usize].wrap == [Wrap::ClampToEdge; 2]
            })
        };
        for t in (0..HOUSE.triangles.len()).filter(clamped) {
            for v in HOUSE.triangles[t] {
                let uv = HOUSE.uvs[v as usize];
                // Computed from coordinates up to 20 m in cells of 1 m and more.
                let inside =
                    uv.cmpge(Vec2::splat(-1e-5)).all() && uv.cmple(Vec2::splat(1.00001)).all();
                assert!(inside, "{uv}");
            }
        }
    }

    /// Distance to the nearest triangle that the ray meets, and whether it sees its front.
    ///
    /// Where several are met at one distance, as on an edge, a front wins.
    fn first_seen(eye: DVec3, direction: DVec3) -> Option<(f64, u32, bool)> {
        let mut nearest: Option<(f64, u32, bool)> = None;
        for &(object, [a, b, c]) in TRIANGLES.iter() {
            // Moeller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997.
            let (ab, ac) = (b - a, c - a);
            let p = direction.cross(ac);
            let determinant = ab.dot(p);
            if determinant == 0.0 {
                continue;
            }
            let from_a = eye - a;
            let u = from_a.dot(p) / determinant;
            let q = from_a.cross(ab);
            let v = direction.dot(q) / determinant;
            let t = ac.dot(q) / determinant;
            let is_hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0;
            let wins = nearest
                .is_none_or(|(best, _, front)| t < best - 1e-6 || (t < best + 1e-6 && !front));
            if is_hit && wins {
                nearest = Some((t, object, determinant > 0.0));
            }
        }
        nearest
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10_000))]

        /// From above the ground, near or far, no line of sight to any triangle meets a back
        /// first: nowhere is there a hole or a turned triangle.
        #[test]
        fn only_fronts_are_seen_from_outside(
            toward in [-1.0..1.0f64, 0.0..1.0, -1.0..1.0],
            distance in 0.0..60.0f64,
            triangle: prop::sample::Index,
            at in [0.0..1.0f64, 0.0..1.0],
        ) {
            // On the box around the house, moved out; low ones are likely, they see most.
            let [x, y, z] = toward;
            let toward = DVec3::new(x, y.powi(3), z);
            let scale = toward.abs().max_element().max(1e-3);
            let eye = toward / scale * (DVec3::new(10.0, 20.0, 20.0) + distance);
            let (_, [a, b, c]) = TRIANGLES[triangle.index(TRIANGLES.len())];
            let target = a + at[0] * (b + at[1] * (c - b) - a);
            let seen = first_seen(eye, (target - eye).normalize());
            prop_assert!(
                seen.is_none_or(|(_, _, front)| front),
                "the back of {} from {eye} to {target}", name(seen.unwrap().1)
            );
        }
    }
}
