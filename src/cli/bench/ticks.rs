//! What one tick costs: in free space, sliding, cutting.

use super::figures::Figures;
use super::work::grinding;
use crate::content::Role;
use crate::device::{Reading, Spec, UPRIGHT};
use crate::frame::{Pose, Vec3};
use crate::scenario::Workpiece;
use crate::session;
use crate::sim::{Setup, Simulation, Step};
use crate::touch::{Body, EDGE, Instrument, Profile, Shank, WorkingEnd};
use crate::volume::{Grid, ISO, Label, Volume};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

pub struct Ticks {
    /// By case, µs.
    pub us: BTreeMap<&'static str, Figures>,
    /// What one stroke of the bur removes.
    pub removed_mm3: f64,
}

/// Radius of the round bur, ISO 014.
const BUR: WorkingEnd = WorkingEnd::Ball { radius: 0.7 };

/// A straight fissure bur, US 57.
fn fissure() -> WorkingEnd {
    let profile = Profile::frustum(0.5, 0.5, 4.0, [EDGE; 2]);
    WorkingEnd::Shaped(Arc::new(Body::turned(profile, Some(Shank::friction_grip(1.0, 4.0)))))
}

/// Ticks of a course.
const TICKS: usize = 12_000;

/// How far the cutting hand sinks in that time, mm.
const DEPTH: f32 = 7.5;

/// Length of the stroke through the block, mm.
const STROKE: f32 = 12.0;

/// Circles over the chewing surface, in tooth space.
struct Course {
    /// Middle of the crown; z is its highest point.
    middle: Vec3,
    /// mm
    radius: f32,
    /// Of the hand, mm/s.
    speed: f32,
}

impl Course {
    fn at(&self, tick: usize) -> Vec3 {
        let turn = tick as f32 * 0.001 * self.speed / self.radius;
        self.middle + self.radius * Vec3::new(libm::cosf(turn), libm::sinf(turn), 0.0)
    }
}

pub fn on(tooth: Volume) -> Result<Ticks, String> {
    let (scenario, workpiece) = grinding(tooth)?;
    let mut setup = session::setup(&scenario, &workpiece, Spec::phantom_omni());
    let middle = crown(&workpiece);
    let mut us = BTreeMap::new();

    let above = Course { middle: middle + Vec3::Z * 4.0, radius: 4.0, speed: 100.0 };
    us.insert("free", times(&setup, WorkingEnd::Point, false, |t| above.at(t), |step| step.touch.is_none()));

    let slide = Course { middle, radius: 2.5, speed: 20.0 };
    let grounds: Vec<f32> = (0..TICKS).map(|t| ground(&setup.matter.volume, slide.at(t))).collect();
    for (name, end, lift) in
        [("slide", WorkingEnd::Point, -0.3), ("bur_slide", BUR, 0.3), ("shell_slide", fissure(), -0.3)]
    {
        let place = |t: usize| slide.at(t).with_z(grounds[t] + lift);
        us.insert(name, times(&setup, end, false, place, |step| step.touch.is_some()));
    }

    // All of it decay, so that the bur gets on wherever it is pressed, and never leaves the matter.
    let decay = scenario.tissues.entries().iter().find(|e| scenario.tissues.role(e.label()) == Some(Role::Decay));
    let decay = decay.ok_or("no tissue of the table is decay")?.label();
    setup.matter.volume.relabel(|_, _| decay);
    let cut = Course { middle, radius: 2.0, speed: 8.0 };
    // From the mean height of the ground, which all resolutions agree on; the highest voxel they do not.
    let level = (0..TICKS).map(|t| ground(&setup.matter.volume, cut.at(t))).sum::<f32>() / TICKS as f32;
    let place = |t: usize| cut.at(t).with_z(level + 1.5 - t as f32 * (DEPTH / TICKS as f32));
    for (name, end) in [("cut", WorkingEnd::Point), ("bur_cut", BUR), ("shell_cut", fissure())] {
        us.insert(name, times(&setup, end, true, place, |step| step.cutting));
    }
    setup.matter.volume = block(*setup.matter.volume.grid(), decay);
    let removed_mm3 = removed_mm3(&setup, |t| Vec3::new(STROKE * (0.5 - t as f32 / TICKS as f32), 0.0, -3.2));
    Ok(Ticks { us, removed_mm3 })
}

fn crown(workpiece: &Workpiece) -> Vec3 {
    let place = &workpiece.teeth[0];
    (0.5 * (place.crown_low + place.crown_high)).with_z(place.crown_high.z)
}

/// Height of the first matter straight below a place, tooth space.
fn ground(volume: &Volume, from: Vec3) -> f32 {
    let steps = (0..1000).map(|i| from - Vec3::Z * (i as f32 * 0.01));
    steps.into_iter().find(|p| volume.density_at(*p) >= ISO).map_or(from.z, |p| p.z)
}

/// A world with one instrument, its hand brought in from above.
fn begin(setup: &Setup, end: WorkingEnd, cuts: bool, first: Vec3) -> Simulation {
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

/// Times of those ticks of a course that do what is to be measured.
fn times(
    setup: &Setup,
    end: WorkingEnd,
    cuts: bool,
    place: impl Fn(usize) -> Vec3,
    counts: impl Fn(&Step) -> bool,
) -> Figures {
    let mut simulation = begin(setup, end, cuts, place(0));
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
    Figures::of(times)
}

/// A block of one tissue with its top at z = 0, in as many voxels as a tooth but 22 mm wide: each size holds the very
/// same matter, which a tooth with its fissures sampled ever finer is not.
fn block(like: Grid, label: Label) -> Volume {
    let spacing = 22.0 / like.dims[0] as f32;
    Volume::from_distance(Grid::centred(like.dims, Vec3::splat(spacing)), 1.5 * spacing, |p| (p.z, label))
}

/// What the bur removes on a course: solid voxels that became air, times their size.
fn removed_mm3(setup: &Setup, place: impl Fn(usize) -> Vec3) -> f64 {
    let mut setup = setup.clone();
    setup.matter.around.clear();
    setup.world_from_tooth = Pose::IDENTITY;
    let mut simulation = begin(&setup, BUR, true, place(0));
    let voxel = setup.matter.volume.grid().voxel_mm3();
    let mut removed = 0u64;
    for tick in 0..TICKS {
        let step = simulation.step(&Reading::at(setup.world_from_tooth * place(tick)));
        removed += u64::from(step.removed);
    }
    removed as f64 * voxel
}
