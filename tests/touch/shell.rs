//! Instruments that are more than a ball: what they push, how they turn the hand, what they take away.

use crate::support::phantom;

use phantom::*;
use std::sync::Arc;
use typodont_core::device::{DeviceSpec, Reading};
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::{Setup, Simulation, Step};
use typodont_core::touch::{Body, EDGE_RADIUS, Profile, Shank, WorkingEnd};
use typodont_core::volume::{Grid, Label, Volume, surface};

/// A straight fissure bur, 1 mm wide and 4 mm long, on a friction grip shank.
fn fissure() -> Body {
    let shank = Shank { neck: 0.8, diameter: 1.6, begins: 7.0, ends: 12.0 };
    Body::revolved(Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2]), Some(shank))
}

/// A device without flaws that renders torque.
fn world(volume: Volume, body: Body, cuts: bool) -> Simulation {
    let setup = setup(volume, WorkingEnd::Body(Arc::new(body)), cuts);
    let device = DeviceSpec { max_torque: 1000.0, ..ideal_device() };
    Simulation::new(Setup { device, ..setup })
}

fn turn(sim: &mut Simulation, position: Vec3, orientation: Quat) -> Step {
    sim.step(&Reading { pose: Pose { position, orientation }, buttons: 0 })
}

/// Blunting of the edge, mm: what voxels of 0.1 mm can hold.
const BLUNT: f32 = 0.2;

/// Signed distance from a block with one edge: all that lies at negative x and negative z.
fn edge(p: Vec3) -> f32 {
    let (x, z) = (p.x + BLUNT, p.z + BLUNT);
    x.max(0.0).hypot(z.max(0.0)) + x.max(z).min(0.0) - BLUNT
}

/// Orientations of the whole scene: no axis of the voxels is special.
fn scenes() -> [Quat; 4] {
    let about = |axis: Vec3, angle: f32| Quat::from_axis_angle(axis.normalize(), angle);
    [
        Quat::IDENTITY,
        about(Vec3::new(1.0, 2.0, 0.5), 0.7),
        about(Vec3::new(-0.3, 1.0, 2.0), 2.1),
        about(Vec3::new(1.0, -1.0, 0.2), 1.3),
    ]
}

/// The turn that takes a handle's shaft to a direction.
fn shaft_along(direction: Vec3) -> Quat {
    Quat::from_rotation_arc(Vec3::Z, direction.normalize())
}

#[test]
fn a_bur_leaning_on_an_edge_turns_the_hand_by_force_times_lever() {
    // Aim: torque about the tip within 5 % of lever × force. Method: the side of a fissure bur crosses the edge of a
    // block at a known distance from its tip, pressed 1 mm against 1 N/mm.
    for spacing in [0.1, 0.05] {
        for scene in scenes() {
            let n = (9.0 / spacing) as u32;
            let block = volume([n; 3], spacing, |p| (edge(scene.conjugate() * p), HARD));
            for (lean, lever) in [(0.5f32, 3.0), (0.9, 1.5), (0.3, 2.5)] {
                let mut sim = world(block.clone(), fissure(), false);
                let shaft = Vec3::new(-lean.cos(), 0.0, lean.sin());
                let out = Vec3::new(lean.sin(), 0.0, lean.cos());
                let orientation = shaft_along(scene * shaft);
                let met = Vec3::new(-BLUNT, 0.0, -BLUNT) + out * BLUNT;
                let touching = met + out * 0.5 - shaft * lever;
                let mut last = None;
                for tick in 0..600 {
                    let press = 1.0 - 2.0 * (tick as f32 / 400.0).min(1.0);
                    last = Some(turn(&mut sim, scene * (touching + out * press), orientation));
                }
                let step = last.unwrap();
                let expected = scene * shaft.cross(out) * lever * step.force.length();
                let off = (step.torque - expected).length() / expected.length();
                println!(
                    "{spacing} {lean} {lever}: force {}, torque {} expected {expected}, off {off:.3}",
                    step.force, step.torque
                );
                assert!((step.force.length() - 1.0).abs() < 0.03, "{}", step.force);
                assert!(step.force.angle_between(scene * out).to_degrees() < 2.5);
                assert!(off < 0.05, "{spacing} mm, lean {lean}: torque {} instead of {expected}", step.torque);
            }
        }
    }
}

