//! An arm over a serial port: lines of 64 characters, one of the host for each of the arm.
//!
//! Takes a force in world space. Gives the pose that the arm computes itself. After a line out of turn or a lost byte
//! the two sides synchronize again: the host waits for the next line. Never pushes meanwhile.

use crate::polhem::{orientation_to_world, to_arm, to_world};
use crate::report_filter::ReportFilter;
use crate::{DeviceReport, OpenError, Protocol};
use serial2::SerialPort;
use std::io::ErrorKind;
use std::time::{Duration, Instant};
use typodont_core::device::{DeviceError, DeviceSpec, Pacing, Reading, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};

/// Length of a record; the last byte ends the line.
pub const RECORD_LENGTH: usize = 64;
const END: u8 = b'\n';

/// Ignored over USB, but not by serial adapters.
const BAUD: u32 = 115_200;

/// Time for which one exchange waits for the arm's record.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(15);

/// Time-out of a single read.
const READ_TIMEOUT: Duration = Duration::from_millis(2);

/// Fourth number of the host's records: "force in space".
const CARTESIAN_FORCE: u8 = 2;

/// Maximum distance from the origin, mm: the radius of the workspace is 100 mm, and no arm of this kind reaches twice
/// that.
const MAX_DISTANCE: f32 = 250.0;

/// Lists the serial ports that may belong to an arm: the USB class of such devices, as each system names it.
pub fn ports() -> Vec<String> {
    // A system that cannot list its ports is treated as one without any.
    let ports = SerialPort::available_ports().unwrap_or_default();
    let mut names: Vec<String> = ports.iter().filter_map(|p| p.to_str().map(String::from)).collect();
    names.retain(|name| name.contains("ttyACM") || name.contains("cu.usbmodem") || name.starts_with("COM"));
    names.sort();
    names
}

/// Opens an arm on a serial port.
///
/// # Errors
///
/// Returns an error if the port cannot be opened, with the remedy for the cause.
pub fn open(port: &str) -> Result<SerialArm, OpenError> {
    let opened = SerialPort::open(port, BAUD).and_then(SerialArm::new);
    opened.map_err(|error| {
        let help = match error.kind() {
            // Windows denies a port that another program has open.
            ErrorKind::PermissionDenied if cfg!(target_os = "linux") => {
                "join the group that owns it (`sudo usermod -aG dialout $USER`) and log in again"
            }
            ErrorKind::NotFound => "plug the arm in; `typodont devices` lists the serial ports",
            _ => "close other programs that use the port",
        };
        OpenError::new(format!("cannot open the serial port {port}: {error}"), help)
    })
}

/// Protocol of an arm on a serial port.
pub struct SerialArm {
    port: SerialPort,
    spec: DeviceSpec,
    filter: ReportFilter,
    opened: Instant,
    /// Bytes received after the last complete record.
    buffer: Vec<u8>,
    /// Estimated number of the host's records that the arm has not answered; `None` before the arm was woken.
    unanswered: Option<u32>,
    /// The arm has answered since it was last too late.
    has_answered: bool,
}

/// Time without data after which the host writes first: an arm whose last host program died in the middle of an
/// exchange waits for that exchange to end.
const WAKE_AFTER: Duration = Duration::from_millis(500);

/// Maximum of unanswered records that a slow arm may still answer; with more it would never be on time again.
const UNANSWERED_MAX: u32 = 8;

impl SerialArm {
    /// Sets the time-outs of an open port; sends nothing.
    ///
    /// # Errors
    ///
    /// Returns an error if the system refuses a time-out.
    pub fn new(mut port: SerialPort) -> std::io::Result<SerialArm> {
        port.set_read_timeout(READ_TIMEOUT)?;
        port.set_write_timeout(ANSWER_TIMEOUT)?;
        let filter = ReportFilter::new(
            MAX_DISTANCE,
            "its lines are not those of a Polhem; is another device on this serial port?",
        );
        Ok(SerialArm {
            port,
            spec: spec(),
            filter,
            opened: Instant::now(),
            buffer: Vec::with_capacity(8 * RECORD_LENGTH),
            unanswered: None,
            has_answered: true,
        })
    }

