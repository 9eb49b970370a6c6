// Surface of the carved tooth, found by a ray through each pixel. Compiled after view.wgsl,
// relief.wgsl and tooth.wgsl.
// CPU twin: src/render/cpu/iso_pass.rs.

// Density at which matter begins.
const ISO: f32 = 0.5;
// Step within a surface, in voxels: even a single voxel is solid for longer than that.
const STEP: f32 = 0.8;
// Step in empty space, in voxels: even a single voxel gives a density above zero over two voxels of a ray.
const STEP_IN_AIR: f32 = 1.6;
// False positions after one halving: together a hundredth of a voxel.
const SECANTS: i32 = 2;

struct Seen {
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

// Depth, mm, of the first place with matter along a ray; -1 if there is none.
fn first_hit(start: vec3f, along: vec3f) -> f32 {
    let ends = span(start, along);
    let pace = max(max(abs(along.x), abs(along.y)), abs(along.z));
    let step = STEP / pace;
    let step_in_air = STEP_IN_AIR / pace;
    var z = max(ends.x, view.position.w);
    var before = z;
    var density_before = 0.0;
    while z < ends.y {
        let at = start + along * z;
        let brick = brick_of(at);
        let steps = f32(textureLoad(empty, vec3i(brick), 0).r);
        let out = z + way_out(at, along, brick, steps);
        if steps > 0.0 {
            z = out;
            before = z;
            density_before = 0.0;
            continue;
        }
        while z < out {
            let now = density(start + along * z);
            if now >= ISO {
                return refined(start, along, before, density_before, z, now);
            }
            before = z;
            density_before = now;
            z += select(step_in_air, step, now > 0.0);
        }
    }
    return -1.0;
}

// The surface between a place without and a place with matter.
fn refined(start: vec3f, along: vec3f, before: f32, density_before: f32, z: f32, density_at: f32) -> f32 {
    var outside = before;
    var low = density_before;
    var inside = z;
    var high = density_at;
    var middle = 0.5 * (outside + inside);
    for (var i = 0; i <= SECANTS; i++) {
        let value = density(start + along * middle);
        if value >= ISO {
            inside = middle;
            high = value;
        } else {
            outside = middle;
            low = value;
        }
        let part = clamp((ISO - low) / max(high - low, 1e-6), 0.05, 0.95);
        middle = outside + (inside - outside) * part;
    }
    return middle;
}

// The depth alone, for shadows.
@fragment
fn iso_depth_fragment(@builtin(position) pixel: vec4f) -> @builtin(frag_depth) f32 {
    let z = first_hit(ray_start(), ray_along(ray(pixel.xy)));
    if z < 0.0 {
        discard;
    }
    return buffer_depth(z);
}

@fragment
fn iso_fragment(@builtin(position) pixel: vec4f) -> Seen {
    let way = ray(pixel.xy);
    let start = ray_start();
    let along = ray_along(way);
    let z = first_hit(start, along);
    if z < 0.0 {
        discard;
    }
    let at = start + along * z;
    let point = view.position.xyz + way * z;
    let downhill = -slope(at);
    let long = length(downhill);
    let normal = select(-normalize(way), downhill / max(long, 1e-9), long > 1e-6);
    let seen = finish(at);
    let open = openness(at, normal);
    let colour = lit(hairline(seen, at, point, normal), open, point, marked(at, point, normal, seen.a));
    return Seen(vec4f(screen(colour), 1.0), buffer_depth(z));
}
