// Direct volume rendering: colours and opacities by density, blended along each ray. Compiled after view.wgsl and
// tooth.wgsl. CPU twin: src/render/cpu/volume_pass.rs.

// Depth buffer of the scene drawn so far.
@group(2) @binding(0) var scene_depth: texture_2d<f32>;

// Opacity at which nothing behind is visible.
const OPAQUE: f32 = 0.99;
// Gloss of the shaded share.
const GLOSS: f32 = 0.12;

struct Blended {
    // Multiplied by opacity.
    colour: vec4f,
    // Depth of the first sample that shows anything.
    first: f32,
}

// Density and label (of 255) of a voxel; of the nearest one where there is none.
fn voxel(at: vec3i) -> vec2f {
    return textureLoad(voxels, clamp(at, vec3i(0), vec3i(tooth.dims.xyz) - 1), 0).rg;
}

fn table_entry(density: f32, label: f32) -> vec4f {
    return textureLoad(transfer, vec2i(i32(density * 255.0 + 0.5), i32(label * 255.0 + 0.5)), 0);
}

// Entry of the table of the nearest voxel's label for the density at a place.
fn entry(at: vec3f) -> vec4f {
    return table_entry(density(at), voxel(vec3i(floor(at + 0.5))).g);
}

// Colour and opacity at a place: the entries of the eight labels around it for the density there, by the matter of their
// voxels, so that no face of a voxel shows where tissues meet. Where all entries are equal, that one, to the last bit; and
// where no tissues meet, that of `sole`. The loops count to zero there instead of standing in a branch, which software
// executes also where it is not taken.
fn mixed_entry(at: vec3f, sole: f32, do_tissues_meet: bool) -> vec4f {
    let corner = floor(at);
    let share = at - corner;
    let here = density(at);
    let first = table_entry(here, sole);
    var is_alike = true;
    let labels = select(0u, 8u, do_tissues_meet);
    for (var i = 0u; i < labels; i++) {
        is_alike = is_alike && voxel(vec3i(corner) + corner_step(i)).g == sole;
    }
    var is_equal = true;
    var matter = 0.0;
    // Colours multiplied by opacity.
    var sum = vec4f(0.0);
    let entries = select(8u, 0u, is_alike);
    for (var i = 0u; i < entries; i++) {
        let step = corner_step(i);
        let near = mix(1.0 - share, share, vec3f(step));
        let around = voxel(vec3i(corner) + step);
        let weight = near.x * near.y * near.z * around.r;
        let found = table_entry(here, around.g);
        is_equal = is_equal && all(found == first);
        sum += vec4f(found.rgb * found.a, found.a) * weight;
        matter += weight;
    }
    if is_equal || matter <= 0.0 {
        return first;
    }
    return vec4f(sum.rgb / max(sum.a, 1e-9), sum.a / matter);
}

// Step from the first to another of the eight voxels around a place.
fn corner_step(i: u32) -> vec3i {
    return vec3i(i32(i & 1u), i32((i >> 1u) & 1u), i32(i >> 2u));
}

// From front to back until nothing shines through or the scene ends the ray.
fn blend(start: vec3f, along: vec3f, pace: f32, behind: f32) -> Blended {
    let ends = span(start, along);
    let end = min(ends.y, behind);
    // Samples lie at whole steps from the eye, so that leaping over nothing changes nothing.
    var number = ceil(max(ends.x, view.position.w) / pace);
    var z = number * pace;
    var blended = Blended(vec4f(0.0), -1.0);
    while z < end {
        let at = start + along * z;
        let brick = brick_of(at);
        let known = textureLoad(empty, vec3i(brick), 0).rg;
        let is_even = known.r == EVEN;
        let is_one_tissue = known.r == ONE_TISSUE;
        let steps = f32(select(known.r, 0u, is_even || is_one_tissue));
        var out = z + way_out(at, along, brick, steps);
        if steps > 0.0 {
            number = max(ceil(out / pace), number + 1.0);
            z = number * pace;
            continue;
        }
        out = min(out, end);
        // In a uniform brick all samples are equal, so one sample stands for all of them.
        let samples = select(1.0, max(ceil(out / pace) - number, 1.0), is_even);
        while z < out {
            let place = start + along * z;
            var sole = f32(known.g) / 255.0;
            if !is_one_tissue {
                sole = voxel(vec3i(floor(place + 0.5))).g;
            }
            let found = mixed_entry(place, sole, !is_even && !is_one_tissue);
            if found.a > 0.0 {
                let opacity = select(found.a, 1.0 - pow(1.0 - found.a, samples), is_even);
                blended.colour += vec4f(found.rgb, 1.0) * (opacity * (1.0 - blended.colour.a));
                blended.first = select(blended.first, z, blended.first < 0.0);
                if blended.colour.a > OPAQUE {
                    return blended;
                }
            }
            number += samples;
            z = number * pace;
        }
    }
    return blended;
}

