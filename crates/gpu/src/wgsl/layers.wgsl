// Which triangles may touch which texels of layers, and be what these show.
//
// Numbers have 24 bits. Where a triangle lies is known but for its doubt, and whatever may be so
// within that doubt is told.

struct Task {
    // From the middle of a layer to its borders, in texels.
    half: vec2f,
    // Of a layer, in texels.
    width: u32,
    texels: u32,
    // Layers that are looked at.
    begin: u32,
    end: u32,
    // All layers.
    layers: u32,
    objects: u32,
    // Corners of the view cell.
    corners: u32,
    // How many touches there is room for.
    room: u32,
}

// Where an object stands before the camera: rows that take a point of its mesh to its depth, and to
// texels right of and below the middle of the picture times that.
struct Placed {
    x: vec4f,
    y: vec4f,
    depth: vec4f,
    // How far each can be off.
    doubt: vec3f,
    // The first of its triangles among all that are drawn, and in the list of triangles.
    first_drawn: u32,
    first_triangle: u32,
    // -1 where triangles turn their winding.
    winding: f32,
    padding: vec2u,
}

struct Touches {
    count: atomic<u32>,
    // Bits that say that a triangle is known too vaguely, or that there are too many to be counted.
    wrong: atomic<u32>,
    // Texel of the layers looked at, and number of the triangle among all that are drawn.
    list: array<vec2u>,
}

@group(0) @binding(0) var<uniform> task: Task;
@group(0) @binding(1) var<storage, read> positions: array<f32>;
// Three vertices, and what the material is like.
@group(0) @binding(2) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(3) var<storage, read> objects: array<Placed>;
// Of the view cell, homogeneous, where objects are placed.
@group(0) @binding(4) var<storage, read> corners: array<vec4f>;
// Depths between layers, ascending, and those at both ends.
@group(0) @binding(5) var<storage, read> borders: array<f32>;
// Of each texel, the complement of the best rank that is sure.
@group(0) @binding(6) var<storage, read_write> best: array<atomic<u32>>;
// Texels that something masked may touch, a bit each.
@group(0) @binding(7) var<storage, read_write> masked: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> touches: Touches;

// Of traits, besides those of materials.
const MAY_BE_FRONT = 4u;
const IS_FRONT = 8u;
const IS_SEEN = 16u;
const VAGUE = 32u;

// Rounding, in parts of a number: a few operations', and many operations'.
const FEW = 0x1p-22;
const MANY = 0x1p-19;
// No length, in texels.
const FLAT = 1e-9;

struct Piece {
    @builtin(position) position: vec4f,
    // Of its corners: texels from the middle of the picture, and reciprocal depth. Last, doubt of
    // texels, and of depths in parts of them.
    @location(0) @interpolate(flat) a: vec4f,
    @location(1) @interpolate(flat) b: vec4f,
    @location(2) @interpolate(flat) c: vec3f,
    // Among all that are drawn, and traits.
    @location(3) @interpolate(flat) number: vec2u,
}

// The object of which a triangle is drawn.
fn object_of(drawn: u32) -> u32 {
    var first = 0u;
    var end = task.objects;
    while end - first > 1u {
        let middle = (first + end) / 2u;
        if objects[middle].first_drawn <= drawn {
            first = middle;
        } else {
            end = middle;
        }
    }
    return first;
}

fn placed(object: Placed, vertex: u32) -> vec3f {
    let at = 3u * vertex;
    let point = vec4f(positions[at], positions[at + 1u], positions[at + 2u], 1.0);
    return vec3f(dot(object.x, point), dot(object.y, point), dot(object.depth, point));
}

// The cross product of magnitudes, its parts added.
fn spread(u: vec3f, v: vec3f) -> vec3f {
    return u.yzx * v.zxy + u.zxy * v.yzx;
}

// A plane through a point, and how far its normal and the point can be off.
struct Plane {
    normal: vec3f,
    normal_doubt: vec3f,
    point: vec3f,
    doubt: vec3f,
}

fn plane_of(a: vec3f, b: vec3f, c: vec3f, doubt: vec3f, winding: f32) -> Plane {
    let u = b - a;
    let v = c - a;
    let u_doubt = 2.0 * doubt + FEW * abs(u);
    let v_doubt = 2.0 * doubt + FEW * abs(v);
    let off = spread(u_doubt, abs(v)) + spread(abs(u), v_doubt) + spread(u_doubt, v_doubt);
    return Plane(cross(u, v) * winding, off + FEW * spread(abs(u), abs(v)), a, doubt);
}

