//! How the work was done: force, speed and way, tick by tick.

use super::falls::{Fall, Falls};
use super::shape::Danger;
use crate::content::Role;
use crate::frame::{Pose, Vec3};
use crate::record::{Haptic, Recording};
use crate::scenario::Workpiece;
use crate::session::Session;
use crate::sim::Step;
use crate::tick::{TICK_S, Tick};
use crate::volume::{Edit, Label};

/// Ticks over which speed and way are measured: at 1 ms a coarse encoder alone reads as 55 mm/s.
const SPAN: u64 = 20;

/// Seconds of contact below which smoothness means nothing.
const SMOOTHNESS_LEAST_S: f64 = 1.0;

/// A value with the moment of its occurrence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub value: f64,
    pub at: Tick,
    /// Tooth space, mm.
    pub place: Vec3,
}

/// Highest and mean of something over ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Range {
    pub highest: Option<Moment>,
    sum: f64,
    count: u64,
}

impl Range {
    fn add(&mut self, value: f64, at: Tick, place: Vec3) {
        if self.highest.is_none_or(|h| value > h.value) {
            self.highest = Some(Moment { value, at, place });
        }
        self.sum += value;
        self.count += 1;
    }

    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// What was seen of a whole session.
#[derive(Clone, Debug)]
pub struct Seen {
    pub ticks: u64,
    pub force: Range,
    pub speed: Range,
    pub force_near: Range,
    pub speed_near: Range,
    pub path_mm: f64,
    pub drilling_ticks: u64,
    pub contact_ticks: u64,
    pub soft_ticks: u64,
    pub neighbour_ticks: u64,
    /// Ticks in which another person's hand led this one, by stage.
    pub led_ticks: Vec<u64>,
    /// Log dimensionless jerk.
    pub smoothness: Option<f64>,
    pub falls: Falls,
    pub trace: Trace,
}

/// One point of the curves in a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub at: Tick,
    /// Greatest force since the last sample, N.
    pub force: f32,
    /// mm/s
    pub speed: f32,
    /// Share of the decay gone, %.
    pub cleared: f32,
    pub touched: bool,
    pub cutting: bool,
}

/// Force, speed and the like over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Every [`Trace::SPAN_TICKS`] ticks.
    pub samples: Vec<Sample>,
}

impl Trace {
    /// Ticks from one sample to the next.
    pub const SPAN_TICKS: u64 = 100;
}

/// Watches a replay.
pub struct Watcher {
    tooth_from_world: Pose,
    roles: [Option<Role>; 256],
    turns: Vec<bool>,
    danger: Danger,
    seen: Seen,
    last_place: Option<Vec3>,
    was_touched: bool,
    now: Sample,
    /// Places of the tip in contact, every [`SPAN`] ticks, by unbroken spell of contact.
    spells: Vec<Vec<Vec3>>,
    /// Voxels that became air, in the order of time.
    fallen: Vec<(u32, Fall)>,
}