    /// Returns whether an arm sends records on the port. Writes nothing.
    pub fn detects_arm(&mut self, timeout: Duration) -> bool {
        let until = Instant::now() + timeout;
        let mut received = Vec::new();
        while Instant::now() < until && self.read_available(&mut received).is_ok() {
            let is_record = |line: &[u8]| line.len() == RECORD_LENGTH - 1 && PoseRecord::parse(line).is_some();
            if received.split(|b| *b == END).any(is_record) {
                return true;
            }
        }
        false
    }

    /// Appends the bytes received so far to `buffer`.
    fn read_available(&self, buffer: &mut Vec<u8>) -> Result<(), DeviceError> {
        let mut bytes = [0; 4 * RECORD_LENGTH];
        match self.port.read(&mut bytes) {
            Ok(0) => Err(DeviceError::Lost { why: "the serial port has closed; is the arm plugged in?", code: 0 }),
            Ok(n) => {
                buffer.extend_from_slice(&bytes[..n]);
                Ok(())
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(()),
            Err(error) => {
                let code = error.raw_os_error().unwrap_or(0);
                Err(DeviceError::Lost { why: "reading the serial port failed; is the arm plugged in?", code })
            }
        }
    }

    fn send_force(&mut self, force: Vec3) -> Result<(), DeviceError> {
        self.port.write_all(&encode_force(force)).map_err(|error| {
            let code = error.raw_os_error().unwrap_or(0);
            DeviceError::Lost { why: "writing to the serial port failed; is the arm plugged in?", code }
        })
    }

    /// Waits for any bytes from the arm, discards them, since the beginning of a record may be missing, and starts an
    /// exchange.
    fn wake(&mut self) -> Result<(), DeviceError> {
        let mut received = Vec::new();
        self.read_available(&mut received)?;
        if !received.is_empty() || self.opened.elapsed() > WAKE_AFTER {
            // Bytes that cannot be discarded are read and rejected as an invalid record.
            let _ = self.port.discard_input_buffer();
            self.resynchronize()?;
        }
        Ok(())
    }

    /// Sends a record without force, so that the arm answers with a record from its beginning. The buffer is kept:
    /// the second half of a record may still arrive, and without its first half it would be taken for the beginning
    /// of the next one.
    fn resynchronize(&mut self) -> Result<(), DeviceError> {
        // An arm that has answered since the last time is not slow: unanswered records never reached it.
        let still = if self.has_answered { 0 } else { self.unanswered.unwrap_or(0) };
        self.unanswered = Some((still + 1).min(UNANSWERED_MAX));
        self.has_answered = false;
        self.send_force(Vec3::ZERO)
    }

    /// Waits for a record; returns the newest if several came at once.
    fn receive_record(&mut self) -> Result<Option<[u8; RECORD_LENGTH]>, DeviceError> {
        let until = Instant::now() + ANSWER_TIMEOUT;
        let mut buffer = std::mem::take(&mut self.buffer);
        let mut result = Ok(());
        while !has_line(&buffer) && result.is_ok() && Instant::now() < until {
            result = self.read_available(&mut buffer);
        }
        self.buffer = buffer;
        result?;
        let mut newest = None;
        while has_line(&self.buffer) {
            // If the end of a line is missing, everything up to its expected position is dropped.
            let end = self.buffer[..RECORD_LENGTH.min(self.buffer.len())].iter().position(|b| *b == END);
            let line: Vec<u8> = self.buffer.drain(..end.map_or(RECORD_LENGTH, |at| at + 1)).collect();
            match (line.try_into(), end) {
                (Ok(record), Some(_)) => newest = Some(record),
                _ => self.filter.count_invalid()?,
            }
            self.unanswered = self.unanswered.map(|n| n.saturating_sub(1));
            self.has_answered = true;
        }
        Ok(newest)
    }
}

/// Returns whether the bytes contain the end of a line, or as many bytes as a record.
fn has_line(buffer: &[u8]) -> bool {
    buffer.len() >= RECORD_LENGTH || buffer.contains(&END)
}

impl Protocol for SerialArm {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Device
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        match self.unanswered {
            None => {
                self.wake()?;
                return Ok(None);
            }
            Some(0) => {
                let may_push = self.filter.is_fresh(Instant::now()) && output.force.is_finite();
                let force = if may_push { output.force.clamp_length_max(self.spec.max_force) } else { Vec3::ZERO };
                self.send_force(to_arm(force))?;
                self.unanswered = Some(1);
            }
            // The arm has not answered an earlier record yet; sending now would leave it one record behind for good.
            Some(_) => {}
        }
        let Some(record) = self.receive_record()? else {
            self.resynchronize()?;
            return Ok(None);
        };
        let Some(numbers) = PoseRecord::parse(&record[..RECORD_LENGTH - 1]) else {
            self.filter.count_invalid()?;
            return Ok(None);
        };
        let (reading, now) = (numbers.reading(), Instant::now());
        if !self.filter.accept(reading.pose.position, now)? {
            return Ok(None);
        }
        Ok(Some(DeviceReport { reading, state: self.filter.state(now) }))
    }

