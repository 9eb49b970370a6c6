//! A device moved by a script: reach, press, trace, wait. It closes the loop through the force it is given.
//!
//! Takes moves in world space. Gives readings as a hand would, and what was felt when a move ends. Never sees the tooth.

use super::{Device, Gone, Hand, HandModel, Output, Reading, Spec, UPRIGHT};
use crate::frame::{Pose, Vec3};
use crate::tick::TICK_S;
use std::collections::VecDeque;

/// One thing a hand does. Positions in world space, mm.
#[derive(Clone, Debug, PartialEq)]
pub enum Move {
    /// Straight to a place, in free space.
    Reach { to: Vec3, speed: f32 },
    /// Straight up to a height (world y), from wherever the hand is.
    Rise { to_height: f32, speed: f32 },
    /// From here along a direction until the force is met, then holds it for a while.
    ///
    /// Gives up after `reach` mm without meeting it.
    Press { along: Vec3, force: f32, hold: f32, reach: f32, speed: f32 },
    /// Along a path while pressing along a direction with a force.
    ///
    /// The hand leans beyond the path by as much as the force asks, within `lean` (least, most; mm); it starts at the least.
    Trace { path: Vec<Vec3>, along: Vec3, force: f32, speed: f32, lean: [f32; 2] },
    /// Along a path in matter that gives way, until a force is met along it, then holds that for a while: a probe into a pocket.
    ///
    /// Ends where the path does if nothing is met.
    Slide { path: Vec<Vec3>, force: f32, hold: f32, speed: f32 },
    /// Guides the tip that is seen on the screen along a path, leaning toward where it lags behind.
    ///
    /// The hand leans up to `lean` mm beyond the path and no harder than `force` N; where the tip does not follow it waits
    /// for up to `patience` s before it goes on. A hand that `yields` takes its lean back at once where the tip is beyond the path:
    /// what it carves is soft, and gives way suddenly.
    Guide { path: Vec<Vec3>, speed: f32, lean: f32, force: f32, patience: f32, yields: bool },
    /// Holds still for so many seconds.
    Wait { seconds: f32 },
}

/// What was felt during a move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Felt {
    /// Where the first resistance was met.
    pub touched_at: Option<Vec3>,
    /// Greatest force along the pressing direction, N.
    pub force: f32,
    /// How far beyond first touch the hand was when the move ended, along the pressing direction, mm.
    pub depth: f32,
    /// Spring felt while pressing on: slope of force over depth between a third of the force and all of it, N/mm.
    pub stiffness: Option<f32>,
}

/// Force from which a hand notices that it touches, N (perceptual threshold of the finger, about 0.05–0.1).
const NOTICE: f32 = 0.06;

/// How eagerly pressing corrects its force, mm/s per N. Above 30 it overshoots on enamel.
const PRESS_GAIN: f32 = 15.0;

/// How eagerly a guiding hand leans toward where the tip should be, 1/s. From 20 on it overshoots in soft decay.
const GUIDE_GAIN: f32 = 12.0;

/// How eagerly a hand that yields takes its lean back, 1/s. A startled hand does in 50 ms what else takes it 100.
const YIELD_GAIN: f32 = 40.0;

/// How far the tip may lag behind before a guiding hand waits for it, mm.
const GUIDE_SLACK: f32 = 0.15;

/// A reach that takes longer than this is given up, s: something is in the way.
const REACH_PATIENCE: f32 = 10.0;

/// The scripted device.
#[derive(Clone, Debug)]
pub struct Scripted {
    spec: Spec,
    hand: Hand,
    tremor: Tremor,
    /// Where the tip is on the screen.
    seen: Vec3,
    moves: VecDeque<Move>,
    now: Progress,
    felt: Option<Felt>,
}

/// The fine shaking of a hand: sines of 8 to 12 Hz, the band of physiological tremor.
#[derive(Clone, Debug)]
pub struct Tremor {
    /// mm
    amplitude: f32,
    /// One per axis and sine, radians.
    phases: [Vec3; 3],
    tick: u64,
}

