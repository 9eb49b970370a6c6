//! The serial arm: lines of 64 characters, one of ours for each of its own.
//!
//! Takes a force in world space. Gives the pose that the arm works out itself. Whoever speaks out of turn or loses a byte
//! starts again: the next line is waited for, and nothing is pushed meanwhile.

use super::{to_arm, to_world, turn_to_world};
use crate::device::trust::Trust;
use crate::device::{Beat, Gone, Output, Reading, Report, Spec, Trouble, Wire};
use crate::frame::{Pose, Quat, Vec3};
use serial2::SerialPort;
use std::io::ErrorKind;
use std::time::{Duration, Instant};

/// A record's bytes; the last ends the line.
pub const RECORD: usize = 64;
const END: u8 = b'\n';

/// USB ignores it; adapters do not.
const BAUD: u32 = 115_200;

/// How long one turn waits for the arm's record.
const ANSWER: Duration = Duration::from_millis(15);

/// How long one look at the port waits.
const LOOK: Duration = Duration::from_millis(2);

/// "Force in space": what the fourth number of our records says.
const CARTESIAN_FORCE: u8 = 2;

/// Radius of the workspace is 100 mm; beyond twice that no arm of this kind goes, mm.
const REACH: f32 = 250.0;

/// Serial ports that may be an arm's: USB's class for such devices, as each system names it.
pub fn ports() -> Vec<String> {
    // A system that lists no ports has none for us.
    let ports = SerialPort::available_ports().unwrap_or_default();
    let mut names: Vec<String> = ports.iter().filter_map(|p| p.to_str().map(String::from)).collect();
    names.retain(|name| name.contains("ttyACM") || name.contains("cu.usbmodem") || name.starts_with("COM"));
    names.sort();
    names
}

/// Opens a serial port for an arm.
pub fn open(port: &str) -> Result<Records, Trouble> {
    let opened = SerialPort::open(port, BAUD).and_then(Records::new);
    opened.map_err(|error| {
        let help = match error.kind() {
            ErrorKind::PermissionDenied => {
                "join the group that owns it (`sudo usermod -aG dialout $USER`) and log in again"
            }
            ErrorKind::NotFound => "plug the arm in; `typodont devices` lists the serial ports there are",
            _ => "close other programs that use the port",
        };
        Trouble::new(format!("cannot open the serial port {port}: {error}"), help)
    })
}

/// An arm on a serial port.
pub struct Records {
    port: SerialPort,
    spec: Spec,
    trust: Trust,
    opened: Instant,
    /// Bytes that do not make a record yet.
    heard: Vec<u8>,
    /// Records of ours that the arm has not answered, as far as is known; none before it was woken.
    unanswered: Option<u32>,
    /// It has answered since it last failed to in time.
    has_answered: bool,
}

/// How long an arm that says nothing is waited for before it is spoken to: one whose last program died in the middle waits
/// for its turn to end.
const WAKE_AFTER: Duration = Duration::from_millis(500);

/// Answers that may still come from a slow arm; more, and it will never be in time again.
const UNANSWERED_MAX: u32 = 8;

impl Records {
    pub fn new(mut port: SerialPort) -> std::io::Result<Records> {
        port.set_read_timeout(LOOK)?;
        port.set_write_timeout(ANSWER)?;
        let trust =
            Trust::new(REACH, "what it sends is not what a Polhem sends; is another device on this serial port?");
        Ok(Records {
            port,
            spec: spec(),
            trust,
            opened: Instant::now(),
            heard: Vec::with_capacity(8 * RECORD),
            unanswered: None,
            has_answered: true,
        })
    }

    /// Whether something like an arm speaks on the port; writes nothing.
    pub fn hears_an_arm(&mut self, patience: Duration) -> bool {
        let until = Instant::now() + patience;
        let mut heard = Vec::new();
        while Instant::now() < until && self.look(&mut heard).is_ok() {
            let is_record = |line: &[u8]| line.len() == RECORD - 1 && Numbers::of(line).is_some();
            if heard.split(|b| *b == END).any(is_record) {
                return true;
            }
        }
        false
    }

