//! Stick and slip follow Coulomb's law: a weight on a slope starts to slide at one angle and stops below another.

use crate::support::phantom;

use phantom::*;
use typodont_core::device::Reading;
use typodont_core::frame::{Quat, Vec3};
use typodont_core::sim::Simulation;
use typodont_core::touch::{Material, WorkingEnd};

/// kg
const MASS: f32 = 0.05;

/// mm/s²
const GRAVITY: f32 = 9810.0;

/// Damping of a vibration by the hand's grip, N·s/mm; without it the spring of 1 N/mm would oscillate for ever. It
/// always acts across the slope, and along it only while the weight is to rest.
const RINGING: f32 = 0.002;

/// Normal of a slope that is aligned with no axis.
fn outward() -> Vec3 {
    Vec3::new(0.2, 0.15, 1.0).normalize()
}

fn downhill() -> Vec3 {
    let n = outward();
    (Vec3::new(1.0, -0.4, 0.0) - n * Vec3::new(1.0, -0.4, 0.0).dot(n)).normalize()
}

/// A weight held by nothing but the slope.
struct Weight {
    sim: Simulation,
    at: Vec3,
    velocity: Vec3,
    is_gripped: bool,
}

impl Weight {
    fn resting(end: &WorkingEnd, sticking: f32, sliding: f32) -> Weight {
        let slope = volume([160, 80, 60], 0.1, |p| (p.dot(outward()), HARD));
        let mut setup = setup(slope, end.clone(), false);
        let material = Material { static_friction: sticking, dynamic_friction: sliding, ..*setup.materials.get(HARD) };
        setup.materials.set(HARD, material);
        let radius = if let WorkingEnd::Ball { radius } = end { *radius } else { 0.0 };
        let at = outward() * (radius + 0.05) - downhill() * 5.0;
        let mut weight = Weight { sim: Simulation::new(setup), at, velocity: Vec3::ZERO, is_gripped: true };
        for _ in 0..800 {
            weight.turn(0.0);
        }
        weight
    }

    /// One tick on a slope of an angle in degrees: the slope stays, gravity turns.
    fn turn(&mut self, angle: f32) {
        let step = self.sim.step(&Reading::at(self.at));
        let (n, angle) = (outward(), angle.to_radians());
        let weight = (downhill() * angle.sin() - n * angle.cos()) * (MASS * GRAVITY);
        let across = if self.is_gripped { self.velocity } else { n * self.velocity.dot(n) };
        // N/kg are m/s².
        let force = step.force * 1000.0 + weight - across * (RINGING * 1000.0);
        self.velocity += force / MASS * 1e-3;
        self.at += self.velocity * 1e-3;
    }

    /// Tilts from level as slowly as a table would be.
    fn tilt(&mut self, angle: f32) {
        (0..2000).for_each(|tick| self.turn(angle * tick as f32 / 2000.0));
    }

    fn speed(&self) -> f32 {
        self.velocity.dot(downhill())
    }

    fn way(&self) -> f32 {
        self.sim.clone().step(&Reading::at(self.at)).tip.dot(downhill())
    }
}

const ENDS: [WorkingEnd; 2] = [WorkingEnd::Point, WorkingEnd::Ball { radius: 0.7 }];

#[test]
fn a_resting_weight_sticks_up_to_the_angle_of_its_coefficient() {
    // Aim: the slope at which sliding begins is atan(static) ± 1°. Method: tilt at 4°/s from 3° below until the tip has
    // gone 0.1 mm.
    for end in ENDS {
        for (sticking, sliding) in [(0.2f32, 0.2f32), (0.3, 0.1), (0.5, 0.3), (0.8, 0.2), (0.4, 0.4)] {
            let expected = sticking.atan().to_degrees();
            let mut weight = Weight::resting(&end, sticking, sliding);
            weight.tilt(expected - 3.0);
            let start = weight.way();
            let mut angle = expected - 3.0;
            while weight.way() - start < 0.1 && angle < expected + 6.0 {
                angle += 4e-3;
                weight.turn(angle);
            }
            println!("{end:?} {sticking}/{sliding}: {angle:.2}°, expected {expected:.2}°");
            assert!((angle - expected).abs() < 1.0, "{end:?} {sticking}/{sliding}: {angle}°, not {expected}°");
        }
    }
}

#[test]
fn a_sliding_weight_stops_below_the_angle_of_its_coefficient() {
    // Aim: at atan(dynamic) − 1° a sliding weight stops and stays, at + 1° it goes faster and faster. Method: set it
    // sliding at 25 mm/s on a steep slope, then level the slope.
    for end in ENDS {
        for (sticking, sliding) in [(0.2f32, 0.2f32), (0.3, 0.15), (0.5, 0.3), (0.4, 0.4)] {
            let critical = sliding.atan().to_degrees();
            let run = |angle: f32| {
                let mut weight = Weight::resting(&end, sticking, sliding);
                weight.is_gripped = false;
                for _ in 0..4000 {
                    if weight.speed() > 25.0 {
                        break;
                    }
                    weight.turn(sticking.max(sliding).atan().to_degrees() + 3.0);
                }
                assert!(weight.speed() > 25.0, "it slides");
                for _ in 0..100 {
                    weight.turn(angle);
                }
                let early = weight.speed();
                for _ in 0..150 {
                    weight.turn(angle);
                }
                (early, weight.speed())
            };
            let ((_, below), (early, above)) = (run(critical - 1.0), run(critical + 1.0));
            println!("{end:?} {sticking}/{sliding}: below {below:.2} mm/s, above {early:.2} → {above:.2} mm/s");
            assert!(below.abs() < 4.0, "{end:?} {sticking}/{sliding}: still {below} mm/s");
            assert!(above > early && above > 15.0, "{end:?} {sticking}/{sliding}: {early} → {above} mm/s");
        }
    }
}

#[test]
fn a_stuck_tip_stays_stuck() {
    // Aim: below the angle of sticking nothing creeps: less than 0.02 mm in two seconds, while the hand trembles.
    for end in ENDS {
        let mut weight = Weight::resting(&end, 0.5, 0.3);
        weight.tilt(20.0);
        let start = weight.way();
        for tick in 0..2000 {
            weight.at += Quat::from_rotation_z(tick as f32) * Vec3::X * 0.002;
            weight.turn(20.0);
        }
        let crept = (weight.way() - start).abs();
        println!("{end:?}: {crept:.4} mm");
        assert!(crept < 0.02, "{end:?}: {crept} mm");
    }
}
