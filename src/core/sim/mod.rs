//! State of one session's simulation, advanced one tick at a time.
//!
//! Takes readings, gives forces and edits. Live sessions, headless runs, replays, tests and benchmarks all call the
//! same [`Simulation::step`]; the servo thread of `typodont-devices` calls it at 1 kHz with a real device. A step
//! never reads a clock, uses unseeded randomness, depends on a scenario, or allocates.

mod tooling;

use crate::device::{DeviceSpec, Reading, Wrench};
use crate::frame::{Pose, Vec3};
use crate::tick::Tick;
use crate::touch::{
    CarvingParameters, Coefficient, CollisionScene, Contact, ContactForce, ContactSpring, FillingMaterial, ForceLimit,
    Gate, Guidance, GuidanceController, Instrument, MaterialScales, Materials, Proxy, SpringLimit, ToolLoad, Vibration,
};
use crate::volume::{Edit, Label, Volume};
use tooling::Tooling;

/// Initial state and parameters of a simulation.
#[derive(Clone, Debug)]
pub struct Setup {
    pub scene: CollisionScene,
    pub materials: Materials,
    /// Scales of the materials for each instrument, in instrument order; instruments beyond the end of the list are
    /// unscaled.
    pub material_scales: Vec<MaterialScales>,
    /// In the order of the indices in [`Command::SelectInstrument`]; the first is selected at the start.
    pub instruments: Vec<Instrument>,
    pub carving: CarvingParameters,
    /// Filling materials that can be placed and condensed.
    pub fillings: Vec<FillingMaterial>,
    pub vibration: Vibration,
    /// In the order of the indices in [`Command::SetGuidance`].
    pub guidances: Vec<Guidance>,
    pub world_from_tooth: Pose,
    pub device: DeviceSpec,
    /// Ticks over which forces fade in after the hand was released: at the start, after a change of instrument, and
    /// after an invalid reading.
    pub ramp: u32,
}

/// Half a second: long enough for a hand to notice the force and yield, short enough not to hide a contact.
pub const RAMP_TICKS: u32 = 500;

/// Change that a session may make between two ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Selects another instrument.
    SelectInstrument { instrument: usize },
    /// Sets a coefficient of a tissue to a value, in its unit, before the scales of each instrument are applied.
    SetCoefficient { label: Label, coefficient: Coefficient, value: f32 },
    /// Gives a tissue all properties of another, as each instrument feels that tissue now.
    SetMaterial { label: Label, like: Label },
    /// Starts or stops burs.
    RunBur { running: bool },
    /// Starts a guidance from its beginning, or ends guidance.
    SetGuidance { guidance: Option<usize> },
    /// Selects the filling that carriers place, or none.
    SetFilling { label: Option<Label> },
}

/// Result of one tick. Positions, directions and forces are in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub tick: Tick,
    /// Force to be rendered by the device, N.
    pub force: Vec3,
    /// Torque about the tip to be rendered by the device, N·mm.
    pub torque: Vec3,
    /// Position of the hand, mm; the last valid one if the reading was refused.
    pub hand: Vec3,
    /// Position of the working end, mm, including its penetration into soft tissue.
    pub tip: Vec3,
    /// Unit vector from the working end along the handle toward the hand.
    pub shaft: Vec3,
    pub touch: Option<Touch>,
    /// True while matter is being cut, even if the cut was too small to change a voxel in this tick.
    pub cutting: bool,
    /// Number of voxels that became air.
    pub removed: u32,
    /// Force of the other hand on this one, N: part of `force`.
    pub coupling_force: Vec3,
    /// Force of the exercise's guidance, N: part of `force`.
    pub guidance: Vec3,
    /// Index of the selected instrument.
    pub instrument: usize,
}

impl Step {
    /// Tick in which the hand is free: zero force, no contact, no cutting.
    fn released(tick: Tick, hand: &Pose, instrument: usize) -> Step {
        Step {
            tick,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            hand: hand.position,
            tip: hand.position,
            shaft: hand.rotate(Vec3::Z),
            touch: None,
            cutting: false,
            removed: 0,
            coupling_force: Vec3::ZERO,
            guidance: Vec3::ZERO,
            instrument,
        }
    }

    /// Force and torque to be sent to the device.
    pub fn wrench(&self) -> Wrench {
        Wrench { force: self.force, torque: self.torque }
    }
}

/// Contact of the working end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Tissue that carries most of the contact force.
    pub label: Label,
    /// Spring component of the contact force, N.
    pub spring: f32,
    /// Unit normal out of the matter, world space.
    pub normal: Vec3,
}

