//! A finished picture with the stairs along its edges smoothed. Twin of `smooth_pass.wgsl`.

use crate::frame::Vec3;
use crate::render::picture::Image;
use crate::volume::rows::{in_rows, processors};

/// Brightness is counted in whole numbers, 0 to 1020, so that every computer compares it alike. Less contrast than this, or
/// than this share of the brightest neighbour, is no edge that anybody sees.
const FAINT: f32 = 60.0;
const FAINT_SHARE: f32 = 0.125;
/// Contrast over which an edge comes to be smoothed fully, so that none appears at once.
const GROWING: f32 = 40.0;
/// Pixels that an edge is followed each way.
const FOLLOWS: i32 = 8;
/// Share of the contrast at an edge by which its course must change to end it.
const ENDS: f32 = 0.25;

pub fn smooth_pass(drawn: &Image) -> Image {
    let mut pixels: Vec<[u8; 4]> = drawn.rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    in_rows(&mut pixels, drawn.width, processors(), |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if let Some((across, share)) = mixed(drawn, [x as i32, y as i32]) {
                let (own, other) = (colour(*pixel), colour(texel(drawn, across)));
                let [r, g, b] = own.lerp(other, share).to_array().map(|v| (v + 0.5) as u8);
                *pixel = [r, g, b, u8::MAX];
            }
        }
    });
    Image { rgba: pixels.into_flattened(), ..*drawn }
}

/// Which neighbour reaches into a pixel, and how far.
fn mixed(drawn: &Image, at: [i32; 2]) -> Option<([i32; 2], f32)> {
    let near = |x: i32, y: i32| brightness(drawn, [at[0] + x, at[1] + y]);
    let (m, n, s, w, e) = (near(0, 0), near(0, -1), near(0, 1), near(-1, 0), near(1, 0));
    let high = [n, s, w, e].into_iter().fold(m, f32::max);
    let low = [n, s, w, e].into_iter().fold(m, f32::min);
    let faint = FAINT.max(FAINT_SHARE * high);
    if high - low <= faint {
        return None;
    }
    let (nw, ne, sw, se) = (near(-1, -1), near(1, -1), near(-1, 1), near(1, 1));
    let bend = |a: f32, b: f32, c: f32| (a + c - 2.0 * b).abs();
    let bends_down = 2.0 * bend(n, m, s) + bend(nw, w, sw) + bend(ne, e, se);
    let bends_right = 2.0 * bend(w, m, e) + bend(nw, n, ne) + bend(sw, s, se);
    let is_level = bends_down >= bends_right;
    let [before, after] = if is_level { [n, s] } else { [w, e] };
    let is_before = (before - m).abs() > (after - m).abs();
    let (side, other) = if is_before { (-1, before) } else { (1, after) };
    let (across, along) = if is_level { ([0, side], [1, 0]) } else { ([side, 0], [0, 1]) };
    let edge = Edge { drawn, at, across, level: 0.5 * (m + other), contrast: (other - m).abs() };
    let (back, forth) = (edge.end(along.map(|v: i32| -v)), edge.end(along));
    let (nearest, change) = if back.0 < forth.0 { back } else { forth };
    // Only where the nearer end goes away from this pixel does the other side reach into it.
    if (change < 0.0) == (m < edge.level) {
        return None;
    }
    let strength = ((high - low - faint) / GROWING).min(1.0);
    Some(([at[0] + across[0], at[1] + across[1]], (0.5 - nearest / (back.0 + forth.0)) * strength))
}

/// Between a pixel's row and the one across.
struct Edge<'a> {
    drawn: &'a Image,
    at: [i32; 2],
    across: [i32; 2],
    level: f32,
    contrast: f32,
}

impl Edge<'_> {
    /// How far it goes on, pixels, and by how much it has changed there.
    fn end(&self, along: [i32; 2]) -> (f32, f32) {
        let mut change = 0.0;
        for i in 1..=FOLLOWS {
            let here: [i32; 2] = std::array::from_fn(|a| self.at[a] + along[a] * i);
            let beside = std::array::from_fn(|a| here[a] + self.across[a]);
            change = 0.5 * (brightness(self.drawn, here) + brightness(self.drawn, beside)) - self.level;
            if change.abs() >= ENDS * self.contrast {
                return (i as f32 - 0.5, change);
            }
        }
        (FOLLOWS as f32, change)
    }
}

fn texel(drawn: &Image, at: [i32; 2]) -> [u8; 4] {
    let place = |v: i32, size: u32| v.clamp(0, size as i32 - 1) as u32;
    drawn.pixel(place(at[0], drawn.width), place(at[1], drawn.height))
}

fn brightness(drawn: &Image, at: [i32; 2]) -> f32 {
    let [r, g, b, _] = texel(drawn, at).map(f32::from);
    r + 2.0 * g + b
}

fn colour([r, g, b, _]: [u8; 4]) -> Vec3 {
    Vec3::new(f32::from(r), f32::from(g), f32::from(b))
}
