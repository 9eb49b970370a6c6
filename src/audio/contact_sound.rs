//! Sound of the working end on the tooth: a bur that grinds, a probe that scratches.
//!
//! Takes the load and the state of the handpiece. Gives samples. Never allocates after its creation.

use super::handpiece::HandpieceSound;
use super::load::{DrillLoad, Tool};
use super::signal::{Noise, PhaseAccumulator, Ramp, StateVariableFilter, decay_factor, sample_count};

/// Duration of the fades at the beginning and end of contact, s. The tooth must be heard within 20 ms of the touch;
/// the rest of that time is needed by the output's blocks. Below 0.002 there would be a click.
const FADE: f32 = 0.006;

/// Time constant with which the sound follows the hand during contact, s. A hand trembles at up to about 10 Hz.
const FOLLOW: f32 = 0.012;

/// Levels relative to full scale, at a firm 3 N and full speed on enamel: 0.2 to 0.5 works.
const GRIND_LEVEL: f32 = 0.42;
const SCRATCH_LEVEL: f32 = 0.12;

/// Force of the reference loudness of grinding, N: half of the maximum. Usual forces on a bur are 0.5 to 2 N. Below
/// 2.5 a turbine would become quieter under a heavy hand, because the loss of speed would outweigh the force.
const FULL_FORCE: f32 = 3.0;

/// The same for the tip of a hand instrument: a probe is guided with some tenths of a newton.
const FULL_TIP_FORCE: f32 = 0.5;

/// Surface speed of a bur at which grinding has the reference loudness, mm/s: 1 mm at 200 000 rpm.
const FULL_SURFACE_SPEED: f32 = 10_000.0;

/// The same for a tip drawn over a surface, mm/s; chosen by ear.
const FULL_TIP_SPEED: f32 = 40.0;

/// Level of a bur that rubs without cutting, relative to one that cuts.
const RUBBING_LEVEL: f32 = 0.35;

/// Centre of a tissue's noise, Hz, for 1 HV; it rises with the square root of hardness, as the pitch of a struck body
/// does with the square root of its stiffness. So it is 5.5 kHz for enamel (300 HV), 2.5 kHz for dentine (60) and
/// 1.2 kHz for decay (15). Chosen by ear; 200 to 400 works.
const CENTRE_AT_1_HV: f32 = 320.0;

/// Minimum centre, Hz: soft tissue has no hardness and sounds dull.
const MIN_CENTRE: f32 = 300.0;

/// Hardness of sound enamel, HV: the reference for loudness and brightness.
const ENAMEL_HV: f32 = 300.0;

/// Ridges per millimetre that catch a tip: perikymata and the marks of burs are 0.05 to 0.2 mm apart.
const RIDGES_PER_MM: f32 = 8.0;

/// Properties of the contact sound at one moment.
#[derive(Clone, Copy, Default)]
struct ContactTimbre {
    level: f32,
    /// Hz.
    centre: f32,
    /// Quality factor of the main band.
    ring: f32,
    /// Level of the upper band, relative to the main one.
    brightness: f32,
    /// Depth of the modulation of loudness, 0 to 1.
    roughness: f32,
    /// Level of the bur's own tone, transmitted by the tooth.
    tone: f32,
    /// Frequency at which the tip catches, Hz.
    catches: f32,
}

/// Generator of the sound of contact.
pub struct ContactSound {
    rate: f32,
    noise: Noise,
    presence: Ramp,
    timbre: ContactTimbre,
    main: StateVariableFilter,
    upper: StateVariableFilter,
    body: StateVariableFilter,
    chatter: StateVariableFilter,
    tone: PhaseAccumulator,
    /// Revolutions per second of the bur.
    speed: f32,
    catch: PhaseAccumulator,
    catch_strength: f32,
}

impl ContactSound {
    pub fn new(rate: f32, seed: u64) -> ContactSound {
        ContactSound {
            rate,
            noise: Noise::new(seed),
            presence: Ramp::default(),
            timbre: ContactTimbre::default(),
            main: StateVariableFilter::default(),
            upper: StateVariableFilter::default(),
            body: StateVariableFilter::tuned(260.0, 0.8, rate),
            // Chatter between hand and tooth: about a hundred times per second.
            chatter: StateVariableFilter::tuned(110.0, 0.6, rate),
            tone: PhaseAccumulator::default(),
            speed: 0.0,
            catch: PhaseAccumulator::default(),
            catch_strength: 1.0,
        }
    }

    /// Follows the load for the next `time` seconds.
    pub fn follow(&mut self, load: &DrillLoad, handpiece: &HandpieceSound, time: f32) {
        let wanted = timbre_of(load, handpiece);
        if wanted.is_some() != (self.presence.goal > 0.0) {
            self.presence.ramp_to(f32::from(wanted.is_some()), sample_count(FADE, self.rate));
        }
        let is_silent = self.presence.value == 0.0;
        if is_silent {
            [&mut self.main, &mut self.upper, &mut self.body, &mut self.chatter]
                .into_iter()
                .for_each(StateVariableFilter::reset);
        }
        let Some(goal) = wanted else { return };
        self.timbre = if is_silent { goal } else { self.timbre.lerp(&goal, 1.0 - decay_factor(time, FOLLOW)) };
        self.speed = handpiece.speed();
        self.main.tune(self.timbre.centre, self.timbre.ring, self.rate);
        self.upper.tune(2.3 * self.timbre.centre, 1.0, self.rate);
    }

