// Blur of what is not in a lens's focus, in a finished picture. Compiled after view.wgsl and tooth.wgsl.
// CPU twin: src/render/cpu/lens_pass.rs.

// Places from which a pixel gathers light, besides its own: its neighbours, and those of each further ring around it.
const TAPS: i32 = 64;
const NEIGHBOURS: i32 = 8;
const PLACES: f32 = 14.0;
// Square of the radius of a pixel's own disc, pixels.
const OWN: f32 = 0.31830987;

struct Lens {
    // x: depth in focus, mm; y: radius of the circle of a point infinitely far away, pixels times that depth; z: largest radius,
    // pixels.
    focus: vec4f,
    // Steps to a place, pixels; z, w: squares of its ring's inner and outer radius.
    taps: array<vec4f, TAPS>,
}

@group(2) @binding(0) var sharp: texture_2d<f32>;
@group(2) @binding(1) var sharp_depth: texture_2d<f32>;
@group(2) @binding(2) var<uniform> lens: Lens;

// Smallest radius, pixels: a pixel's own.
const SMALLEST: f32 = 0.5;
// Radius of a circle, pixels, from which on a place before the focus is blurred.
const BEFORE: f32 = 1.0;

fn depth_at(at: vec2i) -> f32 {
    let place = (vec2f(at) + 0.5) / vec2f(textureDimensions(sharp_depth));
    return depth_of(textureSampleLevel(sharp_depth, depth_sampler, place, 0.0).r);
}

// Radius of the circle into which a point at a depth is spread, pixels.
fn circle(depth: f32) -> f32 {
    return clamp(lens.focus.y * abs(1.0 / depth - 1.0 / lens.focus.x), SMALLEST, lens.focus.z);
}

// True if a point at a depth is so far before the focus that it spreads over what is behind it.
fn is_blurred_before(depth: f32) -> bool {
    return lens.focus.y * (1.0 / depth - 1.0 / lens.focus.x) > BEFORE;
}

// Light of a pixel; a target that turns linear light into a screen's colours holds it.
fn light_at(at: vec2i) -> vec3f {
    let colour = textureLoad(sharp, at, 0).rgb;
    return select(colour * colour, colour, view.size.z > 0.5);
}

// Weight of a place in a circle of a radius around the pixel: the part of its ring that the circle covers.
fn tap_weight(number: i32, tap: vec4f, radius: f32) -> f32 {
    let places = select(PLACES, f32(NEIGHBOURS), number < NEIGHBOURS);
    return (clamp(radius * radius, tap.z, tap.w) - tap.z) / (places * radius * radius);
}

@vertex
fn lens_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 1.0, 1.0);
}

@fragment
fn lens_fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2i(pixel.xy);
    let last = vec2i(textureDimensions(sharp)) - 1;
    let own_depth = depth_at(at);
    let own_radius = circle(own_depth);
    let is_own_before = is_blurred_before(own_depth);
    let own = min(OWN / (own_radius * own_radius), 1.0);
    // Light and weight of what is before the focus, and of what is not.
    var before = vec4f(0.0);
    var behind = vec4f(0.0);
    if is_own_before {
        before = vec4f(light_at(at), 1.0) * own;
    } else {
        behind = vec4f(light_at(at), 1.0) * own;
    }
    for (var i = 0; i < TAPS; i++) {
        let tap = lens.taps[i];
        let place = clamp(at + vec2i(tap.xy), vec2i(0), last);
        let depth = depth_at(place);
        var radius = circle(depth);
        let is_before = is_blurred_before(depth);
        if !is_before {
            // Before the focus, what is hidden behind is guessed from what is seen beside it; elsewhere, nothing spreads over
            // what is nearer.
            if is_own_before {
                radius = max(radius, own_radius);
            } else if depth > own_depth {
                radius = min(radius, own_radius);
            }
        }
        let light = vec4f(light_at(place), 1.0) * tap_weight(i, tap, radius);
        if is_before {
            before += light;
        } else {
            behind += light;
        }
    }
    // A lens spreads what is before the focus over what is behind.
    let cover = select(min(before.w, 1.0), 1.0, behind.w <= 0.0);
    let light = mix(behind.rgb / max(behind.w, 1e-6), before.rgb / max(before.w, 1e-6), cover);
    let colour = sqrt(light) + dither(pixel.xy);
    return vec4f(select(colour, colour * colour, view.size.z > 0.5), 1.0);
}
