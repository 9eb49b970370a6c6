//! What numbers about people's results say, and how sure one may be of it.
//!
//! Takes plain numbers. Gives estimates with their intervals, each by a published formula; `None` where there are too few
//! numbers, or all alike. Never reads a file, draws lots, or knows what the numbers measure.
//!
//! Every interval is at [`CONFIDENCE`]. The same numbers give the same bits on every machine: `libm`, no platform mathematics.

pub mod distribution;
mod alpha;
mod cut_score;
mod line;
mod reliability;
mod share;
mod spread;

pub use alpha::{Alpha, ItemFit, alpha};
pub use cut_score::{BorderlineRegression, ContrastingGroups, borderline_regression, contrasting_groups};
pub use line::{Line, line};
pub use reliability::{Reliability, Retest, icc, retest};
pub use share::{Share, share};
pub use spread::{Spread, quantile, spread};

/// How often an interval holds what it is an interval of.
pub const CONFIDENCE: f64 = 0.95;

/// A lower and an upper bound.
pub type Interval = [f64; 2];

/// The mean of numbers; not a number of none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Sum of squared distances from the mean.
fn squares(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean) * (v - mean)).sum()
}

/// Variance of the sample, by n − 1.
fn variance(values: &[f64]) -> f64 {
    squares(values) / (values.len() as f64 - 1.0)
}