#[test]
fn a_bur_resting_on_a_ball_turns_the_hand_with_friction_too() {
    // Aim: torque = r × f, where r is the place at which a cylinder's side meets a ball and f holds friction. Method: the
    // hand drags the bur along its own axis across the top of a ball, with dry friction of 0.3.
    let (radius, lever) = (3.0, 2.5);
    let ball = volume([90; 3], 0.1, |p| (p.length() - radius, HARD));
    let mut setup = setup(ball, WorkingEnd::Body(Arc::new(fissure())), false);
    let mut rough = *setup.materials.get(HARD);
    (rough.static_friction, rough.dynamic_friction) = (0.3, 0.3);
    setup.materials.set(HARD, rough);
    setup.device.max_torque = 1000.0;
    let mut sim = Simulation::new(setup);
    let orientation = shaft_along(Vec3::X);
    let mut last = None;
    for tick in 0..1200 {
        let depth = 1.0 - 2.0 * (tick as f32 / 400.0).min(1.0);
        let drag = 0.002 * (tick as f32 - 500.0).max(0.0);
        last = Some(turn(&mut sim, Vec3::new(-lever + drag, 0.0, radius + 0.5 + depth), orientation));
    }
    let step = last.unwrap();
    // The ball's top, as seen from the tip.
    let met = Vec3::new(0.0, 0.0, radius) - step.tip;
    let expected = met.cross(step.force);
    println!("force {}, torque {} expected {expected}", step.force, step.torque);
    assert!((step.force.x / step.force.z + 0.3).abs() < 0.02, "friction: {}", step.force);
    assert!((step.torque - expected).length() < 0.05 * expected.length(), "{} instead of {expected}", step.torque);
}

/// A tissue without damping. At 100 mm/s the damper alone pushes with half a newton and turns with the tip; what is watched
/// here is where the tip goes.
fn undamped(mut sim: Setup) -> Simulation {
    let mut hard = *sim.materials.get(HARD);
    hard.damping = 0.0;
    sim.materials.set(HARD, hard);
    sim.device.max_torque = 1000.0;
    Simulation::new(sim)
}

/// The greatest change of force from one tick to the next, N.
fn worst_jump(steps: &[Step]) -> f32 {
    steps.windows(2).map(|w| w[1].force.distance(w[0].force)).fold(0.0, f32::max)
}

#[test]
fn a_fissure_bur_swept_across_a_rim_never_jolts() {
    // Aim: no step above 0.08 N from tick to tick while points of the shell come and go over an edge. Method: upright and
    // aslant across the rim of a block at three speeds and two resolutions, half a millimetre deep.
    for spacing in [0.172, 0.05] {
        let n = (9.0 / spacing) as u32;
        let block = volume([n; 3], spacing, |p| (edge(p), HARD));
        for lean in [0.0f32, 0.35, 0.7] {
            for speed in [10.0f32, 30.0, 100.0] {
                let mut sim = undamped(setup(block.clone(), WorkingEnd::Body(Arc::new(fissure())), false));
                let orientation = shaft_along(Vec3::new(lean.sin(), 0.3 * lean.sin(), lean.cos()));
                let ticks = (5.0 / speed * 1000.0) as usize;
                // An end held aslant has its lowest edge below the tip.
                let height = 0.5 * lean.sin() - 0.5;
                let down = (0..500).map(|i| Vec3::new(-2.5, 0.1, height + 1.5 * (1.0 - i as f32 / 499.0)));
                let across = (0..ticks).map(|i| Vec3::new(-2.5 + speed * 1e-3 * i as f32, 0.1, height));
                let off = (0..200).map(|_| Vec3::new(2.5, 0.1, height));
                let steps: Vec<Step> = down.chain(across).chain(off).map(|p| turn(&mut sim, p, orientation)).collect();
                let jump = worst_jump(&steps);
                println!("{spacing} mm, lean {lean}, {speed} mm/s: {jump:.4} N");
                assert!(steps.iter().any(|s| s.force.length() > 0.4));
                assert!(steps[steps.len() - 1].touch.is_none(), "the rim is passed");
                assert!(jump < 0.08, "{spacing} mm, lean {lean}, {speed} mm/s: {jump} N");
            }
        }
    }
}

