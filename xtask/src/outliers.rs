//! Objects that would spoil the default view cell: sky domes, and strays far from all else.
//!
//! The default cell is as far from the scene as the scene is large. A dome around a town, or one
//! forgotten triangle at the horizon, puts it where the town is a few pixels or nothing.

use crate::view_cell;
use farfield_sampling::Tracer;
use farfield_scene::{Mesh, Object, Scene};
use farfield_views::sphere_direction;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

/// How many times larger a scene must be with an outlier than without it. At twice, rooms that
/// are half filled and the outskirts of towns would go; at ten, domes that hug their scene and
/// hide it would stay.
const MUCH: f64 = 4.0;

/// The share of a scene that can be spared, of its triangles and of its area. It keeps a ground
/// plane, which is a few triangles but most of the area, and both of two things that are far
/// apart.
const LITTLE: f64 = 1.0 / 20.0;

/// How much of its own size things may reach out of a dome: they often stand on a ground that
/// is wider.
const OVERHANG: f64 = 1.0 / 20.0;

/// The share of the upper directions that a dome covers, seen from its middle. Terrain around a
/// valley covers less, however high its mountains.
const COVERED: f64 = 0.9;

/// Upper directions that are looked along.
const DIRECTIONS: u32 = 256;

/// What matters about one object.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    /// In the world.
    bounds: [DVec3; 2],
    /// How many it draws.
    triangles: u64,
    /// Of all of them, in any unit.
    area: f64,
}

/// Why an object is an outlier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    /// It is a shell around everything else, seen from inside.
    Dome,
    /// It lies far away from everything else, and is little.
    Stray,
}

/// Takes the outliers out of a scene, says so in `warnings`, and returns their names, each once.
///
/// What has the name of an object that stays can be told apart by no name, so it stays too.
pub(crate) fn leave_out(scene: &mut Scene, warnings: &mut Vec<String>) -> Vec<String> {
    let Some(whole) = scene.bounds() else {
        return Vec::new();
    };
    let mut parts = parts_of(scene);
    // What draws nothing is nowhere.
    parts.retain(|(_, part)| part.triangles > 0);
    let (objects, parts): (Vec<usize>, Vec<Part>) = parts.into_iter().unzip();
    let found = outliers(&parts, |part| is_seen_from_inside(scene, objects[part]));

    let mut names: Vec<String> = Vec::new();
    for (part, reason) in &found {
        let name = &scene.objects[objects[*part]].name;
        if names.contains(name) {
            continue;
        }
        let namesakes = scene.objects.iter().enumerate();
        let stays = |object| !found.iter().any(|(part, _)| objects[*part] == object);
        let ambiguous = namesakes
            .filter(|(_, object)| object.name == *name)
            .any(|(object, _)| stays(object));
        warnings.push(warning(name, *reason, whole, ambiguous));
        if !ambiguous {
            names.push(name.clone());
        }
    }
    scene.objects.retain(|object| !names.contains(&object.name));
    names
}

/// What is said of one outlier, and what can be done about it.
fn warning(name: &str, reason: Reason, whole: [DVec3; 2], ambiguous: bool) -> String {
    let what = match reason {
        Reason::Dome => {
            "it encloses everything else, is seen from inside and much larger, as sky domes are"
        }
        Reason::Stray => {
            "it is little, and so far from everything else that the scene is at least four times \
             larger with it"
        }
    };
    if ambiguous {
        return format!(
            "'{name}' spoils the default view cell ({what}), but is not left out, as other \
             objects have its name: name the view cell with --view-cell, or give it another name"
        );
    }
    let cell = view_cell::describe(&view_cell::default_cell(whole));
    format!(
        "'{name}' is left out: {what}; --exclude leaves it out without this warning, any \
         --view-cell keeps it, for instance {cell}, the default with all in"
    )
}