    /// Adds what has come to `heard`.
    fn look(&self, heard: &mut Vec<u8>) -> Result<(), Gone> {
        let mut bytes = [0; 4 * RECORD];
        match self.port.read(&mut bytes) {
            Ok(0) => Err(Gone::Lost { why: "the serial port has closed; is the arm plugged in?", code: 0 }),
            Ok(n) => {
                heard.extend_from_slice(&bytes[..n]);
                Ok(())
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(()),
            Err(error) => {
                let code = error.raw_os_error().unwrap_or(0);
                Err(Gone::Lost { why: "reading the serial port failed; is the arm plugged in?", code })
            }
        }
    }

    fn speak(&mut self, force: Vec3) -> Result<(), Gone> {
        self.port.write_all(&record(force)).map_err(|error| {
            let code = error.raw_os_error().unwrap_or(0);
            Gone::Lost { why: "writing to the serial port failed; is the arm plugged in?", code }
        })
    }

    /// Waits until the arm says anything, throws it away, since its beginning may be missing, and asks for more.
    fn wake(&mut self) -> Result<(), Gone> {
        let mut heard = Vec::new();
        self.look(&mut heard)?;
        if !heard.is_empty() || self.opened.elapsed() > WAKE_AFTER {
            // What cannot be thrown away is read, and refused as no record.
            let _ = self.port.discard_input_buffer();
            self.start_again()?;
        }
        Ok(())
    }

    /// Speaks without a force, to be answered with the beginning of a record. What lies there is left: the second half of
    /// a record may be on its way, and without its first it would be taken for the next one's beginning.
    fn start_again(&mut self) -> Result<(), Gone> {
        // An arm that answered since the last time is not slow: what it did not answer never reached it.
        let still = if self.has_answered { 0 } else { self.unanswered.unwrap_or(0) };
        self.unanswered = Some((still + 1).min(UNANSWERED_MAX));
        self.has_answered = false;
        self.speak(Vec3::ZERO)
    }

    /// Waits for a record; the newest, if several came at once.
    fn listen(&mut self) -> Result<Option<[u8; RECORD]>, Gone> {
        let until = Instant::now() + ANSWER;
        let mut heard = std::mem::take(&mut self.heard);
        let mut looked = Ok(());
        while !has_line(&heard) && looked.is_ok() && Instant::now() < until {
            looked = self.look(&mut heard);
        }
        self.heard = heard;
        looked?;
        let mut newest = None;
        while has_line(&self.heard) {
            // Where a line's end is missing all is dropped up to where it should be.
            let end = self.heard[..RECORD.min(self.heard.len())].iter().position(|b| *b == END);
            let line: Vec<u8> = self.heard.drain(..end.map_or(RECORD, |at| at + 1)).collect();
            match (line.try_into(), end) {
                (Ok(record), Some(_)) => newest = Some(record),
                _ => self.trust.unsound()?,
            }
            self.unanswered = self.unanswered.map(|n| n.saturating_sub(1));
            self.has_answered = true;
        }
        Ok(newest)
    }
}

/// Whether the bytes hold a line, be it too short, or more than one could.
fn has_line(heard: &[u8]) -> bool {
    heard.len() >= RECORD || heard.contains(&END)
}

impl Wire for Records {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        Beat::Device
    }

    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        match self.unanswered {
            None => {
                self.wake()?;
                return Ok(None);
            }
            Some(0) => {
                let may_push = self.trust.is_fresh(Instant::now()) && told.force.is_finite();
                let force = if may_push { told.force.clamp_length_max(self.spec.max_force) } else { Vec3::ZERO };
                self.speak(to_arm(force))?;
                self.unanswered = Some(1);
            }
            // It has yet to answer an earlier record; speaking now would put it one record behind for good.
            Some(_) => {}
        }
        let Some(record) = self.listen()? else {
            self.start_again()?;
            return Ok(None);
        };
        let Some(numbers) = Numbers::of(&record[..RECORD - 1]) else {
            self.trust.unsound()?;
            return Ok(None);
        };
        let (reading, now) = (numbers.reading(), Instant::now());
        if !self.trust.is_sound(reading.pose.position, now)? {
            return Ok(None);
        }
        Ok(Some(Report { reading, state: self.trust.state(now) }))
    }

    fn close(&mut self) {
        // If the arm is not there to hear it, its motors are off.
        let _ = self.speak(Vec3::ZERO);
    }
}

