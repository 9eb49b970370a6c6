//! Every measure of a session, with its evidence.

use super::charting::{self, SiteResult};
use super::process::{Moment, Seen};
use super::restoration::Restoration;
use super::shape::{Deepest, Shape};
use crate::frame::Vec3;
use crate::record::{Recording, Replay};
use crate::scenario::metric::{About, Argument, CHARTING, OF_FILLINGS, PLAIN};
use crate::scenario::{Metric, QuestionKind, Rubric};
use crate::session::{Given, StageResult};
use crate::tick::{TICK_S, Tick};

/// The measures of a session, in the order of the table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    pub all: Vec<Measure>,
}

/// One measure, computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    pub metric: Metric,
    /// `None` where the measure's own rule says there is none.
    pub value: Option<f64>,
    pub evidence: Option<Evidence>,
}

/// Where and when a value arose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    pub at: Option<Tick>,
    /// Tooth space, mm.
    pub place: Vec3,
}

impl Measures {
    /// A measure's value by its full name; `None` when it has none or was not computed.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.get(name).and_then(|m| m.value)
    }

    pub fn get(&self, name: &str) -> Option<&Measure> {
        self.all.iter().find(|m| m.metric.name() == name)
    }
}

/// A value as it was found.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    value: Option<f64>,
    evidence: Option<Evidence>,
}

impl From<Option<f64>> for Found {
    fn from(value: Option<f64>) -> Found {
        Found { value, evidence: None }
    }
}

impl From<f64> for Found {
    fn from(value: f64) -> Found {
        Found::from(Some(value))
    }
}

impl From<Option<Moment>> for Found {
    fn from(moment: Option<Moment>) -> Found {
        let evidence = moment.map(|m| Evidence { at: Some(m.at), place: m.place });
        Found { value: moment.map(|m| m.value), evidence }
    }
}

/// Computes every measure of the table, and those with an argument that the scenario asks for.
pub fn all(
    recording: &Recording,
    replay: &Replay,
    seen: &Seen,
    shape: &Shape,
    restoration: Option<&Restoration>,
    chart: Option<&[SiteResult]>,
) -> Measures {
    let scenario = &recording.scenario;
    let source = Source { recording, replay, seen, shape, restoration, chart, outlines: shape.outline_distances() };
    // Sessions without a cavity have no filling to measure, and those without a chart none to compare.
    let of_fillings = if restoration.is_some() { OF_FILLINGS } else { &[] };
    let charting = if chart.is_some() { CHARTING } else { &[] };
    let mut metrics: Vec<Metric> = PLAIN.iter().chain(of_fillings).chain(charting).map(Metric::plain).collect();
    let zones = scenario.zones.iter().map(|z| Metric::parse(&format!("zone_removed_pct({})", z.id)));
    let tolerance = Metric::parse(&format!("surface_within_tol({})", scenario.measures.tolerance));
    metrics.extend(zones.chain([tolerance]).flatten());
    let asked = scenario.rubric.iter().flat_map(Rubric::metrics);
    for metric in asked {
        if !metrics.contains(metric) {
            metrics.push(metric.clone());
        }
    }
    let compute = |metric: Metric| {
        let Found { value, evidence } = source.find(&metric);
        Measure { metric, value, evidence }
    };
    Measures { all: metrics.into_iter().map(compute).collect() }
}

struct Source<'a> {
    recording: &'a Recording,
    replay: &'a Replay,
    seen: &'a Seen,
    shape: &'a Shape,
    restoration: Option<&'a Restoration>,
    chart: Option<&'a [SiteResult]>,
    /// Distances between the borders of R and T, ascending.
    outlines: Option<Vec<f32>>,
}

