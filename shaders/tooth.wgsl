// The carved tooth as a volume, for the passes that sample it. Compiled after view.wgsl and relief.wgsl.
// CPU twin: src/render/cpu/volume_sampler.rs. `at` is a place in voxel steps from the centre of the first voxel.

struct Tooth {
    world_from_voxel: mat4x4f,
    voxel_from_world: mat4x4f,
    world_from_tooth: mat4x4f,
    // Voxels; w: voxels along the edge of a cube of `hollow`.
    dims: vec4f,
    // Corners of the box that contains all matter; low.w: step of blending, mm.
    low: vec4f,
    // w: share of the colour that lamps shade in blending.
    high: vec4f,
    // Voxel spacing, mm; w: 1 for a radiograph.
    spacing: vec4f,
    // Voxels along the edge of a cell of `colours`.
    cells: vec4f,
}

@group(1) @binding(0) var<uniform> tooth: Tooth;
// Density and label (of 255).
@group(1) @binding(1) var voxels: texture_3d<f32>;
@group(1) @binding(2) var between: sampler;
// Bricks to the nearest that may show something, EVEN, or ONE_TISSUE with the label to look up in green.
@group(1) @binding(3) var empty: texture_3d<u32>;
// Mean density of cubes.
@group(1) @binding(4) var hollow: texture_3d<f32>;
// By density and label: colour and opacity after one step; for a radiograph attenuation in red and green.
@group(1) @binding(5) var transfer: texture_2d<f32>;
// Colour and gloss of cells near the surface.
@group(1) @binding(6) var colours: texture_3d<f32>;

const BRICK: f32 = 8.0;
// A brick in which every sample is the same.
const EVEN: u32 = 0x80u;
// A brick whose matter looks alike.
const ONE_TISSUE: u32 = 0x40u;
// Share of a voxel that surely leads across a border between bricks, however numbers are rounded.
const NUDGE: f32 = 0.004;
// Way outward to the place whose surroundings shade a surface, mm, and the share of light that it can cost.
const REACH: f32 = 0.7;
const DARKEST: f32 = 0.62;

// The eye in voxels.
fn ray_start() -> vec3f {
    return (tooth.voxel_from_world * vec4f(view.position.xyz, 1.0)).xyz;
}

// A ray of world space in voxels, per mm of depth.
fn ray_along(way: vec3f) -> vec3f {
    return (tooth.voxel_from_world * vec4f(way, 0.0)).xyz;
}

// Trilinear; empty beyond the grid.
fn density(at: vec3f) -> f32 {
    let inside = clamp(min(at + 1.0, tooth.dims.xyz - at), vec3f(0.0), vec3f(1.0));
    let value = textureSampleLevel(voxels, between, (at + 0.5) / tooth.dims.xyz, 0.0).r;
    return value * inside.x * inside.y * inside.z;
}

// Depths, mm, at which the ray enters and leaves the box of matter; empty if x > y.
fn span(start: vec3f, along: vec3f) -> vec2f {
    let safe = select(along, vec3f(1e-9), abs(along) < vec3f(1e-9));
    let a = (tooth.low.xyz - start) / safe;
    let b = (tooth.high.xyz - start) / safe;
    let first = min(a, b);
    let last = max(a, b);
    return vec2f(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

// Distance after which the ray leaves the cube of bricks around this one; always above 0.
fn way_out(at: vec3f, along: vec3f, brick: vec3f, steps: f32) -> f32 {
    let reach = max(steps, 1.0);
    // The first brick goes on where the grid has ended.
    let first = brick + 1.0 - reach;
    let low = select(first, vec3f(-1.0), first <= vec3f(0.0)) * BRICK;
    let high = (brick + reach) * BRICK;
    let room = select(at - low, high - at, along > vec3f(0.0));
    let ways = (max(room, vec3f(0.0)) + NUDGE) / max(abs(along), vec3f(1e-9));
    return min(min(ways.x, ways.y), ways.z);
}

// The brick that a place is in.
fn brick_of(at: vec3f) -> vec3f {
    return clamp(floor(at / BRICK), vec3f(0.0), ceil(tooth.dims.xyz / BRICK) - 1.0);
}

// Gradient of the density, per mm in world space, from four corners of a cube two voxels wide, so that the steps that
// carving leaves along voxels are not visible in the shading.
fn slope(at: vec3f) -> vec3f {
    let a = density(at + vec3f(1.0, -1.0, -1.0));
    let b = density(at + vec3f(-1.0, -1.0, 1.0));
    let c = density(at + vec3f(-1.0, 1.0, -1.0));
    let d = density(at + vec3f(1.0, 1.0, 1.0));
    let rise = vec3f(a - b - c + d, c + d - a - b, b + d - a - c);
    let per_mm = rise * 0.25 / (tooth.spacing.xyz * tooth.spacing.xyz);
    return (tooth.world_from_voxel * vec4f(per_mm, 0.0)).xyz;
}

// Share of light that reaches a surface with this normal.
fn openness(at: vec3f, normal: vec3f) -> f32 {
    let outside = at + (tooth.voxel_from_world * vec4f(normal * REACH, 0.0)).xyz;
    let cubes = vec3f(textureDimensions(hollow));
    return 1.0 - DARKEST * textureSampleLevel(hollow, between, (outside + 0.5) / (tooth.dims.w * cubes), 0.0).r;
}

// Colour and gloss of the surface at a place.
fn finish(at: vec3f) -> vec4f {
    let cells = vec3f(textureDimensions(colours));
    return textureSampleLevel(colours, between, (at + 0.5) / (tooth.cells.x * cells), 0.0);
}

// Unit normal of a surface with the relief that belongs to its gloss.
fn marked(at: vec3f, point: vec3f, normal: vec3f, gloss: f32) -> vec3f {
    if !has_relief {
        return normal;
    }
    let gradient = tooth_gradient(at * tooth.spacing.xyz, gloss, point);
    return tilted(normal, (tooth.world_from_tooth * vec4f(gradient, 0.0)).xyz);
}

// Colour and gloss of a surface with the cracks of its enamel.
fn hairline(finish: vec4f, at: vec3f, point: vec3f, normal: vec3f) -> vec4f {
    if !has_relief {
        return finish;
    }
    let own_normal = (vec4f(normal, 0.0) * tooth.world_from_tooth).xyz;
    let eye_cosine = dot(normal, normalize(view.position.xyz - point));
    return cracked(finish, at * tooth.spacing.xyz, own_normal, point, eye_cosine);
}

fn box_corner(index: u32) -> vec3f {
    // Two triangles for each of six sides, counter-clockwise from outside.
    var corners = array<u32, 36>(
        0u, 2u, 1u, 1u, 2u, 3u, 4u, 5u, 6u, 5u, 7u, 6u,
        0u, 1u, 4u, 1u, 5u, 4u, 2u, 6u, 3u, 3u, 6u, 7u,
        0u, 4u, 2u, 2u, 4u, 6u, 1u, 3u, 5u, 3u, 7u, 5u,
    );
    let corner = corners[index];
    let share = vec3f(f32(corner & 1u), f32((corner >> 1u) & 1u), f32(corner >> 2u));
    return mix(tooth.low.xyz, tooth.high.xyz, share);
}

// Far sides of the box of matter, so that each pixel is drawn once and the eye may be inside the box.
@vertex
fn box_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return view.clip_from_world * (tooth.world_from_voxel * vec4f(box_corner(index), 1.0));
}
