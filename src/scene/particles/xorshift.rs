//! Reproducible pseudo-random numbers.

use typodont_core::frame::Vec3;

/// A xorshift generator (G. Marsaglia, *Xorshift RNGs*, 2003).
pub struct Xorshift32(u32);

impl Xorshift32 {
    pub fn new() -> Xorshift32 {
        Xorshift32(0x9E37_79B9)
    }

    /// Number from 0 up to 1.
    pub fn next_f32(&mut self) -> f32 {
        let Xorshift32(state) = self;
        *state ^= *state << 13;
        *state ^= *state >> 17;
        *state ^= *state << 5;
        (*state >> 8) as f32 / (1 << 24) as f32
    }

    /// Number from `low` up to `high`.
    pub fn in_range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next_f32()
    }

    /// Point in the cube from −1 to 1, which is used in place of a ball.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.in_range(-1.0, 1.0), self.in_range(-1.0, 1.0), self.in_range(-1.0, 1.0))
    }
}
