//! Statistics of people's results, with confidence intervals.
//!
//! Takes plain numbers. Gives estimates with their intervals, each by a published formula; `None` if there are too
//! few numbers or they do not vary. Never reads a file, uses randomness, or knows what the numbers measure.
//!
//! Every interval is at [`CONFIDENCE`]. The same numbers give the same bits on every machine, because `libm` replaces
//! the mathematics library of the platform.

pub mod distribution;
mod agreement;
mod alpha;
mod cut_score;
mod linear_fit;
mod reliability;
mod proportion;
mod descriptive;
mod value_range;

pub use agreement::{KappaWeights, WeightedKappa, weighted_kappa};
pub use alpha::{CronbachAlpha, ItemFit, cronbach_alpha};
pub use cut_score::{BorderlineRegression, ContrastingGroups, borderline_regression, contrasting_groups};
pub use descriptive::{DescriptiveStatistics, describe, quantile};
pub use linear_fit::{LinearFit, linear_fit};
pub use proportion::{Proportion, proportion, wilson_interval};
pub use reliability::{IntraclassCorrelation, Retest, icc, retest};
pub use value_range::{ValueRange, describe_in, mean_interval_in};

/// Confidence level of all intervals.
pub const CONFIDENCE: f64 = 0.95;

/// Lower and upper bound.
pub type Interval = [f64; 2];

/// Arithmetic mean; NaN if there are no values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Sum of the squared deviations from the mean.
fn sum_of_squares(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean) * (v - mean)).sum()
}

/// Sample variance, with denominator n − 1.
fn variance(values: &[f64]) -> f64 {
    sum_of_squares(values) / (values.len() as f64 - 1.0)
}
