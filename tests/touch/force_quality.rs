//! Rendered forces compared with mechanics, on phantoms for which mechanics has an exact solution.

use crate::support::phantom;

use phantom::*;
use typodont_core::device::{DeviceSpec, HandModel, SimulatedHand};
use typodont_core::frame::Vec3;
use typodont_core::sim::Simulation;
use typodont_core::touch::WorkingEnd;

/// A hand circling over a ball at a constant depth and speed, in a plane that no axis lies in.
fn circle_on_ball(radius: f32, depth: f32, speed: f32, seconds: f32) -> impl Iterator<Item = Vec3> {
    let (u, v) = (Vec3::new(1.0, 0.3, 0.2).normalize(), Vec3::new(-0.3, 1.0, 0.4));
    let v = (v - u * v.dot(u)).normalize();
    let around = radius - depth;
    let ticks = (seconds * 1000.0) as usize;
    let approach = (0..400).map(move |i| u * (radius + 1.5 - (depth + 1.5) * i as f32 / 399.0));
    approach.chain((0..ticks).map(move |i| {
        let turn = speed * 1e-3 * i as f32 / around;
        (u * turn.cos() + v * turn.sin()) * around
    }))
}

struct Worst {
    magnitude: f32,
    angle: f32,
    jump: f32,
}

fn slide_on_ball(end: WorkingEnd, spacing: f32, speed: f32) -> Worst {
    let (radius, depth) = (5.0, 1.0);
    let n = (14.0 / spacing) as u32;
    let ball = volume([n, n, n], spacing, |p| (p.length() - radius, HARD));
    let end_radius = if let WorkingEnd::Ball { radius } = end { radius } else { 0.0 };
    let mut sim = Simulation::new(setup(ball, end, false));
    let steps = follow(&mut sim, circle_on_ball(radius + end_radius, depth, speed, 0.6));
    let sliding = &steps[400..];
    let magnitude = sliding.iter().map(|s| (s.force.length() - depth).abs() / depth).collect();
    let angle = sliding.iter().map(|s| s.force.angle_between(s.hand).to_degrees()).collect();
    let jump = steps[1..].iter().zip(&steps).map(|(a, b)| (a.force - b.force).length()).fold(0.0, f32::max);
    Worst { magnitude: percentile(magnitude, 0.95), angle: percentile(angle, 0.95), jump }
}

#[test]
fn sliding_on_a_ball_feels_like_a_ball() {
    // Aim: force within 2 % and 2° of k·depth along the radius (95th percentile), no jump above 0.05 N at 50 mm/s.
    // Method: friction off, 1 N/mm, 1 mm deep, every resolution we ship.
    for end in [WorkingEnd::Point, WorkingEnd::Ball { radius: 0.7 }] {
        for spacing in [0.172, 0.1, 0.05] {
            let worst = slide_on_ball(end.clone(), spacing, 50.0);
            println!("{end:?} {spacing}: {:.4} {:.3}° {:.4} N", worst.magnitude, worst.angle, worst.jump);
            assert!(worst.magnitude < 0.02, "{end:?} {spacing} mm: {} off", worst.magnitude);
            assert!(worst.angle < 2.0, "{end:?} {spacing} mm: {}°", worst.angle);
            assert!(worst.jump < 0.05, "{end:?} {spacing} mm: {} N", worst.jump);
        }
    }
}

/// The share of its speed with which a hand thrown at a wall of the stiffest material comes back: above 1 is energy out
/// of nothing.
fn bounce(speed: f32, phase: f32) -> f32 {
    let device = DeviceSpec::phantom_omni();
    let wall = volume([60, 60, 60], 0.1, |p| (p.z, HARD));
    let model = HandModel {
        mass: device.apparent_mass,
        grip_stiffness: 0.0,
        grip_damping: 0.0,
        encoder_step: device.resolution,
    };
    let mut sim = Simulation::new(typodont_core::sim::Setup { device, ..setup(wall, WorkingEnd::Point, false) });
    let mut hand = SimulatedHand::resting_at(model, Vec3::new(0.0, 0.0, 1.0 + phase));
    hand.set_velocity(Vec3::NEG_Z * speed);
    let mut told = Vec3::ZERO;
    let mut deepest = 0.0f32;
    for _ in 0..10_000 {
        let reading = hand.step(&typodont_core::device::Wrench { force: told, ..Default::default() });
        told = sim.step(&reading).force;
        deepest = deepest.min(hand.position().z);
        if hand.position().z > 1.2 {
            break;
        }
    }
    assert!(deepest < 0.0, "the hand met the wall");
    hand.velocity().length() / speed
}

#[test]
fn a_wall_never_gives_back_more_than_it_took() {
    // Aim: press and release is passive at the stiffest material of a PHANTOM Omni, with a 45 g hand, 0.055 mm encoder
    // steps and a tick of delay. Method: throw the free hand at the wall at many speeds and encoder phases.
    for speed in [2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 35.0, 60.0, 100.0, 200.0] {
        let worst = (0..9).map(|phase| bounce(speed, phase as f32 * 0.055 / 9.0)).fold(0.0, f32::max);
        println!("{speed} mm/s: at most {worst:.2} of the speed back");
        assert!(worst <= 1.0, "{speed} mm/s: {worst} back");
    }
}