#[test]
fn a_bur_turned_in_contact_never_jolts() {
    // Aim: as above while the hand tilts and swings the bur at 2 rad/s with its end pressed into a corner.
    for spacing in [0.172, 0.05] {
        let n = (9.0 / spacing) as u32;
        // A step of 1 mm on a plain.
        let block = volume([n; 3], spacing, |p| (p.z.min(edge(p - Vec3::Z)), HARD));
        let mut sim = world(block, fissure(), false);
        let mut steps = Vec::new();
        for tick in 0..6000 {
            let press = 1.2 - 1.6 * (tick as f32 / 600.0).min(1.0);
            let swing = 0.002 * (tick as f32 - 600.0).max(0.0);
            let shaft = Vec3::new(0.7 * swing.sin(), 0.5 * (0.7 * swing).sin(), 1.0);
            steps.push(turn(&mut sim, Vec3::new(0.4, 0.0, press), shaft_along(shaft)));
        }
        let jump = worst_jump(&steps);
        let twist = steps.windows(2).map(|w| w[1].torque.distance(w[0].torque)).fold(0.0, f32::max);
        println!("{spacing} mm: {jump:.4} N, {twist:.3} N·mm");
        assert!(jump < 0.08, "{spacing} mm: {jump} N");
        assert!(steps.iter().filter(|s| s.force.length() > 0.3).count() > 4000);
    }
}

#[test]
fn a_shank_that_touches_does_not_cut() {
    // Aim: the shank pushes and turns the hand, and takes nothing. Method: press it across a ridge of decay with 3 N; then
    // the head with the same, which must cut.
    let ridge = volume([90; 3], 0.1, |p| (Vec3::new(p.x.abs() - 0.4, 0.0, p.z.max(0.0)).x.max(p.z), SOFT));
    let press = |lever: f32| {
        let mut sim = world(ridge.clone(), fissure(), true);
        let orientation = shaft_along(Vec3::X);
        let mut removed = 0;
        let mut force = 0.0f32;
        for tick in 0..1500 {
            let height = 2.0 - 6.0 * (tick as f32 / 1000.0).min(1.0);
            let step = turn(&mut sim, Vec3::new(-lever, 0.0, height), orientation);
            removed += step.removed;
            force = force.max(step.force.length());
            assert!(lever < 4.0 || !step.cutting, "tick {tick}");
        }
        (removed, force)
    };
    let (removed, force) = press(9.0);
    assert_eq!(removed, 0);
    assert!(force > 0.2, "the shank is felt: {force} N");
    assert!(press(2.0).0 > 100);
}

/// Every ISO 6360 shape that the table offers, as one of its sizes.
fn shapes() -> [(&'static str, Profile); 8] {
    [
        ("round", Profile::ball(0.7, 0.0)),
        ("pear", Profile::round_ended(0.4, 0.3, 1.6)),
        ("cylinder", Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2])),
        ("round cylinder", Profile::round_ended(0.5, 0.5, 4.0)),
        ("tapered", Profile::frustum(0.25, 0.45, 4.0, [EDGE_RADIUS; 2])),
        ("round tapered", Profile::round_ended(0.3, 0.5, 4.0)),
        ("inverted cone", Profile::frustum(0.5, 0.38, 0.9, [EDGE_RADIUS; 2])),
        ("flame", Profile::flame(0.6, 5.0, 0.1)),
    ]
}

/// Volume that a shape clears when it moves straight down by a depth from the surface, mm³: at each height the widest
/// part that has passed. Burs have a run-out of 0.01 mm.
fn swept_mm3(profile: &Profile, depth: f32) -> f64 {
    let steps = 4000;
    let mut widest = 0.0f32;
    let mut sum = 0.0;
    for i in 0..steps {
        let z = depth * (i as f32 + 0.5) / steps as f32;
        widest = widest.max(profile.radius_at(z) + 0.01);
        sum += f64::from(core::f32::consts::PI * widest * widest * depth / steps as f32);
    }
    sum
}

