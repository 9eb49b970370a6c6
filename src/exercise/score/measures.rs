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
use crate::scenario::metric_id::{
    FillingMetric, MetricId, ProcessMetric, RemovalDepthMetric, RemovedVolumeMetric, StageMetric, TrialMetric,
    VisibilityMetric, ZoneMetric,
};
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
        match (metric.info.id, &metric.argument) {
            (MetricId::Stage(of_stages), _) => self.of_stages(of_stages),
            (MetricId::RemovedVolume(of_volume), _) => self.of_removed_volume(of_volume).into(),
            (MetricId::RemovalDepth(of_depth), _) => self.of_removal_depth(of_depth),
            (MetricId::Process(of_process), _) => self.of_process(of_process),
            (MetricId::Visibility(of_visibility), _) => self.of_visibility(of_visibility),
            (MetricId::Filling(filling), _) => {
                self.restoration.map_or(ComputedValue::default(), |restoration| of_filling(restoration, filling))
            }
            (MetricId::Trial(trial), _) => self.of_trials(trial),
            (MetricId::Chart(reading), _) => self.chart.and_then(|chart| charting::measure(reading, chart)).into(),
            (MetricId::Zone(of_zone), Some(MetricArgument::Zone(id))) => self.of_zone(of_zone, id),
            (MetricId::SurfaceWithinTolerance, Some(MetricArgument::ToleranceMm(tolerance))) => {
                self.outline_share(*tolerance).into()
            }
            // `Metric::parse` gives each of these two its argument.
            (MetricId::Zone(_) | MetricId::SurfaceWithinTolerance, _) => ComputedValue::default(),
        }
    }

    /// Computes a measure of the stages and their questions.
    fn of_stages(&self, metric: StageMetric) -> ComputedValue {
        match metric {
            StageMetric::CuttingStageTime => self.cutting_stage().map(|s| s.ended.seconds_since(s.started)).into(),
            StageMetric::ToothDetected => self.answered_correctly(is_tooth).into(),
            StageMetric::DetectionLevel => {
                self.last_answer(is_tooth).and_then(|(_, g)| Some(f64::from(g.step?.0))).map(rounded).into()
            }
            StageMetric::ToothDetectionTime => {
                let since =
                    |(stage, given): (&StageResult, &AnswerRecord)| given.step.map_or(stage.started, |(_, at)| at);
                self.last_answer(is_tooth).map(|found| found.1.at.seconds_since(since(found))).into()
            }
            StageMetric::QuadrantDetected => self.answered_correctly(is_quadrant).into(),
            StageMetric::QuadrantDetectionTime => {
                self.last_answer(is_quadrant).map(|(stage, given)| given.at.seconds_since(stage.started)).into()
            }
            StageMetric::QuestionsRight => self.questions_right_pct().into(),
        }
    }

    /// Computes a measure of the removed volume, from numbers of voxels.
    fn of_removed_volume(&self, metric: RemovedVolumeMetric) -> Option<f64> {
        let counts = &self.comparison.counts;
        let share = |part: usize, whole: usize| (whole > 0).then(|| part as f64 / whole as f64);
        let (removed, target, both) = (counts.removed, counts.target, counts.removed_target);
        let cleared_pct = || share(counts.removed_decay, counts.decay).map(|s| 100.0 * s);
        match metric {
            RemovedVolumeMetric::DecayCleared => cleared_pct(),
            RemovedVolumeMetric::AccessibleDecayCleared => {
                let cutting = self.recording.scenario.instruments.iter().filter(|i| i.cuts);
                let radii = cutting.map(|i| i.to_instrument().head_radius());
                let smallest = radii.reduce(f32::min).unwrap_or(0.0);
                self.comparison.accessible_cleared_pct(&self.replay.workpiece.volume, smallest)
            }
            RemovedVolumeMetric::HealthyPerDecay => share(counts.removed_other, counts.decay).map(|s| 100.0 * s),
            RemovedVolumeMetric::Efficiency => {
                let drilling_ticks = self.process.drilling_ticks;
                cleared_pct().filter(|_| drilling_ticks > 0).map(|c| c / seconds(drilling_ticks))
            }
            RemovedVolumeMetric::Dice => share(2 * both, removed + target).or(Some(1.0)),
            RemovedVolumeMetric::Jaccard => share(both, removed + target - both).or(Some(1.0)),
            RemovedVolumeMetric::Precision => share(both, removed).or(Some(if target == 0 { 1.0 } else { 0.0 })),
            RemovedVolumeMetric::Recall => share(both, target).or(Some(1.0)),
        }
    }

    /// Computes a measure of distances at the removed volume.
    fn of_removal_depth(&self, metric: RemovalDepthMetric) -> ComputedValue {
        match metric {
            RemovalDepthMetric::Hausdorff => self.outline_percentile(1.0).into(),
            RemovalDepthMetric::Hausdorff95 => self.outline_percentile(0.95).into(),
            RemovalDepthMetric::OvercutDepth => self.overcut(),
            RemovalDepthMetric::UndercutDepth => self.undercut(),
            RemovalDepthMetric::PulpExposed => {
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
            RemovalDepthMetric::RemainingDentineThickness => {
                let is_floor = |s: VoxelFlags| s.removed() && !s.vulnerable();
                let nearest = self.comparison.nearest(is_floor, |s| s.vulnerable(), &self.process.removals);
                self.deepest(nearest, None)
            }
        }
    }

    /// Computes a measure of force, movement or time.
    fn of_process(&self, metric: ProcessMetric) -> ComputedValue {
        let stats = self.process;
        match metric {
            ProcessMetric::MaxForce => highest_or_zero(stats.force.highest),
            ProcessMetric::MeanForce => stats.force.mean().into(),
            ProcessMetric::MaxSpeed => stats.speed.highest.into(),
            ProcessMetric::MaxForceNearPulp => highest_or_zero(stats.force_near.highest),
            ProcessMetric::MeanForceNearPulp => stats.force_near.mean().unwrap_or(0.0).into(),
            ProcessMetric::MaxSpeedNearPulp => highest_or_zero(stats.speed_near.highest),
            ProcessMetric::PathLength => stats.path_mm.into(),
            ProcessMetric::DrillingTime => seconds(stats.drilling_ticks).into(),
            ProcessMetric::ContactTime => seconds(stats.contact_ticks).into(),
            ProcessMetric::Jerk => stats.smoothness.into(),
            ProcessMetric::SoftTissueDrilledTime => seconds(stats.soft_ticks).into(),
            ProcessMetric::NeighbourDrilledTime => seconds(stats.neighbour_ticks).into(),
            ProcessMetric::SessionTime => seconds(stats.ticks).into(),
        }
    }

    /// Computes a measure of visibility, with the first hidden removal as evidence.
    fn of_visibility(&self, metric: VisibilityMetric) -> ComputedValue {
        let Some(unseen) = &self.process.unseen else { return ComputedValue::default() };
        let is_sound =
            |voxel: &&UnseenVoxel| self.recording.scenario.tissues.role(voxel.tissue) == Some(TissueRole::Sound);
        let (first, count) = (unseen.hidden.first(), unseen.hidden.len());
        let mm3 = |count: usize| count as f64 * self.comparison.grid.voxel_mm3();
        let (value, first) = match metric {
            VisibilityMetric::UnseenShare => {
                ((unseen.judged > 0).then(|| 100.0 * count as f64 / unseen.judged as f64), first)
            }
            VisibilityMetric::UnseenVolume => (Some(mm3(count)), first),
            VisibilityMetric::UnseenSoundVolume => {
                let sound = || unseen.hidden.iter().filter(is_sound);
                (Some(mm3(sound().count())), sound().next())
            }
        };
        let evidence = first.map(|found| {
            let place = self.comparison.grid.centre(self.comparison.grid.cell(found.voxel as usize));
            Evidence { at: Some(found.at), tissue: Some(found.tissue), ..Evidence::at_place(place) }
        });
        ComputedValue { value, evidence }
    }

    /// Computes a measure of trials, for the corrected result with the first error as evidence.
    fn of_trials(&self, metric: TrialMetric) -> ComputedValue {
        let Some(trials) = &self.trials else { return ComputedValue::default() };
        let first_error = trials.first_error.filter(|_| metric == TrialMetric::Corrected);
        let evidence = first_error.map(|(at, place)| Evidence { at: Some(at), ..Evidence::at_place(place) });
        ComputedValue { value: trials.measure(metric), evidence }
    }

    /// Computes a measure of a zone.
    fn of_zone(&self, metric: ZoneMetric, zone: &str) -> ComputedValue {
        let near = || self.process.near_zones.get(zone);
        match metric {
            ZoneMetric::Removed => self.zone_removed_pct(zone),
            ZoneMetric::MaxForceNear => near().map_or(ComputedValue::default(), |n| highest_or_zero(n.force.highest)),
            ZoneMetric::MaxSpeedNear => near().map_or(ComputedValue::default(), |n| highest_or_zero(n.speed.highest)),
        }
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
        let workpiece = &self.replay.workpiece;
        let offsets = NearestOffsets::new(&self.comparison.grid, workpiece, |v| is_in(flags[v]), |v| v == voxel);
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
fn of_filling(restoration: &Restoration, metric: FillingMetric) -> ComputedValue {
    let at = |value: f64, place: Vec3| ComputedValue { value: Some(value), evidence: Some(Evidence::at_place(place)) };
    match metric {
        FillingMetric::Filled => {
            (restoration.cavity > 0).then(|| 100.0 * restoration.filled as f64 / restoration.cavity as f64).into()
        }
        FillingMetric::ContourMean => restoration.mean().into(),
        FillingMetric::ContourP95 => restoration.percentile(0.95).into(),
        FillingMetric::ContourMax => {
            let farthest = [restoration.highest(), restoration.lowest()];
            let farthest = farthest.into_iter().flatten().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            farthest.map_or(ComputedValue::default(), |(mm, place)| at(f64::from(mm.abs()), place))
        }
        FillingMetric::OverhangMax => {
            restoration.highest().map_or(ComputedValue::default(), |(mm, place)| match mm > 0.0 {
                true => at(f64::from(mm), place),
                false => 0.0.into(),
            })
        }
        FillingMetric::DeficitMax => {
            restoration.lowest().map_or(ComputedValue::default(), |(mm, place)| match mm < 0.0 {
                true => at(f64::from(-mm), place),
                false => 0.0.into(),
            })
        }
        FillingMetric::OverhangVolume => restoration.overhang_mm3.into(),
        FillingMetric::VoidVolume => restoration.void_mm3.into(),
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
