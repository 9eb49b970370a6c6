//! How numbers are spread.

use super::distribution::t_quantile;
use super::{CONFIDENCE, Interval, mean, variance};

/// How a measure is spread over sessions.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    pub n: usize,
    pub mean: f64,
    /// Standard deviation of the sample, by n − 1; none of one number.
    pub sd: Option<f64>,
    /// Of the mean: mean ± t·sd/√n, with n − 1 degrees of freedom (Student 1908). It assumes independent people, and a mean
    /// that is about normal: of skewed numbers it is rough below n = 20. None of one number.
    pub mean_interval: Option<Interval>,
    pub min: f64,
    /// Between two numbers linearly (type 7 of Hyndman & Fan 1996), as the quartiles.
    pub median: f64,
    pub quartiles: Interval,
    pub max: f64,
}

/// The spread of some numbers; none of none.
pub fn spread(values: &[f64]) -> Option<Spread> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (&min, &max) = (sorted.first()?, sorted.last()?);
    let (n, mean) = (sorted.len(), mean(&sorted));
    let sd = (n > 1).then(|| variance(&sorted).sqrt());
    let half = sd.map(|sd| t_quantile(0.5 + 0.5 * CONFIDENCE, n as f64 - 1.0) * sd / (n as f64).sqrt());
    Some(Spread {
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

/// The value below which a share of sorted numbers lies, between neighbours linearly. There must be a number.
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
        let one = spread(&[4.0]).unwrap();
        assert_eq!((one.mean, one.sd, one.mean_interval, one.quartiles), (4.0, None, None, [4.0, 4.0]));
        assert_eq!(spread(&[]), None);
    }

    #[test]
    fn quartiles_lie_between_neighbours() {
        assert_eq!(spread(&[4.0, 1.0, 2.0, 3.0]).unwrap().quartiles, [1.75, 3.25]);
    }
}
