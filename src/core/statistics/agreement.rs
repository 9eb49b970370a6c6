//! Agreement of two raters who used the same ordered categories.

use super::distribution::normal_quantile;
use super::{CONFIDENCE, Interval};

/// Penalty for ratings that differ, as a share of the greatest possible difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KappaWeights {
    /// Proportional to the number of categories between the two ratings (Cicchetti & Allison 1971).
    Linear,
    /// Proportional to the square of that number (Fleiss & Cohen 1973).
    Quadratic,
}

/// Cohen's weighted kappa (Psychol Bull 1968;70:213): 1 for identical ratings, 0 for the agreement that chance gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedKappa {
    /// Number of works that both raters rated.
    pub works: usize,
    pub kappa: f64,
    /// Interval by the large-sample variance of Fleiss, Cohen & Everitt (Psychol Bull 1969;72:323), within −1 to 1.
    pub interval: Interval,
}

/// Computes the weighted kappa of two raters.
///
/// `pairs` holds both ratings of each work, from 1 to `categories`. `None` with fewer than two works or categories,
/// with a rating outside the range, or if both raters gave all works the same rating.
pub fn weighted_kappa(pairs: &[(usize, usize)], categories: usize, weights: KappaWeights) -> Option<WeightedKappa> {
    let is_in_range = |rating: usize| (1..=categories).contains(&rating);
    if pairs.len() < 2 || categories < 2 || !pairs.iter().all(|(a, b)| is_in_range(*a) && is_in_range(*b)) {
        return None;
    }
    let n = pairs.len() as f64;
    // Agreement of two categories: 1 for the same, 0 for the most distant.
    let weight = |i: usize, j: usize| {
        let distance = i.abs_diff(j) as f64 / (categories - 1) as f64;
        1.0 - if weights == KappaWeights::Linear { distance } else { distance * distance }
    };
    let mut shares = vec![vec![0.0; categories]; categories];
    for (a, b) in pairs {
        shares[a - 1][b - 1] += 1.0 / n;
    }
    let all = || 0..categories;
    let first: Vec<f64> = all().map(|i| shares[i].iter().sum()).collect();
    let second: Vec<f64> = all().map(|j| all().map(|i| shares[i][j]).sum()).collect();
    let cells = || all().flat_map(|i| all().map(move |j| (i, j)));
    let observed: f64 = cells().map(|(i, j)| weight(i, j) * shares[i][j]).sum();
    let by_chance: f64 = cells().map(|(i, j)| weight(i, j) * first[i] * second[j]).sum();
    /// Differences below this are those of rounding; the terms are of order 1.
    const ROUNDING: f64 = 1e-13;
    let spare = 1.0 - by_chance;
    // No differences beyond rounding: kappa is not defined.
    if spare < 1e-12 {
        return None;
    }
    let kappa = (observed - by_chance) / spare;
    let of_first: Vec<f64> = all().map(|i| all().map(|j| second[j] * weight(i, j)).sum()).collect();
    let of_second: Vec<f64> = all().map(|j| all().map(|i| first[i] * weight(i, j)).sum()).collect();
    let term = |(i, j): (usize, usize)| {
        let deviation = weight(i, j) * spare - (of_first[i] + of_second[j]) * (1.0 - observed);
        shares[i][j] * deviation * deviation
    };
    let centre = observed * by_chance - 2.0 * by_chance + observed;
    let difference = cells().map(term).sum::<f64>() - centre * centre;
    // The variance of a perfect agreement is zero but for rounding.
    let variance = if difference < ROUNDING { 0.0 } else { difference / (n * spare.powi(4)) };
    let half = normal_quantile(0.5 + 0.5 * CONFIDENCE) * variance.sqrt();
    Some(WeightedKappa { works: pairs.len(), kappa, interval: [(kappa - half).max(-1.0), (kappa + half).min(1.0)] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kappa_is_that_of_statsmodels() {
        // Aim: a table with known disagreement. Method: figures of cohens_kappa of statsmodels 0.15 for the same table.
        let table = [[8, 2, 1, 0], [3, 9, 2, 1], [0, 2, 7, 3], [1, 0, 2, 9]];
        let mut pairs = Vec::new();
        for (i, row) in table.iter().enumerate() {
            for (j, count) in row.iter().enumerate() {
                pairs.extend(std::iter::repeat_n((i + 1, j + 1), *count));
            }
        }
        let check = |weights, expected: [f64; 3]| {
            let found = weighted_kappa(&pairs, 4, weights).unwrap();
            for (a, b) in [found.kappa, found.interval[0], found.interval[1]].into_iter().zip(expected) {
                assert!((a - b).abs() < 1e-12, "{weights:?}: {a} where statsmodels gives {b}");
            }
        };
        check(KappaWeights::Linear, LINEAR);
        check(KappaWeights::Quadratic, QUADRATIC);
    }

    const LINEAR: [f64; 3] = [0.6584255042290175, 0.5042302165096387, 0.8126207919483962];
    const QUADRATIC: [f64; 3] = [0.743801652892562, 0.5728235392691677, 0.9147797665159562];

    #[test]
    fn kappa_needs_ratings_that_differ() {
        assert_eq!(weighted_kappa(&[(2, 2), (2, 2)], 5, KappaWeights::Linear), None);
        assert_eq!(weighted_kappa(&[(1, 6), (2, 2)], 5, KappaWeights::Linear), None);
        assert_eq!(weighted_kappa(&[(1, 2)], 5, KappaWeights::Linear), None);
        let same = weighted_kappa(&[(1, 1), (3, 3), (5, 5)], 5, KappaWeights::Quadratic).unwrap();
        assert!((same.kappa - 1.0).abs() < 1e-12 && same.interval[0] > 1.0 - 1e-6, "{same:?}");
    }
}
