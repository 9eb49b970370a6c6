//! Whether the statements of a questionnaire ask after one thing.

use super::distribution::f_quantile;
use super::{CONFIDENCE, Interval, mean, squares, variance};

/// Cronbach's α of some statements (Psychometrika 1951;16:297).
///
/// α = k/(k−1) · (1 − Σ sᵢ² / s²), sᵢ² the variance of statement i over people, s² that of people's sums. It assumes that
/// negative statements are mirrored and that people answer independently; with few people it says little.
#[derive(Clone, Debug, PartialEq)]
pub struct Alpha {
    /// People who answered every statement, and the number of statements.
    pub people: usize,
    pub statements: usize,
    pub alpha: f64,
    /// By F with n − 1 and (n − 1)(k − 1) degrees of freedom (Feldt, Woodruff & Salih, Appl Psychol Meas 1987;11:93).
    pub interval: Interval,
    /// Statement by statement, in their order.
    pub items: Vec<ItemFit>,
}

/// How a statement fits the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ItemFit {
    /// Pearson's correlation with the sum of the others; none where either does not vary.
    pub with_rest: Option<f64>,
    /// α of the others alone; none of fewer than two, or where their sum does not vary.
    pub alpha_without: Option<f64>,
}

/// `answers`: for each person one number per statement, none missing and as they count. Two people and statements at least.
pub fn alpha(answers: &[Vec<f64>]) -> Option<Alpha> {
    let (people, statements) = (answers.len(), answers.first()?.len());
    let value = coefficient(answers)?;
    let (n, k) = (people as f64, statements as f64);
    let freedom = [n - 1.0, (n - 1.0) * (k - 1.0)];
    let tail = 0.5 * (1.0 - CONFIDENCE);
    let bound = |share: f64| 1.0 - (1.0 - value) * f_quantile(share, freedom);
    let items = (0..statements).map(|item| {
        let rest: Vec<Vec<f64>> = answers.iter().map(|a| without(a, item)).collect();
        let own: Vec<f64> = answers.iter().map(|a| a[item]).collect();
        let sums: Vec<f64> = rest.iter().map(|a| a.iter().sum()).collect();
        ItemFit { with_rest: correlation(&own, &sums), alpha_without: coefficient(&rest) }
    });
    Some(Alpha { people, statements, alpha: value, interval: [bound(1.0 - tail), bound(tail)], items: items.collect() })
}

fn coefficient(answers: &[Vec<f64>]) -> Option<f64> {
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

/// Pearson's correlation of two rows of equal length; none where one does not vary.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let products: f64 = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum();
    let scale = (squares(a) * squares(b)).sqrt();
    (scale > 0.0).then(|| products / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_that_say_the_same_have_an_alpha_of_one() {
        let same = alpha(&[vec![1.0, 1.0, 1.0], vec![4.0, 4.0, 4.0], vec![3.0, 3.0, 3.0]]).unwrap();
        assert!((same.alpha - 1.0).abs() < 1e-12, "{}", same.alpha);
        assert!((same.items[0].with_rest.unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn where_nobody_differs_there_is_no_alpha() {
        assert_eq!(alpha(&[vec![3.0, 3.0], vec![3.0, 3.0]]), None);
        assert_eq!(alpha(&[vec![3.0, 3.0]]), None);
        assert_eq!(alpha(&[vec![3.0], vec![4.0]]), None);
        assert_eq!(alpha(&[]), None);
    }
}
