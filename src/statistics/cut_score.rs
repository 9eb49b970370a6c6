//! Where to draw the line between passed and not passed, from examiners' judgements of people.

use super::{Interval, line, mean, variance};

/// The contrasting-groups cut (Livingston & Zieky, Passing Scores, ETS 1982): where a person of that score is as likely to come
/// from the group judged competent as from the group judged not yet competent.
///
/// It takes both groups' scores for normal, and both groups for equally large and equally costly to misjudge: the cut is where
/// the two normal curves cross between their means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContrastingGroups {
    pub cut: f64,
    /// Number of people, mean and standard deviation of those judged not yet competent, and of those judged competent.
    pub below: (usize, f64, f64),
    pub above: (usize, f64, f64),
    /// Of these people: judged competent and under the cut; judged not yet competent and at it or over.
    pub failed_wrongly: usize,
    pub passed_wrongly: usize,
}

/// Two people in each group at least, who differ; the competent better on average.
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

/// Where two normal curves, given by mean and standard deviation, cross between their means.
fn crossing((m1, s1): (f64, f64), (m2, s2): (f64, f64)) -> Option<f64> {
    if m1 >= m2 || s1 <= 0.0 || s2 <= 0.0 {
        return None;
    }
    // (x − m1)²/2s1² + ln s1 = (x − m2)²/2s2² + ln s2, with x counted from m1.
    let gap = m2 - m1;
    let a = s2 * s2 - s1 * s1;
    let b = gap * s1 * s1;
    let c = -gap * gap * s1 * s1 - 2.0 * s1 * s1 * s2 * s2 * libm::log(s2 / s1);
    // a·x² + 2b·x + c = 0. Of b > 0 this form of the root between the means loses no digits, and serves a = 0 as well.
    let root = (b * b - a * c).max(0.0).sqrt();
    let x = -c / (b + root);
    (x > 0.0 && x < gap).then_some(m1 + x)
}

/// The cut by borderline regression (Wood, Humphrey-Murto & Norman, Adv Health Sci Educ 2006;11:115): the score that a line
/// through scores over examiners' global ratings gives to a borderline rating.
///
/// It takes the rating's steps for equally far apart and scores for a straight line over them, with the same scatter everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BorderlineRegression {
    pub people: usize,
    pub cut: f64,
    /// Of the line's height at the borderline rating.
    pub interval: Interval,
    /// Points for each step of the rating.
    pub slope: f64,
    /// R²: how far ratings and scores say the same.
    pub explained: f64,
}

/// `judged`: rating and score of three people at least, who differ in both; the line must rise.
pub fn borderline_regression(judged: &[(f64, f64)], borderline: f64) -> Option<BorderlineRegression> {
    let line = line(judged).filter(|line| line.slope > 0.0)?;
    Some(BorderlineRegression {
        people: line.n,
        cut: line.at(borderline),
        interval: line.interval_at(borderline),
        slope: line.slope,
        explained: line.explained,
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
        // Ratings that fall as scores rise say nothing about a cut.
        assert_eq!(borderline_regression(&[(3.0, 40.0), (2.0, 60.0), (1.0, 90.0)], 2.0), None);
    }
}
