//! A rotating handpiece: the sound of its rotor, its bearings and its air.
//!
//! Takes the load. Gives samples, and the speed of the bur. Never allocates after its creation.

use super::clip::LoopedClip;
use super::load::{DrillLoad, Tool};
use super::signal::{Noise, PhaseAccumulator, Ramp, StateVariableFilter, decay_factor, sample_count};

/// One tone of a handpiece: its frequency per revolution of the bur, and its level.
#[derive(Clone, Copy)]
struct Tone {
    order: f32,
    level: f32,
}

const TONES_MAX: usize = 7;

/// Sound of a kind of handpiece, and its behaviour under load.
struct HandpieceTimbre {
    tones: &'static [Tone],
    /// Noise of bearings and air, relative to a tone of level 1.
    rush: f32,
    /// Force that would stall it, N.
    stall_force: f32,
    /// Minimum speed under load, as a fraction of the free speed.
    min_speed_share: f32,
}

const fn tone(order: f32, level: f32) -> Tone {
    Tone { order, level }
}

/// Tones follow the rotating parts: the rotor (1, with harmonics caused by imbalance of the bur), the cage of its
/// ball bearings (about 0.4 of the rotor), the motor of a 1:5 contra-angle (0.2) and the meshing of its gears. The
/// levels were chosen by ear and by spectrum; half or twice a level still sounds like that handpiece.
///
/// Under load the speed of an air turbine falls linearly with torque until it stalls (J. Dyson, B. Darvell, *Torque,
/// power and efficiency characterization of dental air turbine handpieces*, J. Dent. 27, 1999); an electric motor is
/// governed. Stall force: 3 N on a bur of 1 mm are 1.5 N·mm, where up to 2.3 N·mm were measured (P. Brockhurst, R.
/// Shams, Aust. Dent. J. 39, 1994). 2 to 5 N works for turbines; the values for motors are so high that the speed
/// barely falls.
const AIR_TURBINE: HandpieceTimbre = HandpieceTimbre {
    tones: &[tone(1.0, 1.0), tone(2.0, 0.3), tone(3.0, 0.12), tone(0.4, 0.14), tone(0.8, 0.1)],
    rush: 0.9,
    stall_force: 3.0,
    min_speed_share: 0.3,
};

const ELECTRIC: HandpieceTimbre = HandpieceTimbre {
    tones: &[
        tone(1.0, 0.55),
        tone(2.0, 0.2),
        tone(2.6, 0.3),
        tone(0.2, 0.7),
        tone(0.4, 0.5),
        tone(0.6, 0.3),
        tone(0.08, 0.1),
    ],
    rush: 0.35,
    stall_force: 25.0,
    min_speed_share: 0.85,
};

const LOW_SPEED: HandpieceTimbre = HandpieceTimbre {
    tones: &[tone(1.0, 0.7), tone(2.0, 0.5), tone(3.0, 0.35), tone(4.0, 0.2), tone(6.0, 0.25), tone(13.0, 0.25)],
    rush: 0.4,
    stall_force: 20.0,
    min_speed_share: 0.7,
};

fn timbre(tool: Tool) -> Option<&'static HandpieceTimbre> {
    match tool {
        Tool::AirTurbine => Some(&AIR_TURBINE),
        Tool::Electric => Some(&ELECTRIC),
        Tool::LowSpeed => Some(&LOW_SPEED),
        Tool::Hand => None,
    }
}

/// Level of a handpiece running freely, relative to full scale. Grinding must be louder: 0.05 to 0.15 works.
const LEVEL: f32 = 0.09;

/// Time constants of the speed, s: when the air is switched on, when the bur meets the tooth, and when the air is
/// switched off. Chosen by ear: a turbine is at speed in about 0.3 s and yields at once under the hand. 0.5 to 2
/// times these work.
const RUN_UP: f32 = 0.10;
const GIVE_WAY: f32 = 0.03;
const RUN_DOWN: f32 = 0.12;

/// Fraction of the free speed below which a handpiece is inaudible.
const AUDIBLE_SHARE: f32 = 0.02;

/// Duration of the fade there, s. Short enough for the ear, long enough to avoid a click.
const FADE: f32 = 0.01;

/// Fluctuation caused by a ball bearing, as a fraction of the speed, and its frequency, Hz. 0.001 to 0.005 sounds
/// natural.
const WAVER: f32 = 0.002;
const WAVER_RATE: f32 = 12.0;

/// Generator of the sound of a handpiece.
pub struct HandpieceSound {
    rate: f32,
    noise: Noise,
    /// The tool that sounds; while it runs down, the hand may already hold another one.
    tool: Tool,
    /// Revolutions per second, and their value without load.
    speed: f32,
    free_speed: f32,
    fade: Ramp,
    phases: [PhaseAccumulator; TONES_MAX],
    levels: [f32; TONES_MAX],
    waver: StateVariableFilter,
    rush: StateVariableFilter,
    air: StateVariableFilter,
    recorded: Option<LoopedClip>,
}

