//! The open handle: the program's own protocol for haptic handles that a school builds on a Teensy.
//!
//! Takes a force, and sends it with the time for which it holds. Gives the reports of the handle, a thousand per
//! second at the handle's own rate. Never knows the mechanics of a handle. The layout of the reports, the rules for
//! the firmware and examples are in `content/devices/open-handle.md`; this module is the host's side.

use crate::hid;
use crate::hid::{HidDeviceInfo, HidMatch, REPORT_MAX, Transport};
use crate::protocol::open_device;
use crate::report_filter::ReportFilter;
use crate::{DeviceReport, Driver, FoundDevice, OpenError, Protocol};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use web_time::{Duration, Instant};

/// Product string of the firmware, which distinguishes it from every other Teensy.
pub const PRODUCT: &str = "Typodont Handle";

/// USB ids and usage of Teensy raw HID.
pub const HID_MATCH: HidMatch = HidMatch { vendor: 0x16c0, products: &[0x0486], usage: Some((0xffab, 0x0200)) };

const REPORT_LENGTH: usize = 64;
const FROM_HANDLE: [u8; 2] = *b"TH";
const FROM_HOST: [u8; 2] = *b"TO";
const VERSION: u8 = 1;

/// Kinds of reports, in their fourth byte: two from the handle, two from the host.
const STATE: u8 = 1;
const SPEC: u8 = 2;
const COMMAND: u8 = 1;
const DESCRIBE: u8 = 2;

/// Time without a new command after which the handle releases the hand by itself, ms. Twice the life of a force in
/// the relay: it takes effect when the program has died, not when it is late.
const FORCE_LIFE_MS: u16 = 20;

/// Time for which one exchange waits for a report.
const REPORT_TIMEOUT: Duration = Duration::from_millis(10);

/// Time within which a handle must describe itself, and the interval between two requests.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(2);
const QUERY_INTERVAL: Duration = Duration::from_millis(50);

/// Age of the last obeyed command above which the force counts as late: the same as for the relay's reports.
const MAX_COMMAND_LATENCY: Duration = Duration::from_millis(20);

/// Commands whose time of sending is remembered.
const SENT_HISTORY: usize = 256;

/// Protocol of a handle on a transport.
pub struct OpenHandleProtocol<T> {
    transport: T,
    spec: DeviceSpec,
    has_orientation: bool,
    filter: ReportFilter,
    /// Number of the newest report.
    last_number: Option<u16>,
    command_number: u16,
    sent_at: [Option<Instant>; SENT_HISTORY],
    is_ready: bool,
}

impl<T: Transport> OpenHandleProtocol<T> {
    /// Asks the handle for its description. On a transport that cannot wait, the answer is there at a later call.
    ///
    /// # Errors
    ///
    /// Returns an error if the transport fails, if the handle does not answer within two seconds, or if its
    /// description is incomplete.
    pub fn handshake(mut transport: T) -> Result<OpenHandleProtocol<T>, OpenError> {
        let silent = || {
            OpenError::new(
                "the handle does not describe itself",
                "its firmware must answer as content/devices/open-handle.md says; plug it in again or reload it",
            )
        };
        let broken = |gone: DeviceError| OpenError::new(gone.to_string(), "plug the handle in again");
        let until = Instant::now() + HANDSHAKE_TIMEOUT;
        while Instant::now() < until {
            transport.write(&encode(FROM_HOST, DESCRIBE, 0, &[])).map_err(broken)?;
            let ask_again = Instant::now() + QUERY_INTERVAL;
            while Instant::now() < ask_again {
                let mut report = [0; REPORT_MAX];
                let length = transport.read(&mut report, REPORT_TIMEOUT).map_err(broken)?;
                if length == 0 && !transport.can_wait() {
                    return Err(silent());
                }
                if let Some(body) = decode(&report[..length]).filter(|r| r[3] == SPEC) {
                    let (spec, has_orientation) = parse_description(body)?;
                    return Ok(OpenHandleProtocol::new(transport, spec, has_orientation));
                }
            }
        }
        Err(silent())
    }

    fn new(transport: T, spec: DeviceSpec, has_orientation: bool) -> OpenHandleProtocol<T> {
        // Twice the distance to a corner of the box: room for positions beyond the box.
        let reach = spec.workspace_half.length() * 2.0;
        let not_ours = "its reports are damaged or of another version; check its cable and its firmware";
        OpenHandleProtocol {
            transport,
            spec,
            has_orientation,
            filter: ReportFilter::new(reach, not_ours),
            last_number: None,
            command_number: 0,
            sent_at: [None; SENT_HISTORY],
            is_ready: false,
        }
    }

