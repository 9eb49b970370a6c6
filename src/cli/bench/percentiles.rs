//! Summary of repeated measurements by percentiles.

use serde::Serialize;
use std::time::{Duration, Instant};

/// Median, 99th percentile and highest of `n` values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
    pub n: usize,
}

impl Percentiles {
    /// Nearest-rank percentiles. Without any value all are zero.
    pub fn of(mut values: Vec<f64>) -> Percentiles {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| {
            let place = (share * values.len() as f64).ceil() as usize;
            values.get(place.max(1) - 1).copied().unwrap_or(0.0)
        };
        Percentiles { p50: rank(0.5), p99: rank(0.99), max: rank(1.0), n: values.len() }
    }
}

/// Maximum number of repetitions of a measurement, and the time after which no further repetition begins.
const RUNS_MAX: usize = 9;
const TIME_MAX: Duration = Duration::from_secs(4);

/// Measures `work` repeatedly, in a unit of which `per_second` make a second.
pub fn time_repeated(per_second: f64, work: impl FnMut()) -> Percentiles {
    time_up_to(RUNS_MAX, per_second, work)
}

/// The same, with another maximum number of repetitions.
pub fn time_up_to(runs: usize, per_second: f64, mut work: impl FnMut()) -> Percentiles {
    let begun = Instant::now();
    let mut times = Vec::new();
    while times.is_empty() || (times.len() < runs && begun.elapsed() < TIME_MAX) {
        let start = Instant::now();
        work();
        times.push(start.elapsed().as_secs_f64() * per_second);
    }
    Percentiles::of(times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_occurred() {
        let figures = Percentiles::of((1..=200).rev().map(f64::from).collect());
        assert_eq!(figures, Percentiles { p50: 100.0, p99: 198.0, max: 200.0, n: 200 });
        assert_eq!(Percentiles::of(Vec::new()).n, 0);
    }
}