/// Plunges a bur into a block of decay; what fell, mm³, and how deep the tip got.
fn plunge(body: Body, spacing: f32, depth: f32, scene: Quat) -> (f64, f32) {
    let n = (8.0 / spacing) as u32;
    let block = volume([n; 3], spacing, |p| ((scene.conjugate() * p).z - 2.0, SOFT));
    let mut sim = world(block, body, true);
    let orientation = shaft_along(scene * Vec3::Z);
    let matter = |sim: &Simulation| surface::extract(sim.volume()).volume_mm3();
    let before = matter(&sim);
    let mut tip = Vec3::ZERO;
    for tick in 0..3000 {
        // Decay yields when the hand is 2.2 mm ahead.
        let ahead = (2.8 + depth) * (tick as f32 / 2500.0).min(1.0);
        let step = turn(&mut sim, scene * Vec3::new(0.013, -0.021, 2.6 - ahead), orientation);
        tip = scene.conjugate() * step.tip;
    }
    // Within the surface, so that the grid's own lattice does not count.
    (before - matter(&sim), 2.0 - tip.z)
}

#[test]
fn every_shape_cuts_its_own_outline() {
    // Aim: what a plunge removes is what the outline sweeps, within 4 %, and two resolutions agree within 2 %.
    for (name, profile) in shapes() {
        let [_, top] = profile.span();
        let mut shares = Vec::new();
        for spacing in [0.086, 0.043] {
            let (removed, depth) =
                plunge(Body::revolved(profile.clone(), None), spacing, 0.8 * top.min(4.0), Quat::IDENTITY);
            let share = removed / swept_mm3(&profile, depth);
            println!("{name} {spacing}: {removed:.3} mm³ to {depth:.3} mm, {share:.4} of the outline");
            assert!((share - 1.0).abs() < 0.04, "{name} at {spacing} mm: {share}");
            shares.push(share);
        }
        assert!((shares[0] / shares[1] - 1.0).abs() < 0.02, "{name}: {shares:?}");
    }
}

#[test]
fn a_bur_cuts_alike_in_every_direction() {
    // Aim: a plunge along no axis of the voxels removes its outline too, within 7 %: 0.02 mm of radius.
    let profile = Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2]);
    for scene in scenes() {
        let (removed, depth) = plunge(Body::revolved(profile.clone(), None), 0.08, 2.0, scene);
        let share = removed / swept_mm3(&profile, depth);
        println!("{scene}: {share:.4}");
        assert!((share - 1.0).abs() < 0.07, "{scene}: {share}");
    }
}

#[test]
fn a_ring_catches_on_a_post() {
    // Aim: a voxelised end may be hollow: the hole lets the post in, and the ring holds on to it. Method: lower a ring over
    // a post, then pull sideways: it stops when the hole's edge meets the post, and pulls back along the way.
    let (bore, thick, post) = (1.5, 0.4, 0.6);
    let torus = |p: Vec3| (Vec3::new(p.x, p.y, 0.0).length() - bore).hypot(p.z) - thick;
    let ring = Volume::from_distance(Grid::centred([84, 84, 24], Vec3::splat(0.05)), 0.075, |p| (torus(p), Label(1)));
    let body = Body::of_volume(&ring);
    println!("{} points", body.surface_points().len());
    let matter = volume([60, 60, 60], 0.1, |p| ((Vec3::new(p.x, p.y, 0.0).length() - post).max(p.z - 1.0), HARD));
    let mut sim = world(matter, body, false);
    for tick in 0..500 {
        let step = turn(&mut sim, Vec3::Z * (2.5 - 2.5 * tick as f32 / 499.0), Quat::IDENTITY);
        assert!(step.touch.is_none(), "tick {tick}: the post fits through");
    }
    let steps: Vec<Step> =
        (0..600).map(|tick| turn(&mut sim, Vec3::X * (1.5 * tick as f32 / 599.0), Quat::IDENTITY)).collect();
    let last = steps[599];
    let play = bore - thick - post;
    println!("tip {}, force {}, jump {}", last.tip, last.force, worst_jump(&steps));
    assert!((last.tip.x - play).abs() < 0.03, "{} instead of {play}", last.tip.x);
    assert!((last.force.x + (1.5 - play)).abs() < 0.05 && last.force.with_x(0.0).length() < 0.05, "{}", last.force);
    assert!(worst_jump(&steps) < 0.08);
}