/// The outliers among the objects of a scene, each with its reason: those that are left when
/// removed are none, and never all.
///
/// * `is_shell` - whether the part of an index covers the sky above its middle
fn outliers(parts: &[Part], is_shell: impl Fn(usize) -> bool) -> Vec<(usize, Reason)> {
    let mut kept: Vec<usize> = (0..parts.len()).collect();
    let mut found = Vec::new();
    loop {
        let left: Vec<Part> = kept.iter().map(|part| parts[*part]).collect();
        let dome = enclosing(&left).filter(|index| is_shell(kept[*index]));
        let (out, reason) = match dome {
            Some(index) => (vec![index], Reason::Dome),
            None => (strays(&left), Reason::Stray),
        };
        if out.is_empty() {
            found.sort_by_key(|(part, _)| *part);
            return found;
        }
        found.extend(out.iter().map(|index| (kept[*index], reason)));
        let mut index = 0..;
        kept.retain(|_| index.next().is_some_and(|index| !out.contains(&index)));
    }
}

/// The part that has all others inside, is much larger than they are, and has no more triangles.
///
/// Larger is meant twice: its box has 4^3 times the volume of the boxes of the others together,
/// and along some axis four times the length of theirs. The ground in a dome is as wide as the
/// dome, but its box holds next to nothing; a room with furniture is rarely four times as high.
fn enclosing(parts: &[Part]) -> Option<usize> {
    let holds = |index: &usize| {
        let [min, max] = parts[*index].bounds;
        let size = max - min;
        let overhang = DVec3::splat(OVERHANG * size.max_element());
        let others = || {
            let all = parts.iter().enumerate();
            all.filter(|(other, _)| other != index).map(|(_, p)| p)
        };
        let inside = |part: &Part| {
            part.bounds[0].cmpge(min - overhang).all() && part.bounds[1].cmple(max + overhang).all()
        };
        let Some(rest) = others().map(|part| part.bounds).reduce(enclose) else {
            return false;
        };
        // In boxes of this size, lest volumes overflow.
        let volume = |part: &Part| ((part.bounds[1] - part.bounds[0]) / size).element_product();
        size.min_element() > 0.0
            && others().all(inside)
            && size.cmpge(MUCH * (rest[1] - rest[0])).any()
            && MUCH.powi(3) * others().map(volume).sum::<f64>() <= 1.0
            && parts[*index].triangles <= others().map(|part| part.triangles).sum()
    };
    // Only the largest can hold all others.
    let size = |index: &usize| (parts[*index].bounds[1] - parts[*index].bounds[0]).length();
    (0..parts.len())
        .max_by(|a, b| size(a).total_cmp(&size(b)))
        .filter(holds)
}

/// Parts that are little together, and without which the rest is four times smaller.
///
/// The middle of the scene is where half of the triangles are to either side, whatever lies
/// beyond. From there outwards, the first part that makes the box of all before it four times as
/// large is a stray, and so is all behind it, provided that is at most a twentieth of all
/// triangles and of all area. A scene that thins out has no such step.
///
/// Parts that reach equally far are never torn apart, so their order does not matter: where
/// nearly all triangles are before a step, the middle is among them, so their box is at least as
/// large as their reach, and a box four times as large reaches twice as far.
fn strays(parts: &[Part]) -> Vec<usize> {
    let middle = middle(parts);
    let reach = |index: &usize| {
        let [min, max] = parts[*index].bounds;
        (max - middle).max(middle - min).max_element()
    };
    let mut outwards: Vec<usize> = (0..parts.len()).collect();
    outwards.sort_by(|a, b| reach(a).total_cmp(&reach(b)));

    let sums = |indices: &[usize]| {
        let parts = indices.iter().map(|index| &parts[*index]);
        parts.fold((0, 0.0), |(triangles, area), part| {
            (triangles + part.triangles, area + part.area)
        })
    };
    let all = sums(&outwards);
    let little = |(triangles, area): (u64, f64)| {
        triangles as f64 <= LITTLE * all.0 as f64 && area <= LITTLE * all.1
    };
    let extent = |[min, max]: [DVec3; 2]| (max - min).max_element();
    let mut near: Option<[DVec3; 2]> = None;
    for (i, index) in outwards.iter().enumerate() {
        let bounds = parts[*index].bounds;
        let grown = near.map_or(bounds, |near| enclose(near, bounds));
        let steps = near.is_some_and(|near| {
            let before = extent(near);
            before > 0.0 && extent(grown) >= MUCH * before
        });
        if steps && little(sums(&outwards[i..])) {
            return outwards.split_off(i);
        }
        near = Some(grown);
    }
    Vec::new()
}