    fn send(&mut self, output: &Wrench) -> Result<(), DeviceError> {
        let now = Instant::now();
        let may_push =
            self.is_ready && self.filter.is_fresh(now) && output.force.is_finite() && output.torque.is_finite();
        let output = if may_push { *output } else { Wrench::ZERO };
        let force = output.force.clamp_length_max(self.spec.max_force);
        let torque = output.torque.clamp_length_max(self.spec.max_torque);
        let mut body = [0; 28];
        body[..2].copy_from_slice(&self.last_number.unwrap_or(0).to_le_bytes());
        let numbers = force.to_array().into_iter().chain(torque.to_array());
        body[2..26].chunks_exact_mut(4).zip(numbers).for_each(|(four, n)| four.copy_from_slice(&n.to_le_bytes()));
        body[26..].copy_from_slice(&FORCE_LIFE_MS.to_le_bytes());
        self.command_number = self.command_number.wrapping_add(1);
        self.sent_at[usize::from(self.command_number) % SENT_HISTORY] = Some(now);
        self.transport.write_newest(&encode(FROM_HOST, COMMAND, self.command_number, &body))
    }

    /// Returns whether the handle obeys commands that are too old.
    fn is_behind(&self, obeyed: u16, now: Instant) -> bool {
        let behind = self.command_number.wrapping_sub(obeyed);
        match usize::from(behind) < SENT_HISTORY {
            true => {
                let sent = self.sent_at[usize::from(obeyed) % SENT_HISTORY];
                sent.is_some_and(|at| now.saturating_duration_since(at) > MAX_COMMAND_LATENCY)
            }
            // No command was obeyed yet, or its time of sending has been overwritten.
            false => true,
        }
    }
}

impl<T: Transport> Protocol for OpenHandleProtocol<T> {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Device
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        self.send(output)?;
        let mut report = [0; REPORT_MAX];
        let length = self.transport.read_newest(&mut report, REPORT_TIMEOUT)?;
        if length == 0 {
            return Ok(None);
        }
        let Some(body) = decode(&report[..length]) else {
            self.filter.count_invalid()?;
            return Ok(None);
        };
        if body[3] != STATE {
            return Ok(None);
        }
        let parsed = HandleReport::parse(body, self.has_orientation);
        // A report with the same number again means that the handle hangs: treat it as silence.
        if self.last_number == Some(parsed.number) {
            return Ok(None);
        }
        let now = Instant::now();
        let Some(reading) = parsed.reading else {
            self.filter.count_invalid()?;
            return Ok(None);
        };
        if !self.filter.accept(reading.pose.position, now)? {
            return Ok(None);
        }
        let is_first = self.last_number.replace(parsed.number).is_none();
        if !is_first && self.command_number > 1 && self.is_behind(parsed.last_obeyed, now) {
            self.filter.mark_late(now);
        }
        self.is_ready = parsed.state.is_ready();
        let state = if self.is_ready { self.filter.state(now) } else { parsed.state };
        Ok(Some(DeviceReport { reading, state }))
    }

    fn release_time(&self) -> Option<Duration> {
        Some(Duration::from_millis(FORCE_LIFE_MS.into()))
    }

    fn close(&mut self) {
        self.is_ready = false;
        // If the handle does not receive this, it releases the hand when its last command expires.
        let _ = self.send(&Wrench::ZERO);
    }
}

/// Encodes a report to the handle, with the id byte that raw HID requires and the checksum.
fn encode(magic: [u8; 2], kind: u8, number: u16, body: &[u8]) -> [u8; REPORT_LENGTH + 1] {
    let mut report = [0; REPORT_LENGTH + 1];
    let bytes = &mut report[1..];
    bytes[..2].copy_from_slice(&magic);
    bytes[2] = VERSION;
    bytes[3] = kind;
    bytes[4..6].copy_from_slice(&number.to_le_bytes());
    bytes[6..6 + body.len()].copy_from_slice(body);
    let sum = crc32fast::hash(&bytes[..REPORT_LENGTH - 4]);
    bytes[REPORT_LENGTH - 4..].copy_from_slice(&sum.to_le_bytes());
    report
}

/// Returns the body of a handle's report if its checksum and version are right.
fn decode(report: &[u8]) -> Option<&[u8; REPORT_LENGTH]> {
    let report: &[u8; REPORT_LENGTH] = report.first_chunk()?;
    let is_ours = report[..2] == FROM_HANDLE && report[2] == VERSION;
    let is_whole = crc32fast::hash(&report[..REPORT_LENGTH - 4]) == u32_at(report, REPORT_LENGTH - 4);
    (is_ours && is_whole).then_some(report)
}

/// Parsed state report.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HandleReport {
    number: u16,
    /// Number of the last command that the handle obeyed.
    last_obeyed: u16,
    state: DeviceState,
    /// `None` if the orientation is not a rotation or the position is not finite.
    reading: Option<Reading>,
}

/// Unit of a position, mm: 0.1 µm.
const POSITION_UNIT: f64 = 1e-4;

/// Unit of a quaternion component.
const QUATERNION_UNIT: f32 = 1.0 / 32767.0;

