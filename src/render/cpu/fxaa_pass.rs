//! Anti-aliasing of a finished picture along its edges. Twin of `fxaa_pass.wgsl`.

use super::texture_reads::{Texture, TextureReads};
use typodont_core::frame::Vec3;
use typodont_core::image::RgbaImage;
use typodont_core::parallel::{available_threads, par_rows};

/// Smallest contrast of a visible edge, absolute and as a share of the brightest neighbour. Brightness is a whole
/// number from 0 to 1020, so that every computer compares it alike.
const FAINT: f32 = 60.0;
const FAINT_SHARE: f32 = 0.125;
/// Contrast above the smallest at which an edge is smoothed fully, so that smoothing sets in gradually.
const GROWING: f32 = 40.0;
/// Pixels over which an edge is followed in each direction.
const FOLLOWS: i32 = 8;
/// Share of the edge's contrast by which its brightness must change to end it.
const ENDS: f32 = 0.25;

pub fn fxaa_pass(drawn: &RgbaImage, reads: &TextureReads) -> RgbaImage {
    let mut pixels: Vec<[u8; 4]> = drawn.rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    par_rows(&mut pixels, drawn.width, available_threads(), |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if let Some((across, share)) = neighbour_blend(drawn, reads, [x as i32, y as i32]) {
                reads.count(Texture::Picture, 1);
                let (own, other) = (colour(*pixel), colour(texel(drawn, across)));
                let [r, g, b] = own.lerp(other, share).to_array().map(|v| (v + 0.5) as u8);
                *pixel = [r, g, b, u8::MAX];
            }
        }
    });
    RgbaImage { rgba: pixels.into_flattened(), ..*drawn }
}

/// The neighbour that is blended into a pixel, and its share; `None` if the pixel is not on an edge.
fn neighbour_blend(drawn: &RgbaImage, reads: &TextureReads, at: [i32; 2]) -> Option<([i32; 2], f32)> {
    let near = |x: i32, y: i32| brightness(drawn, [at[0] + x, at[1] + y]);
    reads.count(Texture::Picture, 5);
    let (m, n, s, w, e) = (near(0, 0), near(0, -1), near(0, 1), near(-1, 0), near(1, 0));
    let high = [n, s, w, e].into_iter().fold(m, f32::max);
    let low = [n, s, w, e].into_iter().fold(m, f32::min);
    let faint = FAINT.max(FAINT_SHARE * high);
    if high - low <= faint {
        return None;
    }
    reads.count(Texture::Picture, 4);
    let (nw, ne, sw, se) = (near(-1, -1), near(1, -1), near(-1, 1), near(1, 1));
    let bend = |a: f32, b: f32, c: f32| (a + c - 2.0 * b).abs();
    let bends_down = 2.0 * bend(n, m, s) + bend(nw, w, sw) + bend(ne, e, se);
    let bends_right = 2.0 * bend(w, m, e) + bend(nw, n, ne) + bend(sw, s, se);
    let is_level = bends_down >= bends_right;
    let [before, after] = if is_level { [n, s] } else { [w, e] };
    let is_before = (before - m).abs() > (after - m).abs();
    let (side, other) = if is_before { (-1, before) } else { (1, after) };
    let (across, along) = if is_level { ([0, side], [1, 0]) } else { ([side, 0], [0, 1]) };
    let edge = FxaaEdge { drawn, reads, at, across, level: 0.5 * (m + other), contrast: (other - m).abs() };
    let (back, forth) = (edge.find_end(along.map(|v: i32| -v)), edge.find_end(along));
    let (nearest, change) = if back.0 < forth.0 { back } else { forth };
    // The other side is blended only if the nearer end of the edge bends away from this pixel.
    if (change < 0.0) == (m < edge.level) {
        return None;
    }
    let strength = ((high - low - faint) / GROWING).min(1.0);
    Some(([at[0] + across[0], at[1] + across[1]], (0.5 - nearest / (back.0 + forth.0)) * strength))
}

/// Edge between a pixel's row (or column) and the neighbouring one.
struct FxaaEdge<'a> {
    drawn: &'a RgbaImage,
    reads: &'a TextureReads,
    at: [i32; 2],
    across: [i32; 2],
    level: f32,
    contrast: f32,
}

impl FxaaEdge<'_> {
    /// Length of the edge in a direction, pixels, and the change of brightness at its end.
    fn find_end(&self, along: [i32; 2]) -> (f32, f32) {
        let mut change = 0.0;
        for i in 1..=FOLLOWS {
            let here: [i32; 2] = std::array::from_fn(|a| self.at[a] + along[a] * i);
            self.reads.count(Texture::Picture, 2);
            let beside = std::array::from_fn(|a| here[a] + self.across[a]);
            change = 0.5 * (brightness(self.drawn, here) + brightness(self.drawn, beside)) - self.level;
            if change.abs() >= ENDS * self.contrast {
                return (i as f32 - 0.5, change);
            }
        }
        (FOLLOWS as f32, change)
    }
}

fn texel(drawn: &RgbaImage, at: [i32; 2]) -> [u8; 4] {
    let place = |v: i32, size: u32| v.clamp(0, size as i32 - 1) as u32;
    drawn.pixel(place(at[0], drawn.width), place(at[1], drawn.height))
}

fn brightness(drawn: &RgbaImage, at: [i32; 2]) -> f32 {
    let [r, g, b, _] = texel(drawn, at).map(f32::from);
    r + 2.0 * g + b
}

fn colour([r, g, b, _]: [u8; 4]) -> Vec3 {
    Vec3::new(f32::from(r), f32::from(g), f32::from(b))
}
