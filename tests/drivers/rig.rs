//! What a fake offers to the suite: a hand that can be moved and felt, and ways to misbehave.

#![allow(dead_code)]

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use typodont::device::{Device, Hand, HandModel, Output, Reading, UPRIGHT};
use typodont::frame::{Pose, Quat, Vec3};

/// Starts a fake's thread. A device is no program of this machine: however busy that is, it keeps its own time.
pub fn spawn_device(work: impl FnOnce() + Send + 'static) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        // Where the system grants nothing, a fake is as late as everyone.
        let _ = typodont::device::realtime::raise();
        work();
    })
}

/// A fake device of one kind, plugged in.
pub trait Rig {
    /// What `--device` calls it.
    fn name(&self) -> &'static str;

    /// Opens it with its real driver, as `--device` would.
    fn open(&mut self) -> Result<Box<dyn Device + Send>, String>;

    /// The hand that holds the fake's handle.
    fn hand(&self) -> SharedHand;

    /// What this kind of device can do; the suite asks no more of it.
    fn abilities(&self) -> Abilities;

    /// From now on the fake misbehaves, until `recover`. Only what `abilities` lists is asked for.
    fn misbehave(&mut self, how: Misbehaviour);

    /// Plugged in again, cooled down, on time.
    fn recover(&mut self);
}

#[derive(Clone, Debug)]
pub struct Abilities {
    /// It renders force (the hand feels what the driver is told).
    pub force: bool,
    pub torque: bool,
    pub orientation: bool,
    pub buttons: bool,
    /// It counts in steps of so much, mm: positions are compared within twice this.
    pub resolution: f32,
    /// It reports rates, not places: the suite asks for directions only.
    pub is_rate: bool,
    pub misbehaviours: &'static [Misbehaviour],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misbehaviour {
    /// The cable is pulled, the service dies, the sender stops.
    Unplug,
    /// Bytes that are no message of the protocol, or numbers that are none.
    Garbage,
    /// Replies come 50 ms late.
    Late,
    /// The device cut its force because the hand was too fast.
    OverSpeed,
    /// The device cut its force to let its motors cool.
    WarmMotors,
}

/// The physical model behind a fake, in world space (x right, y up, z toward the user; mm, N), seen from the fake's own
/// thread and from the test's.
#[derive(Clone)]
pub struct SharedHand(Arc<Mutex<Held>>);

struct Held {
    hand: Hand,
    /// Encoder step, mm.
    step: f32,
    orientation: Quat,
    buttons: u32,
    felt: Output,
    /// Most force felt since last asked.
    most: f32,
    /// When the fake was last told a force that is not zero.
    pushed: Option<Instant>,
    turns: u64,
}

impl SharedHand {
    /// A pen grip of 100 g in all, at rest in the middle of the workspace.
    pub fn at_rest(encoder_step: f32) -> SharedHand {
        let hand = Hand::resting_at(HandModel::holding(0.05, encoder_step), Vec3::ZERO);
        SharedHand(Arc::new(Mutex::new(Held {
            hand,
            step: encoder_step,
            orientation: UPRIGHT,
            buttons: 0,
            felt: Output::NONE,
            most: 0.0,
            pushed: None,
            turns: 0,
        })))
    }

    fn held(&self) -> std::sync::MutexGuard<'_, Held> {
        self.0.lock().unwrap()
    }

    /// For the fake, once a millisecond: renders what it was told, gives where the handle is now.
    pub fn turn(&self, told: Output) -> Reading {
        let mut held = self.held();
        held.felt = told;
        held.most = held.most.max(told.force.length());
        if told.force != Vec3::ZERO {
            held.pushed = Some(Instant::now());
        }
        held.turns += 1;
        let reading = held.hand.turn(&told);
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

    /// Where the handle is, finer than its encoders.
    pub fn position(&self) -> Vec3 {
        self.held().hand.position()
    }

    /// mm/s
    pub fn velocity(&self) -> Vec3 {
        self.held().hand.velocity()
    }

    /// What the fake renders now.
    pub fn felt(&self) -> Output {
        self.held().felt
    }

    /// The most force since this was last asked, N.
    pub fn most_felt(&self) -> f32 {
        std::mem::take(&mut self.held().most)
    }

    /// How long ago the hand was last pushed; `None` for never.
    pub fn since_pushed(&self) -> Option<Duration> {
        self.held().pushed.map(|at| at.elapsed())
    }

    /// Turns of the physical model so far.
    pub fn turns(&self) -> u64 {
        self.held().turns
    }
}
