//! Snapshot of a running session for the window: the newest tick, in a mailbox in which the newest value wins.

use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::Step;
use typodont_core::volume::Label;
use typodont_devices::servo::{AssistantTool, SecondHandRole, TimingSummary};
use typodont_exercise::score::Exceedance;

/// The newest tick, and the progress of the session. World space, mm, N, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LessonSnapshot {
    pub hand: Vec3,
    /// Orientation of the handle, `world_from_handle`.
    pub orientation: Quat,
    pub tip: Vec3,
    pub force: Vec3,
    /// The tissue that the instrument touches, if any.
    pub touch: Option<Label>,
    /// The spring's part of the force, N.
    pub spring: f32,
    pub cutting: bool,
    /// True while the hand is inside matter without force, and is to be lifted off.
    pub is_hand_blocked: bool,
    pub instrument: u32,
    pub stage_seconds: f32,
    /// Share of the decay that has been removed, %.
    pub cleared_pct: Option<f32>,
    pub timing: ServoTiming,
    /// The limit of which a warning is shown.
    pub warning: Option<LimitWarning>,
    /// The tool of an assistant, if there is one.
    pub assistant: Option<AssistantTool>,
}

/// Warning of a value above a limit of the exercise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitWarning {
    /// Index into the scenario's limits.
    pub limit: u32,
    /// Greatest value, N or mm/s.
    pub peak: f32,
}

impl From<Exceedance> for LimitWarning {
    fn from(exceedance: Exceedance) -> LimitWarning {
        LimitWarning { limit: exceedance.limit as u32, peak: exceedance.peak }
    }
}

/// Pose of the instrument in use; equal to another if the eye cannot tell them apart.
#[derive(Clone, Copy)]
pub struct InstrumentPose {
    pub index: u32,
    pub tip: Vec3,
    pub orientation: Quat,
}

impl From<&LessonSnapshot> for InstrumentPose {
    fn from(snapshot: &LessonSnapshot) -> InstrumentPose {
        InstrumentPose { index: snapshot.instrument, tip: snapshot.tip, orientation: snapshot.orientation }
    }
}

impl PartialEq for InstrumentPose {
    fn eq(&self, other: &InstrumentPose) -> bool {
        self.index == other.index
            && is_still(self.tip, other.tip)
            && 1.0 - self.orientation.dot(other.orientation).abs() < STILL_ROTATION
    }
}

/// True if a tip has moved less than can be seen; mm.
pub fn is_still(drawn: Vec3, now: Vec3) -> bool {
    drawn.distance(now) < STILL_DISTANCE
}

/// Timing of the servo, µs and counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServoTiming {
    pub ticks: u32,
    pub late_p99: u32,
    pub late_max: u32,
    pub missed: u32,
    pub dropped: u32,
}

/// Movement and rotation of an instrument that are too small to be seen: mm, and as 1 − cosine of half the angle.
const STILL_DISTANCE: f32 = 0.01;
const STILL_ROTATION: f32 = 1e-6;

/// Number of words in the mailbox.
pub const SNAPSHOT_WORDS: usize = 30;

/// Encodes an absent share.
const NO_SHARE: f32 = -1.0;

/// Encodes an absent warning.
const NO_LIMIT: u32 = u32::MAX;

impl LessonSnapshot {
    /// Pose of the instrument's tip.
    pub fn world_from_tip(&self) -> Pose {
        Pose { position: self.tip, orientation: self.orientation }
    }

    pub fn new(
        step: &Step,
        orientation: Quat,
        stage_seconds: f64,
        cleared_pct: Option<f64>,
        timing: Option<TimingSummary>,
    ) -> LessonSnapshot {
        LessonSnapshot {
            hand: step.hand,
            orientation,
            tip: step.tip,
            force: step.force,
            touch: step.touch.map(|t| t.label),
            spring: step.touch.map_or(0.0, |t| t.spring),
            cutting: step.cutting,
            is_hand_blocked: step.is_hand_blocked,
            instrument: step.instrument as u32,
            stage_seconds: stage_seconds as f32,
            cleared_pct: cleared_pct.map(|pct| pct as f32),
            timing: timing.map(ServoTiming::from).unwrap_or_default(),
            warning: None,
            assistant: None,
        }
    }

    /// True if a person would see the difference between two ticks on the screen.
    pub fn looks_different(&self, other: &LessonSnapshot) -> bool {
        /// Difference of forces that the force bar shows, N.
        const VISIBLE_FORCE: f32 = 0.05;
        InstrumentPose::from(self) != InstrumentPose::from(other)
            || (self.touch, self.cutting, self.cleared_pct) != (other.touch, other.cutting, other.cleared_pct)
            || (self.warning, self.is_hand_blocked) != (other.warning, other.is_hand_blocked)
            || (self.spring - other.spring).abs() > VISIBLE_FORCE
            || self.assistant != other.assistant
    }