impl Source<'_> {
    fn find(&self, metric: &Metric) -> Found {
        let About { name, .. } = metric.about;
        let (counts, seen) = (&self.shape.counts, self.seen);
        let share = |part: usize, whole: usize| (whole > 0).then(|| part as f64 / whole as f64);
        let (removed, target, both) = (counts.removed, counts.target, counts.removed_target);
        match *name {
            "decay_cleared_pct" => share(counts.removed_decay, counts.decay).map(|s| 100.0 * s).into(),
            "healthy_per_decay_pct" => share(counts.removed_other, counts.decay).map(|s| 100.0 * s).into(),
            "time_to_clear_s" => self.cutting_stage().map(|s| s.ended.seconds_since(s.started)).into(),
            "detect_tooth" => self.named_rightly(is_tooth).into(),
            "detect_level" => self.search(is_tooth).and_then(|(_, g)| Some(f64::from(g.step?.0))).map(clean).into(),
            "detect_level_time_s" => {
                let since = |(stage, given): (&StageResult, &Given)| given.step.map_or(stage.started, |(_, at)| at);
                self.search(is_tooth).map(|found| found.1.at.seconds_since(since(found))).into()
            }
            "detect_quadrant" => self.named_rightly(is_quadrant).into(),
            "detect_quadrant_time_s" => {
                self.search(is_quadrant).map(|(stage, given)| given.at.seconds_since(stage.started)).into()
            }
            "questions_right_pct" => self.questions_right_pct().into(),
            "dice" => share(2 * both, removed + target).unwrap_or(1.0).into(),
            "jaccard" => share(both, removed + target - both).unwrap_or(1.0).into(),
            "precision" => share(both, removed).unwrap_or(if target == 0 { 1.0 } else { 0.0 }).into(),
            "recall" => share(both, target).unwrap_or(1.0).into(),
            "hausdorff_mm" => self.outline_percentile(1.0).into(),
            "hausdorff95_mm" => self.outline_percentile(0.95).into(),
            "surface_within_tol" => match metric.argument {
                Some(Argument::ToleranceMm(tolerance)) => self.outline_share(tolerance).into(),
                _ => Found::default(),
            },
            "overcut_depth_max_mm" => self.overcut(),
            "undercut_depth_max_mm" => self.undercut(),
            "pulp_exposed" => {
                let voxel = self.shape.exposed();
                let evidence = voxel.map(|v| self.evidence_at(v));
                Found { value: Some(if voxel.is_some() { 1.0 } else { 0.0 }), evidence }
            }
            "remaining_dentine_thickness_min_mm" => {
                self.deepest(self.shape.nearest(|s| s.removed() && !s.vulnerable(), |s| s.vulnerable()), None)
            }
            "force_max_n" => highest_or_zero(seen.force.highest),
            "force_mean_n" => seen.force.mean().into(),
            "speed_max_mm_s" => seen.speed.highest.into(),
            "force_max_near_pulp_n" => highest_or_zero(seen.force_near.highest),
            "force_mean_near_pulp_n" => seen.force_near.mean().unwrap_or(0.0).into(),
            "speed_max_near_pulp_mm_s" => highest_or_zero(seen.speed_near.highest),
            "path_length_mm" => seen.path_mm.into(),
            "drilling_time_s" => seconds(seen.drilling_ticks).into(),
            "contact_time_s" => seconds(seen.contact_ticks).into(),
            "efficiency_pct_s" => {
                let cleared = share(counts.removed_decay, counts.decay).map(|s| 100.0 * s);
                cleared.filter(|_| seen.drilling_ticks > 0).map(|c| c / seconds(seen.drilling_ticks)).into()
            }
            "jerk" => seen.smoothness.into(),
            "soft_tissue_drilled_s" => seconds(seen.soft_ticks).into(),
            "neighbour_drilled_s" => seconds(seen.neighbour_ticks).into(),
            "session_time_s" => seconds(seen.ticks).into(),
            "zone_removed_pct" => match &metric.argument {
                Some(Argument::Zone(id)) => {
                    let zone = self.recording.scenario.zones.iter().position(|z| z.id == *id);
                    zone.and_then(|z| self.shape.zone_removed_pct(z)).into()
                }
                _ => Found::default(),
            },
            name if OF_FILLINGS.iter().any(|about| about.name == name) => {
                self.restoration.map_or(Found::default(), |r| of_filling(r, name))
            }
            charting => self.chart.and_then(|chart| charting::measure(charting, chart)).into(),
        }
    }

    fn cutting_stage(&self) -> Option<&StageResult> {
        self.replay.outcome.stages.get(self.recording.scenario.cutting_stage()?)
    }

    /// Every question that was asked, with the stage's result and the answer.
    fn asked(&self) -> impl Iterator<Item = (&StageResult, &QuestionKind, Option<&Given>)> {
        let stages = self.recording.scenario.stages.iter().zip(&self.replay.outcome.stages);
        stages.flat_map(|(stage, result)| {
            let questions = stage.ask.iter().zip(&result.answers);
            questions.map(move |(question, given)| (result, &question.kind, given.as_ref()))
        })
    }

    /// 1 when the last answer of a kind is right, 0 when it is wrong or was not given; `None` when none was asked for.
    fn named_rightly(&self, is_meant: fn(&QuestionKind) -> bool) -> Option<f64> {
        let is_asked = self.asked().any(|(_, kind, _)| is_meant(kind));
        is_asked.then(|| self.search(is_meant).map_or(0.0, |(_, given)| flag(given.right)))
    }

    /// The last answered question of a kind, with its stage.
    fn search(&self, is_meant: fn(&QuestionKind) -> bool) -> Option<(&StageResult, &Given)> {
        self.asked().filter(|(_, kind, _)| is_meant(kind)).filter_map(|(stage, _, given)| Some((stage, given?))).last()
    }

    fn questions_right_pct(&self) -> Option<f64> {
        let judged = self.asked().filter(|(_, kind, _)| kind.is_judged());
        let (right, all) = judged.fold((0u32, 0u32), |(right, all), (_, _, given)| {
            (right + u32::from(given.is_some_and(|g| g.right == Some(true))), all + 1)
        });
        (all > 0).then(|| 100.0 * f64::from(right) / f64::from(all))
    }

    /// Nearest-rank percentile of the distances between outlines.
    fn outline_percentile(&self, share: f64) -> Option<f64> {
        let distances = self.outlines.as_ref()?;
        let rank = (share * distances.len() as f64).ceil() as usize;
        Some(f64::from(distances[rank.clamp(1, distances.len()) - 1]))
    }

    fn outline_share(&self, tolerance: f32) -> Option<f64> {
        let distances = self.outlines.as_ref()?;
        let within = distances.partition_point(|&d| d <= tolerance);
        Some(within as f64 / distances.len() as f64)
    }

    fn overcut(&self) -> Found {
        let any = self.shape.sets.iter().any(|s| s.removed() && s.sound());
        let farthest = self.shape.farthest(|s| s.removed() && s.sound(), |s| s.decay());
        self.deepest(farthest, if any { None } else { Some(0.0) })
    }

    fn undercut(&self) -> Found {
        let any = self.shape.sets.iter().any(|s| s.decay() && !s.removed());
        let farthest = self.shape.farthest(|s| s.decay() && !s.removed(), |s| s.removed());
        self.deepest(farthest, if any { None } else { Some(0.0) })
    }

    fn deepest(&self, found: Option<Deepest>, otherwise: Option<f64>) -> Found {
        match found {
            Some(Deepest { mm, voxel }) => {
                Found { value: Some(f64::from(mm)), evidence: Some(self.evidence_at(voxel)) }
            }
            None => otherwise.into(),
        }
    }

    fn evidence_at(&self, voxel: usize) -> Evidence {
        let grid = &self.shape.grid;
        Evidence { at: self.seen.falls.at(voxel), place: grid.centre(grid.cell(voxel)) }
    }
}

