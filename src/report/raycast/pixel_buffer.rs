//! Pixels in rows, and laying one picture over another.

/// Red, green, blue (0–1, as a screen shows them) and coverage, the colours already multiplied by it; from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelBuffer {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 4]>,
}

impl PixelBuffer {
    /// Nothing at all.
    pub fn transparent(width: u32, height: u32) -> PixelBuffer {
        PixelBuffer { width, height, pixels: vec![[0.0; 4]; (width * height) as usize] }
    }

    /// One colour.
    pub fn filled(width: u32, height: u32, [red, green, blue]: [f32; 3]) -> PixelBuffer {
        PixelBuffer { width, height, pixels: vec![[red, green, blue, 1.0]; (width * height) as usize] }
    }

    /// Lays a picture of the same size over this one.
    pub fn composite(&mut self, top: &PixelBuffer) {
        debug_assert_eq!((self.width, self.height), (top.width, top.height));
        for (under, over) in self.pixels.iter_mut().zip(&top.pixels) {
            *under = blend_over(*under, *over);
        }
    }

    /// Covers a share of one pixel with a colour; outside the picture nothing happens.
    pub fn blend_pixel(&mut self, x: i64, y: i64, [red, green, blue]: [f32; 3], share: f32) {
        if x >= 0 && y >= 0 && x < i64::from(self.width) && y < i64::from(self.height) && share > 0.0 {
            let pixel = &mut self.pixels[(y * i64::from(self.width) + x) as usize];
            *pixel = blend_over(*pixel, [red * share, green * share, blue * share, share]);
        }
    }

    /// Sets a picture beside this one; both are equally high.
    pub fn hconcat(&self, right: &PixelBuffer) -> PixelBuffer {
        debug_assert_eq!(self.height, right.height);
        let rows = self.pixels.chunks(self.width as usize).zip(right.pixels.chunks(right.width as usize));
        let pixels = rows.flat_map(|(a, b)| a.iter().chain(b)).copied().collect();
        PixelBuffer { width: self.width + right.width, height: self.height, pixels }
    }

    /// Red, green, blue of every pixel in 8 bits; uncovered places show black.
    pub fn rgb8(&self) -> Vec<u8> {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        self.pixels.iter().flat_map(|&[r, g, b, _]| [byte(r), byte(g), byte(b)]).collect()
    }
}

fn blend_over(under: [f32; 4], over: [f32; 4]) -> [f32; 4] {
    let shows = 1.0 - over[3];
    std::array::from_fn(|i| over[i] + under[i] * shows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_black_dab_on_white_is_grey() {
        let mut picture = PixelBuffer::filled(2, 1, [1.0; 3]);
        picture.blend_pixel(1, 0, [0.0; 3], 0.5);
        picture.blend_pixel(5, -3, [0.0; 3], 1.0);
        assert_eq!(picture.rgb8(), [255, 255, 255, 128, 128, 128]);
        assert_eq!(picture.hconcat(&picture).width, 4);
    }
}
