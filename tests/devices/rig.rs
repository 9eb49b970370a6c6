//! Interface of a fake device for the test suite: a simulated hand, and faults that can be switched on.

#![allow(dead_code)]

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, HandModel, Reading, SimulatedHand, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};

/// Starts the thread of a fake device, at raised priority, because a real device keeps its timing however busy the
/// computer is.
pub fn spawn_device(work: impl FnOnce() + Send + 'static) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        // If the system does not grant the priority, the fake runs like any other thread.
        let _ = typodont_devices::realtime::raise_thread_priority();
        work();
    })
}

/// A connected fake device of one kind.
pub trait Rig {
    /// Name of the device in `--device`.
    fn name(&self) -> &'static str;

    /// Opens it with its real driver, as `--device` would.
    fn open(&mut self) -> Result<Box<dyn Device + Send>, String>;

    /// The hand that holds the fake's handle.
    fn hand(&self) -> SharedHand;

    /// Capabilities of this kind of device; the suite tests only these.
    fn abilities(&self) -> Abilities;

    /// Share of the force it is told that the device lets be felt.
    fn force_share(&self) -> f32 {
        1.0
    }

    /// Switches on a fault until `recover`. Only faults listed in `abilities` are requested.
    fn misbehave(&mut self, how: Misbehaviour);

    /// Switches all faults off.
    fn recover(&mut self);
}

#[derive(Clone, Debug)]
pub struct Abilities {
    /// True if the device renders the force that the driver receives.
    pub force: bool,
    pub torque: bool,
    pub orientation: bool,
    pub buttons: bool,
    /// Resolution of positions, mm: positions are compared within twice this.
    pub resolution: f32,
    /// True if the device reports rates instead of positions: the suite then tests directions only.
    pub is_rate: bool,
    pub misbehaviours: &'static [Misbehaviour],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misbehaviour {
    /// The cable is unplugged, the service ends, or the sender stops.
    Unplug,
    /// Bytes that are not a valid message of the protocol, or numbers that are not finite.
    Garbage,
    /// Replies are delayed by 50 ms.
    Late,
    /// The device switched its force off because the hand was too fast.
    OverSpeed,
    /// The device switched its force off to let its motors cool.
    WarmMotors,
}

/// The physical model behind a fake, in world space (x right, y up, z toward the user; mm, N), seen from the fake's own
/// thread and from the test's.
#[derive(Clone)]
pub struct SharedHand(Arc<Mutex<Held>>);

struct Held {
    hand: SimulatedHand,
    /// Encoder step, mm.
    step: f32,
    orientation: Quat,
    buttons: u32,
    felt: Wrench,
    /// Maximum force since the last call of `most_felt`, N.
    most: f32,
    /// Time at which the fake last received a force other than zero.
    pushed: Option<Instant>,
    turns: u64,
}

impl SharedHand {
    /// A pen grip of 100 g in all, at rest in the middle of the workspace.
    pub fn at_rest(encoder_step: f32) -> SharedHand {
        let hand = SimulatedHand::resting_at(HandModel::holding(0.05, encoder_step), Vec3::ZERO);
        SharedHand(Arc::new(Mutex::new(Held {
            hand,
            step: encoder_step,
            orientation: UPRIGHT,
            buttons: 0,
            felt: Wrench::ZERO,
            most: 0.0,
            pushed: None,
            turns: 0,
        })))
    }

    fn held(&self) -> std::sync::MutexGuard<'_, Held> {
        self.0.lock().unwrap()
    }

    /// Advances the model by 1 ms with the force and torque received by the fake; returns the handle's reading.
    pub fn turn(&self, told: Wrench) -> Reading {
        let mut held = self.held();
        held.felt = told;
        held.most = held.most.max(told.force.length());
        if told.force != Vec3::ZERO {
            held.pushed = Some(Instant::now());
        }
        held.turns += 1;
        let reading = held.hand.step(&told);
        let pose = Pose { orientation: held.orientation, ..reading.pose };
        Reading { pose, buttons: held.buttons }
    }

    /// For the test: where the person wants the handle.
    pub fn reach(&self, goal: Vec3) {
        self.held().hand.goal = goal;
    }

    /// Holds so loosely that a spring leads the hand: its own weight and a little friction are left.
    pub fn let_loose(&self) {
        let mut held = self.held();
        let model = HandModel { grip_stiffness: 0.0, grip_damping: 0.001, ..HandModel::holding(0.05, held.step) };
        held.hand.set_model(model);
    }

    pub fn hold_tight(&self) {
        let mut held = self.held();
        let model = HandModel::holding(0.05, held.step);
        held.hand.goal = held.hand.position();
        held.hand.set_model(model);
    }

    pub fn goal(&self) -> Vec3 {
        self.held().hand.goal
    }

    pub fn turn_to(&self, orientation: Quat) {
        self.held().orientation = orientation;
    }

    pub fn press_buttons(&self, buttons: u32) {
        self.held().buttons = buttons;
    }

    /// Position of the handle, mm, finer than the resolution of its encoders.
    pub fn position(&self) -> Vec3 {
        self.held().hand.position()
    }

    /// mm/s
    pub fn velocity(&self) -> Vec3 {
        self.held().hand.velocity()
    }

    /// Force and torque that the fake renders now.
    pub fn felt(&self) -> Wrench {
        self.held().felt
    }

    /// Maximum force since the last call, N.
    pub fn most_felt(&self) -> f32 {
        std::mem::take(&mut self.held().most)
    }

    /// Time since the fake last received a force other than zero; `None` if it never did.
    pub fn since_pushed(&self) -> Option<Duration> {
        self.held().pushed.map(|at| at.elapsed())
    }

    /// Steps of the physical model so far.
    pub fn turns(&self) -> u64 {
        self.held().turns
    }
}
