//! The working end on the tooth: a bur that grinds, a probe that scratches.

use super::load::{DrillLoad, Tool};
use super::rotor::Rotor;
use super::signal::{Filter, Noise, Ramp, Turn, decay, samples};

/// How long the sound of contact takes to come and to go, s. The tooth is heard within 20 ms of the touch: what is left of them
/// belongs to the output's blocks. Below 0.002 a click would be heard.
const FADE: f32 = 0.006;

/// How long the sound takes to follow the hand while it stays on the tooth, s. A hand trembles up to about 10 Hz.
const FOLLOW: f32 = 0.012;

/// Of full scale, at a firm 3 N at full speed on enamel: 0.2 to 0.5 works.
const GRIND_LEVEL: f32 = 0.42;
const SCRATCH_LEVEL: f32 = 0.12;

/// The force, N, at which grinding has its full loudness, and half of what it could ever have. Usual forces on a bur are 0.5 to
/// 2 N. Below 2.5 a turbine would grow quieter under a heavy hand, since its speed falls faster than force makes it loud.
const FULL_FORCE: f32 = 3.0;

/// The same for a tip: a probe is led with some tenths of a newton.
const FULL_TIP_FORCE: f32 = 0.5;

/// The speed of a bur's surface, mm/s, at which grinding has its full loudness: 1 mm at 200 000 rpm.
const FULL_SURFACE_SPEED: f32 = 10_000.0;

/// The same for a tip drawn over a surface, by ear.
const FULL_TIP_SPEED: f32 = 40.0;

/// A bur that rubs and takes nothing away, beside one that cuts.
const RUB: f32 = 0.35;

/// Where the noise of a tissue has its middle, Hz, for 1 HV; it rises with the root of hardness, as the pitch of a struck body
/// does with the root of its stiffness. So enamel (300 HV) has it at 5.5 kHz, dentine (60) at 2.5 kHz, decay (15) at 1.2 kHz.
/// By ear; 200 to 400 works.
const CENTRE_OF_ONE: f32 = 320.0;

/// Soft tissue has no hardness, and a dull sound, Hz.
const CENTRE_LEAST: f32 = 300.0;

/// Hardness of sound enamel, HV: loudness and brightness are said beside it.
const ENAMEL: f32 = 300.0;

/// Ridges that a tip catches at per millimetre: perikymata and the marks of burs lie 0.05 to 0.2 mm apart.
const RIDGES_PER_MM: f32 = 8.0;

/// What a moment's contact sounds like.
#[derive(Clone, Copy, Default)]
struct Character {
    level: f32,
    /// Hz.
    centre: f32,
    /// Quality of the main band.
    ring: f32,
    /// Of the upper band, beside the main one.
    brightness: f32,
    /// How deep loudness wavers, 0 to 1.
    roughness: f32,
    /// Of the bur's own tone, carried by the tooth.
    tone: f32,
    /// How often it catches, Hz.
    catches: f32,
}

pub struct Contact {
    rate: f32,
    noise: Noise,
    presence: Ramp,
    now: Character,
    main: Filter,
    upper: Filter,
    body: Filter,
    chatter: Filter,
    tone: Turn,
    /// Turns per second of the bur.
    speed: f32,
    catch: Turn,
    catch_strength: f32,
}

impl Contact {
    pub fn new(rate: f32, seed: u64) -> Contact {
        Contact {
            rate,
            noise: Noise::new(seed),
            presence: Ramp::default(),
            now: Character::default(),
            main: Filter::default(),
            upper: Filter::default(),
            body: Filter::tuned(260.0, 0.8, rate),
            // Chatter of hand and tooth: some hundred times a second.
            chatter: Filter::tuned(110.0, 0.6, rate),
            tone: Turn::default(),
            speed: 0.0,
            catch: Turn::default(),
            catch_strength: 1.0,
        }
    }

    /// Takes the load for the next `time` seconds.
    pub fn follow(&mut self, load: &DrillLoad, rotor: &Rotor, time: f32) {
        let heard = heard(load, rotor);
        if heard.is_some() != (self.presence.goal > 0.0) {
            self.presence.aim(f32::from(heard.is_some()), samples(FADE, self.rate));
        }
        let is_silent = self.presence.value == 0.0;
        if is_silent {
            [&mut self.main, &mut self.upper, &mut self.body, &mut self.chatter].into_iter().for_each(Filter::rest);
        }
        let Some(goal) = heard else { return };
        self.now = if is_silent { goal } else { self.now.toward(&goal, 1.0 - decay(time, FOLLOW)) };
        self.speed = rotor.speed();
        self.main.tune(self.now.centre, self.now.ring, self.rate);
        self.upper.tune(2.3 * self.now.centre, 1.0, self.rate);
    }

