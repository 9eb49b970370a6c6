//! Chance that is the same every time.

use crate::frame::Vec3;

/// A xorshift generator (G. Marsaglia, *Xorshift RNGs*, 2003).
pub struct Chance(u32);

impl Chance {
    pub fn new() -> Chance {
        Chance(0x9E37_79B9)
    }

    /// From 0 up to 1.
    pub fn unit(&mut self) -> f32 {
        let Chance(state) = self;
        *state ^= *state << 13;
        *state ^= *state >> 17;
        *state ^= *state << 5;
        (*state >> 8) as f32 / (1 << 24) as f32
    }

    /// From one number up to another.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A place in the cube from -1 to 1, which looks as good as a ball.
    pub fn anywhere(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }
}
