//! Many times in a few numbers.

use serde::Serialize;
use std::time::{Duration, Instant};

/// Median, 99th percentile and highest of `n` values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
    pub n: usize,
}

impl Figures {
    /// Nearest-rank percentiles. Without any value all are zero.
    pub fn of(mut values: Vec<f64>) -> Figures {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| {
            let place = (share * values.len() as f64).ceil() as usize;
            values.get(place.max(1) - 1).copied().unwrap_or(0.0)
        };
        Figures { p50: rank(0.5), p99: rank(0.99), max: rank(1.0), n: values.len() }
    }
}

/// How often a repeated work is repeated, and for how long at most.
const RUNS: usize = 9;
const ENOUGH: Duration = Duration::from_secs(4);

/// Times of some work, in units of so many per second.
pub fn repeated(per_second: f64, mut work: impl FnMut()) -> Figures {
    let begun = Instant::now();
    let mut times = Vec::new();
    while times.is_empty() || (times.len() < RUNS && begun.elapsed() < ENOUGH) {
        let start = Instant::now();
        work();
        times.push(start.elapsed().as_secs_f64() * per_second);
    }
    Figures::of(times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_occurred() {
        let figures = Figures::of((1..=200).rev().map(f64::from).collect());
        assert_eq!(figures, Figures { p50: 100.0, p99: 198.0, max: 200.0, n: 200 });
        assert_eq!(Figures::of(Vec::new()).n, 0);
    }
}
