//! The process of the work: force, speed and path, tick by tick.

use super::contact_motion::{ContactMotion, ContactTick, SPAN, SpanMotion, TissueContact};
use super::contact_spell::{ContactSpell, ContactSpells};
use super::line_of_sight::LineOfSight;
use super::removal_comparison::ProximityField;
use super::voxel_removals::{VoxelRemoval, VoxelRemovals};
use crate::catalog::TissueRole;
use crate::record::{Recording, TickRecord};
use crate::scenario::metric::MetricArgument;
use crate::scenario::{Limit, Rubric, Scenario, Workpiece, Zone};
use crate::session::{Input, Session};
use std::collections::BTreeMap;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::Step;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::{Edit, Label};

/// Time in contact below which smoothness has no meaning, s.
const SMOOTHNESS_LEAST_S: f64 = 1.0;

/// A value with the tick and the position of its occurrence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakValue {
    pub value: f64,
    pub at: Tick,
    /// Position, tooth space, mm.
    pub place: Vec3,
    /// Tissue that was touched at that tick.
    pub tissue: Label,
    /// Force at that tick, N.
    pub force: f32,
}

/// Maximum and mean of a quantity over ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunningStats {
    pub highest: Option<PeakValue>,
    sum: f64,
    count: u64,
}

impl RunningStats {
    fn add(&mut self, reached: PeakValue) {
        if self.highest.is_none_or(|h| reached.value > h.value) {
            self.highest = Some(reached);
        }
        self.sum += reached.value;
        self.count += 1;
    }

    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// Force and speed near a zone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NearZoneStats {
    pub force: RunningStats,
    pub speed: RunningStats,
}

/// Process statistics of a whole session.
#[derive(Clone, Debug)]
pub struct ProcessStats {
    pub ticks: u64,
    pub force: RunningStats,
    pub speed: RunningStats,
    pub force_near: RunningStats,
    pub speed_near: RunningStats,
    /// Force and speed near the zones for which the rubric asks, by id.
    pub near_zones: BTreeMap<String, NearZoneStats>,
    pub path_mm: f64,
    pub drilling_ticks: u64,
    pub contact_ticks: u64,
    pub soft_ticks: u64,
    pub neighbour_ticks: u64,
    /// Number of ticks in which another person guided the trainee's hand, by stage.
    pub led_ticks: Vec<u64>,
    /// Log dimensionless jerk; `None` if there was too little contact.
    pub smoothness: Option<f64>,
    pub removals: VoxelRemovals,
    pub trace: Trace,
    /// Spells in which the force on a tissue exceeded the value that still earns all points for `force_max_n`.
    pub hard_presses: Vec<ContactSpell>,
    /// Spells in which a running bur touched soft tissue or an adjacent tooth in a cutting stage.
    pub forbidden_contacts: Vec<ContactSpell>,
    /// Removals out of the trainee's sight; `None` if the recording has no view.
    pub unseen: Option<UnseenCut>,
}

/// Voxels that were removed while the trainee could not see them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnseenCut {
    /// Number of removed voxels of which it is known from where the trainee looked.
    pub judged: u64,
    /// Those of them that were hidden, in order of time.
    pub hidden: Vec<UnseenVoxel>,
}

/// A voxel that was removed out of sight, and its tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnseenVoxel {
    pub voxel: u32,
    pub at: Tick,
    pub tissue: Label,
}

/// One sample of the curves in a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSample {
    pub at: Tick,
    /// Maximum force since the last sample, N.
    pub force: f32,
    /// Speed, mm/s.
    pub speed: f32,
    /// Share of the decay removed, %.
    pub cleared: f32,
    pub touched: bool,
    pub cutting: bool,
}

/// Force, speed and progress over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Samples, one every [`Trace::SPAN_TICKS`] ticks.
    pub samples: Vec<TraceSample>,
    /// Mean forces on the instrument, N, tooth space, without those of guidance: one for every
    /// [`Trace::FORCE_TICKS`] ticks.
    pub forces: Vec<Vec3>,
    /// Orientations of the device's space, `world_from_device`, each with the tick from which it holds; the identity before
    /// the first.
    pub device_orientations: Vec<(Tick, Quat)>,
}

