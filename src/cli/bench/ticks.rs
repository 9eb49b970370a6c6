//! Time of one tick: in free space, sliding on a surface, and cutting.

use super::percentiles::Percentiles;
use super::volumes::grinding_workpiece;
use typodont_core::device::{DeviceSpec, Reading, UPRIGHT};
use typodont_core::frame::{Pose, Vec3};
use typodont_exercise::catalog::TissueRole;
use typodont_exercise::scenario::Workpiece;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;
use typodont_core::sim::{Setup, Simulation, Step};
use typodont_core::touch::{Body, EDGE_RADIUS, Instrument, Profile, Shank, WorkingEnd};
use typodont_core::volume::{Grid, ISO, Label, Volume};

pub struct TickTimings {
    /// Times by case, µs.
    pub us: BTreeMap<&'static str, Percentiles>,
    /// Volume that one stroke of the bur removes, mm³.
    pub removed_mm3: f64,
}

/// A round bur, ISO 014.
pub const BUR: WorkingEnd = WorkingEnd::Ball { radius: 0.7 };

/// A straight fissure bur, US 57.
pub fn fissure_bur() -> WorkingEnd {
    let profile = Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2]);
    WorkingEnd::Body(Arc::new(Body::revolved(profile, Some(Shank::friction_grip(1.0, 4.0)))))
}

/// Number of ticks of a measured path.
const TICKS: usize = 12_000;

/// Distance that the hand descends while cutting in that time, mm.
const DEPTH: f32 = 7.5;

/// Length of the stroke through the block, mm.
const STROKE: f32 = 12.0;

/// Circular path over the occlusal surface, in tooth space.
pub struct CircularPath {
    /// Centre of the crown; z is its highest point.
    pub middle: Vec3,
    /// mm
    pub radius: f32,
    /// Speed of the hand, mm/s.
    pub speed: f32,
}

impl CircularPath {
    pub fn at(&self, tick: usize) -> Vec3 {
        let angle = tick as f32 * 0.001 * self.speed / self.radius;
        self.middle + self.radius * Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0)
    }
}

pub fn measure(tooth: Volume) -> Result<TickTimings, String> {
    let (scenario, workpiece) = grinding_workpiece(tooth)?;
    let mut setup = typodont_exercise::session::setup(&scenario, &workpiece, DeviceSpec::phantom_omni());
    let middle = crown(&workpiece);
    let mut us = BTreeMap::new();

    let above = CircularPath { middle: middle + Vec3::Z * 4.0, radius: 4.0, speed: 100.0 };
    us.insert("free", measure_ticks(&setup, WorkingEnd::Point, false, |t| above.at(t), |step| step.touch.is_none()));

    let slide = CircularPath { middle, radius: 2.5, speed: 20.0 };
    let surface_heights: Vec<f32> = (0..TICKS).map(|t| surface_height(&setup.scene.volume, slide.at(t))).collect();
    for (name, end, lift) in
        [("slide", WorkingEnd::Point, -0.3), ("bur_slide", BUR, 0.3), ("shell_slide", fissure_bur(), -0.3)]
    {
        let place = |t: usize| slide.at(t).with_z(surface_heights[t] + lift);
        us.insert(name, measure_ticks(&setup, end, false, place, |step| step.touch.is_some()));
    }

    // The whole tooth is made decay, so that the bur advances wherever it is pressed, and stays in contact.
    let decay = scenario.tissues.entries().iter().find(|e| scenario.tissues.role(e.label()) == Some(TissueRole::Decay));
    let decay = decay.ok_or("the table of tissues contains no decay")?.label();
    setup.scene.volume.relabel(|_, _| decay);
    let cut = CircularPath { middle, radius: 2.0, speed: 8.0 };
    // The path starts from the mean height of the surface, which is equal at all resolutions; the highest voxel is not.
    let level = (0..TICKS).map(|t| surface_height(&setup.scene.volume, cut.at(t))).sum::<f32>() / TICKS as f32;
    let place = |t: usize| cut.at(t).with_z(level + 1.5 - t as f32 * (DEPTH / TICKS as f32));
    for (name, end) in [("cut", WorkingEnd::Point), ("bur_cut", BUR), ("shell_cut", fissure_bur())] {
        us.insert(name, measure_ticks(&setup, end, true, place, |step| step.cutting));
    }
    setup.scene.volume = solid_block(*setup.scene.volume.grid(), decay);
    let removed_mm3 = removed_mm3(&setup, |t| Vec3::new(STROKE * (0.5 - t as f32 / TICKS as f32), 0.0, -3.2));
    Ok(TickTimings { us, removed_mm3 })
}

