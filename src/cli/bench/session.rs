//! Measurements on whole sessions: time to replay and score five minutes, and peak memory.

use super::percentiles::{Percentiles, time_repeated};
use super::volumes::{SEED, TempPath, exercise, grinding_workpiece};
use super::{DIMS, grow_tooth, name_of};
use crate::cli::run::{RunRequest, SeedSource, SessionDriver, run_session};
use std::collections::BTreeMap;
use std::process::Command;
use std::sync::Arc;
use typodont_core::device::DeviceSpec;
use typodont_core::sim::Simulation;
use typodont_core::volume::Volume;
use typodont_exercise::record::{
    Recorder, Recording, RecordingEndFile, RecordingHeadFile, ReplayCheck, ServoStatsFile,
};
use typodont_exercise::score;
use typodont_exercise::session::{ActionFile, Operator, OperatorFile, Session};
use typodont_formats::Library;
use typodont_formats::diagnostic::headlines;

pub struct FiveMinuteTimings {
    pub replay_s: Percentiles,
    pub score_s: Percentiles,
}

/// Ticks of the measured session.
const FIVE_MINUTES: usize = 300_000;

/// The careful operator at work until the exercise's five minutes are over.
pub fn five_minutes(tooth: Volume) -> Result<FiveMinuteTimings, String> {
    let recording = record_session(tooth)?;
    if recording.len() < FIVE_MINUTES {
        return Err(format!("the measured session ended after {} ticks, not {FIVE_MINUTES}", recording.len()));
    }
    let mut last_replay = None;
    let mut failed = None;
    let replay_s = time_repeated(1.0, || match score::observe(&recording, ReplayCheck::Skip) {
        Ok(watched) => last_replay = Some(watched),
        Err(error) => failed = Some(error),
    });
    if let Some(error) = failed {
        return Err(error);
    }
    let watched = last_replay.ok_or("no session was replayed")?;
    let mut all: Vec<_> = (0..5).map(|_| watched.clone()).collect();
    let times = std::iter::from_fn(|| {
        let watched = all.pop()?;
        let start = std::time::Instant::now();
        std::hint::black_box(score::evaluate(&recording, watched));
        Some(start.elapsed().as_secs_f64())
    });
    Ok(FiveMinuteTimings { replay_s, score_s: Percentiles::of(times.collect()) })
}

/// Runs and records a session in which the operator keeps cutting.
fn record_session(tooth: Volume) -> Result<Recording, String> {
    let (scenario, workpiece) = grinding_workpiece(tooth)?;
    let mut operator = careful_operator()?;
    keep_cutting(&mut operator);
    let spec = DeviceSpec::phantom_omni();
    let head = RecordingHeadFile::of(&scenario, &spec, SEED);
    let file = TempPath::new("mcap");
    let mut recorder = Recorder::create(&file.0, &head, &scenario, &workpiece).map_err(|e| e.to_string())?;
    let mut session = Session::new(scenario.clone(), &workpiece);
    let mut simulation = Simulation::new(typodont_exercise::session::setup(&scenario, &workpiece, spec.clone()));
    let mut trainee = Operator::new(operator, scenario, workpiece, spec, SEED);
    typodont_exercise::session::run(&mut session, &mut simulation, &mut trainee, &mut recorder)
        .map_err(|e| e.to_string())?;
    recorder
        .finish(&RecordingEndFile { reason: "complete".into(), servo: ServoStatsFile::of(&simulation) })
        .map_err(|e| e.to_string())?;
    drop((session, simulation, trainee));
    Recording::read(&file.0).map_err(|e| e.to_string())
}

/// Makes an operator pass over the decay repeatedly, without end: no rule confirms its stage, and each begins again when
/// all is done, however soon the operator's hand is through.
fn keep_cutting(operator: &mut OperatorFile) {
    for rule in &mut operator.rules {
        rule.repeat = true;
        rule.actions.retain(|action| !matches!(action, ActionFile::Confirm));
        for action in &mut rule.actions {
            if let ActionFile::Cut(cut) = action {
                (cut.passes, cut.until_cleared_pct) = (50, 100.0);
            }
        }
    }
}

/// Peak memory of a separate process that runs, records, scores and reports a session of this size, MiB.
pub fn peak_mib(dims: &str) -> Result<f64, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let output = Command::new(program).args(["bench", "--session-peak", dims]).output().map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.trim().parse().map_err(|_| format!("a session of {dims}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Runs, records, scores and reports as `typodont run` does, then prints the peak memory.
pub fn print_peak(dims: &str) -> Result<(), String> {
    let known = DIMS.into_iter().find(|d| name_of(*d) == dims);
    let dims = known.ok_or_else(|| format!("unknown-size: \"{dims}\" is not one of the measured sizes"))?;
    let folder = TempPath::new("session");
    let run = RunRequest {
        scenario: Arc::new(exercise(grow_tooth(dims)?)?),
        driver: SessionDriver::Script(Box::new(careful_operator()?)),
        seed: SeedSource::Given(SEED),
        participant: "",
        out: &folder.0,
        digests: BTreeMap::new(),
    };
    run_session(run).map_err(|failure| failure.message())?;
    println!("{:.1}", peak_of_this_process()?);
    Ok(())
}

fn careful_operator() -> Result<OperatorFile, String> {
    OperatorFile::read(&Library::shipped(), "careful").map_err(|found| headlines(&found))
}

/// Peak resident memory of this process so far, MiB. Available on Linux only.
fn peak_of_this_process() -> Result<f64, String> {
    let status = std::fs::read_to_string("/proc/self/status").map_err(|e| e.to_string())?;
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = peak.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kib.map(|kib| kib / 1024.0).ok_or_else(|| "the system does not report the peak memory of a process".to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_measured_hand_never_finishes_of_itself() {
        // Aim: the measured session lasts as long as the exercise lets it, however good the operator becomes. Method: the
        // rules of the careful operator, which confirms each stage when it is done.
        let confirms = |operator: &OperatorFile| {
            operator.rules.iter().flat_map(|rule| &rule.actions).any(|action| matches!(action, ActionFile::Confirm))
        };
        let mut operator = careful_operator().unwrap();
        assert!(confirms(&operator));
        keep_cutting(&mut operator);
        assert!(!confirms(&operator));
        assert!(operator.rules.iter().all(|rule| rule.repeat));
    }
}
