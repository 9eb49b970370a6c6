//! Blur of what is not in a lens's focus, in a finished picture. Twin of `lens_pass.wgsl`.

use super::texture_reads::{Texture, TextureReads};
use super::{Framebuffer, dither};
use crate::eye::Eye;
use crate::lens::{LensView, TAPS, own_weight, tap_weight};
use typodont_core::frame::Vec3;
use typodont_core::image::RgbaImage;
use typodont_core::parallel::{available_threads, par_rows};

/// Light and weight of some places.
#[derive(Clone, Copy, Default)]
struct Gathered {
    light: Vec3,
    weight: f32,
}

impl Gathered {
    fn add(&mut self, light: Vec3, weight: f32) {
        self.light += light * weight;
        self.weight += weight;
    }

    fn mean(self) -> Vec3 {
        self.light / self.weight.max(1e-6)
    }
}

/// The picture of an eye's framebuffer through a lens.
pub fn lens_pass(sharp: &Framebuffer, eye: &Eye, lens: &LensView, reads: &TextureReads) -> RgbaImage {
    let drawn = sharp.to_image();
    let mut pixels = vec![[0u8; 4]; sharp.pixels.len()];
    par_rows(&mut pixels, sharp.width, available_threads(), |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            reads.count(Texture::Picture, 2 * (TAPS as u64 + 1));
            let light = SharpPicture { sharp, drawn: &drawn, eye, lens }.gather([x as i32, y as i32]);
            let noise = dither(x as u32, y);
            let [r, g, b] = light.to_array().map(|light| ((light.sqrt() + noise) * 255.0 + 0.5) as u8);
            *pixel = [r, g, b, u8::MAX];
        }
    });
    RgbaImage { rgba: pixels.into_flattened(), ..drawn }
}

struct SharpPicture<'a> {
    sharp: &'a Framebuffer,
    drawn: &'a RgbaImage,
    eye: &'a Eye,
    lens: &'a LensView,
}

