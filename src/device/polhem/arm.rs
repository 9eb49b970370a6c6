//! The HID arm: six encoders in, three motor currents out.
//!
//! Takes a force in world space. Gives the pose that the encoders tell. The arm answers each report with one of its own and
//! stops its motors half a second after the last.

use super::geometry::Config;
use super::{to_arm, to_world, turn_to_world};
use crate::device::hid::{REPORT_MAX, Transport};
use crate::device::trust::Trust;
use crate::device::{Beat, Gone, Output, Reading, Report, Spec, State, UPRIGHT, Wire};
use crate::frame::{Pose, Quat, Vec3};
use std::time::{Duration, Instant};

/// What the firmware takes at most, mA; its own limit is 3 A.
const CURRENT_MAX: f64 = 1999.0;

/// How long one turn waits for the answer to its report.
const ANSWER: Duration = Duration::from_millis(10);

/// After this long without an answer a report counts as lost, and the arm is spoken to again. Speaking more often would
/// let a slow arm answer in time to what is long past.
const LOST: Duration = Duration::from_millis(100);

/// Encoders and `info`: what counts in a report, however long it is.
const HEARD: usize = 14;

/// Added to the fourth encoder while the button is down; the encoder itself stays within half of it.
const PRESSED: i16 = 10_000;

/// Wrist and arm reach this far from the middle of the workspace, mm: links of 0.45 m and the offset of the origin.
const REACH: f32 = 700.0;

/// What `info` says when the arm does not know where its encoders are.
const ASKS_FOR_CALIBRATION: i16 = 1;

const CURRENTS: i16 = 0;
const PRESET: i16 = 1;

const CALIBRATE: State = State::Calibrate {
    how: "hold the arm with its upper link upright and its forearm level, pointing at you, then press the stylus button",
};

/// Bytes of a report to the arm with its id, which depends on the board: Teensys take 64, mbed boards 14.
pub fn report_length(vendor: u16) -> usize {
    if vendor == 0x1234 { 15 } else { 65 }
}

/// An arm on a transport.
pub struct Arm<T> {
    transport: T,
    config: &'static Config,
    report_length: usize,
    spec: Spec,
    trust: Trust,
    /// What the last sound report said; none before the first, which only an all-zero report brings about.
    heard: Option<Heard>,
    was_pressed: bool,
    /// When the report was sent that the arm has not answered.
    asked: Option<Instant>,
    /// It was late, and has been told to let go.
    is_hushed: bool,
}

/// A report of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Heard {
    joints: [i16; 3],
    wrist: [i16; 3],
    is_pressed: bool,
    asks_for_calibration: bool,
}

impl<T: Transport> Arm<T> {
    pub fn new(transport: T, config: &'static Config, report_length: usize) -> Arm<T> {
        let trust = Trust::new(REACH, "what it sends is not what a Polhem sends; is it another device on a Teensy?");
        let spec = spec(config);
        Arm {
            transport,
            config,
            report_length,
            spec,
            trust,
            heard: None,
            was_pressed: false,
            asked: None,
            is_hushed: false,
        }
    }

    /// Sends currents and a command, or a preset.
    fn tell(&mut self, words: [i16; 7]) -> Result<(), Gone> {
        let mut report = [0; REPORT_MAX];
        for (two, word) in report[1..].chunks_exact_mut(2).zip(words) {
            two.copy_from_slice(&word.to_le_bytes());
        }
        self.transport.write(&report[..self.report_length])
    }

    /// What to send now: currents for the force, or nothing while it may not be trusted.
    fn currents(&self, told: &Output, now: Instant) -> [i16; 3] {
        let Some(heard) = self.heard.filter(|h| !h.asks_for_calibration && self.trust.is_fresh(now)) else {
            return [0; 3];
        };
        let force = to_arm(told.force.clamp_length_max(self.spec.max_force));
        if !force.is_finite() {
            return [0; 3];
        }
        let angles = self.config.angles(heard.joints);
        let amperes = self.config.currents(angles, force.to_array().map(f64::from));
        // All three are cut down alike: one alone would turn the force aside.
        let most = amperes.iter().fold(0.0, |most: f64, a| most.max(a.abs() * 1000.0));
        let share = if most > CURRENT_MAX { CURRENT_MAX / most } else { 1.0 };
        amperes.map(|a| (a * 1000.0 * share).round() as i16)
    }

    /// Tells an arm that asks for it where its encoders are, when the person says that it is in place.
    fn calibrate(&mut self, heard: Heard) -> Result<(), Gone> {
        let is_told = heard.is_pressed && !self.was_pressed;
        self.was_pressed = heard.is_pressed;
        if heard.asks_for_calibration && is_told {
            self.trust.forget();
            // d e f stand in the currents' place, a b c behind the command.
            self.tell([0, 0, 0, PRESET, 0, 0, self.config.preset_c])?;
        }
        Ok(())
    }