    pub fn encode(&self) -> [u32; SNAPSHOT_WORDS] {
        let [a, b, c] = self.hand.to_array().map(f32::to_bits);
        let [d, e, f] = self.tip.to_array().map(f32::to_bits);
        let [g, h, i] = self.force.to_array().map(f32::to_bits);
        let [p, q, r, s] = self.orientation.to_array().map(f32::to_bits);
        let touch = self.touch.map_or(0, |label| u32::from(label.0));
        let [spring, seconds] = [self.spring, self.stage_seconds].map(f32::to_bits);
        let cleared = self.cleared_pct.unwrap_or(NO_SHARE).to_bits();
        let ServoTiming { ticks, late_p99, late_max, missed, dropped } = self.timing;
        let flags = u32::from(self.cutting) | u32::from(self.is_hand_blocked) << 1;
        let [limit, peak] = self.warning.map_or([NO_LIMIT, 0], |warning| [warning.limit, warning.peak.to_bits()]);
        let [role, at_x, at_y, at_z] = encode_assistant(self.assistant);
        [
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            h,
            i,
            touch,
            spring,
            flags,
            self.instrument,
            seconds,
            cleared,
            ticks,
            late_p99,
            late_max,
            missed,
            dropped,
            p,
            q,
            r,
            s,
            limit,
            peak,
            role,
            at_x,
            at_y,
            at_z,
        ]
    }

    pub fn decode(words: [u32; SNAPSHOT_WORDS]) -> LessonSnapshot {
        let vector = |at: usize| Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(words[at + i])));
        let cleared = f32::from_bits(words[14]);
        LessonSnapshot {
            hand: vector(0),
            orientation: Quat::from_array([20, 21, 22, 23].map(|i| f32::from_bits(words[i]))),
            tip: vector(3),
            force: vector(6),
            touch: (words[9] != 0).then_some(Label(words[9] as u8)),
            spring: f32::from_bits(words[10]),
            cutting: words[11] & 1 != 0,
            is_hand_blocked: words[11] & 2 != 0,
            instrument: words[12],
            stage_seconds: f32::from_bits(words[13]),
            cleared_pct: (cleared >= 0.0).then_some(cleared),
            timing: ServoTiming {
                ticks: words[15],
                late_p99: words[16],
                late_max: words[17],
                missed: words[18],
                dropped: words[19],
            },
            warning: (words[24] != NO_LIMIT)
                .then(|| LimitWarning { limit: words[24], peak: f32::from_bits(words[25]) }),
            assistant: decode_assistant(words[26], vector(27)),
        }
    }
}

/// Bits of an assistant's word: a suction tube, a syringe, and a pressed button.
const SUCTION: u32 = 1;
const SYRINGE: u32 = 2;
const PRESSED: u32 = 4;

fn encode_assistant(assistant: Option<AssistantTool>) -> [u32; 4] {
    let Some(AssistantTool { role, tip, is_pressed }) = assistant else { return [0; 4] };
    let tool = match role {
        SecondHandRole::Instructor => 0,
        SecondHandRole::Suction => SUCTION,
        SecondHandRole::Irrigation => SYRINGE,
    };
    let [x, y, z] = tip.to_array().map(f32::to_bits);
    [if is_pressed { tool | PRESSED } else { tool }, x, y, z]
}

fn decode_assistant(word: u32, tip: Vec3) -> Option<AssistantTool> {
    let role = match word & (SUCTION | SYRINGE) {
        SUCTION => SecondHandRole::Suction,
        SYRINGE => SecondHandRole::Irrigation,
        _ => return None,
    };
    Some(AssistantTool { role, tip, is_pressed: word & PRESSED != 0 })
}

impl From<TimingSummary> for ServoTiming {
    fn from(summary: TimingSummary) -> ServoTiming {
        let count = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        ServoTiming {
            ticks: count(summary.ticks),
            late_p99: count(summary.late_p99.as_micros() as u64),
            late_max: count(summary.late_max.as_micros() as u64),
            missed: count(summary.missed),
            dropped: count(summary.dropped_events),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_into_the_box_comes_out() {
        let seen = LessonSnapshot {
            hand: Vec3::new(1.0, -2.0, 3.5),
            orientation: Quat::from_xyzw(0.5, 0.5, -0.5, 0.5),
            tip: Vec3::new(0.1, 0.2, 0.3),
            force: Vec3::new(-0.5, 1.5, 0.25),
            touch: Some(Label(4)),
            spring: 1.25,
            cutting: true,
            is_hand_blocked: false,
            instrument: 2,
            stage_seconds: 12.5,
            cleared_pct: Some(33.0),
            timing: ServoTiming { ticks: 9, late_p99: 8, late_max: 7, missed: 6, dropped: 5 },
            warning: Some(LimitWarning { limit: 3, peak: 2.75 }),
            assistant: Some(AssistantTool {
                role: SecondHandRole::Irrigation,
                tip: Vec3::new(4.0, 5.0, -6.0),
                is_pressed: true,
            }),
        };
        assert_eq!(LessonSnapshot::decode(seen.encode()), seen);
        let nothing = LessonSnapshot {
            touch: None,
            cutting: false,
            is_hand_blocked: true,
            cleared_pct: None,
            warning: None,
            assistant: None,
            ..seen
        };
        assert_eq!(LessonSnapshot::decode(nothing.encode()), nothing);
    }
}
