//! The protocol of one arm and its grip with the Inverse Service, at 1 kHz.
//!
//! Takes forces. Gives the poses of the arm with the orientation of the grip. The service answers as fast as it is
//! asked, so the rate is kept here. Never trusts a force before the service has reported that it renders a first,
//! tiny one. Sends no force while replies are late, while the arm is not ready, and while the service does not render
//! what it was sent.

use crate::haply::messages;
use crate::haply::messages::{ArmReport, ArmStatus, ForceKey, GripReport, HaplyCommand, StateFrame};
use crate::haply::service::{InverseService, ServiceReply};
use crate::{DeviceReport, Protocol};
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::Error;
use typodont_core::device::{DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::tick::TICK_S;

/// Protocol of one arm on the Inverse Service.
pub struct HaplyProtocol {
    service: InverseService,
    spec: DeviceSpec,
    arm: String,
    status: ArmStatus,
    grip: GripState,
    /// Time at which the next frame is due.
    next_due: Instant,
    key: ForceKey,
    force_check: ForceCheck,
    /// Both key names were tried without success, and neither has worked since.
    was_refused: bool,
    /// Force sent with the last frame, N, world space.
    sent_force: Vec3,
    is_first: bool,
    /// Devices whose configuration was requested.
    known_ids: Vec<String>,
    wants_full_state: bool,
    late_in_a_row: u32,
    unreadable_since: Option<Instant>,
}

/// Result of checking that the service renders the force it is sent.
enum ForceCheck {
    /// Replies without a sign of the tiny force, under the key name now tried.
    Trying {
        answers: u32,
        is_other_name: bool,
    },
    /// Consecutive replies that contradict the force sent.
    Verified {
        denials: u32,
    },
    Refused {
        since: Instant,
    },
}

impl ForceCheck {
    const START: ForceCheck = ForceCheck::Trying { answers: 0, is_other_name: false };
}

/// Last known state of the grip.
struct GripState {
    id: Option<String>,
    orientation: Quat,
    buttons: u32,
    updated_at: Instant,
}

const FRAME_INTERVAL: Duration = Duration::from_nanos((TICK_S * 1e9) as u64);

/// Too light to feel, but far above the rounding of the reported force, N: upward, against the arm's own weight.
const PROBE_FORCE: Vec3 = Vec3::new(0.0, 0.02, 0.0);

/// Replies after which a key name counts as not understood. One would suffice in lockstep, but the device lags some
/// ticks.
const MAX_PROBES: u32 = 50;

/// Time after which both names are tried again, as after an emergency stop.
const RETRY_AFTER: Duration = Duration::from_secs(1);

/// Consecutive replies that contradict a force, after which it counts as cut: 0.1 s, the time in which a stop must be
/// noticed.
const MAX_DENIALS: u32 = 100;

/// Forces below this may be removed by the device's own filters, N. The probe force, twice as large, was rendered.
const MIN_DENIABLE_FORCE: f32 = 0.01;

/// Time after which a reply is too late for a force to be sent: the relay releases the hand at the same age.
const LATE_REPLY: Duration = Duration::from_millis(20);

/// Consecutive late replies after which the service counts as slow; a single one may be a delay of the machine.
const MAX_LATE_REPLIES: u32 = 3;

/// Time for which replies may be unreadable. The relay waits longer, but cannot report the reason.
const UNREADABLE_TIMEOUT: Duration = Duration::from_millis(200);

/// Time for which a grip without reports keeps its buttons: radio drops frames, but a bur must not keep running by
/// itself.
const BUTTON_TIMEOUT: Duration = Duration::from_millis(500);

impl HaplyProtocol {
    pub fn new(service: InverseService, arm: ArmReport, spec: DeviceSpec) -> HaplyProtocol {
        let now = Instant::now();
        HaplyProtocol {
            key: service.default_force_key(),
            service,
            spec,
            known_ids: vec![arm.id.clone()],
            arm: arm.id,
            status: arm.status,
            grip: GripState { id: None, orientation: UPRIGHT, buttons: 0, updated_at: now },
            next_due: now,
            force_check: ForceCheck::START,
            was_refused: false,
            sent_force: Vec3::ZERO,
            is_first: true,
            wants_full_state: false,
            late_in_a_row: 0,
            unreadable_since: None,
        }
    }
}

impl Protocol for HaplyProtocol {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Device
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        if self.service.is_answered() {
            let now = Instant::now();
            if now < self.next_due {
                // Return after waiting, so that the next call sends the newest force.
                thread::sleep(self.next_due - now);
                return Ok(None);
            }
            self.next_due = now.max(self.next_due + FRAME_INTERVAL);
            self.send_frame(output).map_err(|error| device_lost(&error))?;
        }
        match self.service.receive().map_err(|error| device_lost(&error))? {
            ServiceReply::Nothing => Ok(None),
            ServiceReply::Answer { text, elapsed } => {
                self.late_in_a_row = if elapsed > LATE_REPLY { self.late_in_a_row.saturating_add(1) } else { 0 };
                self.interpret(&text)
            }
        }
    }

    fn close(&mut self) {
        self.service.close();
    }
}

