// Uniform and functions of every pass: one eye, the lamps, and the lighting. CPU twin: src/render/shading.rs.
// Colours are sRGB, 0 to 1; lengths in mm; world space.

struct Lamp {
    // w: reach past the edge of its own shadow on a white tissue, as a cosine.
    position: vec4f,
    // Colour multiplied by intensity.
    colour: vec4f,
}

// The eye in the chair lamp's place.
struct Shadow {
    // w: near.
    position: vec4f,
    // w: far.
    right: vec4f,
    // w: radius of the lamp's luminous area.
    up: vec4f,
    // w: half of the map's width at a depth of 1 mm.
    ahead: vec4f,
}

struct View {
    clip_from_world: mat4x4f,
    // w: near.
    position: vec4f,
    // w: far.
    right: vec4f,
    up: vec4f,
    ahead: vec4f,
    // Left, right, bottom, top at a depth of 1 mm.
    window: vec4f,
    // Width and height in pixels; z: 1 where the target turns linear light into a screen's colours by itself; w: seed of relief.
    size: vec4f,
    background_middle: vec4f,
    background_edge: vec4f,
    // x: ambient light.
    ambient: vec4f,
    lamps: array<Lamp, 2>,
    shadow: Shadow,
}

@group(0) @binding(0) var<uniform> view: View;
// Depths that the lamp sees: to be compared, and to be read. WebGL 2 reads single texels of depths only by a sampler.
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;
@group(0) @binding(3) var shadow_depths: texture_2d<f32>;
@group(0) @binding(4) var depth_sampler: sampler;

// Light of the surroundings, as shares of the ambient light: from the opening of the mouth, and from its depth.
const OPENING: vec3f = vec3f(0.0, 0.28, 0.96);
const BRIGHT: vec3f = vec3f(1.30, 1.30, 1.28);
const DEEP: vec3f = vec3f(0.42, 0.24, 0.20);
// Gloss above which a surface mirrors the edge of the mouth's opening, and where that edge lies.
const POLISHED: f32 = 0.5;
const EDGE: vec2f = vec2f(0.35, 0.7);
// Share of the light that hollows lose and their walls throw back, for a white wall.
const RETURNED: f32 = 0.75;
// Share of the lamp's light that comes through a white tissue from around its shadow.
const SHADOW_GLOW: f32 = 0.33;
// Brightness up to which the tone map changes nothing, and the rate at which brighter light turns white.
const LINEAR_UP_TO: f32 = 0.76;
const WHITENING: f32 = 0.15;
const PI: f32 = 3.14159265;
// False in pipelines for scenes without shadows: in software, a branch costs time even where it is not taken.
override has_shadows: bool = false;
// Places at which a shadow is looked for, and at which its edge is measured.
const SHADOW_SEARCHES: i32 = 12;
const SHADOW_TAPS: i32 = 24;
// Gap between caster and receiver, mm, beyond which shadows get no softer.
const SHADOW_GAP: f32 = 10.0;
// Distance, in texels of the map, by which a receiver is moved out along its normal.
const SHADOW_LIFT: f32 = 5.0;
// Steepest surface, as seen by the lamp, whose slope is followed between the places: a tangent.
const SHADOW_SLOPE: f32 = 8.0;
// Where shadows fade toward the map's border, from its middle (0) to there (1).
const SHADOW_FADE: vec2f = vec2f(0.8, 0.95);
// Cosine and sine of the golden angle, which spreads places over a disc evenly.
const GOLDEN: vec2f = vec2f(-0.73736888, 0.67549029);

// Ray through a pixel, per mm of depth.
fn ray(pixel: vec2f) -> vec3f {
    let at = pixel / view.size.xy;
    let right = view.window.x + (view.window.y - view.window.x) * at.x;
    let up = view.window.w + (view.window.z - view.window.w) * at.y;
    return view.ahead.xyz + view.right.xyz * right + view.up.xyz * up;
}

fn buffer_depth_between(near: f32, far: f32, z: f32) -> f32 {
    return far / (far - near) * (1.0 - near / z);
}

fn depth_between(near: f32, far: f32, buffer: f32) -> f32 {
    return near / (1.0 - buffer * (far - near) / far);
}

fn buffer_depth(z: f32) -> f32 {
    return buffer_depth_between(view.position.w, view.right.w, z);
}

fn depth_of(buffer: f32) -> f32 {
    return depth_between(view.position.w, view.right.w, buffer);
}

// Light of the surroundings from a direction; a shorter vector gives a blurred mean.
fn surroundings(toward: vec3f) -> vec3f {
    return view.ambient.x * mix(DEEP, BRIGHT, 0.5 + 0.5 * dot(toward, OPENING));
}

// Light of the surroundings as polished metal mirrors it: the opening of the mouth has an edge.
fn mirrored_surroundings(toward: vec3f) -> vec3f {
    return view.ambient.x * mix(DEEP, BRIGHT, smoothstep(EDGE.x, EDGE.y, 0.5 + 0.5 * dot(toward, OPENING)));
}

