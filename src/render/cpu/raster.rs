//! Triangles to pixels with a depth buffer, by the rules of graphics adapters: corners on a grid of 1/256 pixel, a pixel
//! belongs to the triangle that its middle lies in, on an edge to the one below or to the right.

use super::{Framebuffer, Pixel};
use typodont_core::parallel::{available_threads, par_rows};

/// Number of values that vary over a triangle: see `surface_pass`.
pub const VARYING: usize = 11;

#[derive(Clone, Copy)]
pub struct ShadedVertex {
    pub clip: [f32; 4],
    pub varying: [f32; VARYING],
}

/// Steps of the grid that corners are put on, per pixel.
const SUBPIXELS: f32 = 256.0;

/// Draws the triangles that face the eye (counter-clockwise); `shade` converts the varying values to a colour.
pub fn draw(
    vertices: &[ShadedVertex],
    triangles: &[[u32; 3]],
    framebuffer: &mut Framebuffer,
    shade: impl Fn([f32; VARYING]) -> [f32; 3] + Sync,
) {
    let (width, height) = (framebuffer.width, framebuffer.height);
    let bands = available_threads();
    let rows = height.div_ceil(bands as u32).max(1);
    par_rows(&mut framebuffer.pixels, rows * width, bands, |band, pixels| {
        let mut row_band = RowBand { pixels, width, height, first_row: band * rows };
        for triangle in triangles {
            row_band.draw_clipped(triangle.map(|i| vertices[i as usize]), &shade);
        }
    });
}

/// Some rows of a canvas.
struct RowBand<'a> {
    pixels: &'a mut [Pixel],
    width: u32,
    height: u32,
    first_row: u32,
}

impl RowBand<'_> {
    /// Clips a triangle at the near plane and fills the rest.
    fn draw_clipped(&mut self, triangle: [ShadedVertex; 3], shade: &impl Fn([f32; VARYING]) -> [f32; 3]) {
        if triangle.iter().all(|c| c.clip[2] >= 0.0) {
            return self.fill(&triangle, shade);
        }
        let mut clipped: Vec<ShadedVertex> = Vec::with_capacity(4);
        for (i, &from) in triangle.iter().enumerate() {
            let to = triangle[(i + 1) % 3];
            if from.clip[2] >= 0.0 {
                clipped.push(from);
            }
            if (from.clip[2] >= 0.0) != (to.clip[2] >= 0.0) {
                clipped.push(lerp_vertex(&from, &to, from.clip[2] / (from.clip[2] - to.clip[2])));
            }
        }
        for i in 2..clipped.len() {
            self.fill(&[clipped[0], clipped[i - 1], clipped[i]], shade);
        }
    }

    fn fill(&mut self, triangle: &[ShadedVertex; 3], shade: &impl Fn([f32; VARYING]) -> [f32; 3]) {
        let [width, height] = [self.width as f32, self.height as f32];
        let place = triangle.map(|c| {
            let [x, y, _, w] = c.clip;
            [(0.5 + 0.5 * x / w) * width, (0.5 - 0.5 * y / w) * height].map(|v| f64::from(v * SUBPIXELS).round() as i64)
        });
        // With y downward, a triangle that is counter-clockwise to the eye has a negative area.
        let area = -double_area(place[0], place[1], place[2]);
        if area <= 0 {
            return;
        }
        let last_row = self.first_row + (self.pixels.len() / self.width as usize) as u32;
        let [xs, ys] = [0, 1].map(|a| place.map(|p| p[a]));
        let middles = |values: [i64; 3], low: u32, end: u32| {
            let grid = SUBPIXELS as i64;
            let least = values.iter().min().copied().unwrap_or(0).div_euclid(grid).max(i64::from(low));
            let most = values.iter().max().copied().unwrap_or(0).div_euclid(grid).min(i64::from(end) - 1);
            least..=most
        };
        let inverse = triangle.map(|c| 1.0 / c.clip[3]);
        for y in middles(ys, self.first_row, last_row) {
            for x in middles(xs, 0, self.width) {
                let middle = [x, y].map(|v| v * SUBPIXELS as i64 + SUBPIXELS as i64 / 2);
                let weights = [1, 2, 0].map(|i| (i, (i + 1) % 3)).map(|(a, b)| {
                    let value = -double_area(place[a], place[b], middle);
                    let edge = [place[b][0] - place[a][0], place[b][1] - place[a][1]];
                    let owns = edge[1] > 0 || (edge[1] == 0 && edge[0] < 0);
                    if value > 0 || (value == 0 && owns) { Some(value) } else { None }
                });
                let [Some(a), Some(b), Some(c)] = weights else { continue };
                let share = [a, b, c].map(|v| v as f32 / area as f32);
                let depth: f32 = (0..3).map(|i| share[i] * triangle[i].clip[2] * inverse[i]).sum();
                let pixel = &mut self.pixels[(y as usize - self.first_row as usize) * self.width as usize + x as usize];
                if !(0.0..=1.0).contains(&depth) || depth >= pixel.depth {
                    continue;
                }
                let near = [0, 1, 2].map(|i| share[i] * inverse[i]);
                let total = near[0] + near[1] + near[2];
                let vary = |v: usize| (0..3).map(|i| near[i] * triangle[i].varying[v]).sum::<f32>() / total;
                *pixel = Pixel { colour: shade(std::array::from_fn(vary)), depth };
            }
        }
    }
}

fn lerp_vertex(from: &ShadedVertex, to: &ShadedVertex, part: f32) -> ShadedVertex {
    let mix = |a: f32, b: f32| a + (b - a) * part;
    ShadedVertex {
        clip: std::array::from_fn(|i| mix(from.clip[i], to.clip[i])),
        varying: std::array::from_fn(|i| mix(from.varying[i], to.varying[i])),
    }
}

/// Twice the area of a triangle, positive when clockwise to the eye (y downward).
fn double_area(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
