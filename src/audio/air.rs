//! What rushes: the suction tube, and the water spray.

use super::clip::Loop;
use super::load::DrillLoad;
use super::signal::{Filter, Noise, Ramp, samples};

/// Of full scale. Suction is heard behind the drill, spray behind suction: half to twice of these works.
const SUCTION_LEVEL: f32 = 0.1;
const SPRAY_LEVEL: f32 = 0.03;

/// A valve opens and closes, s.
const FADE: f32 = 0.06;

/// The tube's own pitch, Hz: a saliva ejector of some 15 cm, open at one end, and what turbulence adds above it.
const TUBE: f32 = 580.0;
const HISS: f32 = 3800.0;

/// How quickly water in the tube gurgles, Hz.
const GURGLE: f32 = 7.0;

pub struct Air {
    rate: f32,
    noise: Noise,
    suction: Ramp,
    spray: Ramp,
    tube: Filter,
    hiss: Filter,
    gurgle: Filter,
    mist: Filter,
    recorded: Option<Loop>,
}

impl Air {
    pub fn new(rate: f32, seed: u64, recorded: Option<Loop>) -> Air {
        Air {
            rate,
            noise: Noise::new(seed),
            suction: Ramp::default(),
            spray: Ramp::default(),
            tube: Filter::tuned(TUBE, 1.5, rate),
            hiss: Filter::tuned(HISS, 0.6, rate),
            gurgle: Filter::tuned(GURGLE, 0.6, rate),
            mist: Filter::tuned(6500.0, 0.6, rate),
            recorded,
        }
    }

    pub fn follow(&mut self, load: &DrillLoad) {
        let fade = samples(FADE, self.rate);
        let suction = if load.is_suction_on { SUCTION_LEVEL } else { 0.0 };
        let spray = if load.is_spray_on && load.is_running { SPRAY_LEVEL } else { 0.0 };
        for (ramp, goal) in [(&mut self.suction, suction), (&mut self.spray, spray)] {
            if goal != ramp.goal {
                ramp.aim(goal, fade);
            }
        }
    }

    pub fn next(&mut self) -> f32 {
        let (suction, spray) = (self.suction.next(), self.spray.next());
        let mut sum = 0.0;
        if suction > 0.0 {
            sum += suction * self.suction_next();
        }
        if spray > 0.0 {
            sum += spray * self.mist.pass(self.noise.white()).high;
        }
        sum
    }

    fn suction_next(&mut self) -> f32 {
        /// A recording has its peaks at full scale, where the noise reaches about thrice that.
        const PEAK: f32 = 3.0;
        if let Some(recorded) = &mut self.recorded {
            return PEAK * recorded.next(1.0);
        }
        let white = self.noise.white();
        let gurgle = (1.0 + 30.0 * self.gurgle.pass(white).low).clamp(0.4, 1.8);
        1.6 * gurgle * self.tube.pass(white).band + self.hiss.pass(white).band
    }
}
