//! Light as in a photograph for a textbook: a soft lamp from the upper left, a weaker one from the right, and shade in
//! hollows, so that fissures and cavities are seen while colours stay what they are.
//!
//! Shade in hollows is the depth of a place below its surroundings in the picture, at three sizes of surroundings. After
//! Luft, Colditz & Deussen, *Image Enhancement by Unsharp Masking the Depth Buffer* (2006).

use crate::raycast::{Hit, OrthographicCamera};
use typodont_core::frame::Vec3;
use typodont_core::parallel::par_rows;

/// Toward the lamps as (right, up, back), need not be unit; chosen by eye on teeth.
const KEY: Vec3 = Vec3::new(-0.55, 0.65, 0.8);
const FILL: Vec3 = Vec3::new(0.8, 0.05, 0.6);

/// Shares of full light. Together a little more than 1 where a surface faces the key.
const AMBIENT: f32 = 0.30;
const KEY_SHARE: f32 = 0.60;
const FILL_SHARE: f32 = 0.17;

/// Reach of the key light past the edge of its own shadow, as a cosine: a large, soft lamp.
const WRAP: f32 = 0.2;

/// Light lost where a surface turns away from the eye: draws a pale tooth's outline on white paper.
const RIM: f32 = 0.2;

/// Gloss of wet enamel, as a share of full light, and how tight its highlight is.
const GLOSS: f32 = 0.10;
const GLOSS_TIGHTNESS: f32 = 28.0;

/// Shade on a tooth is warm, because light comes through it: the share by which red gains and blue loses there.
const WARMTH: f32 = 0.12;

/// Surroundings that a place's depth is compared with: half their width, mm, and the share of light that is lost at most.
/// The finest shows fissures, the widest a cavity's floor. 0.6 in all still tells colours.
const OCCLUSION_SCALES: [(f32, f32); 3] = [(0.25, 0.24), (0.7, 0.22), (1.8, 0.16)];

/// Sets the light that falls on a hit; `occlusion` is the share of light lost in hollows there.
pub fn shade_hit(camera: &OrthographicCamera, hit: Hit, occlusion: f32) -> Hit {
    let normal = Vec3::new(hit.normal.dot(camera.right), hit.normal.dot(camera.up), hit.normal.dot(camera.back()));
    let (key, fill) = (KEY.normalize(), FILL.normalize());
    let from_key = ((normal.dot(key) + WRAP) / (1.0 + WRAP)).max(0.0);
    let from_fill = normal.dot(fill).max(0.0);
    let away = 1.0 - normal.z.clamp(0.0, 1.0);
    let rim = 1.0 - RIM * away * away;
    // At its outline a surface is deeper than its surroundings without being a hollow.
    let open = 1.0 - occlusion * (0.3 + 0.7 * normal.z.clamp(0.0, 1.0));
    let light = (AMBIENT + KEY_SHARE * from_key + FILL_SHARE * from_fill) * rim * open;
    let half = (key + Vec3::Z).normalize();
    let gloss = GLOSS * libm::powf(normal.dot(half).max(0.0), GLOSS_TIGHTNESS) * open;
    Hit { light, gloss, ..hit }
}

/// A colour as a screen shows it, in the light of a hit.
pub fn lit_colour(colour: [f32; 3], hit: &Hit) -> [f32; 4] {
    let lost = (1.0 - hit.light).max(0.0);
    // A square is near enough to a screen's curve, and the same on every machine.
    let lit = |c: f32, warmth: f32| (c * c * (hit.light + warmth * lost * hit.light) + hit.gloss).min(1.0).sqrt();
    let [red, green, blue] = colour;
    [lit(red, WARMTH), lit(green, 0.0), lit(blue, -WARMTH), 1.0]
}

/// Share of light lost per pixel because the surface is deeper there than around it.
pub fn ambient_occlusion(depths: &[Option<f32>], width: usize, pixel: f32, threads: usize) -> Vec<f32> {
    let mut lost = vec![0.0f32; depths.len()];
    for (radius, share) in OCCLUSION_SCALES {
        let reach = ((radius / pixel) as usize).max(1);
        let around = BlurredDepth::of(depths, width, reach, threads);
        for ((lost, depth), around) in lost.iter_mut().zip(depths).zip(&around.depths) {
            if let (Some(depth), Some(around)) = (depth, around) {
                // A pit as deep as half its own radius loses all it can; what stands out gains a little.
                let below = (depth - around) / (0.5 * radius);
                *lost += share * below.clamp(-0.25, 1.0);
            }
        }
    }
    lost
}

/// Mean depth of the surface around each pixel.
struct BlurredDepth {
    depths: Vec<Option<f32>>,
}

impl BlurredDepth {
    /// Two passes of a box each way: nearly a bell.
    fn of(depths: &[Option<f32>], width: usize, reach: usize, threads: usize) -> BlurredDepth {
        let height = depths.len() / width;
        let mut sums: Vec<[f32; 2]> = depths.iter().map(|d| d.map_or([0.0, 0.0], |d| [d, 1.0])).collect();
        for _ in 0..2 {
            box_rows(&mut sums, width, reach, threads);
            sums = transposed(&sums, width);
            box_rows(&mut sums, height, reach, threads);
            sums = transposed(&sums, height);
        }
        BlurredDepth { depths: sums.iter().map(|&[sum, weight]| (weight > 1e-4).then(|| sum / weight)).collect() }
    }
}

fn box_rows(values: &mut [[f32; 2]], width: usize, reach: usize, threads: usize) {
    par_rows(values, width as u32, threads, |_, row| {
        let mut total = [0.0f64; 2];
        let mut so_far = vec![total];
        for value in row.iter() {
            total = [total[0] + f64::from(value[0]), total[1] + f64::from(value[1])];
            so_far.push(total);
        }
        for (i, value) in row.iter_mut().enumerate() {
            let (low, high) = (so_far[i.saturating_sub(reach)], so_far[(i + reach + 1).min(so_far.len() - 1)]);
            let scale = 1.0 / (2 * reach + 1) as f64;
            *value = [((high[0] - low[0]) * scale) as f32, ((high[1] - low[1]) * scale) as f32];
        }
    });
}

fn transposed(values: &[[f32; 2]], width: usize) -> Vec<[f32; 2]> {
    let height = values.len() / width;
    (0..values.len()).map(|i| values[i % height * width + i / height]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pit_is_darker_than_a_plain_and_a_plain_loses_nothing() {
        let (width, height) = (60, 50);
        let depth = |i: usize| {
            let (x, y) = ((i % width) as f32 - 30.0, (i / width) as f32 - 25.0);
            if x * x + y * y < 16.0 { 1.5 } else { 1.0 }
        };
        let depths: Vec<Option<f32>> = (0..width * height).map(|i| (i % width > 3).then(|| depth(i))).collect();
        let lost = ambient_occlusion(&depths, width, 0.05, 2);
        assert!(lost[25 * width + 30] > 0.25, "{}", lost[25 * width + 30]);
        assert!(lost[2 * width + 5].abs() < 0.02);
        assert_eq!(lost[0], 0.0);
    }
}
