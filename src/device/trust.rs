//! Whether a device may be given a force: its reports come in time, and say what a hand can do.
//!
//! Takes each report's place and when it came. Gives whether it is sound, and why there is no force for now.
//! [`Trust`] is shared by the wires whose firmware judges nothing by itself, [`Nonsense`] by those behind a vendor's library.

use super::{Gone, Reading, Report, Spec, State};
use crate::frame::{Pose, Vec3};
use std::time::{Duration, Instant};

/// Reports further apart than this are late: two frames of full-speed USB's slowest hiccups, and what the relay lets pass.
const LATE: Duration = Duration::from_millis(20);

/// How long reports must have been in time again before forces come back; shorter, and a device that answers now and then
/// would kick.
const IN_TIME: Duration = Duration::from_millis(200);

/// Unsound reports, less sound ones, after which it is no device of ours: a twentieth of a second at 1 kHz, longer than a
/// burst of noise on a cable.
const UNSOUND_MAX: u32 = 50;

/// Unsound reports, less sound ones, up to which a sound one is believed. Of random numbers some look sound.
const BELIEVED: u32 = 2;

/// Fastest a hand moves, mm/s. Free reaching stays below 3 m/s; noise in a count's high byte jumps at 100 m/s.
const SPEED_MAX: f32 = 5000.0;

/// A step that is allowed however short the time was, mm: reports come in bursts.
const STEP_FREE: f32 = 10.0;

/// What is known of a device's reports so far.
#[derive(Clone, Debug)]
pub struct Trust {
    /// Farthest from the middle that the device can be, mm.
    reach: f32,
    /// The last sound report.
    last: Option<(Instant, Vec3)>,
    late_at: Option<Instant>,
    unsound: u32,
    not_ours: Gone,
}

impl Trust {
    /// `not_ours` is what to say of a device that keeps sending what cannot be.
    pub fn new(reach: f32, not_ours: &'static str) -> Trust {
        Trust { reach, last: None, late_at: None, unsound: 0, not_ours: Gone::Lost { why: not_ours, code: 0 } }
    }

    /// Judges a report that says where the tip is, world space, mm; false for one that must not be used.
    pub fn is_sound(&mut self, position: Vec3, now: Instant) -> Result<bool, Gone> {
        let is_reachable = position.is_finite() && position.length() <= self.reach;
        let is_followable = self.last.is_none_or(|(at, from)| {
            let most = STEP_FREE + SPEED_MAX * now.saturating_duration_since(at).as_secs_f32();
            position.distance(from) <= most
        });
        if !is_reachable || !is_followable {
            self.unsound()?;
            return Ok(false);
        }
        if self.last.is_some_and(|(at, _)| now.saturating_duration_since(at) > LATE) {
            self.late_at = Some(now);
        }
        self.last = Some((now, position));
        let is_believed = self.unsound <= BELIEVED;
        self.unsound = self.unsound.saturating_sub(1);
        Ok(is_believed)
    }

    /// Counts a report that is none of the protocol.
    pub fn unsound(&mut self) -> Result<(), Gone> {
        self.unsound += 1;
        if self.unsound > UNSOUND_MAX { Err(self.not_ours) } else { Ok(()) }
    }

    /// Counts a report as late that came in time but answers something old.
    pub fn stale(&mut self, now: Instant) {
        self.late_at = Some(now);
    }

    /// The next place may be anywhere: the device has been told where it is.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Whether a force may be rendered now; if not, why.
    pub fn state(&self, now: Instant) -> State {
        match self.late_at {
            Some(at) if now.saturating_duration_since(at) < IN_TIME => State::ForceOff {
                why: "its reports come too late; use another USB socket, without a hub, and close busy programs",
            },
            _ => State::Ready,
        }
    }

    /// Whether a force may be sent: the last report was sound, like those before it, and is young.
    pub fn is_fresh(&self, now: Instant) -> bool {
        let is_young = self.last.is_some_and(|(at, _)| now.saturating_duration_since(at) <= LATE);
        is_young && self.unsound == 0 && self.state(now).is_ready()
    }
}

/// Reports in a row that make no sense before a device counts as broken: about half a second.
const NONSENSE_MAX: u32 = 500;

/// The usable workspace is a box within a larger shape; so many times its half are still places an arm may be.
const WORKSPACES: f32 = 10.0;

/// The pose, if a device of this kind can be there.
pub fn sensible(pose: Pose, spec: &Spec) -> Option<Pose> {
    let is_reachable = pose.position.abs().cmple(spec.workspace_half * WORKSPACES).all();
    (is_reachable && pose.is_sound()).then_some(pose)
}

/// Poses that make no sense, one after the other, from a vendor's library that vouches for all the rest.
#[derive(Clone, Debug, Default)]
pub struct Nonsense {
    in_a_row: u32,
}

impl Nonsense {
    /// What to report in place of such a pose, until there were too many.
    pub fn refuse(&mut self) -> Result<Report, Gone> {
        self.in_a_row += 1;
        if self.in_a_row > NONSENSE_MAX {
            return Err(Gone::Lost { why: "its positions make no sense; switch it off and on again", code: 0 });
        }
        let state = State::ForceOff { why: "its positions make no sense" };
        Ok(Report { reading: Reading::ABSENT, state })
    }

    /// A pose made sense.
    pub fn forgive(&mut self) {
        self.in_a_row = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trust() -> Trust {
        Trust::new(300.0, "not ours")
    }

    #[test]
    fn a_place_that_no_hand_reaches_in_time_is_refused() {
        // Aim: one wild report costs one report, a stream of them costs the device. Method: a made-up clock.
        let (mut trust, start) = (trust(), Instant::now());
        let ms = |n| start + Duration::from_millis(n);
        assert_eq!(trust.is_sound(Vec3::X, ms(0)), Ok(true));
        assert_eq!(trust.is_sound(Vec3::X * 100.0, ms(1)), Ok(false));
        assert!(!trust.is_fresh(ms(1)));
        assert_eq!(trust.is_sound(Vec3::X * 2.0, ms(2)), Ok(true));
        assert!(trust.is_fresh(ms(2)));
        assert_eq!(trust.is_sound(Vec3::NAN, ms(3)), Ok(false));
        let gone = (0..100).find_map(|_| trust.is_sound(Vec3::X * 301.0, ms(4)).err());
        assert_eq!(gone, Some(Gone::Lost { why: "not ours", code: 0 }));
    }

    #[test]
    fn a_late_device_waits_for_its_force() {
        let (mut trust, start) = (trust(), Instant::now());
        let ms = |n| start + Duration::from_millis(n);
        assert_eq!(trust.is_sound(Vec3::ZERO, ms(0)), Ok(true));
        assert!(trust.is_fresh(ms(20)) && !trust.is_fresh(ms(21)));
        assert_eq!(trust.is_sound(Vec3::ZERO, ms(50)), Ok(true));
        assert!(!trust.is_fresh(ms(50)) && !trust.state(ms(50)).is_ready());
        for n in (60..=260).step_by(10) {
            assert_eq!(trust.is_sound(Vec3::ZERO, ms(n)), Ok(true));
        }
        assert!(trust.is_fresh(ms(260)));
    }
}