/// A measure of a filling. Of distances the place is told, not the moment: many strokes make a surface.
fn of_filling(restoration: &Restoration, name: &str) -> Found {
    let at = |value: f64, place: Vec3| Found { value: Some(value), evidence: Some(Evidence { at: None, place }) };
    match name {
        "filled_pct" if restoration.cavity > 0 => {
            (100.0 * restoration.filled as f64 / restoration.cavity as f64).into()
        }
        "contour_mean_mm" => restoration.mean().into(),
        "contour_p95_mm" => restoration.percentile(0.95).into(),
        "contour_max_mm" => {
            let farthest = [restoration.highest(), restoration.lowest()];
            let farthest = farthest.into_iter().flatten().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            farthest.map_or(Found::default(), |(mm, place)| at(f64::from(mm.abs()), place))
        }
        "overhang_max_mm" => restoration.highest().map_or(Found::default(), |(mm, place)| match mm > 0.0 {
            true => at(f64::from(mm), place),
            false => 0.0.into(),
        }),
        "deficit_max_mm" => restoration.lowest().map_or(Found::default(), |(mm, place)| match mm < 0.0 {
            true => at(f64::from(-mm), place),
            false => 0.0.into(),
        }),
        "overhang_mm3" => restoration.overhang_mm3.into(),
        "void_mm3" => restoration.void_mm3.into(),
        _ => Found::default(),
    }
}

fn is_tooth(kind: &QuestionKind) -> bool {
    matches!(kind, QuestionKind::ToothWith { .. })
}

fn is_quadrant(kind: &QuestionKind) -> bool {
    matches!(kind, QuestionKind::QuadrantOf { .. })
}

/// What never occurred was never high.
fn highest_or_zero(highest: Option<Moment>) -> Found {
    if highest.is_none() { 0.0.into() } else { highest.into() }
}

fn flag(right: Option<bool>) -> f64 {
    if right == Some(true) { 1.0 } else { 0.0 }
}

fn seconds(ticks: u64) -> f64 {
    ticks as f64 * TICK_S
}

/// A coefficient as it was written: 0.7, not 0.699999988079071.
fn clean(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
