//! Confidence intervals of means that stay within the values that are possible.

use super::distribution::t_quantile;
use super::{CONFIDENCE, DescriptiveStatistics, Interval, describe, mean, proportion, variance};

/// Values that a quantity can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueRange {
    Unbounded,
    NonNegative,
    /// From the first number to the second, which is greater.
    Within(f64, f64),
    /// 0 or 1.
    Binary,
}

impl ValueRange {
    pub fn contains(self, value: f64) -> bool {
        match self {
            ValueRange::Unbounded => true,
            ValueRange::NonNegative => value >= 0.0,
            ValueRange::Within(low, high) => (low..=high).contains(&value),
            ValueRange::Binary => value == 0.0 || value == 1.0,
        }
    }

    /// Range of the difference between two such values.
    pub fn of_difference(self) -> ValueRange {
        match self {
            ValueRange::Unbounded | ValueRange::NonNegative => ValueRange::Unbounded,
            ValueRange::Within(low, high) => ValueRange::Within(low - high, high - low),
            ValueRange::Binary => ValueRange::Within(-1.0, 1.0),
        }
    }
}

/// Descriptive statistics with an interval of the mean that stays within the range; `None` if there are no values.
pub fn describe_in(values: &[f64], range: ValueRange) -> Option<DescriptiveStatistics> {
    Some(DescriptiveStatistics { mean_interval: mean_interval_in(values, range), ..describe(values)? })
}

/// Confidence interval of a mean, within the range; `None` for fewer than two values.
///
/// - 0 or 1: Wilson's interval of a proportion ([`proportion`]).
/// - Within two bounds: Student's interval of logit p, p = (mean − low) / (high − low), transformed back. Its standard
///   error is that of the mean, divided by (high − low)·p·(1 − p) (delta method).
/// - Not negative: Student's interval of the logarithm of the mean, whose standard error is that of the mean divided by
///   the mean (delta method), transformed back.
/// - Unbounded: Student's interval, mean ± t·sd/√n.
///
/// If any value is outside the range, the range is wrong, and the interval is that of an unbounded quantity. Values
/// that are all equal give the interval from that value to itself.
pub fn mean_interval_in(values: &[f64], range: ValueRange) -> Option<Interval> {
    if values.len() < 2 {
        return None;
    }
    let (n, mean) = (values.len() as f64, mean(values));
    let half = t_quantile(0.5 + 0.5 * CONFIDENCE, n - 1.0) * (variance(values) / n).sqrt();
    let range = if values.iter().all(|v| range.contains(*v)) { range } else { ValueRange::Unbounded };
    let interval = match range {
        ValueRange::Binary => {
            return proportion(values.iter().filter(|v| **v == 1.0).count(), values.len()).map(|p| p.interval);
        }
        _ if half == 0.0 => [mean; 2],
        ValueRange::Unbounded => [mean - half, mean + half],
        ValueRange::NonNegative => [-1.0, 1.0].map(|side| mean * libm::exp(side * half / mean)),
        ValueRange::Within(low, high) => {
            let share = (mean - low) / (high - low);
            let logit = libm::log(share / (1.0 - share));
            let half = half / ((high - low) * share * (1.0 - share));
            [-1.0, 1.0].map(|side| low + (high - low) / (1.0 + libm::exp(-(logit + side * half))))
        }
    };
    Some(interval)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_interval_leaves_the_range() {
        // Aim: times, percentages and yes-or-no measures have possible intervals where Student's leaves the range.
        // Method: skewed values near each bound, few and many.
        let near_zero = [0.0, 0.0, 0.0, 0.0, 0.001, 0.04];
        let near_full = [100.0, 99.9, 100.0, 100.0, 93.0];
        let flags = [0.0, 0.0, 0.0, 0.0, 1.0];
        for (values, range) in [
            (&near_zero[..], ValueRange::NonNegative),
            (&near_full[..], ValueRange::Within(0.0, 100.0)),
            (&flags[..], ValueRange::Binary),
        ] {
            let student = mean_interval_in(values, ValueRange::Unbounded).unwrap();
            assert!(!student.iter().all(|v| range.contains(*v)), "{student:?}");
            let [low, high] = mean_interval_in(values, range).unwrap();
            let within = if range == ValueRange::Binary { ValueRange::Within(0.0, 1.0) } else { range };
            assert!(within.contains(low) && within.contains(high), "{low} to {high}");
            assert!(low < mean(values) && mean(values) < high, "{low} to {high}");
        }
    }

    #[test]
    fn far_from_the_bounds_the_interval_is_students() {
        let values = [49.0, 50.0, 50.5, 51.0];
        let student = mean_interval_in(&values, ValueRange::Unbounded).unwrap();
        for range in [ValueRange::NonNegative, ValueRange::Within(0.0, 100.0)] {
            let own = mean_interval_in(&values, range).unwrap();
            assert!(own.iter().zip(student).all(|(a, b)| (a - b).abs() < 0.05), "{own:?} and {student:?}");
        }
    }

    #[test]
    fn impossible_values_and_equal_values_have_an_interval() {
        let beyond = [-1.0, 3.0];
        assert_eq!(
            mean_interval_in(&beyond, ValueRange::NonNegative),
            mean_interval_in(&beyond, ValueRange::Unbounded)
        );
        assert_eq!(mean_interval_in(&[0.0; 3], ValueRange::NonNegative), Some([0.0; 2]));
        assert_eq!(mean_interval_in(&[100.0; 3], ValueRange::Within(0.0, 100.0)), Some([100.0; 2]));
        assert_eq!(mean_interval_in(&[4.0], ValueRange::Unbounded), None);
        assert_eq!(ValueRange::Within(0.0, 100.0).of_difference(), ValueRange::Within(-100.0, 100.0));
    }
}
