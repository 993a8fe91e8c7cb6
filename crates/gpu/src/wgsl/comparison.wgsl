// Two pictures, seen as one.

struct Shown {
    // sRGB, behind everything.
    background: vec3f,
    mode: u32,
    // How many times as strong differences are.
    gain: f32,
    // The column between both in a split picture; it is white.
    border: i32,
}

@group(0) @binding(0) var<uniform> shown: Shown;
@group(0) @binding(1) var first: texture_2d<f32>;
@group(0) @binding(2) var second: texture_2d<f32>;

// A triangle over all of the picture.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

// Alpha is 1 where something is seen, else 0.
fn over_background(color: vec4f) -> vec3f {
    return mix(shown.background, color.rgb, color.a);
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let before = over_background(textureLoad(first, pixel, 0));
    let after = over_background(textureLoad(second, pixel, 0));
    var color = before;
    switch shown.mode {
        case SECOND: {
            color = after;
        }
        case SPLIT: {
            if pixel.x == shown.border {
                color = vec3f(1.0);
            } else if pixel.x > shown.border {
                color = after;
            }
        }
        case DIFFERENCE: {
            color = min(abs(before - after) * shown.gain, vec3f(1.0));
        }
        default: {}
    }
    return vec4f(color, 1.0);
}
