// Triangles shaded per pixel: solids, and the carved tooth as a mesh. Compiled after view.wgsl, relief.wgsl and tooth.wgsl.
// CPU twin: src/render/cpu/surface_pass.rs.

struct Solid {
    world_from_solid: mat4x4f,
    // Colour and gloss, multiplied with those of the vertices.
    finish: vec4f,
}

@group(2) @binding(0) var<uniform> solid: Solid;

struct Corner {
    @location(0) position: vec3f,
    // w: gloss.
    @location(1) normal: vec4f,
    // w: stippling.
    @location(2) colour: vec4f,
}

// A place of the tooth, whose colour is not at its corners. In software, each value that varies over a triangle costs time for each.
struct ToothPlace {
    @builtin(position) place: vec4f,
    @location(0) point: vec3f,
    @location(1) normal: vec3f,
}

// A place of a solid.
struct SolidPlace {
    @builtin(position) place: vec4f,
    @location(0) point: vec3f,
    @location(1) normal: vec3f,
    @location(2) finish: vec4f,
}

// The same with relief.
struct ReliefPlace {
    @builtin(position) place: vec4f,
    @location(0) point: vec3f,
    @location(1) normal: vec3f,
    @location(2) finish: vec4f,
    // Place in the mesh's own space, mm; w: stippling.
    @location(3) own: vec4f,
}

fn placed(corner: Corner, world_from_own: mat4x4f) -> ToothPlace {
    let point = world_from_own * vec4f(corner.position, 1.0);
    let normal = (world_from_own * vec4f(corner.normal.xyz, 0.0)).xyz;
    return ToothPlace(view.clip_from_world * point, point.xyz, normal);
}

@vertex
fn solid_vertex(corner: Corner) -> SolidPlace {
    let at = placed(corner, solid.world_from_solid);
    return SolidPlace(at.place, at.point, at.normal, vec4f(corner.colour.rgb, corner.normal.w));
}

@vertex
fn relief_vertex(corner: Corner) -> ReliefPlace {
    let at = placed(corner, solid.world_from_solid);
    let finish = vec4f(corner.colour.rgb, corner.normal.w);
    return ReliefPlace(at.place, at.point, at.normal, finish, vec4f(corner.position, corner.colour.w));
}

@fragment
fn solid_fragment(in: SolidPlace) -> @location(0) vec4f {
    return vec4f(screen(lit(in.finish * solid.finish, 1.0, in.point, normalize(in.normal))), 1.0);
}

@fragment
fn stippled_fragment(in: ReliefPlace) -> @location(0) vec4f {
    var normal = normalize(in.normal);
    if has_relief {
        let gradient = stipple_gradient(in.own.xyz) * (in.own.w * resolved(in.point, STIPPLE_FINE_WIDTH));
        normal = tilted(normal, (solid.world_from_solid * vec4f(gradient, 0.0)).xyz);
    }
    return vec4f(screen(lit(in.finish * solid.finish, 1.0, in.point, normal)), 1.0);
}

@vertex
fn tooth_vertex(corner: Corner) -> ToothPlace {
    return placed(corner, tooth.world_from_tooth);
}

// Cosine between the normal of a tooth's surface and the way to the eye below which the normal is turned to the eye.
const EDGE_ON: f32 = 0.4;

// Unit normal of a place that an eye sees: at the sharp rim of a cut, the gradient of voxels may turn away from the eye.
fn turned_to_eye(normal: vec3f, to_eye: vec3f) -> vec3f {
    return normalize(normal + to_eye * max(EDGE_ON - dot(normal, to_eye), 0.0));
}

@fragment
fn tooth_fragment(in: ToothPlace) -> @location(0) vec4f {
    let normal = turned_to_eye(normalize(in.normal), normalize(view.position.xyz - in.point));
    let at = (tooth.voxel_from_world * vec4f(in.point, 1.0)).xyz;
    let seen = finish(at);
    let open = openness(at, normal);
    return vec4f(screen(lit(hairline(seen, at, in.point, normal), open, in.point, marked(at, in.point, normal, seen.a))), 1.0);
}

// Another tooth, whose enamel is as that of the carved one.
@fragment
fn enamel_fragment(in: ReliefPlace) -> @location(0) vec4f {
    var normal = normalize(in.normal);
    var seen = in.finish * solid.finish;
    if has_relief {
        let own_normal = (vec4f(normal, 0.0) * solid.world_from_solid).xyz;
        seen = cracked(seen, in.own.xyz, own_normal, in.point, dot(normal, normalize(view.position.xyz - in.point)));
        let gradient = tooth_gradient(in.own.xyz, ENAMEL_GLOSS, in.point);
        normal = tilted(normal, (solid.world_from_solid * vec4f(gradient, 0.0)).xyz);
    }
    return vec4f(screen(lit(seen, 1.0, in.point, normal)), 1.0);
}

// The greatest depth that is less than that of an empty picture.
const BEHIND_ALL: f32 = 0.99999994;

// Behind everything: a triangle that covers the picture.
@vertex
fn background_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, BEHIND_ALL, 1.0);
}

@fragment
fn background_fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let from_middle = (pixel.xy / view.size.xy - 0.5) * 2.0;
    let share = 0.5 * dot(from_middle, from_middle);
    let even = mix(view.background_middle.rgb, view.background_edge.rgb, share);
    let is_even = all(view.background_middle.rgb == view.background_edge.rgb);
    return vec4f(screen(even + select(dither(pixel.xy), 0.0, is_even)), 1.0);
}