impl SharpPicture<'_> {
    /// Light that reaches a pixel through the lens.
    fn gather(&self, at: [i32; 2]) -> Vec3 {
        let lens = self.lens;
        let own_depth = self.depth(at);
        let own_radius = lens.circle(own_depth);
        let is_own_before = lens.is_blurred_before(own_depth);
        // What is before the focus, and what is not.
        let (mut before, mut behind) = (Gathered::default(), Gathered::default());
        let side = if is_own_before { &mut before } else { &mut behind };
        side.add(self.light(at), own_weight(own_radius));
        for (i, tap) in lens.taps.iter().enumerate() {
            let place = self.within([at[0] + tap.steps[0], at[1] + tap.steps[1]]);
            let depth = self.depth(place);
            let is_before = lens.is_blurred_before(depth);
            let radius = match lens.circle(depth) {
                // What is hidden behind is guessed from what is seen beside it.
                radius if !is_before && is_own_before => radius.max(own_radius),
                // Nothing spreads over what is nearer.
                radius if !is_before && depth > own_depth => radius.min(own_radius),
                radius => radius,
            };
            let side = if is_before { &mut before } else { &mut behind };
            side.add(self.light(place), tap_weight(i, tap, radius));
        }
        // A lens spreads what is before the focus over what is behind.
        let cover = if behind.weight <= 0.0 { 1.0 } else { before.weight.min(1.0) };
        let (behind, before) = (behind.mean(), before.mean());
        behind + (before - behind) * cover
    }

    fn within(&self, at: [i32; 2]) -> [i32; 2] {
        [at[0].clamp(0, self.sharp.width as i32 - 1), at[1].clamp(0, self.sharp.height as i32 - 1)]
    }

    fn depth(&self, [x, y]: [i32; 2]) -> f32 {
        self.eye.depth(self.sharp.pixels[y as usize * self.sharp.width as usize + x as usize].depth)
    }

    fn light(&self, [x, y]: [i32; 2]) -> Vec3 {
        let [r, g, b, _] = self.drawn.pixel(x as u32, y as u32).map(|v| f32::from(v) / 255.0);
        Vec3::new(r * r, g * g, b * b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Viewpoint;
    use crate::cpu::Pixel;
    use crate::scene::Lens;

    const SIZE: [u32; 2] = [120, 90];
    const FOCUS: f32 = 100.0;

    fn viewpoint() -> Viewpoint {
        Viewpoint::look_at(Vec3::ZERO, Vec3::NEG_Z * FOCUS, Vec3::Y)
    }

    /// A picture whose left half shows one brightness and depth, mm, and the right half another, through a lens with circles of 8 pixels.
    fn halves(left: (f32, f32), right: (f32, f32)) -> RgbaImage {
        let [width, height] = SIZE;
        let eye = viewpoint().eye(width as f32 / height as f32);
        let pixels = (0..width * height).map(|i| {
            let (brightness, depth) = if i % width < width / 2 { left } else { right };
            Pixel { colour: [brightness; 3], depth: eye.buffer_depth(depth) }
        });
        let sharp = Framebuffer { width, height, pixels: pixels.collect() };
        let lens = LensView::new(&Lens { focus: Vec3::NEG_Z * FOCUS, aperture: 20.0 }, &eye, [8 * 120, 8 * 90]);
        lens_pass(&sharp, &eye, &lens, &TextureReads::default())
    }

    fn row(image: &RgbaImage) -> Vec<f32> {
        (0..SIZE[0]).map(|x| f32::from(image.pixel(x, SIZE[1] / 2)[0]) / 255.0).collect()
    }

    #[test]
    fn an_even_picture_stays_as_it_is() {
        for depth in [40.0, FOCUS, 1000.0] {
            for value in row(&halves((0.5, depth), (0.5, depth))) {
                assert!((value - 0.5).abs() < 0.005, "{depth} mm: {value}");
            }
        }
    }

    #[test]
    fn what_is_in_focus_keeps_its_edge_before_a_blurred_depth() {
        let seen = row(&halves((0.9, FOCUS), (0.1, 1500.0)));
        let middle = SIZE[0] as usize / 2;
        assert!(seen[..middle].iter().all(|v| (v - 0.9).abs() < 0.01), "{seen:?}");
        assert!(seen[middle..].iter().all(|v| (v - 0.1).abs() < 0.01), "{seen:?}");
    }

    #[test]
    fn an_edge_before_the_focus_is_spread_to_both_sides() {
        // Aim: half of the light at the edge, all of it a circle's radius beside it, and light is added, not screen values.
        let (bright, dark) = (0.8f32, 0.2f32);
        let seen = row(&halves((bright, 40.0), (dark, FOCUS)));
        let middle = SIZE[0] as usize / 2;
        let light: Vec<f32> = seen.iter().map(|v| (v * v - dark * dark) / (bright * bright - dark * dark)).collect();
        let at_edge = 0.5 * (light[middle - 1] + light[middle]);
        assert!((0.4..0.6).contains(&at_edge), "{at_edge}: {light:?}");
        assert!(light[middle - 12] > 0.97 && light[middle + 12] < 0.03, "{light:?}");
        assert!(light.windows(2).all(|pair| pair[1] < pair[0] + 0.04), "{light:?}");
    }

    #[test]
    fn an_edge_behind_the_focus_is_as_wide_as_its_circles() {
        let seen = row(&halves((0.8, 1500.0), (0.2, 1500.0)));
        let middle = SIZE[0] as usize / 2;
        let width = seen.iter().filter(|v| (0.23..0.77).contains(*v)).count();
        assert!((8..18).contains(&width), "{width} pixels: {seen:?}");
        assert!(seen[middle - 12] > 0.78 && seen[middle + 12] < 0.22, "{seen:?}");
    }
}
