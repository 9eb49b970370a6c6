//! Triangles to pixels with a depth buffer, by the rules of graphics adapters: corners on a grid of 1/256 pixel, a pixel
//! belongs to the triangle that its middle lies in, on an edge to the one below or to the right.

use super::{Canvas, Pixel};
use crate::volume::rows::{in_rows, processors};

/// What varies over a triangle: see `surface_pass`.
pub const VARYING: usize = 10;

#[derive(Clone, Copy)]
pub struct Corner {
    pub clip: [f32; 4],
    pub vary: [f32; VARYING],
}

/// Steps of the grid that corners are put on, per pixel.
const GRID: f32 = 256.0;

/// Draws what faces the eye, counter-clockwise; `shade` turns what varies into a colour.
pub fn draw(
    corners: &[Corner],
    triangles: &[[u32; 3]],
    canvas: &mut Canvas,
    shade: impl Fn([f32; VARYING]) -> [f32; 3] + Sync,
) {
    let (width, height) = (canvas.width, canvas.height);
    let bands = processors();
    let rows = height.div_ceil(bands as u32).max(1);
    in_rows(&mut canvas.pixels, rows * width, bands, |band, pixels| {
        let mut strip = Strip { pixels, width, height, first: band * rows };
        for triangle in triangles {
            strip.clipped(triangle.map(|i| corners[i as usize]), &shade);
        }
    });
}

/// Some rows of a canvas.
struct Strip<'a> {
    pixels: &'a mut [Pixel],
    width: u32,
    height: u32,
    first: u32,
}

impl Strip<'_> {
    /// Cuts off what lies before the near plane, then fills what is left.
    fn clipped(&mut self, triangle: [Corner; 3], shade: &impl Fn([f32; VARYING]) -> [f32; 3]) {
        if triangle.iter().all(|c| c.clip[2] >= 0.0) {
            return self.fill(&triangle, shade);
        }
        let mut kept: Vec<Corner> = Vec::with_capacity(4);
        for (i, &from) in triangle.iter().enumerate() {
            let to = triangle[(i + 1) % 3];
            if from.clip[2] >= 0.0 {
                kept.push(from);
            }
            if (from.clip[2] >= 0.0) != (to.clip[2] >= 0.0) {
                kept.push(between(&from, &to, from.clip[2] / (from.clip[2] - to.clip[2])));
            }
        }
        for i in 2..kept.len() {
            self.fill(&[kept[0], kept[i - 1], kept[i]], shade);
        }
    }

    fn fill(&mut self, triangle: &[Corner; 3], shade: &impl Fn([f32; VARYING]) -> [f32; 3]) {
        let [width, height] = [self.width as f32, self.height as f32];
        let place = triangle.map(|c| {
            let [x, y, _, w] = c.clip;
            [(0.5 + 0.5 * x / w) * width, (0.5 - 0.5 * y / w) * height].map(|v| f64::from(v * GRID).round() as i64)
        });
        // With y downward, what is counter-clockwise to the eye has a negative area.
        let area = -cross(place[0], place[1], place[2]);
        if area <= 0 {
            return;
        }
        let last_row = self.first + (self.pixels.len() / self.width as usize) as u32;
        let [xs, ys] = [0, 1].map(|a| place.map(|p| p[a]));
        let middles = |values: [i64; 3], low: u32, end: u32| {
            let grid = GRID as i64;
            let least = values.iter().min().copied().unwrap_or(0).div_euclid(grid).max(i64::from(low));
            let most = values.iter().max().copied().unwrap_or(0).div_euclid(grid).min(i64::from(end) - 1);
            least..=most
        };
        let inverse = triangle.map(|c| 1.0 / c.clip[3]);
        for y in middles(ys, self.first, last_row) {
            for x in middles(xs, 0, self.width) {
                let middle = [x, y].map(|v| v * GRID as i64 + GRID as i64 / 2);
                let weights = [1, 2, 0].map(|i| (i, (i + 1) % 3)).map(|(a, b)| {
                    let value = -cross(place[a], place[b], middle);
                    let edge = [place[b][0] - place[a][0], place[b][1] - place[a][1]];
                    let owns = edge[1] > 0 || (edge[1] == 0 && edge[0] < 0);
                    if value > 0 || (value == 0 && owns) { Some(value) } else { None }
                });
                let [Some(a), Some(b), Some(c)] = weights else { continue };
                let share = [a, b, c].map(|v| v as f32 / area as f32);
                let depth: f32 = (0..3).map(|i| share[i] * triangle[i].clip[2] * inverse[i]).sum();
                let pixel = &mut self.pixels[(y as usize - self.first as usize) * self.width as usize + x as usize];
                if !(0.0..=1.0).contains(&depth) || depth >= pixel.depth {
                    continue;
                }
                let near = [0, 1, 2].map(|i| share[i] * inverse[i]);
                let total = near[0] + near[1] + near[2];
                let vary = |v: usize| (0..3).map(|i| near[i] * triangle[i].vary[v]).sum::<f32>() / total;
                *pixel = Pixel { colour: shade(std::array::from_fn(vary)), depth };
            }
        }
    }
}

fn between(from: &Corner, to: &Corner, part: f32) -> Corner {
    let mix = |a: f32, b: f32| a + (b - a) * part;
    Corner {
        clip: std::array::from_fn(|i| mix(from.clip[i], to.clip[i])),
        vary: std::array::from_fn(|i| mix(from.vary[i], to.vary[i])),
    }
}

/// Twice the area of a triangle, positive when clockwise to the eye (y downward).
fn cross(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