/// Maximum hand displacement, mm, and rotation, rad, during a run of invalid readings after which the simulation
/// re-engages at the old tip position: a short delay of a busy computer must not move the tool through the tooth. The
/// force fades in again.
const REENGAGE_DISTANCE: f32 = 2.0;
const REENGAGE_ANGLE: f32 = 0.2;

/// Last valid hand pose and tip position before a run of invalid readings, tooth space.
#[derive(Clone, Copy, Debug)]
struct LastTrusted {
    hand: Pose,
    tip: Vec3,
}

impl LastTrusted {
    fn can_reengage(&self, tooth_from_handle: &Pose) -> bool {
        let is_near = self.hand.position.distance(tooth_from_handle.position) < REENGAGE_DISTANCE;
        is_near && self.hand.orientation.angle_between(tooth_from_handle.orientation) < REENGAGE_ANGLE
    }
}

/// Pose of the hand and response of the working end in one tick; tooth space.
#[derive(Clone, Copy, Debug)]
struct TipState {
    tooth_from_handle: Pose,
    /// Position of the proxy, mm.
    tip: Vec3,
    contact: Option<Contact>,
    contact_force: ContactForce,
    /// Fraction of the contact force to render, 0 to 1.
    ramp_factor: f32,
}

impl TipState {
    /// Load on matter, if the head bears on any.
    ///
    /// A bur that bears on its shank acts with less force, and one that bears on its shank alone does not act. A force
    /// that is not yet rendered does not act either.
    fn load(&self) -> Option<ToolLoad> {
        let Contact { head_share, label, .. } = self.contact.filter(|contact| contact.head_share > 0.0)?;
        let spring = self.contact_force.spring * head_share * self.ramp_factor;
        Some(ToolLoad {
            tip: self.tip,
            hand: self.tooth_from_handle.position,
            orientation: self.tooth_from_handle.orientation,
            contact_force: ContactForce { spring, ..self.contact_force },
            label,
        })
    }

    /// Torque of the contact force about the tip, N·mm.
    fn torque(&self) -> Vec3 {
        let moment_arm = self.contact.map_or(Vec3::ZERO, |contact| contact.moment_arm);
        moment_arm * self.contact_force.force.length()
    }

    /// Position at which the tip is displayed, mm.
    ///
    /// Only a compliant collider, the floor of a sulcus, lets the displayed tip sink in; any other tip is displayed
    /// exactly at the position of the proxy.
    fn displayed_tip(&self, scene: &CollisionScene) -> Vec3 {
        let (tip, hand) = (self.tip, self.tooth_from_handle.position);
        let penetration = self.contact.and_then(|c| scene.penetration(c.label, tip, self.contact_force.spring));
        penetration.map_or(tip, |(depth, out)| tip - out * depth.min((hand - tip).length()))
    }
}

/// State of one session's simulation.
///
/// Each call of [`Simulation::step`] advances it by one tick.
#[derive(Clone, Debug)]
pub struct Simulation {
    scene: CollisionScene,
    /// Materials as felt with each instrument, in instrument order.
    materials: Vec<Materials>,
    material_scales: Vec<MaterialScales>,
    instruments: Vec<Instrument>,
    vibration: Vibration,
    guidance: GuidanceController,
    world_from_tooth: Pose,
    tooth_from_world: Pose,
    force_limit: ForceLimit,
    tick: Tick,
    instrument: usize,
    /// False until the working end has been clear of matter once, so that starting or changing instruments inside a
    /// tooth gives zero force instead of pushing the hand out. Also false after a release, until the hand is clear of
    /// matter or re-engages where it was.
    is_engaged: bool,
    /// Hand pose and tip position at the last valid reading.
    last_trusted: Option<LastTrusted>,
    ramp: u32,
    /// Ticks since the hand was released, up to `ramp`.
    ticks_since_release: u32,
    coupling_force: Vec3,
    hand: Pose,
    proxy: Proxy,
    contact_spring: ContactSpring,
    tooling: Tooling,
    gate: Gate,
}