    fn close(&mut self) {
        // If the arm does not receive this, its motors are off already.
        let _ = self.send_force(Vec3::ZERO);
    }
}

/// Encodes a record of the host: a force in the arm's axes, in whole millinewtons.
fn encode_force(force: Vec3) -> [u8; RECORD_LENGTH] {
    let [x, y, z] = force.to_array().map(|newtons| (newtons * 1000.0).round() as i32);
    let line = format!("{x} {y} {z} {CARTESIAN_FORCE} 0 0 0");
    let mut record = [b' '; RECORD_LENGTH];
    // Forces are limited to some newtons, so a line has about thirty characters.
    record[..line.len()].copy_from_slice(line.as_bytes());
    record[RECORD_LENGTH - 1] = END;
    record
}

/// Parsed record of the arm: the position of the tip in the arm's axes, mm, and four angles, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PoseRecord {
    position: Vec3,
    angles: [f32; 4],
}

impl PoseRecord {
    /// Returns `None` for a line that is not a record of an arm, or that contains a value that is not finite.
    fn parse(line: &[u8]) -> Option<PoseRecord> {
        let mut words = std::str::from_utf8(line).ok()?.split_ascii_whitespace();
        let mut number = || words.next()?.parse::<f32>().ok().filter(|n| n.is_finite());
        let position = Vec3::new(number()?, number()?, number()?);
        let angles = [number()?, number()?, number()?, number()?];
        // The eighth number is a state that no publication explains; it must be present.
        words.next()?.parse::<i32>().ok()?;
        words.next().is_none().then_some(PoseRecord { position, angles })
    }

    /// Returns the pose in world space. The roll of the stylus and its button are sent over a separate radio link,
    /// which is not supported: roll is 0, and no button is pressed.
    fn reading(&self) -> Reading {
        let [a, lambda, d, e] = self.angles;
        let fore = Quat::from_rotation_z(a) * Quat::from_rotation_y(-lambda);
        let hand = Quat::from_rotation_x(d) * Quat::from_rotation_y(e);
        let pose =
            Pose { position: to_world(self.position), orientation: orientation_to_world((fore * hand).normalize()) };
        Reading { pose, buttons: 0 }
    }
}

/// Specification as in toolkits that support the arm: 5 N, 1500 N/m, 3 N·s/m, 100 mm around the middle.
fn spec() -> DeviceSpec {
    DeviceSpec {
        name: "Polhem".into(),
        max_force: 5.0,
        // Not published; a quarter, as other arms with motors of this size hold for hours.
        continuous_force: 1.25,
        max_torque: 0.0,
        max_stiffness: 1.5,
        max_damping: 0.003,
        // The arm prints three or four decimals; its encoders are coarser, similar to those of the first Polhem.
        resolution: 0.05,
        workspace_half: Vec3::splat(57.0),
        // Not published.
        apparent_mass: 0.1,
        page_force: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_sent_in_whole_millinewtons() {
        let record = encode_force(Vec3::new(0.5, -1.2341, 5.0));
        assert_eq!(record[RECORD_LENGTH - 1], b'\n');
        assert_eq!(std::str::from_utf8(&record).unwrap().trim_end(), "500 -1234 5000 2 0 0 0");
    }

    #[test]
    fn an_invalid_line_is_refused() {
        let numbers = PoseRecord::parse(b"10.000 -20.5 3.25 0.1 0.2 0.3 0.4 0      ").unwrap();
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
            assert_eq!(PoseRecord::parse(line.as_bytes()), None, "{line}");
        }
        assert_eq!(PoseRecord::parse(&[0xff, 0xfe, b' ']), None);
    }
}
