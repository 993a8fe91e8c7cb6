// Object, triangle and depth of the nearest surface.

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) alpha: f32,
    // Object and triangle, those of the triangle's first corner.
    @location(2) @interpolate(flat, first) ids: vec2u,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) number: u32) -> Vertex {
    let corner = corners[index];
    return Vertex(
        placed(number, position_of(corner.x)),
        uv_of(corner.x),
        color_of(corner.x).a,
        vec2u(instances[number].object, triangles[corner.y].w),
    );
}

struct Ids {
    @location(0) ids: vec2u,
    // Along the view axis, in metres.
    @location(1) depth: f32,
}

fn ids_of(at: Vertex) -> Ids {
    // A fragment's w is the reciprocal of what it was in clip space.
    return Ids(at.ids, 1.0 / at.position.w);
}

@fragment
fn opaque(at: Vertex) -> Ids {
    return ids_of(at);
}

@fragment
fn masked(at: Vertex) -> Ids {
    if !is_there(at.uv, at.alpha) {
        discard;
    }
    return ids_of(at);
}