// Squared roughness of a coat: rougher where it is duller.
fn coat_width(gloss: f32) -> f32 {
    return max(0.42 - 1.6 * gloss, 0.1);
}

// Reflectance of a coat from straight above and at grazing incidence.
fn coat_reflectance(gloss: f32) -> vec2f {
    let above = gloss * gloss;
    return vec2f(above, min(50.0 * above, 1.0));
}

// Share of a uniform light that the coat mirrors toward an eye at this cosine: the integral of `coat`, fitted.
fn coat_albedo(gloss: f32, to_eye: f32) -> f32 {
    let a = coat_width(gloss);
    let x = 1.0 - to_eye;
    let x2 = x * x;
    let x3 = x2 * x;
    let above = 1.084 - 0.847 * a - x2 * (0.715 - 0.775 * a) - x2 * x3 * (0.197 - 1.784 * a);
    let grazing = x2 * x2 * (1.231 - 0.787 * x) + x3 * a * (2.207 * a - 1.829);
    let reflectance = coat_reflectance(gloss);
    return reflectance.x * above + reflectance.y * grazing;
}

// Light that a coat mirrors from a lamp, multiplied by pi (GGX).
fn coat(gloss: f32, normal: vec3f, to_lamp: vec3f, to_eye: vec3f) -> f32 {
    let lamp_cosine = dot(normal, to_lamp);
    if lamp_cosine <= 0.0 {
        return 0.0;
    }
    let eye_cosine = max(dot(normal, to_eye), 0.0);
    let halfway = normalize(to_lamp + to_eye);
    let half_cosine = max(dot(normal, halfway), 0.0);
    let a = coat_width(gloss);
    let bulge = half_cosine * half_cosine * (a * a - 1.0) + 1.0;
    let facets = a * a / (bulge * bulge);
    let seen = 0.5 / max(mix(2.0 * lamp_cosine * eye_cosine, lamp_cosine + eye_cosine, a), 1e-4);
    let x = 1.0 - max(dot(to_lamp, halfway), 0.0);
    let x2 = x * x;
    let reflectance = coat_reflectance(gloss);
    return facets * seen * mix(reflectance.x, reflectance.y, x2 * x2 * x) * lamp_cosine;
}

// Colours brighter than a screen are compressed, and paler the brighter they are (the shoulder of Khronos PBR Neutral).
fn tone(linear: vec3f) -> vec3f {
    let peak = max(linear.r, max(linear.g, linear.b));
    if peak < LINEAR_UP_TO {
        return linear;
    }
    let left = 1.0 - LINEAR_UP_TO;
    let compressed = 1.0 - left * left / (peak + left - LINEAR_UP_TO);
    let pale = 1.0 - 1.0 / (WHITENING * (peak - compressed) + 1.0);
    return mix(linear * (compressed / peak), vec3f(compressed), pale);
}

// A receiver of the lamp's light, as the lamp sees it.
struct ShadowReceiver {
    // Place in the map, from 0 to 1, and depth, mm.
    at: vec2f,
    depth: f32,
    // Change of the surface's depth per mm to the right and upward.
    slope: vec2f,
    // Change of the place in the map per mm to the right and upward.
    scale: vec2f,
}

// Depth of the receiver's plane at an offset in mm.
fn plane_depth(receiver: ShadowReceiver, offset: vec2f) -> f32 {
    return receiver.depth / max(1.0 - dot(receiver.slope, offset) / receiver.depth, 0.1);
}

// Mean depth, mm, of what lies between the lamp and the receiver; -1 if nothing does.
fn caster_depth(receiver: ShadowReceiver, reach: f32) -> f32 {
    var sum = 0.0;
    var count = 0.0;
    var way = vec2f(1.0, 0.0);
    for (var i = 0; i < SHADOW_SEARCHES; i++) {
        let offset = way * (reach * sqrt((f32(i) + 0.5) / f32(SHADOW_SEARCHES)));
        let stored = textureSampleLevel(shadow_depths, depth_sampler, receiver.at + offset * receiver.scale, 0.0).r;
        let depth = depth_between(view.shadow.position.w, view.shadow.right.w, stored);
        if depth < plane_depth(receiver, offset) {
            sum += depth;
            count += 1.0;
        }
        way = vec2f(way.x * GOLDEN.x - way.y * GOLDEN.y, way.x * GOLDEN.y + way.y * GOLDEN.x);
    }
    return select(-1.0, sum / count, count > 0.0);
}

