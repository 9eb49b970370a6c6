// Plane mirror: the picture of its reflected eye, drawn on a disc. Compiled after view.wgsl and tooth.wgsl.
// CPU twin: src/render/cpu/mirror_pass.rs.

struct Mirror {
    // w: radius.
    middle: vec4f,
    // Axes across the face, as in its picture; right.w: share of light that is reflected.
    right: vec4f,
    up: vec4f,
    // Unit normal of the reflecting face.
    normal: vec4f,
}

@group(2) @binding(0) var<uniform> mirror: Mirror;
// Picture of the reflected eye; its upper left corner is left of and above the disc.
@group(2) @binding(1) var reflected: texture_2d<f32>;

struct Seen {
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

fn texel(at: vec2i, last: vec2i) -> vec3f {
    return textureLoad(reflected, clamp(at, vec2i(0), last), 0).rgb;
}

// Linear between texels, from 0 to 1 across the picture.
fn between_texels(share: vec2f) -> vec3f {
    let size = vec2i(textureDimensions(reflected));
    let at = share * vec2f(size) - 0.5;
    let base = vec2i(floor(at));
    let part = at - floor(at);
    let last = size - 1;
    let upper = mix(texel(base, last), texel(base + vec2i(1, 0), last), part.x);
    let lower = mix(texel(base + vec2i(0, 1), last), texel(base + vec2i(1, 1), last), part.x);
    return mix(upper, lower, part.y);
}

@vertex
fn mirror_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 1.0, 1.0);
}

@fragment
fn mirror_fragment(@builtin(position) pixel: vec4f) -> Seen {
    let way = ray(pixel.xy);
    let facing = dot(way, mirror.normal.xyz);
    let z = dot(mirror.middle.xyz - view.position.xyz, mirror.normal.xyz) / min(facing, -1e-6);
    let from_middle = view.position.xyz + way * z - mirror.middle.xyz;
    let at = vec2f(dot(from_middle, mirror.right.xyz), dot(from_middle, mirror.up.xyz)) / mirror.middle.w;
    if facing >= 0.0 || z < view.position.w || z > view.right.w || dot(at, at) > 1.0 {
        discard;
    }
    let colour = between_texels(vec2f(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y));
    return Seen(vec4f(colour * mirror.right.w, 1.0), buffer_depth(z));
}
