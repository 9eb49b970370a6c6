//! The open handle: a profile of our own for haptic handles that a school builds on a Teensy.
//!
//! Takes a force and says for how long it holds. Gives what the handle reports a thousand times a second, on its own beat.
//! The bytes, the rules for the firmware and an example stand in `content/devices/open-handle.md`; this file is the host's
//! half of it.

use super::hid::{self, Kind, Plugged, REPORT_MAX, Transport};
use super::trust::Trust;
use super::{Beat, Device, Driver, Found, Gone, Output, Reading, Relay, Report, Spec, State, Trouble, UPRIGHT, Wire};
use crate::frame::{Pose, Quat, Vec3};
use std::time::{Duration, Instant};

/// What the firmware must call itself, to be told from every other Teensy.
pub const PRODUCT: &str = "Typodont Handle";

/// Teensy's raw HID.
pub const KIND: Kind = Kind { vendor: 0x16c0, products: &[0x0486], usage: Some((0xffab, 0x0200)) };

const REPORT: usize = 64;
const FROM_HANDLE: [u8; 2] = *b"TH";
const FROM_HOST: [u8; 2] = *b"TO";
const VERSION: u8 = 1;

/// What a report is, in its fourth byte.
const STATE: u8 = 1;
const SPEC: u8 = 2;
const ORDER: u8 = 1;
const ASK: u8 = 2;

/// After this long without a new order the handle lets go by itself. Twice what the relay lets a force live: it acts when
/// the program has died, not when it is late.
const LIFE_MS: u16 = 20;

/// How long one turn waits for a report.
const WAIT: Duration = Duration::from_millis(10);

/// How long a handle may take to say what it is, and how often it is asked.
const INTRODUCTION: Duration = Duration::from_secs(2);
const ASK_EVERY: Duration = Duration::from_millis(50);

/// An order that is obeyed later than this means that the hand feels what was: as the relay's reports.
const OBEYED_LATE: Duration = Duration::from_millis(20);

/// Orders whose time of sending is remembered.
const REMEMBERED: usize = 256;

/// A handle on a transport.
pub struct OpenHandle<T> {
    transport: T,
    spec: Spec,
    has_orientation: bool,
    trust: Trust,
    /// The newest report's number.
    heard: Option<u16>,
    order: u16,
    sent_at: [Option<Instant>; REMEMBERED],
    is_ready: bool,
}

impl<T: Transport> OpenHandle<T> {
    /// Asks the handle what it is.
    pub fn meet(mut transport: T) -> Result<OpenHandle<T>, Trouble> {
        let silent = || {
            Trouble::new(
                "the handle does not say what it is",
                "its firmware must answer as content/devices/open-handle.md says; plug it in again, or load it anew",
            )
        };
        let broken = |gone: Gone| Trouble::new(gone.to_string(), "plug the handle in again");
        let until = Instant::now() + INTRODUCTION;
        while Instant::now() < until {
            transport.write(&sealed(FROM_HOST, ASK, 0, &[])).map_err(broken)?;
            let ask_again = Instant::now() + ASK_EVERY;
            while Instant::now() < ask_again {
                let mut report = [0; REPORT_MAX];
                let length = transport.read(&mut report, WAIT).map_err(broken)?;
                if let Some(body) = opened(&report[..length]).filter(|r| r[3] == SPEC) {
                    let (spec, has_orientation) = introduction(body)?;
                    return Ok(OpenHandle::of(transport, spec, has_orientation));
                }
            }
        }
        Err(silent())
    }

    fn of(transport: T, spec: Spec, has_orientation: bool) -> OpenHandle<T> {
        // A corner of the box, and as much again for where a hand leans.
        let reach = spec.workspace_half.length() * 2.0;
        let not_ours = "its reports are damaged or not those of this version; check its cable and its firmware";
        OpenHandle {
            transport,
            spec,
            has_orientation,
            trust: Trust::new(reach, not_ours),
            heard: None,
            order: 0,
            sent_at: [None; REMEMBERED],
            is_ready: false,
        }
    }

