// Uniform and functions of every pass: one eye, the lamps, and the lighting. CPU twin: src/render/cpu/light.rs.
// Colours are sRGB, 0 to 1; lengths in mm; world space.

struct Lamp {
    // w: reach past the edge of its own shadow on a white tissue, as a cosine.
    position: vec4f,
    // Colour multiplied by intensity.
    colour: vec4f,
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
    // Width and height in pixels; z: 1 where the target turns linear light into a screen's colours by itself.
    size: vec4f,
    background_middle: vec4f,
    background_edge: vec4f,
    // x: ambient light.
    ambient: vec4f,
    lamps: array<Lamp, 2>,
}

@group(0) @binding(0) var<uniform> view: View;

// Light of the surroundings, as shares of the ambient light: from the opening of the mouth, and from its depth.
const OPENING: vec3f = vec3f(0.0, 0.28, 0.96);
const BRIGHT: vec3f = vec3f(1.30, 1.30, 1.28);
const DEEP: vec3f = vec3f(0.42, 0.24, 0.20);
// Gloss above which a surface mirrors the edge of the mouth's opening, and where that edge lies.
const POLISHED: f32 = 0.5;
const EDGE: vec2f = vec2f(0.35, 0.7);
// Share of the light that hollows lose and their walls throw back, for a white wall.
const RETURNED: f32 = 0.5;
// Brightness up to which the tone map changes nothing, and the rate at which brighter light turns white.
const LINEAR_UP_TO: f32 = 0.76;
const WHITENING: f32 = 0.15;
const PI: f32 = 3.14159265;

// Ray through a pixel, per mm of depth.
fn ray(pixel: vec2f) -> vec3f {
    let at = pixel / view.size.xy;
    let right = view.window.x + (view.window.y - view.window.x) * at.x;
    let up = view.window.w + (view.window.z - view.window.w) * at.y;
    return view.ahead.xyz + view.right.xyz * right + view.up.xyz * up;
}

fn buffer_depth(z: f32) -> f32 {
    return view.right.w / (view.right.w - view.position.w) * (1.0 - view.position.w / z);
}

fn depth_of(buffer: f32) -> f32 {
    return view.position.w / (1.0 - buffer * (view.right.w - view.position.w) / view.right.w);
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
    return max(0.42 - 1.5 * gloss, 0.12);
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
    let above = 1.085 - 0.863 * a - x2 * (0.756 - 0.875 * a) - x2 * x3 * (0.132 - 1.691 * a);
    let grazing = x3 * (0.450 + a * (1.894 * a - 1.645));
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
        light += lamp.colour.xyz * max((dot(normal, to_lamp) + wrap) / ((1.0 + wrap) * (1.0 + wrap)), vec3f(0.0));
        shine += lamp.colour.xyz * coat(finish.a, normal, to_lamp, to_eye);
    }
    let reached = open / (1.0 - RETURNED * albedo * (1.0 - open));
    return sqrt(tone(albedo * light * reached * (1.0 - mirrored) + shine * open));
}

// Converts an sRGB colour for this target.
fn screen(colour: vec3f) -> vec3f {
    if view.size.z == 0.0 {
        return colour;
    }
    let low = colour / 12.92;
    let high = pow((colour + 0.055) / 1.055, vec3f(2.4));
    return select(high, low, colour <= vec3f(0.04045));
}
