//! Proportions with confidence intervals.

use super::distribution::normal_quantile;
use super::{CONFIDENCE, Interval};

/// Proportion of people with a property, with the interval for the population.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proportion {
    pub count: usize,
    pub total: usize,
    /// Wilson's score interval (1927): suitable for few people, and within 0 to 1 even if nobody or everybody has the
    /// property.
    pub interval: Interval,
}

/// Computes the proportion of `count` in `of`; `None` if `of` is zero.
pub fn proportion(count: usize, of: usize) -> Option<Proportion> {
    if of == 0 {
        return None;
    }
    let interval = wilson_interval(count as f64 / of as f64, of);
    Some(Proportion { count, total: of, interval })
}

/// Returns Wilson's score interval for a share `p`, 0 to 1, of `of` observations; `of` is at least 1.
pub fn wilson_interval(p: f64, of: usize) -> Interval {
    let n = of as f64;
    let z = normal_quantile(0.5 + 0.5 * CONFIDENCE);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}