impl Tremor {
    /// `amplitude`: typical excursion in mm; a steady hand has 0.02–0.05. The seed sets the phases.
    pub fn new(amplitude: f32, seed: u64) -> Tremor {
        let phase = |i: u64| {
            let mixed = (seed ^ i.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (mixed >> 40) as f32 / (1u64 << 24) as f32 * core::f32::consts::TAU
        };
        let phases = std::array::from_fn(|i| Vec3::from_array(std::array::from_fn(|a| phase((3 * i + a) as u64 + 1))));
        Tremor { amplitude, phases, tick: 0 }
    }

    fn next(&mut self) -> Vec3 {
        /// Hz, without a common period.
        const FREQUENCIES: [f32; 3] = [8.1, 9.7, 11.3];
        let seconds = self.tick as f32 * TICK_S as f32;
        self.tick += 1;
        let sines = FREQUENCIES.iter().zip(&self.phases).map(|(frequency, phase)| {
            let turn = core::f32::consts::TAU * (frequency * seconds).fract();
            Vec3::new(libm::sinf(turn + phase.x), libm::sinf(turn + phase.y), libm::sinf(turn + phase.z))
        });
        sines.sum::<Vec3>() * (self.amplitude / 3.0)
    }
}

/// How far the current move has come.
#[derive(Clone, Copy, Debug, Default)]
struct Progress {
    seconds: f32,
    /// mm along the path or the pressing direction.
    travelled: f32,
    /// Correction beyond the path, mm along the pressing direction.
    lean: f32,
    /// The same in any direction, for guiding.
    aside: Vec3,
    /// Waited for the tip at this place, s.
    waited: f32,
    started_at: Vec3,
    begun: bool,
    met: bool,
    felt: Felt,
    third: Option<(f32, f32)>,
}

impl Scripted {
    pub fn new(spec: Spec, model: HandModel, tremor: Tremor, start: Vec3) -> Scripted {
        Scripted {
            spec,
            hand: Hand::resting_at(model, start),
            tremor,
            seen: start,
            moves: VecDeque::new(),
            now: Progress::default(),
            felt: None,
        }
    }

    pub fn push(&mut self, next: Move) {
        self.moves.push_back(next);
    }

    pub fn is_idle(&self) -> bool {
        self.moves.is_empty()
    }

    /// Drops what was still to be done.
    pub fn stop(&mut self) {
        self.moves.clear();
        self.now = Progress::default();
        self.hand.goal = self.hand.position();
    }

    /// Looks at the screen: where the tip is, world space.
    pub fn see(&mut self, tip: Vec3) {
        self.seen = tip;
    }

    /// What the last finished move felt; given once.
    pub fn take_felt(&mut self) -> Option<Felt> {
        self.felt.take()
    }

    /// Where the hand is, world space.
    pub fn position(&self) -> Vec3 {
        self.hand.position()
    }