impl Watcher {
    pub fn new(recording: &Recording, workpiece: &Workpiece) -> Watcher {
        let scenario = &recording.scenario;
        let roles = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)));
        let now = Sample { at: Tick::ZERO, force: 0.0, speed: 0.0, cleared: 0.0, touched: false, cutting: false };
        Watcher {
            tooth_from_world: workpiece.world_from_tooth.inverse(),
            roles,
            turns: scenario.instruments.iter().map(|i| i.is_bur()).collect(),
            danger: Danger::around(scenario, &workpiece.volume, scenario.measures.near),
            seen: Seen {
                ticks: 0,
                force: Range::default(),
                speed: Range::default(),
                force_near: Range::default(),
                speed_near: Range::default(),
                path_mm: 0.0,
                drilling_ticks: 0,
                contact_ticks: 0,
                soft_ticks: 0,
                neighbour_ticks: 0,
                led_ticks: vec![0; scenario.stages.len()],
                smoothness: None,
                falls: Falls::default(),
                trace: Trace::default(),
            },
            last_place: None,
            was_touched: false,
            now,
            spells: Vec::new(),
            fallen: Vec::new(),
        }
    }

    pub fn see(&mut self, haptic: &Haptic, step: &Step, edits: &[Edit], session: &Session) {
        let tick = haptic.tick;
        let place = self.tooth_from_world * step.tip;
        self.seen.ticks = tick.0 + 1;
        // How the exercise or an instructor leads the hand is not how hard the trainee presses.
        let led = step.guidance + step.lead;
        let pressed = if led == Vec3::ZERO { step.force } else { step.force - led };
        let fall = Fall { at: tick, force: pressed.length(), instrument: step.instrument as u8 };
        self.fallen.extend(edits.iter().filter(|e| e.removes()).map(|e| (e.index, fall)));
        self.seen.drilling_ticks += u64::from(step.cutting);
        self.now.cutting |= step.cutting;
        self.was_touched |= step.touch.is_some();
        if step.lead != Vec3::ZERO
            && let Some((stage, _)) = session.stage()
        {
            self.seen.led_ticks[stage] += 1;
        }
        if let Some(touch) = &step.touch {
            let force = f64::from(pressed.length());
            self.seen.contact_ticks += 1;
            self.seen.force.add(force, tick, place);
            if self.danger.is_near(place) {
                self.seen.force_near.add(force, tick, place);
            }
            self.now.force = self.now.force.max(pressed.length());
            self.now.touched = true;
            let is_running = self.turns[step.instrument] && session.stage().is_some_and(|(_, s)| s.cutting);
            match self.roles[usize::from(touch.label.0)] {
                Some(Role::Soft) if is_running => self.seen.soft_ticks += 1,
                Some(Role::Neighbour) if is_running => self.seen.neighbour_ticks += 1,
                _ => {}
            }
        }
        if tick.0.is_multiple_of(SPAN) {
            self.see_span(tick, place);
        }
        if (tick.0 + 1).is_multiple_of(Trace::SPAN_TICKS) {
            let cleared = session.cleared_pct().unwrap_or(0.0) as f32;
            self.seen.trace.samples.push(Sample { at: tick.next(), cleared, ..self.now });
            self.now = Sample { force: 0.0, touched: false, cutting: false, ..self.now };
        }
    }

    /// Once every [`SPAN`] ticks: way, speed, and the track for smoothness.
    fn see_span(&mut self, tick: Tick, place: Vec3) {
        let way = self.last_place.map_or(0.0, |last| f64::from(place.distance(last)));
        let speed = way / (SPAN as f64 * TICK_S);
        self.seen.path_mm += way;
        self.now.speed = speed as f32;
        if self.was_touched && self.last_place.is_some() {
            self.seen.speed.add(speed, tick, place);
            if self.danger.is_near(place) {
                self.seen.speed_near.add(speed, tick, place);
            }
            match self.spells.last_mut() {
                Some(spell) if !spell.is_empty() => spell.push(place),
                _ => self.spells.push(vec![place]),
            }
        } else if self.spells.last().is_some_and(|s| !s.is_empty()) {
            self.spells.push(Vec::new());
        }
        self.was_touched = false;
        self.last_place = Some(place);
    }

    pub fn conclude(mut self) -> Seen {
        self.seen.falls = Falls::sorted(self.fallen);
        self.seen.smoothness = log_dimensionless_jerk(&self.spells);
        self.seen
    }
}

/// −ln(T⁵/L² · ∫|jerk|² dt) over all spells of contact (Hogan & Sternad 2009); nearer to zero is smoother.
fn log_dimensionless_jerk(spells: &[Vec<Vec3>]) -> Option<f64> {
    let dt = SPAN as f64 * TICK_S;
    let (mut seconds, mut length, mut jerk_squared) = (0.0, 0.0, 0.0);
    for spell in spells {
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
