//! Shares: so many of so many.

use super::distribution::normal_quantile;
use super::{CONFIDENCE, Interval};

/// How many had something, and what that says of others like them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    pub had: usize,
    pub of: usize,
    /// Wilson's score interval (1927): good for few people, and within 0 to 1 even where nobody or everybody had it.
    pub interval: Interval,
}

/// A share; none of nobody.
pub fn share(had: usize, of: usize) -> Option<Share> {
    if of == 0 {
        return None;
    }
    let (n, p) = (of as f64, had as f64 / of as f64);
    let z = normal_quantile(0.5 + 0.5 * CONFIDENCE);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    Some(Share { had, of, interval: [(middle - half).max(0.0), (middle + half).min(1.0)] })
}
