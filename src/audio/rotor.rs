//! The handpiece that turns: its whine, its bearings, its air.

use super::clip::Loop;
use super::load::{DrillLoad, Tool};
use super::signal::{Filter, Noise, Ramp, Turn, decay, samples};

/// One tone of a handpiece: how often it swings while the bur turns once, and how loud it is.
#[derive(Clone, Copy)]
struct Tone {
    order: f32,
    level: f32,
}

const TONES_MAX: usize = 7;

/// How a handpiece sounds and how it bears a load.
struct Character {
    tones: &'static [Tone],
    /// Of the rushing of bearings and air, beside a tone of level 1.
    rush: f32,
    /// The force that would hold it still, N.
    stall_force: f32,
    /// The share of its speed below which it never falls.
    least_share: f32,
}

const fn tone(order: f32, level: f32) -> Tone {
    Tone { order, level }
}

/// Tones follow what turns: the rotor (1, and its overtones, which an unbalanced bur makes), the cage of its ball bearings (about
/// 0.4 of the rotor), the motor of a 1:5 contra-angle (0.2) and the meshing of its gears. How loud each is was chosen by ear and
/// by its spectrum; half or twice as loud is still that handpiece.
///
/// Under load an air turbine's speed falls linearly with torque until it stalls (J. Dyson, B. Darvell, *Torque, power and
/// efficiency characterization of dental air turbine handpieces*, J. Dent. 27, 1999); an electric motor is governed. The force
/// that stalls it: 3 N on a bur of 1 mm are 1.5 N·mm, where up to 2.3 N·mm were measured (P. Brockhurst, R. Shams, Aust. Dent. J.
/// 39, 1994). 2 to 5 N works for turbines; those of motors are so high that speed barely falls.
const AIR_TURBINE: Character = Character {
    tones: &[tone(1.0, 1.0), tone(2.0, 0.3), tone(3.0, 0.12), tone(0.4, 0.14), tone(0.8, 0.1)],
    rush: 0.9,
    stall_force: 3.0,
    least_share: 0.3,
};

const ELECTRIC: Character = Character {
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
    least_share: 0.85,
};

const LOW_SPEED: Character = Character {
    tones: &[tone(1.0, 0.7), tone(2.0, 0.5), tone(3.0, 0.35), tone(4.0, 0.2), tone(6.0, 0.25), tone(13.0, 0.25)],
    rush: 0.4,
    stall_force: 20.0,
    least_share: 0.7,
};

fn character(tool: Tool) -> Option<&'static Character> {
    match tool {
        Tool::AirTurbine => Some(&AIR_TURBINE),
        Tool::Electric => Some(&ELECTRIC),
        Tool::LowSpeed => Some(&LOW_SPEED),
        Tool::Hand => None,
    }
}

/// Of a handpiece that runs free, of full scale. Grinding is to stand above it: 0.05 to 0.15 works.
const LEVEL: f32 = 0.09;

/// How fast the speed follows, s: air is let in, the bur meets the tooth, the air is shut off. From the ear: a turbine is up in
/// some 0.3 s and gives way at once under the hand. 0.5 to 2 times these work.
const RUN_UP: f32 = 0.10;
const GIVE_WAY: f32 = 0.03;
const RUN_DOWN: f32 = 0.12;

/// Share of its free speed below which a handpiece is not heard any more.
const HEARD_FROM: f32 = 0.02;

/// How long it fades in and out there, s. Short enough for an ear, long enough for no click.
const FADE: f32 = 0.01;

/// How much a ball bearing lets the speed waver, of the speed, and how quickly, Hz. 0.001 to 0.005 is heard as alive.
const WAVER: f32 = 0.002;
const WAVER_RATE: f32 = 12.0;

/// The handpiece as it sounds from sample to sample.
pub struct Rotor {
    rate: f32,
    noise: Noise,
    /// Whose sound it is while it runs down: the hand may already hold another tool.
    tool: Tool,
    /// Turns per second, and what they are when nothing holds the bur.
    speed: f32,
    free: f32,
    fade: Ramp,
    turns: [Turn; TONES_MAX],
    levels: [f32; TONES_MAX],
    waver: Filter,
    rush: Filter,
    air: Filter,
    recorded: Option<Loop>,
}

impl Character {
    /// What a load leaves of the free speed, 0 to 1.
    fn left_by(&self, load: &DrillLoad) -> f32 {
        let force = if load.is_touching { load.force } else { 0.0 };
        (1.0 - force / self.stall_force).max(self.least_share)
    }
}