// How far before a plane a point lies, and how far that can be off, in any unit.
fn before(plane: Plane, point: vec4f) -> vec2f {
    let to = point.xyz - plane.point * point.w;
    let to_doubt = plane.doubt * point.w + FEW * (abs(point.xyz) + abs(plane.point) * point.w);
    let off = dot(plane.normal_doubt, abs(to) + to_doubt) + dot(abs(plane.normal), to_doubt);
    // And what vanishes because it is too small for a number.
    return vec2f(dot(plane.normal, to), off + MANY * dot(abs(plane.normal), abs(to)) + 1e-30);
}

// What of the sides of a triangle can be seen.
fn traits_of(material: u32, plane: Plane) -> u32 {
    if (material & DOUBLE_SIDED) != 0u {
        return material | MAY_BE_FRONT | IS_FRONT | IS_SEEN;
    }
    var traits = material;
    let camera = before(plane, vec4f(0.0, 0.0, 0.0, 1.0));
    if camera.x >= -camera.y {
        traits |= MAY_BE_FRONT;
    }
    if camera.x > camera.y {
        traits |= IS_FRONT;
    }
    var is_hidden = true;
    for (var i = 0u; i < task.corners; i++) {
        let corner = before(plane, corners[i]);
        if corner.x >= -corner.y {
            is_hidden = false;
        }
        if corner.x > corner.y {
            traits |= IS_SEEN;
        }
    }
    return select(traits, HIDDEN, is_hidden);
}

const HIDDEN = 0xffffffffu;

// Four corners of a rectangle around all texels that a triangle may touch: of whole texels around a
// small one, along its longest edge around a large one.
@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) drawn: u32) -> Piece {
    let towards = vec2f(f32(corner & 1u), f32(corner >> 1u));
    var piece: Piece;
    piece.position = vec4f(2.0, 2.0, 0.5, 1.0);
    let object = objects[object_of(drawn)];
    let triangle = triangles[object.first_triangle + (drawn - object.first_drawn)];
    let a = placed(object, triangle.x);
    let b = placed(object, triangle.y);
    let c = placed(object, triangle.z);
    let nearest = min(min(a.z, b.z), c.z) - object.doubt.z;
    let traits = traits_of(triangle.w, plane_of(a, b, c, object.doubt, object.winding));
    if traits == HIDDEN {
        return piece;
    }
    piece.number = vec2u(drawn, traits);
    let everywhere = vec4f(2.0 * towards - 1.0, 0.5, 1.0);
    if nearest <= 3.0 * object.doubt.z {
        piece.number.y = VAGUE;
        piece.position = everywhere;
        return piece;
    }
    let p = a.xy / a.z;
    let q = b.xy / b.z;
    let r = c.xy / c.z;
    let reach = max(max(abs(p), abs(q)), abs(r));
    let off = (object.doubt.xy + reach * object.doubt.z) / nearest;
    let doubt = 1.01 * max(off.x, off.y)
        + 2.0 * FEW * (max(reach.x, reach.y) + max(task.half.x, task.half.y))
        + SQUARE_DOUBT;
    if doubt > 0.25 {
        piece.number.y = VAGUE;
        piece.position = everywhere;
        return piece;
    }
    piece.a = vec4f(p, 1.0 / a.z, doubt);
    piece.b = vec4f(q, 1.0 / b.z, 1.01 * object.doubt.z / nearest + MANY);
    piece.c = vec3f(r, 1.0 / c.z);

    let low = floor(min(min(p, q), r) - doubt + task.half);
    let high = floor(max(max(p, q), r) + doubt + task.half) + 1.0;
    let begin = max(low, vec2f(0.0));
    let end = min(high, 2.0 * task.half);
    if any(begin >= end) {
        return piece;
    }
    var at = mix(begin, end, towards) - task.half;
    let size = end - begin;
    if min(size.x, size.y) > 8.0 {
        let edges = array(q - p, r - q, p - r);
        var longest = edges[0];
        for (var i = 1; i < 3; i++) {
            if dot(edges[i], edges[i]) > dot(longest, longest) {
                longest = edges[i];
            }
        }
        let along = normalize(longest);
        let across = vec2f(-along.y, along.x);
        let u = vec3f(dot(along, p), dot(along, q), dot(along, r));
        let v = vec3f(dot(across, p), dot(across, q), dot(across, r));
        // More than half of a texel's diagonal.
        let margin = 0.75 + 2.0 * doubt;
        let least = vec2f(min(min(u.x, u.y), u.z), min(min(v.x, v.y), v.z)) - margin;
        let most = vec2f(max(max(u.x, u.y), u.z), max(max(v.x, v.y), v.z)) + margin;
        let turned = mix(least, most, towards);
        at = along * turned.x + across * turned.y;
    }
    piece.position = vec4f(at.x / task.half.x, -at.y / task.half.y, 0.5, 1.0);
    return piece;
}

