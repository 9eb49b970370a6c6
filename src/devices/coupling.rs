//! Position coupling between two hands on one instrument: a spring that never returns more energy than it received.
//!
//! Takes the position of this hand and the delayed position of the other one. Gives the force on this hand. Both ends
//! run the same law, so either hand may lead. Never reads a clock.
//!
//! With a delay, a spring feeds energy into the hands. After Nuño, Ortega, Barabanov and Basañez (2009, "A globally
//! stable PD controller for bilateral teleoperators", IEEE Trans. Robotics 24(3)) the pair stays passive while the
//! damping of the two ends outweighs stiffness times delay: 4 B₁ B₂ > (T₁ + T₂)² K², so with equal ends K < B / T,
//! where T is the one-way delay. The stiffness used here is at most half of that, for every measured delay.

use typodont_core::frame::Vec3;
use typodont_core::tick::TICK_S;

/// Parameters on which the two ends of a coupling agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingParams {
    /// Maximum stiffness, without delay, N/mm. 0.3 leads a hand firmly and still lets it yield.
    pub stiffness: f32,
    /// Damping of each end, N·s/mm; no more than the limit of the device.
    pub damping: f32,
    /// Maximum force, N. A hand that is led must be able to overcome it.
    pub max_force: f32,
}

impl CouplingParams {
    /// Returns parameters of a firm guiding hand for a device with this damping limit, N·s/mm.
    pub fn for_damping(max_damping: f32) -> CouplingParams {
        CouplingParams { stiffness: 0.3, damping: max_damping.min(0.005), max_force: 1.5 }
    }
}

/// Position of the other hand, with its age.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayedPosition {
    /// World space, mm.
    pub position: Vec3,
    /// Age of the position, s: the transmission delay from the other end.
    pub delay: f32,
}

/// Fraction of the largest stiffness that is passive; the margin covers velocities that are measured late.
const STIFFNESS_MARGIN: f32 = 0.5;

/// Delay of the two ends themselves, s: one tick each way and the lag of [`SPEED_TICKS`].
const LOCAL_DELAY: f32 = 0.004;

/// Ticks over which velocity is measured: a longer interval reduces the noise of coarse encoders.
const SPEED_TICKS: usize = 5;

/// Time over which the coupling fades in, s, so that there is no jolt when somebody takes the lead.
const FADE_TIME: f32 = 0.5;

/// Delay above which the connection counts as lost, s.
const MAX_DELAY: f32 = 0.1;

/// One end of a coupling.
#[derive(Clone, Debug)]
pub struct Coupling {
    params: CouplingParams,
    recent_positions: [Vec3; SPEED_TICKS + 1],
    sample_count: usize,
    /// Fraction of the coupling in effect, 0 to 1.
    fade: f32,
    /// Largest recent delay, s: grows at once and shrinks slowly, so that network jitter cannot feed in energy.
    delay: f32,
}

/// Rate at which a longer delay is forgotten, per tick: half in 0.7 s.
const DELAY_DECAY: f32 = 1e-3;

impl Coupling {
    pub fn new(params: CouplingParams) -> Coupling {
        Coupling { params, recent_positions: [Vec3::ZERO; SPEED_TICKS + 1], sample_count: 0, fade: 0.0, delay: 0.0 }
    }

    /// Returns the force on this hand for one tick, N, world space. `remote` is `None` while the other hand does not
    /// take part.
    pub fn force(&mut self, local: Vec3, remote: Option<DelayedPosition>) -> Vec3 {
        self.recent_positions.rotate_right(1);
        self.recent_positions[0] = local;
        self.sample_count = (self.sample_count + 1).min(SPEED_TICKS + 1);
        let remote = remote
            .filter(|remote| remote.position.is_finite() && remote.delay.is_finite() && remote.delay <= MAX_DELAY);
        let Some(DelayedPosition { position, delay }) = remote.filter(|_| local.is_finite()) else {
            self.fade = 0.0;
            return Vec3::ZERO;
        };
        self.fade = (self.fade + TICK_S as f32 / FADE_TIME).min(1.0);
        self.delay = f32::max(delay.max(0.0), self.delay * (1.0 - DELAY_DECAY));
        let spring = (position - local) * (self.stiffness() * self.fade);
        let damper = self.velocity() * (self.params.damping * self.fade);
        (spring - damper).clamp_length_max(self.params.max_force)
    }

    /// Returns the stiffness in effect, N/mm.
    pub fn stiffness(&self) -> f32 {
        self.params.stiffness.min(STIFFNESS_MARGIN * self.params.damping / (self.delay + LOCAL_DELAY))
    }

    fn velocity(&self) -> Vec3 {
        match self.sample_count {
            0 | 1 => Vec3::ZERO,
            known => {
                (self.recent_positions[0] - self.recent_positions[known - 1]) / ((known - 1) as f32 * TICK_S as f32)
            }
        }
    }

