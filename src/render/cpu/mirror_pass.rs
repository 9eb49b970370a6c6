//! A disc that shows what its reflected eye sees. Twin of `mirror_pass.wgsl`.

use super::{CpuView, Framebuffer};
use crate::mirror::PlaneMirror;
use crate::scene::Rgb;
use typodont_core::frame::Vec3;
use typodont_core::image::RgbaImage;

pub fn mirror_pass(mirror: &PlaneMirror, reflected: &RgbaImage, view: &CpuView, framebuffer: &mut Framebuffer) {
    let (right, up, normal) = (mirror.right(), mirror.up(), mirror.normal());
    let (middle, eye) = (mirror.world_from_mirror.position, view.eye);
    framebuffer.for_each_pixel(|x, y, pixel| {
        let direction = view.ray(x, y);
        let facing = direction.dot(normal);
        let z = (middle - eye.position).dot(normal) / facing.min(-1e-6);
        let from_middle = eye.position + direction * z - middle;
        let (across, above) = (from_middle.dot(right) / mirror.radius, from_middle.dot(up) / mirror.radius);
        if facing >= 0.0 || z < eye.near || z > eye.far || across * across + above * above > 1.0 {
            return;
        }
        let depth = eye.buffer_depth(z);
        if depth < pixel.depth {
            let colour = sample_linear(reflected, [0.5 + 0.5 * across, 0.5 - 0.5 * above]);
            pixel.colour = colour.map(|c| c * mirror.reflectance);
            pixel.depth = depth;
        }
    });
}

/// Linear between texels, from 0 to 1 across the picture.
fn sample_linear(picture: &RgbaImage, share: [f32; 2]) -> Rgb {
    let size = [picture.width, picture.height];
    let at: [f32; 2] = std::array::from_fn(|a| share[a] * size[a] as f32 - 0.5);
    let base = at.map(f32::floor);
    let part: [f32; 2] = std::array::from_fn(|a| at[a] - base[a]);
    let texel = |dx: f32, dy: f32| {
        let place = |v: f32, size: u32| v.clamp(0.0, size as f32 - 1.0) as u32;
        let [r, g, b, _] = picture.pixel(place(base[0] + dx, size[0]), place(base[1] + dy, size[1]));
        Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0
    };
    let upper = texel(0.0, 0.0).lerp(texel(1.0, 0.0), part[0]);
    let lower = texel(0.0, 1.0).lerp(texel(1.0, 1.0), part[0]);
    upper.lerp(lower, part[1]).to_array()
}