// What of a triangle a texel sees. Points are relative to the texel's centre; their third number is
// the reciprocal depth.
struct Contact {
    // Depths on what of the triangle may lie in the texel: the least and the greatest. None if these
    // are the other way round.
    depths: vec2f,
    // Whether the triangle surely lies over the centre, or surely does not.
    is_over: bool,
    is_beside: bool,
    // Depths that it may have there, if it surely has some.
    center: vec2f,
    // Distances from the centre to its border, and depths there.
    distances: vec2f,
    nearest: vec2f,
    // Whether that point of the border surely lies in the texel.
    is_in: bool,
}

// Extends a range of reciprocal depths by those on what of an edge lies in a square.
fn on_edge(p: vec3f, q: vec3f, half: f32, range: vec2f) -> vec2f {
    let along = q.xy - p.xy;
    var first = 0.0;
    var last = 1.0;
    for (var axis = 0; axis < 2; axis++) {
        if abs(along[axis]) < FLAT {
            if abs(p[axis]) > half {
                return range;
            }
            continue;
        }
        let met = (vec2f(-half, half) - p[axis]) / along[axis];
        first = max(first, min(met.x, met.y));
        last = min(last, max(met.x, met.y));
    }
    if first > last {
        return range;
    }
    return including(including(range, between(p.z, q.z, first)), between(p.z, q.z, last));
}

// Right to a few parts of the result, however different p and q are.
fn between(p: f32, q: f32, t: f32) -> f32 {
    return p * (1.0 - t) + q * t;
}

fn including(range: vec2f, value: f32) -> vec2f {
    return vec2f(min(range.x, value), max(range.y, value));
}

// Extends a range of reciprocal depths by those at the corners of a square on one of its sides, as
// far as a triangle reaches along it.
fn on_side(a: vec3f, b: vec3f, c: vec3f, y: f32, half: f32, range: vec2f) -> vec2f {
    // Columns and reciprocal depths of the ends of what the line through that side meets.
    var left = vec2f(NOTHING, 0.0);
    var right = vec2f(-NOTHING, 0.0);
    let ends = array(a, b, c, a);
    for (var i = 0; i < 3; i++) {
        let p = ends[i];
        let q = ends[i + 1];
        if min(p.y, q.y) > y || max(p.y, q.y) < y || p.y == q.y {
            continue;
        }
        let t = clamp((y - p.y) / (q.y - p.y), 0.0, 1.0);
        let met = vec2f(between(p.x, q.x, t), between(p.z, q.z, t));
        if met.x < left.x {
            left = met;
        }
        if met.x >= right.x {
            right = met;
        }
    }
    if left.x > half || right.x < -half {
        return range;
    }
    let length = right.x - left.x;
    if length < FLAT {
        return including(including(range, left.y), right.y);
    }
    let met = (clamp(vec2f(-half, half), left.xx, right.xx) - left.x) / length;
    return including(including(range, between(left.y, right.y, met.x)), between(left.y, right.y, met.y));
}

const NOTHING = 1e30;

// Which side of an edge the origin lies on, times the edge's length and its distance, and how far
// that can be off.
fn turn(p: vec2f, q: vec2f, doubt: f32) -> vec2f {
    let reach = abs(p.x) + abs(p.y) + abs(q.x) + abs(q.y) + 2.0 * doubt;
    let rounding = FEW * (abs(p.x * q.y) + abs(p.y * q.x));
    return vec2f(p.x * q.y - p.y * q.x, doubt * reach + rounding);
}