    fn send(&mut self, told: &Output) -> Result<(), Gone> {
        let now = Instant::now();
        let may_push = self.is_ready && self.trust.is_fresh(now) && told.force.is_finite() && told.torque.is_finite();
        let told = if may_push { *told } else { Output::NONE };
        let force = told.force.clamp_length_max(self.spec.max_force);
        let torque = told.torque.clamp_length_max(self.spec.max_torque);
        let mut body = [0; 28];
        body[..2].copy_from_slice(&self.heard.unwrap_or(0).to_le_bytes());
        let numbers = force.to_array().into_iter().chain(torque.to_array());
        body[2..26].chunks_exact_mut(4).zip(numbers).for_each(|(four, n)| four.copy_from_slice(&n.to_le_bytes()));
        body[26..].copy_from_slice(&LIFE_MS.to_le_bytes());
        self.order = self.order.wrapping_add(1);
        self.sent_at[usize::from(self.order) % REMEMBERED] = Some(now);
        self.transport.write(&sealed(FROM_HOST, ORDER, self.order, &body))
    }

    /// Whether the handle obeys orders of long ago.
    fn is_behind(&self, obeyed: u16, now: Instant) -> bool {
        let behind = self.order.wrapping_sub(obeyed);
        match usize::from(behind) < REMEMBERED {
            true => {
                let sent = self.sent_at[usize::from(obeyed) % REMEMBERED];
                sent.is_some_and(|at| now.saturating_duration_since(at) > OBEYED_LATE)
            }
            // None obeyed yet, or so long ago that it is forgotten.
            false => true,
        }
    }
}

impl<T: Transport> Wire for OpenHandle<T> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        Beat::Device
    }

    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        self.send(told)?;
        let mut report = [0; REPORT_MAX];
        let length = self.transport.newest(&mut report, WAIT)?;
        if length == 0 {
            return Ok(None);
        }
        let Some(body) = opened(&report[..length]) else {
            self.trust.unsound()?;
            return Ok(None);
        };
        if body[3] != STATE {
            return Ok(None);
        }
        let said = Said::of(body, self.has_orientation);
        // A handle that repeats itself is stuck: that is silence.
        if self.heard == Some(said.number) {
            return Ok(None);
        }
        let now = Instant::now();
        let Some(reading) = said.reading else {
            self.trust.unsound()?;
            return Ok(None);
        };
        if !self.trust.is_sound(reading.pose.position, now)? {
            return Ok(None);
        }
        let is_first = self.heard.replace(said.number).is_none();
        if !is_first && self.order > 1 && self.is_behind(said.obeyed, now) {
            self.trust.stale(now);
        }
        self.is_ready = said.state.is_ready();
        let state = if self.is_ready { self.trust.state(now) } else { said.state };
        Ok(Some(Report { reading, state }))
    }

    fn close(&mut self) {
        self.is_ready = false;
        // If the handle does not hear it, it lets go when its last order's life is over.
        let _ = self.send(&Output::NONE);
    }
}

/// A report to the handle, with the id byte that raw HID wants and the checksum.
fn sealed(magic: [u8; 2], kind: u8, number: u16, body: &[u8]) -> [u8; REPORT + 1] {
    let mut report = [0; REPORT + 1];
    let bytes = &mut report[1..];
    bytes[..2].copy_from_slice(&magic);
    bytes[2] = VERSION;
    bytes[3] = kind;
    bytes[4..6].copy_from_slice(&number.to_le_bytes());
    bytes[6..6 + body.len()].copy_from_slice(body);
    let sum = crc32fast::hash(&bytes[..REPORT - 4]);
    bytes[REPORT - 4..].copy_from_slice(&sum.to_le_bytes());
    report
}

/// A report of the handle, if it is whole and of our version.
fn opened(report: &[u8]) -> Option<&[u8; REPORT]> {
    let report: &[u8; REPORT] = report.first_chunk()?;
    let is_ours = report[..2] == FROM_HANDLE && report[2] == VERSION;
    let is_whole = crc32fast::hash(&report[..REPORT - 4]) == u32_at(report, REPORT - 4);
    (is_ours && is_whole).then_some(report)
}

/// What a report of state says.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Said {
    number: u16,
    /// The last order that it obeyed.
    obeyed: u16,
    state: State,
    /// None if it cannot be: an orientation that is none.
    reading: Option<Reading>,
}

/// One unit of a position, mm: 0.1 µm.
const POSITION_UNIT: f64 = 1e-4;

/// One unit of a quaternion.
const TURN_UNIT: f32 = 1.0 / 32767.0;