// Attenuation of the highest value of a table, per mm, in 65535 parts.
const MOST_ATTENUATION: f32 = 20.0;
// Optical depth shown as white, and the brightness up to which the film is linear.
const WHITE_DEPTH: f32 = 3.0;
const FILM_LINEAR_UP_TO: f32 = 0.76;
// Colour of a lit film.
const FILM: vec3f = vec3f(0.94, 0.97, 1.0);

// Line integral of the attenuation along a ray, without unit, up to the end of the scene.
fn optical_depth(start: vec3f, along: vec3f, pace: f32, behind: f32) -> f32 {
    let ends = span(start, along);
    let end = min(ends.y, behind);
    var number = ceil(max(ends.x, view.position.w) / pace);
    var z = number * pace;
    var sum = 0.0;
    while z < end {
        let at = start + along * z;
        let known = textureLoad(empty, vec3i(brick_of(at)), 0).r;
        let is_even = known == EVEN;
        let steps = f32(select(known, 0u, is_even || known == ONE_TISSUE));
        var out = z + way_out(at, along, brick_of(at), steps);
        if steps > 0.0 {
            number = max(ceil(out / pace), number + 1.0);
            z = number * pace;
            continue;
        }
        out = min(out, end);
        let samples = select(1.0, max(ceil(out / pace) - number, 1.0), is_even);
        while z < out {
            let found = floor(entry(start + along * z).rg * 255.0 + 0.5);
            sum += (found.x * 256.0 + found.y) * samples;
            number += samples;
            z = number * pace;
        }
    }
    return sum * (MOST_ATTENUATION / 65535.0) * tooth.low.w;
}

// Brightness of the film: linear in optical depth, then compressed.
fn film(depth: f32) -> f32 {
    let linear = depth / WHITE_DEPTH;
    let left = 1.0 - FILM_LINEAR_UP_TO;
    let compressed = 1.0 - left * left / (linear + left - FILM_LINEAR_UP_TO);
    return select(linear, compressed, linear > FILM_LINEAR_UP_TO);
}

@fragment
fn volume_fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let way = ray(pixel.xy);
    let start = ray_start();
    let along = ray_along(way);
    let at = pixel.xy / vec2f(textureDimensions(scene_depth));
    let behind = depth_of(textureSampleLevel(scene_depth, depth_sampler, at, 0.0).r);
    if tooth.spacing.w > 0.0 {
        let white = film(optical_depth(start, along, tooth.low.w / length(way), behind));
        return vec4f(screen(FILM) * white, white);
    }
    let blended = blend(start, along, tooth.low.w / length(way), behind);
    if blended.first < 0.0 {
        discard;
    }
    let plain = blended.colour.rgb / blended.colour.a;
    let downhill = -slope(start + along * blended.first);
    let long = length(downhill);
    let normal = select(-normalize(way), downhill / max(long, 1e-9), long > 1e-6);
    let lamps = lit(vec4f(plain, GLOSS), 1.0, view.position.xyz + way * blended.first, normal);
    let colour = screen(mix(plain, lamps, tooth.high.w));
    return vec4f(colour * blended.colour.a, blended.colour.a);
}