// The point of an edge that is nearest to the origin.
fn nearest_on(p: vec3f, q: vec3f) -> vec3f {
    let along = q.xy - p.xy;
    let length_squared = dot(along, along);
    var t = 0.0;
    if length_squared > FLAT * FLAT {
        t = clamp(-dot(p.xy, along) / length_squared, 0.0, 1.0);
    }
    return vec3f(between(p.x, q.x, t), between(p.y, q.y, t), between(p.z, q.z, t));
}

// Least and greatest depth that reciprocals may stand for.
fn depths_of(reciprocals: vec2f, doubt: f32) -> vec2f {
    return vec2f((1.0 - doubt) / reciprocals.y, (1.0 + doubt) / reciprocals.x);
}

fn contact_of(piece: Piece) -> Contact {
    let center = floor(piece.position.xy) + 0.5 - task.half;
    let a = vec3f(piece.a.xy - center, piece.a.z);
    let b = vec3f(piece.b.xy - center, piece.b.z);
    let c = vec3f(piece.c.xy - center, piece.c.z);
    let doubt = piece.a.w;
    let depth_doubt = piece.b.w;
    var found: Contact;

    let half = 0.5 + 2.0 * doubt;
    let low = min(min(a.xy, b.xy), c.xy);
    let high = max(max(a.xy, b.xy), c.xy);
    let all = vec2f(min(min(a.z, b.z), c.z), max(max(a.z, b.z), c.z));
    if any(low > vec2f(half)) || any(high < vec2f(-half)) {
        found.depths = vec2f(1.0, 0.0);
        return found;
    }
    var range = all;
    if any(low < vec2f(-half)) || any(high > vec2f(half)) {
        range = vec2f(NOTHING, 0.0);
        range = on_edge(a, b, half, range);
        range = on_edge(b, c, half, range);
        range = on_edge(c, a, half, range);
        range = on_side(a, b, c, -half, half, range);
        range = on_side(a, b, c, half, half, range);
    }
    if range.x > range.y {
        found.depths = vec2f(1.0, 0.0);
        return found;
    }
    found.depths = depths_of(range, depth_doubt);

    let turns = array(turn(b.xy, c.xy, doubt), turn(c.xy, a.xy, doubt), turn(a.xy, b.xy, doubt));
    let weights = vec3f(turns[0].x, turns[1].x, turns[2].x);
    let off = vec3f(turns[0].y, turns[1].y, turns[2].y);
    let is_left = weights > off;
    let is_right = weights < -off;
    found.is_over = all_of(is_left) || all_of(is_right);
    found.is_beside = (any(is_left) && any(is_right))
        || any(low > vec2f(doubt)) || any(high < vec2f(-doubt));
    if found.is_over {
        let sum = abs(weights.x + weights.y + weights.z);
        let at = dot(abs(weights), vec3f(a.z, b.z, c.z)) / sum;
        let rest = sum - (off.x + off.y + off.z);
        // Rounding of a sum of positive numbers is far within the doubt of depths.
        let error = (off.x + off.y + off.z) * (all.y - all.x) / max(rest, FLAT * FLAT);
        let reciprocals = clamp(vec2f(at - error, at + error), all.xx, all.yy);
        found.center = depths_of(reciprocals, depth_doubt);
    }

    var nearest = nearest_on(a, b);
    for (var i = 0; i < 2; i++) {
        let other = nearest_on(select(b, c, i == 1), select(c, a, i == 1));
        if dot(other.xy, other.xy) < dot(nearest.xy, nearest.xy) {
            nearest = other;
        }
    }
    let distance = length(nearest.xy);
    found.distances = vec2f(max(distance - 2.0 * doubt, 0.0), distance + 2.0 * doubt);
    found.nearest = depths_of(nearest.zz, depth_doubt);
    found.is_in = max(abs(nearest.x), abs(nearest.y)) < 0.5 - 2.0 * doubt;
    return found;
}

fn all_of(are: vec3<bool>) -> bool {
    return are.x && are.y && are.z;
}

// How many borders lie before a depth, and with `are_met` also at it.
fn borders_before(depth: f32, are_met: bool) -> u32 {
    var first = 0u;
    var end = task.layers + 1u;
    while first < end {
        let middle = (first + end) / 2u;
        let border = borders[middle];
        if border < depth || (are_met && border == depth) {
            first = middle + 1u;
        } else {
            end = middle;
        }
    }
    return first;
}