    pub fn next(&mut self) -> f32 {
        let presence = self.presence.next();
        if presence == 0.0 {
            return 0.0;
        }
        let Character { level, brightness, roughness, tone, catches, .. } = self.now;
        let white = self.noise.white();
        // The narrow filter leaves little of the noise; nine times that is some 0.4.
        let waver = (1.0 + roughness * 9.0 * self.chatter.pass(white).low).clamp(0.2, 2.0);
        let rough = white * waver * self.catching(catches);
        let main = self.main.pass(rough).band;
        let upper = self.upper.pass(rough).band;
        let body = self.body.pass(rough).band;
        self.tone.advance(self.speed, self.rate);
        presence * level * (main + brightness * upper + 0.8 * body + tone * waver * self.tone.sine())
    }

    /// A tip catches at a ridge, lets go, and fades until the next one; each ridge is another.
    fn catching(&mut self, catches: f32) -> f32 {
        if catches <= 0.0 {
            return 1.0;
        }
        let unevenness = 1.0 + 0.4 * self.catch_strength;
        if self.catch.advance(catches * unevenness, self.rate) {
            self.catch_strength = self.noise.white();
        }
        let left = 1.0 - self.catch.turns();
        0.25 + (1.3 + 0.6 * self.catch_strength) * left * left
    }
}

impl Character {
    /// A share of the way to another, 0 to 1.
    fn toward(&self, goal: &Character, share: f32) -> Character {
        let between = |from: f32, to: f32| from + share * (to - from);
        Character {
            level: between(self.level, goal.level),
            centre: between(self.centre, goal.centre),
            ring: between(self.ring, goal.ring),
            brightness: between(self.brightness, goal.brightness),
            roughness: between(self.roughness, goal.roughness),
            tone: between(self.tone, goal.tone),
            catches: between(self.catches, goal.catches),
        }
    }
}

/// `None` where there is nothing to hear.
fn heard(load: &DrillLoad, rotor: &Rotor) -> Option<Character> {
    if !load.is_touching {
        return None;
    }
    match load.tool {
        Tool::Hand => Some(scratch(load)),
        _ if load.is_running => Some(grind(load, rotor.share())),
        // A bur that stands still on a tooth is silent.
        _ => None,
    }
    .filter(|heard| heard.level > 0.0)
}

/// Louder with force and speed (both level off), brighter the harder the tissue; a bur that is held back is duller.
fn grind(load: &DrillLoad, share: f32) -> Character {
    let hardness = (load.hardness / ENAMEL).min(2.0).sqrt();
    let force = 2.0 * load.force / (load.force + FULL_FORCE);
    let speed = (load.surface_speed * share / FULL_SURFACE_SPEED).min(1.5).sqrt();
    let work = if load.is_cutting { 1.0 } else { RUB };
    Character {
        level: GRIND_LEVEL * force * speed * work * (0.3 + 0.7 * hardness.min(1.0)),
        centre: (CENTRE_OF_ONE * load.hardness.sqrt() * share.sqrt()).max(CENTRE_LEAST),
        ring: 0.9,
        brightness: 0.6 * hardness,
        roughness: 0.3 + 0.7 * (load.force / 4.0).min(1.0),
        tone: 0.2 * hardness,
        catches: 0.0,
    }
}

/// The same for a tip that is drawn along: its pitch is the tissue's, its rhythm the hand's.
fn scratch(load: &DrillLoad) -> Character {
    let hardness = (load.hardness / ENAMEL).min(2.0).sqrt();
    let force = 2.0 * load.force / (load.force + FULL_TIP_FORCE);
    let speed = (load.surface_speed / FULL_TIP_SPEED).min(1.5).sqrt();
    Character {
        level: SCRATCH_LEVEL * force * speed * (0.15 + 0.85 * hardness.min(1.0)),
        centre: (0.8 * CENTRE_OF_ONE * load.hardness.sqrt()).max(CENTRE_LEAST),
        ring: 2.5,
        brightness: 0.4 * hardness,
        roughness: 0.2,
        tone: 0.0,
        // Beyond some hundred a second the ridges blur.
        catches: (RIDGES_PER_MM * load.surface_speed).min(400.0),
    }
}