impl HandleReport {
    fn parse(report: &[u8; REPORT_LENGTH], has_orientation: bool) -> HandleReport {
        let coordinate = |at| (f64::from(u32_at(report, at) as i32) * POSITION_UNIT) as f32;
        let position = Vec3::new(coordinate(16), coordinate(20), coordinate(24));
        let part = |at| f32::from(u16_at(report, at) as i16) * QUATERNION_UNIT;
        let rotation = Quat::from_xyzw(part(28), part(30), part(32), part(34));
        let orientation = if has_orientation { rotation } else { UPRIGHT };
        let pose = Pose { position, orientation };
        let valid_pose = pose.is_valid().then(|| Pose { orientation: orientation.normalize(), ..pose });
        HandleReport {
            number: u16_at(report, 4),
            last_obeyed: u16_at(report, 6),
            state: state(report[8], report[9]),
            reading: valid_pose.map(|pose| Reading { pose, buttons: u32_at(report, 12) }),
        }
    }
}

fn state(state: u8, cause: u8) -> DeviceState {
    match (state, cause) {
        (0, _) => DeviceState::Homing { what: "the handle is starting" },
        (1, _) => DeviceState::Calibrate { how: "put the handle in its rest and press its button" },
        (2, _) => DeviceState::Homing { what: "the handle is finding its centre; keep your hands off" },
        (3, _) => DeviceState::Ready,
        (4, 1) => DeviceState::ForceOff { why: "the commands arrived too late; close busy programs" },
        (4, 2) => DeviceState::ForceOff { why: "its motors are too warm; let it rest for some minutes" },
        (4, 3) => DeviceState::ForceOff { why: "the hand moved too fast; hold the handle still for a moment" },
        (4, 4) => DeviceState::ForceOff { why: "its force is switched off; press the switch on the handle" },
        (4, 5) => DeviceState::ForceOff {
            why: "it detected a fault in its motors or sensors; switch it off and have it checked",
        },
        _ => DeviceState::ForceOff { why: "its state is unknown to this program; is its firmware newer?" },
    }
}

/// Parses a description report into a device specification, and whether the handle senses its orientation.
///
/// # Errors
///
/// Returns an error if force, stiffness, resolution or workspace is missing.
fn parse_description(report: &[u8; REPORT_LENGTH]) -> Result<(DeviceSpec, bool), OpenError> {
    // Dividing gives the float nearest to 0.02 mm for 20 µm; multiplying by the inverse would not.
    let per = |units: f32, at: usize| f32::from(u16_at(report, at)) / units;
    let abilities = report[26];
    let (has_force, has_torque, has_orientation) = (abilities & 1 != 0, abilities & 2 != 0, abilities & 4 != 0);
    let name = String::from_utf8_lossy(&report[28..60]).trim_end_matches('\0').trim().to_string();
    let spec = DeviceSpec {
        name: if name.is_empty() { PRODUCT.into() } else { name },
        max_force: per(1000.0, 6),
        continuous_force: per(1000.0, 8),
        max_torque: if has_torque { per(10.0, 10) } else { 0.0 },
        max_stiffness: per(1000.0, 12),
        max_damping: per(100_000.0, 14),
        resolution: per(10_000.0, 16),
        workspace_half: Vec3::new(per(10.0, 18), per(10.0, 20), per(10.0, 22)),
        apparent_mass: per(1000.0, 24),
        page_force: None,
    };
    let is_whole = has_force && spec.max_force > 0.0 && spec.max_stiffness > 0.0;
    if !is_whole || spec.resolution <= 0.0 || spec.workspace_half.min_element() <= 0.0 {
        return Err(OpenError::new(
            format!("the description of {} lacks a force, a stiffness, a resolution or a workspace", spec.name),
            "set the numbers in its description report as content/devices/open-handle.md says",
        ));
    }
    Ok((spec, has_orientation))
}

fn u16_at(report: &[u8; REPORT_LENGTH], at: usize) -> u16 {
    u16::from_le_bytes([report[at], report[at + 1]])
}

fn u32_at(report: &[u8; REPORT_LENGTH], at: usize) -> u32 {
    u32::from(u16_at(report, at)) | u32::from(u16_at(report, at + 2)) << 16
}

/// Driver of open handles.
pub struct OpenHandleDriver;

impl Driver for OpenHandleDriver {
    fn name(&self) -> &'static str {
        "open-handle"
    }

    fn description(&self) -> &'static str {
        "a home-built handle on a Teensy (content/devices/open-handle.md); the argument is its serial number"
    }

    fn hid_kinds(&self) -> &'static [HidMatch] {
        &[HID_MATCH]
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        Ok(hid::found_devices(handles()?))
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        let help = format!("plug it in; its firmware must have the product string \"{PRODUCT}\"");
        let plugged = hid::select(handles()?, argument, "open handle", &help)?;
        Ok(open_device(OpenHandleProtocol::handshake(hid::open(&plugged)?)?))
    }
}

fn handles() -> Result<Vec<HidDeviceInfo>, OpenError> {
    let mut handles = hid::find(&[HID_MATCH])?;
    handles.retain(|p| p.title == PRODUCT);
    Ok(handles)
}
