// Alpha of the base colour's texture, at its finest level of detail and with all digits: samplers
// weigh texels with some eight bits, which moves the border of a mask.

fn wrapped(at: i32, size: i32, wrap: u32) -> i32 {
    if at >= 0 && at < size {
        return at;
    }
    if wrap == CLAMP_TO_EDGE {
        return clamp(at, 0, size - 1);
    }
    let period = select(size, 2 * size, wrap == MIRRORED_REPEAT);
    let inside = ((at % period) + period) % period;
    return min(inside, 2 * size - 1 - inside);
}

fn alpha_of_texel(at: vec2i, size: vec2i) -> f32 {
    let texel = vec2i(
        wrapped(at.x, size.x, material.wrap.x),
        wrapped(at.y, size.y, material.wrap.y),
    );
    return textureLoad(base_texture, texel, 0).a;
}

fn alpha_at(uv: vec2f) -> f32 {
    let size = vec2i(textureDimensions(base_texture));
    let at = clamp(uv * vec2f(size), vec2f(-FARTHEST), vec2f(FARTHEST));
    if flag(NEAREST) {
        return alpha_of_texel(vec2i(floor(at)), size);
    }
    let corner = floor(at - 0.5);
    let share = at - 0.5 - corner;
    let texel = vec2i(corner);
    let above = mix(
        alpha_of_texel(texel, size),
        alpha_of_texel(texel + vec2i(1, 0), size),
        share.x,
    );
    let below = mix(
        alpha_of_texel(texel + vec2i(0, 1), size),
        alpha_of_texel(texel + vec2i(1, 1), size),
        share.x,
    );
    return mix(above, below, share.y);
}

// Whether the surface is there; `alpha` is that of the vertices.
fn is_there(uv: vec2f, alpha: f32) -> bool {
    return alpha * material.base_color.a * alpha_at(uv) >= material.cutoff;
}