/// What we say: a force in the arm's axes, in whole millinewtons.
fn record(force: Vec3) -> [u8; RECORD] {
    let [x, y, z] = force.to_array().map(|newtons| (newtons * 1000.0).round() as i32);
    let line = format!("{x} {y} {z} {CARTESIAN_FORCE} 0 0 0");
    let mut record = [b' '; RECORD];
    // Forces are clamped to some newtons, so a line is some thirty characters long.
    record[..line.len()].copy_from_slice(line.as_bytes());
    record[RECORD - 1] = END;
    record
}

/// What the arm says: where the tip is in its axes, mm, and four angles, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Numbers {
    position: Vec3,
    angles: [f32; 4],
}

impl Numbers {
    /// None for what is no line of an arm, or holds what is no number.
    fn of(line: &[u8]) -> Option<Numbers> {
        let mut words = std::str::from_utf8(line).ok()?.split_ascii_whitespace();
        let mut number = || words.next()?.parse::<f32>().ok().filter(|n| n.is_finite());
        let position = Vec3::new(number()?, number()?, number()?);
        let angles = [number()?, number()?, number()?, number()?];
        // Its eighth number is a state that no publication explains; it must be there.
        words.next()?.parse::<i32>().ok()?;
        words.next().is_none().then_some(Numbers { position, angles })
    }

    /// The stylus' roll and its button come by a radio of their own, which is not listened to: roll is 0, no button.
    fn reading(&self) -> Reading {
        let [a, lambda, d, e] = self.angles;
        let fore = Quat::from_rotation_z(a) * Quat::from_rotation_y(-lambda);
        let hand = Quat::from_rotation_x(d) * Quat::from_rotation_y(e);
        let pose = Pose { position: to_world(self.position), orientation: turn_to_world((fore * hand).normalize()) };
        Reading { pose, buttons: 0 }
    }
}

/// As toolkits that know the arm have it: 5 N, 1500 N/m, 3 N·s/m, 100 mm around the middle.
fn spec() -> Spec {
    Spec {
        name: "Polhem".into(),
        max_force: 5.0,
        // Not published; what other arms with motors of this size hold for hours, a quarter.
        continuous_force: 1.25,
        max_torque: 0.0,
        max_stiffness: 1.5,
        max_damping: 0.003,
        // It prints three or four decimals; its encoders are coarser, about as the first Polhem's.
        resolution: 0.05,
        workspace_half: Vec3::splat(57.0),
        // Not published.
        apparent_mass: 0.1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_said_in_whole_millinewtons() {
        let said = record(Vec3::new(0.5, -1.2341, 5.0));
        assert_eq!(said[RECORD - 1], b'\n');
        assert_eq!(std::str::from_utf8(&said).unwrap().trim_end(), "500 -1234 5000 2 0 0 0");
    }

    #[test]
    fn a_line_that_is_none_is_refused() {
        let numbers = Numbers::of(b"10.000 -20.5 3.25 0.1 0.2 0.3 0.4 0      ").unwrap();
        assert_eq!(numbers.position, Vec3::new(10.0, -20.5, 3.25));
        for line in [
            "1 2 3 4 5 6 7",
            "1 2 3 4 5 6 7 0 9",
            "nan 2 3 4 5 6 7 0",
            "inf 2 3 4 5 6 7 0",
            "1 2 3 4 5 6 7 0.5",
            "1,5 2 3 4 5 6 7 0",
            "",
        ] {
            assert_eq!(Numbers::of(line.as_bytes()), None, "{line}");
        }
        assert_eq!(Numbers::of(&[0xff, 0xfe, b' ']), None);
    }
}
