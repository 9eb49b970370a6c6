//! The world of one session, turned one tick at a time.
//!
//! Takes readings, gives forces and edits: live session, headless run, replay, tests and benchmarks all turn the same
//! [`Simulation::step`], and [`Servo`] turns it at 1 kHz with a device in somebody's hand. A step never reads a clock, draws
//! an unseeded number, knows a scenario, or allocates.

mod assist;
mod attend;
mod beats;
mod pace;
mod servo;

pub use assist::{Assist, AssistNews, Role, Second};
pub use beats::{BeatSummary, Beats, Histogram};
pub use servo::{Ended, Letter, Order, Servo, Turn};

use crate::device::{Output, Reading, Spec};
use crate::frame::{Pose, Vec3};
use crate::tick::Tick;
use crate::touch::{
    Carver, Carving, Coefficient, Contact, Factors, Filling, ForceLimit, Gate, Guidance, Guide, Instrument, Law,
    Materials, Matter, Packer, Press, Proxy, Pull, SpringLimit, Vibration,
};
use crate::volume::{Edit, Label, Volume};

/// Everything a simulation is made of.
#[derive(Clone, Debug)]
pub struct Setup {
    pub matter: Matter,
    pub materials: Materials,
    /// What each instrument makes of them, in the instruments' order; nothing for those beyond the list.
    pub factors: Vec<Factors>,
    /// In the order in which [`Command::Take`] counts them; the first is in the hand at start.
    pub instruments: Vec<Instrument>,
    pub carving: Carving,
    /// What can be laid and condensed.
    pub fillings: Vec<Filling>,
    pub vibration: Vibration,
    /// In the order in which [`Command::Guide`] counts them.
    pub guidances: Vec<Guidance>,
    pub world_from_tooth: Pose,
    pub device: Spec,
    /// Ticks over which forces come in after the hand was let go: at the start, after another instrument was taken, after a
    /// reading that could not be trusted.
    pub ramp: u32,
}

/// Half a second: long enough for a hand to notice and yield, short enough not to hide a touch.
pub const RAMP_TICKS: u32 = 500;

/// What the session may change between two ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Takes another instrument into the hand.
    Take { instrument: usize },
    /// Gives one of a tissue's coefficients another value, in its unit, before each instrument's own factors.
    Set { label: Label, coefficient: Coefficient, value: f32 },
    /// Lets burs run, or stops them.
    RunBur { running: bool },
    /// Leads the hand by a guidance from its beginning, or by none.
    Guide { guidance: Option<usize> },
    /// Gives carriers a filling to lay, or none.
    Fill { label: Option<Label> },
}

/// What one tick came to. Positions and forces in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub tick: Tick,
    /// To be rendered by the device, N.
    pub force: Vec3,
    /// To be rendered about the tip, N·mm.
    pub torque: Vec3,
    /// Where the hand is, mm; the last trusted place when the reading was refused.
    pub hand: Vec3,
    /// Where the working end is, mm: as deep in soft matter as it is pressed.
    pub tip: Vec3,
    /// Unit, from the working end along the handle toward the hand.
    pub shaft: Vec3,
    pub touch: Option<Touch>,
    /// Matter fell, or would have within this tick's limits.
    pub cutting: bool,
    /// Voxels that became air.
    pub removed: u32,
    /// How another hand led this one, N: part of `force`.
    pub lead: Vec3,
    /// How the exercise led the hand, N: part of `force`.
    pub guidance: Vec3,
    /// Index of the instrument in the hand.
    pub instrument: usize,
}

impl Step {
    /// What the device is told.
    pub fn output(&self) -> Output {
        Output { force: self.force, torque: self.torque }
    }
}

/// What the working end touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Tissue that carries most of the push.
    pub label: Label,
    /// The spring's part of the force, N.
    pub spring: f32,
    /// Unit, out of the matter, world space.
    pub normal: Vec3,
}

/// How far a hand may have gone, mm, and turned, rad, while it could not be trusted, to take up its working end where that was:
/// a busy machine's hiccup is no reason to pass through the tooth. Its force comes back softly.
const SLIP: f32 = 2.0;
const TWIST: f32 = 0.2;

/// A hand that could not be trusted any more, tooth space.
#[derive(Clone, Copy, Debug)]
struct Left {
    hand: Pose,
    tip: Vec3,
}

impl Left {
    fn is_back(&self, held: &Pose) -> bool {
        let is_near = self.hand.position.distance(held.position) < SLIP;
        is_near && self.hand.orientation.angle_between(held.orientation) < TWIST
    }
}

