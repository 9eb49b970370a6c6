//! An arm over HID: six encoders in, three motor currents out.
//!
//! Takes a force in world space. Gives the pose computed from the encoders. The arm answers each report with one of
//! its own and stops its motors half a second after the last one. Never sends a current while the reports are late or
//! invalid.

use crate::hid::{REPORT_MAX, Transport};
use crate::polhem::geometry::ArmConfig;
use crate::polhem::{orientation_to_world, to_arm, to_world};
use crate::report_filter::ReportFilter;
use crate::{DeviceReport, Protocol};
use typodont_core::device::{DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use web_time::{Duration, Instant};

/// Maximum current that the firmware accepts, mA; its own limit is 3 A.
const CURRENT_MAX: f64 = 1999.0;

/// Time for which one exchange waits for the answer to its report.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(10);

/// Time without an answer after which a report counts as lost and another one is sent. Sending more often would let a
/// slow arm answer in time, but to an old report.
const LOST_AFTER: Duration = Duration::from_millis(100);

/// Time after the last report at which the arm stops its motors.
const MOTOR_STOP_TIME: Duration = Duration::from_millis(500);

/// Length of encoders and `info`, the used bytes of a report of any length.
const ENCODER_BYTES: usize = 14;

/// Offset of the fourth encoder while the button is down; the encoder itself stays within half of it.
const BUTTON_OFFSET: i16 = 10_000;

/// Reach of arm and wrist from the middle of the workspace, mm: links of 0.45 m and the offset of the origin.
const MAX_DISTANCE: f32 = 700.0;

/// Value of `info` while the arm does not know the positions of its encoders.
const ASKS_FOR_CALIBRATION: i16 = 1;

const CURRENTS: i16 = 0;
const PRESET: i16 = 1;

const CALIBRATE: DeviceState = DeviceState::Calibrate {
    how: "hold the arm with its upper link upright and its forearm level, toward you, then press the stylus button",
};

/// Returns the length in bytes of a report to the arm, with its id byte: 1 + 64 for a Teensy, 1 + 14 for an mbed board.
pub fn report_length(vendor: u16) -> usize {
    if vendor == 0x1234 { 15 } else { 65 }
}

/// Protocol of an arm on a transport.
pub struct HidArm<T> {
    transport: T,
    config: &'static ArmConfig,
    report_length: usize,
    spec: DeviceSpec,
    filter: ReportFilter,
    /// The last valid report; `None` before the first one, which only an all-zero report triggers.
    last_report: Option<EncoderReport>,
    was_pressed: bool,
    /// Time at which the report was sent that the arm has not answered.
    sent_at: Option<Instant>,
    /// The arm was late, and a report without force has been sent.
    is_silenced: bool,
}

/// Parsed report of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct EncoderReport {
    joints: [i16; 3],
    wrist: [i16; 3],
    is_pressed: bool,
    asks_for_calibration: bool,
}

impl<T: Transport> HidArm<T> {
    pub fn new(transport: T, config: &'static ArmConfig, report_length: usize) -> HidArm<T> {
        let filter =
            ReportFilter::new(MAX_DISTANCE, "its reports are not those of a Polhem; is it another device on a Teensy?");
        let spec = spec(config);
        HidArm {
            transport,
            config,
            report_length,
            spec,
            filter,
            last_report: None,
            was_pressed: false,
            sent_at: None,
            is_silenced: false,
        }
    }

    /// Sends currents and a command, or a preset.
    fn send_words(&mut self, words: [i16; 7]) -> Result<(), DeviceError> {
        let mut report = [0; REPORT_MAX];
        for (two, word) in report[1..].chunks_exact_mut(2).zip(words) {
            two.copy_from_slice(&word.to_le_bytes());
        }
        self.transport.write(&report[..self.report_length])
    }

    /// Returns the currents for a force, mA; zero while the reports are not trusted.
    fn currents(&self, output: &Wrench, now: Instant) -> [i16; 3] {
        let Some(encoders) = self.last_report.filter(|h| !h.asks_for_calibration && self.filter.is_fresh(now)) else {
            return [0; 3];
        };
        let force = to_arm(output.force.clamp_length_max(self.spec.max_force));
        if !force.is_finite() {
            return [0; 3];
        }
        let angles = self.config.angles(encoders.joints);
        let amperes = self.config.currents(angles, force.to_array().map(f64::from));
        // All three are scaled alike: limiting only one would change the direction of the force.
        let most = amperes.iter().fold(0.0, |most: f64, a| most.max(a.abs() * 1000.0));
        let share = if most > CURRENT_MAX { CURRENT_MAX / most } else { 1.0 };
        amperes.map(|a| (a * 1000.0 * share).round() as i16)
    }

    /// Sends the encoder presets to an uncalibrated arm when the user confirms its position with the button.
    fn calibrate(&mut self, encoders: EncoderReport) -> Result<(), DeviceError> {
        let is_confirmed = encoders.is_pressed && !self.was_pressed;
        self.was_pressed = encoders.is_pressed;
        if encoders.asks_for_calibration && is_confirmed {
            self.filter.forget_position();
            // The presets d e f replace the currents; a b c follow the command.
            self.send_words([0, 0, 0, PRESET, 0, 0, self.config.preset_c])?;
        }
        Ok(())
    }

