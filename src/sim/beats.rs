//! How well the beat is kept: lateness and work per tick, counted without allocating.
//!
//! Takes durations. Gives percentiles and counts. Two things are told apart: how late a beat came (the machine's and the
//! device's affair) and how long its work took (ours).

use std::time::Duration;

/// Durations by size: to the microsecond below 2 ms, to the millisecond below 1 s; longer ones count as the last.
#[derive(Clone, Debug)]
pub struct Histogram {
    fine: Box<[u32]>,
    coarse: Box<[u32]>,
    count: u64,
    max: Duration,
}

const FINE: usize = 2000;
const COARSE: usize = 1000;

impl Histogram {
    pub fn new() -> Histogram {
        Histogram {
            fine: vec![0; FINE].into_boxed_slice(),
            coarse: vec![0; COARSE].into_boxed_slice(),
            count: 0,
            max: Duration::ZERO,
        }
    }

    pub fn add(&mut self, duration: Duration) {
        let micros = duration.as_micros() as usize;
        match self.fine.get_mut(micros) {
            Some(bin) => *bin += 1,
            None => self.coarse[(micros / 1000).min(COARSE - 1)] += 1,
        }
        self.count += 1;
        self.max = self.max.max(duration);
    }

    pub fn count(&self) -> u64 {
        self.count
    }

    pub fn max(&self) -> Duration {
        self.max
    }

    /// The duration that a share of all does not exceed, rounded up to its bin; zero when there are none.
    pub fn percentile(&self, share: f64) -> Duration {
        let wanted = (self.count as f64 * share).ceil().max(1.0) as u64;
        let fine = self.fine.iter().enumerate().map(|(i, n)| (Duration::from_micros(i as u64 + 1), *n));
        let coarse = self.coarse.iter().enumerate().map(|(i, n)| (Duration::from_millis(i as u64 + 1), *n));
        let mut seen = 0;
        for (upper, n) in fine.chain(coarse) {
            seen += u64::from(n);
            if seen >= wanted {
                return upper.min(self.max);
            }
        }
        self.max
    }
}

impl Default for Histogram {
    fn default() -> Self {
        Histogram::new()
    }
}

/// How the beats of a servo went so far.
#[derive(Clone, Debug, Default)]
pub struct Beats {
    /// How late each beat came.
    pub late: Histogram,
    /// How long each tick's own work took.
    pub work: Histogram,
    /// Beats that never came: whole milliseconds that a beat was late.
    pub missed: u64,
    /// Times the hand was let go because a beat came too late.
    pub let_go: u64,
    /// Letters that found no room.
    pub dropped: u64,
}

/// A summary of [`Beats`] that fits a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeatSummary {
    pub ticks: u64,
    pub late_p50: Duration,
    pub late_p99: Duration,
    pub late_max: Duration,
    pub work_p99: Duration,
    pub work_max: Duration,
    pub missed: u64,
    pub let_go: u64,
    pub dropped: u64,
}

impl Beats {
    pub fn summary(&self) -> BeatSummary {
        BeatSummary {
            ticks: self.work.count(),
            late_p50: self.late.percentile(0.5),
            late_p99: self.late.percentile(0.99),
            late_max: self.late.max(),
            work_p99: self.work.percentile(0.99),
            work_max: self.work.max(),
            missed: self.missed,
            let_go: self.let_go,
            dropped: self.dropped,
        }
    }
}

impl BeatSummary {
    /// As words for a slot; durations in µs.
    pub(super) fn words(&self) -> [u32; 9] {
        let us = |d: Duration| d.as_micros().min(u128::from(u32::MAX)) as u32;
        let count = |n: u64| n.min(u64::from(u32::MAX)) as u32;
        [
            count(self.ticks),
            us(self.late_p50),
            us(self.late_p99),
            us(self.late_max),
            us(self.work_p99),
            us(self.work_max),
            count(self.missed),
            count(self.let_go),
            count(self.dropped),
        ]
    }

    pub(super) fn of_words(words: [u32; 9]) -> BeatSummary {
        let us = |i: usize| Duration::from_micros(u64::from(words[i]));
        let count = |i: usize| u64::from(words[i]);
        BeatSummary {
            ticks: count(0),
            late_p50: us(1),
            late_p99: us(2),
            late_max: us(3),
            work_p99: us(4),
            work_max: us(5),
            missed: count(6),
            let_go: count(7),
            dropped: count(8),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        let mut histogram = Histogram::new();
        assert_eq!(histogram.percentile(0.99), Duration::ZERO);
        for i in 0..1000 {
            histogram.add(Duration::from_micros(i));
        }
        histogram.add(Duration::from_millis(70));
        assert_eq!(histogram.percentile(0.5), Duration::from_micros(501));
        assert_eq!(histogram.percentile(0.99), Duration::from_micros(991));
        assert_eq!(histogram.percentile(1.0), Duration::from_millis(70));
        assert_eq!(histogram.max(), Duration::from_millis(70));
    }

    #[test]
    fn a_summary_survives_its_slot() {
        let mut beats = Beats { missed: 3, let_go: 2, dropped: 1, ..Beats::default() };
        beats.late.add(Duration::from_micros(40));
        beats.work.add(Duration::from_micros(12));
        assert_eq!(BeatSummary::of_words(beats.summary().words()), beats.summary());
    }
}
