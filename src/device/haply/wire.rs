//! One arm and its grip on the Inverse Service, a thousand times a second.
//!
//! The service answers as often as it is asked, so the beat is kept here. Believes in a force only once the service says
//! that it renders a first, tiny one; lets go while answers come late, while the arm is not ready, and when the service
//! renders nothing of what it is told.

use super::protocol::{self, Arm, Command, ForceKey, Frame, Grip, Status};
use super::service::{Heard, Service};
use crate::device::{Beat, Gone, Output, Reading, Report, Spec, State, UPRIGHT, Wire};
use crate::frame::{Pose, Quat, Vec3};
use crate::tick::TICK_S;
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::Error;

pub struct Haply {
    service: Service,
    spec: Spec,
    arm: String,
    status: Status,
    held: Held,
    /// When the next frame is due.
    due: Instant,
    key: ForceKey,
    proof: Proof,
    /// Both names were tried in vain, and none has worked since.
    was_refused: bool,
    /// Told with the last frame, N, world space.
    told: Vec3,
    is_first: bool,
    /// Devices that the service was asked to describe.
    described: Vec<String>,
    wants_full_state: bool,
    late_in_a_row: u32,
    unreadable_since: Option<Instant>,
}

/// Whether the service renders what it is told.
enum Proof {
    /// Answers without a sign of the tiny force, under the name that is tried now.
    Trying {
        answers: u32,
        is_other_name: bool,
    },
    /// Answers in a row that deny the force that was told.
    Proven {
        denials: u32,
    },
    Refused {
        since: Instant,
    },
}

impl Proof {
    const START: Proof = Proof::Trying { answers: 0, is_other_name: false };
}

/// What the grip said last.
struct Held {
    id: Option<String>,
    orientation: Quat,
    buttons: u32,
    heard: Instant,
}

const BEAT: Duration = Duration::from_nanos((TICK_S * 1e9) as u64);

/// Too light to feel, far above the rounding of an echo, N: up, against the arm's own weight.
const TOUCH: Vec3 = Vec3::new(0.0, 0.02, 0.0);

/// Answers until a name counts as not understood. One would do in lockstep; the device itself is some ticks behind.
const TRIED_MAX: u32 = 50;

/// How long to wait until both names are tried again, as after an emergency stop.
const TRY_AGAIN: Duration = Duration::from_secs(1);

/// Answers in a row that deny a force, until the force counts as cut: a tenth of a second, as long as a stop takes to be noticed.
const DENIALS_MAX: u32 = 100;

/// Forces below this may vanish in the device's own filters, N. The first touch, twice as much, did not.
const DENIABLE: f32 = 0.01;

/// An answer after this is too late to be pushed by: the relay too lets go then.
const LATE: Duration = Duration::from_millis(20);

/// Late answers in a row until the service counts as slow; one may be the machine's hiccup.
const LATE_MAX: u32 = 3;

/// How long answers may be unreadable: the relay's own patience is longer, but cannot say why.
const UNREADABLE_MAX: Duration = Duration::from_millis(200);

/// How long a grip that is not heard of keeps its buttons: radio drops frames, but a bur must not run on by itself.
const BUTTON_LIFE: Duration = Duration::from_millis(500);

impl Haply {
    pub fn new(service: Service, arm: Arm, spec: Spec) -> Haply {
        let now = Instant::now();
        Haply {
            key: service.likely_key(),
            service,
            spec,
            described: vec![arm.id.clone()],
            arm: arm.id,
            status: arm.status,
            held: Held { id: None, orientation: UPRIGHT, buttons: 0, heard: now },
            due: now,
            proof: Proof::START,
            was_refused: false,
            told: Vec3::ZERO,
            is_first: true,
            wants_full_state: false,
            late_in_a_row: 0,
            unreadable_since: None,
        }
    }
}

impl Wire for Haply {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        Beat::Device
    }

    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        if self.service.is_answered() {
            let now = Instant::now();
            if now < self.due {
                // Waiting is a turn of its own, so that the force told after it is the newest.
                thread::sleep(self.due - now);
                return Ok(None);
            }
            self.due = now.max(self.due + BEAT);
            self.ask(told).map_err(|error| lost(&error))?;
        }
        match self.service.hear().map_err(|error| lost(&error))? {
            Heard::Nothing => Ok(None),
            Heard::Answer { text, after } => {
                self.late_in_a_row = if after > LATE { self.late_in_a_row.saturating_add(1) } else { 0 };
                self.read(&text)
            }
        }
    }

    fn close(&mut self) {
        self.service.close();
    }
}

impl Haply {
    fn ask(&mut self, told: &Output) -> Result<(), Box<Error>> {
        self.told = self.force(told);
        let is_configurable = self.service.likely_key() == ForceKey::Vector;
        let command = Command {
            arm: &self.arm,
            force: self.told,
            key: self.key,
            configures: std::mem::take(&mut self.is_first) && is_configurable,
            wants_full_state: std::mem::take(&mut self.wants_full_state),
        };
        self.service.ask(&protocol::command(&command))
    }

    /// What of a force is passed on, N.
    fn force(&self, told: &Output) -> Vec3 {
        match self.proof {
            _ if self.obstacle().is_some() => Vec3::ZERO,
            Proof::Trying { .. } => TOUCH,
            Proof::Proven { .. } if told.force.is_finite() => told.force.clamp_length_max(self.spec.max_force),
            Proof::Proven { .. } | Proof::Refused { .. } => Vec3::ZERO,
        }
    }