// The layers looked at that depths may lie in: first and end. The first and the last of all layers
// hold also what is before and behind.
fn layers_of(depths: vec2f) -> vec2u {
    let last = task.layers - 1u;
    let first = min(max(borders_before(depths.x, false), 1u) - 1u, last);
    let end = clamp(borders_before(depths.y, true), first + 1u, task.layers);
    return vec2u(max(first, task.begin), min(end, task.end));
}

// Whether depths surely lie in a layer.
fn are_in(depths: vec2f, layer: u32) -> bool {
    return (layer == 0u || depths.x > borders[layer])
        && (layer + 1u == task.layers || depths.y < borders[layer + 1u]);
}

// Whether depths may lie in a layer.
fn may_be_in(depths: vec2f, layer: u32) -> bool {
    return (layer == 0u || depths.y >= borders[layer])
        && (layer + 1u == task.layers || depths.x <= borders[layer + 1u]);
}

// Ranks as the CPU has them, the least the best: 0 front faces over the centre, 1 front faces beside
// it, 2 and 3 back faces alike; then the depth or the squared distance, below 2.
fn rank(kind: u32, value: f32) -> u32 {
    return (kind << 30u) | bitcast<u32>(clamp(value, 0.0, MOST));
}

const MOST = 1.99;

fn texel_of(position: vec4f, layer: u32) -> u32 {
    let at = vec2u(position.xy);
    return (layer - task.begin) * task.texels + at.y * task.width + at.x;
}

// Notes the best that is sure of each texel.
@fragment
fn sure(piece: Piece) {
    let traits = piece.number.y;
    if (traits & VAGUE) != 0u {
        atomicOr(&touches.wrong, IS_VAGUE);
        return;
    }
    let is_masked = (traits & MASKED) != 0u;
    if !is_masked && (traits & IS_SEEN) == 0u {
        return;
    }
    let contact = contact_of(piece);
    if contact.depths.x > contact.depths.y {
        return;
    }
    let kind = select(2u, 0u, (traits & IS_FRONT) != 0u);
    let layers = layers_of(contact.depths);
    for (var layer = layers.x; layer < layers.y; layer++) {
        let texel = texel_of(piece.position, layer);
        if is_masked {
            atomicOr(&masked[texel / 32u], 1u << (texel % 32u));
        } else if contact.is_over && are_in(contact.center, layer) {
            note(texel, kind, contact.center.y * (1.0 + FEW));
        } else if contact.is_in && are_in(contact.nearest, layer) {
            let distance = contact.distances.y * (1.0 + FEW);
            note(texel, kind + 1u, distance * distance);
        }
    }
}

fn note(texel: u32, kind: u32, value: f32) {
    if value < MOST {
        atomicMax(&best[texel], ~rank(kind, value));
    }
}

// Lists what the best that is sure does not beat.
@fragment
fn possible(piece: Piece) {
    let traits = piece.number.y;
    if (traits & VAGUE) != 0u {
        return;
    }
    let contact = contact_of(piece);
    if contact.depths.x > contact.depths.y {
        return;
    }
    let kind = select(2u, 0u, (traits & MAY_BE_FRONT) != 0u);
    let distance = select(0.0, contact.distances.x, contact.is_beside) * (1.0 - FEW);
    let depth = select(contact.depths.x, contact.center.x, contact.is_over) * (1.0 - FEW);
    let layers = layers_of(contact.depths);
    for (var layer = layers.x; layer < layers.y; layer++) {
        let texel = texel_of(piece.position, layer);
        var can_be = rank(kind + 1u, distance * distance);
        if !contact.is_beside && (!contact.is_over || may_be_in(contact.center, layer)) {
            can_be = rank(kind, depth);
        }
        var to_beat = ~atomicLoad(&best[texel]);
        // What is searched in a mask depends on what else lies beside the centre.
        let is_masked = ((atomicLoad(&masked[texel / 32u]) >> (texel % 32u)) & 1u) != 0u;
        if is_masked && ((to_beat >> 30u) & 1u) == 1u {
            to_beat |= 0x3fffffffu;
        }
        if can_be <= to_beat {
            let place = atomicAdd(&touches.count, 1u);
            if place < task.room {
                touches.list[place] = vec2u(texel, piece.number.x);
            } else if place >= MOST_COUNTED {
                atomicOr(&touches.wrong, IS_UNCOUNTED);
            }
        }
    }
}