/// Along every axis, the middle of the box that has the median triangle.
fn middle(parts: &[Part]) -> DVec3 {
    let total: u64 = parts.iter().map(|part| part.triangles).sum();
    let along = |axis: usize| {
        let mut middles: Vec<(f64, u64)> = parts
            .iter()
            .map(|part| {
                (
                    part.bounds[0].midpoint(part.bounds[1])[axis],
                    part.triangles,
                )
            })
            .collect();
        middles.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut before = 0;
        let median = middles.iter().find(|(_, triangles)| {
            before += triangles;
            2 * before >= total
        });
        median.map_or(0.0, |(at, _)| *at)
    };
    DVec3::from_array([0, 1, 2].map(along))
}

/// All objects that draw something, with areas in squares of the scene's extent.
fn parts_of(scene: &Scene) -> Vec<(usize, Part)> {
    let Some([min, max]) = scene.bounds() else {
        return Vec::new();
    };
    let unit = (max - min).max_element();
    let part = |object: usize| {
        let id = object as u32;
        let triangles = scene.mesh_of(id).triangles.clone();
        let bounds = scene.bounds_of(id)?;
        let area = |triangle: u32| {
            let vertices = scene.triangles[triangle as usize];
            let [a, b, c] = vertices.map(|vertex| scene.world_position(id, vertex) / unit);
            (b - a).cross(c - a).length() / 2.0
        };
        let part = Part {
            bounds,
            triangles: triangles.len() as u64,
            area: triangles.map(area).sum(),
        };
        Some((object, part))
    };
    let objects = (0..scene.objects.len()).into_par_iter();
    objects.filter_map(part).collect()
}

/// Whether an object, seen from the middle of its box, covers nearly all of what is above.
///
/// A triangle covers if it can be seen from there: its front, or its back where its material
/// shows both.
fn is_seen_from_inside(scene: &Scene, object: usize) -> bool {
    let id = object as u32;
    let Some([min, max]) = scene.bounds_of(id) else {
        return false;
    };
    let middle = min.midpoint(max);
    let shows = |triangle: &u32| {
        let material = scene.triangle_materials[*triangle as usize];
        let corners = scene.triangle_in(id, *triangle);
        let [a, b, c] = corners.map(|vertex| scene.world_position(id, vertex) - middle);
        scene.materials[material as usize].double_sided || a.dot((b - a).cross(c - a)) < 0.0
    };
    let mesh = scene.mesh_of(id);
    let shown = mesh.triangles.clone().filter(shows);
    let triangles: Vec<[u32; 3]> = shown.map(|t| scene.triangles[t as usize]).collect();
    let shell = Scene {
        positions: scene.positions.clone(),
        meshes: vec![Mesh {
            vertices: mesh.vertices.clone(),
            triangles: 0..triangles.len() as u32,
        }],
        objects: vec![Object {
            mesh: 0,
            world_from_mesh: DAffine3::from_translation(-middle)
                * scene.objects[object].world_from_mesh,
            name: String::new(),
        }],
        triangles,
        ..Scene::default()
    };
    let tracer = Tracer::new(&shell);
    // The first half of all directions are those above.
    let covered = (0..DIRECTIONS)
        .map(|i| sphere_direction(i, 2 * DIRECTIONS))
        .filter(|up| {
            tracer
                .nearest_to_range(DVec3::ZERO, *up, [0.0, f64::INFINITY])
                .is_some()
        })
        .count();
    covered as f64 >= COVERED * f64::from(DIRECTIONS)
}

