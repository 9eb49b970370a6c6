//! Cut scores between pass and fail, from examiners' judgements of people.

use super::{Interval, linear_fit, mean, variance};

/// Cut score by the contrasting-groups method (Livingston & Zieky, Passing Scores, ETS 1982): the score at which a
/// person is equally likely to belong to the group judged competent and to the group judged not yet competent.
///
/// The method assumes that the scores of both groups are normally distributed and that both groups are equally large
/// and equally costly to misjudge: the cut is where the two normal curves cross between their means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContrastingGroups {
    pub cut: f64,
    /// Number, mean and standard deviation of the people judged not yet competent.
    pub below: (usize, f64, f64),
    /// Number, mean and standard deviation of the people judged competent.
    pub above: (usize, f64, f64),
    /// Number of people judged competent whose score is below the cut.
    pub failed_wrongly: usize,
    /// Number of people judged not yet competent whose score is at or above the cut.
    pub passed_wrongly: usize,
}

/// Computes the cut score by contrasting groups.
///
/// `None` unless each group has at least two people with different scores and the competent group has the higher
/// mean.
pub fn contrasting_groups(not_yet: &[f64], competent: &[f64]) -> Option<ContrastingGroups> {
    if not_yet.len() < 2 || competent.len() < 2 {
        return None;
    }
    let describe = |values: &[f64]| (values.len(), mean(values), variance(values).sqrt());
    let (below, above) = (describe(not_yet), describe(competent));
    let cut = crossing((below.1, below.2), (above.1, above.2))?;
    Some(ContrastingGroups {
        cut,
        below,
        above,
        failed_wrongly: competent.iter().filter(|s| **s < cut).count(),
        passed_wrongly: not_yet.iter().filter(|s| **s >= cut).count(),
    })
}

/// Abscissa at which two normal curves, given by mean and standard deviation, cross between their means.
fn crossing((m1, s1): (f64, f64), (m2, s2): (f64, f64)) -> Option<f64> {
    if m1 >= m2 || s1 <= 0.0 || s2 <= 0.0 {
        return None;
    }
    // (x − m1)²/2s1² + ln s1 = (x − m2)²/2s2² + ln s2, with x measured from m1.
    let gap = m2 - m1;
    let a = s2 * s2 - s1 * s1;
    let b = gap * s1 * s1;
    let c = -gap * gap * s1 * s1 - 2.0 * s1 * s1 * s2 * s2 * libm::log(s2 / s1);
    // a·x² + 2b·x + c = 0. Because b > 0, this form of the root between the means loses no digits; it also serves a =
    // 0.
    let root = (b * b - a * c).max(0.0).sqrt();
    let x = -c / (b + root);
    (x > 0.0 && x < gap).then_some(m1 + x)
}

/// Cut score by borderline regression (Wood, Humphrey-Murto & Norman, Adv Health Sci Educ 2006;11:115): the score
/// that a regression line of scores on examiners' global ratings predicts for a borderline rating.
///
/// The method assumes that the steps of the rating are equally far apart and that scores depend on it linearly, with
/// the same variance everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BorderlineRegression {
    pub people: usize,
    pub cut: f64,
    /// Interval of the line at the borderline rating.
    pub interval: Interval,
    /// Points per step of the rating.
    pub slope: f64,
    /// R²: agreement of ratings and scores.
    pub r_squared: f64,
}

/// Computes the cut score by borderline regression.
///
/// `judged` holds the rating and the score of each person. `None` with fewer than three people, if all ratings or all
/// scores are equal, or if the line does not rise.
pub fn borderline_regression(judged: &[(f64, f64)], borderline: f64) -> Option<BorderlineRegression> {
    let line = linear_fit(judged).filter(|line| line.slope > 0.0)?;
    Some(BorderlineRegression {
        people: line.n,
        cut: line.predict(borderline),
        interval: line.interval_at(borderline),
        slope: line.slope,
        r_squared: line.r_squared,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_spreads_put_the_cut_in_the_middle() {
        let cut = contrasting_groups(&[40.0, 50.0, 60.0], &[70.0, 80.0, 90.0]).unwrap();
        assert!((cut.cut - 65.0).abs() < 1e-9);
        assert_eq!((cut.failed_wrongly, cut.passed_wrongly), (0, 0));
    }

    #[test]
    fn at_the_cut_both_curves_are_equally_high() {
        let (below, above) = ([30.0, 52.0, 61.0, 38.0, 44.0], [70.0, 75.0, 81.0, 74.0]);
        let ContrastingGroups { cut, below, above, .. } = contrasting_groups(&below, &above).unwrap();
        let height = |(_, mean, sd): (usize, f64, f64)| (-0.5 * ((cut - mean) / sd).powi(2)).exp() / sd;
        assert!((height(below) / height(above) - 1.0).abs() < 1e-9);
        assert!(below.1 < cut && cut < above.1);
    }

    #[test]
    fn groups_in_the_wrong_order_have_no_cut() {
        assert_eq!(contrasting_groups(&[70.0, 80.0], &[40.0, 50.0]), None);
        assert_eq!(contrasting_groups(&[40.0, 40.0], &[80.0, 80.0]), None);
        // Ratings that fall as scores rise define no cut.
        assert_eq!(borderline_regression(&[(3.0, 40.0), (2.0, 60.0), (1.0, 90.0)], 2.0), None);
    }
}
