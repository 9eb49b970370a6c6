//! State of one session's simulation, advanced one tick at a time.
//!
//! Takes readings, gives forces and edits. Live sessions, headless runs, replays, tests and benchmarks all call the
//! same [`Simulation::step`]; the servo thread of `typodont-devices` calls it at 1 kHz with a real device. A step
//! never reads a clock, uses unseeded randomness, depends on a scenario, or allocates.

mod hand_mapping;
mod tooling;

pub use hand_mapping::HandFrame;

use crate::device::{DeviceSpec, Reading, Wrench};
use crate::frame::{Pose, Quat, Vec3};
use crate::tick::Tick;
use crate::touch::{
    CarvingParameters, Coefficient, CollisionScene, Contact, ContactForce, ContactSpring, FillingMaterial, ForceLimit,
    Gate, Guidance, GuidanceController, Instrument, MaterialScales, Materials, Proxy, SpringLimit, ToolLoad, Vibration,
};
use crate::volume::{Edit, Label, Volume};
use hand_mapping::{FreeHand, HandMapping, TipPath};
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
    /// Moves the space of the hand to a frame. Meanwhile the hand is free; the tip stays if it is at the tooth or touches
    /// anything, and otherwise keeps its place in the workspace of the device. A frame with a middle moves the tip to where
    /// the hand is in it, and the one after that brings the middle back to the origin of the world.
    PlaceHand { frame: HandFrame },
    /// Presses or releases the clutch, unless the frame has a middle: while it is pressed, the hand is free and the tip stays. The second of two short
    /// presses brings the middle of the device's workspace back to the origin of the world.
    PressClutch { is_pressed: bool },
}