impl HaplyProtocol {
    fn send_frame(&mut self, output: &Wrench) -> Result<(), Box<Error>> {
        self.sent_force = self.force_to_send(output);
        let is_configurable = self.service.default_force_key() == ForceKey::Vector;
        let command = HaplyCommand {
            arm: &self.arm,
            force: self.sent_force,
            key: self.key,
            sends_configuration: std::mem::take(&mut self.is_first) && is_configurable,
            wants_full_state: std::mem::take(&mut self.wants_full_state),
        };
        self.service.send(&messages::encode_command(&command))
    }

    /// Returns the force to send, N.
    fn force_to_send(&self, output: &Wrench) -> Vec3 {
        match self.force_check {
            _ if self.blocking_state().is_some() => Vec3::ZERO,
            ForceCheck::Trying { .. } => PROBE_FORCE,
            ForceCheck::Verified { .. } if output.force.is_finite() => {
                output.force.clamp_length_max(self.spec.max_force)
            }
            ForceCheck::Verified { .. } | ForceCheck::Refused { .. } => Vec3::ZERO,
        }
    }

    /// Returns the state in which no force is tried, if there is one.
    fn blocking_state(&self) -> Option<DeviceState> {
        let ArmStatus { calibrated, power_supply, ready } = self.status;
        if power_supply == Some(false) {
            return Some(DeviceState::ForceOff { why: "the arm has no power: plug in its power supply" });
        }
        if calibrated == Some(false) {
            return Some(DeviceState::Calibrate {
                how: "move the arm as Haply's Device Manager shows until its light is steady",
            });
        }
        if ready == Some(false) {
            return Some(DeviceState::Homing { what: "the Inverse Service is starting the arm" });
        }
        if self.late_in_a_row >= MAX_LATE_REPLIES {
            let why = "the Inverse Service responds too late: close other programs, use the service of this machine";
            return Some(DeviceState::ForceOff { why });
        }
        None
    }

    fn state(&self) -> DeviceState {
        if let Some(state) = self.blocking_state() {
            return state;
        }
        match self.force_check {
            ForceCheck::Verified { .. } => DeviceState::Ready,
            ForceCheck::Trying { .. } if !self.was_refused => {
                DeviceState::Homing { what: "testing the arm with a force too light to feel" }
            }
            _ => DeviceState::ForceOff {
                why: "the Inverse Service accepts forces but the arm renders none: release its stop, close other \
                      programs that use it, update the service",
            },
        }
    }