impl Simulation {
    /// Creates a simulation at rest with the first instrument selected and the bur running.
    ///
    /// # Panics
    /// If there is no instrument; a resolved scenario always has one.
    pub fn new(setup: Setup) -> Simulation {
        let Setup {
            scene,
            materials,
            mut material_scales,
            instruments,
            carving,
            fillings,
            vibration,
            guidances,
            world_from_tooth,
            device,
            ramp,
        } = setup;
        assert!(!instruments.is_empty(), "a simulation needs at least one instrument");
        material_scales.resize(instruments.len(), MaterialScales::default());
        let spring = SpringLimit {
            max_stiffness: device.max_stiffness,
            max_damping: device.max_damping,
            resolution: device.resolution,
        };
        let tooth_from_world = world_from_tooth.inverse();
        let proxy = Proxy::new(&scene, &instruments, tooth_from_world * Vec3::ZERO);
        Simulation {
            scene,
            materials: material_scales.iter().map(|f| materials.clone().scaled_by(f)).collect(),
            material_scales,
            instruments,
            vibration,
            guidance: GuidanceController::new(guidances, &spring),
            world_from_tooth,
            tooth_from_world,
            force_limit: ForceLimit { max_force: device.max_force, max_torque: device.max_torque },
            tick: Tick::ZERO,
            instrument: 0,
            is_engaged: false,
            last_trusted: None,
            ramp,
            ticks_since_release: 0,
            coupling_force: Vec3::ZERO,
            hand: Pose::IDENTITY,
            proxy,
            contact_spring: ContactSpring::new(spring),
            tooling: Tooling::new(carving, fillings),
            gate: Gate::default(),
        }
    }

    /// Advances the simulation by one tick.
    ///
    /// An invalid reading (not finite, or without an orientation) gives zero force and leaves the state unchanged.
    /// When readings are valid again, the working end continues where it was, unless the hand has meanwhile moved too
    /// far.
    pub fn step(&mut self, reading: &Reading) -> Step {
        let tick = self.tick;
        self.tick = tick.next();
        let Some(pose) = self.gate.admit(&reading.pose) else { return self.lose_hand(tick) };
        self.hand = pose;
        let tooth_from_handle = self.tooth_from_world * pose;
        if !self.is_engaged {
            return self.try_to_engage(tick, &tooth_from_handle);
        }
        let state = self.follow_hand(tooth_from_handle);
        let (instrument, materials) = (&self.instruments[self.instrument], &self.materials[self.instrument]);
        let cutting = self.tooling.work(&mut self.scene, instrument, materials, state.load().as_ref());
        if self.tooling.has_packed() {
            self.proxy.invalidate();
        }
        let guidance = self.guidance.force(
            tick,
            tooth_from_handle.position,
            self.contact_spring.velocity(),
            &self.world_from_tooth,
        );
        let vibration = if cutting && instrument.is_rotary { self.vibration.force(tick) } else { Vec3::ZERO };
        let Wrench { force, torque } = self.render(&state, vibration, guidance);
        Step {
            force,
            torque,
            tip: self.world_from_tooth * state.displayed_tip(&self.scene),
            touch: self.touch(&state),
            cutting,
            removed: self.edits().iter().filter(|e| e.removes()).count() as u32,
            coupling_force: self.coupling_force,
            guidance,
            ..Step::released(tick, &pose, self.instrument)
        }
    }

    /// Releases the hand for a tick without a valid reading; remembers the last trusted hand and tip.
    fn lose_hand(&mut self, tick: Tick) -> Step {
        if self.is_engaged {
            self.last_trusted = Some(LastTrusted { hand: self.tooth_from_world * self.hand, tip: self.proxy.tip() });
        }
        self.is_engaged = false;
        self.release(tick)
    }

    /// Releases the hand for one more tick, and engages it from the next tick on if it is clear of matter, or near
    /// where it was last trusted.
    fn try_to_engage(&mut self, tick: Tick, tooth_from_handle: &Pose) -> Step {
        self.is_engaged = Proxy::is_free_at(&self.scene, &self.instruments[self.instrument], tooth_from_handle);
        let step = self.release(tick);
        // From the old tip position the proxy follows the hand, which may be free by now, or on the other side of a
        // surface.
        if let Some(last) = self.last_trusted.take().filter(|last| last.can_reengage(tooth_from_handle)) {
            self.proxy.reset_to(last.tip);
            self.is_engaged = true;
        }
        step
    }

    /// Moves the working end after the hand and computes the contact force.
    fn follow_hand(&mut self, tooth_from_handle: Pose) -> TipState {
        let ramp_factor = self.advance_ramp();
        let (instrument, materials) = (&self.instruments[self.instrument], &self.materials[self.instrument]);
        self.proxy.follow(&self.scene, instrument, materials, &tooth_from_handle);
        let (tip, contact) = (self.proxy.tip(), self.proxy.contact().copied());
        let contact_force = self.contact_spring.force(tooth_from_handle.position, tip, contact.as_ref());
        TipState { tooth_from_handle, tip, contact, contact_force, ramp_factor }
    }

