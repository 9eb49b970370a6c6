//! Every measure of a session, with its evidence.

use super::charting::{self, SiteResult};
use super::nearest_offset::{AnatomicalDirection, NearestOffsets};
use super::process::{PeakValue, ProcessStats, UnseenVoxel};
use super::removal_comparison::{RemovalComparison, VoxelDistance, VoxelFlags};
use super::restoration::Restoration;
use super::trials::{TrialSummary, tissue_felt};
use crate::catalog::TissueRole;
use crate::record::{Recording, Replay};
use crate::scenario::file::ZoneRole;
use crate::scenario::metric::{CHARTING, MetricArgument, OF_DRAWS, OF_FILLINGS, OF_VIEWS, PLAIN};
use crate::scenario::{Metric, QuestionKind, Rubric};
use crate::session::{AnswerRecord, StageResult};
use typodont_core::frame::Vec3;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::Label;

/// The measures of a session, in the order of the table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    pub all: Vec<Measure>,
}

/// One computed measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    pub metric: Metric,
    /// Value; `None` if the measure has no value by its own rule.
    pub value: Option<f64>,
    pub evidence: Option<Evidence>,
}

/// Place and time at which a value arose, and the tissue, depth and force there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    pub at: Option<Tick>,
    /// Position, tooth space, mm.
    pub place: Vec3,
    /// Tissue that was removed, left, exposed or touched there.
    pub tissue: Option<Label>,
    /// Direction from the nearest tissue to be removed; for remaining decay, from the cavity.
    pub direction: Option<AnatomicalDirection>,
    /// Distance that the value states, mm.
    pub depth: Option<f32>,
    /// Volume of the vulnerable tissue that was removed, mm³.
    pub volume: Option<f64>,
    /// Force at that tick, N.
    pub force: Option<f32>,
}

impl Evidence {
    fn at_place(place: Vec3) -> Evidence {
        Evidence { at: None, place, tissue: None, direction: None, depth: None, volume: None, force: None }
    }
}

impl Measures {
    /// Returns a measure's value by its full name; `None` if it has no value or was not computed.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.get(name).and_then(|m| m.value)
    }

    pub fn get(&self, name: &str) -> Option<&Measure> {
        self.all.iter().find(|m| m.metric.name() == name)
    }
}

/// A computed value with its evidence.
#[derive(Clone, Copy, Debug, Default)]
struct ComputedValue {
    value: Option<f64>,
    evidence: Option<Evidence>,
}

impl From<Option<f64>> for ComputedValue {
    fn from(value: Option<f64>) -> ComputedValue {
        ComputedValue { value, evidence: None }
    }
}

impl From<f64> for ComputedValue {
    fn from(value: f64) -> ComputedValue {
        ComputedValue::from(Some(value))
    }
}

impl From<Option<PeakValue>> for ComputedValue {
    fn from(moment: Option<PeakValue>) -> ComputedValue {
        let evidence = moment.map(|m| Evidence {
            at: Some(m.at),
            tissue: Some(m.tissue).filter(|tissue| *tissue != Label::AIR),
            force: Some(m.force),
            ..Evidence::at_place(m.place)
        });
        ComputedValue { value: moment.map(|m| m.value), evidence }
    }
}

/// Computes every measure of the table, and the measures with an argument that the scenario uses.
pub fn all(
    recording: &Recording,
    replay: &Replay,
    process: &ProcessStats,
    comparison: &RemovalComparison,
    restoration: Option<&Restoration>,
    chart: Option<&[SiteResult]>,
) -> Measures {
    let scenario = &recording.scenario;
    let source = MeasureSource {
        recording,
        replay,
        process,
        comparison,
        restoration,
        chart,
        trials: TrialSummary::of(scenario, &replay.workpiece, &replay.outcome),
        outlines: comparison.outline_distances(),
    };
    // Sessions without a cavity have no filling to measure, and those without a chart no readings to compare.
    let of_fillings = if restoration.is_some() { OF_FILLINGS } else { &[] };
    let charting = if chart.is_some() { CHARTING } else { &[] };
    let of_draws = if source.trials.is_some() { OF_DRAWS } else { &[] };
    let of_views = if process.unseen.is_some() { OF_VIEWS } else { &[] };
    let mut metrics: Vec<Metric> =
        PLAIN.iter().chain(of_fillings).chain(of_draws).chain(of_views).chain(charting).map(Metric::plain).collect();
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
        let ComputedValue { value, evidence } = source.compute(&metric);
        // What was touched is named as it felt; a possible site of a draw has no name for readers.
        let felt = |e: Evidence| Evidence {
            tissue: e.tissue.zip(e.at).map(|(t, at)| tissue_felt(scenario, replay, t, at)).or(e.tissue),
            ..e
        };
        Measure { metric, value, evidence: evidence.map(felt) }
    };
    Measures { all: metrics.into_iter().map(compute).collect() }
}

