//! Descriptive statistics: mean, spread and quantiles.

use super::distribution::t_quantile;
use super::{CONFIDENCE, Interval, mean, variance};

/// Distribution of a measure over sessions.
#[derive(Clone, Debug, PartialEq)]
pub struct DescriptiveStatistics {
    pub n: usize,
    pub mean: f64,
    /// Sample standard deviation, with denominator n − 1; `None` for a single value.
    pub sd: Option<f64>,
    /// Interval of the mean: mean ± t·sd/√n, with n − 1 degrees of freedom (Student 1908). It assumes independent
    /// people and an approximately normal mean: for skewed values it is rough below n = 20. `None` for a single
    /// value.
    pub mean_interval: Option<Interval>,
    pub min: f64,
    /// Median, interpolated linearly (type 7 of Hyndman & Fan 1996), as are the quartiles.
    pub median: f64,
    pub quartiles: Interval,
    pub max: f64,
}

/// Computes descriptive statistics; `None` if there are no values.
pub fn describe(values: &[f64]) -> Option<DescriptiveStatistics> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (&min, &max) = (sorted.first()?, sorted.last()?);
    let (n, mean) = (sorted.len(), mean(&sorted));
    let sd = (n > 1).then(|| variance(&sorted).sqrt());
    let half = sd.map(|sd| t_quantile(0.5 + 0.5 * CONFIDENCE, n as f64 - 1.0) * sd / (n as f64).sqrt());
    Some(DescriptiveStatistics {
        n,
        mean,
        sd,
        mean_interval: half.map(|half| [mean - half, mean + half]),
        min,
        median: quantile(&sorted, 0.5),
        quartiles: [quantile(&sorted, 0.25), quantile(&sorted, 0.75)],
        max,
    })
}

/// Value below which a fraction `share` (0 to 1) of sorted values lies, interpolated linearly.
///
/// # Panics
/// If there are no values, or `share` is outside 0 to 1.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    below + (above - below) * place.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_has_a_mean_and_no_spread() {
        let one = describe(&[4.0]).unwrap();
        assert_eq!((one.mean, one.sd, one.mean_interval, one.quartiles), (4.0, None, None, [4.0, 4.0]));
        assert_eq!(describe(&[]), None);
    }

    #[test]
    fn quartiles_lie_between_neighbours() {
        assert_eq!(describe(&[4.0, 1.0, 2.0, 3.0]).unwrap().quartiles, [1.75, 3.25]);
    }
}
