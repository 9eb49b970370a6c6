//! Light on a tooth that lies before white paper: that of a lesson, seen from the camera's side, and shade in hollows, so that
//! fissures and cavities are seen.
//!
//! Shade in hollows is the depth of a place below its surroundings in the picture, at three sizes of surroundings. After
//! Luft, Colditz & Deussen, *Image Enhancement by Unsharp Masking the Depth Buffer* (2006).

use crate::raycast::{Hit, OrthographicCamera};
use typodont_core::frame::Vec3;
use typodont_core::parallel::par_rows;
use typodont_render::{Appearance, Lamp, Lights, LitPoint};

/// Distance of the head lamp from the tooth, mm: that of a dentist's eyes.
const EYE_DISTANCE: f32 = 350.0;

/// Light lost where a surface turns away from the eye: draws a pale tooth's outline on white paper.
const RIM: f32 = 0.2;

/// Surroundings that a place's depth is compared with: half their width, mm, and the share of light that is lost at most.
/// The finest shows fissures, the widest a cavity's floor. 0.6 in all still tells colours.
const OCCLUSION_SCALES: [(f32, f32); 3] = [(0.25, 0.24), (0.7, 0.22), (1.8, 0.16)];

/// Share of light that a surface with this normal in tooth space returns; `occlusion` is the share lost in hollows there. It
/// falls toward the outline, too.
pub fn openness(camera: &OrthographicCamera, normal: Vec3, occlusion: f32) -> f32 {
    let facing = normal.dot(camera.back()).clamp(0.0, 1.0);
    let away = 1.0 - facing;
    // At its outline a surface is deeper than its surroundings without being a hollow.
    ((1.0 - occlusion * (0.3 + 0.7 * facing)) * (1.0 - RIM * away * away)).min(1.0)
}

/// Lamps around a camera, in its space, placed as around a trainee.
pub fn lamps() -> Lights {
    Lights { head: Lamp::head(Vec3::new(0.0, 0.0, EYE_DISTANCE)), ..Lights::default() }
}

/// A surface's colour on the screen, in the light of [`lamps`].
pub fn lit_colour(lamps: &Lights, camera: &OrthographicCamera, finish: Appearance, hit: &Hit) -> [f32; 4] {
    let seen = |v: Vec3| Vec3::new(v.dot(camera.right), v.dot(camera.up), v.dot(camera.back()));
    let place =
        LitPoint { point: seen(hit.point - camera.middle), normal: seen(hit.normal), to_eye: Vec3::Z, open: hit.open };
    let [red, green, blue] = lamps.shade(finish, place, || 1.0);
    [red, green, blue, 1.0]
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