struct MeasureSource<'a> {
    recording: &'a Recording,
    replay: &'a Replay,
    process: &'a ProcessStats,
    comparison: &'a RemovalComparison,
    restoration: Option<&'a Restoration>,
    chart: Option<&'a [SiteResult]>,
    /// Answers of the trials; `None` without a draw.
    trials: Option<TrialSummary>,
    /// Distances between the borders of R and T, mm, ascending.
    outlines: Option<Vec<f32>>,
}

impl MeasureSource<'_> {
    fn compute(&self, metric: &Metric) -> ComputedValue {
        let name = metric.info.name;
        match (name, &metric.argument) {
            ("surface_within_tol", Some(MetricArgument::ToleranceMm(tolerance))) => {
                self.outline_share(*tolerance).into()
            }
            ("zone_removed_pct", Some(MetricArgument::Zone(id))) => self.zone_removed_pct(id),
            (_, Some(MetricArgument::Zone(id))) => match self.process.near_zones.get(id) {
                Some(near) if name == "force_max_near_n" => highest_or_zero(near.force.highest),
                Some(near) => highest_or_zero(near.speed.highest),
                None => ComputedValue::default(),
            },
            _ => self
                .of_stages(name)
                .or_else(|| self.of_removed_volume(name))
                .or_else(|| self.of_removal_depth(name))
                .or_else(|| self.of_process(name))
                .or_else(|| self.of_visibility(name))
                .unwrap_or_else(|| self.of_filling_trials_or_chart(name)),
        }
    }

    /// Computes a measure of the stages and their questions; `None` for other measures.
    fn of_stages(&self, name: &str) -> Option<ComputedValue> {
        Some(match name {
            "time_to_clear_s" => self.cutting_stage().map(|s| s.ended.seconds_since(s.started)).into(),
            "detect_tooth" => self.answered_correctly(is_tooth).into(),
            "detect_level" => {
                self.last_answer(is_tooth).and_then(|(_, g)| Some(f64::from(g.step?.0))).map(rounded).into()
            }
            "detect_level_time_s" => {
                let since =
                    |(stage, given): (&StageResult, &AnswerRecord)| given.step.map_or(stage.started, |(_, at)| at);
                self.last_answer(is_tooth).map(|found| found.1.at.seconds_since(since(found))).into()
            }
            "detect_quadrant" => self.answered_correctly(is_quadrant).into(),
            "detect_quadrant_time_s" => {
                self.last_answer(is_quadrant).map(|(stage, given)| given.at.seconds_since(stage.started)).into()
            }
            "questions_right_pct" => self.questions_right_pct().into(),
            _ => return None,
        })
    }

    /// Computes a measure of the removed volume, from numbers of voxels; `None` for other measures.
    fn of_removed_volume(&self, name: &str) -> Option<ComputedValue> {
        let counts = &self.comparison.counts;
        let share = |part: usize, whole: usize| (whole > 0).then(|| part as f64 / whole as f64);
        let (removed, target, both) = (counts.removed, counts.target, counts.removed_target);
        let cleared_pct = || share(counts.removed_decay, counts.decay).map(|s| 100.0 * s);
        Some(match name {
            "decay_cleared_pct" => cleared_pct().into(),
            "accessible_decay_cleared_pct" => {
                let cutting = self.recording.scenario.instruments.iter().filter(|i| i.cuts);
                let radii = cutting.map(|i| i.to_instrument().head_radius());
                let smallest = radii.reduce(f32::min).unwrap_or(0.0);
                self.comparison.accessible_cleared_pct(&self.replay.workpiece.volume, smallest).into()
            }
            "healthy_per_decay_pct" => share(counts.removed_other, counts.decay).map(|s| 100.0 * s).into(),
            "efficiency_pct_s" => {
                let drilling_ticks = self.process.drilling_ticks;
                cleared_pct().filter(|_| drilling_ticks > 0).map(|c| c / seconds(drilling_ticks)).into()
            }
            "dice" => share(2 * both, removed + target).unwrap_or(1.0).into(),
            "jaccard" => share(both, removed + target - both).unwrap_or(1.0).into(),
            "precision" => share(both, removed).unwrap_or(if target == 0 { 1.0 } else { 0.0 }).into(),
            "recall" => share(both, target).unwrap_or(1.0).into(),
            _ => return None,
        })
    }

    /// Computes a measure of distances at the removed volume; `None` for other measures.
    fn of_removal_depth(&self, name: &str) -> Option<ComputedValue> {
        Some(match name {
            "hausdorff_mm" => self.outline_percentile(1.0).into(),
            "hausdorff95_mm" => self.outline_percentile(0.95).into(),
            "overcut_depth_max_mm" => self.overcut(),
            "undercut_depth_max_mm" => self.undercut(),
            "pulp_exposed" => {
                let first = self.comparison.first_exposed(&self.process.removals);
                let removed_mm3 = self.comparison.removed_vulnerable() as f64 * self.comparison.grid.voxel_mm3();
                let evidence = first.map(|(voxel, removal)| Evidence {
                    at: removal.map(|r| r.at),
                    force: removal.map(|r| r.force),
                    volume: Some(removed_mm3),
                    ..self.evidence_at(voxel)
                });
                ComputedValue { value: Some(if first.is_some() { 1.0 } else { 0.0 }), evidence }
            }
            "remaining_dentine_thickness_min_mm" => {
                let is_floor = |s: VoxelFlags| s.removed() && !s.vulnerable();
                let nearest = self.comparison.nearest(is_floor, |s| s.vulnerable(), &self.process.removals);
                self.deepest(nearest, None)
            }
            _ => return None,
        })
    }

    /// Computes a measure of force, movement or time; `None` for other measures.
    fn of_process(&self, name: &str) -> Option<ComputedValue> {
        let stats = self.process;
        Some(match name {
            "force_max_n" => highest_or_zero(stats.force.highest),
            "force_mean_n" => stats.force.mean().into(),
            "speed_max_mm_s" => stats.speed.highest.into(),
            "force_max_near_pulp_n" => highest_or_zero(stats.force_near.highest),
            "force_mean_near_pulp_n" => stats.force_near.mean().unwrap_or(0.0).into(),
            "speed_max_near_pulp_mm_s" => highest_or_zero(stats.speed_near.highest),
            "path_length_mm" => stats.path_mm.into(),
            "drilling_time_s" => seconds(stats.drilling_ticks).into(),
            "contact_time_s" => seconds(stats.contact_ticks).into(),
            "jerk" => stats.smoothness.into(),
            "soft_tissue_drilled_s" => seconds(stats.soft_ticks).into(),
            "neighbour_drilled_s" => seconds(stats.neighbour_ticks).into(),
            "session_time_s" => seconds(stats.ticks).into(),
            _ => return None,
        })
    }

    /// Computes a measure of visibility, with the first hidden removal as evidence; `None` for other measures.
    fn of_visibility(&self, name: &str) -> Option<ComputedValue> {
        if !OF_VIEWS.iter().any(|about| about.name == name) {
            return None;
        }
        let Some(unseen) = &self.process.unseen else { return Some(ComputedValue::default()) };
        let is_sound =
            |voxel: &&UnseenVoxel| self.recording.scenario.tissues.role(voxel.tissue) == Some(TissueRole::Sound);
        let hidden = unseen.hidden.iter();
        let (first, count) = match name {
            "unseen_sound_cut_mm3" => (hidden.clone().find(is_sound), hidden.filter(is_sound).count()),
            _ => (unseen.hidden.first(), unseen.hidden.len()),
        };
        let value = match name {
            "unseen_cut_pct" => (unseen.judged > 0).then(|| 100.0 * count as f64 / unseen.judged as f64),
            _ => Some(count as f64 * self.comparison.grid.voxel_mm3()),
        };
        let evidence = first.map(|found| {
            let place = self.comparison.grid.centre(self.comparison.grid.cell(found.voxel as usize));
            Evidence { at: Some(found.at), tissue: Some(found.tissue), ..Evidence::at_place(place) }
        });
        Some(ComputedValue { value, evidence })
    }

    /// Computes a measure of a filling, of trials or of a periodontal chart; other measures have no value.
    fn of_filling_trials_or_chart(&self, name: &str) -> ComputedValue {
        if OF_FILLINGS.iter().any(|about| about.name == name) {
            return self.restoration.map_or(ComputedValue::default(), |r| of_filling(r, name));
        }
        if let Some(trials) = self.trials.as_ref().filter(|_| OF_DRAWS.iter().any(|about| about.name == name)) {
            let first_error = trials.first_error.filter(|_| name == "detect_corrected_pct");
            let evidence = first_error.map(|(at, place)| Evidence { at: Some(at), ..Evidence::at_place(place) });
            return ComputedValue { value: trials.measure(name), evidence };
        }
        self.chart.and_then(|chart| charting::measure(name, chart)).into()
    }

    /// Computes a zone's removed share, with the voxel of the zone that was removed first as evidence.
    fn zone_removed_pct(&self, id: &str) -> ComputedValue {
        let Some(zone) = self.recording.scenario.zones.iter().position(|z| z.id == id) else {
            return ComputedValue::default();
        };
        // Of a target, the first removed voxel says nothing about the share that was removed.
        let role = self.recording.scenario.zones[zone].role;
        let is_protected = matches!(role, ZoneRole::NeverRemove | ZoneRole::Container);
        let first = self.comparison.removed_of_zone(zone).min_by_key(|&v| (self.process.removals.at(v), v));
        let evidence = first.filter(|_| is_protected).map(|v| self.evidence_at(v));
        ComputedValue { value: self.comparison.zone_removed_pct(zone), evidence }
    }

    fn cutting_stage(&self) -> Option<&StageResult> {
        self.replay.outcome.stages.get(self.recording.scenario.cutting_stage()?)
    }

    /// Returns every question that was asked, with the result of its stage and its answer.
    fn asked(&self) -> impl Iterator<Item = (&StageResult, &QuestionKind, Option<&AnswerRecord>)> {
        let stages = self.recording.scenario.stages.iter().zip(&self.replay.outcome.stages);
        stages.flat_map(|(stage, result)| {
            let questions = stage.ask.iter().zip(&result.answers);
            questions.map(move |(question, given)| (result, &question.kind, given.as_ref()))
        })
    }

    /// Returns the questions of a kind outside of draws, whose answers have measures of their own.
    fn asked_once(
        &self,
        is_meant: fn(&QuestionKind) -> bool,
    ) -> impl Iterator<Item = (&StageResult, Option<&AnswerRecord>)> {
        let stages = self.recording.scenario.stages.iter().zip(&self.replay.outcome.stages);
        stages.filter(|(stage, _)| stage.draw.is_none()).flat_map(move |(stage, result)| {
            let questions = stage.ask.iter().zip(&result.answers);
            let meant = questions.filter(move |(question, _)| is_meant(&question.kind));
            meant.map(move |(_, given)| (result, given.as_ref()))
        })
    }

    /// Returns 1 if the last answer to questions of a kind is correct, 0 if it is incorrect or missing; `None` if no
    /// such question was asked.
    fn answered_correctly(&self, is_meant: fn(&QuestionKind) -> bool) -> Option<f64> {
        let is_asked = self.asked_once(is_meant).next().is_some();
        is_asked.then(|| self.last_answer(is_meant).map_or(0.0, |(_, given)| flag(given.correct)))
    }

    /// Returns the last answer to questions of a kind, with the result of its stage.
    fn last_answer(&self, is_meant: fn(&QuestionKind) -> bool) -> Option<(&StageResult, &AnswerRecord)> {
        self.asked_once(is_meant).filter_map(|(stage, given)| Some((stage, given?))).last()
    }

    fn questions_right_pct(&self) -> Option<f64> {
        let judged = self.asked().filter(|(_, kind, _)| kind.is_judged());
        let (right, all) = judged.fold((0u32, 0u32), |(right, all), (_, _, given)| {
            (right + u32::from(given.is_some_and(|g| g.correct == Some(true))), all + 1)
        });
        (all > 0).then(|| 100.0 * f64::from(right) / f64::from(all))
    }

    /// Returns a percentile (nearest rank) of the distances between outlines, mm; `share` is 0 to 1.
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

    fn overcut(&self) -> ComputedValue {
        let any = self.comparison.flags.iter().any(|s| s.removed() && s.sound());
        let (is_cut, is_decay) = (|s: VoxelFlags| s.removed() && s.sound(), |s: VoxelFlags| s.decay());
        let farthest = self.comparison.farthest(is_cut, is_decay, &self.process.removals);
        self.with_direction(self.deepest(farthest, if any { None } else { Some(0.0) }), farthest, is_decay)
    }

    fn undercut(&self) -> ComputedValue {
        let any = self.comparison.flags.iter().any(|s| s.decay() && !s.removed());
        let (is_left, is_removed) = (|s: VoxelFlags| s.decay() && !s.removed(), |s: VoxelFlags| s.removed());
        let farthest = self.comparison.farthest(is_left, is_removed, &self.process.removals);
        self.with_direction(self.deepest(farthest, if any { None } else { Some(0.0) }), farthest, is_removed)
    }

    fn deepest(&self, found: Option<VoxelDistance>, otherwise: Option<f64>) -> ComputedValue {
        match found {
            Some(VoxelDistance { mm, voxel }) => {
                let evidence = Evidence { depth: Some(mm), ..self.evidence_at(voxel) };
                ComputedValue { value: Some(f64::from(mm)), evidence: Some(evidence) }
            }
            None => otherwise.into(),
        }
    }

    /// Adds the direction of the farthest voxel from the set from which its distance was measured.
    fn with_direction(
        &self,
        computed: ComputedValue,
        farthest: Option<VoxelDistance>,
        is_in: impl Fn(VoxelFlags) -> bool,
    ) -> ComputedValue {
        let Some((evidence, VoxelDistance { voxel, .. })) = computed.evidence.zip(farthest) else { return computed };
        let flags = &self.comparison.flags;
        let distal = self.replay.workpiece.distal();
        let offsets = NearestOffsets::new(&self.comparison.grid, distal, |v| is_in(flags[v]), |v| v == voxel);
        let direction = offsets.of(voxel).map(|(_, direction)| direction);
        ComputedValue { evidence: Some(Evidence { direction, ..evidence }), ..computed }
    }

    fn evidence_at(&self, voxel: usize) -> Evidence {
        let grid = &self.comparison.grid;
        let removal = self.process.removals.get(voxel).filter(|_| self.comparison.flags[voxel].removed());
        Evidence {
            at: removal.map(|r| r.at),
            tissue: Some(self.replay.workpiece.volume.tissue(voxel)),
            force: removal.map(|r| r.force),
            ..Evidence::at_place(grid.centre(grid.cell(voxel)))
        }
    }
}

