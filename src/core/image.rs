//! Image of rendered pixels in memory.

/// Red, green, blue and alpha, 8 bits each, display-encoded, in rows from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbaImage {
    pub width: u32,
    pub height: u32,
    /// 4 bytes per pixel.
    pub rgba: Vec<u8>,
}

impl RgbaImage {
    /// Returns the pixel in column `x` and row `y`, counted from the top left.
    ///
    /// # Panics
    /// If the pixel is outside the image.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        let first = 4 * (y as usize * self.width as usize + x as usize);
        [self.rgba[first], self.rgba[first + 1], self.rgba[first + 2], self.rgba[first + 3]]
    }
}
