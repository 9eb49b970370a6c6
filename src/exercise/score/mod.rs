//! The score of a session.
//!
//! Takes a recording, and nothing else. Gives measures with their evidence, a verdict on every voxel, and a grade.
//! Never uses a device, a clock or a screen: the same recording gives the same score to the last bit.

mod voxel_set;
mod charting;
mod contact_motion;
mod contact_spell;
mod voxel_removals;
mod grade;
mod idle;
mod limit_monitor;
mod line_of_sight;
mod error_episodes;
mod measures;
mod nearest_offset;
mod process;
mod restoration;
mod trials;
mod removal_comparison;
mod verdict;
mod zones;

pub use charting::{ProbingReading, SiteResult};
pub use contact_spell::ContactSpell;
pub use error_episodes::{EpisodeKind, ErrorEpisode, error_episodes};
pub use grade::{Grade, HardFailResult, ItemFactor, ItemResult};
pub use idle::{idle_grade, score_trainee};
pub use limit_monitor::{EXCEEDANCE_GAP_TICKS, Exceedance, LimitMonitor};
pub use measures::{Evidence, Measure, Measures};
pub use nearest_offset::AnatomicalDirection;
pub use process::{Trace, TraceSample, UnseenCut, UnseenVoxel};
pub use restoration::Restoration;
pub use trials::TrialSummary;
pub use verdict::Verdict;
pub use voxel_removals::{VoxelRemoval, VoxelRemovals};
pub use voxel_set::VoxelSet;
pub use zones::{DecayInZone, ZoneVoxels, decay_in_zones, decay_on_vulnerable_mm3};

use crate::record;
use crate::record::{Recording, Replay, ReplayCheck};

/// Version of the formulae. It changes whenever the score of an old recording would change.
pub const SCORER_VERSION: u32 = 2;

/// Complete result of scoring a recording.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The replay from which the score was computed.
    pub replay: Replay,
    pub measures: Measures,
    /// Verdicts, one per voxel of the workpiece.
    pub verdicts: Vec<Verdict>,
    pub removals: VoxelRemovals,
    /// Voxels of each zone of the scenario.
    pub zones: Vec<ZoneVoxels>,
    /// Spells in which the force on a tissue exceeded the value that still earns all points.
    pub hard_presses: Vec<ContactSpell>,
    /// Spells in which a running bur touched soft tissue or an adjacent tooth.
    pub forbidden_contacts: Vec<ContactSpell>,
    /// Force, speed and progress over time, sampled for charts.
    pub trace: Trace,
    pub grade: Option<Grade>,
    /// Comparison of the filling with the original contour; `None` without a prepared cavity.
    pub restoration: Option<Restoration>,
    /// Comparison of the periodontal chart with the true values; `None` if no stage asks for a chart.
    pub chart: Option<Vec<SiteResult>>,
    /// Number of ticks in which another person guided the trainee's hand, by stage of the scenario.
    pub led_ticks: Vec<u64>,
    /// Removals out of the trainee's sight; `None` if the recording has no view.
    pub unseen: Option<UnseenCut>,
}

/// A replayed session with its process statistics, before it is scored.
#[derive(Clone, Debug)]
pub struct ObservedReplay {
    replay: Replay,
    process: process::ProcessStats,
}

/// Scores a recording by replaying it.
///
/// # Errors
/// Returns a message if the recording's workpiece cannot be made.
pub fn score(recording: &Recording, check: ReplayCheck) -> Result<Scored, String> {
    Ok(evaluate(recording, self::observe(recording, check)?))
}

/// Replays a recording and collects the process statistics of every tick: the first half of scoring.
///
/// # Errors
/// Returns a message if the recording's workpiece cannot be made.
pub fn observe(recording: &Recording, watch: ReplayCheck) -> Result<ObservedReplay, String> {
    let workpiece = recording.workpiece()?;
    let mut observer = process::ProcessObserver::new(recording, &workpiece);
    let replay = record::replay(recording, workpiece, watch, |haptic, step, edits, session| {
        observer.observe(haptic, step, edits, session);
    });
    Ok(ObservedReplay { replay, process: observer.finish() })
}

/// Computes the score after the replay: the second half of scoring.
pub fn evaluate(recording: &Recording, observed: ObservedReplay) -> Scored {
    let ObservedReplay { replay, process: seen } = observed;
    let scenario = &recording.scenario;
    let comparison = removal_comparison::RemovalComparison::of(scenario, &replay);
    let filled = scenario.has_filling().then(|| Restoration::of(&replay.workpiece, &replay.volume));
    let restoration = filled.flatten();
    let verdicts = verdict::of(scenario, &replay, &comparison, restoration.as_ref());
    let chart = charting::chart(recording, &replay);
    let measures = measures::all(recording, &replay, &seen, &comparison, restoration.as_ref(), chart.as_deref());
    let is_finished = recording.end.is_some() && !replay.outcome.aborted;
    let grade = scenario.rubric.as_ref().map(|rubric| grade::of(rubric, &measures, is_finished));
    let process::ProcessStats { removals, trace, led_ticks, hard_presses, forbidden_contacts, unseen, .. } = seen;
    Scored {
        replay,
        measures,
        verdicts,
        removals,
        zones: comparison.zones,
        hard_presses,
        forbidden_contacts,
        trace,
        grade,
        restoration,
        chart,
        led_ticks,
        unseen,
    }
}
