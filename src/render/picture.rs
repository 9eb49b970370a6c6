//! A finished picture.

/// Red, green, blue, alpha in 8 bits, as a screen shows them, in rows from the upper left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    pub width: u32,
    pub height: u32,
    /// 4 bytes per pixel.
    pub rgba: Vec<u8>,
}

impl Image {
    /// The pixel at a place, from the upper left.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        let first = 4 * (y as usize * self.width as usize + x as usize);
        [self.rgba[first], self.rgba[first + 1], self.rgba[first + 2], self.rgba[first + 3]]
    }
}
