// Colours of the nearest surface.

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) color: vec4f,
    // In the world, of any length.
    @location(2) normal: vec3f,
    // Instance, and triangle in the order in which they are drawn: those of the triangle's first corner.
    @location(3) @interpolate(flat, first) drawn: vec2u,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) number: u32) -> Vertex {
    let corner = corners[index];
    return Vertex(
        placed(number, position_of(corner.x)),
        uv_of(corner.x),
        color_of(corner.x),
        normal_in_world(instances[number], normal_of(corner.x)),
        vec2u(number, corner.y),
    );
}

// Normals transform by the inverse transpose: the cofactors over the determinant, of which the sign
// is enough.
fn normal_in_world(instance: Instance, normal: vec3f) -> vec3f {
    let side = select(normal, -normal, instance.mirrored != 0u);
    return cross(instance.y, instance.z) * side.x
        + cross(instance.z, instance.x) * side.y
        + cross(instance.x, instance.y) * side.z;
}

// A triangle's edges from its first corner, in the world and on the texture.
struct Edges {
    to_b: vec3f,
    to_c: vec3f,
    uv_b: vec2f,
    uv_c: vec2f,
}

fn edges_of(drawn: vec2u) -> Edges {
    let instance = instances[drawn.x];
    let vertices = triangles[drawn.y].xyz;
    let a = vertices.x;
    // Counter-clockwise seen from the front also in objects that are mirrored.
    let b = select(vertices.y, vertices.z, instance.mirrored != 0u);
    let c = select(vertices.z, vertices.y, instance.mirrored != 0u);
    let axes = mat3x3f(instance.x, instance.y, instance.z);
    let origin = position_of(a);
    return Edges(
        axes * (position_of(b) - origin),
        axes * (position_of(c) - origin),
        uv_of(b) - uv_of(a),
        uv_of(c) - uv_of(a),
    );
}

// Growth of uv per column and per row of the picture.
struct Footprint {
    column: vec2f,
    row: vec2f,
}

// The level of detail whose texels are as large as the longer side of the footprint.
fn level_of(size: vec2u, footprint: Footprint) -> f32 {
    let column = length(footprint.column * vec2f(size));
    let row = length(footprint.row * vec2f(size));
    return log2(max(max(column, row), 1.0));
}

// A normal bent by a bump in tangent space: x along growing u, y against growing v. Where the
// texture coordinates have no direction, it stays as it was.
fn bent(normal: vec3f, edges: Edges, bump: vec3f) -> vec3f {
    // Solves to_b = uv_b.x U + uv_b.y V and to_c = uv_c.x U + uv_c.y V for the directions U and V.
    let area = edges.uv_b.x * edges.uv_c.y - edges.uv_b.y * edges.uv_c.x;
    let side_of_uv = select(1.0, -1.0, area < 0.0);
    let along_u = (edges.to_b * edges.uv_c.y - edges.to_c * edges.uv_b.y) * side_of_uv;
    let along_v = (edges.to_c * edges.uv_b.x - edges.to_b * edges.uv_c.x) * side_of_uv;
    let across = along_u - normal * dot(along_u, normal);
    if dot(across, across) <= 0.0 {
        return normal;
    }
    let tangent = normalize(across);
    let side = cross(normal, tangent);
    let bitangent = select(side, -side, dot(side, along_v) > 0.0);
    return normalize(tangent * bump.x + bitangent * bump.y + normal * bump.z);
}

fn normal_at(at: Vertex, is_front: bool, footprint: Footprint) -> vec3f {
    var normal = at.normal;
    if dot(normal, normal) <= 0.0 {
        let edges = edges_of(at.drawn);
        normal = cross(edges.to_b, edges.to_c);
    }
    normal = normalize(normal);
    if flag(BENT_NORMAL) {
        let level = level_of(textureDimensions(normal_texture), footprint);
        let texel = textureSampleLevel(normal_texture, normal_sampler, at.uv, level).xyz;
        let scale = vec3f(material.normal_scale, material.normal_scale, 1.0);
        normal = bent(normal, edges_of(at.drawn), (texel * 2.0 - 1.0) * scale);
    }
    return select(-normal, normal, is_front || !flag(DOUBLE_SIDED));
}

fn color_at(at: Vertex, is_front: bool, footprint: Footprint) -> vec4f {
    let level = level_of(textureDimensions(base_texture), footprint);
    let base_color = material.base_color.rgb
        * at.color.rgb
        * textureSampleLevel(base_texture, base_sampler, at.uv, level).rgb;
    let emissive_level = level_of(textureDimensions(emissive_texture), footprint);
    let emissive = material.emissive
        * textureSampleLevel(emissive_texture, emissive_sampler, at.uv, emissive_level).rgb;
    if flag(UNLIT) {
        return vec4f(base_color + emissive, 1.0);
    }
    let normal = normal_at(at, is_front, footprint);
    let from_sun = view.sun * max(dot(normal, view.to_sun), 0.0);
    let from_around = mix(view.ground, view.sky, normal.y * 0.5 + 0.5);
    return vec4f(base_color * (from_sun + from_around) + emissive, 1.0);
}

// Differences between neighbouring pixels are exact for what is linear on the screen: uv / depth and
// 1 / depth, which is a fragment's w.
fn footprint_at(at: Vertex) -> Footprint {
    let uv_over_depth = at.uv * at.position.w;
    return Footprint(
        (dpdx(uv_over_depth) - at.uv * dpdx(at.position.w)) / at.position.w,
        (dpdy(uv_over_depth) - at.uv * dpdy(at.position.w)) / at.position.w,
    );
}

@fragment
fn opaque(at: Vertex, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    return color_at(at, is_front, footprint_at(at));
}

@fragment
fn masked(at: Vertex, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let footprint = footprint_at(at);
    if !is_there(at.uv, at.color.a) {
        discard;
    }
    return color_at(at, is_front, footprint);
}
