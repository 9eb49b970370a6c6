//! Device driven by a script of moves: reach, press, trace, wait. The simulated hand closes the force loop.
//!
//! Takes moves in world space. Gives readings as a hand would, and the contact measured during each finished move.
//! Never reads the tooth.

use crate::device::{Device, DeviceError, DeviceSpec, HandModel, Reading, SimulatedHand, UPRIGHT, Wrench};
use crate::frame::{Pose, Vec3};
use crate::tick::TICK_S;
use std::collections::VecDeque;

/// One move of the hand. Positions are in world space, mm; speeds in mm/s; forces in N; times in s.
#[derive(Clone, Debug, PartialEq)]
pub enum Move {
    /// Moves in a straight line to a point, in free space.
    Reach { to: Vec3, speed: f32 },
    /// Moves straight up to a height (world y), from the current position.
    Rise { to_height: f32, speed: f32 },
    /// Moves along a direction until `force` is met, then holds that force for `hold` s.
    ///
    /// Gives up after `reach` mm without meeting the force.
    Press { along: Vec3, force: f32, hold: f32, reach: f32, speed: f32 },
    /// Follows a path while pressing along a direction with a force.
    ///
    /// The goal of the hand is displaced from the path along that direction by as much as the force requires, within
    /// `overtravel` (minimum and maximum, mm); the displacement starts at the minimum.
    Trace { path: Vec<Vec3>, along: Vec3, force: f32, speed: f32, overtravel: [f32; 2] },
    /// Follows a path through compliant tissue until `force` is met along the path, then holds that force for `hold`
    /// s; for example, a probe in a periodontal pocket.
    ///
    /// Ends at the end of the path if the force is not met.
    Slide { path: Vec<Vec3>, force: f32, hold: f32, speed: f32 },
    /// Guides the displayed tip along a path; the goal of the hand leads the path in the direction in which the tip
    /// lags.
    ///
    /// The lead is at most `max_lead` mm and is reduced while the force exceeds `force` N. Where the tip does not
    /// follow, the hand waits for up to `max_wait` s before it moves on. With `backs_off`, the lead is taken back
    /// quickly where the tip is beyond the path: soft tissue that is being carved gives way suddenly. With
    /// `limits_force`, the spring of the grip never pulls with more than `force`, however far the path has gone ahead
    /// (damping and impact still add to it); otherwise the lag of the tip adds to the force.
    TrackTip {
        path: Vec<Vec3>,
        speed: f32,
        max_lead: f32,
        force: f32,
        max_wait: f32,
        backs_off: bool,
        limits_force: bool,
    },
    /// Holds still for a time, s.
    Wait { seconds: f32 },
}

/// Contact measured during a move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MoveResult {
    /// Position of the hand at first contact, world space.
    pub touched_at: Option<Vec3>,
    /// Greatest force along the pressing direction, N.
    pub force: f32,
    /// Distance of the hand beyond the point of first contact when the move ended, along the pressing direction, mm.
    pub depth: f32,
    /// Stiffness measured while the force rises: slope of force over depth between a third of the force and the whole
    /// force, N/mm.
    pub stiffness: Option<f32>,
}

/// Duration of a tick, s.
const DT: f32 = TICK_S as f32;

/// Force from which contact is noticed, N (perceptual threshold of the finger, about 0.05–0.1).
const TOUCH_THRESHOLD: f32 = 0.06;

/// Gain of the force control while pressing, mm/s per N. Above 30 it overshoots on enamel.
const PRESS_GAIN: f32 = 15.0;

/// Gain with which the lead follows the lag of the tip, 1/s. From 20 on it overshoots in soft caries.
const TRACKING_GAIN: f32 = 12.0;

/// Gain with which a hand that backs off reduces its lead, 1/s. A startled hand takes 50 ms for what otherwise takes
/// 100 ms.
const BACK_OFF_GAIN: f32 = 40.0;

/// Lag of the tip beyond which the hand waits for it, mm.
const TRACKING_TOLERANCE: f32 = 0.15;

/// Duration after which a reach is abandoned, s: something is in the way.
const REACH_TIMEOUT: f32 = 10.0;

/// Device whose simulated hand carries out moves in order.
#[derive(Clone, Debug)]
pub struct ScriptedDevice {
    spec: DeviceSpec,
    hand: SimulatedHand,
    tremor: Tremor,
    /// Tip position as displayed, world space.
    observed_tip: Vec3,
    moves: VecDeque<Move>,
    progress: MoveProgress,
    last_result: Option<MoveResult>,
}

