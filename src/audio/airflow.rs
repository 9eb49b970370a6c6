//! Sounds of flowing air and water: the suction tube and the water spray.
//!
//! Takes the load. Gives samples. Never allocates after its creation.

use super::clip::LoopedClip;
use super::load::DrillLoad;
use super::signal::{Noise, Ramp, StateVariableFilter, sample_count};

/// Levels relative to full scale. Suction is quieter than the drill, spray quieter than suction: half to twice these
/// works.
const SUCTION_LEVEL: f32 = 0.1;
const SPRAY_LEVEL: f32 = 0.03;

/// Time in which a valve opens or closes, s.
const FADE: f32 = 0.06;

/// Resonance of the tube, Hz: a saliva ejector of about 15 cm, open at one end; `HISS_HZ`: turbulence above it.
const TUBE_HZ: f32 = 580.0;
const HISS_HZ: f32 = 3800.0;

/// Frequency at which water gurgles in the tube, Hz.
const GURGLE_HZ: f32 = 7.0;

/// Generator of suction and spray.
pub struct AirflowSound {
    rate: f32,
    noise: Noise,
    suction: Ramp,
    spray: Ramp,
    tube: StateVariableFilter,
    hiss: StateVariableFilter,
    gurgle: StateVariableFilter,
    mist: StateVariableFilter,
    recorded: Option<LoopedClip>,
}

impl AirflowSound {
    pub fn new(rate: f32, seed: u64, recorded: Option<LoopedClip>) -> AirflowSound {
        AirflowSound {
            rate,
            noise: Noise::new(seed),
            suction: Ramp::default(),
            spray: Ramp::default(),
            tube: StateVariableFilter::tuned(TUBE_HZ, 1.5, rate),
            hiss: StateVariableFilter::tuned(HISS_HZ, 0.6, rate),
            gurgle: StateVariableFilter::tuned(GURGLE_HZ, 0.6, rate),
            mist: StateVariableFilter::tuned(6500.0, 0.6, rate),
            recorded,
        }
    }

    /// Follows the load from the next sample on.
    pub fn follow(&mut self, load: &DrillLoad) {
        let fade = sample_count(FADE, self.rate);
        let suction = if load.is_suction_on { SUCTION_LEVEL } else { 0.0 };
        let spray = if load.is_spray_on && load.is_running { SPRAY_LEVEL } else { 0.0 };
        for (ramp, goal) in [(&mut self.suction, suction), (&mut self.spray, spray)] {
            if goal != ramp.goal {
                ramp.ramp_to(goal, fade);
            }
        }
    }

    pub fn next_sample(&mut self) -> f32 {
        let (suction, spray) = (self.suction.next_value(), self.spray.next_value());
        let mut sum = 0.0;
        if suction > 0.0 {
            sum += suction * self.suction_sample();
        }
        if spray > 0.0 {
            sum += spray * self.mist.process(self.noise.white()).high;
        }
        sum
    }

    fn suction_sample(&mut self) -> f32 {
        /// Gain of a recording, which has its peaks at full scale, where the noise reaches about three times that.
        const PEAK: f32 = 3.0;
        if let Some(recorded) = &mut self.recorded {
            return PEAK * recorded.next_sample(1.0);
        }
        let white = self.noise.white();
        let gurgle = (1.0 + 30.0 * self.gurgle.process(white).low).clamp(0.4, 1.8);
        1.6 * gurgle * self.tube.process(white).band + self.hiss.process(white).band
    }
}
