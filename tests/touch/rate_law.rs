//! The rate law takes what the bur's work pays for: by force and speed, against hardness, whatever the voxels' size.

use crate::support::phantom;

use phantom::*;
use typodont_core::device::Reading;
use typodont_core::frame::Vec3;
use typodont_core::sim::{Setup, Simulation};
use typodont_core::touch::{CarvingParameters, CuttingLaw, Material, WearRate, WorkingEnd};
use typodont_core::volume::Volume;

/// Conditions under which a bur is pressed into a block.
#[derive(Clone, Copy)]
struct Press {
    spacing: f32,
    force: f32,
    rpm: f32,
    hardness: f32,
    grit: f32,
}

const USUAL: Press = Press { spacing: 0.1, force: 0.5, rpm: 100_000.0, hardness: 300.0, grit: 1.0 };

impl Press {
    fn world(&self) -> Setup {
        let dims = [(4.0 / self.spacing) as u32, (4.0 / self.spacing) as u32, (6.0 / self.spacing) as u32];
        let block = volume(dims, self.spacing, |p| (p.z - 1.0, HARD));
        let mut world = setup(block, WorkingEnd::Ball { radius: 0.7 }, true);
        let law = CuttingLaw::Rate(WearRate { rpm: self.rpm, grit: self.grit });
        world.carving = CarvingParameters { max_feed: 10.0, law, ..world.carving };
        let hard = *world.materials.get(HARD);
        world.materials.set(HARD, Material { hardness: Some(self.hardness), ..hard });
        world
    }

    /// mm³ taken in two seconds of steady force, and the greatest step of the force after the bur has come down.
    fn cut(&self) -> (f64, f32) {
        let mut sim = Simulation::new(self.world());
        // The bur stands while it is brought down, so that all start alike.
        sim.apply(&typodont_core::sim::Command::RunBur { running: false });
        for tick in 0..400 {
            sim.step(&Reading::at(Vec3::Z * (2.2 - (0.5 + self.force) * tick as f32 / 399.0)));
        }
        sim.apply(&typodont_core::sim::Command::RunBur { running: true });
        let before = solid_mm3(sim.volume());
        let mut tip = sim.step(&Reading::at(Vec3::Z * (1.7 - self.force))).tip;
        let (mut last, mut jump) = (None, 0.0f32);
        for _ in 0..2000 {
            let step = sim.step(&Reading::at(tip - Vec3::Z * self.force));
            tip = step.tip;
            jump = last.map_or(jump, |l: Vec3| jump.max(l.distance(step.force)));
            last = Some(step.force);
        }
        (before - solid_mm3(sim.volume()), jump)
    }

    /// Removal by the law with k = 0.06, mm³.
    fn expected(&self) -> f64 {
        let surface_speed = std::f64::consts::TAU * 0.7 * f64::from(self.rpm) / 60.0;
        0.06 * f64::from(self.grit) * f64::from(self.force) * surface_speed / (f64::from(self.hardness) * 9.80665) * 2.0
    }
}

fn solid_mm3(volume: &Volume) -> f64 {
    volume.densities().iter().map(|d| f64::from(d.unit())).sum::<f64>() * volume.grid().voxel_mm3()
}

#[test]
fn what_falls_is_what_the_law_says() {
    // Aim: within 4 % of k·F·v/H for half and double of each: so it is proportional to force, speed and grit, and inverse
    // to hardness. Method: a steady force for two seconds into a block.
    let presses = [
        USUAL,
        Press { force: 0.25, ..USUAL },
        Press { force: 1.0, ..USUAL },
        Press { rpm: 50_000.0, ..USUAL },
        Press { rpm: 200_000.0, ..USUAL },
        Press { hardness: 150.0, ..USUAL },
        Press { hardness: 600.0, ..USUAL },
        Press { grit: 0.5, ..USUAL },
    ];
    for press in presses {
        let Press { force, rpm, hardness, grit, .. } = press;
        let ((mm3, jump), expected) = (press.cut(), press.expected());
        println!("{force} N, {rpm}/min, {hardness} HV, grit {grit}: {mm3:.4} mm³, law {expected:.4}, jump {jump:.4} N");
        assert!((mm3 / expected - 1.0).abs() < 0.04, "{force} N, {rpm}/min, {hardness} HV: {mm3}, law {expected}");
        assert!(jump < 0.08, "{jump} N");
    }
}

#[test]
fn the_voxels_size_does_not_matter() {
    // Aim: within 2 % between 0.172, 0.1 and 0.05 mm, for a quick and a slow cut.
    for hardness in [150.0, 900.0] {
        let mm3 = [0.172, 0.1, 0.05].map(|spacing| Press { spacing, hardness, ..USUAL }.cut().0);
        println!("{hardness} HV: {mm3:.4?} mm³");
        let (least, most) = mm3.iter().fold((f64::MAX, 0.0f64), |(a, b), &m| (a.min(m), b.max(m)));
        assert!(least > 0.01 && most / least < 1.02, "{mm3:?}");
    }
}

#[test]
fn nothing_falls_without_speed_force_or_a_hardness() {
    let nothing = |name: &str, setup: Setup, depth: f32| {
        let mut sim = Simulation::new(setup);
        for tick in 0..1500 {
            let hand = Vec3::Z * (2.2 - (0.5 + depth) * (tick as f32 / 499.0).min(1.0));
            sim.step(&Reading::at(hand));
            assert!(sim.edits().is_empty(), "{name}, tick {tick}");
        }
    };
    nothing("a bur that stands still", Press { rpm: 0.0, ..USUAL }.world(), 1.0);
    nothing("a bur that does not touch", USUAL.world(), -0.05);
    let mut untouchable = USUAL.world();
    let hard = *untouchable.materials.get(HARD);
    untouchable.materials.set(HARD, Material { hardness: None, ..hard });
    nothing("a tissue without hardness", untouchable, 1.0);
}

#[test]
fn a_bur_never_goes_faster_than_its_feed() {
    // Aim: the softest tissue does not swallow the bur: at most max_feed and what tolerances add.
    let mut world = Press { hardness: 0.5, force: 2.0, ..USUAL }.world();
    world.carving.max_feed = 4.0;
    let mut sim = Simulation::new(world);
    let mut last = None;
    for tick in 0..1000 {
        let step = sim.step(&Reading::at(Vec3::Z * (2.2 - tick as f32 * 0.01).max(-1.0)));
        if tick > 200 {
            let sunk = last.map_or(0.0, |l: f32| l - step.tip.z);
            assert!(sunk < 0.04, "tick {tick}: {sunk} mm in one tick");
        }
        last = Some(step.tip.z);
    }
    let sunk = 1.7 - last.unwrap();
    println!("{sunk} mm in 1 s at 4 mm/s");
    assert!(sunk > 1.5 && sunk < 4.2, "{sunk} mm");
}