impl Trace {
    /// Number of ticks from one sample to the next.
    pub const SPAN_TICKS: u64 = 100;

    /// Number of ticks over which a force is averaged: whole periods of a bur's vibration (500 Hz in the thesis), and
    /// shorter than a press of the hand. 10–40 looks alike.
    pub const FORCE_TICKS: u64 = 20;

    fn add_device_orientation(&mut self, tick: Tick, world_from_device: Quat) {
        let last = self.device_orientations.last().map_or(Quat::IDENTITY, |(_, last)| *last);
        if world_from_device != last {
            self.device_orientations.push((tick, world_from_device));
        }
    }
}

/// Collects the process statistics during a replay.
pub struct ProcessObserver {
    tooth_from_world: Pose,
    motion: ContactMotion,
    roles: [Option<TissueRole>; 256],
    is_rotary: Vec<bool>,
    proximity: ProximityField,
    /// Fields of the zones for which the rubric asks, in the order of `near_zones` of the statistics.
    near_zones: Vec<ProximityField>,
    stats: ProcessStats,
    /// Everything that can hide a voxel; `None` if the recording has no view.
    sight: Option<LineOfSight>,
    /// Force above which a press is recorded, N; `None` if the rubric does not limit the force.
    force_limit: Option<f64>,
    hard_presses: ContactSpells,
    forbidden_contacts: ContactSpells,
    now: TraceSample,
    /// Sum of the forces since the last mean, N, tooth space.
    force_sum: Vec3,
    /// Positions of the tip in contact, every [`SPAN`] ticks, by uninterrupted period of contact.
    contact_runs: Vec<Vec<Vec3>>,
    /// Voxels that became air, in order of time.
    removal_log: Vec<(u32, VoxelRemoval)>,
}