impl Said {
    fn of(report: &[u8; REPORT], has_orientation: bool) -> Said {
        let coordinate = |at| (f64::from(u32_at(report, at) as i32) * POSITION_UNIT) as f32;
        let position = Vec3::new(coordinate(16), coordinate(20), coordinate(24));
        let part = |at| f32::from(u16_at(report, at) as i16) * TURN_UNIT;
        let turned = Quat::from_xyzw(part(28), part(30), part(32), part(34));
        let orientation = if has_orientation { turned } else { UPRIGHT };
        let pose = Pose { position, orientation };
        let sound = pose.is_sound().then(|| Pose { orientation: orientation.normalize(), ..pose });
        Said {
            number: u16_at(report, 4),
            obeyed: u16_at(report, 6),
            state: state(report[8], report[9]),
            reading: sound.map(|pose| Reading { pose, buttons: u32_at(report, 12) }),
        }
    }
}

fn state(state: u8, cause: u8) -> State {
    match (state, cause) {
        (0, _) => State::Homing { what: "the handle is starting" },
        (1, _) => State::Calibrate { how: "put the handle in its rest and press its button" },
        (2, _) => State::Homing { what: "the handle is finding its middle; keep your hands off" },
        (3, _) => State::Ready,
        (4, 1) => State::ForceOff { why: "the orders came too late; close busy programs" },
        (4, 2) => State::ForceOff { why: "its motors are too warm; let it rest for some minutes" },
        (4, 3) => State::ForceOff { why: "the hand was too fast; hold the handle still for a moment" },
        (4, 4) => State::ForceOff { why: "its force is switched off; press the switch on the handle" },
        (4, 5) => {
            State::ForceOff { why: "it found a fault in its motors or sensors; switch it off and have it checked" }
        }
        _ => State::ForceOff { why: "its state is not known to this program; is its firmware newer?" },
    }
}

/// What a handle says that it is, and whether it senses how it is turned.
fn introduction(report: &[u8; REPORT]) -> Result<(Spec, bool), Trouble> {
    // Divided, so that 20 µm become the number nearest to 0.02 mm.
    let per = |units: f32, at: usize| f32::from(u16_at(report, at)) / units;
    let abilities = report[26];
    let (has_force, has_torque, has_orientation) = (abilities & 1 != 0, abilities & 2 != 0, abilities & 4 != 0);
    let name = String::from_utf8_lossy(&report[28..60]).trim_end_matches('\0').trim().to_string();
    let spec = Spec {
        name: if name.is_empty() { PRODUCT.into() } else { name },
        max_force: per(1000.0, 6),
        continuous_force: per(1000.0, 8),
        max_torque: if has_torque { per(10.0, 10) } else { 0.0 },
        max_stiffness: per(1000.0, 12),
        max_damping: per(100_000.0, 14),
        resolution: per(10_000.0, 16),
        workspace_half: Vec3::new(per(10.0, 18), per(10.0, 20), per(10.0, 22)),
        apparent_mass: per(1000.0, 24),
    };
    let is_whole = has_force && spec.max_force > 0.0 && spec.max_stiffness > 0.0;
    if !is_whole || spec.resolution <= 0.0 || spec.workspace_half.min_element() <= 0.0 {
        return Err(Trouble::new(
            format!("{} says that it has no force, no stiffness, no step or no workspace", spec.name),
            "set the numbers of its description report as content/devices/open-handle.md says",
        ));
    }
    Ok((spec, has_orientation))
}

fn u16_at(report: &[u8; REPORT], at: usize) -> u16 {
    u16::from_le_bytes([report[at], report[at + 1]])
}

fn u32_at(report: &[u8; REPORT], at: usize) -> u32 {
    u32::from(u16_at(report, at)) | u32::from(u16_at(report, at + 2)) << 16
}

/// `--device open-handle`.
pub struct OpenHandleDriver;

impl Driver for OpenHandleDriver {
    fn name(&self) -> &'static str {
        "open-handle"
    }

    fn about(&self) -> &'static str {
        "a home-built handle on a Teensy (content/devices/open-handle.md); after the colon a serial number, if there are several"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        Ok(hid::listed(handles()?))
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        let help = format!("plug it in; its firmware must call itself \"{PRODUCT}\"");
        let plugged = hid::chosen(handles()?, argument, "open handle", &help)?;
        Ok(Box::new(Relay::start(OpenHandle::meet(hid::open(&plugged)?)?)))
    }
}

fn handles() -> Result<Vec<Plugged>, Trouble> {
    let mut handles = hid::find(&[KIND])?;
    handles.retain(|p| p.title == PRODUCT);
    Ok(handles)
}
