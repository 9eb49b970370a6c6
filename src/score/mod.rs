//! What a session was worth.
//!
//! Takes a recording, and nothing else. Gives measures with their evidence, a verdict on every voxel, and a grade. Never
//! sees a device, a clock or a screen: the same recording gives the same score to the last bit.

mod crop;
mod grade;
mod measures;
mod process;
mod shape;
mod verdict;
mod zones;

pub(crate) use crop::Crop;
pub use grade::{Grade, HardFailResult, ItemResult};
pub use measures::{Evidence, Measure, Measures};
pub use process::{Sample, Trace};
pub use verdict::Verdict;

use crate::record::{self, Recording, Replay, Watch};
use crate::tick::Tick;

/// Version of the formulae. It changes whenever a score of an old recording would change.
pub const SCORER_VERSION: u32 = 1;

/// Everything a recording says when it is scored.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The replay that the score was taken from.
    pub replay: Replay,
    pub measures: Measures,
    /// One per voxel of the workpiece.
    pub verdicts: Vec<Verdict>,
    /// When each voxel fell, one per voxel of the workpiece; `None`: it never fell.
    pub fell_at: Vec<Option<Tick>>,
    /// Force, speed and the like over time, thinned for drawing.
    pub trace: Trace,
    pub grade: Option<Grade>,
}

/// Scores a recording by turning it again. `Err` when its workpiece cannot be made.
pub fn score(recording: &Recording, watch: Watch) -> Result<Scored, String> {
    let mut watcher = process::Watcher::new(recording)?;
    let replay = record::replay(recording, watch, |haptic, step, edits, session| {
        watcher.see(haptic, step, edits, session);
    })?;
    Ok(judge(recording, replay, watcher.conclude()))
}

/// The part of scoring that comes after the last tick.
pub(crate) fn judge(recording: &Recording, replay: Replay, seen: process::Seen) -> Scored {
    let scenario = &recording.scenario;
    let shape = shape::Shape::of(scenario, &replay);
    let verdicts = verdict::of(scenario, &replay, &shape);
    let measures = measures::all(recording, &replay, &seen, &shape);
    let grade = scenario.rubric.as_ref().map(|rubric| grade::of(rubric, &measures));
    let process::Seen { fell_at, trace, .. } = seen;
    Scored { replay, measures, verdicts, fell_at, trace, grade }
}
