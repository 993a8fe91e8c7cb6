// What all shaders know of the scene, the picture and the material.

// An object.
struct Instance {
    // The mesh's axes in the world.
    x: vec3f,
    object: u32,
    y: vec3f,
    // 1 where triangles turn their winding.
    mirrored: u32,
    z: vec3f,
    padding: u32,
}

// Where an instance stands before the camera: rows that take a point of its mesh to clip space.
struct Placement {
    x: vec4f,
    y: vec4f,
    depth: vec4f,
}

// A picture's own constants.
struct View {
    to_sun: vec3f,
    sun: vec3f,
    sky: vec3f,
    ground: vec3f,
    // Depth from which on something is seen, in metres.
    near: f32,
}

struct Material {
    base_color: vec4f,
    emissive: vec3f,
    // Alpha from which on the surface is there.
    cutoff: f32,
    normal_scale: f32,
    flags: u32,
    wrap: vec2u,
}

@group(0) @binding(0) var<storage, read> positions: array<f32>;
// Normal, uv and colour of each vertex.
@group(0) @binding(1) var<storage, read> attributes: array<f32>;
// Three vertices, and the triangle's index in the scene.
@group(0) @binding(2) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(3) var<storage, read> instances: array<Instance>;
// Vertex, and the triangle whose first corner it is.
@group(0) @binding(4) var<storage, read> corners: array<vec2u>;

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var<storage, read> placements: array<Placement>;

@group(2) @binding(0) var<uniform> material: Material;
@group(2) @binding(1) var base_texture: texture_2d<f32>;
@group(2) @binding(2) var base_sampler: sampler;
@group(2) @binding(3) var normal_texture: texture_2d<f32>;
@group(2) @binding(4) var normal_sampler: sampler;
@group(2) @binding(5) var emissive_texture: texture_2d<f32>;
@group(2) @binding(6) var emissive_sampler: sampler;

// Relative to the middle of its mesh.
fn position_of(vertex: u32) -> vec3f {
    let at = 3u * vertex;
    return vec3f(positions[at], positions[at + 1u], positions[at + 2u]);
}

fn normal_of(vertex: u32) -> vec3f {
    let at = ATTRIBUTES * vertex;
    return vec3f(attributes[at], attributes[at + 1u], attributes[at + 2u]);
}

fn uv_of(vertex: u32) -> vec2f {
    let at = ATTRIBUTES * vertex + 3u;
    return vec2f(attributes[at], attributes[at + 1u]);
}

fn color_of(vertex: u32) -> vec4f {
    let at = ATTRIBUTES * vertex + 5u;
    return vec4f(attributes[at], attributes[at + 1u], attributes[at + 2u], attributes[at + 3u]);
}

// In clip space, with depth reversed: near / depth, so that it is as precise far away as near.
fn placed(instance: u32, position: vec3f) -> vec4f {
    let placement = placements[instance];
    let point = vec4f(position, 1.0);
    return vec4f(
        dot(placement.x, point),
        dot(placement.y, point),
        view.near,
        dot(placement.depth, point),
    );
}

fn flag(which: u32) -> bool {
    return (material.flags & which) != 0u;
}