    fn reading(&self, heard: Heard) -> Reading {
        let Heard { joints, wrist, is_pressed, .. } = heard;
        let angles = self.config.angles(joints);
        let [x, y, z] = self.config.position(angles).map(|metres| (metres * 1000.0) as f32);
        let orientation = match self.config.has_wrist() {
            true => {
                let [a, c, d, e, f] = self.config.turns(angles, wrist).map(|angle| angle as f32);
                let fore = Quat::from_rotation_z(a) * Quat::from_rotation_y(c);
                let hand = Quat::from_rotation_x(d) * Quat::from_rotation_y(e) * Quat::from_rotation_x(f);
                turn_to_world((fore * hand).normalize())
            }
            false => UPRIGHT,
        };
        Reading { pose: Pose { position: to_world(Vec3::new(x, y, z)), orientation }, buttons: is_pressed.into() }
    }
}

impl<T: Transport> Wire for Arm<T> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        Beat::Device
    }

    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        let now = Instant::now();
        if self.asked.is_none_or(|at| now.saturating_duration_since(at) > LOST) {
            let [a, b, c] = if self.asked.is_none() { self.currents(told, now) } else { [0; 3] };
            self.tell([a, b, c, CURRENTS, 0, 0, 0])?;
            self.asked = Some(now);
        }
        let mut report = [0; REPORT_MAX];
        let length = self.transport.newest(&mut report, ANSWER)?;
        if length == 0 {
            if !std::mem::replace(&mut self.is_hushed, true) {
                self.tell([0; 7])?;
            }
            return Ok(None);
        }
        (self.asked, self.is_hushed) = (None, false);
        let Some(heard) = Heard::of(&report[..length]) else {
            self.trust.unsound()?;
            return Ok(None);
        };
        let reading = self.reading(heard);
        let now = Instant::now();
        if !self.trust.is_sound(reading.pose.position, now)? {
            return Ok(None);
        }
        self.heard = Some(heard);
        self.calibrate(heard)?;
        let state = if heard.asks_for_calibration { CALIBRATE } else { self.trust.state(now) };
        Ok(Some(Report { reading, state }))
    }

    fn close(&mut self) {
        // If the arm is not there to hear it, its motors are off.
        let _ = self.tell([0; 7]);
    }
}

impl Heard {
    /// None for what is too short to be a report of an arm.
    fn of(report: &[u8]) -> Option<Heard> {
        let mut words = report.get(..HEARD)?.chunks_exact(2).map(|two| i16::from_le_bytes([two[0], two[1]]));
        let [a, b, c, mut d, e, f, info] = std::array::from_fn(|_| words.next().unwrap_or(0));
        let is_pressed = d > PRESSED / 2;
        if is_pressed {
            d = d.saturating_sub(PRESSED);
        }
        // The wrist's encoders are wired the other way round.
        let wrist = [f, e, d];
        Some(Heard { joints: [a, b, c], wrist, is_pressed, asks_for_calibration: info == ASKS_FOR_CALIBRATION })
    }
}

fn spec(config: &Config) -> Spec {
    Spec {
        name: config.name.into(),
        max_force: config.max_force as f32,
        // Not published; what other arms with motors of this size hold for hours, a quarter.
        continuous_force: config.max_force as f32 / 4.0,
        max_torque: 0.0,
        max_stiffness: config.max_stiffness as f32 / 1000.0,
        max_damping: config.max_damping as f32 / 1000.0,
        resolution: config.resolution() as f32 * 1000.0,
        // Toolkits give a radius of 100 mm; the box within that sphere.
        workspace_half: Vec3::splat(57.0),
        // Not published either; links of plywood, capstans without gears.
        apparent_mass: 0.1,
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
    fn the_button_is_taken_out_of_the_fourth_encoder() {
        let heard = |d| Heard::of(&report([1, 2, 3, d, 5, 6, 0])).unwrap();
        assert_eq!((heard(-300).wrist, heard(-300).is_pressed), ([6, 5, -300], false));
        assert_eq!((heard(9700).wrist, heard(9700).is_pressed), ([6, 5, -300], true));
        assert_eq!(Heard::of(&report([0; 7])[..13]), None, "too short");
    }

    #[test]
    fn mbed_boards_send_fourteen_bytes() {
        assert!(Heard::of(&report([1, 2, 3, 4, 5, 6, 1])[..14]).unwrap().asks_for_calibration);
        assert_eq!((report_length(0x1234), report_length(0x16c0)), (15, 65));
    }
}