    pub fn next_sample(&mut self) -> f32 {
        let presence = self.presence.next_value();
        if presence == 0.0 {
            return 0.0;
        }
        let ContactTimbre { level, brightness, roughness, tone, catches, .. } = self.timbre;
        let white = self.noise.white();
        // The narrow filter passes little of the noise; nine times its output is about 0.4.
        let waver = (1.0 + roughness * 9.0 * self.chatter.process(white).low).clamp(0.2, 2.0);
        let rough = white * waver * self.stick_slip(catches);
        let main = self.main.process(rough).band;
        let upper = self.upper.process(rough).band;
        let body = self.body.process(rough).band;
        self.tone.advance(self.speed, self.rate);
        presence * level * (main + brightness * upper + 0.8 * body + tone * waver * self.tone.sine())
    }

    /// Returns the envelope of a tip that catches at a ridge, slips, and fades until the next one; the ridges differ.
    fn stick_slip(&mut self, catches: f32) -> f32 {
        if catches <= 0.0 {
            return 1.0;
        }
        let unevenness = 1.0 + 0.4 * self.catch_strength;
        if self.catch.advance(catches * unevenness, self.rate) {
            self.catch_strength = self.noise.white();
        }
        let remaining = 1.0 - self.catch.phase();
        0.25 + (1.3 + 0.6 * self.catch_strength) * remaining * remaining
    }
}

impl ContactTimbre {
    /// Returns the interpolation to `goal` by a fraction `share`, 0 to 1.
    fn lerp(&self, goal: &ContactTimbre, share: f32) -> ContactTimbre {
        let mix = |from: f32, to: f32| from + share * (to - from);
        ContactTimbre {
            level: mix(self.level, goal.level),
            centre: mix(self.centre, goal.centre),
            ring: mix(self.ring, goal.ring),
            brightness: mix(self.brightness, goal.brightness),
            roughness: mix(self.roughness, goal.roughness),
            tone: mix(self.tone, goal.tone),
            catches: mix(self.catches, goal.catches),
        }
    }
}

/// Returns the sound of a load; `None` for silence.
fn timbre_of(load: &DrillLoad, handpiece: &HandpieceSound) -> Option<ContactTimbre> {
    if !load.is_touching {
        return None;
    }
    match load.tool {
        Tool::Hand => Some(scratch(load)),
        _ if load.is_running => Some(grind(load, handpiece.speed_share())),
        // A bur that does not rotate is silent on the tooth.
        _ => None,
    }
    .filter(|timbre| timbre.level > 0.0)
}

/// Returns the sound of a bur: louder with force and speed (both level off), brighter with hardness, duller when
/// slowed down.
fn grind(load: &DrillLoad, share: f32) -> ContactTimbre {
    let hardness = (load.hardness / ENAMEL_HV).min(2.0).sqrt();
    let force = 2.0 * load.force / (load.force + FULL_FORCE);
    let speed = (load.surface_speed * share / FULL_SURFACE_SPEED).min(1.5).sqrt();
    let work = if load.is_cutting { 1.0 } else { RUBBING_LEVEL };
    ContactTimbre {
        level: GRIND_LEVEL * force * speed * work * (0.3 + 0.7 * hardness.min(1.0)),
        centre: (CENTRE_AT_1_HV * load.hardness.sqrt() * share.sqrt()).max(MIN_CENTRE),
        ring: 0.9,
        brightness: 0.6 * hardness,
        roughness: 0.3 + 0.7 * (load.force / 4.0).min(1.0),
        tone: 0.2 * hardness,
        catches: 0.0,
    }
}

/// Returns the sound of a tip that is drawn along: the tissue determines its pitch, the hand its rhythm.
fn scratch(load: &DrillLoad) -> ContactTimbre {
    let hardness = (load.hardness / ENAMEL_HV).min(2.0).sqrt();
    let force = 2.0 * load.force / (load.force + FULL_TIP_FORCE);
    let speed = (load.surface_speed / FULL_TIP_SPEED).min(1.5).sqrt();
    ContactTimbre {
        level: SCRATCH_LEVEL * force * speed * (0.15 + 0.85 * hardness.min(1.0)),
        centre: (0.8 * CENTRE_AT_1_HV * load.hardness.sqrt()).max(MIN_CENTRE),
        ring: 2.5,
        brightness: 0.4 * hardness,
        roughness: 0.2,
        tone: 0.0,
        // Above some hundred per second the ridges blur.
        catches: (RIDGES_PER_MM * load.surface_speed).min(400.0),
    }
}