/// Computes a measure of a filling. The evidence of a distance is its position, without a time, since a surface results
/// from many strokes.
fn of_filling(restoration: &Restoration, name: &str) -> ComputedValue {
    let at = |value: f64, place: Vec3| ComputedValue { value: Some(value), evidence: Some(Evidence::at_place(place)) };
    match name {
        "filled_pct" if restoration.cavity > 0 => {
            (100.0 * restoration.filled as f64 / restoration.cavity as f64).into()
        }
        "contour_mean_mm" => restoration.mean().into(),
        "contour_p95_mm" => restoration.percentile(0.95).into(),
        "contour_max_mm" => {
            let farthest = [restoration.highest(), restoration.lowest()];
            let farthest = farthest.into_iter().flatten().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            farthest.map_or(ComputedValue::default(), |(mm, place)| at(f64::from(mm.abs()), place))
        }
        "overhang_max_mm" => restoration.highest().map_or(ComputedValue::default(), |(mm, place)| match mm > 0.0 {
            true => at(f64::from(mm), place),
            false => 0.0.into(),
        }),
        "deficit_max_mm" => restoration.lowest().map_or(ComputedValue::default(), |(mm, place)| match mm < 0.0 {
            true => at(f64::from(-mm), place),
            false => 0.0.into(),
        }),
        "overhang_mm3" => restoration.overhang_mm3.into(),
        "void_mm3" => restoration.void_mm3.into(),
        _ => ComputedValue::default(),
    }
}

fn is_tooth(kind: &QuestionKind) -> bool {
    matches!(kind, QuestionKind::ToothWith { .. })
}

fn is_quadrant(kind: &QuestionKind) -> bool {
    matches!(kind, QuestionKind::QuadrantOf { .. })
}

/// Returns the maximum, or 0 if the event never occurred.
fn highest_or_zero(highest: Option<PeakValue>) -> ComputedValue {
    if highest.is_none() { 0.0.into() } else { highest.into() }
}

fn flag(right: Option<bool>) -> f64 {
    if right == Some(true) { 1.0 } else { 0.0 }
}

fn seconds(ticks: u64) -> f64 {
    ticks as f64 * TICK_S
}

/// Rounds a coefficient to its written value: 0.7, not 0.699999988079071.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
