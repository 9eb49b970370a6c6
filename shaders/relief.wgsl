// Fine relief of surfaces, which tilts their normals and moves nothing, and hairline cracks in enamel, which tint it. Compiled after view.wgsl.
// CPU twin: src/render/relief.rs.

// False in pipelines for scenes without relief: in software, a branch costs time even where it is not taken.
override has_relief: bool = false;

// Width of a dimple of stippled gingiva, and by how much it is lower or higher than the mean, mm.
const STIPPLE_WIDTH: f32 = 0.55;
const STIPPLE_DEPTH: f32 = 0.03;
// Width of the dimples of a second lattice that are as steep, mm: of two together, no row is seen.
const STIPPLE_FINE_WIDTH: f32 = 0.4;
// Rotation of the first lattice of dimples; that of the second is its inverse: no row of them lies along the arch.
const STIPPLE_TURN: mat3x3f = mat3x3f(vec3f(0.36, -0.8, 0.48), vec3f(0.48, 0.6, 0.64), vec3f(-0.8, 0.0, 0.6));
// Width of the marks of a bur across the tooth's axis and along it, and by how much they are lower or higher, mm.
const MARK_WIDTH: vec3f = vec3f(0.38, 0.38, 0.17);
const MARK_DEPTH: f32 = 0.007;
// Rise of the marks across the tooth's axis, mm per mm.
const MARK_SLOPE: vec2f = vec2f(0.35, -0.22);
// Gloss of tissue that is smooth, and of tissue with all of the marks.
const SMOOTH: f32 = 0.19;
const GROUND: f32 = 0.13;
// Width of the ridges of enamel that nobody cut (perikymata) across the tooth's axis and along it, and by how much they are lower or
// higher, mm; the gloss of such enamel, and the difference from it at which there are none.
const RIDGE_WIDTH: vec3f = vec3f(1.1, 1.1, 0.13);
const RIDGE_DEPTH: f32 = 0.0013;
const ENAMEL_GLOSS: f32 = 0.2;
const ENAMEL_GLOSS_RANGE: f32 = 0.01;
// Width of a hairline crack of enamel, and the distance between two sheets in which cracks lie, mm. Normals of the sheets of both
// kinds, across the tooth's axis. Number of seeds that have their sheets at places of their own, and the share of that distance by which
// the next seed's are shifted. Width and height of a sheet's bends, mm.
const CRACK_WIDTH: f32 = 0.04;
const CRACK_SPREAD: f32 = 4.3;
const CRACK_ACROSS: mat2x3f = mat2x3f(vec3f(0.94, 0.34, 0.0), vec3f(-0.42, 0.91, 0.0));
const CRACK_SHIFTS: u32 = 512u;
const GOLDEN_SHARE: f32 = 0.618034;
const CRACK_BEND: vec2f = vec2f(2.3, 0.35);
// Distances from the middle of a crack, as shares of its width, between which it fades.
const CRACK_EDGE: vec2f = vec2f(0.15, 0.5);
// Width of a crack in pixels up to which it is drawn wider than it is, and paler; and pixels, mm, from which on it is left out.
const CRACK_PIXELS: f32 = 1.5;
const CRACK_GONE: vec2f = vec2f(0.1, 0.2);
// Size of the parts of enamel that have cracks of one kind, mm; the noise from which on they begin, and at which they are whole.
const CRACKED_PART: f32 = 3.7;
const CRACKED_FROM: vec2f = vec2f(0.15, 0.35);
// Cosines between a sheet's and the surface's normal: from the first on the crack fades, and at the second it has faded. The same
// for the tooth's axis and the surface's normal.
const CRACK_FLAT: vec2f = vec2f(0.6, 0.85);
const CRACK_TOP: vec2f = vec2f(0.4, 0.65);
const CRACK_TINT: vec3f = vec3f(0.91, 0.88, 0.84);
// Cosine between the normal and the way to the eye at which cracks are too narrow to be seen.
const CRACK_EDGE_ON: f32 = 0.4;
// Size of a pixel, as a share of the relief's width, up to which relief is drawn whole, and from which on not at all.
const FADE: vec2f = vec2f(0.3, 0.8);

// Random value of a lattice point for the scene's seed, -1 to 1 (the finalizer of MurmurHash3).
fn lattice_value(x: u32, y: u32, z: u32) -> f32 {
    var hash = x ^ y ^ z ^ (u32(view.size.w) * 0x27D4EB2Fu);
    hash = (hash ^ (hash >> 16u)) * 0x85EBCA6Bu;
    hash = (hash ^ (hash >> 13u)) * 0xC2B2AE35u;
    return f32(hash >> 8u) * (2.0 / 16777216.0) - 1.0;
}