impl ProcessObserver {
    pub fn new(recording: &Recording, workpiece: &Workpiece) -> ProcessObserver {
        let scenario = &recording.scenario;
        let roles = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)));
        let within = scenario.measures.pulp_proximity;
        let asked_zones = zones_near_which_is_measured(scenario);
        let field_of = |zone: &&Zone| ProximityField::around_zone(zone, scenario, &workpiece.volume, within);
        let has_views = recording.inputs.iter().any(|(_, input)| matches!(input, Input::Look(_)));
        let now = TraceSample { at: Tick::ZERO, force: 0.0, speed: 0.0, cleared: 0.0, touched: false, cutting: false };
        ProcessObserver {
            tooth_from_world: workpiece.world_from_tooth.inverse(),
            motion: ContactMotion::new(workpiece.world_from_tooth),
            roles,
            is_rotary: scenario.instruments.iter().map(|i| i.is_bur()).collect(),
            proximity: ProximityField::around_vulnerable(scenario, &workpiece.volume, within),
            near_zones: asked_zones.values().map(field_of).collect(),
            stats: ProcessStats {
                ticks: 0,
                force: RunningStats::default(),
                speed: RunningStats::default(),
                force_near: RunningStats::default(),
                speed_near: RunningStats::default(),
                near_zones: asked_zones.keys().map(|id| (id.to_string(), NearZoneStats::default())).collect(),
                path_mm: 0.0,
                drilling_ticks: 0,
                contact_ticks: 0,
                soft_ticks: 0,
                neighbour_ticks: 0,
                led_ticks: vec![0; scenario.stages.len()],
                smoothness: None,
                removals: VoxelRemovals::default(),
                trace: Trace::default(),
                hard_presses: Vec::new(),
                forbidden_contacts: Vec::new(),
                unseen: has_views.then(UnseenCut::default),
            },
            sight: has_views.then(|| LineOfSight::of(workpiece)),
            force_limit: force_limit(scenario),
            hard_presses: ContactSpells::default(),
            forbidden_contacts: ContactSpells::default(),
            now,
            force_sum: Vec3::ZERO,
            contact_runs: Vec::new(),
            removal_log: Vec::new(),
        }
    }

    pub fn observe(&mut self, haptic: &TickRecord, step: &Step, edits: &[Edit], session: &Session) {
        let tick = haptic.tick;
        let ContactTick { place, pressed, contact, span } = self.motion.observe(tick, step);
        self.stats.ticks = tick.0 + 1;
        let removal = VoxelRemoval { at: tick, force: pressed.length(), instrument: step.instrument as u8 };
        self.removal_log.extend(edits.iter().filter(|e| e.removes()).map(|e| (e.index, removal)));
        self.observe_force(tick, pressed);
        self.stats.trace.add_device_orientation(tick, step.world_from_device);
        self.observe_visibility(tick, edits, session);
        self.stats.drilling_ticks += u64::from(step.cutting);
        self.now.cutting |= step.cutting;
        if step.coupling_force != Vec3::ZERO
            && let Some((stage, _)) = session.stage()
        {
            self.stats.led_ticks[stage] += 1;
        }
        if let Some(TissueContact { tissue, force }) = contact {
            self.stats.contact_ticks += 1;
            let reached = PeakValue { value: f64::from(force), at: tick, place, tissue, force };
            self.stats.force.add(reached);
            if self.proximity.is_near(place) {
                self.stats.force_near.add(reached);
            }
            for stats in stats_near(&self.near_zones, &mut self.stats.near_zones, place) {
                stats.force.add(reached);
            }
            self.now.force = self.now.force.max(force);
            self.now.touched = true;
            // Matter too thin to have a tissue is not named.
            if tissue != Label::AIR && self.force_limit.is_some_and(|limit| f64::from(force) > limit) {
                self.hard_presses.add(tissue, tick, force, place);
            }
            let is_running = self.is_rotary[step.instrument] && session.stage().is_some_and(|(_, s)| s.cutting);
            let role = self.roles[usize::from(tissue.0)].filter(|_| is_running);
            self.stats.soft_ticks += u64::from(role == Some(TissueRole::Soft));
            self.stats.neighbour_ticks += u64::from(role == Some(TissueRole::Neighbour));
            if matches!(role, Some(TissueRole::Soft | TissueRole::Neighbour)) {
                self.forbidden_contacts.add(tissue, tick, force, place);
            }
        }
        if let Some(span) = span {
            self.observe_span(tick, place, span);
        }
        if (tick.0 + 1).is_multiple_of(Trace::SPAN_TICKS) {
            let cleared = session.cleared_pct().unwrap_or(0.0) as f32;
            self.stats.trace.samples.push(TraceSample { at: tick.next(), cleared, ..self.now });
            self.now = TraceSample { force: 0.0, touched: false, cutting: false, ..self.now };
        }
    }

    /// Averages the force on the instrument (N, world space).
    fn observe_force(&mut self, tick: Tick, pressed: Vec3) {
        self.force_sum += self.tooth_from_world.rotate(pressed);
        if (tick.0 + 1).is_multiple_of(Trace::FORCE_TICKS) {
            self.stats.trace.forces.push(self.force_sum / Trace::FORCE_TICKS as f32);
            self.force_sum = Vec3::ZERO;
        }
    }

    /// Counts the removed voxels that the trainee cannot see.
    fn observe_visibility(&mut self, at: Tick, edits: &[Edit], session: &Session) {
        let (Some(sight), Some(unseen)) = (&mut self.sight, &mut self.stats.unseen) else { return };
        sight.apply_edits(edits);
        let Some(view) = session.view() else { return };
        let view = view.transformed(&self.tooth_from_world);
        for edit in edits.iter().filter(|edit| edit.removes()) {
            unseen.judged += 1;
            if !sight.is_visible(&view, edit.index as usize) {
                unseen.hidden.push(UnseenVoxel { voxel: edit.index, at, tissue: edit.before.label });
            }
        }
    }

    /// Updates path, speed and the track for smoothness, once every [`SPAN`] ticks.
    fn observe_span(&mut self, tick: Tick, place: Vec3, span: SpanMotion) {
        let SpanMotion { length, speed, contact } = span;
        self.stats.path_mm += length;
        self.now.speed = speed as f32;
        if let Some(TissueContact { tissue, force }) = contact {
            let reached = PeakValue { value: speed, at: tick, place, tissue, force };
            self.stats.speed.add(reached);
            if self.proximity.is_near(place) {
                self.stats.speed_near.add(reached);
            }
            for stats in stats_near(&self.near_zones, &mut self.stats.near_zones, place) {
                stats.speed.add(reached);
            }
            match self.contact_runs.last_mut() {
                Some(spell) if !spell.is_empty() => spell.push(place),
                _ => self.contact_runs.push(vec![place]),
            }
        } else if self.contact_runs.last().is_some_and(|s| !s.is_empty()) {
            self.contact_runs.push(Vec::new());
        }
    }

    pub fn finish(mut self) -> ProcessStats {
        self.stats.removals = VoxelRemovals::sorted(self.removal_log);
        self.stats.smoothness = log_dimensionless_jerk(&self.contact_runs);
        self.stats.hard_presses = self.hard_presses.finish();
        self.stats.forbidden_contacts = self.forbidden_contacts.finish();
        self.stats
    }
}

