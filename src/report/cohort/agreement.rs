//! Agreement of examiners with each other and with the computed marks.

use super::{Cohort, ExaminerRating};
use crate::session_file::{GradeFile, ItemResultFile, SessionFile};
use serde::Serialize;
use std::collections::BTreeMap;
use typodont_core::statistics::{Interval, KappaWeights, icc, weighted_kappa};

/// Name under which the computed marks are listed with the examiners.
pub const MACHINE: &str = "machine";

/// Agreement about the works as a whole, or about one item of the rubric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgreementFile {
    /// Title and measure of the item; null for the works as a whole.
    pub item: Option<RatedItemFile>,
    /// Highest value of the scale.
    pub scale: u8,
    /// Number of works that anybody rated.
    pub works: usize,
    /// In alphabetical order.
    pub raters: Vec<String>,
    /// Each two raters, then each rater and the computed marks.
    pub pairs: Vec<AgreementPair>,
    /// ICC(2,1) of all raters, over the works that all of them rated; null for a single rater.
    pub icc: Option<IccFile>,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct RatedItemFile {
    pub title: String,
    pub metric: String,
}

/// Agreement of two raters, the second of whom may be [`MACHINE`], over the works that both rated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgreementPair {
    pub raters: [String; 2],
    pub works: usize,
    /// Weighted kappa; the computed marks are rounded to values of the scale. Null if ratings are not whole numbers, or
    /// do not vary.
    pub kappa_linear: Option<KappaFile>,
    pub kappa_quadratic: Option<KappaFile>,
    /// ICC(2,1); the computed marks are not rounded.
    pub icc: Option<IccFile>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KappaFile {
    pub kappa: f64,
    pub interval: Interval,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IccFile {
    pub works: usize,
    pub icc: f64,
    pub interval: Option<Interval>,
}

/// Ratings of each rater, by work.
type RatingsByRater = BTreeMap<String, BTreeMap<usize, f64>>;

impl Cohort {
    /// Computes the agreement about sessions of one exercise: `attempts` holds each person's sessions, as indices.
    /// Empty without ratings.
    pub(super) fn agreement(&self, attempts: &[Vec<usize>]) -> Vec<AgreementFile> {
        let mut groups: BTreeMap<(Option<RatedItemFile>, u8), RatingsByRater> = BTreeMap::new();
        for rating in &self.ratings {
            let Some(work) = self.rated_work(rating, attempts) else { continue };
            let item = rating
                .item
                .as_ref()
                .map(|(title, metric)| RatedItemFile { title: title.clone(), metric: metric.clone() });
            let by_rater = groups.entry((item, rating.scale)).or_default();
            by_rater.entry(rating.rater.clone()).or_default().insert(work, rating.rating);
        }
        groups.into_iter().map(|((item, scale), by_rater)| self.agreement_about(item, scale, &by_rater)).collect()
    }

    fn agreement_about(&self, item: Option<RatedItemFile>, scale: u8, by_rater: &RatingsByRater) -> AgreementFile {
        let mut works: Vec<usize> = by_rater.values().flat_map(|own| own.keys().copied()).collect();
        works.sort_unstable();
        works.dedup();
        let computed = works.iter().filter_map(|&work| {
            let grade = self.sessions[work].1.grade.as_ref()?;
            Some((work, computed_rating(grade, item.as_ref(), scale)?))
        });
        let computed: BTreeMap<usize, f64> = computed.collect();
        let raters: Vec<&String> = by_rater.keys().collect();
        let mut pairs = Vec::new();
        for (number, first) in raters.iter().enumerate() {
            let others = raters[number + 1..].iter();
            pairs.extend(
                others.filter_map(|second| pair([first, second], [&by_rater[*first], &by_rater[*second]], scale)),
            );
        }
        pairs.extend(by_rater.iter().filter_map(|(rater, own)| pair([rater, MACHINE], [own, &computed], scale)));
        let by_all = works.iter().filter_map(|work| by_rater.values().map(|own| own.get(work).copied()).collect());
        let by_all: Vec<Vec<f64>> = by_all.collect();
        AgreementFile {
            scale,
            works: works.len(),
            raters: raters.into_iter().cloned().collect(),
            pairs,
            icc: icc_file(&by_all),
            item,
        }
    }

    /// Returns the session that a rating is about: the one of its recording, or else the participant's last one with a
    /// grade.
    pub(super) fn rated_work(&self, rating: &ExaminerRating, attempts: &[Vec<usize>]) -> Option<usize> {
        let session = |index: &usize| &self.sessions[*index].1;
        let of_exercise = |index: &usize| rating.scenario.as_ref().is_none_or(|own| *own == session(index).scenario.id);
        if !rating.recording.is_empty() {
            let is_own = |index: &usize| recording_of(session(index)) == rating.recording;
            return attempts.iter().flatten().copied().find(|index| is_own(index));
        }
        let is_own = |index: &usize| session(index).participant == rating.participant && of_exercise(index);
        let mut latest_first = attempts.iter().flatten().copied().rev();
        latest_first.find(|index| !rating.participant.is_empty() && is_own(index) && session(index).grade.is_some())
    }
}

/// Returns the SHA-256 of a session's recording; empty for values entered by hand.
pub fn recording_of(session: &SessionFile) -> &str {
    session.digests.get("recording.mcap").map_or("", String::as_str)
}

fn pair(raters: [&str; 2], ratings: [&BTreeMap<usize, f64>; 2], scale: u8) -> Option<AgreementPair> {
    let both = ratings[0].iter().filter_map(|(work, first)| Some([*first, *ratings[1].get(work)?]));
    let both: Vec<[f64; 2]> = both.collect();
    if both.is_empty() {
        return None;
    }
    // The computed marks lie between the values of the scale; an examiner's own ratings may as well.
    let is_machine = raters[1] == MACHINE;
    let category = |rating: f64, rounds: bool| {
        (rounds || rating.fract() == 0.0).then(|| rating.round().clamp(1.0, f64::from(scale)) as usize)
    };
    let categories: Option<Vec<(usize, usize)>> =
        both.iter().map(|[first, second]| Some((category(*first, false)?, category(*second, is_machine)?))).collect();
    let kappa = |weights| {
        let found = weighted_kappa(categories.as_ref()?, usize::from(scale), weights)?;
        Some(KappaFile { kappa: found.kappa, interval: found.interval })
    };
    Some(AgreementPair {
        raters: raters.map(String::from),
        works: both.len(),
        kappa_linear: kappa(KappaWeights::Linear),
        kappa_quadratic: kappa(KappaWeights::Quadratic),
        icc: icc_file(&both.iter().map(|both| both.to_vec()).collect::<Vec<_>>()),
    })
}

fn icc_file(ratings: &[Vec<f64>]) -> Option<IccFile> {
    let found = icc(ratings)?;
    let interval = found.interval.map(|bounds| bounds.map(|bound| bound.clamp(-1.0, 1.0)));
    Some(IccFile { works: found.people, icc: found.icc, interval })
}

/// Value of the scale for a computed mark, not rounded.
///
/// Of an item: 1 for no points to the highest value for all points, in proportion. Of the grade: 1 with a critical
/// error, for a session that was not finished and for no points; 2 (borderline) at the pass mark; the highest value for
/// all points; in proportion between.
pub fn computed_rating(grade: &GradeFile, item: Option<&RatedItemFile>, scale: u8) -> Option<f64> {
    let scale = f64::from(scale);
    let share = |part: f64, whole: f64| if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 1.0 };
    match item {
        Some(item) => {
            let is_own = |own: &&ItemResultFile| own.metric == item.metric && own.title == item.title;
            let own = grade.items.iter().find(is_own).filter(|own| own.max_points > 0.0)?;
            Some(1.0 + (scale - 1.0) * share(own.points, own.max_points))
        }
        None if !grade.finished || !grade.hard_fails.is_empty() => Some(1.0),
        None if grade.points < grade.pass_points => Some(1.0 + share(grade.points, grade.pass_points)),
        None => {
            Some(2.0 + (scale - 2.0) * share(grade.points - grade.pass_points, grade.max_points - grade.pass_points))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pass_mark_is_borderline_and_a_critical_error_fails() {
        let grade = |points: f64| GradeFile {
            points,
            max_points: 100.0,
            pass_points: 70.0,
            finished: true,
            passed: points >= 70.0,
            hard_fails: vec![],
            items: vec![],
            hard_fail_checks: vec![],
        };
        for (points, expected) in [(0.0, 1.0), (35.0, 1.5), (70.0, 2.0), (80.0, 3.0), (100.0, 5.0)] {
            assert_eq!(computed_rating(&grade(points), None, 5), Some(expected), "{points}");
        }
        let failed = GradeFile { hard_fails: vec!["Pulp exposed".into()], ..grade(100.0) };
        assert_eq!(computed_rating(&failed, None, 5), Some(1.0));
        let item = RatedItemFile { title: "Overlap".into(), metric: "dice".into() };
        assert_eq!(computed_rating(&grade(50.0), Some(&item), 5), None);
    }
}