impl HandpieceTimbre {
    /// Returns the fraction of the free speed that is left under a load, 0 to 1.
    fn speed_share_under(&self, load: &DrillLoad) -> f32 {
        let force = if load.is_touching { load.force } else { 0.0 };
        (1.0 - force / self.stall_force).max(self.min_speed_share)
    }
}

impl HandpieceSound {
    pub fn new(rate: f32, seed: u64, recorded: Option<LoopedClip>) -> HandpieceSound {
        HandpieceSound {
            rate,
            noise: Noise::new(seed),
            tool: Tool::default(),
            speed: 0.0,
            free_speed: 1.0,
            fade: Ramp::default(),
            phases: Default::default(),
            levels: [0.0; TONES_MAX],
            waver: StateVariableFilter::tuned(WAVER_RATE, 0.7, rate),
            rush: StateVariableFilter::default(),
            air: StateVariableFilter::tuned(7000.0, 0.7, rate),
            recorded,
        }
    }

    /// Returns the speed of the bur, revolutions per second.
    pub fn speed(&self) -> f32 {
        self.speed
    }

    /// Returns the fraction of the free speed, 0 to 1.
    pub fn speed_share(&self) -> f32 {
        (self.speed / self.free_speed).min(1.0)
    }

    /// Follows the load for the next `time` seconds.
    pub fn follow(&mut self, load: &DrillLoad, time: f32) {
        let wanted = timbre(load.tool).filter(|_| load.is_running && load.speed > 0.0);
        let is_silent = self.fade.value == 0.0;
        // A handpiece fades out before another one starts.
        let is_tool_changed = wanted.is_some() && load.tool != self.tool;
        if is_silent && is_tool_changed {
            self.reset();
            self.tool = load.tool;
        }
        let goal = match wanted {
            Some(timbre) if is_silent || !is_tool_changed => {
                self.glide_free_speed(load.speed / 60.0, time) * timbre.speed_share_under(load)
            }
            _ => 0.0,
        };
        let constant = match (load.is_running, goal < self.speed) {
            (false, _) => RUN_DOWN,
            (true, true) => GIVE_WAY,
            (true, false) => RUN_UP,
        };
        self.speed = goal + (self.speed - goal) * decay_factor(time, constant);
        let is_heard = self.speed_share() > AUDIBLE_SHARE && (is_silent || !is_tool_changed);
        if is_heard != (self.fade.goal > 0.0) {
            self.fade.ramp_to(f32::from(is_heard), sample_count(FADE, self.rate));
        }
        if is_silent && goal == 0.0 {
            self.reset();
        }
        self.tune();
    }

    /// Returns the free speed, which glides to a new value; from silence it starts there.
    fn glide_free_speed(&mut self, wanted: f32, time: f32) -> f32 {
        let left = if self.fade.value == 0.0 { 0.0 } else { decay_factor(time, RUN_UP) };
        self.free_speed = wanted + (self.free_speed - wanted) * left;
        self.free_speed
    }

    /// Tunes tones and noise. Tones near the limit of the sample rate fade out before they alias.
    fn tune(&mut self) {
        let Some(&HandpieceTimbre { tones, .. }) = timbre(self.tool) else { return };
        let highest = 0.45 * self.rate;
        for (level, tone) in self.levels.iter_mut().zip(tones) {
            let room = (highest - tone.order * self.speed) / (0.1 * highest);
            *level = tone.level * room.clamp(0.0, 1.0);
        }
        self.rush.tune((1.6 * self.speed).max(400.0), 1.2, self.rate);
    }

    fn reset(&mut self) {
        self.speed = 0.0;
        [&mut self.waver, &mut self.rush, &mut self.air].into_iter().for_each(StateVariableFilter::reset);
    }

    pub fn next_sample(&mut self) -> f32 {
        let fade = self.fade.next_value();
        if fade == 0.0 {
            return 0.0;
        }
        // At half its speed a bur is much less than half as loud: the level follows a power of the speed above one.
        let share = self.speed_share();
        let loudness = LEVEL * fade * share * share.sqrt();
        loudness * self.recorded_sample(share).unwrap_or_else(|| self.synthesised_sample())
    }

    fn recorded_sample(&mut self, share: f32) -> Option<f32> {
        /// Gain of a recording, which has its peaks at full scale, where the tones together reach about twice their
        /// first.
        const PEAK: f32 = 2.0;
        self.recorded.as_mut().map(|recorded| PEAK * recorded.next_sample(share))
    }

    fn synthesised_sample(&mut self) -> f32 {
        let Some(&HandpieceTimbre { tones, rush, .. }) = timbre(self.tool) else { return 0.0 };
        let white = self.noise.white();
        // The narrow filter passes little of the noise; the factor restores it to about 1.
        let waver = 1.0 + WAVER * 40.0 * self.waver.process(white).low;
        let mut sum = 0.0;
        for ((phase, level), tone) in self.phases.iter_mut().zip(self.levels).zip(tones) {
            phase.advance(tone.order * self.speed * waver, self.rate);
            sum += level * phase.sine();
        }
        sum + rush * (self.rush.process(white).band + 0.35 * self.air.process(white).high)
    }
}