/// Returns the zones of the rubric's measures of force and speed near a zone, by id.
fn zones_near_which_is_measured(scenario: &Scenario) -> BTreeMap<&str, &Zone> {
    let asked = scenario.rubric.iter().flat_map(Rubric::metrics).filter(|metric| metric.info.is_near_zone());
    let ids = asked.filter_map(|metric| match &metric.argument {
        Some(MetricArgument::Zone(id)) => Some(id),
        _ => None,
    });
    ids.filter_map(|id| scenario.zones.iter().find(|zone| zone.id == *id))
        .map(|zone| (zone.id.as_str(), zone))
        .collect()
}

/// Returns the statistics of the zones near a point in tooth space.
fn stats_near<'a>(
    fields: &'a [ProximityField],
    stats: &'a mut BTreeMap<String, NearZoneStats>,
    place: Vec3,
) -> impl Iterator<Item = &'a mut NearZoneStats> {
    fields.iter().zip(stats.values_mut()).filter(move |(field, _)| field.is_near(place)).map(|(_, stats)| stats)
}

/// Returns the greatest force that costs no points, N: the least of the rubric's values for `force_max_n`; `None` if
/// the rubric does not limit this measure.
fn force_limit(scenario: &Scenario) -> Option<f64> {
    let rubric = scenario.rubric.as_ref()?;
    let items = rubric.items.iter().map(|i| (&i.metric, i.full_at));
    let fails = rubric.hard_fails.iter().filter_map(|fail| match fail.when {
        Limit::Above(limit) => Some((&fail.metric, limit)),
        Limit::Below(_) => None,
    });
    let limits = items.chain(fails).filter(|(metric, _)| metric.info.name == "force_max_n");
    limits.map(|(_, limit)| limit).reduce(f64::min)
}

/// Returns −ln(T⁵/L² · ∫|jerk|² dt) over all periods of contact (Hogan & Sternad 2009); a value nearer to zero is
/// smoother.
fn log_dimensionless_jerk(contact_runs: &[Vec<Vec3>]) -> Option<f64> {
    let dt = SPAN as f64 * TICK_S;
    let (mut seconds, mut length, mut jerk_squared) = (0.0, 0.0, 0.0);
    for spell in contact_runs {
        seconds += spell.len() as f64 * dt;
        length += spell.windows(2).map(|w| f64::from(w[0].distance(w[1]))).sum::<f64>();
        let third = spell
            .windows(4)
            .map(|w| ((w[3] - w[2] * 3.0 + w[1] * 3.0 - w[0]).as_dvec3() / (dt * dt * dt)).length_squared());
        jerk_squared += third.sum::<f64>() * dt;
    }
    let measure = (seconds * seconds * seconds * seconds * seconds) / (length * length) * jerk_squared;
    (seconds >= SMOOTHNESS_LEAST_S && measure.is_finite() && measure > 0.0).then(|| -libm::log(measure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_stroke_beats_a_shaky_one() {
        let track = |shake: f32| -> Vec<Vec3> {
            (0..200)
                .map(|i| {
                    let t = i as f32 * 0.02;
                    Vec3::new((t * 1.5).sin() * 3.0, shake * (t * 60.0).sin(), 0.0)
                })
                .collect()
        };
        let [smooth, shaky] = [0.0, 0.05].map(|shake| log_dimensionless_jerk(&[track(shake)]));
        assert!(smooth > shaky, "{smooth:?} {shaky:?}");
        assert_eq!(log_dimensionless_jerk(&[track(0.0)[..10].to_vec()]), None);
    }
}
