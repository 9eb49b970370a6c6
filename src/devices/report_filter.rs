//! Validity and timeliness checks on a device's reports, which decide whether it may be given a force.
//!
//! Takes the position in each report and its time of arrival. Gives whether the report is valid, and the reason if
//! forces are off for now, for protocols whose firmware checks nothing itself. Never reads a clock: the caller passes the
//! time.

use typodont_core::device::{DeviceError, DeviceState};
use typodont_core::frame::Vec3;
use web_time::{Duration, Instant};

/// Interval between two reports above which the later one is late: covers the longest delays of full-speed USB, and
/// equals the time for which the relay repeats the last report.
const LATE_AFTER: Duration = Duration::from_millis(20);

/// Time for which reports must have been on time before forces return. With a shorter time, a device that answers
/// only now and then would kick.
const RECOVERY_TIME: Duration = Duration::from_millis(200);

/// Limit of the error count, which rises by one with each invalid report and falls by one with each valid one. Above it
/// the device counts as lost: 0.05 s of reports at 1 kHz, longer than a burst of noise on a cable.
const MAX_INVALID: u32 = 50;

/// Invalid reports, minus valid ones, up to which a valid one is used. Random numbers can look valid.
const MAX_INVALID_TRUSTED: u32 = 2;

/// Maximum speed of a hand, mm/s. Free reaching stays below 3 m/s; noise in the high byte of a counter jumps at 100
/// m/s.
const SPEED_MAX: f32 = 5000.0;

/// Displacement between two reports that is always accepted, mm, however short the interval: reports arrive in
/// bursts.
const STEP_FREE: f32 = 10.0;

/// State of the checks on one device's reports.
#[derive(Clone, Debug)]
pub struct ReportFilter {
    /// Maximum distance from the origin of world space that the device can reach, mm.
    max_distance: f32,
    /// Time and position of the last valid report; world space, mm.
    last: Option<(Instant, Vec3)>,
    late_at: Option<Instant>,
    invalid_count: u32,
    error: DeviceError,
}

impl ReportFilter {
    /// Creates a filter without history. `max_distance` is the reach from the origin, mm; `reason` is the error text
    /// for a device that keeps sending invalid reports.
    pub fn new(max_distance: f32, reason: &'static str) -> ReportFilter {
        ReportFilter {
            max_distance,
            last: None,
            late_at: None,
            invalid_count: 0,
            error: DeviceError::Lost { why: reason, code: 0 },
        }
    }

    /// Checks a report with the tip at `position` (world space, mm); returns false if the report must not be used.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] after too many invalid reports.
    pub fn accept(&mut self, position: Vec3, now: Instant) -> Result<bool, DeviceError> {
        let is_reachable = position.is_finite() && position.length() <= self.max_distance;
        let is_followable = self.last.is_none_or(|(at, from)| {
            let most = STEP_FREE + SPEED_MAX * now.saturating_duration_since(at).as_secs_f32();
            position.distance(from) <= most
        });
        if !is_reachable || !is_followable {
            self.count_invalid()?;
            return Ok(false);
        }
        if self.last.is_some_and(|(at, _)| now.saturating_duration_since(at) > LATE_AFTER) {
            self.late_at = Some(now);
        }
        self.last = Some((now, position));
        let is_believed = self.invalid_count <= MAX_INVALID_TRUSTED;
        self.invalid_count = self.invalid_count.saturating_sub(1);
        Ok(is_believed)
    }

    /// Counts a report that does not follow the protocol.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] after too many invalid reports.
    pub fn count_invalid(&mut self) -> Result<(), DeviceError> {
        self.invalid_count += 1;
        if self.invalid_count > MAX_INVALID { Err(self.error) } else { Ok(()) }
    }

    /// Marks the device as late: the report arrived in time but answers an old request.
    pub fn mark_late(&mut self, now: Instant) {
        self.late_at = Some(now);
    }

    /// Accepts any next position: the device has just been given a new reference position.
    pub fn forget_position(&mut self) {
        self.last = None;
    }

    /// Returns whether a force may be rendered now and, if not, why.
    pub fn state(&self, now: Instant) -> DeviceState {
        match self.late_at {
            Some(at) if now.saturating_duration_since(at) < RECOVERY_TIME => DeviceState::ForceOff {
                why: "its reports arrive too late; use another USB port without a hub, and close busy programs",
            },
            _ => DeviceState::Ready,
        }
    }

    /// Returns whether a force may be sent: the last report was valid, so were those before it, and it is recent.
    pub fn is_fresh(&self, now: Instant) -> bool {
        let is_young = self.last.is_some_and(|(at, _)| now.saturating_duration_since(at) <= LATE_AFTER);
        is_young && self.invalid_count == 0 && self.state(now).is_ready()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filter() -> ReportFilter {
        ReportFilter::new(300.0, "not ours")
    }

    #[test]
    fn a_position_that_no_hand_reaches_in_time_is_refused() {
        // Aim: one invalid report costs one report, a stream of them costs the device. Method: an artificial clock.
        let (mut filter, start) = (filter(), Instant::now());
        let ms = |n| start + Duration::from_millis(n);
        assert_eq!(filter.accept(Vec3::X, ms(0)), Ok(true));
        assert_eq!(filter.accept(Vec3::X * 100.0, ms(1)), Ok(false));
        assert!(!filter.is_fresh(ms(1)));
        assert_eq!(filter.accept(Vec3::X * 2.0, ms(2)), Ok(true));
        assert!(filter.is_fresh(ms(2)));
        assert_eq!(filter.accept(Vec3::NAN, ms(3)), Ok(false));
        let gone = (0..100).find_map(|_| filter.accept(Vec3::X * 301.0, ms(4)).err());
        assert_eq!(gone, Some(DeviceError::Lost { why: "not ours", code: 0 }));
    }

    #[test]
    fn a_late_device_gets_no_force_until_it_recovers() {
        let (mut filter, start) = (filter(), Instant::now());
        let ms = |n| start + Duration::from_millis(n);
        assert_eq!(filter.accept(Vec3::ZERO, ms(0)), Ok(true));
        assert!(filter.is_fresh(ms(20)) && !filter.is_fresh(ms(21)));
        assert_eq!(filter.accept(Vec3::ZERO, ms(50)), Ok(true));
        assert!(!filter.is_fresh(ms(50)) && !filter.state(ms(50)).is_ready());
        for n in (60..=260).step_by(10) {
            assert_eq!(filter.accept(Vec3::ZERO, ms(n)), Ok(true));
        }
        assert!(filter.is_fresh(ms(260)));
    }
}