fn crown(workpiece: &Workpiece) -> Vec3 {
    let place = &workpiece.teeth[0];
    place.crown.centre().with_z(place.crown.high.z)
}

/// Height of the first solid voxel straight below a point, tooth space, mm.
pub fn surface_height(volume: &Volume, from: Vec3) -> f32 {
    let steps = (0..1000).map(|i| from - Vec3::Z * (i as f32 * 0.01));
    steps.into_iter().find(|p| volume.density_at(*p) >= ISO).map_or(from.z, |p| p.z)
}

/// A simulation with one instrument; the hand approaches from above.
fn begin_simulation(setup: &Setup, end: WorkingEnd, cuts: bool, first: Vec3) -> Simulation {
    let mut setup = setup.clone();
    setup.instruments = vec![Instrument::new(end, cuts)];
    let world_from_tooth = setup.world_from_tooth;
    let mut simulation = Simulation::new(setup);
    for i in 0..300 {
        let above = first + Vec3::Z * (6.0 - 0.02 * i as f32);
        let pose = Pose { position: world_from_tooth * above, orientation: UPRIGHT };
        simulation.step(&Reading { pose, buttons: 0 });
    }
    simulation
}

/// Measures those ticks of a path to which the case applies.
pub fn measure_ticks(
    setup: &Setup,
    end: WorkingEnd,
    cuts: bool,
    place: impl Fn(usize) -> Vec3,
    counts: impl Fn(&Step) -> bool,
) -> Percentiles {
    let mut simulation = begin_simulation(setup, end, cuts, place(0));
    let mut times = Vec::with_capacity(TICKS);
    for tick in 0..TICKS {
        let position = setup.world_from_tooth * place(tick);
        let reading = Reading { pose: Pose { position, orientation: UPRIGHT }, buttons: 0 };
        let start = Instant::now();
        let step = simulation.step(&reading);
        let elapsed = start.elapsed();
        if counts(&step) {
            times.push(elapsed.as_secs_f64() * 1e6);
        }
    }
    Percentiles::of(times)
}

/// A block of one tissue with its top at z = 0, in as many voxels as a tooth but 22 mm wide. Its shape is the same at
/// every size, while that of a tooth changes as its fissures are sampled more finely.
fn solid_block(like: Grid, label: Label) -> Volume {
    let spacing = 22.0 / like.dims[0] as f32;
    Volume::from_distance(Grid::centred(like.dims, Vec3::splat(spacing)), 1.5 * spacing, |p| (p.z, label))
}

/// Volume that the bur removes on a path, mm³: number of solid voxels that became air, times the volume of a voxel.
fn removed_mm3(setup: &Setup, place: impl Fn(usize) -> Vec3) -> f64 {
    let mut setup = setup.clone();
    setup.scene.colliders.clear();
    setup.world_from_tooth = Pose::IDENTITY;
    let mut simulation = begin_simulation(&setup, BUR, true, place(0));
    let voxel = setup.scene.volume.grid().voxel_mm3();
    let mut removed = 0u64;
    for tick in 0..TICKS {
        let step = simulation.step(&Reading::at(setup.world_from_tooth * place(tick)));
        removed += u64::from(step.removed);
    }
    removed as f64 * voxel
}