    fn interpret(&mut self, text: &str) -> Result<Option<DeviceReport>, DeviceError> {
        let Some(StateFrame { arms, grips }) = messages::parse_frame(text) else {
            let since = *self.unreadable_since.get_or_insert_with(Instant::now);
            let why = "the replies of the Inverse Service cannot be read: restart it, or update it or this program";
            return if since.elapsed() > UNREADABLE_TIMEOUT {
                Err(DeviceError::Lost { why, code: 0 })
            } else {
                Ok(None)
            };
        };
        self.unreadable_since = None;
        let ids = arms.iter().map(|a| &a.id).chain(grips.iter().map(|g| &g.id));
        let unknown_ids: Vec<String> = ids.filter(|id| !self.known_ids.contains(id)).cloned().collect();
        self.wants_full_state |= !unknown_ids.is_empty();
        self.known_ids.extend(unknown_ids);
        self.update_grip(&grips);
        let Some(arm) = arms.into_iter().find(|arm| arm.id == self.arm) else {
            return Ok(None);
        };
        self.status.update(arm.status);
        if self.blocking_state().is_none() {
            self.check_rendered_force(arm.rendered);
        }
        let Some(position) = arm.position else {
            return Ok(None);
        };
        let pose = Pose { position, orientation: self.grip.orientation };
        Ok(Some(DeviceReport { reading: Reading { pose, buttons: self.grip.buttons }, state: self.state() }))
    }

    /// Updates the state of the grip in use: the last one, if it is present, else the first one available.
    fn update_grip(&mut self, grips: &[GripReport]) {
        let is_current = |grip: &&GripReport| Some(&grip.id) == self.grip.id.as_ref();
        let present = || grips.iter().filter(|grip| !grip.is_unavailable);
        if let Some(grip) = present().find(is_current).or_else(|| present().find(|grip| grip.orientation.is_some())) {
            if Some(&grip.id) != self.grip.id.as_ref() {
                self.grip.buttons = 0;
            }
            self.grip.id = Some(grip.id.clone());
            self.grip.orientation = grip.orientation.unwrap_or(self.grip.orientation);
            self.grip.buttons = grip.buttons.unwrap_or(self.grip.buttons);
            self.grip.updated_at = Instant::now();
        } else if self.grip.updated_at.elapsed() > BUTTON_TIMEOUT {
            self.grip.buttons = 0;
        }
    }

    /// Compares the force that the service reports with the force it was sent.
    fn check_rendered_force(&mut self, rendered: Option<Vec3>) {
        let rendered = rendered.unwrap_or(Vec3::ZERO);
        // A quarter, because the device's own gates and filters may reduce a force.
        let agrees = rendered.dot(self.sent_force) > 0.25 * self.sent_force.length_squared();
        match &mut self.force_check {
            ForceCheck::Trying { .. } if self.sent_force == PROBE_FORCE && agrees => {
                self.force_check = ForceCheck::Verified { denials: 0 };
                self.was_refused = false;
            }
            ForceCheck::Trying { answers, .. } if *answers < MAX_PROBES => *answers += 1,
            ForceCheck::Trying { is_other_name: false, .. } => {
                self.key = self.key.other();
                self.force_check = ForceCheck::Trying { answers: 0, is_other_name: true };
            }
            ForceCheck::Trying { .. } => {
                self.key = self.key.other();
                self.was_refused = true;
                self.force_check = ForceCheck::Refused { since: Instant::now() };
            }
            ForceCheck::Verified { .. } if self.sent_force.length() < MIN_DENIABLE_FORCE => {}
            ForceCheck::Verified { denials } if agrees => *denials = 0,
            ForceCheck::Verified { denials } if *denials < MAX_DENIALS => *denials += 1,
            ForceCheck::Verified { .. } => {
                self.was_refused = true;
                self.force_check = ForceCheck::START;
            }
            ForceCheck::Refused { since } if since.elapsed() > RETRY_AFTER => self.force_check = ForceCheck::START,
            ForceCheck::Refused { .. } => {}
        }
    }
}

fn device_lost(error: &Error) -> DeviceError {
    let (why, code) = match error {
        Error::ConnectionClosed | Error::AlreadyClosed | Error::Protocol(_) => {
            ("the Inverse Service ended the connection: restart it", 0)
        }
        Error::Io(error) => {
            ("the connection to the Inverse Service failed: restart it", error.raw_os_error().unwrap_or(0))
        }
        _ => ("the replies are not those of the Inverse Service: restart it", 0),
    };
    DeviceError::Lost { why, code }
}