/// The state of one session's world.
#[derive(Clone, Debug)]
pub struct Simulation {
    matter: Matter,
    /// How the tissues answer each instrument.
    materials: Vec<Materials>,
    factors: Vec<Factors>,
    instruments: Vec<Instrument>,
    vibration: Vibration,
    guide: Guide,
    world_from_tooth: Pose,
    tooth_from_world: Pose,
    force_limit: ForceLimit,
    tick: Tick,
    instrument: usize,
    bur_runs: bool,
    /// False until the working end has been out of matter once: whoever starts or changes instruments inside a tooth
    /// feels nothing until then, instead of being thrown out. So does a hand that was let go and is not back where it was.
    is_out: bool,
    /// Where hand and working end were when the hand could not be trusted any more.
    left_at: Option<Left>,
    ramp: u32,
    /// Ticks since the hand was let go, up to `ramp`.
    eased: u32,
    lead: Vec3,
    hand: Pose,
    proxy: Proxy,
    law: Law,
    carver: Carver,
    fillings: Vec<Filling>,
    /// Index into `fillings` of what is given.
    filling: Option<usize>,
    packer: Packer,
    gate: Gate,
}

impl Simulation {
    /// A world at rest with the first instrument in the hand and the bur running.
    ///
    /// # Panics
    /// Without any instrument: a scenario that resolved has one.
    pub fn new(setup: Setup) -> Simulation {
        let Setup {
            matter,
            materials,
            mut factors,
            instruments,
            carving,
            fillings,
            vibration,
            guidances,
            world_from_tooth,
            device,
            ramp,
        } = setup;
        assert!(!instruments.is_empty(), "a hand holds something");
        factors.resize(instruments.len(), Factors::default());
        let spring = SpringLimit {
            max_stiffness: device.max_stiffness,
            max_damping: device.max_damping,
            resolution: device.resolution,
        };
        let tooth_from_world = world_from_tooth.inverse();
        let proxy = Proxy::new(&matter, &instruments, tooth_from_world * Vec3::ZERO);
        Simulation {
            matter,
            materials: factors.iter().map(|f| materials.clone().times(f)).collect(),
            factors,
            instruments,
            vibration,
            guide: Guide::new(guidances, &spring),
            world_from_tooth,
            tooth_from_world,
            force_limit: ForceLimit { max_force: device.max_force, max_torque: device.max_torque },
            tick: Tick::ZERO,
            instrument: 0,
            bur_runs: true,
            is_out: false,
            left_at: None,
            ramp,
            eased: 0,
            lead: Vec3::ZERO,
            hand: Pose::IDENTITY,
            proxy,
            law: Law::new(spring),
            carver: Carver::new(carving),
            fillings,
            filling: None,
            packer: Packer::new(),
            gate: Gate::default(),
        }
    }

    /// Turns the world by one tick.
    ///
    /// A reading that cannot be trusted (not finite, no orientation) gives zero force and leaves the world as it was. A hand
    /// that is trusted again finds the working end where it was, unless it has gone too far on inside matter.
    pub fn step(&mut self, reading: &Reading) -> Step {
        let tick = self.tick;
        self.tick = tick.next();
        let Some(pose) = self.gate.admit(&reading.pose) else {
            if self.is_out {
                self.left_at = Some(Left { hand: self.tooth_from_world * self.hand, tip: self.proxy.tip() });
            }
            self.is_out = false;
            return self.let_go(tick);
        };
        self.hand = pose;
        let held = self.tooth_from_world * pose;
        let hand = held.position;
        let instrument = &self.instruments[self.instrument];
        if !self.is_out {
            self.is_out = Proxy::is_free_at(&self.matter, instrument, &held);
            let step = self.let_go(tick);
            // From there it follows the hand, which may be free by now, or on the other side of a wall.
            if let Some(left) = self.left_at.take().filter(|left| left.is_back(&held)) {
                self.proxy.let_go(left.tip);
                self.is_out = true;
            }
            return step;
        }
        let eased = self.ease_in();
        let instrument = &self.instruments[self.instrument];
        let materials = &self.materials[self.instrument];
        self.proxy.follow(&self.matter, instrument, materials, &held);
        let tip = self.proxy.tip();
        let contact = self.proxy.contact().copied();
        let pull = self.law.pull(hand, tip, contact.as_ref());
        let cutting = match contact {
            // A bur that leans on its shank presses the less with what cuts, and without it not at all. And nobody cuts with a
            // force that is not felt yet.
            Some(Contact { at_head, label, .. }) if instrument.cuts && self.bur_runs && at_head > 0.0 => {
                let pull = Pull { spring: pull.spring * at_head * eased, ..pull };
                let press = Press { tip, hand, orientation: held.orientation, pull, label };
                self.packer.rest();
                self.carver.cut(&mut self.matter.volume, instrument, materials, &press)
            }
            Some(Contact { at_head, label, .. }) if instrument.packs.is_some() && at_head > 0.0 => {
                self.carver.rest();
                let pull = Pull { spring: pull.spring * at_head * eased, ..pull };
                let press = Press { tip, hand, orientation: held.orientation, pull, label };
                match self.filling.zip(instrument.packs.as_ref()) {
                    Some((filling, packs)) => {
                        self.packer.pack(&mut self.matter, instrument, packs, &self.fillings[filling], &press);
                    }
                    None => self.packer.rest(),
                }
                false
            }
            _ => {
                self.carver.rest();
                self.packer.rest();
                false
            }
        };
        if !self.packer.edits().is_empty() {
            self.proxy.look_again();
        }
        let tremble = if cutting && instrument.turns { self.vibration.force(tick) } else { Vec3::ZERO };
        let mut force = (self.world_from_tooth.turn(pull.force) + tremble) * eased;
        if self.lead != Vec3::ZERO {
            force += self.lead;
        }
        let guidance = self.guide.force(tick, hand, self.law.velocity(), &self.world_from_tooth);
        if guidance != Vec3::ZERO {
            force += guidance;
        }
        let force = self.gate.emit(force, &self.force_limit);
        let lever = contact.map_or(Vec3::ZERO, |c| c.lever);
        let torque = self.world_from_tooth.turn(lever * pull.force.length()) * eased;
        let torque = self.gate.emit_torque(torque, &self.force_limit);
        let touch = contact.map(|Contact { label, normal, .. }| Touch {
            label,
            spring: pull.spring,
            normal: self.world_from_tooth.turn(normal),
        });
        // Only matter of a sulcus' floor gives way; all other tips are where they may be, to the bit.
        let sunk = contact.and_then(|c| self.matter.sinking(c.label, tip, pull.spring));
        let shown = sunk.map_or(tip, |(depth, out)| tip - out * depth.min((hand - tip).length()));
        Step {
            tick,
            force,
            torque,
            hand: pose.position,
            tip: self.world_from_tooth * shown,
            shaft: pose.turn(Vec3::Z),
            touch,
            cutting,
            removed: self.edits().iter().filter(|e| e.removes()).count() as u32,
            lead: self.lead,
            guidance,
            instrument: self.instrument,
        }
    }

