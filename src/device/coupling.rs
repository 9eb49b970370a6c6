//! Two hands on one instrument: a spring between them that never gives more energy than it was given.
//!
//! Takes where this hand is and where the other one was some milliseconds ago. Gives the force on this hand. Both ends run
//! the same law, so either hand may lead. Never reads a clock.
//!
//! With a delay a spring feeds energy into the hands. After Nuño, Ortega, Barabanov and Basañez (2009, "A globally stable PD
//! controller for bilateral teleoperators", IEEE Trans. Robotics 24(3)) the pair stays passive while the damping of the two
//! ends outweighs stiffness times delay: 4 B₁ B₂ > (T₁ + T₂)² K², so with equal ends K < B / T, T being the delay of one way.
//! The stiffness used here is half of that at most, whatever the delay turns out to be.

use crate::frame::Vec3;
use crate::tick::TICK_S;

/// What the two ends of a coupling agree on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// Stiffest spring, without delay, N/mm. 0.3 leads a hand firmly and still lets it yield.
    pub stiffness: f32,
    /// Damping of each end, N·s/mm; no more than the device's own limit.
    pub damping: f32,
    /// N. A hand that is led must be able to win.
    pub max_force: f32,
}

impl Tie {
    /// A firm guiding hand for a device of a damping limit.
    pub fn for_damping(max_damping: f32) -> Tie {
        Tie { stiffness: 0.3, damping: max_damping.min(0.005), max_force: 1.5 }
    }
}

/// Where the other hand is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Far {
    /// World space, mm.
    pub position: Vec3,
    /// Age of that position: how long the way from there takes, s.
    pub delay: f32,
}

/// Share of the stiffness at which the pair would just be passive: the rest is for velocities that are measured late.
const MARGIN: f32 = 0.5;

/// Delay that the ends have by themselves, s: one tick each way and the lag of [`SPEED_TICKS`].
const OWN_DELAY: f32 = 0.004;

/// Ticks over which speed is measured: coarse encoders make fewer noisy.
const SPEED_TICKS: usize = 5;

/// Time over which a tie comes in and goes, s: no jolt when somebody takes the lead.
const EASE: f32 = 0.5;

/// A way that is older than this counts as cut, s.
const CUT_AFTER: f32 = 0.1;

/// One end of a tie.
#[derive(Clone, Debug)]
pub struct Coupling {
    tie: Tie,
    way: [Vec3; SPEED_TICKS + 1],
    known: usize,
    /// 0 to 1: how much of the tie is in effect.
    eased: f32,
    /// The longest delay of late, s: it grows at once and shrinks slowly, so that a jittering network cannot pump.
    delay: f32,
}

/// How fast a longer delay is forgotten, per tick: half in 0.7 s.
const FORGET: f32 = 1e-3;

impl Coupling {
    pub fn new(tie: Tie) -> Coupling {
        Coupling { tie, way: [Vec3::ZERO; SPEED_TICKS + 1], known: 0, eased: 0.0, delay: 0.0 }
    }

    /// The force on this hand for one tick, N, world space. `far` is `None` while the other hand does not take part.
    pub fn force(&mut self, mine: Vec3, far: Option<Far>) -> Vec3 {
        self.way.rotate_right(1);
        self.way[0] = mine;
        self.known = (self.known + 1).min(SPEED_TICKS + 1);
        let far = far.filter(|far| far.position.is_finite() && far.delay.is_finite() && far.delay <= CUT_AFTER);
        let Some(Far { position, delay }) = far.filter(|_| mine.is_finite()) else {
            self.eased = 0.0;
            return Vec3::ZERO;
        };
        self.eased = (self.eased + TICK_S as f32 / EASE).min(1.0);
        self.delay = f32::max(delay.max(0.0), self.delay * (1.0 - FORGET));
        let spring = (position - mine) * (self.stiffness() * self.eased);
        let damper = self.velocity() * (self.tie.damping * self.eased);
        (spring - damper).clamp_length_max(self.tie.max_force)
    }

    /// N/mm now in effect.
    pub fn stiffness(&self) -> f32 {
        self.tie.stiffness.min(MARGIN * self.tie.damping / (self.delay + OWN_DELAY))
    }

    fn velocity(&self) -> Vec3 {
        match self.known {
            0 | 1 => Vec3::ZERO,
            known => (self.way[0] - self.way[known - 1]) / ((known - 1) as f32 * TICK_S as f32),
        }
    }

    /// Forgets the hand's way: the device jumped, or was away.
    pub fn forget(&mut self) {
        self.known = 0;
        self.eased = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Hand, HandModel, Output};
    use std::collections::VecDeque;

