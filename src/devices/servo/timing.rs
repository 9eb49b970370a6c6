//! Timing statistics of a servo: lateness and work per tick, counted without allocating.
//!
//! Takes durations. Gives percentiles and counts. Keeps apart how late a tick was (caused by the machine or the
//! device) and how long its computation took (caused by the program). Never reads a clock.

use std::time::Duration;

/// Histogram of durations: to the microsecond below 2 ms, to the millisecond below 1 s; longer ones are in the last
/// bin.
#[derive(Clone, Debug)]
pub struct DurationHistogram {
    fine: Box<[u32]>,
    coarse: Box<[u32]>,
    count: u64,
    max: Duration,
}

const FINE: usize = 2000;
const COARSE: usize = 1000;

impl DurationHistogram {
    pub fn new() -> DurationHistogram {
        DurationHistogram {
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

    /// Returns the duration that a fraction `share` of all durations does not exceed, rounded up to its bin; zero
    /// without any.
    pub fn percentile(&self, share: f64) -> Duration {
        let wanted = (self.count as f64 * share).ceil().max(1.0) as u64;
        let fine = self.fine.iter().enumerate().map(|(i, n)| (Duration::from_micros(i as u64 + 1), *n));
        let coarse = self.coarse.iter().enumerate().map(|(i, n)| (Duration::from_millis(i as u64 + 1), *n));
        let mut counted = 0;
        for (upper, n) in fine.chain(coarse) {
            counted += u64::from(n);
            if counted >= wanted {
                return upper.min(self.max);
            }
        }
        self.max
    }
}

impl Default for DurationHistogram {
    fn default() -> Self {
        DurationHistogram::new()
    }
}

/// Timing of a servo so far.
#[derive(Clone, Debug, Default)]
pub struct TimingStats {
    /// Lateness of each tick.
    pub late: DurationHistogram,
    /// Computing time of each tick.
    pub work: DurationHistogram,
    /// Ticks that were skipped: whole milliseconds by which a tick was late.
    pub missed: u64,
    /// Number of times the hand was released because a tick was too late.
    pub late_releases: u64,
    /// Events dropped because the channel was full.
    pub dropped_events: u64,
}

/// Summary of [`TimingStats`] that fits a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimingSummary {
    pub ticks: u64,
    pub late_p50: Duration,
    pub late_p99: Duration,
    pub late_max: Duration,
    pub work_p99: Duration,
    pub work_max: Duration,
    pub missed: u64,
    pub late_releases: u64,
    pub dropped_events: u64,
}

impl TimingStats {
    pub fn summary(&self) -> TimingSummary {
        TimingSummary {
            ticks: self.work.count(),
            late_p50: self.late.percentile(0.5),
            late_p99: self.late.percentile(0.99),
            late_max: self.late.max(),
            work_p99: self.work.percentile(0.99),
            work_max: self.work.max(),
            missed: self.missed,
            late_releases: self.late_releases,
            dropped_events: self.dropped_events,
        }
    }
}

impl TimingSummary {
    /// Encodes the summary as words for a slot; durations in µs.
    pub(super) fn encode(&self) -> [u32; 9] {
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
            count(self.late_releases),
            count(self.dropped_events),
        ]
    }

    pub(super) fn decode(words: [u32; 9]) -> TimingSummary {
        let us = |i: usize| Duration::from_micros(u64::from(words[i]));
        let count = |i: usize| u64::from(words[i]);
        TimingSummary {
            ticks: count(0),
            late_p50: us(1),
            late_p99: us(2),
            late_max: us(3),
            work_p99: us(4),
            work_max: us(5),
            missed: count(6),
            late_releases: count(7),
            dropped_events: count(8),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        let mut histogram = DurationHistogram::new();
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
        let mut stats = TimingStats { missed: 3, late_releases: 2, dropped_events: 1, ..TimingStats::default() };
        stats.late.add(Duration::from_micros(40));
        stats.work.add(Duration::from_micros(12));
        assert_eq!(TimingSummary::decode(stats.summary().encode()), stats.summary());
    }
}
