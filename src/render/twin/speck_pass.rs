//! Small things in great number: balls and discs. Twin of `speck_pass.wgsl`.

use super::{Canvas, Pixel, Sight};
use crate::frame::Vec3;
use crate::render::scene::{Finish, Speck};
use crate::volume::rows::{in_rows, processors};

/// How far a disc of water bulges: its normal at the rim leans outward by so much.
const BULGE: f32 = 0.7;
/// A ray meets a disc that it looks along this little nowhere.
const EDGE_ON: f32 = 1e-4;

pub fn grains(specks: &[Speck], sight: &Sight, canvas: &mut Canvas) {
    draw(specks, sight, canvas, |speck, met, point, pixel, depth| {
        pixel.colour = sight.lit(speck.finish, 1.0, point, met.normal);
        pixel.depth = depth;
    });
}

pub fn drops(specks: &[Speck], sight: &Sight, canvas: &mut Canvas) {
    draw(specks, sight, canvas, |speck, met, point, pixel, _| {
        let matt = Vec3::from(sight.lit(Finish { gloss: 0.0, ..speck.finish }, 1.0, point, met.normal));
        let wet = Vec3::from(sight.lit(speck.finish, 1.0, point, met.normal));
        // A lamp is mirrored by clear water as brightly as by milk.
        let glint = (wet - matt).max_element();
        let opacity = met.thick * (speck.opacity + (1.0 - speck.opacity) * glint);
        pixel.colour = (wet * opacity + Vec3::from(pixel.colour) * (1.0 - opacity)).to_array();
    });
}

/// Where a ray meets a speck.
struct Met {
    z: f32,
    normal: Vec3,
    /// How thick the speck is there, as a share of its thickest place.
    thick: f32,
}

/// Asks each speck in turn for the pixels around it.
fn draw(
    specks: &[Speck],
    sight: &Sight,
    canvas: &mut Canvas,
    paint: impl Fn(&Speck, &Met, Vec3, &mut Pixel, f32) + Sync,
) {
    if specks.is_empty() {
        return;
    }
    let (width, height, eye) = (canvas.width, canvas.height, &sight.eye);
    let bands = processors();
    let rows = height.div_ceil(bands as u32).max(1);
    in_rows(&mut canvas.pixels, rows * width, bands, |band, pixels| {
        let first = band * rows;
        let last = first + (pixels.len() / width as usize) as u32;
        for speck in specks {
            let to = speck.place - eye.position;
            let z = to.dot(eye.ahead);
            if z < eye.near || z > eye.far {
                continue;
            }
            let reach = speck.radius * room(to, z, speck.radius);
            let corner = |side: f32| eye.place(speck.place + (eye.right - eye.up) * (side * reach)).0;
            let ([left, top], [right, bottom]) = (corner(-1.0), corner(1.0));
            let span = |low: f32, high: f32, size: u32, least: u32, most: u32| {
                let [low, high] = [low.floor(), high.ceil()].map(|v| v.clamp(0.0, size as f32) as u32);
                low.max(least)..high.min(most)
            };
            for y in span(top * height as f32, bottom * height as f32, height, first, last) {
                for x in span(left * width as f32, right * width as f32, width, 0, width) {
                    let way = sight.ray(x as f32 + 0.5, y as f32 + 0.5);
                    let Some(met) = meet(to, speck.radius, speck.facing, way).filter(|met| met.z >= eye.near) else {
                        continue;
                    };
                    let depth = eye.buffer_depth(met.z);
                    let pixel = &mut pixels[((y - first) * width + x) as usize];
                    if depth < pixel.depth {
                        paint(speck, &met, eye.position + way * met.z, pixel, depth);
                    }
                }
            }
        }
    });
}

/// By how much what is square to the way of sight must be larger than the speck to cover all that is seen of it.
fn room(to: Vec3, z: f32, radius: f32) -> f32 {
    1.02 * to.length() / z * (z / (z - radius).max(1e-6)).min(2.0)
}

/// The front of a ball, or a disc.
fn meet(to: Vec3, radius: f32, facing: Option<Vec3>, way: Vec3) -> Option<Met> {
    let Some(facing) = facing else {
        let nearest = to.dot(way) / way.length_squared();
        let left = radius * radius - (way * nearest - to).length_squared();
        if left < 0.0 {
            return None;
        }
        let z = nearest - left.sqrt() / way.length();
        return Some(Met { z, normal: (way * z - to) / radius, thick: left.sqrt() / radius });
    };
    let slope = way.dot(facing);
    if slope.abs() < EDGE_ON {
        return None;
    }
    let z = to.dot(facing) / slope;
    let aside = (way * z - to) / radius;
    let out = aside.length_squared();
    let toward_eye = if slope > 0.0 { -facing } else { facing };
    let met = Met { z, normal: (toward_eye + aside * (BULGE * out)).normalize(), thick: 1.0 - out * out };
    (out <= 1.0).then_some(met)
}
