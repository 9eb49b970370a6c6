//! Reliability of repeated attempts by the same people.

use super::alpha::correlation;
use super::distribution::{f_quantile, t_quantile};
use super::{CONFIDENCE, Interval, mean, sum_of_squares};

/// ICC(2,1) of Shrout & Fleiss (Psychol Bull 1979;86:420): two-way random effects, absolute agreement, a single
/// attempt.
///
/// (MSR − MSE) / (MSR + (k−1)·MSE + k·(MSC − MSE)/n), from the mean squares between people (MSR), between attempts
/// (MSC) and of the residual (MSE). A gain of all people from one attempt to the next lowers it. It may be negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntraclassCorrelation {
    pub people: usize,
    pub attempts: usize,
    pub icc: f64,
    /// Interval of Shrout & Fleiss, with Satterthwaite's degrees of freedom; `None` if no variance remains besides
    /// that between people and between attempts.
    pub interval: Option<Interval>,
}

/// Computes the intraclass correlation.
///
/// `values` holds, for each person, one value per attempt. `None` with fewer than two people or attempts, if people
/// differ in their number of attempts, or if the values do not vary.
pub fn icc(values: &[Vec<f64>]) -> Option<IntraclassCorrelation> {
    let (people, attempts) = (values.len(), values.first()?.len());
    if people < 2 || attempts < 2 || values.iter().any(|v| v.len() != attempts) {
        return None;
    }
    let (n, k) = (people as f64, attempts as f64);
    let all: Vec<f64> = values.iter().flatten().copied().collect();
    let rows: Vec<f64> = values.iter().map(|v| mean(v)).collect();
    let columns: Vec<f64> = (0..attempts).map(|a| mean(&values.iter().map(|v| v[a]).collect::<Vec<_>>())).collect();
    let (of_people, of_attempts) = (k * sum_of_squares(&rows), n * sum_of_squares(&columns));
    // Rounding may make the residual slightly negative.
    let residual = (sum_of_squares(&all) - of_people - of_attempts).max(0.0);
    let (msr, msc, mse) = (of_people / (n - 1.0), of_attempts / (k - 1.0), residual / ((n - 1.0) * (k - 1.0)));
    let whole = msr + (k - 1.0) * mse + k * (msc - mse) / n;
    // No differences beyond rounding.
    if sum_of_squares(&all) <= 1e-24 * all.iter().map(|v| v * v).sum::<f64>() || whole <= 0.0 {
        return None;
    }
    let icc = (msr - mse) / whole;
    let interval = (residual > 1e-12 * sum_of_squares(&all)).then(|| {
        let (f, spare) = (msc / mse, n * (1.0 + (k - 1.0) * icc) - k * icc);
        let over = (k - 1.0) * (n - 1.0) * (k * icc * f + spare) * (k * icc * f + spare);
        let freedom = over / ((n - 1.0) * k * k * icc * icc * f * f + spare * spare);
        let share = 0.5 + 0.5 * CONFIDENCE;
        let (low, high) = (f_quantile(share, [n - 1.0, freedom]), f_quantile(share, [freedom, n - 1.0]));
        let others = k * msc + (k * n - k - n) * mse;
        [n * (msr - low * mse) / (low * others + n * msr), n * (high * msr - mse) / (others + n * high * msr)]
    });
    Some(IntraclassCorrelation { people, attempts, icc, interval })
}

/// Two attempts by the same people: test and retest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retest {
    pub people: usize,
    /// Pearson correlation: agreement in the order of people. A gain of all people does not lower it.
    pub correlation: Option<f64>,
    /// Mean of second minus first attempt.
    pub gain: f64,
    /// Student's interval of `gain`, for paired values.
    pub gain_interval: Interval,
    /// Standard deviation of the gains / √2: typical deviation of one attempt from the person's true level.
    pub typical_error: f64,
}

/// Compares two attempts: `pairs` holds the first and the second of each person. `None` with fewer than two people.
pub fn retest(pairs: &[(f64, f64)]) -> Option<Retest> {
    let n = pairs.len();
    if n < 2 {
        return None;
    }
    let (first, second): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let gains: Vec<f64> = pairs.iter().map(|(a, b)| b - a).collect();
    let (gain, variance) = (mean(&gains), sum_of_squares(&gains) / (n as f64 - 1.0));
    let half = t_quantile(0.5 + 0.5 * CONFIDENCE, n as f64 - 1.0) * (variance / n as f64).sqrt();
    Some(Retest {
        people: n,
        correlation: correlation(&first, &second),
        gain,
        gain_interval: [gain - half, gain + half],
        typical_error: (0.5 * variance).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icc_is_the_one_its_authors_print() {
        // Aim: ICC(2,1) of the example of Shrout & Fleiss (their table 2: six people, four judges) is 0.29 (table 4).
        let values = [
            [9.0, 2.0, 5.0, 8.0],
            [6.0, 1.0, 3.0, 2.0],
            [8.0, 4.0, 6.0, 8.0],
            [7.0, 1.0, 2.0, 6.0],
            [10.0, 5.0, 6.0, 9.0],
            [6.0, 2.0, 4.0, 7.0],
        ];
        let found = icc(&values.map(Vec::from)).unwrap();
        assert_eq!(format!("{:.2}", found.icc), "0.29");
        let [low, high] = found.interval.unwrap();
        assert!(low < found.icc && found.icc < high, "{low} {high}");
    }

    #[test]
    fn what_everybody_gains_lowers_agreement_and_not_order() {
        let pairs = [(50.0, 60.0), (60.0, 70.0), (70.0, 80.5)];
        let again = retest(&pairs).unwrap();
        assert!(again.correlation.unwrap() > 0.999);
        assert!(icc(&pairs.map(|(a, b)| vec![a, b])).unwrap().icc < 0.75);
    }

    #[test]
    fn where_nobody_differs_there_is_no_reliability() {
        assert_eq!(icc(&[vec![0.1, 0.1], vec![0.1, 0.1], vec![0.1, 0.1]]), None);
        assert_eq!(icc(&[vec![1.0, 2.0]]), None);
        assert_eq!(icc(&[vec![1.0, 2.0], vec![1.0]]), None);
    }
}