    /// Sums all forces on the hand, within the limits of the device. Vibration and guidance in N, world space.
    fn render(&mut self, state: &TipState, vibration: Vec3, guidance: Vec3) -> Wrench {
        let contact_force = self.world_from_tooth.rotate(state.contact_force.force);
        let mut force = (contact_force + vibration) * state.ramp_factor;
        // A zero force is not added: it would turn −0 into 0, and recordings are compared to the last bit.
        for other in [self.coupling_force, guidance] {
            if other != Vec3::ZERO {
                force += other;
            }
        }
        let torque = self.world_from_tooth.rotate(state.torque()) * state.ramp_factor;
        Wrench {
            force: self.gate.clamp_force(force, &self.force_limit),
            torque: self.gate.clamp_torque(torque, &self.force_limit),
        }
    }

    /// Returns the contact as reported to the session, if there is one.
    fn touch(&self, state: &TipState) -> Option<Touch> {
        state.contact.map(|Contact { label, normal, .. }| Touch {
            label,
            spring: state.contact_force.spring,
            normal: self.world_from_tooth.rotate(normal),
        })
    }

    /// Advances the fade-in after a release; returns the fraction of the force to render, 0 to 1.
    fn advance_ramp(&mut self) -> f32 {
        if self.ticks_since_release >= self.ramp {
            return 1.0;
        }
        self.ticks_since_release += 1;
        self.ticks_since_release as f32 / self.ramp as f32
    }

    /// Releases the hand for a tick: zero force, no contact, no cutting.
    fn release(&mut self, tick: Tick) -> Step {
        self.ticks_since_release = 0;
        self.tooling.reset();
        self.contact_spring.reset();
        self.guidance.suspend();
        self.proxy.reset_to(self.tooth_from_world * self.hand.position);
        Step::released(tick, &self.hand, self.instrument)
    }

    /// Returns true while the hand is released and has neither been clear of matter since nor re-engaged.
    pub fn is_released(&self) -> bool {
        !self.is_engaged
    }

    /// Sets the force of another hand on this one, N, world space, from the next tick on. A force that is not finite
    /// is zero.
    pub fn set_coupling_force(&mut self, force: Vec3) {
        self.coupling_force = if force.is_finite() { force } else { Vec3::ZERO };
    }

    /// Applies a command before the next tick. Unknown instruments are ignored.
    pub fn apply(&mut self, command: &Command) {
        match *command {
            Command::SelectInstrument { instrument } if instrument < self.instruments.len() => {
                self.instrument = instrument;
                (self.is_engaged, self.last_trusted) = (false, None);
            }
            Command::SelectInstrument { .. } => {}
            Command::SetCoefficient { label, coefficient, value } => {
                for (materials, scales) in self.materials.iter_mut().zip(&self.material_scales) {
                    let value = value * scales.get(label).coefficient(coefficient);
                    if !value.is_finite() {
                        // An instrument that cannot cut the tissue still cannot.
                        continue;
                    }
                    materials.set(label, materials.get(label).with(coefficient, value));
                }
            }
            Command::SetMaterial { label, like } => {
                for materials in &mut self.materials {
                    materials.set(label, *materials.get(like));
                }
            }
            Command::RunBur { running } => self.tooling.bur_runs = running,
            Command::SetGuidance { guidance } => self.guidance.choose(guidance, self.tick),
            Command::SetFilling { label } => self.tooling.select_filling(label),
        }
    }

    /// Voxels changed by the last tick, in the order of their changes.
    pub fn edits(&self) -> &[Edit] {
        self.tooling.edits()
    }

    /// The next tick.
    pub fn tick(&self) -> Tick {
        self.tick
    }

    pub fn volume(&self) -> &Volume {
        &self.scene.volume
    }

    /// Returns the volume as it is now and drops the rest.
    pub fn into_volume(self) -> Volume {
        self.scene.volume
    }

    pub fn scene(&self) -> &CollisionScene {
        &self.scene
    }

    /// Materials as felt with the selected instrument.
    pub fn materials(&self) -> &Materials {
        &self.materials[self.instrument]
    }

    pub fn world_from_tooth(&self) -> &Pose {
        &self.world_from_tooth
    }

    /// Counts of refused readings and limited forces so far.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }
}
