//! A periodontal chart against the truth.

use crate::record::{Recording, Replay};
use crate::scenario::{Calculus, Site};
use crate::session::Noted;
use crate::tick::Tick;

/// Above this a reading was pressed too hard, N: 0.25 N is taught, and a hand is good to a tenth.
const HARD: f32 = 0.35;

/// A reading within this of the truth is right, mm: what examiners of studies are calibrated to.
const RIGHT: f64 = 1.0;

/// What was charted at a site, and what is true there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteResult {
    pub site: Site,
    /// mm
    pub true_depth: f64,
    /// How far the margin lies below the neckline, mm.
    pub recession: f64,
    /// `None` where depths were not read.
    pub reading: Option<Reading>,
    /// `None` where no stage asks for it.
    pub calculus_marked: Option<bool>,
    pub has_calculus: bool,
}

/// A depth as it was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Whole mm.
    pub read: u8,
    /// N
    pub force: f32,
    pub at: Tick,
}

/// The chart of a session; `None` where no stage asks for one. What was noted last at a site counts.
pub fn chart(recording: &Recording, replay: &Replay) -> Option<Vec<SiteResult>> {
    let scenario = &recording.scenario;
    let asks =
        |calculus: bool| scenario.stages.iter().any(|s| if calculus { s.chart.calculus } else { s.chart.depths });
    let gum = replay.workpiece.periodontium.as_ref().filter(|_| asks(true) || asks(false))?;
    let notes = || replay.outcome.stages.iter().flat_map(|stage| &stage.charted);
    let deposits: &[Calculus] = scenario.scene.teeth.first().map_or(&[], |tooth| &tooth.calculus);
    let result = |site: Site| {
        let here = || notes().filter(move |note| note.site == site);
        let mut reading = here().filter_map(|note| match note.what {
            Noted::Depth { read, force, .. } => Some(Reading { read, force, at: note.at }),
            Noted::Calculus => None,
        });
        SiteResult {
            site,
            true_depth: f64::from(gum.pockets.depth[site as usize]),
            recession: f64::from(gum.pockets.recession[site as usize]),
            reading: reading.next_back(),
            calculus_marked: asks(true).then(|| here().any(|note| note.what == Noted::Calculus)),
            has_calculus: deposits.iter().any(|deposit| deposit.site == site),
        }
    };
    Some(Site::ALL.into_iter().map(result).collect())
}

/// One of the measures of [`crate::scenario::metric::CHARTING`].
pub fn measure(name: &str, chart: &[SiteResult]) -> Option<f64> {
    let share = |count: usize, of: usize| (of > 0).then(|| 100.0 * count as f64 / of as f64);
    let off: Vec<f64> = chart.iter().filter_map(|s| Some(f64::from(s.reading?.read) - s.true_depth)).collect();
    let forces = || chart.iter().filter_map(|s| Some(s.reading?.force));
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0u32), |(sum, count), v| (sum + v, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    let is_asked = chart.iter().any(|s| s.calculus_marked.is_some());
    let marked = |s: &&SiteResult| s.calculus_marked == Some(true);
    match name {
        "sites_read_pct" => share(off.len(), chart.len()),
        "probing_within_1mm_pct" => share(off.iter().filter(|d| d.abs() <= RIGHT).count(), chart.len()),
        "probing_error_mm" => mean(&mut off.iter().map(|d| d.abs())),
        "probing_bias_mm" => mean(&mut off.iter().copied()),
        "probing_force_max_n" => forces().reduce(f32::max).map(f64::from),
        "probing_force_high" => {
            forces().next().is_some().then(|| forces().filter(|force| *force > HARD).count() as f64)
        }
        "calculus_found_pct" if is_asked => {
            let there = || chart.iter().filter(|s| s.has_calculus);
            share(there().filter(marked).count(), there().count())
        }
        // Where there is some and nobody noted any, it was not looked for.
        "calculus_false_alarms" if is_asked => {
            let was_looked_for = chart.iter().any(|s| marked(&s)) || !chart.iter().any(|s| s.has_calculus);
            was_looked_for.then(|| chart.iter().filter(|s| !s.has_calculus).filter(marked).count() as f64)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site(site: Site, true_depth: f64, read: Option<(u8, f32)>, marked: bool, has_calculus: bool) -> SiteResult {
        let reading = read.map(|(read, force)| Reading { read, force, at: Tick(0) });
        SiteResult { site, true_depth, recession: 0.0, reading, calculus_marked: Some(marked), has_calculus }
    }

    #[test]
    fn a_chart_is_measured_by_the_formulae_it_prints() {
        // Aim: each measure by hand. Method: three readings of six, off by 0, +2 and −1 mm.
        let chart = [
            site(Site::MesioBuccal, 3.0, Some((3, 0.2)), false, true),
            site(Site::Buccal, 2.0, Some((4, 0.6)), true, true),
            site(Site::DistoBuccal, 5.0, Some((4, 0.3)), true, false),
            site(Site::MesioLingual, 2.0, None, false, false),
            site(Site::Lingual, 2.0, None, false, false),
            site(Site::DistoLingual, 2.0, None, false, false),
        ];
        let check = |name: &str, expected: f64| {
            let found = measure(name, &chart).unwrap_or(f64::NAN);
            assert!((found - expected).abs() < 1e-6, "{name}: {found}, not {expected}");
        };
        check("sites_read_pct", 50.0);
        check("probing_within_1mm_pct", 100.0 / 3.0);
        check("probing_error_mm", 1.0);
        check("probing_bias_mm", 1.0 / 3.0);
        check("probing_force_max_n", f64::from(0.6f32));
        check("probing_force_high", 1.0);
        check("calculus_found_pct", 50.0);
        check("calculus_false_alarms", 1.0);
        let unread: Vec<SiteResult> = chart.iter().map(|s| SiteResult { reading: None, ..*s }).collect();
        for name in ["probing_error_mm", "probing_force_max_n", "probing_force_high"] {
            assert_eq!(measure(name, &unread), None, "{name}: who reads nothing is not praised for it");
        }
        let unmarked: Vec<SiteResult> =
            chart.iter().map(|s| SiteResult { calculus_marked: Some(false), ..*s }).collect();
        assert_eq!(measure("calculus_false_alarms", &unmarked), None, "nor who looks for nothing");
        let clean: Vec<SiteResult> = unmarked.iter().map(|s| SiteResult { has_calculus: false, ..*s }).collect();
        assert_eq!(measure("calculus_false_alarms", &clean), Some(0.0));
    }
}