    /// Share of a force that the hand is given: rises from 0 to 1 after it was let go.
    fn ease_in(&mut self) -> f32 {
        if self.eased >= self.ramp {
            return 1.0;
        }
        self.eased += 1;
        self.eased as f32 / self.ramp as f32
    }

    /// Zero force, nothing touched, nothing cut.
    fn let_go(&mut self, tick: Tick) -> Step {
        self.eased = 0;
        self.carver.rest();
        self.packer.rest();
        self.law.forget();
        self.guide.let_go();
        self.proxy.let_go(self.tooth_from_world * self.hand.position);
        Step {
            tick,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            hand: self.hand.position,
            tip: self.hand.position,
            shaft: self.hand.turn(Vec3::Z),
            touch: None,
            cutting: false,
            removed: 0,
            lead: Vec3::ZERO,
            guidance: Vec3::ZERO,
            instrument: self.instrument,
        }
    }

    /// True while the hand is free because it was let go, and has neither been out of matter since nor taken hold again.
    pub fn has_let_go(&self) -> bool {
        !self.is_out
    }

    /// Another hand leads this one with a force, N, world space, from the next tick on. A force that is not finite is none.
    pub fn lead(&mut self, force: Vec3) {
        self.lead = if force.is_finite() { force } else { Vec3::ZERO };
    }

    /// Carries out a command before the next tick. Unknown instruments are ignored: the hand keeps what it holds.
    pub fn apply(&mut self, command: &Command) {
        match *command {
            Command::Take { instrument } if instrument < self.instruments.len() => {
                self.instrument = instrument;
                (self.is_out, self.left_at) = (false, None);
            }
            Command::Take { .. } => {}
            Command::Set { label, coefficient, value } => {
                for (materials, factors) in self.materials.iter_mut().zip(&self.factors) {
                    let value = value * factors.get(label).of(coefficient);
                    if !value.is_finite() {
                        // What an instrument cannot cut it still cannot.
                        continue;
                    }
                    materials.set(label, materials.get(label).with(coefficient, value));
                }
            }
            Command::RunBur { running } => self.bur_runs = running,
            Command::Guide { guidance } => self.guide.choose(guidance, self.tick),
            Command::Fill { label } => self.filling = self.fillings.iter().position(|f| Some(f.label) == label),
        }
    }

    /// The last tick's changed voxels, in the order they changed.
    pub fn edits(&self) -> &[Edit] {
        // Whoever cuts does not pack.
        if self.packer.edits().is_empty() { self.carver.edits() } else { self.packer.edits() }
    }

    /// The tick that comes next.
    pub fn tick(&self) -> Tick {
        self.tick
    }

    pub fn volume(&self) -> &Volume {
        &self.matter.volume
    }

    /// The matter as it is now, for whoever needs nothing else of the world.
    pub fn into_volume(self) -> Volume {
        self.matter.volume
    }

    pub fn matter(&self) -> &Matter {
        &self.matter
    }

    /// How the tissues answer the instrument in the hand.
    pub fn materials(&self) -> &Materials {
        &self.materials[self.instrument]
    }

    pub fn world_from_tooth(&self) -> &Pose {
        &self.world_from_tooth
    }

    /// What the gates for numbers had to change so far.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }
}
