//! Known worlds for tests: walls, balls and slabs of one or two tissues, and hands that move through them.

#![allow(dead_code)]

use typodont_core::device::{DeviceSpec, Reading, Wrench};
use typodont_core::frame::{Pose, Vec3};
use typodont_core::sim::{Setup, Simulation, Step};
use typodont_core::touch::{
    CarvingParameters, CollisionScene, CuttingLaw, Instrument, Material, Materials, Vibration, WorkingEnd,
};
use typodont_core::volume::{Grid, Label, Volume};

pub const HARD: Label = Label(1);
pub const SOFT: Label = Label(2);

/// Enamel and decay as the thesis tuned them (Table 2.4), friction left out unless a test brings it.
pub fn materials() -> Materials {
    let hard = Material {
        stiffness: 1.0,
        damping: 1.0,
        static_friction: 0.0,
        dynamic_friction: 0.0,
        cut_force: Some(2.0),
        hardness: Some(300.0),
    };
    let soft = Material { stiffness: 0.09, damping: 0.3, cut_force: Some(0.2), hardness: Some(15.0), ..hard };
    Materials::new().with(HARD, hard).with(SOFT, soft)
}

/// A device without flaws: fine encoders and no limits that matter.
pub fn ideal_device() -> DeviceSpec {
    DeviceSpec {
        name: "ideal".into(),
        max_force: 100.0,
        max_stiffness: 1.0,
        resolution: 0.0,
        ..DeviceSpec::phantom_omni()
    }
}

pub fn volume(dims: [u32; 3], spacing: f32, distance: impl Fn(Vec3) -> (f32, Label)) -> Volume {
    Volume::from_distance(Grid::centred(dims, Vec3::splat(spacing)), 1.5 * spacing, distance)
}

pub fn setup(volume: Volume, end: WorkingEnd, cuts: bool) -> Setup {
    Setup {
        scene: CollisionScene { volume, colliders: Vec::new() },
        materials: materials(),
        material_scales: Vec::new(),
        instruments: vec![Instrument::new(end, cuts)],
        carving: CarvingParameters { dwell: 0.3, dwell_share: 1.0 / 3.0, max_feed: 30.0, law: CuttingLaw::Threshold },
        fillings: Vec::new(),
        vibration: Vibration::NONE,
        guidances: Vec::new(),
        world_from_tooth: Pose::IDENTITY,
        device: ideal_device(),
        ramp: 0,
    }
}

/// Turns the world once per place.
pub fn follow(sim: &mut Simulation, places: impl Iterator<Item = Vec3>) -> Vec<Step> {
    places.map(|p| sim.step(&Reading::at(p))).collect()
}

pub fn output(step: &Step) -> Wrench {
    step.wrench()
}

/// The value below which a share of the values lies.
pub fn percentile(mut values: Vec<f32>, share: f32) -> f32 {
    values.sort_by(f32::total_cmp);
    values[((values.len() - 1) as f32 * share).round() as usize]
}
