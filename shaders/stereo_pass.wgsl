// Combines the pictures of both eyes for a stereo screen. Needs no other shader. CPU twin:
// src/render/cpu/stereo_pass.rs.

struct Pair {
    // 0 side by side, 1 top and bottom, 2 rows, 3 anaglyph, 4 left, 5 right.
    arrangement: u32,
    // 1 if the pictures already contain linear light.
    is_linear: u32,
    // Size of the left eye's picture, pixels.
    width: u32,
    height: u32,
    // From both pictures' linear light to red, green and blue; rows of the left eye's, then of the right eye's.
    dubois: array<vec4f, 6>,
}

@group(0) @binding(0) var<uniform> pair: Pair;
@group(0) @binding(1) var left: texture_2d<f32>;
@group(0) @binding(2) var right: texture_2d<f32>;

fn linear(value: vec3f) -> vec3f {
    let high = pow((value + 0.055) / 1.055, vec3f(2.4));
    return select(high, value / 12.92, value <= vec3f(0.04045));
}

fn encoded(value: vec3f) -> vec3f {
    let high = 1.055 * pow(max(value, vec3f(1e-6)), vec3f(1.0 / 2.4)) - 0.055;
    return select(high, value * 12.92, value <= vec3f(0.0031308));
}

fn anaglyph(a: vec3f, b: vec3f) -> vec3f {
    var light = array<vec3f, 2>(a, b);
    if pair.is_linear == 0u {
        light = array<vec3f, 2>(linear(a), linear(b));
    }
    let m = pair.dubois;
    let through = vec3f(
        dot(m[0].xyz, light[0]) + dot(m[3].xyz, light[1]),
        dot(m[1].xyz, light[0]) + dot(m[4].xyz, light[1]),
        dot(m[2].xyz, light[0]) + dot(m[5].xyz, light[1]),
    );
    let seen = clamp(through, vec3f(0.0), vec3f(1.0));
    if pair.is_linear == 1u {
        return seen;
    }
    return encoded(seen);
}

@vertex
fn whole_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 1.0, 1.0);
}

@fragment
fn stereo_fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    var at = vec2u(pixel.xy);
    if pair.arrangement == 3u {
        return vec4f(anaglyph(textureLoad(left, at, 0).rgb, textureLoad(right, at, 0).rgb), 1.0);
    }
    var is_right = pair.arrangement == 5u;
    if pair.arrangement == 0u && at.x >= pair.width {
        at.x -= pair.width;
        is_right = true;
    }
    if pair.arrangement == 1u && at.y >= pair.height {
        at.y -= pair.height;
        is_right = true;
    }
    if pair.arrangement == 2u && (at.y & 1u) == 1u {
        is_right = true;
    }
    if is_right {
        return vec4f(textureLoad(right, at, 0).rgb, 1.0);
    }
    return vec4f(textureLoad(left, at, 0).rgb, 1.0);
}