/// Result of one tick. Positions, directions and forces are in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub tick: Tick,
    /// Force on the hand, N; [`Step::wrench`] gives it in the space of the device.
    pub force: Vec3,
    /// Torque on the hand about the tip, N·mm.
    pub torque: Vec3,
    /// Position of the hand, mm; the last valid one if the reading was refused.
    pub hand: Vec3,
    /// Position of the working end, mm, including its penetration into soft tissue.
    pub tip: Vec3,
    /// Orientation of the handle, `world_from_handle`.
    pub handle: Quat,
    /// Orientation of the device's space, `world_from_device`; the identity unless the hand was placed otherwise.
    pub world_from_device: Quat,
    /// True while the hand is placed anew or the clutch is pressed: the tip then does not follow the hand.
    pub is_hand_free: bool,
    /// True while the hand was released and is inside matter: it renders no force and cuts nothing until it is clear of it.
    pub is_hand_blocked: bool,
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
    pub fn released(tick: Tick, hand: &Pose, instrument: usize) -> Step {
        Step {
            tick,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            hand: hand.position,
            tip: hand.position,
            handle: hand.orientation,
            world_from_device: Quat::IDENTITY,
            is_hand_free: false,
            is_hand_blocked: false,
            touch: None,
            cutting: false,
            removed: 0,
            coupling_force: Vec3::ZERO,
            guidance: Vec3::ZERO,
            instrument,
        }
    }

    /// Unit vector from the working end along the handle toward the hand.
    pub fn shaft(&self) -> Vec3 {
        self.handle * Vec3::Z
    }

    /// Force and torque to be sent to the device, in its own space.
    pub fn wrench(&self) -> Wrench {
        let Step { force, torque, world_from_device, .. } = *self;
        if world_from_device == Quat::IDENTITY {
            return Wrench { force, torque };
        }
        let device_from_world = world_from_device.conjugate();
        Wrench { force: device_from_world * force, torque: device_from_world * torque }
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

/// Distance of the tip from the middle of the tooth's neck up to which it stays where it is while the hand is placed
/// anew, mm: a crown, its root and a tip that has just left them. A tip that stays displaces the hand within its
/// workspace by up to twice its distance, so that one farther away turns with the view instead.
const STAY_DISTANCE: f32 = 15.0;

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
    /// Only a compliant collider, such as the floor of a sulcus or the cheek, lets the displayed tip sink in; any other tip is
    /// displayed exactly at the position of the proxy. `radius`: of the working end, mm.
    fn displayed_tip(&self, scene: &CollisionScene, radius: f32) -> Vec3 {
        let (tip, hand, force) = (self.tip, self.tooth_from_handle.position, self.contact_force.spring);
        let penetration = self.contact.and_then(|c| scene.penetration(c.label, (tip, radius), force));
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
    hand_mapping: HandMapping,
    hand: Pose,
    /// Wrench of the last tick, in the space of the device.
    rendered: Wrench,
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
            hand_mapping: HandMapping::new(),
            hand: Pose::IDENTITY,
            rendered: Wrench::ZERO,
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
        let mut step = match self.gate.admit(&reading.pose) {
            Some(in_device) => self.step_with_hand(tick, &in_device),
            None => self.lose_hand(tick),
        };
        step.world_from_device = self.hand_mapping.frame().orientation;
        self.rendered = step.wrench();
        step
    }

    /// Advances the simulation by one tick with a valid pose of the hand in the space of its device.
    fn step_with_hand(&mut self, tick: Tick, in_device: &Pose) -> Step {
        if self.hand_mapping.is_changing()
            && let Some(free) = self.hand_mapping.advance(in_device)
        {
            return self.free_hand(tick, &free);
        }
        let pose = self.hand_mapping.world_pose(in_device);
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
        let radius = if state.contact.is_some() { instrument.head_radius() } else { 0.0 };
        let Wrench { force, torque } = self.render(&state, vibration, guidance);
        Step {
            force,
            torque,
            tip: self.world_from_tooth * state.displayed_tip(&self.scene, radius),
            touch: self.touch(&state),
            cutting,
            removed: self.edits().iter().filter(|e| e.removes()).count() as u32,
            coupling_force: self.coupling_force,
            guidance,
            ..Step::released(tick, &pose, self.instrument)
        }
    }

    /// Leaves the hand free for a tick in which its mapping changes. The force that it felt before fades out.
    fn free_hand(&mut self, tick: Tick, free: &FreeHand) -> Step {
        self.hand = free.world_from_handle;
        self.set_scale(self.hand_mapping.frame().scale);
        let world_from_device = self.hand_mapping.frame().orientation;
        let Wrench { force, torque } = free.wrench;
        let step = self.release(tick);
        Step { force: world_from_device * force, torque: world_from_device * torque, is_hand_free: true, ..step }
    }

    /// Frees the hand until its mapping has changed. From then on the working end continues where it was, if the hand is
    /// still there, or as soon as the hand is clear of matter.
    fn disengage(&mut self) {
        if self.is_engaged {
            let orientation = (self.tooth_from_world * self.hand).orientation;
            let tip = self.proxy.tip();
            self.last_trusted = Some(LastTrusted { hand: Pose { position: tip, orientation }, tip });
        }
        self.is_engaged = false;
    }

    /// Limits all springs so that the device renders them with the same stiffness at a scale as without it: a hand that
    /// moves the tip by twice its own way would feel twice the stiffness.
    fn set_scale(&mut self, scale: f32) {
        self.contact_spring.set_scale(scale);
        self.guidance.set_scale(scale);
    }

    /// Releases the hand for a tick without a valid reading; remembers the last trusted hand and tip.
    fn lose_hand(&mut self, tick: Tick) -> Step {
        self.hand_mapping.drop_force();
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
        Step { is_hand_blocked: !self.is_engaged, ..step }
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

    /// Applies a command before the next tick. Unknown instruments and frames that are not valid are ignored.
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
            Command::PlaceHand { frame } if frame.is_valid() => self.place_hand(frame),
            Command::PlaceHand { .. } => {}
            Command::PressClutch { is_pressed } => self.press_clutch(is_pressed),
        }
    }

    fn place_hand(&mut self, frame: HandFrame) {
        let frame = HandFrame { orientation: frame.orientation.normalize(), ..frame };
        let tip = self.proxy.tip();
        let is_at_work =
            tip.length() < STAY_DISTANCE || self.proxy.contact().is_some() || self.hand_mapping.is_tip_held();
        let tip = self.world_from_tooth * tip;
        let path = if self.hand_mapping.is_centring() || frame.middle.is_some() || self.hand_mapping.is_registered() {
            TipPath::Centre(tip)
        } else if is_at_work {
            TipPath::Stay(tip)
        } else {
            TipPath::Turn
        };
        if self.hand_mapping.place(frame, path, self.rendered) {
            self.disengage();
        } else if !self.hand_mapping.is_changing() {
            self.set_scale(self.hand_mapping.frame().scale);
        }
    }

    fn press_clutch(&mut self, is_pressed: bool) {
        let tip = self.world_from_tooth * self.proxy.tip();
        if self.hand_mapping.press_clutch(is_pressed, self.tick, tip, self.rendered) {
            self.disengage();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::{CuttingLaw, Material, WorkingEnd};
    use crate::volume::Grid;

    /// A ball above a level wall at z = 0, with forces that fade in over half a second.
    fn wall() -> Simulation {
        let hard = Label(1);
        let grid = Grid::centred([100, 60, 60], Vec3::splat(0.2));
        let volume = Volume::from_distance(grid, 0.3, |p| (p.z, hard));
        let material = Material {
            stiffness: 1.0,
            damping: 1.0,
            static_friction: 0.0,
            dynamic_friction: 0.0,
            cut_force: None,
            hardness: None,
        };
        Simulation::new(Setup {
            scene: CollisionScene { volume, colliders: Vec::new() },
            materials: Materials::new().with(hard, material),
            material_scales: Vec::new(),
            instruments: vec![Instrument::new(WorkingEnd::Ball { radius: 0.7 }, false)],
            carving: CarvingParameters { dwell: 0.3, dwell_share: 0.3, max_feed: 30.0, law: CuttingLaw::Threshold },
            fillings: Vec::new(),
            vibration: Vibration::NONE,
            guidances: Vec::new(),
            world_from_tooth: Pose::IDENTITY,
            device: DeviceSpec::phantom_omni(),
            ramp: RAMP_TICKS,
        })
    }

    /// Steps with a hand that moves evenly from one place to another; returns the largest change of the force on the
    /// device in one tick, N, and the last step.
    fn go(sim: &mut Simulation, from: Vec3, to: Vec3, ticks: u32) -> (f32, Step) {
        let (mut worst, mut before, mut last) = (0.0, sim.rendered.force, None);
        for tick in 1..=ticks {
            let step = sim.step(&Reading::at(from.lerp(to, tick as f32 / ticks as f32)));
            let force = step.wrench().force;
            worst = before.distance(force).max(worst);
            (before, last) = (force, Some(step));
        }
        (worst, last.expect("at least one tick"))
    }

    #[test]
    fn a_hand_moves_100_mm_under_the_clutch_without_a_step_of_the_force() {
        // Aim: the tip stays and nobody feels the clutch. Method: press on a wall, hold the clutch, move the hand by 100 mm,
        // let go, and press again from there; no tick changes the force on the device by more than 0.05 N.
        const MOST: f32 = 0.05;
        let mut sim = wall();
        let (above, pressed) = (Vec3::Z * 2.0, Vec3::Z * -0.3);
        let (entry, step) = go(&mut sim, above, pressed, 1_500);
        assert!(step.force.z > 0.5 && entry < MOST, "{} N, step {entry} N", step.force.z);
        let tip = step.tip;
        sim.apply(&Command::PressClutch { is_pressed: true });
        let far = pressed + Vec3::X * 100.0;
        let (held, step) = go(&mut sim, pressed, far, 800);
        assert!(step.tip.distance(tip) < 1e-4 && step.force == Vec3::ZERO, "{} N at {}", step.force, step.tip);
        sim.apply(&Command::PressClutch { is_pressed: false });
        let (released, _) = go(&mut sim, far, far, 700);
        let (again, step) = go(&mut sim, far, far - Vec3::Z * 0.9, 1_000);
        println!("largest steps: {entry} {held} {released} {again} N");
        assert!(held < MOST && released < MOST && again < MOST, "{held} {released} {again} N");
        assert!(step.force.z > 0.5 && step.tip.distance(tip) < 0.1, "{} N at {}", step.force, step.tip);
    }

    #[test]
    fn a_placed_hand_feels_the_wall_in_its_own_space() {
        // Aim: after a turn by a quarter the wall is felt against the movement of the hand, and a lost reading during the
        // turn ends every force. Method: press along z, turn so that the hand's x is the world's -z, and push along +x.
        let mut sim = wall();
        let pressed = Vec3::Z * -0.3;
        go(&mut sim, Vec3::Z * 2.0, pressed, 1_500);
        let orientation = Quat::from_rotation_y(core::f32::consts::FRAC_PI_2);
        sim.apply(&Command::PlaceHand { frame: HandFrame { orientation, scale: 1.0, ..HandFrame::DEVICE } });
        let mut lost = sim.clone();
        assert!(lost.step(&Reading::at(pressed)).force != Vec3::ZERO);
        assert_eq!(lost.step(&Reading::ABSENT).force, Vec3::ZERO);
        assert_eq!(lost.step(&Reading::at(pressed)).force, Vec3::ZERO);
        let (turning, _) = go(&mut sim, pressed, pressed, 400);
        let out = pressed - Vec3::X * 2.0;
        go(&mut sim, pressed, out, 600);
        let (_, step) = go(&mut sim, out, pressed + Vec3::X * 0.8, 1_500);
        let felt = step.wrench().force;
        assert!(turning < 0.05, "{turning} N");
        assert!(felt.x < -0.3 && felt.y.abs() + felt.z.abs() < 0.05 && step.force.z > 0.3, "{felt} N");
    }
}
