// Uniform and functions of every pass: one eye, the lamps, and the lighting. CPU twin: src/render/cpu/light.rs.
// Colours are sRGB, 0 to 1; lengths in mm; world space.

struct Lamp {
    // w: reach past the edge of its own shadow, as a cosine.
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
    background_top: vec4f,
    background_bottom: vec4f,
    // x: ambient light.
    ambient: vec4f,
    lamps: array<Lamp, 2>,
}

@group(0) @binding(0) var<uniform> view: View;

// Light lost where a surface turns away from the eye: draws a pale tooth's outline.
const RIM: f32 = 0.25;
// Shade on a tooth is warm, because light comes through it: the share by which red gains and blue loses there.
const WARMTH: f32 = 0.12;
// Share of the ambient light that comes from above.
const SKY: f32 = 0.25;

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

// To the power of 32, a highlight as wide as on wet enamel.
fn tight(x: f32) -> f32 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    let x16 = x8 * x8;
    return x16 * x16;
}

// Shaded colour of a surface (rgb, gloss) at a point with a unit normal; `open`: share of light that reaches it.
fn lit(finish: vec4f, open: f32, point: vec3f, normal: vec3f) -> vec3f {
    let to_eye = normalize(view.position.xyz - point);
    let away = 1.0 - clamp(dot(normal, to_eye), 0.0, 1.0);
    var light = vec3f(view.ambient.x * (1.0 - SKY + SKY * normal.y));
    var shine = vec3f(0.0);
    for (var i = 0; i < 2; i++) {
        let lamp = view.lamps[i];
        if all(lamp.colour.xyz == vec3f(0.0)) {
            continue;
        }
        let to_lamp = normalize(lamp.position.xyz - point);
        let wrap = lamp.position.w;
        light += lamp.colour.xyz * max((dot(normal, to_lamp) + wrap) / (1.0 + wrap), 0.0);
        let halfway = normalize(to_lamp + to_eye);
        shine += lamp.colour.xyz * tight(max(dot(normal, halfway), 0.0));
    }
    light *= open * (1.0 - RIM * away * away);
    let warm = light + vec3f(WARMTH, 0.0, -WARMTH) * max(vec3f(1.0) - light, vec3f(0.0)) * light;
    // A square approximates the sRGB curve.
    let linear = finish.rgb * finish.rgb * warm + shine * (finish.a * open);
    return sqrt(clamp(linear, vec3f(0.0), vec3f(1.0)));
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