    /// What the arm waits for before any force is tried.
    fn obstacle(&self) -> Option<State> {
        let Status { calibrated, power_supply, ready } = self.status;
        if power_supply == Some(false) {
            return Some(State::ForceOff { why: "the arm has no power: plug in its power supply" });
        }
        if calibrated == Some(false) {
            return Some(State::Calibrate {
                how: "turn the arm as Haply's Device Manager shows until its light is steady",
            });
        }
        if ready == Some(false) {
            return Some(State::Homing { what: "the Inverse Service starts the arm" });
        }
        if self.late_in_a_row >= LATE_MAX {
            let why = "the Inverse Service answers too late: close other programs, use this machine's own service";
            return Some(State::ForceOff { why });
        }
        None
    }

    fn state(&self) -> State {
        if let Some(obstacle) = self.obstacle() {
            return obstacle;
        }
        match self.proof {
            Proof::Proven { .. } => State::Ready,
            Proof::Trying { .. } if !self.was_refused => {
                State::Homing { what: "trying whether the arm renders a force too light to feel" }
            }
            _ => State::ForceOff {
                why: "the Inverse Service takes forces but the arm renders none: release its stop, end other programs \
                      that use it, update the service",
            },
        }
    }

    fn read(&mut self, text: &str) -> Result<Option<Report>, Gone> {
        let Some(Frame { arms, grips }) = protocol::frame(text) else {
            let since = *self.unreadable_since.get_or_insert_with(Instant::now);
            let why = "what answers there cannot be read: restart the Inverse Service, update it or this program";
            return if since.elapsed() > UNREADABLE_MAX { Err(Gone::Lost { why, code: 0 }) } else { Ok(None) };
        };
        self.unreadable_since = None;
        let ids = arms.iter().map(|a| &a.id).chain(grips.iter().map(|g| &g.id));
        let strangers: Vec<String> = ids.filter(|id| !self.described.contains(id)).cloned().collect();
        self.wants_full_state |= !strangers.is_empty();
        self.described.extend(strangers);
        self.hold(&grips);
        let Some(arm) = arms.into_iter().find(|arm| arm.id == self.arm) else {
            return Ok(None);
        };
        self.status.update(arm.status);
        if self.obstacle().is_none() {
            self.prove(arm.rendered);
        }
        let Some(position) = arm.position else {
            return Ok(None);
        };
        let pose = Pose { position, orientation: self.held.orientation };
        Ok(Some(Report { reading: Reading { pose, buttons: self.held.buttons }, state: self.state() }))
    }

    /// Takes over what the grip in the hand says: the one held so far, else the first that is there.
    fn hold(&mut self, grips: &[Grip]) {
        let is_held = |grip: &&Grip| Some(&grip.id) == self.held.id.as_ref();
        let present = || grips.iter().filter(|grip| !grip.is_away);
        if let Some(grip) = present().find(is_held).or_else(|| present().find(|grip| grip.orientation.is_some())) {
            if Some(&grip.id) != self.held.id.as_ref() {
                self.held.buttons = 0;
            }
            self.held.id = Some(grip.id.clone());
            self.held.orientation = grip.orientation.unwrap_or(self.held.orientation);
            self.held.buttons = grip.buttons.unwrap_or(self.held.buttons);
            self.held.heard = Instant::now();
        } else if self.held.heard.elapsed() > BUTTON_LIFE {
            self.held.buttons = 0;
        }
    }

    /// Weighs what the service says it renders against what it was told.
    fn prove(&mut self, rendered: Option<Vec3>) {
        let rendered = rendered.unwrap_or(Vec3::ZERO);
        // A quarter: the device's own gates and filters may weaken a force.
        let agrees = rendered.dot(self.told) > 0.25 * self.told.length_squared();
        match &mut self.proof {
            Proof::Trying { .. } if self.told == TOUCH && agrees => {
                self.proof = Proof::Proven { denials: 0 };
                self.was_refused = false;
            }
            Proof::Trying { answers, .. } if *answers < TRIED_MAX => *answers += 1,
            Proof::Trying { is_other_name: false, .. } => {
                self.key = self.key.other();
                self.proof = Proof::Trying { answers: 0, is_other_name: true };
            }
            Proof::Trying { .. } => {
                self.key = self.key.other();
                self.was_refused = true;
                self.proof = Proof::Refused { since: Instant::now() };
            }
            Proof::Proven { .. } if self.told.length() < DENIABLE => {}
            Proof::Proven { denials } if agrees => *denials = 0,
            Proof::Proven { denials } if *denials < DENIALS_MAX => *denials += 1,
            Proof::Proven { .. } => {
                self.was_refused = true;
                self.proof = Proof::START;
            }
            Proof::Refused { since } if since.elapsed() > TRY_AGAIN => self.proof = Proof::START,
            Proof::Refused { .. } => {}
        }
    }
}

fn lost(error: &Error) -> Gone {
    let (why, code) = match error {
        Error::ConnectionClosed | Error::AlreadyClosed | Error::Protocol(_) => {
            ("the Inverse Service ended the connection: start it again", 0)
        }
        Error::Io(error) => {
            ("the connection to the Inverse Service broke: start it again", error.raw_os_error().unwrap_or(0))
        }
        _ => ("what answers there does not speak as the Inverse Service does: restart it", 0),
    };
    Gone::Lost { why, code }
}