/// Physiological tremor of a hand: sines of 8 to 12 Hz.
#[derive(Clone, Debug)]
pub struct Tremor {
    /// Typical excursion, mm.
    amplitude: f32,
    /// Phases of the three sines, one per axis, rad.
    phases: [Vec3; 3],
    tick: u64,
}

impl Tremor {
    /// `amplitude`: typical excursion, mm; a steady hand has 0.02–0.05. The seed sets the phases.
    pub fn new(amplitude: f32, seed: u64) -> Tremor {
        let phase = |i: u64| {
            let mixed = (seed ^ i.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (mixed >> 40) as f32 / (1u64 << 24) as f32 * core::f32::consts::TAU
        };
        let phases = std::array::from_fn(|i| Vec3::from_array(std::array::from_fn(|a| phase((3 * i + a) as u64 + 1))));
        Tremor { amplitude, phases, tick: 0 }
    }

    fn next(&mut self) -> Vec3 {
        /// Hz; chosen without a common period.
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

/// Progress of the current move.
#[derive(Clone, Copy, Debug, Default)]
struct MoveProgress {
    seconds: f32,
    /// Distance along the path or the pressing direction, mm.
    travelled: f32,
    /// Displacement beyond the path, mm along the pressing direction.
    overtravel: f32,
    /// Displacement from the path in any direction, mm, for [`Move::TrackTip`].
    lead: Vec3,
    /// Time waited for the tip at the current point, s.
    waited: f32,
    started_at: Vec3,
    begun: bool,
    force_reached: bool,
    result: MoveResult,
    third_of_force: Option<(f32, f32)>,
}

impl ScriptedDevice {
    pub fn new(spec: DeviceSpec, model: HandModel, tremor: Tremor, start: Vec3) -> ScriptedDevice {
        ScriptedDevice {
            spec,
            hand: SimulatedHand::resting_at(model, start),
            tremor,
            observed_tip: start,
            moves: VecDeque::new(),
            progress: MoveProgress::default(),
            last_result: None,
        }
    }

    pub fn push(&mut self, next: Move) {
        self.moves.push_back(next);
    }

    pub fn is_idle(&self) -> bool {
        self.moves.is_empty()
    }

    /// Drops the current move and all that follow.
    pub fn stop(&mut self) {
        self.moves.clear();
        self.progress = MoveProgress::default();
        self.hand.goal = self.hand.position();
    }

    /// Sets the displayed tip position, world space, which [`Move::TrackTip`] follows.
    pub fn observe_tip(&mut self, tip: Vec3) {
        self.observed_tip = tip;
    }

    /// Returns the result of the last finished move, once.
    pub fn take_result(&mut self) -> Option<MoveResult> {
        self.last_result.take()
    }

    /// True position of the hand, world space, mm.
    pub fn position(&self) -> Vec3 {
        self.hand.position()
    }

    /// Advances the current move by one tick under a force of the device, N.
    fn advance(&mut self, force: Vec3) {
        let Some(current) = self.moves.front() else { return };
        if !self.progress.begun {
            self.progress = MoveProgress::begin(current, self.hand.goal);
        }
        self.progress.seconds += DT;
        let hand = SensedHand {
            force,
            position: self.hand.position(),
            goal: self.hand.goal,
            grip_stiffness: self.hand.model().grip_stiffness,
        };
        let (goal, done) = self.progress.advance(current, &hand, self.observed_tip);
        self.hand.goal = goal;
        if done {
            self.last_result = Some(self.progress.result);
            self.moves.pop_front();
            self.progress = MoveProgress::default();
        }
    }
}

/// State of the hand at the start of a tick; world space.
#[derive(Clone, Copy)]
struct SensedHand {
    /// Force of the device, N.
    force: Vec3,
    /// Position, mm.
    position: Vec3,
    /// Intended position, mm.
    goal: Vec3,
    /// N/mm.
    grip_stiffness: f32,
}

/// Force that a move seeks and then holds.
#[derive(Clone, Copy)]
struct ForceTarget {
    /// N.
    force: f32,
    /// Time for which the force is held, s.
    hold: f32,
    /// Greatest speed of the approach, mm/s.
    speed: f32,
}

impl MoveProgress {
    /// Progress at the start of a move, with the goal of the hand at that time.
    fn begin(current: &Move, started_at: Vec3) -> MoveProgress {
        let overtravel = if let Move::Trace { overtravel, .. } = current { overtravel[0] } else { 0.0 };
        MoveProgress { begun: true, started_at, overtravel, ..MoveProgress::default() }
    }

    /// Advances a move by one tick; returns the new goal of the hand, world space, mm, and true if the move is done.
    ///
    /// `tip` is the displayed tip position, world space, mm.
    fn advance(&mut self, current: &Move, hand: &SensedHand, tip: Vec3) -> (Vec3, bool) {
        match *current {
            Move::Reach { to, speed } => self.reach(hand, to, speed),
            Move::Rise { to_height, speed } => self.rise(hand, to_height, speed),
            Move::Press { along, force, hold, reach, speed } => {
                self.press(hand, along, reach, ForceTarget { force, hold, speed })
            }
            Move::Slide { ref path, force, hold, speed } => self.slide(hand, path, ForceTarget { force, hold, speed }),
            Move::Trace { ref path, along, force, speed, overtravel } => {
                let overtravel = self.trace_overtravel(hand, along, force, overtravel);
                let (on_path, at_end) = self.travel(path, speed);
                (on_path + along * overtravel, at_end)
            }
            Move::TrackTip { ref path, speed, max_lead, force, max_wait, backs_off, limits_force } => {
                let (on_path, at_end) = point_along(path, self.travelled);
                let lag = on_path - tip;
                self.lead_tip(lag, max_lead, backs_off);
                if hand.force.length() > force {
                    self.lead *= 1.0 - 5.0 * DT;
                }
                let is_waiting = self.wait_or_travel(lag, speed, max_wait);
                let mut goal = on_path + self.lead;
                if limits_force {
                    let displacement = goal - hand.position;
                    goal = hand.position + displacement.clamp_length_max(force / hand.grip_stiffness);
                }
                (goal, at_end && !is_waiting)
            }
            Move::Wait { seconds } => (hand.goal, self.seconds >= seconds),
        }
    }

    fn reach(&mut self, hand: &SensedHand, to: Vec3, speed: f32) -> (Vec3, bool) {
        let displacement = to - self.started_at;
        self.travelled = (self.travelled + speed * DT).min(displacement.length());
        let goal = self.started_at + displacement.normalize_or_zero() * self.travelled;
        let has_arrived = self.travelled >= displacement.length() && hand.position.distance(to) < 0.3;
        (goal, has_arrived || self.seconds > REACH_TIMEOUT)
    }

    fn rise(&mut self, hand: &SensedHand, to_height: f32, speed: f32) -> (Vec3, bool) {
        self.travelled += speed * DT;
        let height = (self.started_at.y + self.travelled).min(to_height.max(self.started_at.y));
        (Vec3 { y: height, ..hand.goal }, height >= to_height)
    }

    fn press(&mut self, hand: &SensedHand, along: Vec3, reach: f32, target: ForceTarget) -> (Vec3, bool) {
        let resistance = self.record_contact(hand, along, target.force);
        let has_touched = self.result.touched_at.is_some();
        self.overtravel += target.step(resistance, has_touched);
        let goal = self.started_at + along * self.overtravel;
        (goal, self.holds(resistance, target) || self.overtravel > reach)
    }

    fn slide(&mut self, hand: &SensedHand, path: &[Vec3], target: ForceTarget) -> (Vec3, bool) {
        let (_, direction) = point_and_direction(path, self.overtravel.max(0.0));
        let resistance = self.record_contact(hand, direction, target.force);
        let is_touching = resistance > TOUCH_THRESHOLD;
        self.overtravel = (self.overtravel + target.step(resistance, is_touching)).max(0.0);
        let (on_path, at_end) = point_along(path, self.overtravel);
        (on_path, self.holds(resistance, target) || at_end)
    }

    /// Returns true once a force has been reached and held long enough; the time is counted from when it is reached.
    fn holds(&mut self, resistance: f32, target: ForceTarget) -> bool {
        if target.force - resistance < 0.1 * target.force && !self.force_reached {
            (self.force_reached, self.seconds) = (true, 0.0);
        }
        self.force_reached && self.seconds >= target.hold
    }

    /// Adjusts the displacement beyond a path to a force, N, within its bounds; returns it, mm.
    fn trace_overtravel(&mut self, hand: &SensedHand, along: Vec3, force: f32, [least, most]: [f32; 2]) -> f32 {
        let resistance = self.record_contact(hand, along, force);
        self.overtravel += (force - resistance) * PRESS_GAIN * DT;
        self.overtravel = self.overtravel.clamp(least, most);
        self.overtravel
    }

    /// Moves on along a path; returns the point reached, and true if that is the end.
    fn travel(&mut self, path: &[Vec3], speed: f32) -> (Vec3, bool) {
        self.travelled += speed * DT;
        point_along(path, self.travelled)
    }

    /// Moves the lead in the direction in which the tip lags.
    fn lead_tip(&mut self, lag: Vec3, max_lead: f32, backs_off: bool) {
        let is_beyond = backs_off && lag.dot(self.lead) < 0.0;
        let gain = if is_beyond { BACK_OFF_GAIN } else { TRACKING_GAIN };
        self.lead = (self.lead + lag * (gain * DT)).clamp_length_max(max_lead);
    }

    /// Moves on along the path unless the tip lags too far; returns true while the hand waits for it.
    fn wait_or_travel(&mut self, lag: Vec3, speed: f32, max_wait: f32) -> bool {
        let is_waiting = lag.length() > TRACKING_TOLERANCE && self.waited < max_wait;
        if is_waiting {
            self.waited += DT;
        } else {
            self.travelled += speed * DT;
            self.waited = (self.waited - DT).max(0.0);
        }
        is_waiting
    }

    /// Records the contact met while pressing along a direction; returns the resistance, N.
    fn record_contact(&mut self, hand: &SensedHand, along: Vec3, wanted: f32) -> f32 {
        let (at, resistance) = (hand.position, -hand.force.dot(along));
        if resistance > TOUCH_THRESHOLD && self.result.touched_at.is_none() {
            self.result.touched_at = Some(at);
        }
        if let Some(touched) = self.result.touched_at {
            self.result.depth = (at - touched).dot(along);
            if self.third_of_force.is_none() && resistance > wanted / 3.0 {
                self.third_of_force = Some((resistance, self.result.depth));
            }
            if let Some((f, d)) =
                self.third_of_force.filter(|(_, d)| self.result.depth - d > 0.05 && !self.force_reached)
            {
                self.result.stiffness = Some((resistance - f) / (self.result.depth - d));
            }
        }
        self.result.force = self.result.force.max(resistance);
        resistance
    }
}

impl ForceTarget {
    /// Displacement of the goal toward the force within one tick, mm; at full speed until there is contact.
    fn step(&self, resistance: f32, is_touching: bool) -> f32 {
        let speed = if is_touching { ((self.force - resistance) * PRESS_GAIN).min(self.speed) } else { self.speed };
        speed * DT
    }
}

/// Returns the point `travelled` mm along a polyline, and its smoothed direction there.
fn point_and_direction(path: &[Vec3], travelled: f32) -> (Vec3, Vec3) {
    /// Half the length over which the direction is taken, mm: a hand rounds off corners.
    const HALF_SPAN: f32 = 0.3;
    let (here, _) = point_along(path, travelled);
    let (ahead, _) = point_along(path, travelled + HALF_SPAN);
    let (behind, _) = point_along(path, (travelled - HALF_SPAN).max(0.0));
    (here, (ahead - behind).normalize_or(Vec3::NEG_Y))
}

/// Returns the point `travelled` mm along a polyline, and true if that is its end.
fn point_along(path: &[Vec3], travelled: f32) -> (Vec3, bool) {
    let mut remaining = travelled;
    for pair in path.windows(2) {
        let length = pair[0].distance(pair[1]);
        if remaining < length {
            return (pair[0].lerp(pair[1], remaining / length), false);
        }
        remaining -= length;
    }
    (path.last().copied().unwrap_or(Vec3::ZERO), true)
}

impl Device for ScriptedDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.advance(output.force);
        let steady = self.hand.goal;
        self.hand.goal += self.tremor.next();
        let reading = self.hand.step(output);
        self.hand.goal = steady;
        Ok(Reading { pose: Pose { orientation: UPRIGHT, ..reading.pose }, ..reading })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_limits_its_force_waits_at_a_wall() {
        // Aim: however long a bur is held up, the hand presses with the force of its file, and with more without the limit.
        // Method: a path of 12 mm into a stiff wall at its start, followed to its end.
        let pressed = |limits_force: bool| -> f32 {
            let model = HandModel::holding(0.045, 0.0);
            let mut device = ScriptedDevice::new(DeviceSpec::phantom_omni(), model, Tremor::new(0.0, 1), Vec3::ZERO);
            device.push(Move::TrackTip {
                path: vec![Vec3::ZERO, Vec3::new(0.0, -12.0, 0.0)],
                speed: 4.0,
                max_lead: 4.0,
                force: 1.5,
                max_wait: 0.2,
                backs_off: false,
                limits_force,
            });
            let mut last = Wrench::default();
            for _ in 0..2500 {
                let reading = device.exchange(&last).unwrap();
                let depth = (-reading.pose.position.y).max(0.0);
                last = Wrench { force: Vec3::Y * (2.0 * depth), ..Wrench::default() };
                device.observe_tip(Vec3::ZERO);
            }
            last.force.y
        };
        assert!((pressed(true) - 1.5).abs() < 0.05, "{}", pressed(true));
        assert!(pressed(false) > 2.0, "{}", pressed(false));
    }
}