    /// Forgets the motion of the hand: the device jumped, or was disconnected.
    pub fn reset(&mut self) {
        self.sample_count = 0;
        self.fade = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;
    use typodont_core::device::{HandModel, SimulatedHand, Wrench};

    /// Couples two hands with a delay each way. Returns the largest energy that the coupling gave away beyond what it
    /// received (mJ), the energy in the hands at the start and at the end (mJ), and their final distance (mm).
    ///
    /// `assumed_ticks` is the delay that the ends believe in.
    fn coupled(delay_ticks: usize, assumed_ticks: usize, grip: f32) -> (f64, f64, f64, f32) {
        let model = |grip_stiffness: f32| HandModel {
            grip_stiffness,
            grip_damping: if grip_stiffness > 0.0 { 0.008 } else { 0.0 },
            ..HandModel::holding(0.045, 0.0)
        };
        let mut hands =
            [SimulatedHand::resting_at(model(grip), Vec3::ZERO), SimulatedHand::resting_at(model(0.0), Vec3::ZERO)];
        let mut ends = [CouplingParams::for_damping(0.005); 2].map(Coupling::new);
        let mut in_flight: [VecDeque<Vec3>; 2] =
            std::array::from_fn(|_| (0..=delay_ticks).map(|_| Vec3::ZERO).collect());
        let mut forces = [Vec3::ZERO; 2];
        let (mut given, mut worst) = (0.0f64, 0.0f64);
        let mass = f64::from(model(0.0).mass);
        let energy = |hands: &[SimulatedHand; 2]| -> f64 {
            hands.iter().map(|h| 0.5 * mass * f64::from(h.velocity().length_squared()) * 1e-3).sum()
        };
        // The coupling fades in at rest; then the free hand is thrown.
        let mut before = 0.0;
        for tick in 0..8000 {
            if tick == 1000 {
                hands[1].set_velocity(Vec3::new(60.0, 30.0, 0.0));
                before = energy(&hands);
            }
            for i in 0..2 {
                let at = hands[i].position();
                hands[i].step(&Wrench { force: forces[i], ..Wrench::ZERO });
                // Work of the coupling on this hand, N·mm = mJ, in the tick in which the hand felt it.
                given += f64::from(forces[i].dot(hands[i].position() - at));
            }
            worst = worst.max(given);
            for i in 0..2 {
                in_flight[i].push_back(hands[i].position());
            }
            for i in 0..2 {
                let remote = DelayedPosition {
                    position: in_flight[1 - i].pop_front().unwrap(),
                    delay: assumed_ticks as f32 * 1e-3,
                };
                forces[i] = ends[i].force(hands[i].position(), Some(remote));
            }
        }
        (worst, before, energy(&hands), hands[0].position().distance(hands[1].position()))
    }

    #[test]
    fn a_coupling_stays_passive_up_to_twenty_milliseconds() {
        // Aim: for every delay, the coupling never gives the hands more than they gave it, and a thrown hand comes to
        // rest. Method: one hand is held by a grip or not at all, the other is thrown at 67 mm/s; the work on both is
        // summed.
        for grip in [0.0, 0.3, 2.0] {
            for delay in [0, 1, 2, 5, 10, 15, 20] {
                let (worst, before, after, apart) = coupled(delay, delay, grip);
                println!(
                    "grip {grip}, delay {delay}: gave {worst:.4} of {before:.4} mJ, {after:.6} left, {apart:.3} mm"
                );
                assert!(worst < 0.02 * before, "grip {grip}, delay {delay}: gives away {worst} mJ of {before}");
                assert!(after < 0.02 * before, "grip {grip}, delay {delay}: {after} of {before} mJ left");
            }
        }
    }

    #[test]
    fn a_coupling_that_does_not_know_its_delay_feeds_in_energy() {
        // Control of the test above: the same hands and the same delay, with the spring as stiff as without any delay.
        let (worst, before, ..) = coupled(20, 0, 0.0);
        assert!(worst > before, "gave only {worst} of {before} mJ");
    }

    #[test]
    fn a_led_hand_follows() {
        // Aim: the spring leads. Method: the remote hand stays 5 mm away; a free hand moves to it.
        let mut hand =
            SimulatedHand::resting_at(HandModel { grip_stiffness: 0.0, ..HandModel::holding(0.045, 0.0) }, Vec3::ZERO);
        let mut end = Coupling::new(CouplingParams::for_damping(0.005));
        let mut force = Vec3::ZERO;
        for _ in 0..4000 {
            let reading = hand.step(&Wrench { force, ..Wrench::ZERO });
            force = end.force(reading.pose.position, Some(DelayedPosition { position: Vec3::X * 5.0, delay: 0.002 }));
        }
        assert!(hand.position().distance(Vec3::X * 5.0) < 0.05, "{}", hand.position());
    }

    #[test]
    fn a_lost_connection_releases_the_hand_and_fades_in_again() {
        let mut end = Coupling::new(CouplingParams::for_damping(0.005));
        let remote = |delay| Some(DelayedPosition { position: Vec3::X * 3.0, delay });
        for _ in 0..1000 {
            end.force(Vec3::ZERO, remote(0.0));
        }
        assert!(end.force(Vec3::ZERO, remote(0.0)).length() > 0.5);
        for broken in [remote(0.2), remote(f32::NAN), Some(DelayedPosition { position: Vec3::NAN, delay: 0.0 }), None] {
            assert_eq!(end.force(Vec3::ZERO, broken), Vec3::ZERO);
            assert!(end.force(Vec3::ZERO, remote(0.0)).length() < 0.01, "fades in again");
        }
    }
}