    fn reading(&self, encoders: EncoderReport) -> Reading {
        let EncoderReport { joints, wrist, is_pressed, .. } = encoders;
        let angles = self.config.angles(joints);
        let [x, y, z] = self.config.position(angles).map(|metres| (metres * 1000.0) as f32);
        let orientation = match self.config.has_wrist() {
            true => {
                let [a, c, d, e, f] = self.config.handle_rotations(angles, wrist).map(|angle| angle as f32);
                let fore = Quat::from_rotation_z(a) * Quat::from_rotation_y(c);
                let hand = Quat::from_rotation_x(d) * Quat::from_rotation_y(e) * Quat::from_rotation_x(f);
                orientation_to_world((fore * hand).normalize())
            }
            false => UPRIGHT,
        };
        Reading { pose: Pose { position: to_world(Vec3::new(x, y, z)), orientation }, buttons: is_pressed.into() }
    }
}

impl<T: Transport> Protocol for HidArm<T> {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Device
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        let now = Instant::now();
        if self.sent_at.is_none_or(|at| now.saturating_duration_since(at) > LOST_AFTER) {
            let [a, b, c] = if self.sent_at.is_none() { self.currents(output, now) } else { [0; 3] };
            self.send_words([a, b, c, CURRENTS, 0, 0, 0])?;
            self.sent_at = Some(now);
        }
        let mut report = [0; REPORT_MAX];
        let length = self.transport.read_newest(&mut report, ANSWER_TIMEOUT)?;
        if length == 0 {
            if !std::mem::replace(&mut self.is_silenced, true) {
                self.send_words([0; 7])?;
            }
            return Ok(None);
        }
        (self.sent_at, self.is_silenced) = (None, false);
        let Some(encoders) = EncoderReport::parse(&report[..length]) else {
            self.filter.count_invalid()?;
            return Ok(None);
        };
        let reading = self.reading(encoders);
        let now = Instant::now();
        if !self.filter.accept(reading.pose.position, now)? {
            return Ok(None);
        }
        self.last_report = Some(encoders);
        self.calibrate(encoders)?;
        let state = if encoders.asks_for_calibration { CALIBRATE } else { self.filter.state(now) };
        Ok(Some(DeviceReport { reading, state }))
    }

    fn release_time(&self) -> Option<Duration> {
        Some(MOTOR_STOP_TIME)
    }

    fn close(&mut self) {
        // If the arm does not receive this, its motors are off already.
        let _ = self.send_words([0; 7]);
    }
}

impl EncoderReport {
    /// Returns `None` for a report that is too short.
    fn parse(report: &[u8]) -> Option<EncoderReport> {
        let mut words = report.get(..ENCODER_BYTES)?.chunks_exact(2).map(|two| i16::from_le_bytes([two[0], two[1]]));
        let [a, b, c, mut d, e, f, info] = std::array::from_fn(|_| words.next().unwrap_or(0));
        let is_pressed = d > BUTTON_OFFSET / 2;
        if is_pressed {
            d = d.saturating_sub(BUTTON_OFFSET);
        }
        // The encoders of the wrist are wired in reverse order.
        let wrist = [f, e, d];
        Some(EncoderReport { joints: [a, b, c], wrist, is_pressed, asks_for_calibration: info == ASKS_FOR_CALIBRATION })
    }
}

fn spec(config: &ArmConfig) -> DeviceSpec {
    DeviceSpec {
        name: config.name.into(),
        max_force: config.max_force as f32,
        // Not published; a quarter, as other arms with motors of this size hold for hours.
        continuous_force: config.max_force as f32 / 4.0,
        max_torque: 0.0,
        max_stiffness: config.max_stiffness as f32 / 1000.0,
        max_damping: config.max_damping as f32 / 1000.0,
        resolution: config.resolution() as f32 * 1000.0,
        // Other toolkits state a radius of 100 mm; this is the box within that sphere.
        workspace_half: Vec3::splat(57.0),
        // Not published either; an estimate for plywood links and capstans without gears.
        apparent_mass: 0.1,
        page_force: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(words: [i16; 7]) -> [u8; 64] {
        let mut bytes = [0; 64];
        bytes.chunks_exact_mut(2).zip(words).for_each(|(two, w)| two.copy_from_slice(&w.to_le_bytes()));
        bytes
    }

    #[test]
    fn the_button_is_removed_from_the_fourth_encoder() {
        let parsed = |d| EncoderReport::parse(&report([1, 2, 3, d, 5, 6, 0])).unwrap();
        assert_eq!((parsed(-300).wrist, parsed(-300).is_pressed), ([6, 5, -300], false));
        assert_eq!((parsed(9700).wrist, parsed(9700).is_pressed), ([6, 5, -300], true));
        assert_eq!(EncoderReport::parse(&report([0; 7])[..13]), None, "too short");
    }

    #[test]
    fn mbed_boards_send_fourteen_bytes() {
        assert!(EncoderReport::parse(&report([1, 2, 3, 4, 5, 6, 1])[..14]).unwrap().asks_for_calibration);
        assert_eq!((report_length(0x1234), report_length(0x16c0)), (15, 65));
    }
}
