//! Time as a count of constant ticks.
//!
//! Takes and gives whole ticks. Never reads a clock: seconds are derived, so that all machines agree on every
//! instant.

/// Length of one tick, s. The haptic servo runs at 1 kHz; below that rate, stiff contact vibrates.
pub const TICK_S: f64 = 0.001;

/// Instant of a session: the number of ticks since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tick(pub u64);

impl Tick {
    pub const ZERO: Tick = Tick(0);

    /// Seconds since the start of the session.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * TICK_S
    }

    pub fn next(self) -> Tick {
        Tick(self.0 + 1)
    }

    /// Seconds from an earlier tick to this one; zero if `earlier` is not earlier.
    pub fn seconds_since(self, earlier: Tick) -> f64 {
        Tick(self.0.saturating_sub(earlier.0)).seconds()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_and_ticks_agree() {
        // Aim: a time limit written in seconds ends on exactly the expected tick.
        assert_eq!(Tick(300_000).seconds(), 300.0);
        assert_eq!(Tick(1500).seconds_since(Tick(500)), 1.0);
    }
}