// Share of the chair lamp that a point with a unit normal sees.
fn lamp_share(point: vec3f, normal: vec3f) -> f32 {
    let half = view.shadow.ahead.w;
    let distance = dot(point - view.shadow.position.xyz, view.shadow.ahead.xyz);
    let texel = 2.0 * half * distance / f32(textureDimensions(shadow_map).x);
    let from_lamp = point + normal * (SHADOW_LIFT * texel) - view.shadow.position.xyz;
    let z = dot(from_lamp, view.shadow.ahead.xyz);
    let across = vec2f(dot(from_lamp, view.shadow.right.xyz), dot(from_lamp, view.shadow.up.xyz)) / (z * half);
    let from_middle = max(abs(across.x), abs(across.y));
    let along_depth = abs(2.0 * z - view.shadow.position.w - view.shadow.right.w) / (view.shadow.right.w - view.shadow.position.w);
    let fade = smoothstep(SHADOW_FADE.x, SHADOW_FADE.y, max(from_middle, along_depth));
    if fade == 1.0 {
        return 1.0;
    }
    let facing = max(-dot(normal, from_lamp) / z, 1e-4);
    let steep = vec2f(dot(normal, view.shadow.right.xyz), dot(normal, view.shadow.up.xyz)) / facing;
    let slope = steep * min(1.0, SHADOW_SLOPE / max(length(steep), 1e-6));
    let scale = vec2f(0.5, -0.5) / (z * half);
    let receiver = ShadowReceiver(vec2f(0.5 + 0.5 * across.x, 0.5 - 0.5 * across.y), z, slope, scale);
    let reach = max(view.shadow.up.w * SHADOW_GAP / z, texel);
    let caster = caster_depth(receiver, reach);
    if caster < 0.0 {
        return 1.0;
    }
    let blur = clamp(view.shadow.up.w * (z - caster) / caster, texel, reach);
    var seen = 0.0;
    var way = vec2f(1.0, 0.0);
    for (var i = 0; i < SHADOW_TAPS; i++) {
        let offset = way * (blur * sqrt((f32(i) + 0.5) / f32(SHADOW_TAPS)));
        let depth = buffer_depth_between(view.shadow.position.w, view.shadow.right.w, plane_depth(receiver, offset));
        seen += textureSampleCompareLevel(shadow_map, shadow_sampler, receiver.at + offset * receiver.scale, depth);
        way = vec2f(way.x * GOLDEN.x - way.y * GOLDEN.y, way.x * GOLDEN.y + way.y * GOLDEN.x);
    }
    return mix(seen / f32(SHADOW_TAPS), 1.0, fade);
}

// Shaded colour of a surface (rgb, gloss) at a point with a unit normal; `open`: share of light that reaches it.
fn lit(finish: vec4f, open: f32, point: vec3f, normal: vec3f) -> vec3f {
    let to_eye = normalize(view.position.xyz - point);
    let eye_cosine = clamp(dot(normal, to_eye), 0.0, 1.0);
    // A square approximates the sRGB curve.
    let albedo = finish.rgb * finish.rgb;
    let mirrored = coat_albedo(finish.a, eye_cosine);
    // The mean over a hemisphere of a light that changes evenly is that from two thirds of the way.
    var light = surroundings(normal * 0.6667);
    let toward = reflect(-to_eye, normal);
    var shine = surroundings(toward) * mirrored;
    if finish.a > POLISHED {
        shine = mirrored_surroundings(toward) * mirrored;
    }
    for (var i = 0; i < 2; i++) {
        let lamp = view.lamps[i];
        if all(lamp.colour.xyz == vec3f(0.0)) {
            continue;
        }
        let to_lamp = normalize(lamp.position.xyz - point);
        // Light spreads farther in a tissue the less of it is absorbed: red in gingiva. The total stays the same.
        let wrap = lamp.position.w * albedo;
        let scattered = max((dot(normal, to_lamp) + wrap) / ((1.0 + wrap) * (1.0 + wrap)), vec3f(0.0));
        var scattering = lamp.colour.xyz;
        var mirroring = lamp.colour.xyz;
        if has_shadows && i == 0 && any(scattered > vec3f(0.0)) {
            let seen = lamp_share(point, normal);
            scattering *= mix(SHADOW_GLOW * albedo, vec3f(1.0), seen);
            mirroring *= seen;
        }
        light += scattering * scattered;
        shine += mirroring * coat(finish.a, normal, to_lamp, to_eye);
    }
    let reached = open / (1.0 - RETURNED * albedo * (1.0 - open));
    return sqrt(tone(albedo * light * reached * (1.0 - mirrored) + shine * open));
}

// Noise of one step of a screen's brightness, against bands where a colour changes slowly (Roberts's R2 sequence, 2018). `pixel`: its
// middle.
fn dither(pixel: vec2f) -> f32 {
    return (fract(dot(pixel, vec2f(0.7548777, 0.5698403))) - 0.5) / 255.0;
}

// True in pipelines whose target turns linear light into a screen's colours by itself: in software, a branch costs time even where it
// is not taken.
override is_srgb_target: bool = false;

// Converts an sRGB colour for this target.
fn screen(colour: vec3f) -> vec3f {
    if !is_srgb_target {
        return colour;
    }
    let low = colour / 12.92;
    let high = pow((colour + 0.055) / 1.055, vec3f(2.4));
    return select(high, low, colour <= vec3f(0.04045));
}
