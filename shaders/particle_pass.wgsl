// Particles of dust and water: balls and discs, found by a ray through each pixel. Compiled after view.wgsl and
// tooth.wgsl. CPU twin: src/render/cpu/particle_pass.rs.

struct Speck {
    // w: radius.
    @location(0) place: vec4f,
    // a: opacity at the thickest place.
    @location(1) colour: vec4f,
    // Normal of a disc; zero for a ball. w: gloss.
    @location(2) facing: vec4f,
}

struct Varying {
    @builtin(position) pixel: vec4f,
    @location(0) @interpolate(flat) place: vec4f,
    @location(1) @interpolate(flat) colour: vec4f,
    @location(2) @interpolate(flat) facing: vec4f,
}

struct Seen {
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

struct Met {
    // Depth, mm; negative if the ray misses the particle.
    z: f32,
    normal: vec3f,
    // Thickness of the particle there, as a share of its greatest thickness.
    thick: f32,
}

// Bulge of a disc of water: outward inclination of the normal at its rim.
const BULGE: f32 = 0.7;
// By how much of its radius a disc of water is narrower at places.
const LOBES: f32 = 0.16;
// Turn of a disc's outline with its place, radians per mm.
const LOBE_TURN: vec3f = vec3f(0.31, 0.23, 0.37);
// Greatest tilt of a disc's normal by ripples, and their wave numbers, radians per mm.
const RIPPLE: f32 = 0.16;
const RIPPLE_WAVES: mat2x2f = mat2x2f(vec2f(4.3, -3.1), vec2f(2.9, 5.2));
// A ray more parallel to a disc than this does not meet it.
const EDGE_ON: f32 = 1e-4;

// Factor by which a square facing the eye must be larger than the particle to cover its whole outline.
fn room(to: vec3f, z: f32, radius: f32) -> f32 {
    return 1.02 * length(to) / z * min(z / max(z - radius, 1e-6), 2.0);
}

// Radius of a disc's outline in the direction of a place beside its middle, as a share of the greatest.
fn outline(aside: vec3f, middle: vec3f) -> f32 {
    let turn = dot(middle, LOBE_TURN);
    let level = vec2f(cos(turn), sin(turn));
    let way = aside.xz / max(length(aside), 1e-6);
    let a = dot(way, level);
    let b = dot(way, vec2f(-level.y, level.x));
    let waves = 0.5 * (2.0 * a * a - 1.0) + 0.5 * (4.0 * b * b - 3.0) * b;
    return 1.0 - LOBES * (0.5 - 0.5 * waves);
}

// The front of a ball, or a disc.
fn meet(place: vec4f, facing: vec3f, way: vec3f) -> Met {
    let to = place.xyz - view.position.xyz;
    let radius = place.w;
    if all(facing == vec3f(0.0)) {
        let nearest = dot(to, way) / dot(way, way);
        let past = way * nearest - to;
        let left = radius * radius - dot(past, past);
        if left < 0.0 {
            return Met(-1.0, vec3f(0.0), 0.0);
        }
        let z = nearest - sqrt(left) / length(way);
        return Met(z, (way * z - to) / radius, sqrt(left) / radius);
    }
    let slope = dot(way, facing);
    if abs(slope) < EDGE_ON {
        return Met(-1.0, vec3f(0.0), 0.0);
    }
    let z = dot(to, facing) / slope;
    let aside = (way * z - to) / (radius * outline(way * z - to, place.xyz));
    let out = dot(aside, aside);
    if out > 1.0 {
        return Met(-1.0, vec3f(0.0), 0.0);
    }
    let toward_eye = select(facing, -facing, slope > 0.0);
    let tilt = sin(RIPPLE_WAVES * (place.xz + way.xz * z - to.xz)) * RIPPLE;
    return Met(z, normalize(toward_eye + aside * (BULGE * out) + vec3f(tilt.x, 0.0, tilt.y)), 1.0 - out * out);
}

@vertex
fn speck_vertex(@builtin(vertex_index) index: u32, speck: Speck) -> Varying {
    var corners = array<vec2f, 6>(
        vec2f(-1.0, -1.0), vec2f(1.0, -1.0), vec2f(-1.0, 1.0), vec2f(-1.0, 1.0), vec2f(1.0, -1.0), vec2f(1.0, 1.0),
    );
    let to = speck.place.xyz - view.position.xyz;
    let aside = corners[index] * speck.place.w * room(to, dot(to, view.ahead.xyz), speck.place.w);
    let corner = speck.place.xyz + view.right.xyz * aside.x + view.up.xyz * aside.y;
    return Varying(view.clip_from_world * vec4f(corner, 1.0), speck.place, speck.colour, speck.facing);
}

@fragment
fn grain_fragment(in: Varying) -> Seen {
    let way = ray(in.pixel.xy);
    let met = meet(in.place, in.facing.xyz, way);
    if met.z < view.position.w {
        discard;
    }
    let point = view.position.xyz + way * met.z;
    let colour = lit(vec4f(in.colour.rgb, in.facing.w), 1.0, point, met.normal);
    return Seen(vec4f(screen(colour), 1.0), buffer_depth(met.z));
}

@fragment
fn drop_fragment(in: Varying) -> Seen {
    let way = ray(in.pixel.xy);
    let met = meet(in.place, in.facing.xyz, way);
    if met.z < view.position.w {
        discard;
    }
    let point = view.position.xyz + way * met.z;
    let wet = lit(vec4f(in.colour.rgb, in.facing.w), 1.0, point, met.normal);
    var glint = 0.0;
    if in.facing.w > 0.0 {
        // A lamp is mirrored by clear water as brightly as by milk.
        let gain = wet - lit(vec4f(in.colour.rgb, 0.0), 1.0, point, met.normal);
        glint = max(max(gain.r, gain.g), gain.b);
    }
    let opacity = met.thick * mix(in.colour.a, 1.0, glint);
    return Seen(vec4f(screen(wet) * opacity, opacity), buffer_depth(met.z));
}