// Random values on a lattice of whole numbers, interpolated between them (w), and their gradient.
fn noise(at: vec3f) -> vec4f {
    let base = floor(at);
    let part = at - base;
    let share = part * part * (3.0 - 2.0 * part);
    let rise = 6.0 * part * (1.0 - part);
    let corner = bitcast<vec3u>(vec3i(base));
    let x = vec2u(corner.x, corner.x + 1u) * 0x9E3779B1u;
    let y = vec2u(corner.y, corner.y + 1u) * 0x85EBCA77u;
    let z = vec2u(corner.z, corner.z + 1u) * 0xC2B2AE3Du;
    let a = lattice_value(x.x, y.x, z.x);
    let b = lattice_value(x.y, y.x, z.x);
    let c = lattice_value(x.x, y.y, z.x);
    let d = lattice_value(x.y, y.y, z.x);
    let e = lattice_value(x.x, y.x, z.y);
    let f = lattice_value(x.y, y.x, z.y);
    let g = lattice_value(x.x, y.y, z.y);
    let h = lattice_value(x.y, y.y, z.y);
    let along_x = mix(mix(b - a, d - c, share.y), mix(f - e, h - g, share.y), share.z);
    let rows = mix(vec4f(a, c, e, g), vec4f(b, d, f, h), share.x);
    let along_y = mix(rows.y - rows.x, rows.w - rows.z, share.z);
    let along_z = mix(rows.z, rows.w, share.y) - mix(rows.x, rows.y, share.y);
    let value = mix(mix(rows.x, rows.y, share.y), mix(rows.z, rows.w, share.y), share.z);
    return vec4f(rise * vec3f(along_x, along_y, along_z), value);
}

// Width of a pixel at a point, mm.
fn pixel_at(point: vec3f) -> f32 {
    return length(point - view.position.xyz) * (view.window.y - view.window.x) / view.size.x;
}

// Share of a relief of a width, mm, that is drawn at a point: none where pixels are too large for it.
fn resolved(point: vec3f, width: f32) -> f32 {
    return 1.0 - smoothstep(FADE.x, FADE.y, pixel_at(point) / width);
}

// Unit normal of a surface with a relief, given the gradient of its height.
fn tilted(normal: vec3f, gradient: vec3f) -> vec3f {
    return normalize(normal - gradient + normal * dot(gradient, normal));
}

// Gradient of the height of stippled gingiva at a place of its own space, mm.
fn stipple_gradient(at: vec3f) -> vec3f {
    let coarse = noise(STIPPLE_TURN * at / STIPPLE_WIDTH).xyz * STIPPLE_TURN;
    let fine = STIPPLE_TURN * noise(at * STIPPLE_TURN / STIPPLE_FINE_WIDTH).xyz;
    return (coarse + fine) * (STIPPLE_DEPTH / STIPPLE_WIDTH);
}

// Share of a surface with a gloss that is enamel which nobody cut.
fn uncut_share(gloss: f32) -> f32 {
    return 1.0 - clamp(abs(gloss - ENAMEL_GLOSS) / ENAMEL_GLOSS_RANGE, 0.0, 1.0);
}

// Gradient of the height of a tooth's surface with a gloss at a place of its own space, mm: bur marks and rough decay, or ridges of
// enamel. Those that are too fine for the pixels at a point are left out.
fn tooth_gradient(at: vec3f, gloss: f32, point: vec3f) -> vec3f {
    let marks = clamp((SMOOTH - gloss) / (SMOOTH - GROUND), 0.0, 1.0);
    let ridges = uncut_share(gloss);
    let is_marked = marks > 0.0;
    let width = select(RIDGE_WIDTH, MARK_WIDTH, is_marked);
    let slope = select(vec2f(0.0), MARK_SLOPE, is_marked);
    let depth = select(RIDGE_DEPTH * ridges, MARK_DEPTH * marks, is_marked) * resolved(point, width.z);
    let inclined = vec3f(at.xy, at.z + dot(slope, at.xy));
    let gradient = noise(inclined / width).xyz / width;
    return (gradient + gradient.z * vec3f(slope, 0.0)) * depth;
}

// Colour and gloss of a tooth's surface with the hairline cracks of its enamel, at a place and with a unit normal of its own space, mm.
// Cracks are narrower where an eye sees the surface from aside.
fn cracked(finish: vec4f, at: vec3f, normal: vec3f, point: vec3f, eye_cosine: f32) -> vec4f {
    let pixel = pixel_at(point) / max((eye_cosine - CRACK_EDGE_ON) / (1.0 - CRACK_EDGE_ON), 0.01);
    let uncut = uncut_share(finish.a) * (1.0 - smoothstep(CRACK_GONE.x, CRACK_GONE.y, pixel));
    if uncut <= 0.0 {
        return finish;
    }
    let width = max(CRACK_WIDTH, CRACK_PIXELS * pixel);
    let part = noise(at.zxy / CRACKED_PART).w;
    let across = select(CRACK_ACROSS[0], CRACK_ACROSS[1], part < 0.0);
    let bend = CRACK_BEND.y * noise(at.yzx / CRACK_BEND.x).w;
    let shift = f32(u32(view.size.w) % CRACK_SHIFTS) * GOLDEN_SHARE;
    let away = CRACK_SPREAD * abs(fract((dot(at, across) + bend) / CRACK_SPREAD + shift) - 0.5);
    // Cracks end in a point.
    let whole = smoothstep(CRACKED_FROM.x, CRACKED_FROM.y, abs(part));
    let line = 1.0 - smoothstep(CRACK_EDGE.x, CRACK_EDGE.y, away / (width * max(whole, 0.01)));
    let seen = uncut * CRACK_WIDTH / width;
    let steep = 1.0 - smoothstep(CRACK_FLAT.x, CRACK_FLAT.y, abs(dot(normal, across)));
    let aside = 1.0 - smoothstep(CRACK_TOP.x, CRACK_TOP.y, normal.z);
    return vec4f(finish.rgb * mix(vec3f(1.0), CRACK_TINT, seen * line * whole * steep * aside), finish.a);
}