fn enclose([min_a, max_a]: [DVec3; 2], [min_b, max_b]: [DVec3; 2]) -> [DVec3; 2] {
    [min_a.min(min_b), max_a.max(max_b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::BuiltIn;
    use proptest::prelude::*;

    /// A box by its middle and size.
    fn part(middle: [f64; 3], size: [f64; 3], triangles: u64, area: f64) -> Part {
        let (middle, half) = (DVec3::from(middle), DVec3::from(size) / 2.0);
        Part {
            bounds: [middle - half, middle + half],
            triangles,
            area,
        }
    }

    /// What parts of this area are taken for.
    const SHELL_AREA: f64 = 12345.0;

    fn found(parts: &[Part]) -> Vec<(usize, Reason)> {
        outliers(parts, |index| parts[index].area == SHELL_AREA)
    }

    /// Coordinates of few binary digits, so that moving them rounds nothing.
    fn coordinates(reach: i32) -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3((-reach..=reach).prop_map(|n| f64::from(n) / 8.0))
    }

    fn sizes() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3((0..=32u32).prop_map(|n| f64::from(n) / 8.0))
    }

    /// A cluster, and perhaps things far away, large shells around the origin, and flat ground.
    fn scenes() -> impl Strategy<Value = Vec<Part>> {
        let near = (coordinates(40), sizes(), 1..500u64, 0.0..10f64);
        let far = (coordinates(100_000), sizes(), 1..30u64, 0.0..2f64);
        let shell = (coordinates(4), 1..2000u32, 1..300u64);
        let ground = (1..2000u32, 0.0..1e6f64);
        let make = |(p, s, t, a): ([f64; 3], [f64; 3], u64, f64)| part(p, s, t, a);
        (
            prop::collection::vec(near.prop_map(make), 0..12),
            prop::collection::vec(far.prop_map(make), 0..4),
            prop::collection::vec(shell, 0..2),
            prop::collection::vec(ground, 0..2),
        )
            .prop_map(|(near, far, shells, grounds)| {
                let shells = shells
                    .into_iter()
                    .map(|(at, size, t)| part(at, [f64::from(size); 3], t, SHELL_AREA));
                let grounds = grounds.into_iter().map(|(size, area)| {
                    part([0.0; 3], [f64::from(size), 0.0, f64::from(size)], 2, area)
                });
                near.into_iter()
                    .chain(far)
                    .chain(shells)
                    .chain(grounds)
                    .collect()
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Something is left, and nothing of it is an outlier.
        #[test]
        fn what_is_left_has_no_outliers(parts in scenes()) {
            let out = found(&parts);
            let is_out = |index: &usize| out.iter().any(|(part, _)| part == index);
            let left: Vec<Part> = (0..parts.len())
                .filter(|index| !is_out(index))
                .map(|index| parts[index])
                .collect();
            prop_assert_eq!(left.is_empty(), parts.is_empty());
            prop_assert_eq!(found(&left), []);
        }

        /// Neither unit nor origin nor order matters.
        #[test]
        fn scale_place_and_order_do_not_matter(
            (parts, order) in scenes().prop_flat_map(|parts| {
                let order: Vec<usize> = (0..parts.len()).collect();
                (Just(parts), Just(order).prop_shuffle())
            }),
            exponent in -40..40i32,
            by in coordinates(1_000_000),
        ) {
            let scale = 2f64.powi(exponent);
            let changed: Vec<Part> = order.iter().map(|index| Part {
                bounds: parts[*index].bounds.map(|corner| (corner + DVec3::from(by)) * scale),
                ..parts[*index]
            }).collect();
            let mut expected = found(&parts);
            let mut same: Vec<(usize, Reason)> =
                found(&changed).iter().map(|(part, reason)| (order[*part], *reason)).collect();
            expected.sort_by_key(|(part, _)| *part);
            same.sort_by_key(|(part, _)| *part);
            prop_assert_eq!(same, expected);
        }

        /// Little things are strays where they lie four times as far out as all else reaches, in
        /// whatever directions.
        #[test]
        fn little_things_far_away_are_strays(
            near in prop::collection::vec((coordinates(40), sizes()), 1..10),
            far in prop::collection::vec((sizes(), prop::sample::select(&DVec3::AXES[..]), any::<bool>(), 100..10_000u32), 1..4),
        ) {
            let mut parts: Vec<Part> =
                near.iter().map(|(at, size)| part(*at, *size, 500, 50.0)).collect();
            // One that is never a point.
            parts.push(part([0.0; 3], [1.0; 3], 500, 50.0));
            let count = parts.len();
            for (size, axis, negative, distance) in far {
                let sign = if negative { -1.0 } else { 1.0 };
                parts.push(part((axis * sign * f64::from(distance)).into(), size, 1, 0.1));
            }
            let expected: Vec<_> = (count..parts.len()).map(|i| (i, Reason::Stray)).collect();
            prop_assert_eq!(found(&parts), expected);
        }
    }

    #[test]
    fn a_dome_is_found_behind_a_stray_and_a_stray_in_a_dome() {
        let town = part([0.0, 5.0, 0.0], [60.0, 10.0, 60.0], 1000, 900.0);
        let ground = part([0.0; 3], [204.0, 0.0, 204.0], 2, 40_000.0);
        let dome = part([0.0, 50.0, 0.0], [200.0, 100.0, 200.0], 60, SHELL_AREA);
        let stray = part([0.0, 0.0, -9000.0], [1.0; 3], 12, 6.0);
        let inner = part([0.0, 95.0, 0.0], [1.0; 3], 12, 6.0);
        assert_eq!(
            found(&[dome, town, ground, stray]),
            [(0, Reason::Dome), (3, Reason::Stray)]
        );
        // The sun in the dome is as high above as the dome, so there it is no shell around little.
        assert_eq!(found(&[town, ground, dome, inner]), []);
        let far = part([0.0, 0.0, -9000.0], [20_000.0; 3], 60, SHELL_AREA);
        assert_eq!(
            found(&[town, ground, stray, far]),
            [(2, Reason::Stray), (3, Reason::Dome)]
        );
    }

    /// What must not go.
    #[test]
    fn what_belongs_to_a_scene_stays() {
        let house = part([0.0, 5.0, 0.0], [10.0; 3], 2000, 600.0);
        let kept = |parts: &[Part]| assert_eq!(found(parts), [], "{parts:?}");
        kept(&[]);
        kept(&[house]);
        // A ground plane of any size.
        for size in [12.0, 30.0, 100.0, 1e4] {
            let ground = part([0.0; 3], [size, 0.0, size], 2, size * size);
            kept(&[house, ground]);
        }
        // Two equals far apart, and three of which one is farther.
        let moved = |x: f64| part([x, 5.0, 0.0], [10.0; 3], 2000, 600.0);
        kept(&[house, moved(1e6)]);
        kept(&[house, moved(20.0), moved(1e6)]);
        // A mast that is as high as a few houses.
        kept(&[house, part([0.0, 15.0, 0.0], [0.1, 30.0, 0.1], 8, 10.0)]);
        // A room around its furniture.
        let room = part([0.0, 1.5, 0.0], [6.0, 3.0, 5.0], 12, SHELL_AREA);
        let cupboard = part([2.0, 0.9, 1.0], [1.0, 1.8, 0.5], 40, 5.0);
        let table = part([0.0, 0.4, 0.0], [2.0, 0.8, 1.0], 60, 5.0);
        kept(&[room, cupboard, table]);
        // A detailed hall around a lamp.
        let lamp = part([0.0, 0.1, 0.0], [0.1, 0.2, 0.1], 500, 0.1);
        kept(&[
            part([0.0, 2.5, 0.0], [10.0, 5.0, 10.0], 9000, SHELL_AREA),
            lamp,
        ]);
        // Suburbs that thin out.
        let suburbs = (0..20).map(|i| {
            let distance = 1.8f64.powi(i);
            part([distance, 0.0, 0.0], [1.0; 3], 10, 10.0)
        });
        kept(&suburbs.collect::<Vec<_>>());
    }

    #[test]
    fn built_in_scenes_have_no_outliers() {
        for scene in [BuiltIn::House, BuiltIn::default()] {
            let mut warnings = Vec::new();
            assert!(leave_out(&mut scene.scene(), &mut warnings).is_empty());
            assert_eq!(warnings, [""; 0]);
        }
    }
}
