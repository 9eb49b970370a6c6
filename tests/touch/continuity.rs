//! No border and no rim is a step in the force.

use crate::support::phantom;

use phantom::*;
use typodont_core::frame::Vec3;
use typodont_core::sim::{Setup, Simulation};
use typodont_core::touch::{CarvingParameters, CuttingLaw, Material, WearRate, WorkingEnd};
use typodont_core::volume::{Label, Volume};

const DENTINE: Label = Label(3);

/// Most that the force may change within one tick, N: half of what is felt as a click.
const STEP: f32 = 0.08;

/// The same at 100 mm/s where friction or an edge holds the tip, N. There the hand itself stretches the spring by 0.1 N a
/// tick (1 N/mm), and as the spring turns, the damper of 5 N·s/m gives as much again: to smooth that away would be a softer
/// wall. Only level ground without friction, where
/// nothing is cut, keeps to the stricter bound at that speed.
const STEP_OF_A_FAST_HAND: f32 = 0.2;

/// Enamel, dentine and decay side by side, level.
fn borders(spacing: f32) -> Volume {
    let dims = [(16.0 / spacing) as u32, (6.0 / spacing) as u32, (6.0 / spacing) as u32];
    volume(dims, spacing, |p| {
        let tissue = match p.x {
            x if x < -2.5 => HARD,
            x if x < 1.5 => DENTINE,
            x if x < 4.0 => SOFT,
            _ => HARD,
        };
        (p.z - 1.0, tissue)
    })
}

/// A cavity with a sharp rim in a level block: walls of 35°, 1.2 mm deep, half dentine and half decay at its bottom.
fn cavity(spacing: f32) -> Volume {
    let dims = [(16.0 / spacing) as u32, (7.0 / spacing) as u32, (7.0 / spacing) as u32];
    volume(dims, spacing, |p| {
        let wall = 35.0f32.to_radians();
        let across = (p.x * p.x + p.y * p.y).sqrt();
        let cone = (2.5 - across) * wall.sin() + (1.0 - p.z) * -wall.cos();
        let hollow = (-cone).max(-0.2 - p.z);
        let tissue = match p.z {
            z if z > 0.4 => HARD,
            _ if p.x > 0.0 => SOFT,
            _ => DENTINE,
        };
        ((p.z - 1.0).max(-hollow), tissue)
    })
}

fn world(volume: Volume, end: WorkingEnd, law: Option<CuttingLaw>, friction: f32) -> Setup {
    let mut world = setup(volume, end, law.is_some());
    world.carving = CarvingParameters { law: law.unwrap_or_default(), max_feed: 10.0, ..world.carving };
    let hard = Material { static_friction: friction, dynamic_friction: friction, ..*world.materials.get(HARD) };
    let dentine = Material { stiffness: 0.7, damping: 0.7, hardness: Some(60.0), ..hard };
    let decay = Material { static_friction: 2.0 * friction, ..*world.materials.get(SOFT) };
    world.materials = world.materials.with(HARD, hard).with(DENTINE, dentine).with(SOFT, decay);
    world
}

/// Comes down beside, goes across at a speed and a depth below the level surface, and back.
fn sweep(radius: f32, depth: f32, speed: f32) -> impl Iterator<Item = Vec3> {
    let (from, to) = (Vec3::new(-6.0, 0.05, 1.0 + radius - depth), Vec3::new(6.0, -0.05, 1.0 + radius - depth));
    let above = Vec3::Z * (depth + 0.3);
    let ticks = (12.0 / speed * 1000.0) as usize;
    let down = (0..600).map(move |i| (from + above).lerp(from, i as f32 / 599.0));
    let across = (0..ticks).map(move |i| from.lerp(to, i as f32 / ticks as f32));
    // A hand turns back within some hundredths of a second.
    let turning = (0..40).map(move |_| to);
    let back = (0..ticks).map(move |i| to.lerp(from, i as f32 / ticks as f32));
    down.chain(across).chain(turning).chain(back)
}

fn check(name: &str, volume: fn(f32) -> Volume, law: Option<CuttingLaw>) {
    let mut failed = Vec::new();
    for end in [WorkingEnd::Point, WorkingEnd::Ball { radius: 0.7 }] {
        let radius = if let WorkingEnd::Ball { radius } = end { radius } else { 0.0 };
        if law.is_some() && radius == 0.0 {
            continue;
        }
        for spacing in [0.2, 0.1] {
            for speed in [10.0, 30.0, 100.0] {
                for friction in [0.0, 0.4] {
                    let mut sim = Simulation::new(world(volume(spacing), end.clone(), law, friction));
                    let steps = follow(&mut sim, sweep(radius, 0.6, speed));
                    let jumps = steps[1..].iter().zip(&steps).map(|(a, b)| (a.force - b.force).length());
                    let (at, worst) = jumps.enumerate().fold((0, 0.0), |w, (i, j)| if j > w.1 { (i, j) } else { w });
                    let most = steps.iter().map(|s| s.force.length()).fold(0.0, f32::max);
                    let place = steps[at].hand;
                    println!(
                        "{name} {end:?} {spacing} mm, {speed} mm/s, μ {friction}: {worst:.4} N at {place:.2}, most {most:.2} N"
                    );
                    let is_level = name == "borders" && friction == 0.0;
                    let most = if speed > 50.0 && !is_level { STEP_OF_A_FAST_HAND } else { STEP };
                    if worst >= most {
                        failed.push(format!("{end:?} {spacing} mm, {speed} mm/s, μ {friction}: {worst} N at {place}"));
                    }
                }
            }
        }
    }
    assert!(failed.is_empty(), "{name}:\n{}", failed.join("\n"));
}

#[test]
fn borders_between_tissues_are_no_steps() {
    check("borders", borders, None);
}

#[test]
fn the_rim_of_a_cavity_is_no_step() {
    check("rim", cavity, None);
}

#[test]
fn cutting_across_borders_is_no_step() {
    check("threshold", borders, Some(CuttingLaw::Threshold));
    check("rate", borders, Some(CuttingLaw::Rate(WearRate { rpm: 100_000.0, grit: 1.0 })));
}

#[test]
fn cutting_over_the_rim_is_no_step() {
    check("thresholds over the rim", cavity, Some(CuttingLaw::Threshold));
    check("rate law over the rim", cavity, Some(CuttingLaw::Rate(WearRate { rpm: 100_000.0, grit: 1.0 })));
}
