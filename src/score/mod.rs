//! What a session was worth.
//!
//! Takes a recording, and nothing else. Gives measures with their evidence, a verdict on every voxel, and a grade. Never
//! sees a device, a clock or a screen: the same recording gives the same score to the last bit.

mod bits;
mod charting;
mod crop;
mod falls;
mod grade;
mod lapses;
mod measures;
mod process;
mod restoration;
mod shape;
mod verdict;
mod zones;

pub use charting::{Reading, SiteResult};
pub(crate) use crop::Crop;
pub use falls::{Fall, Falls};
pub use grade::{Grade, HardFailResult, ItemResult};
pub use lapses::{Lapse, Mistake, Way, lapses};
pub use measures::{Evidence, Measure, Measures};
pub use process::{Sample, Trace};
pub use restoration::Restoration;
pub use verdict::Verdict;

use crate::record::{self, Recording, Replay, Watch};

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
    pub falls: Falls,
    /// Force, speed and the like over time, thinned for drawing.
    pub trace: Trace,
    pub grade: Option<Grade>,
    /// The filling of a prepared cavity, where the exercise begins with one.
    pub restoration: Option<Restoration>,
    /// The periodontal chart against the truth, where a stage asks for one.
    pub chart: Option<Vec<SiteResult>>,
    /// Ticks in which another person's hand led the trainee's, by stage of the scenario.
    pub led_ticks: Vec<u64>,
}

/// A session turned again and watched, before it is judged.
#[derive(Clone, Debug)]
pub struct Watched {
    replay: Replay,
    seen: process::Seen,
}

/// Scores a recording by turning it again. `Err` when its workpiece cannot be made.
pub fn score(recording: &Recording, watch: Watch) -> Result<Scored, String> {
    Ok(judge(recording, self::watch(recording, watch)?))
}

/// The first half of scoring: turns a recording again and sees every tick.
pub fn watch(recording: &Recording, watch: Watch) -> Result<Watched, String> {
    let workpiece = recording.workpiece()?;
    let mut watcher = process::Watcher::new(recording, &workpiece);
    let replay = record::replay(recording, workpiece, watch, |haptic, step, edits, session| {
        watcher.see(haptic, step, edits, session);
    });
    Ok(Watched { replay, seen: watcher.conclude() })
}

/// The second half: what comes after the last tick.
pub fn judge(recording: &Recording, watched: Watched) -> Scored {
    let Watched { replay, seen } = watched;
    let scenario = &recording.scenario;
    let shape = shape::Shape::of(scenario, &replay);
    let filled = scenario.has_filling().then(|| Restoration::of(&replay.workpiece, &replay.volume));
    let restoration = filled.flatten();
    let verdicts = verdict::of(scenario, &replay, &shape, restoration.as_ref());
    let chart = charting::chart(recording, &replay);
    let measures = measures::all(recording, &replay, &seen, &shape, restoration.as_ref(), chart.as_deref());
    let is_finished = recording.end.is_some() && !replay.outcome.aborted;
    let grade = scenario.rubric.as_ref().map(|rubric| grade::of(rubric, &measures, is_finished));
    let process::Seen { falls, trace, led_ticks, .. } = seen;
    Scored { replay, measures, verdicts, falls, trace, grade, restoration, chart, led_ticks }
}
