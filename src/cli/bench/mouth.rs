//! A tick of one tooth beside a tick of the same tooth among all others of the mouth, and how long the mouth takes to open.

use super::percentiles::Percentiles;
use super::ticks::{BUR, CircularPath, fissure_bur, measure_ticks, surface_height};
use super::volumes;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;
use typodont_core::device::DeviceSpec;
use typodont_core::frame::Vec3;
use typodont_core::sim::Setup;
use typodont_core::touch::WorkingEnd;
use typodont_exercise::scenario::{self, ResolveMode, Workpiece};
use typodont_exercise::session;
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};

const MOUTH: (&str, &str) =
    ("scenarios/17-mouth-diagnosis.json", include_str!("../../../scenarios/17-mouth-diagnosis.json"));

/// Times of the 28 teeth of an exercise.
#[derive(Serialize)]
pub struct MouthTimings {
    /// Reading the exercise and making all of its teeth, once, s.
    pub open_s: Percentiles,
    /// Ticks of the treated tooth by itself, by case, µs.
    pub one_tooth_tick_us: BTreeMap<&'static str, Percentiles>,
    /// The same ticks among the other teeth and the mucosa.
    pub mouth_tick_us: BTreeMap<&'static str, Percentiles>,
}

pub fn measure() -> Result<MouthTimings, String> {
    let start = Instant::now();
    let source = SourceText::new(MOUTH.0, MOUTH.1);
    let scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece)
        .map_err(|found| headlines(&found))?;
    let workpiece = Workpiece::make(&scenario, volumes::SEED).map_err(|e| e.to_string())?;
    let mouth = session::setup(&scenario, &workpiece, DeviceSpec::phantom_omni());
    let open_s = Percentiles::of(vec![start.elapsed().as_secs_f64()]);
    let mut one_tooth = mouth.clone();
    one_tooth.scene.colliders.clear();
    let crown = workpiece.teeth[0].crown;
    let middle = crown.centre().with_z(crown.high.z);
    let of = |setup: &Setup| ticks_of(setup, middle);
    let (one_tooth_tick_us, mouth_tick_us) = (of(&one_tooth), of(&mouth));
    Ok(MouthTimings { open_s, one_tooth_tick_us, mouth_tick_us })
}

/// Ticks in the air over the tooth, on its occlusal surface, and near its margins, where its neighbours are in reach.
fn ticks_of(setup: &Setup, middle: Vec3) -> BTreeMap<&'static str, Percentiles> {
    let above = CircularPath { middle: middle + Vec3::Z * 4.0, radius: 4.0, speed: 100.0 };
    let free = measure_ticks(setup, WorkingEnd::Point, false, |t| above.at(t), |step| step.touch.is_none());
    let mut us = BTreeMap::from([("free", free)]);
    let slide = CircularPath { middle, radius: 2.5, speed: 20.0 };
    for (name, end, lift) in
        [("slide", WorkingEnd::Point, -0.3), ("bur_slide", BUR, 0.3), ("shell_slide", fissure_bur(), -0.3)]
    {
        let place = |t: usize| {
            let on = slide.at(t);
            on.with_z(surface_height(&setup.scene.volume, on) + lift)
        };
        us.insert(name, measure_ticks(setup, end, false, place, |step| step.touch.is_some()));
    }
    us
}