    fn advance(&mut self, force: Vec3) {
        let Some(current) = self.moves.front() else { return };
        if !self.now.begun {
            let lean = if let Move::Trace { lean, .. } = current { lean[0] } else { 0.0 };
            self.now = Progress { begun: true, started_at: self.hand.goal, lean, ..Progress::default() };
        }
        let dt = TICK_S as f32;
        let now = &mut self.now;
        now.seconds += dt;
        let done = match current {
            Move::Reach { to, speed } => {
                let way = *to - now.started_at;
                now.travelled = (now.travelled + speed * dt).min(way.length());
                self.hand.goal = now.started_at + way.normalize_or_zero() * now.travelled;
                now.travelled >= way.length() && self.hand.position().distance(*to) < 0.3
                    || now.seconds > REACH_PATIENCE
            }
            Move::Rise { to_height, speed } => {
                now.travelled += speed * dt;
                self.hand.goal.y = (now.started_at.y + now.travelled).min(to_height.max(now.started_at.y));
                self.hand.goal.y >= *to_height
            }
            Move::Press { along, force: wanted, hold, reach, speed } => {
                let resistance = now.feel(force, *along, self.hand.position(), *wanted);
                let lack = wanted - resistance;
                let step = if now.felt.touched_at.is_some() { (lack * PRESS_GAIN).min(*speed) } else { *speed };
                now.lean += step * dt;
                self.hand.goal = now.started_at + *along * now.lean;
                if lack < 0.1 * wanted && !now.met {
                    (now.met, now.seconds) = (true, 0.0);
                }
                (now.met && now.seconds >= *hold) || now.lean > *reach
            }
            Move::Slide { path, force: wanted, hold, speed } => {
                let (_, way) = point_and_way(path, now.lean.max(0.0));
                let resistance = now.feel(force, way, self.hand.position(), *wanted);
                let lack = wanted - resistance;
                let step = if resistance > NOTICE { (lack * PRESS_GAIN).min(*speed) } else { *speed };
                now.lean = (now.lean + step * dt).max(0.0);
                let (on_path, at_end) = point_along(path, now.lean);
                self.hand.goal = on_path;
                if lack < 0.1 * wanted && !now.met {
                    (now.met, now.seconds) = (true, 0.0);
                }
                (now.met && now.seconds >= *hold) || at_end
            }
            Move::Trace { path, along, force: wanted, speed, lean: [least, most] } => {
                let resistance = now.feel(force, *along, self.hand.position(), *wanted);
                now.lean += (wanted - resistance) * PRESS_GAIN * dt;
                now.lean = now.lean.clamp(*least, *most);
                now.travelled += speed * dt;
                let (on_path, at_end) = point_along(path, now.travelled);
                self.hand.goal = on_path + *along * now.lean;
                at_end
            }
            Move::Guide { path, speed, lean, force: most, patience, yields } => {
                let (on_path, at_end) = point_along(path, now.travelled);
                let lag = on_path - self.seen;
                let is_beyond = *yields && lag.dot(now.aside) < 0.0;
                let gain = if is_beyond { YIELD_GAIN } else { GUIDE_GAIN };
                now.aside = (now.aside + lag * (gain * dt)).clamp_length_max(*lean);
                if force.length() > *most {
                    now.aside *= 1.0 - 5.0 * dt;
                }
                let is_waiting = lag.length() > GUIDE_SLACK && now.waited < *patience;
                if is_waiting {
                    now.waited += dt;
                } else {
                    now.travelled += speed * dt;
                    now.waited = (now.waited - dt).max(0.0);
                }
                self.hand.goal = on_path + now.aside;
                at_end && !is_waiting
            }
            Move::Wait { seconds } => now.seconds >= *seconds,
        };
        if done {
            self.felt = Some(self.now.felt);
            self.moves.pop_front();
            self.now = Progress::default();
        }
    }
}

impl Progress {
    /// Notes what pressing along a direction meets; returns the resistance in N.
    fn feel(&mut self, force: Vec3, along: Vec3, at: Vec3, wanted: f32) -> f32 {
        let resistance = -force.dot(along);
        if resistance > NOTICE && self.felt.touched_at.is_none() {
            self.felt.touched_at = Some(at);
        }
        if let Some(touched) = self.felt.touched_at {
            self.felt.depth = (at - touched).dot(along);
            if self.third.is_none() && resistance > wanted / 3.0 {
                self.third = Some((resistance, self.felt.depth));
            }
            if let Some((f, d)) = self.third.filter(|(_, d)| self.felt.depth - d > 0.05 && !self.met) {
                self.felt.stiffness = Some((resistance - f) / (self.felt.depth - d));
            }
        }
        self.felt.force = self.felt.force.max(resistance);
        resistance
    }
}

/// The point so far along a polyline, and the way on from there.
fn point_and_way(path: &[Vec3], travelled: f32) -> (Vec3, Vec3) {
    /// Over which way a polyline's direction is taken, mm: corners are no corners to a hand.
    const OVER: f32 = 0.3;
    let (here, _) = point_along(path, travelled);
    let (ahead, _) = point_along(path, travelled + OVER);
    let (behind, _) = point_along(path, (travelled - OVER).max(0.0));
    (here, (ahead - behind).normalize_or(Vec3::NEG_Y))
}

/// The point `travelled` mm along a polyline, and whether that is its end.
fn point_along(path: &[Vec3], travelled: f32) -> (Vec3, bool) {
    let mut left = travelled;
    for pair in path.windows(2) {
        let length = pair[0].distance(pair[1]);
        if left < length {
            return (pair[0].lerp(pair[1], left / length), false);
        }
        left -= length;
    }
    (path.last().copied().unwrap_or(Vec3::ZERO), true)
}

impl Device for Scripted {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        self.advance(output.force);
        let steady = self.hand.goal;
        self.hand.goal += self.tremor.next();
        let reading = self.hand.turn(output);
        self.hand.goal = steady;
        Ok(Reading { pose: Pose { orientation: UPRIGHT, ..reading.pose }, ..reading })
    }
}
