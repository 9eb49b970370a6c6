//! Cronbach's α: internal consistency of the statements of a questionnaire.

use super::distribution::f_quantile;
use super::{CONFIDENCE, Interval, mean, sum_of_squares, variance};

/// Cronbach's α of a set of statements (Psychometrika 1951;16:297).
///
/// α = k/(k−1) · (1 − Σ sᵢ² / s²), where sᵢ² is the variance of statement i over people and s² that of people's sums.
/// It assumes that the scores of negatively worded statements are reversed and that people answer independently; with
/// few people it says little.
#[derive(Clone, Debug, PartialEq)]
pub struct CronbachAlpha {
    /// Number of people, each of whom answered every statement.
    pub people: usize,
    pub statements: usize,
    pub alpha: f64,
    /// Interval from the F distribution with n − 1 and (n − 1)(k − 1) degrees of freedom (Feldt, Woodruff & Salih,
    /// Appl Psychol Meas 1987;11:93).
    pub interval: Interval,
    /// Fit of each statement, in the order of the statements.
    pub items: Vec<ItemFit>,
}

/// Fit of one statement with the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ItemFit {
    /// Pearson correlation with the sum of the others; `None` if either does not vary.
    pub item_rest_correlation: Option<f64>,
    /// α of the others alone; `None` if there are fewer than two or their sum does not vary.
    pub alpha_if_deleted: Option<f64>,
}

/// Computes Cronbach's α.
///
/// `answers` holds, for each person, one score per statement, none missing, with negatively worded statements already
/// reversed. `None` with fewer than two people or statements, or if the sums do not vary.
///
/// # Panics
/// If a person has fewer answers than the first.
pub fn cronbach_alpha(answers: &[Vec<f64>]) -> Option<CronbachAlpha> {
    let (people, statements) = (answers.len(), answers.first()?.len());
    let value = alpha_coefficient(answers)?;
    let (n, k) = (people as f64, statements as f64);
    let freedom = [n - 1.0, (n - 1.0) * (k - 1.0)];
    let tail = 0.5 * (1.0 - CONFIDENCE);
    let bound = |share: f64| 1.0 - (1.0 - value) * f_quantile(share, freedom);
    let items = (0..statements).map(|item| {
        let rest: Vec<Vec<f64>> = answers.iter().map(|a| without(a, item)).collect();
        let own: Vec<f64> = answers.iter().map(|a| a[item]).collect();
        let sums: Vec<f64> = rest.iter().map(|a| a.iter().sum()).collect();
        ItemFit { item_rest_correlation: correlation(&own, &sums), alpha_if_deleted: alpha_coefficient(&rest) }
    });
    Some(CronbachAlpha {
        people,
        statements,
        alpha: value,
        interval: [bound(1.0 - tail), bound(tail)],
        items: items.collect(),
    })
}

fn alpha_coefficient(answers: &[Vec<f64>]) -> Option<f64> {
    let statements = answers.first()?.len();
    if answers.len() < 2 || statements < 2 {
        return None;
    }
    let own: f64 = (0..statements).map(|item| variance(&answers.iter().map(|a| a[item]).collect::<Vec<_>>())).sum();
    let whole = variance(&answers.iter().map(|a| a.iter().sum()).collect::<Vec<_>>());
    let k = statements as f64;
    (whole > 0.0).then(|| k / (k - 1.0) * (1.0 - own / whole))
}

fn without(answers: &[f64], item: usize) -> Vec<f64> {
    answers.iter().enumerate().filter(|(i, _)| *i != item).map(|(_, v)| *v).collect()
}

/// Pearson correlation of two series of equal length; `None` if one does not vary.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let products: f64 = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum();
    let scale = (sum_of_squares(a) * sum_of_squares(b)).sqrt();
    (scale > 0.0).then(|| products / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_that_say_the_same_have_an_alpha_of_one() {
        let same = cronbach_alpha(&[vec![1.0, 1.0, 1.0], vec![4.0, 4.0, 4.0], vec![3.0, 3.0, 3.0]]).unwrap();
        assert!((same.alpha - 1.0).abs() < 1e-12, "{}", same.alpha);
        assert!((same.items[0].item_rest_correlation.unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn where_nobody_differs_there_is_no_alpha() {
        assert_eq!(cronbach_alpha(&[vec![3.0, 3.0], vec![3.0, 3.0]]), None);
        assert_eq!(cronbach_alpha(&[vec![3.0, 3.0]]), None);
        assert_eq!(cronbach_alpha(&[vec![3.0], vec![4.0]]), None);
        assert_eq!(cronbach_alpha(&[]), None);
    }
}