impl Rotor {
    pub fn new(rate: f32, seed: u64, recorded: Option<Loop>) -> Rotor {
        Rotor {
            rate,
            noise: Noise::new(seed),
            tool: Tool::default(),
            speed: 0.0,
            free: 1.0,
            fade: Ramp::default(),
            turns: Default::default(),
            levels: [0.0; TONES_MAX],
            waver: Filter::tuned(WAVER_RATE, 0.7, rate),
            rush: Filter::default(),
            air: Filter::tuned(7000.0, 0.7, rate),
            recorded,
        }
    }

    /// Turns per second.
    pub fn speed(&self) -> f32 {
        self.speed
    }

    /// What the load leaves of the free speed, 0 to 1.
    pub fn share(&self) -> f32 {
        (self.speed / self.free).min(1.0)
    }

    /// Takes the load for the next `time` seconds.
    pub fn follow(&mut self, load: &DrillLoad, time: f32) {
        let wanted = character(load.tool).filter(|_| load.is_running && load.speed > 0.0);
        let is_silent = self.fade.value == 0.0;
        // One handpiece fades before another is heard.
        let is_exchanged = wanted.is_some() && load.tool != self.tool;
        if is_silent && is_exchanged {
            self.rest();
            self.tool = load.tool;
        }
        let goal = match wanted {
            Some(character) if is_silent || !is_exchanged => {
                self.free_at(load.speed / 60.0, time) * character.left_by(load)
            }
            _ => 0.0,
        };
        let constant = match (load.is_running, goal < self.speed) {
            (false, _) => RUN_DOWN,
            (true, true) => GIVE_WAY,
            (true, false) => RUN_UP,
        };
        self.speed = goal + (self.speed - goal) * decay(time, constant);
        let is_heard = self.share() > HEARD_FROM && (is_silent || !is_exchanged);
        if is_heard != (self.fade.goal > 0.0) {
            self.fade.aim(f32::from(is_heard), samples(FADE, self.rate));
        }
        if is_silent && goal == 0.0 {
            self.rest();
        }
        self.tune();
    }

    /// The free speed glides when another is asked for; from silence it is there at once.
    fn free_at(&mut self, wanted: f32, time: f32) -> f32 {
        let left = if self.fade.value == 0.0 { 0.0 } else { decay(time, RUN_UP) };
        self.free = wanted + (self.free - wanted) * left;
        self.free
    }

    /// Tones that the rate cannot carry fade out before they fold back.
    fn tune(&mut self) {
        let Some(&Character { tones, .. }) = character(self.tool) else { return };
        let highest = 0.45 * self.rate;
        for (level, tone) in self.levels.iter_mut().zip(tones) {
            let room = (highest - tone.order * self.speed) / (0.1 * highest);
            *level = tone.level * room.clamp(0.0, 1.0);
        }
        self.rush.tune((1.6 * self.speed).max(400.0), 1.2, self.rate);
    }

    fn rest(&mut self) {
        self.speed = 0.0;
        [&mut self.waver, &mut self.rush, &mut self.air].into_iter().for_each(Filter::rest);
    }

    pub fn next(&mut self) -> f32 {
        let fade = self.fade.next();
        if fade == 0.0 {
            return 0.0;
        }
        // A bur that turns half as fast is much less than half as loud: what moves the air is its speed's square.
        let share = self.share();
        let loudness = LEVEL * fade * share * share.sqrt();
        loudness * self.recorded_next(share).unwrap_or_else(|| self.synthesised_next())
    }

    fn recorded_next(&mut self, share: f32) -> Option<f32> {
        /// A recording has its peaks at full scale, where the tones together reach about twice their first.
        const PEAK: f32 = 2.0;
        self.recorded.as_mut().map(|recorded| PEAK * recorded.next(share))
    }

    fn synthesised_next(&mut self) -> f32 {
        let Some(&Character { tones, rush, .. }) = character(self.tool) else { return 0.0 };
        let white = self.noise.white();
        // The narrow filter leaves little of the noise; this brings it back to about 1.
        let waver = 1.0 + WAVER * 40.0 * self.waver.pass(white).low;
        let mut sum = 0.0;
        for ((turn, level), tone) in self.turns.iter_mut().zip(self.levels).zip(tones) {
            turn.advance(tone.order * self.speed * waver, self.rate);
            sum += level * turn.sine();
        }
        sum + rush * (self.rush.pass(white).band + 0.35 * self.air.pass(white).high)
    }
}
