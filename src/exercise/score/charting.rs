//! The comparison of a periodontal chart with the true values.

use crate::record::{Recording, Replay};
use crate::scenario::metric_id::ChartMetric;
use crate::scenario::{Calculus, ProbingSite};
use crate::session::ChartEntry;
use typodont_core::tick::Tick;

/// Force above which a reading counts as pressed too hard, N. 0.25 N is taught; a trained hand keeps it to 0.1 N.
const HIGH_FORCE: f32 = 0.35;

/// Maximum error of a correct reading, mm: the tolerance to which examiners in clinical studies are calibrated.
const DEPTH_TOLERANCE: f64 = 1.0;

/// Charted and true values at a site.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteResult {
    pub site: ProbingSite,
    /// True probing depth, mm.
    pub true_depth: f64,
    /// Recession of the gingival margin below the cemento-enamel junction, mm.
    pub recession: f64,
    /// Reading of the depth; `None` if no depth was read.
    pub reading: Option<ProbingReading>,
    /// True if calculus was marked; `None` if no stage asks for calculus.
    pub calculus_marked: Option<bool>,
    pub has_calculus: bool,
}

/// A depth reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbingReading {
    /// Depth as read, whole mm.
    pub depth_mm: u8,
    /// Probing force, N.
    pub force: f32,
    pub at: Tick,
}

/// Returns the chart of a session; `None` if no stage asks for one. The last entry at each site counts.
pub fn chart(recording: &Recording, replay: &Replay) -> Option<Vec<SiteResult>> {
    let scenario = &recording.scenario;
    let asks =
        |calculus: bool| scenario.stages.iter().any(|s| if calculus { s.chart.calculus } else { s.chart.depths });
    let gum = replay.workpiece.periodontium.as_ref().filter(|_| asks(true) || asks(false))?;
    let notes = || replay.outcome.stages.iter().flat_map(|stage| &stage.charted);
    let deposits: &[Calculus] = scenario.scene.teeth.first().map_or(&[], |tooth| &tooth.calculus);
    let result = |site: ProbingSite| {
        let here = || notes().filter(move |note| note.site == site);
        let mut reading = here().filter_map(|note| match note.entry {
            ChartEntry::Depth { reading: read, force, .. } => {
                Some(ProbingReading { depth_mm: read, force, at: note.at })
            }
            ChartEntry::Calculus => None,
        });
        SiteResult {
            site,
            true_depth: f64::from(gum.pockets.depth[site as usize]),
            recession: f64::from(gum.pockets.recession[site as usize]),
            reading: reading.next_back(),
            calculus_marked: asks(true).then(|| here().any(|note| note.entry == ChartEntry::Calculus)),
            has_calculus: deposits.iter().any(|deposit| deposit.site == site),
        }
    };
    Some(ProbingSite::ALL.into_iter().map(result).collect())
}

/// Computes one of the measures of [`CHARTING`](crate::scenario::metric::CHARTING); `None` if it has no value.
pub fn measure(metric: ChartMetric, chart: &[SiteResult]) -> Option<f64> {
    let share = |count: usize, of: usize| (of > 0).then(|| 100.0 * count as f64 / of as f64);
    let off: Vec<f64> = chart.iter().filter_map(|s| Some(f64::from(s.reading?.depth_mm) - s.true_depth)).collect();
    let forces = || chart.iter().filter_map(|s| Some(s.reading?.force));
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0u32), |(sum, count), v| (sum + v, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    let is_asked = chart.iter().any(|s| s.calculus_marked.is_some());
    let marked = |s: &&SiteResult| s.calculus_marked == Some(true);
    match metric {
        ChartMetric::SitesRead => share(off.len(), chart.len()),
        ChartMetric::WithinOneMm => share(off.iter().filter(|d| d.abs() <= DEPTH_TOLERANCE).count(), chart.len()),
        ChartMetric::MeanError => mean(&mut off.iter().map(|d| d.abs())),
        ChartMetric::MeanBias => mean(&mut off.iter().copied()),
        ChartMetric::MaxForce => forces().reduce(f32::max).map(f64::from),
        ChartMetric::HighForceReadings => {
            forces().next().is_some().then(|| forces().filter(|force| *force > HIGH_FORCE).count() as f64)
        }
        ChartMetric::CalculusFound => {
            let there = || chart.iter().filter(|s| s.has_calculus);
            share(there().filter(marked).count(), there().count()).filter(|_| is_asked)
        }
        // If there is calculus and no site was marked, the trainee did not look for calculus.
        ChartMetric::CalculusFalseAlarms => {
            let was_looked_for = chart.iter().any(|s| marked(&s)) || !chart.iter().any(|s| s.has_calculus);
            (is_asked && was_looked_for).then(|| chart.iter().filter(|s| !s.has_calculus).filter(marked).count() as f64)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site(
        site: ProbingSite,
        true_depth: f64,
        read: Option<(u8, f32)>,
        marked: bool,
        has_calculus: bool,
    ) -> SiteResult {
        let reading = read.map(|(read, force)| ProbingReading { depth_mm: read, force, at: Tick(0) });
        SiteResult { site, true_depth, recession: 0.0, reading, calculus_marked: Some(marked), has_calculus }
    }

    #[test]
    fn a_chart_is_measured_by_the_formulae_it_prints() {
        // Aim: each measure by hand. Method: three readings of six, off by 0, +2 and −1 mm.
        let chart = [
            site(ProbingSite::MesioBuccal, 3.0, Some((3, 0.2)), false, true),
            site(ProbingSite::Buccal, 2.0, Some((4, 0.6)), true, true),
            site(ProbingSite::DistoBuccal, 5.0, Some((4, 0.3)), true, false),
            site(ProbingSite::MesioLingual, 2.0, None, false, false),
            site(ProbingSite::Lingual, 2.0, None, false, false),
            site(ProbingSite::DistoLingual, 2.0, None, false, false),
        ];
        let check = |metric: ChartMetric, expected: f64| {
            let found = measure(metric, &chart).unwrap_or(f64::NAN);
            assert!((found - expected).abs() < 1e-6, "{metric:?}: {found}, not {expected}");
        };
        check(ChartMetric::SitesRead, 50.0);
        check(ChartMetric::WithinOneMm, 100.0 / 3.0);
        check(ChartMetric::MeanError, 1.0);
        check(ChartMetric::MeanBias, 1.0 / 3.0);
        check(ChartMetric::MaxForce, f64::from(0.6f32));
        check(ChartMetric::HighForceReadings, 1.0);
        check(ChartMetric::CalculusFound, 50.0);
        check(ChartMetric::CalculusFalseAlarms, 1.0);
        let unread: Vec<SiteResult> = chart.iter().map(|s| SiteResult { reading: None, ..*s }).collect();
        for metric in [ChartMetric::MeanError, ChartMetric::MaxForce, ChartMetric::HighForceReadings] {
            assert_eq!(measure(metric, &unread), None, "{metric:?}: who reads nothing is not praised for it");
        }
        let unmarked: Vec<SiteResult> =
            chart.iter().map(|s| SiteResult { calculus_marked: Some(false), ..*s }).collect();
        assert_eq!(measure(ChartMetric::CalculusFalseAlarms, &unmarked), None, "nor who looks for nothing");
        let clean: Vec<SiteResult> = unmarked.iter().map(|s| SiteResult { has_calculus: false, ..*s }).collect();
        assert_eq!(measure(ChartMetric::CalculusFalseAlarms, &clean), Some(0.0));
    }
}
