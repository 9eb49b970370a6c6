// Anti-aliasing of a finished picture along its edges. Compiled after view.wgsl and tooth.wgsl, but uses neither.
// CPU twin: src/render/cpu/fxaa_pass.rs.

@group(2) @binding(0) var drawn: texture_2d<f32>;

// Brightness is a whole number from 0 to 1020, so that every computer compares it alike.
const FULL: f32 = 255.0;
// Smallest contrast of a visible edge, absolute and as a share of the brightest neighbour.
const FAINT: f32 = 60.0;
const FAINT_SHARE: f32 = 0.125;
// Contrast above the smallest at which an edge is smoothed fully, so that smoothing sets in gradually.
const GROWING: f32 = 40.0;
// Pixels over which an edge is followed in each direction.
const FOLLOWS: i32 = 8;
// Share of the edge's contrast by which its brightness must change to end it.
const ENDS: f32 = 0.25;

fn texel(at: vec2i) -> vec3f {
    let last = vec2i(textureDimensions(drawn)) - 1;
    return textureLoad(drawn, clamp(at, vec2i(0), last), 0).rgb;
}

fn brightness(at: vec2i) -> f32 {
    let whole = round(texel(at) * FULL);
    return whole.r + 2.0 * whole.g + whole.b;
}

// Length, pixels, of an edge between a row of pixels and the neighbouring one, and the change of brightness at its end.
fn end_of(at: vec2i, across: vec2i, along: vec2i, level: f32, contrast: f32) -> vec2f {
    var change = 0.0;
    for (var i = 1; i <= FOLLOWS; i++) {
        let here = at + along * i;
        change = 0.5 * (brightness(here) + brightness(here + across)) - level;
        if abs(change) >= ENDS * contrast {
            return vec2f(f32(i) - 0.5, change);
        }
    }
    return vec2f(f32(FOLLOWS), change);
}

@vertex
fn smooth_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 1.0, 1.0);
}

@fragment
fn smooth_fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2i(pixel.xy);
    let own = texel(at);
    let m = brightness(at);
    let n = brightness(at + vec2i(0, -1));
    let s = brightness(at + vec2i(0, 1));
    let w = brightness(at + vec2i(-1, 0));
    let e = brightness(at + vec2i(1, 0));
    let high = max(m, max(max(n, s), max(w, e)));
    let low = min(m, min(min(n, s), min(w, e)));
    let faint = max(FAINT, FAINT_SHARE * high);
    if high - low <= faint {
        return vec4f(own, 1.0);
    }
    let nw = brightness(at + vec2i(-1, -1));
    let ne = brightness(at + vec2i(1, -1));
    let sw = brightness(at + vec2i(-1, 1));
    let se = brightness(at + vec2i(1, 1));
    let bends_down = 2.0 * abs(n + s - 2.0 * m) + abs(nw + sw - 2.0 * w) + abs(ne + se - 2.0 * e);
    let bends_right = 2.0 * abs(w + e - 2.0 * m) + abs(nw + ne - 2.0 * n) + abs(sw + se - 2.0 * s);
    let is_level = bends_down >= bends_right;
    let before = select(w, n, is_level);
    let after = select(e, s, is_level);
    let is_before = abs(before - m) > abs(after - m);
    let step = select(vec2i(1, 0), vec2i(0, 1), is_level);
    let across = select(step, -step, is_before);
    let other = select(after, before, is_before);
    let contrast = abs(other - m);
    let level = 0.5 * (m + other);
    let along = step.yx;
    let back = end_of(at, across, -along, level, contrast);
    let forth = end_of(at, across, along, level, contrast);
    let near = select(forth, back, back.x < forth.x);
    // The other side is blended only if the nearer end of the edge bends away from this pixel.
    let reaches = (near.y < 0.0) != (m < level);
    let share = select(0.0, 0.5 - near.x / (back.x + forth.x), reaches);
    let strength = min((high - low - faint) / GROWING, 1.0);
    return vec4f(mix(own, texel(at + across), share * strength), 1.0);
}