    /// Two hands in a tie with a delay each way; returns the energy the tie has given away beyond what it was given (its
    /// worst, mJ), the energy in the hands at the start and at the end, and how far apart they ended.
    ///
    /// `told_ticks` is the delay that the ends believe in.
    fn tied(delay_ticks: usize, told_ticks: usize, grip: f32) -> (f64, f64, f64, f32) {
        let model = |grip_stiffness: f32| HandModel {
            grip_stiffness,
            grip_damping: if grip_stiffness > 0.0 { 0.008 } else { 0.0 },
            ..HandModel::holding(0.045, 0.0)
        };
        let mut hands = [Hand::resting_at(model(grip), Vec3::ZERO), Hand::resting_at(model(0.0), Vec3::ZERO)];
        let mut ends = [Tie::for_damping(0.005); 2].map(Coupling::new);
        let mut ways: [VecDeque<Vec3>; 2] = std::array::from_fn(|_| (0..=delay_ticks).map(|_| Vec3::ZERO).collect());
        let mut told = [Vec3::ZERO; 2];
        let (mut given, mut worst) = (0.0f64, 0.0f64);
        let mass = f64::from(model(0.0).mass);
        let energy = |hands: &[Hand; 2]| -> f64 {
            hands.iter().map(|h| 0.5 * mass * f64::from(h.velocity().length_squared()) * 1e-3).sum()
        };
        // Eased in at rest; then the free hand is thrown.
        let mut before = 0.0;
        for tick in 0..8000 {
            if tick == 1000 {
                hands[1].set_velocity(Vec3::new(60.0, 30.0, 0.0));
                before = energy(&hands);
            }
            for i in 0..2 {
                let at = hands[i].position();
                hands[i].turn(&Output { force: told[i], ..Output::NONE });
                // Work of the tie on this hand, N·mm = mJ, in the tick in which it was felt.
                given += f64::from(told[i].dot(hands[i].position() - at));
            }
            worst = worst.max(given);
            for i in 0..2 {
                ways[i].push_back(hands[i].position());
            }
            for i in 0..2 {
                let far = Far { position: ways[1 - i].pop_front().unwrap(), delay: told_ticks as f32 * 1e-3 };
                told[i] = ends[i].force(hands[i].position(), Some(far));
            }
        }
        (worst, before, energy(&hands), hands[0].position().distance(hands[1].position()))
    }

    #[test]
    fn a_tie_stays_passive_up_to_twenty_milliseconds() {
        // Aim: whatever the delay, the tie never gives the hands more than they gave it, and what was thrown comes to rest.
        // Method: one hand held by a grip or not at all, the other thrown at 67 mm/s; the work on both is summed.
        for grip in [0.0, 0.3, 2.0] {
            for delay in [0, 1, 2, 5, 10, 15, 20] {
                let (worst, before, after, apart) = tied(delay, delay, grip);
                println!(
                    "grip {grip}, delay {delay}: gave {worst:.4} of {before:.4} mJ, {after:.6} left, {apart:.3} mm"
                );
                assert!(worst < 0.02 * before, "grip {grip}, delay {delay}: gives away {worst} mJ of {before}");
                assert!(after < 0.02 * before, "grip {grip}, delay {delay}: {after} of {before} mJ left");
            }
        }
    }

    #[test]
    fn a_tie_that_does_not_know_its_delay_pumps() {
        // The control of the test above: the same hands and the same way, the spring as stiff as without any delay.
        let (worst, before, ..) = tied(20, 0, 0.0);
        assert!(worst > before, "gave only {worst} of {before} mJ");
    }

    #[test]
    fn a_led_hand_follows() {
        // Aim: the spring leads. Method: the far hand stands 5 mm away; a free hand comes to it.
        let mut hand =
            Hand::resting_at(HandModel { grip_stiffness: 0.0, ..HandModel::holding(0.045, 0.0) }, Vec3::ZERO);
        let mut end = Coupling::new(Tie::for_damping(0.005));
        let mut force = Vec3::ZERO;
        for _ in 0..4000 {
            let reading = hand.turn(&Output { force, ..Output::NONE });
            force = end.force(reading.pose.position, Some(Far { position: Vec3::X * 5.0, delay: 0.002 }));
        }
        assert!(hand.position().distance(Vec3::X * 5.0) < 0.05, "{}", hand.position());
    }

    #[test]
    fn a_cut_way_lets_go_and_comes_back_softly() {
        let mut end = Coupling::new(Tie::for_damping(0.005));
        let far = |delay| Some(Far { position: Vec3::X * 3.0, delay });
        for _ in 0..1000 {
            end.force(Vec3::ZERO, far(0.0));
        }
        assert!(end.force(Vec3::ZERO, far(0.0)).length() > 0.5);
        for broken in [far(0.2), far(f32::NAN), Some(Far { position: Vec3::NAN, delay: 0.0 }), None] {
            assert_eq!(end.force(Vec3::ZERO, broken), Vec3::ZERO);
            assert!(end.force(Vec3::ZERO, far(0.0)).length() < 0.01, "eases in again");
        }
    }
}
